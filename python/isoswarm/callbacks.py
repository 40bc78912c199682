"""Functions of the user: called once for all points, and what they answer is checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from isoswarm._arrays import Floats
from isoswarm.errors import CallbackError

BatchFunction = Callable[[Floats], npt.ArrayLike]
"""Takes points, (n, 3), or (n, 2) in the plane; returns one value for each."""


def checked(function: BatchFunction, name: str, axes: int, shape: tuple[int, ...] = ()) -> Callable[[Floats], Floats]:
    """`function` with its answers checked.

    Parameters
    ----------
    function : callable
        Takes (n, axes), returns (n, *shape).
    name : str
        How messages call it.
    axes : int
        2 or 3 columns are handed over.
    shape : tuple of int
        What it returns for each point.

    Returns
    -------
    callable
        Takes (n, 3), returns a float64 array; raises CallbackError for a wrong shape, for what is not numbers and
        for NaN. Exceptions of the function itself pass through.

    """
    if not callable(function):
        raise TypeError(f"{name}: expected a function of an (n, {axes}) array, given {type(function).__name__}")

    def call(points: Floats) -> Floats:
        X = np.ascontiguousarray(points[:, :axes])
        answer: Any = function(X)
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
