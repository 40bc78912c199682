//! Finds out whether a tape is a constant plus a sum of Gaussian bumps, however its formula was written.

use super::recipe::{Id, Made, Numbers, Recipe};
use crate::op::Op;
use crate::tape::{Code, Tape};

/// Fewest bumps of a sum.
const LEAST: usize = 4;

/// What an instruction computes.
#[derive(Clone, Copy, Debug, Default)]
enum Form {
    /// A number.
    Number(Id),
    /// scale · (x_axis − centre)
    Linear(Linear),
    /// level + Σ_axis weight (x_axis − centre)²
    Quadratic(Quadratic),
    /// offset + Σ bumps, from the first to the last of a chain
    Sum(Id, Chain),
    /// Anything else, and sums that have been used already.
    #[default]
    Other,
}

/// Bumps that follow each other in [`Work`]: joining two chains moves nothing.
#[derive(Clone, Copy, Debug)]
struct Chain {
    first: u32,
    last: u32,
    count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Linear {
    axis: usize,
    center: Id,
    scale: Id,
}

#[derive(Clone, Copy, Debug)]
struct Quadratic {
    level: Id,
    /// The weight and the centre on each axis, where it has that axis.
    axes: [Option<(Id, Id)>; 3],
}

/// All numbers and bumps so far, and the place of the next bump in each one's chain.
#[derive(Default)]
struct Work {
    numbers: Numbers,
    bumps: Vec<Made>,
    next: Vec<u32>,
}

/// The recipe of a tape that is a sum of at least [`LEAST`] bumps.
pub(super) fn recognise(tape: &Tape) -> Option<Recipe> {
    if tape.exps < LEAST {
        return None;
    }
    let mut forms: Vec<Form> = Vec::with_capacity(tape.instrs.len());
    let mut work = Work::default();
    for instr in &tape.instrs {
        let form = match instr.code {
            Code::Input if instr.args[0] < 3 => {
                let (center, scale) = (work.numbers.constant(0.0), work.numbers.constant(1.0));
                Form::Linear(Linear { axis: instr.args[0] as usize, center, scale })
            }
            Code::Input => return None,
            Code::Uniform => Form::Number(work.numbers.uniform(instr.args[0])),
            Code::Op(op, _) => {
                let mut take = |k: usize| {
                    if instr.slots().contains(&k) {
                        let slot = &mut forms[instr.args[k] as usize];
                        // A sum is taken away: one that is used twice is not recognised.
                        if matches!(slot, Form::Sum(..)) { std::mem::take(slot) } else { *slot }
                    } else {
                        Form::Number(work.numbers.uniform(instr.args[k]))
                    }
                };
                let a = take(0);
                let b = if op.arity() == 2 { take(1) } else { Form::Other };
                work.operation(op, a, b, forms.len() as u32)
            }
        };
        if matches!(form, Form::Other) {
            return None;
        }
        forms.push(form);
    }
    match forms.pop() {
        Some(Form::Sum(offset, chain)) if chain.count as usize >= LEAST => {
            let bumps = work.places(chain).into_iter().map(|k| work.bumps[k]).collect();
            Some(Recipe { numbers: work.numbers, offset, bumps })
        }
        _ => None,
    }
}

impl Work {
    fn operation(&mut self, op: Op, a: Form, b: Form, number: u32) -> Form {
        match op {
            Op::Square => self.square(a),
            Op::Neg => self.negated(a),
            Op::Exp => self.exponential(a, number),
            Op::Add => self.add(a, b),
            Op::Sub => {
                let b = self.negated(b);
                self.add(a, b)
            }
            Op::SquaredDifference => {
                let b = self.negated(b);
                let difference = self.add(a, b);
                self.square(difference)
            }
            Op::Mul => match (a, b) {
                (Form::Number(s), f) | (f, Form::Number(s)) => self.map(f, |n, v| n.mul(v, s)),
                (Form::Linear(p), Form::Linear(q)) => self.product(p, q),
                _ => Form::Other,
            },
            Op::Div => match (a, b) {
                (f, Form::Number(s)) => self.map(f, |n, v| n.div(v, s)),
                _ => Form::Other,
            },
            _ => Form::Other,
        }
    }

