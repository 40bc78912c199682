//! Triply periodic surfaces, in the usual trigonometric approximations of the minimal surfaces.

use crate::model::kind::{Category, Kind, ParamSpec};
use crate::{Graph, Node};

const PARAMS: &[ParamSpec] = &[
    ParamSpec::length("period", 1.0, "Side of the cubic cell."),
    ParamSpec::new("level", 0.0, "value", "Shifts the surface: above 0 the inside grows."),
];

/// sin and cos of X = 2πx/period, Y and Z, and the constants for the rest.
struct Waves {
    s: [Node; 3],
    c: [Node; 3],
    phase: [Node; 3],
}

impl Waves {
    fn twice(&self, g: &mut Graph) -> ([Node; 3], [Node; 3]) {
        let two = g.constant(2.0);
        let double = self.phase.map(|p| g.mul(two, p));
        (double.map(|p| g.sin(p)), double.map(|p| g.cos(p)))
    }
}

fn product(g: &mut Graph, factors: &[Node]) -> Node {
    factors[1..].iter().fold(factors[0], |a, &b| g.mul(a, b))
}

fn scaled(g: &mut Graph, k: f64, a: Node) -> Node {
    let k = g.constant(k);
    g.mul(k, a)
}

/// A row whose F is an expression of the waves, minus the level.
macro_rules! lattice {
    ($name:literal, $doc:literal, $formula:literal, |$g:ident, $w:ident| $body:expr) => {
        Kind {
            name: $name,
            category: Category::Shape,
            doc: $doc,
            formula: $formula,
            params: PARAMS,
            build: |l, call| {
                let $g = &mut l.graph;
                let turn = $g.constant(2.0 * std::f64::consts::PI);
                let rate = $g.div(turn, call.p[0]);
                let phase = call.at.map(|v| $g.mul(rate, v));
                let $w = Waves { s: phase.map(|p| $g.sin(p)), c: phase.map(|p| $g.cos(p)), phase };
                let f = $body;
                Ok($g.sub(f, call.p[1]))
            },
            ..Kind::ROW
        }
    };
}

/// The sum over the three cyclic shifts of the axes of a product of three factors.
fn cyclic(g: &mut Graph, a: &[Node; 3], b: &[Node; 3], c: Option<&[Node; 3]>) -> Node {
    let terms: Vec<Node> = (0..3)
        .map(|k| {
            let ab = g.mul(a[k], b[(k + 1) % 3]);
            c.map_or(ab, |c| g.mul(ab, c[(k + 2) % 3]))
        })
        .collect();
    g.sum(&terms)
}

pub const KINDS: &[Kind] = &[
    lattice!(
        "gyroid",
        "Schoen's gyroid.",
        "sin X cos Y + sin Y cos Z + sin Z cos X − level; X = 2πx/period",
        |g, w| { cyclic(g, &w.s, &w.c, None) }
    ),
    lattice!(
        "schwarz_p",
        "Schwarz' primitive surface.",
        "cos X + cos Y + cos Z − level; X = 2πx/period",
        |g, w| { g.sum(&w.c) }
    ),
    lattice!(
        "schwarz_d",
        "Schwarz' diamond surface.",
        "sin X sin Y sin Z + sin X cos Y cos Z + cos X sin Y cos Z + cos X cos Y sin Z − level; X = 2πx/period",
        |g, w| {
            let (rest, all) = (cyclic(g, &w.s, &w.c, Some(&w.c)), product(g, &w.s));
            g.add(all, rest)
        }
    ),
    lattice!(
        "neovius",
        "Neovius' surface.",
        "3 (cos X + cos Y + cos Z) + 4 cos X cos Y cos Z − level; X = 2πx/period",
        |g, w| {
            let (sum, all) = (g.sum(&w.c), product(g, &w.c));
            let (sum, all) = (scaled(g, 3.0, sum), scaled(g, 4.0, all));
            g.add(sum, all)
        }
    ),
    lattice!(
        "lidinoid",
        "Lidin's lidinoid.",
        "(sin 2X cos Y sin Z + sin 2Y cos Z sin X + sin 2Z cos X sin Y)/2 \
         − (cos 2X cos 2Y + cos 2Y cos 2Z + cos 2Z cos 2X)/2 + 0.15 − level; X = 2πx/period",
        |g, w| {
            let (s2, c2) = w.twice(g);
            let first = cyclic(g, &s2, &w.c, Some(&w.s));
            let second = cyclic(g, &c2, &c2, None);
            let d = g.sub(first, second);
            let (d, shift) = (scaled(g, 0.5, d), g.constant(0.15));
            g.add(d, shift)
        }
    ),
    lattice!(
        "iwp",
        "Schoen's I-WP surface.",
        "2 (cos X cos Y + cos Y cos Z + cos Z cos X) − cos 2X − cos 2Y − cos 2Z − level; X = 2πx/period",
        |g, w| {
            let (_, c2) = w.twice(g);
            let pairs = cyclic(g, &w.c, &w.c, None);
            let (pairs, doubles) = (scaled(g, 2.0, pairs), g.sum(&c2));
            g.sub(pairs, doubles)
        }
    ),
];
