//! Who is near whom: hash grids by octave of the radius of interaction, and flat lists of neighbours.
//!
//! No loop runs over all pairs: a grid has cells of the radius of interaction, found through a hash of their Morton
//! codes, and only the cells around a particle are visited. Where radii differ, each octave of radii has its own grid,
//! so that one large particle does not make the cells of all small ones large.

use rayon::prelude::*;

use crate::vector::V3;

/// Largest cell coordinate plus one: three of them interleave into 63 bits.
const CELLS_PER_AXIS: f64 = 2_097_152.0;

/// Cells that one task handles.
const CELLS_PER_TASK: usize = 256;

/// Spreads the lowest 21 bits so that two zeros follow each.
#[inline(always)]
fn spread(v: u64) -> u64 {
    let mut v = v & 0x1f_ffff;
    v = (v | (v << 32)) & 0x001f_0000_0000_ffff;
    v = (v | (v << 16)) & 0x001f_0000_ff00_00ff;
    v = (v | (v << 8)) & 0x100f_00f0_0f00_f00f;
    v = (v | (v << 4)) & 0x10c3_0c30_c30c_30c3;
    (v | (v << 2)) & 0x1249_2492_4924_9249
}

#[inline(always)]
fn morton(c: [u64; 3]) -> u64 {
    spread(c[0]) | spread(c[1]) << 1 | spread(c[2]) << 2
}

/// A grid of cells over some of the points, addressed by hash. Memory: about 16 bytes a point.
pub(crate) struct Grid {
    lo: V3,
    inverse: f64,
    keys: Vec<u64>,
    start: Vec<u32>,
    order: Vec<u32>,
    /// By hash: number of the cell plus one, and above it half of the hash, so that most misses are seen at once.
    table: Vec<u64>,
    mask: u64,
}

impl Grid {
    /// A grid over `points[members]` (all points for `None`) with cells of side `cell` (> 0), or larger where the
    /// points extend over more than 2^21 cells.
    pub(crate) fn new(points: &[V3], members: Option<Vec<u32>>, cell: f64) -> Self {
        let members = members.unwrap_or_else(|| (0..points.len() as u32).collect());
        let (lo, cell) = Self::frame(points, &members, cell);
        let inverse = 1.0 / cell;
        let mut keyed: Vec<(u64, u32)> = members
            .into_par_iter()
            .with_min_len(4096)
            .map(|i| (morton(coordinates(points[i as usize], lo, inverse)), i))
            .collect();
        keyed.par_sort_unstable();
        let mut keys = Vec::with_capacity(keyed.len() / 3 + 1);
        let mut start = Vec::with_capacity(keyed.len() / 3 + 2);
        for (at, (key, _)) in keyed.iter().enumerate() {
            if keys.last() != Some(key) {
                keys.push(*key);
                start.push(at as u32);
            }
        }
        start.push(keyed.len() as u32);
        let size = (4 * keys.len().max(1)).next_power_of_two();
        let mut grid = Self {
            lo,
            inverse,
            keys,
            start,
            order: keyed.into_iter().map(|(_, i)| i).collect(),
            table: vec![0; size],
            mask: size as u64 - 1,
        };
        for c in 0..grid.keys.len() {
            let full = hash(grid.keys[c]);
            let mut h = full & grid.mask;
            while grid.table[h as usize] != 0 {
                h = (h + 1) & grid.mask;
            }
            grid.table[h as usize] = (full & TAG) | (c as u64 + 1);
        }
        grid
    }

    fn frame(points: &[V3], members: &[u32], cell: f64) -> (V3, f64) {
        let mut lo = [f64::INFINITY; 3];
        let mut hi = [f64::NEG_INFINITY; 3];
        for &i in members {
            let p = points[i as usize];
            for a in 0..3 {
                lo[a] = lo[a].min(p[a]);
                hi[a] = hi[a].max(p[a]);
            }
        }
        let extent = (0..3).map(|a| hi[a] - lo[a]).fold(0.0, f64::max);
        // One cell of margin below, so that the coordinates of neighbouring cells never wrap.
        let cell = cell.max(extent / (CELLS_PER_AXIS - 4.0)).max(f64::MIN_POSITIVE);
        (lo.map(|v| if v.is_finite() { v - cell } else { 0.0 }), cell)
    }

