//! Interval search: the boxes that may contain a zero of F, with pruned tapes for the points in them.

use std::sync::Arc;

use rayon::prelude::*;

use crate::FieldError;
use crate::interval::Interval;
use crate::lanes::LANES;
use crate::program::{Program, Purpose};
use crate::prune::Scratch;
use crate::regions::Whole;
use crate::surface::{Aabb, Cells, Surface};
use crate::tape::Tape;

/// Pruned tapes are made while a level has at most this many boxes; below, children share their ancestor's.
const MOST_TAPES: usize = 4096;

/// Tapes up to this length are not worth pruning further.
const SHORT: usize = 16;

/// Tapes up to this length are asked for their derivatives where that may exclude a box.
const CHEAP: usize = 64;

/// Boxes that one task divides, at least.
const TASK: usize = 32;

/// A tape and the box it is good for.
#[derive(Clone)]
struct Region {
    bounds: Aabb,
    tape: Arc<Tape>,
}

/// A box, and the number of the region it lies in.
#[derive(Clone, Copy)]
struct Open {
    bounds: Aabb,
    region: u32,
}

/// Some boxes of a level, and regions that begin there. Numbers from that of the regions before on are those of the new ones.
#[derive(Default)]
struct Part {
    boxes: Vec<Open>,
    regions: Vec<Region>,
}

/// The boxes of side at most `side` (larger if they would be more than `most`) that may contain zeros.
pub(super) fn search<'a>(whole: Whole<'a>, bounds: &Aabb, side: f64, most: usize, tail: f64) -> Cells<'a> {
    let everywhere = bounds.grown(0.25 * longest(bounds));
    let mut regions = vec![Region { bounds: everywhere, tape: Arc::new(whole.tape.clone()) }];
    let mut level = vec![Open { bounds: *bounds, region: 0 }];
    let mut present = longest(bounds);
    let smooth = !whole.tape.jumps();
    while present > side && level.len() * 4 <= most && !level.is_empty() {
        let division = Division { whole: &whole, prune: level.len() <= MOST_TAPES, tail, smooth };
        let parts: Vec<Part> = level
            .par_chunks(TASK)
            .map_init(Scratch::default, |scratch, boxes| {
                let mut part = Part::default();
                boxes.iter().for_each(|open| division.divide(open, &regions, &mut part, scratch));
                part
            })
            .collect();
        (level, regions) = joined(parts, &regions);
        present *= 0.5;
    }
    let boxes = level.iter().map(|o| o.bounds).collect();
    let compile = |r: Region| (r.bounds, Program::new(&r.tape, Purpose::Inputs));
    let regions = regions.into_par_iter().map(compile).collect();
    Cells { boxes, side: present, evaluate: Box::new(Located { whole, regions }) }
}

/// The boxes of all parts in their order, with the regions that consecutive ones lie in.
fn joined(parts: Vec<Part>, before: &[Region]) -> (Vec<Open>, Vec<Region>) {
    let mut level = Vec::with_capacity(parts.iter().map(|p| p.boxes.len()).sum());
    let mut regions: Vec<Region> = Vec::new();
    let mut last = (usize::MAX, u32::MAX);
    for (k, part) in parts.into_iter().enumerate() {
        for open in part.boxes {
            let number = open.region as usize;
            let (of, region) = match number.checked_sub(before.len()) {
                None => (usize::MAX, &before[number]),
                Some(new) => (k, &part.regions[new]),
            };
            if (of, open.region) != last {
                regions.push(region.clone());
                last = (of, open.region);
            }
            level.push(Open { region: regions.len() as u32 - 1, ..open });
        }
    }
    (level, regions)
}

pub(crate) fn longest(b: &Aabb) -> f64 {
    (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max)
}

/// Up to eight boxes.
pub(crate) struct Halves {
    boxes: [Aabb; LANES],
    many: usize,
}

impl std::ops::Deref for Halves {
    type Target = [Aabb];

    fn deref(&self) -> &[Aabb] {
        &self.boxes[..self.many]
    }
}

