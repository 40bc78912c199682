"""Every regular surface of models/surfaces.json: components and area."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

SURFACES = {
    s["name"]: s
    for s in json.loads((Path(__file__).parents[2] / "models" / "surfaces.json").read_text(encoding="utf-8"))
}
REGULAR = [name for name, s in SURFACES.items() if "singular" not in s["tags"]]


def test_most_are_regular() -> None:
    assert len(SURFACES) == 40
    assert len(REGULAR) == 26


@pytest.mark.parametrize("name", REGULAR)
def test_components_and_area(name: str) -> None:
    surface = SURFACES[name]
    field = iso.parse(surface["expr"])
    samples = iso.sample(field, n=20_000, bounds=surface["bbox"])
    report = samples.report
    assert report.components == surface["components"]
    assert len(samples) == 20_000
    # Cells are measured in tangent planes: second order in spacing times curvature, first order at a crease.
    allowed = {"sharp-edges": 0.04, "high-curvature-rim": 0.02}
    rel = max([0.01, *(allowed[tag] for tag in surface["tags"] if tag in allowed)])
    assert report.area == pytest.approx(surface["area"], rel=rel)
    lo, hi = np.array(surface["bbox"])
    assert (samples.points >= lo).all()
    assert (samples.points <= hi).all()
    F, Fx = field.value_gradient(samples.points)
    slope = np.linalg.norm(Fx, axis=1)
    regular = slope > 0
    assert np.max(np.abs(F[regular]) / slope[regular]) < 1e-9 * np.linalg.norm(hi - lo)


@pytest.mark.parametrize("name", sorted(set(SURFACES) - set(REGULAR)))
def test_singular_surfaces_do_not_break(name: str) -> None:
    surface = SURFACES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", iso.SamplingWarning)
        samples = iso.sample(iso.parse(surface["expr"]), n=2000, bounds=surface["bbox"])
    assert len(samples) == 2000
    assert np.isfinite(samples.points).all()
    assert np.isfinite(samples.normals).all()
    assert np.isfinite(samples.areas).all()
    lengths = np.linalg.norm(samples.normals, axis=1)
    assert (np.isclose(lengths, 1) | (lengths == 0)).all()
