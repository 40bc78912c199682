//! Pruning: the tape that is left when it is known that the coordinates stay in a box. The losing side of a
//! minimum, maximum or selection disappears, and so does all that is constant there: near any one place few
//! operations of a large model matter (the sparsity that WH94's conclusion asks for).

use pulp::{Arch, NullaryFnOnce};

use crate::interval::Interval;
use crate::lanes::{LANES, Lanes, Pass};
use crate::op::{Op, apply};
use crate::plain::{Adjoints, forward, reverse};
use crate::tape::{Code, Instr, Mode, Tape, Uniform};

/// Working memory of pruning, kept between calls.
#[derive(Default)]
pub(crate) struct Scratch {
    /// The intervals of the boxes that are looked at.
    pub pass: Pass,
    /// In which boxes each instruction of the old tape is reached: bit l is box l.
    reached: Vec<u8>,
    /// For each box, from the result back, what is reached and what becomes of it.
    kept: [Vec<Kept>; LANES],
    /// What each instruction of the old tape became; meaningless for those that were not reached.
    became: Vec<Operand>,
}

/// An instruction that is reached in a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept {
    pub instr: u32,
    pub fate: Fate,
}

impl Scratch {
    /// What is reached in box `lane`, from the result back, after [`Tape::decide`].
    pub(crate) fn kept(&self, lane: usize) -> &[Kept] {
        &self.kept[lane]
    }
}

/// What becomes of an instruction.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fate {
    /// It stays.
    Stay,
    /// It is its operand of this number.
    Take(u8),
    /// It is the constant that its interval has shrunk to.
    Point,
    /// It is an exponential that is too small to matter.
    Tail,
}

/// What an instruction turned out to be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operand {
    /// An instruction of the new tape.
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
        let (mut values, mut adjoints) = (Vec::new(), Adjoints::default());
        forward(self, uniforms, inputs, &mut values);
        reverse(self, uniforms, &values, &mut adjoints);
        for (number, g) in gradient.iter_mut().enumerate() {
            *g = self.input(number).map_or(Interval::ZERO, |at| adjoints.list[at]);
        }
    }

    /// Whether pruning with this `tail` needs the adjoints of the pass.
    pub(crate) fn drops_tails(&self, tail: f64) -> bool {
        tail > 0.0 && self.exps > 0
    }

    /// Whether there is anything that a box may decide: without choices and tails a tape stays what it is.
    pub(crate) fn may_be_pruned(&self, tail: f64) -> bool {
        use Op::{Abs, Ceil, Choose, Floor, Less, Max, Min, Round};
        let open =
            |i: &Instr| matches!(i.code, Code::Op(Min | Max | Abs | Choose | Floor | Ceil | Round | Less, _));
        self.drops_tails(tail) || self.instrs.iter().any(open)
    }

    /// Decides for the first `lanes` boxes of the pass in `scratch`, which ran over this tape with the same
    /// `uniforms`, what is left there; then [`Tape::pruned`] makes the tapes.
    pub(crate) fn decide(&self, uniforms: &[Interval], tail: f64, lanes: usize, scratch: &mut Scratch) {
        let Scratch { pass, reached, kept, .. } = scratch;
        let tail = self.drops_tails(tail).then_some(tail);
        Arch::new().dispatch(Decide { tape: self, shared: uniforms, pass, lanes, tail, reached, kept });
    }

    /// The tape for box `lane`, after [`Tape::decide`].
    ///
    /// Values in the box are the same to the last bit, derivatives but for the order of their sums; except that
    /// exponentials which together change F by no more than `exps * tail` are dropped (`tail` = 0: none are; `exps`
    /// is their number in the tape that was compiled, so that pruning again and again stays within the bound).
    pub(crate) fn pruned(&self, uniforms: &[Interval], lane: usize, scratch: &mut Scratch) -> Tape {
        let Scratch { pass, kept, became, .. } = scratch;
        let (own, instrs) = (self.own.clone(), Vec::with_capacity(kept[lane].len()));
        let p = Pruner { tape: self, shared: uniforms, pass, lane, own, instrs, dropped: false };
        p.rewrite(became, &kept[lane])
    }
}

/// The sweep from the result back that finds what is reached, in all boxes at once.
struct Decide<'a> {
    tape: &'a Tape,
    shared: &'a [Interval],
    pass: &'a Pass,
    lanes: usize,
    tail: Option<f64>,
    reached: &'a mut Vec<u8>,
    kept: &'a mut [Vec<Kept>; LANES],
}

impl NullaryFnOnce for Decide<'_> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let n = self.tape.instrs.len();
        self.reached.clear();
        self.reached.resize(n, 0);
        self.reached[n - 1] = (u8::MAX as u32 >> (LANES - self.lanes)) as u8;
        self.kept.iter_mut().for_each(Vec::clear);
        for i in (0..n).rev() {
            let mut open = self.reached[i];
            if open == 0 {
                continue;
            }
            let instr = self.tape.instrs[i];
            if let Code::Op(op, mode) = instr.code {
                open = match op {
                    Op::Min | Op::Max | Op::Abs | Op::Choose => self.choose(i, op, mode, open),
                    Op::Exp => self.keep(i, open, Fate::Tail, self.tails(i)),
                    // In a box without extent −x and |x| are single numbers too, but ones that change with x.
                    Op::Floor | Op::Ceil | Op::Round | Op::Less => {
                        self.keep(i, open, Fate::Point, self.points(i))
                    }
                    _ => open,
                };
            }
            self.keep(i, open, Fate::Stay, open);
            for k in instr.slots() {
                self.reached[instr.args[k] as usize] |= open;
            }
        }
    }
}

