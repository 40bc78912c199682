//! Where rays meet surfaces: against closed forms and against brute force.

use std::sync::atomic::AtomicBool;

use isoswarm_field::vector::{dot, norm, sub};
use isoswarm_field::{Aabb, Field, text};
use isoswarm_geometry::render::{CastOptions, Caster, Clip, Hit, Plane, Pose, Ray, SIDE, View};

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

/// A camera on the direction (2, -3, 1.2), looking at the origin.
fn pose(distance: f64) -> Pose {
    let toward = isoswarm_field::vector::unit([2.0, -3.0, 1.2]);
    let right = isoswarm_field::vector::unit([3.0, 2.0, 0.0]);
    let up = isoswarm_field::vector::cross(toward, right);
    Pose { eye: toward.map(|v| distance * v), axes: [right, up, toward] }
}

fn cube(half: f64) -> Clip {
    Clip::new(Aabb::new([-half; 3], [half; 3]))
}

/// One tile of a view of the origin's neighbourhood, and what its rays hit.
fn cast(field: &Field, clip: &Clip, options: &CastOptions) -> (Vec<Ray>, Vec<Hit>) {
    let view = View::perspective(pose(6.0), 0.6, 64.0, 64.0);
    let rays = view.tile(0.5, 0.5, 1.0, clip, |_, _| true);
    let hits =
        Caster::new(field, &clip.bounds).unwrap().tile(&rays, options, &AtomicBool::new(false)).unwrap();
    (rays, hits)
}

fn all() -> CastOptions {
    CastOptions { layers: u16::MAX, cap_box: false, ..Default::default() }
}

/// Hits of each ray.
fn by_ray(hits: &[Hit]) -> Vec<Vec<Hit>> {
    let mut rows = vec![Vec::new(); SIDE * SIDE];
    for h in hits {
        rows[usize::from(h.ray)].push(*h);
    }
    rows
}

#[test]
fn a_sphere_is_hit_where_the_quadratic_says() {
    let (rays, hits) = cast(&field("x^2 + y^2 + z^2 - 1"), &cube(1.5), &all());
    let mut count = 0;
    for (ray, hits) in rays.iter().zip(by_ray(&hits)) {
        let (a, b) = (dot(ray.direction, ray.direction), dot(ray.direction, ray.origin));
        let root = b * b - a * (dot(ray.origin, ray.origin) - 1.0);
        if root < 0.0 {
            assert!(hits.is_empty());
            continue;
        }
        assert_eq!(hits.len(), 2, "discriminant {root}");
        for (h, sign) in hits.iter().zip([-1.0, 1.0]) {
            let t = (-b + sign * root.sqrt()) / a;
            assert!((h.t - t).abs() < 1e-10, "{} {t}", h.t);
            let p = ray.at(h.t);
            assert!(norm(sub(h.gradient, p.map(|v| 2.0 * v))) < 1e-6);
        }
        count += 1;
    }
    // The picture of a ball of radius 1 at distance 6: a disc of radius 1/√35 on a plane at distance 1.
    let pixel = 2.0 * (0.3f64).tan() / 64.0;
    let expected = std::f64::consts::PI / 35.0 / (pixel * pixel);
    assert!((f64::from(count) / expected - 1.0).abs() < 0.01, "{count} {expected}");
}

/// All roots of a quartic c0 + c1 t + … + c4 t⁴: Durand and Kerner's iteration.
fn quartic(c: [f64; 5]) -> Vec<(f64, f64)> {
    let mul = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let divide = |a: (f64, f64), b: (f64, f64)| {
        let n = b.0 * b.0 + b.1 * b.1;
        let p = mul(a, (b.0, -b.1));
        (p.0 / n, p.1 / n)
    };
    // Around the middle of the roots, so that few digits cancel.
    let mut z: Vec<(f64, f64)> = (0..4)
        .map(|k| {
            let (s, c0) = (0.4 + f64::from(k) * 1.5).sin_cos();
            (-c[3] / (4.0 * c[4]) + 0.5 * c0, 0.5 * s)
        })
        .collect();
    for _ in 0..200 {
        for k in 0..4 {
            let mut p = (c[4], 0.0);
            for j in (0..4).rev() {
                let q = mul(p, z[k]);
                p = (q.0 + c[j], q.1);
            }
            let mut d = (c[4], 0.0);
            for j in (0..4).filter(|j| *j != k) {
                d = mul(d, (z[k].0 - z[j].0, z[k].1 - z[j].1));
            }
            let step = divide(p, d);
            z[k] = (z[k].0 - step.0, z[k].1 - step.1);
        }
    }
    z
}

