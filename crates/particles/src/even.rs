//! The default method: relaxed coarse to fine.
//!
//! A coarse swarm is cheap, settles large-scale differences of density, and freezes into a lattice with few defects.
//! Each refinement puts a floater on every edge of the Delaunay stars: four times as many on a lattice twice as fine,
//! with as many defects as before. So few steps are left to do at full resolution.

use isoswarm_field::Surface;

use crate::Error;
use crate::constraint::Walls;
use crate::constraint::{Target, project};
use crate::options::{self, Amount, Density};
use crate::population::{self, Habitat, linear};
use crate::relax::{Moved, Relaxation};
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::Seeds;
use crate::sizing::Sizing;
use crate::swarm::Swarm;
use crate::vector::V3;

/// How a phase of the relaxation goes: σ in square roots of the mean cell, gain, momentum.
#[derive(Clone, Copy)]
struct Phase {
    sigma: f64,
    gain: f64,
    momentum: f64,
}

/// From random points. A gain of .72 is α Δt = 6 × .12 in WH94's units; 1.1 diverges on random points.
const ROUGH: Phase = Phase { sigma: 0.45, gain: 0.72, momentum: 0.9 };
/// From a lattice, whose floaters keep their distance and bear longer steps.
const REFINED: Phase = Phase { sigma: 0.45, gain: 1.4, momentum: 0.9 };
/// Slow modes at the last level.
const SETTLING: Phase = Phase { sigma: 0.42, gain: 2.0, momentum: 0.9 };
/// Nearest neighbours only: evens out the distances around defects. The smaller σ, the softer the lattice, the larger
/// the gain.
const POLISHING: Phase = Phase { sigma: 0.31, gain: 5.0, momentum: 0.87 };

/// Steps at the coarsest level, at each between, and at the last one: before settling, most while settling
/// (`Options::steps`), and polishing.
const COARSE_STEPS: usize = 100;
const MIDDLE_STEPS: usize = 16;
const FIRST_STEPS: usize = 10;
pub(crate) const SETTLING_STEPS: usize = 60;
const POLISHING_STEPS: usize = 9;
/// Steps of settling after which the gain falls by a factor every so many.
const PATIENCE: usize = 36;
const CALMING_EVERY: usize = 2;
const CALMER: f64 = 0.75;
/// Steps after a refinement until the population is brought to its number.
const BEFORE_BALANCE: usize = 4;
/// Steps that bring floaters from an earlier run to a new number and density.
const AGAIN_STEPS: usize = 40;
/// Steps until the density is asked again.
const SIZING_STEPS: usize = 4;
/// Most corrections of the number for a spacing.
const CORRECTIONS: usize = 3;

/// A coarse level has at least this many floaters, and as many times the number of components.
const COARSEST: usize = 300;
const PER_COMPONENT: usize = 12;
/// Mean distance between nearest neighbours in square roots of the mean cell, when relaxed: .96 of the hexagonal one.
const NEAREST: f64 = 1.03;
/// Root mean square displacement of a step in σ at which a swarm counts as settled: further steps change its evenness
/// little.
const SETTLED: f64 = 0.055;
/// The same where a spacing is asked for, which is measured to a hundredth.
const SETTLED_TO_MEASURE: f64 = 0.03;
/// What the surface on which floaters move may be off, in square roots of the mean cell.
const SKETCHED: f64 = 1e-3;
/// Difference between the spacing asked for and measured that is worth another correction.
const CLOSE: f64 = 0.008;

/// What came of it.
pub(crate) struct Spread {
    pub(crate) swarm: Swarm,
    /// Square root of the area of a size-1 cell (the length of one, on curves).
    pub(crate) unit: f64,
    /// Why it is not converged.
    pub(crate) unmet: Option<String>,
}

