"""The command ``isoswarm mesh``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from isoswarm.cli import model as models
from isoswarm.cli.commands import (
    Bounds,
    Json,
    Limit,
    Model,
    Quiet,
    Seed,
    Settings,
    Water,
    app,
    check_ending,
    print_rows,
)
from isoswarm.cli.outcome import Code, errors, print_json, reported, say
from isoswarm.meshing import mesh

ENDINGS = (".ply", ".obj", ".stl", ".glb", ".3mf", ".vtp", ".npz")


@app.command("mesh")
def mesh_command(
    model: Model,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help=f"A {', '.join(ENDINGS)} file.", dir_okay=False),
    ] = None,
    count: Annotated[
        int | None, typer.Option("-n", "--count", help="About so many vertices.", show_default="10000")
    ] = None,
    spacing: Annotated[
        float | None, typer.Option("--spacing", help="Instead of -n: mean distance of neighbours.")
    ] = None,
    error: Annotated[
        float | None, typer.Option("--error", help="Instead of -n: largest distance from the surface.")
    ] = None,
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    density: Annotated[str | None, typer.Option("--density", help="'curvature' for more vertices there.")] = None,
    rule: Annotated[str, typer.Option("--rule", help="delaunay or circumsphere.")] = "delaunay",
    seed: Seed = 0,
    time_limit: Limit = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Mesh the surface of MODEL with triangles."""
    with reported():
        if output is not None:
            check_ending("--output", output, ENDINGS)
        field = models.read(model, settings or [], water, 3)
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
            made = mesh(
                field,
                n=count,
                spacing=spacing,
                error=error,
                bounds=models.bounds(bounds),
                density=density,  # type: ignore[arg-type]  # checked there
                rule=rule,  # type: ignore[arg-type]  # checked by the core
                seed=seed,
                time_limit=time_limit,
                progress=lambda phase, fraction, _n, _steps: bar.update(task, description=phase, completed=fraction),
            )
        if output is not None and len(made):
            made.save(output)
        if as_json:
            print_json({"output": str(output) if output else None, **made.report.as_dict()})
        elif not quiet:
            print_rows(made.report.rows())
            if output is not None and len(made):
                errors.print(f"wrote {output}", markup=False)
        if not made.report.vertices:
            raise typer.Exit(Code.EMPTY)
        if not made.report.sound:
            say("not sound", "see the warnings of the report", "yellow")
            raise typer.Exit(Code.NOT_CONVERGED)
