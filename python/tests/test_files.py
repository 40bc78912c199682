"""Models in files, there and back."""

from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

SHAPE = iso.smooth_union(iso.sphere(0.8).named("ball"), iso.torus(1.1, 0.3), k=0.2).freeze("*/minor") - iso.box(1, 1, 3)


def test_json_keeps_everything(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "shape.iso.json"
    SHAPE.save(path)
    again = iso.load(path)
    assert again == SHAPE
    assert dict(again.parameters) == dict(SHAPE.parameters)
    X = rng.uniform(-2, 2, (100, 3))
    np.testing.assert_array_equal(again.value(X), SHAPE.value(X))


def test_vm_keeps_the_values(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "shape.vm"
    SHAPE.save(path)
    X = rng.uniform(-2, 2, (100, 3))
    np.testing.assert_allclose(iso.load(path).value(X), SHAPE.value(X), rtol=1e-12, atol=1e-12)


def test_a_tape_made_elsewhere(root: Path) -> None:
    part = iso.load(root / "models" / "csg_part.vm")
    assert part.axes == 3
    assert np.isfinite(part.value(np.zeros((1, 3)))).all()


def test_functions_are_named_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "mixed.iso.json"
    wave = iso.from_function(lambda X: X[:, 2] - 0.1 * np.sin(X[:, 0]), name="wave")
    (iso.sphere() & wave).save(path)
    X = [[0.3, 0.2, 0.1]]
    assert iso.load(path, functions={"wave": wave}).value(X) == (iso.sphere() & wave).value(X)
    with pytest.raises(ValueError, match="wave"):
        iso.load(path)
    with pytest.raises(ValueError, match="expected a field made with from_function"):
        iso.load(path, functions={"wave": iso.sphere()})


def test_text_is_read_back(rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (100, 3))
    np.testing.assert_allclose(iso.parse(SHAPE.to_text()).value(X), SHAPE.value(X), rtol=1e-12, atol=1e-12)


def test_wrong_endings_and_folders(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"ends in \.iso\.json or \.vm"):
        SHAPE.save(tmp_path / "shape.json")
    with pytest.raises(FileNotFoundError, match="create the folder"):
        SHAPE.save(tmp_path / "missing" / "shape.vm")
    with pytest.raises(ValueError, match="function"):
        iso.from_function(lambda X: X[:, 0]).save(tmp_path / "shape.vm")
