//! Sparse rows of ∂F/∂q against all of it.

use super::agreement::flattened;
use super::{All, Outcome, Reference, ensure, packed, same, some_rates};
use crate::{Field, SparseRows};

/// Rows from pruned tapes against the dense ones: F to the last bit, derivatives within the rounding errors of another order
/// of sums, and to the last bit where there was nothing to prune. Nothing is left out but zeros.
pub fn pruned_rows_agree(field: &Field, points: &[[f64; 3]]) -> Outcome {
    if field.components() != 1 || field.is_opaque() || points.is_empty() {
        return Ok(0);
    }
    let n = points.len();
    let all = All::of(field, &packed(field, points), &some_rates(field))?;
    let (mut value, mut gradient) = (vec![f64::NAN; n], vec![[f64::NAN; 3]; n]);
    let rows = field.pruned_rows(points, 0.0, &mut value, &mut gradient);
    compare(field, points, (&value, &gradient), &all, &rows, None)
}

/// Rows of a sum of bumps against the dense ones: parameters of one bump to the last bit. What is left out, and what tails
/// change in sums over many bumps, is below `bound` times the largest entry. 0 where the field is no such sum.
pub fn bump_rows_agree(field: &Field, points: &[[f64; 3]], bound: f64) -> Outcome {
    let n = points.len();
    let all = All::of(field, &packed(field, points), &some_rates(field))?;
    let (mut value, mut gradient) = (vec![f64::NAN; n], vec![[f64::NAN; 3]; n]);
    match field.bump_rows(points, &mut value, &mut gradient)? {
        Some(rows) => compare(field, points, (&value, &gradient), &all, &rows, Some(bound)),
        None => Ok(0),
    }
}

fn compare(
    field: &Field,
    points: &[[f64; 3]],
    (value, gradient): (&[f64], &[[f64; 3]]),
    all: &All,
    rows: &SparseRows,
    bound: Option<f64>,
) -> Outcome {
    let (free, reference) = (field.free(), Reference::new(field)?);
    let (m, q) = (free.len(), field.parameters().iter().map(|p| p.value).collect::<Vec<_>>());
    ensure((rows.len(), rows.width()) == (points.len(), m), || "the rows have another shape".into())?;
    let dense = rows.to_dense();
    // Without choices there is nothing to prune.
    let exact = bound.is_none() && field.tape(0).choices() == 0;
    let largest = all.q.iter().filter(|v| v.is_finite()).fold(0.0f64, |a, v| a.max(v.abs()));
    let left_out = bound.map_or(0.0, |b| b * largest);
    let (mut count, d) = (0, field.axes());
    for (i, &p) in points.iter().enumerate() {
        let sample = reference.as_ref().map(|r| r.at(0, flattened(field, p), &q));
        if sample.as_ref().is_some_and(|s| !s.regular) {
            continue;
        }
        ensure(bound.is_some() || same(value[i], all.value[i]), || {
            format!("F at {p:?}: {:e} beside a sparse row, {:e} beside a dense one", value[i], all.value[i])
        })?;
        if let Some(s) = &sample {
            for a in 0..d {
                let (given, expected) = (gradient[i][a], all.gradient[i * d + a]);
                let slack = 32.0 * s.operations as f64 * f64::EPSILON * s.gradient_size[a] + left_out;
                ensure((given - expected).abs() <= slack, || {
                    format!(
                        "dF/dx{a} at {p:?}: {given:e} beside a sparse row, {expected:e} beside a dense one"
                    )
                })?;
            }
        }
        for k in 0..m {
            let (given, expected) = (dense[i * m + k], all.q[i * m + k]);
            let slack = match (&sample, exact) {
                (_, true) | (None, _) => 0.0,
                (Some(s), _) => 32.0 * s.operations as f64 * f64::EPSILON * s.parameter_sizes[free[k]],
            } + left_out;
            ensure(same(given, expected) || (given - expected).abs() <= slack, || {
                format!("dF/dq{k} at {p:?}: {given:e} in a sparse row, {expected:e} in a dense one")
            })?;
            count += 1;
        }
    }
    Ok(count)
}
