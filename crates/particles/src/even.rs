//! The default method: relaxed coarse to fine.
//!
//! A coarse swarm is cheap, settles large-scale differences of density, and freezes into a lattice with few defects.
//! Each refinement puts a floater on every edge of the Delaunay stars: four times as many on a lattice twice as fine,
//! with as many defects as before. So few steps are left to do at full resolution.

use isoswarm_field::Surface;

use crate::constraint::Walls;
use crate::options::{Amount, Phase};
use crate::population::{self, Turnover, linear};
use crate::relax::Relaxation;
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::Seeds;
use crate::swarm::Swarm;
use crate::Error;

/// σ in square roots of the mean cell while a swarm finds its order, and when it is finished.
const SIGMA: f64 = 0.45;
const SIGMA_LAST: f64 = 0.42;
/// A coarse level has at least this many floaters, and as many times the number of components.
const COARSEST: usize = 300;
const PER_COMPONENT: usize = 12;
/// Mean distance between nearest neighbours in square roots of the mean cell, when relaxed: .96 of the hexagonal one.
const NEAREST: f64 = 1.03;
/// Root mean square displacement in σ at which a swarm counts as settled.
const SETTLED: f64 = 4e-3;

/// What came of it.
pub(crate) struct Spread {
    pub(crate) swarm: Swarm,
    /// Square root of the area of a size-1 cell (the length of one, on curves).
    pub(crate) unit: f64,
    /// Why it is not converged.
    pub(crate) unmet: Option<String>,
}

/// Spreads floaters over a surface from its seeds.
pub(crate) fn spread<'s>(
    run: &mut Run<'_>,
    surface: &'s dyn Surface,
    seeds: &Seeds<'_>,
    amount: Amount,
    last_steps: usize,
) -> Result<Spread, Error> {
    let walls = seeds.walls;
    let e = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    let n = match amount {
        Amount::Count(n) => n,
        Amount::Spacing(s) => count_for(seeds.area, s / NEAREST, walls.axes).max(seeds.components),
    };
    let levels = levels_for(n, seeds.components, walls.axes).min(e("LEVELS", 9.0) as u32);
    let factor = if walls.axes == 2 { 1 } else { 2 };
    let n0 = n >> (factor * levels);
    let mut work = Work {
        run,
        surface,
        walls,
        least: seeds.least,
        unit: linear(seeds.area / n0 as f64, walls.axes),
        relaxation: Relaxation::new(surface, walls, Swarm::default(), 1.0, seeds.least),
    };
    let swarm = choose(seeds, n0, Rng::new(work.run.seed, Stream::Thinning));
    work.take(swarm, SIGMA);
    // Coarsest level: large-scale order.
    let coarse = e("COARSE", 100.0) as usize;
    for k in 0..coarse {
        if k == coarse / 8 || k == coarse / 4 || k == coarse / 2 {
            work.balance(n0, SIGMA)?;
        }
        work.step(0.1 + 0.2 * k as f64 / coarse as f64)?;
    }
    for level in (0..levels).rev() {
        let target = n >> (factor * level);
        work.refine(SIGMA)?;
        let middle = e("MIDDLE", 16.0) as usize;
        for k in 0..if level > 0 { middle } else { 6 } {
            if k == 4 {
                let t = work.balance(target, SIGMA)?;
                if e("TALK", 0.0) > 0.0 { eprintln!("level {level} {target} {t:?}"); }
            }
            work.step(0.3)?;
        }
    }
    let mut last = crate::relax::Moved::default();
    for k in 0..last_steps {
        if k == e("B2", 8.0) as usize {
            let t = work.balance(n, SIGMA)?;
            if e("TALK", 0.0) > 0.0 { eprintln!("last {t:?}"); }
        }
        if k == e("LATE", 12.0) as usize {
            work.relaxation.sigma = SIGMA_LAST * work.unit;
        }
        last = work.step(0.5 + 0.4 * k as f64 / last_steps as f64)?;
        if e("TALK", 0.0) > 1.0 { eprintln!("{k} {:.4}", last.rms); }
        if k > 16 && last.rms < e("SETTLED", SETTLED) {
            break;
        }
    }
    work.run.evaluations += work.relaxation.evaluations;
    let unmet = (last.rms > 5.0 * SETTLED).then(|| format!("still moving by {:.3} σ a step", last.rms));
    Ok(Spread { swarm: work.relaxation.swarm, unit: work.unit, unmet })
}

