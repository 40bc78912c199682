"""Changes of a scene's model and settings, and back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, SupportsFloat

from isoswarm._arrays import as_count
from isoswarm._requests import Watch, as_bound, as_json, as_number, as_settings
from isoswarm.field import Field
from isoswarm.live import SceneParameters
from isoswarm.pins import Progress
from isoswarm.scene_view import SceneView

__all__ = ["EditableScene"]


class EditableScene(SceneView):
    """A :class:`Scene` as far as its model and settings go: each change is logged and can be undone."""

    @property
    def parameters(self) -> SceneParameters:
        """All parameters by path; their ``value``, ``frozen``, ``bounds`` and ``scale`` can be set."""
        return SceneParameters(self)

    # Parameters -------------------------------------------------------------------------------------------------

    def freeze(self, *paths: str) -> None:
        """Lock parameters, bit for bit, against drags and fits (``*`` stands for anything; none given: all)."""
        for pattern in paths or ("*",):
            self._do("freeze", pattern=pattern, frozen=True)

    def release(self, *paths: str) -> None:
        """Let drags and fits move parameters again (``*`` stands for anything; none given: all)."""
        for pattern in paths or ("*",):
            self._do("freeze", pattern=pattern, frozen=False)

    def limit(self, path: str, lowest: float | None = None, highest: float | None = None) -> None:
        """Give parameters bounds (``*`` stands for anything); None or infinite: no bound."""
        bounds = [as_bound(v) for v in (lowest, highest)]
        self._do("limit", pattern=path, bounds=bounds)

    def rest(self) -> None:
        """Take the present shape as the one to which the setting ``recovery`` leads back."""
        self._do("rest")

    def configure(self, **settings: Any) -> None:
        """Change settings, by the names and with the meaning that the constructor gives them.

        >>> import isoswarm as iso
        >>> scene = iso.Scene(iso.sphere(r=1), n=200)
        >>> scene.configure(recovery=0.1, focus=(0.3, 0.5))
        >>> scene.settings["recovery"]
        0.1

        """
        now = json.loads(self._inner.settings())
        self._do("settings", settings=as_settings(now, settings, self._inner.axes))

    # The tree ---------------------------------------------------------------------------------------------------

    def add(self, path: str, part: Field | str, *, name: str | None = None) -> None:
        """Add a part: another operand of the operator at `path`, or the union of the node there and the part.

        Parameters
        ----------
        path : str
            A node (:attr:`nodes`); "" for the whole.
        part : Field or str
            The part; a string is a formula.
        name : str, optional
            Its name in the model.

        Examples
        --------
        >>> import isoswarm as iso
        >>> scene = iso.Scene(iso.sphere(r=1), n=200)
        >>> scene.add("", iso.sphere(r=0.4).translate(x=3), name="moon")
        >>> list(scene.parameters)
        ['sphere/r', 'moon/x', 'moon/y', 'moon/z', 'moon/sphere/r']

        """
        self._do("add", path=path, model=self._part(part), name=name)

    def replace(self, path: str, part: Field | str) -> None:
        """Put another part at a path ("" for the whole)."""
        self._do("replace", path=path, model=self._part(part))

    def remove(self, path: str) -> None:
        """Take a part out, and the pins on it."""
        self._do("remove", path=path)

    def hide(self, path: str, hidden: bool = True) -> None:
        """Leave a part out of the operator above it, or take it in again (``hidden=False``).

        The model is as if the part had been removed, and pins on it go; its parameters stay, and come back with it.
        (``scene.undo()`` brings the pins back.)

        >>> import isoswarm as iso
        >>> scene = iso.Scene("sphere(r=1) | translate(sphere(r=0.5), x=1)", n=200)
        >>> scene.hide("translate")
        >>> scene.parameters["translate/x"].value
        1.0
        >>> scene.hide("translate", hidden=False)

        """
        self._do("hide", path=path, hidden=hidden)

    def wrap(self, path: str, kind: str, *, name: str | None = None, **parameters: SupportsFloat) -> None:
        """Put a part inside an operator on one operand, such as ``"twist"`` or ``"translate"``.

        Parameters
        ----------
        path : str
            The part; "" for the whole.
        kind : str
            The operator, see :mod:`isoswarm.shapes`.
        name : str, optional
            Its name in the model.
        **parameters : float
            Its parameters; those not given are as the operator has them.

        """
        values = {key: as_number(value, key) for key, value in parameters.items()}
        self._do("wrap", path=path, kind=kind, parameters=values, name=name)

    def unwrap(self, path: str) -> None:
        """Take an operator off its only operand."""
        self._do("unwrap", path=path)

    def rename(self, path: str, name: str) -> None:
        """Give a node a name of letters, digits and ``_``; an empty one takes it away."""
        self._do("rename", path=path, name=name)

    def duplicate(self, path: str, *, name: str | None = None) -> None:
        """Put a copy of a part beside it, with parameters of its own; `name` is the copy's.

        >>> import isoswarm as iso
        >>> scene = iso.Scene("sphere(r=1) | translate(sphere(r=0.5), x=1)", n=200)
        >>> scene.duplicate("translate", name="twin")
        >>> scene.parameters["twin/x"].value = -1
        >>> sorted(scene.parameters.now)[-4:]
        ['twin/sphere/r', 'twin/x', 'twin/y', 'twin/z']

        """
        self._do("duplicate", path=path, name=name)

    def reorder(self, path: str, order: Sequence[int]) -> None:
        """Put the operands of a node into another order: the present place of each."""
        self._do("reorder", path=path, order=[as_count(i, "order") for i in order])

    # Back and forth -----------------------------------------------------------------------------------------------

    def undo(self) -> None:
        """Take back the last change of the model, the parameters, the pins or the settings, to the last bit.

        Raises
        ------
        SceneStateError
            There is nothing to undo.

        """
        self._do("undo")

    def redo(self) -> None:
        """Make it again, to the last bit."""
        self._do("redo")

    # Within -----------------------------------------------------------------------------------------------------

    def _set(self, path: str, value: float) -> None:
        self._do("set", path=path, value=as_number(value, path))

    def _scale(self, path: str, scale: float) -> None:
        self._do("scale", pattern=path, scale=as_number(scale, "scale"))

    def _do(
        self, what: str, progress: Progress | None = None, every: int | None = None, **arguments: Any
    ) -> dict[str, Any]:
        return self._carry_out(as_json({"do": what, **arguments}), Watch(progress), every)

    def _carry_out(self, command: str, watch: Watch, every: int | None) -> dict[str, Any]:
        if every is not None and as_count(every, "every") == 0:
            raise ValueError("every: expected a number of steps from 1, given 0")
        done = self._inner.apply(command, watch.function, every)
        for watcher in self._watchers:
            watcher()
        return done

    def _part(self, part: Field | str) -> str:
        if isinstance(part, str):
            return part
        if not isinstance(part, Field):
            raise TypeError(f"part: expected a Field or a formula, given {type(part).__name__}")
        self._inner.learn(part._model)
        return part._model.to_json()
