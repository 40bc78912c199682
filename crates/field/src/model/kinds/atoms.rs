//! Coordinates, constants, free-standing parameters, and what holds a model together.

use crate::model::Payload;
use crate::model::kind::{Category, Kind, Layout, Operands, PayloadKind};

const ATOM: Kind = Kind { category: Category::Atom, ..Kind::ROW };
const STRUCTURE: Kind = Kind { category: Category::Structure, ..Kind::ROW };

pub const KINDS: &[Kind] = &[
    Kind { name: "x", doc: "The first coordinate.", formula: "x", build: |_, c| Ok(c.at[0]), ..ATOM },
    Kind { name: "y", doc: "The second coordinate.", formula: "y", build: |_, c| Ok(c.at[1]), ..ATOM },
    Kind { name: "z", doc: "The third coordinate.", formula: "z", build: |_, c| Ok(c.at[2]), ..ATOM },
    Kind {
        name: "const",
        doc: "A number that is no parameter.",
        formula: "v",
        payload: PayloadKind::Number,
        build: |l, c| match c.model.payload() {
            Payload::Number(v) => Ok(l.graph.constant(*v)),
            _ => unreachable!("checked when the node was made"),
        },
        ..ATOM
    },
    Kind {
        name: "parameter",
        doc: "A named parameter of a formula.",
        formula: "q",
        layout: Layout::Own,
        build: |_, c| Ok(c.p[0]),
        ..ATOM
    },
    Kind {
        name: "planar",
        doc: "A curve in the plane z = 0: its operand there. A model of which some part is planar and which \
              does not depend on z has two axes.",
        formula: "f(x, y, 0)",
        operands: Operands::Exactly(1),
        build: |l, c| {
            l.make_planar();
            let zero = l.graph.constant(0.0);
            l.moved(c, [c.at[0], c.at[1], zero])
        },
        ..STRUCTURE
    },
    Kind {
        name: "stack",
        doc: "A field of several components, one an operand: the points where all are zero, such as the curve in \
              which two surfaces meet. Only as the outermost node.",
        formula: "(f, g, …)",
        operands: Operands::AtLeast(1),
        build: |_, _| {
            Err(crate::FieldError::Invalid(
                "stack: only the outermost node can have several components; apply the other operators to each \
                 operand of `stack`"
                    .into(),
            ))
        },
        ..STRUCTURE
    },
    Kind {
        name: "program",
        doc: "A straight-line program, such as a .vm tape.",
        formula: "program(x, y, z)",
        category: Category::Shape,
        payload: PayloadKind::Program,
        build: |l, c| match c.model.payload() {
            Payload::Program(program) => Ok(program.build(&mut l.graph, c.at)),
            _ => unreachable!("checked when the node was made"),
        },
        ..STRUCTURE
    },
    Kind {
        name: "function",
        doc: "A function of the caller's, known only by its values, with any number of parameters of its own.",
        formula: "f(x, y, z, q)",
        category: Category::Shape,
        layout: Layout::Function,
        payload: PayloadKind::Callback,
        build: |l, c| Ok(l.leaf(c)),
        ..STRUCTURE
    },
];
