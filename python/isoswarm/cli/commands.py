"""The commands that sample, tell and show; see also :mod:`isoswarm.cli.run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

import isoswarm
from isoswarm.cli import model as models
from isoswarm.cli.outcome import errors, finish, print_json, reported
from isoswarm.diagnosis import diagnose
from isoswarm.field import Field
from isoswarm.meshing import mesh_samples
from isoswarm.rendering import MESHES, render
from isoswarm.samples import Samples
from isoswarm.sampling import Method, sample

app = typer.Typer(
    name="isoswarm",
    help="Even samples on implicit surfaces.",
    epilog="Exit codes: 0 done, 1 unexpected, 2 wrong input or usage, 3 no surface in the bounds, 4 not converged, "
    "130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Model = Annotated[str, typer.Argument(metavar="MODEL", help=models.HELP)]
Count = Annotated[int | None, typer.Option("-n", "--count", help="Exactly this many samples.", show_default="1000")]
Spacing = Annotated[float | None, typer.Option("--spacing", help="Instead of -n: mean distance of neighbours.")]
Bounds = Annotated[
    str | None,
    typer.Option("--bounds", help="One number b for [-b, b], or x0,y0,z0,x1,y1,z1. Default: found."),
]
Settings = Annotated[list[str] | None, typer.Option("--set", help="name=value of a parameter; may be repeated.")]
Water = Annotated[bool, typer.Option("--water/--no-water", help="Keep a molecule's water.")]
Axes = Annotated[int, typer.Option("--axes", help="2 for a formula of a curve in the plane.")]
Seed = Annotated[int, typer.Option("--seed", help="Of every random choice.")]
Limit = Annotated[float | None, typer.Option("--time-limit", help="In seconds; keeps what there is by then.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document to standard output.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No progress bar, no report.")]


@app.command("sample")
def sample_command(
    model: Model,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A .ply, .npz, .obj or .csv file.", dir_okay=False)
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw them, too: a .png file.", dir_okay=False)
    ] = None,
    count: Count = None,
    spacing: Spacing = None,
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    density: Annotated[str | None, typer.Option("--density", help="'curvature' for more samples there.")] = None,
    method: Annotated[
        str, typer.Option("--method", help="floaters, adaptive, simple, fissioning or random.")
    ] = "floaters",
    seed: Seed = 0,
    time_limit: Limit = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Spread points evenly over the surface of MODEL."""
    with reported():
        if output is not None:
            check_ending("--output", output, (".ply", ".npz", ".obj", ".csv"))
        if picture is not None:
            check_ending("--picture", picture, (".png",))
        field = models.read(model, settings or [], water, axes)
        samples = _sampled(
            field,
            quiet,
            n=count,
            spacing=spacing,
            bounds=models.bounds(bounds),
            density=density,
            method=method,
            seed=seed,
            time_limit=time_limit,
        )
        if output is not None:
            samples.save(output)
        if picture is not None and len(samples):
            samples.picture(picture, style="surface")
        if as_json:
            print_json({"n": len(samples), "output": str(output) if output else None, **samples.report.as_dict()})
        elif not quiet:
            print_rows([("points", f"{len(samples):,}"), *samples.report.rows()])
            for path in filter(None, (output, picture)):
                errors.print(f"wrote {path}", markup=False)
        finish(samples.report)


