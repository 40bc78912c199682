//! Deterministic, vectorisable elementary functions.
//!
//! Every result that depends on a transcendental function uses these instead of `std`, whose `exp`, `sin`, ... differ
//! between platforms. They are made of IEEE additions, multiplications, divisions, square roots and integer bit
//! operations alone, in one fixed order and without fused multiply-add, so that a value has the same bits on every
//! machine and in every vector width. (The sign and payload of a NaN are not specified.)
//!
//! They have no table look-ups and no branches: a loop
//! `for i in 0..64 { out[i] = exp(a[i]) }` compiles to SSE2, AVX2 or AVX-512 instructions, as the enclosing
//! `pulp::Arch::dispatch` allows.
//!
//! The `*_ULPS` constants bound |computed - exact| in units of the last place of the result (for a subnormal result,
//! of the smallest subnormal). They lie above the largest errors found against exact values in some 20,000 random and
//! border arguments for each of two to six ranges per function, and are meant for outward rounding in interval
//! arithmetic. exp, ln, sin, cos, atan and asin were found monotone where the exact functions are, also over the borders
//! of their reductions; tanh can turn back by an ulp. Polynomials come from `tools/math_coefficients.py`.

mod arc;
mod double;
mod exp;
mod log;
mod pow;
mod trig;

pub use arc::{acos, asin, atan, atan2};
pub(crate) use exp::exps;
pub use exp::{cosh, exp, sinh, tanh};
pub use log::ln;
pub use pow::{cbrt, pow};
pub use trig::{TRIG_ACCURATE, TRIG_RANGE, cos, sin, sin_cos, tan};

use double::sel;

/// Bound on the error of [`exp`] in ulps; measured: 0.77.
pub const EXP_ULPS: f64 = 1.0;
/// Bound on the error of [`ln`] in ulps; measured: 0.70.
pub const LN_ULPS: f64 = 1.0;
/// Bound on the error of [`sin`] in ulps, for |x| <= [`TRIG_ACCURATE`]; measured: 0.75.
pub const SIN_ULPS: f64 = 1.0;
/// Bound on the error of [`cos`] in ulps, for |x| <= [`TRIG_ACCURATE`]; measured: 0.77.
pub const COS_ULPS: f64 = 1.0;
/// Bound on the error of [`tan`] in ulps, for |x| <= [`TRIG_ACCURATE`]; measured: 1.97.
pub const TAN_ULPS: f64 = 2.5;
/// Bound on the error of [`asin`] in ulps; measured: 1.11.
pub const ASIN_ULPS: f64 = 1.5;
/// Bound on the error of [`acos`] in ulps; measured: 1.11.
pub const ACOS_ULPS: f64 = 1.5;
/// Bound on the error of [`atan`] in ulps; measured: 0.77.
pub const ATAN_ULPS: f64 = 1.0;
/// Bound on the error of [`atan2`] in ulps; measured: 1.26.
pub const ATAN2_ULPS: f64 = 2.0;
/// Bound on the error of [`pow`] in ulps; measured: 0.76.
pub const POW_ULPS: f64 = 1.0;
/// Bound on the error of [`sinh`] in ulps; measured: 2.12.
pub const SINH_ULPS: f64 = 3.0;
/// Bound on the error of [`cosh`] in ulps; measured: 1.18.
pub const COSH_ULPS: f64 = 2.0;
/// Bound on the error of [`tanh`] in ulps; measured: 2.26.
pub const TANH_ULPS: f64 = 3.0;
/// Bound on the error of [`cbrt`] in ulps; measured: 0.67.
pub const CBRT_ULPS: f64 = 1.0;

/// Square root, correctly rounded; NaN for x < 0.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn sqrt(x: f64) -> f64 {
    x.sqrt()
}

/// Absolute value, exact.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn abs(x: f64) -> f64 {
    x.abs()
}

/// Largest integer not above x, exact.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn floor(x: f64) -> f64 {
    x.floor()
}

/// Smallest integer not below x, exact.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn ceil(x: f64) -> f64 {
    x.ceil()
}

/// Nearest integer, ties to the even one (as Python's `round`), exact.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn round(x: f64) -> f64 {
    x.round_ties_even()
}

/// a - b floor(a / b), each operation rounded: the remainder with the sign of b, as Python's `%`.
///
/// In exact arithmetic it lies in [0, b) for b > 0. With rounding it can reach b, or miss 0 by the rounding of a / b
/// times b. NaN for b = 0 and for infinities.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn modulo(a: f64, b: f64) -> f64 {
    a - b * (a / b).floor()
}

/// The smaller of a and b; NaN if either is NaN. Of equal values (+0 and -0) it is b.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn min(a: f64, b: f64) -> f64 {
    sel((a < b) | a.is_nan(), a, b)
}

/// The larger of a and b; NaN if either is NaN. Of equal values (+0 and -0) it is b.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[must_use]
pub fn max(a: f64, b: f64) -> f64 {
    sel((a > b) | a.is_nan(), a, b)
}
