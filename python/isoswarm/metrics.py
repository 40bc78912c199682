"""Measures of evenness, as the literature defines them: see docs/theory/metrics.md.

Each takes points on a surface with their normals, or :class:`~isoswarm.Samples`. All are dimensionless.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds, as_floats
from isoswarm.meshing import Mesh, TriangleQuality
from isoswarm.samples import Evenness, Samples

__all__ = ["coverage", "cv", "evenness", "rho_avg", "rho_min", "six_valent", "triangle_quality", "triangles"]

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


def triangle_quality(points: Mesh | npt.ArrayLike, faces: npt.ArrayLike | None = None) -> TriangleQuality:
    """How good the triangles of a mesh are: Q, ratio of the radii, angles, valences.

    Parameters
    ----------
    points : Mesh or array_like, (n, 3)
        A mesh, or the vertices of one from any mesher.
    faces : array_like of int, (f, 3)
        Vertex numbers of the triangles, where the points are an array.

    """
    return TriangleQuality(**_core.triangle_quality(*_mesh(points, faces))[1])


def triangles(points: Mesh | npt.ArrayLike, faces: npt.ArrayLike | None = None) -> dict[str, Floats]:
    """``q``, ``radius_ratio``, ``smallest_angle`` and ``largest_angle`` (degrees) of each triangle, (f,) each."""
    return _core.triangle_quality(*_mesh(points, faces))[0]


def _mesh(points: Mesh | npt.ArrayLike, faces: npt.ArrayLike | None) -> tuple[Floats, npt.NDArray[np.int64]]:
    if isinstance(points, Mesh):
        return points.points, points.faces
    if faces is None:
        raise ValueError("faces: needed where points is an array and not a Mesh")
    F = np.ascontiguousarray(faces, dtype=np.int64)
    if F.ndim != 2 or F.shape[1] != 3:
        raise ValueError(f"faces: expected shape (f, 3), given {F.shape}")
    return as_floats("points", points, (None, 3)), F
