"""The command that measures."""

from __future__ import annotations

import warnings

import typer

from isoswarm.cli import model as models
from isoswarm.cli.commands import Axes, Bounds, Count, Json, Model, Seed, Settings, Spacing, Water, app, print_rows
from isoswarm.cli.outcome import print_json, reported
from isoswarm.errors import SamplingWarning
from isoswarm.measuring import measure


@app.command("measure")
def measure_command(
    model: Model,
    count: Count = None,
    spacing: Spacing = None,
    bounds: Bounds = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    tolerance: float = typer.Option(1e-9, "--tolerance", help="Relative error that triangles are divided for."),
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Area, volume, centroid, inertia and curvature integrals of the surface of MODEL, each with its error."""
    with reported():
        field = models.read(model, settings or [], water, axes)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SamplingWarning)  # the notes are shown
            found = measure(
                field, n=count, spacing=spacing, bounds=models.bounds(bounds), tolerance=tolerance, seed=seed
            )
        if as_json:
            print_json(found.as_dict())
        else:
            print_rows(found.rows())
