"""The argument MODEL: a formula, or a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from isoswarm.field import Field
from isoswarm.loading import load, parse
from isoswarm.molecules import ENDINGS as MOLECULES
from isoswarm.molecules import molecule
from isoswarm.scene import Scene

HELP = (
    "A formula such as 'x^2 + y^2 + z^2 - 1' or 'sphere(r=1) | box(2, 1, 1)', a .vm or .iso.json model or scene, or a "
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
    field: Field
    if ending.endswith(MOLECULES):
        field = molecule(model, water=water)
    elif ending.endswith(FILES):
        found = load(model)
        field = found.model if isinstance(found, Scene) else found
    elif Path(model).is_file():
        raise ValueError(f"{model}: expected a file that ends in one of {', '.join((*FILES, *MOLECULES))}")
    else:
        return parse(model, axes=axes, **values)
    return field.with_parameters(values)


def read_scene(model: str, settings: list[str], water: bool = False, axes: int = 3, **options: Any) -> Scene:
    """The scene in a file, or one of the field that MODEL names; `options` as for :class:`Scene`, given or None."""
    given = {key: value for key, value in options.items() if value is not None}
    if model.lower().endswith(FILES):
        found = load(model)
        if isinstance(found, Scene):
            for path, value in map(_setting, settings):
                found.parameters[path].value = value
            if given:
                found.configure(**given)
            return found
    return Scene(read(model, settings, water, axes), **given)


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
