//! Registers: where the two sweeps over a tape keep their numbers. Values that the reverse sweep needs stay;
//! all others, and all adjoints, share registers as soon as they are done with, so that the working set of a
//! long tape stays in the cache. Adding passes an adjoint on without moving it.

use std::cell::RefCell;

use crate::arrange::Arrange;
use crate::op::{Op, is_flat};
use crate::tape::{Code, Mode, Tape};

/// What a program is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Values only.
    Value,
    /// Values and derivatives with respect to the inputs.
    Inputs,
    /// Values and derivatives with respect to inputs and uniforms.
    Everything,
}

/// A step of the forward sweep: registers of values, except for uniforms and input numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub code: Code,
    pub out: u32,
    pub args: [u32; 3],
}

/// A step of the reverse sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Back {
    pub code: Code,
    /// Bit k: operand k is reached for the first time: its adjoint is written, not added to.
    pub fresh: u8,
    /// Bit k: operand k takes nothing here (it is flat, no register, or has inherited this step's adjoint).
    pub skip: u8,
    /// Register of this step's adjoint, and of its value.
    pub adjoint: u32,
    pub value: u32,
    /// Registers of the operands' adjoints, and of their values (or a uniform).
    pub adjoints: [u32; 3],
    pub args: [u32; 3],
}

/// A tape with registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Program {
    pub forward: Vec<Step>,
    pub backward: Vec<Back>,
    /// Number of value registers and of adjoint registers.
    pub values: usize,
    pub adjoints: usize,
    /// Register of the result, and of its adjoint.
    pub root: u32,
    pub root_adjoint: u32,
    /// Numbers of the inputs that occur.
    pub inputs: Vec<u32>,
    /// (input number, adjoint register) where the result depends on the input with a derivative.
    pub input_adjoints: Vec<(u32, u32)>,
    /// The tape's own constants, and where their numbers begin.
    own: Vec<f64>,
    first_own: usize,
}

const NONE: u32 = u32::MAX;

thread_local! {
    static WORK: RefCell<Work> = RefCell::new(Work::default());
}

/// Working memory, kept between calls: many short tapes are compiled one after the other.
#[derive(Default)]
struct Work {
    /// The last instruction that reads each value, and whether the reverse sweep does.
    last_use: Vec<u32>,
    stays: Vec<bool>,
    /// Registers of values and of adjoints.
    values: Vec<u32>,
    adjoints: Vec<u32>,
    /// How many steps contribute to each adjoint, and how many adjoints live in each register.
    contributions: Vec<u32>,
    sharers: Vec<u32>,
    pool: Pool,
}

/// `n` times `value`.
fn refill<T: Clone>(v: &mut Vec<T>, n: usize, value: T) {
    v.clear();
    v.resize(n, value);
}

/// Hands out registers.
#[derive(Default)]
struct Pool {
    free: Vec<u32>,
    count: u32,
}

impl Pool {
    fn reset(&mut self) {
        self.free.clear();
        self.count = 0;
    }

    fn take(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        })
    }
}

/// Whether the reverse step of an operation reads (operand 0, operand 1, its result).
fn reads(op: Op, mode: Mode, purpose: Purpose) -> (bool, bool, bool) {
    let uniform_too = purpose == Purpose::Everything;
    match (op, mode) {
        (Op::Abs | Op::Square | Op::Ln | Op::Sin | Op::Cos | Op::Asin | Op::Acos | Op::Atan, _) => {
            (true, false, false)
        }
        (Op::Sqrt | Op::Exp | Op::Tan, _) => (false, false, true),
        (Op::Mul, Mode::Slots) => (true, true, false),
        (Op::Mul, _) => (uniform_too, uniform_too, false),
        (Op::Div, Mode::SlotUniform) => (false, false, uniform_too),
        (Op::Div, _) => (false, true, true),
        (Op::Min | Op::Max | Op::Atan2 | Op::Mod | Op::SquaredDifference, _) => (true, true, false),
        (Op::Pow, _) => (true, true, true),
        (Op::Choose, _) => (true, false, false),
        _ => (false, false, false),
    }
}

/// Whether operand `k`'s adjoint is this step's own, unchanged.
fn passes(op: Op, k: usize) -> bool {
    matches!((op, k), (Op::Add, _) | (Op::Sub | Op::Mod, 0))
}

impl Program {
    pub(crate) fn new(tape: &Tape, purpose: Purpose) -> Program {
        WORK.with_borrow_mut(|work| Self::with(tape, purpose, work))
    }

