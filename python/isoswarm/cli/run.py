"""The command that replays a script on a scene."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from isoswarm import _core
from isoswarm._arrays import Floats
from isoswarm.cli import model as models
from isoswarm.cli.commands import Axes, Json, Model, Quiet, Settings, Water, app, check_ending, print_rows, size_of
from isoswarm.cli.outcome import Code, errors, print_json, reported, say
from isoswarm.drawing import draw
from isoswarm.field import Field
from isoswarm.pins import DragResult, FitResult, Floaters, Moment, Transfer
from isoswarm.rendering import render_marked
from isoswarm.scene import Scene
from isoswarm.script import read_script

EVERY = 2
Column = npt.NDArray[np.float32]


@app.command("run")
def run_command(
    model: Model,
    script: Annotated[Path, typer.Option("--script", help="The commands: a .json file.", dir_okay=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The scene at the end: an .iso.json file.", dir_okay=False)
    ] = None,
    frames: Annotated[
        Path | None, typer.Option("--frames", help="A folder for numbered .png pictures.", file_okay=False)
    ] = None,
    animation: Annotated[
        Path | None, typer.Option("--animation", help="One animated .png (or .apng).", dir_okay=False)
    ] = None,
    every: Annotated[int, typer.Option("--every", min=1, help="Steps from one picture to the next.")] = EVERY,
    rate: Annotated[float, typer.Option("--rate", min=0.1, max=1000, help="Pictures a second.")] = 20.0,
    style: Annotated[str, typer.Option("--style", help="discs, or surface: by ray casting.")] = "discs",
    size: Annotated[str, typer.Option("--size", help="Width x height in pixels.")] = "640x480",
    azimuth: Annotated[float, typer.Option("--azimuth", help="Direction of view, in degrees.")] = 35.0,
    elevation: Annotated[float, typer.Option("--elevation", help="Direction of view, in degrees.")] = 25.0,
    count: Annotated[int | None, typer.Option("-n", "--count", help="About this many floaters.")] = None,
    spacing: Annotated[float | None, typer.Option("--spacing", help="Instead of -n: distance of neighbours.")] = None,
    bounds: Annotated[str | None, typer.Option("--bounds", help="The box that clips the surface.")] = None,
    settings: Settings = None,
    water: Water = False,
    axes: Axes = 3,
    seed: Annotated[int | None, typer.Option("--seed", help="Of every random choice.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Replay the commands of a script on MODEL, a scene or a model, and draw what happens."""
    with reported():
        if output is not None:
            check_ending("--output", output, (".iso.json",))
        if animation is not None:
            check_ending("--animation", animation, (".png", ".apng"))
        if frames is not None and not frames.absolute().parent.is_dir():
            raise ValueError(f"--frames: there is no folder {frames.absolute().parent}; create it first")
        width, height = size_of(size)
        if count is not None and spacing is not None:
            raise ValueError(f"expected -n or --spacing, given both (n={count}, spacing={spacing})")
        commands = read_script(script)
        options = {"n": count, "spacing": spacing, "bounds": models.bounds(bounds), "seed": seed}
        scene = models.read_scene(model, settings or [], water, axes, **options)
        before = {path: p.value for path, p in scene.parameters.now.items()}
        if style not in ("discs", "surface"):
            raise ValueError(f"--style: expected discs or surface, given {style}")
        film = Film(cast=style == "surface") if frames is not None or animation is not None else None
        results = replayed(scene, commands, film, every, quiet)
        pictures: list[bytes] = []
        if film is not None:
            view = {"azimuth": math.radians(azimuth), "elevation": math.radians(elevation)}
            pictures = film.drawn(quiet, width=width, height=height, **view)
        if frames is not None:
            frames.mkdir(exist_ok=True)
            for k, png in enumerate(pictures):
                _core.write_bytes(frames / f"{k:05d}.png", png)
        if animation is not None:
            _core.write_bytes(animation, _core.animate(pictures, 1.0 / rate))
        if output is not None:
            scene.save(output)
        written = [str(path) for path in (output, animation) if path is not None]
        if frames is not None:
            written.append(f"{len(pictures)} pictures in {frames}")
        if as_json:
            print_json(as_document(scene, commands, results, output, len(pictures)))
        elif not quiet:
            print_report(scene, commands, results, before)
            for what in written:
                errors.print(f"wrote {what}", markup=False)
        missed = [
            f"command {k + 1} ({commands[k]['do']}): {result!r}"
            for k, result in enumerate(results)
            if (isinstance(result, DragResult) and not result.reached and result.ending != "released")
            or (isinstance(result, FitResult) and not result.converged)
        ]
        if missed:
            say("not reached", "; ".join(missed), "yellow")
            raise typer.Exit(Code.NOT_CONVERGED)


