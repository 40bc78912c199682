//! The operations that a model is made of: what each computes, and its local derivatives. Every evaluator
//! (blocks of points, intervals, duals for second derivatives) and the constant folder use these two functions,
//! so that each formula stands in one place.

use crate::scalar::Scalar;

/// An operation with up to three operands. Unary operations ignore `b` and `c`; only [`Op::Choose`] has a `c`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Op {
    /// −a
    Neg,
    /// |a|, with derivative 0 at 0.
    Abs,
    /// √a, with derivative 0 at 0 (and NaN for a < 0).
    Sqrt,
    /// a²
    Square,
    /// eᵃ
    Exp,
    /// Natural logarithm.
    Ln,
    /// Sine, radians.
    Sin,
    /// Cosine, radians.
    Cos,
    /// Tangent, radians.
    Tan,
    /// Arc sine.
    Asin,
    /// Arc cosine.
    Acos,
    /// Arc tangent.
    Atan,
    /// Largest integer not above a; derivative 0.
    Floor,
    /// Smallest integer not below a; derivative 0.
    Ceil,
    /// Nearest integer, halves away from zero; derivative 0.
    Round,
    /// a + b
    Add,
    /// a − b
    Sub,
    /// (a − b)²: half of all that distances are made of.
    SquaredDifference,
    /// a · b
    Mul,
    /// a / b
    Div,
    /// The smaller; where both are equal the derivative is the mean of the operands' derivatives.
    Min,
    /// The larger; ties as for [`Op::Min`].
    Max,
    /// aᵇ; for a < 0 defined where b is an integer.
    Pow,
    /// Angle of the point (b, a), in (−π, π].
    Atan2,
    /// a − b ⌊a/b⌋: has the sign of b.
    Mod,
    /// 1 where a < b, else 0; derivative 0.
    Less,
    /// b where a ≠ 0, else c.
    Choose,
}

impl Op {
    /// Every operation, for exhaustive tests.
    pub const ALL: [Op; 27] = [
        Op::Neg,
        Op::Abs,
        Op::Sqrt,
        Op::Square,
        Op::Exp,
        Op::Ln,
        Op::Sin,
        Op::Cos,
        Op::Tan,
        Op::Asin,
        Op::Acos,
        Op::Atan,
        Op::Floor,
        Op::Ceil,
        Op::Round,
        Op::Add,
        Op::Sub,
        Op::SquaredDifference,
        Op::Mul,
        Op::Div,
        Op::Min,
        Op::Max,
        Op::Pow,
        Op::Atan2,
        Op::Mod,
        Op::Less,
        Op::Choose,
    ];

    /// Number of operands: 1, 2 or 3.
    pub const fn arity(self) -> usize {
        match self {
            Op::Choose => 3,
            _ if (self as u8) < (Op::Add as u8) => 1,
            _ => 2,
        }
    }

    /// Whether an instruction may take its second operand from the uniforms, without a copy for each point.
    pub const fn takes_uniform_second(self) -> bool {
        matches!(
            self,
            Op::Add
                | Op::Sub
                | Op::SquaredDifference
                | Op::Mul
                | Op::Div
                | Op::Min
                | Op::Max
                | Op::Pow
                | Op::Mod
                | Op::Less
        )
    }

    /// The same for the first operand.
    pub const fn takes_uniform_first(self) -> bool {
        matches!(self, Op::Sub | Op::Div | Op::Less)
    }

    /// Whether the operation or its derivative takes far more than a memory access.
    pub const fn is_slow(self) -> bool {
        matches!(self, Op::Pow | Op::Atan2 | Op::Sin | Op::Cos | Op::Tan | Op::Asin | Op::Acos)
    }

    /// Whether the operands may be exchanged.
    pub const fn commutes(self) -> bool {
        matches!(self, Op::Add | Op::Mul | Op::Min | Op::Max | Op::SquaredDifference)
    }
}

