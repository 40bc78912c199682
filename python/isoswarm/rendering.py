"""Pictures of surfaces by ray casting, with points and meshes in them; turntables."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds, as_floats, as_points
from isoswarm.drawing import PIN
from isoswarm.errors import EmptySurfaceWarning
from isoswarm.field import Field
from isoswarm.meshing import mesh
from isoswarm.samples import Samples
from isoswarm.sampling import sample
from isoswarm.scene import Scene

__all__ = ["Image", "render", "turntable"]

Style = Literal["surface", "discs", "points", "mesh", "flat", "wireframe"]
Coloring = Literal["uniform", "curvature", "height", "normal"]
Section = Literal["flat", "hatched", "distance", "slice"]
Plane = tuple[Sequence[float], float]
Pixels = npt.NDArray[np.uint8]

MESHES = {"mesh": "smooth", "flat": "flat", "wireframe": "wireframe"}


class Image(bytes):
    """A picture: the bytes of its PNG, which a notebook shows.

    Attributes
    ----------
    array : ndarray, (height, width, 4), uint8
        Its pixels from the top, sRGB with straight alpha.
    certified : bool
        Whether intervals prove that no part of a surface is missing.

    """

    array: Pixels
    certified: bool

    def _repr_png_(self) -> bytes:
        return bytes(self)


def render(
    what: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    style: Style | None = None,
    coloring: Coloring = "uniform",
    values: Any = None,
    bounds: Any = None,
    planes: Plane | Iterable[Plane] = (),
    section: Section = "flat",
    capped: bool = True,
    opacity: float = 1.0,
    n: int = 10_000,
    width: int = 1200,
    height: int = 900,
    azimuth: float = 0.6,
    elevation: float = 0.4,
    up: npt.ArrayLike = (0.0, 0.0, 1.0),
    field_of_view: float = 0.5,
    projection: Literal["perspective", "parallel"] = "perspective",
    frame: npt.ArrayLike | None = None,
    transparent: bool = False,
    ground: bool = True,
    shadow: float = 0.8,
    ambient_occlusion: float = 1.0,
    supersampling: int = 3,
    disc_scale: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Image:
    """Draw a field, a scene, samples, a mesh, or several of them in one picture.

    A field is drawn by casting rays: intervals prove that no part of the surface is stepped over. What is drawn
    together hides and shades each other; discs and balls that touch a surface are laid on it.

    Parameters
    ----------
    what : Field, Scene, Samples, mesh, or a sequence of these
        A mesh is anything with ``points`` (or ``vertices``) and ``faces``.
    path : str or path, optional
        A ``.png`` to write, too.
    style : {"surface", "discs", "points", "mesh", "flat", "wireframe"}
        By default fields are surfaces, samples discs, meshes smooth. "discs" and "points" draw a field by ``n``
        samples. "mesh", "flat" and "wireframe" draw meshes smooth, flat or with the edges of their triangles.
    coloring : {"uniform", "curvature", "height", "normal"}
        What the colour says: curvature is mean curvature, warm where the surface bulges.
    values : Field or array_like, optional
        Instead of ``coloring``: a field whose values colour surfaces, or a number for each sample or vertex.
    bounds : pair of corners or float, optional
        The box in which fields are drawn. By default ``field.bounds``.
    planes : (normal, offset) or a sequence of these
        Each keeps normal · x ≤ offset of fields and shows the cut.
    section : {"flat", "hatched", "distance", "slice"}
        How cuts look: one tone; hatched; coloured by the distance to the surface with lines; the same outside the
        solid, too.
    capped : bool
        Whether solids that the bounds cut are closed there.
    opacity : float
        Above 0, up to 1: of each layer of a field's surface.
    n : int
        Samples of a field that is drawn as discs or points, vertices of one that is drawn as a mesh.
    width, height : int
        In pixels.
    azimuth, elevation : float
        Direction of the view, in radians.
    up : array_like, (3,)
        What is up in the picture.
    field_of_view : float
        Opening angle of the camera, in radians, 0.05 to 2.
    projection : {"perspective", "parallel"}
        "parallel" for pictures to measure in.
    frame : array_like, (m, 3), optional
        Points that fill the picture; by default what is drawn does.
    transparent : bool
        Leave the background out.
    ground : bool
        Whether there is a ground that shows shadows.
    shadow, ambient_occlusion : float
        How dark shadows and hollows are, 0 to 1.
    supersampling : int
        1 to 4: smoother edges, more time.
    disc_scale : float, optional
        Factor on the radii of discs.
    progress : callable, optional
        Called with the part of the picture that is done, 0 to 1, up to 20 times a second. An exception in it ends the
        work, as Ctrl-C does.

    Returns
    -------
    Image
        The bytes of the PNG, with the pixels as ``array``.

    Warns
    -----
    EmptySurfaceWarning
        There is nothing to see; the picture is the background.
    UserWarning
        A field with a Python function in it has no intervals: thin parts may be missing.

    Raises
    ------
    ValueError
        An option is out of range, or bounds are needed.

    Examples
    --------
    >>> import isoswarm as iso
    >>> shape = iso.torus(major=1, minor=0.4)
    >>> iso.render(shape, width=64, height=48).array.shape
    (48, 64, 4)
    >>> half = iso.render(shape, planes=((0, 1, 0), 0.0), section="distance", width=64, height=48)
    >>> half[1:4]
    b'PNG'

    """
    items = _items(what)
    cut = _planes(planes)
    # A cloud has one style; where there are several kinds of things samples are discs.
    clouds: list[Samples] = []
    solids: list[_core.Solid] = []
    meshes: list[_core.Triangles] = []
    for item in items:
        field = item.model if isinstance(item, Scene) else item
        if isinstance(field, Field):
            lo, hi = as_bounds(bounds) if bounds is not None else field.require_bounds()
            if style in MESHES:
                meshes.append(_mesh(mesh(field, n=n, bounds=(lo, hi)), style, values))
            elif style in ("discs", "points"):
                clouds.append(sample(field, n=n, bounds=(lo, hi)))
            else:
                shown = values if isinstance(values, Field) else None
                solids.append(
                    _core.Solid(
                        field._model,
                        tuple(lo),
                        tuple(hi),
                        planes=cut,
                        capped=capped,
                        opacity=opacity,
                        section=section,
                        values=None if shown is None else shown._model,
                    )
                )
        elif isinstance(item, Samples):
            clouds.append(item)
        else:
            meshes.append(_mesh(item, style, values))
    given = values is not None
    png, pixels, empty, certified = _core.render(
        _cloud(clouds, values),
        solids,
        meshes,
        width=width,
        height=height,
        azimuth=azimuth,
        elevation=elevation,
        up=tuple(as_floats("up", up, (3,))),
        field_of_view=field_of_view,
        projection=projection,
        style="points" if style == "points" else "surface" if style == "surface" and not solids else "discs",
        coloring="given" if given else coloring,
        transparent=transparent,
        disc_scale=disc_scale,
        supersampling=supersampling,
        ground=ground,
        shadow=shadow,
        ambient_occlusion=ambient_occlusion,
        frame=None if frame is None else as_points(frame, 3, "frame"),
        progress=progress,
    )
    if empty:
        message = "there is nothing to see; check the sign of the field (F < 0 inside), or pass other bounds"
        warnings.warn(message, EmptySurfaceWarning, stacklevel=2)
    if not certified:
        message = "a Python function has no intervals: parts thinner than 1/400 of the box may be missing"
        warnings.warn(message, UserWarning, stacklevel=2)
    if path is not None:
        _core.write_bytes(_png_path(path), png)
    image = Image(png)
    image.array, image.certified = pixels, certified
    return image


def render_marked(field: Field, pins: Floats, pin_normals: Floats, *, frame: npt.ArrayLike, **options: Any) -> bytes:
    """A PNG of a field by ray casting, with pins as red discs on it, inside a frame of points."""
    corners = np.asarray(frame, dtype=np.float64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float(np.linalg.norm(high - low))
    # What moves may be a little outside of where its particles have been.
    lo, hi = field.bounds or (low - 0.1 * size, high + 0.1 * size)
    solid = _core.Solid(
        field._model, tuple(lo), tuple(hi), planes=[], capped=True, opacity=1.0, section="flat", values=None
    )
    cloud = None
    if len(pins):
        radii = np.full(len(pins), 0.02 * size)
        cloud = _core.Cloud(pins, pin_normals, radii, colors=np.tile(PIN, (len(pins), 1)))
    settings: dict[str, Any] = {
        "up": (0.0, 0.0, 1.0),
        "field_of_view": 0.5,
        "projection": "perspective",
        "style": "discs",
        "coloring": "given" if len(pins) else "uniform",
        "transparent": False,
        "disc_scale": 1.0,
        "supersampling": 2,
        "ground": False,
        "shadow": 0.8,
        "ambient_occlusion": 1.0,
        **options,
    }
    return _core.render(cloud, [solid], [], frame=as_points(corners, 3, "frame"), **settings)[0]


def turntable(
    what: Any,
    path: str | os.PathLike[str],
    *,
    frames: int = 48,
    rate: float = 20.0,
    azimuth: float = 0.6,
    progress: Any = None,
    **options: Any,
) -> None:
    """Draw what turns once about its up axis, as one animated PNG.

    Parameters
    ----------
    what
        As for :func:`render`.
    path : str or path
        A ``.png`` or ``.apng`` to write.
    frames : int
        Pictures of a turn.
    rate : float
        Pictures a second.
    azimuth : float
        Where the turn begins, in radians.
    progress : callable, optional
        Called with the pictures done and their number.
    **options
        Of :func:`render`. All pictures have one frame: the ball around what is drawn.

    """
    if frames < 1:
        raise ValueError(f"frames: expected at least 1, given {frames}")
    items = _items(what)
    options = {"frame": _ball(items, options.get("bounds")), "ground": False, **options}
    pictures: list[bytes] = []
    for k in range(frames):
        pictures.append(render(items, azimuth=azimuth + 2 * math.pi * k / frames, **options))
        if progress is not None:
            progress(k + 1, frames)
    _core.write_bytes(_png_path(path, (".png", ".apng")), _core.animate(pictures, 1.0 / rate))


def _items(what: Any) -> list[Any]:
    items = list(what) if isinstance(what, list | tuple) else [what]
    for item in items:
        known = isinstance(item, Field | Scene | Samples)
        if not known and not (hasattr(item, "faces") and (hasattr(item, "points") or hasattr(item, "vertices"))):
            raise ValueError(f"expected fields, scenes, samples or meshes, given {item!r:.60}")
    return items


def _planes(planes: Any) -> list[tuple[tuple[float, float, float], float]]:
    given = list(planes)
    # One (normal, offset), or several.
    if len(given) == 2 and np.ndim(given[0]) == 1 and np.ndim(given[1]) == 0 and len(given[0]) == 3:
        given = [planes]
    out = []
    for plane in given:
        try:
            normal, offset = plane
        except (TypeError, ValueError) as error:
            raise ValueError(f"planes: expected (normal, offset) each, given {plane!r:.60}") from error
        x, y, z = as_floats("planes", normal, (3,)).tolist()
        out.append(((x, y, z), float(as_floats("planes", offset, ()))))
    return out


def _shades(values: Any, count: int) -> Any:
    """Colours for numbers, one a row."""
    numbers = as_floats("values", values, (count,))
    return _core.colors(numbers, "sequential")


def _cloud(clouds: list[Samples], values: Any) -> _core.Cloud | None:
    if not clouds:
        return None
    one = {
        name: np.concatenate([getattr(c, name) for c in clouds])
        for name in ("points", "normals", "radii", "curvatures")
    }
    colors = None
    if values is not None and not isinstance(values, Field):
        colors = _shades(values, len(one["points"]))
    elif isinstance(values, Field):
        colors = _shades(values.value(one["points"]), len(one["points"]))
    return _core.Cloud(one["points"], one["normals"], one["radii"], curvatures=one["curvatures"], colors=colors)


def _mesh(given: Any, style: Style | None, values: Any) -> _core.Triangles:
    points = as_points(given.points if hasattr(given, "points") else given.vertices, 3, "points")
    faces = np.ascontiguousarray(given.faces, dtype=np.int64)
    columns = {}
    for name, width in (("normals", 3), ("curvatures", 2)):
        column = getattr(given, name, None)
        if column is not None and np.shape(column) == (len(points), width):
            columns[name] = np.ascontiguousarray(column, dtype=np.float64)
    colors = None
    if isinstance(values, Field):
        colors = _shades(values.value(points), len(points))
    elif values is not None:
        colors = _shades(values, len(points))
    return _core.Triangles(points, faces, MESHES.get(style or "mesh", "smooth"), colors=colors, **columns)


def _ball(items: list[Any], bounds: Any) -> Any:
    """Points of a ball around everything."""
    corners = []
    for item in items:
        field = item.model if isinstance(item, Scene) else item
        if isinstance(field, Field):
            corners += list(as_bounds(bounds) if bounds is not None else field.require_bounds())
        else:
            points = np.asarray(field.points if hasattr(field, "points") else field.vertices)
            corners += [points.min(axis=0), points.max(axis=0)]
    lo, hi = np.min(corners, axis=0), np.max(corners, axis=0)
    z, turn = np.linspace(1, -1, 100), np.pi * (1 + 5**0.5) * np.arange(100)
    flat = np.sqrt(1 - z * z)
    ball = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
    # Most things fill their box's inscribed ellipsoid rather than its corners.
    return 0.5 * (lo + hi) + 0.5 * np.linalg.norm(hi - lo) / math.sqrt(3) * 1.25 * ball


def _png_path(path: str | os.PathLike[str], endings: tuple[str, ...] = (".png",)) -> Path:
    file = Path(path)
    if file.suffix.lower() not in endings:
        raise ValueError(f"{file}: expected a file that ends in {' or '.join(endings)}")
    return file
