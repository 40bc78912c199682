//! Neighbours on a surface with several sheets: who is near and may be on the same one.

use std::ops::Range;

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::{Grid, Neighbors, Part, Reach, alike, cells_per_task, range};
use crate::swarm::{DOUBTFUL, FORGOTTEN, LEANING, doubt};
use crate::vector::V3;

/// Cells that are larger than so many radii, because the whole is so large, are not measured in single precision.
const COARSE: f64 = 16.0;
/// Places in single precision are relative to the largest radius: those that are smaller than this part of it do not see well enough.
const SPREAD: f64 = 1e3;
/// Candidates that are left out together where none is a neighbour.
const LANES: usize = 16;
/// Not a neighbour.
const NOBODY: u32 = u32::MAX;

impl Neighbors {
    /// All pairs within reach that may be on one sheet soon; those of which that is in doubt are marked (see [`doubt`]).
    pub(crate) fn on_sheets(points: &[V3], normals: &[V3], reach: Reach<'_>) -> Self {
        Self::on_sheets_within(points, normals, reach, |a, b| if a > b { a } else { b })
    }

    /// As [`Neighbors::on_sheets`], for those who only count up to the root mean square of both radii: some that are farther may be
    /// among them.
    pub(crate) fn on_sheets_between(points: &[V3], normals: &[V3], reach: Reach<'_>) -> Self {
        Self::on_sheets_within(points, normals, reach, |a, b| 0.5 * (a + b))
    }

    /// `both`: of the squares of two radii, how far the two see each other, squared, at most the larger.
    fn on_sheets_within(
        points: &[V3],
        normals: &[V3],
        reach: Reach<'_>,
        both: impl Fn(f32, f32) -> f32 + Copy + Sync,
    ) -> Self {
        let radius = match reach {
            Reach::Same(radius) => Some(radius),
            Reach::Each(each) => {
                let together = |r: &(f64, f64)| alike(points.len(), r.0, r.1) && r.1 <= SPREAD * r.0;
                range(each).filter(together).map(|r| r.1)
            }
        };
        if let Some(radius) = radius {
            let grid = Grid::new(points, None, radius);
            if grid.cell() <= COARSE * radius {
                let (per_task, _) = cells_per_task(&grid, points.len(), reach);
                let task = |t: usize| {
                    let cells = t * per_task..((t + 1) * per_task).min(grid.len());
                    Arch::new().dispatch(OnSheets {
                        grid: &grid,
                        points,
                        normals,
                        reach,
                        radius,
                        both,
                        cells,
                    })
                };
                let parts: Vec<Part> = (0..grid.len().div_ceil(per_task)).into_par_iter().map(task).collect();
                return Self::new(points.len(), parts);
            }
        }
        let mark = |i: usize, j: usize| {
            doubt(points[i], points[j], normals[i], normals[j]).map(|d| if d { Self::MARK } else { 0 })
        };
        Self::find_marked(points, reach, mark)
    }
}

/// One task: the rows of all particles in some cells.
struct OnSheets<'a, F> {
    grid: &'a Grid,
    points: &'a [V3],
    normals: &'a [V3],
    reach: Reach<'a>,
    /// The largest.
    radius: f64,
    both: F,
    cells: Range<usize>,
}

impl<F: Fn(f32, f32) -> f32 + Copy> NullaryFnOnce for OnSheets<'_, F> {
    type Output = Part;

    #[inline(always)]
    fn call(self) -> Part {
        let Self { grid, points, normals, reach, radius, both, cells } = self;
        let mut part = Part::for_about(cells.clone().map(|c| grid.members(c).len()).sum());
        let (mut around, per_radius) = (Around::default(), 1.0 / radius);
        for c in cells {
            let Some(&first) = grid.members(c).first() else { continue };
            // Relative to one of them and in radii, so that single precision is enough.
            let origin = points[first as usize];
            let place = |i: u32| {
                let p = points[i as usize];
                [0, 1, 2].map(|a| ((p[a] - origin[a]) * per_radius) as f32)
            };
            let square = |i: u32| match reach {
                Reach::Same(_) => 1.0,
                Reach::Each(r) => (r[i as usize] * per_radius).powi(2) as f32,
            };
            around.index.clear();
            grid.cells(grid.at(c).map(|v| v.saturating_sub(1)), grid.at(c).map(|v| v + 1), |c| {
                around.index.extend_from_slice(grid.members(c));
            });
            around.gather(place, |i| normals[i as usize].map(|v| v as f32), square);
            for &i in grid.members(c) {
                let own = square(i);
                around.judge(i, place(i), normals[i as usize].map(|v| v as f32), |other| both(own, other));
                part.row(i, |row| around.write(row));
            }
        }
        part.done()
    }
}

