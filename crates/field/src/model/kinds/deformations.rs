//! Operators that move or deform the space of their operand: F at transformed coordinates.

use super::formulas::clamp;
use crate::model::kind::{Category, Kind, Operands, ParamSpec};
use crate::model::{Call, Lower};
use crate::{FieldError, Graph, Node};

const DEFORMATION: Kind =
    Kind { category: Category::Deformation, operands: Operands::Exactly(1), ..Kind::ROW };

const fn length(name: &'static str, default: f64, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, default, "length", doc)
}

const fn number(name: &'static str, default: f64, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, default, "", doc)
}

const fn angle(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, 0.0, "angle", doc)
}

pub(super) const AXIS: ParamSpec =
    ParamSpec::new("axis", 2.0, "index", "0: x, 1: y, 2: z.").within(0.0, 2.0).discrete();

/// The coordinates with `axis` last, the others in cyclic order.
pub(super) fn along(at: [Node; 3], axis: i64) -> [Node; 3] {
    let a = axis as usize;
    [at[(a + 1) % 3], at[(a + 2) % 3], at[a]]
}

/// Undoes [`along`].
pub(super) fn back(v: [Node; 3], axis: i64) -> [Node; 3] {
    let a = axis as usize;
    let mut at = v;
    at[(a + 1) % 3] = v[0];
    at[(a + 2) % 3] = v[1];
    at[a] = v[2];
    at
}

/// (x cos t + y sin t, y cos t − x sin t): the point turned by −t.
fn turned_back(g: &mut Graph, [x, y]: [Node; 2], t: Node) -> [Node; 2] {
    let (s, c) = (g.sin(t), g.cos(t));
    let (xc, ys, yc, xs) = (g.mul(x, c), g.mul(y, s), g.mul(y, c), g.mul(x, s));
    [g.add(xc, ys), g.sub(yc, xs)]
}

/// Rodrigues' formula for the angle −t about the axis n (of any length but 0).
fn rotate(l: &mut Lower, c: &Call) -> Result<Node, FieldError> {
    let g = &mut l.graph;
    let (t, n) = (c.p[0], &c.p[1..4]);
    let size = g.length(n);
    let n: Vec<Node> = n.iter().map(|&v| g.div(v, size)).collect();
    let (s, cos, one) = (g.sin(t), g.cos(t), g.constant(1.0));
    let rest = g.sub(one, cos);
    let dot = g.dot(&n, &c.at);
    let lift = g.mul(dot, rest);
    let at = [0, 1, 2].map(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (a, b) = (g.mul(c.at[i], n[j]), g.mul(c.at[j], n[i]));
        let cross = g.sub(a, b); // (p × n)ₖ = −(n × p)ₖ
        let (kept, turned, axial) = (g.mul(c.at[k], cos), g.mul(cross, s), g.mul(n[k], lift));
        let sum = g.add(kept, turned);
        g.add(sum, axial)
    });
    l.moved(c, at)
}

/// One coordinate repeated with period `p`, `count` times around 0 (without end where `count` is 0).
fn repeated(g: &mut Graph, v: Node, p: Node, count: i64) -> Node {
    let turns = g.div(v, p);
    let cell = if count == 0 {
        g.round(turns)
    } else {
        let shift = g.constant((count - 1) as f64 / 2.0);
        let (lo, hi) = (g.constant(0.0), g.constant((count - 1) as f64));
        let counted = g.add(turns, shift);
        let cell = g.round(counted);
        let cell = clamp(g, cell, lo, hi);
        g.sub(cell, shift)
    };
    let centre = g.mul(p, cell);
    g.sub(v, centre)
}

