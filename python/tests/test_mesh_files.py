"""Meshes in files read back as they were, with other people's readers."""

from pathlib import Path

import lib3mf
import numpy as np
import pytest
import pyvista
import trimesh

import isoswarm as iso
from isoswarm import _core

FORMATS = ("ply", "obj", "stl", "glb", "3mf", "vtp", "npz")


class Ball:
    """An icosphere of radius 2 about (10, -20, 30), with exact normals and curvatures."""

    def __init__(self) -> None:
        sphere = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
        self.normals = np.array(sphere.vertices)
        self.normals /= np.linalg.norm(self.normals, axis=1, keepdims=True)
        self.points = 2.0 * self.normals + [10.0, -20.0, 30.0]
        self.faces = np.array(sphere.faces, dtype=np.int64)
        self.curvatures = np.full((len(self.points), 2), 0.5)
        self.ids = np.arange(len(self.points), dtype=np.uint64) * 7

    def save(self, path: Path) -> Path:
        _core.save_mesh(path, self.points, self.faces, self.normals, self.curvatures, self.ids)
        return path


@pytest.fixture
def ball():
    return Ball()


def volume(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("ending", ["ply", "obj"])
def test_double_precision_survives(ball, ending, tmp_path):
    mesh = trimesh.load(ball.save(tmp_path / f"a.{ending}"), process=False)
    assert np.array_equal(mesh.faces, ball.faces)
    assert np.array_equal(mesh.vertices, ball.points)
    assert np.allclose(mesh.vertex_normals, ball.normals, atol=1e-12)
    assert mesh.is_watertight
    assert mesh.volume > 0


def test_stl_is_what_slicers_read(ball, tmp_path):
    mesh = trimesh.load(ball.save(tmp_path / "a.stl"))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume(ball.points, ball.faces), rel=1e-5)
    assert len(mesh.faces) == len(ball.faces)


def test_glb_is_y_up_and_keeps_its_place(ball, tmp_path):
    scene = trimesh.load(ball.save(tmp_path / "a.glb"), process=False)
    mesh = scene.to_geometry()
    x, y, z = ball.points.T
    assert np.allclose(mesh.vertices, np.stack([x, z, -y], axis=1), atol=1e-6)
    n = ball.normals
    part = next(iter(scene.geometry.values()))
    assert np.allclose(part.vertex_normals, np.stack([n[:, 0], n[:, 2], -n[:, 1]], axis=1), atol=1e-6)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert np.allclose(part.vertex_attributes["_CURVATURE"], 0.5)


def test_glb_without_curvature_where_there_is_none(ball, tmp_path):
    ball.curvatures[3] = np.nan
    scene = trimesh.load(ball.save(tmp_path / "a.glb"), process=False)
    assert "_CURVATURE" not in next(iter(scene.geometry.values())).vertex_attributes


