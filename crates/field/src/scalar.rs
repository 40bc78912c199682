//! What a number must be able to do to run through a tape.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math;

/// A number type that the tape can be evaluated in: `f64`, [`crate::Interval`], [`crate::Dual`].
pub trait Scalar:
    Copy
    + Send
    + Sync
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The number as a constant.
    fn from_f64(v: f64) -> Self;
    /// See [`crate::Op`] for each of these.
    fn abs(self) -> Self;
    /// −1, 0 or 1: the derivative of |a|.
    fn sign(self) -> Self;
    /// √a
    fn sqrt(self) -> Self;
    /// `self / (2 root)`, and 0 where the root is 0: the derivative of √.
    fn half_over(self, root: Self) -> Self;
    /// a²
    fn square(self) -> Self;
    /// eᵃ
    fn exp(self) -> Self;
    /// ln a
    fn ln(self) -> Self;
    /// `self · ln a`, and 0 where `self` is 0: the derivative of aᵇ for b.
    fn times_ln(self, a: Self) -> Self;
    /// sin a
    fn sin(self) -> Self;
    /// cos a
    fn cos(self) -> Self;
    /// tan a
    fn tan(self) -> Self;
    /// asin a
    fn asin(self) -> Self;
    /// acos a
    fn acos(self) -> Self;
    /// atan a
    fn atan(self) -> Self;
    /// ⌊a⌋
    fn floor(self) -> Self;
    /// ⌈a⌉
    fn ceil(self) -> Self;
    /// Nearest integer.
    fn round(self) -> Self;
    /// min(a, b); NaN if either is.
    fn min(self, b: Self) -> Self;
    /// max(a, b); NaN if either is.
    fn max(self, b: Self) -> Self;
    /// aᵇ
    fn pow(self, b: Self) -> Self;
    /// Angle of (b, a).
    fn atan2(self, b: Self) -> Self;
    /// a − b ⌊a/b⌋
    fn modulo(self, b: Self) -> Self;
    /// 1 where a < b, else 0.
    fn less(self, b: Self) -> Self;
    /// `b` where `mask` ≠ 0, else `c`.
    fn choose(mask: Self, b: Self, c: Self) -> Self;
    /// `g` where self < b, g/2 where they are equal, else 0: the derivative of min and max.
    fn pass_if_less(self, b: Self, g: Self) -> Self;
}

impl Scalar for f64 {
    #[inline(always)]
    fn from_f64(v: f64) -> Self {
        v
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        let positive = if self > 0.0 { 1.0 } else { 0.0 };
        let negative = if self < 0.0 { 1.0 } else { 0.0 };
        positive - negative
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn half_over(self, root: Self) -> Self {
        let d = self / (root + root);
        if root == 0.0 { 0.0 } else { d }
    }
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
    #[inline(always)]
    fn exp(self) -> Self {
        math::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        math::ln(self)
    }
    #[inline(always)]
    fn times_ln(self, a: Self) -> Self {
        let v = self * math::ln(a);
        if self == 0.0 { 0.0 } else { v }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        math::sin(self)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        math::cos(self)
    }
    #[inline(always)]
    fn tan(self) -> Self {
        math::tan(self)
    }
    #[inline(always)]
    fn asin(self) -> Self {
        math::asin(self)
    }
    #[inline(always)]
    fn acos(self) -> Self {
        math::acos(self)
    }
    #[inline(always)]
    fn atan(self) -> Self {
        math::atan(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
    #[inline(always)]
    fn ceil(self) -> Self {
        f64::ceil(self)
    }
    #[inline(always)]
    fn round(self) -> Self {
        f64::round(self)
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        if (self < b) | self.is_nan() { self } else { b }
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        if (self > b) | self.is_nan() { self } else { b }
    }
    #[inline(always)]
    fn pow(self, b: Self) -> Self {
        math::pow(self, b)
    }
    #[inline(always)]
    fn atan2(self, b: Self) -> Self {
        math::atan2(self, b)
    }
    #[inline(always)]
    fn modulo(self, b: Self) -> Self {
        self - b * (self / b).floor()
    }
    #[inline(always)]
    fn less(self, b: Self) -> Self {
        if self < b { 1.0 } else { 0.0 }
    }
    #[inline(always)]
    fn choose(mask: Self, b: Self, c: Self) -> Self {
        if mask != 0.0 { b } else { c }
    }
    #[inline(always)]
    fn pass_if_less(self, b: Self, g: Self) -> Self {
        let at_most = if self <= b { g } else { 0.0 };
        let half = 0.5 * g;
        if self == b { half } else { at_most }
    }
}
