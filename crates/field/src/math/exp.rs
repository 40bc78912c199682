//! The exponential and the hyperbolic functions.

use super::double::{MAGIC, fast_two_sum, poly, sel, xor_sign};
use crate::wide::WideDouble;

const LOG2_E: f64 = core::f64::consts::LOG2_E;
/// ln 2 in two parts; the first has 32 bits, so that k times it is exact for |k| < 2^21.
const LN2: [f64; 2] = [0.6931471803691238, 1.9082149292705877e-10];
/// (e^r - 1 - r) / r^2 on |r| <= ln(2) / 2, relative error 2^-51.9.
const EXP_POLY: [f64; 10] = [
    0.5000000000000001,
    0.16666666666666669,
    0.041666666666623824,
    0.008333333333330039,
    0.0013888888917367081,
    0.00019841269863171557,
    2.4801521057868204e-05,
    2.7557268276905696e-06,
    2.7620201591031547e-07,
    2.5100472505694996e-08,
];

/// x + lo = k ln 2 + r with |r| <= ln(2) / 2, |k| <= 1077. `hi` + `lo` = e^r - 1, `bits` holds k as [`MAGIC`] does.
struct Reduced<T> {
    bits: T,
    hi: T,
    lo: T,
}

#[inline(always)]
fn reduce<T: WideDouble>(x: T, lo: T) -> Reduced<T> {
    let (c, magic) = (T::splat, T::splat(MAGIC));
    let t = x * c(LOG2_E) + magic;
    let k = t - magic;
    let a = x - k * c(LN2[0]);
    let b = k * c(LN2[1]) - lo;
    let r = a - b;
    let tail = (a - r) - b;
    Reduced { bits: t, hi: r, lo: r * r * poly(r, &EXP_POLY) + tail }
}

/// 2^a and 2^b with a + b = k + shift, so that neither factor overflows where their product with [0.7, 1.5] does not.
#[inline(always)]
fn powers<T: WideDouble>(bits: T, shift: i64) -> (T, T) {
    let sum = move |bits: u64| bits.wrapping_sub(MAGIC.to_bits()).wrapping_add((2046 + shift) as u64);
    let half = move |bits: u64| (sum(bits) >> 1) & 0x7ff;
    (bits.map_bits(|b| half(b) << 52), bits.map_bits(|b| sum(b).wrapping_sub(half(b)) << 52))
}

/// e^(x + lo) for |lo| <= ulp(x); x beyond the range of results is cut, NaN stays NaN.
#[inline(always)]
fn exp_pairs<T: WideDouble>(x: T, lo: T) -> T {
    let (least, most) = (T::splat(-746.0), T::splat(710.0));
    let x = most.if_less(x, most, x.if_less(least, least, x));
    let r = reduce(x, lo);
    let (s, e) = fast_two_sum(T::splat(1.0), r.hi);
    let (a, b) = powers(r.bits, 0);
    (s + (e + r.lo)) * a * b
}

/// [`exp_pairs`] of one number.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn exp_pair(x: f64, lo: f64) -> f64 {
    exp_pairs(x, lo)
}

/// [`exp`] of several numbers.
#[inline(always)]
pub(crate) fn exps<T: WideDouble>(x: T) -> T {
    exp_pairs(x, T::splat(0.0))
}

/// e^x. Overflows to +inf above 709.78, underflows through the subnormals to 0 below -745.13.
///
/// Error below [`EXP_ULPS`](super::EXP_ULPS); NaN gives NaN.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn exp(x: f64) -> f64 {
    exp_pair(x, 0.0)
}

/// (e^a - 1) 2^-SHIFT for a >= 0 or NaN; +inf for a > 710.6, where sinh and cosh have overflowed.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn exp_m1_scaled<const SHIFT: i64>(a: f64) -> f64 {
    let a = sel(a > 720.0, 720.0, a);
    let r = reduce(a, 0.0);
    let (p, q) = powers(r.bits, -SHIFT);
    // 2^k (1 + hi + lo) - 1, with 2^k - 1 added exactly.
    let one = 1.0 / (1u64 << SHIFT) as f64;
    let scale = |v: f64| v * p * q;
    let (s, e) = super::double::two_sum(scale(1.0), -one);
    let (s, f) = super::double::two_sum(s, scale(r.hi));
    let sum = s + ((e + f) + scale(r.lo));
    // The sums above have become inf - inf.
    sel(a > 710.6, f64::INFINITY, sum)
}

/// Hyperbolic sine: odd, overflows to an infinity beyond |x| = 710.47.
///
/// Error below [`SINH_ULPS`](super::SINH_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn sinh(x: f64) -> f64 {
    let a = x.abs();
    // With E = e^a - 1 and g = E / 4: sinh a = (E + E / (E + 1)) / 2 = 2 (g + g / (4 g + 1)).
    let g = exp_m1_scaled::<2>(a);
    let rest = sel(g > 1e20, 0.25, g / (4.0 * g + 1.0));
    // Below 2^-28 sinh a is a to the last bit, and a / 4 may have lost some.
    xor_sign(sel(a < 3.7e-9, a, 2.0 * (g + rest)), x)
}

/// Hyperbolic cosine: even, overflows to +inf beyond |x| = 710.47.
///
/// Error below [`COSH_ULPS`](super::COSH_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn cosh(x: f64) -> f64 {
    // With E = e^|x| - 1 and h = E / 2: cosh x = (E + 1 + 1 / (E + 1)) / 2 = 1 + 2 h^2 / (2 h + 1).
    let h = 2.0 * exp_m1_scaled::<2>(x.abs());
    let small = 1.0 + 2.0 * h * h / (2.0 * h + 1.0);
    let large = (h + 0.5) + 0.25 / (h + 0.5);
    sel(h > 0.25, large, small)
}

/// Hyperbolic tangent: odd, within [-1, 1].
///
/// Error below [`TANH_ULPS`](super::TANH_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn tanh(x: f64) -> f64 {
    let a = x.abs();
    let e = exp_m1_scaled::<0>(2.0 * sel(a > 20.0, 20.0, a));
    xor_sign(e / (e + 2.0), x)
}