def replayed(scene: Scene, commands: list[dict[str, Any]], film: Film | None, every: int, quiet: bool) -> list[Any]:
    """Replay with a progress bar on standard error; says at which command it broke off."""
    place = 0
    with bar("replaying", quiet) as progress:
        task = progress.add_task("replaying", total=max(len(commands), 1))

        def told(moment: Moment) -> None:
            nonlocal place
            place = moment.command
            progress.update(task, completed=moment.command + moment.steps / max(moment.most, 1))
            if film is not None:
                film.add(moment.floaters, moment.pins, moment.pin_normals, moment.clock, moment.model)

        if film is not None:
            film.add(scene.floaters, *scene._inner.marks(), scene.clock, scene.model)
        try:
            return scene.replay(commands, progress=told, every=None if film is None else every)
        except Exception:
            progress.stop()
            if place < len(commands):
                say("broke off", f"at command {place + 1} of {len(commands)} ({commands[place]['do']})", "red")
            raise


class Film:
    """What there is to draw, kept until it is known how large the picture has to be."""

    def __init__(self, *, cast: bool = False) -> None:
        self.cast = cast
        self._models: list[tuple[Field | None, Floats, Floats]] = []
        self._frames: list[tuple[Column, ...]] = []
        self._clock = -1
        # Directions that are spread evenly, and the farthest that anything has been in each.
        z, turn = np.linspace(1, -1, 200), np.pi * (1 + 5**0.5) * np.arange(200)
        self._directions = np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
        self._outline = np.zeros((200, 3))
        self._reach = np.full(200, -np.inf)

    def add(self, floaters: Floaters, pins: Floats, pin_normals: Floats, clock: int, model: Field | None) -> None:
        """Keep a moment, instead of the last one if no time has passed."""
        if self._clock == clock:
            self._frames.pop()
            self._models.pop()
        self._clock = clock
        # Rays need the model only, which may be large: not where discs are drawn.
        self._models.append((model if self.cast else None, pins, pin_normals))
        columns = (floaters.points, floaters.normals, floaters.radii, pins, pin_normals)
        self._frames.append(tuple(column.astype(np.float32) for column in columns))
        reach = floaters.points @ self._directions.T
        first = reach.argmax(axis=0)
        reach = reach.max(axis=0)
        farther = reach > self._reach
        self._reach[farther] = reach[farther]
        self._outline[farther] = floaters.points[first[farther]]

    def drawn(self, quiet: bool, **options: Any) -> list[bytes]:
        """The pictures, all seen by the same camera."""
        pictures = []
        if self.cast:
            with bar("drawing", quiet) as progress:
                for model, pins, normals in progress.track(self._models, description="drawing"):
                    assert model is not None
                    pictures.append(render_marked(model, pins, normals, frame=self._outline, **options))
            return pictures
        with bar("drawing", quiet) as progress:
            for frame in progress.track(self._frames, description="drawing"):
                points, normals, radii, pins, pin_normals = (column.astype(np.float64) for column in frame)
                floaters = Floaters(points, normals, radii, np.zeros(len(points), dtype=np.uint64))
                pictures.append(draw(floaters, pins, pin_normals, frame=self._outline, ground=False, **options))
        return pictures


def bar(what: str, quiet: bool) -> Progress:
    """A progress bar on standard error."""
    return Progress(
        TextColumn(f"{what:<9}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=errors,
        transient=True,
        disable=quiet,
    )


def as_document(
    scene: Scene, commands: list[dict[str, Any]], results: list[Any], output: Path | None, pictures: int
) -> dict[str, Any]:
    """What ``--json`` prints."""
    told = [
        {"command": k, "do": commands[k]["do"], **result.as_dict()}
        for k, result in enumerate(results)
        if isinstance(result, DragResult | FitResult | Transfer)
    ]
    pins = [{"id": p.id, "name": p.name, "position": p.position.tolist(), "distance": p.distance} for p in scene.pins]
    return {
        "commands": len(results),
        "clock": scene.clock,
        "floaters": len(scene.floaters),
        "spacing": scene.spacing,
        "results": told,
        "pins": pins,
        "parameters": {path: p.value for path, p in scene.parameters.now.items()},
        "output": str(output) if output else None,
        "pictures": pictures,
    }


def print_report(scene: Scene, commands: list[dict[str, Any]], results: list[Any], before: dict[str, float]) -> None:
    """What happened, for people."""
    rows = [
        ("commands", f"{len(results)}, to step {scene.clock}"),
        ("floaters", f"{len(scene.floaters):,}, {scene.spacing:.4g} apart"),
        (
            "pins",
            f"{len(scene.pins)}, {max((p.distance for p in scene.pins), default=0.0):.2g} off the surface at most",
        ),
    ]
    for k, result in enumerate(results):
        if isinstance(result, DragResult | FitResult | Transfer):
            told = repr(result).partition(": ")[2].rstrip(">")
            rows.append((f"{k + 1}: {commands[k]['do']}", told))
    print_rows(rows)
    now = scene.parameters.now
    moved = [(path, before.get(path), p.value) for path, p in now.items() if before.get(path) != p.value]
    if moved:
        table = Table("parameter", "before", "now", box=None, pad_edge=False)
        for path, was, value in moved[:40]:
            table.add_row(path, "new" if was is None else f"{was:g}", f"{value:g}")
        Console(highlight=False).print(table)
        if len(moved) > 40:
            typer.echo(f"… and {len(moved) - 40} more (--json lists all)")
