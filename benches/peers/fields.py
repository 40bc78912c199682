"""The surfaces that every pipeline samples: values in NumPy, F < 0 inside."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

MODELS = Path(__file__).resolve().parents[2] / "models"

# Van der Waals radii in ångström (Bondi 1964).
RADII = {"H": 1.20, "C": 1.70, "N": 1.55, "O": 1.52, "S": 1.80}


@dataclass(frozen=True)
class Blobs:
    """F(x) = iso - sum_i exp(-k (|x - c_i|^2 / r_i^2 - 1)).

    ``centers`` (b, 3) and ``radii`` (b,) in model units; ``k`` without unit. ``reach``: a blob's tail is left out
    beyond ``reach`` radii (``None``: never); what is dropped is below exp(-k (reach^2 - 1)) a blob.
    """

    name: str
    centers: np.ndarray
    radii: np.ndarray
    k: float
    iso: float = 1.0
    reach: float | None = None

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of a box that holds the surface."""
        # Where F = 0 somewhere one blob has at least 1/b of the sum.
        grow = np.sqrt(1 + np.log(len(self.radii)) / self.k) if self.reach is None else self.reach
        extent = grow * self.radii[:, None]
        return (self.centers - extent).min(axis=0), (self.centers + extent).max(axis=0)

    def value(self, points: np.ndarray) -> np.ndarray:
        """F at points (n, 3)."""
        total = np.full(len(points), self.iso)
        for center, radius in zip(self.centers, self.radii, strict=True):
            offset = points - center
            squared = np.einsum("ij,ij->i", offset, offset)
            total -= np.exp(self.k * (1 - squared / radius**2))
        return total

    def value_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F (n,) and its gradient (n, 3) at points near the surface; far blobs are left out."""
        from scipy.spatial import cKDTree

        value, gradient = np.full(len(points), self.iso), np.zeros((len(points), 3))
        tree = cKDTree(points)
        for center, radius in zip(self.centers, self.radii, strict=True):
            near = np.asarray(tree.query_ball_point(center, 4 * radius), dtype=np.intp)
            offset = points[near] - center
            weight = np.exp(self.k * (1 - np.einsum("ij,ij->i", offset, offset) / radius**2))
            value[near] -= weight
            gradient[near] += (2 * self.k / radius**2) * weight[:, None] * offset
        return value, gradient

    def grid(self, cell: float) -> tuple[np.ndarray, np.ndarray]:
        """F on a regular grid: values (nx, ny, nz) and the grid's first corner; plain vectorised NumPy.

        Without ``reach`` every blob is evaluated in every grid point, as a general formula has to be; with it a blob
        only touches the grid points within reach of its centre.
        """
        lo, hi = self.bounds()
        lo = lo - cell
        shape = np.ceil((hi - lo) / cell).astype(int) + 2
        axes = [lo[a] + cell * np.arange(shape[a]) for a in range(3)]
        values = np.full(shape, self.iso)
        for center, radius in zip(self.centers, self.radii, strict=True):
            window = [slice(None)] * 3
            if self.reach is not None:
                window = [
                    slice(*np.searchsorted(axes[a], [center[a] - self.reach * radius, center[a] + self.reach * radius]))
                    for a in range(3)
                ]
            dx, dy, dz = ((axes[a][window[a]] - center[a]) ** 2 * (self.k / radius**2) for a in range(3))
            exponent = self.k - dx[:, None, None] - dy[None, :, None] - dz
            values[tuple(window)] -= np.exp(exponent, out=exponent)
        return values, lo


def sixteen_blobs() -> Blobs:
    """16 overlapping blobs around the origin, the scene of every floater benchmark."""
    rng = np.random.default_rng(16)
    centers = rng.uniform(-1, 1, (16, 3))
    return Blobs("blobs", centers, rng.uniform(0.45, 0.65, 16), k=2.0)


def protein() -> Blobs:
    """The protein of PDB entry 1TII without its water: one blob an atom, van der Waals radii, k = 2.

    A tail is dropped beyond three radii, where it is exp(-16) = 1e-7.
    """
    import gemmi

    structure = gemmi.read_structure(str(MODELS / "1tii.pdb"))
    structure.remove_waters()
    atoms = [(a.pos.tolist(), RADII[a.element.name]) for c in structure[0] for r in c for a in r]
    centers, radii = (np.array(column, dtype=float) for column in zip(*atoms, strict=True))
    return Blobs("protein", centers, radii, k=2.0, reach=3.0)
