//! `sample` on analytic surfaces: what it promises, measured by independent means.

mod surfaces;

use std::f64::consts::PI;
use std::ops::ControlFlow;

use isoswarm_field::{Aabb, Field, Surface, text};
use isoswarm_particles::{Amount, Density, Error, Method, Options, Samples, Status, Stop, places, sample};
use surfaces::*;

fn count<'a>(n: usize) -> Options<'a> {
    Options { amount: Amount::Count(n), ..Options::default() }
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt()
}

/// Distances to the nearest other point, by all pairs.
fn nearest(points: &[[f64; 3]]) -> Vec<f64> {
    let other = |i: usize| (0..points.len()).filter(move |&j| j != i);
    (0..points.len())
        .map(|i| other(i).map(|j| distance(points[i], points[j])).fold(f64::INFINITY, f64::min))
        .collect()
}

fn mean(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

/// The promises that hold for every result.
fn check(s: &Samples, f: &Analytic, bounds: &Aabb, n: usize) {
    assert_eq!(s.points.len(), n);
    for v in [s.normals.len(), s.radii.len(), s.areas.len(), s.curvatures.len(), s.component.len()] {
        assert_eq!(v, n);
    }
    let diameter = Aabb::around(&s.points).unwrap().diagonal();
    for (p, normal) in s.points.iter().zip(&s.normals) {
        assert!(bounds.grown(1e-12 * diameter).contains(*p), "{p:?} left {bounds:?}");
        let (v, g) = f.at(*p);
        let l = distance(g, [0.0; 3]);
        assert!(v.abs() <= 1e-12 * diameter * l, "{p:?} is off by {}", v / l);
        let unit = distance(*normal, g.map(|c| c / l));
        assert!(unit < 1e-12, "normal {normal:?} at {p:?}");
    }
    let most = nearest(&s.points).into_iter().fold(f64::INFINITY, f64::min);
    assert!(most > 0.0, "two samples on one spot");
}

/// Reached on all four; the goal is .80, .92, .04 and .75.
fn is_even(s: &Samples, name: &str) {
    let e = &s.report.evenness;
    assert!(e.rho_min >= 0.82, "{name}: rho_min {}", e.rho_min);
    assert!(e.rho_avg >= 0.945, "{name}: rho_avg {}", e.rho_avg);
    assert!(e.cv <= 0.03, "{name}: CV {}", e.cv);
    assert!(e.six_valent >= 0.88, "{name}: six-valent {}", e.six_valent);
}

#[test]
fn the_four_surfaces_are_sampled_evenly() {
    let tests: [(&str, Analytic, Aabb, Option<f64>); 4] = [
        ("sphere", sphere([0.0; 3], 1.0), cube_bounds(1.25), Some(4.0 * PI)),
        ("torus", torus(1.0, 0.4), cube_bounds(1.5), Some(4.0 * PI * PI * 0.4)),
        ("blobs", sixteen(), cube_bounds(2.0), None),
        ("gyroid", gyroid(1.0), cube_bounds(PI), Some(122.0533)),
    ];
    for (name, f, bounds, area) in &tests {
        for seed in [0, 1] {
            let s = sample(f, bounds, Options { seed, ..count(5000) }).unwrap();
            check(&s, f, bounds, 5000);
            is_even(&s, name);
            assert_eq!(s.report.status, Status::Converged, "{name}");
            assert_eq!(s.report.components, 1, "{name}");
            if let Some(area) = area {
                assert!((s.report.area / area - 1.0).abs() < 2e-3, "{name}: area {}", s.report.area);
            }
        }
    }
}

#[test]
fn the_measures_agree_with_all_pairs() {
    let f = sphere([0.0; 3], 1.0);
    let s = sample(&f, &cube_bounds(1.2), count(2000)).unwrap();
    let d = nearest(&s.points);
    let hexagonal = (2.0 * 4.0 * PI / 2000.0 / 3f64.sqrt()).sqrt();
    let e = &s.report.evenness;
    assert!((mean(&d) / hexagonal / e.rho_avg - 1.0).abs() < 2e-3);
    let least = d.iter().fold(f64::INFINITY, |m, v| m.min(*v));
    assert!((least / hexagonal / e.rho_min - 1.0).abs() < 2e-3);
    assert!((mean(&d) / s.report.spacing - 1.0).abs() < 1e-12);
    let again = isoswarm_particles::metrics::evenness(&s.points, &s.normals, None, 3);
    assert!((again.rho_avg / e.rho_avg - 1.0).abs() < 1e-6 && (again.six_valent - e.six_valent).abs() < 5e-3);
    assert!((s.areas.iter().sum::<f64>() - s.report.area).abs() < 1e-9);
    assert!(s.curvatures.iter().all(|k| (k[0] - 1.0).abs() < 1e-4 && (k[1] - 1.0).abs() < 1e-4));
}

#[test]
fn spacing_is_met_within_one_percent() {
    for (f, bounds) in [(torus(1.0, 0.4), cube_bounds(1.5)), (sixteen(), cube_bounds(2.0))] {
        for spacing in [0.15, 0.04] {
            let s = sample(&f, &bounds, Options { amount: Amount::Spacing(spacing), ..Options::default() })
                .unwrap();
            let found = mean(&nearest(&s.points));
            assert!((found / spacing - 1.0).abs() < 0.01, "{found} for {spacing}");
            assert_eq!(s.report.status, Status::Converged);
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads_but_on_the_seed() {
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sample(&sixteen(), &cube_bounds(2.0), Options { seed, ..count(3000) }).unwrap())
    };
    let one = run(1, 5);
    assert!(one == run(3, 5), "bits differ between one thread and three");
    assert!(one.points != run(1, 6).points, "the seed has no effect");
}

#[test]
fn scale_and_place_do_not_matter() {
    for (scale, at) in [(1e-6, [0.0; 3]), (1e6, [0.0; 3]), (1.0, [7.0, -5.0, 3.0])] {
        let f = Analytic::new(move |p| {
            let d = [0, 1, 2].map(|a| (p[a] - at[a]) / scale);
            let f = (d[0] / 1.5).powi(2) + d[1] * d[1] + (d[2] / 0.7).powi(2) - 1.0;
            (f, [2.0 * d[0] / 2.25 / scale, 2.0 * d[1] / scale, 2.0 * d[2] / 0.49 / scale])
        })
        .lipschitz(5.0 / scale);
        let bounds = Aabb::new(at.map(|v| v - 1.7 * scale), at.map(|v| v + 1.7 * scale));
        let s = sample(&f, &bounds, count(1500)).unwrap();
        check(&s, &f, &bounds, 1500);
        is_even(&s, "ellipsoid");
        assert!((s.report.area / (13.984244729 * scale * scale) - 1.0).abs() < 2e-3, "{}", s.report.area);
    }
}

#[test]
fn every_component_is_found_however_small() {
    // Two large spheres, one of a fortieth of the spacing, one next to a large one.
    let f = spheres(vec![
        ([-1.0, 0.0, 0.0], 0.6),
        ([1.0, 0.0, 0.0], 0.6),
        ([0.0, 1.1, 0.3], 0.004),
        ([-0.3, 0.0, 0.0], 0.02),
    ]);
    let bounds = cube_bounds(2.0);
    let s = sample(&f, &bounds, count(500)).unwrap();
    check(&s, &f, &bounds, 500);
    assert_eq!(s.report.components, 4);
    assert!(s.report.certified);
    assert_eq!(sample(&f, &bounds, count(3)).unwrap_err(), Error::TooFew { n: 3, components: 4 });
    assert_eq!(sample(&f, &bounds, count(4)).unwrap().report.components, 4);
}

#[test]
fn nested_shells_get_their_shares() {
    let f = shells(vec![0.5, 0.6, 1.0]);
    let bounds = cube_bounds(1.1);
    let s = sample(&f, &bounds, count(3000)).unwrap();
    check(&s, &f, &bounds, 3000);
    is_even(&s, "shells");
    assert_eq!(s.report.components, 3);
    let total = 0.25 + 0.36 + 1.0;
    for r in [0.5, 0.6, 1.0] {
        let many = s.points.iter().filter(|p| (distance(**p, [0.0; 3]) - r).abs() < 0.01).count();
        let share = r * r / total * 3000.0;
        assert!(
            (many as f64 / share - 1.0).abs() < 0.02,
            "{many} on the shell of radius {r}, {share} expected"
        );
    }
}

#[test]
fn thin_sheets_are_sampled_on_both_sides() {
    // Spacing .06; thickness .1 and .02 in the middle, radius of curvature at the rim .0025 and .0001.
    for (half, rho_avg, cv) in [(0.05, 0.88, 0.12), (0.01, 0.85, 0.22)] {
        let f = ellipsoid([1.0, 1.0, half]);
        let bounds = Aabb::new([-1.1, -1.1, -2.0 * half], [1.1, 1.1, 2.0 * half]);
        let s = sample(&f, &bounds, count(2000)).unwrap();
        check(&s, &f, &bounds, 2000);
        assert_eq!(s.report.components, 1);
        let up = s.points.iter().filter(|p| p[2] > 0.0).count();
        assert!((900..=1100).contains(&up), "{up} of 2000 on the upper side");
        // The flat part, away from the rim, is as even as any surface.
        let flat: Vec<[f64; 3]> =
            s.points.iter().copied().filter(|p| p[2] > 0.0 && p[0].hypot(p[1]) < 0.9).collect();
        let inner: Vec<f64> = nearest(&flat);
        let m = mean(&inner);
        let deviation = mean(&inner.iter().map(|d| (d - m) * (d - m)).collect::<Vec<_>>()).sqrt();
        assert!(deviation / m < 0.06, "CV {} on the flat part", deviation / m);
        let e = &s.report.evenness;
        assert!(e.rho_avg > rho_avg && e.cv < cv, "{e:?}");
    }
}

#[test]
fn creases_and_corners_are_kept_apart() {
    let f = cube(1.0);
    let bounds = cube_bounds(1.2);
    let s = sample(&f, &bounds, count(3000)).unwrap();
    assert!(s.points.iter().all(|p| f.at(*p).0.abs() < 1e-12));
    assert_eq!(s.report.components, 1);
    let e = &s.report.evenness;
    assert!(e.rho_min > 0.3 && e.rho_avg > 0.87, "{e:?}");
    // Each face has its share.
    for a in 0..3 {
        for side in [-1.0, 1.0] {
            let many = s.points.iter().filter(|p| p[a] == side).count();
            assert!((500..=620).contains(&many), "{many} of 3000 on the face {a} {side}");
        }
    }
}

#[test]
fn vanishing_gradients_do_no_harm() {
    for (f, bounds) in [(heart(), cube_bounds(1.5)), (cone(), cube_bounds(1.0))] {
        let s = sample(&f, &bounds, count(1500)).unwrap();
        assert_eq!(s.points.len(), 1500);
        for (i, p) in s.points.iter().enumerate() {
            assert!(p.iter().all(|v| v.is_finite()) && s.areas[i].is_finite() && s.radii[i].is_finite());
            // Off by no more than a thousandth of the size in value, next to the singular points as well.
            assert!(f.at(*p).0.abs() < 1e-6, "{p:?} {}", f.at(*p).0);
        }
        assert!(s.report.evenness.rho_avg > 0.93, "{:?}", s.report.evenness);
    }
}

#[test]
fn curves_in_the_plane_work_too() {
    let f = ellipse(1.0, 0.3);
    let bounds = Aabb::new([-1.1, -0.5, 0.0], [1.1, 0.5, 0.0]);
    let s = sample(&f, &bounds, count(500)).unwrap();
    check(&s, &f, &bounds, 500);
    assert!(s.points.iter().all(|p| p[2] == 0.0));
    // The perimeter, by Ramanujan's second formula.
    let h = (0.7f64 / 1.3).powi(2);
    let perimeter = PI * 1.3 * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    assert!((s.report.area / perimeter - 1.0).abs() < 1e-3, "{} {perimeter}", s.report.area);
    let e = &s.report.evenness;
    assert!(e.rho_min > 0.85 && e.cv < 0.04 && e.six_valent == 1.0, "{e:?}");
    let s = sample(
        &circle(2.0),
        &Aabb::new([-3.0; 3], [3.0; 3]),
        Options { amount: Amount::Spacing(0.05), ..count(1) },
    );
    let s = s.unwrap();
    assert!((mean(&nearest(&s.points)) / 0.05 - 1.0).abs() < 0.02, "{}", s.report.spacing);
    assert!(s.curvatures.iter().all(|k| (k[0] - 0.5).abs() < 1e-4 && k[1] == 0.0));
}

#[test]
fn without_intervals_or_second_derivatives() {
    let f = Analytic::new(|p: [f64; 3]| {
        let d = [p[0] - 0.4, p[1], p[2]];
        let l = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(1e-300);
        (l - 0.3, d.map(|v| v / l))
    })
    .without_hessian();
    let bounds = cube_bounds(3.0);
    let s = sample(&f, &bounds, count(1000)).unwrap();
    check(&s, &f, &bounds, 1000);
    is_even(&s, "black box");
    assert!(!s.report.certified);
    let k: Vec<f64> = s.curvatures.iter().map(|k| 0.5 * (k[0] + k[1])).collect();
    assert!((mean(&k) - 1.0 / 0.3).abs() < 0.05, "curvature from neighbours: {}", mean(&k));
}

#[test]
fn densities_by_function_and_by_curvature() {
    let f = sphere([0.0; 3], 1.0);
    let dense = |points: &[[f64; 3]], out: &mut [f64]| -> Result<(), String> {
        points.iter().zip(out).for_each(|(p, d)| *d = if p[2] > 0.0 { 4.0 } else { 1.0 });
        Ok(())
    };
    for method in [Method::Even, Method::Random] {
        let options = Options { density: Density::Function(&dense), method, ..count(4000) };
        let s = sample(&f, &cube_bounds(1.2), options).unwrap();
        assert_eq!(s.points.len(), 4000);
        let up = s.points.iter().filter(|p| p[2] > 0.0).count();
        assert!((3120..=3280).contains(&up), "{method:?}: {up} of 4000 where 3200 belong");
    }
    let long = ellipsoid([2.0, 0.5, 0.5]);
    let options = Options { density: Density::Curvature, ..count(2000) };
    let s = sample(&long, &cube_bounds(2.2), options).unwrap();
    let per_area = |tip: bool| {
        let of = |i: &usize| (s.points[*i][0].abs() > 1.8) == tip;
        let chosen: Vec<usize> = (0..2000).filter(of).collect();
        chosen.len() as f64 / chosen.iter().map(|&i| s.areas[i]).sum::<f64>()
    };
    assert!(per_area(true) > 1.5 * per_area(false), "{} {}", per_area(true), per_area(false));
}

#[test]
fn a_changed_surface_is_taken_up_where_the_last_one_ended() {
    let first = sample(&ellipsoid([1.0, 1.0, 1.0]), &cube_bounds(1.5), count(1000)).unwrap();
    let f = ellipsoid([1.2, 1.0, 0.9]);
    let options = Options { start: Some(&first.points), ..count(1200) };
    let s = sample(&f, &cube_bounds(1.5), options).unwrap();
    check(&s, &f, &cube_bounds(1.5), 1200);
    assert!(s.report.evenness.rho_avg > 0.93, "{:?}", s.report.evenness);
}

#[test]
fn a_coarse_result_is_refined_to_all_of_the_surface() {
    let (ball, ring) = (sphere([0.0; 3], 1.0), torus(1.0, 0.4));
    let bounds = cube_bounds(1.5);
    let cases = [(&ball, 4.0 * PI, 1000, 10_000), (&ball, 4.0 * PI, 50, 300), (&ball, 4.0 * PI, 100, 1000)];
    for (f, area, few, n) in cases.into_iter().chain([(&ring, 4.0 * PI * PI * 0.4, 60, 1000)]) {
        let first = sample(f, &bounds, count(few)).unwrap();
        let s = sample(f, &bounds, Options { start: Some(&first.points), ..count(n) }).unwrap();
        check(&s, f, &bounds, n);
        assert_eq!(s.report.status, Status::Converged, "{few} to {n}");
        assert!((s.report.area / area - 1.0).abs() < 0.02, "{few} to {n}: area {}", s.report.area);
    }
}

#[test]
fn a_start_that_covers_a_part_is_told_and_does_no_harm() {
    let f = sphere([0.0; 3], 1.0);
    let first = sample(&f, &cube_bounds(1.5), count(1000)).unwrap().points;
    let far: Vec<[f64; 3]> = first.iter().map(|p| p.map(|c| c + 5.0)).collect();
    let half: Vec<[f64; 3]> = first.iter().copied().filter(|p| p[2] > 0.0).collect();
    for start in [&far, &half] {
        let s = sample(&f, &cube_bounds(1.5), Options { start: Some(start), ..count(800) }).unwrap();
        check(&s, &f, &cube_bounds(1.5), 800);
        assert!(s.report.evenness.rho_avg > 0.93, "{:?}", s.report.evenness);
        assert!(s.report.warnings.iter().any(|w| w.contains("sampled afresh")), "{:?}", s.report.warnings);
    }
    let options = Options { amount: Amount::Spacing(0.1), start: Some(&first[..50]), ..Options::default() };
    let s = sample(&f, &cube_bounds(1.5), options).unwrap();
    assert!((mean(&nearest(&s.points)) / 0.1 - 1.0).abs() < 0.01, "{}", s.points.len());
}

#[test]
fn random_points_are_uniform_and_independent() {
    let f = torus(1.0, 0.5);
    let n = 20_000;
    let s = sample(&f, &cube_bounds(1.6), Options { method: Method::Random, ..count(n) }).unwrap();
    assert_eq!(s.points.len(), n);
    // The outer half of a torus has the area part 1/2 + r/(πR).
    let outer = s.points.iter().filter(|p| p[0].hypot(p[1]) > 1.0).count() as f64 / n as f64;
    let expected = 0.5 + 0.5 / PI;
    let error = (expected * (1.0 - expected) / n as f64).sqrt();
    assert!((outer - expected).abs() < 4.0 * error, "{outer} for {expected}");
    // Eight octants and chi squared with 7 degrees of freedom: 24.3 is the 99.9 % quantile, 0.6 the .1 % one.
    let mut octants = [0.0; 8];
    s.points.iter().for_each(|p| {
        octants[usize::from(p[0] > 0.0) + 2 * usize::from(p[1] > 0.0) + 4 * usize::from(p[2] > 0.0)] += 1.0;
    });
    let each = n as f64 / 8.0;
    let chi: f64 = octants.iter().map(|o| (o - each) * (o - each) / each).sum();
    assert!((0.6..24.3).contains(&chi), "chi squared {chi}: neither biased nor stratified is expected");
    // Independent points have a mean nearest distance of half the square root of the cell.
    let cell = (4.0 * PI * PI * 0.5 / 2000.0f64).sqrt();
    let few = &s.points[..2000];
    let ratio = mean(&nearest(few)) / (0.5 * cell);
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn mere_places_are_those_of_the_samples() {
    let (torus, bounds) = (torus(1.0, 0.4), Aabb::new([-1.6; 3], [1.6; 3]));
    for amount in [Amount::Count(1500), Amount::Spacing(0.08)] {
        let given = places(&torus, &bounds, amount, 3, 100_000, None).unwrap().unwrap();
        let s = sample(&torus, &bounds, Options { amount, seed: 3, ..Options::default() }).unwrap();
        assert_eq!((given.points, given.spacing), (s.points, s.report.spacing));
    }
    let refused = places(&torus, &bounds, Amount::Count(1500), 3, 1000, None);
    assert!(matches!(refused, Err(Error::TooMany { .. })), "{refused:?}");
    let elsewhere = Aabb::new([3.0; 3], [4.0; 3]);
    assert_eq!(places(&torus, &elsewhere, Amount::Count(10), 3, 1000, None), Ok(None));
}

#[test]
fn an_empty_surface_is_no_error() {
    let s = sample(&nowhere(), &cube_bounds(1.0), count(100)).unwrap();
    assert_eq!((s.points.len(), s.report.status.clone(), s.report.certified), (0, Status::Empty, true));
    assert_eq!(s.report.status.name(), "empty");
}

/// The warning that goes with an empty result.
fn why_empty(f: impl Fn([f64; 3]) -> (f64, [f64; 3]) + Send + Sync + 'static) -> String {
    let s = sample(&Analytic::new(f), &cube_bounds(2.0), count(100)).unwrap();
    assert_eq!((s.points.len(), s.report.status.clone()), (0, Status::Empty));
    assert!(!s.report.certified);
    s.report.warnings.join("; ")
}

#[test]
fn a_field_that_is_no_number_anywhere_is_told_from_an_empty_one() {
    let why = why_empty(|_| (f64::NAN, [f64::NAN; 3]));
    assert!(why.contains("nowhere a finite number"), "{why}");
    let s = sample(&nowhere(), &cube_bounds(1.0), count(100)).unwrap();
    assert!(s.report.warnings.is_empty(), "{:?}", s.report.warnings);
}

#[test]
fn a_field_that_only_touches_zero_is_told_from_an_empty_one() {
    let squared = |p: [f64; 3]| {
        let v = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - 1.0;
        (v * v, p.map(|c| 4.0 * v * c))
    };
    let touching = [
        why_empty(squared),
        why_empty(|p| (p[0] * p[0], [2.0 * p[0], 0.0, 0.0])),
        why_empty(|p| (p[0].abs(), [p[0].signum(), 0.0, 0.0])),
    ];
    for why in touching {
        assert!(why.contains("does not change its sign") && why.contains("nowhere negative"), "{why}");
    }
    let why = why_empty(|_| (0.0, [0.0; 3]));
    assert!(why.contains("zero on a whole region"), "{why}");
}

#[test]
fn a_surface_in_a_face_of_the_bounds_is_sampled() {
    let bounds = cube_bounds(1.0);
    for (offset, sign) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let f = Analytic::new(move |p: [f64; 3]| (sign * (p[2] - offset), [0.0, 0.0, sign])).lipschitz(1.0);
        let s = sample(&f, &bounds, count(500)).unwrap();
        check(&s, &f, &bounds, 500);
        assert!(s.points.iter().all(|p| (p[2] - offset).abs() < 1e-12 && bounds.contains(*p)));
        assert_eq!(s.report.status, Status::Converged);
        assert!((s.report.area - 4.0).abs() < 0.05, "{}", s.report.area);
        let told = |w: &String| w.contains("lies in a face of the bounds (z = ");
        assert!(s.report.warnings.iter().any(told), "{:?}", s.report.warnings);
    }
    let s = sample(&cube(1.0), &bounds, count(600)).unwrap();
    assert_eq!(s.points.len(), 600);
    assert!(s.points.iter().all(|p| bounds.contains(*p) && cube(1.0).at(*p).0.abs() < 1e-12));
    // A sphere that only touches the faces is no such surface.
    let s = sample(&sphere([0.0; 3], 1.0), &bounds, count(500)).unwrap();
    assert!(s.points.len() == 500 && s.report.warnings.is_empty(), "{:?}", s.report.warnings);
}

#[test]
fn areas_of_few_samples_add_up_to_the_surface() {
    let f = sphere([0.0; 3], 1.0);
    for n in [1, 2, 3, 4, 7, 12, 30] {
        let s = sample(&f, &cube_bounds(1.5), count(n)).unwrap();
        assert_eq!(s.points.len(), n);
        let sum: f64 = s.areas.iter().sum();
        assert!((sum / (4.0 * PI) - 1.0).abs() < 0.12 && (sum - s.report.area).abs() < 1e-9, "{n}: {sum}");
        if (2..8).contains(&n) {
            assert!(s.report.warnings.iter().any(|w| w.contains("`areas` were scaled")), "{n}");
        }
    }
    let s = sample(&f, &cube_bounds(1.5), count(300)).unwrap();
    assert!(s.report.warnings.is_empty(), "{:?}", s.report.warnings);
}

#[test]
fn samples_do_not_pile_up_at_a_singular_point() {
    // Shells, and a point in the middle.
    let f = Analytic::new(|p: [f64; 3]| {
        let r = distance(p, [0.0; 3]);
        let slope = 20.0 * (20.0 * r).cos() / r;
        ((20.0 * r).sin(), p.map(|c| slope * c))
    });
    let s = sample(&f.lipschitz(20.0), &cube_bounds(1.01), count(5000)).unwrap();
    assert_eq!(s.points.len(), 5000);
    let middle = s.points.iter().filter(|p| distance(**p, [0.0; 3]) < 0.05).count();
    assert!(middle <= 1, "{middle} samples in the middle");
    // Found by intervals: six whole spheres, three that the faces cut, eight corners of two, and the point, once.
    let f = Field::new(&text::parse("sin(20*sqrt(x^2 + y^2 + z^2))", &[]).unwrap()).unwrap();
    let s = sample(&f, &cube_bounds(1.01), count(5000)).unwrap();
    assert_eq!(s.report.components, 6 + 3 + 2 * 8 + 1);
}

#[test]
fn what_a_very_thin_sheet_leaves_open_is_not_claimed() {
    let f = ellipsoid([1.0, 1.0, 0.001]);
    let s = sample(&f, &Aabb::new([-1.1, -1.1, -0.01], [1.1, 1.1, 0.01]), count(3000)).unwrap();
    assert_eq!(s.points.len(), 3000);
    assert!(!s.report.certified);
    assert!(s.report.warnings.iter().any(|w| w.contains("back to back")), "{:?}", s.report.warnings);
    assert!((s.report.area / (2.0 * PI) - 1.0).abs() < 0.12, "{}", s.report.area);
    assert!(s.report.max_error <= 1e-3 * s.report.spacing || s.report.status != Status::Converged);
    // Nothing of the kind is said of a thick body.
    let s = sample(&sphere([0.0; 3], 1.0), &cube_bounds(1.2), count(1000)).unwrap();
    assert!(s.report.certified);
}

#[test]
fn wrong_requests_say_what_is_wrong() {
    let f = sphere([0.0; 3], 1.0);
    let ask = |bounds: &Aabb, options: Options<'_>| sample(&f, bounds, options).unwrap_err();
    let good = cube_bounds(1.5);
    let spacing = |s: f64| Options { amount: Amount::Spacing(s), ..Options::default() };
    for s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(ask(&good, spacing(s)), Error::Option { name: "spacing", .. }), "{s}");
    }
    match ask(&good, spacing(1e-5)) {
        Error::TooMany { estimate, limit, .. } => {
            // 4π (1.03/1e-5)².
            assert!((estimate / 1.333e11 - 1.0).abs() < 0.05 && limit == 20_000_000, "{estimate}");
        }
        other => panic!("{other}"),
    }
    assert!(matches!(ask(&good, count(1_000_000_000)), Error::TooMany { .. }));
    assert!(matches!(ask(&good, count(0)), Error::Option { name: "n", .. }));
    for (lo, hi) in [(1.0, -1.0), (0.0, 0.0), (f64::NAN, 1.0), (f64::NEG_INFINITY, 1.0), (-1e308, 1e308)] {
        let bounds = Aabb::new([lo, -1.0, -1.0], [hi, 1.0, 1.0]);
        assert!(matches!(ask(&bounds, count(10)), Error::Bounds { .. }), "{lo} {hi}");
    }
    let start = [[f64::NAN; 3]];
    assert!(matches!(
        ask(&good, Options { start: Some(&start), ..count(10) }),
        Error::Option { name: "start", .. }
    ));
    let bad = |_: &[[f64; 3]], out: &mut [f64]| -> Result<(), String> {
        out.fill(-1.0);
        Ok(())
    };
    let e = ask(&good, Options { density: Density::Function(&bad), ..count(10) });
    assert!(e.to_string().contains("expected positive, finite values, given -1 at"), "{e}");
    let fails = |_: &[[f64; 3]], _: &mut [f64]| -> Result<(), String> { Err("no data there".into()) };
    let e = ask(&good, Options { density: Density::Function(&fails), ..count(10) });
    assert_eq!(e, Error::Density { reason: "no data there".into() });
}

