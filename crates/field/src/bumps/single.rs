//! A sum of bumps in single precision, for points that are only on their way.
//!
//! Neighbouring points are taken together, with coordinates relative to the middle between them and in units of the
//! reach of a bump, so that single precision does at any place and scale. Exponents are of two, and relative to the
//! offset, which is what the bumps add up to at the surface.

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::{CHUNK, Sum};
use crate::FieldError;
use crate::math;
use crate::surface::{Aabb, Surface};

/// What rounding may move the surface, in reaches of a bump: coordinates of up to four have 24 bits; with a margin of
/// eight.
const ROUNDING: f64 = 2e-6;
/// Most that a bump of either sign may be, in units of the offset: where bumps of both signs cancel, rounding counts more.
const CANCELLED: f64 = 16.0;
/// The same for bumps of one sign, which at the surface are together as much as the offset.
const OVERFLOW: f64 = 1e9;

/// Points for which bumps are gathered from the grid together, and points that are evaluated side by side.
const GROUP: usize = 32;
const LANES: usize = 8;
/// Extent of the points of a group in reaches of a bump beyond which it is divided. A patch of less than three reaches
/// has less than six times the bumps that one point has.
const WIDE: f64 = 3.0;

/// See the module.
#[derive(Debug)]
pub(crate) struct Single {
    sum: Sum,
    terms: Vec<Term>,
    /// The absolute value of the offset.
    unit: f64,
    /// One over the unit of length.
    scale: f64,
}

/// sign · 2^(level − Σ_axis weight (x_axis − centre)²) in the units of [`Single`]; left out where the sum is beyond `reach`.
#[derive(Clone, Copy, Debug)]
struct Term {
    weight: [f32; 3],
    level: f32,
    sign: f32,
    reach: f32,
}

impl Single {
    /// The sum in single precision, or the sum itself where that would move its surface by more than `error` (a length).
    pub(super) fn of(sum: Sum, error: f64) -> Result<Self, Sum> {
        let unit = sum.offset.abs();
        let scale = 1.0 / sum.grid.reach;
        let binary = core::f64::consts::LOG2_E;
        let mut terms = Vec::with_capacity(sum.bumps.len());
        let (mut highest, mut cancel) = (f64::NEG_INFINITY, false);
        for (b, reach) in sum.bumps.iter().zip(&sum.reach) {
            let level = b.level + math::ln(b.factor.abs() / unit);
            highest = highest.max(level);
            cancel |= (b.factor < 0.0) == (sum.offset < 0.0);
            terms.push(Term {
                weight: b.weight.map(|w| (w * binary / (scale * scale)) as f32),
                level: (level * binary) as f32,
                sign: b.factor.signum() as f32,
                reach: (reach * binary) as f32,
            });
        }
        let most = if cancel { CANCELLED } else { OVERFLOW };
        let finite = |t: &Term| t.weight.iter().chain([&t.level, &t.reach]).all(|v| v.is_finite());
        let enough = error >= ROUNDING * sum.grid.reach && highest <= math::ln(most);
        if enough && scale.is_finite() && terms.iter().all(finite) {
            Ok(Self { sum, terms, unit, scale })
        } else {
            Err(sum)
        }
    }

    fn evaluate(&self, points: &[[f64; 3]], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        let mut desk = Desk::default();
        let arch = Arch::new();
        let mut start = 0;
        while start < points.len() {
            let mut end = (start + GROUP).min(points.len());
            let bounds = loop {
                let Some(b) = Aabb::around(&points[start..end]) else { return };
                if end - start <= LANES || b.diagonal() <= WIDE * self.sum.grid.reach {
                    break b;
                }
                end = start + (end - start).div_ceil(2);
            };
            let (points, value, gradient) =
                (&points[start..end], &mut value[start..end], &mut gradient[start..end]);
            start = end;
            if bounds.diagonal().is_finite() {
                arch.dispatch(Group { of: self, bounds, points, value, gradient, desk: &mut desk });
            } else {
                self.sum.evaluate(points, value, gradient);
            }
        }
    }
}

