//! The crossings in a small cell. It is cut, down to single rays and parts of them, until F rises or falls along all rays of each part,
//! so that each ray has one crossing at most there: then the signs of F at the ends tell.

use isoswarm_field::{CompiledPiece, Interval, Piece, Ranges};

use super::Hit;
use super::bundle::{LEVELS, SIDE};
use super::refine::Bracket;
use super::walk::{Cell, Walk};

/// Parts of rays are not cut below this, relative to t: two crossings nearer to each other may be missed.
const SHORT: f64 = 1e-8;

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
}

/// Whether a function surely has no zero between two values of the same sign, `length` apart, with this range of slopes; `room` is
/// for rounding.
fn stays_off(a: f64, b: f64, slope: Interval, length: f64, room: f64) -> bool {
    if (a < 0.0) != (b < 0.0) {
        return false;
    }
    // Downwards from a as fast as may be and up to b again: upside down for negative values.
    let (lo, hi) = if a < 0.0 { (-slope.hi, -slope.lo) } else { (slope.lo, slope.hi) };
    let (a, b) = (a.abs(), b.abs());
    let least = if lo >= 0.0 || hi <= 0.0 { a.min(b) } else { (hi * a - lo * b + lo * hi * length) / (hi - lo) };
    least > room
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
        let rays = if piece.jumps() { rays } else { self.near(search, cell, ranges, rate, rays) };
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

    /// The rays whose values at the cell's ends, with the range of their slopes, do not prove that they stay off the surface.
    fn near(&mut self, search: &mut Search, cell: Cell, ranges: &Ranges, rate: Interval, rays: Rays) -> Rays {
        let part = |ray: usize| {
            let r = &self.bundle.rays[ray];
            (cell.from.max(r.near), cell.to.min(r.far))
        };
        let open: Vec<usize> = cell
            .square
            .rays()
            .filter(|&i| rays.0 & search.bit(i) != 0 && self.is_open(i) && part(i).0 < part(i).1)
            .collect();
        search.points.clear();
        search.points.extend(open.iter().map(|&i| self.bundle.rays[i].at(part(i).0)));
        search.points.extend(open.iter().map(|&i| self.bundle.rays[i].at(part(i).1)));
        search.value.resize(search.points.len(), 0.0);
        self.pieces.value(&search.ready, &search.points, &mut search.value);
        let (first, last) = search.value.split_at(open.len());
        let room = ROOM * ranges.value.magnitude();
        let off: Vec<bool> = (0..open.len())
            .map(|k| {
                let (from, to) = part(open[k]);
                stays_off(first[k], last[k], rate, to - from, room)
            })
            .collect();
        let inside: Vec<bool> = first.iter().map(|v| *v < 0.0).collect();
        let mut left = 0;
        for (k, &i) in open.iter().enumerate() {
            if !off[k] {
                left |= search.bit(i);
            } else if self.begins_in(i, cell) {
                self.begin(i, inside[k]);
            }
        }
        Rays(left)
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
