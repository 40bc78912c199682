//! Pruning: the tape that is left when it is known that the coordinates stay in a box. The losing side of a
//! minimum, maximum or selection disappears, and so does all that is constant there: near any one place few
//! operations of a large model matter (the sparsity that WH94's conclusion asks for).

use crate::interval::Interval;
use crate::lanes::Pass;
use crate::op::{Op, apply, is_flat};
use crate::plain::{forward, reverse};
use crate::tape::{Code, Instr, Mode, Tape, Uniform};

/// Working memory of pruning, kept between calls.
#[derive(Default)]
pub(crate) struct Scratch {
    /// The intervals of the boxes that are looked at.
    pub pass: Pass,
    /// What each instruction of the old tape became; meaningless for those that were not reached.
    became: Vec<Operand>,
    reached: Vec<bool>,
    kept: Vec<u32>,
}

/// What an instruction turned out to be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operand {
    /// An instruction: of the old tape while looking for what is kept, of the new one afterwards.
    Slot(u32),
    Uniform(u32),
}

impl Tape {
    /// The interval of the function over a box, given the uniforms' intervals.
    pub(crate) fn interval(&self, uniforms: &[Interval], inputs: &[Interval]) -> Interval {
        let mut values = Vec::with_capacity(self.instrs.len());
        forward(self, uniforms, inputs, &mut values);
        values[self.instrs.len() - 1]
    }

    /// The intervals of the derivatives with respect to the inputs.
    pub(crate) fn interval_gradient(
        &self,
        uniforms: &[Interval],
        inputs: &[Interval],
        gradient: &mut [Interval],
    ) {
        let (mut values, mut adjoints) = (Vec::new(), Vec::new());
        forward(self, uniforms, inputs, &mut values);
        reverse(self, uniforms, &values, &mut adjoints);
        for (number, g) in gradient.iter_mut().enumerate() {
            *g = self.input(number).map_or(Interval::ZERO, |at| adjoints[at]);
        }
    }

    /// Whether pruning with this `tail` needs the adjoints of the pass.
    pub(crate) fn drops_tails(&self, tail: f64) -> bool {
        tail > 0.0 && self.exps > 0
    }

    /// The tape for box `lane` of the pass in `scratch`, which ran over this tape with the same `uniforms`.
    ///
    /// Values in the box are the same to the last bit, derivatives but for the order of their sums; except that
    /// exponentials which together change F by no more than `exps * tail` are dropped (`tail` = 0: none are; `exps`
    /// is their number in the tape that was compiled, so that pruning again and again stays within the bound).
    pub(crate) fn pruned(
        &self,
        uniforms: &[Interval],
        tail: f64,
        lane: usize,
        scratch: &mut Scratch,
    ) -> Tape {
        let drop_tails = self.drops_tails(tail);
        let Scratch { pass, became, reached, kept } = scratch;
        let mut p =
            Pruner { tape: self, shared: uniforms, pass, lane, own: self.own.clone(), instrs: Vec::new() };
        let is_tail = |i| drop_tails && pass.adjoint(i, lane).magnitude() * pass.value(i, lane).hi <= tail;
        p.find(became, reached, kept, is_tail);
        p.rewrite(became, kept)
    }
}

struct Pruner<'a> {
    tape: &'a Tape,
    shared: &'a [Interval],
    pass: &'a Pass,
    lane: usize,
    own: Vec<f64>,
    instrs: Vec<Instr>,
}

