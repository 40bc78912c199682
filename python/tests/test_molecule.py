"""Molecules: what is read, and what surface it makes."""

from pathlib import Path

import gemmi
import numpy as np
import pytest

import isoswarm as iso

WATER = "3\nwater\nO 0.000 0.000 0.117\nH 0.000 0.757 -0.471\nH 0.000 -0.757 -0.471\n"


@pytest.fixture
def water(tmp_path: Path) -> Path:
    path = tmp_path / "water.xyz"
    path.write_text(WATER)
    return path


def test_the_protein(root: Path) -> None:
    atoms = iso.read_atoms(root / "models" / "1tii.pdb")
    assert len(atoms) == 5469
    assert len(iso.read_atoms(root / "models" / "1tii.pdb", water=True)) == 5684
    assert atoms.centers.shape == (5469, 3)
    assert set(atoms.elements) == {"C", "N", "O", "S"}
    assert set(atoms.radii) == {1.7, 1.55, 1.52, 1.8}
    # First ATOM record of the file.
    np.testing.assert_allclose(atoms.centers[0], _first_atom(root / "models" / "1tii.pdb"))


def _first_atom(path: Path) -> list[float]:
    line = next(line for line in path.read_text().splitlines() if line.startswith("ATOM"))
    return [float(line[a:b]) for a, b in ((30, 38), (38, 46), (46, 54))]


def test_the_gaussian_formula(water: Path, rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (100, 3))
    atoms = iso.read_atoms(water)
    d2 = ((X[:, None] - atoms.centers[None]) ** 2).sum(axis=2)
    expected = 1 - np.exp(-1.5 * (d2 / atoms.radii**2 - 1)).sum(axis=1)
    np.testing.assert_allclose(iso.molecule(water, sharpness=1.5).value(X), expected, rtol=1e-12, atol=1e-12)


def test_the_compact_formula(water: Path, rng: np.random.Generator) -> None:
    X = rng.uniform(-2, 2, (100, 3))
    atoms = iso.read_atoms(water)
    R = atoms.radii / np.sqrt(1 - 0.25 ** (1 / 3))
    d2 = ((X[:, None] - atoms.centers[None]) ** 2).sum(axis=2)
    expected = 0.25 - (np.maximum(0, 1 - d2 / R**2) ** 3).sum(axis=1)
    np.testing.assert_allclose(iso.molecule(water, kind="compact").value(X), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", ["gaussian", "compact"])
def test_an_atom_alone_is_its_sphere(tmp_path: Path, kind) -> None:
    path = tmp_path / "argon.xyz"
    path.write_text("1\n\nAr 1 2 3\n")
    field = iso.molecule(path, kind=kind)
    radius = iso.read_atoms(path).radii[0]
    samples = iso.sample(field, n=100)
    np.testing.assert_allclose(np.linalg.norm(samples.points - [1, 2, 3], axis=1), radius, rtol=1e-9)


def test_parameters_are_frozen_and_named_after_the_file(water: Path) -> None:
    parameters = iso.molecule(water).parameters
    assert all(p.frozen for p in parameters.values())
    assert parameters["water/x1"].value == 0.0
    assert len(parameters) == 2 + 4 * 3


def test_hydrogens_can_be_left_out(water: Path) -> None:
    assert iso.read_atoms(water).elements == ("O", "H", "H")
    assert iso.read_atoms(water, hydrogens=False).elements == ("O",)


def test_mmcif(tmp_path: Path, root: Path) -> None:
    structure = gemmi.read_structure(str(root / "models" / "1tii.pdb"))
    structure.setup_entities()
    path = tmp_path / "1tii.cif"
    structure.make_mmcif_document().write_file(str(path))
    one, two = iso.read_atoms(path), iso.read_atoms(root / "models" / "1tii.pdb")
    np.testing.assert_allclose(one.centers, two.centers, atol=1e-9)
    assert one.elements == two.elements


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.xyz", "", "line 1: expected the number of atoms"),
        ("a.xyz", "3\n\nO 0 0 0\n", "expected 3 atoms after the comment line, given 1"),
        ("a.xyz", "1\n\nO 0 zero 0\n", "line 3: expected a symbol and three numbers"),
        ("a.xyz", "1\n\nO 0 0\n", "line 3: expected a symbol and three numbers"),
        ("a.xyz", "1\n\nQq 0 0 0\n", "line 3: expected a chemical symbol, given 'Qq'"),
        ("a.xyz", "1\n\nO 0 0 nan\n", "not finite"),
        ("a.pdb", "hello\n", "no atoms"),
        ("a.cif", "hello\n", "cannot be read as a PDB or mmCIF file"),
        ("a.mol", "hello\n", r"ends in one of \.pdb"),
    ],
)
def test_files_that_are_no_molecules(tmp_path: Path, name: str, text: str, message: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        iso.molecule(path)


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no molecule at"):
        iso.molecule(tmp_path / "missing.pdb")


def test_an_unknown_kind(water: Path) -> None:
    with pytest.raises(ValueError, match='expected "gaussian" or "compact"'):
        iso.molecule(water, kind="hard")
