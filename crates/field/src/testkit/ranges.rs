//! Intervals, pruned regions and cells against values at points.

use super::agreement::flattened;
use super::{All, BoxAt, Failure, Outcome, Reference, ensure, packed, some_rates};
use crate::surface::{Aabb, Surface};
use crate::{Field, Interval, RegionOptions};

/// F, its gradient and its Hessian at points of a box against their intervals over the box. `inside` are numbers
/// that place the points in the box, by their fractional parts; corners and the centre are tried as well.
pub fn intervals_contain(field: &Field, at: &BoxAt, inside: &[[f64; 3]]) -> Outcome {
    let Some(reference) = Reference::new(field)? else { return Ok(0) };
    let (d, k, b) = (field.axes(), field.components(), at.aabb());
    let (value, gradient, hessian) = (
        field.interval(&b.lo[..d], &b.hi[..d])?,
        field.interval_gradient(&b.lo[..d], &b.hi[..d])?,
        field.interval_hessian(&b.lo[..d], &b.hi[..d])?,
    );
    let points = points_in(&b, inside);
    let all = All::of(field, &packed(field, &points), &some_rates(field))?;
    let q: Vec<f64> = field.parameters().iter().map(|p| p.value).collect();
    let check = |what: &str, p: [f64; 3], range: &[Interval], numbers: &[f64]| -> Outcome {
        for (r, v) in range.iter().zip(numbers) {
            ensure(v.is_nan() || r.contains(*v), || {
                format!("{what} at {p:?} is {numbers:?}, not in {range:?} over {b:?}")
            })?;
        }
        Ok(range.len())
    };
    let mut count = 0;
    for (i, &p) in points.iter().enumerate() {
        for c in 0..k {
            let s = reference.at(c, flattened(field, p), &q);
            if !s.regular {
                continue;
            }
            let (n, at) = (d * d, i * k + c);
            count += check("F", p, &value[c..=c], &all.value[at..=at])?;
            count += check("the gradient", p, &gradient[c * d..][..d], &all.gradient[at * d..][..d])?;
            count += check("the Hessian", p, &hessian[c * n..][..n], &all.hessian[at * n..][..n])?;
        }
    }
    Ok(count)
}

/// Corners, centre, and points placed by the fractional parts of `inside`.
fn points_in(b: &Aabb, inside: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let between = |t: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|a| {
            let v = b.lo[a] + t[a] * (b.hi[a] - b.lo[a]);
            if v.is_finite() { v.clamp(b.lo[a], b.hi[a]) } else { b.lo[a].max(0.0).min(b.hi[a]) }
        })
    };
    let mut points: Vec<[f64; 3]> =
        (0..8).map(|i| std::array::from_fn(|a| if i >> a & 1 == 0 { b.lo[a] } else { b.hi[a] })).collect();
    points.push(between([0.5; 3]));
    points.extend(inside.iter().map(|p| between(p.map(|v| v.abs().fract()))));
    points.retain(|p| p.iter().all(|v| v.is_finite()));
    points
}

/// Regions of any leaf size against the field itself: the same bits of F, and derivatives to rounding, where no
/// tails are dropped, and values within `tail` times the number of exponentials else; also where points have moved by up to `margin`, or left.
pub fn pruning_keeps(field: &Field, points: &[[f64; 3]], margin: f64, tail: f64) -> Outcome {
    let Some(reference) = Reference::new(field)? else { return Ok(0) };
    let q: Vec<f64> = field.parameters().iter().map(|p| p.value).collect();
    let exps = reference.exponentials() as f64;
    let d = field.axes();
    let mut count = 0;
    for leaf in [1, 64, 256] {
        let narrowed = field.narrowed_for(points, margin, None, RegionOptions { leaf, tail })?;
        for reach in [0.0, 0.99, 1e3] {
            let shifted: Vec<[f64; 3]> = points
                .iter()
                .enumerate()
                .map(|(i, p)| {
                    let side = if i % 2 == 0 { reach * margin } else { -reach * margin };
                    std::array::from_fn(|a| if a < d { p[a] + side } else { p[a] })
                })
                .collect();
            let n = shifted.len();
            let (mut v, mut w) = (vec![f64::NAN; n], vec![f64::NAN; n]);
            let (mut g, mut h) = (vec![[f64::NAN; 3]; n], vec![[f64::NAN; 3]; n]);
            let (mut s, mut t) = (vec![[f64::NAN; 6]; n], vec![[f64::NAN; 6]; n]);
            Surface::value_gradient(field, &shifted, &mut v, &mut g)?;
            Surface::hessian(field, &shifted, &mut s)?;
            narrowed.value_gradient(&shifted, &mut w, &mut h)?;
            narrowed.hessian(&shifted, &mut t)?;
            for i in 0..n {
                let sample = reference.at(0, flattened(field, shifted[i]), &q);
                if !sample.regular {
                    continue;
                }
                let place = || format!("leaves of {leaf}, moved {reach} of {margin}, at {:?}", shifted[i]);
                if tail == 0.0 {
                    // Sums of adjoints come in another order where an operation has gone.
                    let slack = 32.0 * sample.operations as f64 * f64::EPSILON;
                    let near = (0..d).all(|a| (g[i][a] - h[i][a]).abs() <= slack * sample.gradient_size[a]);
                    let tame = sample.largest < 100.0;
                    ensure(v[i] == w[i] && near && (!tame || alike(&s[i], &t[i])), || {
                        let (whole, pruned) = ((v[i], g[i], s[i]), (w[i], h[i], t[i]));
                        format!("{}: pruning turns {whole:?} into {pruned:?}", place())
                    })?;
                } else {
                    let bound = tail * exps + 2.0 * sample.noise;
                    ensure((v[i] - w[i]).abs() <= bound, || {
                        format!("{}: pruning changes {:e} by {:e}", place(), v[i], w[i] - v[i])
                    })?;
                }
                count += 1;
            }
        }
    }
    Ok(count)
}

