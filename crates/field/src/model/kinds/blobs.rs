//! Sums of bumps: blobby spheres and cylinders, metaballs, Gaussian atoms.

use super::formulas::clamp;
use crate::model::kind::{Category, Kind, Layout, ParamSpec};
use crate::{Graph, Node};

const SHAPE: Kind = Kind { category: Category::Shape, layout: Layout::Groups, ..Kind::ROW };

const fn coordinate(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, 0.0, "length", doc)
}

const BIAS: ParamSpec = ParamSpec::new("bias", 0.5, "value", "What the sum must exceed to be inside.");

const BALL: &[ParamSpec] = &[
    coordinate("x", "x of the centre."),
    coordinate("y", "y of the centre."),
    coordinate("z", "z of the centre."),
    ParamSpec::length("r", 1.0, "Radius."),
];

/// |p − a|²
fn squared_distance(g: &mut Graph, at: [Node; 3], a: &[Node]) -> Node {
    let d: Vec<Node> = (0..3).map(|k| g.sub(at[k], a[k])).collect();
    g.dot(&d, &d)
}

/// Squared distance from the segment from a to b (also of length 0).
fn squared_distance_to_segment(g: &mut Graph, at: [Node; 3], a: &[Node], b: &[Node]) -> Node {
    let ab: Vec<Node> = (0..3).map(|k| g.sub(b[k], a[k])).collect();
    let ap: Vec<Node> = (0..3).map(|k| g.sub(at[k], a[k])).collect();
    let (zero, one, tiny) = (g.constant(0.0), g.constant(1.0), g.constant(1e-300));
    let (along, size) = (g.dot(&ap, &ab), g.dot(&ab, &ab));
    let size = g.max(size, tiny);
    let t = g.div(along, size);
    let t = clamp(g, t, zero, one);
    let d: Vec<Node> = (0..3)
        .map(|k| {
            let foot = g.mul(t, ab[k]);
            g.sub(ap[k], foot)
        })
        .collect();
    g.dot(&d, &d)
}

/// k/r²: once a model, not once a point.
fn rate(g: &mut Graph, k: Node, r: Node) -> Node {
    let r2 = g.square(r);
    g.div(k, r2)
}

/// exp(−d²/r²)
fn bump(g: &mut Graph, d2: Node, r: Node) -> Node {
    let minus = g.constant(-1.0);
    let rate = rate(g, minus, r);
    let u = g.mul(d2, rate);
    g.exp(u)
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "blobs",
        doc: "Blobby spheres (WH94): a bias, then centre and radius of each. A single blob of radius r has its \
              surface at r √(ln 1/bias) from its centre.",
        formula: "bias − Σ exp(−|p − cᵢ|²/rᵢ²)",
        params: &[BIAS],
        group: BALL,
        build: |l, c| {
            let g = &mut l.graph;
            let terms: Vec<Node> = c.p[1..]
                .chunks(4)
                .map(|q| {
                    let d2 = squared_distance(g, c.at, q);
                    bump(g, d2, q[3])
                })
                .collect();
            let sum = g.sum(&terms);
            Ok(g.sub(c.p[0], sum))
        },
        ..SHAPE
    },
    Kind {
        name: "blobby_cylinders",
        doc: "Blobby cylinders (WH94): a bias, then both ends and the radius of each.",
        formula: "bias − Σ exp(−dist(p, segment aᵢbᵢ)²/rᵢ²)",
        params: &[BIAS],
        group: &[
            coordinate("ax", "x of the first end."),
            coordinate("ay", "y of the first end."),
            coordinate("az", "z of the first end."),
            coordinate("bx", "x of the second end."),
            coordinate("by", "y of the second end."),
            coordinate("bz", "z of the second end."),
            ParamSpec::length("r", 1.0, "Radius."),
        ],
        build: |l, c| {
            let g = &mut l.graph;
            let terms: Vec<Node> = c.p[1..]
                .chunks(7)
                .map(|q| {
                    let d2 = squared_distance_to_segment(g, c.at, &q[..3], &q[3..6]);
                    bump(g, d2, q[6])
                })
                .collect();
            let sum = g.sum(&terms);
            Ok(g.sub(c.p[0], sum))
        },
        ..SHAPE
    },
    Kind {
        name: "metaballs",
        doc: "Bumps with compact support: each is exactly 0 beyond its radius. Twice continuously differentiable.",
        formula: "bias − Σ max(0, 1 − |p − cᵢ|²/rᵢ²)³",
        params: &[ParamSpec { default: 0.25, ..BIAS }],
        group: BALL,
        build: |l, c| {
            let g = &mut l.graph;
            let (zero, one, three) = (g.constant(0.0), g.constant(1.0), g.constant(3.0));
            let terms: Vec<Node> = c.p[1..]
                .chunks(4)
                .map(|q| {
                    let (d2, rate) = (squared_distance(g, c.at, q), rate(g, one, q[3]));
                    let u = g.mul(d2, rate);
                    let u = g.sub(one, u);
                    let u = g.max(u, zero);
                    g.pow(u, three)
                })
                .collect();
            let sum = g.sum(&terms);
            Ok(g.sub(c.p[0], sum))
        },
        ..SHAPE
    },
    Kind {
        name: "gaussians",
        doc: "Gaussian atoms: at iso = 1 a single atom has its surface exactly at its radius. The larger `sharpness` \
              is, the closer the surface is to the union of the balls.",
        formula: "iso − Σ exp(−sharpness (|p − cᵢ|²/rᵢ² − 1))",
        params: &[
            ParamSpec { name: "iso", default: 1.0, ..BIAS },
            ParamSpec::new("sharpness", 2.0, "", "How fast an atom fades.")
                .within(f64::MIN_POSITIVE, f64::INFINITY),
        ],
        group: BALL,
        build: |l, c| {
            let g = &mut l.graph;
            let terms: Vec<Node> = c.p[2..]
                .chunks(4)
                .map(|q| {
                    let (d2, rate) = (squared_distance(g, c.at, q), rate(g, c.p[1], q[3]));
                    let u = g.mul(d2, rate);
                    let u = g.sub(c.p[1], u);
                    g.exp(u)
                })
                .collect();
            let sum = g.sum(&terms);
            Ok(g.sub(c.p[0], sum))
        },
        ..SHAPE
    },
];
