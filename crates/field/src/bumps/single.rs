//! A sum of bumps in single precision, for points that are only on their way.
//!
//! Coordinates are relative to the middle of all bumps and in units of the reach of a bump, so that single precision does
//! at any place and scale. Exponents are of two, and relative to the offset, which is what the bumps add up to at the
//! surface.

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::{CHUNK, Sum};
use crate::FieldError;
use crate::math;
use crate::surface::{Aabb, Surface};

/// What rounding may move the surface: coordinates have 24 bits; with a margin of eight.
const ROUNDING: f64 = 1e-6;
/// Most that a bump of either sign may be, in units of the offset: where bumps of both signs cancel, rounding counts more.
const CANCELLED: f64 = 16.0;
/// The same for bumps of one sign, which at the surface are together as much as the offset.
const OVERFLOW: f64 = 1e9;

/// Points whose bumps are gathered together, and points that are evaluated side by side.
const RUN: usize = 16;
const LANES: usize = 8;
/// Extent of the points of a run in reaches of a bump beyond which it is divided. A patch of less than two reaches has less
/// than four times the bumps that one point has.
const WIDE: f64 = 2.0;

/// See the module.
#[derive(Debug)]
pub(crate) struct Single {
    sum: Sum,
    terms: Vec<Term>,
    /// Squared distance from the centre beyond which each of the terms is left out.
    reach: Vec<f32>,
    /// The absolute value of the offset.
    unit: f64,
    origin: [f64; 3],
    /// One over the unit of length.
    scale: f64,
}

/// sign · 2^(level − Σ_axis weight (x_axis − centre)²) in the units of [`Single`].
#[derive(Clone, Copy, Debug, Default)]
struct Term {
    center: [f32; 3],
    weight: [f32; 3],
    level: f32,
    sign: f32,
}

impl Single {
    /// The sum in single precision, or the sum itself where that would move its surface by more than `error` (a length).
    pub(super) fn or_double(sum: Sum, error: f64) -> Box<dyn Surface> {
        let centers: Vec<[f64; 3]> = sum.bumps.iter().map(|b| b.center).collect();
        let Some(bounds) = Aabb::around(&centers) else { return Box::new(sum) };
        let origin = bounds.middle();
        let (unit, scale) = (sum.offset.abs(), 1.0 / sum.grid.reach);
        let binary = core::f64::consts::LOG2_E;
        let (mut terms, mut reaches) = (Vec::new(), Vec::new());
        let (mut highest, mut cancel) = (f64::NEG_INFINITY, false);
        for (b, reach) in sum.bumps.iter().zip(&sum.reach) {
            let level = b.level + math::ln(b.factor.abs() / unit);
            highest = highest.max(level);
            cancel |= (b.factor < 0.0) == (sum.offset < 0.0);
            terms.push(Term {
                center: [0, 1, 2].map(|a| ((b.center[a] - origin[a]) * scale) as f32),
                weight: b.weight.map(|w| (w * binary / (scale * scale)) as f32),
                level: (level * binary) as f32,
                sign: b.factor.signum() as f32,
            });
            let least = b.weight.iter().fold(f64::INFINITY, |m, w| m.min(*w));
            reaches.push((reach / least * (scale * scale)) as f32);
        }
        let most = if cancel { CANCELLED } else { OVERFLOW };
        let finite = |t: &Term| t.weight.iter().chain([&t.level]).all(|v| v.is_finite());
        let enough = error >= ROUNDING * (sum.grid.reach + 0.5 * bounds.diagonal());
        if enough && highest <= math::ln(most) && scale.is_finite() && terms.iter().all(finite) {
            Box::new(Self { sum, terms, reach: reaches, unit, origin, scale })
        } else {
            Box::new(sum)
        }
    }

    fn evaluate(&self, points: &[[f64; 3]], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        let mut desk = Desk::default();
        let arch = Arch::new();
        let mut start = 0;
        while start < points.len() {
            let mut end = (start + RUN).min(points.len());
            let bounds = loop {
                let Some(b) = Aabb::around(&points[start..end]) else { return };
                if end - start <= 1 || b.diagonal() <= WIDE * self.sum.grid.reach {
                    break b;
                }
                end = start + (end - start) / 2;
            };
            let (points, value, gradient) =
                (&points[start..end], &mut value[start..end], &mut gradient[start..end]);
            arch.dispatch(Run { of: self, bounds, points, value, gradient, desk: &mut desk });
            start = end;
        }
    }

