//! Intervals with outward rounding: whatever a point of the operands evaluates to, in exact arithmetic or in
//! this crate's `f64` evaluators, lies inside the result.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math;
use crate::scalar::Scalar;

/// A closed interval. Where an operation is undefined on the whole operand, or unbounded, the result is all
/// numbers ([`Interval::ENTIRE`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// At least one unit in the last place, without a branch: several boxes are evaluated side by side.
#[inline(always)]
fn step(v: f64) -> f64 {
    let e = v.abs() * f64::EPSILON + f64::from_bits(1);
    if v.is_finite() { e } else { 0.0 }
}

#[inline(always)]
fn down(v: f64) -> f64 {
    v - step(v)
}

#[inline(always)]
fn up(v: f64) -> f64 {
    v + step(v)
}

/// Moves an end by `ulps` units in the last place; used where a function is not correctly rounded.
fn widen(lo: f64, hi: f64, ulps: f64) -> Interval {
    let slack = ulps * f64::EPSILON;
    Interval::checked(down(lo - lo.abs() * slack), up(hi + hi.abs() * slack))
}

/// Units in the last place by which the elementary functions may be wrong, with a margin.
const ULPS: f64 = 8.0;

impl Interval {
    /// All numbers.
    pub const ENTIRE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// Exactly 0.
    pub const ZERO: Interval = Interval { lo: 0.0, hi: 0.0 };

    /// The interval from `lo` to `hi`.
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// The interval, or everything if an end is not a number.
    #[inline(always)]
    fn checked(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::ENTIRE }
    }

    /// Whether the number lies inside (NaN lies in every unbounded interval).
    pub fn contains(&self, v: f64) -> bool {
        (self.lo <= v && v <= self.hi) || (v.is_nan() && *self == Self::ENTIRE)
    }

    /// Whether 0 lies inside.
    #[inline(always)]
    pub fn has_zero(&self) -> bool {
        self.lo <= 0.0 && 0.0 <= self.hi
    }

    /// The smallest interval around both.
    #[inline(always)]
    pub fn hull(self, b: Self) -> Self {
        Self { lo: self.lo.min(b.lo), hi: self.hi.max(b.hi) }
    }

    /// The largest absolute value inside.
    #[inline(always)]
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// hi − lo
    pub fn width(self) -> f64 {
        self.hi - self.lo
    }

    fn is_point(self) -> bool {
        self.lo == self.hi
    }

    fn around(values: [f64; 4], ulps: f64) -> Self {
        if values.iter().any(|v| v.is_nan()) {
            return Self::ENTIRE;
        }
        let lo = values.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        widen(lo, hi, ulps)
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self::checked(down(self.lo + b.lo), up(self.hi + b.hi))
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self::checked(down(self.lo - b.hi), up(self.hi - b.lo))
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        if self == Self::ZERO || b == Self::ZERO {
            return Self::ZERO;
        }
        let p = [self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi];
        // 0 · ∞ is 0 here: the infinite end stands for arbitrarily large finite numbers.
        let p = p.map(|v| if v.is_nan() { 0.0 } else { v });
        let lo = p[0].min(p[1]).min(p[2].min(p[3]));
        let hi = p[0].max(p[1]).max(p[2].max(p[3]));
        Self { lo: down(lo), hi: up(hi) }
    }
}

impl Div for Interval {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        if b.has_zero() {
            return Self::ENTIRE;
        }
        let p = [self.lo / b.lo, self.lo / b.hi, self.hi / b.lo, self.hi / b.hi];
        if p.iter().any(|v| v.is_nan()) {
            return Self::ENTIRE;
        }
        let lo = p[0].min(p[1]).min(p[2].min(p[3]));
        let hi = p[0].max(p[1]).max(p[2].max(p[3]));
        Self { lo: down(lo), hi: up(hi) }
    }
}

