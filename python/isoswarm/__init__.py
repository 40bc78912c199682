"""Even samples on implicit surfaces, by particles that are locked onto F(x, q) = 0.

>>> import isoswarm as iso
>>> shape = iso.torus(major=1, minor=0.4) - iso.sphere(r=0.5).translate(x=1)
>>> samples = iso.sample(shape, n=2000)
>>> samples.points.shape, samples.normals.shape
((2000, 3), (2000, 3))
"""

import isoswarm.functions as functions
from isoswarm import errors, metrics, shapes
from isoswarm._core import __version__
from isoswarm.adapters import *  # noqa: F403
from isoswarm.adapters import __all__ as _adapters
from isoswarm.bumps import *  # noqa: F403
from isoswarm.bumps import __all__ as _blobs
from isoswarm.certifying import Certificate, Component, certify
from isoswarm.diagnosis import DerivativeCheck, Diagnosis, check_derivatives, diagnose
from isoswarm.edges import Crease, Creases
from isoswarm.errors import *  # noqa: F403
from isoswarm.errors import __all__ as _errors
from isoswarm.field import Field, Operand, Parameter, Parameters
from isoswarm.live import Node, SceneParameter, SceneParameters
from isoswarm.loading import from_function, load, parse
from isoswarm.measuring import Estimate, Measures, Moments, measure
from isoswarm.meshing import Mesh, MeshReport, TriangleQuality, mesh
from isoswarm.molecules import Atoms, molecule, read_atoms
from isoswarm.motion import surface_velocity
from isoswarm.patches import Parametric, ParametricSamples, parametric
from isoswarm.pins import DragResult, FitResult, Floaters, Moment, Pin, Transfer
from isoswarm.rendering import Image, render, turntable
from isoswarm.samples import Evenness, Report, Samples
from isoswarm.sampling import sample
from isoswarm.scene import Scene
from isoswarm.script import read_script
from isoswarm.shapes import *  # noqa: F403
from isoswarm.shapes import __all__ as _shapes
from isoswarm.special import *  # noqa: F403
from isoswarm.special import __all__ as _special

__all__ = [
    "Atoms",
    "Certificate",
    "Component",
    "Crease",
    "Creases",
    "DerivativeCheck",
    "Diagnosis",
    "DragResult",
    "Estimate",
    "Evenness",
    "Field",
    "FitResult",
    "Floaters",
    "Image",
    "Measures",
    "Mesh",
    "MeshReport",
    "Moment",
    "Moments",
    "Node",
    "Operand",
    "Parameter",
    "Parameters",
    "Parametric",
    "ParametricSamples",
    "Pin",
    "Report",
    "Samples",
    "Scene",
    "SceneParameter",
    "SceneParameters",
    "Transfer",
    "TriangleQuality",
    "__version__",
    "certify",
    "check_derivatives",
    "diagnose",
    "errors",
    "from_function",
    "functions",
    "load",
    "measure",
    "mesh",
    "metrics",
    "molecule",
    "parametric",
    "parse",
    "read_atoms",
    "read_script",
    "render",
    "sample",
    "shapes",
    "surface_velocity",
    "turntable",
]


def __getattr__(name: str) -> object:
    # Only who uses it needs anywidget.
    if name == "Studio":
        from isoswarm.studio import Studio

        return Studio
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ += _adapters + _blobs + _errors + _shapes + _special
