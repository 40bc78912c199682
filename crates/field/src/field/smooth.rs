//! How regular a field surely is in a box: whether a minimum, an absolute value, a rounding or a selection is undecided.

use super::Field;
use crate::FieldError;
use crate::interval::Interval;
use crate::op::Op;
use crate::plain::{forward, operands};
use crate::scalar::Scalar;
use crate::tape::Code;

/// What is known of F over a box, where the intervals of its derivatives are bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Regularity {
    /// It may jump.
    Broken,
    /// It is continuous, and its derivatives may jump: those on either side lie in their intervals.
    Kinked,
    /// All derivatives are continuous.
    Smooth,
}

impl Field {
    /// How regular F surely is over a box, by the choices that it depends on there. For the first component; an error where
    /// a part is opaque.
    pub fn regularity(&self, lo: &[f64], hi: &[f64]) -> Result<Regularity, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let (tape, spans) = (self.tape(0), self.spans(0));
        let mut values: Vec<Interval> = Vec::new();
        forward(tape, &spans, &inputs, &mut values);
        let mut reached = vec![false; tape.instrs.len()];
        if let Some(last) = reached.last_mut() {
            *last = true;
        }
        let mut out = Regularity::Smooth;
        for (i, instr) in tape.instrs.iter().enumerate().rev() {
            let Code::Op(op, mode) = instr.code else { continue };
            if !reached[i] {
                continue;
            }
            let (a, b) = operands(tape, &spans, &values, mode, instr.args);
            let (regularity, needed) = depends(op, a, b);
            out = out.min(regularity);
            for k in instr.slots().filter(|&k| needed[k]) {
                reached[instr.args[k] as usize] = true;
            }
        }
        Ok(out)
    }
}

/// How regular an operation is for such operands, and on which of them it depends.
fn depends(op: Op, a: Interval, b: Interval) -> (Regularity, [bool; 3]) {
    use Regularity::{Broken, Kinked, Smooth};
    let all = [true; 3];
    let either = |smooth: bool, otherwise: Regularity| (if smooth { Smooth } else { otherwise }, all);
    let flat = |v: Interval| either(v.lo == v.hi, Broken);
    match op {
        Op::Abs => either(!a.has_zero(), Kinked),
        Op::Min | Op::Max if a.hi < b.lo || b.hi < a.lo => {
            let first = (a.hi < b.lo) == (op == Op::Min);
            (Smooth, [first, !first, false])
        }
        Op::Min | Op::Max => (Kinked, all),
        Op::Choose if !a.has_zero() => (Smooth, [true, true, false]),
        Op::Choose if a.lo == 0.0 && a.hi == 0.0 => (Smooth, [true, false, true]),
        Op::Choose => (Broken, all),
        Op::Floor => flat(a.floor()),
        Op::Ceil => flat(a.ceil()),
        Op::Round => flat(Scalar::round(a)),
        Op::Mod => flat((a / b).floor()),
        Op::Less => either(a.hi < b.lo || a.lo > b.hi, Broken),
        // Broken along the negative x axis.
        Op::Atan2 => either(!a.has_zero() || b.lo > 0.0, Broken),
        _ => (Smooth, all),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text;

    #[test]
    fn choices_are_seen_where_they_are_open() {
        let at = |formula: &str, x: f64| {
            let field = Field::new(&text::parse(formula, &[]).unwrap()).unwrap();
            field.regularity(&[x - 0.1, -0.1, -0.1], &[x + 0.1, 0.1, 0.1]).unwrap()
        };
        use Regularity::{Broken, Kinked, Smooth};
        assert_eq!([0.0, 1.0].map(|x| at("abs(x) + y*z", x)), [Kinked, Smooth]);
        assert_eq!([0.0, 1.0].map(|x| at("max(x, y) + z", x)), [Kinked, Smooth]);
        assert_eq!([0.0, 0.5].map(|x| at("floor(x) + y + z", x)), [Broken, Smooth]);
        // What a choice leaves out does not matter.
        assert_eq!([0.0, 2.0].map(|x| at("min(x, 1 + abs(y)) + z", x)), [Smooth, Kinked]);
        assert_eq!(at("sqrt(x^2 + y^2) + z", 0.0), Smooth);
    }
}
