//! Set operations, offsets and shells.

use crate::model::kind::{Category, Kind, Operands, ParamSpec};

const OPERATOR: Kind = Kind { category: Category::Operator, operands: Operands::Exactly(1), ..Kind::ROW };

/// The kind of a node that takes its operand out of what is above.
pub const HIDDEN: &str = "hidden";

pub const KINDS: &[Kind] = &[
    Kind {
        name: "union",
        doc: "What is inside any of the operands.",
        formula: "min(f, g, …)",
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let terms = l.operands(c)?;
            Ok(l.graph.min_all(&terms))
        },
        ..OPERATOR
    },
    Kind {
        name: "intersection",
        doc: "What is inside all of the operands.",
        formula: "max(f, g, …)",
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let terms = l.operands(c)?;
            Ok(l.graph.max_all(&terms))
        },
        ..OPERATOR
    },
    Kind {
        name: "difference",
        doc: "What is inside the first operand and outside all others.",
        formula: "max(f, −g, …)",
        operands: Operands::AtLeast(1),
        build: |l, c| {
            let mut terms = l.operands(c)?;
            for t in &mut terms[1..] {
                *t = l.graph.neg(*t);
            }
            Ok(l.graph.max_all(&terms))
        },
        ..OPERATOR
    },
    Kind {
        name: "complement",
        doc: "Inside and outside exchanged.",
        formula: "−f",
        build: |l, c| {
            let f = l.operand(c, 0)?;
            Ok(l.graph.neg(f))
        },
        ..OPERATOR
    },
    Kind {
        name: "offset",
        doc: "Grown by a distance d (shrunk where d < 0), as far as the operand is a distance.",
        formula: "f − d",
        params: &[ParamSpec::new("d", 0.1, "length", "How far outwards.")],
        build: |l, c| {
            let f = l.operand(c, 0)?;
            Ok(l.graph.sub(f, c.p[0]))
        },
        ..OPERATOR
    },
    Kind {
        name: "shell",
        doc: "A wall of the given thickness with the operand's surface in its middle.",
        formula: "|f| − thickness/2",
        params: &[ParamSpec::length("thickness", 0.1, "Full thickness.")],
        build: |l, c| {
            let f = l.operand(c, 0)?;
            let g = &mut l.graph;
            let (size, half) = (g.abs(f), g.constant(0.5));
            let half = g.mul(half, c.p[0]);
            Ok(g.sub(size, half))
        },
        ..OPERATOR
    },
    Kind {
        name: HIDDEN,
        doc: "A part that is left out for now: the operator above is as if it had been removed, and its parameters \
              stay. A model of which everything is hidden has no surface.",
        formula: "f, where it stands for a part of its own",
        build: |l, c| l.operand(c, 0),
        ..OPERATOR
    },
];