/// The bumps around a group of points: relative centres and what the choice among them needs, as columns; and all that
/// an evaluation needs, bump by bump.
#[derive(Default)]
struct Desk {
    near: Vec<u32>,
    center: [Vec<f32>; 3],
    weight: [Vec<f32>; 3],
    reach: Vec<f32>,
    outside: Vec<f32>,
    terms: Vec<[f32; 8]>,
    chosen: Vec<[f32; 8]>,
}

struct Group<'a> {
    of: &'a Single,
    bounds: Aabb,
    points: &'a [[f64; 3]],
    value: &'a mut [f64],
    gradient: &'a mut [[f64; 3]],
    desk: &'a mut Desk,
}

impl NullaryFnOnce for Group<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { of, bounds, points, value, gradient, desk } = self;
        let origin = [0, 1, 2].map(|a| 0.5 * (bounds.lo[a] + bounds.hi[a]));
        desk.gather(of, &bounds, origin);
        let slope = -2.0 * core::f64::consts::LN_2 * of.unit * of.scale;
        for first in (0..points.len()).step_by(LANES) {
            let n = LANES.min(points.len() - first);
            let mut x = [[0.0f32; LANES]; 3];
            let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            for j in 0..LANES {
                let p = points[first + j.min(n - 1)];
                for a in 0..3 {
                    x[a][j] = ((p[a] - origin[a]) * of.scale) as f32;
                    lo[a] = lo[a].min(x[a][j]);
                    hi[a] = hi[a].max(x[a][j]);
                }
            }
            desk.choose(lo, hi);
            let (f, g) = sum(&desk.chosen, &x);
            for j in 0..n {
                value[first + j] = of.sum.offset + of.unit * f64::from(f[j]);
                gradient[first + j] = [0, 1, 2].map(|a| slope * f64::from(g[a][j]));
            }
        }
    }
}

impl Desk {
    /// The bumps that count somewhere in the box.
    #[inline(always)]
    fn gather(&mut self, of: &Single, bounds: &Aabb, origin: [f64; 3]) {
        self.near.clear();
        let near = &mut self.near;
        of.sum.grid.rows(bounds, |row| near.extend(row.start as u32..row.end as u32));
        let m = near.len();
        for a in 0..3 {
            self.center[a].clear();
            self.weight[a].clear();
            self.center[a].extend(
                near.iter().map(|&i| ((of.sum.bumps[i as usize].center[a] - origin[a]) * of.scale) as f32),
            );
            self.weight[a].extend(near.iter().map(|&i| of.terms[i as usize].weight[a]));
        }
        self.reach.clear();
        self.reach.extend(near.iter().map(|&i| of.terms[i as usize].reach));
        self.outside.clear();
        self.outside.resize(m, 0.0);
        let half = [0, 1, 2].map(|a| (0.5 * (bounds.hi[a] - bounds.lo[a]) * of.scale) as f32);
        self.measure(half.map(|h| -h), half);
        self.terms.clear();
        let mut kept = 0;
        for k in 0..m {
            if self.outside[k] > self.reach[k] {
                continue;
            }
            let t = &of.terms[self.near[k] as usize];
            let [x, y, z] = [0, 1, 2].map(|a| self.center[a][k]);
            self.terms.push([x, y, z, t.weight[0], t.weight[1], t.weight[2], t.level, t.sign]);
            for a in 0..3 {
                self.center[a][kept] = self.center[a][k];
                self.weight[a][kept] = self.weight[a][k];
            }
            self.reach[kept] = self.reach[k];
            kept += 1;
        }
        for a in 0..3 {
            self.center[a].truncate(kept);
            self.weight[a].truncate(kept);
        }
        self.reach.truncate(kept);
        self.outside.truncate(kept);
    }

