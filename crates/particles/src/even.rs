//! The default method: relaxed coarse to fine, or from an advancing front.
//!
//! A coarse swarm is cheap, settles large-scale differences of density, and freezes into a lattice with few defects.
//! Each refinement puts a floater on every edge of the Delaunay stars: four times as many on a lattice twice as fine,
//! with as many defects as before. So few steps are left to do at full resolution.
//!
//! A surface with features everywhere that a coarse swarm cannot see has no order at large to be found. There a front
//! ([`crate::front`]) puts all floaters in place at once.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{Surface, in_pool};

use crate::Error;
use crate::constraint::Walls;
use crate::edges::EdgeFloaters;
use crate::front;
use crate::options::{self, Amount, Density};
use crate::population::{self, Habitat, linear};
use crate::relax::{Moved, Pace, Relaxation};
use crate::resume::resume;
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::Seeds;
use crate::sizing::Sizing;
use crate::swarm::Swarm;
use crate::vector::V3;

// How the phases of the relaxation go: σ in square roots of the mean cell.

/// From random points. A gain of .72 is α Δt = 6 × .12 in WH94's units; 1.1 diverges on random points.
const ROUGH: Pace = Pace { sigma: 0.45, gain: 0.72, momentum: 0.9, skin: 0.8, stray: 0.02 };
/// From a lattice, whose floaters keep their distance and bear longer steps.
const REFINED: Pace = Pace { sigma: 0.45, gain: 1.6, momentum: 0.8, skin: 0.8, stray: 0.02 };
/// Slow modes at the last level.
const SETTLING: Pace = Pace { sigma: 0.42, gain: 2.5, momentum: 0.8, skin: 0.8, stray: 0.02 };
/// Nearest neighbours only: evens out the distances around defects. The smaller σ, the softer the lattice, the larger
/// the gain.
const POLISHING: Pace = Pace { sigma: 0.31, gain: 5.0, momentum: 0.7, skin: 1.6, stray: 0.0 };

