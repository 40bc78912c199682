//! Which places are taken, while points are added one by one.

use crate::vector::V3;

/// Points in cells whose hashes share chains: who is in a chain by chance is told by the distance. Memory: 40 bytes a point.
pub(crate) struct Occupied {
    origin: V3,
    inverse: f64,
    /// By hash: the last point that came in, plus one.
    table: Vec<u32>,
    /// Each point, and the one before it in its chain, plus one.
    points: Vec<(V3, u32)>,
}

/// Odd factors, one an axis, that spread the coordinates of cells over all bits.
const SPREAD: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];

impl Occupied {
    /// No points yet; about `many` are expected around `origin`, and the largest radius that will be asked about is `reach` (> 0).
    pub(crate) fn new(origin: V3, reach: f64, many: usize) -> Self {
        // A ball meets two cells on each axis.
        let inverse = 1.0 / (2.0 * reach).max(f64::MIN_POSITIVE);
        Self { origin, inverse, table: vec![0; many.max(16).next_power_of_two()], points: Vec::new() }
    }

    /// The part of the hash that comes from the coordinate on axis `a` of the cell that holds `v`.
    #[inline(always)]
    fn part(&self, a: usize, v: f64) -> u64 {
        // Far out the cast saturates, and chains get long.
        (((v - self.origin[a]) * self.inverse).floor() as i64 as u64).wrapping_mul(SPREAD[a])
    }

    #[inline(always)]
    fn slot(&self, parts: u64) -> usize {
        (parts ^ (parts >> 32)).wrapping_mul(SPREAD[0]) as usize >> 20 & (self.table.len() - 1)
    }

    /// Adds a point; its number is that of the points before it.
    pub(crate) fn add(&mut self, p: V3) {
        if self.points.len() >= self.table.len() {
            self.table = vec![0; 2 * self.table.len()];
            for (p, _) in std::mem::take(&mut self.points) {
                self.link(p);
            }
        }
        self.link(p);
    }

    fn link(&mut self, p: V3) {
        let h = self.slot(self.part(0, p[0]) ^ self.part(1, p[1]) ^ self.part(2, p[2]));
        self.points.push((p, self.table[h]));
        self.table[h] = self.points.len() as u32;
    }

    /// Whether one of the points closer to `p` than `radius` (at most the reach) passes the test.
    #[inline]
    pub(crate) fn any(&self, p: V3, radius: f64, test: impl Fn(usize) -> bool) -> bool {
        let square = radius * radius;
        let ends = [0, 1, 2].map(|a| [self.part(a, p[a] - radius), self.part(a, p[a] + radius)]);
        // Where both ends of an axis lie in one cell it counts once.
        let many = ends.map(|e| 1 + usize::from(e[0] != e[1]));
        for &z in &ends[2][..many[2]] {
            for &y in &ends[1][..many[1]] {
                for &x in &ends[0][..many[0]] {
                    let mut next = self.table[self.slot(x ^ y ^ z)];
                    while next != 0 {
                        let k = next as usize - 1;
                        let (q, before) = self.points[k];
                        let d = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                        if d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < square && test(k) {
                            return true;
                        }
                        next = before;
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};
    use crate::vector::distance;

    #[test]
    fn finds_whom_all_pairs_find() {
        let rng = Rng::new(3, Stream::Probes);
        let at = |k: u64| [0, 1, 2].map(|a| rng.unit(3 * k + a));
        let mut taken = Occupied::new([0.0; 3], 0.05, 3000);
        for k in 0..3000 {
            taken.add(at(k));
        }
        let mut found = 0;
        for k in 0..300 {
            let p = at(10_000 + k);
            let expected = (0..3000).any(|j| distance(p, at(j)) < 0.04);
            assert_eq!(taken.any(p, 0.04, |_| true), expected, "{p:?}");
            assert!(!taken.any(p, 0.04, |_| false));
            found += usize::from(expected);
        }
        assert!(found > 100 && found < 280, "{found} of 300");
    }
}
