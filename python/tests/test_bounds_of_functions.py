"""Boxes of black boxes, through the operators around them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso


def test_a_function_in_the_plane_keeps_its_bounds() -> None:
    circle = iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 1, bounds=1.5, axes=2)
    assert circle.bounds is not None
    np.testing.assert_allclose(np.asarray(circle.bounds)[:, :2], [[-1.5, -1.5], [1.5, 1.5]])
    assert len(iso.sample(circle, n=40)) == 40


def test_the_complement_of_a_function_has_its_bounds() -> None:
    ball = iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 1, bounds=1.5)
    np.testing.assert_allclose(np.asarray((~ball).bounds), np.asarray(ball.bounds))


def test_wrong_names_are_wrong_values() -> None:
    with pytest.raises(ValueError, match="radius"):
        iso.sphere(r=1).with_parameters({"radius": 2.0})


def test_an_empty_mmcif_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "nothing.cif"
    path.write_text("")
    with pytest.raises(ValueError, match="nothing.cif"):
        iso.molecule(path)


def ball_in_a_box(asked: list[np.ndarray]):
    """A ball that the box from -1 to 1 cuts, NaN outside of the box; keeps what it is asked."""

    def value(X: np.ndarray) -> np.ndarray:
        asked.append(X.copy())
        return np.where(np.abs(X).max(axis=1) <= 1, np.linalg.norm(X, axis=1) - 1.2, np.nan)

    return value


def test_a_function_is_not_asked_beyond_its_bounds() -> None:
    asked: list[np.ndarray] = []
    samples = iso.sample(iso.from_function(ball_in_a_box(asked), bounds=1.0), n=400)
    assert samples.report.converged, samples.report
    assert samples.report.on_bounds > 20
    assert np.abs(np.concatenate(asked)).max() <= 1.0
    # One-sided differences are as good as others, for what they are needed for.
    inner = ~np.isclose(np.abs(samples.points).max(axis=1), 1.0)
    np.testing.assert_allclose(samples.curvatures[inner], 1 / 1.2, rtol=1e-3)


def test_a_function_without_slope_is_asked_at_numbers_only() -> None:
    asked: list[np.ndarray] = []

    def step(X: np.ndarray) -> np.ndarray:
        asked.append(X.copy())
        return np.where(np.abs(X).max(axis=1) < 1, -1.0, 1.0)

    samples = iso.sample(iso.from_function(step, bounds=2.0), n=200)
    assert not samples.report.converged
    assert np.isfinite(np.concatenate(asked)).all()
