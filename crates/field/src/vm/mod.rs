//! fidget's plain-text tapes (`.vm`): straight-line programs, one operation a line.
//!
//! ```text
//! # comment
//! _0 const 1.5
//! _1 var-x
//! _2 add _0 _1
//! ```
//!
//! The last line is the result. Read are all operations but `rand` and `mix`, which scramble bits and have no
//! derivative. `compare` is −1, 0 or 1, `mod` is Euclidean, `and` and `or` are short-circuit (0 is false), `not`
//! is 1 or 0.

use std::fmt::Write;

use rustc_hash::FxHashMap;

use crate::graph::Expr;
use crate::model::{Model, Payload, kinds};
use crate::text::read_number;
use crate::{FieldError, Graph, Node, Op};

/// Largest size of a file in bytes.
pub const MAX_BYTES: usize = 64 << 20;
/// Largest number of operations.
pub const MAX_STEPS: usize = 1_000_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Const(f64),
    Axis(u8),
    Unary(&'static str, u32),
    Binary(&'static str, u32, u32),
}

const UNARY: [&str; 18] = [
    "neg", "abs", "sqrt", "square", "floor", "ceil", "round", "sin", "cos", "tan", "asin", "acos", "atan",
    "ln", "not", "exp", "recip", "copy",
];
const BINARY: [&str; 11] = ["add", "sub", "mul", "div", "min", "max", "atan2", "compare", "mod", "and", "or"];
const AXES: [&str; 3] = ["var-x", "var-y", "var-z"];

/// A straight-line program over x, y and z. Its result is its last step.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    steps: Vec<Step>,
}

fn fail<T>(line: usize, reason: String) -> Result<T, FieldError> {
    Err(FieldError::File { format: "vm", line, reason })
}

/// Text of a file for a message: short and printable.
fn shown(word: &str) -> String {
    let mut s: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    if word.chars().count() > 40 {
        s.push('…');
    }
    s
}

