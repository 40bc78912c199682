//! Sine, cosine and tangent.

use super::double::{MAGIC, blend, poly, sel, two_sum};

/// pi / 2 in three parts of 33 bits and a rest: q times a part is exact for |q| <= 2^20.
const PIO2: [f64; 4] =
    [1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32];
const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
/// (sin r - r) / r^3 in z = r^2 <= 0.64, relative error 2^-51.9.
const SIN_POLY: [f64; 6] = [
    -0.16666666666666663,
    0.008333333333330467,
    -0.00019841269836043575,
    2.7557315738586845e-06,
    -2.5051057394492127e-08,
    1.5912864224903485e-10,
];
/// (cos r - 1 + z / 2) / z^2 in z = r^2 <= 0.64, relative error 2^-54.
const COS_POLY: [f64; 6] = [
    0.041666666666666664,
    -0.0013888888888887096,
    2.4801587298318395e-05,
    -2.755731704403567e-07,
    2.0876099692314926e-09,
    -1.1379338585298136e-11,
];

/// Up to this |x| (2^20 pi / 2, rounded down) the error bounds of [`sin`], [`cos`], [`tan`] in ulps hold.
///
/// Beyond, up to [`TRIG_RANGE`], the result is that of an argument x (1 + e), |e| <= 2^-51: bounded and
/// deterministic, with an absolute error of at most 2^-51 |x|.
pub const TRIG_ACCURATE: f64 = 1_647_000.0;

/// Beyond this |x| (2^40; a double there is less than 2^12 steps from the next period) the argument of [`sin`],
/// [`cos`] and [`tan`] is taken as 0. Infinities and NaN give NaN.
pub const TRIG_RANGE: f64 = 1_099_511_627_776.0;

/// x = q pi / 2 + r: sin r, cos r and masks of the two lowest bits of q.
struct Quadrant {
    sin: f64,
    cos: f64,
    odd: u64,
    bits: u64,
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn quadrant(x: f64) -> Quadrant {
    // 0 x is NaN for infinities.
    let x = sel(x.abs() <= TRIG_RANGE, x, 0.0 * x);
    let t = x * TWO_OVER_PI + MAGIC;
    let q = t - MAGIC;
    let (h, e0) = two_sum(x - q * PIO2[0], -q * PIO2[1]);
    let (h, e1) = two_sum(h, -q * PIO2[2]);
    let low = (e0 + e1) - q * PIO2[3];
    let r = h + low;
    let lo = low - (r - h);

    let z = r * r;
    let hz = 0.5 * z;
    // sin(r + lo) = r + r^3 P(z) + lo cos r
    let sin = r + (z * r * poly(z, &SIN_POLY) + lo * (1.0 - hz));
    let sin = sel(x == 0.0, x, sin); // keeps the sign of a zero
    // cos(r + lo) = 1 - z / 2 + z^2 Q(z) - lo sin r
    let w = 1.0 - hz;
    let cos = w + (((1.0 - w) - hz) + (z * z * poly(z, &COS_POLY) - r * lo));
    let bits = t.to_bits();
    Quadrant { sin, cos, odd: (bits & 1).wrapping_neg(), bits }
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn negate_if(x: f64, bit1: u64) -> f64 {
    f64::from_bits(x.to_bits() ^ ((bit1 & 2) << 62))
}

/// Sine and cosine of x radians, for little more than the price of one of them.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    let Quadrant { sin, cos, odd, bits } = quadrant(x);
    (negate_if(blend(odd, cos, sin), bits), negate_if(blend(odd, sin, cos), bits.wrapping_add(1)))
}

/// Sine of x radians, within [-1, 1].
///
/// Error below [`SIN_ULPS`](super::SIN_ULPS) for |x| <= [`TRIG_ACCURATE`], which see for larger x.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn sin(x: f64) -> f64 {
    sin_cos(x).0
}

/// Cosine of x radians, within [-1, 1].
///
/// Error below [`COS_ULPS`](super::COS_ULPS) for |x| <= [`TRIG_ACCURATE`], which see for larger x.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn cos(x: f64) -> f64 {
    sin_cos(x).1
}

/// Tangent of x radians.
///
/// Error below [`TAN_ULPS`](super::TAN_ULPS) for |x| <= [`TRIG_ACCURATE`], which see for larger x.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn tan(x: f64) -> f64 {
    let Quadrant { sin, cos, odd, .. } = quadrant(x);
    let num = blend(odd, cos, sin);
    let den = blend(odd, sin, cos);
    f64::from_bits((num / den).to_bits() ^ (odd & (1 << 63)))
}
