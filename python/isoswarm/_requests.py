"""What a scene is asked for, as the core takes it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat

import numpy as np

from isoswarm import _core
from isoswarm._arrays import as_bounds, as_count, as_floats, as_seed
from isoswarm.field import Field
from isoswarm.pins import Floaters, Moment, Progress

if TYPE_CHECKING:
    from isoswarm.scene import Scene

Loss = Literal["squares"] | tuple[Literal["huber", "cauchy", "soft_l1"], float]
"""What a distance costs in a fit."""


class Watch:
    """A progress function as the core calls it, for one of several commands."""

    def __init__(self, progress: Progress | None, command: int = 0, commands: int = 1) -> None:
        self._progress = progress
        self._place = (command, commands)
        self.ended = False
        self.function = None if progress is None else self._call

    def _call(
        self, steps: int, most: int, remaining: float, clock: int, columns: Any, marks: Any, model: _core.Model
    ) -> bool:
        assert self._progress is not None
        pins, normals = marks
        moment = Moment(
            steps, most, remaining, clock, Floaters(*columns), pins, normals, *self._place, model=Field(model)
        )
        self.ended = self._progress(moment) is False
        return not self.ended

    def after(self, scene: Scene) -> bool:
        """Tell of the state after the command; whether to go on."""
        if self._progress is None:
            return True
        core = scene._inner
        self._place = (self._place[0] + 1, self._place[1])
        return self._call(0, 0, 0.0, core.clock, core.floaters(), core.marks(), core.model())


def as_json(value: Any) -> str:
    return json.dumps(value, allow_nan=False)


def as_number(value: SupportsFloat, what: str) -> float:
    return float(as_floats(what, value, ()))  # type: ignore[arg-type]


def as_length(radius: float | None) -> float | None:
    return None if radius is None else as_number(radius, "radius")


def as_bound(value: float | None) -> float | None:
    return None if value is None or value in (np.inf, -np.inf) else as_number(value, "bounds")


def as_loss(loss: Loss) -> Any:
    if loss == "squares":
        return "squares"
    if isinstance(loss, tuple) and len(loss) == 2 and loss[0] in ("huber", "cauchy", "soft_l1"):
        return {loss[0]: as_number(loss[1], "loss")}
    raise ValueError(f'loss: expected "squares", or "huber", "cauchy" or "soft_l1" with a length, given {loss!r:.60}')


def as_settings(settings: dict[str, Any], changes: dict[str, Any], axes: int) -> dict[str, Any]:
    """Settings as the core takes them, with changes as Python has them."""
    settings = dict(settings)
    for key, value in changes.items():
        if key == "n":
            settings["amount"] = {"count": as_count(value, key)}
        elif key == "spacing":
            settings["amount"] = {"spacing": as_number(value, key)}
        elif key == "seed":
            settings["seed"] = as_seed(value)
        elif key == "bounds":
            settings["bounds"] = None if value is None else [c.tolist() for c in as_bounds(value, axes)]
        elif key in ("gain", "speed", "recovery", "curvature"):
            settings[key] = as_number(value, key)
        elif key == "follow":
            settings[key] = bool(value)
        elif key == "focus":
            settings["focus"] = None
            if value is not None:
                radius, factor = as_floats("focus", value, (2,)).tolist()
                settings["focus"] = {"radius": radius, "factor": factor}
        else:
            known = "n, spacing, seed, bounds, gain, speed, recovery, curvature, follow, focus"
            raise TypeError(f"there is no setting {key!r}; there are: {known}")
    return settings
