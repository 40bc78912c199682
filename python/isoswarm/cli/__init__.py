"""The command `isoswarm`. Glue: everything it does is one call of the package.

Exit codes, which stay as they are:

====  ==============================================================================
0     done
1     an unexpected failure; please report it
2     wrong usage or input: a malformed formula, a missing file, …
3     there is no surface in the bounds
4     not converged, out of time, or a drag that did not arrive; what there is has been written
130   interrupted with Ctrl-C
====  ==============================================================================
"""

from isoswarm.cli import measure as _measure  # adds its command
from isoswarm.cli import meshes as _meshes  # adds its command
from isoswarm.cli import render as _render  # adds its command
from isoswarm.cli import run as _run  # adds its command
from isoswarm.cli import studio as _studio  # adds its command
from isoswarm.cli.commands import app, main

__all__ = ["app", "main"]

del _measure, _meshes, _render, _run, _studio
