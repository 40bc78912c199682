"""Shapes, operators and deformations.

Made by scripts/generate_shapes.py from the core's table of kinds; do not edit. Every parameter may be a number, which
becomes a parameter of the model, or a field that gives it.
"""

from __future__ import annotations

from isoswarm.field import Field, Operand, node

__all__ = [
    "bend",
    "bend_about",
    "blobby_blend",
    "box",
    "capsule",
    "complement",
    "cone",
    "cylinder",
    "difference",
    "ellipsoid",
    "gyroid",
    "hidden",
    "intersection",
    "iwp",
    "lidinoid",
    "mirror",
    "neovius",
    "offset",
    "plane",
    "quadratic_union",
    "quadric",
    "r_blend",
    "repeat",
    "rotate",
    "rotate_about",
    "rotate_euler",
    "rounded_box",
    "scale",
    "scale_about",
    "scale_axes",
    "schwarz_d",
    "schwarz_p",
    "shell",
    "smooth_difference",
    "smooth_intersection",
    "smooth_union",
    "sphere",
    "superelliptic_blend",
    "superquadric",
    "taper",
    "taper_about",
    "torus",
    "translate",
    "twist",
    "twist_about",
    "union",
]


def sphere(r: Operand = 1.0) -> Field:
    """A ball of radius r.

    Exact distance.

    F = |p| − r

    Parameters
    ----------
    r : float or Field
        Radius (length, above 0).

    Returns
    -------
    Field
    """
    return node("sphere", r=r)


def ellipsoid(rx: Operand = 1.0, ry: Operand = 1.0, rz: Operand = 1.0) -> Field:
    """An ellipsoid with the given semi-axes.

    Not a distance: F grows by 1 from the surface to its double.

    F = |(x/rx, y/ry, z/rz)| − 1

    Parameters
    ----------
    rx : float or Field
        Semi-axis along x (length, above 0).
    ry : float or Field
        Semi-axis along y (length, above 0).
    rz : float or Field
        Semi-axis along z (length, above 0).

    Returns
    -------
    Field
    """
    return node("ellipsoid", rx=rx, ry=ry, rz=rz)


def box(x: Operand = 1.0, y: Operand = 1.0, z: Operand = 1.0) -> Field:
    """A box with full side lengths x, y and z: box(2, 1, 1) reaches from −1 to 1 along x.

    Exact distance.

    F = |max(q, 0)| outside, max(qx, qy, qz) inside; q = |p| − (x, y, z)/2

    Parameters
    ----------
    x : float or Field
        Full side length along x (length, above 0).
    y : float or Field
        Full side length along y (length, above 0).
    z : float or Field
        Full side length along z (length, above 0).

    Returns
    -------
    Field
    """
    return node("box", x=x, y=y, z=z)


def rounded_box(x: Operand = 1.0, y: Operand = 1.0, z: Operand = 1.0, r: Operand = 0.1) -> Field:
    """A box with full side lengths x, y and z whose edges are rounded with radius r.

    Exact distance.

    F = |max(q, 0)| − r outside, max(qx, qy, qz) − r inside; q = |p| − (x, y, z)/2 + r

    Parameters
    ----------
    x : float or Field
        Full side length along x (length, above 0).
    y : float or Field
        Full side length along y (length, above 0).
    z : float or Field
        Full side length along z (length, above 0).
    r : float or Field
        Radius of the edges, at most half the shortest side (length, at least 0).

    Returns
    -------
    Field
    """
    return node("rounded_box", x=x, y=y, z=z, r=r)


def torus(major: Operand = 1.0, minor: Operand = 0.25) -> Field:
    """A torus around the z axis.

    Exact distance.

    F = |(|(x, y)| − major, z)| − minor

    Parameters
    ----------
    major : float or Field
        Radius of the circle in the middle of the tube (length, above 0).
    minor : float or Field
        Radius of the tube (length, above 0).

    Returns
    -------
    Field
    """
    return node("torus", major=major, minor=minor)


def cylinder(r: Operand = 1.0, h: Operand = 2.0) -> Field:
    """A capped cylinder along z, centred at the origin.

    Exact distance.

    F = |max(q, 0)| outside, max(qr, qz) inside; q = (|(x, y)| − r, |z| − h/2)

    Parameters
    ----------
    r : float or Field
        Radius (length, above 0).
    h : float or Field
        Full height (length, above 0).

    Returns
    -------
    Field
    """
    return node("cylinder", r=r, h=h)