#[test]
fn a_torus_is_hit_where_the_quartic_says() {
    // (|p|² + R² − r²)² = 4 R² (x² + y²) with R = 1, r = 0.35.
    let (big, small) = (1.0, 0.35);
    let f = field("(x^2 + y^2 + z^2 + 1 - 0.1225)^2 - 4*(x^2 + y^2)");
    let (rays, hits) = cast(&f, &cube(1.5), &all());
    let mut crossings = 0;
    for (ray, hits) in rays.iter().zip(by_ray(&hits)) {
        // From the point nearest to the origin on, where numbers are small.
        let d = ray.direction;
        let t0 = -dot(ray.origin, d) / dot(d, d);
        let o = ray.at(t0);
        let (a, b, e) = (dot(d, d), 2.0 * dot(o, d), dot(o, o) + big * big - small * small);
        let (pa, pb, pc) =
            (d[0] * d[0] + d[1] * d[1], 2.0 * (o[0] * d[0] + o[1] * d[1]), o[0] * o[0] + o[1] * o[1]);
        let c =
            [e * e - 4.0 * pc, 2.0 * b * e - 4.0 * pb, b * b + 2.0 * a * e - 4.0 * pa, 2.0 * a * b, a * a];
        let roots = quartic(c);
        // Rays that nearly touch may be counted either way.
        if roots.iter().any(|r| (1e-9..1e-4).contains(&r.1.abs())) {
            continue;
        }
        let mut real: Vec<f64> = roots.iter().filter(|r| r.1.abs() < 1e-9).map(|r| t0 + r.0).collect();
        real.sort_by(f64::total_cmp);
        if real.windows(2).any(|w| w[1] - w[0] < 1e-4) {
            continue;
        }
        assert_eq!(hits.len(), real.len(), "{real:?} {hits:?}");
        for (h, t) in hits.iter().zip(real) {
            assert!((h.t - t).abs() < 1e-9, "{} {t}", h.t);
            crossings += 1;
        }
    }
    assert!(crossings > 1000);
}

/// Numbers in [0, 1): SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn random_csg(seed: u64) -> String {
    let mut r = Random(seed);
    let mut ball = || {
        let mut c = || 1.6 * r.next() - 0.8;
        let (x, y, z) = (c(), c(), c());
        format!("sqrt((x-{x:.3})^2 + (y-{y:.3})^2 + (z-{z:.3})^2) - {:.3}", 0.3 + 0.4 * r.next())
    };
    let mut f = ball();
    for k in 0..7 {
        let g = ball();
        f = match k % 3 {
            0 => format!("min({f}, {g})"),
            1 => format!("max({f}, -({g}))"),
            _ => format!("min({f}, max({g}, abs(z) - 0.1))"),
        };
    }
    f
}

