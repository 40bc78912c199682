//! Sums of Gaussian bumps, such as molecules: F = offset + Σ factor exp(level − Σ_axis weight (x_axis − centre)²).
//!
//! Near any point only the bumps around it matter. A tape spends a dozen instructions on a bump and needs interval
//! passes to find out which ones can be left out; here a grid of the bumps knows it, and one loop computes value and
//! derivatives of each. The sum is recognised on the tape, so that it does not matter how a model was written.

mod exact;
mod near;
mod recipe;
mod recognise;
mod search;
mod single;
mod terms;
#[cfg(test)]
mod tests;

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use single::Single;

use crate::FieldError;
use crate::math;
use crate::surface::{Aabb, Cells, Surface};
use crate::wide::{Double, Wide};
pub(crate) use near::Near;
pub(crate) use recipe::Recipe;
pub(crate) use terms::Terms;

/// factor · exp(level − Σ_axis weight (x_axis − centre)²)
#[derive(Clone, Copy, Debug)]
struct Bump {
    factor: f64,
    level: f64,
    weight: [f64; 3],
    center: [f64; 3],
}

/// What all dropped bumps together may move the surface, relative to its diameter.
const TAIL: f64 = 1e-13;

/// The gradient at the surface of several bumps that cancel, relative to that of one alone: a guess on the safe side,
/// since the tail enters by its logarithm.
const FLAT: f64 = 1e-3;

/// Points whose bumps are gathered together.
const RUN: usize = 16;

/// Points share their bumps if the box around them has at most this diagonal, in reaches; and where bumps that one of them does
/// not need cost more than finding them.
const WIDE: f64 = 1.6;
const CLOSE: f64 = 0.2;

/// Points that one task evaluates.
const CHUNK: usize = 1024;

/// Lanes of a block.
const LANES: usize = 16;
/// Vectors that hold them.
const PARTS: usize = LANES / Double::WIDTH;

/// A sum of bumps at fixed parameters, as a surface.
#[derive(Debug)]
pub(crate) struct Sum {
    offset: f64,
    bumps: Vec<Bump>,
    /// The instruction of each bump's exponential on the tape.
    exps: Vec<u32>,
    /// Squared distance, measured in the bump's own weights, beyond which it is left out.
    reach: Vec<f64>,
    /// What a bump that is left out is worth at most.
    tail: f64,
    /// Smallest slope of a bump alone where it cancels the offset.
    slope: f64,
    grid: Grid,
}

/// A grid of cells; the bumps are in the order of the cells of their centres, x running fastest.
#[derive(Debug)]
struct Grid {
    /// Longest distance at which any bump counts.
    reach: f64,
    side: f64,
    lo: [f64; 3],
    count: [usize; 3],
    /// Where each cell's bumps begin; one more at the end.
    start: Vec<u32>,
}

/// The same for a sketch, and how many bumps end near one point.
const SKETCHED: f64 = 0.1 / 8.0;

/// Distance from the centre at which the exponent has fallen by one, at most.
fn extent(b: &Bump) -> f64 {
    1.0 / b.weight.iter().fold(f64::INFINITY, |m, w| m.min(*w)).sqrt()
}

impl Sum {
    /// What is left when tails are dropped that move the surface by about `error` (a length) at most.
    pub(crate) fn sketch(&self, error: f64) -> Option<Box<dyn Surface>> {
        Some(Single::or_double(self.shortened(error)?, error))
    }

    /// The same in double precision.
    fn shortened(&self, error: f64) -> Option<Sum> {
        // Wherever a bump ends only the few around it end too, not all of them.
        let tail = SKETCHED * error * self.slope;
        let bumps = self.bumps.iter().copied().zip(self.exps.iter().copied()).collect();
        Self::with_tail(self.offset, bumps, tail.max(self.tail), self.slope)
    }

