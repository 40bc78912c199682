//! Switches: the places where an expression changes from one formula to another. A minimum, maximum, absolute value,
//! comparison or rounding has a difference G that is 0 where it switches; F has an edge on the curve F = G = 0
//! wherever the gradients on the two sides of it differ.

mod search;

use crate::arrange::Arrange;
use crate::dual::Dual;
use crate::op::{Op, apply};
use crate::plain::operands;
use crate::regions::Whole;
use crate::surface::Aabb;
use crate::tape::{Code, Instr, Mode};
use crate::vector::{V3, norm, sub};

/// The switches of a function: see [`Surface::switches`](crate::Surface::switches).
pub struct Switches<'a> {
    whole: Whole<'a>,
    uniforms: Vec<Dual<f64>>,
}

/// A switch near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Number of the switch.
    pub switch: u32,
    /// G: a - b of a minimum, maximum or comparison, a of an absolute value, the distance of a rounding's operand to the
    /// nearest number where its result jumps.
    pub value: f64,
    /// ∂G/∂x.
    pub gradient: V3,
}

/// F and the switches that matter for it at a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Local {
    /// F.
    pub value: f64,
    /// ∂F/∂x; between sides that are equal their mean.
    pub gradient: V3,
    /// The switches that are reached from F through the sides that are taken.
    pub switches: Vec<Difference>,
}

impl Local {
    /// The difference of a switch, if it matters here.
    pub fn of(&self, switch: u32) -> Option<&Difference> {
        self.switches.iter().find(|d| d.switch == switch)
    }
}

/// What of a function matters in a box: its instructions from the result back.
#[derive(Clone, Debug, Default)]
pub struct Route {
    steps: Vec<Step>,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    instr: u32,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    /// The instruction is carried out.
    Compute,
    /// It is its operand of this number.
    Take(u8),
    /// It is this number.
    Constant(f64),
}

/// A box that may hold a point with F = 0 and an open switch: see [`Switches::boxes`].
#[derive(Clone, Debug)]
pub struct SwitchBox {
    /// The box.
    pub bounds: Aabb,
    /// The switches that are open there.
    pub switches: Vec<u32>,
    /// Roots of sums of squares that may be 0 there: see [`Switches::squares`].
    pub tips: Vec<u32>,
}

/// Working memory of [`Switches::at`], kept between calls.
#[derive(Clone, Debug, Default)]
pub struct Desk {
    values: Vec<Dual<f64>>,
    reached: Vec<bool>,
}

/// Whether an instruction switches.
fn is_switch(instr: &Instr) -> bool {
    use Op::{Abs, Ceil, Floor, Less, Max, Min, Mod, Round};
    matches!(instr.code, Code::Op(Min | Max | Abs | Less | Floor | Ceil | Round | Mod, _))
}

/// Whether two numbers differ even within a distance of `tie`.
fn differ(a: Dual<f64>, b: Dual<f64>, tie: f64) -> bool {
    (a.v - b.v).abs() > tie * norm(sub(a.d, b.d))
}

/// The difference of a switch, given its operands.
fn difference(op: Op, a: Dual<f64>, b: Dual<f64>) -> Dual<f64> {
    let beyond = |v: Dual<f64>, shift: f64| Dual { v: (v.v - shift) - (v.v - shift).round(), ..v };
    match op {
        Op::Abs | Op::Square => a,
        Op::Floor | Op::Ceil => beyond(a, 0.0),
        Op::Round => beyond(a, 0.5),
        Op::Mod => beyond(a / b, 0.0),
        _ => a - b,
    }
}

impl<'a> Switches<'a> {
    /// The switches of a function.
    pub(crate) fn new(whole: Whole<'a>) -> Self {
        let uniforms = whole.uniforms.iter().map(|&u| Dual::from(u)).collect();
        Self { whole, uniforms }
    }

    /// Whether the function has none, and no lengths either: then its surface has neither creases nor tips.
    pub fn is_empty(&self) -> bool {
        let instrs = &self.whole.tape.instrs;
        !(0..instrs.len()).any(|i| is_switch(&instrs[i]) || self.squares(i as u32).len() > 1)
    }

    /// The squares whose sum stands under a root: where all are 0 it has a tip. None where it is no such root.
    /// [`Switches::difference`] gives what is squared.
    pub fn squares(&self, root: u32) -> Vec<u32> {
        let instrs = &self.whole.tape.instrs;
        let mut found = Vec::new();
        if !matches!(instrs[root as usize].code, Code::Op(Op::Sqrt, _)) {
            return found;
        }
        let mut rest = vec![instrs[root as usize].args[0]];
        while let Some(i) = rest.pop() {
            let instr = &instrs[i as usize];
            match instr.code {
                Code::Op(Op::Add, Mode::Slots) => rest.extend(&instr.args[..2]),
                Code::Op(Op::Square | Op::SquaredDifference, _) => found.push(i),
                _ => return Vec::new(),
            }
        }
        found.arrange();
        found.dedup();
        found
    }

