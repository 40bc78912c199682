//! The fast sum agrees with the tape, and its boxes hold the surface.

use super::{Recipe, Sum};
use crate::{Aabb, Field, Surface, text};

/// Deterministic numbers in [0, 1).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// `count` Gaussian atoms in a cube of the given side.
fn atoms(count: usize, side: f64) -> Field {
    let mut u = numbers();
    let mut formula = String::from("gaussians(1, 2");
    for _ in 0..count {
        for _ in 0..3 {
            formula += &format!(", {}", side * (u() - 0.5));
        }
        formula += &format!(", {}", 0.8 + 0.4 * u());
    }
    field(&(formula + ")"))
}

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).expect("a formula")).expect("a model")
}

fn sum(field: &Field) -> Option<Sum> {
    Recipe::of(field.tape(0))?.sum(field.tape(0), field.uniforms(0))
}

fn cloud(count: usize, side: f64) -> Vec<[f64; 3]> {
    let mut u = numbers();
    (0..count).map(|_| [0; 3].map(|_| side * (u() - 0.5))).collect()
}

/// Largest difference between the fast sum and the tape, of F and its first and second derivatives.
fn difference(field: &Field, points: &[[f64; 3]]) -> f64 {
    let sum = sum(field).expect("a sum of bumps");
    let n = points.len();
    let (mut v, mut g, mut h) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[0.0; 6]; n]);
    sum.value_gradient(points, &mut v, &mut g).expect("arrays that fit");
    sum.hessian(points, &mut h).expect("arrays that fit");
    let (mut tv, mut tg, mut th) = (v.clone(), vec![0.0; 3 * n], vec![0.0; 9 * n]);
    // With rates of parameters it is the tape that is evaluated.
    let (still, mut rate) = (vec![0.0; field.free().len()], tv.clone());
    field
        .gradient_and_rate(points.as_flattened(), &still, &mut tv, &mut tg, &mut rate)
        .expect("arrays that fit");
    Field::hessian(field, points.as_flattened(), &mut th).expect("arrays that fit");
    let mut most = 0f64;
    for i in 0..n {
        most = most.max((v[i] - tv[i]).abs());
        for a in 0..3 {
            most = most.max((g[i][a] - tg[3 * i + a]).abs());
        }
        for (k, at) in [0, 1, 2, 4, 5, 8].into_iter().enumerate() {
            most = most.max((h[i][k] - th[9 * i + at]).abs());
        }
    }
    most
}

#[test]
fn values_of_many_bumps_do_not_depend_on_the_points_beside_them() {
    let field = atoms(300, 12.0);
    let mut points = cloud(700, 16.0);
    points.extend([[f64::NAN, 0.0, 0.0], [1e300; 3], [f64::INFINITY, 0.0, 0.0]]);
    let n = points.len();
    let (mut v, mut g) = (vec![0.0; n], vec![0.0; 3 * n]);
    let mut plain = vec![0.0; n];
    field.value(points.as_flattened(), &mut plain).expect("arrays that fit");
    field.gradient(points.as_flattened(), &mut v, &mut g).expect("arrays that fit");
    let (still, mut rate) = (vec![0.0; field.free().len()], vec![0.0; n]);
    let (mut tv, mut tg) = (vec![0.0; n], vec![0.0; 3 * n]);
    field
        .gradient_and_rate(points.as_flattened(), &still, &mut tv, &mut tg, &mut rate)
        .expect("arrays that fit");
    for i in 0..n {
        let (mut one, mut slope) = ([0.0], [0.0; 3]);
        field.gradient(&points[i], &mut one, &mut slope).expect("arrays that fit");
        assert_eq!(
            [one[0], slope[0], slope[1], slope[2]].map(f64::to_bits),
            [v[i], g[3 * i], g[3 * i + 1], g[3 * i + 2]].map(f64::to_bits)
        );
        assert_eq!(plain[i].to_bits(), v[i].to_bits());
        assert_eq!(v[i].is_nan(), tv[i].is_nan(), "{:?}", points[i]);
        if i < 700 {
            assert!(
                (v[i] - tv[i]).abs() < 1e-12 && (0..3).all(|a| (g[3 * i + a] - tg[3 * i + a]).abs() < 1e-12)
            );
        }
    }
}