def capsule(r: Operand = 0.5, h: Operand = 1.0) -> Field:
    """All points within r of a segment along z, centred at the origin.

    Exact distance.

    F = |(x, y, z − clamp(z, −h/2, h/2))| − r

    Parameters
    ----------
    r : float or Field
        Radius (length, above 0).
    h : float or Field
        Length of the segment, without the round ends (length, at least 0).

    Returns
    -------
    Field
    """
    return node("capsule", r=r, h=h)


def cone(r1: Operand = 1.0, r2: Operand = 0.0, h: Operand = 2.0) -> Field:
    """A capped cone along z, centred at the origin; r2 = 0 gives a tip.

    The distance inside and next to the faces; less than it beyond the edges.

    F = max((|(x, y)| − r1 − (r2 − r1)(z/h + 1/2)) h/√(h² + (r1 − r2)²), |z| − h/2)

    Parameters
    ----------
    r1 : float or Field
        Radius at z = −h/2 (length, at least 0).
    r2 : float or Field
        Radius at z = h/2 (length, at least 0).
    h : float or Field
        Full height (length, above 0).

    Returns
    -------
    Field
    """
    return node("cone", r1=r1, r2=r2, h=h)


def plane(nx: Operand = 0.0, ny: Operand = 0.0, nz: Operand = 1.0, offset: Operand = 0.0) -> Field:
    """The half-space on the side of a plane that its normal points away from.

    Exact distance. The normal need not have length 1, but not length 0.

    F = n·p/|n| − offset

    Parameters
    ----------
    nx : float or Field
        x of the normal.
    ny : float or Field
        y of the normal.
    nz : float or Field
        z of the normal.
    offset : float or Field
        Distance of the plane from the origin, along the normal (length).

    Returns
    -------
    Field
    """
    return node("plane", nx=nx, ny=ny, nz=nz, offset=offset)


def superquadric(
    rx: Operand = 1.0, ry: Operand = 1.0, rz: Operand = 1.0, e1: Operand = 0.5, e2: Operand = 0.5
) -> Field:
    """A superquadric: 1, 1 is an ellipsoid; towards 0 it becomes a box, at 2 a double pyramid.

    F grows by 1 from the surface to its double.

    F = ((|x/rx|^(2/e2) + |y/ry|^(2/e2))^(e2/e1) + |z/rz|^(2/e1))^(e1/2) − 1

    Parameters
    ----------
    rx : float or Field
        Semi-axis along x (length, above 0).
    ry : float or Field
        Semi-axis along y (length, above 0).
    rz : float or Field
        Semi-axis along z (length, above 0).
    e1 : float or Field
        Exponent from pole to pole (0.02 to 4).
    e2 : float or Field
        Exponent around the z axis (0.02 to 4).

    Returns
    -------
    Field
    """
    return node("superquadric", rx=rx, ry=ry, rz=rz, e1=e1, e2=e2)


