"""A fit by scipy.optimize.least_squares: residuals and derivatives are those of isoswarm's own fit, evaluated by it."""

import contextlib
import subprocess
import time
from typing import Self

import numpy as np
from scipy.optimize import least_squares

METHODS = ("trf", "dogbox", "lm")


class Problem:
    """The programme crates/particles/examples/fit.rs as a server; ``command`` starts it."""

    def __init__(self, command: list[str]) -> None:
        self._process = subprocess.Popen([*command, "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.n, self.m = (int(v) for v in np.frombuffer(self._read(16), dtype=np.uint64))
        self.start = np.frombuffer(self._read(8 * self.m))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.stdin.close()
        self._process.wait()

    def _read(self, count: int) -> bytes:
        data = self._process.stdout.read(count)
        if len(data) < count:
            raise RuntimeError("the server of residuals ended early")
        return data

    def _ask(self, what: bytes, q: np.ndarray, count: int) -> np.ndarray:
        self._process.stdin.write(what + np.ascontiguousarray(q, dtype=float).tobytes())
        self._process.stdin.flush()
        return np.frombuffer(self._read(8 * count))

    def residuals(self, q: np.ndarray) -> np.ndarray:
        """(n,) at q (m,)."""
        return self._ask(b"r", q, self.n)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """(n, m) at q (m,)."""
        return self._ask(b"j", q, self.n * self.m).reshape(self.n, self.m)


class _StopError(Exception):
    """Good enough, or too late."""


def solve(problem: Problem, method: str, target: float, limit: float) -> dict:
    """Runs a method until its root mean square residual is at most ``target`` or ``limit`` seconds have passed.

    ``seconds`` leaves out all time in residuals and derivatives: what they cost in Python is not the peer's fault.
    ``log``: seconds and root mean square at each evaluation. ``reached``: whether the target was.
    """
    log: list[tuple[float, float]] = []
    outside, best = 0.0, np.inf
    begin = time.perf_counter()

    def residuals(q: np.ndarray) -> np.ndarray:
        nonlocal outside, best
        start = time.perf_counter()
        r = problem.residuals(q)
        rms = float(np.sqrt(np.mean(r * r)))
        seconds = start - begin - outside
        outside += time.perf_counter() - start
        best = min(best, rms)
        log.append((seconds, rms))
        if rms <= target or seconds > limit:
            raise _StopError
        return r

    def jacobian(q: np.ndarray) -> np.ndarray:
        nonlocal outside
        start = time.perf_counter()
        j = problem.jacobian(q)
        outside += time.perf_counter() - start
        return j

    options = {"max_nfev": 100_000, "ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15, "x_scale": "jac"}
    with contextlib.suppress(_StopError):
        least_squares(residuals, problem.start, jacobian, method=method, **options)
    return {"method": method, "seconds": log[-1][0], "rms": best, "reached": best <= target, "log": log}
