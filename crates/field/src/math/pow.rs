//! Powers and roots.

use super::double::{MAGIC, poly, sel, two_prod, xor_sign};
use super::exp::exp_pair;
use super::log::ln_pair;

const TWO_52: f64 = 4_503_599_627_370_496.0;
const TWO_54: f64 = 4.0 * TWO_52;
const TWO_MINUS_18: f64 = 1.0 / 262_144.0;

/// Is a >= 0 an integer?
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn is_integer(a: f64) -> bool {
    ((a + TWO_52) - TWO_52 == a) | (a >= TWO_52)
}

/// x to the power y, with the special values of IEEE 754 `pow`.
///
/// A negative x has a power for integer y, of the sign (-1)^y, and NaN for others. x^0 = 1 and 1^y = 1 also for NaN.
/// 0^y is 0 for y > 0 and inf for y < 0 (of the sign of x for odd y). Error below [`POW_ULPS`](super::POW_ULPS) over
/// the whole range; a result that is a double below 2^53 (small integers to small integers) is exact.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn pow(x: f64, y: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (lh, ll) = ln_pair(ax);
    // Beyond 2^66 every power of a double other than 1 has left the range.
    let cut = sel(ay > 7.4e19, xor_sign(7.4e19, y), y);
    let (p, e) = two_prod(cut, lh);
    let in_range = p.abs() <= 800.0;
    let r = exp_pair(p, sel(in_range, e + cut * ll, 0.0));

    let y_negative = y < 0.0;
    let r = sel(ax == 0.0, sel(y_negative, f64::INFINITY, 0.0), r);
    let r = sel(ax == f64::INFINITY, sel(y_negative, 0.0, f64::INFINITY), r);
    let integer = is_integer(ay);
    let odd = integer & !is_integer(0.5 * ay);
    let r = sel(odd, xor_sign(r, x), r);
    let no_value = (x < 0.0) & !integer & (ax < f64::INFINITY);
    let r = sel(no_value | x.is_nan() | y.is_nan(), f64::NAN, r);
    sel((y == 0.0) | (x == 1.0), 1.0, r)
}

/// cbrt(m) on [0.5, 4], relative error 2^-7.7.
const CBRT_POLY: [f64; 5] = [
    0.5189978361037302,
    0.6542973117201535,
    -0.21580018957752015,
    0.04437845996234062,
    -0.003660165019409193,
];

/// Cube root: odd, defined for all x.
///
/// Error below [`CBRT_ULPS`](super::CBRT_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn cbrt(x: f64) -> f64 {
    let a = x.abs();
    let subnormal = a < f64::MIN_POSITIVE;
    let a = sel(subnormal, a * TWO_54, a);
    let bits = a.to_bits();
    let e = f64::from_bits(TWO_52.to_bits() | (bits >> 52)) - (TWO_52 + 1023.0);
    // a = 2^(3 k) m with 1/2 <= m < 4
    let t = e * (1.0 / 3.0) + MAGIC;
    let k = t.to_bits().wrapping_sub(MAGIC.to_bits());
    let m = f64::from_bits(bits.wrapping_sub(k.wrapping_mul(3) << 52));
    let t = poly(m, &CBRT_POLY);
    // Halley's iteration: the relative error 2^-7.7 becomes 2^-23,
    let c = t * t * t;
    let t = t * ((c + 2.0 * m) / (2.0 * c + m));
    // and, rounded to 23 bits so that t t is exact, once more.
    let t = f64::from_bits((t.to_bits() + 0x2000_0000) & !0x3fff_ffff);
    let q = m / (t * t);
    let r = t + t * ((q - t) / (2.0 * t + q));
    let back = sel(subnormal, TWO_MINUS_18, 1.0);
    let r = r * f64::from_bits(k.wrapping_add(1023) << 52) * back;
    let r = sel((x == 0.0) | (x.abs() >= f64::INFINITY) | x.is_nan(), x.abs(), r);
    xor_sign(r, x)
}