/// Barr's bend: the x axis becomes a circle of radius 1/k around (0, 1/k). The point before the bend is
/// (atan2(kx, 1 − ky)/k, (2y − k(x² + y²))/(1 + √((kx)² + (1 − ky)²))).
pub(super) fn bent(g: &mut Graph, at: [Node; 3], k: Node, axis: i64) -> [Node; 3] {
    let [x, y, z] = along(at, axis);
    let (one, two, small, least) = (g.constant(1.0), g.constant(2.0), g.constant(1e-2), g.constant(1e-3));
    let (kx, ky) = (g.mul(k, x), g.mul(k, y));
    let level = g.sub(one, ky);
    let (squared, radius) = (g.dot(&[x, y], &[x, y]), g.length(&[kx, level]));
    // Almost straight, k²(x² + y²) < .01: the angle is 2 atan(w), w = kx/(|(kx, 1 − ky)| + 1 − ky), and w/k and
    // atan(w)/w need no division by k; so k = 0 is no special place.
    let k_squared = g.square(k);
    let size = g.mul(k_squared, squared);
    let sum = g.add(radius, level);
    let sum = g.max(sum, least);
    let (w, straight) = (g.div(kx, sum), g.div(x, sum));
    let w_squared = g.square(w);
    let mut series = g.constant(1.0 / 13.0);
    for odd in [11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        let term = g.mul(w_squared, series);
        let first = g.constant(1.0 / odd);
        series = g.sub(first, term);
    }
    let near = g.mul(straight, series);
    let near = g.mul(two, near);
    let divisor = g.select(size, small, one, k);
    let turn = g.atan2(kx, level);
    let far = g.div(turn, divisor);
    let u = g.select(size, small, near, far);
    let (twice, sag, below) = (g.mul(two, y), g.mul(k, squared), g.add(one, radius));
    let above = g.sub(twice, sag);
    let v = g.div(above, below);
    back([u, v, z], axis)
}

/// The point turned back about the axis by `rate` times its height.
pub(super) fn twisted(g: &mut Graph, at: [Node; 3], rate: Node, axis: i64) -> [Node; 3] {
    let [x, y, z] = along(at, axis);
    let t = g.mul(rate, z);
    let [x, y] = turned_back(g, [x, y], t);
    back([x, y, z], axis)
}

