"""Functions of the user: called for all points at once, and what they answer is checked."""

from __future__ import annotations

import inspect
import keyword
from collections.abc import Callable, Mapping, Sequence
from typing import Any, SupportsFloat

import numpy as np
import numpy.typing as npt

from isoswarm._arrays import Floats
from isoswarm.errors import CallbackError

BatchFunction = Callable[..., npt.ArrayLike]
"""Takes points, (n, 3), or (n, 2) in the plane, and its parameters by name; returns one value for each point."""

Checked = Callable[[Floats, Sequence[float]], Floats]
"""Takes points, (n, 3), and the values of the parameters; returns a float64 array."""


def checked(
    function: BatchFunction,
    name: str,
    axes: int,
    shape: tuple[int, ...] = (),
    parameters: Sequence[str] = (),
) -> Checked:
    """`function` with its answers checked.

    Parameters
    ----------
    function : callable
        Takes (n, axes) and the parameters as keyword arguments, returns (n, *shape).
    name : str
        How messages call it.
    axes : int
        2 or 3 columns are handed over.
    shape : tuple of int
        What it returns for each point.
    parameters : sequence of str
        Names of the parameters.

    Returns
    -------
    callable
        Takes (n, 3) and the values of the parameters, returns a float64 array; raises CallbackError for a wrong shape,
        for what is not numbers and for NaN. Exceptions of the function itself pass through.

    Raises
    ------
    TypeError
        Not a function, or not one that can be called with these parameters.

    """
    if not callable(function):
        raise TypeError(f"{name}: expected a function of an (n, {axes}) array, given {type(function).__name__}")
    _check_signature(function, name, parameters)

    def call(points: Floats, q: Sequence[float] = ()) -> Floats:
        X = np.ascontiguousarray(points[:, :axes])
        answer: Any = function(X, **dict(zip(parameters, q, strict=True)))
        expected = (len(X), *shape)
        try:
            values = np.ascontiguousarray(answer, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise CallbackError(f"{name}: expected numbers of shape {expected}, given {answer!r:.60}") from error
        if np.shape(answer) != expected:
            raise CallbackError(
                f"{name}: expected shape {expected} for points of shape {X.shape}, given {np.shape(answer)}; "
                "it is called once with all points, so use array functions such as np.maximum"
            )
        bad = np.isnan(values).reshape(len(X), -1).any(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise CallbackError(
                f"{name}: gave NaN at {int(bad.sum())} of {len(X)} points, first at {X[first].tolist()}; "
                "give a number everywhere in the bounds (for instance a large positive one outside the domain)"
            )
        return values

    return call


def as_parameters(values: Mapping[str, SupportsFloat]) -> list[tuple[str, float]]:
    """Names and values of a function's parameters, checked."""
    if not isinstance(values, Mapping):
        raise TypeError(f"parameters: expected names and values such as {{'r': 1.0}}, given {values!r:.60}")
    for name, value in values.items():
        number: Any = value
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ValueError(f"parameters: expected names that can be keyword arguments, given {name!r:.60}")
        if isinstance(value, bool | np.bool_) or not isinstance(value, SupportsFloat) or np.ndim(number) != 0:
            raise TypeError(
                f"parameters: expected a number for {name}, given {value!r:.60}; "
                "put what depends on other fields into a formula around the function"
            )
        if not np.isfinite(float(value)):
            raise ValueError(f"parameters: expected a finite number for {name}, given {float(value)}")
    return [(name, float(value)) for name, value in values.items()]


def _check_signature(function: BatchFunction, name: str, parameters: Sequence[str]) -> None:
    """Whether the function can be called with the parameters by name, as far as Python can tell."""
    try:
        signature = inspect.signature(function, follow_wrapped=False)
    except (TypeError, ValueError):
        return  # some functions written in C do not say
    try:
        signature.bind(None, **dict.fromkeys(parameters, 0.0))
    except TypeError as error:
        called = ", ".join(["X", *(f"{p}=…" for p in parameters)])
        raise TypeError(f"{name} is called as {name}({called}), but takes {signature}: {error}") from None
