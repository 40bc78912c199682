"""What sampling gives: points with all that belongs to them, and the account of how it went."""

from __future__ import annotations

import base64
import html
import importlib
import os
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats
from isoswarm.edges import Creases
from isoswarm.errors import ConvergenceError

if TYPE_CHECKING:
    from isoswarm.field import Field
    from isoswarm.meshing import Mesh

__all__ = ["Evenness", "Report", "Samples"]


@dataclass(frozen=True)
class Evenness:
    """How evenly points lie on a surface; dimensionless.

    Attributes
    ----------
    rho_min, rho_avg : float
        Smallest and mean distance between nearest neighbours, over that of the hexagonal packing of as many points
        on as much area, √(2A / (√3 n)); 1 is perfect.
    cv : float
        Standard deviation of that distance over its mean; 0 is perfect.
    six_valent : float
        Part of the points with exactly six neighbours in their Delaunay star (two, on a curve).
    coverage : float
        Radius of the largest empty disc over the hexagonal packing's distance; .577 is perfect.

    """

    rho_min: float
    rho_avg: float
    cv: float
    six_valent: float
    coverage: float


@dataclass(frozen=True)
class Report:
    """How a run went.

    Attributes
    ----------
    status : {"converged", "not converged", "empty"}
        How it ended.
    reason : str
        What was not reached and why; empty where everything was.
    components : int
        Connected components found.
    certified : bool
        Whether interval arithmetic accounts for the whole of the bounds: every box of the first search that may hold a
        piece of the surface holds a sample, is next to one that does, or has been shown to be empty. Only components
        smaller than such a box and as close to another can have been missed; `iso.certify` proves the number where it
        can.
    resolution : float
        Largest side of the boxes of the first search, in model units.
    max_error : float
        Largest abs(F)/‖∇F‖ over the samples with a gradient, in model units.
    evenness : Evenness
        How evenly they lie, relative to ``density`` where that is not uniform.
    spacing : float
        Mean distance between a sample and its nearest neighbour, in model units.
    area : float
        Area of the surface (length of the curve) from the samples' cells.
    on_bounds : int
        Samples on the faces of the bounds, which clip the surface there.
    singular : int
        Samples where the gradient vanishes; their normal is (0, 0, 0).
    steps, evaluations, births, deaths : int
        Steps taken, points at which F was evaluated, floaters born and died.
    seconds : float
        Wall-clock time.
    warnings : tuple of str
        What else there is to know, a sentence each.

    """

    status: Literal["converged", "not converged", "empty"]
    reason: str
    components: int
    certified: bool
    resolution: float
    max_error: float
    evenness: Evenness
    spacing: float
    area: float
    on_bounds: int
    singular: int
    steps: int
    evaluations: int
    births: int
    deaths: int
    seconds: float
    warnings: tuple[str, ...]

    @property
    def converged(self) -> bool:
        """Whether everything asked for was reached."""
        return self.status == "converged"

    def as_dict(self) -> dict[str, Any]:
        """Plain types only, ready for JSON."""
        return asdict(self) | {"warnings": list(self.warnings)}

    def rows(self) -> list[tuple[str, str]]:
        """Name and value as text, for people."""
        even = self.evenness
        rows = [
            ("status", f"{self.status}: {self.reason}" if self.reason else self.status),
            ("components", f"{self.components} ({'certified' if self.certified else 'not certified'})"),
            ("spacing", f"{self.spacing:.6g}"),
            ("area", f"{self.area:.6g}"),
            ("off the surface", f"{self.max_error:.2g} at most"),
            (
                "evenness",
                f"ρ_min {even.rho_min:.3f}, ρ_avg {even.rho_avg:.3f}, CV {even.cv:.3f}, "
                f"six-valent {even.six_valent:.0%}, coverage {even.coverage:.3f}",
            ),
            ("work", f"{self.steps} steps, {self.evaluations:,} evaluations, {self.seconds:.2f} s"),
        ]
        if self.on_bounds:
            rows.append(("on the bounds", f"{self.on_bounds} samples"))
        if self.singular:
            rows.append(("without a normal", f"{self.singular} samples"))
        rows += [("warning", text) for text in self.warnings]
        return rows

    def __str__(self) -> str:
        return "\n".join(f"{name + ':':<18}{value}" for name, value in self.rows())


