//! The crossings in a small cell. It is cut, down to single rays and parts of them, until F rises or falls along all rays of each part,
//! so that each ray has one crossing at most there: then the signs of F at the ends tell.

use isoswarm_field::{CompiledPiece, Interval, Piece, Pieces, Ranges};

use super::Hit;
use super::bundle::{LEVELS, SIDE};
use super::refine::Bracket;
use super::walk::{Cell, Walk};

/// Parts of rays are not cut below this, relative to t: two crossings nearer to each other may be missed.
const SHORT: f64 = 1e-8;

/// Cells with parts of no more rays than this that may touch the surface are searched ray by ray.
const FEW: usize = 16;

/// Pieces into which such a part is cut at a time.
const CUTS: usize = 8;

/// Room for rounding in a value, in parts of the largest that F has in a cell.
const ROOM: f64 = 1e-12;

/// Parts whose ends are evaluated together.
const TOGETHER: usize = 64;

/// Most cuts of a small cell. What is open then is known by the signs at the ends of its parts only.
const MOST: usize = 512;

/// A part of a ray with one crossing at most.
#[derive(Clone, Copy, Debug)]
struct Span {
    ray: usize,
    from: f64,
    to: f64,
    /// dF/dt in the middle of its range; NaN where nothing is known of it.
    rate: f64,
}

fn point(v: f64) -> Interval {
    Interval::new(v, v)
}

/// A small cell being searched.
pub(super) struct Search {
    ready: CompiledPiece,
    /// Parts of rays, each ray's nearest first, that wait for their ends' values.
    spans: Vec<Span>,
    cuts: usize,
    /// First ray of the cell's square.
    corner: usize,
    points: Vec<[f64; 3]>,
    value: Vec<f64>,
}

/// Rays of a square of up to 8 × 8, a bit each.
#[derive(Clone, Copy)]
struct Rays(u64);

impl Search {
    fn bit(&self, ray: usize) -> u64 {
        let (x, y) = (ray % SIDE - self.corner % SIDE, ray / SIDE - self.corner / SIDE);
        1 << (8 * y + x)
    }

    /// F at all `points`.
    fn evaluate(&mut self, pieces: &Pieces) {
        self.value.resize(self.points.len(), 0.0);
        pieces.value(&self.ready, &self.points, &mut self.value);
    }
}

/// A part of one ray, with the values of F at its ends and the range of its slope between them.
#[derive(Clone, Copy, Debug)]
struct Part {
    ray: usize,
    from: f64,
    to: f64,
    ends: [f64; 2],
    rate: Interval,
}

impl Part {
    /// Whether F surely has no zero in the part; `room` is for rounding.
    fn stays_off(&self, room: f64) -> bool {
        let [a, b] = self.ends;
        if (a < 0.0) != (b < 0.0) {
            return false;
        }
        // Downwards from a as fast as may be and up to b again: upside down for negative values.
        let (lo, hi) = if a < 0.0 { (-self.rate.hi, -self.rate.lo) } else { (self.rate.lo, self.rate.hi) };
        let (a, b) = (a.abs(), b.abs());
        let least = if lo >= 0.0 || hi <= 0.0 {
            a.min(b)
        } else {
            (hi * a - lo * b + lo * hi * (self.to - self.from)) / (hi - lo)
        };
        least > room
    }
}

