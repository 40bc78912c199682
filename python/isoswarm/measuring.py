"""Measures of a surface: area, volume, moments, curvature integrals, and integrals of functions of the user's."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds, as_count, as_seed
from isoswarm.callbacks import checked
from isoswarm.errors import SamplingWarning
from isoswarm.field import Field
from isoswarm.samples import Samples

__all__ = ["Estimate", "Measures", "Moments", "measure"]

Integrand = Callable[[Floats, Floats], npt.ArrayLike]
"""Takes points (n, 3) on the surface and outward unit normals (n, 3); returns (n,)."""


@dataclass(frozen=True)
class Estimate:
    """A number and how far it may be off.

    Attributes
    ----------
    value, error : float
        ``abs(value - truth) <= error`` is meant to hold: the error is twice the difference between Gauss rules of
        degree 6 and 8, and what places without a smooth surface may add. It is an estimate, not a proof.

    """

    value: float
    error: float

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        if self.error == 0 or not math.isfinite(self.error):
            return f"{self.value:.15g} ± {self.error:.1g}"
        digits = max(0, min(15, 1 - math.floor(math.log10(self.error))))
        return f"{self.value:.{digits}f} ± {self.error:.1g}"


@dataclass(frozen=True)
class Moments:
    """Centre and inertia of a body of density 1.

    Attributes
    ----------
    centroid, centroid_error : ndarray, (3,)
        In model units.
    inertia, inertia_error : ndarray, (3, 3)
        About the centroid, ∫ (r·r I - r rᵀ).

    """

    centroid: Floats
    centroid_error: Floats
    inertia: Floats
    inertia_error: Floats


@dataclass(frozen=True)
class Measures:
    """What :func:`measure` gives.

    Attributes
    ----------
    area : Estimate
        Area of the surface.
    volume : Estimate or None
        Volume where F < 0; None for a surface that bounds none: `notes` says why, `places` where.
    solid : Moments or None
        Centroid and inertia of the solid F < 0.
    shell : Moments
        Centroid and inertia of the surface itself, as a thin shell.
    mean_curvature, gaussian_curvature, willmore, thin_plate : Estimate or None
        ∫ H, ∫ κ₁κ₂, ∫ H² and ∫ κ₁² + κ₂², with H = (κ₁ + κ₂)/2, positive where convex. None where the field has no
        second derivatives, or where they were not asked for.
    euler : int
        Euler characteristic of the triangles that were integrated over.
    gauss_bonnet : float or None
        ∫ κ₁κ₂ / 2π - euler: 0 where a closed, smooth surface has the topology of its triangles.
    integrals : dict of str to Estimate
        Those of `integrands`.
    points, faces : ndarray, (n, 3) and (f, 3)
        The triangles; where samples were measured, the points are theirs.
    weights : ndarray, (n,)
        ``weights @ f(points)`` approximates ∫ f dA to the fourth order; they add up to the area.
    places : ndarray, (k, 3)
        Where something is not guaranteed: ends of the surface, creases, singular points.
    notes : tuple of str
        What is not guaranteed, and why; empty where all is well.
    reliable : bool
        Whether the errors can be relied on: the triangles cover the surface once, as far as can be told. Not so where
        they have holes inside the box, or are no oriented manifold: then the errors are wide guesses.

    """

    area: Estimate
    volume: Estimate | None
    solid: Moments | None
    shell: Moments
    mean_curvature: Estimate | None
    gaussian_curvature: Estimate | None
    willmore: Estimate | None
    thin_plate: Estimate | None
    euler: int
    gauss_bonnet: float | None
    integrals: dict[str, Estimate]
    points: Floats
    faces: npt.NDArray[np.int64]
    weights: Floats
    places: Floats
    notes: tuple[str, ...]
    reliable: bool

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON; without points, faces and weights."""
        numbers = ("area", "volume", "mean_curvature", "gaussian_curvature", "willmore", "thin_plate")
        found: dict[str, Any] = {name: _plain(getattr(self, name)) for name in numbers}
        for name in ("solid", "shell"):
            moments: Moments | None = getattr(self, name)
            found[name] = moments and {key: value.tolist() for key, value in vars(moments).items()}
        return found | {
            "euler": self.euler,
            "gauss_bonnet": self.gauss_bonnet,
            "integrals": {name: _plain(value) for name, value in self.integrals.items()},
            "vertices": len(self.points),
            "triangles": len(self.faces),
            "places": self.places.tolist(),
            "notes": list(self.notes),
            "reliable": self.reliable,
        }

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        named = [
            ("area", self.area),
            ("volume", self.volume),
            ("∫ mean curvature", self.mean_curvature),
            ("∫ Gaussian curvature", self.gaussian_curvature),
            ("Willmore energy", self.willmore),
            ("thin-plate energy", self.thin_plate),
            *self.integrals.items(),
        ]
        rows = [(name, str(value)) for name, value in named if value is not None]
        for name, moments in (("centroid", self.solid), ("centroid of the shell", self.shell)):
            if moments is not None:
                rows.append((name, ", ".join(f"{v:.9g}" for v in moments.centroid)))
        if self.solid is not None:
            rows.append(("inertia", "; ".join(", ".join(f"{v:.6g}" for v in row) for row in self.solid.inertia)))
        off = "" if self.gauss_bonnet is None else f" (Gauss-Bonnet: off by {self.gauss_bonnet:.1g})"
        rows.append(("Euler characteristic", f"{self.euler}{off}"))
        rows.append(("triangles", f"{len(self.faces):,} over {len(self.points):,} vertices"))
        return rows + [("note", text) for text in self.notes]

    def __str__(self) -> str:
        return "\n".join(f"{name + ':':<23}{value}" for name, value in self.rows())