/// The point drawn to the axis by the factor that belongs to its height.
pub(super) fn tapered(g: &mut Graph, at: [Node; 3], rate: Node, axis: i64) -> [Node; 3] {
    let [x, y, z] = along(at, axis);
    let (one, least) = (g.constant(1.0), g.constant(0.01));
    let grown = g.mul(rate, z);
    let s = g.add(one, grown);
    let s = g.max(s, least);
    let (x, y) = (g.div(x, s), g.div(y, s));
    back([x, y, z], axis)
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "translate",
        doc: "The operand moved by (x, y, z).",
        formula: "f(p − (x, y, z))",
        params: &[length("x", 0.0, "Along x."), length("y", 0.0, "Along y."), length("z", 0.0, "Along z.")],
        build: |l, c| {
            let at = [0, 1, 2].map(|k| l.graph.sub(c.at[k], c.p[k]));
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "rotate",
        doc: "The operand turned about an axis through the origin, counter-clockwise seen from its tip.",
        formula: "f(R⁻¹ p), R by Rodrigues' formula",
        params: &[
            angle("angle", "Radians."),
            number("ax", 0.0, "x of the axis.").frozen(),
            number("ay", 0.0, "y of the axis.").frozen(),
            number("az", 1.0, "z of the axis; its length does not matter.").frozen(),
        ],
        build: rotate,
        ..DEFORMATION
    },
    Kind {
        name: "rotate_euler",
        doc: "The operand turned about x, then y, then z.",
        formula: "f((Rz Ry Rx)⁻¹ p)",
        params: &[
            angle("x", "Radians about x, first."),
            angle("y", "Radians about y, second."),
            angle("z", "Radians about z, last."),
        ],
        build: |l, c| {
            let mut at = c.at;
            for axis in [2, 1, 0] {
                let [u, v, w] = along(at, axis);
                let [u, v] = turned_back(&mut l.graph, [u, v], c.p[axis as usize]);
                at = back([u, v, w], axis);
            }
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "scale",
        doc: "The operand made larger by a factor. Distances stay distances.",
        formula: "s f(p/s)",
        params: &[ParamSpec::length("s", 1.0, "Factor.")],
        build: |l, c| {
            let one = l.graph.constant(1.0);
            let inverse = l.graph.div(one, c.p[0]);
            let at = c.at.map(|v| l.graph.mul(v, inverse));
            let f = l.moved(c, at)?;
            Ok(l.graph.mul(c.p[0], f))
        },
        ..DEFORMATION
    },
    Kind {
        name: "scale_axes",
        doc: "The operand stretched by a factor for each axis. A distance no longer is one.",
        formula: "f(x/sx, y/sy, z/sz)",
        params: &[
            ParamSpec::length("sx", 1.0, "Factor along x."),
            ParamSpec::length("sy", 1.0, "Factor along y."),
            ParamSpec::length("sz", 1.0, "Factor along z."),
        ],
        build: |l, c| {
            let at = [0, 1, 2].map(|k| l.graph.div(c.at[k], c.p[k]));
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "mirror",
        doc: "The part of the operand on the side of a plane that the normal points to, and its mirror image.",
        formula: "f(p − 2 min(n·p/|n| − offset, 0) n/|n|)",
        params: &[
            number("nx", 1.0, "x of the normal.").frozen(),
            number("ny", 0.0, "y of the normal.").frozen(),
            number("nz", 0.0, "z of the normal; its length does not matter.").frozen(),
            length("offset", 0.0, "Distance of the plane from the origin."),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let size = g.length(&c.p[..3]);
            let n: Vec<Node> = c.p[..3].iter().map(|&v| g.div(v, size)).collect();
            let height = g.dot(&n, &c.at);
            let height = g.sub(height, c.p[3]);
            let (zero, two) = (g.constant(0.0), g.constant(2.0));
            let below = g.min(height, zero);
            let below = g.mul(two, below);
            let at = [0, 1, 2].map(|k| {
                let step = g.mul(below, n[k]);
                g.sub(c.at[k], step)
            });
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "repeat",
        doc: "Copies of the operand at regular distances, centred at the origin. The operand must fit into a cell, or \
              it is cut off at its borders.",
        formula: "f(p − period · cell(p))",
        params: &[
            length("px", 0.0, "Period along x; 0: not repeated.").within(0.0, f64::INFINITY).frozen(),
            length("py", 0.0, "Period along y; 0: not repeated.").within(0.0, f64::INFINITY).frozen(),
            length("pz", 0.0, "Period along z; 0: not repeated.").within(0.0, f64::INFINITY).frozen(),
            number("nx", 0.0, "Copies along x; 0: without end.").within(0.0, 1e6).discrete(),
            number("ny", 0.0, "Copies along y; 0: without end.").within(0.0, 1e6).discrete(),
            number("nz", 0.0, "Copies along z; 0: without end.").within(0.0, 1e6).discrete(),
        ],
        build: |l, c| {
            let at = [0, 1, 2].map(|k| {
                let period = &c.model.params()[k];
                if period.expr.is_none() && period.value == 0.0 {
                    return c.at[k];
                }
                repeated(&mut l.graph, c.at[k], c.p[k], c.discrete(3 + k))
            });
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "twist",
        doc: "The operand twisted about an axis.",
        formula: "f(x cos t + y sin t, y cos t − x sin t, z), t = rate · z",
        params: &[
            ParamSpec::new("rate", 1.0, "angle/length", "Radians per unit of length along the axis."),
            AXIS,
        ],
        build: |l, c| {
            let at = twisted(&mut l.graph, c.at, c.p[0], c.discrete(1));
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "bend",
        doc: "The operand bent (Barr 1984): what lay along x (y or z for axis 0 or 1) becomes an arc of radius 1/rate \
              that turns about the axis.",
        formula: "f(atan2(kx, 1 − ky)/k, 1/k − |(x, 1/k − y)|, z), k = rate",
        params: &[ParamSpec::new("rate", 0.5, "angle/length", "Curvature of the arc; 0: straight."), AXIS],
        build: |l, c| {
            let at = bent(&mut l.graph, c.at, c.p[0], c.discrete(1));
            l.moved(c, at)
        },
        ..DEFORMATION
    },
    Kind {
        name: "taper",
        doc: "The operand widened along an axis; the factor is never below 0.01.",
        formula: "f(x/s, y/s, z), s = max(1 + rate · z, 0.01)",
        params: &[ParamSpec::new("rate", 0.1, "1/length", "Change of the factor per unit of length."), AXIS],
        build: |l, c| {
            let at = tapered(&mut l.graph, c.at, c.p[0], c.discrete(1));
            l.moved(c, at)
        },
        ..DEFORMATION
    },
];
