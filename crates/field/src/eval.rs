//! The two sweeps over a tape, for blocks of `B` points in any number type: values forward, derivatives in
//! reverse. Lanes run across points and never mix, so that a result depends neither on the block's size nor on
//! the width of the machine's vectors.

use crate::SMALL;
use crate::op::{Op, apply, is_flat, pull};
use crate::program::{Back, Program};
use crate::scalar::Scalar;
use crate::tape::{Code, Mode, Uniform};

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
            Op::SquaredDifference => $run!(Op::SquaredDifference),
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
pub(crate) use dispatch;

/// The forward sweep, for a block of points; `inputs[k]` is coordinate k. The result is in register `root`.
#[inline(always)]
pub(crate) fn forward<V: Scalar, const B: usize>(
    program: &Program,
    uniforms: &[V],
    inputs: &[[V; B]],
    registers: &mut [[V; B]],
) {
    for step in &program.forward {
        let [a, b, c] = step.args.map(|r| r as usize);
        let out = step.out as usize;
        match step.code {
            Code::Input => registers[out] = inputs[a],
            Code::Uniform => registers[out] = [program.uniform(uniforms, step.args[0]); B],
            Code::Op(op, Mode::Slots) => {
                macro_rules! run {
                    ($op:expr) => {
                        match const { $op.arity() } {
                            1 => {
                                if let Ok([out, a]) = registers.get_disjoint_mut([out, a]) {
                                    map::<V, B>(out, |j| apply($op, a[j], a[j], a[j]));
                                }
                            }
                            2 => match registers.get_disjoint_mut([out, a, b]) {
                                Ok([out, a, b]) => map::<V, B>(out, |j| apply($op, a[j], b[j], b[j])),
                                // Both operands are one register; the result's is always another.
                                Err(_) => {
                                    let a = registers[a];
                                    map::<V, B>(&mut registers[out], |j| apply($op, a[j], a[j], a[j]));
                                }
                            },
                            _ => {
                                let (a, b, c) = (registers[a], registers[b], registers[c]);
                                map::<V, B>(&mut registers[out], |j| apply($op, a[j], b[j], c[j]));
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::SlotUniform) => {
                let b = program.uniform(uniforms, step.args[1]);
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.takes_uniform_second() } {
                            if let Ok([out, a]) = registers.get_disjoint_mut([out, a]) {
                                map::<V, B>(out, |j| apply($op, a[j], b, b));
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::UniformSlot) => {
                let a = program.uniform(uniforms, step.args[0]);
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.takes_uniform_first() } {
                            if let Ok([out, b]) = registers.get_disjoint_mut([out, b]) {
                                map::<V, B>(out, |j| apply($op, a, b[j], b[j]));
                            }
                        }
                    };
                }
                dispatch!(op, run)
            }
        }
    }
}

/// Fills a block. A function of its own, so that the compiler knows that the block overlaps nothing.
#[inline(always)]
fn map<V: Scalar, const B: usize>(out: &mut [V; B], f: impl Fn(usize) -> V) {
    for j in 0..B {
        out[j] = f(j);
    }
}

/// Takes the derivatives with respect to uniforms out of a reverse sweep.
pub(crate) trait Sink<V: Scalar, const B: usize> {
    /// Whether anything is wanted from this uniform.
    fn wants(&self, uniform: u32) -> bool;
    /// Adds a block of contributions.
    fn add(&mut self, uniform: u32, contribution: impl Fn(usize) -> V);
}

/// Nothing is wanted: derivatives with respect to the coordinates only.
pub(crate) struct Ignore;

impl<V: Scalar, const B: usize> Sink<V, B> for Ignore {
    #[inline(always)]
    fn wants(&self, _: u32) -> bool {
        false
    }
    #[inline(always)]
    fn add(&mut self, _: u32, _: impl Fn(usize) -> V) {}
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
    fn add(&mut self, uniform: u32, contribution: impl Fn(usize) -> f64) {
        let r = self.rates[uniform as usize];
        for j in 0..B {
            self.total[j] += r * contribution(j);
        }
    }
}

/// Marks uniforms that no free parameter moves.
pub(crate) const NO_ROW: u32 = u32::MAX;

/// All derivatives: one row of adjoints for each uniform that depends on a free parameter.
pub(crate) struct Full<'a, V, const B: usize> {
    pub row_of: &'a [u32],
    pub rows: &'a mut [[V; B]],
    /// Which rows hold anything yet in this block: clearing these is cheaper than clearing the rows.
    pub touched: &'a mut [bool],
}

impl<V: Scalar, const B: usize> Sink<V, B> for Full<'_, V, B> {
    #[inline(always)]
    fn wants(&self, uniform: u32) -> bool {
        self.row_of.get(uniform as usize).is_some_and(|r| *r != NO_ROW)
    }
    #[inline(always)]
    fn add(&mut self, uniform: u32, contribution: impl Fn(usize) -> V) {
        let row = self.row_of[uniform as usize] as usize;
        let target = &mut self.rows[row];
        if std::mem::replace(&mut self.touched[row], true) {
            for j in 0..B {
                target[j] = target[j] + contribution(j);
            }
        } else {
            map::<V, B>(target, contribution);
        }
    }
}

