"""What a run of the benchmarks is told, and the helpers that every row uses."""

import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

BENCHES = Path(__file__).resolve().parent
ROOT = BENCHES.parent


@dataclass(frozen=True)
class Options:
    """``runs``: how many are timed (the median counts); ``quick``: small sizes, to try the script itself."""

    runs: int = 5
    quick: bool = False
    log: Callable[[str], None] = print


def timed(call: Callable[[], Any], runs: int, *, limit: float = 20.0) -> tuple[float, Any]:
    """Median of the wall times of up to ``runs`` calls, in seconds, and the last result.

    The first call is not counted where calls are short; no further call is made once ``limit`` seconds have passed.
    """
    start = time.perf_counter()
    result = call()
    times = [time.perf_counter() - start]
    if times[0] < 1.0:
        times.clear()
    while len(times) < runs and (not times or time.perf_counter() - start < limit):
        begin = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), result


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
