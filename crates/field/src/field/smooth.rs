//! Where a field is surely smooth: no minimum, absolute value, rounding or selection is undecided.

use super::Field;
use crate::FieldError;
use crate::interval::Interval;
use crate::op::Op;
use crate::plain::{forward, operands};
use crate::scalar::Scalar;
use crate::tape::Code;

impl Field {
    /// Whether F surely has continuous derivatives over a box, wherever their intervals are bounded: every choice that F
    /// depends on falls the same way all over it. For the first component; an error where a part is opaque.
    pub fn is_smooth(&self, lo: &[f64], hi: &[f64]) -> Result<bool, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let (tape, spans) = (self.tape(0), self.spans(0));
        let mut values: Vec<Interval> = Vec::new();
        forward(tape, &spans, &inputs, &mut values);
        let mut reached = vec![false; tape.instrs.len()];
        if let Some(last) = reached.last_mut() {
            *last = true;
        }
        for (i, instr) in tape.instrs.iter().enumerate().rev() {
            let Code::Op(op, mode) = instr.code else { continue };
            if !reached[i] {
                continue;
            }
            let (a, b) = operands(tape, &spans, &values, mode, instr.args);
            let Some(needed) = decided(op, a, b) else { return Ok(false) };
            for k in instr.slots().filter(|&k| needed[k]) {
                reached[instr.args[k] as usize] = true;
            }
        }
        Ok(true)
    }
}

/// Which operands an operation depends on where it is smooth; `None` where it may have a kink or a jump.
fn decided(op: Op, a: Interval, b: Interval) -> Option<[bool; 3]> {
    let all = [true; 3];
    let flat = |v: Interval| (v.lo == v.hi).then_some(all);
    match op {
        Op::Abs => (!a.has_zero()).then_some(all),
        Op::Min if a.hi < b.lo => Some([true, false, false]),
        Op::Min if b.hi < a.lo => Some([false, true, false]),
        Op::Max if a.hi < b.lo => Some([false, true, false]),
        Op::Max if b.hi < a.lo => Some([true, false, false]),
        Op::Min | Op::Max => None,
        Op::Choose if !a.has_zero() => Some([true, true, false]),
        Op::Choose if a.lo == 0.0 && a.hi == 0.0 => Some([true, false, true]),
        Op::Choose => None,
        Op::Floor => flat(a.floor()),
        Op::Ceil => flat(a.ceil()),
        Op::Round => flat(Scalar::round(a)),
        Op::Mod => flat((a / b).floor()),
        Op::Less => (a.hi < b.lo || a.lo > b.hi).then_some(all),
        // The cut along the negative x axis.
        Op::Atan2 => (!a.has_zero() || b.lo > 0.0).then_some(all),
        _ => Some(all),
    }
}
