"""Scenes: what a person holds, drags, locks, edits, undoes and saves."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

PAIR = "smooth_union(translate(sphere(r=1), x=-0.8), translate(sphere(r=0.7), x=0.9), k=0.3)"


def ball(n: int = 200) -> iso.Scene:
    return iso.Scene(iso.sphere(r=1.0), n=n)


def off(scene: iso.Scene, X: np.ndarray) -> float:
    """Largest distance between points and the surface."""
    F, gradient = scene.model.value_gradient(X)
    return float(np.max(np.abs(F) / np.linalg.norm(gradient, axis=1)))


def values(scene: iso.Scene) -> list[float]:
    return [p.value for p in scene.parameters.values()]


def test_a_drag_takes_the_surface_along() -> None:
    scene = iso.Scene(PAIR, n=300)
    foot, hand = scene.pin((-1.8, 0, 0)), scene.pin((1.6, 0, 0), name="hand")
    held = foot.position
    result = scene.drag(hand, to=(2.2, 0.4, 0.1))
    assert result.reached
    assert (result.rank, result.pins, result.ending) == (2, 2, "reached")
    np.testing.assert_allclose(hand.position, [2.2, 0.4, 0.1], atol=1e-8)
    assert hand.distance < 1e-9
    assert foot.distance < 1e-9
    np.testing.assert_array_equal(foot.position, held)
    assert off(scene, scene.floaters.points) < 1e-4
    # A swarm of discs that point outward, each with its own number.
    floaters = scene.floaters
    assert floaters.points.shape == floaters.normals.shape == (len(floaters), 3)
    np.testing.assert_allclose(np.linalg.norm(floaters.normals, axis=1), 1.0)
    assert len(set(floaters.ids.tolist())) == len(floaters)
    # What the pin did not move it slipped: the way it went is what was asked for.
    assert result.slip[hand].shape == (3,)
    assert result.slip[hand] is result.slip[1]


def test_floaters_have_normals_from_the_start() -> None:
    floaters = ball().floaters
    np.testing.assert_allclose(floaters.normals, floaters.points, atol=1e-6)


def test_a_result_is_told_to_people() -> None:
    scene = ball()
    hand = scene.pin((1, 0, 0))
    scene.parameters["sphere/r"].bounds = (0.5, 1.2)
    result = scene.drag(hand, to=(2, 0, 0))
    assert not result.reached
    assert result.at_limit == ("sphere/r",)
    assert result.distance == pytest.approx(0.8, abs=1e-6)
    assert repr(result).startswith("<DragResult: stuck in ")
    assert "0.8 left" in repr(result)
    assert "held back by sphere/r" in repr(result)
    assert "at a limit" in str(result)
    json.dumps(result.as_dict())


def test_pins_are_known_by_number_and_name() -> None:
    scene = ball()
    a, b = scene.pin((1, 0, 0), name="hand", weight=2), scene.pin((0, 1, 0), line=(0, 0, 2), grip=0.3, softness=0.1)
    assert scene.pins == (a, b)
    assert (a, b) == (0, 1)
    assert {0: "x"}[a] == "x"
    assert scene["hand"] == a == scene[0]
    assert (a.name, a.weight, a.line, a.plane, a.grip) == ("hand", 2.0, None, None, None)
    assert b.line is not None
    assert (b.line.tolist(), b.softness, b.grip) == ([0, 0, 1], 0.1, 0.3)
    assert scene.drag("hand", to=(1.1, 0, 0)).steps > 0
    b.remove()
    assert not b.exists
    assert scene.pins == (a,)
    assert "removed" in repr(b)
    with pytest.raises(iso.UnknownPinError, match=r"there is no pin 1; there are: 0 \('hand'\)"):
        b.position  # noqa: B018
    with pytest.raises(iso.UnknownPinError, match="there is no pin"):
        scene.drag("foot", to=(0, 0, 0))
    with pytest.raises(ValueError, match="belongs to another scene"):
        ball().drag(a, to=(1, 0, 0))
    assert ball().pin((1, 0, 0)) != a
    # A pin on a plane goes where the plane lets it.
    on_plane = ball().pin((1, 0, 0), plane=(0, 0, 1))
    assert on_plane.plane is not None
    assert on_plane.plane.tolist() == [0, 0, 1]


def test_parameters_can_be_set_frozen_and_bounded() -> None:
    scene = iso.Scene(iso.sphere(r=1).named("arm") | iso.box(0.5, 0.5, 0.5).named("body").translate(x=3), n=300)
    radius = scene.parameters["arm/r"]
    radius.value = 0.8
    assert scene.model.parameters["arm/r"].value == 0.8
    assert off(scene, scene.floaters.points) < 1e-6
    radius.bounds = (0.5, math.inf)
    radius.scale = 0.25
    assert (radius.bounds, radius.scale) == ((0.5, math.inf), 0.25)
    with pytest.raises(ValueError, match="arm/r"):
        radius.value = 0.2
    assert radius.value == 0.8
    scene.freeze("*body/*", "translate/*")
    assert [path for path, p in scene.parameters.items() if not p.frozen] == ["arm/r"]
    kept = values(scene)[1:]
    hand = scene.pin((0.8, 0, 0))
    assert scene.drag(hand, to=(1, 0, 0)).reached
    assert values(scene)[1:] == kept
    scene.release()
    assert not any(p.frozen for p in scene.parameters.values())
    radius.frozen = True
    assert scene.parameters.now["arm/r"].frozen
    scene.remove("arm")
    with pytest.raises(iso.UnknownParameterError, match="no longer"):
        radius.value  # noqa: B018
    with pytest.raises(iso.UnknownParameterError, match="there are: "):
        scene.parameters["arm/r"]


def test_several_pins_at_once_and_a_handle() -> None:
    scene = iso.Scene("rotate(ellipsoid(1.5, 1, 0.8), 0, az=1)", n=200)
    scene.freeze("ellipsoid/*")
    for axis in ("ax", "ay", "az"):
        scene.parameters[f"rotate/{axis}"].frozen = True
    a = scene.pin((1.06, 0.7, 0))
    assert scene.turn([a], centre=(0, 0, 0), rotation=(0, 0, 0.7)).reached
    (free,) = [p for p in scene.parameters.values() if not p.frozen]
    assert free.value == pytest.approx(0.7, abs=1e-6)
    moved = iso.Scene("translate(sphere(r=1))", n=200)
    hands = {moved.pin((-1, 0, 0)): (-1, 0, 0), moved.pin((1, 0, 0), name="e"): (2, 0, 0)}
    assert moved.drag(hands).reached
    assert values(moved)[0] == pytest.approx(0.5, abs=1e-6)
    region = ball()
    result = region.drag(region.pin((0, 0, 1), grip=0.2), to=(0, 0, 1.2), radius=0.6)
    assert result.reached
    assert (result.rank, result.pins) == (1, 1), "what comes along is no pin"


def test_grab_step_and_let_go() -> None:
    scene = ball()
    hand = scene.pin((1, 0, 0))
    scene.grab({hand: (2, 0, 0)})
    assert scene.is_held
    scene.step(5)
    half = scene.parameters["sphere/r"].value
    assert 1 < half < 2
    scene.grab(hand, (1.2, 0, 0))
    scene.step(60)
    result = scene.let_go()
    assert result.reached
    assert not scene.is_held
    assert scene.parameters["sphere/r"].value == pytest.approx(1.2, abs=1e-6)
    with pytest.raises(iso.SceneStateError, match="nothing is held"):
        scene.let_go()


def test_samples_are_of_the_surface_as_it_is() -> None:
    scene = iso.Scene(iso.sphere(r=1.0), spacing=0.1)
    first = scene.samples
    assert scene.samples is first
    assert first.report.spacing == pytest.approx(0.1, rel=0.05)
    scene.parameters["sphere/r"].value = 2.0
    assert scene.samples is not first
    exactly = scene.sample(500)
    assert len(exactly) == 500
    np.testing.assert_allclose(np.linalg.norm(exactly.points, axis=1), 2.0)
    assert scene.model == iso.sphere(r=2.0)


def test_a_curve_in_the_plane_is_a_scene_too() -> None:
    scene = iso.Scene(iso.parse("x^2 + y^2 - r^2", r=1, axes=2), n=60)
    hand = scene.pin((1, 0))
    assert scene.drag(hand, to=(1.5, 0)).reached
    assert scene.parameters["r"].value == pytest.approx(1.5, abs=1e-6)
    assert not scene.floaters.points[:, 2].any()
    assert len(scene.sample(40)) == 40
    with pytest.raises(ValueError, match="z = 0"):
        scene.pin((1, 0, 1))


def test_the_tree_changes_under_the_floaters() -> None:
    scene = ball(300)
    ids = set(scene.floaters.ids.tolist())
    scene.add("", iso.sphere(r=0.5).translate(x=4), name="moon")
    assert ids <= set(scene.floaters.ids.tolist())
    assert (scene.floaters.points[:, 0] > 3).sum() > 30
    assert [(n.path, n.kind, n.name, n.operands) for n in scene.nodes][:3] == [
        ("union", "union", None, 2),
        ("sphere", "sphere", None, 0),
        ("moon", "translate", "moon", 1),
    ]
    scene.reorder("", [1, 0])
    assert [n.path for n in scene.nodes][1] == "moon"
    scene.wrap("sphere", "rotate", name="wring", angle=0.5)
    assert scene.parameters["wring/angle"].value == 0.5
    scene.unwrap("wring")
    scene.remove("moon")
    scene.replace("", "box(1, 1, 1)")
    assert [n.kind for n in scene.nodes] == ["box"]
    for _ in range(6):
        scene.undo()
    assert scene.model == iso.sphere(r=1.0)
    with pytest.raises(iso.SceneStateError, match="nothing to undo"):
        scene.undo()
    scene.redo()
    assert scene.history == (1, 5)


def test_undo_gives_every_bit_back() -> None:
    scene = iso.Scene(PAIR, n=200)
    hand = scene.pin((1.6, 0, 0))
    before = values(scene), hand.position.tolist()
    scene.drag(hand, to=(2.0, 0.5, 0))
    after = values(scene), hand.position.tolist()
    assert before != after
    scene.undo()
    assert (values(scene), hand.position.tolist()) == before
    scene.redo()
    assert (values(scene), hand.position.tolist()) == after


def test_a_fit_follows_points() -> None:
    wanted = iso.sample(iso.ellipsoid(1.4, 0.9, 1.1).translate(x=0.3), n=150).points
    scene = iso.Scene(iso.ellipsoid(1, 1, 1).translate(), n=200)
    result = scene.fit(wanted, iterations=50)
    assert result.converged
    assert result.largest < 1e-9
    assert (result.rank, result.freedom) == (6, 6)
    assert values(scene) == pytest.approx([0.3, 0, 0, 1.4, 0.9, 1.1], abs=1e-8)
    assert "rank 6 of 6" in repr(result)
    assert "rank" in str(result)
    json.dumps(result.as_dict())
    scene.undo()
    wild = np.vstack([wanted, [[3, 3, 3], [-4, 1, 0]]])
    scene.fit(wild, loss=("cauchy", 0.02), iterations=200)
    assert scene.parameters["translate/x"].value == pytest.approx(0.3, abs=1e-3)
    scene.fit(wild, np.append(np.ones(150), [0, 0]))
    assert values(scene) == pytest.approx([0.3, 0, 0, 1.4, 0.9, 1.1], abs=1e-8)


def test_settings() -> None:
    scene = iso.Scene(
        iso.sphere(r=1), spacing=0.3, seed=5, bounds=2, gain=0.5, speed=0.1, recovery=0.2, focus=(0.4, 0.5)
    )
    found = scene.settings
    lo, hi = found.pop("bounds")
    assert (lo.tolist(), hi.tolist()) == ([-2] * 3, [2] * 3)
    expected = {"spacing": 0.3, "n": None, "seed": 5, "gain": 0.5, "speed": 0.1, "recovery": 0.2, "focus": (0.4, 0.5)}
    assert found == expected
    assert scene.spacing == 0.3
    scene.configure(n=150, focus=None, bounds=None, recovery=0.5)
    assert scene.settings["n"] == 150
    assert scene.settings["focus"] is None
    assert scene.settings["gain"] == 0.5
    # The rest shape is returned to.
    scene.rest()
    scene.parameters["sphere/r"].value = 1.4
    scene.step(60)
    assert scene.parameters["sphere/r"].value == pytest.approx(1.0, abs=1e-6)


def test_a_file_keeps_every_bit(tmp_path: Path) -> None:
    path = tmp_path / "creature.iso.json"
    scene = iso.Scene(PAIR, n=200)
    scene.pin((-1.8, 0, 0), name="foot", weight=2, plane=(1, 2, 3))
    scene.drag(scene.pin((1.6, 0, 0)), to=(2.0, 0.5, 0.1))
    scene.freeze("*k")
    scene.save(path)
    back = iso.load(path)
    assert isinstance(back, iso.Scene)
    assert back.model == scene.model
    assert [p.position.tolist() for p in back.pins] == [p.position.tolist() for p in scene.pins]
    assert back["foot"].weight == 2
    assert back.clock == scene.clock
    back.save(tmp_path / "again.iso.json")
    assert (tmp_path / "again.iso.json").read_text() == path.read_text()
    # A model's file still is a field.
    scene.model.save(path)
    assert iso.load(path) == scene.model
    path.write_text('{"format": "isoswarm scene", "version": 99}')
    with pytest.raises(iso.FileFormatError, match="update isoswarm"):
        iso.load(path)
    with pytest.raises(ValueError, match=r"ends in \.iso\.json"):
        scene.save(tmp_path / "creature.json")


def test_a_log_replays_to_the_same_bits(tmp_path: Path) -> None:
    scene = iso.Scene(PAIR, n=300)
    hand = scene.pin((1.6, 0, 0), name="hand")
    scene.step(3)
    scene.drag(hand, to=(2, 0.5, 0))
    scene.freeze("*r")
    scene.step(2)
    scene.drag(hand, to=(2, -0.5, 0.3), progress=lambda moment: moment.steps < 3, every=1)
    assert scene.log[-1]["steps"] == 3, "ended by the progress function"
    scene.save_log(tmp_path / "log.json")
    for script in (scene.log, tmp_path / "log.json", str(tmp_path / "log.json")):
        again = iso.Scene(PAIR, n=300)
        results = again.replay(script)
        assert values(again) == values(scene)
        assert again.clock == scene.clock
        np.testing.assert_array_equal(again.floaters.points, scene.floaters.points)
        assert [type(r).__name__ for r in results] == [
            "Pin",
            "NoneType",
            "DragResult",
            "NoneType",
            "NoneType",
            "DragResult",
        ]


def test_a_replay_says_how_far_it_is_and_can_be_ended() -> None:
    script = [
        {"do": "pin", "at": [1, 0, 0], "name": "hand"},
        {"do": "drag", "hands": [{"pin": "hand", "to": [2, 0, 0]}]},
        {"do": "step", "count": 4, "at_step": 100},
    ]
    scene, moments = ball(), []
    scene.replay(script, progress=moments.append, every=1)
    assert {m.commands for m in moments} == {3}
    assert [m.command for m in moments] == sorted(m.command for m in moments)
    assert moments[-1].command == 3
    assert scene.clock == 104
    assert len(ball().replay(script, progress=lambda m: m.command < 1)) == 1
    with pytest.raises(iso.FileFormatError, match="command 1"):
        ball().replay([{"do": "step"}, {"do": "fly"}])
    with pytest.raises(FileNotFoundError, match="no script at"):
        ball().replay("nothing.json")


def test_progress_sees_the_scene_move() -> None:
    scene = iso.Scene("translate(sphere(r=1))", n=200)
    hand = scene.pin((1, 0, 0))
    moments: list[iso.Moment] = []
    scene.drag(hand, to=(2, 0, 0), progress=moments.append, every=3)
    assert len(moments) > 3
    assert all(m.clock % 3 == 0 for m in moments)
    left = [m.remaining for m in moments]
    assert left == sorted(left, reverse=True)
    x = [m.pins[0, 0] for m in moments]
    assert x == sorted(x)
    assert moments[0].floaters.points[:, 0].max() < moments[-1].floaters.points[:, 0].max()
    assert moments[0].pin_normals.shape == (1, 3)


def test_an_exception_in_progress_comes_out_and_leaves_a_usable_scene() -> None:
    scene = ball()
    hand = scene.pin((1, 0, 0))

    def stop(moment: iso.Moment) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        scene.drag(hand, to=(2, 0, 0), progress=stop, every=2)
    assert not scene.is_held
    assert 1.0 < scene.parameters["sphere/r"].value < 2.0
    scene.undo()
    assert scene.parameters["sphere/r"].value == 1.0

    with pytest.raises(RuntimeError, match="at work"):
        scene.drag(hand, to=(2, 0, 0), progress=lambda moment: scene.undo(), every=1)
    assert scene.drag(hand, to=(1.5, 0, 0)).reached


def test_a_picture_shows_floaters_and_pins(tmp_path: Path) -> None:
    from PIL import Image

    scene = ball(400)
    scene.pin((1, 0, 0.4))
    path = tmp_path / "scene.png"
    far = np.array(np.meshgrid([-4, 4], [-4, 4], [-4, 4])).T.reshape(-1, 3)

    def colors(**options: object) -> tuple[int, int]:
        png = scene.picture(path, width=160, height=120, azimuth=0.0, **options)
        assert path.read_bytes() == png
        image = np.asarray(Image.open(path).convert("RGB")).astype(int)
        return (image[..., 0] > image[..., 2] + 60).sum(), (image[..., 2] > image[..., 0] + 30).sum()

    near, small = colors(), colors(frame=far)
    assert near[0] > 20, "the pin is red"
    assert near[1] > 2500, "a ball that fills the picture, more than a quarter of it discs"
    assert near[1] / small[1] > 10, "in the frame it is less than a quarter as large"
    assert "data:image/png" in scene._repr_html_()
    assert repr(scene).startswith("<Scene: 1 parameter, 1 pin, 4")