@pytest.mark.parametrize("closed", [True, False])
def test_3mf_is_valid_and_in_millimetres(ball, closed, tmp_path):
    if not closed:
        ball.faces = ball.faces[1:]
    path = ball.save(tmp_path / "a.3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
    meshes = model.GetMeshObjects()
    assert meshes.MoveNext()
    mesh = meshes.GetCurrentMeshObject()
    assert mesh.IsManifoldAndOriented() == closed
    assert mesh.GetType() == (lib3mf.ObjectType.Model if closed else lib3mf.ObjectType.Surface)
    vertices = np.array([list(v.Coordinates) for v in mesh.GetVertices()])
    assert np.allclose(vertices, ball.points, atol=1e-5)
    assert np.array_equal([list(t.Indices) for t in mesh.GetTriangleIndices()], ball.faces)


def test_vtp_holds_every_column(ball, tmp_path):
    mesh = pyvista.read(ball.save(tmp_path / "a.vtp"))
    assert np.array_equal(mesh.points, ball.points)
    assert np.array_equal(mesh.regular_faces, ball.faces)
    assert np.array_equal(mesh.point_data["Normals"], ball.normals)
    assert np.array_equal(mesh.point_data["Curvatures"], ball.curvatures)
    assert np.array_equal(mesh.point_data["Ids"], ball.ids)
    assert mesh.is_manifold


def test_npz_holds_every_column(ball, tmp_path):
    with np.load(ball.save(tmp_path / "a.npz")) as file:
        assert file["faces"].dtype == np.int64
        for name in ("points", "faces", "normals", "curvatures", "ids"):
            assert np.array_equal(file[name], getattr(ball, name)), name


@pytest.mark.parametrize("ending", FORMATS)
def test_an_empty_mesh_is_an_empty_file_of_its_format(ending, tmp_path):
    path = tmp_path / f"a.{ending}"
    _core.save_mesh(path, np.empty((0, 3)), np.empty((0, 3), dtype=np.int64))
    assert path.stat().st_size > 0
    if ending == "3mf":
        model = lib3mf.get_wrapper().CreateModel()
        model.QueryReader("3mf").ReadFromFile(str(path))
        assert model.GetMeshObjects().Count() == 0
    if ending == "vtp":
        assert pyvista.read(path).n_cells == 0


@pytest.fixture(scope="module")
def can():
    return iso.mesh(iso.cylinder(r=0.7, h=1.5), n=1500)


@pytest.mark.parametrize(("ending", "up"), [("glb", 1), ("obj", 2), ("ply", 2)])
def test_creases_are_sharp_where_that_is_asked_for(can, ending, up, tmp_path):
    can.save(tmp_path / f"a.{ending}", sharp=True)
    read = trimesh.load(tmp_path / f"a.{ending}", process=False)
    part = next(iter(read.geometry.values())) if ending == "glb" else read
    assert len(part.faces) == len(can.faces)
    across, normals = np.delete(part.vertices, up, axis=1) / 0.7, np.array(part.vertex_normals)
    # Every normal is that of the mantle or of a lid, also on the rims, where both are.
    lid = np.abs(np.abs(normals[:, up]) - 1) < 1e-6
    assert np.abs(np.delete(normals, up, axis=1)[~lid] - across[~lid]).max() < 1e-5
    rims = np.abs(np.hypot(*across.T) - 1) < 1e-5
    assert min(lid[rims].sum(), (~lid)[rims].sum()) >= 40
    # And every triangle has those of its side.
    fronts = np.array(part.face_normals)
    assert np.einsum("fk,fck->fc", fronts, normals[part.faces]).min() > 0.9


def test_vertices_on_creases_are_shared_unless_sharp(can, tmp_path):
    for name, sharp in [("usual", None), ("sharp", True)]:
        can.save(tmp_path / f"{name}.ply", sharp=sharp)
        assert trimesh.load(tmp_path / f"{name}.ply", process=False).is_watertight == (not sharp)
    for name, sharp in [("usual", None), ("shared", False)]:
        can.save(tmp_path / f"{name}.vtp", sharp=sharp)
        assert (pyvista.read(tmp_path / f"{name}.vtp").n_points == len(can.points)) == (sharp is False)
    can.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as file:
        assert np.array_equal(file["corner_normals"].reshape(-1, 3, 3), can.corner_normals)
        assert np.array_equal(file["faces"], can.faces)
    assert iso.mesh(iso.sphere(), n=500).corner_normals is None


def test_what_makes_no_mesh_is_refused(ball, tmp_path):
    path = tmp_path / "a.ply"
    ball.faces[5, 1] = len(ball.points)
    with pytest.raises(ValueError, match=r"faces: expected numbers of vertices from 0 to below 162, but row 5"):
        ball.save(path)
    ball.faces[5, 1] = -1
    with pytest.raises(ValueError, match="faces: expected vertex numbers from 0"):
        ball.save(path)
    with pytest.raises(ValueError, match=r"\.ply, \.obj, \.stl, \.glb, \.3mf, \.vtp, \.npz"):
        Ball().save(tmp_path / "a.step")
    assert not list(tmp_path.iterdir())
