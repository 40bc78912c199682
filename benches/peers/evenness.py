"""How even points are, measured alike for everybody and without isoswarm's own code."""

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

CANDIDATES = 24


def evenness(
    points: np.ndarray,
    area: float,
    normals: np.ndarray | None = None,
    inner: np.ndarray | None = None,
) -> dict[str, float]:
    """Distances to the nearest neighbour, relative to the hexagonal packing of as many points on the same area.

    points (n, 3); area of the part that the inner points cover; inner (n,) bool leaves points out of the statistics
    (but not out of the neighbours). rho_min, rho_avg: minimum and mean distance over the packing's; cv: standard
    deviation over mean. With normals (n, 3): neighbours whose normals are more than a right angle apart (the opposite
    face of a thin sheet) do not count, and six: the part of the points with six neighbours in the Delaunay
    triangulation of their neighbourhood, projected onto the tangent plane.
    """
    inner = np.ones(len(points), dtype=bool) if inner is None else inner
    packed = np.sqrt(2 * area / (np.sqrt(3) * inner.sum()))
    distance, index = cKDTree(points).query(points[inner], k=CANDIDATES if normals is not None else 2)
    result = {}
    if normals is not None:
        same = np.einsum("ij,ikj->ik", normals[inner], normals[index]) > 0
        result["six"] = _six_valent(points, normals[inner], index, same)
        distance = np.where(same, distance, np.inf)
    nearest = distance[:, 1:].min(axis=1)
    return {
        "n": int(inner.sum()),
        "rho_min": float(nearest.min() / packed),
        "rho_avg": float(nearest.mean() / packed),
        "cv": float(nearest.std() / nearest.mean()),
        **result,
    }


def _six_valent(points: np.ndarray, normals: np.ndarray, index: np.ndarray, same: np.ndarray) -> float:
    six = 0
    for normal, near, keep in zip(normals, index, same, strict=True):
        offset = points[near[keep]] - points[near[0]]
        across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        across /= np.linalg.norm(across)
        plane = np.stack([offset @ across, offset @ np.cross(normal, across)], axis=1)
        try:
            start, neighbours = Delaunay(plane).vertex_neighbor_vertices
        except QhullError:
            continue
        six += len(neighbours[start[0] : start[1]]) == 6
    return six / len(normals)
