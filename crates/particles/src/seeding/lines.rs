//! Points that are uniform by area: roots along axis-parallel lines at random places.
//!
//! Lines parallel to axis a, as many per cross-section everywhere, meet a piece of surface in proportion to |n_a|. So
//! roots along lines in all axis directions, each kept with probability 1/Σ|n_a|, are uniform by area, and the sum of
//! 1/Σ|n_a| over all roots, divided by the density of the lines, is an unbiased estimate of the area.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{Aabb, FieldError};

use super::region::Region;
use super::{WATCHED, look};
use crate::rng::Rng;
use crate::run::Run;
use crate::vector::{V3, unit};

/// Points along a segment in a box at which F is evaluated before roots are isolated.
const STATIONS: usize = 3;
/// Boxes that are handled at a time, which bounds the memory.
const BATCH: usize = 1 << 15;
/// Evaluations that refine a root.
const REFINEMENTS: usize = 4;

/// Roots found so far.
#[derive(Default)]
pub(crate) struct Roots {
    pub(crate) points: Vec<V3>,
    pub(crate) gradients: Vec<V3>,
    /// Box of each root.
    pub(crate) owner: Vec<u32>,
    /// Whether the root belongs to the uniform sample.
    pub(crate) keep: Vec<bool>,
    /// Line of each root, numbered over all casts.
    pub(crate) line: Vec<u64>,
    /// Lines cast so far.
    pub(crate) lines: u64,
    /// Sum of the area estimates of all casts.
    pub(crate) area: f64,
}

impl Roots {
    /// Size of the uniform sample.
    pub(crate) fn kept(&self) -> usize {
        self.keep.iter().filter(|k| **k).count()
    }

    pub(crate) fn push(&mut self, point: V3, gradient: V3, owner: u32, keep: bool, line: u64) {
        self.points.push(point);
        self.gradients.push(gradient);
        self.owner.push(owner);
        self.keep.push(keep);
        self.line.push(line);
    }

    /// The indices with those of the uniform sample first, and their number.
    pub(crate) fn uniform_first(&self) -> (Vec<usize>, usize) {
        let mut order: Vec<usize> = (0..self.points.len()).filter(|&i| self.keep[i]).collect();
        let uniform = order.len();
        order.extend((0..self.points.len()).filter(|&i| !self.keep[i]));
        (order, uniform)
    }
}

/// A part of a line on which a root is bracketed, or may hide between two equal signs.
#[derive(Clone, Copy)]
struct Bracket {
    owner: u32,
    line: u64,
    axis: u8,
    /// The coordinates on the other axes; the one on `axis` is unused.
    at: V3,
    t: [f64; 2],
    f: [f64; 2],
    /// dF/dt at both ends.
    d: [f64; 2],
}

impl Bracket {
    fn point(&self, t: f64) -> V3 {
        let mut p = self.at;
        p[self.axis as usize] = t;
        p
    }

    fn changes_sign(&self) -> bool {
        (self.f[0] < 0.0) != (self.f[1] < 0.0)
    }

    /// Where the cubic through both ends comes closest to zero, for ends of equal sign whose slopes lead towards
    /// zero and whose cubic crosses or nearly crosses it.
    fn hidden(&self) -> Option<f64> {
        let h = self.t[1] - self.t[0];
        let s = if self.f[0] < 0.0 { -1.0 } else { 1.0 };
        let (f0, f1, d0, d1) = (s * self.f[0], s * self.f[1], s * self.d[0] * h, s * self.d[1] * h);
        if !(d0 < 0.0 && d1 > 0.0) {
            return None;
        }
        // Minimum of the cubic on (0, 1): the root of its derivative between slopes of opposite sign, by bisection.
        let (b, c) = (3.0 * (f1 - f0) - 2.0 * d0 - d1, 2.0 * (f0 - f1) + d0 + d1);
        let (mut lo, mut hi) = (0.0, 1.0);
        for _ in 0..24 {
            let m = 0.5 * (lo + hi);
            if d0 + m * (2.0 * b + 3.0 * c * m) < 0.0 {
                lo = m;
            } else {
                hi = m;
            }
        }
        let u = 0.5 * (lo + hi);
        let least = f0 + u * (d0 + u * (b + u * c));
        (least < 0.1 * f0.min(f1)).then_some(self.t[0] + u * h)
    }

