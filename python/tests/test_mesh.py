"""Meshes from Python and the shell."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import isoswarm as iso
from isoswarm.cli import app

TORUS = "(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)"


def test_a_torus_is_a_closed_mesh_of_genus_one():
    made = iso.mesh(iso.parse(TORUS), n=1500, bounds=1.6)
    r = made.report
    assert r.closed
    assert r.manifold
    assert r.sound
    assert r.genus == (1,)
    assert r.euler == 0
    assert r.components == 1
    assert made.faces.dtype == np.int64
    assert made.faces.shape == (r.faces, 3)
    assert len(made) == r.faces
    assert made.points.shape == made.normals.shape == (r.vertices, 3)
    assert made.curvatures.shape == (r.vertices, 2)
    assert not made.points.flags.writeable
    np.testing.assert_allclose(np.linalg.norm(made.normals, axis=1), 1.0)
    assert np.abs(made.field.value(made.points)).max() < 1e-12
    # Counter-clockwise seen from outside: the volume is positive, and that of the torus.
    a, b, c = (made.points[made.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(3.158273408348595, rel=0.02)
    assert "closed manifold" in str(r)
    assert "closed" in repr(made)
    json.dumps(r.as_dict())


def test_samples_become_vertices():
    samples = iso.sample(iso.parse(TORUS), n=1500, bounds=1.6)
    made = samples.to_mesh()
    np.testing.assert_array_equal(made.points, samples.points)
    assert made.report.closed
    assert samples.to_mesh(smoothing=8).report.quality.q_avg > made.report.quality.q_avg
    with pytest.warns(iso.SamplingWarning, match="no manifold"):
        rule = samples.to_mesh(rule="circumsphere")
    assert 0.9 < len(rule) / len(made) < 1.1


def test_the_distance_asked_for_is_kept():
    made = iso.mesh(iso.sphere(r=1), error=1e-2)
    centres = made.points[made.faces].mean(axis=1)
    assert 0.002 < np.max(1 - np.linalg.norm(centres, axis=1)) <= 0.0101


def test_density_and_clipping():
    made = iso.mesh(iso.parse("x^2+y^2-z^2-0.25"), n=1500, bounds=1, density=lambda p: 1 + 8 * (p[:, 2] > 0))
    assert made.report.sound
    assert made.report.boundaries == 2
    up = made.points[:, 2] > 0
    assert up.sum() > 2 * (~up).sum()


def test_quality_measures_any_triangles():
    q = iso.metrics.triangle_quality([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    assert q.radius_ratio_avg == pytest.approx(0.8)
    assert q.largest_angle == pytest.approx(90)
    each = iso.metrics.triangles([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    assert each["q"] == pytest.approx([2 * 3**0.5 / 5])
    with pytest.raises(ValueError, match="faces"):
        iso.metrics.triangle_quality([[0, 0, 0]])
    with pytest.raises(ValueError, match="below 1"):
        iso.metrics.triangle_quality([[0, 0, 0]], [[0, 1, 2]])


def test_wrong_requests_say_what_is_wrong():
    with pytest.raises(ValueError, match="one of n, spacing and error"):
        iso.mesh(iso.sphere(), n=10, error=0.1)
    with pytest.raises(ValueError, match="error"):
        iso.mesh(iso.sphere(), error=-1.0)
    with pytest.raises(ValueError, match="rule"):
        iso.mesh(iso.sphere(), rule="marching")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="Field"):
        iso.mesh("x")  # type: ignore[arg-type]
    with pytest.warns(iso.EmptySurfaceWarning):
        assert len(iso.mesh(iso.parse("x^2+y^2+z^2+1"), bounds=1)) == 0


def test_a_scene_has_a_mesh_that_follows():
    scene = iso.Scene(iso.sphere(r=1), n=800)
    first = scene.mesh()
    assert first.report.closed
    assert first.report.euler == 2
    scene.step(5)
    second = scene.mesh()
    np.testing.assert_array_equal(second.points, scene.floaters.points)
    np.testing.assert_array_equal(second.ids, scene.floaters.ids)
    assert second.report.closed


def test_libraries_take_it():
    made = iso.mesh(iso.sphere(r=1), n=500)
    taken = made.to_trimesh()
    assert isinstance(taken, trimesh.Trimesh)
    assert taken.is_watertight
    assert taken.volume > 4
    surface = made.to_pyvista()
    assert surface.is_manifold
    np.testing.assert_array_equal(surface.faces.reshape(-1, 4)[:, 1:], made.faces)
    np.testing.assert_array_equal(surface.point_data["normals"], made.normals)


def test_the_command_writes_a_mesh(tmp_path):
    out = tmp_path / "part.stl"
    run = CliRunner().invoke(app, ["mesh", TORUS, "--bounds", "1.6", "-n", "800", "-o", str(out), "--json"])
    assert run.exit_code == 0, run.output
    report = json.loads(run.stdout)
    assert report["closed"]
    assert report["genus"] == [1]
    assert out.stat().st_size == 84 + 50 * report["faces"]
    run = CliRunner().invoke(app, ["mesh", TORUS, "-o", str(tmp_path / "part.txt")])
    assert run.exit_code == 2
    run = CliRunner().invoke(app, ["mesh", "x^2+y^2+z^2+1", "--bounds", "1", "-q"])
    assert run.exit_code == 3
