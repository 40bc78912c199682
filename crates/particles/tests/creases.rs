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
    // Cube and ball: a circle on each face (the sphere cuts the cube's edges off as |(.75, .75, 0)| > 1). Cube and cylinders:
    // a circle on each face. Cylinders among each other, inside: of the curves of each pair, x = +-y, what lies outside of
    // the third: 8 corners where all three meet (x² = y² = z² = .08), 12 half ellipses between... see the counts below.
    let closed: Vec<f64> = c.edges.iter().filter(|e| e.closed).map(|e| e.length).collect();
    let rim = 2.0 * PI * (1.0f64 - 0.75 * 0.75).sqrt();
    assert_eq!(closed.iter().filter(|l| (*l / rim - 1.0).abs() < 1e-8).count(), 6, "{closed:?}");
    assert_eq!(closed.iter().filter(|l| (*l / (2.0 * PI * 0.4) - 1.0).abs() < 1e-8).count(), 6, "{closed:?}");
    for e in &c.edges {
        println!("{} {:?} {} {:?}", e.length, e.ends, e.closed, c.points[e.points[0] as usize]);
    }
    println!("{:?}", c.corners.iter().map(|&i| c.points[i as usize]).collect::<Vec<_>>());
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
