//! Algebraic surfaces.

use super::monomials;
use crate::model::Payload;
use crate::model::kind::{Category, Kind, Layout, ParamSpec, PayloadKind};
use crate::{Graph, Node};

const SHAPE: Kind = Kind { category: Category::Shape, ..Kind::ROW };

const fn q(name: &'static str, default: f64, doc: &'static str) -> ParamSpec {
    ParamSpec::new(name, default, "", doc)
}

/// Σ cₖ x^i y^j z^k
fn polynomial(g: &mut Graph, at: [Node; 3], exponents: &[[u8; 3]], coefficients: &[Node]) -> Node {
    let terms: Vec<Node> = exponents
        .iter()
        .zip(coefficients)
        .map(|(e, &c)| {
            let mut monomial = g.constant(1.0);
            for (k, &power) in e.iter().enumerate() {
                let power = g.constant(power as f64);
                let factor = g.pow(at[k], power);
                monomial = g.mul(monomial, factor);
            }
            g.mul(c, monomial)
        })
        .collect();
    g.sum(&terms)
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "algebraic",
        doc: "A polynomial of any degree with a parameter for each monomial: by degree, then x², xy, y², xz, yz, \
              z² (HBJF02 eq. 9, corrected). Name coefficients by their exponents, or give the degree, or all \
              coefficients in order.",
        formula: "Σ c_xiyjzk xⁱ yʲ zᵏ",
        layout: Layout::Monomials,
        payload: PayloadKind::Exponents,
        build: |l, c| match c.model.payload() {
            Payload::Exponents(e) => Ok(polynomial(&mut l.graph, c.at, e, &c.p)),
            _ => unreachable!("checked when the node was made"),
        },
        ..SHAPE
    },
    Kind {
        name: "quadric",
        doc: "A surface of second degree with its ten coefficients (HBJF02 eq. 9, corrected). By default the unit \
              sphere.",
        formula: "q0 + q1 x + q2 y + q3 z + q4 x² + q5 xy + q6 y² + q7 xz + q8 yz + q9 z²",
        params: &[
            q("q0", -1.0, "The constant."),
            q("q1", 0.0, "Coefficient of x."),
            q("q2", 0.0, "Coefficient of y."),
            q("q3", 0.0, "Coefficient of z."),
            q("q4", 1.0, "Coefficient of x²."),
            q("q5", 0.0, "Coefficient of xy."),
            q("q6", 1.0, "Coefficient of y²."),
            q("q7", 0.0, "Coefficient of xz."),
            q("q8", 0.0, "Coefficient of yz."),
            q("q9", 1.0, "Coefficient of z²."),
        ],
        build: |l, c| Ok(polynomial(&mut l.graph, c.at, &monomials(2), &c.p)),
        ..SHAPE
    },
];
