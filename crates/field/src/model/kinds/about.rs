//! Deformations about a centre that do nothing at their defaults: what adapters are made of (HBJF02 section 5).

use super::deformations::{AXIS, bent, tapered, twisted};
use super::formulas::clamp;
use crate::model::kind::{Category, Kind, Layout, Operands, ParamSpec};
use crate::model::{Call, Lower};
use crate::{FieldError, Graph, Node};

const DEFORMATION: Kind =
    Kind { category: Category::Deformation, operands: Operands::Exactly(1), ..Kind::ROW };

const CX: ParamSpec = ParamSpec::new("cx", 0.0, "length", "x of the centre.").frozen();
const CY: ParamSpec = ParamSpec::new("cy", 0.0, "length", "y of the centre.").frozen();
const CZ: ParamSpec = ParamSpec::new("cz", 0.0, "length", "z of the centre.").frozen();

const fn angle(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, 0.0, "angle", doc)
}

const fn corner(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, -1.0, "length", doc).frozen()
}

const fn extent(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::length(name, 2.0, doc).frozen()
}

const fn count(name: &'static str, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, 3.0, "index", doc).within(2.0, MOST as f64).discrete()
}

/// Largest number of control points along an axis.
const MOST: usize = 8;

/// The operand at centre + map(p − centre); parameter `first` and the next two are the centre.
fn about(
    l: &mut Lower,
    c: &Call,
    first: usize,
    map: impl FnOnce(&mut Graph, [Node; 3]) -> [Node; 3],
) -> Result<Node, FieldError> {
    let g = &mut l.graph;
    let centre = [c.p[first], c.p[first + 1], c.p[first + 2]];
    let offset = [0, 1, 2].map(|k| g.sub(c.at[k], centre[k]));
    let moved = map(g, offset);
    let at = [0, 1, 2].map(|k| g.add(centre[k], moved[k]));
    l.moved(c, at)
}

/// sin(t)/t for `square` = t²: smooth at 0, and so are its derivatives.
fn sinc(g: &mut Graph, square: Node) -> Node {
    let (small, one) = (g.constant(1e-2), g.constant(1.0));
    let safe = g.max(square, small);
    let t = g.sqrt(safe);
    let sine = g.sin(t);
    let far = g.div(sine, t);
    // 1 − u/6 (1 − u/20 (1 − …)): exact to rounding for t below .1.
    let mut near = one;
    for k in [110.0, 72.0, 42.0, 20.0, 6.0] {
        let k = g.constant(k);
        let part = g.div(square, k);
        let term = g.mul(part, near);
        near = g.sub(one, term);
    }
    g.select(square, small, near, far)
}

/// The offset d turned by −|w| about w, by Rodrigues' formula in terms that are smooth at w = 0:
/// d cos t + (d × w) sin(t)/t + w (w·d) (1 − cos t)/t², t = |w|.
fn turned_back(g: &mut Graph, d: [Node; 3], w: &[Node]) -> [Node; 3] {
    let (half, quarter, one) = (g.constant(0.5), g.constant(0.25), g.constant(1.0));
    let square = g.dot(w, w);
    let s = sinc(g, square);
    let square_half = g.mul(quarter, square);
    let s_half = sinc(g, square_half);
    // (1 − cos t)/t² = ½ (sin(t/2)/(t/2))²
    let s_half = g.square(s_half);
    let versine = g.mul(half, s_half);
    let drop = g.mul(square, versine);
    let cosine = g.sub(one, drop);
    let along = g.dot(w, &d);
    let lift = g.mul(along, versine);
    [0, 1, 2].map(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (a, b) = (g.mul(d[i], w[j]), g.mul(d[j], w[i]));
        let cross = g.sub(a, b);
        let (kept, turned, axial) = (g.mul(d[k], cosine), g.mul(cross, s), g.mul(w[k], lift));
        let sum = g.add(kept, turned);
        g.add(sum, axial)
    })
}

/// The Bernstein polynomials of degree n − 1 at u: C(n − 1, i) uⁱ (1 − u)ⁿ⁻¹⁻ⁱ.
fn bernstein(g: &mut Graph, u: Node, n: usize) -> Vec<Node> {
    let one = g.constant(1.0);
    let v = g.sub(one, u);
    let (mut up, mut down) = (vec![one], vec![one]);
    for i in 1..n {
        up.push(g.mul(up[i - 1], u));
        down.push(g.mul(down[i - 1], v));
    }
    let mut choose = 1.0;
    (0..n)
        .map(|i| {
            let b = g.mul(up[i], down[n - 1 - i]);
            let c = g.constant(choose);
            choose = choose * (n - 1 - i) as f64 / (i + 1) as f64;
            g.mul(c, b)
        })
        .collect()
}

