"""The main job: even samples of a surface."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any, Literal

import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import as_bounds, as_count, as_points, as_seed
from isoswarm.callbacks import BatchFunction, checked
from isoswarm.errors import EmptySurfaceWarning, SamplingWarning
from isoswarm.field import Field
from isoswarm.samples import Samples

__all__ = ["Method", "sample"]

Method = Literal["floaters", "adaptive", "simple", "fissioning", "random"]
Progress = Callable[[str, float, int, int], object]


def sample(
    field: Field,
    *,
    n: int | None = None,
    spacing: float | None = None,
    bounds: Any = None,
    density: BatchFunction | Literal["curvature"] | None = None,
    creases: bool = False,
    seed: int = 0,
    method: Method = "floaters",
    start: Samples | npt.ArrayLike | None = None,
    time_limit: float | None = None,
    max_samples: int = 20_000_000,
    steps: int | None = None,
    progress: Progress | None = None,
) -> Samples:
    """Spread points evenly over the surface F = 0.

    Parameters
    ----------
    field : Field
        The surface.
    n : int, optional
        Exactly this many points; 1000 if neither this nor `spacing` is given.
    spacing : float, optional
        Instead of `n`: mean distance between a point and its nearest neighbour, in model units.
    bounds : pair of corners or float, optional
        Where to look: ``(lo, hi)``, or b for the box from -b to b. By default ``field.bounds``. A surface that
        leaves the box is clipped by it.
    density : callable or "curvature", optional
        Relative number of points per area, a batch function of position, (n, 3) to (n,), or by curvature.
    creases : bool
        Whether to place samples on the surface's edges and corners (minima and maxima, as operators on shapes make
        them) and keep the others off them; see ``samples.creases``. Where they would be more than half of the samples,
        none are placed there, and a warning names a number that is enough.
    seed : int
        Of every random choice: same seed, same result, on any number of threads.
    method : {"floaters", "adaptive", "simple", "fissioning", "random"}
        ``"floaters"`` is the one to use. ``"random"`` gives independent points, uniformly distributed by area, for
        Monte Carlo. The others are the schemes of Witkin and Heckbert (1994), sections 4.1 to 4.4, to compare with.
    start : Samples or array_like (k, 3), optional
        Go on from earlier points, when the field has changed a little.
    time_limit : float, optional
        In seconds; what there is by then is returned, marked as not converged.
    max_samples : int
        More than that is refused, with an estimate.
    steps : int, optional
        Most relaxation steps.
    progress : callable, optional
        Called as ``progress(phase, fraction, floaters, steps)`` up to 20 times a second; an exception in it ends the
        run and comes out.

    Returns
    -------
    Samples
        Of length 0, with an EmptySurfaceWarning, where there is no surface in the bounds. Where something asked for
        was not reached, with a SamplingWarning; ``report`` says more.

    Raises
    ------
    ValueError
        A wrong argument. TooFewError: `n` is less than the number of components. TooLargeError: more than
        `max_samples`.

    Examples
    --------
    >>> import isoswarm as iso
    >>> sphere = iso.sample(iso.parse("x^2 + y^2 + z^2 - 1"), n=500, bounds=1.5)
    >>> len(sphere), sphere.report.components
    (500, 1)

    """
    if not isinstance(field, Field):
        raise TypeError(f"field: expected a Field (see iso.parse, iso.from_function), given {type(field).__name__}")
    if n is not None and spacing is not None:
        raise ValueError(f"expected n or spacing, given both (n={n}, spacing={spacing})")
    if n is None and spacing is None:
        n = 1000
    if n is not None:
        n = as_count(n, "n", 1, 2**48)
    if time_limit is not None and not 0.0 <= time_limit < float("inf"):
        raise ValueError(f"time_limit: expected seconds from 0, given {time_limit}")
    seed = as_seed(seed)
    lo, hi = as_bounds(bounds, field.axes) if bounds is not None else field.require_bounds()
    by: Any = density
    if density is not None and density != "curvature":
        if isinstance(density, str):
            raise ValueError(f'density: expected a function, "curvature" or None, given {density!r}')
        by = checked(density, "density", field.axes)
    if start is not None:
        start = as_points(start.points if isinstance(start, Samples) else start, field.axes, "start")
    began = time.perf_counter()
    columns = _core.sample(
        field._model,
        n=n,
        spacing=spacing,
        lo=tuple(lo),
        hi=tuple(hi),
        method=method,
        density=by,
        creases=creases,
        seed=seed,
        start=start,
        most=max_samples,
        steps=steps,
        time_limit=time_limit,
        progress=progress,
    )
    samples = Samples(field, columns, time.perf_counter() - began, (lo, hi))
    if samples.report.status == "empty":
        # What the search knows of the reason says more than a guess.
        why = "; ".join(samples.report.warnings) or "check the sign of the field, or pass larger bounds"
        warnings.warn(
            f"there is no surface F = 0 in the bounds {lo.tolist()} to {hi.tolist()}; {why}",
            EmptySurfaceWarning,
            stacklevel=2,
        )
    elif not samples.report.converged:
        warnings.warn(f"not converged: {samples.report.reason}", SamplingWarning, stacklevel=2)
    return samples
