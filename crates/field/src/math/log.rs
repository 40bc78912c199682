//! The natural logarithm, in double and in double-double precision.

use super::double::{fast_two_sum, poly, sel, two_prod, two_sum};

const LN2: [f64; 2] = [0.6931471803691238, 1.9082149292705877e-10];
/// ln 2 in two parts; the first has 42 bits, so that k times it is exact for |k| <= 1074.
const LN2_42: [f64; 2] = [0.6931471805598903, 5.497923018708371e-14];
/// (2 atanh(s) / s - 2) / s^2 in z = s^2 on the range of [`Parts`], relative error 2^-50.9.
const LN_POLY: [f64; 7] = [
    0.666666666666667,
    0.3999999999989889,
    0.28571428626253836,
    0.22222211089379496,
    0.1818289243253687,
    0.15331611722055008,
    0.14617807153417325,
];
/// (2 atanh(s) / s - 2 - 2 s^2 / 3) / s^4 in z = s^2, relative error 2^-53.8.
const LN_DD_POLY: [f64; 8] = [
    0.4,
    0.2857142857142937,
    0.22222222221652765,
    0.18181818336099848,
    0.1538459488700718,
    0.1333480879881234,
    0.11706126464563398,
    0.11724327060846747,
];
const TWO_THIRDS: [f64; 2] = [0.6666666666666666, 3.700743415417188e-17];
const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// x = 2^k m with sqrt(1/2) <= m < sqrt 2, for finite x > 0; anything (without a trap) for other x.
struct Parts {
    k: f64,
    m: f64,
}

#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
fn parts(x: f64) -> Parts {
    let subnormal = x < f64::MIN_POSITIVE;
    let bits = sel(subnormal, x * TWO_52, x).to_bits();
    let e = bits.wrapping_add(0x3ff0_0000_0000_0000 - SQRT_HALF_BITS) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(e << 52).wrapping_add(0x3ff0_0000_0000_0000));
    let k = f64::from_bits(TWO_52.to_bits() | e) - (TWO_52 + 1023.0);
    Parts { k: k - sel(subnormal, 52.0, 0.0), m }
}

/// Natural logarithm. ln 0 = -inf (either zero), ln inf = inf, ln x = NaN for x < 0 and NaN.
///
/// Error below [`LN_ULPS`](super::LN_ULPS), subnormals included.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn ln(x: f64) -> f64 {
    let Parts { k, m } = parts(x);
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let half = 0.5 * f * f;
    // ln m = f - f^2 / 2 + s (f^2 / 2 + z R(z))
    let rest = s * (half + z * poly(z, &LN_POLY)) + k * LN2[1];
    let (a, b) = two_sum(k * LN2[0], f);
    let (c, d) = fast_two_sum(a, -half);
    let r = c + ((b + d) + rest);
    let r = sel(x > 0.0, r, sel(x == 0.0, f64::NEG_INFINITY, f64::NAN));
    sel(x == f64::INFINITY, x, r)
}

/// ln x = h + l with a relative error below 2^-64, for finite x > 0; finite garbage for 0, infinities and NaN.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn ln_pair(x: f64) -> (f64, f64) {
    let Parts { k, m } = parts(x);
    let f = m - 1.0;
    let (dh, dl) = fast_two_sum(2.0, f);
    let inv = 1.0 / dh;
    let s = f * inv;
    let (p, e) = two_prod(s, dh);
    let sl = (((f - p) - e) - s * dl) * inv;
    // ln m = 2 s + s^3 (2/3 + z P(z))
    let (z, ze) = two_prod(s, s);
    let zl = ze + 2.0 * s * sl;
    let (c, ce) = fast_two_sum(TWO_THIRDS[0], z * poly(z, &LN_DD_POLY));
    let cl = ce + TWO_THIRDS[1];
    let (u, ue) = two_prod(z, s);
    let ul = ue + (z * sl + zl * s);
    let (v, ve) = two_prod(u, c);
    let vl = ve + (u * cl + ul * c);
    let (a, ae) = fast_two_sum(2.0 * s, v);
    let al = ae + (2.0 * sl + vl);
    let (h, he) = two_sum(k * LN2_42[0], a);
    fast_two_sum(h, he + (al + k * LN2_42[1]))
}
