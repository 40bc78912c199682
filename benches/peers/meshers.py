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
