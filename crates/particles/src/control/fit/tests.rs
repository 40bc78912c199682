//! Fits with known results.

use isoswarm_field::{Field, text};

use super::*;

pub(super) fn field(formula: &str, parameters: &[(&str, f64)]) -> Field {
    Field::new(&text::parse(formula, parameters).unwrap()).unwrap()
}

/// n points on the unit sphere.
pub(super) fn sphere(n: usize) -> Vec<[f64; 3]> {
    let rng = crate::rng::Rng::new(3, crate::rng::Stream::Jitter);
    (0..n as u64).map(|i| rng.direction(i, 3)).collect()
}

#[test]
fn a_ball_is_found() {
    let mut ball =
        field("(x-a)^2 + (y-b)^2 + (z-c)^2 - r^2", &[("a", 0.0), ("b", 0.0), ("c", 0.0), ("r", 1.0)]);
    let points: Vec<[f64; 3]> =
        sphere(50).iter().map(|p| [2.0 * p[0] + 3.0, 2.0 * p[1] - 1.0, 2.0 * p[2] + 0.5]).collect();
    let fit = fit(&mut ball, &points, FitOptions::default()).unwrap();
    assert!(fit.status.is_converged(), "{fit:?}");
    assert!(fit.largest < 1e-14 * 7.0, "{fit:?}");
    assert_eq!((fit.rank, fit.freedom), (4, 4));
    let q = ball.q();
    for (v, e) in q.iter().zip([3.0, -1.0, 0.5, 2.0]) {
        // r enters squared.
        assert!((v.abs() - f64::abs(e)).abs() < 1e-13, "{q:?}");
    }
}

/// Points on an ellipsoid with half axes 1, 1.5 and 0.8 about (0.3, 0, −0.2).
fn ellipsoid(n: usize) -> Vec<[f64; 3]> {
    sphere(n).iter().map(|p| [p[0] + 0.3, 1.5 * p[1], 0.8 * p[2] - 0.2]).collect()
}

fn conic() -> Field {
    field("quadric()", &[])
}

#[test]
fn a_multiple_of_f_is_the_same_surface() {
    // Ten coefficients, nine that matter; a frozen normaliser would shrink F to nothing.
    let mut f = conic();
    let fit = fit(&mut f, &ellipsoid(80), FitOptions::default()).unwrap();
    assert!(fit.status.is_converged() && fit.largest < 1e-11, "{fit:?}");
    assert_eq!((fit.rank, fit.freedom), (9, 10));
    let q = f.q();
    let size = q.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    assert!(size > 0.3 && size < 10.0, "{q:?}");
    assert!(
        (q[4] / q[6] - 1.5f64.powi(2)).abs() < 1e-10 && (q[9] / q[4] - 0.8f64.powi(-2)).abs() < 1e-10,
        "{q:?}"
    );
}

#[test]
fn distances_are_those_of_geometry() {
    // The circle that is nearest in distance to two concentric ones lies between them, whatever F's values do.
    let mut points = Vec::new();
    for p in sphere(200) {
        points.push(p.map(|v| 0.99 * v));
        points.push(p.map(|v| 1.01 * v));
    }
    for formula in ["sqrt(x^2 + y^2 + z^2) - r", "exp(3*(sqrt(x^2 + y^2 + z^2) - r)) - 1"] {
        let mut f = field(formula, &[("r", 0.7)]);
        let fit = fit(&mut f, &points, FitOptions::default()).unwrap();
        assert!(fit.status.is_converged(), "{formula}: {fit:?}");
        // exp bends: its estimate of the distance is right to first order only.
        let bound = if formula.starts_with("sqrt") { 1e-9 } else { 1e-3 };
        assert!((f.q()[0] - 1.0).abs() < bound, "{formula}: {:?}", f.q());
        assert!((fit.rms - 0.01).abs() < 0.5 * bound, "{formula}: {fit:?}");
    }
}

#[test]
fn outliers_pull_less_with_a_robust_loss() {
    let mut points = sphere(100);
    points.extend(sphere(10).iter().map(|p| [p[0].abs() + 3.0, p[1], p[2]]));
    let off = |loss| {
        let mut f = field("sqrt((x-a)^2 + y^2 + z^2) - r", &[("a", 0.2), ("r", 1.3)]);
        let fit = fit(&mut f, &points, FitOptions { loss, ..FitOptions::default() }).unwrap();
        assert!(fit.status.is_converged(), "{loss:?} {fit:?}");
        f.q()[0].abs() + (f.q()[1] - 1.0).abs()
    };
    let squares = off(Loss::Squares);
    assert!(squares > 0.3, "{squares}");
    assert!(off(Loss::Huber(0.05)) < 0.1 * squares);
    assert!(off(Loss::SoftL1(0.05)) < 0.1 * squares);
    assert!(off(Loss::Cauchy(0.05)) < 0.01 * squares);
}

#[test]
fn units_do_not_matter() {
    let points = ellipsoid(60);
    let run = |unit: f64| {
        let formula = format!("((x - a)/2)^2 + ((y - b*{unit:?})/c)^2 + (z/d)^2 - 1");
        let mut f = field(&formula, &[("a", 0.0), ("b", 0.2 / unit), ("c", 1.2), ("d", 1.0)]);
        let fit = fit(&mut f, &points, FitOptions::default()).unwrap();
        (f.q(), fit)
    };
    let ((one, a), (other, b)) = (run(1.0), run(1024.0));
    assert_eq!(a.iterations, b.iterations);
    assert_eq!((one[0], one[1], one[2]), (other[0], 1024.0 * other[1], other[2]));
    assert_eq!(a.rms, b.rms);
}

