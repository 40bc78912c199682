"""Kinds whose arguments are neither numbers nor fields: polynomials by exponents, blends by a function of two."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm.field import Field, Operand, node

__all__ = ["algebraic", "blend", "free_form", "stack", "xy", "xyz"]


def xyz() -> tuple[Field, Field, Field]:
    """Coordinates of space, to make formulas of.

    Examples
    --------
    >>> import isoswarm as iso
    >>> x, y, z = iso.xyz()
    >>> (x**2 + y**2 + z**2 - 1).value([[2.0, 0.0, 0.0]]).tolist()
    [3.0]

    """
    x, y, z = (Field(_core.Model.parse(axis, [], 3)) for axis in "xyz")
    return x, y, z


def xy() -> tuple[Field, Field]:
    """Coordinates of the plane, to make curves of; fields made of them have two axes.

    Examples
    --------
    >>> import isoswarm as iso
    >>> x, y = iso.xy()
    >>> circle = x**2 + y**2 - 1
    >>> circle.axes
    2

    """
    x, y, _ = xyz()
    return node("planar", x), node("planar", y)


def algebraic(coefficients: Mapping[tuple[int, int, int], Operand]) -> Field:
    """Make a polynomial of any degree, with a parameter for each monomial.

    Parameters
    ----------
    coefficients : mapping
        Exponents (i, j, k) to the coefficient of xⁱ yʲ zᵏ.

    Examples
    --------
    >>> import isoswarm as iso
    >>> sphere = iso.algebraic({(2, 0, 0): 1, (0, 2, 0): 1, (0, 0, 2): 1, (0, 0, 0): -1})
    >>> list(sphere.parameters)
    ['algebraic/c', 'algebraic/c_x2', 'algebraic/c_y2', 'algebraic/c_z2']

    """
    named = {}
    for exponents, value in coefficients.items():
        try:
            i, j, k = (int(e) for e in exponents)
        except (TypeError, ValueError):
            i = -1
        if i < 0 or (i, j, k) != tuple(exponents) or min(i, j, k) < 0:
            raise ValueError(f"coefficients: expected exponents such as (2, 0, 1), given {exponents!r}")
        factors = "".join(f"{axis}{e}" for axis, e in zip("xyz", (i, j, k), strict=True) if e)
        named[f"c_{factors}" if factors else "c"] = value
    return node("algebraic", **named)


def blend(f: Operand, g: Operand, h: Callable[[Field, Field], Operand]) -> Field:
    """Join two fields by an expression of your own.

    Parameters
    ----------
    f, g : Field or float
        Operands.
    h : callable
        Is called once, with two fields that stand for the operands, and returns the expression.

    Examples
    --------
    >>> import isoswarm as iso, numpy as np
    >>> lens = iso.blend(iso.sphere(), iso.sphere().translate(x=1), lambda f, g: np.maximum(f, g))
    >>> lens.value([[0.5, 0.0, 0.0]]).tolist()
    [-0.5]

    """
    x, y, _ = xyz()
    return node("blend", f, g, h=h(x, y))


def stack(*fields: Operand) -> Field:
    """Make a field of several components: the points where all are zero, such as the curve where surfaces meet."""
    return node("stack", *fields)


def free_form(
    field: Field,
    lo: npt.ArrayLike,
    hi: npt.ArrayLike,
    controls: tuple[int, int, int] = (3, 3, 3),
    displacements: npt.ArrayLike | None = None,
) -> Field:
    """Deform a field freely by a lattice of control points in a box (after Sederberg and Parry 1986).

    The inverse deformation p - d(p) is what is written down: exact for the whole lattice moved as one, close to the
    forward deformation where displacements change slowly. Outside of the box the displacement is that of the nearest
    point of the box.

    Parameters
    ----------
    field : Field
        What is deformed.
    lo, hi : array_like, (3,)
        Corners of the box, lo < hi on each axis.
    controls : tuple of int
        Control points (nx, ny, nz) along each axis, 2 to 8.
    displacements : array_like, (nx, ny, nz, 3), optional
        Displacement of each control point; 0 by default.

    Returns
    -------
    Field
        With the displacements as parameters before those of ``field``.

    Examples
    --------
    >>> import isoswarm as iso
    >>> import numpy as np
    >>> d = np.zeros((2, 2, 2, 3))
    >>> d[..., 0] = 0.5  # the whole lattice by 0.5 along x
    >>> moved = iso.free_form(iso.sphere(r=1), (-1, -1, -1), (1, 1, 1), (2, 2, 2), d)
    >>> round(float(moved.value([[1.5, 0.0, 0.0]])[0]), 12)
    0.0

    """
    low, high = np.asarray(lo, float), np.asarray(hi, float)
    if low.shape != (3,) or high.shape != (3,) or not np.all(low < high):
        raise ValueError(f"lo, hi: expected two corners with lo < hi on each axis, given {lo!r} and {hi!r}")
    counts = tuple(int(c) for c in controls)
    if len(counts) != 3 or not all(2 <= c <= 8 for c in counts):
        raise ValueError(f"controls: expected 2 to 8 along each axis, given {controls}")
    shape = (*counts, 3)
    d = np.zeros(shape) if displacements is None else np.asarray(displacements, float)
    if d.shape != shape or not np.all(np.isfinite(d)):
        raise ValueError(f"displacements: expected finite numbers of shape {shape}, given {d.shape}")
    # x fastest, z slowest.
    flat = d.transpose(2, 1, 0, 3).reshape(-1)
    return node("free_form", field, *low, *(high - low), *counts, *flat)
