"""Scenes and bad input: a clear answer, and the scene stays as it was."""

import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isoswarm as iso

NAN = float("nan")


@pytest.fixture(scope="module")
def scene() -> iso.Scene:
    scene = iso.Scene(iso.sphere(r=1).named("a") | iso.sphere(r=0.5).translate(x=3).named("b"), n=200)
    scene.pin((1, 0, 0), name="hand")
    return scene


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda s: s.pin((NAN, 0, 0)), ValueError, "finite"),
        (lambda s: s.pin((40, 0, 0)), ValueError, "off the surface"),
        (lambda s: s.pin((1, 0)), ValueError, "shape"),
        (lambda s: s.pin(1.0), ValueError, "one point of 3 numbers"),
        (lambda s: s.pin((0, 1, 0), name="hand"), ValueError, "a name that no other pin has"),
        (lambda s: s.pin((0, 1, 0), weight=0), ValueError, "weight"),
        (lambda s: s.pin((0, 1, 0), weight=NAN), ValueError, "weight"),
        (lambda s: s.pin((0, 1, 0), softness=-1), ValueError, "softness"),
        (lambda s: s.pin((0, 1, 0), grip=0), ValueError, "grip"),
        (lambda s: s.pin((0, 1, 0), line=(0, 0, 0)), ValueError, "not zero"),
        (lambda s: s.pin((0, 1, 0), line=(0, 0, 1), plane=(0, 0, 1)), ValueError, "line or plane"),
        (lambda s: s.unpin(7), iso.UnknownPinError, r"no pin 7; there are: 0 \(`hand`\)"),
        (lambda s: s["foot"], iso.UnknownPinError, "there is no pin 'foot'"),
        (lambda s: s.drag("hand"), ValueError, "expected a point to drag the pin to"),
        (lambda s: s.drag("hand", (NAN, 0, 0)), ValueError, "finite"),
        (lambda s: s.drag({"hand": (1, 0, 0)}, (1, 0, 0)), ValueError, "within the mapping"),
        (lambda s: s.drag({}), ValueError, "at least one pin"),
        (lambda s: s.drag(1.5, (1, 0, 0)), TypeError, "expected a Pin, its name or its number"),
        (lambda s: s.drag("hand", (1, 0, 0), radius=-1), ValueError, "radius"),
        (lambda s: s.drag("hand", (1, 0, 0), steps=-1), ValueError, "steps"),
        (lambda s: s.drag("hand", (1, 0, 0), steps=2.5), TypeError, "steps"),
        (lambda s: s.drag("hand", (1, 0, 0), every=0), ValueError, "every"),
        (lambda s: s.turn([], centre=(0, 0, 0)), ValueError, "at least one pin"),
        (lambda s: s.turn(["hand"], centre=(0, NAN, 0)), ValueError, "centre"),
        (lambda s: s.let_go(), iso.SceneStateError, "nothing is held"),
        (lambda s: s.redo(), iso.SceneStateError, "nothing to redo"),
        (lambda s: s.freeze("nothing/*"), iso.UnknownParameterError, "no parameter"),
        (lambda s: setattr(s.parameters["a/r"], "value", -1), ValueError, "a/r"),
        (lambda s: setattr(s.parameters["a/r"], "value", NAN), ValueError, "finite"),
        (lambda s: setattr(s.parameters["a/r"], "value", "big"), ValueError, "expected numbers"),
        (lambda s: setattr(s.parameters["a/r"], "bounds", (2, 3)), ValueError, "contain its value"),
        (lambda s: setattr(s.parameters["a/r"], "scale", 0), ValueError, "scale"),
        (lambda s: s.configure(gain=0), ValueError, "gain"),
        (lambda s: s.configure(gain=0.5, speed=9), ValueError, "speed"),
        (lambda s: s.configure(colour=1), TypeError, "there is no setting 'colour'"),
        (lambda s: s.configure(n=10**9), ValueError, "floaters"),
        (lambda s: s.configure(seed=-1), ValueError, "seed"),
        (lambda s: s.configure(focus=(0, 1)), ValueError, "focus"),
        (lambda s: s.add("", "sphere(r="), iso.ParseError, "position"),
        (lambda s: s.add("", 3), TypeError, "expected a Field or a formula"),
        (lambda s: s.add("nobody", "sphere(r=1)"), ValueError, "nobody"),
        (lambda s: s.replace("", "x^2 + y^2 + z^2 + 1"), iso.EmptySurfaceError, "no surface"),
        (lambda s: s.remove("c"), ValueError, "`c`"),
        (lambda s: s.wrap("a", "frobnicate"), ValueError, "frobnicate"),
        (lambda s: s.wrap("a", "twist", speed=1), ValueError, "no parameter `speed`"),
        (lambda s: s.unwrap("a"), ValueError, "operand"),
        (lambda s: s.reorder("", [0, 0]), ValueError, "once"),
        (lambda s: s.fit([]), ValueError, "points"),
        (lambda s: s.fit([[NAN, 0, 0]]), ValueError, "finite"),
        (lambda s: s.fit([[1, 0, 0]], [1, 2]), ValueError, "weights"),
        (lambda s: s.fit([[1, 0, 0]], loss="taste"), ValueError, "loss: expected"),
        (lambda s: s.fit([[1, 0, 0]], loss=("huber", -1)), ValueError, "-1"),
        (lambda s: s.fit([[1, 0, 0]], iterations=0), ValueError, "iterations"),
        (lambda s: s.replay([{"do": "drag", "hands": [], "speed": 3}]), iso.FileFormatError, "speed"),
    ],
)
def test_it_is_refused_and_the_scene_stays(
    scene: iso.Scene, change: Callable[[iso.Scene], Any], error: type[Exception], message: str
) -> None:
    def state() -> tuple[Any, ...]:
        rows = [(path, p.value, p.bounds, p.scale, p.frozen) for path, p in scene.parameters.now.items()]
        return rows, scene.floaters.points.tolist(), len(scene.log), scene.history, scene.pins, str(scene.settings)

    before = state()
    with pytest.raises(error, match=message):
        change(scene)
    assert state() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model": "x - y"}, "give `bounds`"),
        ({"model": "x^2 + y^2 + z^2 + 1", "bounds": 2}, "no surface"),
        ({"model": "sphere(r=1)", "n": 10, "spacing": 0.1}, "given both"),
        ({"model": "sphere(r=1)", "spacing": 0}, "spacing"),
        ({"model": "sphere(r=1)", "spacing": NAN}, "finite"),
        ({"model": "sphere(r=1)", "bounds": ((1, 1, 1), (0, 0, 0))}, "lo < hi"),
        ({"model": "sphere(r=1)", "recovery": 2}, "recovery"),
    ],
)
def test_a_scene_that_makes_no_sense(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        iso.Scene(**arguments)


def test_what_is_no_model() -> None:
    with pytest.raises(TypeError, match="expected a Field or a formula"):
        iso.Scene(3)  # type: ignore[arg-type]


def bumpy(X: np.ndarray, r: float) -> np.ndarray:
    return np.linalg.norm(X, axis=1) - r + 0.02 * np.sin(5 * X[:, 0])


def test_a_function_of_points_and_parameters_is_dragged_like_everything_else(tmp_path: Path) -> None:
    field = iso.from_function(bumpy, parameters={"r": 1.0}, bounds=2)
    scene = iso.Scene(field, n=150)
    (start,) = field.project([[1, 0, 0]])
    assert scene.drag(scene.pin(start), to=(1.4, 0, 0)).reached
    assert scene.parameters["function/r"].value == pytest.approx(1.4 + 0.02 * np.sin(7), abs=1e-6)
    assert abs(scene.model.value([[1.4, 0, 0]])[0]) < 1e-8
    path = tmp_path / "bumpy.iso.json"
    scene.save(path)
    back = iso.load(path, functions={"bumpy": field})
    assert back.parameters["function/r"].value == scene.parameters["function/r"].value
    with pytest.raises(ValueError, match="bumpy"):
        iso.load(path)


def test_a_function_can_be_added_even_within_a_formula() -> None:
    scene = iso.Scene(iso.sphere(r=1), n=150, bounds=4)
    part = iso.from_function(lambda X: np.linalg.norm(X - [2.5, 0, 0], axis=1), name="far", bounds=4) - 0.5
    scene.add("", part)
    assert (scene.floaters.points[:, 0] > 1.5).sum() > 10
    other = iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 2, name="far", bounds=4)
    with pytest.raises(ValueError, match="two functions called `far`"):
        scene.add("", other)
    scene.add("", part.named("again"))