/// The particles in the cells around one cell, as columns.
#[derive(Default)]
struct Around {
    index: Vec<u32>,
    x: [Vec<f32>; 3],
    n: [Vec<f32>; 3],
    /// Squares of their reaches.
    reach: Vec<f32>,
    /// An entry of a list each, or [`NOBODY`].
    entry: Vec<u32>,
    plain: Vec<u32>,
    marked: Vec<u32>,
}

impl Around {
    #[inline(always)]
    fn gather(
        &mut self,
        place: impl Fn(u32) -> [f32; 3],
        normal: impl Fn(u32) -> [f32; 3],
        reach: impl Fn(u32) -> f32,
    ) {
        let m = self.index.len();
        for column in self.x.iter_mut().chain(&mut self.n).chain([&mut self.reach]) {
            column.resize(m, 0.0);
        }
        for column in [&mut self.entry, &mut self.plain, &mut self.marked] {
            column.resize(m, 0);
        }
        for (k, &j) in self.index.iter().enumerate() {
            let (x, n) = (place(j), normal(j));
            self.reach[k] = reach(j);
            for a in 0..3 {
                (self.x[a][k], self.n[a][k]) = (x[a], n[a]);
            }
        }
    }

    /// Who of them is a neighbour of particle `own`.
    #[inline(always)]
    fn judge(&mut self, own: u32, p: [f32; 3], n: [f32; 3], both: impl Fn(f32) -> f32) {
        let count = self.index.len();
        let (index, entry) = (&self.index[..count], &mut self.entry[..count]);
        let [x, y, z] = [&self.x[0][..count], &self.x[1][..count], &self.x[2][..count]];
        let [u, v, w] = [&self.n[0][..count], &self.n[1][..count], &self.n[2][..count]];
        let reach = &self.reach[..count];
        for k in 0..count {
            let (dx, dy, dz) = (p[0] - x[k], p[1] - y[k], p[2] - z[k]);
            let square = dx * dx + dy * dy + dz * dz;
            let c = n[0] * u[k] + n[1] * v[k] + n[2] * w[k];
            let a = dx * n[0] + dy * n[1] + dz * n[2];
            let b = dx * u[k] + dy * v[k] + dz * w[k];
            let (a, b) = (a * a, b * b);
            let least = if a < b { a } else { b };
            let doubtful = (c < DOUBTFUL as f32) | (least > LEANING as f32 * square);
            let near = (square <= both(reach[k])) & (c >= FORGOTTEN as f32) & (index[k] != own);
            let mark = if doubtful { Neighbors::MARK } else { 0 };
            entry[k] = if near { index[k] | mark } else { NOBODY };
        }
    }

