"""Control points: steps a second while pins are dragged, one solve beside fidget's solver, numerical derivatives."""

import json
import os
import subprocess

from options import ROOT, Options, timed
from rows.native import _fidget
from table import Row, number


def _speed(part: str, steps: int, threads: int | None) -> dict:
    environment = {"CARGO_TARGET_DIR": str(ROOT / "build" / "bench-target"), **os.environ}
    if threads is not None:
        environment["RAYON_NUM_THREADS"] = str(threads)
    command = ["cargo", "run", "--release", "--quiet", "-p", "isoswarm-scene", "--example", "speed", "--"]
    done = subprocess.run(
        [*command, part, str(steps)], cwd=ROOT, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return json.loads(done.stdout)


def step_rows(options: Options) -> list[Row]:
    """Whole steps: pins, parameters, floaters."""
    rows = []
    for part, steps, threads, where, reach, beyond in (
        ("paper", 20_000, 1, "one core", 5000.0, 10_000.0),
        ("thousand", 1000, None, "all cores", 60.0, 120.0),
        ("local", 300, None, "all cores", 60.0, 60.0),
    ):
        count = steps // 10 if options.quick else steps
        best = max((_speed(part, count, threads) for _ in range(min(options.runs, 3))), key=_per_second)
        what = f"drag, m = {best['parameters']}, n = {best['pins']}, r = {best['floaters']:,}, {where}"
        rate = _per_second(best)
        rows.append(Row(what, f"{number(rate)} steps/s", "", rate, "/s", reach, beyond, data=best))
    return rows


def _per_second(result: dict) -> float:
    return result["steps_per_second"]


def solve_rows(options: Options) -> list[Row]:
    """One solve of a drag beside fidget's solver; at m = 1000 that takes two minutes."""
    del options
    rows = []
    for case in _fidget("solve"):
        ours, theirs = case["isoswarm"], case["fidget"]
        what = f"one solve of a drag, m = {case['m']}, n = {case['pins']}"
        text = f"{number(ours['ms'])} ms, off {ours['distance']:.0e}"
        peer = f"fidget-solver {number(theirs['ms'])} ms, off {theirs['distance']:.0e}" if theirs else "failed"
        ratio = theirs["ms"] / ours["ms"] if theirs else None
        rows.append(Row(what, text, peer, ratio, "x", 1.0, 10.0, data=case))
    return rows


def numerical_rows(options: Options) -> list[Row]:
    """The same drag of a formula and of a Python function without derivatives: what exact derivatives save."""
    import isoswarm as iso
    import numpy as np

    centres = [(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.6, 0.2)]
    start = {f"{a}{i}": c[k] for i, c in enumerate(centres) for k, a in enumerate("xyz")}
    start |= {f"r{i}": 0.6 for i in range(3)}

    def blobs(X: np.ndarray, **q: float) -> np.ndarray:
        total = np.zeros(len(X))
        for i in range(3):
            d = X - np.array([q[f"x{i}"], q[f"y{i}"], q[f"z{i}"]])
            total += np.exp(-np.einsum("ij,ij->i", d, d) / q[f"r{i}"] ** 2)
        return 0.5 - total

    terms = "+".join(f"exp(-((x-x{i})^2+(y-y{i})^2+(z-z{i})^2)/r{i}^2)" for i in range(3))
    box = ((-3, -3, -3), (3, 3, 3))
    models = {"formula": iso.parse(f"0.5-({terms})", **start), "numerical": iso.from_function(blobs, parameters=start)}
    seconds = {}
    for name, model in models.items():
        begin = iso.Scene(model, n=500, bounds=box, seed=0)
        hand = begin.pin((1.05, 0.0, 0.0))

        def drag(scene=begin, pin=hand) -> object:
            result = scene.drag(pin, to=(1.5, 0.4, 0.0))
            scene.undo()
            return result

        seconds[name], result = timed(options, drag)
        if not result.reached:
            raise RuntimeError(f"{name}: {result}")
    ratio = seconds["numerical"] / seconds["formula"]
    text = f"{number(1e3 * seconds['formula'])} ms"
    peer = f"numerical, in Python {number(1e3 * seconds['numerical'])} ms"
    return [Row("a drag to its end, m = 12, r = 500: both converge", text, peer, ratio, "x", 1.0, 1.0, data=seconds)]


def rows(options: Options) -> list[Row]:
    """All of them."""
    return step_rows(options) + solve_rows(options) + numerical_rows(options)