/// Whether two Hessians differ by rounding only.
fn alike(a: &[f64; 6], b: &[f64; 6]) -> bool {
    let size = a.iter().fold(1.0f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).all(|(x, y)| super::same(*x, *y) || (x - y).abs() <= 1e-9 * size)
}

/// Whether every zero that Newton's method finds from the `starts` lies in a box of an interval search, and the
/// search's own evaluator agrees with the field in the boxes. Returns the number of zeros.
pub fn cells_keep_zeros(field: &Field, bounds: &Aabb, side: f64, starts: &[[f64; 3]]) -> Outcome {
    let cells = field.cells(bounds, side, 1 << 20).ok_or_else(|| Failure("the field has no cells".into()))?;
    ensure(cells.side <= side, || format!("the boxes have side {:e}, asked for {side:e}", cells.side))?;
    let slack = 1e-9 * bounds.diagonal();
    let zeros = projected(field, bounds, starts)?;
    for p in &zeros {
        ensure(cells.boxes.iter().any(|b| b.grown(slack).contains(*p)), || {
            format!("the zero at {p:?} is in none of {} boxes", cells.boxes.len())
        })?;
    }
    let centres: Vec<[f64; 3]> =
        cells.boxes.iter().map(|b| std::array::from_fn(|a| 0.5 * (b.lo[a] + b.hi[a]))).collect();
    let n = centres.len();
    let (mut v, mut w) = (vec![0.0; n], vec![0.0; n]);
    let (mut g, mut h) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    Surface::value_gradient(field, &centres, &mut v, &mut g)?;
    cells.evaluate.value_gradient(&centres, &mut w, &mut h)?;
    for i in 0..n {
        let size = 1.0 + v[i].abs();
        ensure(super::same(v[i], w[i]) || (v[i] - w[i]).abs() <= 1e-10 * size, || {
            format!("in cells F is {:e} at {:?}, not {:e}", w[i], centres[i], v[i])
        })?;
    }
    Ok(zeros.len())
}

/// The zeros in the bounds that Newton's method along the gradient finds.
fn projected(field: &Field, bounds: &Aabb, starts: &[[f64; 3]]) -> Result<Vec<[f64; 3]>, Failure> {
    let mut points = starts.to_vec();
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    for _ in 0..40 {
        Surface::value_gradient(field, &points, &mut v, &mut g)?;
        for (p, (f, g)) in points.iter_mut().zip(v.iter().zip(&g)) {
            let size = g.iter().map(|c| c * c).sum::<f64>();
            if size > 0.0 {
                *p = std::array::from_fn(|a| p[a] - f * g[a] / size);
            }
        }
    }
    Surface::value_gradient(field, &points, &mut v, &mut g)?;
    let near = 1e-12 * bounds.diagonal();
    let is_zero = |f: f64, g: &[f64; 3]| f.abs() <= near * g.iter().map(|c| c * c).sum::<f64>().sqrt();
    let kept = points.iter().zip(v.iter().zip(&g));
    Ok(kept.filter(|(p, (f, g))| is_zero(**f, g) && bounds.contains(**p)).map(|(p, _)| *p).collect())
}
