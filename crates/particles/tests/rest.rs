//! Floaters on a surface at rest come to rest themselves: births and deaths cease.

use isoswarm_field::{Aabb, Field, text};
use isoswarm_particles::floaters::{Floaters, Parameters};
use isoswarm_particles::{Amount, Options, sample};

/// With radii at σ̂ the mean distance to the nearest neighbour settles at this many σ̂.
const NEAREST: f64 = 1.72;

/// Births and deaths in each of so many runs of 50 steps, from even samples.
fn unrest(formula: &str, n: usize, runs: usize) -> Vec<(usize, usize, usize)> {
    let field = Field::new(&text::parse(formula, &[]).unwrap()).unwrap();
    let found = field.bounds().unwrap();
    let bounds = found.grown(0.05 * found.diagonal());
    let options = Options { amount: Amount::Count(n), ..Options::default() };
    let samples = sample(&field, &bounds, options).unwrap();
    let spacing = samples.report.spacing;
    let mut floaters = Floaters::new(&samples.points, 0.85 * spacing / NEAREST);
    let diameter = Aabb::around(&samples.points).unwrap().diagonal();
    let parameters = Parameters::live(diameter, spacing / NEAREST);
    (0..runs)
        .map(|_| {
            let (mut births, mut deaths) = (0, 0);
            for _ in 0..50 {
                let happened = floaters.step(&field, &bounds, &[], &parameters, 0, &mut 0).unwrap();
                births += happened.births;
                deaths += happened.deaths;
            }
            (births, deaths, floaters.len())
        })
        .collect()
}

#[test]
fn births_cease_on_a_smooth_surface() {
    let found = unrest("smooth_union(sphere(1), translate(sphere(0.6), x=1), k=0.2)", 600, 4);
    assert_eq!((found[3].0, found[3].1), (0, 0), "{found:?}");
}

#[test]
fn births_cease_at_sharp_edges() {
    // Edges of all angles down to knife edges, where a ball cuts a thin wall.
    let found = unrest("shell(gyroid(period=1.1), thickness=0.32) & sphere(1)", 1500, 4);
    // A lens: one edge of 60 degrees all around.
    let lens = unrest("translate(sphere(1), z=-0.866) & translate(sphere(1), z=0.866)", 400, 4);
    assert_eq!((lens[3].0, lens[3].1), (0, 0), "{lens:?}");
    assert_eq!((found[3].0, found[3].1), (0, 0), "{found:?}");
}
