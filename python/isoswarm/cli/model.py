"""The argument MODEL: a formula, or a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from isoswarm.field import Field
from isoswarm.loading import load, parse
from isoswarm.molecules import ENDINGS as MOLECULES
from isoswarm.molecules import molecule

HELP = (
    "A formula such as 'x^2 + y^2 + z^2 - 1' or 'sphere(r=1) | box(2, 1, 1)', a .vm or .iso.json model, or a "
    ".pdb, .cif or .xyz molecule. Put -- before a formula that begins with a minus sign."
)
FILES = (".vm", ".iso.json")


def read(model: str, settings: list[str], water: bool = False, axes: int = 3) -> Field:
    """The field that MODEL names, with parameters set.

    Parameters
    ----------
    model : str
        What the user typed.
    settings : list of str
        ``name=value`` each.
    water : bool
        Keep a molecule's water.
    axes : int
        2 for a formula of a curve in the plane.

    """
    values = dict(_setting(text) for text in settings)
    ending = model.lower().removesuffix(".gz")
    if ending.endswith(MOLECULES):
        field = molecule(model, water=water)
    elif ending.endswith(FILES):
        field = load(model)
    elif Path(model).is_file():
        raise ValueError(f"{model}: expected a file that ends in one of {', '.join((*FILES, *MOLECULES))}")
    else:
        return parse(model, axes=axes, **values)
    return field.with_parameters(values)


def bounds(text: str | None) -> Any:
    """``--bounds``: one number b for the box from -b to b, or all lower and then all upper corners' coordinates."""
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) == 1:
        return numbers[0]
    if len(numbers) in (4, 6):
        half = len(numbers) // 2
        return numbers[:half], numbers[half:]
    raise ValueError(f"--bounds: expected 1, 4 or 6 numbers such as 1.5 or -1,-1,-1,1,1,1, given {text!r}")


def _setting(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        if not (equals and name.strip()):
            raise ValueError
        return name.strip(), float(value)
    except ValueError:
        raise ValueError(f"--set: expected name=number, given {text!r}") from None
