//! Sums that come out the same at any vector width.

/// Partial sums of a dot product: a fixed number, so that no vector width changes the result.
const LANES: usize = 16;

/// Σ aᵢ bᵢ in a fixed order.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (a[..n].as_chunks::<LANES>(), b[..n].as_chunks::<LANES>());
    let mut s = [0.0; LANES];
    for (x, y) in a.iter().zip(b) {
        for l in 0..LANES {
            s[l] += x[l] * y[l];
        }
    }
    for (l, (x, y)) in a_rest.iter().zip(b_rest).enumerate() {
        s[l] += x * y;
    }
    let mut half = LANES / 2;
    while half > 0 {
        for l in 0..half {
            s[l] += s[l + half];
        }
        half /= 2;
    }
    s[0]
}
