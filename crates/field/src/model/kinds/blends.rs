//! Blends: HBJF02 eqs. 4 to 6 (corrected), any h(f, g), and smooth minima.

use crate::model::kind::{Category, Kind, Operands, ParamSpec, PayloadKind};
use crate::model::{Call, Lower, Payload};
use crate::{FieldError, Graph, Node};

const BLEND: Kind = Kind { category: Category::Operator, operands: Operands::Exactly(2), ..Kind::ROW };

const WIDTH: ParamSpec = ParamSpec::length("k", 0.1, "Width of the blend.");

/// −k ln Σ exp(−fᵢ/k), with the smallest f taken out of the exponentials so that they never overflow.
fn soft_min(g: &mut Graph, terms: &[Node], k: Node) -> Node {
    let (least, one) = (g.min_all(terms), g.constant(1.0));
    let rate = g.div(one, k);
    let parts: Vec<Node> = terms
        .iter()
        .map(|&f| {
            let d = g.sub(least, f);
            let u = g.mul(d, rate);
            g.exp(u)
        })
        .collect();
    let sum = g.sum(&parts);
    let log = g.ln(sum);
    let below = g.mul(k, log);
    g.sub(least, below)
}

/// min(f, g) − max(k − |f − g|, 0)²/(4k)
fn quadratic_min(g: &mut Graph, a: Node, b: Node, k: Node) -> Node {
    let (zero, quarter) = (g.constant(0.0), g.constant(0.25));
    let least = g.min(a, b);
    let apart = g.sub(a, b);
    let apart = g.abs(apart);
    let near = g.sub(k, apart);
    let near = g.max(near, zero);
    let (squared, scale) = (g.square(near), g.div(quarter, k));
    let below = g.mul(squared, scale);
    g.sub(least, below)
}

