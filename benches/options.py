"""What a run of the benchmarks is told, and the helpers that every row uses."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

BENCHES = Path(__file__).resolve().parent
ROOT = BENCHES.parent


@dataclass(frozen=True)
class Options:
    """``runs``: how many are timed (the fastest counts); ``quick``: small sizes, to try the script itself.

    ``processor``: processor time of all threads instead of wall time, for a machine that is busy with other things.
    """

    runs: int = 5
    quick: bool = False
    processor: bool = False
    log: Callable[[str], None] = print


def timed(options: Options, call: Callable[[], Any], limit: float = 8.0) -> tuple[float, Any]:
    """Smallest time of up to ``options.runs`` calls, in seconds, and the last result.

    Whatever else the machine does can only add. No further call is made once ``limit`` seconds have passed.
    """
    clock = time.process_time if options.processor else time.perf_counter
    start = time.perf_counter()
    best = float("inf")
    for _ in range(options.runs):
        begin = clock()
        result = call()
        best = min(best, clock() - begin)
        if time.perf_counter() - start > limit:
            break
    return best, result


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
