//! Shapes around the origin. F is the signed distance where the formula says so.

use super::formulas::clamp;
use crate::model::kind::{Category, Kind, ParamSpec};
use crate::{Graph, Node};

const SHAPE: Kind = Kind { category: Category::Shape, ..Kind::ROW };

const fn any(name: &'static str, default: f64, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, default, "length", doc)
}

/// |v| − s/2 for each coordinate.
fn beyond(g: &mut Graph, v: Node, side: Node) -> Node {
    let half = g.constant(0.5);
    let (size, half) = (g.abs(v), g.mul(half, side));
    g.sub(size, half)
}

/// Signed distance to the corner region where all of `q` are ≤ 0. On a face the gradient is exactly the
/// face's normal: inside and on the surface the largest of q counts alone.
fn corner(g: &mut Graph, q: &[Node]) -> Node {
    let zero = g.constant(0.0);
    let inside = g.max_all(q);
    let outside: Vec<Node> = q.iter().map(|&v| g.max(v, zero)).collect();
    let outside = g.length(&outside);
    g.select(zero, inside, outside, inside)
}

/// (u² + 10⁻⁶⁰)^e, with a finite derivative at u = 0 for every e > 0.
fn even_power(g: &mut Graph, u: Node, e: Node) -> Node {
    let (squared, tiny) = (g.square(u), g.constant(1e-60));
    let size = g.add(squared, tiny);
    g.pow(size, e)
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "sphere",
        doc: "A ball of radius r. Exact distance.",
        formula: "|p| − r",
        params: &[ParamSpec::length("r", 1.0, "Radius.")],
        build: |l, c| {
            let size = l.graph.length(&c.at);
            Ok(l.graph.sub(size, c.p[0]))
        },
        ..SHAPE
    },
    Kind {
        name: "ellipsoid",
        doc: "An ellipsoid with the given semi-axes. Not a distance: F grows by 1 from the surface to its double.",
        formula: "|(x/rx, y/ry, z/rz)| − 1",
        params: &[
            ParamSpec::length("rx", 1.0, "Semi-axis along x."),
            ParamSpec::length("ry", 1.0, "Semi-axis along y."),
            ParamSpec::length("rz", 1.0, "Semi-axis along z."),
        ],
        build: |l, c| {
            let u: Vec<Node> = (0..3).map(|k| l.graph.div(c.at[k], c.p[k])).collect();
            let (size, one) = (l.graph.length(&u), l.graph.constant(1.0));
            Ok(l.graph.sub(size, one))
        },
        ..SHAPE
    },
    Kind {
        name: "box",
        doc: "A box with full side lengths x, y and z: box(2, 1, 1) reaches from −1 to 1 along x. Exact distance.",
        formula: "|max(q, 0)| outside, max(qx, qy, qz) inside; q = |p| − (x, y, z)/2",
        params: &[
            ParamSpec::length("x", 1.0, "Full side length along x."),
            ParamSpec::length("y", 1.0, "Full side length along y."),
            ParamSpec::length("z", 1.0, "Full side length along z."),
        ],
        build: |l, c| {
            let q: Vec<Node> = (0..3).map(|k| beyond(&mut l.graph, c.at[k], c.p[k])).collect();
            Ok(corner(&mut l.graph, &q))
        },
        ..SHAPE
    },
    Kind {
        name: "rounded_box",
        doc: "A box with full side lengths x, y and z whose edges are rounded with radius r. Exact distance.",
        formula: "|max(q, 0)| − r outside, max(qx, qy, qz) − r inside; q = |p| − (x, y, z)/2 + r",
        params: &[
            ParamSpec::length("x", 1.0, "Full side length along x."),
            ParamSpec::length("y", 1.0, "Full side length along y."),
            ParamSpec::length("z", 1.0, "Full side length along z."),
            any("r", 0.1, "Radius of the edges, at most half the shortest side.").within(0.0, f64::INFINITY),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let q: Vec<Node> = (0..3)
                .map(|k| {
                    let q = beyond(g, c.at[k], c.p[k]);
                    g.add(q, c.p[3])
                })
                .collect();
            let f = corner(g, &q);
            Ok(g.sub(f, c.p[3]))
        },
        ..SHAPE
    },
    Kind {
        name: "torus",
        doc: "A torus around the z axis. Exact distance.",
        formula: "|(|(x, y)| − major, z)| − minor",
        params: &[
            ParamSpec::length("major", 1.0, "Radius of the circle in the middle of the tube."),
            ParamSpec::length("minor", 0.25, "Radius of the tube."),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let rho = g.length(&c.at[..2]);
            let u = g.sub(rho, c.p[0]);
            let d = g.length(&[u, c.at[2]]);
            Ok(g.sub(d, c.p[1]))
        },
        ..SHAPE
    },
    Kind {
        name: "cylinder",
        doc: "A capped cylinder along z, centred at the origin. Exact distance.",
        formula: "|max(q, 0)| outside, max(qr, qz) inside; q = (|(x, y)| − r, |z| − h/2)",
        params: &[ParamSpec::length("r", 1.0, "Radius."), ParamSpec::length("h", 2.0, "Full height.")],
        build: |l, c| {
            let g = &mut l.graph;
            let rho = g.length(&c.at[..2]);
            let q = [g.sub(rho, c.p[0]), beyond(g, c.at[2], c.p[1])];
            Ok(corner(g, &q))
        },
        ..SHAPE
    },
    Kind {
        name: "capsule",
        doc: "All points within r of a segment along z, centred at the origin. Exact distance.",
        formula: "|(x, y, z − clamp(z, −h/2, h/2))| − r",
        params: &[
            ParamSpec::length("r", 0.5, "Radius."),
            any("h", 1.0, "Length of the segment, without the round ends.").within(0.0, f64::INFINITY),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let half = g.constant(0.5);
            let hi = g.mul(half, c.p[1]);
            let lo = g.neg(hi);
            let near = clamp(g, c.at[2], lo, hi);
            let w = g.sub(c.at[2], near);
            let d = g.length(&[c.at[0], c.at[1], w]);
            Ok(g.sub(d, c.p[0]))
        },
        ..SHAPE
    },
    Kind {
        name: "cone",
        doc: "A capped cone along z, centred at the origin; r2 = 0 gives a tip. The distance inside and next to the \
              faces; less than it beyond the edges.",
        formula: "max((|(x, y)| − r1 − (r2 − r1)(z/h + 1/2)) h/√(h² + (r1 − r2)²), |z| − h/2)",
        params: &[
            any("r1", 1.0, "Radius at z = −h/2.").within(0.0, f64::INFINITY),
            any("r2", 0.0, "Radius at z = h/2.").within(0.0, f64::INFINITY),
            ParamSpec::length("h", 2.0, "Full height."),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let [r1, r2, h] = [c.p[0], c.p[1], c.p[2]];
            let (rho, half) = (g.length(&c.at[..2]), g.constant(0.5));
            let (rise, up) = (g.sub(r2, r1), g.div(c.at[2], h));
            let t = g.add(up, half);
            let widening = g.mul(rise, t);
            let radius = g.add(r1, widening);
            let (over, slant) = (g.sub(rho, radius), g.length(&[h, rise]));
            let cosine = g.div(h, slant);
            let (side, cap) = (g.mul(over, cosine), beyond(g, c.at[2], h));
            Ok(g.max(side, cap))
        },
        ..SHAPE
    },
    Kind {
        name: "plane",
        aliases: &["half_space"],
        doc: "The half-space on the side of a plane that its normal points away from. Exact distance. The normal \
              need not have length 1, but not length 0.",
        formula: "n·p/|n| − offset",
        params: &[
            ParamSpec::new("nx", 0.0, "", "x of the normal."),
            ParamSpec::new("ny", 0.0, "", "y of the normal."),
            ParamSpec::new("nz", 1.0, "", "z of the normal."),
            any("offset", 0.0, "Distance of the plane from the origin, along the normal."),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let n = &c.p[..3];
            let (along, size) = (g.dot(n, &c.at), g.length(n));
            let d = g.div(along, size);
            Ok(g.sub(d, c.p[3]))
        },
        ..SHAPE
    },
    Kind {
        name: "superquadric",
        aliases: &["superellipsoid"],
        doc: "A superquadric: 1, 1 is an ellipsoid; towards 0 it becomes a box, at 2 a double pyramid. F grows by 1 \
              from the surface to its double.",
        formula: "((|x/rx|^(2/e2) + |y/ry|^(2/e2))^(e2/e1) + |z/rz|^(2/e1))^(e1/2) − 1",
        params: &[
            ParamSpec::length("rx", 1.0, "Semi-axis along x."),
            ParamSpec::length("ry", 1.0, "Semi-axis along y."),
            ParamSpec::length("rz", 1.0, "Semi-axis along z."),
            ParamSpec::new("e1", 0.5, "", "Exponent from pole to pole.").within(0.02, 4.0),
            ParamSpec::new("e2", 0.5, "", "Exponent around the z axis.").within(0.02, 4.0),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let (one, half) = (g.constant(1.0), g.constant(0.5));
            let u: Vec<Node> = (0..3).map(|k| g.div(c.at[k], c.p[k])).collect();
            let (e1, e2) = (c.p[3], c.p[4]);
            let (inverse1, inverse2, ratio) = (g.div(one, e1), g.div(one, e2), g.div(e2, e1));
            let (px, py) = (even_power(g, u[0], inverse2), even_power(g, u[1], inverse2));
            let around = g.add(px, py);
            let around = g.pow(around, ratio);
            let along = even_power(g, u[2], inverse1);
            let (sum, outer) = (g.add(around, along), g.mul(half, e1));
            let size = g.pow(sum, outer);
            Ok(g.sub(size, one))
        },
        ..SHAPE
    },
];
