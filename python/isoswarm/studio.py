"""The Studio in a notebook: a widget whose parameters and pins are those of a scene, both ways.

Needs ``pip install "isoswarm[notebook]"``.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

try:
    import anywidget
    import traitlets
except ImportError as error:
    raise ImportError('the Studio in a notebook needs anywidget: pip install "isoswarm[notebook]"') from error

from isoswarm import _core
from isoswarm.serving import studio_file

if TYPE_CHECKING:
    from isoswarm.scene import Scene

__all__ = ["Studio"]


class Studio(anywidget.AnyWidget):
    """The Studio for a scene: what is done there is done to the scene, and the other way round.

    Parameters
    ----------
    scene : Scene
        The scene.
    height : int
        In pixels.

    Attributes
    ----------
    parameters : dict of str to float
        Values by path; can be observed, linked to other widgets, and set.
    pins : list of dict
        ``id``, ``name`` and ``at`` of each pin.

    Examples
    --------
    >>> import isoswarm as iso
    >>> scene = iso.Scene(iso.sphere(r=1), n=200)
    >>> studio = iso.Studio(scene)                                             # doctest: +SKIP
    >>> studio.parameters = {"sphere/r": 1.5}                                  # doctest: +SKIP

    """

    document = traitlets.Unicode().tag(sync=True)
    parameters: traitlets.Dict[str, float] = traitlets.Dict().tag(sync=True)
    pins: traitlets.List[dict[str, Any]] = traitlets.List().tag(sync=True)
    height = traitlets.Int(600).tag(sync=True)
    # Changes made in Python are counted, so that the page takes over these and not its own.
    revision = traitlets.Int(0).tag(sync=True)
    revision_of = traitlets.Unicode("document").tag(sync=True)

    def __init__(self, scene: Scene, *, height: int = 600) -> None:
        self._busy = False
        self._scene = scene
        super().__init__(height=height, **_shared(scene))
        self.observe(self._from_page, ["document", "parameters", "pins"])
        scene._watchers.append(self._from_scene)

    # Not read before it is needed.
    _esm = traitlets.Unicode().tag(sync=True)

    @traitlets.default("_esm")
    def _default_esm(self) -> str:
        return studio_file("widget.js").read_text(encoding="utf-8")

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self._scene

    def close(self) -> None:
        """Take it away; the scene stays."""
        if self._from_scene in self._scene._watchers:
            self._scene._watchers.remove(self._from_scene)
        super().close()

    def _from_scene(self) -> None:
        """The scene has changed in Python."""
        if self._busy:
            return
        self._busy = True
        try:
            now = _shared(self._scene)
            if now == {"document": self.document, "parameters": self.parameters, "pins": self.pins}:
                return
            same = _same_but_values(now["document"], self.document)
            with self.hold_sync():
                self.set_trait("document", now["document"])
                self.set_trait("parameters", now["parameters"])
                self.set_trait("pins", now["pins"])
                self.set_trait("revision_of", "values" if same else "document")
                self.set_trait("revision", self.revision + 1)
        finally:
            self._busy = False

    def _from_page(self, change: Any) -> None:
        """The page, or somebody who sets a trait, has changed something."""
        if self._busy:
            return
        now = _shared(self._scene)
        if change.new == now[change.name]:
            return
        self._busy = True
        try:
            if change.name == "document":
                self._take_document(change.new)
            elif change.name == "parameters":
                known = {k: v for k, v in change.new.items() if v != now["parameters"].get(k)}
                self._scene._do("assign", values=known)
            else:
                moved = [p for p in change.new if p not in now["pins"]]
                self._scene._do("assign", pins=[{"pin": p["id"], "to": p["at"]} for p in moved])
        finally:
            self._busy = False
        if change.name != "document":
            self._from_scene()

    def _take_document(self, text: str) -> None:
        """The page's scene: values where nothing else has changed, so that undo takes them back, else the whole."""
        if _same_but_values(text, self._scene.to_json()):
            model, pins = _values(text)
            self._scene._do("assign", values=model, pins=[{"pin": p["id"], "to": p["at"]} for p in pins])
        else:
            self._scene._take(text)


def _shared(scene: Scene) -> dict[str, Any]:
    """What both sides know."""
    values = {path: p.value for path, p in scene.parameters.now.items() if not p.discrete}
    pins = [{"id": p.id, "name": p.name, "at": p.position.tolist()} for p in scene.pins]
    return {"document": scene.to_json(), "parameters": values, "pins": pins}


def _values(text: str) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """Values and pins of a file of a scene."""
    document = json.loads(text)
    model = _core.Model.from_json(json.dumps(document["model"]), [])
    values = {path: value for path, value, *_, discrete, _unit in model.parameters() if not discrete}
    return values, document.get("pins", [])


def _same_but_values(a: str, b: str) -> bool:
    """Whether two files of scenes differ at most in values of parameters, places of pins, and the clock."""
    return bool(_bare(a) == _bare(b))


def _bare(text: str) -> Any:
    document = json.loads(text)
    pins = [{k: v for k, v in pin.items() if k != "at"} for pin in document.get("pins", [])]
    return {**document, "model": _without_values(document["model"]), "pins": pins, "clock": 0, "spacing": 0}


def _without_values(part: Any) -> Any:
    if isinstance(part, dict):
        return {k: 0 if k == "value" else _without_values(v) for k, v in part.items()}
    if isinstance(part, list):
        return [_without_values(p) for p in part]
    return part
