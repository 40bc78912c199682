//! The bumps that reach into a region, for a walk through space from large boxes to small ones.

use pulp::{Arch, NullaryFnOnce};

use super::search::Range;
use super::{Block, Bump, LANES, Sum, columns};
use crate::interval::Interval;
use crate::math;
use crate::surface::Aabb;

/// Relative slack that covers rounding in a bump's slope and in their sum.
const SLACK: f64 = 1e-12;

/// The bumps that reach into a region, in the sum's order.
#[derive(Clone, Debug)]
pub(crate) struct Near {
    numbers: Vec<u32>,
    bumps: Vec<Bump>,
}

impl Near {
    pub(crate) fn len(&self) -> usize {
        self.bumps.len()
    }
}

impl Sum {
    /// All bumps.
    pub(crate) fn everything(&self) -> Near {
        Near { numbers: (0..self.bumps.len() as u32).collect(), bumps: self.bumps.clone() }
    }

    /// Those among `near` that reach into the box.
    pub(crate) fn nearer(&self, near: &Near, b: &Aabb) -> Near {
        let numbers: Vec<u32> = near.numbers.iter().copied().filter(|&i| self.counts(i, b)).collect();
        let bumps = numbers.iter().map(|&i| self.bumps[i as usize]).collect();
        Near { numbers, bumps }
    }

    /// The ranges of the sum and of its gradient in a box that the bumps of `near` reach into.
    pub(crate) fn ranges(&self, near: &Near, b: &Aabb, slopes: bool) -> (Interval, [Interval; 3]) {
        let arch = Arch::new();
        let (lo, hi) = arch.dispatch(Range { sum: self, bumps: &near.bumps, bounds: b });
        if !slopes {
            return (Interval::new(lo, hi), [Interval::ENTIRE; 3]);
        }
        let steepest = self.tail * self.bumps.len() as f64 * self.steepest();
        let range = arch.dispatch(Slopes { bumps: &near.bumps, bounds: b });
        let slack = |v: [f64; 2]| SLACK * (v[0].abs() + v[1].abs()) + steepest;
        (Interval::new(lo, hi), range.map(|v| Interval::new(v[0] - slack(v), v[1] + slack(v))))
    }

    /// A bound on the slope of a bump that is left out, over what it is worth: 2 √(weight · depth).
    fn steepest(&self) -> f64 {
        let weight = self.bumps.iter().flat_map(|b| b.weight).fold(0.0, f64::max);
        let reach = self.reach.iter().copied().fold(1.0, f64::max);
        2.0 * (weight * reach).sqrt()
    }

    /// F at points of the region of `near`.
    pub(crate) fn value_near(&self, near: &Near, points: &[[f64; 3]], value: &mut [f64]) {
        let arch = Arch::new();
        for (points, value) in points.chunks(LANES).zip(value.chunks_mut(LANES)) {
            let f = arch.dispatch(Values { offset: self.offset, bumps: &near.bumps, points });
            value.copy_from_slice(&f[..points.len()]);
        }
    }

    /// F and its gradient at points of the region of `near`.
    pub(crate) fn gradient_near(
        &self,
        near: &Near,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) {
        let arch = Arch::new();
        for (k, points) in points.chunks(LANES).enumerate() {
            let (f, g) = arch.dispatch(Block { offset: self.offset, bumps: &near.bumps, points });
            for j in 0..points.len() {
                value[k * LANES + j] = f[j];
                gradient[k * LANES + j] = [g[0][j], g[1][j], g[2][j]];
            }
        }
    }
}

/// The values of [`Block`] alone, to the same bits.
struct Values<'a> {
    offset: f64,
    bumps: &'a [Bump],
    points: &'a [[f64; 3]],
}

impl NullaryFnOnce for Values<'_> {
    type Output = [f64; LANES];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let x = columns(self.points);
        let mut f = [self.offset; LANES];
        for j in 0..LANES {
            if (x[0][j] + x[1][j] + x[2][j]).is_nan() {
                f[j] = f64::NAN;
            }
        }
        for b in self.bumps {
            let [wx, wy, wz] = b.weight;
            let mut u = [0.0; LANES];
            for j in 0..LANES {
                let d = [x[0][j] - b.center[0], x[1][j] - b.center[1], x[2][j] - b.center[2]];
                u[j] = b.level - (wx * (d[0] * d[0]) + wy * (d[1] * d[1]) + wz * (d[2] * d[2]));
            }
            for j in 0..LANES {
                u[j] = b.factor * math::exp(u[j]);
            }
            for j in 0..LANES {
                f[j] += u[j];
            }
        }
        f
    }
}

/// The range of the gradient of bumps in a box, without slack.
struct Slopes<'a> {
    bumps: &'a [Bump],
    bounds: &'a Aabb,
}

impl NullaryFnOnce for Slopes<'_> {
    type Output = [[f64; 2]; 3];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { bumps, bounds } = self;
        let (mut lo, mut hi) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for part in bumps.chunks(LANES) {
            let (mut near, mut far) = ([0.0; LANES], [0.0; LANES]);
            let (mut below, mut above) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            let mut factor = [0.0; LANES];
            let mut weight = [[0.0; LANES]; 3];
            for j in 0..LANES {
                let b = &part[j.min(part.len() - 1)];
                factor[j] = if j < part.len() { b.factor } else { 0.0 };
                (near[j], far[j]) = (b.level, b.level);
                for a in 0..3 {
                    weight[a][j] = -2.0 * b.weight[a];
                    below[a][j] = bounds.lo[a] - b.center[a];
                    above[a][j] = bounds.hi[a] - b.center[a];
                    let least = below[a][j].max(-above[a][j]).max(0.0);
                    let most = above[a][j].max(-below[a][j]);
                    near[j] -= b.weight[a] * (least * least);
                    far[j] -= b.weight[a] * (most * most);
                }
            }
            for j in 0..LANES {
                near[j] = factor[j] * math::exp(near[j]);
                far[j] = factor[j] * math::exp(far[j]);
            }
            for a in 0..3 {
                for j in 0..LANES {
                    let (p, q) = (weight[a][j] * near[j], weight[a][j] * far[j]);
                    let all = [p * below[a][j], p * above[a][j], q * below[a][j], q * above[a][j]];
                    lo[a][j] += all[0].min(all[1]).min(all[2].min(all[3]));
                    hi[a][j] += all[0].max(all[1]).max(all[2].max(all[3]));
                }
            }
        }
        [0, 1, 2].map(|a| [lo[a].iter().sum(), hi[a].iter().sum()])
    }
}
