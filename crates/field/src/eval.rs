//! The two sweeps over a tape, for blocks of `B` points in any number type: values forward, derivatives in
//! reverse. Lanes run across points and never mix, so that a result depends neither on the block's size nor on
//! the width of the machine's vectors.

use crate::op::{Op, apply, is_flat, pull};
use crate::scalar::Scalar;
use crate::tape::{ACTIVE, Code, Instr, Mode, Tape, Uniform};

/// Calls `$run!(Op)` with the operation as a constant, so that each arm compiles to its own loop.
macro_rules! dispatch {
    ($op:expr, $run:ident) => {
        match $op {
            Op::Neg => $run!(Op::Neg),
            Op::Abs => $run!(Op::Abs),
            Op::Sqrt => $run!(Op::Sqrt),
            Op::Square => $run!(Op::Square),
            Op::Exp => $run!(Op::Exp),
            Op::Ln => $run!(Op::Ln),
            Op::Sin => $run!(Op::Sin),
            Op::Cos => $run!(Op::Cos),
            Op::Tan => $run!(Op::Tan),
            Op::Asin => $run!(Op::Asin),
            Op::Acos => $run!(Op::Acos),
            Op::Atan => $run!(Op::Atan),
            Op::Floor => $run!(Op::Floor),
            Op::Ceil => $run!(Op::Ceil),
            Op::Round => $run!(Op::Round),
            Op::Add => $run!(Op::Add),
            Op::Sub => $run!(Op::Sub),
            Op::Mul => $run!(Op::Mul),
            Op::Div => $run!(Op::Div),
            Op::Min => $run!(Op::Min),
            Op::Max => $run!(Op::Max),
            Op::Pow => $run!(Op::Pow),
            Op::Atan2 => $run!(Op::Atan2),
            Op::Mod => $run!(Op::Mod),
            Op::Less => $run!(Op::Less),
            Op::Choose => $run!(Op::Choose),
        }
    };
}