    /// The root of the cubic through both ends of a bracket, a safeguarded guess.
    fn guess(&self) -> f64 {
        let h = self.t[1] - self.t[0];
        let (f0, f1, d0, d1) = (self.f[0], self.f[1], self.d[0] * h, self.d[1] * h);
        let linear = f0 / (f0 - f1);
        let (b, c) = (3.0 * (f1 - f0) - 2.0 * d0 - d1, 2.0 * (f0 - f1) + d0 + d1);
        let (mut lo, mut hi, mut u) = (0.0, 1.0, linear);
        if !(linear.is_finite() && b.is_finite() && c.is_finite()) {
            return self.t[0] + 0.5 * h;
        }
        for _ in 0..12 {
            let value = f0 + u * (d0 + u * (b + u * c));
            if (value < 0.0) == (f0 < 0.0) {
                lo = u;
            } else {
                hi = u;
            }
            let next = u - value / (d0 + u * (2.0 * b + 3.0 * u * c));
            u = if next > lo && next < hi { next } else { 0.5 * (lo + hi) };
        }
        // Not at the very ends, so that the bracket shrinks.
        self.t[0] + h * u.clamp(1e-9, 1.0 - 1e-9)
    }
}

/// Casts `density` lines per area of cross-section and axis through all boxes.
pub(crate) fn cast(
    region: &Region<'_>,
    run: &mut Run<'_>,
    axes: usize,
    density: f64,
    rng: Rng,
    roots: &mut Roots,
) -> Result<(), FieldError> {
    let before = roots.points.len();
    for (batch, boxes) in region.boxes.chunks(BATCH).enumerate() {
        let first = batch * BATCH;
        let segments = segments(boxes, first, axes, density, rng, &mut roots.lines);
        solve(region, run, axes, segments, STATIONS, roots)?;
    }
    let mut area = 0.0;
    for i in before..roots.points.len() {
        let n = unit(roots.gradients[i]);
        let weight = 1.0 / (n[0].abs() + n[1].abs() + n[2].abs()).max(1.0);
        roots.keep[i] = rng.unit(roots.line[i].wrapping_mul(64) + i as u64) < weight;
        area += weight;
    }
    roots.area += area / density;
    Ok(())
}

/// Independent points, uniform by area: on each of `many` lines through boxes drawn at random, each as likely as its
/// cross-sections are large, one root at most, found with `stations` evaluations. Gives points and gradients in the
/// order of the lines.
pub(crate) fn draw(
    region: &Region<'_>,
    run: &mut Run<'_>,
    axes: usize,
    many: usize,
    stations: usize,
    rng: Rng,
) -> Result<Vec<(V3, V3)>, FieldError> {
    /// Roots of a line that are accounted for; should there be more, those lines count less than they should.
    const MOST: usize = 4;
    let mut total = 0.0;
    let mut bound = Vec::with_capacity(region.boxes.len() * axes);
    for b in &region.boxes {
        for axis in 0..axes {
            total += (0..axes).filter(|&a| a != axis).map(|a| b.hi[a] - b.lo[a]).product::<f64>();
            bound.push(total);
        }
    }
    let mut segments: Vec<Bracket> = (0..many)
        .map(|k| {
            let own = rng.child(k as u64);
            let pick = bound.partition_point(|&c| c <= own.unit(0) * total).min(bound.len() - 1);
            let (owner, axis) = (pick / axes, pick % axes);
            let b = &region.boxes[owner];
            let mut at = b.lo;
            for a in (0..axes).filter(|&a| a != axis) {
                at[a] += own.unit(1 + a as u64) * (b.hi[a] - b.lo[a]);
            }
            Bracket {
                owner: owner as u32,
                line: k as u64,
                axis: axis as u8,
                at,
                t: [b.lo[axis], b.hi[axis]],
                f: [0.0; 2],
                d: [0.0; 2],
            }
        })
        .collect();
    segments.arrange_by_key(|s| s.owner);
    let mut roots = Roots::default();
    solve(region, run, axes, segments, stations, &mut roots)?;
    let mut of_line: Vec<(u64, u32)> = roots.line.iter().copied().zip(0u32..).collect();
    of_line.arrange();
    let mut out = Vec::new();
    for group in of_line.chunk_by(|a, b| a.0 == b.0) {
        let own = rng.child(group[0].0);
        // Each root of the line is as likely as the only root of another.
        let slot = (own.unit(8) * MOST.max(group.len()) as f64) as usize;
        let Some(&(_, i)) = group.get(slot) else { continue };
        let (p, g) = (roots.points[i as usize], roots.gradients[i as usize]);
        let n = unit(g);
        let weight = 1.0 / (n[0].abs() + n[1].abs() + n[2].abs()).max(1.0);
        if own.unit(9) < weight {
            out.push((p, g));
        }
    }
    Ok(out)
}

