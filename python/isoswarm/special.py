"""Kinds whose arguments are neither numbers nor fields: polynomials by exponents, blends by a function of two."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from isoswarm import _core
from isoswarm.field import Field, Operand, node

__all__ = ["algebraic", "blend", "stack", "xy", "xyz"]


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
