"""Mutilated formulas and tapes: each is read, or refused with a ValueError; nothing else happens."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

FORMULAS = [
    "x^2 + y^2 + z^2 - 1",
    "sphere(r=1) | box(2, 1, 1) & ~torus(major=1, minor=0.3)",
    "smooth_union(sphere(), translate(sphere(0.5), x=1 + sin(y)), k=0.2) - 0.1",
    "ball = sphere(r=2); ball - translate(ball, z=1)  # a comment",
    "where(x < 1, min(x, y, z), abs(z) % 0.3) ** 2e-3",
]


def mutilated(text: str, rng: np.random.Generator) -> str:
    """Up to four cuts, doublings, swaps and strange characters."""
    strange = "()[]{};=,<>|&~^*+-/%#.eE0919xyz_\0\n\tπ∞😀\"'\\"
    for _ in range(rng.integers(1, 5)):
        i, j = sorted(rng.integers(0, len(text) + 1, 2))
        match rng.integers(0, 4):
            case 0:
                text = text[:i] + text[j:]
            case 1:
                text = text[:j] + text[i:j] + text[j:]
            case 2:
                text = text[:i] + strange[rng.integers(0, len(strange))] + text[i:]
            case _:
                text = text[:i] + text[i:j][::-1] + text[j:]
    return text


def test_formulas(rng: np.random.Generator) -> None:
    read = 0
    X = rng.uniform(-1, 1, (3, 3))
    for _ in range(3000):
        text = mutilated(FORMULAS[rng.integers(0, len(FORMULAS))], rng)
        try:
            field = iso.parse(text)
        except ValueError:
            continue
        read += 1
        if field.axes == 3:
            assert field.value(X).shape == (3,)
    assert 30 < read < 2970


@pytest.mark.parametrize("ending", [".vm", ".iso.json"])
def test_files(tmp_path: Path, rng: np.random.Generator, ending: str) -> None:
    path = tmp_path / f"model{ending}"
    iso.parse(FORMULAS[2]).save(path)
    whole = path.read_text()
    for _ in range(300):
        path.write_text(mutilated(whole, rng), encoding="utf-8")
        with contextlib.suppress(ValueError):
            iso.load(path)
