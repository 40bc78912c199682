//! The residuals of a fit and their derivatives.

use isoswarm_field::{Aabb, Parametric};

use super::{Loss, Measure};
use crate::Error;
use crate::vector::{V3, dot, norm};

/// Estimates of distances saturate here, in diagonals of the points' box.
const REACH: f64 = 10.0;
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
    pub(super) off: Vec<f64>,
    pub(super) gradient: Vec<V3>,
    /// Signed distances; NaN where a point is left out.
    pub(crate) distance: Vec<f64>,
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
    pub(super) fn inverse_squared(&self, off: f64, gradient: V3) -> f64 {
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
}

impl State {
    pub(crate) fn summary(&self, problem: &Problem<'_>) -> Distances {
        Distances::of(&self.distance, problem.weights)
    }
}

/// How far some points are from a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// Root of the mean square distance, a length; weights count squared, as they do in the fit.
    pub rms: f64,
    /// The largest distance, a length.
    pub largest: f64,
    /// Points that are left out.
    pub skipped: usize,
}

impl Distances {
    /// From signed distances, NaN where a point is left out, and the weight of each point (`None`: 1; more weights than distances do
    /// no harm).
    ///
    /// ```
    /// use isoswarm_particles::control::Distances;
    /// let d = Distances::of(&[3.0, -4.0, f64::NAN], None);
    /// assert_eq!((d.rms, d.largest, d.skipped), (12.5f64.sqrt(), 4.0, 1));
    /// ```
    pub fn of(distances: &[f64], weights: Option<&[f64]>) -> Self {
        let (mut sum, mut total, mut found) = (0.0, 0.0, Self::default());
        for (i, t) in distances.iter().enumerate() {
            if t.is_nan() {
                found.skipped += 1;
                continue;
            }
            let w = weights.map_or(1.0, |w| w[i]);
            sum += w * w * t * t;
            total += w * w;
            found.largest = found.largest.max(t.abs());
        }
        found.rms = if total > 0.0 { (sum / total).sqrt() } else { 0.0 };
        found
    }
}
