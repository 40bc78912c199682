"""Functions of points and parameters."""

from pathlib import Path

import numpy as np
import pytest

import isoswarm as iso

VALUES = {"k": 0.3, "c": 2.5, "r": 1.25}
FORMULA = iso.parse("x^2 + y^2 + z^2 + k*sin(c*z) - r^2", **VALUES)


def wavy(X, k, c, r):
    return (X**2).sum(axis=1) + k * np.sin(c * X[:, 2]) - r**2


def wavy_gradient(X, k, c, r):
    return 2 * X + np.stack([0 * X[:, 2], 0 * X[:, 2], k * c * np.cos(c * X[:, 2])], axis=1)


def wavy_slopes(X, k, c, r):
    z = X[:, 2]
    return np.stack([np.sin(c * z), k * z * np.cos(c * z), np.full(len(X), -2 * r)], axis=1)


class Noted:
    """The function, which notes the values that it is called with and fails where it is told to."""

    def __init__(self, fails: int | None = None) -> None:
        self.fails, self.calls = fails, []

    def __call__(self, X, **q):
        self.calls.append(q)
        if len(self.calls) == self.fails:
            raise RuntimeError("no more")
        return wavy(X, **q)

    def varied(self) -> set[str]:
        return {name for q in self.calls for name in q if q[name] != VALUES[name]}


def made(function=wavy, **more) -> iso.Field:
    return iso.from_function(function, parameters=VALUES, bounds=2.5, **more)


WRAPPINGS = {
    "alone": lambda f: f,
    "moved and scaled": lambda f: f.translate(0.3, -0.2, 0.1).scale(1.5),
    "twisted": lambda f: iso.twist(f, rate=0.7),
    "blended with itself": lambda f: iso.smooth_union(f, f.translate(x=1), k=0.3),
    "in arithmetic": lambda f: 2 * f + np.square(f) - iso.xyz()[0],
}