/// The value of `op`.
#[inline(always)]
pub fn apply<V: Scalar>(op: Op, a: V, b: V, c: V) -> V {
    match op {
        Op::Neg => -a,
        Op::Abs => a.abs(),
        Op::Sqrt => a.sqrt(),
        Op::Square => a.square(),
        Op::Exp => a.exp(),
        Op::Ln => a.ln(),
        Op::Sin => a.sin(),
        Op::Cos => a.cos(),
        Op::Tan => a.tan(),
        Op::Asin => a.asin(),
        Op::Acos => a.acos(),
        Op::Atan => a.atan(),
        Op::Floor => a.floor(),
        Op::Ceil => a.ceil(),
        Op::Round => a.round(),
        Op::Add => a + b,
        Op::Sub => a - b,
        Op::SquaredDifference => (a - b).square(),
        Op::Mul => a * b,
        Op::Div => a / b,
        Op::Min => a.min(b),
        Op::Max => a.max(b),
        Op::Pow => a.pow(b),
        Op::Atan2 => a.atan2(b),
        Op::Mod => a.modulo(b),
        Op::Less => a.less(b),
        Op::Choose => V::choose(a, b, c),
    }
}

/// Whether the derivative with respect to operand `k` is zero everywhere.
pub const fn is_flat(op: Op, k: usize) -> bool {
    match op {
        Op::Floor | Op::Ceil | Op::Round | Op::Less => true,
        Op::Choose => k == 0,
        _ => false,
    }
}

/// `adjoint` times the derivative of `op` with respect to operand `k` (0, 1 or 2); `r` is the value of `op`.
/// The adjoint is a factor, not multiplied afterwards, so that additions cost nothing and a select can pass or
/// drop it.
#[inline(always)]
pub fn pull<V: Scalar>(op: Op, k: usize, adjoint: V, a: V, b: V, r: V) -> V {
    let g = adjoint;
    match (op, k) {
        (Op::Neg, _) => -g,
        (Op::Abs, _) => g * a.sign(),
        (Op::Sqrt, _) => g.half_over(r),
        (Op::Square, _) => g * (a + a),
        (Op::Exp, _) => g * r,
        (Op::Ln, _) => g / a,
        (Op::Sin, _) => g * a.cos(),
        (Op::Cos, _) => -(g * a.sin()),
        (Op::Tan, _) => g * (V::from_f64(1.0) + r.square()),
        (Op::Asin, _) => g / (V::from_f64(1.0) - a.square()).sqrt(),
        (Op::Acos, _) => -(g / (V::from_f64(1.0) - a.square()).sqrt()),
        (Op::Atan, _) => g / (V::from_f64(1.0) + a.square()),
        (Op::Floor | Op::Ceil | Op::Round | Op::Less, _) => V::from_f64(0.0),
        (Op::Add, _) => g,
        (Op::Sub, 0) => g,
        (Op::Sub, _) => -g,
        (Op::SquaredDifference, 0) => g * ((a - b) + (a - b)),
        (Op::SquaredDifference, _) => g * ((b - a) + (b - a)),
        (Op::Mul, 0) => g * b,
        (Op::Mul, _) => g * a,
        (Op::Div, 0) => g / b,
        (Op::Div, _) => -(g * r / b),
        (Op::Min, 0) | (Op::Max, 1) => a.pass_if_less(b, g),
        (Op::Min, _) | (Op::Max, _) => b.pass_if_less(a, g),
        (Op::Pow, 0) => g * (b * a.pow(b - V::from_f64(1.0))),
        (Op::Pow, _) => g * r.times_ln(a),
        (Op::Atan2, 0) => g * b / (a.square() + b.square()),
        (Op::Atan2, _) => -(g * a / (a.square() + b.square())),
        (Op::Mod, 0) => g,
        (Op::Mod, _) => -(g * (a / b).floor()),
        (Op::Choose, 1) => V::choose(a, g, V::from_f64(0.0)),
        (Op::Choose, 2) => V::choose(a, V::from_f64(0.0), g),
        (Op::Choose, _) => V::from_f64(0.0),
    }
}
