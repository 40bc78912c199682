"""What there is to see of a scene."""

from __future__ import annotations

import base64
import html
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from isoswarm import _core
from isoswarm._arrays import Floats
from isoswarm.drawing import draw
from isoswarm.errors import UnknownPinError
from isoswarm.field import Field, Parameters
from isoswarm.live import Node
from isoswarm.meshing import Mesh
from isoswarm.pins import Floaters, Pin, Transfer
from isoswarm.samples import Samples
from isoswarm.sampling import sample

if TYPE_CHECKING:
    from isoswarm.scene import Scene

__all__ = ["SceneView"]

T = TypeVar("T")


class SceneView:
    """What there is to see of a :class:`Scene`; nothing here changes it."""

    _inner: _core.Scene
    _kept: dict[str, Any]
    _kept_at: tuple[int, int]

    def _start(self, core: _core.Scene) -> None:
        self._inner = core
        # Told after each command: views of the scene.
        self._watchers: list[Callable[[], None]] = []
        self._kept: dict[str, Any] = {}
        self._kept_at = (-1, -1)
        self._live: tuple[Any, _core.LiveMesh] | None = None

    # What there is --------------------------------------------------------------------------------------------

    @property
    def model(self) -> Field:
        """The field with the present parameters: a value of its own, which does not change with the scene."""
        return self._keep("model", lambda: Field(self._inner.model()))

    @property
    def floaters(self) -> Floaters:
        """The particles on the surface as they are now."""
        return Floaters(*self._inner.floaters())

    def mesh(self) -> Mesh:
        """The floaters as they are now, joined by triangles; row by row those of ``floaters``, with the same ids.

        From call to call the mesh follows the floaters: edges are flipped, floaters that have died or been born are
        taken out and put in, and where the topology has changed they are joined anew. Its report leaves out
        what costs time: the distance from the surface, curvatures, self-intersections.

        Examples
        --------
        >>> import isoswarm as iso
        >>> scene = iso.Scene(iso.sphere(r=1), n=500)
        >>> scene.mesh().report.closed
        True

        """
        began = time.perf_counter()
        lo, hi = self._inner.bounds
        if self._live is None or self._live[0] != (lo, hi):
            self._live = ((lo, hi), _core.LiveMesh(lo, hi))
        points, normals, _, ids = self._inner.floaters()
        columns = self._live[1].update(points, normals, ids, self._inner.spacing)
        return Mesh(self.model, columns, time.perf_counter() - began)

    @property
    def pins(self) -> tuple[Pin, ...]:
        """The pins, in the order in which they were made."""
        return tuple(self._pin_of(number) for number, _ in self._inner.pin_names())

    @property
    def clock(self) -> int:
        """Steps taken."""
        return self._inner.clock

    @property
    def spacing(self) -> float:
        """Mean distance between neighbouring floaters that is aimed at, in model units."""
        return self._inner.spacing

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The box (lo, hi) that clips the surface."""
        lo, hi = self._inner.bounds
        return np.array(lo), np.array(hi)

    @property
    def nodes(self) -> tuple[Node, ...]:
        """The parts of the model that can be edited, each before its operands.

        >>> import isoswarm as iso
        >>> scene = iso.Scene("sphere(r=1) | translate(box(1, 1, 1), x=2)", n=200)
        >>> [node.path for node in scene.nodes]
        ['union', 'sphere', 'translate', 'box']

        """
        return self._keep("nodes", lambda: tuple(Node(*row) for row in self._inner.nodes()))

    @property
    def settings(self) -> dict[str, Any]:
        """The settings by name, as the constructor and :meth:`configure` take them."""
        found = json.loads(self._inner.settings())
        amount, focus, bounds = found.pop("amount"), found.pop("focus", None), found.pop("bounds", None)
        return {
            "n": amount.get("count"),
            "spacing": amount.get("spacing"),
            **found,
            "bounds": None if bounds is None else (np.array(bounds[0]), np.array(bounds[1])),
            "focus": None if focus is None else (focus["radius"], focus["factor"]),
        }

    @property
    def is_held(self) -> bool:
        """Whether pins are held: between :meth:`grab` and :meth:`let_go`."""
        return self._inner.is_held

    @property
    def adapting(self) -> Transfer | None:
        """How well the part under an adapter follows it; None where no adapter is on (:meth:`Scene.adapt`)."""
        found = self._inner.transfer()
        return None if found is None else Transfer.of(found)

    @property
    def history(self) -> tuple[int, int]:
        """How many changes can be undone, and redone."""
        return self._inner.history

    @property
    def log(self) -> list[dict[str, Any]]:
        """What has been done, in order, as plain data: what :meth:`replay` takes.

        >>> import isoswarm as iso
        >>> scene = iso.Scene(iso.sphere(r=1), n=200)
        >>> scene.freeze("sphere/*")
        >>> scene.log
        [{'at_step': 0, 'do': 'freeze', 'pattern': 'sphere/*', 'frozen': True}]

        """
        commands: list[dict[str, Any]] = json.loads(self._inner.log())["commands"]
        return commands

    @property
    def samples(self) -> Samples:
        """Even samples of the surface as it is now, with the scene's spacing; see :meth:`sample`."""
        return self._keep("samples", self.sample)

    def sample(self, n: int | None = None, *, spacing: float | None = None, **options: Any) -> Samples:
        """Even samples of the surface as it is now, started from the floaters.

        Parameters
        ----------
        n : int, optional
            Exactly this many.
        spacing : float, optional
            Instead of `n`; if neither is given, the scene's.
        **options
            As for :func:`isoswarm.sample`.

        """
        if n is None and spacing is None:
            spacing = self.spacing
        start = self._inner.floaters()[0]
        given = {"bounds": self.bounds, "seed": self.settings["seed"], "start": start, **options}
        if self.model.axes == 2:
            given["bounds"] = (
                tuple(corner[:2] for corner in self.bounds) if "bounds" not in options else given["bounds"]
            )
        return sample(self.model, n=n, spacing=spacing, **given)

    # Files ----------------------------------------------------------------------------------------------------

    def to_json(self) -> str:
        """Give the text of a file of the scene, as :meth:`save` writes it."""
        return self._inner.to_json()

    def _take(self, text: str) -> None:
        """Become the scene of such a text; what was done before cannot be undone any more."""
        watchers = self._watchers
        self._start(_core.Scene.from_json(text, []))
        self._watchers = watchers

    def show(self, *, height: int = 600) -> Any:
        """Show the scene in a notebook, in the Studio: what is done there is done to it, and the other way round.

        Needs ``pip install "isoswarm[notebook]"``.

        Parameters
        ----------
        height : int
            In pixels.

        Returns
        -------
        Studio
            A widget.

        """
        from isoswarm.studio import Studio

        return Studio(self, height=height)  # type: ignore[arg-type]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene to a file, whole or not at all; :func:`isoswarm.load` reads it back.

        Model, parameters, pins, settings and clock are exact to the last bit. The floaters are not part of it, they
        settle again; nor is the log, see :meth:`save_log`. Functions are stored by name.

        Parameters
        ----------
        path : str or path
            Ends in ``.iso.json``.

        """
        file = Path(path)
        if not file.name.lower().endswith(".iso.json"):
            raise ValueError(f"{file}: expected a file that ends in .iso.json")
        _core.write_bytes(file, self._inner.to_json().encode())

    def save_log(self, path: str | os.PathLike[str]) -> None:
        """Write what has been done as a script for :meth:`replay` and ``isoswarm run``."""
        _core.write_bytes(Path(path), self._inner.log().encode())

    def picture(self, path: str | os.PathLike[str] | None = None, **options: Any) -> bytes:
        """Draw the floaters as lit discs, and the pins as red ones.

        Parameters
        ----------
        path : str or path, optional
            A ``.png`` to write, too.
        **options
            ``width``, ``height``, ``azimuth``, ``elevation``, ``transparent``, ``supersampling`` as for
            :meth:`Samples.picture`; ``frame``, points, (m, 3), that fill the picture instead of the floaters.

        Returns
        -------
        bytes
            The PNG.

        """
        png = draw(self.floaters, *self._inner.marks(), **options)
        if path is not None:
            _core.write_bytes(Path(path), png)
        return png

    # Within ----------------------------------------------------------------------------------------------------

    def _pin_of(self, number: int) -> Pin:
        return Pin(cast("Scene", self), number)

    def _rows(self) -> Parameters:
        return self._keep("parameters", lambda: Parameters(self._inner.parameters()))

    def _pin(self, number: int) -> dict[str, Any]:
        for row in self._inner.pins():
            if row["id"] == number:
                return row
        raise UnknownPinError(f"there is no pin {number}; there are: {_listed(self._inner.pin_names())}")

    def _keep(self, what: str, make: Callable[[], T]) -> T:
        """What is worth keeping until the scene changes."""
        now = (self._inner.given, self._inner.clock)
        if self._kept_at != now:
            self._kept, self._kept_at = {}, now
        if what not in self._kept:
            self._kept[what] = make()
        return self._kept[what]  # type: ignore[no-any-return]

    def __getitem__(self, name: str | int) -> Pin:
        """The pin of that name or number."""
        pins = self._inner.pin_names()
        for number, own in pins:
            if name in (number, own) and name is not None:
                return self._pin_of(number)
        raise UnknownPinError(f"there is no pin {name!r}; there are: {_listed(pins)}")

    def __iter__(self) -> Iterator[Pin]:
        return iter(self.pins)

    # For people -------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        core = self._inner
        counts = [(len(core.parameters()), "parameter"), (len(core.pin_names()), "pin")]
        shown = ", ".join(f"{n} {what}{'s' * (n != 1)}" for n, what in counts)
        held = ", held" * core.is_held
        return f"<Scene: {shown}, {len(core.floaters()[0])} floaters {core.spacing:.4g} apart, step {core.clock}{held}>"

    def _repr_html_(self) -> str:
        picture = base64.b64encode(self.picture(width=480, height=360, supersampling=2)).decode("ascii")
        rows = "".join(
            f"<tr><td style='text-align:left'>{html.escape(path)}</td><td>{p.value:g}</td>"
            f"<td>{'frozen' if p.frozen else ''}</td></tr>"
            for path, p in list(self._rows().items())[:30]
        )
        image = f"<img width='480' height='360' alt='the scene' src='data:image/png;base64,{picture}'>"
        return f"<div>{image}<br><code>{html.escape(repr(self))}</code><table>{rows}</table></div>"


def _listed(pins: list[tuple[int, str | None]]) -> str:
    return ", ".join(f"{number} ({name!r})" if name else str(number) for number, name in pins[:20]) or "none"
