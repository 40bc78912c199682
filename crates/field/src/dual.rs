//! Numbers that carry three derivatives along. A reverse sweep in duals gives second derivatives.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// A value and its derivatives along three directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<S> {
    /// The value.
    pub v: S,
    /// The derivatives.
    pub d: [S; 3],
}

impl<S: Scalar> Dual<S> {
    /// A value that changes at rate 1 along `direction` and not along the others.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub fn variable(v: S, direction: usize) -> Self {
        let mut d = [S::from_f64(0.0); 3];
        d[direction] = S::from_f64(1.0);
        Self { v, d }
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn constant(v: S) -> Self {
        Self { v, d: [S::from_f64(0.0); 3] }
    }

    /// f(self) with slope f'(self).
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn chain(self, v: S, slope: S) -> Self {
        Self { v, d: self.d.map(|d| d * slope) }
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn zip(self, b: Self, v: S, f: impl Fn(S, S) -> S) -> Self {
        Self { v, d: [f(self.d[0], b.d[0]), f(self.d[1], b.d[1]), f(self.d[2], b.d[2])] }
    }
}

impl<S: Scalar> From<f64> for Dual<S> {
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn from(v: f64) -> Self {
        Self::constant(S::from_f64(v))
    }
}

impl<S: Scalar> Add for Dual<S> {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn add(self, b: Self) -> Self {
        self.zip(b, self.v + b.v, |x, y| x + y)
    }
}

impl<S: Scalar> Sub for Dual<S> {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sub(self, b: Self) -> Self {
        self.zip(b, self.v - b.v, |x, y| x - y)
    }
}

impl<S: Scalar> Neg for Dual<S> {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn neg(self) -> Self {
        Self { v: -self.v, d: self.d.map(|d| -d) }
    }
}

// The product and quotient rules add and subtract.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<S: Scalar> Mul for Dual<S> {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn mul(self, b: Self) -> Self {
        self.zip(b, self.v * b.v, |x, y| x * b.v + y * self.v)
    }
}

// The product and quotient rules add and subtract.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<S: Scalar> Div for Dual<S> {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn div(self, b: Self) -> Self {
        let q = self.v / b.v;
        self.zip(b, q, |x, y| (x - q * y) / b.v)
    }
}

impl<S: Scalar> Scalar for Dual<S> {
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn from_f64(v: f64) -> Self {
        Self::constant(S::from_f64(v))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn abs(self) -> Self {
        self.chain(self.v.abs(), self.v.sign())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sign(self) -> Self {
        Self::constant(self.v.sign())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sqrt(self) -> Self {
        let r = self.v.sqrt();
        Self { v: r, d: self.d.map(|d| d.half_over(r)) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn half_over(self, root: Self) -> Self {
        let q = self.v.half_over(root.v);
        self.zip(root, q, |x, y| (x - (q + q) * y).half_over(root.v))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn square(self) -> Self {
        self.chain(self.v.square(), self.v + self.v)
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn exp(self) -> Self {
        let e = self.v.exp();
        self.chain(e, e)
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn ln(self) -> Self {
        Self { v: self.v.ln(), d: self.d.map(|d| d / self.v) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn times_ln(self, a: Self) -> Self {
        self.zip(a, self.v.times_ln(a.v), |x, y| x.times_ln(a.v) + self.v * y / a.v)
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sin(self) -> Self {
        self.chain(self.v.sin(), self.v.cos())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn cos(self) -> Self {
        self.chain(self.v.cos(), -self.v.sin())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn tan(self) -> Self {
        let t = self.v.tan();
        self.chain(t, S::from_f64(1.0) + t.square())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn asin(self) -> Self {
        let w = (S::from_f64(1.0) - self.v.square()).sqrt();
        Self { v: self.v.asin(), d: self.d.map(|d| d / w) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn acos(self) -> Self {
        let w = (S::from_f64(1.0) - self.v.square()).sqrt();
        Self { v: self.v.acos(), d: self.d.map(|d| -(d / w)) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn atan(self) -> Self {
        let w = S::from_f64(1.0) + self.v.square();
        Self { v: self.v.atan(), d: self.d.map(|d| d / w) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn floor(self) -> Self {
        Self::constant(self.v.floor())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn ceil(self) -> Self {
        Self::constant(self.v.ceil())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn round(self) -> Self {
        Self::constant(self.v.round())
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn min(self, b: Self) -> Self {
        self.zip(b, self.v.min(b.v), |x, y| self.v.pass_if_less(b.v, x) + b.v.pass_if_less(self.v, y))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn max(self, b: Self) -> Self {
        self.zip(b, self.v.max(b.v), |x, y| b.v.pass_if_less(self.v, x) + self.v.pass_if_less(b.v, y))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn pow(self, b: Self) -> Self {
        let r = self.v.pow(b.v);
        let slope = b.v * self.v.pow(b.v - S::from_f64(1.0));
        // An exponent that does not move has no logarithm to take, which a negative base would not have.
        self.zip(b, r, |x, y| x * slope + (r * y).times_ln(self.v))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn atan2(self, b: Self) -> Self {
        let w = self.v.square() + b.v.square();
        self.zip(b, self.v.atan2(b.v), |x, y| (x * b.v - y * self.v) / w)
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn modulo(self, b: Self) -> Self {
        let turns = (self.v / b.v).floor();
        self.zip(b, self.v.modulo(b.v), |x, y| x - y * turns)
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn less(self, b: Self) -> Self {
        Self::constant(self.v.less(b.v))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn choose(mask: Self, b: Self, c: Self) -> Self {
        b.zip(c, S::choose(mask.v, b.v, c.v), |x, y| S::choose(mask.v, x, y))
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn pass_if_less(self, b: Self, g: Self) -> Self {
        Self { v: self.v.pass_if_less(b.v, g.v), d: g.d.map(|d| self.v.pass_if_less(b.v, d)) }
    }
}
