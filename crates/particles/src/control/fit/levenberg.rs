//! Levenberg and Marquardt's method in parameters that are measured by their effect, within limits.

use isoswarm_field::{FieldError, Parametric};

use super::jacobian::{Jacobian, Linearised};
use super::linear::{Damped, Linear, Step};
use super::passes::{Matrix, dot};
use super::problem::{Distances, Problem, State};
use super::rank::rank;
use super::{Fit, FitOptions, FitProgress, FitStatus};
use crate::Error;

/// Part of the predicted gain from which a step is taken.
const TAKEN: f64 = 1e-4;
/// Part of the predicted gain from which the linear model is trusted further.
const TRUSTED: f64 = 0.9;
/// Largest bend of a step, relative to it.
const BENT: f64 = 0.375;
/// Smallest and largest damping.
const DAMPING: (f64, f64) = (1e-12, 1e12);
/// Damping above which a short step says nothing.
const HEAVY: f64 = 1.0;
/// Movement of the surface, in diagonals of the points' box, below which there is nothing to gain.
const STILL: f64 = 1e-12;
/// Rounds in which parameters that would leave their limits are held there.
const ROUNDS: usize = 8;
/// Largest distance, in diagonals of the points' box, that is nothing but rounding; also the cosine between the residuals and
/// a column of J.
const ROUNDING: f64 = 1e-15;

/// A fit on its way.
struct Run<'a> {
    problem: Problem<'a>,
    points: &'a [[f64; 3]],
    limits: Vec<(f64, f64)>,
    tolerance: f64,
    state: State,
    evaluations: usize,
    damping: f64,
    /// Longest that each column of J has been: no step is longer for a parameter that loses its effect.
    longest: Vec<f64>,
    at_limit: Vec<usize>,
}

pub(crate) fn run(
    surface: &mut dyn Parametric,
    points: &[[f64; 3]],
    options: &mut FitOptions<'_>,
    mut j: Jacobian,
) -> Result<Fit, Error> {
    let problem = Problem::new(points, options.values, options.weights, options.measure, options.loss);
    let state = problem.state(surface)?.map_err(|i| undefined(i, points[i]))?;
    if state.distance.iter().all(|t| t.is_nan()) {
        return Err(unusable(points.len(), options.weights));
    }
    let m = surface.freedom();
    let mut run = Run {
        problem,
        points,
        limits: surface.limits(),
        tolerance: options.tolerance,
        state,
        evaluations: 1,
        damping: options.damping,
        longest: vec![0.0; m],
        at_limit: Vec::new(),
    };
    let mut iterations = 0;
    let status = loop {
        let Distances { rms, largest, .. } = run.state.summary(&run.problem);
        let report = FitProgress { iteration: iterations, rms, largest };
        if options.progress.as_mut().is_some_and(|progress| progress(&report).is_break()) {
            break FitStatus::Cancelled;
        }
        if largest <= ROUNDING * run.problem.diagonal() {
            break FitStatus::Exact;
        }
        if iterations == options.iterations {
            break FitStatus::Iterations;
        }
        let l = run.problem.linearise(surface, &run.state, &mut j)?;
        iterations += 1;
        if let Some(status) = run.iterate(surface, j.matrix(), &l)? {
            break status;
        }
    };
    if iterations == 0 {
        run.problem.linearise(surface, &run.state, &mut j)?;
    }
    let matrix = j.matrix();
    let scale: Vec<f64> =
        matrix.squares().iter().map(|v| if *v > 0.0 { 1.0 / v.sqrt() } else { 0.0 }).collect();
    let rank = rank(matrix, &scale, options.rank_tolerance);
    let Distances { rms, largest, skipped } = run.state.summary(&run.problem);
    let (evaluations, at_limit, residuals) = (run.evaluations, run.at_limit, run.state.distance);
    Ok(Fit { status, rms, largest, residuals, skipped, rank, freedom: m, iterations, evaluations, at_limit })
}

