//! Opaque leaves with parameters of their own: F(x, q), differentiated with respect to q.

use std::sync::{Arc, Mutex};
use std::thread::ThreadId;

use isoswarm_field::model::{Param, Payload, kind};
use isoswarm_field::testkit::{leaves_agree, scattered, threads_agree};
use isoswarm_field::{Callback, Field, FieldError, Model, json, text};

use super::{call, uses};

/// x² + y² + z² + k sin(c z) − r², with parameters of its own; it notes the values that it is called with.
#[derive(Default)]
struct Wavy {
    exact: bool,
    /// The number of the call that fails, counted from 1.
    fails: Option<usize>,
    calls: Mutex<Vec<(ThreadId, usize, Vec<f64>)>>,
    exact_calls: Mutex<usize>,
}

const WAVY: &str = "x^2 + y^2 + z^2 + k*sin(c*z) - r^2";
const VALUES: [(&str, f64); 3] = [("k", 0.3), ("c", 2.5), ("r", 1.25)];

impl Wavy {
    fn new(exact: bool) -> Arc<Wavy> {
        Arc::new(Wavy { exact, ..Default::default() })
    }

    /// (points, values of the parameters) of each call since the last look.
    fn calls(&self) -> Vec<(usize, Vec<f64>)> {
        let me = std::thread::current().id();
        let calls = std::mem::take(&mut *self.calls.lock().unwrap());
        calls
            .into_iter()
            .map(|(thread, n, q)| {
                assert_eq!(thread, me, "called on another thread");
                (n, q)
            })
            .collect()
    }
}

impl Callback for Wavy {
    fn name(&self) -> &str {
        "wavy"
    }

    fn parameters(&self) -> Vec<Param> {
        VALUES.map(|(name, value)| Param::new(name, value)).to_vec()
    }

