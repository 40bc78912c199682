"""What a step of the floaters costs, and what a floater costs in memory."""

import json
import subprocess
import sys

from options import BENCHES, Options, cores, timed
from peers import fields
from rows import surfaces
from table import Row, number


def step_rows(options: Options) -> list[Row]:
    """Time of a relaxation step on 16 blobs, from the difference between two runs that take few and many steps."""
    import isoswarm as iso

    field, bounds = surfaces.field(fields.sixteen_blobs())
    rows = []
    for n, reach, beyond in ((100_000, 165.0, 100.0), (1_000_000, 100.0, 100.0)):
        if options.quick and n > 100_000:
            continue
        start = iso.sample(field, n=n, bounds=bounds, steps=2).points
        runs = {}
        for steps in (2, 12):
            seconds, samples = timed(
                options, lambda k=steps, s=start, m=n: iso.sample(field, n=m, bounds=bounds, start=s, steps=k)
            )
            runs[steps] = (seconds, samples.report.steps)
        (few, k0), (many, k1) = runs[2], runs[12]
        if k1 == k0:
            rows.append(Row(f"floater step, {n:,}", "", "", None, "ns", reach, beyond, more=False, note="no steps"))
            continue
        ns = 1e9 * (many - few) / (k1 - k0) / n
        what = f"floater step, 16 blobs, {n:,} floaters, {cores()} cores"
        text = f"{number(ns)} ns a floater, {number(1e9 / (ns * n))} steps/s"
        rows.append(Row(what, text, "", ns, "ns", reach, beyond, more=False, data={"runs": runs}))
    return rows


def memory_rows(options: Options) -> list[Row]:
    """Growth of the peak resident memory with n, results included, in fresh processes."""
    sizes = (100_000, 200_000) if options.quick else (500_000, 1_000_000)
    peaks = []
    for n in sizes:
        command = [sys.executable, str(BENCHES / "rows" / "peak.py"), str(n)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=BENCHES)
        peaks.append(json.loads(done.stdout)["bytes"])
    each = (peaks[1] - peaks[0]) / (sizes[1] - sizes[0])
    text = f"{number(each)} bytes"
    data = {"sizes": sizes, "peaks": peaks}
    return [Row("memory a floater (peak, with results)", text, "", each, "bytes", 300.0, 150.0, more=False, data=data)]