#[test]
fn a_run_can_be_stopped_and_gives_what_it_has() {
    let f = sphere([0.0; 3], 1.0);
    let (mut calls, mut last) = (0, 0.0);
    let mut watch = |p: &isoswarm_particles::Progress| {
        assert!(p.fraction >= last, "progress fell from {last} to {}", p.fraction);
        last = p.fraction;
        calls += 1;
        if calls > 50 { ControlFlow::Break(Stop::TimeLimit) } else { ControlFlow::Continue(()) }
    };
    let s = sample(&f, &cube_bounds(1.2), Options { progress: Some(&mut watch), ..count(5000) }).unwrap();
    assert_eq!(s.report.status, Status::NotConverged("the time limit was reached".into()));
    assert!(!s.points.is_empty() && s.points.iter().all(|p| f.at(*p).0.abs() < 1e-12));
}

#[test]
fn a_field_that_fails_says_so() {
    struct Broken;
    impl Surface for Broken {
        fn value_gradient(
            &self,
            _: &[[f64; 3]],
            _: &mut [f64],
            _: &mut [[f64; 3]],
        ) -> Result<(), isoswarm_field::FieldError> {
            Err(isoswarm_field::FieldError::Invalid("division by zero".into()))
        }
        fn hessian(&self, _: &[[f64; 3]], _: &mut [[f64; 6]]) -> Result<(), isoswarm_field::FieldError> {
            unreachable!("there are no samples")
        }
    }
    let e = sample(&Broken, &cube_bounds(1.0), count(10)).unwrap_err();
    assert_eq!(e.to_string(), "division by zero");
    let nan = Analytic::new(|_| (f64::NAN, [f64::NAN; 3]));
    assert_eq!(sample(&nan, &cube_bounds(1.0), count(10)).unwrap().report.status, Status::Empty);
}

