//! The crossings in a small cell. It is cut, down to single rays and parts of them, until F rises or falls along all rays of each part,
//! so that each ray has one crossing at most there: then the signs of F at the ends tell.

use isoswarm_field::{CompiledPiece, Piece, Ranges};

use super::Hit;
use super::bundle::LEVELS;
use super::refine::Bracket;
use super::walk::{Cell, Walk};

/// Parts of rays are not cut below this, relative to t: two crossings nearer to each other may be missed.
const SHORT: f64 = 1e-8;

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
}

impl Walk<'_> {
    /// Finds the crossings in a cell; `ranges` are those of F there.
    pub(super) fn search(&mut self, piece: &Piece, cell: Cell, ranges: &Ranges) {
        let ready = self.pieces.compiled(piece);
        let mut search = Search { ready, spans: Vec::with_capacity(2 * TOGETHER), cuts: 0 };
        self.narrow(&mut search, piece, cell, ranges);
        self.settle(&mut search);
    }

    /// A part of the cell that may contain zeros.
    fn narrow(&mut self, search: &mut Search, piece: &Piece, cell: Cell, ranges: &Ranges) {
        let Some(rate) = self.rate(cell, ranges) else { return };
        let alone = cell.square.level + 1 == LEVELS;
        let single = !rate.has_zero() && !piece.jumps();
        let short = alone && cell.to - cell.from <= SHORT * cell.to.abs().max(cell.from.abs());
        if single || short || search.cuts >= MOST {
            self.collect(search, cell, if single { 0.5 * (rate.lo + rate.hi) } else { f64::NAN });
            return;
        }
        search.cuts += 1;
        let cells = self.parts(cell, true);
        let boxes: Vec<_> =
            cells.iter().filter_map(|c| Some(self.bundle.common(c.square)?.swept(c.from, c.to))).collect();
        for (cell, ranges) in cells.into_iter().zip(self.pieces.ranges(piece, &boxes, true)) {
            if self.bundle.common(cell.square).is_none() {
                continue;
            }
            if ranges.value.lo >= 0.0 || ranges.value.hi < 0.0 {
                self.pass(cell, ranges.value.hi < 0.0);
            } else {
                self.narrow(search, piece, cell, &ranges);
            }
        }
    }

    /// The parts of the open rays in a cell.
    fn collect(&mut self, search: &mut Search, cell: Cell, rate: f64) {
        for ray in cell.square.rays() {
            if self.is_open(ray) {
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
