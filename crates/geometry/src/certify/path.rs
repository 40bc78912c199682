//! Paths on the surface that are proven to be there.
//!
//! Between two curves p ± ε n along a path, F < 0 on the one and F > 0 on the other: then the zeros of F in the strip
//! between them contain a connected set from its one end to the other. Where F grows along both ends, these have one zero
//! each, so that strips in a row join into one connected piece of the surface.

use isoswarm_field::vector::{V3, add, along, distance, dot, norm, scale, sub, unit};
use isoswarm_field::{Aabb, Field, FieldError, Interval, Regularity, Surface};

use super::critical::Critical;
use super::system::{System, at, centre, inner, point};

/// Largest step in radii of curvature.
const STEP: f64 = 0.25;
/// Steps of a path.
const MOST_STEPS: usize = 20_000;
/// How often a segment is halved for its proof.
const DEEPEST: u32 = 14;
/// Half the width of a strip, in steps.
const WIDTH: f64 = 0.3;

/// F, ∇F and the curvature's size at a point.
fn look(field: &Field, p: V3) -> Result<(f64, V3, f64), FieldError> {
    let (mut value, mut gradient, mut hessian) = ([0.0], [[0.0; 3]], [[0.0; 6]]);
    Surface::value_gradient(field, &[p], &mut value, &mut gradient)?;
    Surface::hessian(field, &[p], &mut hessian)?;
    let [xx, xy, xz, yy, yz, zz] = hessian[0];
    let size = (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)).sqrt();
    Ok((value[0], gradient[0], size / norm(gradient[0])))
}

fn project(field: &Field, mut p: V3) -> Result<(V3, V3, f64), FieldError> {
    for _ in 0..4 {
        let (f, g, _) = look(field, p)?;
        p = along(p, -f / dot(g, g), g);
    }
    let (_, g, curvature) = look(field, p)?;
    Ok((p, unit(g), curvature))
}

/// The minima that a saddle's two descending lines lead to, with the lines. `fine` ≤ 1 shortens the steps.
pub(super) fn descend(
    system: &System<'_>,
    from: &Critical,
    sign: f64,
    minima: &[&Critical],
    size: f64,
    fine: f64,
) -> Result<Option<(Vec<V3>, usize)>, FieldError> {
    let field = system.field;
    let start = centre(&from.at);
    let (_, gradient, curvature) = look(field, start)?;
    let step_of = |curvature: f64| fine * (STEP / curvature).clamp(1e-7 * size, size / 40.0);
    let Some(way) = falling(system, start, gradient)? else { return Ok(None) };
    let mut path = vec![start];
    let (mut p, mut n, mut k) = project(field, along(start, sign * step_of(curvature), way))?;
    path.push(p);
    let mut step = step_of(k);
    for _ in 0..MOST_STEPS {
        let near = (0..minima.len())
            .map(|m| (distance(centre(&minima[m].at), p), m))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((d, m)) = near
            && d < 1.5 * step
        {
            path.push(centre(&minima[m].at));
            return Ok(Some((path, m)));
        }
        let down = along(scale(system.h, -1.0), dot(system.h, n), n);
        let (next, normal, curvature) = project(field, along(p, step, unit(down)))?;
        let fell = dot(sub(next, p), system.h) < 0.0;
        if !(fell && dot(normal, n) > 0.8 && next.iter().all(|v| v.is_finite())) {
            step *= 0.5;
            if step < 1e-9 * size {
                return Ok(None);
            }
            continue;
        }
        (p, n, k) = (next, normal, curvature);
        path.push(p);
        step = step_of(k).min(2.0 * step);
    }
    Ok(None)
}

/// The direction in which the height falls fastest from a saddle.
fn falling(system: &System<'_>, p: V3, gradient: V3) -> Result<Option<V3>, FieldError> {
    let mut hessian = [[0.0; 6]];
    Surface::hessian(system.field, &[p], &mut hessian)?;
    let [xx, xy, xz, yy, yz, zz] = hessian[0];
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let bend = |a: V3, b: V3| -dot(a, rows.map(|r| dot(r, b))) / dot(gradient, system.h);
    let (a, b, c) = (bend(system.u, system.u), bend(system.u, system.v), bend(system.v, system.v));
    let half = 0.5 * (a - c);
    let least = 0.5 * (a + c) - (half * half + b * b).sqrt();
    if least.is_nan() || least >= 0.0 {
        return Ok(None);
    }
    // Of the two ways to write the eigenvector, the longer.
    let (first, second) = ([b, least - a], [least - c, b]);
    let w = if first[0].abs() + first[1].abs() > second[0].abs() + second[1].abs() { first } else { second };
    Ok(Some(unit(add(scale(system.u, w[0]), scale(system.v, w[1])))))
}

