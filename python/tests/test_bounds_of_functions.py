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
