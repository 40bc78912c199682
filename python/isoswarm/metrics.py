"""Measures of evenness, as the literature defines them: see docs/theory/metrics.md.

Each takes points on a surface with their normals, or :class:`~isoswarm.Samples`. All are dimensionless.
"""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import as_bounds, as_floats
from isoswarm.samples import Evenness, Samples

__all__ = ["coverage", "cv", "evenness", "rho_avg", "rho_min", "six_valent"]

Points = Samples | npt.ArrayLike


def evenness(points: Points, normals: npt.ArrayLike | None = None, *, bounds: Any = None, axes: int = 3) -> Evenness:
    """All measures at once.

    Parameters
    ----------
    points : Samples or array_like, (n, 3)
        Points on a surface, from any sampler.
    normals : array_like, (n, 3)
        Unit normals, where the points are an array.
    bounds : pair of corners or float, optional
        The box that clips the surface: points on its faces are left out.
    axes : {3, 2}
        2 for points on a curve in the plane.

    Examples
    --------
    >>> import isoswarm as iso
    >>> samples = iso.sample(iso.sphere(), n=1000)
    >>> iso.metrics.evenness(samples).rho_avg > 0.9
    True

    """
    if isinstance(points, Samples):
        return evenness(points.points, points.normals, bounds=bounds, axes=points.field.axes)
    if normals is None:
        raise ValueError("normals: needed where points is an array and not Samples")
    X = as_floats("points", points, (None, 3))
    N = as_floats("normals", normals, (len(X), 3))
    box = None if bounds is None else tuple(tuple(corner.tolist()) for corner in as_bounds(bounds, axes))
    return Evenness(**_core.measure(X, N, box, axes))


def rho_min(points: Points, normals: npt.ArrayLike | None = None) -> float:
    """Smallest distance between nearest neighbours over the hexagonal packing's; 1 is perfect."""
    return evenness(points, normals).rho_min


def rho_avg(points: Points, normals: npt.ArrayLike | None = None) -> float:
    """Mean distance between nearest neighbours over the hexagonal packing's; 1 is perfect."""
    return evenness(points, normals).rho_avg


def cv(points: Points, normals: npt.ArrayLike | None = None) -> float:
    """Coefficient of variation of the distance between nearest neighbours; 0 is perfect."""
    return evenness(points, normals).cv


def six_valent(points: Points, normals: npt.ArrayLike | None = None) -> float:
    """Part of the points with exactly six neighbours in their Delaunay star; 1 is perfect."""
    return evenness(points, normals).six_valent


def coverage(points: Points, normals: npt.ArrayLike | None = None) -> float:
    """Radius of the largest empty disc over the hexagonal packing's distance; .577 is perfect."""
    return evenness(points, normals).coverage
