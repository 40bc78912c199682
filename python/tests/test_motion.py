"""Velocities of moving surfaces."""

import numpy as np
import pytest

import isoswarm as iso


def test_a_ball_slides_grows_and_turns() -> None:
    ball = iso.parse("(x - a)^2 + (y - b)^2 + z^2 - r^2", a=1.5, b=0, r=0.7)
    middle = np.array([1.5, 0, 0])
    out = np.array([[1.0, 0, 0], [0, 0.6, 0.8], [0, 0, -1]])
    points = middle + 0.7 * out
    np.testing.assert_allclose(iso.surface_velocity(ball, points, {"a": 2}), np.tile([2.0, 0, 0], (3, 1)), atol=1e-8)
    np.testing.assert_allclose(iso.surface_velocity(ball, points, {"r": 0.3}), 0.3 * out, atol=1e-8)
    spin = np.array([0, 0, 0.9])
    turned = iso.surface_velocity(ball, points, {"b": 0.9 * 1.5}, spin=spin)
    np.testing.assert_allclose(turned, np.cross(spin, points), atol=1e-8)


def test_other_parameters_are_refused() -> None:
    ball = iso.parse("x^2 + y^2 + z^2 - r", r=1)
    with pytest.raises(iso.UnknownParameterError):
        iso.surface_velocity(ball, [[1, 0, 0]], {"s": 1})
    with pytest.raises(ValueError, match="frozen"):
        iso.surface_velocity(ball.freeze("r"), [[1, 0, 0]], {"r": 1})


def test_floaters_of_a_scene_follow() -> None:
    scene = iso.Scene("(x - 0)^2 + y^2 + z^2 - 1", n=100, follow=True)
    assert scene.settings["follow"] is True