/// Steps at the coarsest level, at each between, and at the last one: before settling, most while settling
/// (`Options::steps`), and polishing. Order that is found while floaters are few costs little.
const COARSE_STEPS: usize = 100;
const FEW: usize = 2000;
const MIDDLE_STEPS_OF_FEW: usize = 24;
const MIDDLE_STEPS: usize = 12;
const FIRST_STEPS: usize = 6;
const SETTLING_STEPS: usize = 60;
const LONG_POLISHING_STEPS: usize = 8;
const POLISHING_STEPS: usize = 6;
/// Fewest steps of settling.
const LEAST_STEPS: usize = 4;
/// What a swarm moves less than two steps ago, as a part of that, where settling is worth its time. Below that it
/// creeps, as in crevices that are finer than its spacing, and many more steps would change its evenness little.
const WORTHWHILE: f64 = 0.1;
/// Steps times floaters up to which it may creep all the same.
const CHEAP: usize = 200_000;
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
/// Where that takes more floaters than so many, the surface is too rough for an order to be found at large: a front does
/// as well, and where there can be none fewer steps do.
const ROUGHLY: usize = 5 * COARSEST;
const FEWER_STEPS: usize = 24;
/// Steps after a front, before the swarm settles; and most while it does where the surface turns by more than so much (radians, about)
/// from floater to floater, since little is won there: 100,000 floaters on a protein have a ρ_avg of .878, and .887 after eight steps more.
const FRONT_STEPS: usize = 2;
const FRONT_SETTLING_STEPS: usize = 6;
const UNRESOLVED: f64 = 0.35;
/// And no larger spacing than this, over the turn of the normal per length (1 is the radius of a sphere): a coarser swarm
/// would see its surface as a cloud.
const BENDING: f64 = 2.5;
/// Mean distance between nearest neighbours in square roots of the mean cell, when relaxed: .96 of the hexagonal one.
const NEAREST: f64 = 1.03;
/// Root mean square displacement of a step in σ at which a swarm counts as settled: further steps change its evenness
/// little.
const SETTLED: f64 = 0.06;
const SETTLED_OF_FEW: f64 = 0.05;
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
    let Wish { amount, n, density, edges, start, most_steps, coarse_steps } = wish;
    let all = seeds.uniform_swarm();
    let apart = linear(seeds.area / all.len().max(1) as f64, walls.axes);
    let (sizing, weights) = Sizing::new(density, surface, &all, apart, walls.axes)?;
    // The last projection makes good for what the sketch is off.
    let sketch = surface.sketch(SKETCHED * linear(seeds.area / n as f64, walls.axes));
    let surface = sketch.as_deref().unwrap_or(surface);
    let levels = levels_for(n, seeds);
    let levels = edges.map_or(levels, |e| levels.min(e.levels(n, halvings(walls.axes))));
    let start = match start {
        Some(points) => {
            resume(run, surface, seeds, points, &weights, n, n >> (halvings(walls.axes) * levels))?
        }
        None => None,
    };
    let levels = start.as_ref().map_or(levels, |swarm| level_of(swarm.len(), n, levels, walls.axes));
    let coarsest = n >> (halvings(walls.axes) * levels);
    // Where seeds may take pieces for one, floaters that are chosen among them may leave out a piece; a front starts from all.
    let rough = coarsest > ROUGHLY || seeds.too_coarse_for(n);
    let rough = rough && start.is_none() && edges.is_none() && walls.axes == 3 && sizing.is_uniform();
    let (levels, coarsest) = if rough { (0, n) } else { (levels, coarsest) };
    let mut work = Work {
        run,
        surface,
        walls,
        seeds,
        sizing,
        edges,
        unresolved: rough && seeds.bend * linear(seeds.area / n as f64, walls.axes) > UNRESOLVED,
        spacing: match amount {
            Amount::Spacing(s) => Some(s),
            Amount::Count(_) => None,
        },
        n,
        unit: linear(seeds.area / coarsest as f64, walls.axes),
        relaxation: Relaxation::new(surface, walls, Swarm::default(), seeds.least),
        phase: ROUGH,
    };
    let mut goes_on = if let Some(mut swarm) = start {
        work.unit = linear(seeds.area / swarm.len() as f64, walls.axes);
        work.hold(&mut swarm, levels)?;
        work.take(swarm)?;
        work.again(levels)?
    } else if rough {
        work.front()?
    } else {
        let on_edges = edges.map_or(0, |e| e.count(levels));
        let free = coarsest.saturating_sub(on_edges).max(seeds.components);
        let mut chosen = choose(seeds, &weights, free, Rng::new(work.run.seed, Stream::Thinning));
        work.hold(&mut chosen, levels)?;
        work.take(chosen)?;
        work.coarsest(levels, coarse_steps)?
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
            let steps = most_steps.unwrap_or(SETTLING_STEPS);
            format!("the floaters still moved after {steps} steps at full resolution; allow more steps")
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
    /// Floaters on creases, if that is asked for and there are any.
    pub(crate) edges: Option<&'a EdgeFloaters<'a>>,
    pub(crate) start: Option<&'a [V3]>,
    pub(crate) most_steps: Option<usize>,
    /// Steps at the coarsest level, if not the usual number.
    pub(crate) coarse_steps: Option<usize>,
}

/// Floaters that bring the mean distance between neighbours to `spacing` on so much area.
pub(crate) fn count_for_spacing(area: f64, spacing: f64, axes: usize) -> f64 {
    let unit = spacing / if axes == 2 { 1.0 } else { NEAREST };
    area / if axes == 2 { unit } else { unit * unit }
}

/// The mean distance between neighbours of so many floaters on so much area.
pub(crate) fn spacing_for_count(area: f64, n: usize, axes: usize) -> f64 {
    let unit = linear(area / n.max(1) as f64, axes);
    unit * if axes == 2 { 1.0 } else { NEAREST }
}

/// Halvings of the number of floaters from level to level.
fn halvings(axes: usize) -> u32 {
    if axes == 2 { 1 } else { 2 }
}