def gyroid(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Schoen's gyroid.

    F = sin X cos Y + sin Y cos Z + sin Z cos X − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("gyroid", period=period, level=level)


def schwarz_p(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Schwarz' primitive surface.

    F = cos X + cos Y + cos Z − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("schwarz_p", period=period, level=level)


def schwarz_d(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Schwarz' diamond surface.

    F = sin X sin Y sin Z + sin X cos Y cos Z + cos X sin Y cos Z + cos X cos Y sin Z − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("schwarz_d", period=period, level=level)


def neovius(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Neovius' surface.

    F = 3 (cos X + cos Y + cos Z) + 4 cos X cos Y cos Z − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("neovius", period=period, level=level)


def lidinoid(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Lidin's lidinoid.

    F = (sin 2X cos Y sin Z + sin 2Y cos Z sin X + sin 2Z cos X sin Y)/2 − (cos 2X cos 2Y + cos 2Y cos 2Z + cos 2Z
        cos 2X)/2 + 0.15 − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("lidinoid", period=period, level=level)


def iwp(period: Operand = 1.0, level: Operand = 0.0) -> Field:
    """Schoen's I-WP surface.

    F = 2 (cos X cos Y + cos Y cos Z + cos Z cos X) − cos 2X − cos 2Y − cos 2Z − level; X = 2πx/period

    Parameters
    ----------
    period : float or Field
        Side of the cubic cell (length, above 0).
    level : float or Field
        Shifts the surface: above 0 the inside grows (value).

    Returns
    -------
    Field
    """
    return node("iwp", period=period, level=level)


def quadric(
    q0: Operand = -1.0,
    q1: Operand = 0.0,
    q2: Operand = 0.0,
    q3: Operand = 0.0,
    q4: Operand = 1.0,
    q5: Operand = 0.0,
    q6: Operand = 1.0,
    q7: Operand = 0.0,
    q8: Operand = 0.0,
    q9: Operand = 1.0,
) -> Field:
    """A surface of second degree with its ten coefficients (HBJF02 eq.

    9, corrected). By default the unit sphere.

    F = q0 + q1 x + q2 y + q3 z + q4 x² + q5 xy + q6 y² + q7 xz + q8 yz + q9 z²

    Parameters
    ----------
    q0 : float or Field
        The constant.
    q1 : float or Field
        Coefficient of x.
    q2 : float or Field
        Coefficient of y.
    q3 : float or Field
        Coefficient of z.
    q4 : float or Field
        Coefficient of x².
    q5 : float or Field
        Coefficient of xy.
    q6 : float or Field
        Coefficient of y².
    q7 : float or Field
        Coefficient of xz.
    q8 : float or Field
        Coefficient of yz.
    q9 : float or Field
        Coefficient of z².

    Returns
    -------
    Field
    """
    return node("quadric", q0=q0, q1=q1, q2=q2, q3=q3, q4=q4, q5=q5, q6=q6, q7=q7, q8=q8, q9=q9)


def union(*operands: Operand) -> Field:
    """What is inside any of the operands.

    F = min(f, g, …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("union", *operands)


def intersection(*operands: Operand) -> Field:
    """What is inside all of the operands.

    F = max(f, g, …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("intersection", *operands)


def difference(*operands: Operand) -> Field:
    """What is inside the first operand and outside all others.

    F = max(f, −g, …)

    Parameters
    ----------
    *operands : Field or float
        Operands.

    Returns
    -------
    Field
    """
    return node("difference", *operands)


def complement(f: Operand) -> Field:
    """Inside and outside exchanged.

    F = −f

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("complement", f)


def offset(f: Operand, d: Operand = 0.1) -> Field:
    """Grown by a distance d (shrunk where d < 0), as far as the operand is a distance.

    F = f − d

    Parameters
    ----------
    f : Field or float
        Operand.
    d : float or Field
        How far outwards (length).

    Returns
    -------
    Field
    """
    return node("offset", f, d=d)


def shell(f: Operand, thickness: Operand = 0.1) -> Field:
    """A wall of the given thickness with the operand's surface in its middle.

    F = |f| − thickness/2

    Parameters
    ----------
    f : Field or float
        Operand.
    thickness : float or Field
        Full thickness (length, above 0).

    Returns
    -------
    Field
    """
    return node("shell", f, thickness=thickness)


def hidden(f: Operand) -> Field:
    """A part that is left out for now: the operator above is as if it had been removed, and its parameters stay.

    A model of which everything is hidden has no surface.

    F = f, where it stands for a part of its own

    Parameters
    ----------
    f : Field or float
        Operand.

    Returns
    -------
    Field
    """
    return node("hidden", f)


def smooth_union(*operands: Operand, k: Operand = 0.1) -> Field:
    """A union with rounded seams: the logarithm of the sum of exponentials.

    Smooth, symmetric, of any number of operands; where n of them are equal the surface moves out by k ln n.

    F = −k ln Σ exp(−fᵢ/k)

    Parameters
    ----------
    *operands : Field or float
        Operands.
    k : float or Field
        Width of the blend (length, above 0).

    Returns
    -------
    Field
    """
    return node("smooth_union", *operands, k=k)


def smooth_intersection(*operands: Operand, k: Operand = 0.1) -> Field:
    """An intersection with rounded seams; see smooth_union.

    F = k ln Σ exp(fᵢ/k)

    Parameters
    ----------
    *operands : Field or float
        Operands.
    k : float or Field
        Width of the blend (length, above 0).

    Returns
    -------
    Field
    """
    return node("smooth_intersection", *operands, k=k)


def smooth_difference(*operands: Operand, k: Operand = 0.1) -> Field:
    """The first operand without all others, with rounded seams; see smooth_union.

    F = k ln(exp(f/k) + Σ exp(−gᵢ/k))

    Parameters
    ----------
    *operands : Field or float
        Operands.
    k : float or Field
        Width of the blend (length, above 0).

    Returns
    -------
    Field
    """
    return node("smooth_difference", *operands, k=k)


def quadratic_union(*operands: Operand, k: Operand = 0.1) -> Field:
    """A union with rounded seams.

    The quadratic smooth minimum, exactly the union where the operands differ by more than k. Once continuously
    differentiable; more than two operands are joined in order.

    F = min(f, g) − max(k − |f − g|, 0)²/(4k)

    Parameters
    ----------
    *operands : Field or float
        Operands.
    k : float or Field
        Width of the blend (length, above 0).

    Returns
    -------
    Field
    """
    return node("quadratic_union", *operands, k=k)


def blobby_blend(f: Operand, g: Operand, T: Operand = 1.0, a: Operand = 0.0, b: Operand = 0.0) -> Field:
    """The blobby blend of two operands (HBJF02 eq.

    4).

    F = T − exp(−f − a) − exp(−g − b)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    T : float or Field
        What the sum must exceed to be inside (value).
    a : float or Field
        How much the first operand shrinks (value).
    b : float or Field
        How much the second operand shrinks (value).

    Returns
    -------
    Field
    """
    return node("blobby_blend", f, g, T=T, a=a, b=b)


def superelliptic_blend(f: Operand, g: Operand, a: Operand = 0.5, b: Operand = 0.5, d: int = 2) -> Field:
    """The superelliptic blend of two operands (HBJF02 eq.

    5, corrected: as printed it is inside out and closed). A union whose seam is filled within the distances a and
    b.

    F = 1 − max(0, 1 − f/a)^d − max(0, 1 − g/b)^d

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    a : float or Field
        How far the blend reaches from the first operand (value, above 0).
    b : float or Field
        How far the blend reaches from the second operand (value, above 0).
    d : int
        Degree: the larger, the sharper the seam (2 to 64).

    Returns
    -------
    Field
    """
    return node("superelliptic_blend", f, g, a=a, b=b, d=d)


def r_blend(f: Operand, g: Operand, s: int = -1, d: int = 0) -> Field:
    """An R-function of two operands (HBJF02 eq.

    6). With F < 0 inside s = 1 is the intersection and s = −1 the union. The derivative at f = g = 0 is defined
    as that of f + g for d = 0; for d above 0 it is 0 there, along the whole crease.

    F = (f + g + s √(f² + g²)) (f² + g²)^(d/2)

    Parameters
    ----------
    f : Field or float
        Operand.
    g : Field or float
        Operand.
    s : int
        1: intersection; −1: union (-1 to 1).
    d : int
        Degree of smoothness at the crease (0 to 16).

    Returns
    -------
    Field
    """
    return node("r_blend", f, g, s=s, d=d)


def translate(f: Operand, x: Operand = 0.0, y: Operand = 0.0, z: Operand = 0.0) -> Field:
    """The operand moved by (x, y, z).

    F = f(p − (x, y, z))

    Parameters
    ----------
    f : Field or float
        Operand.
    x : float or Field
        Along x (length).
    y : float or Field
        Along y (length).
    z : float or Field
        Along z (length).

    Returns
    -------
    Field
    """
    return node("translate", f, x=x, y=y, z=z)


def rotate(f: Operand, angle: Operand = 0.0, ax: Operand = 0.0, ay: Operand = 0.0, az: Operand = 1.0) -> Field:
    """The operand turned about an axis through the origin, counter-clockwise seen from its tip.

    F = f(R⁻¹ p), R by Rodrigues' formula

    Parameters
    ----------
    f : Field or float
        Operand.
    angle : float or Field
        Radians (angle).
    ax : float or Field
        x of the axis (frozen unless released).
    ay : float or Field
        y of the axis (frozen unless released).
    az : float or Field
        z of the axis; its length does not matter (frozen unless released).

    Returns
    -------
    Field
    """
    return node("rotate", f, angle=angle, ax=ax, ay=ay, az=az)


def rotate_euler(f: Operand, x: Operand = 0.0, y: Operand = 0.0, z: Operand = 0.0) -> Field:
    """The operand turned about x, then y, then z.

    F = f((Rz Ry Rx)⁻¹ p)

    Parameters
    ----------
    f : Field or float
        Operand.
    x : float or Field
        Radians about x, first (angle).
    y : float or Field
        Radians about y, second (angle).
    z : float or Field
        Radians about z, last (angle).

    Returns
    -------
    Field
    """
    return node("rotate_euler", f, x=x, y=y, z=z)


def scale(f: Operand, s: Operand = 1.0) -> Field:
    """The operand made larger by a factor.

    Distances stay distances.

    F = s f(p/s)

    Parameters
    ----------
    f : Field or float
        Operand.
    s : float or Field
        Factor (length, above 0).

    Returns
    -------
    Field
    """
    return node("scale", f, s=s)


def scale_axes(f: Operand, sx: Operand = 1.0, sy: Operand = 1.0, sz: Operand = 1.0) -> Field:
    """The operand stretched by a factor for each axis.

    A distance no longer is one.

    F = f(x/sx, y/sy, z/sz)

    Parameters
    ----------
    f : Field or float
        Operand.
    sx : float or Field
        Factor along x (length, above 0).
    sy : float or Field
        Factor along y (length, above 0).
    sz : float or Field
        Factor along z (length, above 0).

    Returns
    -------
    Field
    """
    return node("scale_axes", f, sx=sx, sy=sy, sz=sz)


def mirror(f: Operand, nx: Operand = 1.0, ny: Operand = 0.0, nz: Operand = 0.0, offset: Operand = 0.0) -> Field:
    """The part of the operand on the side of a plane that the normal points to, and its mirror image.

    F = f(p − 2 min(n·p/|n| − offset, 0) n/|n|)

    Parameters
    ----------
    f : Field or float
        Operand.
    nx : float or Field
        x of the normal (frozen unless released).
    ny : float or Field
        y of the normal (frozen unless released).
    nz : float or Field
        z of the normal; its length does not matter (frozen unless released).
    offset : float or Field
        Distance of the plane from the origin (length).

    Returns
    -------
    Field
    """
    return node("mirror", f, nx=nx, ny=ny, nz=nz, offset=offset)


def repeat(
    f: Operand, px: Operand = 0.0, py: Operand = 0.0, pz: Operand = 0.0, nx: int = 0, ny: int = 0, nz: int = 0
) -> Field:
    """Copies of the operand at regular distances, centred at the origin.

    The operand must fit into a cell, or it is cut off at its borders.

    F = f(p − period · cell(p))

    Parameters
    ----------
    f : Field or float
        Operand.
    px : float or Field
        Period along x; 0: not repeated (length, at least 0, frozen unless released).
    py : float or Field
        Period along y; 0: not repeated (length, at least 0, frozen unless released).
    pz : float or Field
        Period along z; 0: not repeated (length, at least 0, frozen unless released).
    nx : int
        Copies along x; 0: without end (0 to 1e+06).
    ny : int
        Copies along y; 0: without end (0 to 1e+06).
    nz : int
        Copies along z; 0: without end (0 to 1e+06).

    Returns
    -------
    Field
    """
    return node("repeat", f, px=px, py=py, pz=pz, nx=nx, ny=ny, nz=nz)


def twist(f: Operand, rate: Operand = 1.0, axis: int = 2) -> Field:
    """The operand twisted about an axis.

    F = f(x cos t + y sin t, y cos t − x sin t, z), t = rate · z

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Radians per unit of length along the axis (angle/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).

    Returns
    -------
    Field
    """
    return node("twist", f, rate=rate, axis=axis)


def bend(f: Operand, rate: Operand = 0.5, axis: int = 2) -> Field:
    """The operand bent (Barr 1984).

    What lay along x (y or z for axis 0 or 1) becomes an arc of radius 1/rate that turns about the axis..

    F = f(atan2(kx, 1 − ky)/k, 1/k − |(x, 1/k − y)|, z), k = rate

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Curvature of the arc; 0: straight (angle/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).

    Returns
    -------
    Field
    """
    return node("bend", f, rate=rate, axis=axis)


def taper(f: Operand, rate: Operand = 0.1, axis: int = 2) -> Field:
    """The operand widened along an axis; the factor is never below 0.01.

    F = f(x/s, y/s, z), s = max(1 + rate · z, 0.01)

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Change of the factor per unit of length (1/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).

    Returns
    -------
    Field
    """
    return node("taper", f, rate=rate, axis=axis)


def rotate_about(
    f: Operand,
    rx: Operand = 0.0,
    ry: Operand = 0.0,
    rz: Operand = 0.0,
    cx: Operand = 0.0,
    cy: Operand = 0.0,
    cz: Operand = 0.0,
) -> Field:
    """The operand turned about a centre by a rotation vector.

    Its direction is the axis, its length the angle, counter-clockwise seen from its tip. Smooth at zero.

    F = f(c + R⁻¹ (p − c)), R by Rodrigues' formula

    Parameters
    ----------
    f : Field or float
        Operand.
    rx : float or Field
        x of the rotation vector, in radians (angle).
    ry : float or Field
        y of the rotation vector, in radians (angle).
    rz : float or Field
        z of the rotation vector, in radians (angle).
    cx : float or Field
        x of the centre (length, frozen unless released).
    cy : float or Field
        y of the centre (length, frozen unless released).
    cz : float or Field
        z of the centre (length, frozen unless released).

    Returns
    -------
    Field
    """
    return node("rotate_about", f, rx=rx, ry=ry, rz=rz, cx=cx, cy=cy, cz=cz)


def scale_about(
    f: Operand,
    sx: Operand = 1.0,
    sy: Operand = 1.0,
    sz: Operand = 1.0,
    cx: Operand = 0.0,
    cy: Operand = 0.0,
    cz: Operand = 0.0,
) -> Field:
    """The operand stretched about a centre by a factor for each axis.

    A distance no longer is one.

    F = f(c + ((x − cx)/sx, (y − cy)/sy, (z − cz)/sz))

    Parameters
    ----------
    f : Field or float
        Operand.
    sx : float or Field
        Factor along x (length, above 0).
    sy : float or Field
        Factor along y (length, above 0).
    sz : float or Field
        Factor along z (length, above 0).
    cx : float or Field
        x of the centre (length, frozen unless released).
    cy : float or Field
        y of the centre (length, frozen unless released).
    cz : float or Field
        z of the centre (length, frozen unless released).

    Returns
    -------
    Field
    """
    return node("scale_about", f, sx=sx, sy=sy, sz=sz, cx=cx, cy=cy, cz=cz)


def taper_about(
    f: Operand, rate: Operand = 0.0, axis: int = 2, cx: Operand = 0.0, cy: Operand = 0.0, cz: Operand = 0.0
) -> Field:
    """The operand widened along an axis through a centre; the factor is 1 at the centre and never below 0.01.

    F = f(c + ((x − cx)/s, (y − cy)/s, z − cz)), s = max(1 + rate (z − cz), 0.01)

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Change of the factor per unit of length (1/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).
    cx : float or Field
        x of the centre (length, frozen unless released).
    cy : float or Field
        y of the centre (length, frozen unless released).
    cz : float or Field
        z of the centre (length, frozen unless released).

    Returns
    -------
    Field
    """
    return node("taper_about", f, rate=rate, axis=axis, cx=cx, cy=cy, cz=cz)


def twist_about(
    f: Operand, rate: Operand = 0.0, axis: int = 2, cx: Operand = 0.0, cy: Operand = 0.0, cz: Operand = 0.0
) -> Field:
    """The operand twisted about an axis through a centre, which stays.

    F = f(c + R⁻¹ (p − c)), R a turn about the axis by rate (z − cz)

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Radians per unit of length along the axis (angle/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).
    cx : float or Field
        x of the centre (length, frozen unless released).
    cy : float or Field
        y of the centre (length, frozen unless released).
    cz : float or Field
        z of the centre (length, frozen unless released).

    Returns
    -------
    Field
    """
    return node("twist_about", f, rate=rate, axis=axis, cx=cx, cy=cy, cz=cz)


def bend_about(
    f: Operand, rate: Operand = 0.0, axis: int = 2, cx: Operand = 0.0, cy: Operand = 0.0, cz: Operand = 0.0
) -> Field:
    """The operand bent about an axis (Barr 1984).

    What lay along the line through the centre becomes an arc; see `bend`..

    F = f(c + b(p − c)), b the bend before which the arc was straight

    Parameters
    ----------
    f : Field or float
        Operand.
    rate : float or Field
        Curvature of the arc; 0: straight (angle/length).
    axis : int
        0: x, 1: y, 2: z (0 to 2).
    cx : float or Field
        x of the centre (length, frozen unless released).
    cy : float or Field
        y of the centre (length, frozen unless released).
    cz : float or Field
        z of the centre (length, frozen unless released).

    Returns
    -------
    Field
    """
    return node("bend_about", f, rate=rate, axis=axis, cx=cx, cy=cy, cz=cz)
