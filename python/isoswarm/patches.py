"""Parametric surfaces x(u, v): even samples and triangles, by floaters that live in (u, v) and repel in space."""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, SupportsFloat

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_floats, as_seed
from isoswarm.errors import SamplingWarning
from isoswarm.field import Field, node
from isoswarm.loading import parse
from isoswarm.samples import Evenness

__all__ = ["Parametric", "ParametricSamples", "parametric"]

Wrap = bool | Literal["twisted"]
WORD = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class ParametricSamples:
    """Samples of a parametric surface.

    Attributes
    ----------
    uv : ndarray, (n, 2)
        Parameters.
    points, normals : ndarray, (n, 3)
        Positions, and unit normals along x_u × x_v.
    faces : ndarray of int, (f, 3)
        Triangles, counter-clockwise seen from where the normals point; empty for mere samples. On a surface with one
        side they do not agree across a curve.
    euler, boundaries : int or None
        Euler characteristic and number of boundary curves of the triangles.
    area : float
        Of the surface, by quadrature.
    spacing : float
        Mean distance between a sample and its nearest neighbour.
    evenness : Evenness
        How evenly they lie.
    poles : tuple
        Which ends of u, and of v, are poles: ((u lo, u hi), (v lo, v hi)).

    """

    uv: Floats
    points: Floats
    normals: Floats
    faces: npt.NDArray[np.int64]
    euler: int | None
    boundaries: int | None
    area: float
    spacing: float
    evenness: Evenness
    poles: tuple[tuple[bool, bool], tuple[bool, bool]]

    def __len__(self) -> int:
        return len(self.points)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the triangles in the format that the ending names, such as .ply, .obj, .stl or .glb."""
        if not len(self.faces):
            raise ValueError("there are no triangles: take Parametric.mesh instead of Parametric.sample")
        _core.save_mesh(Path(path), self.points, self.faces, self.normals)


class Parametric:
    """A parametric surface, made by :func:`parametric`.

    Attributes
    ----------
    coordinates : tuple of Field
        x, y and z as functions of the plane.
    field : Field
        The three in one.
    u, v : tuple of float
        Ranges of the parameters.
    periodic : tuple
        How the edges at their ends hang together.

    """

    def __init__(
        self, coordinates: list[Field], u: tuple[float, float], v: tuple[float, float], periodic: tuple[Wrap, Wrap]
    ) -> None:
        self.coordinates = tuple(coordinates)
        self.field = node("stack", *coordinates)
        self.u, self.v, self.periodic = u, v, periodic

    def point(self, uv: npt.ArrayLike) -> Floats:
        """Points x(u, v), (n, 3), for parameters (n, 2)."""
        places = as_floats("uv", uv, (None, 2))
        return np.stack([c.value(places) for c in self.coordinates], axis=1)

    def sample(
        self, *, n: int | None = None, spacing: float | None = None, seed: int = 0, max_samples: int = 20_000_000
    ) -> ParametricSamples:
        """Spread points evenly.

        Parameters
        ----------
        n : int, optional
            So many; 1000 if neither this nor `spacing` is given. Poles and corners get one each.
        spacing : float, optional
            Instead of `n`: mean distance of neighbours.
        seed : int
            Of every random choice.
        max_samples : int
            More than that is refused.

        """
        return self._make(n, spacing, seed, max_samples, faces=False)

    def mesh(
        self, *, n: int | None = None, spacing: float | None = None, seed: int = 0, max_samples: int = 20_000_000
    ) -> ParametricSamples:
        """Samples as for :meth:`sample`, joined by triangles."""
        return self._make(n, spacing, seed, max_samples, faces=True)

    def _make(self, n: int | None, spacing: float | None, seed: int, most: int, *, faces: bool) -> ParametricSamples:
        if n is not None and spacing is not None:
            raise ValueError(f"expected n or spacing, given both (n={n}, spacing={spacing})")
        seed = as_seed(seed)
        found = _core.patch(
            self.field._model,
            lo=(self.u[0], self.v[0]),
            hi=(self.u[1], self.v[1]),
            wraps=tuple("twisted" if w == "twisted" else "periodic" if w else "open" for w in self.periodic),
            n=1000 if n is None and spacing is None else n,
            spacing=spacing,
            seed=seed,
            most=most,
            faces=faces,
        )
        if not found.pop("settled"):
            warnings.warn("not converged: the floaters still moved in the last step", SamplingWarning, stacklevel=3)
        found["evenness"] = Evenness(**found["evenness"])
        found["poles"] = tuple(tuple(ends) for ends in found["poles"])
        return ParametricSamples(**{"faces": np.empty((0, 3), np.int64), "euler": None, "boundaries": None, **found})


def parametric(
    x: str | Field,
    y: str | Field,
    z: str | Field,
    *,
    u: tuple[float, float],
    v: tuple[float, float],
    periodic: tuple[Wrap, Wrap] = (False, False),
    **parameters: SupportsFloat,
) -> Parametric:
    """A surface from its coordinates as functions of two parameters.

    Parameters
    ----------
    x, y, z : str or Field
        Formulas of u and v, or fields in the plane whose coordinates are u and v.
    u, v : pair of float
        Ranges.
    periodic : pair of bool or "twisted"
        For each parameter whether the edges at the ends of its range are the same curve; ``"twisted"`` where they are
        once it is run through backwards, as on a Möbius strip. Edges that shrink to a point are found to be poles.
    **parameters : float
        Values of other names in the formulas.

    Examples
    --------
    >>> import isoswarm as iso
    >>> from math import pi
    >>> torus = iso.parametric(
    ...     "(R + r*cos(v))*cos(u)", "(R + r*cos(v))*sin(u)", "r*sin(v)",
    ...     u=(0, 2 * pi), v=(0, 2 * pi), periodic=(True, True), R=1, r=0.4,
    ... )
    >>> mesh = torus.mesh(n=1000)
    >>> len(mesh), mesh.euler, mesh.boundaries
    (1000, 0, 0)

    """
    ranges = [_range(name, value) for name, value in (("u", u), ("v", v))]
    wraps = tuple(periodic)
    if len(wraps) != 2 or any(w not in (True, False, "twisted") for w in wraps):
        raise ValueError(f'periodic: expected a pair of True, False or "twisted", given {periodic!r}')
    parts = [_coordinate(name, value, parameters) for name, value in (("x", x), ("y", y), ("z", z))]
    return Parametric(parts, ranges[0], ranges[1], (wraps[0], wraps[1]))


def _range(name: str, value: Any) -> tuple[float, float]:
    lo, hi = as_floats(name, value, (2,)).tolist()
    if not lo < hi:
        raise ValueError(f"{name}: expected lo < hi, given ({lo}, {hi})")
    return lo, hi


def _coordinate(name: str, value: str | Field, parameters: dict[str, SupportsFloat]) -> Field:
    """A coordinate as a field in the plane."""
    if isinstance(value, Field):
        return value
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected a formula of u and v, or a Field, given {type(value).__name__}")
    words = set(WORD.findall(value))
    if bad := words & {"x", "y", "z"}:
        raise ValueError(f"{name}: expected a formula of u and v, given {value!r}, which uses {', '.join(sorted(bad))}")
    text = WORD.sub(lambda word: {"u": "x", "v": "y"}.get(word[0], word[0]), value)
    return parse(text, axes=2, **{key: number for key, number in parameters.items() if key in words})