def test_a_function_that_raises_in_mid_step_leaves_the_scene_as_it_was() -> None:
    calls = {"left": None}

    def touchy(X: np.ndarray, r: float) -> np.ndarray:
        if calls["left"] is not None:
            calls["left"] -= 1
            if calls["left"] < 0:
                raise LookupError("no more")
        return np.linalg.norm(X, axis=1) - r

    scene = iso.Scene(iso.from_function(touchy, parameters={"r": 1.0}, bounds=2), n=100)
    hand = scene.pin((1, 0, 0))
    before = scene.floaters.points.copy(), scene.clock, len(scene.log)
    for calls_left in (0, 7, 40):
        calls["left"] = calls_left
        with pytest.raises(LookupError, match="no more"):
            scene.drag(hand, to=(1.5, 0, 0))
        calls["left"] = None
        assert scene.parameters["function/r"].value == 1.0
        np.testing.assert_array_equal(scene.floaters.points, before[0])
        assert (scene.clock, len(scene.log)) == before[1:]
    assert scene.drag(hand, to=(1.5, 0, 0)).reached


@pytest.mark.parametrize("work", ["step", "drag", "replay"])
def test_ctrl_c_ends_it_within_a_second(work: str) -> None:
    scene = iso.Scene(iso.torus(major=1, minor=0.4), n=3000)
    hand = scene.pin((1.4, 0, 0))
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    run: dict[str, Callable[[], Any]] = {
        "step": lambda: scene.step(10**6),
        "drag": lambda: [scene.configure(speed=1e-6), scene.drag(hand, to=(1e3, 0, 0), steps=10**6)],
        "replay": lambda: scene.replay([{"do": "freeze", "pattern": "*"}, {"do": "step", "at_step": 10**6}]),
    }
    timer = threading.Timer(0.7, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        run[work]()
    assert time.perf_counter() - pressed[0] < 1.0
    assert scene.clock > 0
    assert not scene.is_held
    scene.release("*")
    scene.configure(speed=0.05)
    assert scene.drag(hand, to=(*hand.position[:2] * 1.1, hand.position[2])).reached


def test_threads_do_not_meet_in_a_scene() -> None:
    scene = iso.Scene(iso.sphere(r=1), n=500)
    seen: list[str] = []

    def look() -> None:
        try:
            _ = scene.clock
        except RuntimeError as error:
            seen.append(str(error))

    def progress(moment: iso.Moment) -> None:
        other = threading.Thread(target=look)
        other.start()
        other.join()

    scene.step(3, progress=progress, every=1)
    assert len(seen) == 3
    assert "at work" in seen[0]
