"""Evaluation beside fidget and JAX: the numbers of the Rust programme in benches/fidget and of jax_gradient.py."""

import json
import os
import subprocess
import sys
from typing import Any

from options import BENCHES, ROOT, Options
from table import Row, number


def _fidget(*arguments: str) -> Any:
    environment = {"CARGO_TARGET_DIR": str(ROOT / "build" / "bench-target"), **os.environ}
    command = ["cargo", "run", "--release", "--quiet", "--", *arguments]
    done = subprocess.run(
        command, cwd=BENCHES / "fidget", env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return json.loads(done.stdout)


def gradients(options: Options) -> list[Row]:
    """F + dF/dx + all dF/dq of 250 smooth-min blobs, m = 1000, one thread."""
    result = _fidget("gradients")
    try:
        script = [sys.executable, str(BENCHES / "jax_gradient.py")]
        result["jax"] = json.loads(subprocess.run(script, check=True, stdout=subprocess.PIPE, text=True).stdout)
    except subprocess.CalledProcessError as error:
        options.log(f"JAX did not run: {error}")
    ours = result["isoswarm"]["us_per_point"]
    text = f"{number(ours)} µs a point"
    what = "F, ∂F/∂x, all ∂F/∂q, m = 1000, one thread"
    rows = [Row(what, text, "", ours, "µs", 4.0, 2.0, more=False, data=result)]
    for name, reach, beyond in (("fidget", 150.0, 300.0), ("jax", 1.0, 1.5)):
        if name in result:
            theirs = result[name]["us_per_point"]
            rows.append(Row(what, text, f"{name} {number(theirs)} µs", theirs / ours, "x", reach, beyond))
    return rows


def csg(options: Options) -> list[Row]:
    """F + dF/dx at 100,000 surface points of the CSG part, one thread, pruning included."""
    result = _fidget("csg")
    del options
    ours = min(result["isoswarm"]["pruned"], key=lambda r: r["us_per_point"])
    whole = result["fidget"]["whole_us_per_point"]
    simplified = min(result["fidget"]["simplified"], key=lambda r: r["us_per_point"])
    same = [r for r in result["fidget"]["simplified"] if r["most"] == ours["most"]]
    same = min(same, key=lambda r: r["us_per_point"]) if same else simplified
    what = f"F, ∂F/∂x on a CSG part ({result['operations']} operations), 100,000 points"
    text = f"{number(ours['us_per_point'])} µs a point, ≤ {ours['most']} a leaf"
    peers = [
        ("fidget's JIT, whole tape", whole, 4.0, 10.0),
        (f"fidget, simplified, ≤ {same['most']} a leaf", same["us_per_point"], 1.0, 2.0),
        (f"fidget, simplified, its best (≤ {simplified['most']})", simplified["us_per_point"], 1.0, 2.0),
    ]
    return [
        Row(what, text, f"{name} {number(theirs)} µs", theirs / ours["us_per_point"], "x", reach, beyond, data=result)
        for name, theirs, reach, beyond in peers
    ]


def render(options: Options) -> list[Row]:
    """Primary hits and normals of pictures of 512 x 512, one thread."""
    del options
    rows = []
    for r in _fidget("render"):
        ours, theirs = r["isoswarm_ms"], r["fidget_ms"]
        what = f"ray cast 512 x 512, hits and normals, {r['model']}, one thread"
        peer = f"fidget's voxels {number(theirs)} ms"
        rows.append(Row(what, f"{number(ours)} ms", peer, theirs / ours, "x", 1 / 3, 1.0, data=r))
    return rows