    #[inline(always)]
    fn local(&self, p: [f64; 3]) -> [f32; 3] {
        [0, 1, 2].map(|a| ((p[a] - self.origin[a]) * self.scale) as f32)
    }
}

/// Working memory: the terms around a run of points.
#[derive(Default)]
struct Desk {
    near: Vec<Term>,
}

/// Points next to each other.
struct Run<'a> {
    of: &'a Single,
    bounds: Aabb,
    points: &'a [[f64; 3]],
    value: &'a mut [f64],
    gradient: &'a mut [[f64; 3]],
    desk: &'a mut Desk,
}

impl NullaryFnOnce for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { of, bounds, points, value, gradient, desk } = self;
        let near = desk.gather(of, &bounds);
        let slope = -2.0 * core::f64::consts::LN_2 * of.unit * of.scale;
        for first in (0..points.len()).step_by(LANES) {
            let n = LANES.min(points.len() - first);
            let mut x = [[0.0f32; LANES]; 3];
            for j in 0..LANES {
                let p = of.local(points[first + j.min(n - 1)]);
                (x[0][j], x[1][j], x[2][j]) = (p[0], p[1], p[2]);
            }
            let (f, g) = sum(near, &x);
            for j in 0..n {
                value[first + j] = of.sum.offset + of.unit * f64::from(f[j]);
                gradient[first + j] = [0, 1, 2].map(|a| slope * f64::from(g[a][j]));
            }
        }
    }
}

impl Desk {
    /// The terms that count somewhere in the box.
    #[inline(always)]
    fn gather(&mut self, of: &Single, bounds: &Aabb) -> &[Term] {
        let (lo, hi) = (of.local(bounds.lo), of.local(bounds.hi));
        let near = &mut self.near;
        let mut kept = 0;
        of.sum.grid.rows(bounds, |row| {
            let (terms, reach) = (&of.terms[row.clone()], &of.reach[row]);
            if near.len() < kept + terms.len() {
                near.resize(2 * (kept + terms.len()), Term::default());
            }
            let room = &mut near[kept..kept + terms.len()];
            let mut more = 0;
            for (term, reach) in terms.iter().zip(reach) {
                let outside = |a: usize| {
                    let (below, above) = (lo[a] - term.center[a], term.center[a] - hi[a]);
                    let d = if below > above { below } else { above };
                    if d > 0.0 { d * d } else { 0.0 }
                };
                room[more] = *term;
                more += usize::from(outside(0) + outside(1) + outside(2) <= *reach);
            }
            kept += more;
        });
        &near[..kept]
    }
}

/// Σ sign 2^u and Σ sign 2^u weight (x − centre) for all points.
#[inline(always)]
fn sum(terms: &[Term], x: &[[f32; LANES]; 3]) -> ([f32; LANES], [[f32; LANES]; 3]) {
    // A point that is no number has no value either, even where no bump is near it.
    let mut f = [0.0; LANES];
    for j in 0..LANES {
        f[j] = if (x[0][j] + x[1][j] + x[2][j]).is_nan() { f32::NAN } else { 0.0 };
    }
    let (mut gx, mut gy, mut gz) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for &Term { center: [cx, cy, cz], weight: [wx, wy, wz], level, sign } in terms {
        for j in 0..LANES {
            let (dx, dy, dz) = (x[0][j] - cx, x[1][j] - cy, x[2][j] - cz);
            let (sx, sy, sz) = (wx * dx, wy * dy, wz * dz);
            let e = sign * exp2(level - (sx * dx + sy * dy + sz * dz));
            f[j] += e;
            gx[j] += e * sx;
            gy[j] += e * sy;
            gz[j] += e * sz;
        }
    }
    (f, [gx, gy, gz])
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
    fn any_thread(&self) -> bool {
        true
    }

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
