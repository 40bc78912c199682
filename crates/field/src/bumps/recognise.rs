//! Finds out whether a tape is a constant plus a sum of Gaussian bumps, however its formula was written.

use super::{Bump, Sum};
use crate::op::Op;
use crate::tape::{Code, Tape};

/// What an instruction computes.
#[derive(Clone, Copy, Debug, Default)]
enum Form {
    /// A number.
    Number(f64),
    /// scale · (x_axis − centre)
    Linear(Linear),
    /// level + Σ_axis weight (x_axis − centre)²
    Quadratic(Quadratic),
    /// offset + Σ bumps, from the first to the last of a chain
    Sum(f64, Chain),
    /// Anything else, and sums that have been used already.
    #[default]
    Other,
}

/// Bumps that follow each other in [`Bumps`]: joining two chains moves nothing.
#[derive(Clone, Copy, Debug)]
struct Chain {
    first: u32,
    last: u32,
    count: u32,
}

/// All bumps so far, each with the number of its exponential and the place of the next in its chain.
#[derive(Default)]
struct Bumps {
    list: Vec<(Bump, u32)>,
    next: Vec<u32>,
}

impl Bumps {
    fn push(&mut self, bump: Bump, exp: u32) -> Chain {
        let k = self.list.len() as u32;
        self.list.push((bump, exp));
        self.next.push(k);
        Chain { first: k, last: k, count: 1 }
    }

