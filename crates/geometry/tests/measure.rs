//! Measures against values that are known from formulas.

mod lattice;

use std::f64::consts::PI;

use isoswarm_field::vector::norm;
use isoswarm_field::{Aabb, Field};
use isoswarm_geometry::{Estimate, MeasureOptions, Measures, Mesh, measure};
use lattice::surface;

fn cube(half: f64) -> Aabb {
    Aabb::new([-half; 3], [half; 3])
}

/// A box that moves with `k`, so that each k gives another mesh.
fn shifted(half: [f64; 3], k: usize) -> Aabb {
    let shift = |a: usize| 0.02 * half[a] * ((k * (a + 2)) as f64 * 0.618_034).fract();
    Aabb::new([0, 1, 2].map(|a| -half[a] - shift(a)), [0, 1, 2].map(|a| half[a] + 0.03 * half[a] - shift(a)))
}

fn run(field: &Field, mesh: &Mesh) -> Measures {
    measure(field, mesh, MeasureOptions::default()).unwrap()
}

fn holds(e: Estimate, exact: f64) {
    assert!((e.value - exact).abs() <= e.error, "{e:?}, exactly {exact}, off {:e}", e.value - exact);
}

#[test]
fn a_torus_by_formulas() {
    // R = 1, r = .4: V = 2π²Rr², A = 4π²Rr, ∫H dA = 2π²R, Willmore's energy π² c²/sqrt(c² - 1) with c = R/r.
    let torus = surface("(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16");
    let mesh = lattice::mesh(&torus, &cube(1.5), [44; 3]);
    assert!(mesh.topology().is_closed() && mesh.topology().euler == [0]);
    let m = run(&torus, &mesh);
    let (p2, r) = (PI * PI, 0.4);
    let volume = 2.0 * p2 * r * r;
    holds(m.area, 4.0 * p2 * r);
    holds(m.volume.unwrap(), volume);
    holds(m.mean_curvature.unwrap(), 2.0 * p2);
    holds(m.gaussian_curvature.unwrap(), 0.0);
    holds(m.willmore.unwrap(), p2 / (r * (1.0 - r * r).sqrt()));
    holds(m.thin_plate.unwrap(), 4.0 * p2 / (r * (1.0 - r * r).sqrt()));
    let solid = m.solid.unwrap();
    solid.centroid.iter().for_each(|c| holds(*c, 0.0));
    // About the axis V (R² + 3r²/4), across it V (R²/2 + 5r²/8).
    holds(solid.inertia[0], volume * (0.5 + 5.0 / 8.0 * r * r));
    holds(solid.inertia[5], volume * (1.0 + 0.75 * r * r));
    holds(solid.inertia[1], 0.0);
    holds(m.shell.inertia[5], 4.0 * p2 * r * (1.0 + 1.5 * r * r));
    assert!(m.area.error < 1e-8 * m.area.value && m.volume.unwrap().error < 1e-8 * volume, "{m:?}");
    assert!(
        m.gauss_bonnet.unwrap().abs() < 1e-7 && m.notes.is_empty() && m.places.is_empty(),
        "{:?}",
        m.notes
    );
}

#[test]
fn bars_hold_and_are_not_wide() {
    let ellipsoid = surface("(x/1.5)^2 + y^2 + (z/0.7)^2 - 1");
    let (area, volume) = (13.984_244_729_192_563, 4.0 / 3.0 * PI * 1.5 * 0.7);
    let (mut held, mut ratios) = (0, Vec::new());
    for k in 0..20 {
        let mesh = lattice::mesh(&ellipsoid, &shifted([1.6, 1.1, 0.8], k), [20, 14, 10]);
        let options =
            MeasureOptions { tolerance: 1e-3, curvature: false, weights: false, ..Default::default() };
        let m = measure(&ellipsoid, &mesh, options).unwrap();
        for (e, exact) in [(m.area, area), (m.volume.unwrap(), volume)] {
            let off = (e.value - exact).abs();
            held += usize::from(off <= e.error);
            ratios.push(e.error / off);
            assert!(off < 1e-5 * exact, "{e:?}");
        }
    }
    ratios.sort_by(f64::total_cmp);
    assert!(held >= 38 && ratios[20] < 5.0, "{held} of 40 hold, {ratios:?}");
}

