"""Even samples on implicit surfaces, by particles that are locked onto F(x, q) = 0."""

from isoswarm._core import __version__

__all__ = ["__version__"]