#[test]
fn agrees_with_the_tape_near_and_far_and_in_any_order() {
    let field = atoms(300, 12.0);
    assert!(difference(&field, &cloud(500, 14.0)) < 1e-12);
    let mut sorted = cloud(2000, 12.0);
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(difference(&field, &sorted) < 1e-12);
    assert!(difference(&field, &[[1e3, 0.0, 0.0], [0.0; 3]]) < 1e-12);
}

#[test]
fn formulas_are_recognised_however_they_are_written() {
    let bumps = "exp(-((x-1)^2+y^2+(2*0+z)^2)) + exp(1-(x^2+(1+y)^2+z^2)/0.5)";
    for formula in [
        format!("0.5 - ({bumps} + exp(-(x*x) - y*y - 3*z*z) + 2*exp(-(1-x)^2-(y-1)^2-(z-1)^2))"),
        format!("-({bumps}) + 0.5 - exp(-x^2-y^2-z^2)/3 - exp(-(x^2+y^2+(z-2)^2)*0.7)"),
        "translate(blobs(0.4, 0,0,0,1, 1,0,0,1, 0,1,0,1, 0,0,1,.8), .3, .2, .1)".to_string(),
    ] {
        let field = field(&formula);
        assert!(difference(&field, &cloud(200, 4.0)) < 1e-12, "{formula}");
    }
}

#[test]
fn other_formulas_are_not_taken_for_sums() {
    let four =
        |e: &str| format!("1 - {e} - exp(-x^2-y^2-z^2) - exp(-(x-1)^2-y^2-z^2) - exp(-x^2-(y-1)^2-z^2)");
    assert!(sum(&field(&four("exp(-x^2-y^2-2*z^2)"))).is_some());
    for e in [
        "exp(x^2+y^2+z^2)",
        "exp(-x^2-y^2)",
        "exp(-x^2-y^2-z^2-x)",
        "exp(-x^2-y^2-z^2)*x",
        "exp(-x^2-y^2-(z-x)^2)",
        "sin(x)",
        "max(0, exp(-x^2-y^2-2*z^2))",
    ] {
        assert!(sum(&field(&four(e))).is_none(), "{e}");
    }
}

#[test]
fn the_boxes_hold_every_change_of_sign() {
    let field = atoms(60, 6.0);
    let sum = sum(&field).expect("a sum of bumps");
    let bounds = Aabb::new([-6.0; 3], [6.0; 3]);
    let cells = sum.cells(&bounds, 0.4, 100_000).expect("sums have intervals");
    assert!(cells.side <= 0.4 && cells.boxes.len() < 20_000, "{} boxes of {}", cells.boxes.len(), cells.side);
    let value = |p: [f64; 3]| {
        let mut v = [0.0];
        field.value(&p, &mut v).expect("arrays that fit");
        v[0]
    };
    let mut crossings = 0;
    for p in cloud(300, 8.0) {
        let line = |t: f64| [p[0], p[1], -6.0 + 12.0 * t];
        for k in 0..200 {
            let (mut a, mut b) = (k as f64 / 200.0, (k + 1) as f64 / 200.0);
            let inside = value(line(a)) < 0.0;
            if inside == (value(line(b)) < 0.0) {
                continue;
            }
            for _ in 0..40 {
                let m = 0.5 * (a + b);
                if (value(line(m)) < 0.0) == inside { a = m } else { b = m }
            }
            crossings += 1;
            assert!(cells.boxes.iter().any(|c| c.grown(1e-9).contains(line(a))), "{:?}", line(a));
        }
    }
    assert!(crossings > 100, "{crossings}");
}

#[test]
fn moving_a_parameter_moves_the_sum() {
    let mut field = atoms(20, 3.0);
    let points = cloud(50, 4.0);
    let (mut before, mut after) = (vec![0.0; 50], vec![0.0; 50]);
    let mut g = vec![[0.0; 3]; 50];
    Surface::value_gradient(&field, &points, &mut before, &mut g).expect("arrays that fit");
    field.set_value(0, 1.5).expect("a value for iso");
    Surface::value_gradient(&field, &points, &mut after, &mut g).expect("arrays that fit");
    assert!(before.iter().zip(&after).all(|(b, a)| (a - b - 0.5).abs() < 1e-12));
}