fn free_form(l: &mut Lower, c: &Call) -> Result<Node, FieldError> {
    let n = [0, 1, 2].map(|k| c.discrete(6 + k) as usize);
    let given = (c.p.len() - 9) / 3;
    let all: usize = n.iter().product();
    if given > all {
        return Err(FieldError::Invalid(format!(
            "free_form: expected at most nx · ny · nz = {all} displacements, given {given}"
        )));
    }
    let g = &mut l.graph;
    let (zero, one) = (g.constant(0.0), g.constant(1.0));
    let weights = [0, 1, 2].map(|k| {
        let from = g.sub(c.at[k], c.p[k]);
        let u = g.div(from, c.p[3 + k]);
        let u = clamp(g, u, zero, one);
        bernstein(g, u, n[k])
    });
    // Sums along x, then y, then z.
    let at = [0, 1, 2].map(|a| {
        let mut sheets = Vec::new();
        for k in 0..n[2] {
            let mut rows = Vec::new();
            for j in 0..n[1] {
                let first = n[0] * (j + n[1] * k);
                let terms: Vec<Node> = (first..given.min(first + n[0]))
                    .map(|i| g.mul(weights[0][i - first], c.p[9 + 3 * i + a]))
                    .collect();
                if !terms.is_empty() {
                    let row = g.sum(&terms);
                    rows.push(g.mul(weights[1][j], row));
                }
            }
            if !rows.is_empty() {
                let sheet = g.sum(&rows);
                sheets.push(g.mul(weights[2][k], sheet));
            }
        }
        let shift = if sheets.is_empty() { zero } else { g.sum(&sheets) };
        g.sub(c.at[a], shift)
    });
    l.moved(c, at)
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "rotate_about",
        doc: "The operand turned about a centre by a rotation vector: its direction is the axis, its length the angle, \
              counter-clockwise seen from its tip. Smooth at zero.",
        formula: "f(c + R⁻¹ (p − c)), R by Rodrigues' formula",
        params: &[
            angle("rx", "x of the rotation vector, in radians."),
            angle("ry", "y of the rotation vector, in radians."),
            angle("rz", "z of the rotation vector, in radians."),
            CX,
            CY,
            CZ,
        ],
        build: |l, c| about(l, c, 3, |g, d| turned_back(g, d, &c.p[..3])),
        ..DEFORMATION
    },
    Kind {
        name: "scale_about",
        doc: "The operand stretched about a centre by a factor for each axis. A distance no longer is one.",
        formula: "f(c + ((x − cx)/sx, (y − cy)/sy, (z − cz)/sz))",
        params: &[
            ParamSpec::length("sx", 1.0, "Factor along x."),
            ParamSpec::length("sy", 1.0, "Factor along y."),
            ParamSpec::length("sz", 1.0, "Factor along z."),
            CX,
            CY,
            CZ,
        ],
        build: |l, c| about(l, c, 3, |g, d| [0, 1, 2].map(|k| g.div(d[k], c.p[k]))),
        ..DEFORMATION
    },
    Kind {
        name: "taper_about",
        doc: "The operand widened along an axis through a centre; the factor is 1 at the centre and never below 0.01.",
        formula: "f(c + ((x − cx)/s, (y − cy)/s, z − cz)), s = max(1 + rate (z − cz), 0.01)",
        params: &[
            ParamSpec::new("rate", 0.0, "1/length", "Change of the factor per unit of length."),
            AXIS,
            CX,
            CY,
            CZ,
        ],
        build: |l, c| about(l, c, 2, |g, d| tapered(g, d, c.p[0], c.discrete(1))),
        ..DEFORMATION
    },
    Kind {
        name: "twist_about",
        doc: "The operand twisted about an axis through a centre, which stays.",
        formula: "f(c + R⁻¹ (p − c)), R a turn about the axis by rate (z − cz)",
        params: &[
            ParamSpec::new("rate", 0.0, "angle/length", "Radians per unit of length along the axis."),
            AXIS,
            CX,
            CY,
            CZ,
        ],
        build: |l, c| about(l, c, 2, |g, d| twisted(g, d, c.p[0], c.discrete(1))),
        ..DEFORMATION
    },
    Kind {
        name: "bend_about",
        doc: "The operand bent about an axis (Barr 1984): what lay along the line through the centre becomes an arc; see \
              `bend`.",
        formula: "f(c + b(p − c)), b the bend before which the arc was straight",
        params: &[
            ParamSpec::new("rate", 0.0, "angle/length", "Curvature of the arc; 0: straight."),
            AXIS,
            CX,
            CY,
            CZ,
        ],
        build: |l, c| about(l, c, 2, |g, d| bent(g, d, c.p[0], c.discrete(1))),
        ..DEFORMATION
    },
    Kind {
        name: "free_form",
        doc: "The operand deformed freely by a lattice of control points in a box, each with a displacement (after Sederberg and \
              Parry 1986). It is the inverse deformation that is written down, p − d(p): exact for the whole lattice moved as one, close to the \
              forward deformation where displacements change slowly. Outside of the box the displacement is that of the nearest point of \
              the box. Displacements come with x fastest, z slowest; those that are not given are 0.",
        formula: "f(p − Σ Bᵢ(u) Bⱼ(v) Bₖ(w) dᵢⱼₖ), B Bernstein polynomials, (u, v, w) = (p − corner)/size in the box",
        params: &[
            corner("x0", "x of the box's lowest corner."),
            corner("y0", "y of the box's lowest corner."),
            corner("z0", "z of the box's lowest corner."),
            extent("sx", "Size of the box along x."),
            extent("sy", "Size of the box along y."),
            extent("sz", "Size of the box along z."),
            count("nx", "Control points along x."),
            count("ny", "Control points along y."),
            count("nz", "Control points along z."),
        ],
        group: &[
            ParamSpec::new("dx", 0.0, "length", "x of the displacement."),
            ParamSpec::new("dy", 0.0, "length", "y of the displacement."),
            ParamSpec::new("dz", 0.0, "length", "z of the displacement."),
        ],
        layout: Layout::Groups,
        build: free_form,
        ..DEFORMATION
    },
];
