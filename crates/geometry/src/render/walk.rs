//! The walk through a tile's cells, nearest first.

use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::{Interval, Piece, Pieces, Ranges};

use super::bundle::{Bundle, LEVELS, SIDE, Square};
use super::refine::Refinery;
use super::{CastOptions, Hit};

/// From this level on (squares of 8 rays) a cell is searched where all its rays are monotone.
const SEARCHED: usize = 3;

/// Up to this level (squares of 4 rays) tapes are pruned.
const PRUNED: usize = 4;

/// Cells that are longer than this times their width are cut along the rays only.
const LONG: f64 = 2.0;

/// The least width of a cell, over the length of the rays.
const LEAST: f64 = 1e-4;

/// A ray on its way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    /// Whether the sign of F at its beginning is known.
    pub begun: bool,
    /// Whether F < 0 where the walk has come to.
    pub inside: bool,
    /// Crossings found, and those being worked out.
    pub found: u16,
    pub waiting: u16,
}

/// A cell that may contain zeros.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub square: Square,
    pub from: f64,
    pub to: f64,
}

pub(super) struct Walk<'a> {
    pub pieces: &'a Pieces<'a>,
    pub bundle: Bundle<'a>,
    pub states: Vec<State>,
    pub hits: Vec<Hit>,
    pub options: &'a CastOptions,
    pub refinery: Refinery,
    /// Cells are not made narrower than this, in t.
    least: f64,
    stop: &'a AtomicBool,
}

impl<'a> Walk<'a> {
    pub(super) fn new(
        pieces: &'a Pieces<'a>,
        bundle: Bundle<'a>,
        options: &'a CastOptions,
        stop: &'a AtomicBool,
    ) -> Self {
        let states = vec![State::default(); SIDE * SIDE];
        let least = bundle.common(Square::WHOLE).map_or(0.0, |c| LEAST * (c.far - c.near));
        Self { pieces, bundle, states, hits: Vec::new(), options, refinery: Refinery::default(), least, stop }
    }

    pub(super) fn run(mut self) -> Vec<Hit> {
        if let Some(c) = self.bundle.common(Square::WHOLE) {
            let cell = Cell { square: Square::WHOLE, from: c.near, to: c.far };
            let whole = self.pieces.whole();
            self.cut(&whole, cell);
        }
        let mut hits = self.hits;
        hits.sort_by(|a, b| (a.ray, a.t).partial_cmp(&(b.ray, b.t)).unwrap_or(std::cmp::Ordering::Equal));
        hits
    }

    /// The parts of a cell, nearest first.
    pub(super) fn parts(&self, cell: Cell, fine: bool) -> Vec<Cell> {
        let ratio = self.ratio(cell);
        let (squares, slabs) = if ratio < LONG && cell.square.level + 1 < LEVELS {
            (cell.square.quarters().to_vec(), 2)
        } else {
            (vec![cell.square], if ratio < 3.0 * LONG && !fine { 4 } else { 8 })
        };
        let at = |k: usize| match k {
            _ if k == slabs => cell.to,
            _ => cell.from + (cell.to - cell.from) * (k as f64 / slabs as f64),
        };
        let mut parts = Vec::with_capacity(8);
        for k in 0..slabs {
            for &square in &squares {
                let Some(c) = self.bundle.common(square) else { continue };
                let (from, to) = (at(k).max(c.near), at(k + 1).min(c.far));
                if from < to {
                    parts.push(Cell { square, from, to });
                }
            }
        }
        parts
    }

    /// Whether a cell is small enough to be searched.
    fn is_small(&self, cell: Cell) -> bool {
        cell.square.level >= SEARCHED && self.ratio(cell) < LONG
    }

    /// Whether each ray has one crossing at most in a cell.
    fn is_single(&self, piece: &Piece, cell: Cell, ranges: &Ranges) -> bool {
        self.rate(cell, ranges).is_some_and(|rate| !rate.has_zero()) && !piece.jumps()
    }

    /// Range of dF/dt along the rays of a cell.
    pub(super) fn rate(&self, cell: Cell, ranges: &Ranges) -> Option<Interval> {
        let d = &self.bundle.common(cell.square)?.direction;
        let along = |a: usize| Interval::new(d.lo[a], d.hi[a]) * ranges.gradient[a];
        Some(along(0) + along(1) + along(2))
    }

    /// Length over width.
    fn ratio(&self, cell: Cell) -> f64 {
        let Some(c) = self.bundle.common(cell.square) else { return 0.0 };
        let (across, along) = c.extent(0.5 * (cell.from + cell.to));
        // Squares with a ray or two have no width to speak of.
        (cell.to - cell.from) * along / across.max(self.least * along)
    }

    /// Cuts a cell and goes on with its parts.
    fn cut(&mut self, piece: &Piece, cell: Cell) {
        if self.stop.load(Ordering::Relaxed) {
            return;
        }
        let cells = self.parts(cell, false);
        let small: Vec<bool> = cells.iter().map(|c| self.is_small(*c)).collect();
        let boxes: Vec<_> =
            cells.iter().filter_map(|c| Some(self.bundle.common(c.square)?.swept(c.from, c.to))).collect();
        if boxes.is_empty() {
            return;
        }
        let (ranges, pieces) = self.pieces.divide(piece, &boxes, small.contains(&true));
        for (((cell, ranges), piece), small) in cells.into_iter().zip(ranges).zip(pieces).zip(small) {
            if self.bundle.common(cell.square).is_none() {
                continue;
            }
            if ranges.value.lo >= 0.0 {
                self.pass(cell, false);
            } else if ranges.value.hi < 0.0 {
                self.pass(cell, true);
            } else if small && (cell.square.level >= PRUNED || self.is_single(&piece, cell, &ranges)) {
                self.search(&piece, cell, &ranges);
            } else {
                self.cut(&piece, cell);
            }
        }
    }

    /// A cell without zeros: the rays that begin here are on this side.
    pub(super) fn pass(&mut self, cell: Cell, inside: bool) {
        let Some(c) = self.bundle.common(cell.square) else { return };
        // A ray that begins at the end of the cell belongs to the next one; its own cell knows best.
        if c.begun < cell.from {
            return;
        }
        for i in cell.square.rays() {
            if self.begins_in(i, cell) {
                self.begin(i, inside);
            }
        }
    }

    /// Whether nothing is known yet of where ray `i` begins, and it is in this cell. (One that begins before may have a part that waits.)
    pub(super) fn begins_in(&self, i: usize, cell: Cell) -> bool {
        let near = self.bundle.rays[i].near;
        !self.states[i].begun && self.is_open(i) && cell.from <= near && near < cell.to
    }

    /// The ray begins inside or outside.
    pub(super) fn begin(&mut self, i: usize, inside: bool) {
        let ray = &self.bundle.rays[i];
        self.states[i] = State { begun: true, inside, ..self.states[i] };
        if let Some(face) = ray.face.filter(|&f| self.options.cuts(f, inside)) {
            let hit = Hit { ray: i as u16, t: ray.near, gradient: [0.0; 3], cut: Some(face) };
            self.found(hit);
        }
    }

    /// Notes a hit.
    pub(super) fn found(&mut self, hit: Hit) {
        let i = usize::from(hit.ray);
        self.hits.push(hit);
        self.states[i].found += 1;
        if self.states[i].found == self.options.layers {
            self.bundle.close(i);
        }
    }

    /// Whether ray `i` looks for more.
    pub(super) fn is_open(&self, i: usize) -> bool {
        let r = &self.bundle.rays[i];
        r.near < r.far && self.states[i].found < self.options.layers
    }
}
