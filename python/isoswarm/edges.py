"""Creases: where a surface has an edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from isoswarm._arrays import Floats

if TYPE_CHECKING:
    import numpy as np

    from isoswarm import _core

__all__ = ["Crease", "Creases"]


@dataclass(frozen=True)
class Crease:
    """One edge, from corner to corner, or closed.

    Attributes
    ----------
    points : ndarray of int, (k,)
        Numbers of its points, in order; a closed one does not repeat the first.
    closed : bool
        Whether it is a loop.
    length : float
        Arc length, in model units.

    """

    points: npt.NDArray[np.int64]
    closed: bool
    length: float


class Creases:
    """The creases of a surface, where a minimum or maximum switches.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Points on them, in model units: the first k samples of ``iso.sample(field, creases=True)``.
    corners : ndarray of int
        Numbers of the points at which creases meet or a cone ends.
    edges : tuple of Crease
        The curves.
    certified : bool
        Whether intervals vouch for every crease lying in one of the boxes that were searched.
    warnings : tuple of str
        What should be known besides.

    """

    points: Floats
    corners: npt.NDArray[np.int64]
    edges: tuple[Crease, ...]
    certified: bool
    warnings: tuple[str, ...]

    def __init__(self, inner: _core.Creases) -> None:
        self._inner = inner
        self.points = inner.points
        self.corners = inner.corners
        self.edges = tuple(Crease(*edge) for edge in inner.edges())
        self.certified = inner.certified
        self.warnings = tuple(inner.warnings)

    def __deepcopy__(self, memo: dict[int, Any]) -> Creases:
        return self

    def __repr__(self) -> str:
        return f"<Creases: {len(self.edges)} edges, {len(self.corners)} corners, {len(self.points)} points>"
