"""Wrong input of every sort: the error is the right one and says what to do."""

import resource
import signal
from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

ball = iso.sphere()


@pytest.mark.parametrize(
    ("text", "position"),
    [
        ("x^2 +", 5),
        ("x^2 + * y", 6),
        ("(x + 1", 6),
        ("x + q", 4),
        ("sphere(r=1, r=2)", 12),
        ("sphere(q=1)", 7),
        ("", 0),
    ],
)
def test_a_malformed_formula_says_where(text: str, position: int) -> None:
    with pytest.raises(iso.ParseError) as caught:
        iso.parse(text)
    assert caught.value.position == position
    assert f"position {position}" in str(caught.value)


def test_an_unknown_name_is_named_with_the_nearest() -> None:
    with pytest.raises(iso.ParseError, match=r"sphre.*sphere"):
        iso.parse("sphre(r=1)")


def test_a_formula_that_is_too_deep_is_refused() -> None:
    with pytest.raises(iso.ParseError, match="nested more than 200 deep"):
        iso.parse("(" * 1000 + "x" + ")" * 1000)
    with pytest.raises(iso.TooLargeError, match="1048576 bytes"):
        iso.parse("(" * 1_000_000 + "x" + ")" * 1_000_000)


@pytest.mark.parametrize(
    ("X", "message"),
    [
        ([1.0, 2.0, 3.0], r"X: expected shape \(n, 3\), given \(3,\)"),
        (np.zeros((4, 2)), r"X: expected shape \(n, 3\), given \(4, 2\)"),
        ([[0, 0, float("nan")]], r"X: expected finite numbers, given nan at index \(0, 2\)"),
        ([["a", "b", "c"]], "X: expected numbers of shape"),
    ],
)
def test_points_of_the_wrong_shape(X, message: str) -> None:
    for method in (ball.value, ball.gradient, ball.hessian, ball.parameter_gradient, ball.project):
        with pytest.raises(ValueError, match=message):
            method(X)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (((1, 1, 1), (-1, -1, -1)), "expected lo < hi on every axis"),
        (((-1, -1, -1), (1, 1, float("inf"))), "expected finite numbers"),
        (((-1, -1), (1, 1)), r"expected shape \(2, 3\), given \(2, 2\)"),
        (float("nan"), "expected finite numbers"),
        (-1.0, "expected lo < hi"),
        ("big", "bounds: expected numbers"),
    ],
)
def test_wrong_bounds(bounds, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        iso.sample(ball, n=10, bounds=bounds)


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ({"n": 0}, "n: expected"),
        ({"n": -5}, "n: expected"),
        ({"n": 10, "spacing": 0.1}, "expected n or spacing, given both"),
        ({"spacing": 0.0}, "spacing: expected"),
        ({"spacing": -1.0}, "spacing: expected"),
        ({"spacing": float("nan")}, "spacing: expected"),
        ({"n": 10, "seed": -1}, "seed: expected"),
        ({"n": 10, "method": "magic"}, "method: expected floaters"),
        ({"n": 10, "density": "hot"}, "density: expected"),
        ({"n": 10, "time_limit": -1.0}, "time_limit: expected"),
        ({"n": 10, "start": [[0.0, 0.0]]}, r"start: expected shape \(n, 3\)"),
    ],
)
def test_wrong_requests(request_, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        iso.sample(ball, bounds=1.5, **request_)


@pytest.mark.parametrize("request_", [{"n": 1.5}, {"n": True}, {"n": 10, "seed": None}, {"n": 10, "seed": "1"}])
def test_numbers_that_are_not_whole(request_) -> None:
    with pytest.raises(TypeError, match="expected a whole number, given"):
        iso.sample(ball, bounds=1.5, **request_)


@pytest.mark.parametrize("request_", [{"n": 1_000_000_000}, {"spacing": 1e-6}], ids=str)
def test_a_billion_points_are_refused_with_the_estimate(request_) -> None:
    with pytest.raises(iso.TooLargeError, match=r"about \d\.\d+e\d+ samples"):
        iso.sample(ball, bounds=1.5, **request_)


def test_fewer_samples_than_components() -> None:
    three = ball | ball.translate(x=5) | ball.translate(x=-5)
    with pytest.raises(iso.TooFewError) as caught:
        iso.sample(three, n=2, bounds=7)
    assert caught.value.components == 3


def test_bounds_are_asked_for_where_they_cannot_be_found() -> None:
    with pytest.raises(ValueError, match="pass bounds="):
        iso.sample(iso.plane(), n=10)


def test_an_unknown_parameter_lists_those_there_are() -> None:
    with pytest.raises(iso.UnknownParameterError, match="sphere/r"):
        ball.with_parameters({"radius": 2.0})
    with pytest.raises(ValueError, match="r must be above 0"):
        ball.with_parameters({"sphere/r": -2.0})


def test_division_by_zero_everywhere_is_no_surface() -> None:
    with pytest.warns(iso.EmptySurfaceWarning):
        samples = iso.sample(iso.parse("1 / (x - x) + y"), n=10, bounds=1.0)
    assert len(samples) == 0
    assert samples.report.status == "empty"


def test_operators_take_fields_and_numbers_only() -> None:
    with pytest.raises(TypeError, match="a field or a number"):
        ball + "x"
    with pytest.raises(TypeError, match="not with arrays"):
        np.ones(3) * ball
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(ball)
    with pytest.raises(TypeError, match=r"np\.heaviside does not work on fields"):
        np.heaviside(ball, 1.0)


# Functions ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda X: np.full(len(X), np.nan), "gave NaN at"),
        (lambda X: X, r"expected shape \(\d+,\) for points of shape \(\d+, 3\), given"),
        (lambda X: 1.0, r"given \(\); it is called once with all points"),
        (lambda X: None, "gave NaN|expected shape|expected numbers"),
        (lambda X: ["a"] * len(X), "expected numbers of shape"),
    ],
)
def test_a_function_that_answers_nonsense(function, message: str) -> None:
    field = iso.from_function(function, bounds=1.5, name="mine")
    with pytest.raises(iso.CallbackError, match=message) as caught:
        field.value(np.zeros((5, 3)))
    assert "mine" in str(caught.value)
    with pytest.raises(iso.CallbackError):
        iso.sample(field, n=100)


