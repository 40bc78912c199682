//! A swarm at its full number at once, by an advancing front.
//!
//! Every floater offers places around it as in a hexagonal lattice; offers that are not too close to anybody are brought
//! onto the surface and taken, and the newcomers offer in turn, until no room is left. On a surface with features
//! everywhere that coarse swarms cannot see, that is as good a start as their refinement and costs less.

use std::ops::Range;

use isoswarm_field::Surface;
use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::cross;
use rayon::prelude::*;

use crate::Error;
use crate::constraint::{Target, project};
use crate::neighbors::Occupied;
use crate::options::Phase;
use crate::rng::{Rng, Stream};
use crate::run::Run;
use crate::seeding::Seeds;
use crate::swarm::{Swarm, same_sheet};
use crate::vector::{V3, along, distance, dot, frame, sub, tangential, unit};

/// Distance at which a place is offered, and up to which it is not free, in square roots of the cell that comes of it.
/// Measured: with these a front fills a sphere and a protein with 1.03 and 1.06 floaters a cell.
const OFFER: f64 = 1.0;
const ROOM: f64 = 0.75;
/// Evaluations that bring an offer onto the surface, and how far off it may stay, in the same unit.
const ROUNDS: usize = 3;
const OFF: f64 = 0.05;
/// The part of the room in which two floaters with normals to one side are on one sheet.
const TOGETHER: f64 = 0.3;
/// Offers of a floater: a lattice's neighbours, of which one is its parent.
const AROUND: [[f64; 2]; 6] = {
    const H: f64 = 0.866_025_403_784_438_6;
    [[-1.0, 0.0], [1.0, 0.0], [0.5, H], [-0.5, H], [-0.5, -H], [0.5, -H]]
};
/// Floaters whose offers one task looks through.
const TASK: usize = 256;

/// A place that a floater offers.
struct Offer {
    point: V3,
    parent: u32,
}

/// About `n` floaters that fill the surface from its seeds; never more than twice as many.
pub(crate) fn advance(
    run: &mut Run<'_>,
    surface: &dyn Surface,
    seeds: &Seeds<'_>,
    n: usize,
) -> Result<Swarm, Error> {
    let cell = (seeds.area / n as f64).sqrt();
    let mut front = Front {
        seeds,
        room: ROOM * cell,
        step: OFFER * cell,
        taken: Occupied::new(seeds.walls.lo, ROOM * cell, n),
        swarm: Swarm::default(),
        from: Vec::new(),
    };
    front.begin();
    let (mut first, mut generations) = (0, Vec::new());
    while first < front.swarm.len() && front.swarm.len() < 2 * n {
        let generation = first..front.swarm.len();
        first = generation.end;
        generations.push(first);
        let offers = front.offers(generation);
        let mut points: Vec<V3> = offers.iter().map(|o| o.point).collect();
        let mut normals: Vec<V3> = offers.iter().map(|o| front.swarm.normals[o.parent as usize]).collect();
        let target =
            Target { tolerance: OFF * cell, longest: 0.5 * cell, least: seeds.least, rounds: ROUNDS };
        let left = project(surface, &mut run.evaluations, &seeds.walls, &mut points, &mut normals, target)?;
        for (k, offer) in offers.iter().enumerate() {
            if left[k] <= target.tolerance {
                front.accept(points[k], normals[k], offer.parent as usize);
            }
        }
        let part = front.swarm.len() as f64 / (n.max(1) + front.swarm.len()) as f64;
        if !run.tell(Phase::Relaxing, 0.1 + 0.2 * part, front.swarm.len()) {
            break;
        }
    }
    let mut swarm = front.swarm;
    thin(&mut swarm, n, &generations, Rng::new(run.seed, Stream::Thinning));
    Ok(swarm)
}

/// Takes out what is more than `n`, at random among the last generations, which squeeze in where others meet.
fn thin(swarm: &mut Swarm, n: usize, ends: &[usize], rng: Rng) {
    let many = swarm.len().saturating_sub(n);
    // The latest that have twice as many as must go; the seeds stay.
    let late = |end: &&usize| swarm.len() - **end >= 2 * many;
    let Some(&first) = ends.iter().rev().find(late) else { return };
    let mut order: Vec<(u64, u32)> = (first..swarm.len()).map(|i| (rng.bits(i as u64), i as u32)).collect();
    order.arrange();
    let mut kept: Vec<u32> = (0..first as u32).chain(order[many..].iter().map(|o| o.1)).collect();
    kept.arrange();
    *swarm = swarm.pick(&kept);
}

struct Front<'a> {
    seeds: &'a Seeds<'a>,
    room: f64,
    step: f64,
    taken: Occupied,
    swarm: Swarm,
    /// The direction from its parent to each floater, about; zero for seeds.
    from: Vec<V3>,
}

