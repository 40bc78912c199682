"""Evenness of points whose evenness is known."""

import numpy as np
import pytest

import isoswarm as iso


def hexagonal(k: int) -> np.ndarray:
    """k rows of k points at distance 1."""
    i, j = np.mgrid[:k, :k]
    return np.column_stack([(i + 0.5 * (j % 2)).ravel(), (j * np.sqrt(3) / 2).ravel(), np.zeros(k * k)])


def test_samples_and_their_arrays_are_the_same(sphere: iso.Samples) -> None:
    by_samples = iso.metrics.evenness(sphere)
    by_arrays = iso.metrics.evenness(sphere.points, sphere.normals)
    assert by_samples == by_arrays
    even = sphere.report.evenness
    for name in ("rho_min", "rho_avg", "cv", "six_valent", "coverage"):
        assert getattr(by_samples, name) == pytest.approx(getattr(even, name), rel=1e-6)
        assert getattr(iso.metrics, name)(sphere) == getattr(by_samples, name)


def test_rho_on_a_sphere_is_that_of_the_definition(sphere: iso.Samples) -> None:
    d = np.linalg.norm(sphere.points[:, None] - sphere.points[None], axis=2)
    np.fill_diagonal(d, np.inf)
    nearest = d.min(axis=1)
    hexagon = np.sqrt(2 * 4 * np.pi / (np.sqrt(3) * len(sphere)))
    assert iso.metrics.rho_avg(sphere) == pytest.approx(nearest.mean() / hexagon, rel=0.01)
    assert iso.metrics.rho_min(sphere) == pytest.approx(nearest.min() / hexagon, rel=0.01)
    assert iso.metrics.cv(sphere) == pytest.approx(nearest.std() / nearest.mean(), rel=0.01)


def test_a_hexagonal_grid_is_perfect() -> None:
    points = hexagonal(40)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    inner = iso.metrics.evenness(points, normals, bounds=((0.0, 0.0, -1.0), (39.5, 39 * np.sqrt(3) / 2, 1.0)))
    assert inner.rho_min == pytest.approx(1, abs=0.03)
    assert inner.cv == pytest.approx(0, abs=1e-9)
    assert inner.coverage == pytest.approx(1 / np.sqrt(3), abs=0.03)


def test_random_points_are_as_theory_says() -> None:
    samples = iso.sample(iso.sphere(), n=20_000, method="random")
    even = iso.metrics.evenness(samples)
    assert even.rho_avg == pytest.approx(0.465, abs=0.01)
    assert even.cv == pytest.approx(0.523, abs=0.015)
    assert even.six_valent == pytest.approx(0.295, abs=0.03)


def test_normals_are_asked_for() -> None:
    with pytest.raises(ValueError, match="normals: needed"):
        iso.metrics.rho_avg(np.zeros((4, 3)))
