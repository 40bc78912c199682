//! Witkin and Heckbert, SIGGRAPH '94: what the paper says of its floaters, as far as it can be measured.

mod surfaces;

use isoswarm_field::Aabb;
use isoswarm_particles::floaters::{Floaters, Happened, Parameters};
use isoswarm_particles::metrics::evenness;
use isoswarm_particles::{Amount, Method, Options, sample};
use surfaces::*;

/// One floater on a sphere of diameter `d`, σ̂ = .05 d: the swarm after so many steps, and what the last twenty did.
fn grow(d: f64, steps: usize, seed: u64) -> (Floaters, Happened) {
    let f = sphere([0.0; 3], 0.5 * d);
    let bounds = cube_bounds(0.6 * d);
    let parameters = Parameters::new(d, 0.05 * d);
    let mut floaters = Floaters::new(&[[0.3 * d, 0.4 * d, 0.0]], 0.05 * d);
    let (mut late, mut count) = (Happened::default(), 0);
    for k in 0..steps {
        let h = floaters.step(&f, &bounds, &[], &parameters, seed, &mut count).unwrap();
        if k + 20 >= steps {
            late.births += h.births;
            late.deaths += h.deaths;
        }
    }
    (floaters, late)
}

#[test]
fn one_floater_covers_the_sphere_in_a_hundred_steps() {
    for seed in 0..4 {
        let (floaters, _) = grow(1.0, 100, seed);
        assert!((418..=441).contains(&floaters.len()), "{} floaters after 100 steps", floaters.len());
        let (floaters, late) = grow(1.0, 300, seed);
        assert!((418..=441).contains(&floaters.len()), "{} floaters", floaters.len());
        assert_eq!(late, Happened::default(), "quiet in the end");
        let e = evenness(&floaters.points, &floaters.normals, None, 3);
        assert!(e.cv <= 0.036, "CV {}", e.cv);
    }
}

#[test]
fn the_run_is_the_same_at_every_scale() {
    let (one, _) = grow(1.0, 150, 3);
    for d in [0.01, 100.0] {
        let (other, _) = grow(d, 150, 3);
        let ratio = other.len() as f64 / one.len() as f64;
        assert!((ratio - 1.0).abs() < 0.03, "{} and {} floaters", one.len(), other.len());
        let mean = |f: &Floaters, d: f64| f.sigma.iter().sum::<f64>() / f.len() as f64 / d;
        assert!((mean(&other, d) / mean(&one, 1.0) - 1.0).abs() < 0.01);
    }
    // At a power of two nothing is rounded differently.
    let (twice, _) = grow(2.0, 150, 3);
    assert_eq!(twice.len(), one.len());
    for (p, q) in one.points.iter().zip(&twice.points) {
        assert_eq!(p.map(|v| 2.0 * v), *q);
    }
}

#[test]
fn identities_are_never_used_twice() {
    let (floaters, _) = grow(1.0, 200, 1);
    let mut ids = floaters.id.clone();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), floaters.len());
}

#[test]
fn without_repulsion_floaters_ride_along_and_do_not_drift() {
    // The sphere moves along x at unit speed: F = |x - t| - 1/2, so (∂F/∂q)·q̇ = -n_x. A lone floater moves by the
    // normal part only (section 4: as little as possible).
    let parameters = Parameters { adaptive: false, ..Parameters::new(1.0, 0.05) };
    let bounds = Aabb::new([-1.0; 3], [3.0; 3]);
    let mut floaters = Floaters::new(&[[0.0, 0.5, 0.0]], 0.05);
    let mut count = 0;
    for k in 0..100 {
        let t = 0.03 * f64::from(k) * 0.1;
        let f = sphere([t, 0.0, 0.0], 0.5);
        let normal = f.at(floaters.points[0]).1;
        floaters.step(&f, &bounds, &[-0.1 * normal[0]], &parameters, 0, &mut count).unwrap();
    }
    let (t, p) = (0.3, floaters.points[0]);
    let off = ((p[0] - t).powi(2) + p[1] * p[1] + p[2] * p[2]).sqrt() - 0.5;
    assert!(off.abs() < 5e-3, "{off}");
    // Moving only along the normal, y' = -v n_x n_y and x' = v n_x², the floater falls behind: it slips back over the
    // sphere instead of being carried along.
    assert!(p[0] < 0.1 && p[0] > -0.05, "{p:?}");
}

#[test]
fn floaters_rest_where_the_gradient_vanishes() {
    let parameters = Parameters::new(2.0, 0.1);
    let mut floaters = Floaters::new(&[[0.0; 3], [0.5, 0.0, 0.5]], 0.1);
    let mut count = 0;
    for _ in 0..30 {
        floaters.step(&cone(), &cube_bounds(1.0), &[], &parameters, 0, &mut count).unwrap();
        assert!(floaters.points.iter().flatten().all(|v| v.is_finite()));
    }
}

#[test]
fn the_three_schemes_can_be_compared() {
    let f = sphere([0.0; 3], 1.0);
    let run = |method| {
        sample(&f, &cube_bounds(1.2), Options { amount: Amount::Count(1000), method, ..Options::default() })
            .unwrap()
    };
    let simple = run(Method::Simple);
    assert_eq!(simple.points.len(), 1000);
    assert!(simple.report.evenness.cv <= 0.05, "{:?}", simple.report.evenness);
    let fissioning = run(Method::Fissioning);
    assert_eq!(fissioning.points.len(), 1024, "a power of two");
    assert!(fissioning.report.evenness.cv <= 0.05, "{:?}", fissioning.report.evenness);
    let adaptive = run(Method::Adaptive);
    assert!((850..1150).contains(&adaptive.points.len()), "{}", adaptive.points.len());
    assert!(adaptive.report.evenness.cv <= 0.05, "{:?}", adaptive.report.evenness);
    // And the default method is the most even of all.
    let even = run(Method::Even);
    for other in [&simple, &fissioning, &adaptive] {
        assert!(even.report.evenness.rho_avg > other.report.evenness.rho_avg);
    }
}

#[test]
fn no_more_floaters_than_are_allowed() {
    // Radii that are far too large for σ̂: every floater wants to split at once, again and again.
    let (surface, bounds) = (sphere([0.0; 3], 1.0), cube_bounds(1.2));
    let grown = |most: usize| {
        let parameters = Parameters { most, ..Parameters::live(2.0, 0.02) };
        let mut floaters = Floaters::new(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 0.3);
        for _ in 0..60 {
            floaters.step(&surface, &bounds, &[], &parameters, 0, &mut 0).unwrap();
            assert!(floaters.len() <= most);
        }
        floaters.len()
    };
    assert!(grown(100_000) > 200);
    assert_eq!(grown(50), 50);
}