    fn new(offset: f64, bumps: Vec<(Bump, u32)>) -> Option<Sum> {
        let centers: Vec<[f64; 3]> = bumps.iter().map(|b| b.0.center).collect();
        let finite = |b: &Bump| b.factor.is_finite() && b.center.iter().all(|c| c.is_finite());
        if !bumps.iter().all(|b| finite(&b.0)) || !offset.is_finite() {
            return None;
        }
        // A bump alone has its surface where it cancels the offset, and the slope 2 |offset| √(weight · depth) there.
        let slope = |b: &Bump| {
            let depth = (math::ln(b.factor.abs()) + b.level - math::ln(offset.abs())).max(1e-3);
            2.0 * offset.abs() * (b.weight.iter().fold(f64::INFINITY, |m, w| m.min(*w)) * depth).sqrt()
        };
        let least = bumps.iter().map(|b| slope(&b.0)).fold(f64::INFINITY, f64::min);
        let diameter =
            Aabb::around(&centers)?.diagonal() + bumps.iter().map(|b| extent(&b.0)).fold(0.0, f64::max);
        let tail = TAIL * FLAT * least * diameter / bumps.len() as f64;
        if !(tail > 0.0 && tail.is_finite()) {
            return None;
        }
        Self::with_tail(offset, bumps, tail, least)
    }

    /// The sum without what lies below `tail`.
    fn with_tail(offset: f64, bumps: Vec<(Bump, u32)>, tail: f64, slope: f64) -> Option<Sum> {
        let centers: Vec<[f64; 3]> = bumps.iter().map(|b| b.0.center).collect();
        let reach = |b: &Bump| (b.level + math::ln(b.factor.abs() / tail)).max(0.0);
        let longest = bumps.iter().map(|(b, _)| reach(b).sqrt() * extent(b)).fold(0.0, f64::max);
        let (grid, order) = Grid::new(&centers, longest)?;
        let (bumps, exps): (Vec<Bump>, Vec<u32>) = order.iter().map(|&i| bumps[i as usize]).unzip();
        let reach = bumps.iter().map(reach).collect();
        Some(Sum { offset, tail, slope, bumps, exps, reach, grid })
    }

    /// The bumps that count somewhere in the box, in a fixed order.
    fn near(&self, b: &Aabb, out: &mut Vec<u32>) {
        out.clear();
        self.grid.rows(b, |row| {
            let first = out.len();
            out.resize(first + row.len(), 0);
            let list = &mut out[first..];
            let mut kept = 0;
            for i in row {
                list[kept] = i as u32;
                kept += usize::from(self.least_exponent(i, b) <= self.reach[i]);
            }
            out.truncate(first + kept);
        });
    }

    /// Whether bump `i` is above the tail anywhere in the box.
    #[inline(always)]
    fn counts(&self, i: u32, b: &Aabb) -> bool {
        self.least_exponent(i as usize, b) <= self.reach[i as usize]
    }

    /// Smallest Σ weight (x − centre)² in the box.
    #[inline(always)]
    fn least_exponent(&self, i: usize, b: &Aabb) -> f64 {
        let bump = &self.bumps[i];
        let mut d2 = 0.0;
        for a in 0..3 {
            let d = (b.lo[a] - bump.center[a]).max(bump.center[a] - b.hi[a]).max(0.0);
            d2 += bump.weight[a] * d * d;
        }
        d2
    }

    /// Calls `f` with runs of neighbouring points and the bumps that count there.
    fn runs(&self, points: &[[f64; 3]], near: &mut Vec<u32>, f: &mut impl FnMut(usize, usize, &[Bump])) {
        let mut bumps = Vec::new();
        self.numbered_runs(points, WIDE, near, &mut |start, end, near| {
            bumps.clear();
            bumps.extend(near.iter().map(|&i| self.bumps[i as usize]));
            f(start, end, &bumps);
        });
    }

    /// Calls `f` with runs of neighbouring points and the exponentials, by their instructions on the tape, that count there.
    pub(crate) fn exps(&self, points: &[[f64; 3]], mut f: impl FnMut(usize, usize, &[u32])) {
        let mut exps = Vec::new();
        self.numbered_runs(points, CLOSE, &mut Vec::new(), &mut |start, end, near| {
            exps.clear();
            exps.extend(near.iter().map(|&i| self.exps[i as usize]));
            f(start, end, &exps);
        });
    }

