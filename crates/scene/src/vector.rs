//! Three-vectors as plain arrays.

pub(crate) type V3 = [f64; 3];

pub(crate) fn sub(a: V3, b: V3) -> V3 {
    [0, 1, 2].map(|k| a[k] - b[k])
}

pub(crate) fn norm(a: V3) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

/// a/|a|; `None` where a is zero or |a| is not finite.
pub(crate) fn unit(a: V3) -> Option<V3> {
    let size = norm(a);
    (size.is_finite() && size > 0.0).then(|| a.map(|c| c / size))
}