    fn value(&self, points: &[[f64; 3]], q: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        let mut calls = self.calls.lock().unwrap();
        calls.push((std::thread::current().id(), points.len(), q.to_vec()));
        if self.fails == Some(calls.len()) {
            return Err(FieldError::Callback { name: "wavy".into(), reason: "out of cheese".into() });
        }
        for (v, [x, y, z]) in value.iter_mut().zip(points) {
            *v = x * x + y * y + z * z + q[0] * (q[1] * z).sin() - q[2] * q[2];
        }
        Ok(())
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        q: &[f64],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Option<Result<(), FieldError>> {
        for (g, [x, y, z]) in gradient.iter_mut().zip(points) {
            *g = [2.0 * x, 2.0 * y, 2.0 * z + q[0] * q[1] * (q[1] * z).cos()];
        }
        self.exact.then(|| self.value(points, q, value))
    }

    fn parameter_gradient(
        &self,
        points: &[[f64; 3]],
        q: &[f64],
        slopes: &mut [f64],
    ) -> Option<Result<(), FieldError>> {
        *self.exact_calls.lock().unwrap() += 1;
        for (row, p) in slopes.chunks_exact_mut(3).zip(points) {
            let (sin, cos) = (q[1] * p[2]).sin_cos();
            row.copy_from_slice(&[sin, q[0] * p[2] * cos, -2.0 * q[2]]);
        }
        self.exact.then_some(Ok(()))
    }
}

fn wavy_field(wavy: &Arc<Wavy>) -> Field {
    Field::new(&Model::function(wavy.clone()).unwrap()).unwrap()
}

/// ∂F/∂q, (n, m).
fn slopes(field: &Field, points: &[[f64; 3]]) -> Vec<f64> {
    derivatives(field, points).unwrap().2
}

type Answers = (Vec<f64>, Vec<f64>, Vec<f64>);

/// F, ∂F/∂x and ∂F/∂q.
fn derivatives(field: &Field, points: &[[f64; 3]]) -> Result<Answers, FieldError> {
    let (n, m) = (points.len(), field.free().len());
    let (mut v, mut g, mut q) = (vec![0.0; n], vec![0.0; 3 * n], vec![0.0; n * m]);
    field.parameter_gradient(points.as_flattened(), &mut v, &mut g, &mut q)?;
    Ok((v, g, q))
}

fn rate(field: &Field, points: &[[f64; 3]], q_dot: &[f64]) -> Vec<f64> {
    let n = points.len();
    let (mut v, mut g, mut rate) = (vec![0.0; n], vec![0.0; 3 * n], vec![0.0; n]);
    field.gradient_and_rate(points.as_flattened(), q_dot, &mut v, &mut g, &mut rate).unwrap();
    rate
}

#[test]
fn parameters_of_a_leaf_have_derivatives_as_those_of_a_formula() {
    let points = scattered(200, 1.2, 46);
    let formula = text::parse(WAVY, &VALUES).unwrap();
    let mut all = uses();
    all.push(("one of two components", |m| call("stack", &[&call("sphere", &[], &[0.7]), m], &[])));
    all.push(("in the plane", |m| call("planar", &[m], &[])));
    all.push(("at a place that its own values give", |m| {
        let mut params = call("translate", &[m], &[]).params().to_vec();
        params[0].expr = Some(call("mul", &[&Model::constant(0.1).unwrap(), m], &[]));
        Model::new(kind("translate").unwrap(), params, vec![m.clone()], Payload::None).unwrap()
    }));
    for (name, used) in all {
        let expected = Field::new(&used(&formula)).unwrap();
        for (exact, tolerance) in [(true, 1e-11), (false, 1e-7)] {
            let given = Field::new(&used(&Model::function(Wavy::new(exact)).unwrap())).unwrap();
            let n = leaves_agree(&given, &expected, &points, tolerance);
            assert!(n.unwrap_or_else(|e| panic!("{name}, exact {exact}: {e}")) > 200 * 10);
            threads_agree(&given, &points[..20]).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
}

#[test]
fn parameters_of_leaves_have_paths_and_change_like_all_others() {
    let two = call("union", &[&Model::function(Wavy::new(true)).unwrap(), &call("sphere", &[], &[])], &[]);
    let paths: Vec<String> = two.parameters().into_iter().map(|p| p.path).collect();
    assert_eq!(paths, ["function/k", "function/c", "function/r", "sphere/r"]);
    let other = two.with_value("function/r", 0.5).unwrap();
    let (mut before, mut after) = ([0.0], [0.0]);
    let mut field = Field::new(&two).unwrap();
    field.value(&[0.0, 0.0, 0.0], &mut before).unwrap();
    Field::new(&other).unwrap().value(&[0.0; 3], &mut after).unwrap();
    assert_eq!((before, after), ([-1.5625], [-1.0]));
    field.set_value(2, 2.0).unwrap();
    field.value(&[0.0; 3], &mut before).unwrap();
    assert_eq!(before, [-4.0]);
}

#[test]
fn only_free_parameters_are_asked_for_and_only_where_they_are_needed() {
    let points = scattered(3000, 1.2, 47);
    let (n, flat, q) = (points.len(), points.as_flattened(), VALUES.map(|v| v.1).to_vec());
    let wavy = Wavy::new(false);
    let mut field = wavy_field(&wavy);
    let (mut v, mut g) = (vec![0.0; n], vec![0.0; 3 * n]);
    field.value(flat, &mut v).unwrap();
    assert_eq!(wavy.calls(), [(n, q.clone())]);
    field.gradient(flat, &mut v, &mut g).unwrap();
    assert_eq!(wavy.calls(), [(7 * n, q.clone())]);
    field.set_frozen(1, true);
    slopes(&field, &points);
    let calls = wavy.calls();
    assert_eq!(calls.len(), 1 + 2 * 2, "one call a free parameter and sign");
    for (i, (count, at)) in calls.iter().enumerate().skip(1) {
        let changed: Vec<usize> = (0..3).filter(|&j| at[j] != q[j]).collect();
        assert_eq!((*count, changed), (n, vec![if i < 3 { 0 } else { 2 }]));
    }
    rate(&field, &points, &[1.0, -0.5]);
    assert_eq!(wavy.calls().len(), 1 + 2, "one directional difference for the rate");
    rate(&field, &points, &[0.0, 0.0]);
    assert_eq!(wavy.calls().len(), 1, "nothing moves");
    field.set_frozen(0, true);
    field.set_frozen(2, true);
    slopes(&field, &points);
    assert_eq!(wavy.calls().len(), 1, "nothing is free");
    let exact = Wavy::new(true);
    let mut field = wavy_field(&exact);
    slopes(&field, &points);
    rate(&field, &points, &[1.0, 0.0, 0.0]);
    assert_eq!((exact.calls().len(), *exact.exact_calls.lock().unwrap()), (2, 2));
    (0..3).for_each(|i| field.set_frozen(i, true));
    slopes(&field, &points);
    field.gradient(flat, &mut v, &mut g).unwrap();
    assert_eq!((exact.calls().len(), *exact.exact_calls.lock().unwrap()), (2, 2), "nothing is free");
}

#[test]
fn differences_stay_within_the_bounds() {
    let points = scattered(60, 1.2, 48);
    let expected = slopes(&Field::new(&text::parse(WAVY, &VALUES).unwrap()).unwrap(), &points);
    let (k, c, r) = (0.3, 2.5, 1.25);
    // At a bound, just beside one, between two that are nearer than a step, and in a corner.
    for bounds in [
        [(k, 9.0), (-9.0, c), (r, r + 1e-6)],
        [(k - 1e-7, 9.0), (-9.0, c + 1e-7), (r - 1e-7, r + 1e-6)],
        [(k - 1e-6, k), (c, c + 1.0), (0.0, r)],
    ] {
        let wavy = Wavy::new(false);
        let mut field = wavy_field(&wavy);
        for (i, (lo, hi)) in bounds.into_iter().enumerate() {
            field.set_bounds(i, lo, hi).unwrap();
        }
        let given = slopes(&field, &points);
        for (a, b) in expected.iter().zip(&given) {
            assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()), "{bounds:?}: {b} instead of {a}");
        }
        for q_dot in [[1.0, 0.7, 0.5], [1.0, -0.7, 0.5], [-1.0, -0.7, 0.5]] {
            for (row, b) in expected.chunks_exact(3).zip(rate(&field, &points, &q_dot)) {
                let a: f64 = row.iter().zip(&q_dot).map(|(g, r)| g * r).sum();
                assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()), "{bounds:?}, {q_dot:?}: {b} instead of {a}");
            }
        }
        for (_, q) in wavy.calls() {
            assert!(q.iter().zip(bounds).all(|(v, (lo, hi))| lo <= *v && *v <= hi), "called at {q:?}");
        }
    }
    // Without room nothing can be said, and nothing moves.
    let mut field = wavy_field(&Wavy::new(false));
    field.set_bounds(2, r, r).unwrap();
    let given = slopes(&field, &points);
    assert!(given.chunks_exact(3).all(|row| row[2] == 0.0 && row[1] != 0.0));
}

