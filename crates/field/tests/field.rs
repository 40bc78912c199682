//! Known answers: subgradients, parameters, shapes of arrays, several components, curves in the plane.

use isoswarm_field::testkit::{
    evaluators_agree, gradient_differences, hessian_differences, rates_agree, scattered,
};
use isoswarm_field::{Field, FieldError, Model, Surface, text};

fn with(text: &str, parameters: &[(&str, f64)]) -> Field {
    Field::new(&text::parse(text, parameters).unwrap_or_else(|e| panic!("{text}: {e}"))).unwrap()
}

fn field(text: &str) -> Field {
    with(text, &[])
}

/// F, ∂F/∂x and the Hessian at a point.
fn at(f: &Field, p: &[f64]) -> (f64, Vec<f64>, Vec<f64>) {
    let d = f.axes();
    let (mut v, mut g, mut h) = ([0.0], vec![0.0; d], vec![0.0; d * d]);
    f.gradient(p, &mut v, &mut g).unwrap();
    f.hessian(p, &mut h).unwrap();
    (v[0], g, h)
}

#[test]
fn subgradients_at_kinks_are_defined() {
    let zero = [0.0; 9];
    for (text, p, value, gradient) in [
        ("abs(x) + y", [0.0, 2.0, 0.0], 2.0, [0.0, 1.0, 0.0]),
        ("abs(x) + y", [-3.0, 2.0, 0.0], 5.0, [-1.0, 1.0, 0.0]),
        ("min(x, 3*y)", [3.0, 1.0, 0.0], 3.0, [0.5, 1.5, 0.0]),
        ("max(x, 3*y)", [3.0, 1.0, 0.0], 3.0, [0.5, 1.5, 0.0]),
        ("max(x, 3*y)", [4.0, 1.0, 0.0], 4.0, [1.0, 0.0, 0.0]),
        ("min(x, 2)", [2.0, 0.0, 0.0], 2.0, [0.5, 0.0, 0.0]),
        ("max(2, x)", [2.0, 0.0, 0.0], 2.0, [0.5, 0.0, 0.0]),
        ("sqrt(x) + z", [0.0, 0.0, 1.0], 1.0, [0.0, 0.0, 1.0]),
        ("hypot(x, y, z)", [0.0; 3], 0.0, [0.0; 3]),
        ("floor(x) + ceil(y) + round(z)", [1.0, 1.0, 0.5], 3.0, [0.0; 3]),
        ("where(x < 1, 5*x, 7*x)", [1.0, 0.0, 0.0], 7.0, [7.0, 0.0, 0.0]),
        ("mod(x, 2)", [4.0, 0.0, 0.0], 0.0, [1.0, 0.0, 0.0]),
    ] {
        let (v, g, h) = at(&field(text), &p);
        assert_eq!((v, g.as_slice(), h.as_slice()), (value, &gradient[..], &zero[..]), "{text} at {p:?}");
    }
    // Three-fold ties: the mean of the pairs' means.
    let (_, g, _) = at(&field("max(max(x, y), z)"), &[1.0; 3]);
    assert_eq!(g, [0.25, 0.25, 0.5]);
}

#[test]
fn known_derivatives() {
    let (v, g, h) = at(&field("x^3*y + exp(y*z) + sin(x)/z"), &[0.5, -1.0, 2.0]);
    let (x, y, z) = (0.5f64, -1.0f64, 2.0f64);
    let e = (y * z).exp();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-14 * (1.0 + b.abs());
    assert!(close(v, x.powi(3) * y + e + x.sin() / z));
    let gradient = [3.0 * x * x * y + x.cos() / z, x.powi(3) + z * e, y * e - x.sin() / (z * z)];
    assert!(g.iter().zip(gradient).all(|(a, b)| close(*a, b)), "{g:?} {gradient:?}");
    let xy = 3.0 * x * x;
    let xz = -x.cos() / (z * z);
    let yz = e + y * z * e;
    let hessian = [
        [6.0 * x * y - x.sin() / z, xy, xz],
        [xy, z * z * e, yz],
        [xz, yz, y * y * e + 2.0 * x.sin() / z.powi(3)],
    ];
    assert!(h.iter().zip(hessian.as_flattened()).all(|(a, b)| close(*a, *b)), "{h:?} {hessian:?}");
}

#[test]
fn nan_and_infinity_in() {
    for text in ["x + y*z", "torus()", "gyroid()", "box(1, 1, 1) | sphere()", "max(x, min(y, z))"] {
        let f = field(text);
        let (v, _, _) = at(&f, &[f64::NAN, 1.0, 1.0]);
        assert!(v.is_nan(), "{text} of NaN is {v}");
        for p in [[f64::INFINITY, 1.0, 1.0], [1.0, f64::NEG_INFINITY, 0.0], [f64::MAX, f64::MAX, -f64::MAX]] {
            at(&f, &p);
        }
    }
    assert_eq!(at(&field("x - y"), &[f64::INFINITY, 1.0, 0.0]).0, f64::INFINITY);
    assert!(at(&field("ln(x)"), &[-1.0, 0.0, 0.0]).0.is_nan());
}