/// The negatives of the operands.
fn negated(l: &mut Lower, c: &Call) -> Result<Vec<Node>, FieldError> {
    let terms = l.operands(c)?;
    Ok(terms.iter().map(|&t| l.graph.neg(t)).collect())
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "smooth_union",
        doc: "A union with rounded seams: the logarithm of the sum of exponentials. Smooth, symmetric, of any number \
              of operands; where n of them are equal the surface moves out by k ln n.",
        formula: "−k ln Σ exp(−fᵢ/k)",
        params: &[WIDTH],
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let terms = l.operands(c)?;
            Ok(soft_min(&mut l.graph, &terms, c.p[0]))
        },
        ..BLEND
    },
    Kind {
        name: "smooth_intersection",
        doc: "An intersection with rounded seams; see smooth_union.",
        formula: "k ln Σ exp(fᵢ/k)",
        params: &[WIDTH],
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let terms = negated(l, c)?;
            let f = soft_min(&mut l.graph, &terms, c.p[0]);
            Ok(l.graph.neg(f))
        },
        ..BLEND
    },
    Kind {
        name: "smooth_difference",
        doc: "The first operand without all others, with rounded seams; see smooth_union.",
        formula: "k ln(exp(f/k) + Σ exp(−gᵢ/k))",
        params: &[WIDTH],
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let mut terms = l.operands(c)?;
            terms[0] = l.graph.neg(terms[0]);
            let f = soft_min(&mut l.graph, &terms, c.p[0]);
            Ok(l.graph.neg(f))
        },
        ..BLEND
    },
    Kind {
        name: "quadratic_union",
        doc: "A union with rounded seams: the quadratic smooth minimum, exactly the union where the operands differ \
              by more than k. Once continuously differentiable; more than two operands are joined in order.",
        formula: "min(f, g) − max(k − |f − g|, 0)²/(4k)",
        params: &[WIDTH],
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let terms = l.operands(c)?;
            Ok(terms[1..].iter().fold(terms[0], |a, &b| quadratic_min(&mut l.graph, a, b, c.p[0])))
        },
        ..BLEND
    },
    Kind {
        name: "blobby_blend",
        doc: "The blobby blend of two operands (HBJF02 eq. 4).",
        formula: "T − exp(−f − a) − exp(−g − b)",
        params: &[
            ParamSpec::new("T", 1.0, "value", "What the sum must exceed to be inside."),
            ParamSpec::new("a", 0.0, "value", "How much the first operand shrinks."),
            ParamSpec::new("b", 0.0, "value", "How much the second operand shrinks."),
        ],
        build: |l, c| {
            let mut h = c.p[0];
            for i in 0..2 {
                let f = l.operand(c, i)?;
                let g = &mut l.graph;
                let f = g.add(f, c.p[1 + i]);
                let f = g.neg(f);
                let e = g.exp(f);
                h = g.sub(h, e);
            }
            Ok(h)
        },
        ..BLEND
    },
    Kind {
        name: "superelliptic_blend",
        doc: "The superelliptic blend of two operands (HBJF02 eq. 5, corrected: as printed it is inside out and \
              closed). A union whose seam is filled within the distances a and b.",
        formula: "1 − max(0, 1 − f/a)^d − max(0, 1 − g/b)^d",
        params: &[
            ParamSpec::new("a", 0.5, "value", "How far the blend reaches from the first operand.")
                .within(f64::MIN_POSITIVE, f64::INFINITY),
            ParamSpec::new("b", 0.5, "value", "How far the blend reaches from the second operand.")
                .within(f64::MIN_POSITIVE, f64::INFINITY),
            ParamSpec::new("d", 2.0, "", "Degree: the larger, the sharper the seam.")
                .within(2.0, 64.0)
                .discrete(),
        ],
        build: |l, c| {
            let mut h = l.graph.constant(1.0);
            for i in 0..2 {
                let f = l.operand(c, i)?;
                let g = &mut l.graph;
                let (zero, one) = (g.constant(0.0), g.constant(1.0));
                let f = g.div(f, c.p[i]);
                let f = g.sub(one, f);
                let f = g.max(f, zero);
                let part = g.pow(f, c.p[2]);
                h = g.sub(h, part);
            }
            Ok(h)
        },
        ..BLEND
    },
    Kind {
        name: "r_blend",
        doc: "An R-function of two operands (HBJF02 eq. 6). With F < 0 inside s = 1 is the intersection and s = −1 the \
              union. The derivative at f = g = 0 is defined as that of f + g for d = 0; for d above 0 it is 0 there, \
              along the whole crease.",
        formula: "(f + g + s √(f² + g²)) (f² + g²)^(d/2)",
        params: &[
            ParamSpec::new("s", -1.0, "", "1: intersection; −1: union.").within(-1.0, 1.0).discrete(),
            ParamSpec::new("d", 0.0, "", "Degree of smoothness at the crease.").within(0.0, 16.0).discrete(),
        ],
        build: |l, c| {
            if c.discrete(0) == 0 {
                return Err(FieldError::Invalid(
                    "r_blend: s must be 1 (intersection) or -1 (union), given 0".into(),
                ));
            }
            let (f, h) = (l.operand(c, 0)?, l.operand(c, 1)?);
            let g = &mut l.graph;
            let size = g.length(&[f, h]);
            let (sum, signed) = (g.add(f, h), g.mul(c.p[0], size));
            let base = g.add(sum, signed);
            let factor = g.pow(size, c.p[1]);
            Ok(g.mul(base, factor))
        },
        ..BLEND
    },
    Kind {
        name: "blend",
        doc: "A blend of two operands by any expression h in f and g, such as h=f + g - sqrt(f^2 + g^2). Parameters in \
              h count as the blend's own.",
        formula: "h(f, g)",
        payload: PayloadKind::Expression,
        build: |l, c| {
            let zero = l.graph.constant(0.0);
            let at = [l.operand(c, 0)?, l.operand(c, 1)?, zero];
            match c.model.payload() {
                Payload::Expression(h) => l.model(h, at),
                _ => unreachable!("checked when the node was made"),
            }
        },
        ..BLEND
    },
];
