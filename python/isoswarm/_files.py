"""Text files that may come from strangers."""

from __future__ import annotations

from pathlib import Path

__all__ = ["read_text"]

MOST_BYTES = 256 << 20


def read_text(file: Path, what: str) -> str:
    """The text of a file, or an error that says what was expected; `what` is what is missing where there is none."""
    if not file.is_file():
        raise FileNotFoundError(f"no {what} at {file}")
    if file.stat().st_size > MOST_BYTES:
        raise ValueError(f"{file} has {file.stat().st_size:,} bytes; at most {MOST_BYTES:,} are read")
    try:
        return file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{file}: expected text in UTF-8, given something else at byte {error.start}") from None
