//! Evaluators against each other.

use super::{All, Failure, Outcome, Reference, ensure, packed, same, same_rows, some_rates};
use crate::{Field, Surface};

/// Values from every evaluator, gradients from every evaluator, and both against the slow reference: values and
/// gradients agree to the last bit, with the reference's gradients within the rounding errors of another order.
pub fn evaluators_agree(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, q_dot) = (packed(field, points), some_rates(field));
    let (k, d, m) = (field.components(), field.axes(), q_dot.len());
    let n = points.len();
    let all = All::of(field, &flat, &q_dot)?;
    let (mut value, mut gradient) = (vec![f64::NAN; n * k], vec![f64::NAN; n * k * d]);
    field.value(&flat, &mut value)?;
    let mut count = same_rows("value() against parameter_gradient()", &value, &all.value)?;
    field.gradient(&flat, &mut value, &mut gradient)?;
    count += same_rows("value of gradient() against parameter_gradient()", &value, &all.value)?;
    count += same_rows("gradient() against parameter_gradient()", &gradient, &all.gradient)?;
    let mut rate = vec![f64::NAN; n * k];
    field.gradient_and_rate(&flat, &q_dot, &mut value, &mut gradient, &mut rate)?;
    count += same_rows("value of gradient_and_rate()", &value, &all.value)?;
    count += same_rows("gradient of gradient_and_rate()", &gradient, &all.gradient)?;
    if k == 1 {
        count += as_surface(field, points, &all)?;
    }
    let Some(reference) = Reference::new(field)? else { return Ok(count) };
    let q: Vec<f64> = field.parameters().iter().map(|p| p.value).collect();
    let free = field.free();
    for (i, &p) in points.iter().enumerate() {
        for c in 0..k {
            let s = reference.at(c, flattened(field, p), &q);
            let (at, here) = (i * k + c, || format!("component {c} at {p:?}"));
            ensure(same(s.value, all.value[at]), || {
                format!("{}: F is {:e}, the reference has {:e}", here(), all.value[at], s.value)
            })?;
            count += 1;
            if !s.regular {
                continue;
            }
            let slack = 16.0 * s.operations as f64 * f64::EPSILON;
            for a in 0..d {
                let given = all.gradient[at * d + a];
                ensure((given - s.gradient[a]).abs() <= slack * s.gradient_size[a], || {
                    format!("{}: dF/dx{a} is {given:e}, the reference has {:e}", here(), s.gradient[a])
                })?;
            }
            for (column, &j) in free.iter().enumerate() {
                let given = all.q[at * m + column];
                ensure((given - s.parameters[j]).abs() <= slack * s.parameter_sizes[j], || {
                    format!("{}: dF/dq{column} is {given:e}, the reference has {:e}", here(), s.parameters[j])
                })?;
            }
            count += d + m;
        }
    }
    Ok(count)
}

/// The point as the model sees it: in the plane z is 0.
pub(super) fn flattened(field: &Field, p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| if a < field.axes() { p[a] } else { 0.0 })
}

/// What [`Surface`] answers against the field's own answers.
fn as_surface(field: &Field, points: &[[f64; 3]], all: &All) -> Outcome {
    let (n, d) = (points.len(), field.axes());
    let surface: &dyn Surface = field;
    let (mut value, mut gradient) = (vec![f64::NAN; n], vec![[f64::NAN; 3]; n]);
    surface.value_gradient(points, &mut value, &mut gradient)?;
    let mut count = same_rows("value of the surface", &value, &all.value)?;
    let mut hessian = vec![[f64::NAN; 6]; n];
    surface.hessian(points, &mut hessian)?;
    for i in 0..n {
        for a in 0..3 {
            let expected = if a < d { all.gradient[i * d + a] } else { 0.0 };
            ensure(same(gradient[i][a], expected), || {
                format!("gradient of the surface at {:?}: {:?}", points[i], gradient[i])
            })?;
        }
        for (slot, (a, b)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            let expected = if b < d { all.hessian[(i * d + a) * d + b] } else { 0.0 };
            ensure(same(hessian[i][slot], expected), || {
                format!("Hessian of the surface at {:?}: {:?}", points[i], hessian[i])
            })?;
        }
        count += 9;
    }
    Ok(count)
}

/// (∂F/∂q)·q̇ in one direction against all of ∂F/∂q times q̇.
pub fn rates_agree(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let q_dot = some_rates(field);
    let (k, m) = (field.components(), q_dot.len());
    let all = All::of(field, &packed(field, points), &q_dot)?;
    let Some(reference) = Reference::new(field)? else { return Ok(0) };
    let (q, free) = (field.parameters().iter().map(|p| p.value).collect::<Vec<_>>(), field.free());
    let mut count = 0;
    for (i, &p) in points.iter().enumerate() {
        for c in 0..k {
            let s = reference.at(c, flattened(field, p), &q);
            if !s.regular {
                continue;
            }
            let row = &all.q[(i * k + c) * m..][..m];
            let product: f64 = row.iter().zip(&q_dot).map(|(g, r)| g * r).sum();
            let size: f64 = free.iter().zip(&q_dot).map(|(&j, r)| s.parameter_sizes[j] * r.abs()).sum();
            let (given, slack) =
                (all.rate[i * k + c], 32.0 * (s.operations + m) as f64 * f64::EPSILON * size);
            ensure((given - product).abs() <= slack, || {
                format!(
                    "component {c} at {p:?}: the rate is {given:e}, the parameter gradient gives {product:e}"
                )
            })?;
            count += 1;
        }
    }
    Ok(count)
}

/// Points one by one, and in batches of 15 and 67, against all at once, to the last bit.
pub fn batches_agree(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, q_dot) = (packed(field, points), some_rates(field));
    let all = All::of(field, &flat, &q_dot)?;
    let mut count = 0;
    for size in [1, 15, 67] {
        let mut parts = All::default();
        for part in flat.chunks(size * field.axes()) {
            let one = All::of(field, part, &q_dot)?;
            parts.value.extend(one.value);
            parts.gradient.extend(one.gradient);
            parts.q.extend(one.q);
            parts.rate.extend(one.rate);
            parts.hessian.extend(one.hessian);
        }
        count += all.same(&parts, &format!("all points against {size} at a time"))?;
    }
    Ok(count)
}

/// The same bits from 1, 2, 3 and 5 threads.
pub fn threads_agree(field: &Field, points: &[[f64; 3]]) -> Outcome {
    let (flat, q_dot) = (packed(field, points), some_rates(field));
    let mut count = 0;
    let mut first: Option<All> = None;
    for threads in [1, 2, 3, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| Failure(e.to_string()))?;
        let all = pool.install(|| All::of(field, &flat, &q_dot))?;
        match &first {
            Some(one) => count += one.same(&all, &format!("1 thread against {threads}"))?,
            None => first = Some(all),
        }
    }
    Ok(count)
}
