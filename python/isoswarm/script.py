"""Scripts: commands for a scene, as files and as plain data."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from isoswarm import _core
from isoswarm._files import read_text
from isoswarm._requests import as_json

__all__ = ["read_script"]


def checked_commands(commands: Sequence[Mapping[str, Any]]) -> list[tuple[int | None, str]]:
    """Commands as the core takes them, each with the time for which it waits."""
    header = {"format": "isoswarm script", "version": 1}
    return _core.read_script(as_json({**header, "commands": [dict(c) for c in commands]}))


def read_script(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Read the commands of a script, as :meth:`Scene.replay` takes them.

    Parameters
    ----------
    path : str or path
        A file ``{"format": "isoswarm script", "version": 1, "commands": […]}``.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileFormatError
        A malformed script.

    """
    commands = _core.read_script(read_text(Path(path), "script"))
    return [json.loads(text) | ({} if at is None else {"at_step": at}) for at, text in commands]