@app.command("info")
def info_command(
    model: Model,
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Say what is known about MODEL: parameters, bounds, components, and whether its derivatives are right."""
    with reported():
        field = models.read(model, settings or [], water, axes)
        found = diagnose(field, bounds=models.bounds(bounds), seed=seed)
        if as_json:
            print_json(found.as_dict())
        else:
            print_rows(found.rows())
            if found.parameters:
                _print_parameters(found.parameters)
        if found.components == 0:
            raise typer.Exit(3)


@app.command("view")
def view_command(
    model: Model,
    output: Annotated[Path, typer.Option("-o", "--output", help="A .png file.", dir_okay=False)],
    count: Annotated[int, typer.Option("-n", "--count", help="Number of discs.")] = 10_000,
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    size: Annotated[str, typer.Option("--size", help="Width x height in pixels.")] = "1200x900",
    azimuth: Annotated[float, typer.Option("--azimuth", help="Direction of view, in degrees.")] = 35.0,
    elevation: Annotated[float, typer.Option("--elevation", help="Direction of view, in degrees.")] = 25.0,
    style: Annotated[str, typer.Option("--style", help="discs, points, surface, mesh, flat or wireframe.")] = "discs",
    coloring: Annotated[str, typer.Option("--coloring", help="uniform, curvature, height or normal.")] = "uniform",
    transparent: Annotated[bool, typer.Option("--transparent", help="No background.")] = False,
    seed: Seed = 0,
    time_limit: Limit = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw the surface of MODEL as lit discs."""
    with reported():
        check_ending("--output", output, (".png",))
        width, height = size_of(size)
        field = models.read(model, settings or [], water, axes)
        samples = _sampled(field, quiet, n=count, bounds=models.bounds(bounds), seed=seed, time_limit=time_limit)
        if len(samples) and style in MESHES:
            render(
                mesh_samples(samples, bounds=models.bounds(bounds)),
                output,
                style=style,  # type: ignore[arg-type]  # one of these, by the condition
                coloring=coloring,  # type: ignore[arg-type]  # checked by the core
                width=width,
                height=height,
                azimuth=azimuth * 0.017453292519943295,
                elevation=elevation * 0.017453292519943295,
                transparent=transparent,
            )
        elif len(samples):
            samples.picture(
                output,
                width=width,
                height=height,
                azimuth=azimuth * 0.017453292519943295,
                elevation=elevation * 0.017453292519943295,
                style=style,  # type: ignore[arg-type]  # checked by the core
                coloring=coloring,  # type: ignore[arg-type]
                transparent=transparent,
            )
        if as_json:
            print_json({"n": len(samples), "output": str(output), **samples.report.as_dict()})
        elif not quiet and len(samples):
            errors.print(f"wrote {output}", markup=False)
        finish(samples.report)


def main() -> None:
    """Entry point of the command."""
    app()


def version(wanted: bool) -> None:
    """Print the version and leave."""
    if wanted:
        typer.echo(isoswarm.__version__)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Even samples on implicit surfaces."""


def _sampled(field: Field, quiet: bool, *, method: str = "floaters", **request: Any) -> Samples:
    """Sample with a progress bar on standard error."""
    chosen: Method = method  # type: ignore[assignment]  # checked by the core
    with Progress(
        TextColumn("{task.description:<9}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=errors,
        transient=True,
        disable=quiet,
    ) as bar:
        task = bar.add_task("seeding", total=1.0)
        return sample(
            field,
            method=chosen,
            progress=lambda phase, fraction, _floaters, _steps: bar.update(task, description=phase, completed=fraction),
            **request,
        )


def check_ending(option: str, path: Path, endings: tuple[str, ...]) -> None:
    """Fail before the work rather than after it."""
    if not path.name.lower().endswith(endings):
        raise ValueError(f"{option}: expected a file that ends in {', '.join(endings)}, given {path}")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"{option}: there is no folder {path.absolute().parent}; create it first")


def size_of(text: str) -> tuple[int, int]:
    """``--size``: width and height."""
    width, _, height = text.lower().partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise ValueError(f"--size: expected width x height such as 1200x900, given {text!r}") from None


def print_rows(rows: list[tuple[str, str]]) -> None:
    """Names and values in two columns."""
    table = Table(box=None, show_header=False, pad_edge=False)
    for name, value in rows:
        table.add_row(name, value)
    Console(highlight=False).print(table)


def _print_parameters(parameters: list[dict[str, Any]]) -> None:
    table = Table("parameter", "value", "lowest", "highest", "", box=None, pad_edge=False, title_justify="left")
    shown = parameters[:40]
    for row in shown:
        table.add_row(row["path"], *(f"{row[key]:g}" for key in ("value", "lowest", "highest")), row["state"])
    Console(highlight=False).print(table)
    if len(parameters) > len(shown):
        typer.echo(f"… and {len(parameters) - len(shown)} more (--json lists all)")
