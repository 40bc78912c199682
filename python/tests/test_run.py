"""The command that replays scripts: what it writes, prints and answers with."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from test_cli import command, run

import isoswarm as iso

PAIR = "smooth_union(translate(sphere(r=1), x=-0.8), translate(sphere(r=0.7), x=0.9), k=0.3)"
PIN = {"do": "pin", "at": [1.6, 0, 0], "name": "hand"}


def drag(to: list[float]) -> dict[str, Any]:
    return {"do": "drag", "hands": [{"pin": "hand", "to": to}]}


def script(folder: Path, *commands: dict[str, Any]) -> Path:
    path = folder / "drags.json"
    path.write_text(json.dumps({"format": "isoswarm script", "version": 1, "commands": commands}))
    return path


def test_run_is_what_python_gives(tmp_path: Path) -> None:
    drags, output = (
        script(tmp_path, PIN, drag([2.2, 0.4, 0.1]), {"do": "freeze", "pattern": "*k"}),
        tmp_path / "r.iso.json",
    )
    result = run("run", PAIR, "--script", drags, "-o", output, "-n", 300, "--seed", 3)
    assert result.exit_code == 0, result.output
    expected = iso.Scene(PAIR, n=300, seed=3)
    expected.replay(drags)
    expected.save(tmp_path / "expected.iso.json")
    assert output.read_text() == (tmp_path / "expected.iso.json").read_text()
    assert "2: drag" in result.stdout
    assert "reached in" in result.stdout
    assert "sphere_2/r" in result.stdout
    assert f"wrote {output}" in result.stderr
    # What it wrote can be run, sampled and told about.
    more = script(tmp_path, drag([1.8, 0, 0]))
    again = run("run", output, "--script", more, "--json", "--set", "sphere/r=1.1")
    assert again.exit_code == 0, again.output
    found = json.loads(again.stdout)
    assert found["commands"] == 1
    assert found["clock"] > expected.clock
    assert found["results"][0]["do"] == "drag"
    assert found["results"][0]["reached"]
    assert [(p["id"], p["name"]) for p in found["pins"]] == [(0, "hand")]
    np.testing.assert_allclose(found["pins"][0]["position"], [1.8, 0, 0], atol=1e-6)
    assert found["parameters"]["smooth_union/k"] == expected.parameters["smooth_union/k"].value
    assert run("sample", output, "-n", 300, "--json").exit_code == 0
    assert json.loads(run("info", output, "--json").stdout)["components"] == 1


def test_pictures_and_an_animation(tmp_path: Path) -> None:
    frames, film = tmp_path / "frames", tmp_path / "film.png"
    drags = script(tmp_path, PIN, drag([2.4, 0, 0]))
    given = ["--frames", frames, "--animation", film, "--every", 4, "--size", "120x90", "--rate", 10]
    result = run("run", PAIR, "--script", drags, "-n", 300, *given, "--json")
    assert result.exit_code == 0, result.output
    files = sorted(frames.iterdir())
    assert [f.name for f in files] == [f"{k:05d}.png" for k in range(len(files))]
    assert json.loads(result.stdout)["pictures"] == len(files) >= 4
    with Image.open(film) as image:
        assert image.size == (120, 90)
        assert image.n_frames == len(files)
        assert image.info["duration"] == 100
        image.seek(len(files) - 1)
        last = np.asarray(image.convert("RGB"))
    with Image.open(files[-1]) as image:
        np.testing.assert_array_equal(np.asarray(image.convert("RGB")), last)

    def width(file: Path) -> int:
        picture = np.asarray(Image.open(file).convert("RGB")).astype(int)
        return int((picture[..., 2] > picture[..., 0] + 30).any(axis=0).sum())

    assert width(files[-1]) > width(files[0]) > 20, "the camera stays, the surface grows"


def test_a_drag_that_does_not_arrive_is_4_and_written_all_the_same(tmp_path: Path) -> None:
    output = tmp_path / "r.iso.json"
    commands = [PIN, {"do": "limit", "pattern": "*", "bounds": [None, 2.0]}, {**drag([9, 0, 0]), "steps": 5}]
    result = run("run", PAIR, "--script", script(tmp_path, *commands), "-o", output, "-n", 200)
    assert result.exit_code == 4, result.output
    assert "not reached: command 3 (drag)" in result.stderr
    assert isinstance(iso.load(output), iso.Scene)


@pytest.mark.parametrize(
    ("model", "commands", "more", "code", "message"),
    [
        (PAIR, [{"do": "fly"}], [], 2, "command 0"),
        (PAIR, [PIN, {"do": "step"}, {"do": "unpin", "pin": "foot"}], [], 2, "at command 3 of 3 (unpin)"),
        (PAIR, [PIN, {"do": "undo"}, {"do": "undo"}], [], 2, "nothing to undo"),
        (PAIR, [PIN], ["-o", "result.json"], 2, "ends in .iso.json"),
        (PAIR, [PIN], ["--animation", "film.gif"], 2, "ends in .png"),
        (PAIR, [PIN], ["--frames", "no/such/folder"], 2, "there is no folder"),
        (PAIR, [PIN], ["--every", "0"], 2, "--every"),
        (PAIR, [PIN], ["--size", "big"], 2, "--size"),
        (PAIR, [PIN], ["-n", "100", "--spacing", "0.1"], 2, "given both"),
        (PAIR, [PIN], ["--set", "sphere/q=1"], 2, "q"),
        ("missing.iso.json", [PIN], [], 2, "no model at missing.iso.json"),
        ("x - y", [PIN], [], 2, "bounds"),
        ("x^2 + y^2 + z^2 + 1", [PIN], ["--bounds", "2"], 3, "no surface"),
        ("sphere(r=1)", [{"do": "replace", "model": "x^2 + y^2 + z^2 + 1"}], [], 3, "no surface"),
    ],
)
def test_exit_codes(
    tmp_path: Path, model: str, commands: list[dict[str, Any]], more: list[str], code: int, message: str
) -> None:
    result = run("run", model, "--script", script(tmp_path, *commands), *more)
    assert result.exit_code == code, result.output
    assert message in result.output
    assert [p.name for p in tmp_path.iterdir()] == ["drags.json"]


def test_a_script_that_is_missing() -> None:
    result = run("run", PAIR, "--script", "nothing.json")
    assert result.exit_code == 2
    assert "no script at nothing.json" in result.output


def test_ctrl_c_is_130_and_leaves_no_file(tmp_path: Path) -> None:
    drags, output = script(tmp_path, {"do": "step", "count": 10_000_000}), tmp_path / "r.iso.json"
    process = subprocess.Popen(
        [
            command(),
            "run",
            PAIR,
            "--script",
            drags,
            "-o",
            output,
            "--animation",
            tmp_path / "film.png",
            "--every",
            "99",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    time.sleep(2.5)
    began = time.perf_counter()
    os.kill(process.pid, signal.SIGINT)
    process.communicate(timeout=30)
    assert process.returncode == 130
    assert time.perf_counter() - began < 2.0
    assert [p.name for p in tmp_path.iterdir()] == ["drags.json"]


@pytest.mark.parametrize("name", ["dumbbell", "ellipsoid", "quartic", "three_cylinders"])
def test_the_scripts_of_the_papers_arrive(root: Path, name: str) -> None:
    scene, drags = root / "models" / f"{name}.iso.json", root / "models" / f"{name}.script.json"
    result = run("run", scene, "--script", drags, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["results"]
    assert all(r["distance"] < 1e-6 for r in found["results"] if r["do"] == "drag")
    assert all(p["distance"] < 1e-6 for p in found["pins"])
