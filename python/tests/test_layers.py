"""The check of the crates' import direction finds what it is for."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture
def check(root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("check_layers", root / "scripts" / "check_layers.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def crate(name: str, *uses: str) -> dict[str, object]:
    return {"name": name, "dependencies": [{"name": used} for used in uses]}


ALLOWED = {"field": set(), "particles": {"field"}}


@pytest.mark.parametrize(
    ("packages", "expected"),
    [
        ([crate("field", "rayon"), crate("particles", "field", "rayon")], []),
        ([crate("field", "field")], []),
        (
            [crate("field", "particles"), crate("particles")],
            ["field must not use particles: see ARCHITECTURE.md, layers"],
        ),
        ([crate("scene", "field"), crate("field")], ["scene is not in scripts/check_layers.py"]),
    ],
)
def test_violations(check: ModuleType, packages: list[dict[str, object]], expected: list[str]) -> None:
    found = check.violations(packages, ALLOWED)
    assert len(found) == len(expected)
    assert all(a.startswith(b) for a, b in zip(found, expected, strict=True))
