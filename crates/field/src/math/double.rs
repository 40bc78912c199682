//! Selects, bit tricks and unevaluated sums of two doubles.

use crate::wide::WideDouble;

/// 1.5 * 2^52. Adding it to |x| < 2^51 leaves x rounded to an integer (ties to even) in the low mantissa bits: the
/// conversion that every vector unit has, where `as i64` is a scalar loop below AVX-512DQ.
pub(super) const MAGIC: f64 = 6_755_399_441_055_744.0;

const SPLIT_MASK: u64 = !0x07ff_ffff;
const SIGN: u64 = 1 << 63;

/// `if c { a } else { b }`, as a select: both sides are already computed.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn sel(c: bool, a: f64, b: f64) -> f64 {
    core::hint::select_unpredictable(c, a, b)
}

/// x with its sign flipped where the sign bit of `s` is set.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn xor_sign(x: f64, s: f64) -> f64 {
    f64::from_bits(x.to_bits() ^ (s.to_bits() & SIGN))
}

/// a where the mask is all ones, b where it is zero.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn blend(mask: u64, a: f64, b: f64) -> f64 {
    f64::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

/// a + b = s + e exactly, for any order of magnitudes.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// a + b = s + e exactly, for |a| >= |b| or a = 0.
#[inline(always)]
pub(super) fn fast_two_sum<T: WideDouble>(a: T, b: T) -> (T, T) {
    let s = a + b;
    (s, b - (s - a))
}

/// a b = p + e, with |error of e| <= 2^-105 |p|: Dekker's product, the halves cut by a mask so that it cannot
/// overflow before p does.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn two_prod(a: f64, b: f64) -> (f64, f64) {
    let ah = f64::from_bits(a.to_bits() & SPLIT_MASK);
    let bh = f64::from_bits(b.to_bits() & SPLIT_MASK);
    let (al, bl) = (a - ah, b - bh);
    let p = a * b;
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// c0 + c1 x + c2 x^2 + ...: Horner's scheme in x^2 for the even and the odd terms, two shorter chains side by side.
#[inline(always)]
pub(super) fn poly<T: WideDouble, const N: usize>(x: T, c: &[f64; N]) -> T {
    let y = x * x;
    let c = |i: usize| T::splat(c[i]);
    let (mut a, mut b) = (c(N - 1), c(N - 2));
    let mut i = N - 2;
    // a holds the terms of the parity of N - 1, b the others
    while i >= 2 {
        a = a * y + c(i - 1);
        b = b * y + c(i - 2);
        i -= 2;
    }
    if i == 1 {
        a = a * y + c(0);
        a + b * x
    } else {
        b + a * x
    }
}