impl Front<'_> {
    /// One seed of every component, and then all that have room.
    fn begin(&mut self) {
        let seeds = self.seeds;
        let mut represented = vec![false; seeds.components];
        let first: Vec<bool> =
            seeds.label.iter().map(|&l| !std::mem::replace(&mut represented[l as usize], true)).collect();
        for only_first in [true, false] {
            for i in (0..seeds.points.len()).filter(|&i| first[i] == only_first) {
                if only_first || self.is_free(seeds.points[i], seeds.normals[i]) {
                    self.add(seeds.points[i], seeds.normals[i], seeds.label[i], [0.0; 3]);
                }
            }
        }
    }

    fn is_free(&self, p: V3, normal: V3) -> bool {
        !self.taken.any(p, self.room, |j| {
            let (q, other) = (self.swarm.points[j], self.swarm.normals[j]);
            // Of two at one place, each a little off the surface, the way from one to the other says nothing.
            let together = distance(p, q) < TOGETHER * self.room && dot(normal, other) > 0.0;
            together || same_sheet(p, q, normal, other)
        })
    }

    fn add(&mut self, p: V3, normal: V3, label: u32, from: V3) {
        self.taken.add(p);
        self.swarm.push(p, normal, label, None);
        self.from.push(from);
    }

    /// The places around a generation that are free as far as its tangent planes tell.
    fn offers(&self, generation: Range<usize>) -> Vec<Offer> {
        let around = |i: usize, out: &mut Vec<Offer>| {
            let (p, normal) = (self.swarm.points[i], self.swarm.normals[i]);
            let back = unit(tangential(self.from[i], normal));
            let (u, v) = if back == [0.0; 3] { frame(normal) } else { (back, cross(normal, back)) };
            // The parent is behind.
            let offers = if back == [0.0; 3] { &AROUND[..] } else { &AROUND[1..] };
            for [a, b] in offers {
                let q = along(along(p, self.step * a, u), self.step * b, v);
                let q = self.seeds.walls.clamp(q);
                if self.is_free(q, normal) {
                    out.push(Offer { point: q, parent: i as u32 });
                }
            }
        };
        let generation: Vec<usize> = generation.collect();
        let parts: Vec<Vec<Offer>> = generation
            .par_chunks(TASK)
            .map(|some| {
                let mut out = Vec::new();
                some.iter().for_each(|&i| around(i, &mut out));
                out
            })
            .collect();
        parts.into_iter().flatten().collect()
    }

    fn accept(&mut self, p: V3, normal: V3, parent: usize) {
        let origin = self.swarm.points[parent];
        if distance(p, origin) < 1.5 * self.step && self.is_free(p, normal) {
            self.add(p, normal, self.swarm.label[parent], sub(p, origin));
        }
    }
}

#[cfg(test)]
mod tests {
    use isoswarm_field::{Aabb, Field, text};

    use super::*;
    use crate::seeding::{BOXES, seed};

    /// The swarm of a front, and the square root of the cell that was asked for.
    fn fill(formula: &str, half: f64, n: usize) -> (Swarm, f64, Vec<V3>) {
        let field = Field::new(&text::parse(formula, &[]).expect("a formula")).expect("a model");
        let mut run = Run::new(0, None);
        let (seeds, _) =
            seed(&field, &mut run, &Aabb::new([-half; 3], [half; 3]), 1000, BOXES).expect("a field");
        let seeds = seeds.expect("a surface");
        let swarm = advance(&mut run, &field, &seeds, n).expect("a front");
        (swarm, (seeds.area / n as f64).sqrt(), seeds.points)
    }

    #[test]
    fn a_front_fills_all_there_is_and_crowds_nobody() {
        // Two balls, of which one is small, and a sheet that is thinner than the spacing.
        let two = "min(x^2 + y^2 + z^2 - 1, sqrt((x - 1.3)^2 + y^2 + z^2) - 0.1)";
        let sheet = "(x^2 + y^2)^2 + (60*z)^2 - 1";
        for (formula, n) in [("x^2 + y^2 + z^2 - 1", 20_000), (two, 20_000), (sheet, 4000)] {
            let (swarm, cell, seeds) = fill(formula, 1.6, n);
            let off = swarm.len() as f64 / n as f64 - 1.0;
            assert!(off.abs() < 0.08, "{formula}: {} of {n}", swarm.len());
            let lists = swarm.neighbors(1.5 * cell);
            let mut lonely = 0;
            for i in 0..swarm.len() {
                let nearest =
                    lists.of(i).iter().map(|&j| distance(swarm.points[i], swarm.points[j as usize]));
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                assert!(nearest >= ROOM * cell * (1.0 - 1e-12), "{formula}: {}", nearest / cell);
                lonely += usize::from(nearest > 1.1 * cell);
            }
            assert!(100 * lonely < swarm.len(), "{formula}: {lonely} see nobody near");
            for s in seeds {
                let near = swarm.points.iter().any(|p| distance(*p, s) < 1.1 * cell);
                assert!(near, "{formula}: a hole at {s:?}");
            }
        }
    }
}
