//! Pruning: the tape that is left when it is known that the coordinates stay in a box. The losing side of a
//! minimum, maximum or selection disappears, and so does all that is constant there: near any one place few
//! operations of a large model matter (the sparsity that WH94's conclusion asks for).

use crate::eval::{Ignore, forward, reverse};
use crate::interval::Interval;
use crate::op::{Op, apply};
use crate::tape::{Code, Instr, Mode, Tape, Uniform};

/// Working memory of the interval sweeps, kept between calls.
#[derive(Default)]
pub(crate) struct IntervalScratch {
    slots: Vec<[Interval; 1]>,
    adjoints: Vec<[Interval; 1]>,
    replaced: Vec<Operand>,
    live: Vec<u32>,
}

/// What an instruction turned out to be.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Slot(u32),
    Uniform(u32),
}

impl Tape {
    /// The interval of the function over a box, given the uniforms' intervals.
    pub(crate) fn interval(
        &self,
        uniforms: &[Interval],
        inputs: &[[Interval; 1]],
        scratch: &mut IntervalScratch,
    ) -> Interval {
        scratch.slots.resize(self.instrs.len().max(scratch.slots.len()), [Interval::ZERO]);
        forward::<Interval, 1>(self, uniforms, inputs, &mut scratch.slots);
        scratch.slots[self.instrs.len() - 1][0]
    }

    /// The intervals of the derivatives with respect to the inputs, after [`Tape::interval`].
    pub(crate) fn interval_gradient(
        &self,
        uniforms: &[Interval],
        scratch: &mut IntervalScratch,
        gradient: &mut [Interval],
    ) {
        self.interval_adjoints(uniforms, scratch);
        for (axis, g) in gradient.iter_mut().enumerate() {
            *g = self.input_slot(axis).map_or(Interval::ZERO, |slot| scratch.adjoints[slot][0]);
        }
    }

    fn interval_adjoints(&self, uniforms: &[Interval], scratch: &mut IntervalScratch) {
        scratch.adjoints.resize(self.instrs.len().max(scratch.adjoints.len()), [Interval::ZERO]);
        reverse::<Interval, 1, _>(self, uniforms, &scratch.slots, &mut scratch.adjoints, &mut Ignore);
    }

    /// The tape for the box of the last [`Tape::interval`] call with the same `uniforms` and `scratch`.
    ///
    /// Values and derivatives in the box are the same to the last bit, except that exponentials which together
    /// change F by no more than `exps * tail` are dropped (`tail` = 0: none are; `exps` is their number in the
    /// tape that was compiled, so that pruning again and again stays within the bound).
    pub(crate) fn pruned(&self, uniforms: &[Interval], tail: f64, scratch: &mut IntervalScratch) -> Tape {
        let drop_tails = tail > 0.0 && self.exps > 0;
        if drop_tails {
            self.interval_adjoints(uniforms, scratch);
        }
        let mut p = Pruner {
            tape: self,
            uniforms,
            slots: &scratch.slots,
            replaced: std::mem::take(&mut scratch.replaced),
            instrs: self.instrs.clone(),
            own: self.own.clone(),
        };
        p.replaced.clear();
        for i in 0..p.instrs.len() {
            let tail_here = |adjoint: Interval, e: Interval| {
                let d = adjoint.magnitude() * e.hi;
                d <= tail
            };
            let instr = self.instrs[i];
            let r = if drop_tails
                && matches!(instr.code, Code::Op(Op::Exp, _))
                && tail_here(scratch.adjoints[i][0], scratch.slots[i][0])
            {
                Operand::Uniform(p.constant(0.0))
            } else {
                p.simplify(i)
            };
            p.replaced.push(r);
        }
        let root = p.instrs.len() as u32 - 1;
        let root = p.as_slot(root);
        let Pruner { replaced, instrs, own, .. } = p;
        scratch.replaced = replaced;
        compact(self, instrs, own, root, &mut scratch.live)
    }
}

struct Pruner<'a> {
    tape: &'a Tape,
    uniforms: &'a [Interval],
    slots: &'a [[Interval; 1]],
    replaced: Vec<Operand>,
    instrs: Vec<Instr>,
    own: Vec<f64>,
}

