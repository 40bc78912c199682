"""Pictures of a scene: its floaters as lit discs, its pins as red ones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_points
from isoswarm.pins import Floaters

__all__ = ["draw"]

FLOATER = (0.27, 0.57, 0.72)
PIN = (0.82, 0.16, 0.12)


def draw(
    floaters: Floaters,
    pins: Floats,
    pin_normals: Floats,
    *,
    frame: npt.ArrayLike | None = None,
    width: int = 960,
    height: int = 720,
    azimuth: float = 0.6,
    elevation: float = 0.4,
    transparent: bool = False,
    ground: bool = True,
    supersampling: int = 2,
) -> bytes:
    """A PNG of floaters and pins.

    Parameters
    ----------
    floaters : Floaters
        The particles.
    pins, pin_normals : ndarray, (k, 3)
        Where the pins are, and the surface's normals there.
    frame : array_like, (m, 3), optional
        Points that fill the picture; by default what is drawn does. What lies outside may be cut off.
    width, height, azimuth, elevation, transparent, supersampling
        As for :meth:`Samples.picture`.
    ground : bool
        Whether they stand on a ground that shows their shadow.

    """
    points, normals, radii = floaters.points, floaters.normals, floaters.radii
    if len(pins):
        # A pin's disc takes the place of those that it would cover.
        size = max(1.3 * float(np.median(radii)), 0.02 * float(np.linalg.norm(np.ptp(points, axis=0))))
        free = np.ones(len(points), dtype=bool)
        for pin in pins:
            free &= np.linalg.norm(points - pin, axis=1) > size
        points, normals, radii = points[free], normals[free], radii[free]
        points, normals = np.vstack([points, pins]), np.vstack([normals, pin_normals])
        radii = np.append(radii, np.full(len(pins), size))
    colors = np.vstack([np.tile(FLOATER, (len(points) - len(pins), 1)), np.tile(PIN, (len(pins), 1))])
    return _core.Cloud(points, normals, radii, colors=colors).png(
        width=width,
        height=height,
        azimuth=azimuth,
        elevation=elevation,
        style="discs",
        coloring="given",
        transparent=transparent,
        disc_scale=None,
        supersampling=supersampling,
        frame=None if frame is None else as_points(frame, 3, "frame"),
        ground=ground,
    )
