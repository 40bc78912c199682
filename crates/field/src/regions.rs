//! Pruned tapes by region, shared by the points in it: a tree of boxes around runs of points, each with the
//! tape that is left of its parent's there.

use rayon::prelude::*;

use crate::FieldError;
use crate::interval::Interval;
use crate::kernel::{Batch, Columns, Want, run};
use crate::prune::IntervalScratch;
use crate::surface::Aabb;
use crate::tape::Tape;

/// How regions are cut.
#[derive(Clone, Copy, Debug)]
pub struct RegionOptions {
    /// Most points in a leaf. Fewer than 64 do not pay for an interval pass.
    pub leaf: usize,
    /// Change of F that all dropped exponentials together may cause; 0 drops none.
    pub tail: f64,
}

impl Default for RegionOptions {
    fn default() -> Self {
        Self { leaf: 256, tail: 0.0 }
    }
}

/// A run of points, the box they may move in, and the tape for that box.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    pub start: usize,
    pub end: usize,
    pub bounds: Aabb,
    pub tape: Tape,
}

/// What a build needs to know of the whole model.
pub(crate) struct Whole<'a> {
    pub tape: &'a Tape,
    pub uniforms: &'a [f64],
    /// Intervals of the uniforms: wider than a point where parameters may move.
    pub spans: &'a [Interval],
    pub axes: usize,
}

impl Whole<'_> {
    pub(crate) fn inputs(&self, b: &Aabb) -> [[Interval; 1]; crate::MAX_AXES] {
        let mut inputs = [[Interval::ZERO]; crate::MAX_AXES];
        for a in 0..self.axes.min(3) {
            inputs[a] = [Interval::new(b.lo[a], b.hi[a])];
        }
        inputs
    }

    /// Cuts the points, which should be in a spatially coherent order, into leaves.
    pub(crate) fn leaves(&self, points: &[[f64; 3]], margin: f64, options: RegionOptions) -> Vec<Leaf> {
        // Interval passes over the largest boxes prune nothing; a model that is short has little to gain.
        let mut leaves = Vec::new();
        self.cut(self.tape, points, 0, margin, &options, &mut leaves);
        leaves
    }

    fn cut(
        &self,
        parent: &Tape,
        points: &[[f64; 3]],
        start: usize,
        margin: f64,
        options: &RegionOptions,
        out: &mut Vec<Leaf>,
    ) {
        let Some(bounds) = Aabb::around(points) else { return };
        let bounds = bounds.grown(margin);
        let mut scratch = IntervalScratch::default();
        parent.interval(self.spans, &self.inputs(&bounds), &mut scratch);
        let tape = parent.pruned(self.spans, options.tail, &mut scratch);
        drop(scratch);
        if points.len() <= options.leaf {
            out.push(Leaf { start, end: start + points.len(), bounds, tape });
            return;
        }
        // Runs along a space-filling curve are compact when they are cut in equal parts, four at a time: fewer
        // levels cost fewer passes over long tapes.
        let parts = points.len().div_ceil(options.leaf).min(4);
        let size = points.len().div_ceil(parts);
        let cut = |(k, run): (usize, &[[f64; 3]])| {
            let mut leaves = Vec::new();
            self.cut(&tape, run, start + k * size, margin, options, &mut leaves);
            leaves
        };
        let lists: Vec<Vec<Leaf>> = points.par_chunks(size).enumerate().map(cut).collect();
        out.extend(lists.into_iter().flatten());
    }

    /// F and ∂F/∂x at the points, which are those that the leaves were cut for, in the same order.
    pub(crate) fn evaluate(
        &self,
        leaves: &[Leaf],
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        let expected = leaves.last().map_or(0, |l| l.end);
        if points.len() != expected {
            return Err(FieldError::Shape {
                what: "points of a narrowed surface",
                expected: format!("{expected} points, those it was narrowed for"),
                given: points.len().to_string(),
            });
        }
        let mut tasks = Vec::with_capacity(leaves.len());
        let (mut values, mut gradients) = (value, gradient);
        for leaf in leaves {
            let (v, rest) = values.split_at_mut(leaf.end - leaf.start);
            values = rest;
            let (g, rest) = gradients.split_at_mut(leaf.end - leaf.start);
            gradients = rest;
            tasks.push((leaf, v, g));
        }
        tasks.into_par_iter().with_min_len(4).for_each(|(leaf, v, g)| {
            let points = &points[leaf.start..leaf.end];
            self.one(&leaf.tape, points, v, g);
            for (i, p) in points.iter().enumerate() {
                if !leaf.bounds.contains(*p) {
                    self.one(self.tape, &points[i..=i], &mut v[i..=i], &mut g[i..=i]);
                }
            }
        });
        Ok(())
    }

    fn one(&self, tape: &Tape, points: &[[f64; 3]], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        if self.axes < 3 {
            gradient.fill([0.0; 3]);
        }
        let x = Columns { data: gradient.as_flattened_mut(), stride: 3 };
        let leaves = Columns { data: &mut [], stride: 0 };
        run(tape, self.uniforms, Batch::of_points(points, self.axes), value, Want::Gradient { x, leaves });
    }
}
