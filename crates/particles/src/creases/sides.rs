//! The two sides of a crease at a point of it: the surface is cut with a small circle around the curve.

use isoswarm_field::{FieldError, Surface};

use crate::vector::{V3, add, along, distance, dot, frame, norm, scale, sub, tangential, unit};

/// Points of the circle at which gradients are taken: each formula that has a side holds on more of the circle than lies
/// between two of them.
const AROUND: usize = 16;
/// The first of them, in parts of the angle between two: no place of symmetry.
const PHASE: f64 = 0.3718;
/// Difference of unit normals up to which they are the same; and |F|/|∇F| over the radius up to which a point of the
/// circle is on the surface.
const SAME: f64 = 1e-3;

/// One side of a crease.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// Unit vector from the crease into the surface.
    pub(super) way: V3,
    /// Outward unit normal at the crease.
    pub(super) normal: V3,
}

/// What the surface looks like around a point of F = G = 0.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Two sides at an angle: the left one, for who walks along the tangent on the outside, and the right one.
    Crease([Side; 2]),
    /// No crease.
    Smooth,
    /// Neither: a jump of F, or more than two sides.
    Other,
}

/// Looks at the surface on a circle of radius `radius` around `p` and perpendicular to the unit vector `t`. Normals that differ by
/// less than `least` (radians) make no crease.
pub(super) fn look(
    surface: &dyn Surface,
    count: &mut u64,
    p: V3,
    t: V3,
    radius: f64,
    least: f64,
) -> Result<Shape, FieldError> {
    let (u, v) = frame(t);
    let around: Vec<V3> = (0..AROUND)
        .map(|k| {
            let (s, c) = turn((k as f64 + PHASE) / AROUND as f64);
            add(p, add(scale(u, radius * c), scale(v, radius * s)))
        })
        .collect();
    let (mut value, mut gradient) = (vec![0.0; AROUND], vec![[0.0; 3]; AROUND]);
    *count += AROUND as u64;
    surface.value_gradient(&around, &mut value, &mut gradient)?;
    let mut ways: Vec<(V3, V3)> = Vec::new();
    for g in gradient {
        let n = unit(tangential(unit(g), t));
        if n == [0.0; 3] || ways.iter().any(|w| distance(w.1, n) < SAME) {
            continue;
        }
        let d = crate::vector::cross(n, t);
        ways.extend([(d, n), (scale(d, -1.0), n)]);
    }
    let near: Vec<V3> = ways.iter().map(|w| along(p, radius, w.0)).collect();
    let far: Vec<V3> = ways.iter().map(|w| along(p, 2.0 * radius, w.0)).collect();
    let points = [near, far].concat();
    let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    *count += points.len() as u64;
    if !points.is_empty() {
        surface.value_gradient(&points, &mut value, &mut gradient)?;
    }
    let mut sides: Vec<Side> = Vec::new();
    for (k, &(way, n)) in ways.iter().enumerate() {
        let (here, next) = (unit(gradient[k]), unit(gradient[k + ways.len()]));
        // What curves away is as far off as what the normal turns.
        let on = value[k].abs() <= SAME * radius * norm(gradient[k]);
        if !on || distance(unit(tangential(here, t)), n) > 2.0 * SAME {
            continue;
        }
        let normal = if distance(here, next) < 0.1 { unit(sub(scale(here, 2.0), next)) } else { here };
        if sides.iter().all(|s| distance(s.way, way) > 2.0 * SAME) {
            sides.push(Side { way, normal });
        }
    }
    let [a, b] = sides[..] else { return Ok(Shape::Other) };
    if distance(a.normal, b.normal) < least {
        return Ok(Shape::Smooth);
    }
    let left = crate::vector::cross(add(a.normal, b.normal), t);
    Ok(Shape::Crease(if dot(left, sub(a.way, b.way)) >= 0.0 { [a, b] } else { [b, a] }))
}

/// Whether the normals around a point, on a sphere of radius `radius`, differ by more than `least` (radians).
pub(super) fn is_tip(
    surface: &dyn Surface,
    count: &mut u64,
    p: V3,
    radius: f64,
    least: f64,
) -> Result<bool, FieldError> {
    let around: Vec<V3> = (0..27)
        .filter(|k| *k != 13)
        .map(|k| {
            let way = unit([f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)]);
            along(p, radius, way)
        })
        .collect();
    let (mut value, mut gradient) = (vec![0.0; around.len()], vec![[0.0; 3]; around.len()]);
    *count += around.len() as u64;
    surface.value_gradient(&around, &mut value, &mut gradient)?;
    let normals: Vec<V3> = gradient.into_iter().map(unit).filter(|n| *n != [0.0; 3]).collect();
    Ok(normals.iter().any(|n| distance(*n, normals[0]) > least))
}

/// Sine and cosine of a part of a full turn.
fn turn(part: f64) -> (f64, f64) {
    let angle = 2.0 * std::f64::consts::PI * part;
    (isoswarm_field::math::sin(angle), isoswarm_field::math::cos(angle))
}