#[test]
fn several_components() {
    let f = with("stack(x^2 + y - a, z*b - x, sin(y))", &[("a", 2.0), ("b", 3.0)]);
    assert_eq!((f.components(), f.axes(), f.free().len()), (3, 3, 2));
    let (mut v, mut g, mut q) = ([0.0; 6], [0.0; 18], [0.0; 12]);
    let points = [1.0, 2.0, 3.0, -1.0, 0.0, 0.5];
    f.parameter_gradient(&points, &mut v, &mut g, &mut q).unwrap();
    assert_eq!(v[..2], [1.0, 8.0]);
    assert_eq!(v[3..5], [-1.0, 2.5]);
    assert_eq!(g[..6], [2.0, 1.0, 0.0, -1.0, 0.0, 3.0]);
    assert_eq!(q[..6], [-1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    assert_eq!(q[6..], [-1.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
    let cloud = scattered(150, 2.0, 51);
    for check in [evaluators_agree, rates_agree, gradient_differences, hessian_differences] {
        assert!(check(&f, &cloud).unwrap() > 300);
    }
    let e = Surface::value_gradient(&f, &[[0.0; 3]], &mut [0.0], &mut [[0.0; 3]]).unwrap_err().to_string();
    assert!(e.contains("this field has 3"), "{e}");
    assert_eq!(f.interval(&[0.0; 3], &[1.0; 3]).unwrap().len(), 3);
    assert_eq!(f.interval_gradient(&[0.0; 3], &[1.0; 3]).unwrap().len(), 9);
    assert_eq!(f.interval_hessian(&[0.0; 3], &[1.0; 3]).unwrap().len(), 27);
}

#[test]
fn curves_in_the_plane() {
    let f = field("planar(x^2 + 4*y^2 + x*y - 1)");
    assert_eq!((f.axes(), Surface::axes(&f)), (2, 2));
    let (v, g, h) = at(&f, &[0.5, 1.0]);
    assert_eq!((v, g, h), (3.75, vec![2.0, 8.5], vec![2.0, 1.0, 1.0, 8.0]));
    let (mut v, mut g, mut h) = ([0.0], [[9.0; 3]], [[9.0; 6]]);
    Surface::value_gradient(&f, &[[0.5, 1.0, 0.0]], &mut v, &mut g).unwrap();
    Surface::hessian(&f, &[[0.5, 1.0, 0.0]], &mut h).unwrap();
    assert_eq!((v[0], g[0], h[0]), (3.75, [2.0, 8.5, 0.0], [2.0, 1.0, 0.0, 8.0, 0.0, 0.0]));
    let cloud: Vec<[f64; 3]> = scattered(99, 2.0, 52).iter().map(|p| [p[0], p[1], 0.0]).collect();
    for check in [evaluators_agree, rates_agree, gradient_differences, hessian_differences] {
        check(&f, &cloud).unwrap();
    }
    let bounds = f.bounds().expect("an ellipse is compact");
    assert_eq!((bounds.lo[2], bounds.hi[2]), (0.0, 0.0));
    assert!(bounds.contains([1.0, 0.0, 0.0]) && bounds.diagonal() < 4.0, "{bounds:?}");
    assert!(f.value(&[1.0; 3], &mut [0.0]).is_err(), "three numbers are no points of the plane");
}

#[test]
fn frozen_parameters_are_left_out_of_q() {
    let mut f = with("a*x + b*y + c*z", &[("a", 1.0), ("b", 2.0), ("c", 3.0)]);
    assert_eq!(f.q(), [1.0, 2.0, 3.0]);
    let b = f.parameter("b").unwrap();
    f.set_frozen(b, true);
    assert_eq!((f.q(), f.free()), (vec![1.0, 3.0], vec![0, 2]));
    let (mut v, mut g, mut q, mut rate) = ([0.0], [0.0; 3], [0.0; 2], [0.0]);
    f.parameter_gradient(&[5.0, 6.0, 7.0], &mut v, &mut g, &mut q).unwrap();
    assert_eq!((v[0], q), (38.0, [5.0, 7.0]));
    f.gradient_and_rate(&[5.0, 6.0, 7.0], &[1.0, -1.0], &mut v, &mut g, &mut rate).unwrap();
    assert_eq!(rate, [-2.0]);
    f.set_q(&[10.0, 30.0]).unwrap();
    assert_eq!(f.parameters().iter().map(|p| p.value).collect::<Vec<_>>(), [10.0, 2.0, 30.0]);
    f.set_value(b, 20.0).unwrap();
    f.set_frozen(b, false);
    assert_eq!(f.q(), [10.0, 20.0, 30.0]);
    f.value(&[1.0; 3], &mut v).unwrap();
    assert_eq!(v, [60.0]);
    for i in 0..3 {
        f.set_frozen(i, true);
    }
    f.parameter_gradient(&[1.0; 3], &mut v, &mut g, &mut []).unwrap();
    f.gradient_and_rate(&[1.0; 3], &[], &mut v, &mut g, &mut rate).unwrap();
    assert_eq!((v, g, rate), ([60.0], [10.0, 20.0, 30.0], [0.0]));
}

#[test]
fn values_that_a_parameter_may_not_have_are_refused_and_change_nothing() {
    let mut f = field("sphere(1) | twist(torus(1, 0.25), 0.5)");
    let before = f.q();
    let r = f.parameter("sphere/r").unwrap();
    for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        let e = f.set_value(r, bad).unwrap_err().to_string();
        assert!(
            e.contains("`sphere/r` must be finite and above 0") && e.contains(&format!("given {bad}")),
            "{e}"
        );
        let mut q = before.clone();
        q[0] = 2.0;
        let at = f.free().iter().position(|&i| i == r).unwrap();
        q[at] = bad;
        assert!(f.set_q(&q).is_err());
        assert_eq!(f.q(), before, "an error leaves all values as they were");
    }
    let axis = f.parameters().iter().position(|p| p.discrete).unwrap();
    assert!(f.set_value(axis, 1.0).unwrap_err().to_string().contains("discrete"));
    assert!(matches!(f.set_q(&[1.0]), Err(FieldError::Shape { what: "q", .. })));
    let e = f.parameter("sphere/radius").unwrap_err().to_string();
    assert!(e.contains("no parameter is called `sphere/radius`") && e.contains("sphere/r"), "{e}");
}

#[test]
fn arrays_of_the_wrong_shape_are_refused() {
    let f = with("a*x", &[("a", 1.0)]);
    let (mut one, mut three) = ([0.0], [0.0; 3]);
    let shape = |r: Result<(), FieldError>| assert!(matches!(r, Err(FieldError::Shape { .. })), "{r:?}");
    shape(f.value(&[0.0; 4], &mut one));
    shape(f.value(&[0.0; 6], &mut one));
    shape(f.gradient(&[0.0; 3], &mut one, &mut [0.0; 2]));
    shape(f.gradient(&[0.0; 3], &mut [0.0; 2], &mut three));
    shape(f.hessian(&[0.0; 3], &mut [0.0; 6]));
    shape(f.parameter_gradient(&[0.0; 3], &mut one, &mut three, &mut [0.0; 2]));
    shape(f.gradient_and_rate(&[0.0; 3], &[1.0, 2.0], &mut one, &mut three, &mut [0.0]));
    shape(f.gradient_and_rate(&[0.0; 3], &[1.0], &mut one, &mut three, &mut [0.0; 2]));
    f.value(&[], &mut []).unwrap();
    f.gradient(&[], &mut [], &mut []).unwrap();
    f.hessian(&[], &mut []).unwrap();
    f.parameter_gradient(&[], &mut [], &mut [], &mut []).unwrap();
}

#[test]
fn a_parameter_without_effect_has_derivative_zero() {
    let f = with("a*x + min(b*z, b*z + 1)*0 + c*0", &[("a", 2.0), ("b", 3.0), ("c", 4.0)]);
    let (mut v, mut g, mut q) = ([0.0], [0.0; 3], [7.0; 3]);
    f.parameter_gradient(&[5.0, 6.0, 7.0], &mut v, &mut g, &mut q).unwrap();
    assert_eq!((v, q), ([10.0], [5.0, 0.0, 0.0]), "whatever stood in the array before");
}

#[test]
fn constants_and_bare_coordinates_are_fields_too() {
    let (v, g, h) = at(&field("3"), &[1.0, 2.0, 3.0]);
    assert_eq!((v, g, h), (3.0, vec![0.0; 3], vec![0.0; 9]));
    let (v, g, _) = at(&field("y"), &[1.0, 2.0, 3.0]);
    assert_eq!((v, g), (2.0, vec![0.0, 1.0, 0.0]));
    let f = Field::new(&Model::parameter("a", 4.0).unwrap()).unwrap();
    let (mut v, mut g, mut q) = ([0.0], [1.0; 3], [0.0]);
    f.parameter_gradient(&[1.0, 2.0, 3.0], &mut v, &mut g, &mut q).unwrap();
    assert_eq!((v, g, q), ([4.0], [0.0; 3], [1.0]));
}
