//! Adapters hand their effect over to what they are wrapped around (HBJF02 section 5.1, eqs. 14 to 16).
//!
//! Field points are sprinkled once, on the surface and around it, and carried along by the deformation D; the operand's
//! parameters follow so that F(D(p), q) = F(p, q₀) at all of them, in least squares. See `docs/theory/adapters.md`.

use isoswarm_field::{Aabb, FieldError, Parametric, Surface};

use super::fit::{Fit, FitOptions, FitStatus, Measure, fit};
use crate::Error;
use crate::rng::{Rng, Stream};
use crate::vector::{V3, dot, norm};

/// Weight of points beside the surface once it is clear that the whole field cannot be followed: the surface comes first.
const BESIDE: f64 = 1e-7;
/// Part of the size that counts as nothing.
const NOTHING: f64 = 1e-10;
/// Damping: hardly any, the parameters are near; and more where combinations that the surface does not notice should stay.
const DAMPING: (f64, f64) = (1e-12, 1e-6);
/// Newton steps from a random point to the surface, and of a carried point.
const NEWTON: usize = 12;

/// Points at which the field of an operand is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldPoints {
    /// Positions p₀ before the deformation.
    pub points: Vec<V3>,
    /// F(p₀, q₀).
    pub values: Vec<f64>,
    /// A length for a unit of F: 1/|∇F|, bounded where the gradient is small.
    pub lengths: Vec<f64>,
    /// How many of them lie on the surface; they come first.
    pub on: usize,
}

impl FieldPoints {
    /// About `count` points in `bounds`, half of them on the surface and half up to `band` (a length) beside it. Give
    /// four times as many as there are parameters. The same seed gives the same points. There are fewer where the surface is
    /// hard to find; none on it where it does not meet the box.
    ///
    /// # Errors
    /// [`Error::Bounds`] for bounds that are no box, [`Error::Field`] where F cannot be evaluated.
    pub fn sprinkle(
        surface: &dyn Surface,
        bounds: &Aabb,
        count: usize,
        band: f64,
        seed: u64,
    ) -> Result<Self, Error> {
        let axes = surface.axes();
        if !(0..axes)
            .all(|a| bounds.lo[a].is_finite() && bounds.hi[a].is_finite() && bounds.lo[a] < bounds.hi[a])
        {
            return Err(Error::Bounds { given: format!("{:?} to {:?}", bounds.lo, bounds.hi) });
        }
        let rng = Rng::new(seed, Stream::Probes);
        // Twice as many tries as points: half of a box around a surface leads to it.
        let tries = 4 * count.max(8);
        let mut p: Vec<V3> = (0..tries)
            .map(|i| {
                let own = rng.child(i as u64);
                let mut p = [0.0; 3];
                for a in 0..axes {
                    p[a] = bounds.lo[a] + (bounds.hi[a] - bounds.lo[a]) * own.unit(a as u64);
                }
                p
            })
            .collect();
        let size = bounds.diagonal();
        let (mut value, mut gradient) = (vec![0.0; tries], vec![[0.0; 3]; tries]);
        for _ in 0..NEWTON {
            surface.value_gradient(&p, &mut value, &mut gradient)?;
            for i in 0..tries {
                let g2 = dot(gradient[i], gradient[i]);
                let step = value[i] / g2;
                let length = step.abs() * g2.sqrt();
                if step.is_finite() {
                    let k = step * (0.2 * size / length).min(1.0);
                    (0..3).for_each(|a| p[i][a] -= k * gradient[i][a]);
                }
            }
        }
        surface.value_gradient(&p, &mut value, &mut gradient)?;
        let found: Vec<usize> = (0..tries)
            .filter(|&i| {
                let g = norm(gradient[i]);
                g > 0.0
                    && (value[i] / g).abs() < 1e-6 * size
                    && (0..axes).all(|a| bounds.lo[a] <= p[i][a] && p[i][a] <= bounds.hi[a])
            })
            .take(count.max(2))
            .collect();
        let mut points: Vec<V3> = found.iter().map(|&i| p[i]).collect();
        let on = found.len().div_ceil(2);
        for (k, &i) in found.iter().enumerate().skip(on) {
            let own = rng.child(i as u64);
            let shift = band * (2.0 * own.unit(7) - 1.0) / norm(gradient[i]);
            (0..3).for_each(|a| points[k][a] += shift * gradient[i][a]);
        }
        Self::at(surface, points, on)
    }

