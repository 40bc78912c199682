"""Measures and proofs, as Python sees them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import isoswarm as iso
from isoswarm.cli import app

TORUS = "(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16"


def test_measures_of_a_torus() -> None:
    m = iso.measure(iso.parse(TORUS), n=3000, bounds=1.6, integrands={"x²": lambda X, N: X[:, 0] ** 2})
    for found, truth in [(m.area, 1.6 * np.pi**2), (m.volume, 0.32 * np.pi**2), (m.mean_curvature, 2 * np.pi**2)]:
        assert found is not None
        assert abs(found.value - truth) <= found.error <= 1e-7 * truth
    assert m.euler == 0
    assert m.gauss_bonnet is not None
    assert abs(m.gauss_bonnet) < 1e-6
    assert m.solid is not None
    np.testing.assert_allclose(m.solid.centroid, 0, atol=1e-8)
    np.testing.assert_allclose(m.solid.inertia, m.solid.inertia.T)
    # ∫ x² dA = A (R²/2 + 3r²/4).
    assert m.integrals["x²"].value == pytest.approx(1.6 * np.pi**2 * (0.5 + 0.75 * 0.16), rel=1e-8)
    assert m.weights @ m.points[:, 0] ** 2 == pytest.approx(m.integrals["x²"].value, rel=1e-5)
    assert m.weights.sum() == pytest.approx(m.area.value)
    assert m.notes == ()
    assert "±" in str(m)


def test_samples_are_measured_where_they_are() -> None:
    samples = iso.sample(iso.sphere(r=2), n=500)
    m = iso.measure(samples)
    assert m.area.value == pytest.approx(16 * np.pi, rel=1e-6)
    assert {tuple(p) for p in samples.points} >= {tuple(p) for p in m.points[:10]}
    with pytest.raises(ValueError, match="no n"):
        iso.measure(samples, n=10)


def test_an_open_surface_has_no_volume() -> None:
    with pytest.warns(iso.SamplingWarning, match="open"):
        m = iso.measure(iso.parse("x^2 + y^2 - 1"), n=2000, bounds=1.5)
    assert m.volume is None
    assert m.solid is None
    assert len(m.places)
    assert m.area.value == pytest.approx(6 * np.pi, rel=1e-5)


def test_functions_of_the_user_are_checked() -> None:
    with pytest.raises(iso.CallbackError, match="shape"):
        iso.measure(iso.sphere(), n=200, integrands=lambda X, N: 1.0)
    with pytest.raises(ZeroDivisionError):
        iso.measure(iso.sphere(), n=200, integrands=lambda X, N: 1 / 0)
    with pytest.raises(TypeError, match="Field or Samples"):
        iso.measure("sphere")  # type: ignore[arg-type]


def test_measure_from_the_shell() -> None:
    result = CliRunner().invoke(app, ["measure", "sphere(r=1)", "-n", "500", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert abs(found["volume"]["value"] - 4 / 3 * np.pi) <= found["volume"]["error"]
    text = CliRunner().invoke(app, ["measure", "sphere(r=1)", "-n", "500"])
    assert "volume" in text.stdout
    assert "inertia" in text.stdout


def test_certificates() -> None:
    c = iso.certify(iso.parse(TORUS))
    assert c.proven
    assert (c.genus, c.euler, c.critical) == ((1,), 0, (1, 2, 1))
    shells = iso.certify(iso.parse("(x^2 + y^2 + z^2 - 1)*(x^2 + y^2 + z^2 - 0.25)"), bounds=1.5)
    assert sorted(len(k.inside or ()) for k in shells.components) == [0, 1]
    cone = iso.certify(iso.parse("x^2 + y^2 - z^2"), bounds=1)
    assert not cone.proven
    assert cone.doubtful.shape[1:] == (2, 3)
    assert "reaches the bounds" in str(cone)
    with pytest.raises(ValueError, match="opaque"):
        iso.certify(iso.from_function(lambda X: (X**2).sum(axis=1) - 1, bounds=1.5))


def test_info_tells_what_is_proven() -> None:
    result = CliRunner().invoke(app, ["info", TORUS])
    assert "proven: closed, 1 component of genus 1" in " ".join(result.stdout.split())
    found = json.loads(CliRunner().invoke(app, ["info", TORUS, "--json"]).stdout)
    assert found["topology"]["proven"] is True


def test_meshes_are_compared_with_proofs() -> None:
    mesh = iso.mesh(iso.parse(TORUS), n=1000, certify=True)
    assert mesh.report.certified is True
    assert iso.mesh(iso.parse(TORUS), n=1000).report.certified is None