/// Spreads floaters over a surface from its seeds.
pub(crate) fn spread(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    wish: Wish<'_>,
) -> Result<Spread, Error> {
    let walls = seeds.walls;
    let Wish { amount, n, density, start, most_steps } = wish;
    let all = seeds.uniform_swarm();
    let apart = linear(seeds.area / all.len().max(1) as f64, walls.axes);
    let (sizing, weights) = Sizing::new(density, surface, &all, apart, walls.axes)?;
    let levels = if start.is_some() { 0 } else { levels_for(n, seeds.components, walls.axes) };
    let coarsest = n >> (halvings(walls.axes) * levels);
    // The last projection makes good for what the sketch is off.
    let sketch = surface.sketch(SKETCHED * linear(seeds.area / n as f64, walls.axes));
    let surface = sketch.as_deref().unwrap_or(surface);
    let mut work = Work {
        run,
        surface,
        walls,
        seeds,
        sizing,
        spacing: match amount {
            Amount::Spacing(s) => Some(s),
            Amount::Count(_) => None,
        },
        n,
        unit: linear(seeds.area / coarsest as f64, walls.axes),
        relaxation: Relaxation::new(surface, walls, Swarm::default(), seeds.least),
        phase: ROUGH,
    };
    let mut goes_on = if let Some(start) = start {
        let swarm = resume(&mut work, start)?;
        work.take(swarm)?;
        work.again()?
    } else {
        let chosen = choose(seeds, &weights, coarsest, Rng::new(work.run.seed, Stream::Thinning));
        work.take(chosen)?;
        work.coarsest(levels)?
    };
    for level in (0..levels).rev() {
        if goes_on {
            goes_on = work.finer(level)?;
        }
    }
    let settled = goes_on && work.last(most_steps)?;
    work.run.evaluations += work.relaxation.evaluations;
    let unmet = (!settled).then(|| match work.run.stop {
        None => {
            format!("the floaters still moved after {most_steps} steps at full resolution; allow more steps")
        }
        Some(why) => why.reason().into(),
    });
    Ok(Spread { swarm: work.relaxation.swarm, unit: work.unit, unmet })
}

/// What is asked for.
pub(crate) struct Wish<'a> {
    pub(crate) amount: Amount,
    /// Floaters, to begin with where a spacing is asked for.
    pub(crate) n: usize,
    pub(crate) density: Density<'a>,
    pub(crate) start: Option<&'a [V3]>,
    pub(crate) most_steps: usize,
}

/// Floaters that bring the mean distance between neighbours to `spacing` on so much area.
pub(crate) fn count_for_spacing(area: f64, spacing: f64, axes: usize) -> f64 {
    let unit = spacing / if axes == 2 { 1.0 } else { NEAREST };
    area / if axes == 2 { unit } else { unit * unit }
}

/// Halvings of the number of floaters from level to level.
fn halvings(axes: usize) -> u32 {
    if axes == 2 { 1 } else { 2 }
}

fn levels_for(n: usize, components: usize, axes: usize) -> u32 {
    let coarsest = COARSEST.max(PER_COMPONENT * components);
    let mut levels = 0;
    while n >> (halvings(axes) * (levels + 1)) >= coarsest && levels < 24 {
        levels += 1;
    }
    levels
}

