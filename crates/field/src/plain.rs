//! The two sweeps without registers, one number at a time: every instruction's value and adjoint is kept. For
//! intervals, where pruning asks what each instruction came to.

use crate::SMALL;
use crate::eval::dispatch;
use crate::op::{Op, apply, is_flat, pull};
use crate::scalar::Scalar;
use crate::tape::{Code, Mode, Tape};

/// The value of uniform `u`, given those that the tapes share, which may be of a simpler type.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(crate) fn uniform<U: Copy, V: Scalar + From<U>>(tape: &Tape, shared: &[U], u: u32) -> V {
    match shared.get(u as usize) {
        Some(v) => V::from(*v),
        None => V::from_f64(tape.own[u as usize - shared.len()]),
    }
}

/// The first two operands' values.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
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

/// The value of every instruction, in the first places of `values`, which may be longer.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(crate) fn forward<U: Copy, V: Scalar + From<U>>(
    tape: &Tape,
    shared: &[U],
    inputs: &[V],
    values: &mut Vec<V>,
) {
    if values.len() < tape.instrs.len() {
        values.resize(tape.instrs.len(), V::from_f64(0.0));
    }
    for (i, instr) in tape.instrs.iter().enumerate() {
        values[i] = match instr.code {
            Code::Input => inputs[instr.args[0] as usize],
            Code::Uniform => uniform(tape, shared, instr.args[0]),
            Code::Op(op, mode) => {
                let (a, b) = operands(tape, shared, values, mode, instr.args);
                let c = if op.arity() == 3 { values[instr.args[2] as usize] } else { b };
                apply(op, a, b, c)
            }
        };
    }
}

/// The adjoints of a tape's instructions, kept between calls.
pub(crate) struct Adjoints<V> {
    /// One for each instruction; there may be more of a longer tape before.
    pub list: Vec<V>,
    /// Which have been written to in the sweep.
    reached: Vec<bool>,
}

impl<V> Default for Adjoints<V> {
    fn default() -> Self {
        Self { list: Vec::new(), reached: Vec::new() }
    }
}

/// The adjoint of every instruction, after [`forward`].
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(crate) fn reverse<U: Copy, V: Scalar + From<U>>(
    tape: &Tape,
    shared: &[U],
    values: &[V],
    adjoints: &mut Adjoints<V>,
) {
    let n = tape.instrs.len();
    let Adjoints { list, reached } = adjoints;
    if list.len() < n {
        list.resize(n, V::from_f64(0.0));
    }
    reached.clear();
    reached.resize(n, false);
    if let (Some(root), Some(first)) = (list[..n].last_mut(), reached.last_mut()) {
        (*root, *first) = (V::from_f64(1.0), true);
    }
    for (i, instr) in tape.instrs.iter().enumerate().rev() {
        if !reached[i] {
            list[i] = V::from_f64(0.0);
            continue;
        }
        let Code::Op(op, mode) = instr.code else { continue };
        let (before, rest) = list.split_at_mut(i);
        let (g, r, slots) = (rest[0], values[i], instr.slots());
        if SMALL {
            let (a, b) = operands(tape, shared, values, mode, instr.args);
            for k in slots.rev().filter(|&k| !is_flat(op, k)) {
                add(before, reached, instr.args[k], pull(op, k, g, a, b, r));
            }
            continue;
        }
        // With the operation as a constant: of one match for all, the compiler takes out what some have in common, such
        // as roots, and computes it for every instruction.
        macro_rules! run {
            ($op:expr) => {{
                let (a, b) = operands(tape, shared, values, mode, instr.args);
                run!($op, 2, a, b);
                run!($op, 1, a, b);
                run!($op, 0, a, b);
            }};
            ($op:expr, $k:literal, $a:ident, $b:ident) => {
                if const { $k < $op.arity() && !is_flat($op, $k) } && slots.contains(&$k) {
                    add(before, reached, instr.args[$k], pull($op, $k, g, $a, $b, r));
                }
            };
        }
        dispatch!(op, run);
    }
}

/// Adds a share to the adjoint in `slot`. The first one is written: nothing has to be cleared before.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn add<V: Scalar>(list: &mut [V], reached: &mut [bool], slot: u32, share: V) {
    let slot = slot as usize;
    list[slot] = if reached[slot] { list[slot] + share } else { share };
    reached[slot] = true;
}
