//! Opaque leaves: functions of the caller's.

mod parameters;

use std::sync::{Arc, Mutex};
use std::thread::ThreadId;

use isoswarm_field::model::{Value, kind};
use isoswarm_field::testkit::scattered;
use isoswarm_field::{Aabb, Callback, Field, FieldError, Interval, Model, Surface, text};

type Values = fn([f64; 3]) -> f64;
type Slopes = fn([f64; 3]) -> [f64; 3];

/// A function that notes who calls it.
struct Noted {
    value: Values,
    gradient: Option<Slopes>,
    bounds: Option<Aabb>,
    calls: Mutex<Vec<(ThreadId, usize)>>,
}

impl Noted {
    fn new(value: Values, gradient: Option<Slopes>) -> Arc<Noted> {
        Arc::new(Noted { value, gradient, bounds: None, calls: Mutex::default() })
    }

    fn calls(&self) -> Vec<(ThreadId, usize)> {
        std::mem::take(&mut self.calls.lock().unwrap())
    }
}

impl Callback for Noted {
    fn name(&self) -> &str {
        "noted"
    }

    fn value(&self, points: &[[f64; 3]], _: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        self.calls.lock().unwrap().push((std::thread::current().id(), points.len()));
        for (v, p) in value.iter_mut().zip(points) {
            *v = (self.value)(*p);
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
        let slopes = self.gradient?;
        for (g, p) in gradient.iter_mut().zip(points) {
            *g = slopes(*p);
        }
        Some(self.value(points, q, value))
    }

    fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }
}

/// x² + 2y² + 3z² + xy − 1, which the text below spells.
fn quadric(p: [f64; 3]) -> f64 {
    let [x, y, z] = p;
    x * x + 2.0 * y * y + 3.0 * z * z + x * y - 1.0
}

fn quadric_slopes([x, y, z]: [f64; 3]) -> [f64; 3] {
    [2.0 * x + y, 4.0 * y + x, 6.0 * z]
}

const QUADRIC: &str = "x^2 + 2*y^2 + 3*z^2 + x*y - 1";

