//! Floaters on creases: points that stay where they are while the others spread between them, at every level of the
//! refinement as many as its spacing asks for.

use isoswarm_field::arrange::Arrange;
use rayon::prelude::*;

use crate::Error;
use crate::constraint::Walls;
use crate::creases::Creases;
use crate::neighbors::Grid;
use crate::population::{Census, PROTECTED, faces};
use crate::seeding::Seeds;
use crate::sizing::Sizing;
use crate::stars::{Desk, Stars};
use crate::swarm::{Swarm, same_sheet};
use crate::vector::{V3, distance};

/// Largest part of floaters that stand on creases at a coarser level.
const SHARE: f64 = 0.3;
/// Distance from all floaters, in linear sizes of a cell, at which a seed becomes one.
const ROOM: f64 = 1.2;

/// The points of creases as floaters.
pub(crate) struct EdgeFloaters<'a> {
    creases: &'a Creases,
    normals: Vec<V3>,
    /// Component of each point.
    label: Vec<u32>,
    /// For each point how many halvings of the number it outlives.
    rank: Vec<u32>,
}

impl<'a> EdgeFloaters<'a> {
    pub(crate) fn new(creases: &'a Creases, seeds: &Seeds<'_>) -> Self {
        let mut rank = vec![u32::MAX; creases.points.len()];
        for edge in &creases.edges {
            let n = edge.points.len();
            for (k, &p) in edge.points.iter().enumerate() {
                let end = !edge.closed && (k == 0 || k + 1 == n);
                rank[p as usize] = if end || k == 0 { u32::MAX } else { k.trailing_zeros() };
            }
        }
        let label = seeds.nearest_labels(&creases.points, &vec![[0.0; 3]; creases.points.len()]);
        Self { creases, normals: creases.mean_normals(), label, rank }
    }

    /// Floaters at a level: so many halvings before the last.
    pub(crate) fn count(&self, level: u32) -> usize {
        self.rank.iter().filter(|r| **r >= level).count()
    }

    /// Refinements on the way to `n` floaters at which those on creases are no more than a part of all: between creases that are closer to
    /// each other than floaters there would be no room for any.
    pub(crate) fn levels(&self, n: usize, halvings: u32) -> u32 {
        let few = |level: u32| self.count(level) as f64 <= SHARE * (n >> (halvings * level)) as f64;
        (1..24).take_while(|l| few(*l)).last().unwrap_or(0)
    }

    /// Replaces the floaters on creases by those of a level, and removes others that are too close to them; the last of a
    /// component stays. `unit` is the linear size of a cell.
    pub(crate) fn enter(&self, swarm: &mut Swarm, level: u32, unit: f64) {
        let here: Vec<usize> = (0..self.rank.len()).filter(|&i| self.rank[i] >= level).collect();
        let points: Vec<V3> = here.iter().map(|&i| self.creases.points[i]).collect();
        let mut left = swarm.per_label();
        (0..swarm.len()).filter(|&i| swarm.is_held(i)).for_each(|i| left[swarm.label[i] as usize] -= 1);
        // Beside floaters of other sizes.
        let size = |i: usize| swarm.size.get(i).copied().unwrap_or(1.0);
        let widest = (0..swarm.len()).map(size).fold(0.0, f64::max);
        let reach = |i: usize| PROTECTED * unit * size(i);
        let grid = Grid::new(&points, None, (PROTECTED * unit * widest).max(f64::MIN_POSITIVE));
        let mut stay: Vec<u32> = Vec::with_capacity(swarm.len());
        for i in (0..swarm.len()).filter(|&i| !swarm.is_held(i)) {
            let mut close = false;
            grid.near(swarm.points[i], reach(i), |j| {
                close |= distance(swarm.points[i], points[j as usize]) < reach(i);
            });
            let l = swarm.label[i] as usize;
            if close && left[l] > 1 {
                left[l] -= 1;
            } else {
                stay.push(i as u32);
            }
        }
        let mut next = swarm.pick(&stay);
        next.held = Vec::new();
        for (&i, &p) in here.iter().zip(&points) {
            let size = (!swarm.size.is_empty()).then_some(1.0);
            next.hold(p, self.normals[i], self.label[i], size, i as u32);
        }
        *swarm = next;
    }

