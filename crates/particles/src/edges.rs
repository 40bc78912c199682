//! Floaters on creases: points that stay where they are while the others spread between them, at every level of the
//! refinement as many as its spacing asks for.

use crate::creases::Creases;
use crate::neighbors::Grid;
use crate::population::PROTECTED;
use crate::seeding::Seeds;
use crate::swarm::Swarm;
use crate::vector::{V3, distance};

/// The points of creases as floaters.
pub(crate) struct EdgeFloaters<'a> {
    creases: &'a Creases,
    /// Component of each point.
    label: Vec<u32>,
    /// For each point how many halvings of the number it outlives.
    rank: Vec<u32>,
}

impl<'a> EdgeFloaters<'a> {
    pub(crate) fn new(creases: &'a Creases, seeds: &Seeds<'_>) -> Self {
        let mut rank = vec![0; creases.points.len()];
        for edge in &creases.edges {
            let n = edge.points.len();
            for (k, &p) in edge.points.iter().enumerate() {
                let end = !edge.closed && (k == 0 || k + 1 == n);
                rank[p as usize] = if end || k == 0 { u32::MAX } else { k.trailing_zeros() };
            }
        }
        let label = seeds.nearest_labels(&creases.points, &vec![[0.0; 3]; creases.points.len()]);
        Self { creases, label, rank }
    }

    /// Floaters at a level: so many halvings before the last.
    pub(crate) fn count(&self, level: u32) -> usize {
        self.rank.iter().filter(|r| **r >= level).count()
    }

    /// Replaces the floaters on creases by those of a level, and removes others that are too close to them; the last of a
    /// component stays. `unit` is the linear size of a cell.
    pub(crate) fn enter(&self, swarm: &mut Swarm, level: u32, unit: f64) {
        let here: Vec<usize> = (0..self.rank.len()).filter(|&i| self.rank[i] >= level).collect();
        let points: Vec<V3> = here.iter().map(|&i| self.creases.points[i]).collect();
        let mut left = swarm.per_label();
        (0..swarm.len()).filter(|&i| swarm.is_held(i)).for_each(|i| left[swarm.label[i] as usize] -= 1);
        let reach = PROTECTED * unit;
        let grid = Grid::new(&points, None, reach.max(f64::MIN_POSITIVE));
        let mut stay: Vec<u32> = Vec::with_capacity(swarm.len());
        for i in (0..swarm.len()).filter(|&i| !swarm.is_held(i)) {
            let mut close = false;
            grid.near(swarm.points[i], reach, |j| {
                close |= distance(swarm.points[i], points[j as usize]) < reach;
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
            next.hold(p, self.label[i], size, i as u32);
        }
        *swarm = next;
    }
}
