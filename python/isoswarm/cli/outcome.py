"""How a command ends: exit codes, messages, warnings."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any

import typer
from rich.console import Console

from isoswarm.errors import EmptySurfaceError, EmptySurfaceWarning, SamplingWarning
from isoswarm.samples import Report

errors = Console(stderr=True, highlight=False, soft_wrap=True)
"""Where messages and progress go, so that standard output can be piped."""


class Code(IntEnum):
    """Exit codes; see the package."""

    DONE = 0
    UNEXPECTED = 1
    INPUT = 2
    EMPTY = 3
    NOT_CONVERGED = 4
    INTERRUPTED = 130


@contextmanager
def reported() -> Iterator[None]:
    """Turn exceptions into a message and an exit code, and warnings into messages."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                yield
            finally:
                for warning in caught:
                    if warning.category is not SamplingWarning:  # which finish() tells
                        empty = issubclass(warning.category, EmptySurfaceWarning)
                        say("empty" if empty else "warning", str(warning.message), "yellow")
    except typer.Exit:
        raise
    except KeyboardInterrupt:
        say("interrupted", "nothing was written", "yellow")
        raise typer.Exit(Code.INTERRUPTED) from None
    except EmptySurfaceError as error:
        say("empty", str(error), "yellow")
        raise typer.Exit(Code.EMPTY) from None
    except (ValueError, TypeError, KeyError, OSError) as error:
        say("error", str(error), "red")
        raise typer.Exit(Code.INPUT) from None
    except Exception as error:
        say("unexpected error", f"{type(error).__name__}: {error}", "red")
        raise typer.Exit(Code.UNEXPECTED) from error


def say(what: str, text: str, style: str) -> None:
    """Print one message to standard error."""
    errors.print(f"{what}:", style=style, end=" ", markup=False)
    errors.print(text, markup=False)


def finish(report: Report) -> None:
    """Leave with the code that the report asks for."""
    if report.status == "empty":
        raise typer.Exit(Code.EMPTY)
    if not report.converged:
        say("not converged", report.reason, "yellow")
        raise typer.Exit(Code.NOT_CONVERGED)


def print_json(value: Any) -> None:
    """Print one JSON document; what is not finite becomes null."""
    typer.echo(json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value