/// All that derivatives may be wanted for, told apart as the sweep runs: one copy of its loops serves all.
pub(crate) struct Any<'a, const B: usize> {
    /// For [`Directional`].
    pub rates: &'a [f64],
    pub total: [f64; B],
    /// Instead of it, where there is one.
    pub full: Option<Full<'a, f64, B>>,
}

impl<const B: usize> Any<'_, B> {
    #[inline(never)]
    fn take(&mut self, uniform: u32, block: &[f64; B]) {
        match &mut self.full {
            Some(full) => full.add(uniform, |j| block[j]),
            None => {
                let r = self.rates[uniform as usize];
                for j in 0..B {
                    self.total[j] += r * block[j];
                }
            }
        }
    }
}

impl<const B: usize> Sink<f64, B> for Any<'_, B> {
    #[inline(always)]
    fn wants(&self, uniform: u32) -> bool {
        match &self.full {
            Some(full) => full.wants(uniform),
            None => self.rates.get(uniform as usize).is_some_and(|r| *r != 0.0),
        }
    }
    #[inline(always)]
    fn add(&mut self, uniform: u32, contribution: impl Fn(usize) -> f64) {
        let mut block = [0.0; B];
        map::<f64, B>(&mut block, contribution);
        self.take(uniform, &block);
    }
}

/// Which adjoints of a block are worth computing.
pub(crate) trait Reach<V, const B: usize> {
    /// Whether anything has arrived in this register of adjoints.
    fn is_live(&self, register: u32) -> bool;
    /// Notes whether something has.
    fn set(&mut self, register: u32, live: bool);
    /// Whether every number of the first block is below that of the second, and the other way round.
    fn order(&self, a: impl Fn(usize) -> V, b: impl Fn(usize) -> V) -> (bool, bool);
}

/// All adjoints are computed.
pub(crate) struct Everywhere;

impl<V, const B: usize> Reach<V, B> for Everywhere {
    #[inline(always)]
    fn is_live(&self, _: u32) -> bool {
        true
    }
    #[inline(always)]
    fn set(&mut self, _: u32, _: bool) {}
    #[inline(always)]
    fn order(&self, _: impl Fn(usize) -> V, _: impl Fn(usize) -> V) -> (bool, bool) {
        (false, false)
    }
}

/// What a minimum or maximum does not take at any point of a block is left out, with all that only leads there. Derivatives
/// are the same, but for the sign of zeros.
pub(crate) struct Chosen<'a> {
    /// For each register of adjoints, whether anything has arrived there; all true where `on` is not.
    pub live: &'a mut [bool],
    /// Whether anything is to be left out.
    pub on: bool,
}

