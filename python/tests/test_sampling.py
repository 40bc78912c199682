"""The main job, through Python. (The core's own tests look at evenness and at the schemes in depth.)"""

import _thread
import os
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pytest

import isoswarm as iso

ball = iso.sphere()


def off(samples: iso.Samples) -> float:
    """Largest distance from the surface."""
    F, Fx = samples.field.value_gradient(samples.points)
    return float(np.max(np.abs(F) / np.linalg.norm(Fx, axis=1)))


@pytest.mark.parametrize("n", [1, 2, 7, 100, 1234])
def test_exactly_n(n: int) -> None:
    samples = iso.sample(ball, n=n, bounds=1.5)
    assert len(samples) == n
    for column, width in (("points", 3), ("normals", 3), ("curvatures", 2)):
        assert getattr(samples, column).shape == (n, width)
    for column in ("radii", "areas", "component"):
        assert getattr(samples, column).shape == (n,)
    assert off(samples) < 2e-12


@pytest.mark.parametrize("spacing", [0.3, 0.1])
def test_spacing_is_met(spacing: float) -> None:
    samples = iso.sample(iso.torus(1.0, 0.4), spacing=spacing)
    assert samples.report.spacing == pytest.approx(spacing, rel=0.05)
    d = np.linalg.norm(samples.points[:, None] - samples.points[None], axis=2)
    np.fill_diagonal(d, np.inf)
    assert d.min(axis=1).mean() == pytest.approx(spacing, rel=0.05)


def test_a_sphere_is_a_sphere() -> None:
    samples = iso.sample(iso.sphere(2.0), n=2000)
    np.testing.assert_allclose(samples.normals, samples.points / 2, rtol=0, atol=1e-10)
    np.testing.assert_allclose(samples.curvatures, 0.5, rtol=1e-8)
    assert samples.areas.sum() == pytest.approx(16 * np.pi, rel=2e-3)
    assert samples.report.area == pytest.approx(samples.areas.sum(), rel=1e-12)
    assert samples.report.components == 1
    assert samples.report.certified
    assert samples.report.converged


def test_evenness_of_five_thousand() -> None:
    even = iso.sample(iso.torus(1.0, 0.5), n=5000).report.evenness
    assert even.rho_min >= 0.80
    assert even.rho_avg >= 0.92
    assert even.cv <= 0.04
    assert even.six_valent >= 0.75


def test_the_same_seed_gives_the_same_result_on_any_number_of_threads() -> None:
    code = (
        "import isoswarm as iso, hashlib;"
        "s = iso.sample(iso.torus(1.0, 0.4), n=3000, seed=5);"
        "print(hashlib.sha256(s.points.tobytes() + s.areas.tobytes()).hexdigest())"
    )
    hashes = {
        subprocess.run(
            [sys.executable, "-c", code],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "RAYON_NUM_THREADS": threads},
        ).stdout
        for threads in ("1", "2", "3")
    }
    assert len(hashes) == 1
    one, two = (iso.sample(ball, n=100, seed=seed).points for seed in (1, 2))
    assert not np.array_equal(one, two)


def test_every_component_is_found() -> None:
    grid = [ball.scale(0.3).translate(i, j, k) for i in range(3) for j in range(3) for k in range(3)]
    tiny = iso.sphere(0.01).translate(x=5)
    samples = iso.sample(iso.union(*grid, tiny), n=3000)
    assert samples.report.components == 28
    assert samples.report.certified
    assert len(np.unique(samples.component)) == 28
    assert (np.linalg.norm(samples.points - [5, 0, 0], axis=1) < 0.011).any()


def test_a_box_clips_what_leaves_it() -> None:
    samples = iso.sample(iso.plane(), n=500, bounds=((-1, -1, -1), (1, 1, 1)))
    assert np.abs(samples.points).max() <= 1.0
    assert samples.report.on_bounds > 50
    assert samples.areas.sum() == pytest.approx(4.0, rel=0.02)


def test_a_curve_in_the_plane() -> None:
    x, y = iso.xy()
    samples = iso.sample(x**2 + y**2 - 1, n=100, bounds=1.5)
    assert not samples.points[:, 2].any()
    assert samples.report.area == pytest.approx(2 * np.pi, rel=1e-3)
    angles = np.sort(np.arctan2(samples.points[:, 1], samples.points[:, 0]))
    assert np.diff(angles) == pytest.approx(2 * np.pi / 100, rel=0.1)


@pytest.mark.parametrize("size", [1e-70, 1e-6, 1.0, 1e6, 1e70])
def test_any_size(size: float) -> None:
    samples = iso.sample(iso.torus(size, 0.4 * size), n=500)
    assert off(samples) < 1e-11 * size
    assert samples.report.evenness.rho_avg > 0.9
    assert samples.areas.sum() == pytest.approx(4 * np.pi**2 * 0.4 * size**2, rel=0.01)


def test_density_by_a_function() -> None:
    samples = iso.sample(ball, n=4000, bounds=1.5, density=lambda X: np.where(X[:, 2] > 0, 4.0, 1.0))
    upper = (samples.points[:, 2] > 0).mean()
    assert upper == pytest.approx(0.8, abs=0.02)


def test_density_by_curvature() -> None:
    pancake = iso.parse("x^2 + y^2 + (z/0.2)^2 - 1")
    even, curved = (iso.sample(pancake, n=3000, density=d) for d in (None, "curvature"))

    def at_the_rim(s: iso.Samples) -> float:
        return float((np.hypot(s.points[:, 0], s.points[:, 1]) > 0.95).mean())

    assert at_the_rim(curved) > 2 * at_the_rim(even)