/// All roots on the segments.
fn solve(
    region: &Region<'_>,
    run: &mut Run<'_>,
    axes: usize,
    mut brackets: Vec<Bracket>,
    stations: usize,
    roots: &mut Roots,
) -> Result<(), FieldError> {
    let hidden = isolate(region, run, &mut brackets, stations)?;
    brackets.extend(hidden);
    brackets.arrange_by_key(|b| b.owner);
    refine(region, run, brackets, axes, roots)
}

/// Segments of lines through the boxes, at quasi-random places in each cross-section.
fn segments(
    boxes: &[Aabb],
    first: usize,
    axes: usize,
    density: f64,
    rng: Rng,
    lines: &mut u64,
) -> Vec<Bracket> {
    // The additive recurrence of the plastic number (of the golden ratio in one dimension) spreads few points evenly.
    const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let mut out = Vec::new();
    for (k, b) in boxes.iter().enumerate() {
        let owner = (first + k) as u32;
        for axis in 0..axes {
            let others: Vec<usize> = (0..axes).filter(|&a| a != axis).collect();
            let cross: f64 = others.iter().map(|&a| b.hi[a] - b.lo[a]).product();
            let own = rng.child(u64::from(owner) * 3 + axis as u64);
            let many = (density * cross + own.unit(0)).floor() as usize;
            let shift = [own.unit(1), own.unit(2)];
            for m in 0..many {
                let mut at = b.lo;
                for (o, &a) in others.iter().enumerate() {
                    let step = if others.len() == 1 { GOLDEN } else { STEP[o] };
                    let u = (shift[o] + m as f64 * step).fract();
                    at[a] = b.lo[a] + u * (b.hi[a] - b.lo[a]);
                }
                out.push(Bracket {
                    owner,
                    line: *lines,
                    axis: axis as u8,
                    at,
                    t: [b.lo[axis], b.hi[axis]],
                    f: [0.0; 2],
                    d: [0.0; 2],
                });
                *lines += 1;
            }
        }
    }
    out
}

