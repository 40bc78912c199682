"""Functions of numbers and fields; NumPy's elementary functions work on fields, too.

Made by scripts/generate_shapes.py from the core's table of kinds; do not edit. Every parameter may be a number, which
becomes a parameter of the model, or a field that gives it.
"""

from __future__ import annotations

from isoswarm.field import Field, Operand, node

__all__ = [
    "abs",
    "acos",
    "acosh",
    "add",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "cbrt",
    "ceil",
    "clamp",
    "cos",
    "cosh",
    "div",
    "exp",
    "exp2",
    "floor",
    "hypot",
    "lerp",
    "less",
    "ln",
    "log2",
    "log10",
    "max",
    "min",
    "mod",
    "mul",
    "neg",
    "pow",
    "round",
    "sign",
    "sin",
    "sinh",
    "smoothstep",
    "sqrt",
    "square",
    "step",
    "sub",
    "tan",
    "tanh",
    "trunc",
    "where",
]


def add(*operands: Operand) -> Field:
    """The sum.

    F = f + g + …

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("add", *operands)


def sub(f: Operand, g: Operand) -> Field:
    """The difference of two numbers.

    F = f − g

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("sub", f, g)


def mul(*operands: Operand) -> Field:
    """The product.

    F = f · g · …

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("mul", *operands)


def div(f: Operand, g: Operand) -> Field:
    """The quotient.

    F = f / g

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("div", f, g)


def neg(f: Operand) -> Field:
    """The negative.

    F = −f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("neg", f)


def pow(f: Operand, g: Operand) -> Field:
    """A power; a negative base only with a whole exponent.

    F = f^g

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("pow", f, g)


def mod(f: Operand, g: Operand) -> Field:
    """The remainder, with the sign of g.

    F = f − g ⌊f/g⌋

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("mod", f, g)


def min(*operands: Operand) -> Field:
    """The smallest.

    F = min(f, g, …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("min", *operands)


def max(*operands: Operand) -> Field:
    """The largest.

    F = max(f, g, …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("max", *operands)


def hypot(*operands: Operand) -> Field:
    """The length of a vector; derivative 0 at 0.

    F = √(f² + g² + …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("hypot", *operands)


def abs(f: Operand) -> Field:
    """The absolute value; derivative 0 at 0.

    F = |f|

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("abs", f)


def sqrt(f: Operand) -> Field:
    """The square root; derivative 0 at 0.

    F = √f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("sqrt", f)


def square(f: Operand) -> Field:
    """The square.

    F = f²

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("square", f)


def cbrt(f: Operand) -> Field:
    """The cube root, also of negative numbers, for |f| < 1e150.

    F = ∛f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("cbrt", f)


def exp(f: Operand) -> Field:
    """The exponential function.

    F = e^f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("exp", f)


def exp2(f: Operand) -> Field:
    """A power of two.

    F = 2^f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("exp2", f)


def ln(f: Operand) -> Field:
    """The natural logarithm.

    F = ln f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("ln", f)


def log2(f: Operand) -> Field:
    """The logarithm to base 2.

    F = ln f / ln 2

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("log2", f)


def log10(f: Operand) -> Field:
    """The logarithm to base 10.

    F = ln f / ln 10

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("log10", f)


def sin(f: Operand) -> Field:
    """Sine.

    F = sin f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("sin", f)


def cos(f: Operand) -> Field:
    """Cosine.

    F = cos f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("cos", f)


def tan(f: Operand) -> Field:
    """Tangent.

    F = tan f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("tan", f)


def asin(f: Operand) -> Field:
    """Arc sine.

    F = asin f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("asin", f)


def acos(f: Operand) -> Field:
    """Arc cosine.

    F = acos f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("acos", f)


def atan(f: Operand) -> Field:
    """Arc tangent.

    F = atan f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("atan", f)


def atan2(f: Operand, g: Operand) -> Field:
    """The angle of the point (g, f).

    F = atan2(f, g)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("atan2", f, g)


def sinh(f: Operand) -> Field:
    """Hyperbolic sine.

    F = (e^f − e^−f)/2

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("sinh", f)


def cosh(f: Operand) -> Field:
    """Hyperbolic cosine.

    F = (e^f + e^−f)/2

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("cosh", f)


def tanh(f: Operand) -> Field:
    """Hyperbolic tangent.

    F = 1 − 2/(e^2f + 1)

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("tanh", f)


def asinh(f: Operand) -> Field:
    """Inverse hyperbolic sine.

    F = ln(f + √(f² + 1))

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("asinh", f)


def acosh(f: Operand) -> Field:
    """Inverse hyperbolic cosine, for f ≥ 1.

    F = ln(f + √(f² − 1))

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("acosh", f)


def atanh(f: Operand) -> Field:
    """Inverse hyperbolic tangent, for |f| < 1.

    F = ln((1 + f)/(1 − f))/2

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("atanh", f)


def trunc(f: Operand) -> Field:
    """The nearest whole number towards 0; derivative 0.

    F = f without its fraction

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("trunc", f)


def floor(f: Operand) -> Field:
    """The largest whole number not above; derivative 0.

    F = ⌊f⌋

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("floor", f)


def ceil(f: Operand) -> Field:
    """The smallest whole number not below; derivative 0.

    F = ⌈f⌉

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("ceil", f)


def round(f: Operand) -> Field:
    """The nearest whole number, halves away from 0; derivative 0.

    F = round f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("round", f)


def sign(f: Operand) -> Field:
    """−1, 0 or 1; derivative 0.

    F = sgn f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("sign", f)


def less(f: Operand, g: Operand) -> Field:
    """1 where f < g, else 0; derivative 0.

    F = f < g

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("less", f, g)


def where(f: Operand, g: Operand, h: Operand) -> Field:
    """One of two values; `where(x < 1, f, g)`.

    The surface may tear where the condition changes.

    F = g where f ≠ 0, else h

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    h : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("where", f, g, h)


def step(f: Operand, g: Operand) -> Field:
    """A step at f; derivative 0.

    F = 1 where g ≥ f, else 0

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("step", f, g)


def smoothstep(f: Operand, g: Operand, h: Operand) -> Field:
    """A smooth step of h from f to g.

    F = t²(3 − 2t), t = clamp((h − f)/(g − f), 0, 1)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    h : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("smoothstep", f, g, h)


def lerp(f: Operand, g: Operand, h: Operand) -> Field:
    """From f at h = 0 to g at h = 1.

    F = f + h (g − f)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    h : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("lerp", f, g, h)


def clamp(f: Operand, g: Operand, h: Operand) -> Field:
    """f between g and h.

    F = min(max(f, g), h)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    h : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("clamp", f, g, h)
