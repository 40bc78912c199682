"""Triangle meshes of surfaces: the floaters are the vertices."""

from __future__ import annotations

import os
import time
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds, as_count, as_seed
from isoswarm.callbacks import BatchFunction, checked
from isoswarm.certifying import grown
from isoswarm.errors import EmptySurfaceWarning, SamplingWarning
from isoswarm.field import Field
from isoswarm.samples import Samples, _library
from isoswarm.sampling import Progress

__all__ = ["Mesh", "MeshReport", "TriangleQuality", "mesh", "mesh_samples"]

Rule = Literal["delaunay", "circumsphere"]


@dataclass(frozen=True)
class TriangleQuality:
    """How good triangles are; angles in degrees.

    Attributes
    ----------
    q_avg, q_min : float
        Mean and least of Q = 6/√3 · S / (p h), with area S, half the perimeter p and longest edge h (Frey and
        Borouchaki); 1 for equilateral triangles.
    radius_ratio_avg, radius_ratio_min : float
        Mean and least of twice the radius of the inscribed circle over that of the circumscribed one.
    smallest_angle, smallest_angle_avg, largest_angle : float
        Smallest angle of all, mean of the triangles' smallest angles, largest of all.
    below_30 : float
        Part of the triangles with an angle below 30 degrees.
    six_valent : float
        Part of the vertices with six triangles.
    valence : tuple of int
        Least and most triangles at a vertex.

    """

    q_avg: float
    q_min: float
    radius_ratio_avg: float
    radius_ratio_min: float
    smallest_angle: float
    smallest_angle_avg: float
    largest_angle: float
    below_30: float
    six_valent: float
    valence: tuple[int, int]


@dataclass(frozen=True)
class MeshReport:
    """How a mesh came out.

    Attributes
    ----------
    vertices, edges, faces, components, boundaries : int
        Counts; boundaries are closed loops of edges with one face.
    euler : int
        Euler characteristic V - E + F of all components together.
    genus : tuple of int
        Of each component, its boundaries filled.
    closed, manifold : bool
        Whether it is a consistently oriented 2-manifold, without boundary for ``closed``.
    faults : tuple of str
        What makes it none.
    sound : bool
        Whether it is a manifold with no doubtful places and no self-intersections.
    quality : TriangleQuality
        How good the triangles are.
    max_distance : float
        Largest distance of a triangle's centre from the surface, in model units.
    self_intersections : int
        Pairs of triangles that pass through each other, as far as they were looked for.
    inserted, removed : int
        Vertices besides the samples, and samples that are no vertices.
    filled, flips : int
        Triangles that closed holes between stars that disagree; edges flipped.
    evaluations : int
        Points at which F was evaluated, sampling included.
    seconds : float
        Wall-clock time.
    doubtful : ndarray, (k, 3)
        Where the mesh is not guaranteed to be right.
    certified : bool or None
        Whether the mesh has the topology that is proven of the surface; None where nothing was proven, or asked for.
    warnings : tuple of str
        What else there is to know, a sentence each.

    """

    vertices: int
    edges: int
    faces: int
    components: int
    boundaries: int
    euler: int
    genus: tuple[int, ...]
    closed: bool
    manifold: bool
    faults: tuple[str, ...]
    sound: bool
    quality: TriangleQuality
    max_distance: float
    self_intersections: int
    inserted: int
    removed: int
    filled: int
    flips: int
    evaluations: int
    seconds: float
    doubtful: Floats
    certified: bool | None
    warnings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        return asdict(self) | {
            "genus": list(self.genus),
            "faults": list(self.faults),
            "doubtful": self.doubtful.tolist(),
            "warnings": list(self.warnings),
        }

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        q = self.quality
        kind = "closed manifold" if self.closed else "manifold with boundary" if self.manifold else "not a manifold"
        rows = [
            ("mesh", f"{self.vertices:,} vertices, {self.faces:,} triangles, {kind}"),
            (
                "topology",
                f"{self.components} component{'s' * (self.components != 1)}, Euler characteristic {self.euler}, "
                f"genus {', '.join(map(str, self.genus[:8]))}{' …' * (len(self.genus) > 8)}, "
                f"{self.boundaries} boundaries",
            ),
            (
                "quality",
                f"Q {q.q_avg:.3f} (least {q.q_min:.3f}), angles {q.smallest_angle:.1f}° to {q.largest_angle:.1f}°",
            ),
            ("off the surface", f"{self.max_distance:.2g} at most, at the triangles' centres"),
            ("work", f"{self.evaluations:,} evaluations, {self.seconds:.2f} s"),
        ]
        if self.certified is not None:
            rows.append(("certified", "as is proven" if self.certified else "NO: another topology is proven"))
        if self.self_intersections:
            rows.append(("intersections", f"{self.self_intersections} pairs of triangles"))
        if self.inserted or self.removed:
            rows.append(("repair", f"{self.inserted} vertices inserted, {self.removed} removed"))
        if len(self.doubtful):
            rows.append(("doubtful", f"{len(self.doubtful)} places"))
        rows += [("warning", text) for text in self.warnings]
        return rows

    def __str__(self) -> str:
        return "\n".join(f"{name + ':':<18}{value}" for name, value in self.rows())


