"""The README's Python runs, and says what is true."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso


def blocks(path: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)


def test_the_examples_run(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    example, meshing, editing = blocks(root / "README.md", "python")
    assert len(example.strip().splitlines()) <= 14
    names: dict[str, object] = {}
    exec(compile(example, "README.md", "exec"), names)
    samples = names["samples"]
    assert len(samples) == 10_000
    assert (tmp_path / "points.ply").stat().st_size > 10_000 * 48
    assert np.isfinite(samples.points).all()
    with warnings.catch_warnings():
        # The acute rim of this shape is not guaranteed, and the report says so.
        warnings.simplefilter("ignore", iso.errors.SamplingWarning)
        exec(compile(meshing, "README.md", "exec"), names)
    assert names["part"].report.closed
    assert (tmp_path / "part.stl").stat().st_size == 84 + 50 * len(names["part"].faces)
    assert names["measures"].area.value == pytest.approx(4 * np.pi**2 * 0.4, rel=1e-8)
    exec(compile(editing, "README.md", "exec"), names)
    assert names["scene"].history == (2, 1)
    assert (tmp_path / "creature.iso.json").exists()


def test_the_tour_runs(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(root / "docs" / "guide" / "tour.md", "python"):
        exec(compile(block, "tour.md", "exec"), names)
    assert names["volume"] == pytest.approx(2 * np.pi**2 * 0.3**2, rel=0.01)
    assert names["area"] == pytest.approx(4 * np.pi**2 * 0.3, rel=0.01)


def test_the_guide_to_scenes_runs(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(root / "docs" / "guide" / "scenes.md", "python"):
        exec(compile(block, "scenes.md", "exec"), names)
    # Two balls and what joins them: between the larger and the sum.
    body = 4 / 3 * np.pi * 1 * 0.7 * 0.7
    assert body < names["volume"] < body + 4 / 3 * np.pi * 0.8**3
    assert names["again"].model == names["scene"].model
    assert (tmp_path / "drags.json").exists()


def test_every_file_that_it_points_to_exists(root: Path) -> None:
    text = (root / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#:]+)\)|src=\"([^\":]+)\"", text)
    assert targets
    for pair in targets:
        target = next(t for t in pair if t)
        assert (root / target).exists(), target


def test_the_two_commands_are_targets(root: Path) -> None:
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    for command in ("demo", "test", "bench", "docs"):
        assert f"\n{command}:" in makefile