@pytest.mark.parametrize("wrapping", WRAPPINGS)
@pytest.mark.parametrize("exact", [False, True])
def test_a_function_is_differentiated_like_the_formula(wrapping: str, exact: bool, rng: np.random.Generator) -> None:
    more = {"gradient": wavy_gradient, "parameter_gradient": wavy_slopes} if exact else {}
    given, expected = WRAPPINGS[wrapping](made(**more)), WRAPPINGS[wrapping](FORMULA)
    X = rng.uniform(-1.3, 1.3, (200, 3))
    tolerance = 1e-12 if exact else 1e-6
    np.testing.assert_allclose(given.value(X), expected.value(X), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(given.gradient(X), expected.gradient(X), rtol=tolerance, atol=tolerance)
    slopes = given.parameter_gradient(X)
    assert slopes.shape == expected.parameter_gradient(X).shape
    np.testing.assert_allclose(slopes, expected.parameter_gradient(X), rtol=tolerance, atol=tolerance)


def test_parameters_are_changed_on_a_copy() -> None:
    field = made()
    assert {path: p.value for path, p in field.parameters.items()} == {
        "function/k": 0.3,
        "function/c": 2.5,
        "function/r": 1.25,
    }
    other = field.with_parameters({"function/r": 2.0})
    assert other.value([[0, 0, 0]]).tolist() == [-4.0]
    assert field.value([[0, 0, 0]]).tolist() == [-1.5625]
    assert list(field.named("egg").parameters) == ["egg/k", "egg/c", "egg/r"]
    assert field.with_scale("*/r", 0.1).parameters["function/r"].scale == 0.1


def test_only_free_parameters_are_varied() -> None:
    function = Noted()
    field = made(function).freeze("*/c")
    X = np.zeros((4, 3))
    field.value(X)
    field.gradient(X)
    assert len(function.calls) == 2
    assert function.varied() == set()
    assert field.parameter_gradient(X).shape == (4, 2)
    assert len(function.calls) == 2 + 1 + 2 * 2
    assert function.varied() == {"k", "r"}
    calls = []
    exact = made(parameter_gradient=lambda X, **q: calls.append(q) or wavy_slopes(X, **q))
    assert exact.freeze().parameter_gradient(X).shape == (4, 0)
    assert calls == []
    np.testing.assert_array_equal(exact.freeze("*/c").parameter_gradient(X), wavy_slopes(X, **VALUES)[:, [0, 2]])
    assert calls == [VALUES]


def test_differences_stay_within_the_limits(rng: np.random.Generator) -> None:
    function = Noted()
    field = made(function).with_limits("*/r", 0.5, 1.25).with_limits("*/k", 0.3, 1.0)
    X = rng.uniform(-1.3, 1.3, (50, 3))
    np.testing.assert_allclose(field.parameter_gradient(X), wavy_slopes(X, **VALUES), rtol=1e-6, atol=1e-6)
    assert all(q["r"] <= 1.25 and q["k"] >= 0.3 for q in function.calls)
    with pytest.raises(ValueError, match=r"r must be between 0.5 and 1.25, given 2"):
        field.with_parameters({"function/r": 2.0})


@pytest.mark.parametrize("call", range(1, 8))
def test_an_exception_at_any_call_comes_out_and_changes_nothing(call: int, rng: np.random.Generator) -> None:
    X = rng.uniform(-1.3, 1.3, (20, 3))
    expected = made().parameter_gradient(X)
    function = Noted(fails=call)
    field = made(function)
    before = dict(field.parameters)
    with pytest.raises(RuntimeError, match="no more"):
        field.parameter_gradient(X)
    assert len(function.calls) == call
    assert dict(field.parameters) == before
    np.testing.assert_array_equal(field.parameter_gradient(X), expected)


def test_a_function_that_fails_while_it_is_sampled() -> None:
    function = Noted(fails=10)
    with pytest.raises(RuntimeError, match="no more"):
        iso.sample(made(function), n=200)
    assert len(function.calls) == 10


def test_answers_of_derivatives_are_checked() -> None:
    X = np.zeros((5, 3))
    short = made(parameter_gradient=lambda X, k, c, r: np.zeros(len(X)), name="mine")
    with pytest.raises(iso.CallbackError, match=r"parameter gradient of mine: expected shape \(5, 3\) .* given \(5,\)"):
        short.parameter_gradient(X)
    nan = made(parameter_gradient=lambda X, k, c, r: np.full((len(X), 3), np.nan))
    with pytest.raises(iso.CallbackError, match="gave NaN at 5 of 5 points"):
        nan.parameter_gradient(X)
    # Beyond where the function is defined: NaN while a parameter is varied.
    root = iso.from_function(lambda X, a: np.sqrt(a - 1) + X[:, 0], parameters={"a": 1.0})
    with np.errstate(invalid="ignore"), pytest.raises(iso.CallbackError, match="gave NaN"):
        root.parameter_gradient(X)
    assert np.isfinite(root.with_limits("*/a", 1.0, 2.0).parameter_gradient(X)).all()


@pytest.mark.parametrize(
    ("function", "parameters", "error", "message"),
    [
        (wavy, {"k": 1, "c": 1}, TypeError, r"is called as wavy\(X, k=…, c=…\), but takes \(X, k, c, r\): missing"),
        (wavy, {"k": 1, "c": 1, "r": 1, "radius": 1}, TypeError, "unexpected keyword argument 'radius'"),
        (wavy, None, TypeError, r"is called as wavy\(X\)"),
        (wavy, {"k": 1, "c": 1, "X": 1}, TypeError, "multiple values for argument 'X'"),
        (wavy, {"k": 1, "c": 1, "r": np.nan}, ValueError, "a finite number for r, given nan"),
        (wavy, {"k": 1, "c": 1, "r": [1.0]}, TypeError, r"a number for r, given \[1.0\]"),
        (wavy, {"k": 1, "c": 1, "r": iso.sphere()}, TypeError, "a formula around the function"),
        (lambda X, **q: X[:, 0], {"a b": 1}, ValueError, "names that can be keyword arguments, given 'a b'"),
        (lambda X, **q: X[:, 0], {"if": 1}, ValueError, "names that can be keyword arguments, given 'if'"),
        (wavy, ["k"], TypeError, "names and values such as"),
    ],
)
def test_wrong_parameters(function, parameters, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        iso.from_function(function, parameters=parameters)


def test_derivatives_that_do_not_take_the_parameters() -> None:
    with pytest.raises(TypeError, match="gradient of wavy is called as"):
        made(gradient=lambda X: 2 * X)
    with pytest.raises(ValueError, match="parameter_gradient: expected with `parameters`"):
        iso.from_function(lambda X: X[:, 0], parameter_gradient=lambda X: X)


def test_a_curve_in_the_plane() -> None:
    def circle(X, r):
        assert X.shape[1] == 2
        return (X**2).sum(axis=1) - r**2

    for more in ({}, {"gradient": lambda X, r: 2 * X, "parameter_gradient": lambda X, r: np.full((len(X), 1), -2 * r)}):
        curve = iso.from_function(circle, parameters={"r": 2.0}, axes=2, bounds=3, **more)
        assert curve.axes == 2
        assert curve.parameter_gradient([[1.0, 2.0]]) == pytest.approx(np.array([[-4.0]]), rel=1e-9)
        assert curve.gradient([[1.0, 2.0]]) == pytest.approx(np.array([[2.0, 4.0, 0.0]]), rel=1e-8)


def test_files_keep_the_values(tmp_path: Path) -> None:
    path = tmp_path / "egg.iso.json"
    egg = made(name="egg").with_parameters({"function/r": 2.0}).freeze("*/k").with_limits("*/c", 1, 3)
    egg.save(path)
    again = iso.load(path, functions={"egg": made(name="egg")})
    assert again == egg
    assert dict(again.parameters) == dict(egg.parameters)
    assert again.value([[0, 0, 0]]).tolist() == [-4.0]
    other = iso.from_function(lambda X, r: X[:, 0] - r, parameters={"r": 1.0}, name="egg")
    with pytest.raises(iso.FileFormatError, match=r"expected the parameters of `egg` \(r\), given r, k, c"):
        iso.load(path, functions={"egg": other})


def test_derivatives_of_parameters_are_checked() -> None:
    for honest in (made(), made(parameter_gradient=wavy_slopes), made().freeze("*/k").with_limits("*/r", 1.25, 2)):
        found = iso.diagnose(honest, n=300)
        assert found.derivatives.ok
        assert found.derivatives.parameters < 1e-6
    liar = iso.diagnose(made(parameter_gradient=lambda X, **q: wavy_slopes(X, **q) * [1, 1.01, 1]), n=300)
    assert not liar.derivatives.ok
    assert liar.derivatives.gradient < 1e-6
    assert dict(liar.rows())["parameter derivatives"].startswith(
        "WRONG: the parameter gradient is not that of the values"
    )
    assert np.isnan(iso.diagnose(made().freeze(), n=300).derivatives.parameters)
    frozen = iso.diagnose(iso.torus().freeze("*/major"), n=300)
    assert frozen.derivatives.parameters < 1e-6


def test_a_sampled_function_follows_its_parameters() -> None:
    samples = iso.sample(made().with_parameters({"function/k": 0.0}), n=300)
    np.testing.assert_allclose(np.linalg.norm(samples.points, axis=1), 1.25, rtol=1e-8)
    # |p| = r at k = 0: each point moves outwards at the rate of r.
    moved = samples.sensitivity()
    np.testing.assert_allclose(moved[:, 2], 1.0, rtol=1e-6)