    #[inline(always)]
    fn cell(&self, key: u64) -> Option<usize> {
        let full = hash(key);
        let mut h = full & self.mask;
        loop {
            let entry = self.table[h as usize];
            if entry == 0 {
                return None;
            }
            let c = (entry & !TAG) as usize;
            if (entry ^ full) & TAG == 0 && self.keys[c - 1] == key {
                return Some(c - 1);
            }
            h = (h + 1) & self.mask;
        }
    }

    /// The members of cell number `c`.
    #[inline(always)]
    fn members(&self, c: usize) -> &[u32] {
        &self.order[self.start[c] as usize..self.start[c + 1] as usize]
    }

    /// Calls `f` with every member of every cell that the ball around `p` may touch: a superset of those within
    /// `radius`, in a fixed order.
    pub(crate) fn near(&self, p: V3, radius: f64, mut f: impl FnMut(u32)) {
        let low = coordinates([p[0] - radius, p[1] - radius, p[2] - radius], self.lo, self.inverse);
        let high = coordinates([p[0] + radius, p[1] + radius, p[2] + radius], self.lo, self.inverse);
        let visits = (0..3).map(|a| (high[a] - low[a] + 1) as f64).product::<f64>();
        if visits > self.keys.len() as f64 {
            self.order.iter().for_each(|&j| f(j));
            return;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if let Some(c) = self.cell(morton([x, y, z])) {
                        self.members(c).iter().for_each(|&j| f(j));
                    }
                }
            }
        }
    }
}

/// The half of a hash that the table keeps.
const TAG: u64 = 0xffff_ffff_0000_0000;