#[test]
fn random_solids_are_hit_where_dense_marching_hits_or_before() {
    for seed in 0..6 {
        let f = field(&random_csg(seed));
        let clip = cube(2.0);
        let (rays, hits) = cast(&f, &clip, &CastOptions::default());
        let rows = by_ray(&hits);
        let mut seen = 0;
        for k in (0..SIDE * SIDE).step_by(7) {
            let ray = &rays[k];
            if ray.near >= ray.far {
                continue;
            }
            const STEPS: usize = 2000;
            let t = |i: usize| ray.near + (ray.far - ray.near) * i as f64 / STEPS as f64;
            let points: Vec<f64> = (0..=STEPS).flat_map(|i| ray.at(t(i))).collect();
            let mut value = vec![0.0; STEPS + 1];
            f.value(&points, &mut value).unwrap();
            let marched = (0..=STEPS).find(|&i| value[i] < 0.0);
            match (marched, rows[k].first()) {
                (Some(i), Some(h)) => assert!(h.t <= t(i), "seed {seed}: {} after {}", h.t, t(i)),
                (Some(i), None) => panic!("seed {seed}: nothing where marching finds {}", t(i)),
                // Marching steps over corners; the hit must still be one.
                _ => {}
            }
            if let Some(h) = rows[k].first() {
                let mut around = [0.0; 2];
                let (a, b) = (ray.at(h.t - 1e-9), ray.at(h.t + 1e-9));
                f.value(&[a, b].concat(), &mut around).unwrap();
                assert!(around[0] >= 0.0 && around[1] < 0.0, "seed {seed}: no entry at {}: {around:?}", h.t);
                if let Some(i) = marched {
                    assert!(value[..i].iter().all(|v| *v >= 0.0));
                }
                seen += 1;
            }
        }
        assert!(seen > 20, "seed {seed}: {seen}");
    }
}

#[test]
fn a_cut_has_the_area_of_the_section() {
    let mut clip = cube(1.5);
    clip.planes.push(Plane { normal: [0.0, 0.0, 2.0], offset: 0.6 });
    let f = field("x^2 + y^2 + z^2 - 1");
    let down = Pose { eye: [0.0, 0.0, 4.0], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };
    let view = View::parallel(down, 2.2, 64.0, 64.0);
    let rays = view.tile(0.5, 0.5, 1.0, &clip, |_, _| true);
    let caster = Caster::new(&f, &clip.bounds).unwrap();
    let hits = caster.tile(&rays, &CastOptions::default(), &AtomicBool::new(false)).unwrap();
    let cut = hits.iter().filter(|h| h.cut == Some(Clip::BOX_FACES)).count() as f64;
    let area = cut * (2.2f64 / 64.0).powi(2);
    let expected = std::f64::consts::PI * (1.0 - 0.09);
    assert!((area / expected - 1.0).abs() < 0.01, "{area} {expected}");
    for h in hits.iter().filter(|h| h.cut.is_some()) {
        assert!((rays[usize::from(h.ray)].at(h.t)[2] - 0.3).abs() < 1e-12);
    }
    // Open: the rays fall in and meet the far side from within.
    let open = CastOptions { cap_planes: false, ..Default::default() };
    let hits = caster.tile(&rays, &open, &AtomicBool::new(false)).unwrap();
    assert!(hits.iter().all(|h| h.cut.is_none()));
    assert!(hits.iter().any(|h| rays[usize::from(h.ray)].at(h.t)[2] < -0.9));
}

#[test]
fn sheets_far_thinner_than_a_pixel_are_hit_by_every_ray() {
    for thickness in ["1e-3", "1e-5", "1e-7"] {
        let f = field(&format!("abs(x + 2*y - z) - {thickness}"));
        let (rays, hits) = cast(&f, &cube(1.0), &CastOptions::default());
        let rows = by_ray(&hits);
        for (ray, hits) in rays.iter().zip(rows).filter(|(r, _)| r.near < r.far) {
            let side = |t: f64| {
                let p = ray.at(t);
                p[0] + 2.0 * p[1] - p[2]
            };
            let crosses = (side(ray.near) > 1e-2) != (side(ray.far) > 1e-2)
                && side(ray.near).abs() > 1e-2
                && side(ray.far).abs() > 1e-2;
            assert!(!crosses || hits.len() == 1, "{thickness}");
        }
        assert!(hits.len() > 100);
    }
}

