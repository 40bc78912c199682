//! Independent points, uniform by area (or by a density): for Monte Carlo.

use isoswarm_field::Surface;

use crate::Error;
use crate::finish::finish;
use crate::options::{Density, Phase};
use crate::population::linear;
use crate::report::{Samples, Status};
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::{Seeds, draw};
use crate::sizing::Sizing;
use crate::swarm::Swarm;
use crate::vector::unit;

/// Evaluations along a line through a box before roots are isolated: twice as many as seeding takes, since here a pair
/// of roots that is overlooked is a bias.
const STATIONS: usize = 5;
/// Lines of one batch.
const BATCH: usize = 1 << 17;
/// Batches without a single point after which the search is given up.
const PATIENCE: usize = 64;

/// `n` independent points.
pub(crate) fn scatter(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    n: usize,
    density: Density<'_>,
) -> Result<Samples, Error> {
    let axes = seeds.walls.axes;
    let all = seeds.uniform_swarm();
    let apart = linear(seeds.area / all.len().max(1) as f64, axes);
    let (sizing, relative) = Sizing::new(density, surface, &all, apart, axes)?;
    // The seeds show how far the density rises above its mean, about; beyond that it is cut off.
    let most = relative.iter().fold(0.0f64, |m, &d| m.max(d)) * 1.1;
    let rng = Rng::new(run.seed, Stream::Probes);
    let (mut swarm, mut idle) = (Swarm::default(), 0);
    for batch in 0u64.. {
        let missing = n - swarm.len();
        if missing == 0
            || idle > PATIENCE
            || !run.tell(Phase::Seeding, 0.9 * swarm.len() as f64 / n as f64, swarm.len())
        {
            break;
        }
        // About one line in ten gives a point.
        let lines = (12 * missing + 256).min(BATCH);
        let own = rng.child(batch);
        let found = match draw(&seeds.region, run, axes, lines, STATIONS, own) {
            Err(_) if run.stop.is_some() => break,
            other => other?,
        };
        idle = if found.is_empty() { idle + 1 } else { 0 };
        let mut fresh = Swarm::default();
        for (p, g) in found {
            fresh.push(p, unit(g), 0, None);
        }
        let mut keep: Vec<u32> = (0..fresh.len() as u32).collect();
        if !sizing.is_uniform() {
            sizing.apply(surface, &mut fresh, apart, axes)?;
            let dense = |i: u32| fresh.size[i as usize].powi(if axes == 2 { -1 } else { -2 });
            let chance = rng.child(!batch);
            keep.retain(|&i| chance.unit(u64::from(i)) * most < dense(i));
            fresh.size.clear();
        }
        keep.truncate(missing);
        for i in keep {
            swarm.push(fresh.points[i as usize], fresh.normals[i as usize], 0, None);
        }
    }
    swarm.label = seeds.nearest_labels(&swarm.points, &swarm.normals);
    let status = match run.stop {
        Some(why) => Status::NotConverged(why.reason().into()),
        None if swarm.len() < n => {
            Status::NotConverged("too few lines meet the surface; narrow the bounds".into())
        }
        None => Status::Converged,
    };
    let mean = linear(seeds.area / swarm.len().max(1) as f64, axes);
    let mut samples = finish(run, surface, seeds, swarm, mean, status, None)?;
    // Cells of independent points say little; each stands for the same share.
    let share = seeds.area / samples.points.len().max(1) as f64;
    if sizing.is_uniform() {
        samples.areas.fill(share);
        samples.radii.fill(0.5 * mean);
        samples.report.area = seeds.area;
    }
    Ok(samples)
}
