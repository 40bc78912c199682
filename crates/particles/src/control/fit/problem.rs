//! The residuals of a fit and their derivatives.

use isoswarm_field::{Aabb, Parametric};
use rayon::prelude::*;

use super::{Loss, Measure};
use crate::Error;
use crate::vector::{V3, dot, norm};

/// Estimates of distances saturate here, in diagonals of the points' box.
const REACH: f64 = 10.0;
/// Step for the derivative of |∇F| along the normal, in diagonals of the points' box.
const STEP: f64 = 1e-5;
/// Largest correction of an entry of J for the change of |∇F|, relative to the entries: beyond, the step met a crease.
const CREASE: f64 = 10.0;

/// Which surface values are wanted where.
pub(crate) struct Problem<'a> {
    pub(crate) points: &'a [V3],
    pub(crate) values: Option<&'a [f64]>,
    pub(crate) weights: Option<&'a [f64]>,
    pub(crate) measure: Measure<'a>,
    pub(crate) loss: Loss,
    diagonal: f64,
}

/// The residuals at some q.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// F − g.
    off: Vec<f64>,
    gradient: Vec<V3>,
    /// Signed distances; NaN where a point is left out.
    pub(crate) distance: Vec<f64>,
}

/// The least squares that stand for the loss at some q, besides J.
pub(crate) struct Linearised {
    /// f of |J z + f|².
    pub(crate) f: Vec<f64>,
    /// J over the derivatives of the distances, for each row.
    pub(crate) factor: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        points: &'a [V3],
        values: Option<&'a [f64]>,
        weights: Option<&'a [f64]>,
        measure: Measure<'a>,
        loss: Loss,
    ) -> Self {
        let diagonal = Aabb::around(points).map_or(0.0, |b| b.diagonal());
        Self { points, values, weights, measure, loss, diagonal }
    }

    /// Diagonal of the points' box.
    pub(crate) fn diagonal(&self) -> f64 {
        self.diagonal
    }

    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.weights.map_or(1.0, |w| w[i])
    }

    /// 1/N², where the distance is f/N and N² = |∇F|² + (f/reach)²: see `docs/theory/fits.md`.
    fn inverse_squared(&self, off: f64, gradient: V3) -> f64 {
        let reach = REACH * self.diagonal;
        let far = if reach > 0.0 { off / reach } else { 0.0 };
        1.0 / (dot(gradient, gradient) + far * far)
    }

    /// The residuals at the surface's present q; `Err` with the number of a point where F or its gradient is not finite.
    pub(crate) fn state(&self, surface: &dyn Parametric) -> Result<Result<State, usize>, Error> {
        let n = self.points.len();
        let (mut off, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        surface.value_gradient(self.points, &mut off, &mut gradient)?;
        if let Some(values) = self.values {
            off.iter_mut().zip(values).for_each(|(f, g)| *f -= g);
        }
        let wanted = |i: usize| self.weight(i) > 0.0;
        let slopes = matches!(self.measure, Measure::Distance);
        let fine = |i: usize| off[i].is_finite() && (!slopes || gradient[i].iter().all(|v| v.is_finite()));
        if let Some(i) = (0..n).find(|&i| wanted(i) && !fine(i)) {
            return Ok(Err(i));
        }
        let distance = (0..n)
            .map(|i| match self.measure {
                _ if !wanted(i) => f64::NAN,
                Measure::Scaled(lengths) => off[i] * lengths[i],
                Measure::Distance if norm(gradient[i]) > 0.0 => {
                    off[i] * self.inverse_squared(off[i], gradient[i]).sqrt()
                }
                Measure::Distance => f64::NAN,
            })
            .map(|t: f64| if t.is_finite() { t } else { f64::NAN })
            .collect();
        Ok(Ok(State { off, gradient, distance }))
    }

    /// Half the weighted sum of costs of the points that neither of the states leaves out.
    pub(crate) fn cost(&self, state: &State, other: &State) -> f64 {
        let terms = state.distance.iter().zip(&other.distance).enumerate();
        let term = |(i, (t, o)): (usize, (&f64, &f64))| {
            let w = self.weight(i);
            if t.is_nan() || o.is_nan() { 0.0 } else { 0.5 * w * w * self.loss.cost(*t) }
        };
        terms.map(term).sum()
    }

    /// Derivatives of the distances, row-major, with the factors that weights and loss give them, into `j`; `spare` is another of the
    /// same size.
    pub(crate) fn linearise(
        &self,
        surface: &dyn Parametric,
        state: &State,
        j: &mut Vec<f64>,
        spare: &mut Vec<f64>,
    ) -> Result<Linearised, Error> {
        let (n, m) = (self.points.len(), surface.freedom());
        j.resize(n * m, 0.0);
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        surface.parameter_gradient(self.points, &mut value, &mut gradient, j)?;
        let h = STEP * self.diagonal;
        let largest = state.distance.iter().fold(0.0f64, |a, t| a.max(t.abs()));
        // On the surface the change of |∇F| does not matter.
        let bent = matches!(self.measure, Measure::Distance) && h > 0.0 && largest > 1e-12 * self.diagonal;
        if bent {
            spare.resize(n * m, 0.0);
            let behind: Vec<V3> = (0..n)
                .map(|i| {
                    let (p, g) = (self.points[i], state.gradient[i]);
                    let s = if state.distance[i].is_nan() { 0.0 } else { h / norm(g) };
                    [0, 1, 2].map(|a| p[a] - s * g[a])
                })
                .collect();
            surface.parameter_gradient(&behind, &mut value, &mut gradient, spare)?;
        }
        let (mut f, mut factor) = (vec![0.0; n], vec![0.0; n]);
        for (i, t) in state.distance.iter().enumerate().filter(|(_, t)| !t.is_nan()) {
            let (row, right) = self.loss.factors(*t);
            (factor[i], f[i]) = (self.weight(i) * row, self.weight(i) * right * t);
        }
        if m == 0 {
            return Ok(Linearised { f, factor });
        }
        let row = |i: usize, row: &mut [f64], behind: Option<&[f64]>| {
            let k = factor[i];
            if k == 0.0 {
                return row.fill(0.0);
            }
            if let Measure::Scaled(lengths) = self.measure {
                return row.iter_mut().for_each(|v| *v *= k * lengths[i]);
            }
            // t = f/N:  dt = (G² df − f G dG)/N³ with G = |∇F|, and dG from the derivatives a step behind.
            let (f, g) = (state.off[i], norm(state.gradient[i]));
            let n2 = self.inverse_squared(f, state.gradient[i]);
            let n3 = n2 * n2.sqrt();
            let a = k * g * g * n3;
            let Some(behind) = behind else {
                return row.iter_mut().for_each(|v| *v *= a);
            };
            let b = -k * f * g * n3 / h;
            for (v, w) in row.iter_mut().zip(behind) {
                let bend = b * (*v - w);
                let most = CREASE * a * v.abs().max(w.abs());
                *v = a * *v + if bend.abs() <= most { bend } else { 0.0 };
            }
        };
        let few = (1 << 14) / m + 1;
        if bent {
            let both = j.par_chunks_mut(few * m).zip(spare.par_chunks(few * m)).enumerate();
            both.for_each(|(c, (rows, behind))| {
                for (k, (r, b)) in rows.chunks_exact_mut(m).zip(behind.chunks_exact(m)).enumerate() {
                    row(c * few + k, r, Some(b));
                }
            });
        } else {
            j.par_chunks_mut(few * m).enumerate().for_each(|(c, rows)| {
                for (k, r) in rows.chunks_exact_mut(m).enumerate() {
                    row(c * few + k, r, None);
                }
            });
        }
        Ok(Linearised { f, factor })
    }
}

impl State {
    /// Root of the weighted mean square distance, the largest distance, and how many points are left out.
    pub(crate) fn summary(&self, problem: &Problem<'_>) -> (f64, f64, usize) {
        let (mut sum, mut weights, mut largest, mut skipped) = (0.0, 0.0, 0.0f64, 0);
        for (i, t) in self.distance.iter().enumerate() {
            if t.is_nan() {
                skipped += 1;
                continue;
            }
            let w = problem.weight(i);
            sum += w * w * t * t;
            weights += w * w;
            largest = largest.max(t.abs());
        }
        (if weights > 0.0 { (sum / weights).sqrt() } else { 0.0 }, largest, skipped)
    }
}
