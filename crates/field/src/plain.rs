//! The two sweeps without registers, one number at a time: every instruction's value and adjoint is kept. For
//! intervals, where pruning asks what each instruction came to.

use crate::op::{apply, is_flat, pull};
use crate::scalar::Scalar;
use crate::tape::{Code, Mode, Tape};

/// The value of uniform `u`, given those that the tapes share, which may be of a simpler type.
#[inline(always)]
pub(crate) fn uniform<U: Copy, V: Scalar + From<U>>(tape: &Tape, shared: &[U], u: u32) -> V {
    match shared.get(u as usize) {
        Some(v) => V::from(*v),
        None => V::from_f64(tape.own[u as usize - shared.len()]),
    }
}

/// The first two operands' values.
#[inline(always)]
pub(crate) fn operands<U: Copy, V: Scalar + From<U>>(
    tape: &Tape,
    shared: &[U],
    values: &[V],
    mode: Mode,
    args: [u32; 3],
) -> (V, V) {
    let slot = |k: usize| values[args[k] as usize];
    match mode {
        Mode::Slots => (slot(0), slot(1)),
        Mode::SlotUniform => (slot(0), uniform(tape, shared, args[1])),
        Mode::UniformSlot => (uniform(tape, shared, args[0]), slot(1)),
    }
}

/// The value of every instruction.
#[inline(always)]
pub(crate) fn forward<U: Copy, V: Scalar + From<U>>(
    tape: &Tape,
    shared: &[U],
    inputs: &[V],
    values: &mut Vec<V>,
) {
    values.clear();
    for instr in &tape.instrs {
        let v = match instr.code {
            Code::Input => inputs[instr.args[0] as usize],
            Code::Uniform => uniform(tape, shared, instr.args[0]),
            Code::Op(op, mode) => {
                let (a, b) = operands(tape, shared, values, mode, instr.args);
                let c = if op.arity() == 3 { values[instr.args[2] as usize] } else { b };
                apply(op, a, b, c)
            }
        };
        values.push(v);
    }
}

/// The adjoint of every instruction, after [`forward`].
#[inline(always)]
pub(crate) fn reverse<U: Copy, V: Scalar + From<U>>(
    tape: &Tape,
    shared: &[U],
    values: &[V],
    adjoints: &mut Vec<V>,
) {
    adjoints.clear();
    adjoints.resize(tape.instrs.len(), V::from_f64(0.0));
    if let Some(root) = adjoints.last_mut() {
        *root = V::from_f64(1.0);
    }
    for (i, instr) in tape.instrs.iter().enumerate().rev() {
        if let Code::Op(op, mode) = instr.code {
            let (a, b) = operands(tape, shared, values, mode, instr.args);
            for k in instr.slots().rev().filter(|&k| !is_flat(op, k)) {
                let slot = instr.args[k] as usize;
                adjoints[slot] = adjoints[slot] + pull(op, k, adjoints[i], a, b, values[i]);
            }
        }
    }
}