impl Scalar for Interval {
    #[inline(always)]
    fn from_f64(v: f64) -> Self {
        if v.is_nan() { Self::ENTIRE } else { Self { lo: v, hi: v } }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Self { lo: 0.0, hi: self.magnitude() }
        }
    }
    fn sign(self) -> Self {
        Self { lo: self.lo.sign(), hi: self.hi.sign() }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        if self.hi < 0.0 {
            return Self::ENTIRE;
        }
        Self { lo: down(self.lo.max(0.0).sqrt()).max(0.0), hi: up(self.hi.sqrt()) }
    }
    #[inline(always)]
    fn half_over(self, root: Self) -> Self {
        if root.lo > 0.0 { self / (root + root) } else { Self::ENTIRE }
    }
    #[inline(always)]
    fn square(self) -> Self {
        let a = self.abs();
        Self { lo: down(a.lo * a.lo).max(0.0), hi: up(a.hi * a.hi) }
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let r = widen(math::exp(self.lo), math::exp(self.hi), ULPS);
        Self { lo: r.lo.max(0.0), hi: r.hi }
    }
    fn ln(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ENTIRE;
        }
        let lo = if self.lo > 0.0 { math::ln(self.lo) } else { f64::NEG_INFINITY };
        widen(lo, math::ln(self.hi), ULPS)
    }
    fn times_ln(self, a: Self) -> Self {
        if self == Self::ZERO {
            Self::ZERO
        } else if a.lo > 0.0 {
            self * a.ln()
        } else {
            Self::ENTIRE
        }
    }
    fn sin(self) -> Self {
        (self - Self { lo: down(FRAC_PI_2), hi: up(FRAC_PI_2) }).cos()
    }
    fn cos(self) -> Self {
        // Beyond this the reduction of the argument loses what matters here.
        if self.magnitude() > 1e8 || !self.width().is_finite() || self.width() >= TAU {
            return Self { lo: -1.0, hi: 1.0 };
        }
        let slack = 1e-14 * (1.0 + self.magnitude());
        let reaches = |phase: f64| {
            ((self.lo - phase - slack) / TAU).floor() != ((self.hi - phase + slack) / TAU).floor()
        };
        let (a, b) = (math::cos(self.lo), math::cos(self.hi));
        let pad = 16.0 * f64::EPSILON;
        Self {
            lo: if reaches(PI) { -1.0 } else { (a.min(b) - pad).max(-1.0) },
            hi: if reaches(0.0) { 1.0 } else { (a.max(b) + pad).min(1.0) },
        }
    }
    fn tan(self) -> Self {
        let slack = 1e-14 * (1.0 + self.magnitude());
        let turn = |v: f64| ((v + FRAC_PI_2) / PI).floor();
        if self.magnitude() > 1e8 || self.width() >= PI || turn(self.lo - slack) != turn(self.hi + slack) {
            return Self::ENTIRE;
        }
        widen(math::tan(self.lo), math::tan(self.hi), 64.0)
    }
    fn asin(self) -> Self {
        if self.hi < -1.0 || self.lo > 1.0 {
            return Self::ENTIRE;
        }
        widen(math::asin(self.lo.max(-1.0)), math::asin(self.hi.min(1.0)), ULPS)
    }
    fn acos(self) -> Self {
        if self.hi < -1.0 || self.lo > 1.0 {
            return Self::ENTIRE;
        }
        widen(math::acos(self.hi.min(1.0)), math::acos(self.lo.max(-1.0)), ULPS)
    }
    fn atan(self) -> Self {
        widen(math::atan(self.lo), math::atan(self.hi), ULPS)
    }
    fn floor(self) -> Self {
        Self { lo: self.lo.floor(), hi: self.hi.floor() }
    }
    fn ceil(self) -> Self {
        Self { lo: self.lo.ceil(), hi: self.hi.ceil() }
    }
    fn round(self) -> Self {
        Self { lo: Scalar::round(self.lo), hi: Scalar::round(self.hi) }
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self { lo: self.lo.min(b.lo), hi: self.hi.min(b.hi) }
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self { lo: self.lo.max(b.lo), hi: self.hi.max(b.hi) }
    }
    fn pow(self, b: Self) -> Self {
        let corner = math::pow;
        if self.lo > 0.0 {
            let p = [
                corner(self.lo, b.lo),
                corner(self.lo, b.hi),
                corner(self.hi, b.lo),
                corner(self.hi, b.hi),
            ];
            let r = Self::around(p, ULPS);
            return Self { lo: r.lo.max(0.0), hi: r.hi };
        }
        if b.is_point() && b.lo.fract() == 0.0 {
            if b.lo < 0.0 && self.has_zero() {
                return Self::ENTIRE;
            }
            let even = b.lo % 2.0 == 0.0;
            let base = if even { self.abs() } else { self };
            return Self::around([corner(base.lo, b.lo), corner(base.hi, b.lo), corner(base.lo, b.lo), corner(base.hi, b.lo)], ULPS);
        }
        if self.hi >= 0.0 && b.lo > 0.0 && b.is_point() {
            // A power that is not an integer: undefined for negative bases.
            return Self { lo: 0.0, hi: widen(0.0, corner(self.hi, b.lo), ULPS).hi };
        }
        Self::ENTIRE
    }
    fn atan2(self, x: Self) -> Self {
        if x.lo <= 0.0 && self.has_zero() {
            return Self { lo: down(-PI), hi: up(PI) };
        }
        let f = math::atan2;
        Self::around([f(self.lo, x.lo), f(self.lo, x.hi), f(self.hi, x.lo), f(self.hi, x.hi)], ULPS)
    }
    fn modulo(self, b: Self) -> Self {
        if b.has_zero() {
            return Self::ENTIRE;
        }
        let turns = (self / b).floor();
        if turns.is_point() {
            return self - b * turns;
        }
        // Rounding may carry the remainder slightly past either end.
        let slack = (self.magnitude() + b.magnitude()) * 4.0 * f64::EPSILON;
        let r = b.hull(Self { lo: 0.0, hi: 0.0 });
        Self { lo: r.lo - slack, hi: r.hi + slack }
    }
    #[inline(always)]
    fn less(self, b: Self) -> Self {
        if self.hi < b.lo {
            Self { lo: 1.0, hi: 1.0 }
        } else if self.lo >= b.hi {
            Self { lo: 0.0, hi: 0.0 }
        } else {
            Self { lo: 0.0, hi: 1.0 }
        }
    }
    #[inline(always)]
    fn choose(mask: Self, b: Self, c: Self) -> Self {
        if mask.lo == 0.0 && mask.hi == 0.0 {
            c
        } else if !mask.has_zero() {
            b
        } else {
            b.hull(c)
        }
    }
    #[inline(always)]
    fn pass_if_less(self, b: Self, g: Self) -> Self {
        let zero = Self { lo: 0.0, hi: 0.0 };
        if self.hi < b.lo {
            g
        } else if self.lo > b.hi {
            zero
        } else {
            g.hull(zero)
        }
    }
}
