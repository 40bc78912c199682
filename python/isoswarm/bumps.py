"""Sums of bumps: any number of centres and radii in arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from isoswarm._arrays import as_floats
from isoswarm.field import Field, node

__all__ = ["blobby_cylinders", "blobs", "gaussians", "metaballs"]


def blobs(centers: npt.ArrayLike, radii: npt.ArrayLike, bias: float = 0.5) -> Field:
    """Blobby spheres (WH94): F = bias - Σ exp(-‖p - cᵢ‖² / rᵢ²).

    Parameters
    ----------
    centers : array_like, (k, 3)
        Centres cᵢ.
    radii : array_like, (k,), or float
        Radii rᵢ > 0; a single blob has its surface at r √(ln 1/bias).
    bias : float
        What the sum must exceed to be inside.

    Returns
    -------
    Field
        With 4k + 1 parameters: bias, then x, y, z, r of each.

    """
    return _balls("blobs", centers, radii, bias)


def metaballs(centers: npt.ArrayLike, radii: npt.ArrayLike, bias: float = 0.25) -> Field:
    """Bumps with compact support: F = bias - Σ max(0, 1 - ‖p - cᵢ‖² / rᵢ²)³.

    Parameters
    ----------
    centers : array_like, (k, 3)
        Centres cᵢ.
    radii : array_like, (k,), or float
        Radii rᵢ > 0, beyond which a bump is exactly 0.
    bias : float
        What the sum must exceed to be inside.

    Returns
    -------
    Field
        With 4k + 1 parameters: bias, then x, y, z, r of each.

    """
    return _balls("metaballs", centers, radii, bias)


def gaussians(centers: npt.ArrayLike, radii: npt.ArrayLike, iso: float = 1.0, sharpness: float = 2.0) -> Field:
    """Gaussian atoms: F = iso - Σ exp(-sharpness (‖p - cᵢ‖² / rᵢ² - 1)).

    Parameters
    ----------
    centers : array_like, (k, 3)
        Centres cᵢ.
    radii : array_like, (k,), or float
        Radii rᵢ > 0: where an atom alone has its surface, at iso = 1.
    iso : float
        What the sum must exceed to be inside.
    sharpness : float
        The larger, the closer to the union of the balls.

    Returns
    -------
    Field
        With 4k + 2 parameters: iso, sharpness, then x, y, z, r of each.

    """
    return _balls("gaussians", centers, radii, iso, sharpness)


def blobby_cylinders(starts: npt.ArrayLike, ends: npt.ArrayLike, radii: npt.ArrayLike, bias: float = 0.5) -> Field:
    """Blobby cylinders (WH94): F = bias - Σ exp(-dist(p, segment aᵢbᵢ)² / rᵢ²).

    Parameters
    ----------
    starts, ends : array_like, (k, 3)
        Ends aᵢ and bᵢ of the segments.
    radii : array_like, (k,), or float
        Radii rᵢ > 0.
    bias : float
        What the sum must exceed to be inside.

    Returns
    -------
    Field
        With 7k + 1 parameters: bias, then both ends and the radius of each.

    """
    a = as_floats("starts", starts, (None, 3), "k")
    b = as_floats("ends", ends, (len(a), 3))
    return node("blobby_cylinders", bias, *np.column_stack([a, b, _radii(radii, len(a))]).ravel().tolist())


def _balls(kind: str, centers: npt.ArrayLike, radii: npt.ArrayLike, *first: float) -> Field:
    c = as_floats("centers", centers, (None, 3), "k")
    return node(kind, *first, *np.column_stack([c, _radii(radii, len(c))]).ravel().tolist())


def _radii(radii: npt.ArrayLike, k: int) -> npt.NDArray[np.float64]:
    if np.ndim(radii) == 0:
        return np.full(k, as_floats("radii", radii, ()))
    return as_floats("radii", radii, (k,))
