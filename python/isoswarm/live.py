"""The parameters and nodes of a scene, as they are now."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from isoswarm.errors import UnknownParameterError
from isoswarm.field import Parameter, Parameters

if TYPE_CHECKING:
    from isoswarm.scene_edit import EditableScene

__all__ = ["Node", "SceneParameter", "SceneParameters"]


@dataclass(frozen=True)
class Node:
    """A part of a model that can be edited.

    Attributes
    ----------
    path : str
        Where it is: names of the named nodes above and its own, joined by ``/``; the paths of its
        parameters begin with it.
    kind : str
        Such as ``"sphere"`` or ``"union"``.
    name : str or None
        Its name, if it has one.
    level : int
        Nodes on the way from the root to it.
    operands : int
        How many it has.

    """

    path: str
    kind: str
    name: str | None
    level: int
    operands: int


class SceneParameter:
    """A parameter of a scene as it is now; what is set becomes a change of the scene that can be undone."""

    __slots__ = ("_path", "_scene")

    def __init__(self, scene: EditableScene, path: str) -> None:
        self._scene = scene
        self._path = path

    @property
    def path(self) -> str:
        """Its path in the model."""
        return self._path

    @property
    def value(self) -> float:
        """Present value; to set it moves the surface, and pins that it leaves behind draw it back at the next step."""
        return self._now.value

    @value.setter
    def value(self, value: float) -> None:
        self._scene._set(self._path, value)

    @property
    def frozen(self) -> bool:
        """Whether drags and fits leave it alone."""
        return self._now.frozen

    @frozen.setter
    def frozen(self, frozen: bool) -> None:
        (self._scene.freeze if frozen else self._scene.release)(self._path)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value; infinite where there is none."""
        return self._now.bounds

    @bounds.setter
    def bounds(self, bounds: tuple[float, float]) -> None:
        lowest, highest = bounds
        self._scene.limit(self._path, lowest, highest)

    @property
    def scale(self) -> float:
        """A typical change, against which steps are measured."""
        return self._now.scale

    @scale.setter
    def scale(self, scale: float) -> None:
        self._scene._scale(self._path, scale)

    @property
    def discrete(self) -> bool:
        """A whole number, which drags and fits do not move."""
        return self._now.discrete

    @property
    def unit(self) -> str:
        """``"length"``, ``"angle"``, …; empty for a pure number."""
        return self._now.unit

    @property
    def _now(self) -> Parameter:
        rows = self._scene._rows()
        if self._path not in rows:
            raise UnknownParameterError(f"the model no longer has a parameter `{self._path}`")
        return rows[self._path]

    def __repr__(self) -> str:
        p = self._now
        limits = f" in [{p.bounds[0]:g}, {p.bounds[1]:g}]" if any(map(math.isfinite, p.bounds)) else ""
        return f"<{self._path} = {p.value:g}{limits}{' (frozen)' * p.frozen}>"


class SceneParameters(Mapping[str, SceneParameter]):
    """Path to :class:`SceneParameter`, in the order of q.

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.torus(major=1, minor=0.3), n=200)
    >>> scene.parameters["torus/minor"].value = 0.4
    >>> scene.parameters["torus/major"].frozen = True
    >>> scene.parameters
    2 parameters
      torus/major = 1 (frozen)
      torus/minor = 0.4

    """

    def __init__(self, scene: EditableScene) -> None:
        self._scene = scene

    def __getitem__(self, path: str) -> SceneParameter:
        rows = self._scene._rows()
        if path not in rows:
            known = ", ".join(list(rows)[:20])
            raise UnknownParameterError(f"there is no parameter `{path}`; there are: {known or 'none'}")
        return SceneParameter(self._scene, path)

    def __iter__(self) -> Iterator[str]:
        return iter(self._scene._rows())

    def __len__(self) -> int:
        return len(self._scene._rows())

    def __contains__(self, path: object) -> bool:
        return path in self._scene._rows()

    def __repr__(self) -> str:
        return repr(self._scene._rows())

    @property
    def now(self) -> Parameters:
        """All of them as they are now, as a value that does not change with the scene."""
        return self._scene._rows()