#[test]
fn steps_are_relative_to_the_value_and_to_the_scale() {
    // F = |p|² − r² has the derivative −2 r; sin(c z) that of a parameter far from 1.
    for (r, scale) in [(1e6, 1.0), (1e-6, 1.0), (0.0, 1.0), (0.0, 1e-9), (3e-9, 1e-9)] {
        let wavy = Wavy::new(false);
        let mut field = wavy_field(&wavy);
        field.set_value(2, r).unwrap();
        field.set_scale(2, scale).unwrap();
        let size = r.max(scale);
        let given = slopes(&field, &[[0.1 * size, 0.0, 0.0]]);
        assert!((given[2] + 2.0 * r).abs() <= 1e-9 * size, "r = {r}, scale {scale}: {}", given[2]);
        let steps: Vec<f64> = wavy.calls().iter().map(|c| (c.1[2] - r).abs()).filter(|h| *h > 0.0).collect();
        assert!(
            steps.len() == 2 && steps.iter().all(|h| (1e-7 * size..1e-3 * size).contains(h)),
            "{steps:?}"
        );
    }
}

#[test]
fn a_function_that_fails_at_any_call_leaves_the_field_as_it_was() {
    let points = scattered(20, 1.2, 49);
    let good = wavy_field(&Wavy::new(false));
    let expected = derivatives(&good, &points).unwrap();
    for call in 1..=7 {
        let wavy = Arc::new(Wavy { fails: Some(call), ..Default::default() });
        let field = wavy_field(&wavy);
        let message = derivatives(&field, &points).unwrap_err().to_string();
        assert_eq!(message, "wavy: out of cheese", "call {call}");
        assert_eq!(wavy.calls().len(), call, "no call after the one that failed");
        assert_eq!(field.parameters(), good.parameters());
        assert_eq!(wavy_field(&Wavy::new(false)).q(), field.q());
        // The next time it works, as nothing was left behind.
        wavy.calls.lock().unwrap().resize(call, (std::thread::current().id(), 0, vec![]));
        assert_eq!(derivatives(&field, &points).unwrap(), expected, "call {call}");
    }
}