#[test]
fn halving_the_triangles_divides_the_error_by_a_hundred() {
    // Rules of degree 6: order 7 or more.
    let torus = surface("(x^2 + y^2 + z^2 + 0.84)^2 - 4*(x^2 + y^2)");
    let off = |n: usize| {
        let mean = |k: usize| {
            let mesh = lattice::mesh(&torus, &shifted([1.5, 1.5, 0.5], k), [n, n, n / 3]);
            let options =
                MeasureOptions { tolerance: 1.0, curvature: false, weights: false, ..Default::default() };
            let m = measure(&torus, &mesh, options).unwrap();
            (m.area.value / (1.6 * PI * PI) - 1.0).abs()
        };
        (0..6).map(mean).sum::<f64>() / 6.0
    };
    let (coarse, fine) = (off(18), off(36));
    assert!(fine < coarse / 100.0, "{coarse:e} {fine:e}");
}

#[test]
fn triangles_around_a_rim_thinner_than_themselves_are_divided() {
    // Triangles of .06 around a rim whose radius of curvature is .0025: the normals at their corners oppose each other.
    let c = 0.05f64;
    let pancake = surface("x^2 + y^2 + (z/0.05)^2 - 1");
    let e = (1.0 - c * c).sqrt();
    let (area, volume) = (2.0 * PI * (1.0 + c * c / e * e.atanh()), 4.0 / 3.0 * PI * c);
    for k in 0..3 {
        let mesh = lattice::mesh(&pancake, &shifted([1.1, 1.1, 0.07], k), [40, 40, 4]);
        assert!(mesh.topology().is_closed(), "{k}");
        let m = run(&pancake, &mesh);
        holds(m.area, area);
        holds(m.volume.unwrap(), volume);
        assert!(m.area.error < 1e-5 * area && m.volume.unwrap().error < 1e-5 * volume, "{k}: {m:?}");
        let constants: f64 = m.weights.iter().sum();
        assert!((constants / m.area.value - 1.0).abs() < 1e-12, "{constants}");
    }
}

#[test]
fn weights_integrate() {
    let field = surface("(x/1.5)^2 + y^2 + (z/0.7)^2 - 1");
    let f = |p: &[f64; 3]| (1.3 * p[0]).sin() + p[1] * p[1] * p[2] + (p[2] - 0.2 * p[0]).exp();
    let off = |n: usize| {
        let one = |k: usize| {
            let mesh = lattice::mesh(&field, &shifted([1.6, 1.1, 0.8], k), [2 * n, 3 * n / 2, n]);
            let integrand = |p: &[[f64; 3]], _: &[[f64; 3]], out: &mut [f64]| {
                p.iter().zip(out).for_each(|(p, v)| *v = f(p));
                Ok(())
            };
            let options = MeasureOptions { integrands: vec![&integrand], ..Default::default() };
            let m = measure(&field, &mesh, options).unwrap();
            assert!((m.weights.iter().sum::<f64>() / m.area.value - 1.0).abs() < 1e-12);
            let sum: f64 = mesh.points.iter().zip(&m.weights).map(|(p, w)| w * f(p)).sum();
            (sum / m.integrals[0].value - 1.0).abs()
        };
        (0..4).map(one).sum::<f64>() / 4.0
    };
    let (coarse, fine) = (off(12), off(24));
    assert!(fine < 2e-6 && fine < coarse / 7.0, "{coarse:e} {fine:e}");
}

#[test]
fn a_clipped_surface_has_its_area_and_no_volume() {
    // A sphere of radius 1 between z = -.3 and .6: a zone of area 2π h.
    let sphere = surface("x^2 + y^2 + z^2 - 1");
    let bounds = Aabb::new([-1.1, -1.1, -0.3], [1.1, 1.1, 0.6]);
    let mesh = lattice::mesh(&sphere, &bounds, [30, 30, 13]);
    let options = MeasureOptions { bounds: Some(bounds), ..Default::default() };
    let m = measure(&sphere, &mesh, options).unwrap();
    holds(m.area, 2.0 * PI * 0.9);
    assert!(m.area.error < 1e-8 && m.volume.is_none() && m.solid.is_none() && m.gauss_bonnet.is_none());
    assert!(
        m.notes.len() == 1 && m.notes[0].contains("2 boundary loops") && !m.places.is_empty(),
        "{:?}",
        m.notes
    );
}

