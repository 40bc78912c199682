"""Proofs of the topology of a surface, by interval arithmetic."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds
from isoswarm.field import Field

__all__ = ["Certificate", "Component", "certify"]


@dataclass(frozen=True)
class Component:
    """A connected component whose topology is proven.

    Attributes
    ----------
    euler : int
        Euler characteristic.
    genus : int
        Number of handles.
    inside : tuple of int or None
        Numbers of the components that it lies inside of; None where that could not be told.

    """

    euler: int
    genus: int
    inside: tuple[int, ...] | None


@dataclass(frozen=True)
class Certificate:
    """What is proven of a surface.

    Attributes
    ----------
    proven : bool
        Whether all is: the surface in the bounds is closed, without singular points, and `euler` and `components` are
        right.
    euler : int or None
        Euler characteristic of the whole; proven where it is not None.
    components : tuple of Component
        Empty where their number is not proven.
    critical : tuple of int
        Minima, saddles and maxima of the height by which the proof goes.
    boxes : int
        Boxes looked at.
    doubtful : ndarray, (k, 2, 3)
        Where the proof fails: corners of at most 1000 boxes.
    reason : str
        Why it fails; empty where it does not.

    """

    proven: bool
    euler: int | None
    components: tuple[Component, ...]
    critical: tuple[int, int, int]
    boxes: int
    doubtful: Floats
    reason: str

    @property
    def genus(self) -> tuple[int, ...]:
        """Genus of each component."""
        return tuple(c.genus for c in self.components)

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        return asdict(self) | {"doubtful": self.doubtful.tolist()}

    def __str__(self) -> str:
        if not self.proven:
            part = f"Euler characteristic {self.euler} proven, the rest" if self.euler is not None else "topology"
            return f"{part} not proven: {self.reason}"
        if not self.components:
            return "proven: there is no surface in the bounds"
        count = len(self.components)
        genus = ", ".join(map(str, self.genus))
        return (
            f"proven: closed, {count} component{'s' * (count > 1)} of genus {genus}, Euler characteristic {self.euler} "
            f"({self.boxes:,} boxes)"
        )


def grown(lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
    """The box and a little around it, which a surface in the box does not reach."""
    margin = 0.02 * (hi - lo)
    return lo - margin, hi + margin


def certify(field: Field, *, bounds: Any = None, boxes: int = 2_000_000) -> Certificate:
    """Prove how many components the surface F = 0 has, and of which genus.

    Interval arithmetic isolates all critical points of a height function on the surface; the sum of their signs is the
    Euler characteristic (Morse). Paths that are proven to lie on the surface join its minima, and boxes that cover it
    keep components apart. Nothing is sampled and nothing is a matter of resolution: the proof holds, or it fails and
    says where.

    Parameters
    ----------
    field : Field
        The surface; not an opaque function.
    bounds : pair of corners or float, optional
        A box that the surface must not reach; by default ``field.bounds`` and a little more.
    boxes : int
        Most boxes that are looked at: a second or so for every 100,000.

    Returns
    -------
    Certificate
        Not proven where the surface is singular, leaves the bounds, has creases where the height is extreme, or takes
        more boxes.

    Examples
    --------
    >>> import isoswarm as iso
    >>> print(iso.certify(iso.torus(major=1, minor=0.4)).genus)
    (1,)

    """
    if not isinstance(field, Field):
        raise TypeError(f"field: expected a Field, given {type(field).__name__}")
    if not 1 <= boxes <= 10**10:
        raise ValueError(f"boxes: expected a number from 1, given {boxes}")
    if bounds is not None:
        lo, hi = as_bounds(bounds, field.axes)
    else:
        lo, hi = grown(*field.require_bounds())
    found = _core.certify(field._model, lo=tuple(lo), hi=tuple(hi), boxes=boxes)
    found["components"] = tuple(
        Component(euler, genus, None if inside is None else tuple(inside))
        for euler, genus, inside in found["components"]
    )
    found["doubtful"] = np.array(found["doubtful"], dtype=np.float64).reshape(-1, 2, 3)
    return Certificate(**found)