impl Run<'_> {
    /// Steps of more and more damping until one is taken; why the fit ends, if it does.
    fn iterate(
        &mut self,
        surface: &mut dyn Parametric,
        j: Matrix<'_>,
        l: &Linearised,
    ) -> Result<Option<FitStatus>, Error> {
        let m = j.width();
        let lengths: Vec<f64> = j.squares().iter().map(|v| v.sqrt()).collect();
        if let Some(k) = lengths.iter().position(|v| !v.is_finite()) {
            return Err(Error::Field(FieldError::Invalid(format!(
                "expected finite derivatives, but that by free parameter {k} is not finite at some point; leave out \
                 points where F is not smooth, or freeze the parameter"
            ))));
        }
        self.longest.iter_mut().zip(&lengths).for_each(|(a, b)| *a = a.max(*b));
        let scale: Vec<f64> =
            (0..m).map(|k| if lengths[k] > 0.0 { 1.0 / self.longest[k] } else { 0.0 }).collect();
        let linear = Linear::new(j, &scale);
        let gradient = linear.transposed(&l.f);
        let q = surface.q();
        let pushed: Vec<bool> = (0..m)
            .map(|k| {
                let (lo, hi) = self.limits[k];
                q[k] <= lo && gradient[k] > 0.0 || q[k] >= hi && gradient[k] < 0.0
            })
            .collect();
        self.at_limit = (0..m).filter(|&k| pushed[k]).collect();
        if !(0..m).any(|k| scale[k] > 0.0 && !pushed[k]) {
            return Ok(Some(FitStatus::NothingMoves));
        }
        let steepest = (0..m).filter(|&k| !pushed[k]).fold(0.0f64, |a, k| a.max(gradient[k].abs()));
        if steepest <= ROUNDING * dot(&l.f, &l.f).sqrt() {
            return Ok(Some(FitStatus::Converged));
        }
        let cost = self.problem.cost(&self.state, &self.state);
        let mut growth = 2.0;
        loop {
            let (system, step) = self.within(&linear, &gradient, &pushed, &q);
            let square = dot(&step.effect, &step.effect);
            let predicted = -dot(&gradient, &step.z) - 0.5 * square;
            let moved = (square / self.points.len() as f64).sqrt();
            let still = (self.tolerance * self.tolerance).max(STILL);
            let small = predicted <= self.tolerance * cost || moved <= still * self.problem.diagonal();
            let mut z = step.z.clone();
            if let Some(bend) = self.bend(surface, &linear, &system, &step, l, &q)? {
                z.iter_mut().zip(&bend).for_each(|(z, b)| *z += b);
            }
            let to = self.moved(&q, &z, &scale);
            surface.set_q(&to)?;
            let next = self.problem.state(surface)?;
            self.evaluations += 1;
            if let Ok(next) = next {
                let won = self.problem.cost(&self.state, &next) - self.problem.cost(&next, &self.state);
                let gain = won / predicted;
                if gain > TAKEN {
                    self.state = next;
                    let t = 2.0 * gain - 1.0;
                    let factor = if gain > TRUSTED { 0.1 } else { (1.0 - t * t * t).clamp(1.0 / 3.0, 2.0) };
                    self.damping = (self.damping * factor).max(DAMPING.0);
                    return Ok((small && self.damping < HEAVY).then_some(FitStatus::Converged));
                }
            }
            surface.set_q(&q)?;
            if small || self.damping > DAMPING.1 {
                let status = if self.damping < HEAVY { FitStatus::Converged } else { FitStatus::Stuck };
                return Ok(Some(status));
            }
            self.damping *= growth;
            growth *= 2.0;
        }
    }

    /// q + z in scaled parameters, within the limits.
    fn moved(&self, q: &[f64], z: &[f64], scale: &[f64]) -> Vec<f64> {
        let to = |k: usize| match z[k] {
            0.0 => q[k],
            z => (q[k] + z * scale[k]).clamp(self.limits[k].0, self.limits[k].1),
        };
        (0..q.len()).map(to).collect()
    }

    /// How the step must bend to follow the residuals' curvature along it (Transtrum and Sethna 2012): the solution for half of
    /// their second derivative, which costs one more evaluation. `None` where that is no small correction.
    fn bend(
        &mut self,
        surface: &mut dyn Parametric,
        linear: &Linear<'_>,
        system: &Damped<'_>,
        step: &Step,
        l: &Linearised,
        q: &[f64],
    ) -> Result<Option<Vec<f64>>, Error> {
        const H: f64 = 0.1;
        let part: Vec<f64> = step.z.iter().map(|z| H * z).collect();
        surface.set_q(&self.moved(q, &part, linear.scale()))?;
        self.evaluations += 1;
        let Ok(ahead) = self.problem.state(surface)? else { return Ok(None) };
        let second: Vec<f64> = (0..self.points.len())
            .map(|i| {
                let change = l.factor[i] * (ahead.distance[i] - self.state.distance[i]);
                let v = (change / H - step.effect[i]) / H;
                if l.factor[i] == 0.0 || !v.is_finite() { 0.0 } else { v }
            })
            .collect();
        let bend = system.solve(&linear.transposed(&second)).z;
        let (a, b) = (dot(&bend, &bend).sqrt(), dot(&step.z, &step.z).sqrt());
        Ok((a <= BENT * b).then_some(bend))
    }

    /// The damped step, parameters that would leave their limits held there and the others making up for them; and the
    /// system of the others.
    fn within<'b>(
        &self,
        linear: &'b Linear<'_>,
        gradient: &[f64],
        pushed: &[bool],
        q: &[f64],
    ) -> (Damped<'b>, Step) {
        let scale = linear.scale();
        let mut held = pushed.to_vec();
        let mut base = Step { z: vec![0.0; q.len()], effect: Vec::new() };
        let mut slope = gradient.to_vec();
        for round in 0.. {
            let system = linear.damped(self.damping, &held);
            let mut step = system.solve(&slope);
            step.z.iter_mut().zip(&base.z).for_each(|(z, b)| *z += b);
            step.effect.iter_mut().zip(&base.effect).for_each(|(e, b)| *e += b);
            let mut left = false;
            for k in 0..q.len() {
                if held[k] || scale[k] == 0.0 {
                    continue;
                }
                let to = q[k] + step.z[k] * scale[k];
                let inside = to.clamp(self.limits[k].0, self.limits[k].1);
                if inside != to {
                    (left, held[k], base.z[k]) = (true, true, (inside - q[k]) / scale[k]);
                }
            }
            if !left || round == ROUNDS {
                return (system, step);
            }
            base.effect = linear.times(&base.z);
            let more = linear.transposed(&base.effect);
            slope = gradient.iter().zip(more).map(|(g, m)| g + m).collect();
        }
        unreachable!("the last round returns")
    }
}

/// No point has a say.
fn unusable(count: usize, weights: Option<&[f64]>) -> Error {
    let none = weights.map_or(0, |w| w.iter().filter(|w| **w == 0.0).count());
    Error::Option {
        name: "points",
        expected: "a point or more with a weight above 0 at which F has a gradient".into(),
        given: format!(
            "{count} of which none can be used ({none} with the weight 0, {} where the gradient of F vanishes); raise the \
             weights, or move the surface so that the points are away from its middle",
            count - none
        ),
    }
}

pub(crate) fn undefined(point: usize, at: [f64; 3]) -> Error {
    Error::Field(FieldError::Invalid(format!(
        "expected F and its gradient to be finite at every point, but they are not at point {point}, ({}, {}, {}); leave it \
         out or give it the weight 0",
        at[0], at[1], at[2]
    )))
}
