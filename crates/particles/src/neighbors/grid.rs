//! Points in a grid of cells that is addressed by hash, and their order along a Morton curve.

use isoswarm_field::SMALL;
use rayon::prelude::*;

use crate::vector::V3;

/// Largest cell coordinate plus one: three of them interleave into 63 bits.
const CELLS_PER_AXIS: f64 = 2_097_152.0;

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

/// A grid of cells over some of the points, addressed by hash. Memory: about 12 bytes a point.
///
/// Cells are in the order of their Morton codes, so that those of a block of 4 × 4 × 4 follow each other: a block's bits
/// say which of them there are, and one look into the table finds all of them.
pub struct Grid {
    lo: V3,
    inverse: f64,
    keys: Vec<u64>,
    start: Vec<u32>,
    order: Vec<u32>,
    blocks: Vec<Block>,
    /// By hash: number of the block plus one.
    table: Vec<u32>,
}

/// Cells whose codes agree but for the lowest six bits.
#[derive(Clone, Copy)]
struct Block {
    key: u64,
    /// Bit k: there is a cell with k in its lowest bits.
    present: u64,
    /// The first of its cells.
    first: u32,
}

impl Grid {
    /// A grid over `points[members]` (all points for `None`) with cells of side `cell` (> 0), or larger where the
    /// points extend over more than 2^21 cells.
    pub fn new(points: &[V3], members: Option<Vec<u32>>, cell: f64) -> Self {
        let members = members.unwrap_or_else(|| (0..points.len() as u32).collect());
        let (lo, cell) = Self::frame(points, &members, cell);
        let inverse = 1.0 / cell;
        let mut keyed: Vec<(u64, u32)> = members
            .into_par_iter()
            .with_min_len(4096)
            .map(|i| (morton(coordinates(points[i as usize], lo, inverse)), i))
            .collect();
        sort_by_key(&mut keyed);
        let mut keys = Vec::with_capacity(keyed.len() / 3 + 1);
        let mut start = Vec::with_capacity(keyed.len() / 3 + 2);
        for (at, (key, _)) in keyed.iter().enumerate() {
            if keys.last() != Some(key) {
                keys.push(*key);
                start.push(at as u32);
            }
        }
        start.push(keyed.len() as u32);
        let mut blocks: Vec<Block> = Vec::new();
        for (c, key) in keys.iter().enumerate() {
            if blocks.last().is_none_or(|b| b.key != key >> 6) {
                blocks.push(Block { key: key >> 6, present: 0, first: c as u32 });
            }
            if let Some(b) = blocks.last_mut() {
                b.present |= 1 << (key & 63);
            }
        }
        let mut table = vec![0; (4 * blocks.len().max(1)).next_power_of_two()];
        let mask = table.len() - 1;
        for (k, block) in blocks.iter().enumerate() {
            let mut h = hash(block.key) as usize & mask;
            while table[h] != 0 {
                h = (h + 1) & mask;
            }
            table[h] = k as u32 + 1;
        }
        let order = keyed.into_iter().map(|(_, i)| i).collect();
        Self { lo, inverse, keys, start, order, blocks, table }
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
    fn block(&self, key: u64) -> Option<Block> {
        let mask = self.table.len() - 1;
        let mut h = hash(key) as usize & mask;
        loop {
            let entry = self.table[h];
            if entry == 0 {
                return None;
            }
            let block = self.blocks[entry as usize - 1];
            if block.key == key {
                return Some(block);
            }
            h = (h + 1) & mask;
        }
    }

    #[inline(always)]
    fn at_key(&self, key: u64) -> [u64; 3] {
        [compact(key), compact(key >> 1), compact(key >> 2)]
    }

    /// The coordinates of cell number `c`.
    #[inline(always)]
    pub(super) fn at(&self, c: usize) -> [u64; 3] {
        self.at_key(self.keys[c])
    }

    /// The side of a cell.
    pub(super) fn cell(&self) -> f64 {
        1.0 / self.inverse
    }

    /// The number of cells.
    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }

    /// Calls `f` with the number of every cell with coordinates from `low` to `high`, block by block.
    #[inline(always)]
    pub(super) fn cells(&self, low: [u64; 3], high: [u64; 3], mut f: impl FnMut(usize)) {
        for bz in low[2] >> 2..=high[2] >> 2 {
            for by in low[1] >> 2..=high[1] >> 2 {
                for bx in low[0] >> 2..=high[0] >> 2 {
                    let Some(block) = self.block(morton([bx, by, bz])) else { continue };
                    let within = |b: u64, a: usize| {
                        let first = low[a].max(4 * b) - 4 * b;
                        let last = high[a].min(4 * b + 3) - 4 * b;
                        SLABS[a][last as usize] & !(SLABS[a][first as usize] & !PLANES[a][first as usize])
                    };
                    let mut wanted = block.present & within(bx, 0) & within(by, 1) & within(bz, 2);
                    while wanted != 0 {
                        let bit = wanted.trailing_zeros();
                        f(block.first as usize + (block.present & ((1 << bit) - 1)).count_ones() as usize);
                        wanted &= wanted - 1;
                    }
                }
            }
        }
    }

    /// The members of cell number `c`.
    #[inline(always)]
    pub(super) fn members(&self, c: usize) -> &[u32] {
        &self.order[self.start[c] as usize..self.start[c + 1] as usize]
    }

