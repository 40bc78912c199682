//! Who is near whom: hash grids by octave of the radius of interaction, and flat lists of neighbours.
//!
//! No loop runs over all pairs: a grid has cells of the radius of interaction, found through a hash of their Morton
//! codes, and only the cells around a particle are visited. Where radii differ, each octave of radii has its own grid,
//! so that one large particle does not make the cells of all small ones large.

mod grid;
mod occupied;
mod sheets;

use std::ops::Range;

use isoswarm_field::arrange::Arrange;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

pub use grid::{Grid, spatial_order};
pub(crate) use occupied::Occupied;

use crate::vector::V3;

/// Cells that one task handles.
const CELLS_PER_TASK: usize = 64;
/// Tasks that a thread takes at least: to wake another costs more than what few particles would save.
const TASKS: usize = 4;

/// Particles that one task handles where radii differ.
const PARTICLES_PER_TASK: usize = 64;

/// Radii that differ by no more than this factor are looked through together, in cells of the largest, which is faster than octave by
/// octave; so are so few particles, whatever their radii.
const ALIKE: f64 = 3.0;
const FEW: usize = 2000;

/// How far particles reach.
#[derive(Clone, Copy)]
pub enum Reach<'a> {
    /// All equally far.
    Same(f64),
    /// Each its own; two are neighbours where either reaches the other.
    Each(&'a [f64]),
}

/// For each particle the others that it interacts with. Memory: 12 bytes a particle and 4 bytes a pair and side.
#[derive(Default)]
pub struct Neighbors {
    /// Part and place in it of each particle's row: how many there are, then who.
    place: Vec<(u32, u32)>,
    /// Rows as the tasks have written them: nothing is copied.
    parts: Vec<Vec<u32>>,
}

impl Neighbors {
    /// The bit of an entry that says something about the pair; the others are the neighbour's number.
    pub(crate) const MARK: u32 = 1 << 31;

    /// The neighbours of particle `i`, in an order that depends on positions only, marked ones last: sums over them do not stop at
    /// one here and there.
    #[inline(always)]
    pub fn of(&self, i: usize) -> &[u32] {
        let (part, at) = self.place[i];
        let row = &self.parts[part as usize][at as usize..];
        &row[1..=row[0] as usize]
    }

    /// All pairs within reach for which `keep(i, j)` holds.
    pub fn find(points: &[V3], reach: Reach<'_>, keep: impl Fn(usize, usize) -> bool + Sync) -> Self {
        Self::find_marked(points, reach, |i, j| keep(i, j).then_some(0))
    }

