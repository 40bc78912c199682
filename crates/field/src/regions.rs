//! Pruned tapes by region, shared by the points in it: a tree of boxes around runs of points, each with the
//! tape that is left of its parent's there.

use rayon::prelude::*;

use crate::FieldError;
use crate::interval::Interval;
use crate::kernel::{Batch, Columns, Want, hessian, run};
use crate::program::{Program, Purpose};
use crate::prune::Scratch;
use crate::surface::{Aabb, Surface};
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
    pub program: Program,
    /// Operations carried out for each point.
    pub operations: usize,
}

/// What a build needs to know of the whole model.
pub(crate) struct Whole<'a> {
    pub tape: &'a Tape,
    /// The same with registers, for derivatives with respect to the coordinates.
    pub program: &'a Program,
    pub uniforms: &'a [f64],
    /// Intervals of the uniforms: wider than a point where parameters may move.
    pub spans: Vec<Interval>,
    pub axes: usize,
}

impl Whole<'_> {
    pub(crate) fn inputs(&self, b: &Aabb) -> [Interval; crate::MAX_AXES] {
        let mut inputs = [Interval::ZERO; crate::MAX_AXES];
        for a in 0..self.axes.min(3) {
            inputs[a] = Interval::new(b.lo[a], b.hi[a]);
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
        let mut scratch = Scratch::default();
        parent.interval(&self.spans, &self.inputs(&bounds), &mut scratch);
        let tape = parent.pruned(&self.spans, options.tail, &mut scratch);
        drop(scratch);
        if points.len() <= options.leaf {
            let program = Program::new(&tape, Purpose::Inputs);
            out.push(Leaf { start, end: start + points.len(), bounds, program, operations: tape.len() });
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

    /// F and ∂F/∂x with one program, on this thread.
    pub(crate) fn one(&self, program: &Program, points: &[[f64; 3]], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        if self.axes < 3 {
            gradient.fill([0.0; 3]);
        }
        let x = Columns { data: gradient.as_flattened_mut(), stride: 3 };
        let leaves = Columns { data: &mut [], stride: 0 };
        run(program, self.uniforms, Batch::of_points(points, self.axes), value, Want::Gradient { x, leaves });
    }

    /// Second derivatives with one program, on this thread.
    pub(crate) fn one_hessian(&self, program: &Program, points: &[[f64; 3]], out: &mut [[f64; 6]]) {
        let d = self.axes;
        let mut full = vec![0.0; points.len() * d * d];
        hessian(program, self.uniforms, Batch::of_points(points, d), &mut full);
        upper(&full, d, out);
    }
}

/// From (n, d, d) to xx, xy, xz, yy, yz, zz.
pub(crate) fn upper(full: &[f64], d: usize, out: &mut [[f64; 6]]) {
    for (h, m) in out.iter_mut().zip(full.chunks_exact(d * d)) {
        let at = |i: usize, j: usize| if i < d && j < d { m[i * d + j] } else { 0.0 };
        *h = [at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)];
    }
}

/// A surface with pruned tapes for the points it was narrowed for: see [`Surface::narrowed`].
pub struct Narrowed<'a> {
    pub(crate) whole: Whole<'a>,
    pub(crate) leaves: Vec<Leaf>,
}

impl Narrowed<'_> {
    /// Mean number of operations a point.
    pub fn operations(&self) -> f64 {
        let points = self.leaves.last().map_or(0, |l| l.end).max(1);
        let total: usize = self.leaves.iter().map(|l| l.operations * (l.end - l.start)).sum();
        total as f64 / points as f64
    }

    /// Number of regions.
    pub fn regions(&self) -> usize {
        self.leaves.len()
    }

    fn check(&self, points: &[[f64; 3]]) -> Result<(), FieldError> {
        let expected = self.leaves.last().map_or(0, |l| l.end);
        if points.len() == expected {
            return Ok(());
        }
        Err(FieldError::Shape {
            what: "points of a narrowed surface",
            expected: format!("{expected} points, those it was narrowed for"),
            given: points.len().to_string(),
        })
    }

    /// The region's program, or the whole one for a point that has left the region.
    fn program_at<'s>(&'s self, leaf: &'s Leaf, p: [f64; 3]) -> &'s Program {
        if leaf.bounds.contains(p) { &leaf.program } else { self.whole.program }
    }
}

/// Runs of points that share a program.
fn runs<'s, 'p>(
    n: &'s Narrowed<'_>,
    leaf: &'s Leaf,
    points: &'p [[f64; 3]],
) -> impl Iterator<Item = (usize, usize, &'s Program)> + use<'s, 'p> {
    let mut start = 0;
    std::iter::from_fn(move || {
        let first = points.get(start)?;
        let program = n.program_at(leaf, *first);
        let more = points[start..].iter().take_while(|p| std::ptr::eq(n.program_at(leaf, **p), program)).count();
        let run = (start, start + more, program);
        start += more;
        Some(run)
    })
}

impl Surface for Narrowed<'_> {
    fn axes(&self) -> usize {
        self.whole.axes
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        self.check(points)?;
        let mut tasks = Vec::with_capacity(self.leaves.len());
        let (mut values, mut gradients) = (value, gradient);
        for leaf in &self.leaves {
            let (v, rest) = values.split_at_mut(leaf.end - leaf.start);
            values = rest;
            let (g, rest) = gradients.split_at_mut(leaf.end - leaf.start);
            gradients = rest;
            tasks.push((leaf, v, g));
        }
        tasks.into_par_iter().with_min_len(4).for_each(|(leaf, v, g)| {
            let points = &points[leaf.start..leaf.end];
            for (start, end, program) in runs(self, leaf, points) {
                self.whole.one(program, &points[start..end], &mut v[start..end], &mut g[start..end]);
            }
        });
        Ok(())
    }

    fn hessian(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) -> Result<(), FieldError> {
        self.check(points)?;
        let mut tasks = Vec::with_capacity(self.leaves.len());
        let mut rest = out;
        for leaf in &self.leaves {
            let (h, more) = rest.split_at_mut(leaf.end - leaf.start);
            rest = more;
            tasks.push((leaf, h));
        }
        tasks.into_par_iter().for_each(|(leaf, h)| {
            let points = &points[leaf.start..leaf.end];
            for (start, end, program) in runs(self, leaf, points) {
                self.whole.one_hessian(program, &points[start..end], &mut h[start..end]);
            }
        });
        Ok(())
    }
}
