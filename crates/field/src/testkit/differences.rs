//! Derivatives against finite differences. A difference quotient counts where two step lengths agree on it, so that
//! neither truncation nor rounding nor a kink nearby is mistaken for a wrong derivative.

use super::agreement::flattened;
use super::{All, Failure, Outcome, Reference, Sample, ensure, packed, some_rates};
use crate::Field;

/// Step lengths, relative to the size of what is moved.
const STEPS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
/// How near two quotients, relative to their size, must be.
const CONVERGED: f64 = 1e-6;

/// The fourth-order quotient of `f` for a step `h`.
fn quotient(f: &mut dyn FnMut(f64) -> Option<f64>, h: f64) -> Option<f64> {
    let (near, far) = (f(h)? - f(-h)?, f(2.0 * h)? - f(-2.0 * h)?);
    Some((8.0 * near - far) / (12.0 * h))
}

/// Whether `slope` is the derivative of `f` at 0: `None` where no two quotients agree. `noise` is how wrong values
/// of `f` may be.
fn is_slope(
    slope: f64,
    size: f64,
    noise: f64,
    f: &mut dyn FnMut(f64) -> Option<f64>,
) -> Option<Result<(), f64>> {
    let mut before: Option<f64> = None;
    let mut wrong = None;
    for h in STEPS.map(|s| s * size) {
        let q = quotient(f, h);
        if let (Some(p), Some(q)) = (before, q) {
            let near = CONVERGED * (1.0 + q.abs());
            if (p - q).abs() <= near && noise / h <= 0.1 * near {
                if (slope - q).abs() <= 20.0 * near {
                    return Some(Ok(()));
                }
                wrong = Some(q);
            }
        }
        before = q;
    }
    wrong.map(Err)
}

/// The reference's view of every component at every point where differences make sense.
fn for_each(
    field: &Field,
    points: &[[f64; 3]],
    mut f: impl FnMut(usize, usize, &Sample) -> Result<usize, Failure>,
) -> Outcome {
    let Some(reference) = Reference::new(field)? else { return Ok(0) };
    let q: Vec<f64> = field.parameters().iter().map(|p| p.value).collect();
    let mut count = 0;
    for (i, &p) in points.iter().enumerate() {
        for c in 0..field.components() {
            let s = reference.at(c, flattened(field, p), &q);
            if s.regular && s.smooth && s.largest < 1e6 {
                count += f(i, c, &s)?;
            }
        }
    }
    Ok(count)
}

/// F at one point.
fn value(field: &Field, flat: &[f64], component: usize) -> Option<f64> {
    let mut v = vec![0.0; field.components()];
    field.value(flat, &mut v).ok()?;
    Some(v[component]).filter(|v| v.is_finite())
}

fn judge(verdict: Option<Result<(), f64>>, what: impl FnOnce(f64) -> String) -> Outcome {
    match verdict {
        None => Ok(0),
        Some(Ok(())) => Ok(1),
        Some(Err(q)) => Err(Failure(what(q))),
    }
}

/// ∂F/∂x.
pub fn gradient_differences(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, d, k) = (packed(field, points), field.axes(), field.components());
    let all = All::of(field, &flat, &some_rates(field))?;
    for_each(field, points, |i, c, s| {
        let mut count = 0;
        for a in 0..d {
            let slope = all.gradient[(i * k + c) * d + a];
            let mut f = |t: f64| {
                let mut p = flat[i * d..(i + 1) * d].to_vec();
                p[a] += t;
                value(field, &p, c)
            };
            let verdict = is_slope(slope, 1.0, s.noise, &mut f);
            count += judge(verdict, |q| {
                format!("component {c} at {:?}: dF/dx{a} is {slope:e}, differences say {q:e}", points[i])
            })?;
        }
        Ok(count)
    })
}

/// ∂F/∂q, by changing one parameter after another.
pub fn parameter_differences(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, d, k) = (packed(field, points), field.axes(), field.components());
    let all = All::of(field, &flat, &some_rates(field))?;
    let q = field.q();
    let m = q.len();
    for_each(field, points, |i, c, s| {
        let mut count = 0;
        for j in 0..m {
            let slope = all.q[(i * k + c) * m + j];
            let mut f = |t: f64| {
                let (mut moved, mut next) = (field.clone(), q.clone());
                next[j] += t;
                moved.set_q(&next).ok()?;
                value(&moved, &flat[i * d..(i + 1) * d], c)
            };
            let size = q[j].abs().clamp(0.1, 1.0);
            let verdict = is_slope(slope, size, s.noise, &mut f);
            count += judge(verdict, |x| {
                format!("component {c} at {:?}: dF/dq{j} is {slope:e}, differences say {x:e}", points[i])
            })?;
        }
        Ok(count)
    })
}

/// Second derivatives: symmetric, and the differences of the gradient.
pub fn hessian_differences(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, d, k) = (packed(field, points), field.axes(), field.components());
    let all = All::of(field, &flat, &some_rates(field))?;
    for_each(field, points, |i, c, s| {
        let h = &all.hessian[(i * k + c) * d * d..][..d * d];
        let largest = h.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if s.largest > 1e3 || !largest.is_finite() || largest > 1e6 {
            return Ok(0);
        }
        let mut count = 0;
        for a in 0..d {
            for b in 0..d {
                let (one, other) = (h[a * d + b], h[b * d + a]);
                ensure((one - other).abs() <= 1e-8 * (1.0 + largest), || {
                    format!("component {c} at {:?}: the Hessian {h:?} is not symmetric", points[i])
                })?;
                let mut f = |t: f64| {
                    let mut p = flat[i * d..(i + 1) * d].to_vec();
                    p[b] += t;
                    let (mut v, mut g) = (vec![0.0; k], vec![0.0; k * d]);
                    field.gradient(&p, &mut v, &mut g).ok()?;
                    Some(g[c * d + a]).filter(|g| g.is_finite())
                };
                let verdict = is_slope(one, 1.0, s.noise, &mut f);
                count += judge(verdict, |x| {
                    format!(
                        "component {c} at {:?}: d2F/dx{a}dx{b} is {one:e}, differences say {x:e}",
                        points[i]
                    )
                })?;
            }
        }
        Ok(count)
    })
}
