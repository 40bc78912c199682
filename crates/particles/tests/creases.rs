//! Creases of known surfaces: counts by theory, lengths by formula.

use std::f64::consts::PI;

use isoswarm_field::{Aabb, Field, text};
use isoswarm_particles::creases::{CreaseOptions, Creases, End, creases};

fn field(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

fn find(formula: &str, half: f64, spacing: f64) -> Creases {
    let found =
        creases(&field(formula), &Aabb::new([-half; 3], [half; 3]), CreaseOptions::new(spacing)).unwrap();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    found
}

fn near(a: f64, b: f64, relative: f64) {
    assert!((a / b - 1.0).abs() < relative, "{a} instead of {b}");
}

const CUBE: &str = "max(abs(x), max(abs(y), abs(z))) - 1";
const CSG: &str = "max(max(max(abs(x),max(abs(y),abs(z)))-0.75,x^2+y^2+z^2-1),\
                   max(0.16-x^2-y^2,max(0.16-y^2-z^2,0.16-z^2-x^2)))";

#[test]
fn a_cube_has_eight_corners_and_twelve_edges() {
    let c = find(CUBE, 1.2, 0.07);
    assert_eq!((c.corners.len(), c.edges.len()), (8, 12));
    for &i in &c.corners {
        assert!(c.points[i as usize].iter().all(|v| v.abs() == 1.0), "{:?}", c.points[i as usize]);
    }
    for e in &c.edges {
        near(e.length, 2.0, 1e-14);
        assert_eq!((e.ends, e.points.len()), ([End::Corner; 2], 30));
        for n in e.normals.iter().flatten() {
            assert_eq!(n.iter().filter(|v| v.abs() == 1.0).count(), 1, "{n:?}");
        }
    }
}

#[test]
fn circles_are_closed_and_as_long_as_they_should_be() {
    let c = find("max(x^2 + y^2 - 1, abs(z) - 1)", 1.2, 0.05);
    assert_eq!((c.corners.len(), c.edges.len()), (0, 2));
    for e in &c.edges {
        assert!(e.closed);
        near(e.length, 2.0 * PI, 1e-9);
    }
    let c = find("min((x - 0.6)^2 + y^2 + z^2 - 1, (x + 0.6)^2 + y^2 + z^2 - 1)", 1.8, 0.05);
    assert_eq!(c.edges.len(), 1);
    near(c.edges[0].length, 2.0 * PI * 0.8, 1e-9);
    for p in &c.points {
        assert!(p[0].abs() < 1e-15 && ((p[1] * p[1] + p[2] * p[2]).sqrt() - 0.8).abs() < 1e-15);
    }
}

#[test]
fn the_classic_part_has_the_edges_that_theory_counts() {
    let c = find(CSG, 1.05, 0.05);
    // The sphere cuts the cube's edges off, as |(.75, .75, 0)| > 1, and leaves a circle on each face; each end of a cylinder
    // gives another. Inside, two cylinders meet where y² = z², which is an edge of the part where the third is farther
    // out: a quarter of an ellipse between two of the eight points x² = y² = z² = .08, twelve of them.
    let closed: Vec<f64> = c.edges.iter().filter(|e| e.closed).map(|e| e.length).collect();
    let rim = 2.0 * PI * (1.0f64 - 0.75 * 0.75).sqrt();
    assert_eq!(closed.iter().filter(|l| (*l / rim - 1.0).abs() < 1e-8).count(), 6, "{closed:?}");
    assert_eq!(closed.iter().filter(|l| (*l / (2.0 * PI * 0.4) - 1.0).abs() < 1e-8).count(), 6, "{closed:?}");
    // ∫ .4 √(1 + sin² φ) dφ from -π/4 to π/4, by Simpson's rule.
    let speed = |k: usize| 0.4 * (1.0 + ((k as f64 / 200.0 - 0.5) * PI / 2.0).sin().powi(2)).sqrt();
    let weight = |k: usize| if k == 0 || k == 200 { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
    let quarter: f64 = (0..=200).map(|k| weight(k) * speed(k)).sum::<f64>() * PI / 2.0 / 600.0;
    let open: Vec<f64> = c.edges.iter().filter(|e| !e.closed).map(|e| e.length).collect();
    assert_eq!((open.len(), c.corners.len()), (12, 8));
    open.iter().for_each(|l| near(*l, quarter, 1e-7));
}

#[test]
fn primitives_have_the_edges_that_they_should_have() {
    for (formula, corners, edges, length) in [
        ("box(2, 2, 2)", 8, 12, 24.0),
        ("complement(box(2, 2, 2))", 8, 12, 24.0),
        ("cylinder(r=0.7, h=1.5)", 0, 2, 4.0 * PI * 0.7),
        ("rounded_box(2, 1.5, 1, r=0.2)", 0, 0, 0.0),
        ("capsule(r=0.5, h=1)", 0, 0, 0.0),
        ("shell(box(2, 2, 2), thickness=0.2)", 8, 12, 21.6),
        ("cone(r1=1, r2=0.5, h=2)", 0, 2, 3.0 * PI),
        ("cone(r1=1, r2=0, h=2)", 1, 1, 2.0 * PI),
        ("rotate(cone(r1=1, r2=0, h=2), angle=0.7, ax=1, ay=0.4)", 1, 1, 2.0 * PI),
        ("repeat(box(0.4, 0.4, 0.4), px=0.9, nx=3)", 24, 36, 36.0 * 0.4),
        ("offset(box(2, 2, 2), d=-0.1)", 8, 12, 12.0 * 1.8),
        ("offset(box(2, 2, 2), d=0.1)", 0, 0, 0.0),
        ("smooth_union(sphere(r=1), torus(major=1.2, minor=0.3), k=0.1) - box(0.8, 0.8, 4)", 8, 12, f64::NAN),
        ("mirror(sphere(r=1))", 0, 0, 0.0),
        ("mirror(translate(sphere(r=1), x=0.6))", 0, 1, 1.6 * PI),
        ("quadratic_union(sphere(r=0.8), translate(sphere(r=0.8), x=0.9), k=0.3)", 0, 0, 0.0),
    ] {
        let c = find(formula, 1.8, 0.1);
        println!("{formula}: {} corners, {} edges, {}", c.corners.len(), c.edges.len(), c.length());
        assert_eq!((c.corners.len(), c.edges.len()), (corners, edges), "{formula}");
        if length > 0.0 {
            near(c.length(), length, 1e-6);
        }
    }
}

/// The creases that lead to the tip are too narrow to be seen just before it.
#[test]
fn edges_end_at_the_tip_of_a_cut_cone() {
    let cone = "intersection(cone(r1=1, r2=0, h=2), translate(box(2, 2, 4), x=1, y=1))";
    for formula in [cone, &format!("rotate({cone}, angle=0.7, ax=1, ay=0.4, az=0.2)")] {
        for spacing in [0.3, 0.04] {
            let c = find(formula, 1.8, spacing);
            assert_eq!((c.corners.len(), c.edges.len()), (4, 6), "{formula}");
            assert!(c.edges.iter().all(|e| e.ends == [End::Corner; 2]));
            near(c.length(), 4.0 + 2.0 * 5f64.sqrt() + 0.5 * PI, 1e-7);
        }
    }
}

#[test]
fn points_move_apart_for_the_sake_of_their_number() {
    let bounds = Aabb::new([-1.2; 3], [1.2; 3]);
    let with = |most: usize| {
        creases(&field(CUBE), &bounds, CreaseOptions { most, ..CreaseOptions::new(0.1) }).unwrap()
    };
    let c = with(usize::MAX);
    assert_eq!((c.points.len(), c.count(0.1), c.count(0.5)), (8 + 12 * 19, 8 + 12 * 19, 8 + 12 * 3));
    assert_eq!(with(236), c);
    // Seventeen or eighteen parts an edge instead of twenty; and no fewer than 1.2 times the spacing allows.
    assert_eq!(with(220).points.len(), 8 + 12 * 17);
    assert_eq!(with(10).points.len(), c.count(0.12));
}

#[test]
fn a_turned_or_scaled_cube_is_a_cube() {
    for (k, angle) in [0.3, 1.0, 2.2].into_iter().enumerate() {
        let axis = ["ax=0.3, ay=1, az=-0.2", "ax=1, ay=1, az=1", "ax=-0.1, ay=0.2, az=1"][k];
        let c = find(&format!("rotate(box(2, 2, 2), angle={angle}, {axis})"), 1.9, 0.1);
        assert_eq!((c.corners.len(), c.edges.len()), (8, 12), "{axis}");
        near(c.length(), 24.0, 1e-12);
        for p in &c.corners {
            let p = c.points[*p as usize];
            near(p.iter().map(|v| v * v).sum::<f64>(), 3.0, 1e-14);
        }
    }
    for size in [1e-6, 1e6] {
        let c =
            find(&format!("scale(rotate(box(2, 2, 2), angle=0.3, ax=1), s={size})"), 1.9 * size, 0.1 * size);
        assert_eq!((c.corners.len(), c.edges.len()), (8, 12), "{size}");
        near(c.length(), 24.0 * size, 1e-12);
        let c = find(&format!("scale(cylinder(r=1, h=2), s={size})"), 1.9 * size, 0.1 * size);
        assert_eq!((c.corners.len(), c.edges.len()), (0, 2), "{size}");
        near(c.length(), 4.0 * PI * size, 1e-8);
    }
}

#[test]
fn creases_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| find(CSG, 1.05, 0.07))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn bounds_end_creases() {
    let f = field(CUBE);
    let c = creases(&f, &Aabb::new([-1.2, -1.2, 0.25], [1.2, 1.2, 1.2]), CreaseOptions::new(0.1)).unwrap();
    let walls = c.edges.iter().flat_map(|e| e.ends).filter(|e| *e == End::Wall).count();
    assert_eq!((c.corners.len(), c.edges.len(), walls), (4, 8, 4));
    near(c.length(), 4.0 * 2.0 + 4.0 * 0.75, 1e-12);
}

#[test]
fn where_an_edge_fades_it_ends() {
    // The sides are z = 0 and z = .3 x y where that is below 0: along x = 0 and y = 0 they meet at the angles .3 |y| and
    // .3 x, which reach .02 at .0667.
    let c = find("max(z, z - 0.3*max(x, 0)*y)", 1.0, 0.1);
    assert_eq!(c.edges.len(), 2);
    for e in &c.edges {
        assert_eq!(e.ends.iter().filter(|e| **e == End::Fade).count(), 1, "{:?}", e.ends);
        near(e.length, 1.0 - 0.02 / 0.3, 1e-3);
    }
}

#[test]
fn what_is_opaque_says_so() {
    struct Black;
    impl isoswarm_field::Surface for Black {
        fn value_gradient(
            &self,
            p: &[[f64; 3]],
            value: &mut [f64],
            gradient: &mut [[f64; 3]],
        ) -> Result<(), isoswarm_field::FieldError> {
            for i in 0..p.len() {
                (value[i], gradient[i]) = (p[i][2], [0.0, 0.0, 1.0]);
            }
            Ok(())
        }
        fn hessian(&self, _: &[[f64; 3]], h: &mut [[f64; 6]]) -> Result<(), isoswarm_field::FieldError> {
            h.fill([0.0; 6]);
            Ok(())
        }
    }
    let c = creases(&Black, &Aabb::new([-1.0; 3], [1.0; 3]), CreaseOptions::new(0.1)).unwrap();
    assert!(c.edges.is_empty() && !c.certified && c.warnings.len() == 1);
}

fn sampled(formula: &str, half: f64, n: usize) -> isoswarm_particles::Samples {
    use isoswarm_particles::{Amount, Options, Status, sample};
    let options = Options {
        amount: Amount::Count(n),
        creases: Some(isoswarm_particles::creases::find),
        ..Options::default()
    };
    let s = sample(&field(formula), &Aabb::new([-half; 3], [half; 3]), options).unwrap();
    assert_eq!(s.points.len(), n);
    let c = s.creases.as_ref().unwrap();
    assert_eq!(s.points[..c.points.len()], c.points[..]);
    println!("{formula} {n}: {:?} {}", s.report, c.points.len());
    assert_eq!(s.report.status, Status::Converged);
    assert!((s.report.area - s.areas.iter().sum::<f64>()).abs() < 1e-9 * s.report.area);
    s
}

#[test]
fn more_samples_are_taken_where_edges_need_them() {
    use isoswarm_particles::{Amount, Options, sample};
    let (f, bounds) = (field(CSG), Aabb::new([-1.05; 3], [1.05; 3]));
    let with = |amount: Amount, more: bool| {
        let creases = Some(isoswarm_particles::creases::find as isoswarm_particles::FindCreases);
        sample(&f, &bounds, Options { amount, more, creases, ..Options::default() }).unwrap()
    };
    for amount in [Amount::Count(100), Amount::Spacing(0.6)] {
        let few = with(amount, false);
        assert!(few.creases.is_none() && few.report.more.is_none());
        let more = with(amount, true);
        let n = more.points.len();
        let on = more.creases.as_ref().unwrap().points.len();
        assert_eq!(more.report.more, Some(n));
        assert!(2 * on < n && n < 100 + 3 * on, "{on} of {n}");
        // What the warning names does.
        let named = |w: &String| w.split("at least ").nth(1).and_then(|t| t.parse().ok());
        let least = few.report.warnings.iter().find_map(named).unwrap();
        let enough = with(Amount::Count(least), false);
        assert!(enough.creases.is_some() && enough.points.len() == least);
    }
}

#[test]
fn samples_of_a_cube_stand_on_its_edges_and_its_area_is_right() {
    for n in [1000, 5000] {
        let s = sampled(CUBE, 1.2, n);
        near(s.report.area, 24.0, 1e-12);
        let on = s.creases.as_ref().unwrap().points.len();
        for p in &s.points[on..] {
            let mut q = p.map(f64::abs);
            q.sort_by(f64::total_cmp);
            assert!(1.0 - q[1] > 0.5 * s.report.spacing, "{p:?}");
        }
    }
}

#[test]
fn areas_next_to_creases_are_of_second_order() {
    for (formula, area) in [
        ("max(x^2 + y^2 - 1, abs(z) - 1)", 6.0 * PI),
        ("min((x - 0.6)^2 + y^2 + z^2 - 1, (x + 0.6)^2 + y^2 + z^2 - 1)", 6.4 * PI),
    ] {
        let off = |n: usize| (sampled(formula, 1.8, n).report.area / area - 1.0).abs();
        let (coarse, fine) = (off(1500), off(6000));
        println!("{coarse:e} {fine:e}");
        assert!(fine < 1e-3 && fine < 0.5 * coarse, "{coarse} {fine}");
    }
}

#[test]
fn parts_are_sampled_evenly() {
    sampled(CSG, 1.05, 5000);
    sampled("smooth_union(sphere(r=1), torus(major=1.2, minor=0.3), k=0.1) - box(0.8, 0.8, 4)", 1.8, 4000);
    sampled("cone(r1=1, r2=0, h=2)", 1.2, 2000);
}

#[test]
fn a_large_part_has_all_its_edges() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/csg_part.vm")).unwrap();
    let f = Field::new(&isoswarm_field::vm::parse_vm(&text).unwrap()).unwrap();
    let c = creases(&f, &Aabb::new([-1.1; 3], [1.1; 3]), CreaseOptions::new(0.05)).unwrap();
    let lost = c.edges.iter().filter(|e| !e.closed).flat_map(|e| e.ends).filter(|e| *e == End::Lost).count();
    println!("{} corners, {} edges, {} lost, {:?}", c.corners.len(), c.edges.len(), lost, c.warnings);
    // Each end of an edge is a corner with at least three.
    let mut ends = vec![0; c.points.len()];
    for e in c.edges.iter().filter(|e| !e.closed) {
        ends[e.points[0] as usize] += 1;
        ends[*e.points.last().unwrap() as usize] += 1;
    }
    let few: Vec<_> =
        c.corners.iter().filter(|i| ends[**i as usize] < 3).map(|i| c.points[*i as usize]).collect();
    println!("{} corners with fewer than three edges: {few:?}", few.len());
    assert!((900..915).contains(&c.corners.len()) && lost == 0 && few.len() <= 8);
}

/// A trace takes steps of .0225 along the edge; a notch in it is not passed over.
#[test]
fn notches_narrower_than_a_step_are_found() {
    for width in [0.02, 0.005, 0.001] {
        let f = format!("box(2, 2, 2) - translate(box({width}, 0.4, 0.4), x=0.137, y=1, z=1)");
        let c = creases(&field(&f), &Aabb::new([-1.1; 3], [1.1; 3]), CreaseOptions::new(0.2)).unwrap();
        // Eight corners and twelve edges of the box, one of them in two; four corners and four edges on each side of the notch, three along it.
        assert_eq!((c.corners.len(), c.edges.len()), (16, 24), "{width}: {:?}", c.warnings);
        let length = 24.0 - width + 8.0 * 0.2 + 3.0 * width;
        assert!((c.length() - length).abs() < 1e-9, "{width}: {} instead of {length}", c.length());
    }
}