impl Decide<'_> {
    /// Notes what becomes of an instruction in the boxes of `mask`, and returns those of the others that are open.
    #[inline(always)]
    fn keep(&mut self, i: usize, open: u8, fate: Fate, mask: u8) -> u8 {
        let mut bits = open & mask;
        while bits != 0 {
            self.kept[bits.trailing_zeros() as usize].push(Kept { instr: i as u32, fate });
            bits &= bits - 1;
        }
        open & !mask
    }

    /// The boxes in which an exponential is too small to matter.
    #[inline(always)]
    fn tails(&self, i: usize) -> u8 {
        let Some(tail) = self.tail else { return 0 };
        mask(|l| self.pass.adjoint(i, l).magnitude() * self.pass.value(i, l).hi <= tail)
    }

    /// The boxes in which an instruction without derivatives is a single number.
    #[inline(always)]
    fn points(&self, i: usize) -> u8 {
        let v = self.pass.lanes(i);
        mask(|l| v.lo[l] == v.hi[l] && v.lo[l].is_finite())
    }

    /// Follows the operands that a choice surely takes; returns the boxes where that is open.
    #[inline(always)]
    fn choose(&mut self, i: usize, op: Op, mode: Mode, open: u8) -> u8 {
        let instr = self.tape.instrs[i];
        let a = self.pass.lanes(instr.args[0] as usize);
        let taken = match op {
            Op::Abs => [mask(|l| a.lo[l] > 0.0), 0, 0],
            Op::Choose => [0, mask(|l| !a.lane(l).has_zero()), mask(|l| a.lo[l] == 0.0 && a.hi[l] == 0.0)],
            _ => {
                let b = match mode {
                    Mode::SlotUniform => Lanes::from(self.uniform(instr.args[1])),
                    _ => *self.pass.lanes(instr.args[1] as usize),
                };
                let below = mask(|l| a.hi[l] < b.lo[l]);
                let above = mask(|l| b.hi[l] < a.lo[l]);
                if op == Op::Min { [below, above, 0] } else { [above, below, 0] }
            }
        };
        let mut open = open;
        for k in 0..3 {
            let here = open & taken[k];
            if here != 0 {
                open = self.keep(i, open, Fate::Take(k as u8), here);
                if instr.slots().contains(&k) {
                    self.reached[instr.args[k] as usize] |= here;
                }
            }
        }
        open
    }

    #[inline(always)]
    fn uniform(&self, u: u32) -> Interval {
        match self.shared.get(u as usize) {
            Some(v) => *v,
            None => {
                let c = self.tape.own[u as usize - self.shared.len()];
                Interval::new(c, c)
            }
        }
    }
}

/// The boxes for which something holds.
#[inline(always)]
fn mask(holds: impl Fn(usize) -> bool) -> u8 {
    let mut bits = 0;
    for l in 0..LANES {
        bits |= u8::from(holds(l)) << l;
    }
    bits
}

struct Pruner<'a> {
    tape: &'a Tape,
    shared: &'a [Interval],
    pass: &'a Pass,
    lane: usize,
    own: Vec<f64>,
    instrs: Vec<Instr>,
    /// Whether folding has left an instruction without a use.
    dropped: bool,
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

    /// From the first instruction on: writes the kept ones with their operands resolved, folding constants.
    fn rewrite(mut self, became: &mut Vec<Operand>, kept: &[Kept]) -> Tape {
        became.resize(self.tape.instrs.len(), Operand::Uniform(0));
        for &Kept { instr, fate } in kept.iter().rev() {
            let i = instr as usize;
            became[i] = match fate {
                Fate::Stay => self.emit(i, became),
                Fate::Take(k) => self.operand(&self.tape.instrs[i], k as usize, became),
                Fate::Point => Operand::Uniform(self.constant(self.value(instr).lo)),
                Fate::Tail => Operand::Uniform(self.constant(0.0)),
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
        if self.dropped { tape.without_unused() } else { tape }
    }

    /// What operand `k` of an instruction of the old tape became.
    #[inline(always)]
    fn operand(&self, instr: &Instr, k: usize, became: &[Operand]) -> Operand {
        if instr.slots().contains(&k) {
            became[instr.args[k] as usize]
        } else {
            Operand::Uniform(instr.args[k])
        }
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
        let op = match instr.code {
            Code::Op(op, _) => op,
            Code::Uniform => return Operand::Uniform(instr.args[0]),
            Code::Input => return self.push(instr.code, instr.args),
        };
        let n = op.arity();
        let a = self.operand(&instr, 0, became);
        let b = if n > 1 { self.operand(&instr, 1, became) } else { a };
        let c = if n > 2 { self.operand(&instr, 2, became) } else { a };
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
                self.dropped = true;
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