/// Refinements on the way to `n` floaters.
fn levels_for(n: usize, seeds: &Seeds<'_>) -> u32 {
    let axes = seeds.walls.axes;
    let widest = BENDING / seeds.bend;
    let few = (seeds.area / if axes == 2 { widest } else { widest * widest }).min(n as f64) as usize;
    let coarsest = COARSEST.max(PER_COMPONENT * seeds.components).max(few);
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
    order.arrange_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
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

/// The refinement, of at most `most`, whose number of floaters is nearest to `now`.
fn level_of(now: usize, n: usize, most: u32, axes: usize) -> u32 {
    let off = |level: u32| {
        let part = (n >> (halvings(axes) * level)) as f64 / now as f64;
        part.max(1.0 / part)
    };
    (0..=most).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

struct Work<'w, 'a, 's> {
    run: &'w mut Run<'a>,
    surface: &'s dyn Surface,
    walls: Walls,
    seeds: &'w Seeds<'w>,
    sizing: Sizing<'w>,
    edges: Option<&'w EdgeFloaters<'w>>,
    /// Whether the surface turns much from floater to floater nearly everywhere.
    unresolved: bool,
    /// Mean distance between neighbours that is asked for.
    spacing: Option<f64>,
    /// Floaters at the last level.
    n: usize,
    /// Square root of a size-1 cell at present.
    unit: f64,
    relaxation: Relaxation<'s>,
    phase: Pace,
}

/// To how many floaters a population is brought.
#[derive(Clone, Copy)]
enum Goal {
    Count(usize),
    /// So many that the refinements after this level come out at the number wanted.
    Level(u32),
}

impl Work<'_, '_, '_> {
    /// Brings floaters from an earlier run to the number of a level. Whether to go on.
    fn again(&mut self, levels: u32) -> Result<bool, Error> {
        for k in 0..AGAIN_STEPS {
            let other = levels == 0 && self.relaxation.swarm.len() != self.n;
            if k % (AGAIN_STEPS / 4) == 0 || (k < 12 && other) {
                self.balance(Goal::Level(levels))?;
            }
            if !self.step(0.1 + 0.4 * k as f64 / AGAIN_STEPS as f64)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Fills the surface at once. Whether to go on.
    fn front(&mut self) -> Result<bool, Error> {
        let swarm = front::advance(self.run, self.surface, self.seeds, self.n)?;
        self.take(swarm)?;
        if self.run.stop.is_some() {
            return Ok(false);
        }
        if self.relaxation.swarm.len() != self.n {
            self.balance(Goal::Count(self.n))?;
        }
        self.enter(REFINED);
        for k in 0..FRONT_STEPS {
            if !self.step(0.3 + 0.2 * k as f64 / FRONT_STEPS as f64)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Finds the large-scale order. Whether to go on.
    fn coarsest(&mut self, levels: u32, steps: Option<usize>) -> Result<bool, Error> {
        let usual = if self.relaxation.swarm.len() > ROUGHLY { FEWER_STEPS } else { COARSE_STEPS };
        let steps = steps.map_or(usual, |s| s.min(usual));
        for k in 0..steps {
            // Thrice: from random points large differences remain at first, and few are left at last.
            if k == steps / 8 {
                self.balance(Goal::Count(self.n >> (halvings(self.walls.axes) * levels)))?;
            } else if k == steps / 4 || k == steps / 2 {
                self.balance(Goal::Level(levels))?;
            }
            if !self.step(0.1 + 0.2 * k as f64 / steps as f64)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Doubles the resolution. Whether to go on.
    fn finer(&mut self, level: u32) -> Result<bool, Error> {
        self.refine(level)?;
        self.enter(REFINED);
        let steps = match self.relaxation.swarm.len() {
            _ if level == 0 => FIRST_STEPS,
            n if n < FEW => MIDDLE_STEPS_OF_FEW,
            _ => MIDDLE_STEPS,
        };
        for k in 0..steps {
            if k == BEFORE_BALANCE {
                self.balance(Goal::Level(level))?;
            }
            if !self.step(0.3 + 0.2 / f64::from(level + 1))?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Settles and polishes the last level. Whether it came to rest.
    fn last(&mut self, most: Option<usize>) -> Result<bool, Error> {
        let mut settled = self.settle(most)? && self.polish()?;
        for _ in 0..CORRECTIONS {
            let Some(n) = self.correction().filter(|_| settled) else { break };
            self.n = n;
            self.balance(Goal::Count(n))?;
            settled = self.settle(most)? && self.polish()?;
        }
        Ok(settled)
    }

    fn polish(&mut self) -> Result<bool, Error> {
        self.enter(POLISHING);
        // Where floaters do not resolve the surface, steps are what evens them out.
        let long = self.unresolved || self.relaxation.swarm.len() < FEW;
        for _ in 0..if long { LONG_POLISHING_STEPS } else { POLISHING_STEPS } {
            if !self.step(0.9)?.1 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn settle(&mut self, most: Option<usize>) -> Result<bool, Error> {
        self.enter(SETTLING);
        let settled = match self.spacing {
            Some(_) => SETTLED_TO_MEASURE,
            None if self.relaxation.swarm.len() < FEW => SETTLED_OF_FEW,
            None => SETTLED,
        };
        let steps = most.unwrap_or(if self.unresolved { FRONT_SETTLING_STEPS } else { SETTLING_STEPS });
        let mut before = [f64::INFINITY; 2];
        for k in 0..steps {
            let (moved, goes_on) = self.step(0.5 + 0.4 * k as f64 / steps as f64)?;
            if !goes_on {
                return Ok(false);
            }
            let creeps = most.is_none()
                && moved.rms > (1.0 - WORTHWHILE) * before[k % 2]
                && k * self.relaxation.swarm.len() > CHEAP;
            if k + 1 >= LEAST_STEPS && (moved.rms < settled || creeps) {
                return Ok(true);
            }
            before[k % 2] = moved.rms;
        }
        // A swarm that creeps has settled as far as it will.
        Ok(most.is_none())
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

    fn enter(&mut self, phase: Pace) {
        self.phase = phase;
        self.tune();
    }

    fn tune(&mut self) {
        self.relaxation.tune(Pace { sigma: self.phase.sigma * self.unit, ..self.phase });
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
        let moved = in_pool(self.surface, || self.relaxation.step())?;
        self.run.steps += 1;
        Ok((moved, self.run.tell(options::Phase::Relaxing, fraction, self.relaxation.swarm.len())))
    }

    fn balance(&mut self, goal: Goal) -> Result<(), Error> {
        let (last, halvings) = (self.n, halvings(self.walls.axes));
        let n = |now: usize, edges: usize| match goal {
            Goal::Count(n) => n,
            Goal::Level(0) => last,
            Goal::Level(level) => {
                // Every floater gets three children (one, on curves), but for the bounds and the Euler characteristic.
                let (next, factor) = (last >> (halvings * (level - 1)), 1usize << halvings);
                let missing = (factor * now) as f64 - (now + edges) as f64;
                ((next as f64 + missing) / factor as f64).round().max(1.0) as usize
            }
        };
        let mut swarm = self.relaxation.release();
        let rng = Rng::new(self.run.seed, Stream::Death).child(self.run.steps as u64);
        let mut count = 0;
        let (habitat, unit) = (self.habitat(), self.unit);
        let done =
            in_pool(self.surface, || population::balance(&mut swarm, &habitat, &mut count, unit, n, rng))?;
        self.run.evaluations += count;
        self.run.births += done.births as u64;
        self.run.deaths += done.deaths as u64;
        self.unit = linear(done.share, self.walls.axes);
        self.take(swarm)
    }

    /// Puts the floaters on creases that a level has.
    fn hold(&self, swarm: &mut Swarm, level: u32) -> Result<(), Error> {
        if let Some(edges) = self.edges {
            edges.enter(swarm, level, self.unit);
            edges.fill(swarm, self.seeds, &self.sizing, self.unit)?;
        }
        Ok(())
    }

    fn refine(&mut self, level: u32) -> Result<(), Error> {
        let mut swarm = self.relaxation.release();
        let before = swarm.len();
        let mut count = 0;
        let born = population::refine(&mut swarm, &self.habitat(), &mut count, self.unit)?;
        self.run.evaluations += count;
        self.run.births += born as u64;
        self.unit *= linear(before as f64 / swarm.len() as f64, self.walls.axes);
        self.hold(&mut swarm, level)?;
        self.take(swarm)?;
        self.relaxation.rest();
        Ok(())
    }
}
