"""What people use today for even points on an implicit surface: a grid, marching cubes, Poisson-disk sampling."""

from collections.abc import Callable

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]
Grid = Callable[[float], tuple[np.ndarray, np.ndarray]]


def hexagonal(area: float, n: int) -> float:
    """Distance between neighbours in the hexagonal packing of n points on the area."""
    return float(np.sqrt(2 * area / (np.sqrt(3) * n)))


def marching_cubes(values: np.ndarray, corner: np.ndarray, cell: float) -> Mesh:
    """Vertices (v, 3) and faces (f, 3) of the zero set on a grid."""
    from skimage.measure import marching_cubes as surface

    vertices, faces, _, _ = surface(values, 0.0, spacing=(cell,) * 3)
    return vertices + corner, faces


def mesh_area(mesh: Mesh) -> float:
    """Sum of the triangles' areas."""
    a, b, c = (mesh[0][mesh[1][:, i]] for i in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def open3d(mesh: Mesh, n: int) -> np.ndarray:
    """Sample elimination (Yuksel 2015): exactly n points."""
    import open3d as o3d

    triangles = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(mesh[0]), o3d.utility.Vector3iVector(mesh[1]))
    o3d.utility.random.seed(0)
    return np.asarray(triangles.sample_points_poisson_disk(n).points)


def point_cloud_utils(mesh: Mesh, n: int) -> np.ndarray:
    """Pruned dense samples (Bowers 2010), its defaults; asked for n it gives 1.44 n, so it is asked for fewer."""
    import point_cloud_utils as pcu

    vertices, faces = np.ascontiguousarray(mesh[0], dtype=float), np.ascontiguousarray(mesh[1], dtype=np.int32)
    index, weights = pcu.sample_mesh_poisson_disk(vertices, faces, round(n / 1.44), random_seed=1)
    return pcu.interpolate_barycentric_coords(faces, index, weights, vertices)


def pymeshlab(mesh: Mesh, n: int) -> np.ndarray:
    """MeshLab's Poisson-disk filter (Corsini 2012), its defaults; asked for n it gives 1.44 n, as above.

    Its `exactnumflag` gives n within half a per cent, and takes ten to twenty times as long.
    """
    return _meshlab(mesh, samplenum=round(n / 1.44))


def pymeshlab_coarse(mesh: Mesh, n: int) -> np.ndarray:
    """The same with half as many candidates a point: faster, and less even."""
    return _meshlab(mesh, samplenum=round(n / 1.34), montecarlorate=10)


def _meshlab(mesh: Mesh, **settings: int) -> np.ndarray:
    import pymeshlab as ml

    meshes = ml.MeshSet()
    meshes.add_mesh(ml.Mesh(mesh[0].astype(float), mesh[1].astype(np.int32)))
    meshes.generate_sampling_poisson_disk(**settings)
    return meshes.current_mesh().vertex_matrix()


def libigl(mesh: Mesh, n: int) -> np.ndarray:
    """Blue noise (Bridson 2007) with the radius that gives about n points."""
    import igl

    radius = 0.755 * hexagonal(mesh_area(mesh), n)
    vertices, faces = np.ascontiguousarray(mesh[0], dtype=float), np.ascontiguousarray(mesh[1], dtype=np.int64)
    return igl.blue_noise(vertices, faces, radius)[2]


SAMPLERS: dict[str, Callable[[Mesh, int], np.ndarray]] = {
    "open3d": open3d,
    "point-cloud-utils": point_cloud_utils,
    "pymeshlab": pymeshlab,
    "pymeshlab, half the candidates": pymeshlab_coarse,
    "libigl": libigl,
}

DEFAULTS = tuple(name for name in SAMPLERS if "," not in name)
"""Those of them that run with the settings they come with: a ratio is to the fastest of these."""