impl Pruner<'_> {
    fn constant(&mut self, v: f64) -> u32 {
        let base = self.tape.program.list.len();
        let known = self.own.iter().position(|c| c.to_bits() == v.to_bits());
        let k = known.unwrap_or_else(|| {
            self.own.push(v);
            self.own.len() - 1
        });
        (base + k) as u32
    }

    /// The value of an operand that is a constant.
    fn known(&self, o: Operand) -> Option<f64> {
        let Operand::Uniform(u) = o else { return None };
        match self.tape.program.list.get(u as usize) {
            None => Some(self.own[u as usize - self.tape.program.list.len()]),
            Some(Uniform::Const(c)) => Some(*c),
            Some(_) => None,
        }
    }

    fn interval(&self, o: Operand) -> Interval {
        match o {
            Operand::Slot(s) => self.slots[s as usize][0],
            Operand::Uniform(u) => match self.uniforms.get(u as usize) {
                Some(v) => *v,
                None => Interval::new(
                    self.own[u as usize - self.uniforms.len()],
                    self.own[u as usize - self.uniforms.len()],
                ),
            },
        }
    }

    /// A slot that holds what instruction `i` became; an instruction that became a uniform broadcasts it.
    fn as_slot(&mut self, i: u32) -> u32 {
        match self.replaced[i as usize] {
            Operand::Slot(s) => s,
            Operand::Uniform(u) => {
                self.instrs[i as usize] = Instr::new(Code::Uniform, [u; 3]);
                i
            }
        }
    }

    fn operand(&self, mode: Mode, k: usize, arg: u32) -> Operand {
        let uniform = matches!((mode, k), (Mode::SlotUniform, 1) | (Mode::UniformSlot, 0));
        if uniform { Operand::Uniform(arg) } else { self.replaced[arg as usize] }
    }

    /// Decides what instruction `i` is in this box, rewriting it in place where it stays.
    fn simplify(&mut self, i: usize) -> Operand {
        let instr = self.tape.instrs[i];
        let stay = Operand::Slot(i as u32);
        let (op, mode) = match instr.code {
            Code::Input => return stay,
            Code::Uniform => return Operand::Uniform(instr.args[0]),
            Code::Op(op, mode) => (op, mode),
        };
        let here = self.slots[i][0];
        if here.lo == here.hi && here.lo.is_finite() {
            return Operand::Uniform(self.constant(here.lo));
        }
        let n = op.arity();
        let a = self.operand(mode, 0, instr.args[0]);
        let b = if n > 1 { self.operand(mode, 1, instr.args[1]) } else { a };
        let c = if n > 2 { self.operand(mode, 2, instr.args[2]) } else { a };
        let (ia, ib) = (self.interval(a), self.interval(b));
        match op {
            Op::Min if ia.hi < ib.lo => return a,
            Op::Min if ib.hi < ia.lo => return b,
            Op::Max if ia.lo > ib.hi => return a,
            Op::Max if ib.lo > ia.hi => return b,
            Op::Abs if ia.lo > 0.0 => return a,
            Op::Abs if ia.hi < 0.0 => {
                if let Operand::Slot(s) = a {
                    self.instrs[i] = Instr::new(Code::Op(Op::Neg, Mode::Slots), [s; 3]);
                    return stay;
                }
            }
            Op::Choose if !ia.has_zero() => return b,
            Op::Choose if ia == Interval::ZERO => return c,
            _ => {}
        }
        let (ka, kb, kc) = (self.known(a), self.known(b), self.known(c));
        if let (Some(x), Some(y), Some(z)) = (ka, kb, kc) {
            return Operand::Uniform(self.constant(apply(op, x, y, z)));
        }
        match (op, ka, kb) {
            (Op::Add, Some(0.0), _) | (Op::Mul, Some(1.0), _) => return b,
            (Op::Add | Op::Sub, _, Some(0.0)) | (Op::Mul | Op::Div, _, Some(1.0)) => return a,
            (Op::Mul | Op::Div, Some(0.0), _) | (Op::Mul, _, Some(0.0)) => {
                return Operand::Uniform(self.constant(0.0));
            }
            (Op::Sub, Some(0.0), _) => {
                if let Operand::Slot(s) = b {
                    self.instrs[i] = Instr::new(Code::Op(Op::Neg, Mode::Slots), [s; 3]);
                    return stay;
                }
            }
            _ => {}
        }
        self.instrs[i] = match (n, a, b) {
            (2, Operand::Slot(s), Operand::Uniform(u)) => {
                Instr::new(Code::Op(op, Mode::SlotUniform), [s, u, s])
            }
            (2, Operand::Uniform(u), Operand::Slot(s)) if op.commutes() => {
                Instr::new(Code::Op(op, Mode::SlotUniform), [s, u, s])
            }
            (2, Operand::Uniform(u), Operand::Slot(s)) => {
                Instr::new(Code::Op(op, Mode::UniformSlot), [u, s, s])
            }
            (2, Operand::Uniform(u), Operand::Uniform(v)) => match mode {
                // One of the two was a slot; it broadcasts the uniform that it became.
                Mode::UniformSlot => {
                    let s = self.as_slot(instr.args[1]);
                    Instr::new(Code::Op(op, Mode::UniformSlot), [u, s, s])
                }
                _ => {
                    let s = self.as_slot(instr.args[0]);
                    Instr::new(Code::Op(op, Mode::SlotUniform), [s, v, s])
                }
            },
            _ => {
                let mut args = instr.args;
                for arg in &mut args[..n] {
                    *arg = self.as_slot(*arg);
                }
                let filler = args[0];
                args[n..].fill(filler);
                Instr::new(Code::Op(op, Mode::Slots), args)
            }
        };
        stay
    }
}

/// Removes what the root does not use and renumbers the rest.
fn compact(tape: &Tape, instrs: Vec<Instr>, own: Vec<f64>, root: u32, number: &mut Vec<u32>) -> Tape {
    const DEAD: u32 = u32::MAX;
    number.clear();
    number.resize(instrs.len(), DEAD);
    number[root as usize] = 0;
    let mut used = 0;
    for i in (0..=root as usize).rev() {
        if number[i] != DEAD {
            used += 1;
            for (_, s) in instrs[i].slots() {
                number[s as usize] = 0;
            }
        }
    }
    let mut kept = Vec::with_capacity(used);
    for i in 0..=root as usize {
        if number[i] == DEAD {
            continue;
        }
        number[i] = kept.len() as u32;
        let mut instr = instrs[i];
        let mut args = instr.args;
        for (k, s) in instrs[i].slots() {
            args[k] = number[s as usize];
        }
        if let Code::Op(op, mode) = instr.code {
            let filler = if mode == Mode::UniformSlot { args[1] } else { args[0] };
            args[op.arity()..].fill(filler);
        }
        instr.args = args;
        kept.push(instr);
    }
    Tape { program: tape.program.clone(), own, instrs: kept, inputs: Vec::new(), exps: tape.exps }.finish()
}