class Mesh:
    """Triangles over points of a surface F = 0; all columns are read-only.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Vertices, in model units.
    normals : ndarray, (n, 3)
        Outward unit normals of the surface at the vertices; zero where the gradient vanishes.
    curvatures : ndarray, (n, 2)
        Principal curvatures, the larger in magnitude first; positive where convex seen from outside; NaN where they
        are undefined.
    faces : ndarray of int, (f, 3)
        Numbers of each triangle's vertices, counter-clockwise seen from outside.
    component : ndarray of int, (n,)
        Connected component of each vertex; -1 for those without a triangle.
    ids : ndarray of uint64, (n,)
        Identities of the vertices.
    corner_normals : ndarray, (f, 3, 3), or None
        Where the surface has creases: outward unit normals at the corners of the triangles, which on a crease are those
        of the triangle's side. None where all are those of the vertices.
    report : MeshReport
        How it came out.
    field : Field
        The field that was meshed.

    """

    points: Floats
    normals: Floats
    curvatures: Floats
    faces: npt.NDArray[np.int64]
    component: npt.NDArray[np.int64]
    ids: npt.NDArray[np.uint64]
    corner_normals: Floats | None
    report: MeshReport
    field: Field

    def __init__(self, field: Field, columns: dict[str, Any], seconds: float) -> None:
        report = dict(columns["report"])
        report["quality"] = TriangleQuality(**report["quality"])
        for name in ("genus", "faults", "warnings"):
            report[name] = tuple(report[name])
        report["doubtful"].setflags(write=False)
        self.report = MeshReport(**report, seconds=seconds)
        self.field = field
        for name in ("points", "normals", "curvatures", "faces", "component", "ids"):
            column: npt.NDArray[Any] = columns[name]
            column.setflags(write=False)
            setattr(self, name, column)
        self.corner_normals = columns["corner_normals"]
        if self.corner_normals is not None:
            self.corner_normals.setflags(write=False)

    def __len__(self) -> int:
        """Return the number of triangles."""
        return len(self.faces)

    def save(self, path: str | os.PathLike[str], *, sharp: bool | None = None) -> None:
        """Write the mesh to a file, whole or not at all.

        Parameters
        ----------
        path : str or path
            Ends in ``.ply``, ``.obj``, ``.stl``, ``.glb``, ``.3mf``, ``.vtp`` or ``.npz``. Normals and curvatures go
            where the format can take them.
        sharp : bool, optional
            Whether viewers shade creases sharply. In ``.ply``, ``.glb`` and ``.vtp`` vertices on creases are then there
            once a side, each with the normal of its side, and triangles of different sides share no vertices: no longer
            watertight for programs that do not merge them. ``.obj`` gets further normals for the same vertices. By
            default ``.glb``, ``.vtp`` and ``.obj`` are sharp and ``.ply`` is not. ``.stl`` has a normal a triangle,
            ``.3mf`` has none, ``.npz`` has `corner_normals`.

        Raises
        ------
        ValueError
            Another ending.
        OSError
            The file cannot be written; what stood there before is unchanged.

        """
        corners = None if self.corner_normals is None else self.corner_normals.reshape(-1, 3)
        _core.save_mesh(
            Path(path),
            self.points,
            self.faces,
            self.normals,
            self.curvatures,
            self.ids,
            corner_normals=corners,
            sharp=sharp,
        )

    def to_trimesh(self) -> Any:
        """As a ``trimesh.Trimesh`` with vertex normals and curvatures; needs trimesh."""
        trimesh = _library("trimesh")
        return trimesh.Trimesh(
            self.points,
            self.faces,
            vertex_normals=self.normals,
            vertex_attributes={"curvatures": self.curvatures},
            process=False,
        )

    def to_pyvista(self) -> Any:
        """As a ``pyvista.PolyData`` with normals and curvatures as point data; needs pyvista."""
        pyvista = _library("pyvista")
        cells = np.column_stack([np.full(len(self.faces), 3), self.faces]).ravel()
        surface = pyvista.PolyData(self.points, cells)
        surface.point_data["normals"] = self.normals
        surface.point_data["curvatures"] = self.curvatures
        return surface

    def to_open3d(self) -> Any:
        """As an ``open3d.geometry.TriangleMesh`` with vertex normals; needs open3d."""
        open3d = _library("open3d")
        # It takes arrays that may be written to only, and short integers.
        points, normals = (open3d.utility.Vector3dVector(column.copy()) for column in (self.points, self.normals))
        surface = open3d.geometry.TriangleMesh(points, open3d.utility.Vector3iVector(self.faces.astype(np.int32)))
        surface.vertex_normals = normals
        return surface

    def __repr__(self) -> str:
        r = self.report
        kind = "closed" if r.closed else "with boundary" if r.manifold else "not a manifold"
        return f"<Mesh: {r.vertices} vertices, {r.faces} triangles, {kind}, Euler characteristic {r.euler}>"


