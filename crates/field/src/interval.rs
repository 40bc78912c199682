//! Intervals with outward rounding: whatever a point of the operands evaluates to, in exact arithmetic or in
//! this crate's `f64` evaluators, lies inside the result. Points where an operation is undefined (the root or the
//! logarithm of a negative number, …) do not count: an interval says nothing of what follows from their NaN.

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
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn step(v: f64) -> f64 {
    let e = v.abs() * f64::EPSILON + f64::from_bits(1);
    if v.is_finite() { e } else { 0.0 }
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn down(v: f64) -> f64 {
    v - step(v)
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn up(v: f64) -> f64 {
    v + step(v)
}

/// The smaller of two numbers that are not NaN, as one instruction.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers that are not NaN, as one instruction.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn largest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The range of a monotone function, given its computed values at the ends and a bound on their error (the
/// `*_ULPS` of [`math`]). The slack is twice that: the value computed at a point inside may be wrong the other way.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn widen(lo: f64, hi: f64, ulps: f64) -> Interval {
    let slack = |v: f64| 2.0 * ulps * (v.abs() * f64::EPSILON + f64::from_bits(1));
    // An infinite value stands for a finite one that is too large.
    let (lo, hi) = (finite_or(lo, f64::NEG_INFINITY), finite_or(hi, f64::INFINITY));
    Interval::checked(down(lo - slack(lo)), up(hi + slack(hi)))
}

/// Beyond [`math::TRIG_ACCURATE`] sine and cosine are wrong by up to this times the argument: 2⁻⁵¹.
const FAR: f64 = 2.0 * f64::EPSILON;

/// How far a turning point of a trigonometric function may lie from where it is found, for arguments up to `size`.
fn reduction_slack(size: f64) -> f64 {
    1e-14 * (1.0 + size)
}

/// `v`, or the largest number of its sign if it is infinite, unless it is `allowed`.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn finite_or(v: f64, allowed: f64) -> f64 {
    if v.is_infinite() && v != allowed { v.signum() * f64::MAX } else { v }
}

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
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn checked(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::ENTIRE }
    }

    /// Whether the number lies inside (NaN lies in every unbounded interval).
    pub fn contains(&self, v: f64) -> bool {
        (self.lo <= v && v <= self.hi) || (v.is_nan() && *self == Self::ENTIRE)
    }

    /// Whether 0 lies inside.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub fn has_zero(&self) -> bool {
        self.lo <= 0.0 && 0.0 <= self.hi
    }

    /// The smallest interval around both.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub fn hull(self, b: Self) -> Self {
        Self { lo: self.lo.min(b.lo), hi: self.hi.max(b.hi) }
    }

    /// The largest absolute value inside.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
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

    /// Sine or cosine: `top` is where `f` is 1; half a turn on it is −1.
    fn wave(self, f: fn(f64) -> f64, ulps: f64, top: f64) -> Self {
        let size = self.magnitude();
        // Written so that an infinite width fails too.
        if !(size <= math::TRIG_RANGE && self.width() < TAU) {
            return Self { lo: -1.0, hi: 1.0 };
        }
        let slack = reduction_slack(size);
        let reaches = |phase: f64| {
            ((self.lo - phase - slack) / TAU).floor() != ((self.hi - phase + slack) / TAU).floor()
        };
        let (a, b) = (f(self.lo), f(self.hi));
        let r = widen(a.min(b), a.max(b), ulps);
        let pad = if size > math::TRIG_ACCURATE { 2.0 * FAR * size } else { 0.0 };
        Self {
            lo: if reaches(top + PI) { -1.0 } else { (r.lo - pad).max(-1.0) },
            hi: if reaches(top) { 1.0 } else { (r.hi + pad).min(1.0) },
        }
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
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn add(self, b: Self) -> Self {
        Self::checked(down(self.lo + b.lo), up(self.hi + b.hi))
    }
}

impl Sub for Interval {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sub(self, b: Self) -> Self {
        Self::checked(down(self.lo - b.hi), up(self.hi - b.lo))
    }
}

impl Neg for Interval {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn mul(self, b: Self) -> Self {
        // Without branches: several intervals are multiplied side by side.
        let zero = ((self.lo == 0.0) & (self.hi == 0.0)) | ((b.lo == 0.0) & (b.hi == 0.0));
        let p = [self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi];
        // 0 · ∞ is 0 here: the infinite end stands for arbitrarily large finite numbers.
        let p = p.map(|v| if v.is_nan() { 0.0 } else { v });
        let lo = least(least(p[0], p[1]), least(p[2], p[3]));
        let hi = largest(largest(p[0], p[1]), largest(p[2], p[3]));
        let (lo, hi) = (down(lo), up(hi));
        Self { lo: if zero { 0.0 } else { lo }, hi: if zero { 0.0 } else { hi } }
    }
}