    fn join(&mut self, a: Chain, b: Chain) -> Chain {
        self.next[a.last as usize] = b.first;
        Chain { first: a.first, last: b.last, count: a.count + b.count }
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

#[derive(Clone, Copy, Debug)]
struct Linear {
    axis: usize,
    center: f64,
    scale: f64,
}

impl Linear {
    fn plus(self, v: f64) -> Self {
        Self { center: self.center - v / self.scale, ..self }
    }

    /// The product of two that vanish in the same plane.
    fn times(self, other: Self) -> Option<Quadratic> {
        let mut q = Quadratic { level: 0.0, weight: [0.0; 3], center: [0.0; 3] };
        (q.weight[self.axis], q.center[self.axis]) = (self.scale * other.scale, self.center);
        (self.axis == other.axis && self.center == other.center).then_some(q)
    }
}

#[derive(Clone, Copy, Debug)]
struct Quadratic {
    level: f64,
    weight: [f64; 3],
    center: [f64; 3],
}

impl Quadratic {
    fn raised(self, by: f64) -> Self {
        Self { level: self.level + by, ..self }
    }

    /// The sum of the two where they do not share an axis.
    fn plus(self, other: Self) -> Option<Self> {
        let mut sum = self.raised(other.level);
        for a in 0..3 {
            if other.weight[a] != 0.0 {
                if self.weight[a] != 0.0 {
                    return None;
                }
                (sum.weight[a], sum.center[a]) = (other.weight[a], other.center[a]);
            }
        }
        Some(sum)
    }
}

/// The sum that the tape computes at these uniforms, if it is one: at least `LEAST` bumps that fade in all three
/// directions.
pub(super) fn recognise(tape: &Tape, uniforms: &[f64]) -> Option<Sum> {
    const LEAST: usize = 4;
    if tape.exps < LEAST {
        return None;
    }
    let mut forms: Vec<Form> = Vec::with_capacity(tape.instrs.len());
    let mut bumps = Bumps::default();
    for instr in &tape.instrs {
        let number = |u: u32| {
            let u = u as usize;
            Form::Number(uniforms.get(u).copied().unwrap_or_else(|| tape.own[u - uniforms.len()]))
        };
        let form = match instr.code {
            Code::Input if instr.args[0] < 3 => {
                Form::Linear(Linear { axis: instr.args[0] as usize, center: 0.0, scale: 1.0 })
            }
            Code::Input => return None,
            Code::Uniform => number(instr.args[0]),
            Code::Op(op, _) => {
                let mut take = |k: usize| {
                    if instr.slots().contains(&k) {
                        let slot = &mut forms[instr.args[k] as usize];
                        // A sum is taken away: one that is used twice is not recognised.
                        if matches!(slot, Form::Sum(..)) { std::mem::take(slot) } else { *slot }
                    } else {
                        number(instr.args[k])
                    }
                };
                let a = take(0);
                let b = if op.arity() == 2 { take(1) } else { Form::Other };
                match (op, &a) {
                    (Op::Square, _) => square(&a),
                    (Op::Neg, _) => scale(a, -1.0, &mut bumps),
                    (Op::Exp, _) => exponential(&a, forms.len() as u32, &mut bumps),
                    (Op::Add, _) => add(a, b, &mut bumps),
                    (Op::Sub, _) => {
                        let b = scale(b, -1.0, &mut bumps);
                        add(a, b, &mut bumps)
                    }
                    (Op::SquaredDifference, _) => {
                        let b = scale(b, -1.0, &mut bumps);
                        square(&add(a, b, &mut bumps))
                    }
                    (Op::Mul, _) => match (a, b) {
                        (Form::Number(s), f) | (f, Form::Number(s)) => scale(f, s, &mut bumps),
                        (Form::Linear(p), Form::Linear(q)) => p.times(q).map_or(Form::Other, Form::Quadratic),
                        _ => Form::Other,
                    },
                    (Op::Div, _) => match (a, b) {
                        (f, Form::Number(s)) => divide(f, s, &mut bumps),
                        _ => Form::Other,
                    },
                    _ => Form::Other,
                }
            }
        };
        if matches!(form, Form::Other) {
            return None;
        }
        forms.push(form);
    }
    match forms.pop() {
        Some(Form::Sum(offset, chain)) if chain.count as usize >= LEAST => {
            Sum::new(offset, bumps.places(chain).into_iter().map(|k| bumps.list[k]).collect())
        }
        _ => None,
    }
}

fn square(a: &Form) -> Form {
    let Form::Linear(l) = a else { return Form::Other };
    l.times(*l).map_or(Form::Other, Form::Quadratic)
}

fn exponential(a: &Form, number: u32, bumps: &mut Bumps) -> Form {
    match a {
        Form::Quadratic(q) if q.weight.iter().all(|w| *w < 0.0 && w.is_finite()) && q.level.is_finite() => {
            let bump = Bump { factor: 1.0, level: q.level, weight: q.weight.map(|w| -w), center: q.center };
            Form::Sum(0.0, bumps.push(bump, number))
        }
        _ => Form::Other,
    }
}

fn add(a: Form, b: Form, bumps: &mut Bumps) -> Form {
    match (a, b) {
        (Form::Number(a), Form::Number(b)) => Form::Number(a + b),
        (Form::Quadratic(q), Form::Number(c)) | (Form::Number(c), Form::Quadratic(q)) => {
            Form::Quadratic(q.raised(c))
        }
        (Form::Quadratic(p), Form::Quadratic(q)) => p.plus(q).map_or(Form::Other, Form::Quadratic),
        (Form::Sum(o, s), Form::Number(c)) | (Form::Number(c), Form::Sum(o, s)) => Form::Sum(o + c, s),
        (Form::Sum(o, s), Form::Sum(p, t)) => Form::Sum(o + p, bumps.join(s, t)),
        (Form::Linear(l), Form::Number(c)) | (Form::Number(c), Form::Linear(l)) => Form::Linear(l.plus(c)),
        _ => Form::Other,
    }
}

fn scale(a: Form, s: f64, bumps: &mut Bumps) -> Form {
    map(a, bumps, |v| v * s)
}

fn divide(a: Form, s: f64, bumps: &mut Bumps) -> Form {
    map(a, bumps, |v| v / s)
}

fn map(a: Form, all: &mut Bumps, f: impl Fn(f64) -> f64) -> Form {
    match a {
        Form::Number(v) => Form::Number(f(v)),
        Form::Linear(l) => Form::Linear(Linear { scale: f(l.scale), ..l }),
        Form::Quadratic(q) => Form::Quadratic(Quadratic { level: f(q.level), weight: q.weight.map(&f), ..q }),
        Form::Sum(o, chain) => {
            for k in all.places(chain) {
                let factor = &mut all.list[k].0.factor;
                *factor = f(*factor);
            }
            Form::Sum(f(o), chain)
        }
        _ => Form::Other,
    }
}
