"""Edges and corners of surfaces."""

import numpy as np
import pytest

import isoswarm as iso


def test_a_box_has_twelve_edges() -> None:
    samples = iso.sample(iso.box(1, 2, 3), n=3000, creases=True)
    found = samples.creases
    assert found is not None
    assert (len(found.edges), len(found.corners)) == (12, 8)
    assert sorted(round(e.length, 9) for e in found.edges) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4
    k = len(found.points)
    np.testing.assert_array_equal(samples.points[:k], found.points)
    assert (np.abs(np.abs(found.points[found.corners]) - [0.5, 1.0, 1.5]) < 1e-12).all()
    # The areas of samples beside edges do not reach over them.
    assert samples.areas.sum() == pytest.approx(22.0, rel=2e-3)


def test_a_mesh_keeps_them() -> None:
    part = iso.box(2, 2, 2) - iso.cylinder(r=0.5, h=3)
    surface = iso.mesh(part, n=4000)
    assert surface.report.closed
    assert surface.report.genus == (1,)
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    # The polygons of the two circles are a little smaller than these, the prism between them too.
    assert volume == pytest.approx(8 - np.pi * 0.25 * 2, rel=2e-3)
    samples = iso.sample(part, n=4000, creases=True)
    assert samples.to_mesh().report.closed


def test_smooth_surfaces_have_none() -> None:
    assert iso.sample(iso.sphere(), n=200, creases=True).creases is None
    assert iso.sample(iso.sphere(), n=200).creases is None
