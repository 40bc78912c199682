//! WH94, figures 1 and 2.

use isoswarm::field::{Aabb, Field, text};
use isoswarm::particles::floaters::{Floaters, Parameters};
use isoswarm::particles::metrics::evenness;
use isoswarm::particles::{Amount, Options, sample};

use isoswarm::scene::Scene;

use crate::story::{diameter, off_surface, open, script, value};

/// Figure 1: a blobby cylinder is stretched to four times its length in ten steps; floaters catch up and even out. How uneven they
/// are at once, after thirty more steps and after fifty, and how many there are before and after.
#[test]
fn figure_1_a_stretched_cylinder_is_covered_again() {
    let model = text::parse("blobby_cylinders(0.5, -0.5, 0, 0, 0.5, 0, 0, 0.363)", &[]).unwrap();
    let mut field = Field::new(&model).unwrap();
    let bounds = Aabb::new([-4.0, -1.5, -1.5], [4.0, 1.5, 1.5]);
    let start =
        sample(&field, &bounds, Options { amount: Amount::Count(281), ..Options::default() }).unwrap();
    let parameters = Parameters::live(5.0, start.report.spacing / 1.72);
    let mut floaters = Floaters::new(&start.points, 0.85 * parameters.sigma_hat);
    let step = |field: &Field, floaters: &mut Floaters| {
        floaters.step(field, &bounds, &[], &parameters, 0, &mut 0).unwrap();
    };
    (0..100).for_each(|_| step(&field, &mut floaters));
    let before = floaters.len();
    let (a, b) =
        (field.parameter("blobby_cylinders/ax0").unwrap(), field.parameter("blobby_cylinders/bx0").unwrap());
    for k in 1..=10 {
        let half = 0.5 * (1.0 + 0.3 * f64::from(k));
        field.set_value(a, -half).unwrap();
        field.set_value(b, half).unwrap();
        step(&field, &mut floaters);
    }
    let cv = |f: &Floaters| evenness(&f.points, &f.normals, None, 3).cv;
    let stretched = cv(&floaters);
    (0..30).for_each(|_| step(&field, &mut floaters));
    let thirty = cv(&floaters);
    (0..20).for_each(|_| step(&field, &mut floaters));
    let (fifty, after) = (cv(&floaters), floaters.len());
    println!(
        "CV {stretched:.3}, {thirty:.3} after 30 steps, {fifty:.3} after 50; {before} floaters, then {after}"
    );
    assert!((270..=292).contains(&before), "{before}");
    assert!(thirty < 0.11, "{thirty}");
    assert!(fifty < 0.05, "{fifty}");
    assert!(stretched > 2.0 * thirty.max(fifty), "torn apart, then mended: {stretched}, {thirty}, {fifty}");
    // As many for each area as before.
    let area = |field: &Field| {
        let options = Options { amount: Amount::Count(4000), ..Options::default() };
        sample(field, &bounds, options).unwrap().report.area
    };
    let long = area(&field);
    field.set_value(a, -0.5).unwrap();
    field.set_value(b, 0.5).unwrap();
    let density = (after as f64 / long) / (before as f64 / area(&field));
    assert!((density - 1.0).abs() < 0.06, "{before} floaters became {after}: density {density}");
}

/// Figure 2: three superimposed blobby cylinders become a shape by dragging points.
#[test]
fn figure_2_three_cylinders_become_a_shape() {
    let mut scene = open("three_cylinders");
    let bits = |s: &Scene| -> Vec<u64> { s.field().parameters().iter().map(|p| p.value.to_bits()).collect() };
    let mut drags = 0;
    for entry in script("three_cylinders") {
        let (locked, before) = (scene.field().parameters().to_vec(), bits(&scene));
        let Some(drag) = scene.apply(entry.command).unwrap().drag else { continue };
        drags += 1;
        assert!(drag.reached, "{drag:?}");
        // What is locked for this drag keeps every bit; what is not has moved.
        let same: Vec<bool> = before.iter().zip(bits(&scene)).map(|(a, b)| *a == b).collect();
        assert!((0..same.len()).all(|i| same[i] || !locked[i].frozen), "drag {drags}");
        assert!(same.contains(&false), "drag {drags}");
    }
    assert_eq!(drags, 4);
    let size = diameter(&scene);
    assert!(scene.residuals().unwrap().iter().all(|d| *d < 1e-6 * size), "{:?}", scene.residuals());
    assert!(off_surface(&scene) < 1e-3 * size);
    assert_eq!(value(&scene, "blobby_cylinders/bias").to_bits(), 0.5f64.to_bits());
    let f = scene.frame().floaters;
    let e = evenness(&f.points, &f.normals, None, 3);
    assert!(e.cv < 0.1, "{e:?}");
    // Three limbs: the surface passes where each was drawn to.
    let reaches = |p: [f64; 3]| {
        f.points
            .iter()
            .map(|q| (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt())
            .fold(f64::INFINITY, f64::min)
    };
    for p in [[-1.7, -1.1, 0.6], [2.0, -0.4, -0.3], [-0.1, 0.9, 0.1]] {
        assert!(reaches(p) < 1.5 * scene.frame().spacing, "{p:?}: {}", reaches(p));
    }
}