impl Div for Interval {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
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
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn from_f64(v: f64) -> Self {
        if v.is_nan() { Self::ENTIRE } else { Self { lo: v, hi: v } }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn abs(self) -> Self {
        let lo = largest(largest(self.lo, -self.hi), 0.0);
        Self { lo, hi: largest(self.lo.abs(), self.hi.abs()) }
    }
    fn sign(self) -> Self {
        Self { lo: self.lo.sign(), hi: self.hi.sign() }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn sqrt(self) -> Self {
        if self.hi < 0.0 {
            return Self::ENTIRE;
        }
        Self { lo: down(self.lo.max(0.0).sqrt()).max(0.0), hi: up(self.hi.sqrt()) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn half_over(self, root: Self) -> Self {
        if root.lo > 0.0 { self / (root + root) } else { Self::ENTIRE }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn square(self) -> Self {
        let a = self.abs();
        Self { lo: down(a.lo * a.lo).max(0.0), hi: up(a.hi * a.hi) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn exp(self) -> Self {
        let r = widen(math::exp(self.lo), math::exp(self.hi), math::EXP_ULPS);
        Self { lo: r.lo.max(0.0), hi: r.hi }
    }
    fn ln(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ENTIRE;
        }
        let lo = if self.lo > 0.0 { math::ln(self.lo) } else { f64::NEG_INFINITY };
        widen(lo, math::ln(self.hi), math::LN_ULPS)
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
        self.wave(math::sin, math::SIN_ULPS, FRAC_PI_2)
    }
    fn cos(self) -> Self {
        self.wave(math::cos, math::COS_ULPS, 0.0)
    }
    fn tan(self) -> Self {
        let slack = reduction_slack(self.magnitude());
        let turn = |v: f64| ((v + FRAC_PI_2) / PI).floor();
        let far = self.magnitude() > math::TRIG_ACCURATE;
        if far || self.width() >= PI || turn(self.lo - slack) != turn(self.hi + slack) {
            return Self::ENTIRE;
        }
        widen(math::tan(self.lo), math::tan(self.hi), math::TAN_ULPS)
    }
    fn asin(self) -> Self {
        if self.hi < -1.0 || self.lo > 1.0 {
            return Self::ENTIRE;
        }
        widen(math::asin(self.lo.max(-1.0)), math::asin(self.hi.min(1.0)), math::ASIN_ULPS)
    }
    fn acos(self) -> Self {
        if self.hi < -1.0 || self.lo > 1.0 {
            return Self::ENTIRE;
        }
        widen(math::acos(self.hi.min(1.0)), math::acos(self.lo.max(-1.0)), math::ACOS_ULPS)
    }
    fn atan(self) -> Self {
        widen(math::atan(self.lo), math::atan(self.hi), math::ATAN_ULPS)
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
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn min(self, b: Self) -> Self {
        Self { lo: least(self.lo, b.lo), hi: least(self.hi, b.hi) }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn max(self, b: Self) -> Self {
        Self { lo: largest(self.lo, b.lo), hi: largest(self.hi, b.hi) }
    }
    fn pow(self, b: Self) -> Self {
        let (corner, ulps) = (math::pow, math::POW_ULPS);
        if self.lo > 0.0 {
            // aᵇ = exp(b ln a), and b ln a is extreme at the corners.
            let low = [corner(self.lo, b.lo), corner(self.lo, b.hi)];
            let high = [corner(self.hi, b.lo), corner(self.hi, b.hi)];
            let r = Self::around([low[0], low[1], high[0], high[1]], ulps);
            return Self { lo: r.lo.max(0.0), hi: r.hi };
        }
        if b.is_point() && b.lo.fract() == 0.0 {
            if b.lo < 0.0 && self.has_zero() {
                return Self::ENTIRE;
            }
            let even = b.lo % 2.0 == 0.0;
            let base = if even { self.abs() } else { self };
            let (p, q) = (corner(base.lo, b.lo), corner(base.hi, b.lo));
            return Self::around([p, q, p, q], ulps);
        }
        if b.lo <= 0.0 {
            return Self::ENTIRE;
        }
        // Negative bases have powers for the whole exponents only, if there are any.
        let negative = self.lo < 0.0 && b.lo.ceil() <= b.hi;
        if !negative && self.hi < 0.0 {
            return Self::ENTIRE;
        }
        let size = if negative { self.magnitude() } else { self.hi };
        let top = widen(0.0, corner(size, b.lo).max(corner(size, b.hi)), ulps).hi;
        Self { lo: if negative { -top } else { 0.0 }, hi: top }
    }
    fn atan2(self, x: Self) -> Self {
        if x.lo <= 0.0 && self.has_zero() {
            return Self { lo: down(-PI), hi: up(PI) };
        }
        let f = math::atan2;
        Self::around(
            [f(self.lo, x.lo), f(self.lo, x.hi), f(self.hi, x.lo), f(self.hi, x.hi)],
            math::ATAN2_ULPS,
        )
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
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn less(self, b: Self) -> Self {
        if self.hi < b.lo {
            Self { lo: 1.0, hi: 1.0 }
        } else if self.lo >= b.hi {
            Self { lo: 0.0, hi: 0.0 }
        } else {
            Self { lo: 0.0, hi: 1.0 }
        }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn choose(mask: Self, b: Self, c: Self) -> Self {
        if mask.lo == 0.0 && mask.hi == 0.0 {
            c
        } else if !mask.has_zero() {
            b
        } else {
            b.hull(c)
        }
    }
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn pass_if_less(self, b: Self, g: Self) -> Self {
        let (below, above) = (self.hi < b.lo, self.lo > b.hi);
        let (lo, hi) = (least(g.lo, 0.0), largest(g.hi, 0.0));
        let end = |open: f64, taken: f64| {
            let open = if above { 0.0 } else { open };
            if below { taken } else { open }
        };
        Self { lo: end(lo, g.lo), hi: end(hi, g.hi) }
    }
}
