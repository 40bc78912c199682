"""What can go wrong, as exceptions. Wrong input is a ``ValueError`` throughout; these say more."""

from __future__ import annotations

__all__ = [
    "CallbackError",
    "ConvergenceError",
    "EmptySurfaceError",
    "EmptySurfaceWarning",
    "FileFormatError",
    "IsoswarmError",
    "ParseError",
    "SamplingWarning",
    "SceneStateError",
    "TooFewError",
    "TooLargeError",
    "UnknownParameterError",
    "UnknownPinError",
]


class IsoswarmError(Exception):
    """Base of every exception of this package."""


class ParseError(IsoswarmError, ValueError):
    """A text that is not a formula.

    Attributes
    ----------
    position : int
        Offset of the trouble in characters, from 0.

    """

    def __init__(self, message: str, position: int = 0) -> None:
        super().__init__(message)
        self.position = position


class FileFormatError(IsoswarmError, ValueError):
    """A malformed or truncated file.

    Attributes
    ----------
    line : int
        Line of the trouble, from 1; 0 for the file as a whole.

    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


class TooLargeError(IsoswarmError, ValueError):
    """More depth, size, samples or memory than the limit: the message has the estimate and the limit."""


class TooFewError(IsoswarmError, ValueError):
    """Fewer samples asked for than there are components.

    Attributes
    ----------
    components : int
        The least ``n`` that can be met.

    """

    def __init__(self, message: str, components: int = 0) -> None:
        super().__init__(message)
        self.components = components


class CallbackError(IsoswarmError, ValueError):
    """A function of yours that gave NaN, the wrong shape or something that is not numbers.

    An exception raised *inside* your function comes out as it is.
    """


class UnknownParameterError(IsoswarmError, KeyError, ValueError):
    """A name that no parameter has; the message lists those there are."""

    def __str__(self) -> str:
        return str(self.args[0])


class UnknownPinError(IsoswarmError, KeyError, ValueError):
    """A number or name that no pin of the scene has; the message lists those there are."""

    def __str__(self) -> str:
        return str(self.args[0])


class EmptySurfaceError(IsoswarmError, ValueError):
    """A change that would leave a scene without a surface in its bounds; the scene is as it was."""


class SceneStateError(IsoswarmError, ValueError):
    """What the scene cannot do now, such as undo where nothing was done; the scene is as it was."""


class ConvergenceError(IsoswarmError, RuntimeError):
    """A goal that was not reached, where going on without it would be wrong."""


class SamplingWarning(UserWarning):
    """Something that was asked for was not reached; ``report`` says what and why."""


class EmptySurfaceWarning(SamplingWarning):
    """There is no surface in the bounds."""
