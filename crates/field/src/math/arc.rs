//! The inverse trigonometric functions.

use super::double::{fast_two_sum, poly, sel, two_sum, xor_sign};

/// (atan t - t) / t^3 in z = t^2 <= (7/16)^2, relative error 2^-51.3.
const ATAN_POLY: [f64; 11] = [
    -0.33333333333333326,
    0.1999999999998777,
    -0.1428571428314864,
    0.11111110900560475,
    -0.09090900195560148,
    0.07692087348767168,
    -0.06663239299107136,
    0.05847724720645106,
    -0.05033942776485848,
    0.03782521866106712,
    -0.017547235157290005,
];
/// (asin s - s) / s^3 in z = s^2 <= 1/4, relative error 2^-52.9.
const ASIN_POLY: [f64; 13] = [
    0.16666666666666669,
    0.07499999999998433,
    0.04464285714635543,
    0.030381944138531247,
    0.02237217294214989,
    0.017352392720869973,
    0.013971212973552933,
    0.011479177415184906,
    0.01032281435018578,
    0.005457506718640358,
    0.01740087944269402,
    -0.014851887071247204,
    0.028757851367421566,
];
const PI: [f64; 2] = [core::f64::consts::PI, 1.2246467991473532e-16];
const PIO2: [f64; 2] = [core::f64::consts::FRAC_PI_2, 6.123233995736766e-17];
const PIO4: [f64; 2] = [core::f64::consts::FRAC_PI_4, 3.061616997868383e-17];
const ATAN_HALF: [f64; 2] = [0.4636476090008061, 2.2698777452961687e-17];

/// base + sign atan(a / b) for 0 <= a <= b; `negative` has the sign bit set for sign = -1.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn atan_ratio(a: f64, b: f64, base: f64, base_lo: f64, negative: f64) -> f64 {
    // atan(a / b) = atan c + atan((a - c b) / (b + c a)) for c = 0, 1/2, 1; a - c b is exact by Sterbenz's lemma.
    let one = a > 0.6875 * b;
    let half = a > 0.4375 * b;
    let (a2, b2) = (sel(one, a, 2.0 * a), sel(one, b, 2.0 * b));
    let num = sel(half, a2 - b, a);
    let den = sel(half, b2 + a, b);
    let c = sel(one, PIO4[0], sel(half, ATAN_HALF[0], 0.0));
    let cl = sel(one, PIO4[1], sel(half, ATAN_HALF[1], 0.0));
    let t = num / den;
    let t = sel(num == 0.0, 0.0, t);
    let z = t * t;
    let rest = t * z * poly(z, &ATAN_POLY);
    let (s, e) = fast_two_sum(base, xor_sign(c, negative));
    let (s, f) = two_sum(s, xor_sign(t, negative));
    s + ((e + f) + (base_lo + xor_sign(cl + rest, negative)))
}

/// Inverse tangent, within [-pi / 2, pi / 2] (the doubles next to it).
///
/// Error below [`ATAN_ULPS`](super::ATAN_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn atan(x: f64) -> f64 {
    let ax = x.abs();
    let swap = ax > 1.0;
    let big = sel(ax > 1e300, 1e300, ax);
    let a = sel(swap, 1.0, ax);
    let b = sel(swap, big, 1.0);
    let r = atan_ratio(a, b, sel(swap, PIO2[0], 0.0), sel(swap, PIO2[1], 0.0), sel(swap, -1.0, 1.0));
    xor_sign(r, x)
}

/// Angle of the vector (x, y) in [-pi, pi]: atan(y / x) in the quadrant of the vector.
///
/// Signs of zeros count as in IEEE 754: atan2(+-0, x) is +-0 for x = +0 or above, +-pi for x = -0 or below; of two
/// infinities the angle is an odd multiple of pi / 4. NaN if either is NaN. Error below
/// [`ATAN2_ULPS`](super::ATAN2_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    let (ay, ax) = (y.abs(), x.abs());
    let swap = ay > ax;
    let (a, b) = (sel(swap, ax, ay), sel(swap, ay, ax));
    // The sums of the reduction must not overflow.
    let huge = b > 1e300;
    let shrink = sel(huge, 0.0625, 1.0);
    let infinite = b == f64::INFINITY;
    let a = sel(infinite, sel(a == b, 1.0, 0.0), a * shrink);
    let b = sel(infinite, 1.0, b * shrink);
    // |angle|: swap: pi/2 - r for x >= 0, pi/2 + r for x < 0; else r and pi - r.
    let x_sign = f64::from_bits((x.to_bits() & (1 << 63)) | 0x3ff0_0000_0000_0000);
    let minus = x_sign < 0.0;
    let base = sel(swap, PIO2[0], sel(minus, PI[0], 0.0));
    let base_lo = sel(swap, PIO2[1], sel(minus, PI[1], 0.0));
    let negative = sel(swap, -x_sign, x_sign);
    let r = atan_ratio(a, b, base, base_lo, negative);
    let r = sel(r > PI[0], PI[0], r);
    sel(x.is_nan() | y.is_nan(), f64::NAN, xor_sign(r, y))
}

/// The argument and its arc sine's parts: asin a = s + rest for a <= 1/2, pi/2 - 2 (s + rest) above.
struct Arc {
    s: f64,
    rest: f64,
    small: bool,
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn arc(a: f64) -> Arc {
    let small = a <= 0.5;
    let half = 0.5 * (1.0 - a);
    let z = sel(small, a * a, half);
    let s = sel(small, a, half.sqrt());
    Arc { s, rest: s * z * poly(z, &ASIN_POLY), small }
}

/// Inverse sine, within [-pi / 2, pi / 2]; NaN for |x| > 1.
///
/// Error below [`ASIN_ULPS`](super::ASIN_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn asin(x: f64) -> f64 {
    let Arc { s, rest, small } = arc(x.abs());
    let (h, e) = fast_two_sum(PIO2[0], -2.0 * s);
    let large = h + (e + (PIO2[1] - 2.0 * rest));
    xor_sign(sel(small, s + rest, large), x)
}

/// Inverse cosine, within [0, pi]; NaN for |x| > 1.
///
/// Error below [`ACOS_ULPS`](super::ACOS_ULPS).
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn acos(x: f64) -> f64 {
    let Arc { s, rest, small } = arc(x.abs());
    // pi/2 - asin x; 2 asin(sqrt((1 - x) / 2)); pi - 2 asin(sqrt((1 + x) / 2)): base - sign factor (s + rest)
    let minus = x < 0.0;
    let base = sel(small, PIO2[0], sel(minus, PI[0], 0.0));
    let base_lo = sel(small, PIO2[1], sel(minus, PI[1], 0.0));
    let factor = sel(small, 1.0, -2.0);
    let factor = xor_sign(factor, x);
    let (h, e) = fast_two_sum(base, -(factor * s));
    h + (e + (base_lo - factor * rest))
}
