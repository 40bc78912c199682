"""Formulas and model files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np

from isoswarm import _core
from isoswarm._arrays import as_bounds
from isoswarm._files import read_text
from isoswarm.callbacks import BatchFunction, Checked, as_parameters, checked
from isoswarm.field import Field
from isoswarm.scene import Scene

__all__ = ["from_function", "load", "parse"]


def parse(text: str, *, axes: int = 3, **parameters: SupportsFloat) -> Field:
    """Read a formula.

    Parameters
    ----------
    text : str
        Such as ``"x^2 + y^2 + z^2 - r^2"`` or ``"sphere(r=1) | box(2, 1, 1)"``: arithmetic, the usual functions,
        shapes and operators; ``^`` and ``**`` are powers; ``|``, ``&``, ``~`` combine, and ``-`` between two solids
        is their difference. F < 0 is inside.
    axes : {3, 2}
        2 for a curve in the plane.
    **parameters : float
        Values of the names that the text uses; each becomes a parameter of the field.

    Returns
    -------
    Field

    Raises
    ------
    ParseError
        With the position, what was expected and what was found.

    Examples
    --------
    >>> import isoswarm as iso
    >>> iso.parse("x^2 + y^2 + z^2 - r^2", r=2).value([[3, 0, 0]]).tolist()
    [5.0]

    """
    if not isinstance(text, str):
        raise TypeError(f"text: expected a formula, given {type(text).__name__}")
    return Field(_core.Model.parse(text, [(name, float(value)) for name, value in parameters.items()], axes))


def from_function(
    function: BatchFunction,
    gradient: BatchFunction | None = None,
    *,
    parameters: Mapping[str, SupportsFloat] | None = None,
    parameter_gradient: BatchFunction | None = None,
    bounds: object = None,
    axes: int = 3,
    name: str | None = None,
) -> Field:
    """Make a field of any Python function of arrays, and of parameters.

    Parameters
    ----------
    function : callable
        Takes all points at once, (n, `axes`), and each parameter as a keyword argument, a float; returns F at each
        point, (n,), with F < 0 inside. It is called on the thread that you call from.
    gradient : callable, optional
        Takes the same, returns ∂F/∂x, (n, `axes`). Without it F is differentiated numerically.
    parameters : mapping, optional
        Names of the parameters and their values. They are parameters of the field like any other, with paths such as
        ``function/r``: see :meth:`Field.with_parameters`, :meth:`Field.freeze`, :meth:`Field.with_limits`.
    parameter_gradient : callable, optional
        Takes the same, returns ∂F/∂q, (n, m), one column for each of the m `parameters` in their order. Without it F is
        differentiated numerically: two calls for each free parameter, with steps of 6e-6 times its value or its scale
        (:meth:`Field.with_scale`), whichever is larger, within its limits.
    bounds : pair of corners or float, optional
        A box that contains the surface, whatever the parameters; b for the box from -b to b.
    axes : {3, 2}
        2 for a curve in the plane.
    name : str, optional
        How messages and files call it; by default the function's own name.

    Returns
    -------
    Field
        Without intervals, so that no search for its components is certified.

    Raises
    ------
    TypeError
        A function that cannot be called with these parameters, or a parameter that is no number.
    ValueError
        A parameter that is not finite, or whose name cannot be that of an argument.

    Examples
    --------
    >>> import isoswarm as iso, numpy as np
    >>> ball = iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 1, bounds=1.5)
    >>> ball.gradient([[2.0, 0.0, 0.0]]).round(6).tolist()
    [[1.0, 0.0, 0.0]]

    >>> def egg(X, r, pointed):
    ...     x, y, z = X.T
    ...     return x**2 + y**2 + (z / (1 + pointed * np.tanh(z))) ** 2 - r**2
    >>> field = iso.from_function(egg, parameters={"r": 1.0, "pointed": 0.2}, bounds=2)
    >>> list(field.parameters)
    ['function/r', 'function/pointed']
    >>> field.parameter_gradient([[1.0, 0.0, 0.0]]).round(6).tolist()
    [[-2.0, 0.0]]

    """
    if axes not in (2, 3):
        raise ValueError(f"axes: expected 2 or 3, given {axes}")
    called = name or str(getattr(function, "__name__", "function"))
    box = None
    if bounds is not None:
        lo, hi = as_bounds(bounds, axes)
        box = (tuple(lo.tolist()), tuple(hi.tolist()))
    own = as_parameters(parameters or {})
    names = [key for key, _ in own]
    value = checked(function, called, axes, parameters=names)
    slope = None if gradient is None else checked(gradient, f"gradient of {called}", axes, (axes,), names)
    if slope is not None and axes == 2:
        slope = _padded(slope)
    slopes = None
    if parameter_gradient is not None:
        if not own:
            raise ValueError("parameter_gradient: expected with `parameters`, given without")
        slopes = checked(parameter_gradient, f"parameter gradient of {called}", axes, (len(own),), names)
    field = Field(_core.Model.function(called, own, value, slope, slopes, box))
    return field if axes == 3 else Field(_core.Model.node("planar", [field._model], {}))


def _padded(slope: Checked) -> Checked:
    """A gradient in the plane with a third component of 0."""
    return lambda X, q: np.pad(slope(X, q), ((0, 0), (0, 1)))


def load(path: str | os.PathLike[str], functions: Mapping[str, Field] | None = None) -> Any:
    """Read a model, or a scene, from a file.

    Parameters
    ----------
    path : str or path
        A ``.vm`` tape (plain text, as fidget and MPR write it) or an ``.iso.json``.
    functions : mapping, optional
        The fields, made with :func:`from_function`, that the file refers to by name. Their parameters get the values in
        the file.

    Returns
    -------
    Field or Scene
        What the file says it is: what :meth:`Field.save` or :meth:`Scene.save` wrote.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileFormatError
        A malformed or truncated file: with its line.

    """
    file = Path(path)
    name = file.name.lower()
    if not name.endswith((".vm", ".iso.json")):
        raise ValueError(f"{file}: expected a file that ends in .vm or .iso.json")
    text = read_text(file, "model")
    if name.endswith(".vm"):
        return Field(_core.Model.from_vm(text))
    named = [(key, f._model) for key, f in (functions or {}).items()]
    if _core.format_of(text) == "isoswarm scene":
        return Scene._of(_core.Scene.from_json(text, named))
    return Field(_core.Model.from_json(text, named))