#[inline(always)]
fn hash(key: u64) -> u64 {
    let h = (key ^ (key >> 29)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h ^ (h >> 31)
}

#[inline(always)]
fn coordinates(p: V3, lo: V3, inverse: f64) -> [u64; 3] {
    // The cast saturates: below the grid is cell 0, which holds nothing, above it the last one.
    [0, 1, 2].map(|a| ((p[a] - lo[a]) * inverse).min(CELLS_PER_AXIS - 1.0) as u64)
}

/// The order of the points along a Morton curve of the given resolution: neighbours in space become neighbours in
/// memory. Ties keep their order.
pub(crate) fn spatial_order(points: &[V3], cell: f64) -> Vec<u32> {
    let members: Vec<u32> = (0..points.len() as u32).collect();
    let (lo, cell) = Grid::frame(points, &members, cell);
    let mut keyed: Vec<(u64, u32)> =
        members.into_iter().map(|i| (morton(coordinates(points[i as usize], lo, 1.0 / cell)), i)).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// How far particles reach.
#[derive(Clone, Copy)]
pub(crate) enum Reach<'a> {
    /// All equally far.
    Same(f64),
    /// Each its own; two are neighbours where either reaches the other.
    Each(&'a [f64]),
}

/// For each particle the others that it interacts with. Memory: 8 bytes a particle and 4 bytes a pair and side.
#[derive(Default)]
pub(crate) struct Neighbors {
    span: Vec<(u32, u32)>,
    other: Vec<u32>,
}

impl Neighbors {
    /// The neighbours of particle `i`, in an order that depends on positions only.
    #[inline(always)]
    pub(crate) fn of(&self, i: usize) -> &[u32] {
        let (a, b) = self.span[i];
        &self.other[a as usize..b as usize]
    }

    /// All pairs within reach for which `keep(i, j)` holds.
    pub(crate) fn find(points: &[V3], reach: Reach<'_>, keep: impl Fn(usize, usize) -> bool + Sync) -> Self {
        match reach {
            Reach::Same(r) => Self::of_equals(points, r, keep),
            Reach::Each(r) => Self::of_octaves(points, r, keep),
        }
    }

    fn of_equals(points: &[V3], radius: f64, keep: impl Fn(usize, usize) -> bool + Sync) -> Self {
        let grid = Grid::new(points, None, radius);
        let tasks = grid.keys.len().div_ceil(CELLS_PER_TASK);
        let parts: Vec<Part> = (0..tasks)
            .into_par_iter()
            .map(|t| {
                let cells = t * CELLS_PER_TASK..((t + 1) * CELLS_PER_TASK).min(grid.keys.len());
                let mut part = Part::default();
                let mut near = Candidates::default();
                for c in cells {
                    near.gather(&grid, points, c);
                    for &i in grid.members(c) {
                        let before = part.other.len();
                        near.within(points[i as usize], radius, i, &mut part.other, |j| {
                            keep(i as usize, j as usize)
                        });
                        part.rows.push((i, (part.other.len() - before) as u32));
                    }
                }
                part
            })
            .collect();
        Self::join(points.len(), parts)
    }

    fn of_octaves(points: &[V3], radius: &[f64], keep: impl Fn(usize, usize) -> bool + Sync) -> Self {
        let least = radius.iter().fold(f64::INFINITY, |m, &r| m.min(r));
        if !least.is_finite() {
            return Self { span: vec![(0, 0); points.len()], other: Vec::new() };
        }
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
        present.sort_unstable();
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
        let tasks = points.len().div_ceil(CELLS_PER_TASK);
        let parts: Vec<Part> = (0..tasks)
            .into_par_iter()
            .map(|t| {
                let mut part = Part::default();
                for i in t * CELLS_PER_TASK..((t + 1) * CELLS_PER_TASK).min(points.len()) {
                    let before = part.other.len();
                    let p = points[i];
                    let mut visit = |j: u32| {
                        let (j, q) = (j as usize, points[j as usize]);
                        let reach = radius[i].max(radius[j]);
                        let d2 = (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2);
                        if j != i && d2 <= reach * reach && keep(i, j) {
                            part.other.push(j as u32);
                        }
                    };
                    for (k, &o) in present.iter().enumerate() {
                        match o.cmp(&octaves[i]) {
                            std::cmp::Ordering::Less => {}
                            std::cmp::Ordering::Equal => up_to[k].near(p, side(o), &mut visit),
                            std::cmp::Ordering::Greater => exactly[k].near(p, side(o), &mut visit),
                        }
                    }
                    part.rows.push((i as u32, (part.other.len() - before) as u32));
                }
                part
            })
            .collect();
        Self::join(points.len(), parts)
    }

    fn join(n: usize, parts: Vec<Part>) -> Self {
        let mut lists = Self {
            span: vec![(0, 0); n],
            other: Vec::with_capacity(parts.iter().map(|p| p.other.len()).sum()),
        };
        for part in parts {
            let mut at = lists.other.len() as u32;
            for (i, count) in part.rows {
                lists.span[i as usize] = (at, at + count);
                at += count;
            }
            lists.other.extend_from_slice(&part.other);
        }
        lists
    }
}

#[derive(Default)]
struct Part {
    rows: Vec<(u32, u32)>,
    other: Vec<u32>,
}

/// The particles in the cells around one cell, as columns.
#[derive(Default)]
struct Candidates {
    index: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    hits: Vec<u32>,
}

impl Candidates {
    fn gather(&mut self, grid: &Grid, points: &[V3], c: usize) {
        self.index.clear();
        let key = grid.keys[c];
        let at = [compact(key), compact(key >> 1), compact(key >> 2)];
        for z in at[2].saturating_sub(1)..=at[2] + 1 {
            for y in at[1].saturating_sub(1)..=at[1] + 1 {
                for x in at[0].saturating_sub(1)..=at[0] + 1 {
                    if let Some(c) = grid.cell(morton([x, y, z])) {
                        self.index.extend_from_slice(grid.members(c));
                    }
                }
            }
        }
        self.x.clear();
        self.y.clear();
        self.z.clear();
        self.x.extend(self.index.iter().map(|&j| points[j as usize][0]));
        self.y.extend(self.index.iter().map(|&j| points[j as usize][1]));
        self.z.extend(self.index.iter().map(|&j| points[j as usize][2]));
        self.hits.resize(self.index.len(), 0);
    }

    #[inline]
    fn within(&mut self, p: V3, radius: f64, own: u32, out: &mut Vec<u32>, keep: impl Fn(u32) -> bool) {
        let r2 = radius * radius;
        let m = self.index.len();
        let (x, y, z, index, hits) =
            (&self.x[..m], &self.y[..m], &self.z[..m], &self.index[..m], &mut self.hits[..m]);
        let mut count = 0;
        for k in 0..m {
            let (dx, dy, dz) = (x[k] - p[0], y[k] - p[1], z[k] - p[2]);
            hits[count] = index[k];
            count += usize::from(dx * dx + dy * dy + dz * dz <= r2);
        }
        out.extend(hits[..count].iter().copied().filter(|&j| j != own && keep(j)));
    }
}

/// Inverse of [`spread`].
#[inline(always)]
fn compact(v: u64) -> u64 {
    let mut v = v & 0x1249_2492_4924_9249;
    v = (v | (v >> 2)) & 0x10c3_0c30_c30c_30c3;
    v = (v | (v >> 4)) & 0x100f_00f0_0f00_f00f;
    v = (v | (v >> 8)) & 0x001f_0000_ff00_00ff;
    v = (v | (v >> 16)) & 0x001f_0000_0000_ffff;
    (v | (v >> 32)) & 0x1f_ffff
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
        (0..lists.span.len())
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
        let points = cloud(600, 1.0, [4.0, -2.0, 0.0]);
        let r = Rng::new(9, Stream::Probes);
        let radius: Vec<f64> = (0..600).map(|i| 0.004 * (6.0 * r.unit(i)).exp2()).collect();
        let lists = Neighbors::find(&points, Reach::Each(&radius), |_, _| true);
        assert!(sorted(&lists) == brute(&points, |i, j| radius[i].max(radius[j])));
    }

    #[test]
    fn keeps_what_is_asked_and_survives_coincidence() {
        let points = vec![[1.0, 2.0, 3.0]; 5];
        let lists = Neighbors::find(&points, Reach::Same(0.5), |i, j| (i + j) % 2 == 1);
        assert_eq!(sorted(&lists), vec![vec![1, 3], vec![0, 2, 4], vec![1, 3], vec![0, 2, 4], vec![1, 3]]);
        assert_eq!(Neighbors::find(&[], Reach::Same(1.0), |_, _| true).span.len(), 0);
    }

    #[test]
    fn a_radius_far_below_the_extent_is_found() {
        let mut points = cloud(50, 1e-9, [0.0; 3]);
        points.push([1e6, 0.0, 0.0]);
        let lists = Neighbors::find(&points, Reach::Same(3e-10), |_, _| true);
        assert!(sorted(&lists) == brute(&points, |_, _| 3e-10));
    }

    #[test]
    fn the_spatial_order_is_a_permutation_that_shortens_the_way() {
        let points = cloud(4000, 1.0, [0.0; 3]);
        let order = spatial_order(&points, 0.05);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(k, &i)| k as u32 == i));
        let way = |o: &[u32]| -> f64 {
            o.windows(2).map(|w| distance(points[w[0] as usize], points[w[1] as usize])).sum()
        };
        assert!(way(&order) < 0.25 * way(&sorted));
    }
}