impl Walk<'_> {
    /// Finds the crossings in a cell; `ranges` are those of F there.
    pub(super) fn search(&mut self, piece: &Piece, cell: Cell, ranges: &Ranges) {
        let ready = self.pieces.compiled(piece);
        let corner = cell.square.rays().next().unwrap_or(0);
        let (spans, points, value) = (Vec::with_capacity(2 * TOGETHER), Vec::new(), Vec::new());
        let mut search = Search { ready, spans, cuts: 0, corner, points, value };
        self.narrow(&mut search, piece, cell, ranges, Rays(u64::MAX));
        self.settle(&mut search);
    }

    /// A part of the cell that may contain zeros, looked at for these rays.
    fn narrow(&mut self, search: &mut Search, piece: &Piece, cell: Cell, ranges: &Ranges, rays: Rays) {
        let Some(rate) = self.rate(cell, ranges) else { return };
        let alone = cell.square.level + 1 == LEVELS;
        let single = !rate.has_zero() && !piece.jumps();
        let short = alone && cell.to - cell.from <= SHORT * cell.to.abs().max(cell.from.abs());
        if single || short || search.cuts >= MOST {
            self.collect(search, cell, if single { 0.5 * (rate.lo + rate.hi) } else { f64::NAN }, rays);
            return;
        }
        let rays = if piece.jumps() {
            rays
        } else {
            let room = ROOM * ranges.value.magnitude();
            let (near, left) = self.near(search, cell, rate, room, rays);
            if near.len() <= FEW {
                return self.by_rays(search, piece, near, room);
            }
            left
        };
        search.cuts += 1;
        let mut cells = self.parts(cell, true);
        cells.retain(|c| c.square.rays().any(|i| rays.0 & search.bit(i) != 0));
        let boxes: Vec<_> =
            cells.iter().filter_map(|c| Some(self.bundle.common(c.square)?.swept(c.from, c.to))).collect();
        for (cell, ranges) in cells.into_iter().zip(self.pieces.ranges(piece, &boxes, true)) {
            if self.bundle.common(cell.square).is_none() {
                continue;
            }
            if ranges.value.lo >= 0.0 || ranges.value.hi < 0.0 {
                self.pass(cell, ranges.value.hi < 0.0);
            } else {
                self.narrow(search, piece, cell, &ranges, rays);
            }
        }
    }

    /// The parts of these rays in the cell whose values at the ends do not prove that they stay off the surface, and their rays.
    fn near(
        &mut self,
        search: &mut Search,
        cell: Cell,
        rate: Interval,
        room: f64,
        rays: Rays,
    ) -> (Vec<Part>, Rays) {
        let mut parts: Vec<Part> = Vec::new();
        for ray in cell.square.rays().filter(|&i| rays.0 & search.bit(i) != 0 && self.is_open(i)) {
            let r = &self.bundle.rays[ray];
            let (from, to) = (cell.from.max(r.near), cell.to.min(r.far));
            if from < to {
                parts.push(Part { ray, from, to, ends: [0.0; 2], rate });
            }
        }
        let n = parts.len();
        let at = |p: &Part, t: f64| self.bundle.rays[p.ray].at(t);
        search.points.clear();
        search.points.extend(parts.iter().map(|p| at(p, p.from)));
        search.points.extend(parts.iter().map(|p| at(p, p.to)));
        search.evaluate(self.pieces);
        for (k, p) in parts.iter_mut().enumerate() {
            p.ends = [search.value[k], search.value[n + k]];
        }
        for p in &parts {
            if self.begins_in(p.ray, cell) {
                self.begin(p.ray, p.ends[0] < 0.0);
            }
        }
        parts.retain(|p| !p.stays_off(room) && self.is_open(p.ray));
        let left = parts.iter().fold(0, |all, p| all | search.bit(p.ray));
        (parts, Rays(left))
    }

    /// Finds the crossings of a few rays, each cut by itself: first by values, then by ranges over what is left.
    fn by_rays(&mut self, search: &mut Search, piece: &Piece, mut parts: Vec<Part>, room: f64) {
        let mut spans: Vec<Span> = Vec::new();
        while !parts.is_empty() {
            let fine = self.cut_by_values(search, &parts, room);
            parts.clear();
            for some in fine.chunks(Pieces::MOST) {
                search.cuts += 1;
                let boxes: Vec<_> =
                    some.iter().map(|p| self.bundle.rays[p.ray].swept(p.from, p.to)).collect();
                for (p, ranges) in some.iter().zip(self.pieces.ranges(piece, &boxes, true)) {
                    if !ranges.value.has_zero() {
                        continue;
                    }
                    let along = |a: usize| point(self.bundle.rays[p.ray].direction[a]) * ranges.gradient[a];
                    let rate = along(0) + along(1) + along(2);
                    let short = p.to - p.from <= SHORT * p.to.abs().max(p.from.abs());
                    if !rate.has_zero() || short || search.cuts >= MOST {
                        let rate = if rate.has_zero() { f64::NAN } else { 0.5 * (rate.lo + rate.hi) };
                        spans.push(Span { ray: p.ray, from: p.from, to: p.to, rate });
                    } else {
                        parts.push(Part { rate, ..*p });
                    }
                }
            }
        }
        // Each ray's nearest first.
        spans.sort_by(|a, b| a.ray.cmp(&b.ray).then(a.from.total_cmp(&b.from)));
        search.spans.extend(spans);
        if search.spans.len() >= TOGETHER {
            self.settle(search);
        }
    }

    /// The pieces of parts that may touch the surface, by values at their ends and the parts' slopes.
    fn cut_by_values(&self, search: &mut Search, parts: &[Part], room: f64) -> Vec<Part> {
        let at = |p: &Part, k: usize| p.from + (p.to - p.from) * (k as f64 / CUTS as f64);
        search.points.clear();
        for p in parts {
            search.points.extend((1..CUTS).map(|k| self.bundle.rays[p.ray].at(at(p, k))));
        }
        search.evaluate(self.pieces);
        let mut out = Vec::with_capacity(2 * parts.len());
        for (p, values) in parts.iter().zip(search.value.chunks_exact(CUTS - 1)) {
            let value = |k: usize| match k {
                0 => p.ends[0],
                CUTS => p.ends[1],
                _ => values[k - 1],
            };
            let end = |k: usize| if k == CUTS { p.to } else { at(p, k) };
            let fine = (0..CUTS).map(|k| Part {
                from: end(k),
                to: end(k + 1),
                ends: [value(k), value(k + 1)],
                ..*p
            });
            out.extend(fine.filter(|p| p.from < p.to && !p.stays_off(room)));
        }
        out
    }

    /// The parts of these open rays in a cell.
    fn collect(&mut self, search: &mut Search, cell: Cell, rate: f64, rays: Rays) {
        for ray in cell.square.rays() {
            if rays.0 & search.bit(ray) != 0 && self.is_open(ray) {
                let r = &self.bundle.rays[ray];
                let (from, to) = (cell.from.max(r.near), cell.to.min(r.far));
                if from < to {
                    search.spans.push(Span { ray, from, to, rate });
                }
            }
        }
        if search.spans.len() >= TOGETHER {
            self.settle(search);
        }
    }

    /// Finds the crossings in the parts that wait.
    fn settle(&mut self, search: &mut Search) {
        self.begin_all(search);
        search.spans.retain(|s| self.is_open(s.ray));
        if search.spans.is_empty() {
            return;
        }
        let ends = self.values(search, |s| s.to);
        let mut brackets: Vec<Bracket> = Vec::new();
        for (s, end) in search.spans.iter().zip(ends) {
            let state = &mut self.states[s.ray];
            // What rises has no crossing from outside, and what falls none from inside.
            let possible = s.rate.is_nan() || (s.rate > 0.0) == state.inside;
            if possible && (end < 0.0) != state.inside && state.found + state.waiting < self.options.layers {
                state.inside = !state.inside;
                state.waiting += 1;
                brackets.push(Bracket::new(s.ray, (s.from, s.to), end, s.rate));
            }
        }
        search.spans.clear();
        self.refinery.solve(self.pieces, &search.ready, self.bundle.rays, &mut brackets);
        for b in brackets {
            self.states[b.ray].waiting -= 1;
            // Where F or its gradient is no number the surface has a hole.
            if b.gradient.iter().all(|g| g.is_finite()) {
                self.found(Hit { ray: b.ray as u16, t: b.t, gradient: b.gradient, cut: None });
            }
        }
    }

    /// Rays that begin in the parts that wait learn on which side.
    fn begin_all(&mut self, search: &mut Search) {
        let mut new: Vec<Span> = Vec::new();
        for s in &search.spans {
            if !self.states[s.ray].begun {
                self.states[s.ray].begun = true;
                new.push(*s);
            }
        }
        if new.is_empty() {
            return;
        }
        let points: Vec<_> = new.iter().map(|s| self.bundle.rays[s.ray].at(s.from)).collect();
        let mut value = vec![0.0; points.len()];
        self.pieces.value(&search.ready, &points, &mut value);
        for (s, v) in new.iter().zip(value) {
            self.begin(s.ray, v < 0.0);
        }
    }

    fn values(&self, search: &Search, t: impl Fn(&Span) -> f64) -> Vec<f64> {
        let points: Vec<_> = search.spans.iter().map(|s| self.bundle.rays[s.ray].at(t(s))).collect();
        let mut value = vec![0.0; points.len()];
        self.pieces.value(&search.ready, &points, &mut value);
        value
    }
}