#[test]
fn wrong_parameters_of_functions_are_refused_with_the_reason() {
    let function = |params: Vec<Param>| {
        let payload = Payload::Callback(Wavy::new(true));
        Model::new(kind("function").unwrap(), params, vec![], payload).map(|_| ())
    };
    let named = |names: &[&str]| names.iter().map(|n| Param::new(*n, 1.0)).collect::<Vec<_>>();
    let refused = |params: Vec<Param>, words: &str| {
        let message = function(params).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    };
    assert_eq!(function(named(&["k", "c", "r"])), Ok(()));
    refused(named(&["k", "c"]), "expected the parameters of `wavy` (k, c, r), given k, c");
    refused(named(&["k", "c", "radius"]), "given k, c, radius");
    refused(vec![], "given none");
    let mut wrong = named(&["k", "c", "r"]);
    wrong[1].value = f64::NAN;
    refused(wrong, "c must be finite");
    let mut wrong = named(&["k", "c", "r"]);
    wrong[2].bounds = (2.0, 3.0);
    refused(wrong, "r must be between 2 and 3, given 1");
    let mut wrong = named(&["k", "c", "r"]);
    wrong[2].expr = Some(Model::axis(0));
    refused(wrong, "r is given by an expression, but `wavy` takes numbers: give a number");
    let mut closed = named(&["k", "c", "r"]);
    closed[2].expr = Some(text::parse("2*pi", &[]).unwrap());
    assert_eq!(function(closed), Ok(()), "a formula without coordinates and parameters is a number");
    struct Twice;
    impl Callback for Twice {
        fn name(&self) -> &str {
            "twice"
        }
        fn parameters(&self) -> Vec<Param> {
            vec![Param::new("a", 1.0), Param::new("a", 2.0)]
        }
        fn value(&self, _: &[[f64; 3]], _: &[f64], _: &mut [f64]) -> Result<(), FieldError> {
            Ok(())
        }
    }
    let message = Model::function(Arc::new(Twice)).unwrap_err().to_string();
    assert_eq!(message, "function: `twice` has two parameters called a");
}

#[test]
fn files_keep_parameters_of_functions_by_name() {
    let wavy: Arc<dyn Callback> = Wavy::new(true);
    let functions = |name: &str| (name == "wavy").then(|| wavy.clone());
    let model = Model::function(wavy.clone()).unwrap().named("egg").unwrap();
    let model = model.with_value("egg/r", 0.75).unwrap().with_frozen("egg/c", true).unwrap();
    let model = model.with_bounds("egg/r", 0.5, 2.0).unwrap().with_scale("egg/k", 0.1).unwrap();
    let written = json::to_json(&model);
    let again = json::from_json_with(&written, &functions).unwrap();
    assert!(again == model, "{written}");
    assert_eq!(again.parameters(), model.parameters());
    let file = |params: &str| {
        format!(
            r#"{{"format":"isoswarm model","version":1,"nodes":[{{"kind":"function","function":"wavy","params":[{params}]}}]}}"#
        )
    };
    let read = |params: &str| json::from_json_with(&file(params), &functions);
    let other = r#"{"name":"r","value":3},{"name":"c","value":2},{"name":"k","value":1}"#;
    let values: Vec<f64> = read(other).unwrap().parameters().iter().map(|p| p.value).collect();
    assert_eq!(values, [1.0, 2.0, 3.0], "in any order");
    for (params, words) in [
        (r#"{"name":"r","value":3}"#, "expected the parameters of `wavy` (k, c, r), given r"),
        (r#"{"name":"r","value":3},{"name":"c","value":2},{"name":"q","value":1}"#, "given c, r, q"),
        (r#"{"name":"r","value":3},{"name":"c","value":2},{"name":"r","value":1}"#, "given c, r, r"),
        (r#"{"name":"r","expr":0},{"name":"c","value":2},{"name":"k","value":1}"#, "refers to node 0"),
    ] {
        let message = read(params).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
