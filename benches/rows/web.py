"""The core in headless Chromium: the numbers of web/bench/run.mjs."""

import json
import subprocess

from options import ROOT, Options
from table import Row, number


def rows(options: Options) -> list[Row]:
    """Steps a second, a hand's latency, load and size in the browser."""
    subprocess.run([ROOT / "scripts" / "setup-web"], check=True)
    subprocess.run([ROOT / "scripts" / "build-wasm"], check=True, stdout=subprocess.DEVNULL)
    web = ["npm", "--prefix", str(ROOT / "web"), "run", "--silent"]
    subprocess.run([*web, "build:client"], check=True)
    subprocess.run([*web, "build", "--", "--logLevel", "warn"], check=True)
    done = subprocess.run([*web, "bench", "--", "--json"], check=True, stdout=subprocess.PIPE, text=True)
    found = json.loads(done.stdout)
    options.log("browser: wall time, one worker")
    steps, drag, load = found["steps20"]["rate"], found["drag5"]["median"], found["page"]
    size = {form: found["size"][form] / 1024 for form in ("brotli", "gzip")}
    where = "Chromium, headless"
    many = found["steps50"]["rate"]
    return [
        Row(
            "whole step, 16 blobs, 20,000 floaters",
            f"{number(steps)} steps/s",
            where,
            steps,
            "1/s",
            60.0,
            60.0,
            data=found,
        ),
        Row("whole step, 16 blobs, 50,000 floaters", f"{number(many)} steps/s", where, many, "1/s", 40.0, 40.0),
        Row("hand to moved surface, 5,000 floaters", f"{number(drag)} ms", where, drag, "ms", 50.0, 25.0, more=False),
        Row("the Studio, to first discs, warm", f"{number(load)} ms", where, load, "ms", 1500.0, 700.0, more=False),
        *(
            Row(f"WebAssembly, {form}", f"{number(kilobytes)} KB", where, kilobytes, "KB", 400.0, 200.0, more=False)
            for form, kilobytes in size.items()
        ),
    ]
