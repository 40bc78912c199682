"""The functions that are made from the table of kinds."""

import importlib.util
import inspect
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

ARGUMENTS = {"repeat": {"px": 1.5}}


def test_the_generated_files_are_current(root: Path) -> None:
    spec = importlib.util.spec_from_file_location("generate_shapes", root / "scripts" / "generate_shapes.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    for path, content in generate.files().items():
        assert path.read_text(encoding="utf-8") == content, f"run scripts/generate_shapes.py: {path} is not current"


@pytest.mark.parametrize("name", [name for name in iso.shapes.__all__ if name != "hidden"])
def test_every_function_makes_a_field_that_evaluates(name: str, rng: np.random.Generator) -> None:
    function = getattr(iso.shapes, name)
    operands = []
    for p in inspect.signature(function).parameters.values():
        if p.kind is p.VAR_POSITIONAL:
            operands += [iso.sphere(0.9), iso.box(1, 1.2, 1.4)]
        elif p.default is p.empty:
            operands.append(iso.ellipsoid(0.7, 0.9, 1.1).translate(0.1 * len(operands)))
    field = function(*operands, **ARGUMENTS.get(name, {}))
    assert field.kind == name
    X = rng.uniform(-1, 1, (200, 3))
    F, Fx = field.value_gradient(X)
    assert np.isfinite(F).all()
    e = 1e-6 * np.eye(3)
    differences = np.stack([(field.value(X + d) - field.value(X - d)) / 2e-6 for d in e], axis=1)
    wrong = np.linalg.norm(Fx - differences, axis=1) > 1e-5 * (1 + np.linalg.norm(differences, axis=1))
    # At a crease the two differ: nearly no random point is within 1e-6 of one.
    assert wrong.sum() <= 1
    assert "Returns" in (function.__doc__ or "")


def test_hidden_parts_are_left_out(rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (100, 3))
    ball, ring = iso.sphere(0.9), iso.torus(1.0, 0.3)
    assert np.array_equal((ball | iso.shapes.hidden(ring)).value(X), ball.value(X))
    with pytest.raises(ValueError, match="every part of the model is hidden"):
        iso.shapes.hidden(ball).value(X)


def test_a_name_misspelt_in_a_call_is_python_s_own_error() -> None:
    with pytest.raises(TypeError, match="radius"):
        iso.sphere(radius=1)
    with pytest.raises(ValueError, match="r must be above 0"):
        iso.sphere(0.0)


@pytest.mark.parametrize(
    ("coefficients", "message"),
    [({(2, 0): 1.0}, "expected exponents"), ({(-1, 0, 0): 1.0}, "expected exponents"), ({(99, 0, 0): 1.0}, "degree")],
)
def test_wrong_exponents(coefficients, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        iso.algebraic(coefficients)


def test_wrong_blobs() -> None:
    with pytest.raises(ValueError, match=r"radii: expected shape \(2,\), given \(3,\)"):
        iso.blobs(np.zeros((2, 3)), [1, 2, 3])
    with pytest.raises(ValueError, match=r"centers: expected shape \(k, 3\)"):
        iso.blobs([0, 0, 0], [1])
    assert len(iso.blobs(np.zeros((5, 3)), 1.0).parameters) == 4 * 5 + 1
    assert len(iso.blobby_cylinders(np.zeros((5, 3)), np.ones((5, 3)), 1.0).parameters) == 7 * 5 + 1
