"""Checks of what comes in: every array is looked at once, and the message says what was expected and given."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def as_floats(what: str, value: npt.ArrayLike, shape: tuple[int | None, ...], letters: str = "nm") -> Floats:
    """`value` as a C-ordered float64 array of the given shape.

    Parameters
    ----------
    what : str
        Name of the argument, for the message.
    value : array_like
        What the user gave.
    shape : tuple
        Expected lengths; ``None`` where any length will do.
    letters : str
        Names of the free lengths, for the message.

    Returns
    -------
    ndarray
        float64, C order.

    Raises
    ------
    ValueError
        Not numbers, not finite or of another shape.

    """
    try:
        array = np.asarray(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{what}: expected numbers of shape {_written(shape, letters)}, given {value!r:.60}"
        ) from error
    if np.ndim(value) != len(shape) or any(
        want not in (None, have) for want, have in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{what}: expected shape {_written(shape, letters)}, given {np.shape(value)}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{what}: expected finite numbers, given {array[where]} at index {where}")
    return array


def as_count(value: Any, what: str, least: int = 0, most: int = 2**63 - 1) -> int:
    """`value` as a whole number within limits.

    Raises
    ------
    TypeError
        Not a whole number.
    ValueError
        Beyond the limits.

    """
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise TypeError(f"{what}: expected a whole number, given {value!r:.60}")
    count = operator.index(value)
    if not least <= count <= most:
        raise ValueError(f"{what}: expected a whole number from {least} to {_power(most)}, given {count}")
    return count


def as_seed(value: Any) -> int:
    """The seed of all random choices."""
    return as_count(value, "seed", 0, 2**64 - 1)


def _power(limit: int) -> str:
    """A limit as people read it."""
    for offset, suffix in ((0, ""), (1, " - 1")):
        power = limit + offset
        if power > 1 << 20 and power & (power - 1) == 0:
            return f"2^{power.bit_length() - 1}{suffix}"
    return str(limit)


def as_points(value: npt.ArrayLike, axes: int, what: str = "X") -> Floats:
    """Points as (n, 3); where ``axes`` is 2 an (n, 2) array is accepted too and gets z = 0."""
    if axes == 2 and np.ndim(value) == 2 and np.shape(value)[1] == 2:
        flat = as_floats(what, value, (None, 2))
        return np.column_stack([flat, np.zeros(len(flat))])
    points = as_floats(what, value, (None, 3))
    if axes == 2 and points[:, 2].any():
        raise ValueError(f"{what}: expected z = 0 for a curve in the plane, given other values; pass (n, 2)")
    return points


def as_bounds(value: Any, axes: int = 3, what: str = "bounds") -> tuple[Floats, Floats]:
    """A box ``(lo, hi)`` as two arrays of three numbers.

    Accepts a pair of corners, of ``axes`` numbers each, or one number b for the box from -b to b.
    """
    if np.ndim(value) == 0:
        half = as_floats(what, value, ())
        value = np.array([np.full(axes, -half), np.full(axes, half)])
    if np.shape(value) == (2, 2) and axes == 2:
        box = np.column_stack([as_floats(what, value, (2, 2)), np.zeros(2)])
    else:
        box = as_floats(what, value, (2, 3))
    lo, hi = box
    if not (lo[:axes] < hi[:axes]).all():
        raise ValueError(f"{what}: expected lo < hi on every axis, given lo = {lo.tolist()}, hi = {hi.tolist()}")
    return lo, hi


def _written(shape: tuple[int | None, ...], letters: str) -> str:
    names = iter(letters)
    inner = ", ".join(next(names) if n is None else str(n) for n in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"