impl<const B: usize> Reach<f64, B> for Chosen<'_> {
    #[inline(always)]
    fn is_live(&self, register: u32) -> bool {
        self.live[register as usize]
    }
    #[inline(always)]
    fn set(&mut self, register: u32, live: bool) {
        self.live[register as usize] = live;
    }
    #[inline(always)]
    fn order(&self, a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64) -> (bool, bool) {
        if !self.on {
            return (false, false);
        }
        let (mut below, mut above) = (true, true);
        for j in 0..B {
            below &= a(j) < b(j);
            above &= b(j) < a(j);
        }
        (below, above)
    }
}

/// The reverse sweep, after [`forward`]: leaves ∂F/∂x in the registers `input_adjoints`, where they are live.
#[inline(always)]
pub(crate) fn reverse<V: Scalar, const B: usize, S: Sink<V, B>, R: Reach<V, B>>(
    program: &Program,
    uniforms: &[V],
    registers: &[[V; B]],
    adjoints: &mut [[V; B]],
    sink: &mut S,
    reach: &mut R,
) {
    adjoints[program.root_adjoint as usize] = [V::from_f64(1.0); B];
    reach.set(program.root_adjoint, true);
    for back in &program.backward {
        if !reach.is_live(back.adjoint) {
            for k in 0..3 {
                drop_operand::<V, B, R>(back, k, reach);
            }
            continue;
        }
        let r = &registers[back.value as usize];
        let [a, b, _] = back.args;
        match back.code {
            Code::Input => {}
            Code::Uniform => {
                if sink.wants(a) {
                    let g = &adjoints[back.adjoint as usize];
                    sink.add(a, |j| g[j]);
                }
            }
            Code::Op(op, Mode::Slots) => {
                let (va, vb) = (&registers[a as usize], &registers[b as usize]);
                if let Op::Min | Op::Max = op {
                    let (below, above) = reach.order(|j| va[j], |j| vb[j]);
                    if below | above {
                        let taken = usize::from(below != (op == Op::Min));
                        drop_operand::<V, B, R>(back, 1 - taken, reach);
                        operand::<V, B, false, R>(back, taken, adjoints, reach, |g, _| g);
                        continue;
                    }
                }
                macro_rules! run {
                    ($op:expr) => {{
                        if const { $op.arity() == 3 } {
                            operand::<V, B, { SMALL || $op.is_slow() }, R>(
                                back,
                                2,
                                adjoints,
                                reach,
                                |g, j| pull($op, 2, g, va[j], vb[j], r[j]),
                            );
                        }
                        if const { $op.arity() >= 2 && !is_flat($op, 1) } {
                            operand::<V, B, { SMALL || $op.is_slow() }, R>(
                                back,
                                1,
                                adjoints,
                                reach,
                                |g, j| pull($op, 1, g, va[j], vb[j], r[j]),
                            );
                        }
                        if const { !is_flat($op, 0) } {
                            operand::<V, B, { SMALL || $op.is_slow() }, R>(
                                back,
                                0,
                                adjoints,
                                reach,
                                |g, j| pull($op, 0, g, va[j], vb[j], r[j]),
                            );
                        }
                    }};
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::SlotUniform) => {
                let (va, vb) = (&registers[a as usize], program.uniform(uniforms, b));
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.takes_uniform_second() && !is_flat($op, 0) } {
                            if sink.wants(b) {
                                let g = &adjoints[back.adjoint as usize];
                                sink.add(b, |j| pull($op, 1, g[j], va[j], vb, r[j]));
                            }
                            operand::<V, B, { SMALL || $op.is_slow() }, R>(
                                back,
                                0,
                                adjoints,
                                reach,
                                |g, j| pull($op, 0, g, va[j], vb, r[j]),
                            );
                        }
                    };
                }
                dispatch!(op, run)
            }
            Code::Op(op, Mode::UniformSlot) => {
                let (va, vb) = (program.uniform(uniforms, a), &registers[b as usize]);
                macro_rules! run {
                    ($op:expr) => {
                        if const { $op.takes_uniform_first() && !is_flat($op, 0) } {
                            if sink.wants(a) {
                                let g = &adjoints[back.adjoint as usize];
                                sink.add(a, |j| pull($op, 0, g[j], va, vb[j], r[j]));
                            }
                            operand::<V, B, { SMALL || $op.is_slow() }, R>(
                                back,
                                1,
                                adjoints,
                                reach,
                                |g, j| pull($op, 1, g, va, vb[j], r[j]),
                            );
                        }
                    };
                }
                dispatch!(op, run)
            }
        }
    }
}

