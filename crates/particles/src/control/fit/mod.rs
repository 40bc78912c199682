//! Fits: the parameters move until the surface passes through given points.
//!
//! Least squares in distances, by Levenberg and Marquardt's method: see `docs/theory/fits.md`.

mod dense;
mod jacobian;
mod levenberg;
mod linear;
mod loss;
mod passes;
mod problem;
mod rank;
#[cfg(test)]
mod tests;

use std::ops::ControlFlow;

use isoswarm_field::Parametric;

use crate::Error;
use jacobian::Jacobian;
pub use loss::Loss;
pub use problem::Distances;

/// How far a point is from where F has the value it should have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Measure<'a> {
    /// (F − g)/|∇F|, a length: the distance to first order. It saturates at ten diagonals of the points' box.
    #[default]
    Distance,
    /// (F − g) times a given factor for each point (a length for a unit of F, 0 or more): fits the field and not only the
    /// surface, so that F and 2F differ.
    Scaled(&'a [f64]),
}

/// What a fit reports before each iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitProgress {
    /// Number of the iteration, from 0.
    pub iteration: usize,
    /// Root of the (weighted) mean square distance.
    pub rms: f64,
    /// The largest distance.
    pub largest: f64,
}

/// Called before each iteration; `Break` ends the fit with the best parameters so far.
pub type FitProgressFn<'a> = dyn FnMut(&FitProgress) -> ControlFlow<()> + 'a;

/// Settings of [`fit`].
pub struct FitOptions<'a> {
    /// g: the value that F should have at each point, n numbers; `None`: 0, the points lie on the surface.
    pub values: Option<&'a [f64]>,
    /// Weight of each point's distance, n numbers, 0 or more; a point with 0 is left out. `None`: 1.
    pub weights: Option<&'a [f64]>,
    /// What is made small.
    pub measure: Measure<'a>,
    /// How much a distance costs.
    pub loss: Loss,
    /// Largest number of iterations (each with the derivatives at all points), 1 or more.
    pub iterations: usize,
    /// Converged once a step lowers the cost by less than this part of it, or moves the surface at the points by less than its
    /// square (at least 1e-12), relative to the diagonal of their box. From 0 to 1.
    pub tolerance: f64,
    /// λ of the first iteration, relative to the squared length of a column of the Jacobian: small from nearby, large from far
    /// away. Above 0.
    pub damping: f64,
    /// A singular value below this part of the largest does not count in the rank (columns scaled to equal length).
    pub rank_tolerance: f64,
    /// Reports, and may end the fit.
    pub progress: Option<&'a mut FitProgressFn<'a>>,
}

impl Default for FitOptions<'_> {
    fn default() -> Self {
        Self {
            values: None,
            weights: None,
            measure: Measure::Distance,
            loss: Loss::Squares,
            iterations: 100,
            tolerance: 1e-8,
            damping: 1e-3,
            rank_tolerance: 1e-9,
            progress: None,
        }
    }
}

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitStatus {
    /// Nothing is left but rounding.
    Exact,
    /// The least cost nearby, to the tolerance.
    Converged,
    /// No free parameter has an effect on any point, or all that have are at their limits.
    NothingMoves,
    /// No step lowers the cost further although it is not at its least: F is rough here (a crease, noise, an
    /// undefined region around).
    Stuck,
    /// The iterations were used up.
    Iterations,
    /// The progress function ended it.
    Cancelled,
}

impl FitStatus {
    /// Whether the parameters are the best nearby.
    pub fn is_converged(self) -> bool {
        matches!(self, FitStatus::Exact | FitStatus::Converged)
    }
}

impl std::fmt::Display for FitStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FitStatus::Exact => "the surface passes through all points",
            FitStatus::Converged => "no parameters nearby fit better",
            FitStatus::NothingMoves => {
                "no free parameter that is not at its limit has an effect on the points: release parameters"
            }
            FitStatus::Stuck => "no step fits better: the surface is not smooth here, or undefined nearby",
            FitStatus::Iterations => "the iterations were used up: fit again, or allow more",
            FitStatus::Cancelled => "cancelled",
        })
    }
}

/// The result of a fit. The parameters themselves are in the surface.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Why it ended.
    pub status: FitStatus,
    /// Root of the (weighted) mean square distance, a length.
    pub rms: f64,
    /// The largest distance, a length.
    pub largest: f64,
    /// The signed distance of each point; NaN where it was left out.
    pub residuals: Vec<f64>,
    /// Number of points that were left out at the end: weight 0, or no gradient.
    pub skipped: usize,
    /// Number of parameters, or combinations of them, that the points determine; at most the freedom. Of large local models, with more
    /// than 2^26 points times parameters, the parameters that have an effect on points are counted.
    pub rank: usize,
    /// Number of free parameters.
    pub freedom: usize,
    /// Steps taken or tried, each with derivatives of its own.
    pub iterations: usize,
    /// Number of times that F was evaluated at all points without derivatives by parameters.
    pub evaluations: usize,
    /// Numbers of the parameters (in q) that ended at a limit and would go on.
    pub at_limit: Vec<usize>,
}