    /// Adds seeds where there is nobody: floaters do not get over creases, so that a part of the surface between them that has lost all
    /// of its own would stay empty.
    pub(crate) fn fill(
        &self,
        swarm: &mut Swarm,
        seeds: &Seeds<'_>,
        sizing: &Sizing<'_>,
        unit: f64,
    ) -> Result<(), Error> {
        let mut apart = vec![1.0; seeds.points.len()];
        sizing.at(&seeds.points, &mut apart)?;
        apart.iter_mut().for_each(|a| *a *= ROOM * unit);
        let widest = apart.iter().fold(f64::MIN_POSITIVE, |m, &a| m.max(a));
        let grid = Grid::new(&swarm.points, None, widest);
        let free: Vec<bool> = (0..apart.len())
            .into_par_iter()
            .map(|i| {
                let (p, n, mut room) = (seeds.points[i], seeds.normals[i], true);
                grid.near(p, apart[i], |j| {
                    let (q, m) = (swarm.points[j as usize], swarm.normals[j as usize]);
                    room &= distance(p, q) >= apart[i] || !same_sheet(p, q, n, m);
                });
                room
            })
            .collect();
        let mut added: Vec<V3> = Vec::new();
        for i in (0..free.len()).filter(|&i| free[i]) {
            let p = seeds.points[i];
            if added.iter().all(|q| distance(p, *q) >= apart[i]) {
                added.push(p);
                let size = (!swarm.size.is_empty()).then_some(1.0);
                swarm.push(p, seeds.normals[i], seeds.label[i], size);
            }
        }
        Ok(())
    }
}

/// How far cells next to creases are looked for, in linear sizes of a cell.
const REACH: f64 = 4.0;

/// Areas next to creases: the cells of floaters end there, and those on creases have none. The points of the creases are the first
/// of the swarm.
pub(crate) fn areas(swarm: &Swarm, creases: &Creases, walls: &Walls, unit: f64, census: &mut Census) {
    let on = creases.points.len();
    // The segments at each point.
    let mut at: Vec<Vec<[u32; 2]>> = vec![Vec::new(); on];
    for s in creases.edges.iter().flat_map(|e| e.segments()) {
        s.iter().for_each(|&p| at[p as usize].push(s));
    }
    let lists = swarm.neighbors(REACH * unit);
    let stars = Stars {
        points: &swarm.points,
        normals: &swarm.normals,
        lists: &lists,
        walls: &faces(walls, unit),
        radius: 0.5 * REACH * unit,
        size: &swarm.size,
    };
    let one = |desk: &mut Desk, i: usize| -> Option<f64> {
        let (mut segments, mut others, mut beside) = (Vec::new(), Vec::new(), false);
        for &j in lists.of(i) {
            match at.get(j as usize) {
                Some(own) => {
                    segments.extend_from_slice(own);
                    beside = true;
                }
                None => others.push(j),
            }
        }
        if !beside {
            return None;
        }
        segments.arrange();
        segments.dedup();
        let segments: Vec<[V3; 2]> = segments.iter().map(|s| s.map(|p| creases.points[p as usize])).collect();
        Some(stars.area_beside(i, &others, &segments, 0.5 * REACH * unit, desk))
    };
    let found: Vec<Option<f64>> = (on..swarm.len())
        .into_par_iter()
        .with_min_len(64)
        .map_init(Desk::new, |desk, i| one(desk, i))
        .collect();
    for (cell, area) in census.cells[on..].iter_mut().zip(found) {
        cell.area = area.unwrap_or(cell.area);
    }
    census.cells[..on].iter_mut().for_each(|c| c.area = 0.0);
    census.area = census.cells.iter().map(|c| c.area).sum();
}