#[test]
fn a_run_can_be_stopped_while_it_looks_for_the_surface() {
    let f = sphere([0.0; 3], 1.0);
    for calls in [1, 3] {
        let mut called = 0;
        let mut watch = |p: &isoswarm_particles::Progress| {
            called += 1;
            assert!(called <= calls, "called again after it asked to stop");
            assert!(p.fraction < 0.1 && p.phase == isoswarm_particles::Phase::Seeding, "{p:?}");
            if called == calls { ControlFlow::Break(Stop::Cancelled) } else { ControlFlow::Continue(()) }
        };
        let s = sample(&f, &cube_bounds(1.2), Options { progress: Some(&mut watch), ..count(5000) }).unwrap();
        assert_eq!(s.report.status, Status::NotConverged("cancelled".into()));
        assert!(s.points.is_empty());
    }
}

#[test]
fn uneven_samples_do_not_pass_for_converged() {
    // Spacing .06 on a sheet whose rim bends within .0001: there the samples cannot be even.
    let f = ellipsoid([1.0, 1.0, 0.01]);
    let bounds = Aabb::new([-1.1, -1.1, -0.02], [1.1, 1.1, 0.02]);
    let s = sample(&f, &bounds, count(2000)).unwrap();
    assert!(s.report.evenness.cv > 0.1, "{:?}", s.report.evenness);
    let Status::NotConverged(why) = &s.report.status else { panic!("{:?}", s.report.status) };
    assert!(why.starts_with("the samples are uneven"), "{why}");
    assert!(s.report.warnings.iter().any(|w| w.contains("bends within less than their spacing")));
}

