"""Adapters: deformations that are dragged, and hand their effect over to a part's own parameters (HBJF02 section 5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy.typing as npt

from isoswarm._arrays import as_count, as_floats
from isoswarm.errors import SceneStateError
from isoswarm.field import Field
from isoswarm.pins import DragResult, PinLike, Progress, Transfer

if TYPE_CHECKING:
    from isoswarm.scene import Scene

__all__ = ["Adapter", "Adapting", "Bend", "Lattice", "Mover", "Rotate", "Scale", "Taper", "Twist"]

Axis = Literal["x", "y", "z"]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Adapter:
    """A deformation for :meth:`Scene.adapt`: one of the classes below."""

    kind: ClassVar[str] = ""

    def request(self) -> dict[str, Any]:
        """What the core is asked for."""
        found: dict[str, Any] = {"adapter": self.kind}
        for name in ("center", "half"):
            if getattr(self, name, None) is not None:
                found[name] = as_floats(name, getattr(self, name), (3,)).tolist()
        axis = getattr(self, "axis", None)
        if axis is not None:
            if axis not in ("x", "y", "z"):
                raise ValueError(f'axis: expected "x", "y" or "z", given {axis!r:.60}')
            found["axis"] = "xyz".index(axis)
        controls = getattr(self, "controls", None)
        if controls is not None:
            found["controls"] = [as_count(n, "controls") for n in controls]
            if len(found["controls"]) != 3:
                raise ValueError(f"controls: expected three whole numbers, given {controls!r:.60}")
        return found


@dataclass(frozen=True)
class Mover(Adapter):
    """Moves the part: x, y, z."""

    kind: ClassVar[str] = "mover"


@dataclass(frozen=True)
class Rotate(Adapter):
    """Turns the part about `center` (its middle, if not given): a rotation vector."""

    kind: ClassVar[str] = "rotate"
    center: Vector | None = None


@dataclass(frozen=True)
class Scale(Adapter):
    """Stretches the part from `center` (its middle, if not given): three factors."""

    kind: ClassVar[str] = "scale"
    center: Vector | None = None


@dataclass(frozen=True)
class Taper(Adapter):
    """Widens the part along an axis through `center` (its middle, if not given): a rate."""

    kind: ClassVar[str] = "taper"
    axis: Axis = "z"
    center: Vector | None = None


@dataclass(frozen=True)
class Twist(Adapter):
    """Twists the part about an axis through `center` (its middle, if not given): a rate."""

    kind: ClassVar[str] = "twist"
    axis: Axis = "z"
    center: Vector | None = None


@dataclass(frozen=True)
class Bend(Adapter):
    """Bends the part about an axis through `center` (its middle, if not given): a rate, the curvature of the arc.

    The axis is the one that the arc turns about, not the line that bends. For the axis "z" the line along x through
    `center` becomes an arc (towards y), for "x" the line along y (towards z), for "y" the line along z (towards
    x). So a part that is long in z is bent with the axis "y".

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.capsule(r=0.3, h=3), n=200)
    >>> hand = scene.pin((0, 0, 1.8))
    >>> scene.adapt("", iso.Bend(axis="y")).drag(hand, to=(0.2, 0, 1.79)).result.distance < 0.05
    True

    """

    kind: ClassVar[str] = "bend"
    axis: Axis = "z"
    center: Vector | None = None


@dataclass(frozen=True)
class Lattice(Adapter):
    """Free-form deformation: a displacement for each control point of a box.

    Attributes
    ----------
    controls : three int
        Control points along x, y and z.
    center, half : three float, optional
        Middle, and half the size, of the box; by default it lies around the part.

    """

    kind: ClassVar[str] = "lattice"
    controls: tuple[int, int, int] = (3, 3, 3)
    center: Vector | None = None
    half: Vector | None = None


class Adapting:
    """An adapter that is on, from :meth:`Scene.adapt` or :attr:`Scene.adapter`.

    It goes with :meth:`accept`, :meth:`keep` or :meth:`cancel`.

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.quadric(q0=-1, q4=0.25, q6=1, q9=1), n=200)
    >>> hand = scene.pin((0, 0, 1))
    >>> moving = scene.adapt("", iso.Mover()).drag(hand, to=(0, 0, 1.5))
    >>> moving.transfer.relative < 1e-9, moving.transfer.freedom
    (True, 10)
    >>> _ = moving.accept()
    >>> [round(scene.parameters[f"quadric/q{i}"].value, 6) for i in (0, 3, 4)]
    [-0.75, -1.0, 0.25]

    """

    def __init__(self, scene: Scene, path: str, adapter: Adapter | str) -> None:
        self._scene = scene
        self._ended: Transfer | None = None
        self.path = path
        self.adapter = adapter
        self.result: DragResult | None = None
        """How the last drag went."""

    @property
    def transfer(self) -> Transfer:
        """How well the part takes on the effect, now or, when the adapter has gone, at its end."""
        now = self._scene._inner.transfer()
        if now is not None:
            return Transfer.of(now)
        if self._ended is None:
            raise SceneStateError("the adapter has been taken off")
        return self._ended

    @property
    def part(self) -> Field:
        """The part alone, with its parameters as they follow."""
        model = self._scene._inner.adapted()
        if model is None:
            raise SceneStateError("the adapter has been taken off")
        return Field(model)

    def drag(
        self,
        hands: PinLike | Mapping[Any, npt.ArrayLike],
        to: npt.ArrayLike | None = None,
        *,
        radius: float | None = None,
        steps: int = 1000,
        progress: Progress | None = None,
        every: int | None = None,
    ) -> Adapting:
        """Drag pins as :meth:`Scene.drag` does; the adapter's parameters move, the part's own follow.

        Returns
        -------
        Adapting
            Itself; :attr:`result` says how the drag went, :attr:`transfer` what the part could take on.

        """
        asked = {"radius": radius, "steps": steps, "progress": progress, "every": every}
        self.result = self._scene.drag(hands, to, **asked)  # type: ignore[arg-type]
        return self

    def accept(self) -> Transfer:
        """Take the adapter off; the part keeps what its parameters could take on. How well that went."""
        self._ended = Transfer.of(self._scene._do("accept")["transfer"])
        return self._ended

    def keep(self) -> None:
        """Leave the adapter in the model as an operator."""
        self._ended = self._scene.adapting
        self._scene._do("keep")

    def cancel(self) -> None:
        """Take the adapter off; the part is as it was."""
        self._ended = self._scene.adapting
        self._scene._do("cancel")

    def __repr__(self) -> str:
        on = self._scene.adapting
        state = f"the part follows to {on.relative:.2g} of its size, rank {on.rank} of {on.freedom}" if on else "off"
        return f"<Adapting {self.path or 'the whole'!r} by {self.adapter}: {state}>"
