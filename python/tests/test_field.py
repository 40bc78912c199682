"""Fields: ways in, values, derivatives, parameters."""

import copy
import pickle

import numpy as np
import pytest

import isoswarm as iso

x, y, z = iso.xyz()
FIELDS = {
    "formula": iso.parse("x^2 + a*y^2 + sin(b*z) - exp(x*y)/3", a=2.0, b=1.5),
    "operators": np.sqrt(x**2 + 2 * y**2 + 0.1) - np.cos(z) / (3 + x * x),
    "blobs": iso.blobs([[0, 0, 0], [1, 0.5, 0.2]], [0.8, 0.6]),
    "gaussians": iso.gaussians([[0, 0, 0], [1, 0.5, 0.2]], 0.7),
    "cylinders": iso.blobby_cylinders([[0, 0, 0]], [[1, 0.5, 0.2]], [0.6], bias=0.4),
    "blend": iso.smooth_union(iso.sphere(), iso.torus().translate(0.3, 0.2, 0.1), k=0.2),
    "own blend": iso.blend(iso.sphere(), iso.ellipsoid(1, 2, 3), lambda f, g: f + g - np.sqrt(f * f + g * g + 0.01)),
    "algebraic": iso.algebraic({(4, 0, 0): 1, (0, 2, 2): 0.5, (1, 1, 0): -1, (0, 0, 0): -2}),
}


@pytest.fixture(params=FIELDS, ids=str)
def field(request: pytest.FixtureRequest) -> iso.Field:
    return FIELDS[request.param]


def differences(f, X, step=1e-6):
    """(n, 3) by central differences of any function of points."""
    columns = []
    for axis in range(3):
        e = np.zeros(3)
        e[axis] = step
        columns.append((f(X + e) - f(X - e)) / (2 * step))
    return np.stack(columns, axis=-1)


def test_gradient_is_that_of_the_values(field: iso.Field, rng: np.random.Generator) -> None:
    X = rng.uniform(-1.5, 1.5, (200, 3))
    np.testing.assert_allclose(field.gradient(X), differences(field.value, X), rtol=1e-6, atol=1e-7)


def test_hessian_is_that_of_the_gradient(field: iso.Field, rng: np.random.Generator) -> None:
    X = rng.uniform(-1.5, 1.5, (100, 3))
    hessian = field.hessian(X)
    np.testing.assert_allclose(hessian, differences(field.gradient, X), rtol=2e-6, atol=2e-6)
    np.testing.assert_allclose(hessian, hessian.transpose(0, 2, 1), rtol=1e-12, atol=1e-12)


def test_parameter_gradient_is_that_of_the_values(field: iso.Field, rng: np.random.Generator) -> None:
    X = rng.uniform(-1.5, 1.5, (100, 3))
    free = [path for path, p in field.parameters.items() if not p.frozen and not p.discrete]
    given = field.parameter_gradient(X)
    assert given.shape == (100, len(free))
    for column, path in zip(given.T, free, strict=True):
        value = field.parameters[path].value
        above = field.with_parameters({path: value + 1e-6}).value(X)
        below = field.with_parameters({path: value - 1e-6}).value(X)
        np.testing.assert_allclose(column, (above - below) / 2e-6, rtol=1e-6, atol=1e-7)


def test_interval_contains_the_values(field: iso.Field, rng: np.random.Generator) -> None:
    for _ in range(20):
        lo = rng.uniform(-1.5, 1, 3)
        hi = lo + rng.uniform(0.01, 0.5, 3)
        low, high = field.interval(lo, hi)
        values = field.value(rng.uniform(lo, hi, (500, 3)))
        assert low <= values.min()
        assert values.max() <= high


def test_value_and_gradient_in_one_go(field: iso.Field, rng: np.random.Generator) -> None:
    X = rng.uniform(-1.5, 1.5, (50, 3))
    F, Fx = field.value_gradient(X)
    np.testing.assert_array_equal(Fx, field.gradient(X))
    np.testing.assert_allclose(F, field.value(X), rtol=1e-13, atol=1e-14)


