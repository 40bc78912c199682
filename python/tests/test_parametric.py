"""Parametric surfaces."""

from math import pi
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

TAU = 2 * pi


def test_a_sphere_is_sampled_and_meshed(tmp_path: Path) -> None:
    ball = iso.parametric(
        "r*cos(u)*sin(v)", "r*sin(u)*sin(v)", "-r*cos(v)", u=(0, TAU), v=(0, pi), periodic=(True, False), r=2
    )
    np.testing.assert_allclose(ball.point([[0, pi / 2]]), [[2, 0, 0]], atol=1e-15)
    samples = ball.sample(n=800)
    assert len(samples) == 800
    assert samples.poles == ((False, False), (True, True))
    assert samples.area == pytest.approx(16 * pi, rel=1e-4)
    assert samples.evenness.rho_avg > 0.9
    np.testing.assert_allclose(np.linalg.norm(samples.points, axis=1), 2)
    mesh = ball.mesh(spacing=0.3)
    assert (mesh.euler, mesh.boundaries) == (2, 0)
    mesh.save(tmp_path / "ball.ply")
    assert (tmp_path / "ball.ply").stat().st_size > 1000
    with pytest.raises(ValueError, match="no triangles"):
        samples.save(tmp_path / "points.ply")


def test_a_moebius_strip() -> None:
    r = "(1 + 0.4*v*cos(u/2))"
    strip = iso.parametric(
        f"{r}*cos(u)", f"{r}*sin(u)", "0.4*v*sin(u/2)", u=(0, TAU), v=(-1, 1), periodic=("twisted", False)
    )
    mesh = strip.mesh(n=500)
    assert (mesh.euler, mesh.boundaries) == (0, 1)


def test_wrong_input_is_refused() -> None:
    plane = {"u": (0.0, 1.0), "v": (0.0, 1.0)}
    with pytest.raises(ValueError, match="uses x"):
        iso.parametric("x", "v", "0", **plane)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="lo < hi"):
        iso.parametric("u", "v", "0", u=(1, 0), v=(0, 1))
    with pytest.raises(ValueError, match="periodic"):
        iso.parametric("u", "v", "0", **plane, periodic=(True, 3))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="same curve"):
        iso.parametric("u", "v", "u*v", **plane, periodic=(True, False)).sample(n=10)  # type: ignore[arg-type]