def measure(
    surface: Field | Samples,
    *,
    n: int | None = None,
    spacing: float | None = None,
    bounds: Any = None,
    integrands: Integrand | Mapping[str, Integrand] | None = None,
    curvature: bool = True,
    tolerance: float = 1e-9,
    most: int = 16,
    seed: int = 0,
) -> Measures:
    """Area, volume, centroid, inertia and curvature integrals of F = 0, each with an error.

    The surface is sampled and the samples joined by triangles, each of which is bent onto the surface and integrated by
    Gauss rules: at 10,000 samples area and volume of a smooth surface are right to 1e-8 or better.

    Parameters
    ----------
    surface : Field or Samples
        The surface, or samples of it: then triangles join these, and `weights` belong to them.
    n : int, optional
        Number of vertices; 10,000 if neither this nor `spacing` is given.
    spacing : float, optional
        Instead of `n`: mean distance of neighbours.
    bounds : pair of corners or float, optional
        As for :func:`isoswarm.sample`. A surface that leaves the box is clipped by it: it has an area there and no
        volume.
    integrands : callable or dict of str to callable, optional
        Functions of points and outward unit normals, (n, 3) each, to (n,); integrated over the surface.
    curvature : bool
        Whether to integrate curvatures.
    tolerance : float
        Relative error of area and volume above which triangles are divided.
    most : int
        Parts that triangles may be divided into altogether, in multiples of their number.
    seed : int
        Of the samples.

    Returns
    -------
    Measures
        With a SamplingWarning where something is not guaranteed.

    Examples
    --------
    >>> import isoswarm as iso
    >>> ball = iso.measure(iso.sphere(r=1), n=1000, integrands={"z²": lambda X, N: X[:, 2] ** 2})
    >>> abs(ball.volume.value - 4 / 3 * 3.141592653589793) < 1e-7
    True
    >>> round(ball.integrals["z²"].value, 6), ball.euler
    (4.18879, 2)

    """
    samples = surface if isinstance(surface, Samples) else None
    field = surface.field if isinstance(surface, Samples) else surface
    if not isinstance(field, Field):
        raise TypeError(f"surface: expected a Field or Samples, given {type(surface).__name__}")
    if n is not None and spacing is not None:
        raise ValueError(f"expected n or spacing, given both (n={n}, spacing={spacing})")
    if samples is not None and not (n is None and spacing is None):
        raise ValueError("expected no n and no spacing where samples are measured: the samples are the vertices")
    if n is not None:
        n = as_count(n, "n", 4, 2**48)
    if not 1 <= most <= 10**6:
        raise ValueError(f"most: expected a number from 1 to 1,000,000, given {most}")
    seed = as_seed(seed)
    lo, hi = as_bounds(bounds, field.axes) if bounds is not None else field.require_bounds()
    functions = _named(integrands)
    found = _core.measures(
        field._model,
        n=10_000 if n is None and spacing is None else n,
        spacing=spacing,
        samples=None
        if samples is None
        else (
            samples.points,
            samples.normals,
            samples.radii,
            samples.report.components,
        ),
        lo=tuple(lo),
        hi=tuple(hi),
        seed=seed,
        tolerance=float(tolerance),
        most=most,
        curvature=curvature,
        integrands=[_wrapped(f, name) for name, f in functions.items()],
    )
    result = _result(found, list(functions), curvature)
    if result.notes:
        warnings.warn("; ".join(result.notes), SamplingWarning, stacklevel=2)
    return result


def _named(integrands: Integrand | Mapping[str, Integrand] | None) -> dict[str, Integrand]:
    if integrands is None:
        return {}
    if isinstance(integrands, Mapping):
        return dict(integrands)
    return {getattr(integrands, "__name__", "integral"): integrands}


def _wrapped(function: Integrand, name: str) -> Any:
    """A function of points and normals as one of (n, 6) arrays, its answers checked."""
    if not callable(function):
        raise TypeError(f"{name}: expected a function of points and normals, given {type(function).__name__}")
    check = checked(lambda X: function(X[:, :3], X[:, 3:]), name, 6)
    return lambda X: check(X, ())


def _estimate(pair: tuple[float, float] | None) -> Estimate | None:
    return None if pair is None else Estimate(*pair)


def _moments(found: tuple[list[tuple[float, float]], list[tuple[float, float]]] | None) -> Moments | None:
    if found is None:
        return None
    centre, inertia = (np.array(part) for part in found)
    whole = inertia[[0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(3, 3, 2)
    return Moments(centre[:, 0], centre[:, 1], whole[..., 0], whole[..., 1])


def _result(found: dict[str, Any], names: list[str], curvature: bool) -> Measures:
    numbers = ("area", "volume", "mean_curvature", "gaussian_curvature", "willmore", "thin_plate")
    if not curvature:
        found |= dict.fromkeys((*numbers[2:], "gauss_bonnet"))
    values: dict[str, Any] = {name: _estimate(found[name]) for name in numbers}
    return Measures(
        **values,
        solid=_moments(found["solid"]),
        shell=_moments(found["shell"]),  # type: ignore[arg-type]  # always there
        euler=found["euler"],
        gauss_bonnet=found["gauss_bonnet"],
        integrals=dict(zip(names, (Estimate(*pair) for pair in found["integrals"]), strict=True)),
        points=found["points"],
        faces=found["faces"],
        weights=found["weights"],
        places=found["places"],
        notes=(*found["warnings"], *found["notes"]),
        reliable=found["reliable"],
    )


def _plain(value: Estimate | None) -> dict[str, float] | None:
    return None if value is None else {"value": value.value, "error": value.error}