    /// All pairs within reach for which `mark(i, j)` is not `None`. Its bits, of which only [`Self::MARK`] may be set,
    /// are added to the entries in the lists.
    fn find_marked(
        points: &[V3],
        reach: Reach<'_>,
        mark: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Self {
        match reach {
            Reach::Same(most) => Self::together(points, reach, most, mark),
            Reach::Each(radius) => match range(radius) {
                None => Self { place: vec![(0, 0); points.len()], parts: vec![vec![0]] },
                Some((least, most)) if alike(points.len(), least, most) => {
                    Self::together(points, reach, most, mark)
                }
                Some((least, _)) => Self::of_octaves(points, radius, least, mark),
            },
        }
    }

    /// In cells of the largest radius.
    fn together(
        points: &[V3],
        reach: Reach<'_>,
        most: f64,
        mark: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Self {
        let grid = Grid::new(points, None, most);
        let (per_task, least) = cells_per_task(&grid, points.len(), reach);
        let parts: Vec<Part> = (0..grid.len().div_ceil(per_task))
            .into_par_iter()
            .with_min_len(least)
            .map(|t| {
                let cells = t * per_task..((t + 1) * per_task).min(grid.len());
                Arch::new().dispatch(Within { grid: &grid, points, reach, mark: &mark, cells })
            })
            .collect();
        Self::new(points.len(), parts)
    }

    fn of_octaves(
        points: &[V3],
        radius: &[f64],
        least: f64,
        mark: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Self {
        let octave = |r: f64| {
            let (mut o, mut top) = (0usize, least);
            while r > top && o < 60 {
                top *= 2.0;
                o += 1;
            }
            o
        };
        let octaves: Vec<usize> = radius.iter().map(|&r| octave(r)).collect();
        let mut present: Vec<usize> = octaves.clone();
        present.arrange();
        present.dedup();
        let side = |o: usize| least * 2f64.powi(o as i32);
        let select = |f: &dyn Fn(usize) -> bool| -> Vec<u32> {
            (0..points.len() as u32).filter(|&i| f(octaves[i as usize])).collect()
        };
        // In the grid of its own octave a particle finds everybody up to its own size, in those above those who reach it.
        let up_to: Vec<Grid> =
            present.iter().map(|&o| Grid::new(points, Some(select(&|k| k <= o)), side(o))).collect();
        let exactly: Vec<Grid> =
            present.iter().map(|&o| Grid::new(points, Some(select(&|k| k == o)), side(o))).collect();
        let tasks = points.len().div_ceil(PARTICLES_PER_TASK);
        let parts: Vec<Part> = (0..tasks)
            .into_par_iter()
            .with_min_len(2 * TASKS)
            .map(|t| {
                let mut part = Part::default();
                for i in t * PARTICLES_PER_TASK..((t + 1) * PARTICLES_PER_TASK).min(points.len()) {
                    let p = points[i];
                    part.row(i as u32, |row| {
                        let mut visit = |j: u32| {
                            let (j, q) = (j as usize, points[j as usize]);
                            let reach = radius[i].max(radius[j]);
                            let d2 = (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2);
                            if j != i && d2 <= reach * reach {
                                row.extend(mark(i, j).map(|m| j as u32 | m));
                            }
                        };
                        for (k, &o) in present.iter().enumerate() {
                            match o.cmp(&octaves[i]) {
                                std::cmp::Ordering::Less => {}
                                std::cmp::Ordering::Equal => up_to[k].near(p, side(o), &mut visit),
                                std::cmp::Ordering::Greater => exactly[k].near(p, side(o), &mut visit),
                            }
                        }
                    });
                }
                part.done()
            })
            .collect();
        Self::new(points.len(), parts)
    }

    fn new(n: usize, parts: Vec<Part>) -> Self {
        let mut place = vec![(0, 0); n];
        for (number, part) in parts.iter().enumerate() {
            let mut at = 0;
            for &i in &part.particles {
                place[i as usize] = (number as u32, at);
                at += 1 + part.rows[at as usize];
            }
        }
        Self { place, parts: parts.into_iter().map(|p| p.rows).collect() }
    }
}

/// The smallest and the largest radius; `None` where there are none.
fn range(radius: &[f64]) -> Option<(f64, f64)> {
    let least = radius.iter().fold(f64::INFINITY, |m, &r| m.min(r));
    least.is_finite().then(|| (least, radius.iter().fold(0.0, |m: f64, &r| m.max(r))))
}

/// Whether particles with radii in this range are looked through together.
fn alike(n: usize, least: f64, most: f64) -> bool {
    n <= FEW || most <= ALIKE * least
}

/// Cells that one task handles, and tasks that a thread takes at least. Where radii differ, cells hold many particles.
fn cells_per_task(grid: &Grid, n: usize, reach: Reach<'_>) -> (usize, usize) {
    match reach {
        Reach::Same(_) => (CELLS_PER_TASK, TASKS),
        Reach::Each(_) => ((PARTICLES_PER_TASK * grid.len()).div_ceil(n.max(1)).clamp(1, CELLS_PER_TASK), 1),
    }
}

/// One task of [`Neighbors::together`]: the rows of all particles in some cells.
struct Within<'a, F> {
    grid: &'a Grid,
    points: &'a [V3],
    reach: Reach<'a>,
    mark: &'a F,
    cells: Range<usize>,
}

impl<F: Fn(usize, usize) -> Option<u32>> NullaryFnOnce for Within<'_, F> {
    type Output = Part;

    #[inline(always)]
    fn call(self) -> Part {
        let Self { grid, points, reach, mark, cells } = self;
        let mut part = Part::for_about(cells.clone().map(|c| grid.members(c).len()).sum());
        let mut near = Candidates::default();
        for c in cells {
            near.gather(grid, points, reach, c);
            for &i in grid.members(c) {
                let radius = match reach {
                    Reach::Same(r) => r,
                    Reach::Each(r) => r[i as usize],
                };
                part.row(i, |row| {
                    near.within(points[i as usize], radius, i, row, |j| mark(i as usize, j as usize));
                });
            }
        }
        part.done()
    }
}

/// What one task has found.
#[derive(Default)]
struct Part {
    particles: Vec<u32>,
    /// For each particle how many neighbours it has, and which.
    rows: Vec<u32>,
}

/// Neighbours of a particle for which room is made beforehand.
const USUAL: usize = 16;

impl Part {
    /// Room for about so many particles.
    fn for_about(n: usize) -> Self {
        Self { particles: Vec::with_capacity(n), rows: Vec::with_capacity((USUAL + 1) * n) }
    }

    /// Adds the row of particle `i`, which `fill` writes.
    #[inline(always)]
    fn row(&mut self, i: u32, fill: impl FnOnce(&mut Vec<u32>)) {
        let at = self.rows.len();
        self.rows.push(0);
        fill(&mut self.rows);
        let row = &mut self.rows[at + 1..];
        let mut plain = 0;
        for k in 0..row.len() {
            if row[k] & Neighbors::MARK == 0 {
                if plain < k {
                    row[plain..=k].rotate_right(1);
                }
                plain += 1;
            }
        }
        self.rows[at] = row.len() as u32;
        self.particles.push(i);
    }