/// Whether a path between two critical points is proven to lie along one connected piece of the surface.
pub(super) fn proven(system: &System<'_>, path: &[V3], from: &Aabb, to: &Aabb) -> Result<bool, FieldError> {
    let n = path.len();
    let length = |i: usize| if i + 1 < n { distance(path[i], path[i + 1]) } else { f64::INFINITY };
    let mut offsets = Vec::with_capacity(n);
    for i in 0..n {
        let (_, g, _) = look(system.field, path[i])?;
        let before = if i > 0 { length(i - 1) } else { f64::INFINITY };
        offsets.push(scale(unit(g), WIDTH * length(i).min(before)));
    }
    for i in 0..n {
        let ends = if i == 0 {
            *from
        } else if i + 1 == n {
            *to
        } else {
            at(path[i])
        };
        if !grows(system, &ends, offsets[i])? {
            return Ok(false);
        }
    }
    for i in 0..n - 1 {
        let (p, q, a, b) = (path[i], path[i + 1], offsets[i], offsets[i + 1]);
        if !one_sign(system, sub(p, a), sub(q, b), -1.0, DEEPEST)?
            || !one_sign(system, add(p, a), add(q, b), 1.0, DEEPEST)?
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Smallest box around two.
fn hull(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb::new([0, 1, 2].map(|k| a.lo[k].min(b.lo[k])), [0, 1, 2].map(|k| a.hi[k].max(b.hi[k])))
}

/// A box moved by a vector, outward rounded.
fn moved(b: &Aabb, v: V3) -> Aabb {
    let sum = |k: usize| Interval::new(b.lo[k], b.hi[k]) + point(v[k]);
    Aabb::new([0, 1, 2].map(|k| sum(k).lo), [0, 1, 2].map(|k| sum(k).hi))
}

/// Whether F grows all along from `b` - offset, where it is below 0, to `b` + offset, where it is above.
fn grows(system: &System<'_>, b: &Aabb, offset: V3) -> Result<bool, FieldError> {
    let below = system.value(&moved(b, scale(offset, -1.0)))?;
    let above = system.value(&moved(b, offset))?;
    if !(below.hi < 0.0 && above.lo > 0.0) {
        return Ok(false);
    }
    const PARTS: i32 = 8;
    for k in -PARTS..PARTS {
        let part = |k: i32| moved(b, scale(offset, f64::from(k) / f64::from(PARTS)));
        let piece = hull(&part(k), &part(k + 1));
        if system.regularity(&piece)? == Regularity::Broken
            || inner(offset, &system.gradient(&piece)?).lo <= 0.0
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether F has the sign all along from p to q.
fn one_sign(system: &System<'_>, p: V3, q: V3, sign: f64, depth: u32) -> Result<bool, FieldError> {
    let b = hull(&at(p), &at(q));
    let is = |v: Interval| if sign < 0.0 { v.hi < 0.0 } else { v.lo > 0.0 };
    if is(system.value(&b)?) {
        return Ok(true);
    }
    if system.regularity(&b)? == Regularity::Broken {
        return Ok(false);
    }
    // By the mean value theorem along the segment; the middle is rounded, so it is taken with the box around it.
    let middle = [0, 1, 2].map(|k| Interval::new(0.5, 0.5) * (point(p[k]) + point(q[k])));
    let around = Aabb::new(middle.map(|m| m.lo), middle.map(|m| m.hi));
    let way = [0, 1, 2].map(|k| point(q[k]) - point(p[k]));
    let g = system.gradient(&b)?;
    let slope = g[0] * way[0] + g[1] * way[1] + g[2] * way[2];
    if is(system.value(&around)? + slope * Interval::new(-0.5, 0.5)) {
        return Ok(true);
    }
    if depth == 0 {
        return Ok(false);
    }
    // The halves meet in the middle as it is rounded: a polygon next to the segment, which does as well.
    let m = middle.map(|m| 0.5 * m.lo + 0.5 * m.hi);
    Ok(one_sign(system, p, m, sign, depth - 1)? && one_sign(system, m, q, sign, depth - 1)?)
}
