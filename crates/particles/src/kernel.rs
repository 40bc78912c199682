//! The Gaussian of the repulsion, in plain arithmetic that every vector width computes to the same bit.

use isoswarm_field::wide::WideSingle;

/// exp(-u) for 0 <= u <= 8 to a relative error of 1.2e-10 (4e-8 at 16): (the Taylor polynomial of exp(-u/64)) to the power of 64.
#[inline(always)]
pub(crate) fn gauss(u: f64) -> f64 {
    let x = u * (1.0 / 64.0);
    // Degree 7 in Estrin's order: the remainder at x = 1/8 is 1.5e-12 before the powers.
    let x2 = x * x;
    let x4 = x2 * x2;
    let a = (1.0 - x) + x2 * (0.5 - x * (1.0 / 6.0));
    let b = (1.0 / 24.0 - x * (1.0 / 120.0)) + x2 * (1.0 / 720.0 - x * (1.0 / 5040.0));
    let mut e = a + x4 * b;
    e *= e;
    e *= e;
    e *= e;
    e *= e;
    e *= e;
    e * e
}

/// The same in single precision to 1.5e-5: (the Taylor polynomial of exp(-u/32)) to the power of 32.
#[inline(always)]
pub(crate) fn gauss_single<T: WideSingle>(u: T) -> T {
    let c = T::splat;
    let x = u * c(1.0 / 32.0);
    // Degree 5: the remainder at x = 1/4 is 3e-7 before the powers.
    let x2 = x * x;
    let high = (c(0.5) - x * c(1.0 / 6.0)) + x2 * (c(1.0 / 24.0) - x * c(1.0 / 120.0));
    let mut e = (c(1.0) - x) + x2 * high;
    e = e * e;
    e = e * e;
    e = e * e;
    e = e * e;
    e * e
}

#[cfg(test)]
mod tests {
    use super::{gauss, gauss_single};

    #[test]
    fn agrees_with_exp() {
        for i in 0..=800 {
            let u = i as f64 * 0.01;
            assert!((gauss(u) / (-u).exp() - 1.0).abs() < 1.2e-10, "{u}");
            let single = f64::from(gauss_single(u as f32));
            assert!((single / (-f64::from(u as f32)).exp() - 1.0).abs() < 1.5e-5, "{u}");
        }
        assert!((gauss(16.0) / (-16f64).exp() - 1.0).abs() < 4e-8);
    }
}