#[test]
fn what_is_no_number_stays_so() {
    let sum = sum(&atoms(20, 3.0)).expect("a sum of bumps");
    let (mut v, mut g) = ([0.0; 2], [[0.0; 3]; 2]);
    sum.value_gradient(&[[f64::NAN, 0.0, 0.0], [1e9, 0.0, 0.0]], &mut v, &mut g).expect("arrays that fit");
    assert!(v[0].is_nan() && v[1] == 1.0 && g[1] == [0.0; 3]);
}

#[test]
fn a_sketch_moves_the_surface_by_no_more_than_it_may() {
    let field = atoms(400, 10.0);
    let whole = sum(&field).expect("a sum of bumps");
    let points = cloud(3000, 11.0);
    let of = |s: &dyn Surface| {
        let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        s.value_gradient(&points, &mut v, &mut g).expect("arrays that fit");
        (v, g)
    };
    let (value, gradient) = of(&whole);
    for error in [1e-2, 1e-4] {
        let sketch = Surface::sketch(&field, error).expect("sums have sketches");
        let off = of(sketch.as_ref()).0;
        let mut most = 0f64;
        for i in 0..points.len() {
            let slope = gradient[i].iter().map(|g| g * g).sum::<f64>().sqrt();
            // Near the surface, and where it is regular.
            if value[i].abs() < 0.5 && slope > 0.1 {
                most = most.max((off[i] - value[i]).abs() / slope);
            }
        }
        assert!(most <= error && most > 1e-3 * error, "{most} for {error}");
    }
}

#[test]
fn a_sketch_is_as_good_as_it_promises() {
    for scale in [1e-9, 1.0, 1e12] {
        let mut u = numbers();
        let mut formula = String::from("gaussians(1, 2");
        for _ in 0..300 {
            formula += &format!(
                ", {:e}, {:e}",
                12.0 * scale * (u() - 0.5),
                12.0 * scale * (u() - 0.5) + 1e3 * scale
            );
            formula += &format!(", {:e}, {:e}", 12.0 * scale * (u() - 0.5), scale * (0.8 + 0.4 * u()));
        }
        let field = field(&(formula + ")"));
        let mut points = cloud(3000, 14.0);
        points.iter_mut().for_each(|p| *p = [p[0] * scale, (p[1] + 1e3) * scale, p[2] * scale]);
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let n = points.len();
        let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
        Surface::value_gradient(&field, &points, &mut v, &mut g).expect("arrays that fit");
        for error in [1e-3, 1e-5, 1e-9] {
            let sketch = field.sketch(error * scale).expect("a sum of bumps");
            let (mut sv, mut sg) = (v.clone(), g.clone());
            sketch.value_gradient(&points, &mut sv, &mut sg).expect("arrays that fit");
            let mut seen = 0;
            // Close to the surface, which is where it counts, and where the surface is no saddle about to split.
            let length = |g: [f64; 3]| g.iter().map(|c| c * c).sum::<f64>().sqrt();
            for i in (0..n).filter(|&i| v[i].abs() < 0.5 && length(g[i]) * scale > 1.0) {
                let off = (v[i] - sv[i]).abs() / length(g[i]);
                assert!(off <= error * scale, "{off:e} of {error:e} at scale {scale:e}");
                let turn = length([0, 1, 2].map(|a| g[i][a] - sg[i][a]));
                assert!(turn <= 10.0 * error * length(g[i]), "{turn:e} of {error:e} at scale {scale:e}");
                seen += 1;
            }
            assert!(seen > 100, "{seen}");
        }
    }
    let few = atoms(30, 4.0);
    let nowhere = few.sketch(1e-3).expect("a sum of bumps");
    let (mut v, mut g) = ([0.0; 2], [[0.0; 3]; 2]);
    nowhere
        .value_gradient(&[[f64::NAN, 0.0, 0.0], [1e9, 0.0, 0.0]], &mut v, &mut g)
        .expect("arrays that fit");
    assert!(v[0].is_nan() && v[1] == 1.0 && g[1] == [0.0; 3], "{v:?} {g:?}");
}