impl Halves {
    /// Keeps those for whose number the answer is yes.
    fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        let mut many = 0;
        for k in 0..self.many {
            if wanted(k) {
                self.boxes[many] = self.boxes[k];
                many += 1;
            }
        }
        self.many = many;
    }
}

/// The halves of a box along every axis that is not much shorter than the longest; the first axis changes fastest.
pub(crate) fn halves(bounds: &Aabb, axes: usize) -> Halves {
    let long = longest(bounds);
    let mut out = Halves { boxes: [*bounds; LANES], many: 1 };
    for a in 0..axes {
        if bounds.hi[a] - bounds.lo[a] > 0.6 * long {
            let middle = 0.5 * (bounds.lo[a] + bounds.hi[a]);
            for k in 0..out.many {
                out.boxes[out.many + k] = out.boxes[k];
                out.boxes[out.many + k].lo[a] = middle;
                out.boxes[k].hi[a] = middle;
            }
            out.many *= 2;
        }
    }
    out
}

/// How boxes are divided.
struct Division<'a> {
    whole: &'a Whole<'a>,
    prune: bool,
    tail: f64,
    /// Whether F has no jumps.
    smooth: bool,
}

impl Division<'_> {
    /// Adds the parts of a box where F may have a zero, each with the tape that is left there.
    fn divide(&self, open: &Open, regions: &[Region], out: &mut Part, scratch: &mut Scratch) {
        let Self { whole, prune, tail, .. } = *self;
        let tape = &*regions[open.region as usize].tape;
        let mut parts = halves(&open.bounds, whole.axes);
        scratch.pass.run(tape, &whole.spans, &parts, whole.axes, false);
        let pass = &scratch.pass;
        parts.keep(|lane| pass.result(lane).has_zero());
        if !parts.is_empty() && self.smooth && tape.len() <= CHEAP {
            self.exclude_by_slopes(tape, &mut parts, scratch);
        }
        if parts.is_empty() || !prune || tape.len() <= SHORT || !tape.may_be_pruned(tail) {
            out.boxes.extend(parts.iter().map(|&bounds| Open { bounds, ..*open }));
            return;
        }
        // Points are projected out of their boxes: the tapes are good for a margin around them.
        let mut grown = parts.boxes;
        grown.iter_mut().for_each(|b| *b = b.grown(0.25 * longest(b)));
        let grown = &grown[..parts.len()];
        scratch.pass.run(tape, &whole.spans, grown, whole.axes, tape.drops_tails(tail));
        tape.decide(&whole.spans, tail, grown.len(), scratch);
        for (lane, &bounds) in parts.iter().enumerate() {
            let less = tape.pruned(&whole.spans, lane, scratch);
            // A tape that is hardly shorter is not worth its memory.
            let mut region = open.region;
            if less.len() * 10 < tape.len() * 9 {
                region = (regions.len() + out.regions.len()) as u32;
                out.regions.push(Region { bounds: grown[lane], tape: Arc::new(less) });
            }
            out.boxes.push(Open { bounds, region });
        }
    }

    /// Leaves out the boxes in which F, by its value in the middle and the bounds of its slopes, has no zero: where a coordinate comes more
    /// than once this tells more than the interval of F (the mean value form: Moore, Kearfott and Cloud 2009, section 6.4).
    fn exclude_by_slopes(&self, tape: &Tape, parts: &mut Halves, scratch: &mut Scratch) {
        let Whole { axes, ref spans, .. } = *self.whole;
        let mut middles = parts.boxes;
        middles.iter_mut().for_each(|b| *b = Aabb::new(b.middle(), b.middle()));
        scratch.pass.run(tape, spans, &middles[..parts.len()], axes, false);
        let values: [Interval; LANES] = std::array::from_fn(|lane| scratch.pass.result(lane));
        scratch.pass.run(tape, spans, parts, axes, true);
        let (pass, boxes) = (&scratch.pass, parts.boxes);
        let inputs: [Option<usize>; 3] = std::array::from_fn(|a| (a < axes).then(|| tape.input(a)).flatten());
        parts.keep(|lane| {
            let way = |a: usize| {
                let (b, m) = (&boxes[lane], &middles[lane]);
                Interval::new(b.lo[a], b.hi[a]) - Interval::new(m.lo[a], m.hi[a])
            };
            let parts =
                inputs.iter().enumerate().filter_map(|(a, i)| Some(pass.adjoint((*i)?, lane) * way(a)));
            parts.fold(values[lane], |sum, part| sum + part).has_zero()
        });
    }
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
    fn any_thread(&self) -> bool {
        true
    }

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