#[test]
fn limits_are_kept_and_told() {
    let mut m = text::parse("sqrt((x-a)^2 + y^2 + z^2) - r", &[("a", 0.5), ("r", 0.6)]).unwrap();
    m = m.edit("r", |p| p.bounds = (0.1, 0.8)).unwrap();
    let mut f = Field::new(&m).unwrap();
    let fit = fit(&mut f, &sphere(60), FitOptions::default()).unwrap();
    assert!(fit.status.is_converged(), "{fit:?}");
    assert_eq!((f.q()[1], fit.at_limit), (0.8, vec![1]));
    assert!(f.q()[0].abs() < 0.1);
}

#[test]
fn few_points_move_as_little_as_they_must() {
    // One point, three parameters, of which one has no effect: it keeps its bits.
    let mut f = field("x - a - b*y + 0*c", &[("a", 0.0), ("b", 0.0), ("c", 0.123)]);
    let fit = fit(&mut f, &[[1.0, 2.0, 0.0]], FitOptions::default()).unwrap();
    assert_eq!(fit.rank, 1);
    let q = f.q();
    assert!((q[0] + 2.0 * q[1] - 1.0).abs() < 1e-12, "{q:?}");
    // Each by its effect: both do half.
    assert!((q[0] - 0.5).abs() < 1e-6 && (q[1] - 0.25).abs() < 1e-6 && q[2] == 0.123, "{q:?}");
}

#[test]
fn points_without_a_gradient_are_left_out_and_counted() {
    let mut points = sphere(40);
    points.push([0.0; 3]);
    let weights: Vec<f64> = (0..41).map(|i| if i == 0 { 0.0 } else { 1.0 }).collect();
    let mut f = field("x^2 + y^2 + z^2 - r", &[("r", 2.0)]);
    let options = FitOptions { weights: Some(&weights), ..FitOptions::default() };
    let fit = fit(&mut f, &points, options).unwrap();
    assert_eq!(fit.skipped, 2);
    assert!(fit.residuals[0].is_nan() && fit.residuals[40].is_nan());
    assert!((f.q()[0] - 1.0).abs() < 1e-13);
}

#[test]
fn points_of_which_none_counts_are_refused() {
    let mut f = field("x^2 + y^2 + z^2 - r", &[("r", 2.0)]);
    let mut refused = |points: &[[f64; 3]], weights: Option<&[f64]>, words: &str| {
        let options = FitOptions { weights, ..FitOptions::default() };
        let e = fit(&mut f, points, options).unwrap_err().to_string();
        assert!(e.contains(words) && e.contains("none can be used"), "{e}");
        assert_eq!(f.q(), [2.0]);
    };
    refused(&[[0.0; 3]; 5], None, "5 where the gradient of F vanishes");
    refused(&sphere(4), Some(&[0.0; 4]), "4 with the weight 0");
    refused(&[[0.0; 3], [1.0; 3]], Some(&[1.0, 0.0]), "1 with the weight 0, 1 where");
}

#[test]
fn mistakes_are_named_and_leave_the_surface_alone() {
    let mut f = field("ln(x) - a", &[("a", 0.25)]);
    let refused = |f: &mut Field, points: &[[f64; 3]], options: FitOptions<'_>, words: &str| {
        let e = fit(f, points, options).unwrap_err().to_string();
        assert!(e.contains(words), "{e}");
        assert_eq!(f.q(), [0.25]);
    };
    let fine = [[1.0, 0.0, 0.0]];
    refused(&mut f, &[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], FitOptions::default(), "not at point 1");
    refused(&mut f, &[], FitOptions::default(), "one point or more");
    refused(&mut f, &[[f64::NAN, 0.0, 0.0]], FitOptions::default(), "finite coordinates");
    refused(&mut f, &fine, FitOptions { weights: Some(&[-1.0]), ..Default::default() }, "0 or more");
    refused(&mut f, &fine, FitOptions { values: Some(&[]), ..Default::default() }, "a number for each point");
    refused(&mut f, &fine, FitOptions { loss: Loss::Huber(0.0), ..Default::default() }, "above 0");
}

#[test]
fn a_fit_can_be_watched_and_ended() {
    let mut seen = Vec::new();
    let mut watch = |p: &FitProgress| {
        seen.push(p.rms);
        if p.iteration == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut f = conic();
    let result =
        fit(&mut f, &ellipsoid(80), FitOptions { progress: Some(&mut watch), ..Default::default() }).unwrap();
    assert_eq!((result.status, result.iterations), (FitStatus::Cancelled, 2));
    assert!(seen.len() == 3 && seen[2] < seen[0] && result.rms == seen[2], "{seen:?}");
    let mut stiff = field("x - 1 + 0*a", &[("a", 3.0)]);
    let result = fit(&mut stiff, &[[0.0; 3]], FitOptions::default()).unwrap();
    assert_eq!((result.status, result.rank), (FitStatus::NothingMoves, 0));
}

#[test]
fn threads_do_not_change_a_bit() {
    let blobs: Vec<String> =
        (0..40).map(|i| format!("{}, {}, {}, 0.4", (i % 4), (i / 4) % 4, i / 16)).collect();
    let formula = format!("blobs(0.5, {})", blobs.join(", "));
    let points: Vec<[f64; 3]> = sphere(600).iter().map(|p| p.map(|v| 2.0 * v + 1.5)).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut f = field(&formula, &[]);
        pool.install(|| fit(&mut f, &points, FitOptions { iterations: 4, ..Default::default() })).unwrap();
        f.q()
    };
    assert_eq!(run(1), run(3));
}