def mesh(
    field: Field,
    *,
    n: int | None = None,
    spacing: float | None = None,
    error: float | None = None,
    bounds: Any = None,
    density: BatchFunction | Literal["curvature"] | None = None,
    creases: bool = True,
    rule: Rule = "delaunay",
    smoothing: int | None = None,
    intersections: bool = True,
    seed: int = 0,
    time_limit: float | None = None,
    max_vertices: int = 20_000_000,
    certify: bool | int = False,
    progress: Progress | None = None,
) -> Mesh:
    """Mesh the surface F = 0: samples it evenly and joins the samples by triangles.

    Parameters
    ----------
    field : Field
        The surface.
    n : int, optional
        About so many vertices; 10,000 if nothing else is given. Repairs, and corners of the bounds, add and take some.
    spacing : float, optional
        Instead of `n`: mean distance between neighbours, in model units.
    error : float, optional
        Instead of `n`: largest distance between triangles and surface, in model units. Triangles are as large as
        curvature allows; the distance is measured, and they are refined where it is larger.
    bounds : pair of corners or float, optional
        Where to look: ``(lo, hi)``, or b for the box from -b to b. By default ``field.bounds``. A surface that
        leaves the box ends in a boundary on its faces.
    density : callable or "curvature", optional
        Relative number of vertices per area, a batch function of position, (n, 3) to (n,), or by curvature. By default
        uniform, but denser where the surface bends within less than the spacing. Not with `error`.
    creases : bool
        Whether edges and corners of the surface become edges and vertices of the mesh. Where these would take more than
        half of the vertices asked for, more are taken, and a warning says so.
    rule : {"delaunay", "circumsphere"}
        ``"delaunay"`` is the one to use. ``"circumsphere"`` is that of Szeliski and Tonnesen (1992), to compare
        with; it need not give a manifold.
    smoothing : int, optional
        Most rounds of smoothing; 0 leaves the vertices where the samples are.
    intersections : bool
        Whether to look for triangles that pass through each other.
    seed : int
        Of every random choice: same seed, same mesh, on any number of threads.
    time_limit : float, optional
        For the sampling, in seconds; what there is by then is meshed.
    max_vertices : int
        More than that is refused, with an estimate.
    certify : bool or int
        Whether to prove the surface's topology and compare the mesh with it; a number of boxes for the proof, or True
        for 2,000,000. See :func:`isoswarm.certify`.
    progress : callable, optional
        Called as ``progress(phase, fraction, floaters, steps)`` up to 20 times a second while sampling.

    Returns
    -------
    Mesh
        Its ``report`` says what was reached, and where the mesh is not guaranteed to be right. Empty, with an
        EmptySurfaceWarning, where there is no surface in the bounds; with a SamplingWarning where the report is not
        sound.

    Examples
    --------
    >>> import isoswarm as iso
    >>> torus = iso.mesh(iso.torus(major=1, minor=0.4), n=2000)
    >>> torus.report.closed, torus.report.genus
    (True, (1,))

    """
    if not isinstance(field, Field):
        raise TypeError(f"field: expected a Field (see iso.parse, iso.from_function), given {type(field).__name__}")
    given = {k: v for k, v in (("n", n), ("spacing", spacing), ("error", error)) if v is not None}
    if len(given) > 1:
        raise ValueError(
            f"expected one of n, spacing and error, given {', '.join(f'{k}={v}' for k, v in given.items())}"
        )
    if not given:
        n = 10_000
    if n is not None:
        n = as_count(n, "n", 1, 2**32)
    seed = as_seed(seed)
    if smoothing is not None and not 0 <= smoothing <= 10_000:
        raise ValueError(f"smoothing: expected a number of rounds from 0 to 10,000, given {smoothing}")
    if time_limit is not None and not 0.0 <= time_limit < float("inf"):
        raise ValueError(f"time_limit: expected seconds from 0, given {time_limit}")
    if error is not None and density is not None:
        raise ValueError("density: the error decides on the sizes; leave one of the two out")
    lo, hi = as_bounds(bounds, field.axes) if bounds is not None else field.require_bounds()
    by: Any = density
    if density is not None and density != "curvature":
        if isinstance(density, str):
            raise ValueError(f'density: expected a function, "curvature" or None, given {density!r}')
        by = checked(density, "density", field.axes)
    began = time.perf_counter()
    columns = _core.mesh(
        field._model,
        n=n,
        spacing=spacing,
        error=error,
        lo=tuple(lo),
        hi=tuple(hi),
        rule=rule,
        density=by,
        creases=creases,
        smoothing=smoothing,
        intersections=intersections,
        seed=seed,
        most=max_vertices,
        time_limit=time_limit,
        progress=progress,
        proof=_proof(certify, lo, hi, grow=bounds is None),
    )
    return _told(Mesh(field, columns, time.perf_counter() - began))


