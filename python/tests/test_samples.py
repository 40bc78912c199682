"""What a user does with samples: files, other libraries, pictures, sensitivity."""

import csv
import io
import json
import struct
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import plyfile
import pytest
import trimesh
from PIL import Image

import isoswarm as iso


def test_ply(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "points.ply"
    sphere.save(path)
    vertex = plyfile.PlyData.read(path)["vertex"]
    for columns, expected in ((("x", "y", "z"), sphere.points), (("nx", "ny", "nz"), sphere.normals)):
        np.testing.assert_array_equal(np.column_stack([vertex[c] for c in columns]), expected)
    np.testing.assert_array_equal(vertex["radius"], sphere.radii)
    np.testing.assert_array_equal(vertex["area"], sphere.areas)
    np.testing.assert_array_equal(trimesh.load(path).vertices, sphere.points)


def test_npz(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "points.npz"
    sphere.save(str(path))
    with np.load(path) as file:
        for name in ("points", "normals", "radii", "areas", "curvatures"):
            np.testing.assert_array_equal(file[name], getattr(sphere, name))


def test_obj(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "points.obj"
    sphere.save(path)
    rows = [line.split() for line in path.read_text().splitlines()]
    np.testing.assert_array_equal(np.array([r[1:4] for r in rows if r[:1] == ["v"]], dtype=float), sphere.points)
    np.testing.assert_array_equal(np.array([r[1:4] for r in rows if r[:1] == ["vn"]], dtype=float), sphere.normals)


def test_csv(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "points.csv"
    sphere.save(path)
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    np.testing.assert_array_equal(np.array([[float(r[c]) for c in "xyz"] for r in rows]), sphere.points)
    np.testing.assert_array_equal([float(r["area"]) for r in rows], sphere.areas)


def test_singular_samples_can_be_saved(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", iso.SamplingWarning)
        cone = iso.sample(iso.parse("x^2 + y^2 - z^2"), n=300, bounds=1.0)
    cone.save(tmp_path / "cone.ply")
    assert len(plyfile.PlyData.read(tmp_path / "cone.ply")["vertex"]) == 300


def test_trimesh(sphere: iso.Samples) -> None:
    cloud = sphere.to_trimesh()
    np.testing.assert_array_equal(cloud.vertices, sphere.points)
    np.testing.assert_array_equal(cloud.metadata["normals"], sphere.normals)


def test_pyvista(sphere: iso.Samples) -> None:
    cloud = sphere.to_pyvista()
    np.testing.assert_array_equal(cloud.points, sphere.points)
    for name in ("normals", "radii", "areas", "curvatures", "component"):
        np.testing.assert_array_equal(cloud.point_data[name], getattr(sphere, name))


def test_open3d(sphere: iso.Samples, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the library's place something as strict as it is: it wants C arrays of numbers that may be written to."""

    def vectors(array: np.ndarray) -> np.ndarray:
        assert array.flags.writeable
        assert array.flags.c_contiguous
        assert array.dtype == np.float64
        return array

    geometry = SimpleNamespace(PointCloud=lambda points: SimpleNamespace(points=points))
    library = SimpleNamespace(utility=SimpleNamespace(Vector3dVector=vectors), geometry=geometry)
    monkeypatch.setitem(sys.modules, "open3d", library)
    cloud = sphere.to_open3d()
    np.testing.assert_array_equal(cloud.points, sphere.points)
    np.testing.assert_array_equal(cloud.normals, sphere.normals)


@pytest.mark.parametrize("library", ["open3d", "pyvista", "trimesh"])
def test_a_library_that_is_missing_is_named(sphere: iso.Samples, library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=f"pip install {library}"):
        getattr(sphere, f"to_{library}")()


def test_columns_are_read_only(sphere: iso.Samples) -> None:
    with pytest.raises(ValueError, match="read-only"):
        sphere.points[0, 0] = 1.0


def test_sensitivity_says_how_the_surface_moves() -> None:
    field = iso.ellipsoid(1.0, 1.5, 2.0)
    samples = iso.sample(field, n=400)
    moves = samples.sensitivity()
    assert moves.shape == (400, 3)
    for j, path in enumerate(field.parameters):
        changed = field.with_parameters({path: field.parameters[path].value + 1e-6})
        # The points of the changed surface along the old normals.
        X = samples.points + 1e-6 * moves[:, j : j + 1] * samples.normals
        slope = np.linalg.norm(changed.gradient(X), axis=1)
        np.testing.assert_allclose(changed.value(X) / slope, 0.0, atol=2e-11)


def test_a_picture_shows_the_samples(tmp_path: Path, sphere: iso.Samples) -> None:
    path = tmp_path / "sphere.png"
    png = sphere.picture(path, width=200, height=150, supersampling=1, style="surface", transparent=True)
    assert path.read_bytes() == png
    image = np.asarray(Image.open(path).convert("RGBA"))
    assert image.shape == (150, 200, 4)
    covered = image[..., 2].astype(int) > image[..., 0] + 40  # blue, which its shadow is not
    assert covered[75, 100]
    assert not covered[0, 0]
    # A disc: as wide as high, π/4 of its box.
    ys, xs = np.nonzero(covered)
    width, height = np.ptp(xs) + 1, np.ptp(ys) + 1
    assert width == pytest.approx(height, abs=3)
    assert covered.sum() / (width * height) == pytest.approx(np.pi / 4, abs=0.03)


def test_picture_options_are_checked(sphere: iso.Samples) -> None:
    with pytest.raises(ValueError, match="style"):
        sphere.picture(style="cubes")
    with pytest.raises(ValueError, match="coloring: expected"):
        sphere.picture(coloring="taste")
    with pytest.raises(ValueError, match="width"):
        sphere.picture(width=0)


def test_in_a_notebook(sphere: iso.Samples) -> None:
    text = sphere._repr_html_()
    assert "data:image/png;base64," in text
    assert "500" in text
    assert repr(sphere).startswith("<Samples: 500 points, 1 component, converged")
    assert "evenness" in str(sphere.report)


def test_the_report_is_plain(sphere: iso.Samples) -> None:
    report = json.loads(json.dumps(sphere.report.as_dict()))
    assert report["components"] == 1
    assert 0.9 < report["evenness"]["rho_avg"] < 1
    assert report["seconds"] > 0


def test_png_has_the_size_asked_for(sphere: iso.Samples) -> None:
    png = sphere.picture(width=64, height=48, supersampling=1)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", png[16:24]) == (64, 48)