    fn with(tape: &Tape, purpose: Purpose, work: &mut Work) -> Program {
        let n = tape.instrs.len();
        let Work { last_use, stays, values: register, pool, .. } = &mut *work;
        refill(last_use, n, 0);
        refill(stays, n, false);
        stays[n - 1] = true;
        for (i, instr) in tape.instrs.iter().enumerate() {
            for k in instr.slots() {
                last_use[instr.args[k] as usize] = i as u32;
            }
            if let (Code::Op(op, mode), true) = (instr.code, purpose != Purpose::Value) {
                let (a, b, r) = reads(op, mode, purpose);
                let slots = instr.slots();
                stays[i] |= r;
                for (k, read) in [(0, a), (1, b)] {
                    if read && slots.contains(&k) {
                        stays[instr.args[k] as usize] = true;
                    }
                }
            }
        }
        let mut p = Program {
            forward: Vec::with_capacity(n),
            backward: Vec::new(),
            values: 0,
            adjoints: 0,
            root: 0,
            root_adjoint: 0,
            inputs: Vec::new(),
            input_adjoints: Vec::new(),
            own: tape.own.clone(),
            first_own: tape.uniforms.list.len(),
        };
        pool.reset();
        refill(register, n, NONE);
        for (i, instr) in tape.instrs.iter().enumerate() {
            // The result's register is taken before the operands' are given back: they never coincide.
            let out = pool.take();
            register[i] = out;
            let mut args = instr.args;
            for k in instr.slots() {
                let slot = instr.args[k] as usize;
                args[k] = register[slot];
                if last_use[slot] == i as u32 && !stays[slot] {
                    // An operand that occurs twice is given back once.
                    last_use[slot] = NONE;
                    pool.free.push(register[slot]);
                }
            }
            if let Code::Op(_, Mode::Slots) = instr.code {
                let first = args[0];
                args[instr.slots().end..].fill(first);
            }
            if instr.code == Code::Input {
                p.inputs.push(instr.args[0]);
            }
            p.forward.push(Step { code: instr.code, out, args });
        }
        p.values = pool.count as usize;
        p.root = register[n - 1];
        if purpose != Purpose::Value {
            p.reverse(tape, work, purpose);
        }
        p
    }

    fn reverse(&mut self, tape: &Tape, work: &mut Work, purpose: Purpose) {
        let n = tape.instrs.len();
        let Work { values: value, adjoints: register, contributions, sharers, pool, .. } = work;
        pool.reset();
        refill(register, n, NONE);
        register[n - 1] = pool.take();
        self.root_adjoint = register[n - 1];
        // An adjoint with one contribution is never written again: where that is a sum's own, they share a register.
        refill(contributions, n, 0);
        for instr in &tape.instrs {
            if let Code::Op(op, _) = instr.code {
                for k in instr.slots().filter(|&k| !is_flat(op, k)) {
                    contributions[instr.args[k] as usize] += 1;
                }
            }
        }
        refill(sharers, 1, 1);
        self.backward.reserve(n);
        for (i, instr) in tape.instrs.iter().enumerate().rev() {
            let own = register[i];
            if own == NONE {
                continue;
            }
            let op = match instr.code {
                Code::Input => {
                    self.input_adjoints.push((instr.args[0], own));
                    continue;
                }
                Code::Uniform => None,
                Code::Op(op, _) => Some(op),
            };
            let slots = instr.slots();
            let takes = |k: usize| slots.contains(&k) && op.is_some_and(|op| !is_flat(op, k));
            let passed = |k: usize| takes(k) && op.is_some_and(|op| passes(op, k));
            let mut skip = 0;
            for k in (0..2).filter(|&k| passed(k)) {
                let slot = instr.args[k] as usize;
                if contributions[slot] == 1 {
                    register[slot] = own;
                    sharers[own as usize] += 1;
                    skip |= 1 << k;
                }
            }
            // Else one operand that is reached for the first time may inherit the register from the last sharer.
            let first = |k: usize| register[instr.args[k] as usize] == NONE;
            let twice = slots.len() > 1 && instr.args[0] == instr.args[1];
            let alone = sharers[own as usize] == 1 && !twice;
            let heir = (0..2).find(|&k| alone && passed(k) && first(k));
            let mut back = Back {
                code: instr.code,
                fresh: 0,
                skip,
                adjoint: own,
                value: value[i],
                adjoints: [own; 3],
                args: instr.args,
            };
            for k in 0..3 {
                let slot = instr.args[k] as usize;
                if slots.contains(&k) {
                    back.args[k] = value[slot];
                }
                if !takes(k) || heir == Some(k) {
                    back.skip |= 1 << k;
                }
            }
            if let Code::Op(_, Mode::Slots) = instr.code {
                let first = back.args[0];
                back.args[slots.end..].fill(first);
            }
            // In the order of the sweep: from the last operand to the first.
            for k in (0..3).rev().filter(|&k| back.skip & (1 << k) == 0) {
                let slot = instr.args[k] as usize;
                if register[slot] == NONE {
                    register[slot] = pool.take();
                    sharers.resize(pool.count as usize, 0);
                    sharers[register[slot] as usize] = 1;
                    back.fresh |= 1 << k;
                }
                back.adjoints[k] = register[slot];
            }
            match heir {
                Some(k) => register[instr.args[k] as usize] = own,
                None => {
                    sharers[own as usize] -= 1;
                    if sharers[own as usize] == 0 {
                        pool.free.push(own);
                    }
                }
            }
            let uniform =
                matches!(instr.code, Code::Uniform | Code::Op(_, Mode::SlotUniform | Mode::UniformSlot));
            if back.skip != 7 || (uniform && purpose == Purpose::Everything) {
                self.backward.push(back);
            }
        }
        self.input_adjoints.arrange();
        self.adjoints = pool.count as usize;
    }

    /// The value of uniform `u`, given those that the tapes share.
    #[inline(always)]
    pub(crate) fn uniform<V: crate::Scalar>(&self, shared: &[V], u: u32) -> V {
        match shared.get(u as usize) {
            Some(v) => *v,
            None => V::from_f64(self.own[u as usize - self.first_own]),
        }
    }

    /// The adjoint register of input `number`.
    pub(crate) fn input_adjoint(&self, number: usize) -> Option<usize> {
        self.input_adjoints.iter().find(|(n, _)| *n as usize == number).map(|(_, r)| *r as usize)
    }
}