def mesh_samples(
    samples: Samples,
    *,
    bounds: Any = None,
    rule: Rule = "delaunay",
    smoothing: int | None = 0,
    intersections: bool = True,
) -> Mesh:
    """Join samples by triangles.

    Parameters
    ----------
    samples : Samples
        Of a surface in space.
    bounds : pair of corners or float, optional
        The box that clips the surface; by default the one that was sampled.
    rule, smoothing, intersections
        As for :func:`mesh`; by default the samples stay where they are.

    """
    field = samples.field
    box = samples.bounds if bounds is None else as_bounds(bounds, field.axes)
    lo, hi = field.require_bounds() if box is None else box
    began = time.perf_counter()
    columns = _core.mesh_samples(
        field._model,
        samples.points,
        samples.normals,
        samples.radii,
        samples.creases._inner if samples.creases else None,
        components=samples.report.components,
        unmet=samples.report.reason,
        lo=tuple(lo),
        hi=tuple(hi),
        rule=rule,
        smoothing=smoothing,
        intersections=intersections,
    )
    return _told(Mesh(field, columns, time.perf_counter() - began))


def _proof(certify: bool | int, lo: Floats, hi: Floats, *, grow: bool) -> Any:
    """Box and number of boxes of a proof."""
    if not certify:
        return None
    box = grown(lo, hi) if grow else (lo, hi)
    return tuple(box[0]), tuple(box[1]), 2_000_000 if certify is True else int(certify)


def _told(made: Mesh) -> Mesh:
    """The mesh, with a warning where it is not what was asked for."""
    report = made.report
    if not len(made) and not report.vertices:
        warnings.warn(
            "there is no surface F = 0 in the bounds; check the sign of the field, or pass larger bounds",
            EmptySurfaceWarning,
            stacklevel=3,
        )
    elif not report.sound:
        warnings.warn("; ".join(report.warnings) or "the mesh is not sound", SamplingWarning, stacklevel=3)
    return made
