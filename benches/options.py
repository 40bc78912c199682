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
    """``runs``: how many are timed (the fastest counts); ``quick``: small sizes, to try the script itself."""

    runs: int = 5
    quick: bool = False
    log: Callable[[str], None] = print


def timed(call: Callable[[], Any], runs: int, *, limit: float = 20.0) -> tuple[float, Any]:
    """Smallest wall time of up to ``runs`` calls, in seconds, and the last result.

    Whatever else the machine does can only add. No further call is made once ``limit`` seconds have passed.
    """
    start = time.perf_counter()
    best = float("inf")
    for _ in range(runs):
        begin = time.perf_counter()
        result = call()
        best = min(best, time.perf_counter() - begin)
        if time.perf_counter() - start > limit:
            break
    return best, result


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