/// Values of every instruction, for a block of points; `inputs[k]` is coordinate k.
#[inline(always)]
pub(crate) fn forward<V: Scalar, const B: usize>(
    tape: &Tape,
    uniforms: &[V],
    inputs: &[[V; B]],
    slots: &mut [[V; B]],
) {
    for (i, instr) in tape.instrs.iter().enumerate() {
        let (done, rest) = slots.split_at_mut(i);
        let out = &mut rest[0];
        let [a, b, c] = instr.args;
        match instr.code {
            Code::Input => *out = inputs[a as usize],
            Code::Uniform => *out = [tape.uniform(uniforms, a); B],
            Code::Op(op, Mode::Slots) => {
                let (a, b, c) = (&done[a as usize], &done[b as usize], &done[c as usize]);
                macro_rules! run {
                    ($op:expr) => {
                        for j in 0..B {
                            out[j] = apply($op, a[j], b[j], c[j]);
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::SlotUniform) => {
                let (a, b) = (&done[a as usize], tape.uniform(uniforms, b));
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.arity() == 2 } {
                            for j in 0..B {
                                out[j] = apply($op, a[j], b, b);
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::UniformSlot) => {
                let (a, b) = (tape.uniform(uniforms, a), &done[b as usize]);
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.arity() == 2 && !$op.commutes() } {
                            for j in 0..B {
                                out[j] = apply($op, a, b[j], b[j]);
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
        }
    }
}

/// Takes the derivatives with respect to uniforms out of a reverse sweep.
pub(crate) trait Sink<V: Scalar, const B: usize> {
    /// Whether anything is wanted from this uniform.
    fn wants(&self, uniform: u32) -> bool;
    /// Adds a block of contributions.
    fn add(&mut self, uniform: u32, contribution: &[V; B]);
}

/// Nothing is wanted: derivatives with respect to the coordinates only.
pub(crate) struct Ignore;

impl<V: Scalar, const B: usize> Sink<V, B> for Ignore {
    #[inline(always)]
    fn wants(&self, _: u32) -> bool {
        false
    }
    #[inline(always)]
    fn add(&mut self, _: u32, _: &[V; B]) {}
}

/// The derivative along one direction of parameter space: (∂F/∂q)·q̇, WH94 eq. 2.
pub(crate) struct Directional<'a, const B: usize> {
    pub rates: &'a [f64],
    pub total: [f64; B],
}

impl<const B: usize> Sink<f64, B> for Directional<'_, B> {
    #[inline(always)]
    fn wants(&self, uniform: u32) -> bool {
        self.rates.get(uniform as usize).is_some_and(|r| *r != 0.0)
    }
    #[inline(always)]
    fn add(&mut self, uniform: u32, contribution: &[f64; B]) {
        let r = self.rates[uniform as usize];
        for j in 0..B {
            self.total[j] += r * contribution[j];
        }
    }
}

/// Marks uniforms that no free parameter moves.
pub(crate) const NO_ROW: u32 = u32::MAX;

/// All derivatives: one row of adjoints for each uniform that depends on a free parameter.
pub(crate) struct Full<'a, V, const B: usize> {
    pub row_of: &'a [u32],
    pub rows: &'a mut [[V; B]],
}

impl<V: Scalar, const B: usize> Sink<V, B> for Full<'_, V, B> {
    #[inline(always)]
    fn wants(&self, uniform: u32) -> bool {
        self.row_of.get(uniform as usize).is_some_and(|r| *r != NO_ROW)
    }
    #[inline(always)]
    fn add(&mut self, uniform: u32, contribution: &[V; B]) {
        let row = &mut self.rows[self.row_of[uniform as usize] as usize];
        for j in 0..B {
            row[j] = row[j] + contribution[j];
        }
    }
}

/// The adjoint of every active instruction, after [`forward`]; those of the inputs are ∂F/∂x.
#[inline(always)]
pub(crate) fn reverse<V: Scalar, const B: usize, S: Sink<V, B>>(
    tape: &Tape,
    uniforms: &[V],
    slots: &[[V; B]],
    adjoints: &mut [[V; B]],
    sink: &mut S,
) {
    let n = tape.instrs.len();
    adjoints[n - 1] = [V::from_f64(1.0); B];
    for i in (0..n).rev() {
        let instr = &tape.instrs[i];
        if instr.flags & ACTIVE == 0 {
            continue;
        }
        let (before, rest) = adjoints.split_at_mut(i);
        let g = &rest[0];
        let r = &slots[i];
        let [a, b, _] = instr.args;
        match instr.code {
            Code::Input => {}
            Code::Uniform => {
                if sink.wants(a) {
                    sink.add(a, g);
                }
            }
            Code::Op(op, Mode::Slots) => {
                let (va, vb) = (&slots[a as usize], &slots[b as usize]);
                macro_rules! run {
                    ($op:expr) => {{
                        if const { $op.arity() == 3 } {
                            operand::<V, B>(instr, 2, before, |j| pull($op, 2, g[j], va[j], vb[j], r[j]));
                        }
                        if const { $op.arity() >= 2 && !is_flat($op, 1) } {
                            operand::<V, B>(instr, 1, before, |j| pull($op, 1, g[j], va[j], vb[j], r[j]));
                        }
                        if const { !is_flat($op, 0) } {
                            operand::<V, B>(instr, 0, before, |j| pull($op, 0, g[j], va[j], vb[j], r[j]));
                        }
                    }};
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::SlotUniform) => {
                let (va, vb) = (&slots[a as usize], tape.uniform(uniforms, b));
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.arity() == 2 && !is_flat($op, 0) } {
                            operand::<V, B>(instr, 0, before, |j| pull($op, 0, g[j], va[j], vb, r[j]));
                            if sink.wants(b) {
                                let add = std::array::from_fn(|j| pull($op, 1, g[j], va[j], vb, r[j]));
                                sink.add(b, &add);
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::UniformSlot) => {
                let (va, vb) = (tape.uniform(uniforms, a), &slots[b as usize]);
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.arity() == 2 && !$op.commutes() && !is_flat($op, 0) } {
                            operand::<V, B>(instr, 1, before, |j| pull($op, 1, g[j], va, vb[j], r[j]));
                            if sink.wants(a) {
                                let add = std::array::from_fn(|j| pull($op, 0, g[j], va, vb[j], r[j]));
                                sink.add(a, &add);
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
        }
    }
}

/// Writes or adds to the adjoint of operand `k`.
#[inline(always)]
fn operand<V: Scalar, const B: usize>(
    instr: &Instr,
    k: usize,
    before: &mut [[V; B]],
    contribution: impl Fn(usize) -> V,
) {
    let target = &mut before[instr.args[k] as usize];
    if instr.flags & (1 << k) != 0 {
        for j in 0..B {
            target[j] = contribution(j);
        }
    } else {
        for j in 0..B {
            target[j] = target[j] + contribution(j);
        }
    }
}

/// Carries the rows of adjoints from the uniforms back to the parameters they depend on.
#[inline(always)]
pub(crate) fn reverse_uniforms<V: Scalar, const B: usize>(
    program: &[Uniform],
    values: &[V],
    row_of: &[u32],
    rows: &mut [[V; B]],
) {
    for i in (0..program.len()).rev() {
        let (Uniform::Op(op, args), true) = (program[i], row_of[i] != NO_ROW) else { continue };
        let g = rows[row_of[i] as usize];
        let [a, b, _] = args.map(|s| values[s as usize]);
        for k in 0..op.arity() {
            let row = row_of[args[k] as usize];
            if row == NO_ROW || is_flat(op, k) {
                continue;
            }
            let row = &mut rows[row as usize];
            for j in 0..B {
                row[j] = row[j] + pull(op, k, g[j], a, b, values[i]);
            }
        }
    }
}
