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