def test_the_ways_in_agree(rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (300, 3))
    expected = np.linalg.norm(X, axis=1) - 1.2
    for field in (
        iso.parse("sqrt(x^2 + y^2 + z^2) - r", r=1.2),
        iso.parse("sphere(r=1.2)"),
        iso.sphere(1.2),
        np.sqrt(x**2 + y**2 + z**2) - 1.2,
        iso.from_function(lambda X: np.linalg.norm(X, axis=1) - 1.2),
    ):
        np.testing.assert_allclose(field.value(X), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (np.sqrt(x * x + 1), lambda x, y: np.sqrt(x * x + 1)),
        (np.exp(x) + 2, lambda x, y: np.exp(x) + 2),
        (np.float64(3) * x - np.float64(1), lambda x, y: 3 * x - 1),
        (np.float64(3) - x, lambda x, y: 3 - x),
        (2 / (x * x + 1) + 1 - y, lambda x, y: 2 / (x * x + 1) + 1 - y),
        (np.arctan2(y, x + 5), lambda x, y: np.arctan2(y, x + 5)),
        (np.maximum(x, 0.5) + np.minimum(y, x), lambda x, y: np.maximum(x, 0.5) + np.minimum(y, x)),
        (abs(x) + (-y) + (+y) ** 3, lambda x, y: abs(x) - y + y**3),
        (2**x + x % 0.7, lambda x, y: 2**x + x % 0.7),
        (np.log(np.square(x) + 1), lambda x, y: np.log(x * x + 1)),
        (np.tanh(x) + np.sinh(y) - np.cosh(x), lambda x, y: np.tanh(x) + np.sinh(y) - np.cosh(x)),
        (np.hypot(x, y) + np.cbrt(x), lambda x, y: np.hypot(x, y) + np.cbrt(x)),
        (
            np.exp2(x) + np.log2(x * x + 1) + np.log10(y * y + 1),
            lambda x, y: 2**x + np.log2(x * x + 1) + np.log10(y * y + 1),
        ),
        (
            np.arcsinh(x) + np.arccosh(y + 4) + np.arctanh(x / 3),
            lambda x, y: np.arcsinh(x) + np.arccosh(y + 4) + np.arctanh(x / 3),
        ),
        (np.sign(x) + np.trunc(3 * y), lambda x, y: np.sign(x) + np.trunc(3 * y)),
        (iso.functions.smoothstep(0, 1, x), lambda x, y: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1))),
        (iso.functions.less(x, y) * 2, lambda x, y: (x < y) * 2.0),
    ],
)
def test_arithmetic_is_that_of_numpy(made: iso.Field, expected, rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (200, 3))
    np.testing.assert_allclose(made.value(X), expected(X[:, 0], X[:, 1]), rtol=1e-14, atol=1e-14)


def test_set_operations(rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (500, 3))
    a, b = iso.sphere(1.0), iso.box(2, 1, 1)
    A, B = a.value(X), b.value(X)
    np.testing.assert_array_equal((a | b).value(X), np.minimum(A, B))
    np.testing.assert_array_equal((a & b).value(X), np.maximum(A, B))
    np.testing.assert_array_equal((~a).value(X), -A)
    np.testing.assert_array_equal((a - b).value(X), np.maximum(A, -B))


def test_minus_between_formulas_and_numbers_is_subtraction() -> None:
    X = [[0.5, 0.2, 0.0]]
    assert (x - y).value(X).tolist() == [0.3]
    ball = iso.sphere(1.0)
    assert (ball - 0.1).value([[2.0, 0, 0]]).tolist() == [0.9]
    assert (ball - x).kind == "sub"
    assert (ball - ball.translate(x=1)).kind == "difference"


def test_curves_in_the_plane() -> None:
    u, v = iso.xy()
    circle = u**2 + v**2 - 1
    assert circle.axes == 2
    flat = circle.value([[2.0, 0.0], [0.0, 1.0]])
    assert flat.tolist() == [3.0, 0.0]
    assert circle.value([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).tolist() == flat.tolist()
    assert circle.gradient([[2.0, 1.0]]).tolist() == [[4.0, 2.0, 0.0]]
    assert circle.hessian([[2.0, 1.0]])[0].tolist() == [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]]


def test_parameters_have_paths_and_are_changed_on_a_copy() -> None:
    shape = iso.sphere(r=2.0).named("ball") | iso.torus()
    assert list(shape.parameters) == ["ball/r", "torus/major", "torus/minor"]
    smaller = shape.with_parameters({"ball/r": 1.0})
    assert smaller.parameters["ball/r"].value == 1.0
    assert shape.parameters["ball/r"].value == 2.0
    assert smaller.value([[0, 0, 3.0]]).tolist() == [2.0]
    assert shape.parameters["ball/r"].unit == "length"


def test_frozen_parameters_leave_the_gradient() -> None:
    shape = iso.torus().freeze("*/major")
    assert shape.parameters["torus/major"].frozen
    assert shape.parameter_gradient([[1.3, 0, 0]]).tolist() == [[-1.0]]
    assert shape.release().parameter_gradient([[1.3, 0, 0]]).shape == (1, 2)
    assert shape.freeze().parameter_gradient([[1.3, 0, 0]]).shape == (1, 0)


def test_a_field_may_give_a_parameter() -> None:
    egg = iso.sphere(r=1 + 0.2 * z)
    assert egg.value([[0, 0, 2.0]]) == pytest.approx([2 - 1.4], abs=1e-15)


