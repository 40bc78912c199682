//! Deterministic, vectorisable elementary functions (first version; see the function docs).
macro_rules! via_libm {
    ($($(#[$m:meta])* $name:ident => $f:ident;)*) => {$(
        $(#[$m])*
        #[inline(always)]
        #[must_use]
        pub fn $name(x: f64) -> f64 {
            libm::$f(x)
        }
    )*};
}
via_libm! {
    /// e^x.
    exp => exp;
    /// Natural logarithm.
    ln => log;
    /// Sine.
    sin => sin;
    /// Cosine.
    cos => cos;
    /// Tangent.
    tan => tan;
    /// Inverse sine.
    asin => asin;
    /// Inverse cosine.
    acos => acos;
    /// Inverse tangent.
    atan => atan;
    /// Hyperbolic sine.
    sinh => sinh;
    /// Hyperbolic cosine.
    cosh => cosh;
    /// Hyperbolic tangent.
    tanh => tanh;
    /// Cube root.
    cbrt => cbrt;
    /// Square root.
    sqrt => sqrt;
    /// Absolute value.
    abs => fabs;
    /// Largest integer not above x.
    floor => floor;
    /// Smallest integer not below x.
    ceil => ceil;
    /// Nearest integer, ties to even.
    round => rint;
}
/// Angle of the vector (x, y).
#[inline(always)]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}
/// x to the power y.
#[inline(always)]
#[must_use]
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}
/// a - b floor(a / b).
#[inline(always)]
#[must_use]
pub fn modulo(a: f64, b: f64) -> f64 {
    a - b * floor(a / b)
}
/// The smaller of a and b; NaN if either is NaN.
#[inline(always)]
#[must_use]
pub fn min(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}
/// The larger of a and b; NaN if either is NaN.
#[inline(always)]
#[must_use]
pub fn max(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}
/// Bound on the error of [`exp`] in units in the last place.
pub const EXP_ULPS: f64 = 1.0;
/// Bound on the error of [`ln`] in units in the last place.
pub const LN_ULPS: f64 = 1.0;
/// Bound on the error of [`sin`] in units in the last place.
pub const SIN_ULPS: f64 = 2.0;
/// Bound on the error of [`cos`] in units in the last place.
pub const COS_ULPS: f64 = 2.0;
/// Bound on the error of [`tan`] in units in the last place.
pub const TAN_ULPS: f64 = 4.0;
/// Bound on the error of [`asin`] in units in the last place.
pub const ASIN_ULPS: f64 = 2.0;
/// Bound on the error of [`acos`] in units in the last place.
pub const ACOS_ULPS: f64 = 2.0;
/// Bound on the error of [`atan`] in units in the last place.
pub const ATAN_ULPS: f64 = 2.0;
/// Bound on the error of [`atan2`] in units in the last place.
pub const ATAN2_ULPS: f64 = 3.0;
/// Bound on the error of [`pow`] in units in the last place.
pub const POW_ULPS: f64 = 2.0;
/// Bound on the error of [`sinh`] in units in the last place.
pub const SINH_ULPS: f64 = 4.0;
/// Bound on the error of [`cosh`] in units in the last place.
pub const COSH_ULPS: f64 = 4.0;
/// Bound on the error of [`tanh`] in units in the last place.
pub const TANH_ULPS: f64 = 4.0;