/// Cavities of radius .05, each in a ball of radius .075, on a cubic lattice: seeds are about .05 apart.
fn crowded_shells() -> Analytic {
    let at = |k: usize| 0.17 * (k as f64 - 2.0);
    let balls: Vec<[f64; 3]> = (0..125).map(|k| [k % 5, k / 5 % 5, k / 25].map(at)).collect();
    Analytic::new(move |p| {
        let nearest =
            balls.iter().copied().min_by(|a, b| distance(*a, p).total_cmp(&distance(*b, p))).unwrap();
        let r = distance(nearest, p).max(1e-12);
        let out = [0, 1, 2].map(|a| (p[a] - nearest[a]) / r);
        // A shell: outside of .05 and inside of .075.
        if r > 0.0625 { (r - 0.075, out) } else { (0.05 - r, out.map(|v| -v)) }
    })
    .lipschitz(1.0)
}

#[test]
fn a_run_that_is_stopped_while_it_fills_a_rough_surface_ends_at_once() {
    let mut at = None;
    let mut watch = |p: &isoswarm_particles::Progress| {
        if p.phase != isoswarm_particles::Phase::Relaxing || p.steps > 0 {
            return ControlFlow::Continue(());
        }
        at.get_or_insert(p.floaters);
        ControlFlow::Break(Stop::Cancelled)
    };
    let options = Options { progress: Some(&mut watch), ..count(300_000) };
    let s = sample(&crowded_shells(), &cube_bounds(0.5), options).unwrap();
    assert_eq!(s.report.status, Status::NotConverged("cancelled".into()));
    assert!(at.is_some_and(|n| n < 300_000 && s.points.len() <= n), "{at:?}, {}", s.points.len());
    assert_eq!((s.report.steps, s.report.births), (0, 0));
}

#[test]
fn components_that_the_seeds_cannot_tell_apart_are_counted_in_the_end() {
    let s = sample(&crowded_shells(), &cube_bounds(0.5), count(60_000)).unwrap();
    assert_eq!(s.report.components, 250);
    let mut of_component = vec![None; 250];
    for (p, c) in s.points.iter().zip(&s.component) {
        let key = [0, 1, 2].map(|a| ((p[a] + 0.34) / 0.17).round() as i32);
        let centre = key.map(|k| 0.17 * f64::from(k) - 0.34);
        let own = (key, distance(*p, centre) < 0.0625);
        assert_eq!(*of_component[*c as usize].get_or_insert(own), own, "two pieces in one component");
    }
}