/// Replaces segments by brackets around sign changes; gives those that hide between equal signs.
fn isolate(
    region: &Region<'_>,
    run: &mut Run<'_>,
    segments: &mut Vec<Bracket>,
    stations: usize,
) -> Result<Vec<Bracket>, FieldError> {
    let station = |s: &Bracket, k: usize| s.t[0] + (s.t[1] - s.t[0]) * k as f64 / (stations - 1) as f64;
    let (mut value, mut gradient, mut points) = (Vec::new(), Vec::new(), Vec::new());
    // F and dF/dt at all stations, looked at some at a time: the points and gradients of all are much memory.
    let many = stations * segments.len();
    let (mut f, mut d) = (Vec::with_capacity(many), Vec::with_capacity(many));
    for first in (0..many).step_by(WATCHED) {
        let part = first..(first + WATCHED).min(many);
        let of = |i: usize| (&segments[i / stations], i % stations);
        points.clear();
        points.extend(part.clone().map(of).map(|(s, k)| s.point(station(s, k))));
        look(region.surface(), run, &points, &mut value, &mut gradient)?;
        f.extend_from_slice(&value);
        d.extend(part.zip(&gradient).map(|(i, g)| g[of(i).0.axis as usize]));
    }
    let (mut found, mut doubtful) = (Vec::new(), Vec::new());
    for (i, s) in segments.iter().enumerate() {
        for k in 0..stations - 1 {
            let a = i * stations + k;
            let piece = Bracket {
                t: [station(s, k), station(s, k + 1)],
                f: [f[a], f[a + 1]],
                d: [d[a], d[a + 1]],
                ..*s
            };
            if !(piece.f[0].is_finite() && piece.f[1].is_finite()) {
                continue;
            }
            if piece.changes_sign() {
                found.push(piece);
            } else if let Some(t) = piece.hidden() {
                doubtful.push((piece, t));
            }
        }
    }
    // One look at the place where the roots should hide.
    let points: Vec<V3> = doubtful.iter().map(|(b, t)| b.point(*t)).collect();
    look(region.surface(), run, &points, &mut value, &mut gradient)?;
    let mut hidden = Vec::new();
    for (k, (b, t)) in doubtful.into_iter().enumerate() {
        let slope = gradient[k][b.axis as usize];
        let left = Bracket { t: [b.t[0], t], f: [b.f[0], value[k]], d: [b.d[0], slope], ..b };
        let right = Bracket { t: [t, b.t[1]], f: [value[k], b.f[1]], d: [slope, b.d[1]], ..b };
        hidden.extend([left, right].into_iter().filter(|p| value[k].is_finite() && p.changes_sign()));
    }
    *segments = found;
    Ok(hidden)
}

/// Shrinks every bracket around its root and files the roots.
fn refine(
    region: &Region<'_>,
    run: &mut Run<'_>,
    mut brackets: Vec<Bracket>,
    axes: usize,
    roots: &mut Roots,
) -> Result<(), FieldError> {
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    for round in 0..REFINEMENTS {
        let guesses: Vec<f64> = brackets.iter().map(Bracket::guess).collect();
        let points: Vec<V3> = brackets.iter().zip(&guesses).map(|(b, &t)| b.point(t)).collect();
        look(region.surface(), run, &points, &mut value, &mut gradient)?;
        let last = round + 1 == REFINEMENTS;
        let mut open = Vec::with_capacity(if last { 0 } else { brackets.len() });
        for (k, b) in brackets.into_iter().enumerate() {
            let (t, f, g) = (guesses[k], value[k], gradient[k]);
            let width = b.t[1] - b.t[0];
            let newton = (f / g[b.axis as usize]).abs();
            // Good to 1e-6 of the box: a projection finishes the job.
            if last || newton < 1e-6 * region.side || width < 1e-9 * region.side {
                // A jump or a pole changes the sign too, but F does not fade out there.
                let fades = f.abs() <= 0.5 * b.f[0].abs().max(b.f[1].abs()) || width < 1e-3 * region.side;
                if f.is_finite() && g.iter().all(|v| v.is_finite()) && fades {
                    let mut p = b.point(t);
                    p[axes..].fill(0.0);
                    roots.push(p, g, b.owner, false, b.line);
                }
                continue;
            }
            let slope = g[b.axis as usize];
            let mut next = b;
            let end = usize::from((f < 0.0) != (b.f[0] < 0.0));
            (next.t[end], next.f[end], next.d[end]) = (t, f, slope);
            if f.is_finite() {
                open.push(next);
            }
        }
        brackets = open;
        if brackets.is_empty() {
            break;
        }
    }
    Ok(())
}