#[cfg(test)]
mod tests {
    use crate::{Aabb, Field, Surface, text};

    #[test]
    fn slopes_exclude_boxes_that_intervals_cannot() {
        let bounds = Aabb::new([-1.6; 3], [1.6; 3]);
        let boxes = |formula: &str| {
            let field = Field::new(&text::parse(formula, &[]).unwrap()).unwrap();
            field.cells(&bounds, 0.1, 100_000).unwrap().boxes
        };
        let torus = "(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)";
        let found = boxes(torus);
        // Every box with a corner inside and another outside is there, and not many others are.
        let field = Field::new(&text::parse(torus, &[]).unwrap()).unwrap();
        let (mut crossed, mut near) = (0, 0);
        for k in 0..32 * 32 * 32 {
            let lo = [k % 32, k / 32 % 32, k / 1024].map(|i| -1.6 + 0.1 * f64::from(i));
            let corners: Vec<[f64; 3]> =
                (0..8).map(|c| [0, 1, 2].map(|a| lo[a] + 0.1 * f64::from(c >> a & 1))).collect();
            let mut values = vec![0.0; 8];
            field.value(corners.as_flattened(), &mut values).unwrap();
            let middle = lo.map(|v| v + 0.05);
            let listed = found.iter().any(|b| b.contains(middle));
            let signs = values.iter().filter(|v| **v < 0.0).count();
            if signs % 8 != 0 {
                crossed += 1;
                assert!(listed, "{lo:?}");
            }
            near += usize::from(listed);
        }
        assert_eq!(near, found.len());
        assert!(crossed > 2000 && 5 * near < 9 * crossed, "{crossed} {near}");
        // Without slopes, as where F jumps, they are far more.
        let jumps = boxes(&format!("{torus} + floor(x/4+0.5)"));
        assert!(jumps.len() > 2 * found.len(), "{} {}", jumps.len(), found.len());
    }

    #[test]
    fn kinks_and_partial_functions_keep_their_boxes() {
        let bounds = Aabb::new([-1.0; 3], [1.0; 3]);
        // Zeros at known places: on kinks, at the ends of domains, where slopes are infinite.
        for (formula, zeros) in [
            ("abs(x)-abs(y)+0*z", [[0.31, -0.31, 0.2], [-0.7, 0.7, -0.9], [0.0, 0.0, 0.5]]),
            ("min(abs(x)-0.3,max(y,z)-0.2)", [[0.3, 0.9, 0.9], [0.6, 0.2, -0.4], [-0.3, 0.5, 0.1]]),
            ("sqrt(x)-0.01+0*y*z", [[1e-4, 0.3, 0.3], [1e-4, -0.8, 0.1], [1e-4, 0.0, 0.0]]),
            ("x^1.5-y^2+0*z", [[0.04, 0.008f64.sqrt(), 0.3], [0.0, 0.0, 0.1], [0.25, -0.125f64.sqrt(), 0.0]]),
            ("1/(x+2)-0.5+y*z", [[0.0, 0.0, 0.7], [0.0, -0.4, 0.0], [-0.5, (0.5 - 1.0 / 1.5) / 0.5, 0.5]]),
        ] {
            let field = Field::new(&text::parse(formula, &[]).unwrap()).unwrap();
            let found = field.cells(&bounds, 0.05, 1_000_000).unwrap();
            for z in zeros {
                let mut value = [0.0];
                field.value(&z, &mut value).unwrap();
                assert!(value[0].abs() < 1e-12, "{formula} {z:?} {value:?}");
                assert!(found.boxes.iter().any(|b| b.grown(1e-12).contains(z)), "{formula} {z:?}");
            }
        }
    }
}
