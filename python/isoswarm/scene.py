"""A model being edited: control points are dragged, and its parameters follow."""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import as_count, as_floats, as_points
from isoswarm._requests import Loss, Watch, as_json, as_length, as_loss, as_number, as_settings
from isoswarm.adapters import Adapter, Adapting
from isoswarm.field import Field
from isoswarm.pins import DragResult, FitResult, Pin, PinLike, Progress, Transfer
from isoswarm.scene_edit import EditableScene
from isoswarm.script import checked_commands, read_script

__all__ = ["Scene"]

Result = Pin | DragResult | FitResult | Transfer | None
"""What a command gives."""


class Scene(EditableScene):
    """A model being edited: its tree and parameters, floaters on its surface, pins, settings and a clock.

    Take hold of the surface with :meth:`pin` and move it with :meth:`drag`: the free parameters follow, so that the
    surface goes on passing through every pin. Every change can be undone, is logged, and replays to the same bits.
    Where a change cannot be made, the scene stays as it was.

    Parameters
    ----------
    model : Field or str
        The surface; a string is a formula.
    spacing : float, optional
        Mean distance between neighbouring floaters, in model units.
    n : int, optional
        Instead of `spacing`: about this many floaters on the surface as it is at first; 1000 if neither is given.
    seed : int
        Of every random choice.
    bounds : pair of corners or float, optional
        The box that clips the surface; by default it is found, and found anew while the model changes.
    gain : float, optional
        Part of the way to its target that a dragged pin goes in a step, above 0 to 1; by default 0.4.
    speed : float, optional
        Longest way of a dragged pin in a step as a part of the model's diameter, above 0 to 0.25; by default 0.02.
    recovery : float, optional
        Part of the way back to the rest shape (:meth:`rest`) in a step, 0 to 1; by default 0, it stays.
    curvature : float, optional
        Denser floaters where the surface bends, 0 to 1; by default 0, the same everywhere. At 1 their number per area
        grows with the square of the curvature, between one quarter and four times that of uniform ones.
    follow : bool, optional
        Whether floaters go along with the surface where it moves, keeping their normals, as if painted on it; see
        :func:`surface_velocity`. By default they take the shortest way to where it is.
    focus : pair of float, optional
        ``(radius, factor)``: within about `radius` (model units) of the dragged pins the floaters' spacing is `factor`
        times that elsewhere, above 0 to 1.

    Raises
    ------
    ValueError
        A setting that makes no sense; a surface without end, and no bounds.
    EmptySurfaceError
        There is no surface in the bounds.

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.sphere(r=1), n=300)
    >>> hand = scene.pin((1, 0, 0))
    >>> scene.drag(hand, to=(1.5, 0, 0)).reached
    True
    >>> round(scene.parameters["sphere/r"].value, 6)
    1.5
    >>> scene.undo()
    >>> scene.model.parameters["sphere/r"].value
    1.0

    """

    def __init__(
        self,
        model: Field | str,
        spacing: float | None = None,
        *,
        n: int | None = None,
        seed: int = 0,
        bounds: Any = None,
        gain: float | None = None,
        speed: float | None = None,
        recovery: float | None = None,
        curvature: float | None = None,
        follow: bool | None = None,
        focus: tuple[float, float] | None = None,
    ) -> None:
        if isinstance(model, str):
            model = Field(_core.Model.parse(model, [], 3))
        if not isinstance(model, Field):
            raise TypeError(f"model: expected a Field or a formula, given {type(model).__name__}")
        if n is not None and spacing is not None:
            raise ValueError(f"expected n or spacing, given both (n={n}, spacing={spacing})")
        given = {
            "n": n,
            "spacing": spacing,
            "seed": seed,
            "bounds": bounds,
            "gain": gain,
            "speed": speed,
            "recovery": recovery,
            "curvature": curvature,
            "follow": follow,
            "focus": focus,
        }
        settings = as_settings({}, {key: value for key, value in given.items() if value is not None}, model.axes)
        self._start(_core.Scene(model._model, as_json(settings)))

    @classmethod
    def _of(cls, core: _core.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._start(core)
        return scene

    # Control points ---------------------------------------------------------------------------------------------

    def pin(
        self,
        at: npt.ArrayLike,
        *,
        name: str | None = None,
        weight: float = 1.0,
        softness: float = 0.0,
        line: npt.ArrayLike | None = None,
        plane: npt.ArrayLike | None = None,
        grip: float | None = None,
    ) -> Pin:
        """Make a control point on the surface near a point.

        Parameters
        ----------
        at : array_like, (3,)
            The point, at most a tenth of the model's size off the surface.
        name : str, optional
            To refer to it, as ``scene["hand"]``.
        weight : float
            What it counts beside pins that contradict it, above 0. It acts squared: the sum of w² s² over the pins'
            distances s is made small.
        softness : float
            0: the surface passes through it exactly, if it can. Above 0: missing it by a length s costs as much as
            moving the surface by s/softness everywhere.
        line, plane : array_like, (3,), optional
            Direction of the line, or normal of the plane, along which it may give way.
        grip : float, optional
            Radius, in model units, of a patch of the surface that moves with it: against slipping.

        Returns
        -------
        Pin

        Raises
        ------
        ValueError
            A point far from the surface; a name that another pin has.

        """
        if line is not None and plane is not None:
            raise ValueError("expected line or plane, given both")
        along = None
        if line is not None:
            along = {"line": self._vector(line, "line")}
        if plane is not None:
            along = {"plane": self._vector(plane, "plane")}
        made = self._do(
            "pin",
            at=self._point(at, "at"),
            name=name,
            weight=as_number(weight, "weight"),
            softness=as_number(softness, "softness"),
            along=along,
            grip=None if grip is None else as_number(grip, "grip"),
        )
        return Pin(self, made["pin"])

    def unpin(self, pin: PinLike) -> None:
        """Remove a control point."""
        self._do("unpin", pin=self._reference(pin))

    def drag(
        self,
        hands: PinLike | Mapping[Any, npt.ArrayLike],
        to: npt.ArrayLike | None = None,
        *,
        radius: float | None = None,
        steps: int = 1000,
        progress: Progress | None = None,
        every: int | None = None,
    ) -> DragResult:
        """Drag pins until they arrive or nothing moves any more, let go, and settle.

        Parameters
        ----------
        hands : pin, or mapping of pin to point
            What to drag; a mapping drags several at once.
        to : array_like, (3,)
            Where to, for one pin.
        radius : float, optional
            Radius, in model units, of the region around each pin that follows, less and less towards its edge.
        steps : int
            Most steps.
        progress : callable, optional
            Called with a :class:`Moment` up to 20 times a second; an exception in it ends the drag and comes out,
            ``False`` ends it. Either way, and after Ctrl-C, the scene is where the drag had got to: :meth:`undo`
            takes it back.
        every : int, optional
            Call `progress` whenever the clock is a multiple of this instead.

        Returns
        -------
        DragResult

        Examples
        --------
        >>> import isoswarm as iso
        >>> scene = iso.Scene("translate(sphere(r=1))", n=200)
        >>> west, east = scene.pin((-1, 0, 0)), scene.pin((1, 0, 0))
        >>> result = scene.drag({west: (-1, 0, 0), east: (2, 0, 0)})
        >>> result.reached, result.rank
        (True, 2)
        >>> [round(p.value, 6) for p in scene.parameters.values()]
        [0.5, 0.0, 0.0, 1.5]

        """
        asked = {"hands": self._hands(hands, to), "radius": as_length(radius), "steps": as_count(steps, "steps")}
        return DragResult.of(self._do("drag", progress, every, **asked)["drag"])

    def turn(
        self,
        pins: Sequence[PinLike],
        *,
        centre: npt.ArrayLike,
        rotation: npt.ArrayLike = (0.0, 0.0, 0.0),
        translation: npt.ArrayLike = (0.0, 0.0, 0.0),
        steps: int = 1000,
        progress: Progress | None = None,
        every: int | None = None,
    ) -> DragResult:
        """Turn and move several pins together, as a handle does.

        Parameters
        ----------
        pins : sequence of pins
            What to move.
        centre : array_like, (3,)
            What stays in place under the rotation.
        rotation : array_like, (3,)
            Axis times angle, in radians.
        translation : array_like, (3,)
            Added to it, in model units.
        steps, progress, every
            As for :meth:`drag`.

        """
        asked = {
            "pins": [self._reference(p) for p in pins],
            "centre": self._vector(centre, "centre"),
            "rotation": self._vector(rotation, "rotation"),
            "translation": self._vector(translation, "translation"),
            "steps": as_count(steps, "steps"),
        }
        return DragResult.of(self._do("turn", progress, every, **asked)["drag"])

    def grab(
        self,
        hands: PinLike | Mapping[Any, npt.ArrayLike],
        to: npt.ArrayLike | None = None,
        *,
        radius: float | None = None,
    ) -> None:
        """Take hold of pins, or say where those held go now; :meth:`step` moves them, :meth:`let_go` ends it."""
        self._do("grab", hands=self._hands(hands, to), radius=as_length(radius))

    def step(self, count: int = 1, *, progress: Progress | None = None, every: int | None = None) -> None:
        """Let time pass: `count` steps of the floaters, and of the pins where some are held."""
        self._do("step", progress, every, count=as_count(count, "count"))

    def let_go(self) -> DragResult:
        """Let go of what :meth:`grab` holds, and settle."""
        return DragResult.of(self._do("release")["drag"])

    def fit(
        self,
        points: npt.ArrayLike,
        weights: npt.ArrayLike | None = None,
        *,
        loss: Loss = "squares",
        iterations: int = 100,
        progress: Progress | None = None,
        every: int | None = None,
    ) -> FitResult:
        """Move the free parameters until the surface passes through points, as well as it can.

        Parameters
        ----------
        points : array_like, (n, 3)
            The points. Pins count as points too, much more than these.
        weights : array_like, (n,), optional
            What each counts, 0 or more: the sum of w² s² over the distances s is made small.
        loss : "squares" or (name, length)
            What a distance costs: its square; or, with ``"huber"``, ``"cauchy"`` or ``"soft_l1"`` and a length in
            model units, less than that beyond the length, so that points that are far off count little.
        iterations : int
            Most iterations.
        progress, every
            As for :meth:`drag`.

        Returns
        -------
        FitResult

        Examples
        --------
        >>> import isoswarm as iso
        >>> wanted = iso.sample(iso.ellipsoid(1.3, 0.9, 1.1), n=200)
        >>> scene = iso.Scene(iso.ellipsoid(1, 1, 1), n=200)
        >>> scene.fit(wanted.points).converged
        True
        >>> [round(p.value, 6) for p in scene.parameters.values()]
        [1.3, 0.9, 1.1]

        """
        X = as_points(points, self._inner.axes, "points")
        each = [] if weights is None else as_floats("weights", weights, (len(X),)).tolist()
        asked = {
            "points": X.tolist(),
            "weights": each,
            "loss": as_loss(loss),
            "iterations": as_count(iterations, "iterations"),
        }
        return FitResult.of(self._do("fit", progress, every, **asked)["fit"])

    # Adapters ---------------------------------------------------------------------------------------------------

    def adapt(self, path: str, adapter: Adapter) -> Adapting:
        """Put an adapter on a part: pins then move its few parameters, and the part's own parameters follow.

        Parameters
        ----------
        path : str
            The part (:attr:`nodes`); "" for the whole.
        adapter : Adapter
            :class:`Mover`, :class:`Rotate`, :class:`Scale`, :class:`Taper`, :class:`Twist`, :class:`Bend` or
            :class:`Lattice`.

        Returns
        -------
        Adapting
            Drag with it, look at what the part could take on, then accept, keep or cancel.

        Raises
        ------
        SceneStateError
            An adapter is on; the part has no free parameters.

        """
        if not isinstance(adapter, Adapter):
            raise TypeError(f"adapter: expected an adapter such as iso.Bend(), given {adapter!r:.60}")
        self._do("adapt", path=path, **adapter.request())
        return Adapting(self, path, adapter)

    @property
    def adapter(self) -> Adapting | None:
        """The adapter that is on, as :meth:`adapt` gave it, or None; also of a scene that was saved with it."""
        found = self._inner.adapter()
        return None if found is None else Adapting(self, *found)

    def flatten(self, path: str) -> Transfer:
        """Take an operator off its only operand, whose parameters take its effect on.

        Raises
        ------
        SceneStateError
            They cannot: the message says how far off they would be. The operator stays.

        """
        return Transfer.of(self._do("flatten", path=path)["transfer"])

    def replay(
        self,
        script: str | os.PathLike[str] | Sequence[Mapping[str, Any]],
        *,
        progress: Progress | None = None,
        every: int | None = None,
    ) -> list[Result]:
        """Carry out the commands of a script or a log.

        Parameters
        ----------
        script : path, or sequence of mappings
            A file ``{"format": "isoswarm script", "version": 1, "commands": […]}``, or commands as :attr:`log` gives
            them. A command with ``at_step`` waits until the clock is there.
        progress : callable, optional
            As for :meth:`drag`, and once after each command; its :class:`Moment` says which. ``False`` ends the replay.
        every : int, optional
            As for :meth:`drag`.

        Returns
        -------
        list
            What each command gave: a pin, how a drag, a fit or a transfer went, or None.

        Raises
        ------
        FileFormatError
            A malformed script; nothing has been done. Otherwise what the command raised at which the script broke off;
            what stood before it has been done.

        Examples
        --------
        >>> import isoswarm as iso
        >>> scene = iso.Scene(iso.sphere(r=1), n=200)
        >>> pin, drag = scene.replay([
        ...     {"do": "pin", "at": [1, 0, 0], "name": "hand"},
        ...     {"do": "drag", "hands": [{"pin": "hand", "to": [2, 0, 0]}]},
        ... ])
        >>> drag.ending
        'reached'

        """
        if isinstance(script, str | os.PathLike):
            script = read_script(script)
        commands = checked_commands(script)
        results: list[Result] = []
        for k, (at, command) in enumerate(commands):
            watch = Watch(progress, k, len(commands))
            if at is not None and at > self.clock:
                self._carry_out(as_json({"do": "step", "count": at - self.clock}), watch, every)
            if not watch.ended:
                results.append(self._result(self._carry_out(command, watch, every)))
            if watch.ended or not watch.after(self):
                break
        return results

    # Within -----------------------------------------------------------------------------------------------------

    def _result(self, made: dict[str, Any]) -> Result:
        if made["pin"] is not None:
            return Pin(self, made["pin"])
        if made["drag"] is not None:
            return DragResult.of(made["drag"])
        if made["fit"] is not None:
            return FitResult.of(made["fit"])
        if made["transfer"] is not None:
            return Transfer.of(made["transfer"])
        return None

    def _point(self, value: npt.ArrayLike, what: str) -> list[float]:
        if np.ndim(value) != 1:
            raise ValueError(f"{what}: expected one point of {self._inner.axes} numbers, given shape {np.shape(value)}")
        one: Any = [value]
        x, y, z = as_points(one, self._inner.axes, what)[0]
        return [float(x), float(y), float(z)]

    def _vector(self, value: npt.ArrayLike, what: str) -> list[float]:
        x, y, z = as_floats(what, value, (3,))
        return [float(x), float(y), float(z)]

    def _reference(self, pin: PinLike) -> str | int:
        if isinstance(pin, Pin):
            if pin.scene is not self:
                raise ValueError(f"{pin!r} belongs to another scene")
            return pin.id
        if isinstance(pin, str):
            return pin
        if isinstance(pin, bool) or not hasattr(pin, "__index__"):
            raise TypeError(f"pin: expected a Pin, its name or its number, given {pin!r:.60}")
        return operator.index(pin)

    def _hands(self, hands: PinLike | Mapping[Any, npt.ArrayLike], to: npt.ArrayLike | None) -> list[dict[str, Any]]:
        if isinstance(hands, Mapping):
            if to is not None:
                raise ValueError("to: expected within the mapping of pins, given beside it")
            pairs = list(hands.items())
        elif to is None:
            raise ValueError("to: expected a point to drag the pin to, given none")
        else:
            pairs = [(hands, to)]
        return [{"pin": self._reference(pin), "to": self._point(point, "to")} for pin, point in pairs]