    /// Adds them to a list, marked ones last.
    #[inline(always)]
    fn write(&mut self, row: &mut Vec<u32>) {
        let (mut plain, mut marked) = (0, 0);
        for entries in self.entry.chunks(LANES) {
            // Where radii differ most are no neighbours.
            if entries.iter().fold(NOBODY, |all, e| all & e) == NOBODY {
                continue;
            }
            for &entry in entries {
                self.plain[plain] = entry;
                plain += usize::from(entry & Neighbors::MARK == 0);
                self.marked[marked] = entry;
                marked += usize::from((entry & Neighbors::MARK != 0) & (entry != NOBODY));
            }
        }
        row.extend_from_slice(&self.plain[..plain]);
        row.extend_from_slice(&self.marked[..marked]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};

    /// Rows of lists, sorted.
    fn rows(lists: &Neighbors, n: usize) -> Vec<Vec<u32>> {
        let row = |i: usize| {
            let row = lists.of(i);
            assert!(row.is_sorted_by_key(|e| e & Neighbors::MARK), "marked ones last");
            let mut row = row.to_vec();
            row.sort_unstable();
            row
        };
        (0..n).map(row).collect()
    }

    #[test]
    fn columns_in_single_precision_find_whom_pairs_find() {
        let r = Rng::new(8, Stream::Probes);
        for (size, at) in [(1.0, 0.0), (1e-9, 1e-9), (1e12, -1e13)] {
            let points: Vec<V3> =
                (0..800).map(|i| [0, 1, 2].map(|a| at + size * r.unit(3 * i + a))).collect();
            let mut normals: Vec<V3> = (0..800).map(|i| r.direction(5000 + i, 3)).collect();
            normals[7] = [0.0; 3];
            let radius = 0.15 * size;
            let mark = |i: usize, j: usize| {
                doubt(points[i], points[j], normals[i], normals[j])
                    .map(|d| if d { Neighbors::MARK } else { 0 })
            };
            let pairs = Neighbors::find_marked(&points, Reach::Same(radius), mark);
            let found = Neighbors::on_sheets(&points, &normals, Reach::Same(radius));
            assert_eq!(rows(&found, 800), rows(&pairs, 800), "size {size}");
        }
    }

    #[test]
    fn radii_of_their_own_reach_the_larger_or_the_mean_square() {
        let r = Rng::new(4, Stream::Probes);
        let points: Vec<V3> = (0..700).map(|i| [0, 1, 2].map(|a| r.unit(3 * i + a))).collect();
        let normals: Vec<V3> = (0..700).map(|i| r.direction(5000 + i, 3)).collect();
        let radius: Vec<f64> = (0..700).map(|i| 0.03 * (3.0 * r.unit(9000 + i)).exp2()).collect();
        let mark = |i: usize, j: usize| {
            doubt(points[i], points[j], normals[i], normals[j]).map(|d| if d { Neighbors::MARK } else { 0 })
        };
        let between = |i: usize, j: usize| {
            let way = crate::vector::sub(points[i], points[j]);
            let near = crate::vector::dot(way, way) <= 0.5 * (radius[i].powi(2) + radius[j].powi(2));
            mark(i, j).filter(|_| near)
        };
        let reach = Reach::Each(&radius);
        let found = Neighbors::on_sheets(&points, &normals, reach);
        assert_eq!(rows(&found, 700), rows(&Neighbors::find_marked(&points, reach, mark), 700));
        let found = Neighbors::on_sheets_between(&points, &normals, reach);
        assert_eq!(rows(&found, 700), rows(&Neighbors::find_marked(&points, reach, between), 700));
    }

    #[test]
    fn radii_far_below_the_largest_are_found() {
        let r = Rng::new(4, Stream::Probes);
        // A cluster that is a millionth of the largest radius wide.
        let place = |i: u64| [0, 1, 2].map(|a| 0.3 + r.unit(3 * i + a) * if i < 100 { 1.0 } else { 1e-6 });
        let mut points: Vec<V3> = (0..400).map(place).collect();
        // The first in the cell that the cluster is in.
        points[0] = [0.45; 3];
        let normals: Vec<V3> = (0..400).map(|i| r.direction(5000 + i, 3)).collect();
        let radius: Vec<f64> = (0..400).map(|i| if i < 100 { 0.2 } else { 2e-7 }).collect();
        let mark = |i: usize, j: usize| {
            doubt(points[i], points[j], normals[i], normals[j]).map(|d| if d { Neighbors::MARK } else { 0 })
        };
        let reach = Reach::Each(&radius);
        let found = Neighbors::on_sheets(&points, &normals, reach);
        assert_eq!(rows(&found, 400), rows(&Neighbors::find_marked(&points, reach, mark), 400));
    }

    #[test]
    fn a_radius_far_below_the_extent_is_found() {
        let r = Rng::new(8, Stream::Probes);
        let mut points: Vec<V3> = (0..50).map(|i| [0, 1, 2].map(|a| 1e-9 * r.unit(3 * i + a))).collect();
        points.push([1e6, 0.0, 0.0]);
        let lists = Neighbors::on_sheets(&points, &[[0.0; 3]; 51], Reach::Same(3e-10));
        let pairs = Neighbors::find(&points, Reach::Same(3e-10), |_, _| true);
        let unmarked = |rows: Vec<Vec<u32>>| -> Vec<Vec<u32>> {
            rows.into_iter().map(|row| row.iter().map(|e| e & !Neighbors::MARK).collect()).collect()
        };
        assert_eq!(unmarked(rows(&lists, 51)), rows(&pairs, 51));
    }
}