impl Program {
    /// Number of steps.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Never: a program has a result.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Reads a tape. Errors carry the line.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        if text.len() > MAX_BYTES {
            return Err(FieldError::TooLarge(format!(
                "a .vm tape may have {MAX_BYTES} bytes, this one has {}",
                text.len()
            )));
        }
        let mut steps = Vec::new();
        let mut names: FxHashMap<&str, u32> = FxHashMap::default();
        for (i, line) in text.lines().enumerate() {
            let number = i + 1;
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if steps.len() == MAX_STEPS {
                return Err(FieldError::TooLarge(format!(
                    "a .vm tape may have {MAX_STEPS} operations, this one has more (line {number})"
                )));
            }
            let mut words = line.split_whitespace();
            let name = words.next().expect("the line is not empty");
            let Some(op) = words.next() else {
                return fail(number, format!("expected `name operation operands…`, found `{}`", shown(line)));
            };
            let words: Vec<&str> = words.take(4).collect();
            let count = |n: usize| {
                if words.len() == n {
                    return Ok(());
                }
                let given = if words.len() > 3 { "more".to_string() } else { words.len().to_string() };
                fail(
                    number,
                    format!("`{op}` takes {n} operand{}, given {given}", if n == 1 { "" } else { "s" }),
                )
            };
            let operand = |k: usize| match names.get(words[k]) {
                Some(&n) => Ok(n),
                None => fail(number, format!("`{}` is used before any line defines it", shown(words[k]))),
            };
            let step = if op == "const" {
                count(1)?;
                match read_number(words[0]) {
                    Some(v) if v.is_finite() => Step::Const(v),
                    _ => {
                        return fail(
                            number,
                            format!("expected a finite number, found `{}`", shown(words[0])),
                        );
                    }
                }
            } else if let Some(axis) = AXES.iter().position(|a| *a == op) {
                count(0)?;
                Step::Axis(axis as u8)
            } else if let Some(known) = UNARY.iter().find(|u| **u == op) {
                count(1)?;
                Step::Unary(known, operand(0)?)
            } else if let Some(known) = BINARY.iter().find(|b| **b == op) {
                count(2)?;
                Step::Binary(known, operand(0)?, operand(1)?)
            } else if op == "rand" || op == "mix" {
                return fail(
                    number,
                    format!("`{op}` scrambles bits and cannot be differentiated; remove it"),
                );
            } else {
                let known = AXES.iter().chain(&UNARY).chain(&BINARY).copied().chain(["const"]);
                let hint = crate::text::suggestion(op, known);
                return fail(number, format!("unknown operation `{}`{hint}", shown(op)));
            };
            names.insert(name, steps.len() as u32);
            steps.push(step);
        }
        if steps.is_empty() {
            return fail(0, "there is no operation in it; expected lines such as `_0 var-x`".into());
        }
        Ok(Self { steps })
    }

    /// The tape as text that [`Program::parse`] reads back exactly.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for (i, step) in self.steps.iter().enumerate() {
            let _ = match step {
                Step::Const(v) => writeln!(text, "_{i:x} const {v:?}"),
                Step::Axis(a) => writeln!(text, "_{i:x} {}", AXES[*a as usize]),
                Step::Unary(op, a) => writeln!(text, "_{i:x} {op} _{a:x}"),
                Step::Binary(op, a, b) => writeln!(text, "_{i:x} {op} _{a:x} _{b:x}"),
            };
        }
        text
    }

    /// The program as expressions of the coordinates.
    pub(crate) fn build(&self, g: &mut Graph, at: [Node; 3]) -> Node {
        let mut nodes: Vec<Node> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let node = match *step {
                Step::Const(v) => g.constant(v),
                Step::Axis(a) => at[a as usize],
                Step::Unary(op, a) => unary(g, op, nodes[a as usize]),
                Step::Binary(op, a, b) => binary(g, op, nodes[a as usize], nodes[b as usize]),
            };
            nodes.push(node);
        }
        nodes[nodes.len() - 1]
    }

    /// The tape of a model with its parameters at their present values. `Invalid` where it has opaque leaves or
    /// several components, or is not finite somewhere as a constant.
    pub fn of(model: &Model) -> Result<Self, FieldError> {
        let lowered = model.lower()?;
        let &[root] = lowered.roots.as_slice() else {
            return Err(FieldError::Invalid(
                "a .vm tape has one result; this model has several components".into(),
            ));
        };
        if let Some(leaf) = lowered.leaves.first() {
            return Err(FieldError::Invalid(format!(
                "a .vm tape holds arithmetic only; this model calls the function {}",
                leaf.name
            )));
        }
        let mut needed = vec![false; lowered.graph.len()];
        needed[root.0 as usize] = true;
        for i in (0..=root.0 as usize).rev() {
            if let (true, Expr::Op(_, operands)) = (needed[i], lowered.graph.exprs[i]) {
                operands.iter().for_each(|o| needed[o.0 as usize] = true);
            }
        }
        let mut this = Self { steps: Vec::new() };
        let mut place = vec![0; lowered.graph.len()];
        for i in (0..=root.0 as usize).filter(|&i| needed[i]) {
            place[i] = match lowered.graph.exprs[i] {
                Expr::Const(bits) => this.constant(f64::from_bits(bits))?,
                Expr::Param(k) => this.constant(lowered.params[k as usize].value)?,
                Expr::Input(a) => this.push(Step::Axis(a as u8)),
                Expr::Op(op, [a, b, c]) => this.operation(op, [a, b, c].map(|n| place[n.0 as usize])),
            };
        }
        Ok(this)
    }

    fn push(&mut self, step: Step) -> u32 {
        self.steps.push(step);
        self.steps.len() as u32 - 1
    }

    fn constant(&mut self, v: f64) -> Result<u32, FieldError> {
        if !v.is_finite() {
            return Err(FieldError::Invalid(format!(
                "a part of the model is {v} everywhere: check its divisions"
            )));
        }
        Ok(self.push(Step::Const(v)))
    }

    fn operation(&mut self, op: Op, [a, b, c]: [u32; 3]) -> u32 {
        let unary = |name| Step::Unary(name, a);
        let step = match op {
            Op::Neg => unary("neg"),
            Op::Abs => unary("abs"),
            Op::Sqrt => unary("sqrt"),
            Op::Square => unary("square"),
            Op::Exp => unary("exp"),
            Op::Ln => unary("ln"),
            Op::Sin => unary("sin"),
            Op::Cos => unary("cos"),
            Op::Tan => unary("tan"),
            Op::Asin => unary("asin"),
            Op::Acos => unary("acos"),
            Op::Atan => unary("atan"),
            Op::Floor => unary("floor"),
            Op::Ceil => unary("ceil"),
            Op::Round => unary("round"),
            Op::Add => Step::Binary("add", a, b),
            Op::Sub => Step::Binary("sub", a, b),
            Op::SquaredDifference => {
                let difference = self.push(Step::Binary("sub", a, b));
                Step::Unary("square", difference)
            }
            Op::Mul => Step::Binary("mul", a, b),
            Op::Div => Step::Binary("div", a, b),
            Op::Min => Step::Binary("min", a, b),
            Op::Max => Step::Binary("max", a, b),
            Op::Atan2 => Step::Binary("atan2", a, b),
            Op::Pow => {
                let log = self.push(Step::Unary("ln", a));
                let product = self.push(Step::Binary("mul", b, log));
                Step::Unary("exp", product)
            }
            Op::Mod => {
                let turns = self.push(Step::Binary("div", a, b));
                let whole = self.push(Step::Unary("floor", turns));
                let part = self.push(Step::Binary("mul", b, whole));
                Step::Binary("sub", a, part)
            }
            Op::Less => {
                let order = self.push(Step::Binary("compare", b, a));
                let zero = self.push(Step::Const(0.0));
                Step::Binary("max", order, zero)
            }
            Op::Choose => {
                let not = self.push(Step::Unary("not", a));
                let first = self.push(Step::Binary("and", a, b));
                let second = self.push(Step::Binary("and", not, c));
                Step::Binary("or", first, second)
            }
        };
        self.push(step)
    }
}