    /// The same with the numbers of the bumps.
    fn numbered_runs(
        &self,
        points: &[[f64; 3]],
        wide: f64,
        near: &mut Vec<u32>,
        f: &mut impl FnMut(usize, usize, &[u32]),
    ) {
        let mut start = 0;
        while start < points.len() {
            let mut end = (start + RUN).min(points.len());
            // Points that are far apart are taken in shorter runs.
            let bounds = loop {
                let Some(b) = Aabb::around(&points[start..end]) else { return };
                if end - start <= 1 || b.diagonal() <= wide * self.grid.reach {
                    break b;
                }
                end = start + (end - start) / 2;
            };
            self.near(&bounds, near);
            f(start, end, near);
            start = end;
        }
    }

    fn evaluate(&self, points: &[[f64; 3]], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        let mut near = Vec::new();
        let arch = Arch::new();
        self.runs(points, &mut near, &mut |start, end, bumps| {
            for first in (start..end).step_by(LANES) {
                let n = LANES.min(end - first);
                let block = Block { offset: self.offset, bumps, points: &points[first..first + n] };
                let (f, g) = arch.dispatch(block);
                value[first..first + n].copy_from_slice(&f[..n]);
                for j in 0..n {
                    gradient[first + j] = [g[0][j], g[1][j], g[2][j]];
                }
            }
        });
    }

    fn second(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) {
        let mut near = Vec::new();
        let arch = Arch::new();
        self.runs(points, &mut near, &mut |start, end, bumps| {
            for first in (start..end).step_by(LANES) {
                let n = LANES.min(end - first);
                let h = arch.dispatch(Second { bumps, points: &points[first..first + n] });
                for j in 0..n {
                    out[first + j] = [0, 1, 2, 3, 4, 5].map(|k| h[k][j]);
                }
            }
        });
    }
}

/// Points next to each other, and the bumps that count there.
struct Block<'a> {
    offset: f64,
    bumps: &'a [Bump],
    points: &'a [[f64; 3]],
}

impl NullaryFnOnce for Block<'_> {
    type Output = ([f64; LANES], [[f64; LANES]; 3]);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { offset, bumps, points } = self;
        let c = Double::splat;
        let x = columns(points);
        // A point that is no number has no value either, even where no bump is near it.
        let mut values = [offset; LANES];
        for j in 0..LANES {
            if (x[0][j] + x[1][j] + x[2][j]).is_nan() {
                values[j] = f64::NAN;
            }
        }
        let none = [c(0.0); PARTS];
        let (mut f, mut g, mut x3) = (none, [none; 3], [none; 3]);
        for j in 0..PARTS {
            f[j] = Double::load(&values[j * Double::WIDTH..]);
            for a in 0..3 {
                x3[a][j] = Double::load(&x[a][j * Double::WIDTH..]);
            }
        }
        let [x, y, z] = x3;
        for b in bumps {
            let [wx, wy, wz] = b.weight.map(c);
            let [cx, cy, cz] = b.center.map(c);
            let (mut d, mut u) = ([none; 3], none);
            for j in 0..PARTS {
                d[0][j] = x[j] - cx;
                d[1][j] = y[j] - cy;
                d[2][j] = z[j] - cz;
                u[j] = c(b.level)
                    - (wx * (d[0][j] * d[0][j]) + wy * (d[1][j] * d[1][j]) + wz * (d[2][j] * d[2][j]));
            }
            for u in &mut u {
                *u = c(b.factor) * math::exps(*u);
            }
            for j in 0..PARTS {
                f[j] += u[j];
                let e = c(-2.0) * u[j];
                g[0][j] += e * (wx * d[0][j]);
                g[1][j] += e * (wy * d[1][j]);
                g[2][j] += e * (wz * d[2][j]);
            }
        }
        (unpacked(f), g.map(unpacked))
    }
}

/// The lanes as an array.
#[inline(always)]
fn unpacked(parts: [Double; PARTS]) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    for (j, part) in parts.into_iter().enumerate() {
        part.store(&mut lanes[j * Double::WIDTH..]);
    }
    lanes
}

