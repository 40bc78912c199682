"""A mesh that follows a surface which moves, and areas and volumes beside exact ones."""

import math

import numpy as np

from options import Options, timed
from peers import fields
from rows import surfaces
from table import Row, number

#: Frames of the animation.
FRAMES = 20
#: How much the parameter changes in a frame, in spacings.
MOTION = 0.05


def mesh_rows(options: Options) -> list[Row]:
    """A frame of a mesh of 20,000 vertices after small motion, beside a mesh made afresh."""
    import isoswarm as iso

    blobs, bounds = surfaces.field(fields.sixteen_blobs())
    torus = iso.torus(major=1.0, minor=0.4)
    return [*_frames(options, "16 blobs", blobs, bounds, "x0"), *_frames(options, "torus", torus, 1.6, "major")]


def _frames(options: Options, name: str, model, bounds, moved: str) -> list[Row]:
    """The same for one surface, of which a parameter changes."""
    import isoswarm as iso

    n = 2_000 if options.quick else 20_000
    scene = iso.Scene(model, n=n, bounds=bounds)
    scene.mesh()
    path = next(path for path in scene.parameters if path.endswith(moved))
    times = []
    for _ in range(FRAMES):
        scene.parameters[path].value += MOTION * scene.spacing
        scene.step()
        seconds, mesh = timed(Options(1, options.quick, options.processor), scene.mesh)
        times.append(seconds)
    if not mesh.report.closed:
        raise RuntimeError(f"the mesh that follows is not closed: {mesh.report}")
    frame = 1e3 * float(np.median(times))
    afresh, _ = timed(options, lambda: iso.mesh(scene.model, n=n, bounds=bounds))
    what = f"animated {name}, {n:,} vertices"
    text = f"{number(frame)} ms a frame"
    options.log(f"{what}: {text}, afresh {number(1e3 * afresh)} ms")
    return [
        Row(f"{what}: a frame", text, "", frame, "ms", 33.0, 16.0, more=False, data={"ms": times}),
        Row(f"{what}: beside afresh", text, f"mesh() {number(1e3 * afresh)} ms", 1e3 * afresh / frame, "x", 10.0, 10.0),
    ]


def measure_rows(options: Options) -> list[Row]:
    """Area and volume of a torus from 10,000 samples, over seeds: errors, and whether the error bars hold."""
    import isoswarm as iso

    torus = iso.torus(major=1.0, minor=0.4)
    exact = {"area": 4 * math.pi**2 * 0.4, "volume": 2 * math.pi**2 * 0.4**2}
    seeds = 5 if options.quick else 100
    found = []
    for seed in range(seeds):
        measures = iso.measure(torus, n=10_000, seed=seed)
        found.append({name: getattr(measures, name) for name in exact})
    rows = []
    for name, value in exact.items():
        errors = np.array([abs(float(f[name].value) - value) / value for f in found])
        bars = np.array([float(f[name].error) / value for f in found])
        worst, held = float(errors.max()), int(np.sum(errors <= bars))
        text = f"off by {worst:.1e} at most, bar {float(np.median(bars) / np.median(errors)):.1f} times the error"
        what = f"{name} of a torus, 10,000 samples, {seeds} seeds"
        rows += [
            Row(what, text, "", worst, "", 1e-5, 1e-8, more=False),
            Row(f"{what}: error bars that hold", f"{held}", "", 100 * held / seeds, "%", 95.0, 100.0),
        ]
    return rows