#[test]
fn odd_fields_and_places_are_no_trouble() {
    let none = ["x^2 + y^2 + z^2 + 1", "(x^2 + y^2 + z^2 - 1)^2", "sqrt(-1 - x^2)", "1"];
    for formula in none {
        assert!(cast(&field(formula), &cube(1.5), &all()).1.is_empty(), "{formula}");
    }
    // A number only where the ball of radius 1 is: the surface inside is found, the end of the domain is none.
    let (rays, hits) = cast(&field("0.5 - sqrt(1 - x^2 - y^2 - z^2)"), &cube(1.5), &all());
    assert!(!hits.is_empty());
    for h in &hits {
        assert!((norm(rays[usize::from(h.ray)].at(h.t)) - 0.75f64.sqrt()).abs() < 1e-9);
    }
    // A pole is not a surface that lets rays through, but it must not hang.
    cast(&field("1/(x + 0.3*y) + z"), &cube(1.5), &all());
    cast(&field("floor(3*x) + y"), &cube(1.5), &all());
    // From inside the far side is seen.
    let f = field("x^2 + y^2 + z^2 - 1");
    let clip = cube(1.5);
    let view = View::perspective(pose(0.0), 1.0, 64.0, 64.0);
    let rays = view.tile(0.5, 0.5, 1.0, &clip, |_, _| true);
    let hits = Caster::new(&f, &clip.bounds)
        .unwrap()
        .tile(&rays, &CastOptions::default(), &AtomicBool::new(false))
        .unwrap();
    assert_eq!(hits.len(), SIDE * SIDE);
    assert!(hits.iter().all(|h| h.cut.is_none()));
}

#[test]
fn scale_does_not_matter() {
    let count = |r: f64| {
        let f = field(&format!("x^2 + y^2 + z^2 - {:e}", r * r));
        let view = View::perspective(pose(6.0 * r), 0.6, 64.0, 64.0);
        let clip = cube(1.5 * r);
        let rays = view.tile(0.5, 0.5, 1.0, &clip, |_, _| true);
        let caster = Caster::new(&f, &clip.bounds).unwrap();
        caster.tile(&rays, &all(), &AtomicBool::new(false)).unwrap().len()
    };
    assert_eq!(count(1.0), count(1e9));
    assert_eq!(count(1.0), count(1e-9));
}

#[test]
fn sums_of_bumps_are_hit_as_the_same_tape_is() {
    let sum = "1 - exp(2 - 2*((x-0.3)^2 + y^2 + z^2)) - exp(2 - 3*((x+0.5)^2 + (y-0.2)^2 + z^2)) \
               - exp(2 - 2*(x^2 + (y+0.6)^2 + (z-0.3)^2))";
    // A term that is no bump, and next to nothing: the sum is not recognised.
    let tape = format!("{sum} + 1e-300*sin(x)");
    let clip = cube(3.0);
    let (rays, a) = cast(&field(sum), &clip, &all());
    let (_, b) = cast(&field(&tape), &clip, &all());
    assert_eq!(a.len(), b.len());
    assert!(a.len() > 1000);
    for (p, q) in a.iter().zip(&b) {
        assert_eq!(p.ray, q.ray);
        assert!((p.t - q.t).abs() < 1e-10 * rays[0].far.abs().max(1.0));
    }
}

#[test]
fn threads_do_not_show() {
    let f = field(&random_csg(3));
    let clip = cube(2.0);
    let view = View::perspective(pose(6.0), 0.6, 128.0, 128.0);
    let caster = Caster::new(&f, &clip.bounds).unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tile = |k: usize| {
            view.tile((k % 2 * SIDE) as f64 + 0.5, (k / 2 * SIDE) as f64 + 0.5, 1.0, &clip, |_, _| true)
        };
        pool.install(|| caster.tiles(4, tile, &all(), &AtomicBool::new(false)).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn a_cast_can_be_called_off() {
    let f = field(&random_csg(1));
    let clip = cube(2.0);
    let view = View::perspective(pose(6.0), 0.6, 64.0, 64.0);
    let rays = view.tile(0.5, 0.5, 1.0, &clip, |_, _| true);
    let caster = Caster::new(&f, &clip.bounds).unwrap();
    assert!(caster.tile(&rays, &all(), &AtomicBool::new(true)).is_err());
    assert!(caster.tile(&rays[1..], &all(), &AtomicBool::new(false)).is_err());
}