fn unary(g: &mut Graph, op: &str, a: Node) -> Node {
    match op {
        "neg" => g.neg(a),
        "abs" => g.abs(a),
        "sqrt" => g.sqrt(a),
        "square" => g.square(a),
        "floor" => g.floor(a),
        "ceil" => g.ceil(a),
        "round" => g.round(a),
        "sin" => g.sin(a),
        "cos" => g.cos(a),
        "tan" => g.tan(a),
        "asin" => g.asin(a),
        "acos" => g.acos(a),
        "atan" => g.atan(a),
        "ln" => g.ln(a),
        "exp" => g.exp(a),
        "recip" => {
            let one = g.constant(1.0);
            g.div(one, a)
        }
        "not" => {
            let (zero, one) = (g.constant(0.0), g.constant(1.0));
            if_true(g, a, zero, one)
        }
        _ => a,
    }
}

fn binary(g: &mut Graph, op: &str, a: Node, b: Node) -> Node {
    match op {
        "add" => g.add(a, b),
        "sub" => g.sub(a, b),
        "mul" => g.mul(a, b),
        "div" => g.div(a, b),
        "min" => g.min(a, b),
        "max" => g.max(a, b),
        "atan2" => g.atan2(a, b),
        "compare" => {
            let (zero, one, minus) = (g.constant(0.0), g.constant(1.0), g.constant(-1.0));
            let rest = g.select(b, a, one, zero);
            g.select(a, b, minus, rest)
        }
        "mod" => {
            let size = g.abs(b);
            g.modulo(a, size)
        }
        "and" => if_true(g, a, b, a),
        _ => if_true(g, a, a, b),
    }
}

/// `b` where a ≠ 0, else `c`.
fn if_true(g: &mut Graph, a: Node, b: Node, c: Node) -> Node {
    if let Expr::Op(Op::Less, [lo, hi, _]) = g.exprs[a.0 as usize] {
        return g.select(lo, hi, b, c);
    }
    let (size, zero) = (g.abs(a), g.constant(0.0));
    g.select(zero, size, b, c)
}

/// Reads a tape as a model without parameters.
pub fn parse_vm(text: &str) -> Result<Model, FieldError> {
    let program = Program::parse(text)?;
    Model::new(kinds::known("program"), vec![], vec![], Payload::Program(program.into()))
}

#[cfg(test)]
mod tests;