/// Operand `k` takes nothing here.
#[inline(always)]
fn drop_operand<V: Scalar, const B: usize, R: Reach<V, B>>(back: &Back, k: usize, reach: &mut R) {
    if back.fresh & (1 << k) != 0 {
        reach.set(back.adjoints[k], false);
    }
}

/// Writes or adds to the adjoint of operand `k`. What is slow to compute is compiled once, not once for each.
#[inline(always)]
fn operand<V: Scalar, const B: usize, const SLOW: bool, R: Reach<V, B>>(
    back: &Back,
    k: usize,
    adjoints: &mut [[V; B]],
    reach: &mut R,
    contribution: impl Fn(V, usize) -> V,
) {
    if back.skip & (1 << k) != 0 {
        return;
    }
    let register = back.adjoints[k];
    let pair = [back.adjoint as usize, register as usize];
    let Ok([g, target]) = adjoints.get_disjoint_mut(pair) else { return };
    let fresh = back.fresh & (1 << k) != 0 || !reach.is_live(register);
    reach.set(register, true);
    if SLOW {
        let mut sum = [V::from_f64(0.0); B];
        map::<V, B>(&mut sum, |j| contribution(g[j], j));
        if SMALL {
            return deposit(target, &sum, fresh);
        }
        if !fresh {
            for j in 0..B {
                sum[j] = target[j] + sum[j];
            }
        }
        *target = sum;
    } else if fresh {
        map::<V, B>(target, |j| contribution(g[j], j));
    } else {
        for j in 0..B {
            target[j] = target[j] + contribution(g[j], j);
        }
    }
}

/// Writes a block of contributions, or adds it.
#[inline(never)]
fn deposit<V: Scalar, const B: usize>(target: &mut [V; B], sum: &[V; B], fresh: bool) {
    for j in 0..B {
        target[j] = if fresh { sum[j] } else { target[j] + sum[j] };
    }
}

/// Carries the rows of adjoints from the uniforms back to the parameters they depend on.
#[inline(always)]
pub(crate) fn reverse_uniforms<const B: usize>(
    program: &[Uniform],
    values: &[f64],
    sink: &mut Full<'_, f64, B>,
) {
    for i in (0..program.len()).rev() {
        let Uniform::Op(op, args) = program[i] else { continue };
        if !sink.wants(i as u32) || !sink.touched[sink.row_of[i] as usize] {
            continue;
        }
        let g = sink.rows[sink.row_of[i] as usize];
        let [a, b, _] = args.map(|s| values[s as usize]);
        let r = values[i];
        if SMALL {
            for k in (0..op.arity()).filter(|&k| !is_flat(op, k)) {
                if !sink.wants(args[k]) {
                    continue;
                }
                sink.add(args[k], |j| pull(op, k, g[j], a, b, r));
            }
            continue;
        }
        // One copy for each operation: to choose it again for every point of the block costs more than the sums.
        macro_rules! run {
            ($op:expr) => {{
                if const { !is_flat($op, 0) } && sink.wants(args[0]) {
                    sink.add(args[0], |j| pull($op, 0, g[j], a, b, r));
                }
                if const { $op.arity() >= 2 && !is_flat($op, 1) } && sink.wants(args[1]) {
                    sink.add(args[1], |j| pull($op, 1, g[j], a, b, r));
                }
                if const { $op.arity() == 3 && !is_flat($op, 2) } && sink.wants(args[2]) {
                    sink.add(args[2], |j| pull($op, 2, g[j], a, b, r));
                }
            }};
        }
        dispatch!(op, run);
    }
}
