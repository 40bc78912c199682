//! Interval search: the boxes that may contain a zero of F, with pruned tapes for the points in them.

use std::sync::Arc;

use rayon::prelude::*;

use crate::FieldError;
use crate::program::{Program, Purpose};
use crate::prune::Scratch;
use crate::regions::Whole;
use crate::surface::{Aabb, Cells, Surface};
use crate::tape::Tape;

/// Pruned tapes are made while a level has at most this many boxes; below, children share their ancestor's.
const MOST_TAPES: usize = 4096;

/// Tapes up to this length are not worth pruning further.
const SHORT: usize = 16;

/// A tape and the box it is good for.
#[derive(Clone)]
struct Region {
    bounds: Aabb,
    tape: Arc<Tape>,
}

struct Open {
    bounds: Aabb,
    region: Region,
}

/// The boxes of side at most `side` (larger if they would be more than `most`) that may contain zeros.
pub(super) fn search<'a>(whole: Whole<'a>, bounds: &Aabb, side: f64, most: usize, tail: f64) -> Cells<'a> {
    let everywhere = bounds.grown(0.25 * longest(bounds));
    let region = Region { bounds: everywhere, tape: Arc::new(whole.tape.clone()) };
    let mut level = vec![Open { bounds: *bounds, region }];
    let mut present = longest(bounds);
    while present > side && level.len() * 4 <= most && !level.is_empty() {
        let prune = level.len() <= MOST_TAPES;
        let next: Vec<Vec<Open>> = level
            .par_iter()
            .with_min_len(8)
            .map_init(Scratch::default, |scratch, open| divide(&whole, open, prune, tail, scratch))
            .collect();
        level = next.into_iter().flatten().collect();
        present *= 0.5;
    }
    let boxes = level.iter().map(|o| o.bounds).collect();
    let mut regions: Vec<Region> = Vec::new();
    for open in level {
        if !regions.last().is_some_and(|r| Arc::ptr_eq(&r.tape, &open.region.tape)) {
            regions.push(open.region);
        }
    }
    let compile = |r: Region| (r.bounds, Program::new(&r.tape, Purpose::Inputs));
    let regions = regions.into_par_iter().map(compile).collect();
    Cells { boxes, side: present, evaluate: Box::new(Located { whole, regions }) }
}

pub(crate) fn longest(b: &Aabb) -> f64 {
    (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max)
}

/// The halves of a box along every axis that is not much shorter than the longest.
pub(crate) fn halves(bounds: &Aabb, axes: usize) -> Vec<Aabb> {
    let long = longest(bounds);
    let mut parts = vec![*bounds];
    for a in (0..axes).rev() {
        if bounds.hi[a] - bounds.lo[a] > 0.6 * long {
            let middle = 0.5 * (bounds.lo[a] + bounds.hi[a]);
            let cut = |b: Aabb| {
                let (mut low, mut high) = (b, b);
                low.hi[a] = middle;
                high.lo[a] = middle;
                [low, high]
            };
            parts = parts.into_iter().flat_map(cut).collect();
        }
    }
    parts
}

/// The parts of a box where F may have a zero, each with the tape that is left there.
fn divide(whole: &Whole, open: &Open, prune: bool, tail: f64, scratch: &mut Scratch) -> Vec<Open> {
    let tape = &open.region.tape;
    let mut parts = halves(&open.bounds, whole.axes);
    scratch.pass.run(tape, &whole.spans, &parts, whole.axes, false);
    let mut lane = 0;
    parts.retain(|_| {
        lane += 1;
        scratch.pass.result(lane - 1).has_zero()
    });
    if parts.is_empty() || !prune || tape.len() <= SHORT {
        return parts.into_iter().map(|bounds| Open { bounds, region: open.region.clone() }).collect();
    }
    // Points are projected out of their boxes: the tapes are good for a margin around them.
    let grown: Vec<Aabb> = parts.iter().map(|b| b.grown(0.25 * longest(b))).collect();
    scratch.pass.run(tape, &whole.spans, &grown, whole.axes, tape.drops_tails(tail));
    tape.decide(&whole.spans, tail, grown.len(), scratch);
    let one = |(lane, bounds): (usize, Aabb)| {
        let less = tape.pruned(&whole.spans, lane, scratch);
        // A tape that is hardly shorter is not worth its memory.
        let region = if less.len() * 10 < tape.len() * 9 {
            Region { bounds: grown[lane], tape: Arc::new(less) }
        } else {
            open.region.clone()
        };
        Open { bounds, region }
    };
    parts.into_iter().enumerate().map(one).collect()
}

/// Evaluates points by the region they lie in.
struct Located<'a> {
    whole: Whole<'a>,
    regions: Vec<(Aabb, Program)>,
}

impl Located<'_> {
    /// Runs of consecutive points with one region each, or none for a point outside all.
    fn runs(&self, points: &[[f64; 3]]) -> Vec<(usize, usize, Option<usize>)> {
        let mut runs: Vec<(usize, usize, Option<usize>)> = Vec::new();
        let mut current = 0;
        let n = self.regions.len();
        for (i, p) in points.iter().enumerate() {
            let holds = |r: &usize| self.regions[*r].0.contains(*p);
            let found = (current..n).chain(0..current).find(holds);
            current = found.unwrap_or(current);
            match runs.last_mut() {
                Some((start, end, r)) if *r == found && *end - *start < 4096 => *end = i + 1,
                _ => runs.push((i, i + 1, found)),
            }
        }
        runs
    }
}

impl Surface for Located<'_> {
    fn axes(&self) -> usize {
        self.whole.axes
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        let mut tasks = Vec::new();
        let (mut values, mut gradients) = (value, gradient);
        for (start, end, region) in self.runs(points) {
            let (v, rest) = values.split_at_mut(end - start);
            values = rest;
            let (g, rest) = gradients.split_at_mut(end - start);
            gradients = rest;
            tasks.push((&points[start..end], region, v, g));
        }
        tasks.into_par_iter().with_min_len(8).for_each(|(points, region, v, g)| {
            let program = region.map_or(self.whole.program, |r| &self.regions[r].1);
            self.whole.one(program, points, v, g);
        });
        Ok(())
    }

    fn hessian(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) -> Result<(), FieldError> {
        for (start, end, region) in self.runs(points) {
            let program = region.map_or(self.whole.program, |r| &self.regions[r].1);
            self.whole.one_hessian(program, &points[start..end], &mut out[start..end]);
        }
        Ok(())
    }
}

/// Whether F surely has no zero in the box, which may be unbounded.
pub(super) fn excludes(whole: &Whole, b: &Aabb) -> bool {
    !whole.tape.interval(&whole.spans, &whole.inputs(b)).has_zero()
}