    /// The whole function.
    pub fn everywhere(&self) -> Route {
        let step = |instr| Step { instr, what: What::Compute };
        Route { steps: (0..self.whole.tape.instrs.len() as u32).rev().map(step).collect() }
    }

    /// F and the switches that matter at `p`. A switch whose sides are equal within a distance of `tie` (a length) is
    /// followed on both sides.
    pub fn at(&self, route: &Route, p: V3, tie: f64, desk: &mut Desk, out: &mut Local) {
        let instrs = &self.whole.tape.instrs;
        let Desk { values, reached } = desk;
        values.resize(instrs.len(), Dual::from(0.0));
        reached.resize(instrs.len(), false);
        for step in route.steps.iter().rev() {
            let i = step.instr as usize;
            values[i] = self.value(&instrs[i], step.what, p, values);
            reached[i] = false;
        }
        let root = values[instrs.len() - 1];
        (out.value, out.gradient) = (root.v, root.d);
        out.switches.clear();
        reached[instrs.len() - 1] = true;
        for step in &route.steps {
            let i = step.instr as usize;
            if reached[i] {
                self.follow(i, step.what, tie, values, reached, &mut out.switches);
            }
        }
    }

    /// The difference of any switch at the point of the last [`Switches::at`] with the same route, whether it matters or
    /// not.
    pub fn difference(&self, switch: u32, desk: &Desk) -> Difference {
        let instr = &self.whole.tape.instrs[switch as usize];
        match instr.code {
            Code::Op(op, mode) => {
                let (a, b) = operands(self.whole.tape, &self.uniforms, &desk.values, mode, instr.args);
                let g = difference(op, a, b);
                Difference { switch, value: g.v, gradient: g.d }
            }
            _ => Difference { switch, value: f64::NAN, gradient: [0.0; 3] },
        }
    }

    fn value(&self, instr: &Instr, what: What, p: V3, values: &[Dual<f64>]) -> Dual<f64> {
        let uniform = |u| crate::plain::uniform(self.whole.tape, &self.uniforms, u);
        match what {
            What::Constant(c) => Dual::from(c),
            What::Take(k) if instr.slots().contains(&(k as usize)) => values[instr.args[k as usize] as usize],
            What::Take(k) => uniform(instr.args[k as usize]),
            What::Compute => match instr.code {
                Code::Input => {
                    let axis = instr.args[0] as usize;
                    Dual::variable(p.get(axis).copied().unwrap_or(f64::NAN), axis.min(2))
                }
                Code::Uniform => uniform(instr.args[0]),
                Code::Op(op, mode) => {
                    let (a, b) = operands(self.whole.tape, &self.uniforms, values, mode, instr.args);
                    let c = if op.arity() == 3 { values[instr.args[2] as usize] } else { b };
                    apply(op, a, b, c)
                }
            },
        }
    }

    /// Marks what an instruction that is reached leads to, and notes it if it is a switch.
    fn follow(
        &self,
        i: usize,
        what: What,
        tie: f64,
        values: &[Dual<f64>],
        reached: &mut [bool],
        found: &mut Vec<Difference>,
    ) {
        let instr = &self.whole.tape.instrs[i];
        let mut sides = [true; 3];
        match (what, instr.code) {
            (What::Constant(_), _) => return,
            (What::Take(k), _) => sides = [0, 1, 2].map(|j| j == k),
            (What::Compute, Code::Op(op, mode)) => {
                let (a, b) = operands(self.whole.tape, &self.uniforms, values, mode, instr.args);
                if is_switch(instr) {
                    let g = difference(op, a, b);
                    found.push(Difference { switch: i as u32, value: g.v, gradient: g.d });
                }
                match op {
                    Op::Min | Op::Max => {
                        let apart = a.v - b.v;
                        let tied = !differ(a, b, tie);
                        let first = (apart < 0.0) == (op == Op::Min);
                        sides = [tied || first, tied || !first, false];
                    }
                    Op::Choose => {
                        let mask = &self.whole.tape.instrs[instr.args[0] as usize];
                        let tied = match mask.code {
                            Code::Op(Op::Less, mode) => {
                                let (a, b) =
                                    operands(self.whole.tape, &self.uniforms, values, mode, mask.args);
                                !differ(a, b, tie)
                            }
                            _ => false,
                        };
                        sides = [true, tied || a.v != 0.0, tied || a.v == 0.0];
                    }
                    _ => {}
                }
            }
            _ => {}
        }
        for k in instr.slots().filter(|&k| sides[k]) {
            reached[instr.args[k] as usize] = true;
        }
    }
}

#[cfg(test)]
mod tests;