fn call(name: &str, operands: &[&Model], numbers: &[f64]) -> Model {
    let mut args: Vec<Value> = operands.iter().map(|m| Value::Model((*m).clone())).collect();
    args.extend(numbers.iter().map(|n| Value::Number(*n)));
    Model::call(name, args, vec![]).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// What is done to a leaf: the same is done to the formula.
fn uses() -> Vec<(&'static str, fn(&Model) -> Model)> {
    vec![
        ("alone", |m| m.clone()),
        ("translated", |m| call("translate", &[m], &[0.3, -0.2, 0.5])),
        ("scaled", |m| call("scale", &[m], &[1.7])),
        ("twisted", |m| call("twist", &[m], &[0.8])),
        ("deformed by deformations", |m| call("bend", &[&call("twist", &[m], &[0.6])], &[0.3])),
        ("united with itself", |m| call("smooth_union", &[m, &call("translate", &[m], &[1.0])], &[0.4])),
        ("squared", |m| call("square", &[m], &[])),
    ]
}

/// F, its gradient, ∂F/∂q and the Hessian.
fn everything(f: &Field, points: &[[f64; 3]]) -> [Vec<f64>; 4] {
    let (n, k, m) = (points.len(), f.components(), f.free().len());
    let flat = points.as_flattened();
    let (mut v, mut g, mut q) = (vec![0.0; n * k], vec![0.0; n * k * 3], vec![0.0; n * k * m]);
    f.parameter_gradient(flat, &mut v, &mut g, &mut q).unwrap();
    let mut h = vec![0.0; n * k * 9];
    f.hessian(flat, &mut h).unwrap();
    [v, g, q, h]
}

#[test]
fn leaves_answer_as_the_formula_does() {
    let points = scattered(200, 1.2, 41);
    let formula = text::parse(QUADRIC, &[]).unwrap();
    for (name, used) in uses() {
        let expected = everything(&Field::new(&used(&formula)).unwrap(), &points);
        for gradient in [Some(quadric_slopes as Slopes), None] {
            let leaf = Model::function(Noted::new(quadric, gradient)).unwrap();
            let given = everything(&Field::new(&used(&leaf)).unwrap(), &points);
            let exact = gradient.is_some();
            // The Hessian is numerical in any case.
            for (i, tolerance) in [(0, 1e-13), (1, if exact { 1e-12 } else { 1e-8 }), (3, 1e-3)] {
                for (a, b) in expected[i].iter().zip(&given[i]) {
                    assert!(
                        (a - b).abs() <= tolerance * (1.0 + a.abs()),
                        "{name}, gradient {exact}, answer {i}: {b} instead of {a}"
                    );
                }
            }
        }
    }
}

#[test]
fn two_leaves_one_of_them_at_coordinates_that_the_other_gives() {
    // g(x + f(x, y, z), y, z) with f = x²/4 and g the quadric.
    let inner: Values = |p| 0.25 * p[0] * p[0];
    let inner_slopes: Slopes = |p| [0.5 * p[0], 0.0, 0.0];
    let points = scattered(100, 1.0, 42);
    let x = Model::axis(0);
    let nested = |f: &Model, g: &Model| {
        let mut params = call("translate", &[g], &[]).params().to_vec();
        // translate by −f: the operand sees x + f.
        params[0].expr = Some(call("neg", &[f], &[]));
        Model::new(kind("translate").unwrap(), params, vec![g.clone()], isoswarm_field::model::Payload::None)
            .unwrap()
    };
    let squared = call("mul", &[&Model::constant(0.25).unwrap(), &call("square", &[&x], &[])], &[]);
    let expected =
        everything(&Field::new(&nested(&squared, &text::parse(QUADRIC, &[]).unwrap())).unwrap(), &points);
    for gradients in [true, false] {
        let f = Noted::new(inner, gradients.then_some(inner_slopes));
        let g = Noted::new(quadric, gradients.then_some(quadric_slopes as Slopes));
        let field =
            Field::new(&nested(&Model::function(f.clone()).unwrap(), &Model::function(g.clone()).unwrap()))
                .unwrap();
        let given = everything(&field, &points);
        for (i, tolerance) in [(0, 1e-13), (1, if gradients { 1e-12 } else { 1e-7 })] {
            for (a, b) in expected[i].iter().zip(&given[i]) {
                assert!(
                    (a - b).abs() <= tolerance * (1.0 + a.abs()),
                    "gradients {gradients}: {b} instead of {a}"
                );
            }
        }
        f.calls();
        let mut v = vec![0.0; 100];
        field.value(points.as_flattened(), &mut v).unwrap();
        assert_eq!(f.calls().len(), 1, "one call although the other leaf needs it too");
    }
}

#[test]
fn one_call_for_all_points_on_the_calling_thread() {
    let points = scattered(5000, 1.0, 43);
    let me = std::thread::current().id();
    for gradient in [Some(quadric_slopes as Slopes), None] {
        let noted = Noted::new(quadric, gradient);
        let model = call(
            "union",
            &[&Model::function(noted.clone()).unwrap(), &text::parse("sphere(0.5)", &[]).unwrap()],
            &[],
        );
        let field = Field::new(&model).unwrap();
        let n = points.len();
        let (mut v, mut g) = (vec![0.0; n], vec![0.0; 3 * n]);
        field.value(points.as_flattened(), &mut v).unwrap();
        assert_eq!(noted.calls(), [(me, n)]);
        let batch = if gradient.is_some() { n } else { 7 * n };
        field.gradient(points.as_flattened(), &mut v, &mut g).unwrap();
        assert_eq!(noted.calls(), [(me, batch)]);
        let mut q = vec![0.0; n * field.free().len()];
        field.parameter_gradient(points.as_flattened(), &mut v, &mut g, &mut q).unwrap();
        assert_eq!(noted.calls(), [(me, batch)]);
        let (q_dot, mut rate) = (vec![1.0; field.free().len()], vec![0.0; n]);
        field.gradient_and_rate(points.as_flattened(), &q_dot, &mut v, &mut g, &mut rate).unwrap();
        assert_eq!(noted.calls(), [(me, batch)]);
        let mut hessian = vec![0.0; 9 * n];
        field.hessian(points.as_flattened(), &mut hessian).unwrap();
        let calls = noted.calls();
        assert!(calls.len() == 6 && calls.iter().all(|c| *c == (me, batch)), "{calls:?}");
    }
}

#[test]
fn the_function_s_own_message_comes_back() {
    struct Broken;
    impl Callback for Broken {
        fn name(&self) -> &str {
            "broken"
        }
        fn value(&self, _: &[[f64; 3]], _: &[f64], _: &mut [f64]) -> Result<(), FieldError> {
            Err(FieldError::Callback { name: "broken".into(), reason: "out of cheese".into() })
        }
    }
    let field =
        Field::new(&call("translate", &[&Model::function(Arc::new(Broken)).unwrap()], &[1.0])).unwrap();
    let (mut v, mut g, mut h) = ([0.0], [0.0; 3], [0.0; 9]);
    for result in [
        field.value(&[0.0; 3], &mut v),
        field.gradient(&[0.0; 3], &mut v, &mut g),
        field.hessian(&[0.0; 3], &mut h),
    ] {
        assert_eq!(result.unwrap_err().to_string(), "broken: out of cheese");
    }
}

#[test]
fn nan_passes_through_where_it_belongs() {
    let partly: Values = |p| if p[0] > 0.0 { f64::NAN } else { p[0] + p[1] };
    let model = Model::function(Noted::new(partly, Some(|_| [1.0, 1.0, 0.0]))).unwrap();
    let field = Field::new(&call("add", &[&model, &Model::axis(2)], &[])).unwrap();
    let (mut v, mut g) = ([0.0; 3], [0.0; 9]);
    field.gradient(&[-1.0, 2.0, 3.0, 1.0, 2.0, 3.0, -2.0, 0.0, f64::NAN], &mut v, &mut g).unwrap();
    assert_eq!((v[0], &g[..3]), (4.0, &[1.0, 1.0, 1.0][..]));
    assert!(v[1].is_nan() && v[2].is_nan());
}

#[test]
fn opaque_fields_have_no_intervals_and_say_so() {
    let mut noted = Noted::new(quadric, None);
    let field = Field::new(&Model::function(noted.clone()).unwrap().named("mine").unwrap()).unwrap();
    assert!(field.is_opaque());
    let message = field.interval(&[0.0; 3], &[1.0; 3]).unwrap_err().to_string();
    assert!(message.contains("`mine` is an opaque function"), "{message}");
    assert!(field.cells(&Aabb::new([-1.0; 3], [1.0; 3]), 0.1, 100).is_none());
    assert!(Surface::narrowed(&field, &[[0.0; 3]], 0.1).unwrap().is_none());
    let spans: Option<&[Interval]> = None;
    assert!(field.narrowed_for(&[[0.0; 3]], 0.1, spans, Default::default()).is_err());
    assert_eq!(field.bounds(), None);
    let around = Aabb::new([-2.0; 3], [2.0; 3]);
    drop(field);
    Arc::get_mut(&mut noted).expect("no other owner").bounds = Some(around);
    let f = Model::function(noted).unwrap();
    let bounds = |m: &Model| Field::new(m).unwrap().bounds();
    assert_eq!(bounds(&f), Some(around));
    // Operators take the box along, and what they cannot take along they do not know.
    let moved = bounds(&call("translate", &[&f], &[10.0, 0.0, -1.0])).unwrap();
    assert!((0..3).all(|a| moved.lo[a] == around.lo[a] + [10.0, 0.0, -1.0][a]), "{moved:?}");
    let twice = bounds(&call("scale", &[&f], &[2.0])).unwrap();
    assert!((0..3).all(|a| twice.hi[a] == 2.0 * around.hi[a]), "{twice:?}");
    let far = call("translate", &[&text::parse("sphere(1)", &[]).unwrap()], &[-7.0, 0.0, 0.0]);
    let both = bounds(&call("union", &[&f, &far], &[])).unwrap();
    assert!(both.lo[0] <= -8.0 && both.hi[0] == around.hi[0], "{both:?}");
    assert_eq!(bounds(&call("twist", &[&f], &[1.0])), None);
}

#[test]
fn parameters_around_a_leaf_have_derivatives() {
    // a·f(x) + b, and f scaled by s: F_s from the chain rule through the leaf's coordinates.
    let leaf = Model::function(Noted::new(quadric, Some(quadric_slopes))).unwrap();
    let (a, b) = (Model::parameter("a", 1.5).unwrap(), Model::parameter("b", -0.25).unwrap());
    let linear = call("add", &[&call("mul", &[&a, &leaf], &[]), &b], &[]);
    let field = Field::new(&linear).unwrap();
    let points = scattered(50, 1.0, 44);
    let [_, _, q, _] = everything(&field, &points);
    for (p, row) in points.iter().zip(q.chunks_exact(2)) {
        assert!((row[0] - quadric(*p)).abs() < 1e-14 && row[1] == 1.0, "{row:?}");
    }
}

#[test]
fn parameters_inside_a_leaf_s_coordinates_have_derivatives() {
    let points = scattered(50, 1.0, 45);
    let formula = text::parse(QUADRIC, &[]).unwrap();
    for (name, used) in uses().into_iter().skip(1).take(4) {
        let expected = everything(&Field::new(&used(&formula)).unwrap(), &points);
        let leaf = Model::function(Noted::new(quadric, Some(quadric_slopes))).unwrap();
        let given = everything(&Field::new(&used(&leaf)).unwrap(), &points);
        let model = used(&Model::function(Noted::new(quadric, Some(quadric_slopes))).unwrap());
        let field = Field::new(&model).unwrap();
        let m = field.free().len();
        let q_dot: Vec<f64> = (0..m).map(|i| 1.0 - 0.3 * i as f64).collect();
        let (mut v, mut g, mut rate) = (vec![0.0; 50], vec![0.0; 150], vec![0.0; 50]);
        field.gradient_and_rate(points.as_flattened(), &q_dot, &mut v, &mut g, &mut rate).unwrap();
        for (i, row) in expected[2].chunks_exact(m).enumerate() {
            for (a, b) in row.iter().zip(&given[2][i * m..]) {
                assert!((a - b).abs() <= 1e-9 * (1.0 + a.abs()), "{name}: dF/dq is {b} instead of {a}");
            }
            let product: f64 = row.iter().zip(&q_dot).map(|(g, r)| g * r).sum();
            assert!((rate[i] - product).abs() <= 1e-9 * (1.0 + product.abs()), "{name}: rate {}", rate[i]);
        }
    }
}