/// Moves the free parameters of `surface` so that F has the values `options.values` (0: the surface passes) at `points`.
///
/// Fewer points than parameters: the smallest change that does it, each parameter measured by its effect. Parameters without
/// effect keep their bits, and so do the units in which others are counted not matter. The result does not
/// depend on the number of threads.
///
/// # Errors
/// [`Error::Option`] for settings out of range and where no point counts (each has the weight 0 or lies where F has no gradient),
/// [`Error::Field`] where F is not finite at a point or cannot be evaluated. After an
/// error the surface is as it was.
pub fn fit(
    surface: &mut dyn Parametric,
    points: &[[f64; 3]],
    mut options: FitOptions<'_>,
) -> Result<Fit, Error> {
    check(points, &options)?;
    let part = jacobian::local_part(surface, points)?;
    check_size(surface, points, part)?;
    let before = surface.q();
    let jacobian = Jacobian::new(surface, part.is_some());
    let result = levenberg::run(surface, points, &mut options, jacobian);
    if result.is_err() {
        surface.set_q(&before)?;
    }
    result
}

/// The residuals that [`fit`] squares and sums, and their derivatives by the free parameters, at the present q: n numbers, and n rows
/// of [`Parametric::freedom`] numbers. Weights and the loss are part of both; a point that is left out has zeros.
///
/// # Errors
/// As for [`fit`].
pub fn fit_residuals(
    surface: &dyn Parametric,
    points: &[[f64; 3]],
    options: &FitOptions<'_>,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    check(points, options)?;
    check_size(surface, points, None)?;
    let o = options;
    let problem = problem::Problem::new(points, o.values, o.weights, o.measure, o.loss);
    let state = problem.state(surface)?.map_err(|i| levenberg::undefined(i, points[i]))?;
    let mut jacobian = Jacobian::new(surface, false);
    let f = problem.linearise(surface, &state, &mut jacobian)?.f;
    let Jacobian::All { j, .. } = jacobian else { unreachable!("made above") };
    Ok((f, j))
}

/// Largest number of derivatives held at a time.
const MOST: usize = 1 << 28;

fn check(points: &[[f64; 3]], o: &FitOptions<'_>) -> Result<(), Error> {
    let wrong =
        |name, expected: &str, given: String| Err(Error::Option { name, expected: expected.into(), given });
    let n = points.len();
    if n == 0 {
        return wrong("points", "one point or more", "none".into());
    }
    if let Some(i) = points.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        return wrong("points", "finite coordinates", format!("{:?} as point {i}; leave it out", points[i]));
    }
    for (name, numbers, negative) in [
        ("values", o.values, true),
        ("weights", o.weights, false),
        ("measure", if let Measure::Scaled(s) = o.measure { Some(s) } else { None }, false),
    ] {
        let Some(numbers) = numbers else { continue };
        if numbers.len() != n {
            return wrong(name, "a number for each point", format!("{} for {n} points", numbers.len()));
        }
        if let Some(i) = numbers.iter().position(|v| !v.is_finite() || (*v < 0.0 && !negative)) {
            let what = if negative { "finite numbers" } else { "finite numbers, 0 or more" };
            return wrong(name, what, format!("{} for point {i}", numbers[i]));
        }
    }
    if let Some(c) = o.loss.scale().filter(|c| !(*c > 0.0 && c.is_finite())) {
        return wrong("loss", "a scale above 0, a length", c.to_string());
    }
    if o.iterations == 0 {
        return wrong("iterations", "1 or more", "0".into());
    }
    for (name, v) in [("tolerance", o.tolerance), ("rank_tolerance", o.rank_tolerance)] {
        if !(0.0..1.0).contains(&v) {
            return wrong(name, "0 or more, and below 1", v.to_string());
        }
    }
    if !(o.damping > 0.0 && o.damping.is_finite()) {
        return wrong("damping", "a number above 0", o.damping.to_string());
    }
    Ok(())
}

/// Whether derivatives fit in memory: those that are other than nothing where the model is local (`part` of all).
fn check_size(surface: &dyn Parametric, points: &[[f64; 3]], part: Option<f64>) -> Result<(), Error> {
    let (n, m) = (points.len(), surface.freedom());
    if n as f64 * m as f64 * part.unwrap_or(1.0) <= MOST as f64 {
        return Ok(());
    }
    Err(Error::Option {
        name: "points",
        expected: "at most 2^28 derivatives (points × free parameters that matter near them)".into(),
        given: format!("{n} points and {m} parameters; take fewer points"),
    })
}
