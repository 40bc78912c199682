"""The command: what it writes, prints and answers with."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import plyfile
import pytest
from PIL import Image
from typer.testing import CliRunner, Result

import isoswarm as iso
from isoswarm.cli import app

BALL = "x^2 + y^2 + z^2 - 1"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_sample_writes_the_points(tmp_path: Path) -> None:
    path, picture = tmp_path / "points.ply", tmp_path / "points.png"
    result = run("sample", BALL, "-n", 500, "-o", path, "--picture", picture)
    assert result.exit_code == 0, result.output
    assert len(plyfile.PlyData.read(path)["vertex"]) == 500
    with Image.open(picture) as image:
        assert image.size == (1200, 900)
    assert "components" in result.stdout
    assert f"wrote {path}" in result.stderr


def test_sample_is_what_python_gives(tmp_path: Path) -> None:
    path = tmp_path / "points.npz"
    assert run("sample", BALL, "--spacing", 0.1, "--seed", 3, "--bounds", 1.5, "-o", path, "-q").exit_code == 0
    expected = iso.sample(iso.parse(BALL), spacing=0.1, seed=3, bounds=1.5)
    np.testing.assert_array_equal(np.load(path)["points"], expected.points)


def test_json_is_one_document() -> None:
    result = run("sample", BALL, "-n", 200, "--json")
    report = json.loads(result.stdout)
    assert report["n"] == 200
    assert report["status"] == "converged"
    assert report["components"] == 1
    assert set(report["evenness"]) == {"rho_min", "rho_avg", "cv", "six_valent", "coverage"}


def test_parameters_can_be_set(tmp_path: Path) -> None:
    result = run("sample", "x^2 + y^2 + z^2 - r^2", "--set", "r=2", "-n", 300, "--json")
    assert json.loads(result.stdout)["area"] == pytest.approx(16 * np.pi, rel=0.02)
    result = run("info", "sphere(r=1)", "--set", "sphere/r=3", "--json")
    assert result.exit_code == 2
    vm = tmp_path / "ball.vm"
    vm.write_text(
        "_0 var-x\n_1 var-y\n_2 var-z\n_3 square _0\n_4 square _1\n_5 square _2\n"
        "_6 add _3 _4\n_7 add _5 _6\n_8 const 1\n_9 sub _7 _8\n"
    )
    result = run("sample", vm, "-n", 300, "--json")
    assert json.loads(result.stdout)["area"] == pytest.approx(4 * np.pi, rel=0.02)


def test_info() -> None:
    result = run("info", "sphere(r=1) | translate(torus(major=2, minor=0.3), z=3)", "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["components"] == 2
    assert found["certified"]
    assert found["derivatives"]["ok"]
    assert {p["path"] for p in found["parameters"]} >= {"sphere/r", "torus/major", "torus/minor"}
    assert found["area"] == pytest.approx(4 * np.pi + 4 * np.pi**2 * 0.6, rel=0.02)
    people = run("info", "sphere(r=1)")
    assert "sphere/r" in people.stdout
    assert "right" in people.stdout


def test_view(tmp_path: Path) -> None:
    path = tmp_path / "ball.png"
    assert run("view", BALL, "-o", path, "--size", "160x120", "-n", 500).exit_code == 0
    with Image.open(path) as image:
        assert image.size == (160, 120)
        assert len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)) > 100


def test_a_molecule(tmp_path: Path) -> None:
    path = tmp_path / "water.xyz"
    path.write_text("3\nwater\nO 0 0 0.117\nH 0 0.757 -0.471\nH 0 -0.757 -0.471\n")
    result = run("sample", path, "-n", 500, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["components"] == 1


def test_the_version() -> None:
    assert run("--version").stdout.strip() == iso.__version__


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["sample", "x^2 +"], 2, "position"),
        (["sample", "sphre(r=1)"], 2, "sphre"),
        (["sample", BALL, "-n", "0"], 2, "n: expected"),
        (["sample", BALL, "-n", "many"], 2, "--count"),
        (["sample", BALL, "-n", "5", "--spacing", "0.1"], 2, "given both"),
        (["sample", BALL, "--bounds", "1,2"], 2, "--bounds: expected 1, 4 or 6 numbers"),
        (["sample", BALL, "--bounds", "1,1,1,-1,-1,-1"], 2, "lo < hi"),
        (["sample", BALL, "--method", "magic"], 2, "method: expected"),
        (["sample", BALL, "--set", "r"], 2, "--set: expected name=number"),
        (["sample", BALL, "-o", "points.stl"], 2, "ends in .ply"),
        (["sample", BALL, "-o", "no/such/folder/points.ply"], 2, "there is no folder"),
        (["sample", BALL, "-n", "1000000000"], 2, "limit"),
        (["sample", "missing.vm"], 2, "no model at missing.vm"),
        (["sample", "missing.pdb"], 2, "no molecule at missing.pdb"),
        (["sample", "x - 1"], 2, "pass bounds"),
        (["view", BALL, "-o", "ball.jpg"], 2, "ends in .png"),
        (["view", BALL, "-o", "ball.png", "--size", "big"], 2, "--size: expected"),
        (["sample"], 2, "MODEL"),
        (["frobnicate"], 2, "frobnicate"),
        (["sample", "x^2 + y^2 + z^2 + 1", "--bounds", "2"], 3, "no surface"),
        (["info", "x^2 + y^2 + z^2 + 1", "--bounds", "2"], 3, "components"),
        (["sample", BALL, "-n", "200000", "--time-limit", "0.05"], 4, "time"),
    ],
)
def test_exit_codes(arguments: list[str], code: int, message: str) -> None:
    result = run(*arguments)
    assert result.exit_code == code, result.output
    assert message in result.output


def test_an_unexpected_failure_is_1(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr("isoswarm.cli.commands.sample", broken)
    result = run("sample", BALL)
    assert result.exit_code == 1
    assert "unexpected error: RuntimeError: broken" in result.output


def command() -> str:
    return str(Path(sys.executable).parent / "isoswarm")


def test_the_real_command(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    done = subprocess.run(
        [command(), "sample", "sphere(r=1) | translate(torus(), z=3)", "-n", "400", "-o", path, "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["n"] == 400
    assert len(path.read_text().splitlines()) == 401


def test_ctrl_c_is_130_and_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "points.ply"
    process = subprocess.Popen(
        [command(), "sample", "torus(major=1, minor=0.4)", "-n", "3000000", "-o", path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    time.sleep(2.0)
    began = time.perf_counter()
    os.kill(process.pid, signal.SIGINT)
    process.communicate(timeout=30)
    assert process.returncode == 130
    assert time.perf_counter() - began < 2.0
    assert list(tmp_path.iterdir()) == []


def test_a_formula_that_begins_with_a_minus_sign() -> None:
    assert run("sample", "-n", 100, "--bounds", "-1.5,-1.5,-1.5,1.5,1.5,1.5", "--", f"-({BALL})").exit_code == 0