    fn square(&mut self, a: Form) -> Form {
        if let Form::Linear(l) = a { self.product(l, l) } else { Form::Other }
    }

    /// The product of two that vanish in the same plane.
    fn product(&mut self, p: Linear, q: Linear) -> Form {
        if p.axis != q.axis || !self.numbers.same(p.center, q.center) {
            return Form::Other;
        }
        let mut axes = [None; 3];
        axes[p.axis] = Some((self.numbers.mul(p.scale, q.scale), p.center));
        Form::Quadratic(Quadratic { level: self.numbers.constant(0.0), axes })
    }

    fn exponential(&mut self, a: Form, exp: u32) -> Form {
        let Form::Quadratic(Quadratic { level, axes: [Some(x), Some(y), Some(z)] }) = a else {
            return Form::Other;
        };
        let k = self.bumps.len() as u32;
        let factor = self.numbers.constant(1.0);
        self.bumps.push(Made { factor, level, weight: [x.0, y.0, z.0], center: [x.1, y.1, z.1], exp });
        self.next.push(k);
        Form::Sum(self.numbers.constant(0.0), Chain { first: k, last: k, count: 1 })
    }

    fn add(&mut self, a: Form, b: Form) -> Form {
        let n = &mut self.numbers;
        match (a, b) {
            (Form::Number(a), Form::Number(b)) => Form::Number(n.add(a, b)),
            (Form::Quadratic(q), Form::Number(c)) | (Form::Number(c), Form::Quadratic(q)) => {
                Form::Quadratic(Quadratic { level: n.add(q.level, c), ..q })
            }
            (Form::Quadratic(p), Form::Quadratic(q)) => self.joined(p, q),
            (Form::Sum(o, s), Form::Number(c)) | (Form::Number(c), Form::Sum(o, s)) => {
                Form::Sum(n.add(o, c), s)
            }
            (Form::Sum(o, s), Form::Sum(p, t)) => {
                let offset = n.add(o, p);
                self.next[s.last as usize] = t.first;
                Form::Sum(offset, Chain { first: s.first, last: t.last, count: s.count + t.count })
            }
            (Form::Linear(l), Form::Number(c)) | (Form::Number(c), Form::Linear(l)) => {
                let shift = n.div(c, l.scale);
                Form::Linear(Linear { center: n.sub(l.center, shift), ..l })
            }
            _ => Form::Other,
        }
    }

    /// The sum of two that do not share an axis.
    fn joined(&mut self, p: Quadratic, q: Quadratic) -> Form {
        let mut axes = p.axes;
        for a in 0..3 {
            match (axes[a], q.axes[a]) {
                (Some(_), Some(_)) => return Form::Other,
                (None, other) => axes[a] = other,
                _ => {}
            }
        }
        Form::Quadratic(Quadratic { level: self.numbers.add(p.level, q.level), axes })
    }

    fn negated(&mut self, a: Form) -> Form {
        self.map(a, Numbers::neg)
    }

    /// A multiple.
    fn map(&mut self, a: Form, f: impl Fn(&mut Numbers, Id) -> Id) -> Form {
        let n = &mut self.numbers;
        match a {
            Form::Number(v) => Form::Number(f(n, v)),
            Form::Linear(l) => Form::Linear(Linear { scale: f(n, l.scale), ..l }),
            Form::Quadratic(q) => {
                let level = f(n, q.level);
                let axes = q.axes.map(|axis| axis.map(|(weight, center)| (f(n, weight), center)));
                Form::Quadratic(Quadratic { level, axes })
            }
            Form::Sum(o, chain) => {
                let offset = f(n, o);
                for k in self.places(chain) {
                    self.bumps[k].factor = f(&mut self.numbers, self.bumps[k].factor);
                }
                Form::Sum(offset, chain)
            }
            Form::Other => Form::Other,
        }
    }

    /// The places of the bumps of a chain, in order.
    fn places(&self, chain: Chain) -> Vec<usize> {
        let mut out = Vec::with_capacity(chain.count as usize);
        let mut at = chain.first as usize;
        for _ in 0..chain.count {
            out.push(at);
            at = self.next[at] as usize;
        }
        out
    }
}
