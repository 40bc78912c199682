//! The conformance suite (feature `testkit`): random models, a slow evaluator to compare with, and checks that any
//! [`Field`](crate::Field) must pass. The checks say what disagrees, where, and by how much.
//!
//! ```
//! use isoswarm_field::{Field, testkit, text};
//! let field = Field::new(&text::parse("torus(2, 0.5) | sphere(r=1)", &[])?)?;
//! let points = testkit::scattered(100, 2.0, 1);
//! testkit::conforms(&field, &points).unwrap();
//! # Ok::<(), isoswarm_field::FieldError>(())
//! ```
//!
//! Every check returns how many comparisons it made: a point where some operation is undefined, or where a kink is
//! too near for finite differences, is passed over, and a test should see to it that enough are left.

mod agreement;
mod differences;
mod generate;
mod leaves;
mod ranges;
mod reference;
mod rows;

pub use agreement::{batches_agree, evaluators_agree, rates_agree, threads_agree};
pub use differences::{gradient_differences, hessian_differences, parameter_differences};
pub use generate::{
    BoxAt, Expression, Tree, boxes, each_kind, expressions, node, operations, points, run, scattered, trees,
};
pub use leaves::leaves_agree;
pub use ranges::{cells_keep_zeros, intervals_contain, pruning_keeps};
pub use reference::{Reference, Sample};
pub use rows::{bump_rows_agree, pruned_rows_agree};

use crate::{Field, FieldError};

/// What disagrees.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Failure(pub String);

impl From<FieldError> for Failure {
    fn from(e: FieldError) -> Self {
        Failure(e.to_string())
    }
}

/// The number of comparisons made, or the first that failed.
pub type Outcome = Result<usize, Failure>;

/// Fails with a message that is made only then.
pub(crate) fn ensure(condition: bool, message: impl FnOnce() -> String) -> Result<(), Failure> {
    if condition { Ok(()) } else { Err(Failure(message())) }
}

/// Equal, or both not a number.
pub(crate) fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// Compares two rows of results of the same points number by number.
pub(crate) fn same_rows(what: &str, a: &[f64], b: &[f64]) -> Outcome {
    ensure(a.len() == b.len(), || format!("{what}: {} numbers against {}", a.len(), b.len()))?;
    for (i, (&x, &y)) in a.iter().zip(b).enumerate() {
        ensure(same(x, y), || format!("{what}: number {i} is {x:e} against {y:e}"))?;
    }
    Ok(a.len())
}

/// The field's coordinates of points in space.
pub(crate) fn packed(field: &Field, points: &[[f64; 3]]) -> Vec<f64> {
    points.iter().flat_map(|p| &p[..field.axes()]).copied().collect()
}

/// Everything that a field answers at points: (n, k), (n, k, d), (n, k, m), (n, k), (n, k, d, d).
#[derive(Debug, Default)]
pub(crate) struct All {
    pub value: Vec<f64>,
    pub gradient: Vec<f64>,
    pub q: Vec<f64>,
    pub rate: Vec<f64>,
    pub hessian: Vec<f64>,
}

impl All {
    /// The answers for points given by `axes()` numbers each, with the rates `q_dot` of the parameters.
    pub fn of(field: &Field, flat: &[f64], q_dot: &[f64]) -> Result<All, Failure> {
        let (k, d, m) = (field.components(), field.axes(), field.free().len());
        let n = flat.len() / d;
        // What is not written must show.
        let blank = |width: usize| vec![f64::NAN; n * k * width];
        let mut a =
            All { value: blank(1), gradient: blank(d), q: blank(m), rate: blank(1), hessian: blank(d * d) };
        field.parameter_gradient(flat, &mut a.value, &mut a.gradient, &mut a.q)?;
        let (mut value, mut gradient) = (blank(1), blank(d));
        field.gradient_and_rate(flat, q_dot, &mut value, &mut gradient, &mut a.rate)?;
        field.hessian(flat, &mut a.hessian)?;
        Ok(a)
    }

    /// Whether two sets of answers are the same to the last bit.
    pub fn same(&self, other: &All, what: &str) -> Outcome {
        let mut count = same_rows(&format!("{what}: value"), &self.value, &other.value)?;
        count += same_rows(&format!("{what}: gradient"), &self.gradient, &other.gradient)?;
        count += same_rows(&format!("{what}: parameter gradient"), &self.q, &other.q)?;
        count += same_rows(&format!("{what}: rate"), &self.rate, &other.rate)?;
        Ok(count + same_rows(&format!("{what}: Hessian"), &self.hessian, &other.hessian)?)
    }
}

/// Rates of the free parameters that differ from each other.
pub(crate) fn some_rates(field: &Field) -> Vec<f64> {
    (0..field.free().len()).map(|i| 0.7 - 0.31 * (i % 5) as f64).collect()
}

/// All checks at once, for a field without opaque leaves: evaluators against each other and against finite
/// differences, intervals around the points, pruning for them.
pub fn conforms(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let mut count = evaluators_agree(field, points)?;
    count += rates_agree(field, points)?;
    count += batches_agree(field, points)?;
    count += gradient_differences(field, points)?;
    count += parameter_differences(field, points)?;
    count += hessian_differences(field, points)?;
    for (i, p) in points.iter().enumerate().take(16) {
        let at = BoxAt { centre: *p, half: [0.3, 0.01 * i as f64, 1e-9] };
        count += intervals_contain(field, &at, points)?;
    }
    if field.components() == 1 {
        count += pruning_keeps(field, points, 0.01, 0.0)?;
    }
    Ok(count)
}