def test_projection_lands_on_the_surface(rng: np.random.Generator) -> None:
    blobs = FIELDS["blobs"]
    X = rng.uniform(-0.6, 0.6, (200, 3))
    on = blobs.project(X)
    assert np.abs(blobs.value(on)).max() < 1e-12
    ball = iso.sphere(2.0)
    P = rng.normal(size=(100, 3))
    np.testing.assert_allclose(ball.project(P), 2 * P / np.linalg.norm(P, axis=1, keepdims=True), rtol=1e-12)


def test_projection_that_cannot_be_says_so() -> None:
    with pytest.raises(iso.ConvergenceError, match="1 of 2"):
        iso.parse("x^2 + y^2 + z^2 - 1").project([[1, 0, 0], [0, 0, 0]])


def test_bounds_are_found_where_they_can_be() -> None:
    box = iso.torus(1.0, 0.25).bounds
    assert box is not None
    lo, hi = box
    assert (lo <= [-1.25, -1.25, -0.25]).all()
    assert (hi >= [1.25, 1.25, 0.25]).all()
    assert (hi - lo < [5, 5, 2.5]).all()
    assert iso.plane().bounds is None


def test_equality_and_repr() -> None:
    assert iso.parse("sphere(r=2)") == iso.sphere(2.0)
    assert iso.sphere(2.0) != iso.sphere(1.0)
    assert repr(iso.torus()) == "<Field: torus, 3 axes, 2 parameters (torus/major, torus/minor)>"
    assert "torus/minor" in iso.torus()._repr_html_()
    assert "1 parameter\n  sphere/r = 1" in repr(iso.sphere().parameters)


def test_results_do_not_depend_on_how_many_points_come_at_once(rng: np.random.Generator) -> None:
    X = rng.uniform(-1, 1, (40_000, 3))
    blobs = FIELDS["blobs"]
    np.testing.assert_array_equal(blobs.value(X)[:777], blobs.value(X[:777]))
    np.testing.assert_array_equal(blobs.gradient(X)[20_001:20_002], blobs.gradient(X[20_001:20_002]))


def test_no_points() -> None:
    empty = np.empty((0, 3))
    ball = iso.sphere()
    assert ball.value(empty).shape == (0,)
    assert ball.gradient(empty).shape == (0, 3)
    assert ball.parameter_gradient(empty).shape == (0, 1)
    assert ball.hessian(empty).shape == (0, 3, 3)
    assert ball.project(empty).shape == (0, 3)


def test_free_form_moves_what_its_control_points_say():
    d = np.zeros((3, 2, 2, 3))
    d[2, :, :, 2] = 0.4  # the right end up
    field = iso.free_form(iso.sphere(r=0.5), (-1, -1, -1), (1, 1, 1), (3, 2, 2), d)
    assert len(field.parameters) == 9 + 36 + 1
    # At x = 1 the displacement is .4, at x = -1 it is 0, at x = 0 it is B(1/2) = 1/4 of it (Bernstein).
    value = field.value([[0.0, 0.0, 0.5 + 0.1], [0.0, 0.0, -0.5 + 0.1]])
    assert value == pytest.approx([0.0, 0.0], abs=1e-12)
    for wrong in ({"lo": (1, 1, 1)}, {"controls": (1, 2, 2)}, {"displacements": np.zeros((2, 2, 2, 3))}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            iso.free_form(**{"field": iso.sphere(), "lo": (-1, -1, -1), "hi": (1, 1, 1)} | wrong)


def test_fields_and_samples_can_be_copied_and_sent_to_other_processes():
    field = (iso.parse("x^2 + y^2 + z^2 - r^2", r=0.1 + 0.2).named("ball") | iso.box(0.3, 0.4, 0.5)).freeze("box/x")
    assert copy.copy(field) is field
    assert copy.deepcopy(field) is field
    again = pickle.loads(pickle.dumps(field))
    assert again.parameters == field.parameters
    points = np.random.default_rng(0).normal(size=(100, 3))
    assert again.value(points).tobytes() == field.value(points).tobytes()

    samples = iso.sample(field, n=400)
    for other in (copy.deepcopy(samples), pickle.loads(pickle.dumps(samples))):
        assert other.points.tobytes() == samples.points.tobytes()
        assert other.report == samples.report
    with_creases = iso.sample(iso.box(1, 1, 1), n=1000, creases=True)
    assert len(copy.deepcopy(with_creases).creases.points) == len(with_creases.creases.points)

    opaque = iso.from_function(lambda p: p[:, 0], bounds=([-1] * 3, [1] * 3))
    assert copy.deepcopy(opaque) is opaque
    with pytest.raises(pickle.PicklingError, match="from_function"):
        pickle.dumps(opaque)
