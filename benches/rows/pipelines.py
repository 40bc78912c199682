"""sample() beside grid + marching cubes + Poisson-disk sampling, whole pipelines on both sides."""

import numpy as np

from options import Options, timed
from peers import fields, pipelines
from peers.evenness import evenness
from rows import surfaces
from table import Row, number

CELLS = 2
"""Grid cells across the distance between neighbouring samples: the mesh is to be finer than the samples."""


def rows(options: Options) -> list[Row]:
    """16 blobs at 10,000 and 100,000 samples, the protein at 100,000."""
    jobs = [(fields.sixteen_blobs(), 10_000), (fields.sixteen_blobs(), 100_000), (fields.protein(), 100_000)]
    if options.quick:
        jobs = jobs[:1]
    return [row for blobs, n in jobs for row in _compare(options, blobs, n)]


def _compare(options: Options, blobs: fields.Blobs, n: int) -> list[Row]:
    import isoswarm as iso

    field, bounds = surfaces.field(blobs)
    seconds, samples = timed(options, lambda: iso.sample(field, n=n, bounds=bounds))
    area = float(samples.areas.sum())
    ours = evenness(samples.points, area, samples.normals)
    options.log(f"{blobs.name} n={n}: isoswarm {seconds:.3f} s, {_short(ours)}")
    data = {"isoswarm": {"seconds": seconds, "evenness": ours, "report": str(samples.report)}, "peers": []}

    def by_isoswarm(cell: float) -> tuple[np.ndarray, np.ndarray]:
        lo, hi = (np.asarray(corner) for corner in bounds)
        lo = lo - cell
        axes = [np.arange(lo[a], hi[a] + 2 * cell, cell) for a in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return field.value(points.reshape(-1, 3)).reshape(points.shape[:3]), lo

    best: dict[tuple[str, int], tuple[float, str]] = {}
    cell = pipelines.hexagonal(area, n)
    for by, grid in (("NumPy", blobs.grid), ("isoswarm", by_isoswarm)):
        for cells in (CELLS, 1):
            grid_time, (values, corner) = timed(options, lambda g=grid, c=cells: g(cell / c))
            mesh_time, mesh = timed(
                options, lambda v=values, k=corner, c=cells: pipelines.marching_cubes(v, k, cell / c)
            )
            for name, sampler in pipelines.SAMPLERS.items():
                # On the coarser mesh only what was fastest on the finer one.
                if cells != CELLS and (by, CELLS) in best and best[by, CELLS][1] != name:
                    continue
                entry = _sample(options, data, sampler, name, mesh, n, (by, cells))
                if entry is None:
                    continue
                total = grid_time + mesh_time + entry["sampling"]
                entry |= {"grid": grid_time, "mesh": mesh_time, "total": total}
                if name in pipelines.DEFAULTS and total < best.get((by, cells), (np.inf,))[0]:
                    best[by, cells] = total, name
    what = f"sample({blobs.name}, n={n:,})"
    text = f"{number(seconds)} s, ρ_avg {ours['rho_avg']:.2f}"
    found = []
    for (by, cells), (total, name) in best.items():
        reach, beyond = (5.0, 10.0) if by == "NumPy" else (2.0, 4.0)
        peer = f"{name}, grid by {by}, {cells} cells a spacing: {number(total)} s"
        found.append(Row(what, text, peer, total / seconds, "x", reach, beyond, data=data))
    return found


def _sample(options: Options, data: dict, sampler, name: str, mesh, n: int, key: tuple[str, int]) -> dict | None:
    """One sampler on one mesh; on a mesh of the other grid with as many cells its time is not measured again."""
    by, cells = key
    known = [e for e in data["peers"] if e["name"] == name and e["cells"] == cells]
    if known:
        entry = dict(known[0]) | {"by": by}
    else:
        try:
            seconds, points = timed(options, lambda: sampler(mesh, n))
        except (ImportError, OSError, RuntimeError) as error:
            options.log(f"{name} did not run: {error}")
            return None
        even = evenness(points, pipelines.mesh_area(mesh))
        entry = {"name": name, "by": by, "cells": cells, "sampling": seconds, "evenness": even}
        options.log(f"  {name}, {cells} cells a spacing: {seconds:.2f} s, {_short(even)}")
    data["peers"].append(entry)
    return entry


def _short(even: dict[str, float]) -> str:
    return ", ".join(f"{key} {value:.3f}" if key != "n" else f"n {value}" for key, value in even.items())