    /// The points as they are, of which the first `on` lie on the surface (for example its floaters) and the rest beside it.
    ///
    /// # Errors
    /// [`Error::Field`] where F is not finite or cannot be evaluated.
    pub fn at(surface: &dyn Surface, points: Vec<V3>, on: usize) -> Result<Self, Error> {
        let n = points.len();
        let (mut values, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        surface.value_gradient(&points, &mut values, &mut gradient)?;
        if let Some(i) = (0..n).find(|&i| !values[i].is_finite()) {
            return Err(Error::Field(FieldError::Invalid(format!(
                "expected F to be finite at the field points, but it is not at {:?}; choose points nearer to the surface",
                points[i]
            ))));
        }
        let slopes: Vec<f64> =
            gradient.iter().map(|g| norm(*g)).filter(|g| *g > 0.0 && g.is_finite()).collect();
        // The harmonic mean keeps a few steep places from setting the scale.
        let typical = slopes.len() as f64 / slopes.iter().map(|g| 1.0 / g).sum::<f64>();
        let least = if typical > 0.0 { 0.1 * typical } else { 1.0 };
        let lengths = gradient
            .iter()
            .map(|g| Some(1.0 / norm(*g).max(least)).filter(|v| v.is_finite()).unwrap_or(0.0))
            .collect();
        Ok(Self { points, values, lengths, on: on.min(n) })
    }
}

/// Where a deformation takes points: p with D⁻¹(p) = `before`, by Newton's method from `start` (where the points were
/// a moment ago). `inverse` are the three coordinates of D⁻¹: see `isoswarm_field::model::adapters::inverse`.
///
/// # Errors
/// [`Error::Field`] where D⁻¹ cannot be evaluated, or cannot be turned around: a point has nowhere to go.
pub fn carry(inverse: [&dyn Surface; 3], before: &[V3], start: &[V3]) -> Result<Vec<V3>, Error> {
    let n = before.len();
    if start.len() != n {
        return Err(Error::Option {
            name: "start",
            expected: format!("{n} points"),
            given: start.len().to_string(),
        });
    }
    let size = Aabb::around(before).map_or(0.0, |b| b.diagonal()).max(f64::MIN_POSITIVE);
    let mut p = start.to_vec();
    let mut off = vec![f64::INFINITY; n];
    let mut value = vec![0.0; n];
    let mut slopes = vec![vec![[0.0; 3]; n]; 3];
    let mut values = vec![vec![0.0; n]; 3];
    let mut last = f64::INFINITY;
    for _ in 0..4 * NEWTON {
        for a in 0..3 {
            inverse[a].value_gradient(&p, &mut value, &mut slopes[a])?;
            values[a].copy_from_slice(&value);
        }
        for i in 0..n {
            let r = [0, 1, 2].map(|a| before[i][a] - values[a][i]);
            off[i] = norm(r);
            if let Some(step) = solve3([slopes[0][i], slopes[1][i], slopes[2][i]], r) {
                // Far away the linear map says little.
                let k = (0.25 * size / norm(step)).min(1.0);
                (0..3).for_each(|a| p[i][a] += k * step[a]);
            }
        }
        let largest = off.iter().fold(0.0f64, |a, v| if v.is_nan() { f64::INFINITY } else { a.max(*v) });
        // Quadratic: once rounding stops the descent there is nothing to gain.
        if largest <= 1e-15 * size || (largest < 1e-10 * size && largest >= 0.5 * last) {
            break;
        }
        last = largest;
    }
    match (0..n).find(|&i| off[i].is_nan() || off[i] >= 1e-8 * size) {
        None => Ok(p),
        Some(i) => Err(Error::Field(FieldError::Invalid(format!(
            "expected a deformation that can be turned around near {:?}, but no point is taken there; undo a part of it",
            before[i]
        )))),
    }
}

/// x with A x = b, by Cramer's rule.
fn solve3(a: [V3; 3], b: V3) -> Option<V3> {
    let cross = crate::vector::cross;
    // Columns of the adjugate: A⁻¹ = (r₁ × r₂, r₂ × r₀, r₀ × r₁)/det.
    let c = [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])];
    let determinant = dot(a[0], c[0]);
    let x = [0, 1, 2].map(|k| (b[0] * c[0][k] + b[1] * c[1][k] + b[2] * c[2][k]) / determinant);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Settings of [`transfer`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOptions {
    /// Predictor and correctors together: linear steps, each with the derivatives at all points; 1 or more.
    pub steps: usize,
    /// A singular value below this part of the largest does not count in the rank.
    pub rank_tolerance: f64,
}

impl Default for TransferOptions {
    fn default() -> Self {
        Self { steps: 4, rank_tolerance: 1e-9 }
    }
}

/// How well an operand took a deformation on. Its parameters are in the operand.
#[derive(Clone, Debug)]
pub struct Transfer {
    /// Root mean square distance between the operand's surface and the deformed one, at the points on it.
    pub rms: f64,
    /// The largest such distance.
    pub largest: f64,
    /// The largest distance over the diagonal of the points' box: how far off the operand is, whatever its size.
    pub relative: f64,
    /// The same distance (to first order, signed) at each field point, also beside the surface.
    pub residuals: Vec<f64>,
    /// Number of the operand's parameters, or combinations of them, that the points determine.
    pub rank: usize,
    /// Number of the operand's free parameters.
    pub freedom: usize,
    /// Linear steps that were taken or tried.
    pub steps: usize,
    /// Why it ended; `Iterations` only says that another call would come closer still.
    pub status: FitStatus,
    /// Numbers of the parameters (in q) that ended at a limit and would go on.
    pub at_limit: Vec<usize>,
}

/// Moves the operand's free parameters so that its field at `moved`, where a deformation has taken `field.points`, is what it was at
/// those points before (HBJF02 eqs. 14 to 16, in least squares). It starts from the present parameters: in a drag these
/// are the last step's, the first linear step is the predictor and the others are correctors that know only what is left.
///
/// Where the operand cannot follow the whole field (a scaled sphere is a sphere, but its field has other values), the surface comes
/// first: further steps fit it, and what the surface does not notice stays.
///
/// # Errors
/// [`Error::Option`] for lengths that do not agree, [`Error::Field`] where F is not finite. After an error the operand is
/// as it was.
pub fn transfer(
    operand: &mut dyn Parametric,
    field: &FieldPoints,
    moved: &[V3],
    options: TransferOptions,
) -> Result<Transfer, Error> {
    let size = Aabb::around(moved).map_or(0.0, |b| b.diagonal());
    let weights: Vec<f64> = (0..moved.len()).map(|i| if i < field.on { 1.0 } else { BESIDE }).collect();
    let settings = |weights, damping| FitOptions {
        values: Some(&field.values),
        weights,
        measure: Measure::Scaled(&field.lengths),
        iterations: options.steps,
        tolerance: 1e-13,
        damping,
        rank_tolerance: options.rank_tolerance,
        ..FitOptions::default()
    };
    let before = operand.q();
    let mut result = fit(operand, moved, settings(None, DAMPING.0))?;
    if result.largest > NOTHING * size && field.on > 0 {
        let first = result;
        result = fit(operand, moved, settings(Some(&weights), DAMPING.1)).or_else(|e| {
            operand.set_q(&before)?;
            Err(e)
        })?;
        result.iterations += first.iterations;
        result.rank = first.rank;
    }
    Ok(report(result, field, size))
}

/// The same for any target field: F(x, q) = `target`(x) at `points`, of which the first `on` lie on the target's surface.
///
/// # Errors
/// As for [`transfer`] and [`FieldPoints::at`].
pub fn transfer_from(
    operand: &mut dyn Parametric,
    target: &dyn Surface,
    points: &[V3],
    on: usize,
    options: TransferOptions,
) -> Result<Transfer, Error> {
    let field = FieldPoints::at(target, points.to_vec(), on)?;
    transfer(operand, &field, points, options)
}

fn report(result: Fit, field: &FieldPoints, size: f64) -> Transfer {
    let on: Vec<f64> = result.residuals.iter().take(field.on).filter(|t| !t.is_nan()).copied().collect();
    let rms =
        if on.is_empty() { 0.0 } else { (on.iter().map(|t| t * t).sum::<f64>() / on.len() as f64).sqrt() };
    let largest = on.iter().fold(0.0f64, |a, t| a.max(t.abs()));
    Transfer {
        rms,
        largest,
        relative: if size > 0.0 { largest / size } else { 0.0 },
        residuals: result.residuals,
        rank: result.rank,
        freedom: result.freedom,
        steps: result.iterations,
        status: result.status,
        at_limit: result.at_limit,
    }
}

#[cfg(test)]
mod tests;