/// Floaters that make a cell of the linear size `unit`.
fn count_for(area: f64, unit: f64, axes: usize) -> usize {
    (area / if axes == 2 { unit } else { unit * unit }).round().max(1.0) as usize
}

fn levels_for(n: usize, components: usize, axes: usize) -> u32 {
    let coarsest = COARSEST.max(PER_COMPONENT * components);
    let factor = if axes == 2 { 1 } else { 2 };
    let mut levels = 0;
    while n >> (factor * (levels + 1)) >= coarsest && levels < 12 {
        levels += 1;
    }
    levels
}

/// `n` of the seeds: one for each component, the others at random among those that are uniform by area.
fn choose(seeds: &Seeds<'_>, n: usize, rng: Rng) -> Swarm {
    let mut order: Vec<(u64, usize)> = (0..seeds.points.len()).map(|i| (rng.bits(i as u64), i)).collect();
    order.sort_unstable();
    let mut chosen = vec![false; seeds.points.len()];
    let mut represented = vec![false; seeds.components];
    let mut left = n;
    for &(_, i) in &order {
        let l = seeds.label[i] as usize;
        if !represented[l] && left > 0 {
            represented[l] = true;
            chosen[i] = true;
            left -= 1;
        }
    }
    for &(_, i) in &order {
        if left > 0 && !chosen[i] && i < seeds.uniform {
            chosen[i] = true;
            left -= 1;
        }
    }
    let mut swarm = Swarm::default();
    for i in (0..seeds.points.len()).filter(|&i| chosen[i]) {
        swarm.push(seeds.points[i], seeds.normals[i], seeds.label[i], None);
    }
    swarm
}

struct Work<'w, 'a, 's> {
    run: &'w mut Run<'a>,
    surface: &'s dyn Surface,
    walls: Walls,
    least: f64,
    unit: f64,
    relaxation: Relaxation<'s>,
}

impl Work<'_, '_, '_> {
    /// Makes `swarm` the present one, in spatial order.
    fn take(&mut self, swarm: Swarm, sigma: f64) {
        self.relaxation.reset(swarm.sorted(2.0 * self.unit), sigma * self.unit);
    }

    fn step(&mut self, fraction: f64) -> Result<crate::relax::Moved, Error> {
        let moved = self.relaxation.step()?;
        self.run.steps += 1;
        self.run.tell(Phase::Relaxing, fraction, self.relaxation.swarm.len());
        Ok(moved)
    }

    fn balance(&mut self, n: usize, sigma: f64) -> Result<Turnover, Error> {
        let mut swarm = std::mem::take(&mut self.relaxation.swarm);
        let rng = Rng::new(self.run.seed, Stream::Death).child(self.run.steps as u64);
        let count = &mut self.run.evaluations;
        let done = population::balance(
            &mut swarm, self.surface, count, &self.walls, self.least, self.unit, n, rng,
        )?;
        self.run.births += done.births as u64;
        self.run.deaths += done.deaths as u64;
        self.unit = linear(done.share, self.walls.axes);
        self.take(swarm, sigma);
        Ok(done)
    }

    fn refine(&mut self, sigma: f64) -> Result<(), Error> {
        let mut swarm = std::mem::take(&mut self.relaxation.swarm);
        let before = swarm.len();
        let count = &mut self.run.evaluations;
        let born = population::refine(&mut swarm, self.surface, count, &self.walls, self.least, self.unit)?;
        self.run.births += born as u64;
        let ratio = before as f64 / swarm.len() as f64;
        self.unit *= linear(ratio, self.walls.axes);
        self.take(swarm, sigma);
        self.relaxation.rest();
        Ok(())
    }
}