def _library(name: str) -> Any:
    """A library that is only needed here."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"{name} is not installed; install it with: pip install {name}") from error


class Samples:
    """Points spread over a surface F = 0; all columns have the same length n and are read-only.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Positions, in model units.
    normals : ndarray, (n, 3)
        Outward unit normals ∇F/‖∇F‖; zero where the gradient vanishes.
    radii : ndarray, (n,)
        Radius of the disc that each sample stands for, in model units.
    areas : ndarray, (n,)
        Area of each sample's Voronoi cell in its tangent plane; they add up to the surface's area.
    curvatures : ndarray, (n, 2)
        Principal curvatures, the larger in magnitude first; positive where the surface is convex seen from outside;
        NaN where they are undefined.
    component : ndarray of int, (n,)
        Connected component of each sample, from 0.
    creases : Creases or None
        The surface's edges and corners, where they were asked for and there are any; the first samples lie on them.
    report : Report
        How the run went.
    field : Field
        The field that was sampled.
    bounds : pair of ndarray, optional
        The box that was looked at, where it is known.

    """

    points: Floats
    normals: Floats
    radii: Floats
    areas: Floats
    curvatures: Floats
    component: npt.NDArray[np.int64]
    creases: Creases | None
    report: Report
    field: Field
    bounds: tuple[Floats, Floats] | None

    def __init__(
        self, field: Field, columns: dict[str, Any], seconds: float, bounds: tuple[Floats, Floats] | None = None
    ) -> None:
        self.bounds = bounds
        report = dict(columns["report"])
        report["evenness"] = Evenness(**report["evenness"])
        report["warnings"] = tuple(report["warnings"])
        self.report = Report(**report, seconds=seconds)
        self.field = field
        found = columns["creases"]
        self.creases = None if found is None else Creases(found)
        for name in ("points", "normals", "radii", "areas", "curvatures", "component"):
            column: npt.NDArray[Any] = columns[name]
            column.setflags(write=False)
            setattr(self, name, column)

    def __len__(self) -> int:
        return len(self.points)

    def require_converged(self) -> Samples:
        """Return `self`.

        Raises
        ------
        ConvergenceError
            Unless ``report.converged``.

        """
        if not self.report.converged:
            raise ConvergenceError(f"the samples are {self.report.status}: {self.report.reason}")
        return self

    def sensitivity(self) -> Floats:
        """How each sample moves along its normal when a parameter changes.

        From F(x, q) = 0: n·dx/dqⱼ = -(∂F/∂qⱼ) / ‖∇F‖ (WH94, section 3).

        Returns
        -------
        ndarray, (n, m)
            In model units per unit of the parameter, columns in the order of ``field.parameters``; NaN where the
            gradient vanishes.

        """
        slope = np.linalg.norm(self.field.gradient(self.points), axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(slope > 0.0, -self.field.parameter_gradient(self.points) / slope, np.nan)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all columns to a file, whole or not at all.

        Parameters
        ----------
        path : str or path
            Ends in ``.ply`` (binary, double precision), ``.npz``, ``.obj`` (points and normals) or ``.csv``.

        Raises
        ------
        ValueError
            Another ending.
        OSError
            The file cannot be written; what stood there before is unchanged.

        """
        self._cloud.save(Path(path))

    def picture(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        width: int = 1200,
        height: int = 900,
        azimuth: float = 0.6,
        elevation: float = 0.4,
        style: Literal["discs", "points", "surface"] = "discs",
        coloring: Literal["uniform", "curvature", "height", "normal"] = "uniform",
        transparent: bool = False,
        disc_scale: float | None = None,
        supersampling: int = 3,
    ) -> bytes:
        """Draw the samples as lit discs.

        Parameters
        ----------
        path : str or path, optional
            A ``.png`` to write, too.
        width, height : int
            In pixels.
        azimuth, elevation : float
            Direction of the view, in radians.
        style : {"discs", "points", "surface"}
            Separate discs, balls, or discs large enough to close the surface.
        coloring : {"uniform", "curvature", "height", "normal"}
            What the colour says.
        transparent : bool
            Leave the background out.
        disc_scale : float, optional
            Factor on the radii; by default what suits the style.
        supersampling : int
            1 to 4: smoother edges, more time.

        Returns
        -------
        bytes
            The PNG.

        """
        png = self._cloud.png(
            width=width,
            height=height,
            azimuth=azimuth,
            elevation=elevation,
            style=style,
            coloring=coloring,
            transparent=transparent,
            disc_scale=disc_scale,
            supersampling=supersampling,
        )
        if path is not None:
            _core.write_bytes(Path(path), png)
        return png

    def to_mesh(self, **options: Any) -> Mesh:
        """As a triangle mesh with the samples as vertices; options as for :func:`isoswarm.meshing.mesh_samples`."""
        from isoswarm.meshing import mesh_samples

        return mesh_samples(self, **options)

    def to_trimesh(self) -> Any:
        """As a ``trimesh.PointCloud``, with the other columns in its ``metadata``; needs trimesh."""
        trimesh = _library("trimesh")
        metadata = {name: getattr(self, name) for name in ("normals", "radii", "areas", "curvatures", "component")}
        return trimesh.points.PointCloud(self.points, metadata=metadata)

    def to_open3d(self) -> Any:
        """As an ``open3d.geometry.PointCloud`` with normals; needs open3d."""
        open3d = _library("open3d")
        # It takes arrays that may be written to only.
        columns = [open3d.utility.Vector3dVector(column.copy()) for column in (self.points, self.normals)]
        cloud = open3d.geometry.PointCloud(columns[0])
        cloud.normals = columns[1]
        return cloud

    def to_pyvista(self) -> Any:
        """As a ``pyvista.PolyData`` with the other columns as point data; needs pyvista."""
        pyvista = _library("pyvista")
        cloud = pyvista.PolyData(self.points)
        for name in ("normals", "radii", "areas", "curvatures", "component"):
            cloud.point_data[name] = getattr(self, name)
        return cloud

    @cached_property
    def _cloud(self) -> _core.Cloud:
        return _core.Cloud(self.points, self.normals, self.radii, self.areas, self.curvatures)

    def __repr__(self) -> str:
        report = self.report
        return (
            f"<Samples: {len(self)} points, {report.components} component{'s' * (report.components != 1)}, "
            f"{report.status}, spacing {report.spacing:.4g}>"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
            f"<td style='text-align:left'>{html.escape(value)}</td></tr>"
            for name, value in [("points", f"{len(self):,}"), *self.report.rows()]
        )
        picture = ""
        if len(self):
            png = base64.b64encode(self.picture(width=480, height=360, supersampling=2)).decode("ascii")
            picture = f"<img width='480' height='360' alt='the samples' src='data:image/png;base64,{png}'>"
        return f"<div>{picture}<table>{rows}</table></div>"
