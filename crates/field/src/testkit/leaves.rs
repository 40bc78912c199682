//! Opaque leaves against formulas.

use super::{All, Outcome, ensure, packed, some_rates};
use crate::Field;

/// A model with opaque leaves against the same model as a formula: values within rounding, ∂F/∂x, ∂F/∂q and (∂F/∂q)·q̇
/// within `tolerance` relative to 1 + |expected|, the Hessian, which is numerical in any case, within 1e-3. Both must
/// have the same free parameters in the same order.
pub fn leaves_agree(opaque: &Field, formula: &Field, points: &[[f64; 3]], tolerance: f64) -> Outcome {
    ensure(opaque.q() == formula.q(), || format!("q is {:?} instead of {:?}", opaque.q(), formula.q()))?;
    let q_dot = some_rates(formula);
    let expected = All::of(formula, &packed(formula, points), &q_dot)?;
    let given = All::of(opaque, &packed(opaque, points), &q_dot)?;
    let answers = [
        ("F", &expected.value, &given.value, 1e-13),
        ("dF/dx", &expected.gradient, &given.gradient, tolerance),
        ("dF/dq", &expected.q, &given.q, tolerance),
        ("the rate", &expected.rate, &given.rate, tolerance),
        ("the Hessian", &expected.hessian, &given.hessian, 1e-3),
    ];
    let mut count = 0;
    for (what, expected, given, tolerance) in answers {
        ensure(expected.len() == given.len(), || {
            format!("{what} has {} numbers instead of {}", given.len(), expected.len())
        })?;
        for (i, (a, b)) in expected.iter().zip(given).enumerate() {
            ensure((a - b).abs() <= tolerance * (1.0 + a.abs()), || {
                format!("{what}, number {i}: {b:e} instead of {a:e}")
            })?;
        }
        count += expected.len();
    }
    Ok(count)
}