def test_random_points_are_independent_and_uniform() -> None:
    samples = iso.sample(ball, n=20_000, bounds=1.5, method="random", seed=3)
    assert off(samples) < 1e-11
    # Archimedes: z is uniform on a sphere; the mean of 20,000 has standard deviation 0.0041.
    assert abs(samples.points.mean(axis=0)).max() < 4 * 0.0041
    counts, _ = np.histogram(samples.points[:, 2], bins=20, range=(-1, 1))
    chi2 = ((counts - 1000) ** 2 / 1000).sum()
    assert 5 < chi2 < 45  # 19 degrees of freedom
    # Independent points: nearest neighbours as a Poisson process has them.
    assert samples.report.evenness.rho_avg == pytest.approx(0.465, abs=0.01)


@pytest.mark.parametrize("method", ["adaptive", "simple", "fissioning"])
def test_the_schemes_of_1994(method) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", iso.SamplingWarning)  # adaptive meets a number only about
        samples = iso.sample(ball, n=256, bounds=1.5, method=method)
    assert off(samples) < 1e-11
    assert samples.report.evenness.cv < 0.1
    assert len(samples) == pytest.approx(256, rel=0.15)


@pytest.mark.parametrize("asked", [{"n": 200}, {"spacing": 2 * np.pi / 200}])
def test_the_adaptive_scheme_of_1994_on_a_curve(asked) -> None:
    circle = iso.parse("x^2 + y^2 - 1", axes=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", iso.SamplingWarning)
        samples = iso.sample(circle, method="adaptive", **asked)
    assert len(samples) == pytest.approx(200, rel=0.1)


def test_start_goes_on_from_earlier_points() -> None:
    first = iso.sample(iso.sphere(1.0), n=2000)
    second = iso.sample(iso.sphere(1.05), n=2000, start=first)
    assert off(second) < 2e-12
    assert second.report.evenness.rho_avg > 0.92
    moved = np.linalg.norm(second.points[:, None] - first.points[None, ::10], axis=2).min(axis=0)
    assert np.median(moved) < 0.5 * first.report.spacing + 0.05
    assert second.report.steps <= first.report.steps


def test_an_empty_surface_is_a_result_with_one_warning() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        samples = iso.sample(iso.parse("x^2 + y^2 + z^2 + 1"), n=100, bounds=2.0)
    assert [w.category for w in caught] == [iso.EmptySurfaceWarning]
    assert len(samples) == 0
    assert samples.points.shape == (0, 3)
    assert samples.report.status == "empty"
    assert samples.report.components == 0
    with pytest.raises(iso.ConvergenceError):
        samples.require_converged()


def test_a_time_limit_gives_what_there_is() -> None:
    began = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        samples = iso.sample(ball, n=300_000, bounds=1.5, time_limit=0.3)
    assert time.perf_counter() - began < 2.0
    assert samples.report.status == "not converged"
    assert "time" in samples.report.reason
    if len(samples):
        assert off(samples) < 1e-11


def test_progress_is_told() -> None:
    told: list[tuple[str, float, int, int]] = []
    iso.sample(ball, n=50_000, bounds=1.5, progress=lambda *state: told.append(state))
    assert {phase for phase, *_ in told} <= {"seeding", "relaxing", "finishing"}
    fractions = [fraction for _, fraction, *_ in told]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] <= fractions[-1] <= 1
    assert len(told) >= 2


@pytest.mark.parametrize("threads", ["1", "2"])
def test_progress_functions_may_use_the_library(threads: str) -> None:
    program = """
import threading
import numpy as np
import isoswarm as iso

ball = iso.parse("x^2 + y^2 + z^2 - 1")
points = np.zeros((20_000, 3))
told = []

def progress(*_):
    told.append(ball.value(points).sum() + len(iso.sample(ball, n=50)))

def run():
    iso.sample(ball, n=20_000, progress=progress)

runs = [threading.Thread(target=run) for _ in range(3)]
[r.start() for r in runs]
[r.join() for r in runs]
print(len(told) >= len(runs))
"""
    environment = os.environ | {"RAYON_NUM_THREADS": threads}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "True", done.stderr


def test_ctrl_c_works_within_a_second() -> None:
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.perf_counter())
        _thread.interrupt_main()

    timer = threading.Timer(0.5, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        iso.sample(iso.torus(1.0, 0.4), n=2_000_000)
    assert time.perf_counter() - pressed[0] < 1.0


def test_other_threads_run_meanwhile() -> None:
    ticks = 0
    done = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    began = time.perf_counter()
    iso.sample(ball, n=30_000, bounds=1.5)
    seconds = time.perf_counter() - began
    done.set()
    counter.join()
    assert ticks > 100 * seconds


def test_a_plain_python_function() -> None:
    threads = set()

    def F(X: np.ndarray) -> np.ndarray:
        threads.add(threading.get_ident())
        return np.linalg.norm(X, axis=1) - 1

    samples = iso.sample(iso.from_function(F, bounds=1.5), n=1000)
    assert threads == {threading.get_ident()}
    assert np.abs(np.linalg.norm(samples.points, axis=1) - 1).max() < 1e-9
    assert samples.report.evenness.rho_avg > 0.92
    assert not samples.report.certified


def test_a_function_within_a_model() -> None:
    wavy = iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 1 + 0.1 * np.sin(5 * X[:, 0]), bounds=1.5)
    shape = wavy - iso.sphere(0.4).translate(z=1)
    samples = iso.sample(shape, n=2000, bounds=1.6)
    assert np.abs(shape.value(samples.points)).max() < 1e-8