/// Points next to each other as columns; the last one is repeated.
#[inline(always)]
fn columns(points: &[[f64; 3]]) -> [[f64; LANES]; 3] {
    let mut x = [[0.0; LANES]; 3];
    for a in 0..3 {
        for j in 0..LANES {
            x[a][j] = points[j.min(points.len() - 1)][a];
        }
    }
    x
}

/// The second derivatives of [`Block`].
struct Second<'a> {
    bumps: &'a [Bump],
    points: &'a [[f64; 3]],
}

impl NullaryFnOnce for Second<'_> {
    type Output = [[f64; LANES]; 6];

    #[inline(always)]
    fn call(self) -> Self::Output {
        let x = columns(self.points);
        let mut h = [[0.0; LANES]; 6];
        for b in self.bumps {
            // With d = weight (x - centre): 2 e (2 d dᵀ - weight).
            let (mut d, mut e) = ([[0.0; LANES]; 3], [b.level; LANES]);
            for a in 0..3 {
                for j in 0..LANES {
                    let r = x[a][j] - b.center[a];
                    d[a][j] = b.weight[a] * r;
                    e[j] -= d[a][j] * r;
                }
            }
            for j in 0..LANES {
                e[j] = 2.0 * b.factor * math::exp(e[j]);
            }
            for (k, (a, c)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
                let own = if a == c { b.weight[a] } else { 0.0 };
                for j in 0..LANES {
                    h[k][j] += e[j] * (2.0 * d[a][j] * d[c][j] - own);
                }
            }
        }
        h
    }
}

impl Grid {
    /// Cells of half the reach, or larger where they would be too many; and the order of the bumps in them.
    fn new(centers: &[[f64; 3]], reach: f64) -> Option<(Grid, Vec<u32>)> {
        let bounds = Aabb::around(centers)?;
        let extent = [0, 1, 2].map(|a| bounds.hi[a] - bounds.lo[a]);
        let most = 8.0 * centers.len() as f64 + 64.0;
        let mut side = 0.5 * reach;
        let cells = |side: f64| extent.iter().map(|e| (e / side).floor() + 1.0).product::<f64>();
        if !(side > 0.0 && side.is_finite() && cells(side).is_finite()) {
            return None;
        }
        while cells(side) > most {
            side *= 1.25;
        }
        let count = extent.map(|e| (e / side) as usize + 1);
        let mut grid = Grid { reach, side, lo: bounds.lo, count, start: Vec::new() };
        // Sorted by counting: in each cell in their order.
        let cells: Vec<usize> = centers.iter().map(|c| grid.number(grid.cell(*c))).collect();
        let total = count.iter().product::<usize>();
        let mut start = vec![0u32; total + 1];
        cells.iter().for_each(|&c| start[c + 1] += 1);
        (0..total).for_each(|c| start[c + 1] += start[c]);
        let mut next = start.clone();
        let mut order = vec![0; centers.len()];
        for (i, &c) in cells.iter().enumerate() {
            order[next[c] as usize] = i as u32;
            next[c] += 1;
        }
        grid.start = start;
        Some((grid, order))
    }

    fn cell(&self, p: [f64; 3]) -> [usize; 3] {
        // The cast saturates: what lies below the grid belongs to its first cell.
        [0, 1, 2].map(|a| (((p[a] - self.lo[a]) / self.side) as usize).min(self.count[a] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.count[1] + y) * self.count[0] + x
    }

    /// Calls `f` with ranges of bumps: all that may count in the box.
    fn rows(&self, b: &Aabb, mut f: impl FnMut(std::ops::Range<usize>)) {
        let grown = b.grown(self.reach);
        let (lo, hi) = (self.cell(grown.lo), self.cell(grown.hi));
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                let first = self.start[self.number([lo[0], y, z])];
                let last = self.start[self.number([hi[0], y, z]) + 1];
                if first < last {
                    f(first as usize..last as usize);
                }
            }
        }
    }
}

impl Surface for Sum {
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
        points.par_chunks(CHUNK).zip(out.par_chunks_mut(CHUNK)).for_each(|(p, h)| self.second(p, h));
        Ok(())
    }

    fn cells(&self, bounds: &Aabb, side: f64, most: usize) -> Option<Cells<'_>> {
        Some(search::search(self, bounds, side, most))
    }
}
