//! Floaters that go on from an earlier result.

use isoswarm_field::Surface;

use crate::Error;
use crate::constraint::{Target, project};
use crate::neighbors::Grid;
use crate::population::linear;
use crate::run::Run;
use crate::seeding::Seeds;
use crate::swarm::Swarm;
use crate::vector::{V3, distance};

/// How far from a place on the surface the next of the earlier points may be, in square roots of their mean cell (random points
/// leave no such gap), and the part of the surface that may have none.
const SIGHT: f64 = 2.0;
const BARE: f64 = 0.01;

/// Floaters from earlier points, projected onto the surface; those that do not get there are left out, and components
/// without any get a seed. `None`, with a warning, where they are too few for the `coarsest` level on the way to `n` or
/// leave a part of the surface bare: what they cover would be all that is sampled.
pub(crate) fn resume(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    start: &[V3],
    weights: &[f64],
    n: usize,
    coarsest: usize,
) -> Result<Option<Swarm>, Error> {
    let (walls, axes) = (seeds.walls, seeds.walls.axes);
    let unit = linear(seeds.area / n as f64, axes);
    let mut points: Vec<V3> = start.iter().map(|&p| walls.clamp(p)).collect();
    let mut normals = vec![[0.0; 3]; points.len()];
    let target = Target { tolerance: 1e-6 * unit, longest: unit, least: seeds.least, rounds: 12 };
    let left = project(surface, &mut run.evaluations, &walls, &mut points, &mut normals, target)?;
    let label = seeds.nearest_labels(&points, &normals);
    let mut swarm = Swarm::default();
    for i in (0..points.len()).filter(|&i| left[i] <= 0.05 * unit) {
        swarm.push(points[i], normals[i], label[i], None);
    }
    if 2 * swarm.len() < coarsest {
        run.warnings.push(format!(
            "start: {} of its {} points are on the surface, too few to go on from to {n} samples: sampled afresh",
            swarm.len(),
            start.len()
        ));
        return Ok(None);
    }
    let bare = bare_part(seeds, &swarm.points, weights);
    if bare > BARE {
        run.warnings.push(format!(
            "start: its points leave {:.0} % of the surface bare: sampled afresh",
            (100.0 * bare).ceil()
        ));
        return Ok(None);
    }
    let mut represented = vec![false; seeds.components];
    swarm.label.iter().for_each(|&l| represented[l as usize] = true);
    for i in 0..seeds.points.len() {
        let l = seeds.label[i];
        if !std::mem::replace(&mut represented[l as usize], true) {
            swarm.push(seeds.points[i], seeds.normals[i], l, None);
        }
    }
    Ok(Some(swarm))
}

/// The part of the surface, judged by its uniform seeds, that is farther from all points than [`SIGHT`].
fn bare_part(seeds: &Seeds<'_>, points: &[V3], weights: &[f64]) -> f64 {
    let reach = SIGHT * linear(seeds.area / points.len() as f64, seeds.walls.axes);
    // Where fewer are wanted, fewer do.
    let reach = |i: usize| reach / linear(weights.get(i).copied().unwrap_or(1.0), seeds.walls.axes);
    let widest = (0..seeds.uniform).map(reach).fold(0.0, f64::max);
    let grid = Grid::new(points, None, widest);
    let is_bare = |&i: &usize| {
        let mut near = false;
        grid.near(seeds.points[i], reach(i), |j| {
            near |= distance(points[j as usize], seeds.points[i]) <= reach(i);
        });
        !near
    };
    (0..seeds.uniform).filter(is_bare).count() as f64 / seeds.uniform.max(1) as f64
}
