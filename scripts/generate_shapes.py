"""Writes python/isoswarm/shapes.py and functions.py from the core's table of kinds.

Run it after adding a kind: `.venv/bin/python scripts/generate_shapes.py`. A test fails where the files are not current.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parent.parent / "python" / "isoswarm"
SOLIDS = ("shape", "operator", "deformation")
BY_HAND = {"algebraic", "blend", "blobs", "blobby_cylinders", "metaballs", "gaussians"}
"""Kinds whose arguments are arrays or functions: in bumps.py and special.py."""

HEADER = '''"""{title}

Made by scripts/generate_shapes.py from the core's table of kinds; do not edit. Every parameter may be a number, which
becomes a parameter of the model, or a field that gives it.
"""

from __future__ import annotations

from isoswarm.field import Field, Operand, node

__all__ = [
{names}]

'''


def table() -> list[dict[str, Any]]:
    """The kinds; asked of the extension module alone, so that a broken package can be mended."""
    path = next(PACKAGE.glob("_core*.so"))
    spec = importlib.util.spec_from_file_location("isoswarm._core", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    kinds: list[dict[str, Any]] = json.loads(module.kinds())
    return kinds


def wanted(kind: dict[str, Any], categories: tuple[str, ...]) -> bool:
    """Whether a function is made for a kind."""
    return (
        kind["category"] in categories
        and kind["name"] not in BY_HAND
        and kind["payload"] == "none"
        and kind["layout"] == "fixed"
    )


def operands(kind: dict[str, Any]) -> list[str]:
    """Names of the operands; one with a star where there may be any number."""
    match kind["operands"]:
        case {"exactly": 0}:
            return []
        case {"exactly": 1}:
            return ["f"]
        case {"exactly": n}:
            return ["f", "g", "h", "i"][:n]
        case _:
            return ["*operands"]


def signature(kind: dict[str, Any]) -> str:
    """The parameters of the function."""
    parts = [f"{name}: Operand" for name in operands(kind)]
    for p in kind["params"]:
        kind_of = "int" if p["discrete"] else "Operand"
        default = int(p["default"]) if p["discrete"] else float(p["default"])
        parts.append(f"{p['name']}: {kind_of} = {default!r}")
    return ", ".join(parts)


def remarks(p: dict[str, Any]) -> str:
    """Unit, range and flags of a parameter, in words."""
    lowest, highest = p["bounds"]
    said = [p["unit"]] if p["unit"] not in ("", "index") else []
    if lowest is not None and highest is not None:
        said.append(f"{lowest:g} to {highest:g}")
    elif lowest is not None:
        said.append("above 0" if 0 < lowest < 1e-300 else f"at least {lowest:g}")
    if p["frozen"]:
        said.append("frozen unless released")
    return f" ({', '.join(said)})" if said else ""


def function(kind: dict[str, Any]) -> str:
    """The source of one function."""
    first, _, rest = kind["doc"].partition(". ")
    if len(first) > 110:
        first, _, more = first.partition(": ")
        rest = f"{more[:1].upper()}{more[1:]}. {rest}".strip()
    if len(first) > 110:
        first, rest = f"The kind `{kind['name']}`", kind["doc"]
    lines = [first.rstrip(".") + ".", ""]
    if rest:
        lines += [*textwrap.wrap(rest, 110), ""]
    lines += [*textwrap.wrap(f"F = {kind['formula']}", 110, subsequent_indent="    "), ""]
    names = operands(kind)
    lines += ["Parameters", "----------"]
    described = [(name, "Field or float", "Operand." if name[0] != "*" else "Operands.") for name in names]
    described += [
        (p["name"], "int" if p["discrete"] else "float or Field", p["doc"].rstrip(".") + remarks(p) + ".")
        for p in kind["params"]
    ]
    for name, type_of, text in described:
        lines += [
            f"{name} : {type_of}",
            *textwrap.wrap(text, 100, initial_indent="    ", subsequent_indent="    "),
        ]
    if not described:
        lines = lines[:-2]
    else:
        lines.append("")
    lines += ["Returns", "-------", "Field"]
    doc = "\n".join(lines)
    given = ", ".join(f"{p['name']}={p['name']}" for p in kind["params"])
    call = ", ".join([json.dumps(kind["name"]), *names, *([given] if given else [])])
    body = textwrap.indent(f'"""{doc}\n"""\nreturn node({call})', "    ")
    return f"def {kind['name']}({signature(kind)}) -> Field:\n{body}\n"


def module(kinds: list[dict[str, Any]], title: str) -> str:
    """The source of a module, formatted."""
    names = "".join(f"    {json.dumps(name)},\n" for name in sorted(kind["name"] for kind in kinds))
    source = HEADER.format(title=title, names=names) + "\n\n".join(function(kind) for kind in kinds)
    for command in (["format"], ["check", "--fix-only", "--select", "RUF022"]):
        line = [sys.executable, "-m", "ruff", *command, "--stdin-filename", str(PACKAGE / "shapes.py"), "-"]
        source = subprocess.run(line, input=source, check=True, capture_output=True, text=True).stdout
    return source


def files() -> dict[Path, str]:
    """Path and content of each file."""
    kinds = table()
    return {
        PACKAGE / "shapes.py": module(
            [kind for kind in kinds if wanted(kind, SOLIDS)], "Shapes, operators and deformations."
        ),
        PACKAGE / "functions.py": module(
            [kind for kind in kinds if wanted(kind, ("formula",))],
            "Functions of numbers and fields; NumPy's elementary functions work on fields, too.",
        ),
    }


def main() -> None:
    """Write the files."""
    for path, content in files().items():
        path.write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main()