impl Pruner<'_> {
    /// The interval of an instruction of the old tape.
    #[inline(always)]
    fn value(&self, i: u32) -> Interval {
        self.pass.value(i as usize, self.lane)
    }

    /// The number of a constant.
    fn constant(&mut self, v: f64) -> u32 {
        let known = self.own.iter().position(|c| c.to_bits() == v.to_bits());
        let k = known.unwrap_or_else(|| {
            self.own.push(v);
            self.own.len() - 1
        });
        (self.shared.len() + k) as u32
    }

    /// The value of an operand that is a constant.
    fn known(&self, o: Operand) -> Option<f64> {
        let Operand::Uniform(u) = o else { return None };
        match self.tape.uniforms.list.get(u as usize) {
            None => Some(self.own[u as usize - self.shared.len()]),
            Some(Uniform::Const(c)) => Some(*c),
            Some(_) => None,
        }
    }

    /// From the result back: what is reached, and of that, what is a constant or one of its operands here.
    fn find(
        &mut self,
        became: &mut Vec<Operand>,
        reached: &mut Vec<bool>,
        kept: &mut Vec<u32>,
        is_tail: impl Fn(usize) -> bool,
    ) {
        let n = self.tape.instrs.len();
        became.clear();
        became.resize(n, Operand::Uniform(0));
        reached.clear();
        reached.resize(n, false);
        reached[n - 1] = true;
        kept.clear();
        for i in (0..n).rev() {
            if !reached[i] {
                continue;
            }
            kept.push(i as u32);
            let instr = self.tape.instrs[i];
            let (op, mode) = match instr.code {
                Code::Input => {
                    became[i] = Operand::Slot(i as u32);
                    continue;
                }
                Code::Uniform => {
                    became[i] = Operand::Uniform(instr.args[0]);
                    continue;
                }
                Code::Op(op, mode) => (op, mode),
            };
            let here = self.value(i as u32);
            if op == Op::Exp && is_tail(i) {
                became[i] = Operand::Uniform(self.constant(0.0));
                continue;
            }
            // In a box without extent −x and |x| are single numbers too, but ones that change with x.
            let flat = instr.slots().all(|k| is_flat(op, k));
            if flat && here.lo == here.hi && here.lo.is_finite() {
                became[i] = Operand::Uniform(self.constant(here.lo));
                continue;
            }
            let slots = instr.slots();
            let choice = matches!(op, Op::Min | Op::Max | Op::Abs | Op::Choose)
                .then(|| self.winner(op, mode, instr.args));
            match choice.flatten() {
                Some(k) if slots.contains(&k) => {
                    became[i] = Operand::Slot(instr.args[k]);
                    reached[instr.args[k] as usize] = true;
                }
                Some(k) => became[i] = Operand::Uniform(instr.args[k]),
                None => {
                    became[i] = Operand::Slot(i as u32);
                    for k in slots {
                        reached[instr.args[k] as usize] = true;
                    }
                }
            }
        }
    }

    /// The operand that a choice surely takes here.
    fn winner(&self, op: Op, mode: Mode, args: [u32; 3]) -> Option<usize> {
        let interval = |k: usize| match (mode, k) {
            (Mode::SlotUniform, 1) | (Mode::UniformSlot, 0) => self.uniform_interval(args[k]),
            _ => self.value(args[k]),
        };
        let (a, b) = (interval(0), interval(1));
        match op {
            Op::Min if a.hi < b.lo => Some(0),
            Op::Min if b.hi < a.lo => Some(1),
            Op::Max if a.lo > b.hi => Some(0),
            Op::Max if b.lo > a.hi => Some(1),
            Op::Abs if a.lo > 0.0 => Some(0),
            Op::Choose if !a.has_zero() => Some(1),
            Op::Choose if a == Interval::ZERO => Some(2),
            _ => None,
        }
    }

    fn uniform_interval(&self, u: u32) -> Interval {
        match self.shared.get(u as usize) {
            Some(v) => *v,
            None => {
                let c = self.own[u as usize - self.shared.len()];
                Interval::new(c, c)
            }
        }
    }

    /// From the first instruction on: writes the kept ones with their operands resolved, folding constants.
    fn rewrite(mut self, became: &mut [Operand], kept: &[u32]) -> Tape {
        self.instrs.reserve(kept.len());
        for &i in kept.iter().rev() {
            let i = i as usize;
            became[i] = match became[i] {
                Operand::Uniform(u) => Operand::Uniform(u),
                Operand::Slot(s) if s as usize != i => became[s as usize],
                Operand::Slot(_) => self.emit(i, became),
            };
        }
        let root = became[self.tape.instrs.len() - 1];
        let root = self.slot(root);
        self.instrs.truncate(root as usize + 1);
        let tape = Tape {
            uniforms: self.tape.uniforms.clone(),
            own: self.own,
            instrs: self.instrs,
            exps: self.tape.exps,
        };
        tape.without_unused()
    }

    fn push(&mut self, code: Code, args: [u32; 3]) -> Operand {
        self.instrs.push(Instr::new(code, args));
        Operand::Slot(self.instrs.len() as u32 - 1)
    }

    /// An instruction of the new tape; a uniform is broadcast by one of its own.
    fn slot(&mut self, o: Operand) -> u32 {
        match o {
            Operand::Slot(s) => s,
            Operand::Uniform(u) => {
                self.instrs.push(Instr::new(Code::Uniform, [u; 3]));
                self.instrs.len() as u32 - 1
            }
        }
    }

    fn emit(&mut self, i: usize, became: &[Operand]) -> Operand {
        let instr = self.tape.instrs[i];
        let Code::Op(op, mode) = instr.code else { return self.push(instr.code, instr.args) };
        let operand = |k: usize| match (mode, k) {
            (Mode::SlotUniform, 1) | (Mode::UniformSlot, 0) => Operand::Uniform(instr.args[k]),
            _ => became[instr.args[k] as usize],
        };
        let n = op.arity();
        let a = operand(0);
        let b = if n > 1 { operand(1) } else { a };
        let c = if n > 2 { operand(2) } else { a };
        if op == Op::Abs && self.value(i as u32).lo > 0.0 && self.value(instr.args[0]).hi < 0.0 {
            let s = self.slot(a);
            return self.push(Code::Op(Op::Neg, Mode::Slots), [s; 3]);
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
                let s = self.slot(b);
                return self.push(Code::Op(Op::Neg, Mode::Slots), [s; 3]);
            }
            _ => {}
        }
        match (n, a, b) {
            (2, Operand::Uniform(u), Operand::Slot(s)) if op.takes_uniform_first() => {
                self.push(Code::Op(op, Mode::UniformSlot), [u, s, s])
            }
            (2, Operand::Uniform(u), Operand::Slot(s)) if op.commutes() => {
                self.push(Code::Op(op, Mode::SlotUniform), [s, u, s])
            }
            (2, _, Operand::Uniform(u)) if op.takes_uniform_second() => {
                let s = self.slot(a);
                self.push(Code::Op(op, Mode::SlotUniform), [s, u, s])
            }
            (1, ..) => {
                let s = self.slot(a);
                self.push(Code::Op(op, Mode::Slots), [s; 3])
            }
            (2, ..) => {
                let (s, t) = (self.slot(a), self.slot(b));
                self.push(Code::Op(op, Mode::Slots), [s, t, s])
            }
            _ => {
                let args = [a, b, c].map(|o| self.slot(o));
                self.push(Code::Op(op, Mode::Slots), args)
            }
        }
    }
}

impl Tape {
    /// Removes instructions that folding has left without a use.
    fn without_unused(mut self) -> Tape {
        let n = self.instrs.len();
        let mut used = vec![false; n];
        used[n - 1] = true;
        let mut count = 0;
        for i in (0..n).rev() {
            if used[i] {
                count += 1;
                for k in self.instrs[i].slots() {
                    used[self.instrs[i].args[k] as usize] = true;
                }
            }
        }
        if count == n {
            return self;
        }
        let mut number = vec![0u32; n];
        let mut next = 0u32;
        for i in 0..n {
            if used[i] {
                number[i] = next;
                let mut instr = self.instrs[i];
                let slots = instr.slots();
                for k in slots.clone() {
                    instr.args[k] = number[instr.args[k] as usize];
                }
                // Operands that the operation lacks repeat one that it has.
                if let Code::Op(_, Mode::Slots) = instr.code {
                    let first = instr.args[0];
                    instr.args[slots.end..].fill(first);
                }
                self.instrs[next as usize] = instr;
                next += 1;
            }
        }
        self.instrs.truncate(count);
        self
    }
}