    /// The smallest Σ weight (x − centre)² in the box for every bump.
    #[inline(always)]
    fn measure(&mut self, lo: [f32; 3], hi: [f32; 3]) {
        let m = self.outside.len();
        let outside = &mut self.outside[..m];
        let (cx, cy, cz) = (&self.center[0][..m], &self.center[1][..m], &self.center[2][..m]);
        let (wx, wy, wz) = (&self.weight[0][..m], &self.weight[1][..m], &self.weight[2][..m]);
        for k in 0..m {
            let dx = (lo[0] - cx[k]).max(cx[k] - hi[0]).max(0.0);
            let dy = (lo[1] - cy[k]).max(cy[k] - hi[1]).max(0.0);
            let dz = (lo[2] - cz[k]).max(cz[k] - hi[2]).max(0.0);
            outside[k] = wx[k] * (dx * dx) + wy[k] * (dy * dy) + wz[k] * (dz * dz);
        }
    }

    /// Those that count in a smaller box, into `chosen`.
    #[inline(always)]
    fn choose(&mut self, lo: [f32; 3], hi: [f32; 3]) {
        self.measure(lo, hi);
        let m = self.terms.len();
        self.chosen.resize(m, [0.0; 8]);
        let (outside, reach, terms) = (&self.outside[..m], &self.reach[..m], &self.terms[..m]);
        let chosen = &mut self.chosen[..m];
        let mut kept = 0;
        for k in 0..m {
            chosen[kept.min(k)] = terms[k];
            kept += usize::from(outside[k] <= reach[k]);
        }
        self.chosen.truncate(kept);
    }
}

/// Σ sign 2^u and Σ sign 2^u weight (x − centre) for all points.
#[inline(always)]
fn sum(terms: &[[f32; 8]], x: &[[f32; LANES]; 3]) -> ([f32; LANES], [[f32; LANES]; 3]) {
    // A point that is no number has no value either, even where no bump is near it.
    let mut f = [0.0; LANES];
    for j in 0..LANES {
        f[j] = if (x[0][j] + x[1][j] + x[2][j]).is_nan() { f32::NAN } else { 0.0 };
    }
    let mut g = [[0.0; LANES]; 3];
    for &[cx, cy, cz, wx, wy, wz, level, sign] in terms {
        for j in 0..LANES {
            let (dx, dy, dz) = (x[0][j] - cx, x[1][j] - cy, x[2][j] - cz);
            let (sx, sy, sz) = (wx * dx, wy * dy, wz * dz);
            let e = sign * exp2(level - (sx * dx + sy * dy + sz * dz));
            f[j] += e;
            g[0][j] += e * sx;
            g[1][j] += e * sy;
            g[2][j] += e * sz;
        }
    }
    (f, g)
}

/// 2^u to a relative error of 2e-7 for u < 120; 2^-120 below that.
#[inline(always)]
fn exp2(u: f32) -> f32 {
    /// (2^f - 1)/f on |f| ≤ 1/2 (Moshier's Cephes library, exp2f).
    const C: [f32; 6] =
        [6.931_472e-1, 2.402_264_8e-1, 5.550_332_5e-2, 9.618_437e-3, 1.339_887_4e-3, 1.535_336_2e-4];
    /// Adding 1.5 · 2^23 rounds to an integer, which then stands in the lowest bits.
    const MAGIC: f32 = 12_582_912.0;
    let u = if u > -120.0 { u } else { -120.0 };
    let t = u + MAGIC;
    let f = u - (t - MAGIC);
    let p = 1.0 + f * (C[0] + f * (C[1] + f * (C[2] + f * (C[3] + f * (C[4] + f * C[5])))));
    f32::from_bits(p.to_bits().wrapping_add(t.to_bits() << 23))
}

impl Surface for Single {
    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        points
            .par_chunks(CHUNK)
            .zip(value.par_chunks_mut(CHUNK))
            .zip(gradient.par_chunks_mut(CHUNK))
            .for_each(|((p, v), g)| self.evaluate(p, v, g));
        Ok(())
    }

    fn hessian(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) -> Result<(), FieldError> {
        self.sum.hessian(points, out)
    }
}

#[cfg(test)]
mod tests {
    use super::exp2;

    #[test]
    fn powers_of_two() {
        for k in -1190..1190 {
            let u = k as f32 * 0.1;
            assert!((f64::from(exp2(u)) / f64::from(u).exp2() - 1.0).abs() < 2e-7, "{u}");
        }
        assert_eq!(exp2(-1e30), 2f32.powi(-120));
    }
}
