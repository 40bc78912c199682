"""What can be said about a field: for `isoswarm info`."""

from __future__ import annotations

import math
import warnings
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from isoswarm._arrays import Floats, as_bounds
from isoswarm.certifying import Certificate, grown
from isoswarm.certifying import certify as prove
from isoswarm.errors import SamplingWarning, TooFewError
from isoswarm.field import Field
from isoswarm.samples import Samples
from isoswarm.sampling import sample

__all__ = ["DerivativeCheck", "Diagnosis", "check_derivatives", "diagnose"]


@dataclass(frozen=True)
class DerivativeCheck:
    """Derivatives against central differences.

    Attributes
    ----------
    points : int
        Points looked at.
    gradient : float
        Median over the points of ‖∇F - differences‖ / ‖differences‖. The median, because at a crease the two differ.
    parameters : float
        The same for ∂F/∂q, over the free parameters that were looked at; NaN where there are none.
    ok : bool
        Both are below 1e-4.

    """

    points: int
    gradient: float
    parameters: float

    @property
    def ok(self) -> bool:
        """Whether the derivatives agree with differences."""
        return _agree(self.gradient) and (math.isnan(self.parameters) or _agree(self.parameters))


def _agree(difference: float) -> bool:
    return difference < 1e-4


def _verdict(name: str, difference: float) -> str:
    verdict = "right" if _agree(difference) else f"WRONG: the {name} is not that of the values"
    return f"{verdict} (differ from differences by {difference:.1e})"


@dataclass(frozen=True)
class Diagnosis:
    """What is known about a field.

    Attributes
    ----------
    axes : int
        2 for curves in the plane, 3 for surfaces in space.
    bounds : pair of lists
        The box that was searched.
    components : int
        Connected components found; 0: there is no surface.
    certified : bool
        Whether interval arithmetic has shown that none was missed.
    area : float
        Of the surface, from the samples.
    topology : Certificate or None
        What is proven; None for opaque functions and in the plane.
    derivatives : DerivativeCheck or None
        None where there is no surface.
    parameters : list of dict
        path, value, lowest, highest, state (``"free"`` or ``"frozen"``).

    """

    axes: int
    bounds: tuple[list[float], list[float]]
    components: int
    certified: bool
    area: float
    topology: Certificate | None
    derivatives: DerivativeCheck | None
    parameters: list[dict[str, Any]]

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        plain = asdict(self)
        if self.derivatives is not None:
            plain["derivatives"]["ok"] = self.derivatives.ok
        if self.topology is not None:
            plain["topology"] = self.topology.as_dict()
        return plain

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        lo, hi = self.bounds
        certified = "certified" if self.certified else "not certified"
        rows = [
            ("axes", str(self.axes)),
            ("bounds", f"{[float(f'{v:.6g}') for v in lo]} to {[float(f'{v:.6g}') for v in hi]}"),
            ("components", f"{self.components} ({certified})"),
            ("parameters", str(len(self.parameters))),
        ]
        if self.topology is not None:
            rows.append(("topology", str(self.topology)))
        check = self.derivatives
        if check is not None:
            rows.append(("area", f"{self.area:.6g}"))
            rows.append(("derivatives", _verdict("gradient", check.gradient)))
            if not np.isnan(check.parameters):
                rows.append(("parameter derivatives", _verdict("parameter gradient", check.parameters)))
        return rows


BOXES = 200_000
"""Most boxes in which the topology is looked at, unless more are asked for."""
WORK = 40_000_000
"""Most operations in all of these, each for a box."""


def diagnose(field: Field, *, bounds: Any = None, seed: int = 0, n: int = 2000, boxes: int | None = None) -> Diagnosis:
    """Look at a field: where its surface is, in how many components, and whether its derivatives are right.

    Parameters
    ----------
    field : Field
        The field.
    bounds : pair of corners or float, optional
        Where to look; by default ``field.bounds``.
    seed : int
        Of every random choice.
    n : int
        Samples used; more are taken if there are more components.
    boxes : int, optional
        How much may be done to prove the topology: see :func:`isoswarm.certify`. By default 200,000, or fewer where
        the field has many operations, so that it takes seconds.

    """
    lo, hi = as_bounds(bounds, field.axes) if bounds is not None else field.require_bounds()
    box = (lo, hi) if field.axes == 3 else (lo[:2], hi[:2])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SamplingWarning)
        try:
            samples: Samples = sample(field, n=n, bounds=box, seed=seed)
        except TooFewError as error:
            samples = sample(field, n=4 * error.components, bounds=box, seed=seed)
    report = samples.report
    if boxes is None:
        boxes = min(BOXES, WORK // max(1, field._model.operations))
    return Diagnosis(
        axes=field.axes,
        bounds=(lo.tolist(), hi.tolist()),
        components=report.components,
        certified=report.certified,
        area=report.area,
        topology=_topology(field, box, boxes) if len(samples) else None,
        derivatives=check_derivatives(field, samples.points[:: max(1, len(samples) // 200)]) if len(samples) else None,
        parameters=[
            {
                "path": path,
                "value": p.value,
                "lowest": p.bounds[0],
                "highest": p.bounds[1],
                "state": "frozen" if p.frozen else "free",
            }
            for path, p in field.parameters.items()
        ],
    )


def _topology(field: Field, box: tuple[Floats, Floats], boxes: int) -> Certificate | None:
    """What can be proven within the box and a little around it."""
    if field.axes != 3:
        return None
    try:
        return prove(field, bounds=grown(*box), boxes=boxes)
    except ValueError:  # no intervals
        return None


def check_derivatives(field: Field, X: Floats, most_parameters: int = 50) -> DerivativeCheck:
    """Compare ∇F and ∂F/∂q with central differences.

    Parameters
    ----------
    field : Field
        The field.
    X : ndarray, (n, 3)
        Where; n ≥ 1.
    most_parameters : int
        So many parameters are looked at, spread over all.

    """
    step = 1e-6 * max(float(np.ptp(X, axis=0).max()), 1e-6)
    differences = np.zeros_like(X)
    for axis in range(field.axes):
        aside = np.zeros(3)
        aside[axis] = step
        differences[:, axis] = (field.value(X + aside) - field.value(X - aside)) / (2.0 * step)
    return DerivativeCheck(
        points=len(X),
        gradient=_disagreement(field.gradient(X), differences),
        parameters=_check_parameters(field, X, most_parameters),
    )


def _check_parameters(field: Field, X: Floats, most: int) -> float:
    free = [(path, p) for path, p in field.parameters.items() if not p.frozen and not p.discrete]
    looked_at = [(i, *row) for i, row in enumerate(free)][:: max(1, len(free) // most)]
    columns, differences = [], []
    for column, path, p in looked_at:
        step = 1e-6 * max(abs(p.value), 1e-3 * p.scale)
        high, low = min(p.value + step, p.bounds[1]), max(p.value - step, p.bounds[0])
        if high > low:  # otherwise its limits leave it no room
            above = field.with_parameters({path: high}).value(X)
            below = field.with_parameters({path: low}).value(X)
            columns.append(column)
            differences.append((above - below) / (high - low))
    if not columns:
        return float("nan")
    return _disagreement(field.parameter_gradient(X)[:, columns], np.stack(differences, axis=1))


def _disagreement(given: Floats, expected: Floats) -> float:
    """Median of the relative differences of rows; rows that both vanish agree."""
    scale = np.linalg.norm(expected, axis=1) + 1e-9 * (1.0 + np.abs(expected).max())
    return float(np.median(np.linalg.norm(given - expected, axis=1) / scale))
