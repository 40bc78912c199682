//! How the numbers of a sum of bumps follow from the uniforms of a tape: found once, carried out again for every change of the
//! parameters.

use super::{Bump, Sum};
use crate::tape::Tape;

/// A number of a [`Recipe`].
pub(super) type Id = u32;

/// How a number comes about; operands come before it.
#[derive(Clone, Copy, Debug)]
enum Rule {
    Uniform(u32),
    Const(f64),
    Neg(Id),
    Add(Id, Id),
    Sub(Id, Id),
    Mul(Id, Id),
    Div(Id, Id),
}

/// Rules for numbers, with what is plain from the start left out.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers(Vec<Rule>);

impl Numbers {
    fn push(&mut self, rule: Rule) -> Id {
        self.0.push(rule);
        self.0.len() as Id - 1
    }

    pub(super) fn uniform(&mut self, number: u32) -> Id {
        self.push(Rule::Uniform(number))
    }

    pub(super) fn constant(&mut self, v: f64) -> Id {
        self.push(Rule::Const(v))
    }

    fn known(&self, a: Id) -> Option<f64> {
        if let Rule::Const(v) = self.0[a as usize] { Some(v) } else { None }
    }

    /// Whether two numbers are always the same.
    pub(super) fn same(&self, a: Id, b: Id) -> bool {
        match (self.0[a as usize], self.0[b as usize]) {
            (Rule::Uniform(a), Rule::Uniform(b)) => a == b,
            (Rule::Const(a), Rule::Const(b)) => a == b,
            (Rule::Neg(a), Rule::Neg(b)) => self.same(a, b),
            _ => a == b,
        }
    }

    pub(super) fn neg(&mut self, a: Id) -> Id {
        match self.0[a as usize] {
            Rule::Const(v) => self.constant(-v),
            Rule::Neg(b) => b,
            _ => self.push(Rule::Neg(a)),
        }
    }

    pub(super) fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.known(a), self.known(b)) {
            (Some(a), Some(b)) => self.constant(a + b),
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            _ => self.push(Rule::Add(a, b)),
        }
    }

    pub(super) fn sub(&mut self, a: Id, b: Id) -> Id {
        match (self.known(a), self.known(b)) {
            (Some(a), Some(b)) => self.constant(a - b),
            (Some(0.0), _) => self.neg(b),
            (_, Some(0.0)) => a,
            _ => self.push(Rule::Sub(a, b)),
        }
    }

    pub(super) fn mul(&mut self, a: Id, b: Id) -> Id {
        match (self.known(a), self.known(b)) {
            (Some(a), Some(b)) => self.constant(a * b),
            (Some(1.0), _) => b,
            (_, Some(1.0)) => a,
            (Some(-1.0), _) => self.neg(b),
            (_, Some(-1.0)) => self.neg(a),
            _ => self.push(Rule::Mul(a, b)),
        }
    }

    pub(super) fn div(&mut self, a: Id, b: Id) -> Id {
        match (self.known(a), self.known(b)) {
            (Some(a), Some(b)) => self.constant(a / b),
            (_, Some(1.0)) => a,
            _ => self.push(Rule::Div(a, b)),
        }
    }

    /// The numbers at these uniforms, those of the tape's own after them.
    fn values(&self, uniforms: &[f64], own: &[f64]) -> Vec<f64> {
        let mut v: Vec<f64> = Vec::with_capacity(self.0.len());
        for rule in &self.0 {
            let at = |id: Id| v[id as usize];
            let value = match *rule {
                Rule::Uniform(u) => {
                    let u = u as usize;
                    uniforms.get(u).copied().unwrap_or_else(|| own[u - uniforms.len()])
                }
                Rule::Const(c) => c,
                Rule::Neg(a) => -at(a),
                Rule::Add(a, b) => at(a) + at(b),
                Rule::Sub(a, b) => at(a) - at(b),
                Rule::Mul(a, b) => at(a) * at(b),
                Rule::Div(a, b) => at(a) / at(b),
            };
            v.push(value);
        }
        v
    }
}

/// A bump by its numbers: factor · exp(level + Σ_axis weight (x_axis − centre)²), and its exponential's instruction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Made {
    pub(super) factor: Id,
    pub(super) level: Id,
    pub(super) weight: [Id; 3],
    pub(super) center: [Id; 3],
    pub(super) exp: u32,
}

/// A tape that is a sum of bumps wherever their exponents fade in all directions.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    pub(super) numbers: Numbers,
    pub(super) offset: Id,
    pub(super) bumps: Vec<Made>,
}

impl Recipe {
    /// The recipe of a tape, if it has one.
    pub(crate) fn of(tape: &Tape) -> Option<Self> {
        super::recognise::recognise(tape)
    }

    /// The sum at these uniforms; `None` where an exponent does not fade, or something is not finite.
    pub(crate) fn sum(&self, tape: &Tape, uniforms: &[f64]) -> Option<Sum> {
        let v = self.numbers.values(uniforms, &tape.own);
        let at = |id: Id| v[id as usize];
        let mut bumps = Vec::with_capacity(self.bumps.len());
        for b in &self.bumps {
            let (weight, level) = (b.weight.map(|w| -at(w)), at(b.level));
            if !(weight.iter().all(|w| *w > 0.0 && w.is_finite()) && level.is_finite()) {
                return None;
            }
            bumps.push((Bump { factor: at(b.factor), level, weight, center: b.center.map(at) }, b.exp));
        }
        Sum::new(at(self.offset), bumps)
    }
}
