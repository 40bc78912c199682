"""mesh() beside CGAL's surface mesher and marching cubes: as many vertices, or as near to the surface."""

import numpy as np

from options import Options, timed
from peers import meshers
from table import Row, number

CELLS = (96, 128, 256)
"""Of marching cubes along each axis."""


def rows(options: Options) -> list[Row]:
    """Against CGAL at 10,000 vertices on four surfaces; against marching cubes at equal error."""
    jobs = [*meshers.FORMULAS.items()]
    found = []
    for name, (formula, half) in jobs[:1] if options.quick else jobs:
        found += _beside_cgal(options, name, formula, half)
        for cells in CELLS[:1] if options.quick else CELLS:
            found += _beside_cubes(options, name, formula, half, cells)
    return found


def _beside_cgal(options: Options, name: str, formula: str, half: float) -> list[Row]:
    import isoswarm as iso

    field = iso.parse(formula)
    goal = f"mesh({name}, n=10,000)"
    try:
        points, faces, peer_time = meshers.cgal(formula, half, 10_000)
    except (ImportError, RuntimeError) as error:
        return [Row(goal, "", "CGAL", None, "x", 5.0, 10.0, note=f"CGAL did not run: {error}")]
    seconds, ours = timed(options, lambda: iso.mesh(field, n=len(points), bounds=half))
    theirs = iso.metrics.triangle_quality(points, faces)
    q = ours.report.quality
    text = f"{number(seconds)} s, Q {q.q_avg:.3f}, least angle {q.smallest_angle:.1f}°"
    peer = f"CGAL {number(peer_time)} s, {len(points)} vertices, Q {theirs.q_avg:.3f}, {theirs.smallest_angle:.1f}°"
    options.log(f"{goal}: {text}; {peer}")
    data = {"isoswarm": ours.report.as_dict(), "cgal": {"seconds": peer_time, "quality": vars(theirs)}}
    return [
        Row(goal, text, peer, peer_time / seconds, "x", 5.0, 10.0, data=data),
        Row(f"{goal}: Q_avg", f"{q.q_avg:.3f}", f"{theirs.q_avg:.3f}", q.q_avg, "", 0.92, 0.95),
        Row(
            f"{goal}: least angle",
            f"{q.smallest_angle:.1f}",
            f"{theirs.smallest_angle:.1f}",
            q.smallest_angle,
            "°",
            30,
            35,
        ),
    ]


def _beside_cubes(options: Options, name: str, formula: str, half: float, cells: int) -> list[Row]:
    import isoswarm as iso

    field = iso.parse(formula)
    found = []
    for library, mesher in meshers.CUBES.items():
        try:
            peer_time, (points, faces) = timed(options, lambda m=mesher: m(formula, half, cells))
        except ImportError as error:
            found.append(Row(f"mesh({name}) at equal error", "", library, None, "x", 2.0, 4.0, note=str(error)))
            continue
        error = _distance(field, points, faces)
        seconds, ours = timed(options, lambda e=error: iso.mesh(field, error=e, bounds=half))
        reached = _distance(field, ours.points, ours.faces)
        what = f"mesh({name}, error={error:.1e})"
        text = f"{number(seconds)} s, {len(ours):,} triangles, off {reached:.1e}"
        peer = f"{library}, {cells}³: {number(peer_time)} s, {len(faces):,} triangles, off {error:.1e}"
        options.log(f"{what}: {text}; {peer}")
        found.append(Row(f"{what}: triangles", text, peer, len(faces) / len(ours), "x", 2.0, 4.0))
        found.append(Row(f"{what}: time", text, peer, peer_time / seconds, "x", 0.5, 1.0))
    return found


def _distance(field, points: np.ndarray, faces: np.ndarray) -> float:
    """Largest distance from the surface, at the triangles' centres and the middles of their edges, to first order."""
    corners = points[faces]
    places = np.concatenate([corners.mean(axis=1), *(corners[:, [k, (k + 1) % 3]].mean(axis=1) for k in range(3))])
    return float(np.max(np.abs(field.value(places)) / np.linalg.norm(field.gradient(places), axis=1)))
