"""The command that casts rays."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from isoswarm.cli import model as models
from isoswarm.cli.commands import Bounds, Json, Model, Quiet, Settings, Water, app, check_ending, size_of
from isoswarm.cli.outcome import Code, errors, print_json, reported
from isoswarm.errors import EmptySurfaceWarning
from isoswarm.rendering import render, turntable

DEGREE = math.pi / 180
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@app.command("render")
def render_command(
    model: Model,
    output: Annotated[Path, typer.Option("-o", "--output", help="A .png file.", dir_okay=False)],
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    size: Annotated[str, typer.Option("--size", help="Width x height in pixels.")] = "1200x900",
    azimuth: Annotated[float, typer.Option("--azimuth", help="Direction of view, in degrees.")] = 35.0,
    elevation: Annotated[float, typer.Option("--elevation", help="Direction of view, in degrees.")] = 25.0,
    projection: Annotated[str, typer.Option("--projection", help="perspective or parallel.")] = "perspective",
    style: Annotated[str, typer.Option("--style", help="surface, discs, points, mesh, flat or wireframe.")] = "surface",
    coloring: Annotated[str, typer.Option("--coloring", help="uniform, curvature, height or normal.")] = "uniform",
    cut: Annotated[
        list[str] | None,
        typer.Option("--cut", help="Keep one side of a plane: x=0.2 keeps x <= 0.2, -x=0.2 x >= 0.2; or nx,ny,nz,d."),
    ] = None,
    section: Annotated[
        str, typer.Option("--section", help="How cuts look: flat, hatched, distance or slice.")
    ] = "flat",
    is_open: Annotated[bool, typer.Option("--open", help="Leave solids open where the bounds cut them.")] = False,
    opacity: Annotated[float, typer.Option("--opacity", help="Of each layer, above 0, up to 1.")] = 1.0,
    transparent: Annotated[bool, typer.Option("--transparent", help="No background.")] = False,
    samples: Annotated[int, typer.Option("--samples", help="1 to 4 a pixel and direction.")] = 3,
    turns: Annotated[
        int | None, typer.Option("--turntable", min=1, help="Instead of one picture, so many of one turn, animated.")
    ] = None,
    rate: Annotated[float, typer.Option("--rate", min=0.1, max=1000, help="Pictures a second of a turntable.")] = 20.0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw the surface of MODEL by casting rays: exact at every pixel."""
    with reported():
        check_ending("--output", output, (".png",) if turns is None else (".png", ".apng"))
        width, height = size_of(size)
        field = models.read(model, settings or [], water, 3)
        options: dict[str, Any] = {
            "bounds": models.bounds(bounds),
            "width": width,
            "height": height,
            "azimuth": azimuth * DEGREE,
            "elevation": elevation * DEGREE,
            "projection": projection,
            "style": style,
            "coloring": coloring,
            "planes": [plane(text) for text in cut or []],
            "section": section,
            "capped": not is_open,
            "opacity": opacity,
            "transparent": transparent,
            "supersampling": samples,
        }
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            if turns is None:
                with _bar(quiet) as progress:
                    task = progress.add_task("drawing", total=1.0)
                    told = lambda part: progress.update(task, completed=part)  # noqa: E731
                    render(field, output, progress=told, **options)
            else:
                _turn(field, output, turns, rate, quiet, options)
        empty = any(issubclass(w.category, EmptySurfaceWarning) for w in caught)
        for w in {str(w.message) for w in caught}:
            errors.print(f"warning: {w}", markup=False)
        if as_json:
            print_json({"output": str(output), "empty": empty})
        elif not quiet:
            errors.print(f"wrote {output}", markup=False)
        if empty:
            raise typer.Exit(Code.EMPTY)


def _turn(field: Any, output: Path, turns: int, rate: float, quiet: bool, options: dict[str, Any]) -> None:
    with _bar(quiet) as progress:
        task = progress.add_task("drawing", total=turns)
        told = lambda done, _: progress.update(task, completed=done)  # noqa: E731
        turntable(field, output, frames=turns, rate=rate, progress=told, **options)


def _bar(quiet: bool) -> Progress:
    columns = (TextColumn("drawing  "), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
    return Progress(*columns, console=errors, transient=True, disable=quiet)


def plane(text: str) -> tuple[tuple[float, float, float], float]:
    """The half-space of ``--cut``, as (normal, offset)."""
    name, equals, value = text.replace(" ", "").partition("=")
    axis = AXES.get(name.lstrip("-"))
    try:
        if equals and axis is not None:
            sign = -1.0 if name.startswith("-") else 1.0
            x, y, z = (sign * v for v in axis)
            return (x, y, z), sign * float(value)
        x, y, z, offset = (float(v) for v in text.split(","))
        return (x, y, z), offset
    except ValueError as error:
        raise ValueError(f"--cut: expected x=0.2, -x=0.2 (and alike for y, z) or nx,ny,nz,d, given {text!r}") from error