    /// Calls `f` with every member of every cell that the ball around `p` may touch: a superset of those within
    /// `radius`, in a fixed order.
    pub fn near(&self, p: V3, radius: f64, mut f: impl FnMut(u32)) {
        let low = coordinates([p[0] - radius, p[1] - radius, p[2] - radius], self.lo, self.inverse);
        let high = coordinates([p[0] + radius, p[1] + radius, p[2] + radius], self.lo, self.inverse);
        let visits = (0..3).map(|a| (high[a] - low[a] + 1) as f64).product::<f64>();
        if visits > self.keys.len() as f64 {
            self.order.iter().for_each(|&j| f(j));
            return;
        }
        self.cells(low, high, |c| self.members(c).iter().for_each(|&j| f(j)));
    }
}

/// Of the cells of a block those with the coordinate k on each axis.
const PLANES: [[u64; 4]; 3] = {
    let mut planes = [[0; 4]; 3];
    let mut cell = 0;
    while cell < 64 {
        let mut a = 0;
        while a < 3 {
            // Two bits of each coordinate, interleaved.
            let k = (cell >> a & 1) | (cell >> (a + 3) & 1) << 1;
            planes[a][k] |= 1 << cell;
            a += 1;
        }
        cell += 1;
    }
    planes
};

/// The same for coordinates up to k.
const SLABS: [[u64; 4]; 3] = {
    let mut slabs = PLANES;
    let mut a = 0;
    while a < 3 {
        let mut k = 1;
        while k < 4 {
            slabs[a][k] |= slabs[a][k - 1];
            k += 1;
        }
        a += 1;
    }
    slabs
};

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
pub fn spatial_order(points: &[V3], cell: f64) -> Vec<u32> {
    let members: Vec<u32> = (0..points.len() as u32).collect();
    let (lo, cell) = Grid::frame(points, &members, cell);
    let mut keyed: Vec<(u64, u32)> =
        members.into_iter().map(|i| (morton(coordinates(points[i as usize], lo, 1.0 / cell)), i)).collect();
    sort_by_key(&mut keyed);
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Digits of so many bits are sorted at once.
const DIGIT: u32 = 11;
/// From so few on digits pay,
const FEW: usize = 256;
/// and up to so many: beyond, the second copy costs memory that matters, and threads are faster.
const MANY: usize = 1 << 17;

/// Sorts by key; equal keys by index, in whose order the pairs come.
fn sort_by_key(keyed: &mut Vec<(u64, u32)>) {
    debug_assert!(keyed.is_sorted_by_key(|k| k.1));
    // A module that is downloaded has digits alone.
    if !SMALL && !(FEW..=MANY).contains(&keyed.len()) {
        keyed.par_sort_unstable();
        return;
    }
    let bits = u64::BITS - keyed.iter().fold(0, |all, k| all | k.0).leading_zeros();
    let mut sorted = vec![(0, 0); keyed.len()];
    for shift in (0..bits).step_by(DIGIT as usize) {
        let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
        let mut place = [0u32; 1 << DIGIT];
        keyed.iter().for_each(|k| place[digit(k.0)] += 1);
        let mut before = 0;
        for count in &mut place {
            (*count, before) = (before, before + *count);
        }
        for &k in keyed.iter() {
            let at = &mut place[digit(k.0)];
            sorted[*at as usize] = k;
            *at += 1;
        }
        std::mem::swap(keyed, &mut sorted);
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

    fn cloud(n: u64, size: f64) -> Vec<V3> {
        let r = Rng::new(3, Stream::Probes);
        (0..n).map(|i| [0, 1, 2].map(|a| size * r.unit(3 * i + a))).collect()
    }

    #[test]
    fn cells_of_any_range_are_found_once_each() {
        let points = cloud(900, 1.0);
        let grid = Grid::new(&points, None, 0.07);
        for (low, high) in
            [([0, 0, 0], [15, 15, 15]), ([3, 4, 7], [4, 11, 8]), ([1, 0, 5], [1, 9, 5]), ([20; 3], [22; 3])]
        {
            let mut found = Vec::new();
            grid.cells(low, high, |c| found.push(grid.keys[c]));
            found.sort_unstable();
            let inside = |key: &u64| {
                let at = grid.at_key(*key);
                (0..3).all(|a| low[a] <= at[a] && at[a] <= high[a])
            };
            let mut expected: Vec<u64> = grid.keys.iter().copied().filter(inside).collect();
            expected.sort_unstable();
            assert_eq!(found, expected, "{low:?} to {high:?}");
        }
    }

    #[test]
    fn digits_sort_like_comparisons() {
        let r = crate::rng::Rng::new(2, crate::rng::Stream::Probes);
        for (n, bits) in [(300u32, 63), (5000, 20), (5000, 5), (700, 0), (10, 40)] {
            let key = |i: u32| ((r.unit(u64::from(i)) * 2f64.powi(bits)) as u64).min((1 << bits) - 1);
            let mut keyed: Vec<(u64, u32)> = (0..n).map(|i| (key(i), i)).collect();
            let mut expected = keyed.clone();
            expected.sort();
            super::sort_by_key(&mut keyed);
            assert_eq!(keyed, expected);
        }
    }

    #[test]
    fn the_spatial_order_is_a_permutation_that_shortens_the_way() {
        let points = cloud(4000, 1.0);
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
