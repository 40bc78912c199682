//! The few operations on 3-vectors that a picture needs.

pub(super) type V3 = [f32; 3];

pub(super) fn dot(a: V3, b: V3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scaled(a: V3, s: f32) -> V3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

pub(super) fn mixed(a: V3, b: V3, t: f32) -> V3 {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t]
}

pub(super) fn unit(a: V3) -> V3 {
    scaled(a, 1.0 / dot(a, a).sqrt().max(f32::MIN_POSITIVE))
}

/// Unit vector of `a`, whatever its length; nothing for the zero vector. Scaled first, so that nothing overflows.
pub(super) fn unit_f64(a: [f64; 3]) -> Option<[f64; 3]> {
    let largest = a[0].abs().max(a[1].abs()).max(a[2].abs());
    if largest == 0.0 {
        return None;
    }
    let a = a.map(|v| v / largest);
    let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    Some(a.map(|v| v / length))
}

/// Two unit vectors that make a right-handed frame with the unit vector `w`.
pub(super) fn frame(w: V3) -> (V3, V3) {
    let helper = if w[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let u = unit(cross(helper, w));
    (u, cross(w, u))
}

pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
