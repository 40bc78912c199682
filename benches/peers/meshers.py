"""Meshers to compare with: CGAL's surface mesher, and marching cubes on a grid evaluated by NumPy."""

from collections.abc import Callable

import numpy as np

BLOBS = "0.4" + "".join(
    f"-exp(-((x-({r * np.cos(t)!r}))^2+(y-({r * np.sin(t)!r}))^2+(z-({0.11 * i - 0.8!r}))^2)/0.09)"
    for i, t, r in ((i, 0.8 * i, 0.6 + 0.02 * i) for i in range(16))
).replace("np.float64(", "(")

FORMULAS: dict[str, tuple[str, float]] = {
    "sphere": ("x^2+y^2+z^2-1", 1.25),
    "torus": ("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)", 1.6),
    "tanglecube": ("x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", 3.0),
    "16 blobs": (BLOBS, 1.6),
}
"""Formula and half the side of the box."""


def _numpy(formula: str) -> Callable[..., np.ndarray]:
    """The formula as a function of x, y, z; the formulas are those above."""
    code = compile(formula.replace("^", "**"), "formula", "eval")
    return lambda x, y, z: eval(code, {"exp": np.exp, "sqrt": np.sqrt}, {"x": x, "y": y, "z": z})


def _grid(formula: str, half: float, cells: int) -> tuple[np.ndarray, float]:
    axis = np.linspace(-half, half, cells + 1)
    x, y, z = axis[:, None, None], axis[None, :, None], axis[None, None, :]
    return _numpy(formula)(x, y, z), 2 * half / cells


def scikit(formula: str, half: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """scikit-image's marching cubes (Lewiner), evaluation included."""
    from skimage.measure import marching_cubes

    values, cell = _grid(formula, half, cells)
    points, faces, _, _ = marching_cubes(values, 0.0, spacing=(cell,) * 3)
    return points.astype(float) - half, faces.astype(np.int64)


def vtk(formula: str, half: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """VTK's flying edges, evaluation included."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    values, cell = _grid(formula, half, cells)
    image = vtkImageData()
    image.SetDimensions(*values.shape)
    image.SetSpacing(cell, cell, cell)
    image.SetOrigin(-half, -half, -half)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(values.ravel(order="F")), deep=True))
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.0)
    edges.ComputeNormalsOff()
    edges.ComputeScalarsOff()
    edges.Update()
    found = edges.GetOutput()
    faces = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(found.GetPoints().GetData()).astype(float), faces.astype(np.int64)


CUBES: dict[str, Callable[[str, float, int], tuple[np.ndarray, np.ndarray]]] = {"scikit-image": scikit, "VTK": vtk}


def cgal(formula: str, half: float, n: int) -> tuple[np.ndarray, np.ndarray, float]:
    """CGAL's surface mesher with about `n` vertices: points, faces, and seconds of processor time of the mesher alone.

    The Python package takes surfaces as images only, which it interpolates: cheaper than the formula. The image is not
    timed. The bound on the triangles' size is found by trial; the last trial counts. Angles are bounded by 30 degrees,
    as in CGAL's manual.
    """
    import tempfile
    import time
    from pathlib import Path

    from CGAL import CGAL_Surface_mesher as Mesher
    from CGAL.CGAL_Kernel import Point_3, Sphere_3

    values, cell = _grid(formula, half, 160)
    with tempfile.TemporaryDirectory() as folder:
        image, off = Path(folder) / "image.inr", Path(folder) / "mesh.off"
        _write_inr(image, -values, cell)
        surface = Mesher.Implicit_surface_Gray_level_image_3(
            Mesher.Gray_level_image_3(str(image), 0.0),
            Sphere_3(Point_3(half, half, half), 3 * half**2 * 1.1),
            1e-5,
        )
        bound = 0.1 * half
        for _ in range(4):
            triangulation = Mesher.Surface_mesh_default_triangulation_3()
            complex_ = Mesher.Complex_2_in_triangulation_3(triangulation)
            criteria = Mesher.Surface_mesh_default_criteria_3(30.0, bound, bound)
            began = time.process_time()
            Mesher.make_surface_mesh(complex_, surface, criteria, Mesher.NON_MANIFOLD_TAG)
            seconds = time.process_time() - began
            count = triangulation.number_of_vertices()
            if abs(count / n - 1) < 0.05:
                break
            bound *= (count / n) ** 0.5
        Mesher.output_surface_facets_to_off(str(off), complex_)
        return *_read_off(off), seconds


def _write_inr(path, values: np.ndarray, cell: float) -> None:
    """An image in INRIA's format: a header of 256 bytes, then single precision numbers, x first."""
    sizes = "".join(f"{axis}DIM={size}\n" for axis, size in zip("XYZ", values.shape, strict=True))
    steps = "".join(f"V{axis}={float(cell)!r}\n" for axis in "XYZ")
    head = f"#INRIMAGE-4#{{\n{sizes}VDIM=1\n{steps}TYPE=float\nPIXSIZE=32 bits\nSCALE=2**0\nCPU=pc\n"
    data = np.ascontiguousarray(values.ravel(order="F"), dtype="<f4").tobytes()
    path.write_bytes(head.ljust(252, "\n").encode() + b"##}\n" + data)


def _read_off(path) -> tuple[np.ndarray, np.ndarray]:
    words = path.read_text().split()
    n, f = int(words[1]), int(words[2])
    points = np.array(words[4 : 4 + 3 * n], dtype=float).reshape(n, 3)
    faces = np.array(words[4 + 3 * n : 4 + 3 * n + 4 * f], dtype=np.int64).reshape(f, 4)
    return points, faces[:, 1:]