def test_an_exception_in_a_function_comes_out_as_it_is() -> None:
    class Mine(Exception):
        pass

    def fails(X):
        raise Mine("no")

    with pytest.raises(Mine, match="no"):
        iso.from_function(fails, bounds=1.5).gradient(np.zeros((5, 3)))
    with pytest.raises(Mine, match="no"):
        iso.sample(iso.from_function(fails, bounds=1.5), n=10)
    with pytest.raises(Mine, match="no"):
        iso.sample(ball, n=10, bounds=1.5, density=fails)
    with pytest.raises(Mine, match="no"):
        iso.sample(ball, n=10, bounds=1.5, progress=lambda *_: fails(None))


def test_a_density_that_is_none() -> None:
    with pytest.raises(ValueError, match="density"):
        iso.sample(ball, n=10, bounds=1.5, density=lambda X: -np.ones(len(X)))


def test_a_gradient_of_the_wrong_shape() -> None:
    field = iso.from_function(lambda X: X[:, 0], gradient=lambda X: X[:, 0], name="mine")
    with pytest.raises(iso.CallbackError, match=r"gradient of mine: expected shape \(5, 3\)"):
        field.gradient(np.zeros((5, 3)))


def test_a_gradient_that_lies_is_found_out() -> None:
    honest = iso.from_function(lambda X: (X**2).sum(axis=1) - 1, gradient=lambda X: 2 * X, bounds=1.5)
    assert iso.diagnose(honest).derivatives.ok
    liar = iso.from_function(lambda X: (X**2).sum(axis=1) - 1, gradient=lambda X: 2.1 * X, bounds=1.5)
    found = iso.diagnose(liar)
    assert not found.derivatives.ok
    assert any("WRONG" in value for _, value in found.rows())


def test_a_function_has_no_intervals() -> None:
    with pytest.raises(ValueError, match="no intervals"):
        iso.from_function(lambda X: X[:, 0]).interval([0, 0, 0], [1, 1, 1])


# Files ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    ["_0 var-x\n_1 add _0", "_0 var-x\n_1 add _0 _7\n", "_0 frobnicate\n", "\0\1\2", "", "_0 const nope\n"],
)
def test_a_hostile_vm(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.vm"
    path.write_text(text)
    with pytest.raises(iso.FileFormatError, match="line"):
        iso.load(path)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"version": 99}', '{"version": 1, "model": {"kind": "nonsense"}}'])
def test_a_hostile_json(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.iso.json"
    path.write_text(text)
    with pytest.raises(ValueError, match="expected|version|unknown|line"):
        iso.load(path)


def test_files_that_are_not_models(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"no model at .*missing\.vm"):
        iso.load(tmp_path / "missing.vm")
    with pytest.raises(ValueError, match=r"ends in \.vm or \.iso\.json"):
        iso.load(tmp_path / "shape.stl")
    binary = tmp_path / "binary.vm"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="UTF-8"):
        iso.load(binary)


def test_files_that_cannot_be_written(tmp_path: Path, sphere: iso.Samples) -> None:
    with pytest.raises(ValueError, match=r"\.ply"):
        sphere.save(tmp_path / "points.stl")
    with pytest.raises(FileNotFoundError):
        sphere.save(tmp_path / "missing" / "points.ply")
    (tmp_path / "points.ply").mkdir()
    with pytest.raises(OSError, match="points"):
        sphere.save(tmp_path / "points.ply")


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "points.ply"
    path.write_text("old")
    # A limit on the size of files stands for a full disk.
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError, match="points"):
            sphere.save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["points.ply"]
