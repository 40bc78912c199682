"""How points of a moving surface move with it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_floats, as_points
from isoswarm._requests import as_number
from isoswarm.field import Field

__all__ = ["surface_velocity"]


def surface_velocity(
    field: Field, X: npt.ArrayLike, rates: Mapping[str, float], *, spin: npt.ArrayLike = (0.0, 0.0, 0.0)
) -> Floats:
    """Velocities of points on a moving surface that keep their normals, as if they were painted on it.

    That F = 0 stays true fixes the part of a velocity across the surface only. This is the one along it that follows
    what moves: translations and uniform scalings exactly, rotations with their `spin` (J. Stam and R. Schmidt, "On
    the velocity of an implicit surface", 2011). For identity through time, and motion blur.

    Parameters
    ----------
    field : Field
        One equation of x, y and z.
    X : array_like, (n, 3)
        Points on the surface.
    rates : mapping of str to float
        How fast parameters change, by their paths; the others rest.
    spin : array_like, (3,)
        The angular velocity with which normals turn.

    Returns
    -------
    ndarray, (n, 3)
        In directions in which the surface is flat, where normals do not tell points apart, without a part along it.

    Raises
    ------
    UnknownParameterError
        There is no such parameter.
    ValueError
        A parameter is frozen, or the field is no surface in space.

    Examples
    --------
    >>> import isoswarm as iso
    >>> ball = iso.parse("(x - a)^2 + y^2 + z^2 - 1", a=0)
    >>> iso.surface_velocity(ball, [[0, 0, 1], [1, 0, 0]], {"a": 2}).round(6).tolist()
    [[2.0, 0.0, 0.0], [2.0, 0.0, 0.0]]

    """
    points = as_points(X, 3, "X")
    changes = [(path, as_number(rate, path)) for path, rate in rates.items()]
    return _core.surface_velocity(field._model, points, changes, tuple(as_floats("spin", spin, (3,)).tolist()))
