//! Three-vectors as plain arrays.

/// A point or vector in space.
pub type V3 = [f64; 3];

/// a · b
#[inline(always)]
pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b
#[inline(always)]
pub fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b
#[inline(always)]
pub fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// k a
#[inline(always)]
pub fn scale(a: V3, k: f64) -> V3 {
    [a[0] * k, a[1] * k, a[2] * k]
}

/// a + k b
#[inline(always)]
pub fn along(a: V3, k: f64, b: V3) -> V3 {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}

/// a × b
#[inline(always)]
pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|
#[inline(always)]
pub fn norm(a: V3) -> f64 {
    dot(a, a).sqrt()
}

/// |a - b|
#[inline(always)]
pub fn distance(a: V3, b: V3) -> f64 {
    norm(sub(a, b))
}

/// a / |a|; zero where a is zero or not finite.
#[inline(always)]
pub fn unit(a: V3) -> V3 {
    let square = dot(a, a);
    if square > 1e-200 && square < 1e200 {
        return scale(a, 1.0 / square.sqrt());
    }
    // Scaled first, so that neither tiny nor huge gradients leave the range of the squares.
    let m = a[0].abs().max(a[1].abs()).max(a[2].abs());
    if !(m > 0.0 && m.is_finite()) || a.iter().any(|v| v.is_nan()) {
        return [0.0; 3];
    }
    let b = [a[0] / m, a[1] / m, a[2] / m];
    scale(b, 1.0 / norm(b))
}

/// Two unit vectors that complete the unit vector `n` to an orthonormal, right-handed frame.
pub fn frame(n: V3) -> (V3, V3) {
    let least = if n[0].abs() <= n[1].abs() && n[0].abs() <= n[2].abs() {
        [1.0, 0.0, 0.0]
    } else if n[1].abs() <= n[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let u = unit(cross(n, least));
    (u, cross(n, u))
}

/// `a` without its part along the unit vector `n`.
#[inline(always)]
pub fn tangential(a: V3, n: V3) -> V3 {
    along(a, -dot(a, n), n)
}
