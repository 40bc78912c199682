//! Where rays meet surfaces: against closed forms and against brute force.

use std::sync::atomic::AtomicBool;

use isoswarm_field::vector::{V3, dot, norm, sub};
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