    fn done(mut self) -> Self {
        self.rows.shrink_to_fit();
        self
    }
}

/// The particles in the cells around one cell, as columns.
#[derive(Default)]
struct Candidates {
    index: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    /// Squares of their own radii; 0 where all are equal.
    reach: Vec<f64>,
    /// Squares of the distances to one particle.
    square: Vec<f64>,
    hits: Vec<u32>,
}

impl Candidates {
    #[inline(always)]
    fn gather(&mut self, grid: &Grid, points: &[V3], reach: Reach<'_>, c: usize) {
        self.index.clear();
        let at = grid.at(c);
        let index = &mut self.index;
        grid.cells(at.map(|v| v.saturating_sub(1)), at.map(|v| v + 1), |c| {
            index.extend_from_slice(grid.members(c));
        });
        self.x.clear();
        self.y.clear();
        self.z.clear();
        self.x.extend(self.index.iter().map(|&j| points[j as usize][0]));
        self.y.extend(self.index.iter().map(|&j| points[j as usize][1]));
        self.z.extend(self.index.iter().map(|&j| points[j as usize][2]));
        self.reach.clear();
        match reach {
            Reach::Same(_) => self.reach.resize(self.index.len(), 0.0),
            Reach::Each(r) => {
                self.reach.extend(self.index.iter().map(|&j| r[j as usize] * r[j as usize]));
            }
        }
        self.square.resize(self.index.len(), 0.0);
        self.hits.resize(self.index.len(), 0);
    }

    #[inline(always)]
    fn within(
        &mut self,
        p: V3,
        radius: f64,
        own: u32,
        out: &mut Vec<u32>,
        mark: impl Fn(u32) -> Option<u32>,
    ) {
        let r2 = radius * radius;
        let m = self.index.len();
        let (x, y, z, index) = (&self.x[..m], &self.y[..m], &self.z[..m], &self.index[..m]);
        let reach = &self.reach[..m];
        let (square, hits) = (&mut self.square[..m], &mut self.hits[..m]);
        for k in 0..m {
            let (dx, dy, dz) = (x[k] - p[0], y[k] - p[1], z[k] - p[2]);
            square[k] = dx * dx + dy * dy + dz * dz;
        }
        let mut count = 0;
        for k in 0..m {
            hits[count] = index[k];
            count += usize::from((square[k] <= r2) | (square[k] <= reach[k]));
        }
        out.reserve(count);
        for &j in hits[..count].iter() {
            if j != own
                && let Some(m) = mark(j)
            {
                out.push(j | m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};
    use crate::vector::distance;

    fn cloud(n: u64, size: f64, at: V3) -> Vec<V3> {
        let r = Rng::new(3, Stream::Probes);
        (0..n).map(|i| [0, 1, 2].map(|a| at[a] + size * r.unit(3 * i + a as u64))).collect()
    }

    fn brute(points: &[V3], reach: impl Fn(usize, usize) -> f64) -> Vec<Vec<u32>> {
        (0..points.len())
            .map(|i| {
                let near = |&j: &usize| j != i && distance(points[i], points[j]) <= reach(i, j);
                (0..points.len()).filter(near).map(|j| j as u32).collect()
            })
            .collect()
    }

    fn sorted(lists: &Neighbors) -> Vec<Vec<u32>> {
        (0..lists.place.len())
            .map(|i| {
                let mut row = lists.of(i).to_vec();
                row.sort_unstable();
                row
            })
            .collect()
    }

    #[test]
    fn equal_radii_agree_with_all_pairs_at_every_scale() {
        for (size, at) in [(1.0, [0.0; 3]), (1e-9, [0.0; 3]), (1e12, [-1e13, 5.0, 0.0])] {
            let points = cloud(700, size, at);
            let lists = Neighbors::find(&points, Reach::Same(0.11 * size), |_, _| true);
            assert!(sorted(&lists) == brute(&points, |_, _| 0.11 * size));
        }
    }

    #[test]
    fn differing_radii_agree_with_all_pairs() {
        // Few together, many octave by octave.
        for n in [600, FEW as u64 + 500] {
            let points = cloud(n, 1.0, [4.0, -2.0, 0.0]);
            let r = Rng::new(9, Stream::Probes);
            let radius: Vec<f64> = (0..n).map(|i| 0.004 * (6.0 * r.unit(i)).exp2()).collect();
            let lists = Neighbors::find(&points, Reach::Each(&radius), |_, _| true);
            assert!(sorted(&lists) == brute(&points, |i, j| radius[i].max(radius[j])), "{n}");
        }
    }

    #[test]
    fn keeps_what_is_asked_and_survives_coincidence() {
        let points = vec![[1.0, 2.0, 3.0]; 5];
        let lists = Neighbors::find(&points, Reach::Same(0.5), |i, j| (i + j) % 2 == 1);
        assert_eq!(sorted(&lists), vec![vec![1, 3], vec![0, 2, 4], vec![1, 3], vec![0, 2, 4], vec![1, 3]]);
        assert_eq!(Neighbors::find(&[], Reach::Same(1.0), |_, _| true).place.len(), 0);
    }

    #[test]
    fn a_radius_far_below_the_extent_is_found() {
        let mut points = cloud(50, 1e-9, [0.0; 3]);
        points.push([1e6, 0.0, 0.0]);
        let lists = Neighbors::find(&points, Reach::Same(3e-10), |_, _| true);
        assert!(sorted(&lists) == brute(&points, |_, _| 3e-10));
    }
}
