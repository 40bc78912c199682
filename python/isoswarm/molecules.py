"""Molecules as blob surfaces: PDB, mmCIF and XYZ files, van der Waals radii."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import gemmi
import numpy as np

from isoswarm._arrays import Floats
from isoswarm.bumps import gaussians, metaballs
from isoswarm.field import Field

__all__ = ["ENDINGS", "Atoms", "molecule", "read_atoms"]

ENDINGS = (".pdb", ".ent", ".cif", ".mmcif", ".xyz")
"""File name endings that :func:`molecule` reads; `.gz` after the first four is fine too."""

BIAS = 0.25
SUPPORT = (1.0 - BIAS ** (1.0 / 3.0)) ** -0.5
"""Radius beyond which a compact bump is 0, over that where it is BIAS."""


@dataclass(frozen=True)
class Atoms:
    """The atoms of a molecule.

    Attributes
    ----------
    centers : ndarray, (n, 3)
        Positions in Å.
    radii : ndarray, (n,)
        Van der Waals radii in Å.
    elements : tuple of str
        Chemical symbols.

    """

    centers: Floats
    radii: Floats
    elements: tuple[str, ...]

    def __len__(self) -> int:
        """Count the atoms."""
        return len(self.elements)


def molecule(
    path: str | os.PathLike[str],
    *,
    water: bool = False,
    hydrogens: bool = True,
    kind: Literal["gaussian", "compact"] = "gaussian",
    sharpness: float = 2.0,
    scale: float = 1.0,
) -> Field:
    """Read the surface of a molecule, as a sum of one blob an atom.

    With aᵢ the position and rᵢ = ``scale`` times the van der Waals radius of atom i, and dᵢ = ‖x - aᵢ‖:

    - ``kind="gaussian"``: F = 1 - Σ exp(-s (dᵢ²/rᵢ² - 1)), with s = `sharpness`;
    - ``kind="compact"``: F = 1/4 - Σ max(0, 1 - dᵢ²/Rᵢ²)³, with Rᵢ = rᵢ / √(1 - ∛(1/4)) ≈ 1.643 rᵢ.

    Either way an atom alone is the sphere of radius rᵢ, and F < 0 inside.

    Parameters
    ----------
    path : str or path
        A ``.pdb``, ``.cif`` (mmCIF) or ``.xyz`` file. Of several models, the first; of alternative positions of an
        atom, the first.
    water : bool
        Keep the water molecules.
    hydrogens : bool
        Keep the hydrogen atoms, where the file has any.
    kind : {"gaussian", "compact"}
        Shape of a blob.
    sharpness : float
        s in the Gaussian formula: the larger, the closer the surface is to the union of the balls.
    scale : float
        Factor on the radii.

    Returns
    -------
    Field
        Lengths in Å; its parameters are frozen.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        Not such a file, an unknown element, or no atoms in it.

    """
    atoms = read_atoms(path, water=water, hydrogens=hydrogens)
    if kind == "gaussian":
        field = gaussians(atoms.centers, scale * atoms.radii, sharpness=sharpness)
    elif kind == "compact":
        field = metaballs(atoms.centers, scale * SUPPORT * atoms.radii, bias=BIAS)
    else:
        raise ValueError(f'kind: expected "gaussian" or "compact", given {kind!r}')
    return field.freeze().named(Path(path).name.split(".")[0] or "molecule")


def read_atoms(path: str | os.PathLike[str], *, water: bool = False, hydrogens: bool = True) -> Atoms:
    """Read positions, radii and elements; the arguments are those of :func:`molecule`."""
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"no molecule at {file}")
    ending = file.name.lower().removesuffix(".gz")
    if ending.endswith(".xyz"):
        symbols, positions = _read_xyz(file)
        if not hydrogens:
            kept = [i for i, symbol in enumerate(symbols) if symbol not in ("H", "D")]
            symbols, positions = [symbols[i] for i in kept], positions[kept]
    elif ending.endswith(ENDINGS):
        symbols, positions = _read_structure(file, water, hydrogens)
    else:
        raise ValueError(f"{file}: expected a file that ends in one of {', '.join(ENDINGS)}")
    if not symbols:
        raise ValueError(
            f"{file} has no atoms to draw (water={water}, hydrogens={hydrogens}); is it a PDB, mmCIF or XYZ file?"
        )
    if not np.isfinite(positions).all():
        raise ValueError(f"{file} has atoms whose positions are not finite numbers")
    radii = np.array([gemmi.Element(symbol).vdw_r for symbol in symbols], dtype=np.float64)
    # gemmi keeps radii in single precision; two decimals are what the tables give.
    return Atoms(positions, radii.round(2), tuple(symbols))


def _read_structure(file: Path, water: bool, hydrogens: bool) -> tuple[list[str], Floats]:
    try:
        structure = gemmi.read_structure(str(file))
    except (RuntimeError, ValueError, IndexError) as error:
        raise ValueError(f"{file} cannot be read as a PDB or mmCIF file: {error}") from error
    if not water:
        structure.remove_waters()
    if not hydrogens:
        structure.remove_hydrogens()
    structure.remove_alternative_conformations()
    if len(structure) == 0:
        return [], np.empty((0, 3))
    atoms = [found.atom for found in structure[0].all()]
    positions = np.array([atom.pos.tolist() for atom in atoms], dtype=np.float64).reshape(-1, 3)
    return [atom.element.name for atom in atoms], positions


def _read_xyz(file: Path) -> tuple[list[str], Floats]:
    """XYZ: a count, a comment, then lines of symbol and position in Å."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        count = int(lines[0])
    except (IndexError, ValueError) as error:
        raise ValueError(f"{file} line 1: expected the number of atoms") from error
    if count < 0 or len(lines) < count + 2:
        raise ValueError(f"{file}: expected {count} atoms after the comment line, given {max(len(lines) - 2, 0)}")
    symbols, positions = [], np.empty((count, 3))
    for i, line in enumerate(lines[2 : count + 2]):
        columns = line.split()
        try:
            positions[i] = [float(text) for text in columns[1:4]]
        except ValueError as error:
            raise ValueError(f"{file} line {i + 3}: expected a symbol and three numbers, given {line!r}") from error
        symbol = columns[0].capitalize()
        if gemmi.Element(symbol).atomic_number == 0:
            raise ValueError(f"{file} line {i + 3}: expected a chemical symbol, given {columns[0]!r}")
        symbols.append(symbol)
    return symbols, positions