#[test]
fn holes_and_faults_make_wide_bars_that_are_not_relied_on() {
    let sphere = surface("x^2 + y^2 + z^2 - 1");
    let whole = lattice::mesh(&sphere, &cube(1.1), [20; 3]);
    let sound = run(&sphere, &whole);
    assert!(sound.reliable && sound.area.error < 1e-6);
    // Without one triangle, for several of them: the bar covers what is missing, and is not much wider than the hole.
    let mut order: Vec<usize> = (0..whole.faces.len()).collect();
    order.sort_by(|&f, &g| norm(whole.face_vector(g)).total_cmp(&norm(whole.face_vector(f))));
    for v in [order[0], order[7], order[50]] {
        let mut holed = whole.clone();
        holed.faces.remove(v);
        let m = run(&sphere, &holed);
        let missing = 4.0 * PI - m.area.value;
        assert!(!m.reliable && missing > 1e-3, "{v}: {missing}");
        assert!(missing <= m.area.error && m.area.error < 8.0 * missing, "{missing} {:?}", m.area);
        assert!(m.notes.iter().any(|n| n.starts_with("1 of the loops")), "{:?}", m.notes);
    }
    // A triangle that is there twice.
    let mut twice = whole.clone();
    twice.faces.push(twice.faces[17]);
    let m = run(&sphere, &twice);
    assert!(!m.reliable && (m.area.value - 4.0 * PI).abs() <= m.area.error, "{:?}", m.area);
    // An edge on the box is no hole.
    let bounds = Aabb::new([-1.1, -1.1, -0.3], [1.1; 3]);
    let cut = lattice::mesh(&sphere, &bounds, [20, 20, 12]);
    let m = measure(&sphere, &cut, MeasureOptions { bounds: Some(bounds), ..Default::default() }).unwrap();
    assert!(m.reliable && m.area.error < 1e-6, "{:?}", m.notes);
    holds(m.area, 2.0 * PI * 1.3);
}

#[test]
fn creases_and_cusps_widen_the_bars() {
    let cube_field = surface("max(abs(x), max(abs(y), abs(z))) - 1");
    let mesh = lattice::mesh(&cube_field, &shifted([1.2; 3], 3), [16; 3]);
    let m = run(&cube_field, &mesh);
    holds(m.area, 24.0);
    holds(m.volume.unwrap(), 8.0);
    assert!(m.area.error > 1e-6 && m.area.error < 0.3 && !m.places.is_empty(), "{:?}", m.area);
    assert!(m.notes.iter().any(|n| n.contains("did not settle")), "{:?}", m.notes);
    assert!(m.notes.iter().any(|n| n.contains("Gaussian")), "{:?}", m.notes);
    assert!(m.places.iter().all(|p| p.iter().filter(|v| v.abs() > 0.8).count() >= 2), "{:?}", m.places);
}

#[test]
fn rotations_and_threads_change_nothing() {
    let blobs = surface("0.5-exp(-((x-0.6)^2+y^2+z^2))-exp(-((x+0.6)^2+y^2+z^2))");
    let mesh = lattice::mesh(&blobs, &Aabb::new([-1.9, -1.3, -1.3], [1.9, 1.3, 1.3]), [30, 20, 20]);
    let m = run(&blobs, &mesh);
    holds(m.area, 17.499_459_240_102_265);
    holds(m.volume.unwrap(), 6.649_564_529_889_426);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| run(&blobs, &mesh)), m);
    // 1e5 lengths away: sums are taken around the surface, not around the origin.
    let far = surface("0.5-exp(-((x-100000.6)^2+y^2+z^2))-exp(-((x-99999.4)^2+y^2+z^2))");
    let moved = Mesh::new(mesh.points.iter().map(|p| [p[0] + 1e5, p[1], p[2]]).collect(), mesh.faces.clone());
    let n = run(&far, &moved);
    assert!((n.volume.unwrap().value / m.volume.unwrap().value - 1.0).abs() < 1e-9, "{:?}", n.volume);
    assert!((n.solid.unwrap().centroid[0].value - 1e5).abs() < 1e-8);
}

#[test]
fn bad_input_is_refused() {
    let sphere = surface("x^2 + y^2 + z^2 - 1");
    let error = |field: &Field, mesh: Mesh, options: MeasureOptions<'_>| {
        measure(field, &mesh, options).unwrap_err().to_string()
    };
    let none = || MeasureOptions::default();
    assert!(error(&sphere, Mesh::default(), none()).contains("at least one triangle"));
    let mesh = lattice::mesh(&sphere, &cube(1.2), [5; 3]);
    let bad = Mesh::new(vec![[0.0; 3]], vec![[0, 1, 2]]);
    assert!(error(&sphere, bad, none()).contains("vertex 1 of 1"));
    let nan = |_: &[[f64; 3]], _: &[[f64; 3]], out: &mut [f64]| {
        out.fill(f64::NAN);
        Ok(())
    };
    assert!(
        error(&sphere, mesh.clone(), MeasureOptions { integrands: vec![&nan], ..none() }).contains("NaN")
    );
    assert!(error(&sphere, mesh, MeasureOptions { tolerance: 0.0, ..none() }).contains("tolerance"));
}
