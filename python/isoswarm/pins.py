"""What a person holds of a scene, and how it went: pins, drags, fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from isoswarm._arrays import Floats

if TYPE_CHECKING:
    from isoswarm.field import Field
    from isoswarm.scene import Scene

__all__ = ["DragResult", "FitResult", "Floaters", "Moment", "Pin", "PinLike", "Progress", "Transfer"]


class Pin:
    """A point of a scene through which the surface passes. Made by :meth:`Scene.pin`.

    It is known by its number: a pin equals that number, and is found under it in a dictionary.

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.sphere(r=1))
    >>> top = scene.pin((0, 0, 1), name="top")
    >>> top
    <Pin 0 'top' at (0, 0, 1)>
    >>> top == 0, top.weight, top.distance < 1e-9
    (True, 1.0, True)

    """

    __slots__ = ("_id", "_scene")

    def __init__(self, scene: Scene, number: int) -> None:
        self._scene = scene
        self._id = number

    @property
    def scene(self) -> Scene:
        """The scene that it belongs to."""
        return self._scene

    @property
    def id(self) -> int:
        """Its number, never used twice in a scene."""
        return self._id

    @property
    def name(self) -> str | None:
        """The name that it was given."""
        return self._read()["name"]  # type: ignore[no-any-return]

    @property
    def position(self) -> Floats:
        """Where it is, (3,)."""
        return np.array(self._read()["position"])

    @property
    def distance(self) -> float:
        """How far the surface is from it, abs(F)/‖∇F‖, in model units."""
        return self._read()["distance"]  # type: ignore[no-any-return]

    @property
    def weight(self) -> float:
        """What it counts beside pins that contradict it: w² times its squared distance is made small."""
        return self._read()["weight"]  # type: ignore[no-any-return]

    @property
    def softness(self) -> float:
        """0: met exactly where possible; above 0: missed at a cost."""
        return self._read()["softness"]  # type: ignore[no-any-return]

    @property
    def grip(self) -> float | None:
        """Radius of the patch of the surface that moves with it, in model units."""
        return self._read()["grip"]  # type: ignore[no-any-return]

    @property
    def line(self) -> Floats | None:
        """Direction of the line along which it may give way, of length 1."""
        return self._direction("line")

    @property
    def plane(self) -> Floats | None:
        """Normal of the plane in which it may give way, of length 1."""
        return self._direction("plane")

    @property
    def exists(self) -> bool:
        """Whether the scene still has it."""
        return any(number == self._id for number, _ in self._scene._inner.pin_names())

    def remove(self) -> None:
        """Take it out of the scene, as :meth:`Scene.unpin`."""
        self._scene.unpin(self)

    def _direction(self, what: str) -> Floats | None:
        direction = self._read()[what]
        return None if direction is None else np.array(direction)

    def _read(self) -> dict[str, Any]:
        return self._scene._pin(self._id)

    def __index__(self) -> int:
        return self._id

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Pin):
            return self._id == other._id and self._scene is other._scene
        return self._id == other if isinstance(other, int) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._id)

    def __repr__(self) -> str:
        if not self.exists:
            return f"<Pin {self._id}, removed>"
        row = self._read()
        name = f" {row['name']!r}" if row["name"] else ""
        return f"<Pin {self._id}{name} at ({', '.join(f'{v + 0.0:.4g}' for v in row['position'])})>"


PinLike = Pin | str | int
"""A pin, its name, or its number."""


@dataclass(frozen=True)
class Floaters:
    """The particles of a scene at one moment; all columns have the same length n.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Positions, in model units: near the surface while it moves, on it when it rests.
    normals : ndarray, (n, 3)
        Outward unit normals.
    radii : ndarray, (n,)
        Radius of the disc that each keeps free, in model units.
    ids : ndarray of uint64, (n,)
        Identities, never used twice: what moves on keeps its own.

    """

    points: Floats = field(repr=False)
    normals: Floats = field(repr=False)
    radii: Floats = field(repr=False)
    ids: npt.NDArray[np.uint64] = field(repr=False)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        return f"<Floaters: {len(self)}, radius {float(np.mean(self.radii)):.4g}>"


@dataclass(frozen=True)
class Moment:
    """What a progress function is told: how far a command has come, and what there is to draw.

    Attributes
    ----------
    steps : int
        Steps of this command so far.
    most : int
        The most it may take.
    remaining : float
        Distance between the pins and where they are dragged to (of a fit: root mean square distance), in model units.
    clock : int
        Steps of the scene.
    floaters : Floaters
        The particles.
    pins : ndarray, (k, 3)
        Positions of the pins, in the order of ``scene.pins``.
    pin_normals : ndarray, (k, 3)
        Gradients of the field there.
    command, commands : int
        In a replay: how many commands have been carried out, of so many.
    model : Field or None
        The model with its present parameters: a value of its own, which does not change any more.

    """

    steps: int
    most: int
    remaining: float
    clock: int
    floaters: Floaters
    pins: Floats = field(repr=False)
    pin_normals: Floats = field(repr=False)
    command: int = 0
    commands: int = 1
    model: Field | None = field(default=None, repr=False)


Progress = Callable[[Moment], object]
"""Called with a :class:`Moment`. ``False`` ends the command where it is; an exception ends it and comes out."""


@dataclass(frozen=True)
class DragResult:
    """How a drag went; lengths in model units.

    Attributes
    ----------
    reached : bool
        Whether all dragged pins are where they were dragged to.
    ending : {"reached", "stuck", "step limit", "released", "cancelled"}
        Why it ended; stuck: the model, its limits or other pins do not allow more.
    distance : float
        Largest distance between a dragged pin and where it should be.
    rank : int
        Pins that the parameters could meet independently of each other at the end...
    pins : int
        ...of so many.
    residual : float
        Largest distance between a pin and the surface.
    slip : dict
        Pin number to how far that pin has slipped over the surface instead of moving it, (3,): implicit surfaces
        are slippery. A :class:`Pin` is a key, too.
    steps : int
        Steps it took.
    at_limit : tuple of str
        Paths of the parameters that were held back by their bounds at the end.

    """

    reached: bool
    ending: Literal["reached", "stuck", "step limit", "released", "cancelled"]
    distance: float
    rank: int
    pins: int
    residual: float
    slip: dict[int, Floats]
    steps: int
    at_limit: tuple[str, ...]

    @classmethod
    def of(cls, found: dict[str, Any]) -> DragResult:
        """From what the core gives."""
        slip = {number: np.array(v) for number, v in found["slip"]}
        return cls(**{**found, "slip": slip, "at_limit": tuple(found["at_limit"])})

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        slipped = {number: float(np.linalg.norm(v)) for number, v in self.slip.items()}
        rows = [
            ("ending", f"{self.ending} after {self.steps} steps"),
            ("off its target", f"{self.distance:.3g}"),
            ("off the surface", f"{self.residual:.2g} at most"),
            ("rank", f"{self.rank} of {self.pins} pins"),
        ]
        if any(slipped.values()):
            rows.append(("slipped", ", ".join(f"pin {k} by {v:.3g}" for k, v in slipped.items())))
        if self.at_limit:
            rows.append(("at a limit", ", ".join(self.at_limit)))
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        plain = {name: getattr(self, name) for name in self.__dataclass_fields__}
        slip = {str(number): v.tolist() for number, v in self.slip.items()}
        return plain | {"slip": slip, "at_limit": list(self.at_limit)}

    def __str__(self) -> str:
        return "\n".join(f"{name + ':':<18}{value}" for name, value in self.rows())

    def __repr__(self) -> str:
        left = "" if self.reached else f", {self.distance:.3g} left"
        limit = f", held back by {', '.join(self.at_limit)}" if self.at_limit else ""
        slip = max((float(np.linalg.norm(v)) for v in self.slip.values()), default=0.0)
        return (
            f"<DragResult: {self.ending} in {self.steps} steps{left}, rank {self.rank} of {self.pins}, "
            f"slip {slip:.3g}{limit}>"
        )


@dataclass(frozen=True)
class FitResult:
    """How a fit went; lengths in model units.

    Attributes
    ----------
    converged : bool
        Whether the parameters are the best nearby.
    reason : str
        Why it ended.
    rms : float
        Root of the mean square distance between the surface and the given points, whatever the loss. Weights count
        squared; pins, and points that were left out, do not count.
    largest : float
        The largest distance of these points.
    rank : int
        Parameters, or combinations of them, that the points determine...
    freedom : int
        ...of so many free ones.
    iterations : int
        Steps taken or tried.
    at_limit : tuple of str
        Paths of the parameters that ended at a bound and would go on.
    skipped : int
        Points that were left out: of weight 0, or where F has no gradient.

    """

    converged: bool
    reason: str
    rms: float
    largest: float
    rank: int
    freedom: int
    iterations: int
    at_limit: tuple[str, ...]
    skipped: int = 0

    @classmethod
    def of(cls, found: dict[str, Any]) -> FitResult:
        """From what the core gives."""
        return cls(**{**found, "at_limit": tuple(found["at_limit"])})

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        rows = [
            ("ending", f"{self.reason} ({self.iterations} iterations)"),
            ("distance", f"{self.rms:.3g} (root mean square), {self.largest:.3g} at most"),
            ("rank", f"{self.rank} of {self.freedom} parameters"),
        ]
        if self.skipped:
            rows.append(("left out", f"{self.skipped} points of weight 0 or without a gradient"))
        if self.at_limit:
            rows.append(("at a limit", ", ".join(self.at_limit)))
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        plain = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return plain | {"at_limit": list(self.at_limit)}

    def __str__(self) -> str:
        return "\n".join(f"{name + ':':<18}{value}" for name, value in self.rows())

    def __repr__(self) -> str:
        return (
            f"<FitResult: {self.reason}, rms {self.rms:.3g}, largest {self.largest:.3g}, "
            f"rank {self.rank} of {self.freedom}, {self.iterations} iterations>"
        )


@dataclass(frozen=True)
class Transfer:
    """How well a part takes on the effect of an adapter or operator; lengths in model units.

    Attributes
    ----------
    rms : float
        Root mean square distance between the part's surface and the deformed one.
    largest : float
        The largest such distance.
    relative : float
        The largest distance as a part of the size: how far off the part is.
    rank : int
        Parameters of the part, or combinations of them, that the deformation determines...
    freedom : int
        ...of so many free ones.
    at_limit : tuple of str
        Paths within the part of the parameters that are at a bound and would go on.

    """

    rms: float
    largest: float
    relative: float
    rank: int
    freedom: int
    at_limit: tuple[str, ...]

    @classmethod
    def of(cls, found: dict[str, Any]) -> Transfer:
        """From what the core gives."""
        return cls(**{**found, "at_limit": tuple(found["at_limit"])})

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        plain = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return plain | {"at_limit": list(self.at_limit)}

    def __repr__(self) -> str:
        limit = f", held back by {', '.join(self.at_limit)}" if self.at_limit else ""
        return (
            f"<Transfer: {self.largest:.3g} off at most ({self.relative:.2g} of the size), "
            f"rank {self.rank} of {self.freedom}{limit}>"
        )