/// `n` of the seeds: one for each component, the others at random among those that are uniform by area, in
/// proportion to the weights (empty: all equal).
fn choose(seeds: &Seeds<'_>, weights: &[f64], n: usize, rng: Rng) -> Swarm {
    let all = seeds.points.len();
    let weight = |i: usize| weights.get(i).copied().unwrap_or(1.0);
    let mut order: Vec<(f64, usize)> = (0..all).map(|i| (rng.unit(i as u64) / weight(i), i)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut chosen = vec![false; all];
    let mut represented = vec![false; seeds.components];
    let mut left = n;
    for &(_, i) in &order {
        let l = seeds.label[i] as usize;
        if !represented[l] && left > 0 {
            (represented[l], chosen[i]) = (true, true);
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
    for i in (0..all).filter(|&i| chosen[i]) {
        swarm.push(seeds.points[i], seeds.normals[i], seeds.label[i], None);
    }
    swarm
}

/// Floaters from earlier points, projected onto the surface; those that do not get there are left out, and components
/// without any get a seed.
fn resume(work: &mut Work<'_, '_, '_>, start: &[V3]) -> Result<Swarm, Error> {
    let seeds = work.seeds;
    let mut points: Vec<V3> = start.iter().map(|&p| work.walls.clamp(p)).collect();
    let mut normals = vec![[0.0; 3]; points.len()];
    let target = Target { tolerance: 1e-6 * work.unit, longest: work.unit, least: seeds.least, rounds: 12 };
    let count = &mut work.run.evaluations;
    let left = project(work.surface, count, &work.walls, &mut points, &mut normals, target)?;
    let label = seeds.nearest_labels(&points, &normals);
    let mut swarm = Swarm::default();
    for i in (0..points.len()).filter(|&i| left[i] <= 0.05 * work.unit) {
        swarm.push(points[i], normals[i], label[i], None);
    }
    let mut represented = vec![false; seeds.components];
    swarm.label.iter().for_each(|&l| represented[l as usize] = true);
    for i in 0..seeds.points.len() {
        let l = seeds.label[i];
        if !std::mem::replace(&mut represented[l as usize], true) {
            swarm.push(seeds.points[i], seeds.normals[i], l, None);
        }
    }
    Ok(swarm)
}

struct Work<'w, 'a, 's> {
    run: &'w mut Run<'a>,
    surface: &'s dyn Surface,
    walls: Walls,
    seeds: &'w Seeds<'w>,
    sizing: Sizing<'w>,
    /// Mean distance between neighbours that is asked for.
    spacing: Option<f64>,
    /// Floaters at the last level.
    n: usize,
    /// Square root of a size-1 cell at present.
    unit: f64,
    relaxation: Relaxation<'s>,
    phase: Phase,
}

impl Work<'_, '_, '_> {
    /// Brings floaters from an earlier run to their new number. Whether to go on.
    fn again(&mut self) -> Result<bool, Error> {
        for k in 0..AGAIN_STEPS {
            if k % (AGAIN_STEPS / 4) == 0 || (k < 12 && self.relaxation.swarm.len() != self.n) {
                self.balance(self.n)?;
            }
            if !self.step(0.1 + 0.4 * k as f64 / AGAIN_STEPS as f64)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Finds the large-scale order. Whether to go on.
    fn coarsest(&mut self, levels: u32) -> Result<bool, Error> {
        for k in 0..COARSE_STEPS {
            // Thrice: from random points large differences remain at first, and few are left at last.
            if k == COARSE_STEPS / 8 {
                self.balance(self.n >> (halvings(self.walls.axes) * levels))?;
            } else if k == COARSE_STEPS / 4 || k == COARSE_STEPS / 2 {
                self.balance(self.population(levels))?;
            }
            if !self.step(0.1 + 0.2 * k as f64 / COARSE_STEPS as f64)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Doubles the resolution. Whether to go on.
    fn finer(&mut self, level: u32) -> Result<bool, Error> {
        self.refine()?;
        self.enter(REFINED);
        for k in 0..if level > 0 { MIDDLE_STEPS } else { FIRST_STEPS } {
            if k == BEFORE_BALANCE {
                self.balance(self.population(level))?;
            }
            if !self.step(0.3 + 0.2 / f64::from(level + 1))?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Settles and polishes the last level. Whether it came to rest.
    fn last(&mut self, most: usize) -> Result<bool, Error> {
        let mut settled = self.settle(most)?;
        for _ in 0..CORRECTIONS {
            let Some(n) = self.correction() else { break };
            self.n = n;
            self.balance(n)?;
            settled = self.settle(most)?;
        }
        self.enter(POLISHING);
        for _ in 0..POLISHING_STEPS {
            if self.run.stop.is_some() || !self.step(0.9)?.1 {
                return Ok(false);
            }
        }
        Ok(settled)
    }

    fn settle(&mut self, most: usize) -> Result<bool, Error> {
        self.enter(SETTLING);
        let settled = if self.spacing.is_some() { SETTLED_TO_MEASURE } else { SETTLED };
        for k in 0..most {
            // What has not settled by now shuttles: in crevices many neighbours push at once.
            if k >= PATIENCE && k % CALMING_EVERY == 0 {
                self.enter(Phase { gain: CALMER * self.phase.gain, ..self.phase });
            }
            let (moved, goes_on) = self.step(0.5 + 0.4 * k as f64 / most as f64)?;
            if !goes_on {
                return Ok(false);
            }
            if k >= 2 * BEFORE_BALANCE && moved.rms < settled {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The number of floaters that brings the spacing to what is asked for, where it is off.
    fn correction(&self) -> Option<usize> {
        let wanted = self.spacing?;
        let census = population::census(&self.relaxation.swarm, &self.walls, self.unit);
        let ratio = crate::metrics::mean_nearest(&census) / wanted;
        let factor = if self.walls.axes == 2 { ratio } else { ratio * ratio };
        let n = (self.n as f64 * factor).round().clamp(1.0, 1.5 * self.n as f64) as usize;
        let n = n.max(self.seeds.components);
        ((ratio - 1.0).abs() > CLOSE && n != self.n).then_some(n)
    }

    /// How many floaters a level should have, so that the refinements after it come out at the number wanted.
    fn population(&self, level: u32) -> usize {
        if level == 0 {
            return self.n;
        }
        let next = self.n >> (halvings(self.walls.axes) * (level - 1));
        let swarm = &self.relaxation.swarm;
        let children = population::edges(swarm, &self.walls, self.unit).len();
        let factor = 1usize << halvings(self.walls.axes);
        // Every floater gets three children (one, on curves), but for the bounds and the Euler characteristic.
        let missing = (factor * swarm.len()) as f64 - (swarm.len() + children) as f64;
        ((next as f64 + missing) / factor as f64).round().max(1.0) as usize
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.tune();
    }

    fn tune(&mut self) {
        self.relaxation.tune(self.phase.sigma * self.unit, self.phase.gain, self.phase.momentum);
    }

    /// Makes `swarm` the present one, in spatial order.
    fn take(&mut self, swarm: Swarm) -> Result<(), Error> {
        let mut sorted = swarm.sorted(2.0 * self.unit);
        self.sizing.apply(self.surface, &mut sorted, self.unit, self.walls.axes)?;
        self.relaxation.populate(sorted);
        self.tune();
        Ok(())
    }

    fn habitat(&self) -> Habitat<'_> {
        let Self { surface, walls, seeds, .. } = self;
        Habitat { surface: *surface, walls, least: seeds.least, label_area: &seeds.label_area }
    }

    /// A step, and whether to go on.
    fn step(&mut self, fraction: f64) -> Result<(Moved, bool), Error> {
        if !self.sizing.is_uniform() && self.run.steps.is_multiple_of(SIZING_STEPS) {
            let mut swarm = std::mem::take(&mut self.relaxation.swarm);
            self.sizing.apply(self.surface, &mut swarm, self.unit, self.walls.axes)?;
            self.relaxation.swarm = swarm;
        }
        let moved = self.relaxation.step()?;
        self.run.steps += 1;
        Ok((moved, self.run.tell(options::Phase::Relaxing, fraction, self.relaxation.swarm.len())))
    }

    fn balance(&mut self, n: usize) -> Result<(), Error> {
        let mut swarm = self.relaxation.release();
        let rng = Rng::new(self.run.seed, Stream::Death).child(self.run.steps as u64);
        let mut count = 0;
        let done = population::balance(&mut swarm, &self.habitat(), &mut count, self.unit, n, rng)?;
        self.run.evaluations += count;
        self.run.births += done.births as u64;
        self.run.deaths += done.deaths as u64;
        self.unit = linear(done.share, self.walls.axes);
        self.take(swarm)
    }

    fn refine(&mut self) -> Result<(), Error> {
        let mut swarm = self.relaxation.release();
        let before = swarm.len();
        let mut count = 0;
        let born = population::refine(&mut swarm, &self.habitat(), &mut count, self.unit)?;
        self.run.evaluations += count;
        self.run.births += born as u64;
        self.unit *= linear(before as f64 / swarm.len() as f64, self.walls.axes);
        self.take(swarm)?;
        self.relaxation.rest();
        Ok(())
    }
}
