//! WH94's three schemes from start to end, so that they can be compared with each other and with the default method.

use isoswarm_field::{Aabb, Surface};

use super::{Floaters, Parameters};
use crate::Error;
use crate::even::spacing_for_count;
use crate::finish::finish;
use crate::options::{Amount, Method, Phase};
use crate::population::linear;
use crate::report::{Samples, Status};
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::Seeds;
use crate::swarm::Swarm;
use crate::vector::{V3, norm};

/// Most steps by default.
pub(crate) const STEPS: usize = 400;
/// Radius in square roots of the mean cell for a fixed radius.
const SIGMA: f64 = 0.45;
/// With radii at σ̂ the mean distance to the nearest neighbour settles at this many σ̂ on surfaces, and on curves.
const NEAREST: f64 = 1.72;
const NEAREST_ON_CURVES: f64 = 1.12;
/// Speed in σ per unit of time below which floaters are at rest: root mean square.
const RESTING: f64 = 0.15;

/// Runs a scheme for at most so many steps. `Simple` meets a number of samples exactly, the others about; the report
/// says so.
pub(crate) fn run(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    method: Method,
    n: usize,
    amount: Amount,
    steps: usize,
) -> Result<Samples, Error> {
    let walls = seeds.walls;
    let bounds = Aabb::new(walls.lo, walls.hi);
    let unit = linear(seeds.area / n as f64, walls.axes);
    let diameter = Aabb::around(&seeds.points).map_or(unit, |b| b.diagonal());
    let spacing = match amount {
        Amount::Spacing(s) => s,
        Amount::Count(_) => spacing_for_count(seeds.area, n, walls.axes),
    };
    let sigma_hat = spacing / if walls.axes == 2 { NEAREST_ON_CURVES } else { NEAREST };
    let mut parameters = Parameters::new(diameter, sigma_hat);
    let rng = Rng::new(run.seed, Stream::Thinning);
    let firsts = firsts(seeds);
    let mut floaters = match method {
        Method::Simple => {
            let points = (0..n).map(|k| seeds.points[(rng.unit(k as u64) * seeds.uniform as f64) as usize]);
            let points: Vec<V3> = points.collect();
            Floaters::new(&points, SIGMA * unit)
        }
        Method::Fissioning => {
            Floaters::new(&firsts, SIGMA * linear(seeds.area / firsts.len() as f64, walls.axes))
        }
        _ => Floaters::new(&firsts, sigma_hat.min(0.25 * diameter)),
    };
    if method == Method::Simple {
        separate(&mut floaters, &walls, unit, run.seed);
    }
    parameters.adaptive = method == Method::Adaptive;
    let (mut settled, mut quiet) = (false, 0);
    for k in 0..steps {
        let count = &mut run.evaluations;
        let happened = floaters.step(surface, &bounds, &[], &parameters, run.seed, count)?;
        run.births += happened.births as u64;
        run.deaths += happened.deaths as u64;
        run.steps += 1;
        if !run.tell(Phase::Relaxing, 0.1 + 0.8 * k as f64 / steps as f64, floaters.len()) {
            break;
        }
        quiet = if happened.births + happened.deaths == 0 { quiet + 1 } else { 0 };
        let speed =
            floaters.velocity.iter().zip(&floaters.sigma).map(|(&v, s)| (norm(v) / s).powi(2)).sum::<f64>();
        let resting = (speed / floaters.len() as f64).sqrt() < RESTING;
        if method == Method::Fissioning && floaters.len() < n && (resting || k + 1 >= steps / 2) {
            run.births += floaters.len() as u64;
            floaters.split_all(&bounds, walls.axes, run.seed);
            quiet = 0;
            continue;
        }
        if resting && quiet > 20 {
            settled = true;
            break;
        }
    }
    let mut swarm = Swarm::default();
    let labels = seeds.nearest_labels(&floaters.points, &floaters.normals);
    for i in 0..floaters.len() {
        swarm.push(floaters.points[i], floaters.normals[i], labels[i], None);
    }
    let swarm = swarm.sorted(2.0 * unit);
    let status = match run.stop {
        Some(why) => Status::NotConverged(why.reason().into()),
        None if !settled => Status::NotConverged(format!("the floaters still moved after {steps} steps")),
        None => Status::Converged,
    };
    if method != Method::Simple && matches!(amount, Amount::Count(_)) && swarm.len() != n {
        run.warnings
            .push(format!("this scheme meets a number only about: {} samples for n = {n}", swarm.len()));
    }
    let unit = linear(seeds.area / swarm.len() as f64, walls.axes);
    finish(run, surface, seeds, swarm, unit, status, None)
}

/// The first seed of each component.
fn firsts(seeds: &Seeds<'_>) -> Vec<V3> {
    let mut seen = vec![false; seeds.components];
    (0..seeds.points.len())
        .filter(|&i| !std::mem::replace(&mut seen[seeds.label[i] as usize], true))
        .map(|i| seeds.points[i])
        .collect()
}

/// A seed may be drawn twice: moves every floater a little.
fn separate(floaters: &mut Floaters, walls: &crate::constraint::Walls, unit: f64, seed: u64) {
    let rng = Rng::new(seed, Stream::Jitter);
    for i in 0..floaters.len() {
        let way = rng.direction(i as u64, walls.axes);
        floaters.points[i] = walls.clamp(crate::vector::along(floaters.points[i], 0.3 * unit, way));
    }
}
