"""The command that opens the Studio in the browser."""

from __future__ import annotations

import webbrowser
from typing import Annotated

import typer

from isoswarm.cli import model as models
from isoswarm.cli.commands import Axes, Settings, Water, app
from isoswarm.cli.outcome import errors, reported
from isoswarm.serving import PORT, StudioServer


@app.command("studio")
def studio_command(
    model: Annotated[str | None, typer.Argument(metavar="[MODEL]", help=models.HELP)] = None,
    count: Annotated[int | None, typer.Option("-n", "--count", help="About this many floaters.")] = None,
    spacing: Annotated[float | None, typer.Option("--spacing", help="Instead of -n: distance of neighbours.")] = None,
    bounds: Annotated[str | None, typer.Option("--bounds", help="The box that clips the surface.")] = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0: any that is free.")] = PORT,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Open the Studio: shape MODEL, a scene or a model, in the browser. Ctrl-C ends it."""
    with reported():
        document = None
        if model is not None:
            if count is not None and spacing is not None:
                raise ValueError(f"expected -n or --spacing, given both (n={count}, spacing={spacing})")
            options = {"n": count, "spacing": spacing, "bounds": models.bounds(bounds)}
            document = models.read_scene(model, settings or [], water, axes, **options).to_json()
        with StudioServer(document, port=port) as server:
            typer.echo(server.url)
            if browser and not webbrowser.open(server.url):
                errors.print("no browser was found: open the address above in one", markup=False)
            server.wait()
