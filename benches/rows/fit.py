"""A cold fit of 1000 parameters to 5000 points, beside scipy.optimize.least_squares on the same residuals."""

import json
import os
import subprocess

from options import ROOT, Options
from peers.fit import METHODS, Problem, solve
from table import Row, number


def rows(options: Options) -> list[Row]:
    """250 smooth-min blobs from a guess to noisy points of their surface; all threads.

    isoswarm runs until a step gains less than a hundredth of the cost; SciPy until it is as good, or until it has had
    30 times as long.
    SciPy's time is that of its own work alone; isoswarm's includes residuals and derivatives.
    """
    blobs, points = (25, 500) if options.quick else (250, 5000)
    environment = {"CARGO_TARGET_DIR": str(ROOT / "build" / "bench-target"), **os.environ}
    build = ["cargo", "build", "--release", "--quiet", "-p", "isoswarm-particles", "--example", "fit"]
    subprocess.run(build, cwd=ROOT, env=environment, check=True)
    program = os.path.join(environment["CARGO_TARGET_DIR"], "release", "examples", "fit")
    command = [program, "smooth", str(blobs), str(points)]
    done = subprocess.run([*command, str(options.runs)], check=True, stdout=subprocess.PIPE, text=True)
    ours = json.loads(done.stdout)
    results = []
    for method in METHODS:
        with Problem(command) as problem:
            results.append(solve(problem, method, ours["rms"], 30 * ours["seconds"]))
        last = results[-1]
        options.log(f"{method}: {last['seconds']:.2f} s, rms {last['rms']:.3g} (isoswarm {ours['rms']:.3g})")
    best = min(results, key=lambda r: (not r["reached"], r["seconds"]))
    sign = "" if best["reached"] else "> "
    return [
        Row(
            f"cold fit, m = {ours['parameters']}, {ours['points']} points",
            f"{number(ours['seconds'])} s",
            f"scipy {best['method']} {sign}{number(best['seconds'])} s",
            best["seconds"] / ours["seconds"],
            "x",
            1.0,
            10.0,
            data={"isoswarm": ours, "scipy": results},
        )
    ]
