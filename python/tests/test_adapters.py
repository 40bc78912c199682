"""Adapters: dragged by their few parameters, taken off again."""

from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

PAIR = "translate(sphere(1), 0, 0, 0) | translate(sphere(0.5), 3, 0, 0)"


def pair() -> iso.Scene:
    return iso.Scene(PAIR, n=300, bounds=((-3, -3, -3), (4, 3, 3)))


def test_a_mover_hands_its_effect_over_and_goes() -> None:
    scene = pair()
    before = scene.model
    moving = scene.adapt("translate_2", iso.Mover())
    assert sum(not p.frozen for p in scene.parameters.values()) == 3, "only the adapter's own are free"
    hand = scene.pin((3.5, 0, 0))
    assert moving.drag(hand, to=(3.9, 0, 0)) is moving
    assert moving.result is not None
    assert moving.result.reached
    # The part follows before anything is accepted.
    assert moving.part.parameters["translate/x"].value == pytest.approx(3.4, abs=1e-6)
    assert scene.adapting == moving.transfer
    assert "rank 4 of 4" in repr(moving)
    found = moving.accept()
    assert found.relative < 1e-9
    assert (found.rank, found.freedom, found.at_limit) == (4, 4, ())
    assert scene.parameters["translate_2/x"].value == pytest.approx(3.4, abs=1e-6)
    assert scene.parameters["translate/x"].value == 0.0
    assert scene.adapting is None
    assert moving.transfer == found
    for _ in range(4):
        scene.undo()
    assert scene.model == before


def test_what_the_part_cannot_take_on_is_told_and_can_be_kept() -> None:
    scene = iso.Scene(iso.sphere(r=1), n=200, bounds=3)
    before = scene.model
    tapering = scene.adapt("", iso.Taper(axis="z", center=(0, 0, 0)))
    scene.parameters["adapter/rate"].value = 0.4
    assert 0.02 < tapering.transfer.relative < 0.5, "a sphere cannot be a pear"
    assert "of the size" in repr(tapering.transfer)
    with pytest.raises(iso.SceneStateError, match="an adapter is on"):
        scene.adapt("", iso.Mover())
    tapering.cancel()
    assert scene.model == before
    with pytest.raises(iso.SceneStateError, match="no adapter is on"):
        tapering.accept()
    with pytest.raises(iso.SceneStateError, match="taken off"):
        tapering.part  # noqa: B018
    again = scene.adapt("", iso.Taper(axis="z", center=(0, 0, 0)))
    scene.parameters["adapter/rate"].value = 0.4
    again.keep()
    assert [n.kind for n in scene.nodes] == ["taper_about", "sphere"]


def test_an_operator_is_flattened_where_the_part_can_do_without() -> None:
    scene = iso.Scene("translate(scale(sphere(1), 1.5), 0, 1, 0)", n=200)
    points = scene.sample(100).points
    assert scene.flatten("scale").relative < 1e-9
    assert [n.kind for n in scene.nodes] == ["translate", "sphere"]
    np.testing.assert_allclose(scene.model.value(points), 0.0, atol=1e-8)
    twisted = iso.Scene("twist(box(1, 1, 2), 0.6)", n=200, bounds=3)
    with pytest.raises(iso.SceneStateError, match="stays"):
        twisted.flatten("twist")
    assert [n.kind for n in twisted.nodes] == ["twist", "box"]


@pytest.mark.parametrize(
    "adapter",
    [iso.Rotate(), iso.Scale((3, 0, 0)), iso.Twist("x"), iso.Bend("y"), iso.Lattice((2, 3, 2), half=(1, 1, 1))],
)
def test_every_adapter_begins_as_nothing(adapter: iso.Adapter) -> None:
    scene = pair()
    X = scene.sample(200).points
    on = scene.adapt("translate_2", adapter)
    np.testing.assert_allclose(scene.model.value(X), 0.0, atol=1e-9)
    assert on.transfer.relative == 0.0
    on.cancel()
    assert scene.model == pair().model


def test_mistakes_are_named() -> None:
    scene = pair()
    with pytest.raises(TypeError, match=r"such as iso\.Bend"):
        scene.adapt("", "bend")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="axis"):
        scene.adapt("", iso.Bend("w"))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="controls"):
        scene.adapt("", iso.Lattice((3, 3)))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="controls"):
        scene.adapt("", iso.Lattice((0, 3, 3)))
    with pytest.raises(ValueError, match="finite"):
        scene.adapt("", iso.Scale((0, float("nan"), 0)))
    with pytest.raises(ValueError, match="nobody"):
        scene.adapt("nobody", iso.Mover())
    scene.freeze()
    with pytest.raises(iso.SceneStateError, match="release"):
        scene.adapt("translate_2", iso.Mover())
    assert scene.adapting is None


def test_a_script_tells_of_transfers() -> None:
    scene = iso.Scene(iso.sphere(r=1).translate(), n=200)
    script = [
        {"do": "adapt", "adapter": "mover"},
        {"do": "pin", "at": [1, 0, 0], "name": "hand"},
        {"do": "drag", "hands": [{"pin": "hand", "to": [2, 0, 0]}]},
        {"do": "accept"},
    ]
    results = scene.replay(script)
    assert [type(r).__name__ for r in results] == ["Transfer", "Pin", "DragResult", "Transfer"]
    assert scene.parameters["translate/x"].value == pytest.approx(1.0, abs=1e-6)


def values(field: iso.Field) -> dict[str, float]:
    return {path: parameter.value for path, parameter in field.parameters.items()}


def test_a_scene_with_an_adapter_on_is_saved_and_goes_on(tmp_path: Path) -> None:
    scene = pair()
    assert scene.adapter is None
    hand = scene.pin((3.5, 0, 0))
    moving = scene.adapt("translate_2", iso.Mover()).drag(hand, to=(3.7, 0.1, 0))
    scene.save(tmp_path / "moving.iso.json")
    again = iso.load(tmp_path / "moving.iso.json")
    assert isinstance(again, iso.Scene)
    adapter = again.adapter
    assert adapter is not None
    assert adapter.path == "translate_2"
    assert adapter.transfer == moving.transfer
    assert values(adapter.part) == values(moving.part)
    again.save(tmp_path / "again.iso.json")
    assert (tmp_path / "again.iso.json").read_bytes() == (tmp_path / "moving.iso.json").read_bytes()
    assert adapter.accept() == moving.accept()
    assert values(again.model) == values(scene.model)
    again.undo()
    assert again.adapter is not None
    again.adapter.cancel()
    assert values(again.model) == values(pair().model)
    assert again.adapter is None
