//! Pruned tapes by region, shared by the points in it: a tree of boxes around runs of points, each with the
//! tape that is left of its parent's there.

use std::cell::RefCell;

use rayon::prelude::*;

use crate::FieldError;
use crate::cut::{Curve, Part};
use crate::interval::Interval;
use crate::kernel::{Batch, Columns, Want, hessian, run};
use crate::lanes::LANES;
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
    /// The tape itself, where it is kept instead of a program.
    pub tape: Option<Tape>,
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
        if points.is_empty() {
            return Vec::new();
        }
        let curve = Curve::new(points);
        let cut = Cut { whole: self, curve: &curve, margin, options, tapes: false };
        cut.descend(&Node { tape: self.tape, start: 0, end: points.len() })
    }

    /// The same with the leaves' tapes instead of programs.
    pub(crate) fn tapes(&self, points: &[[f64; 3]], options: RegionOptions) -> Vec<Leaf> {
        if points.is_empty() {
            return Vec::new();
        }
        let curve = Curve::new(points);
        let cut = Cut { whole: self, curve: &curve, margin: 0.0, options, tapes: true };
        cut.descend(&Node { tape: self.tape, start: 0, end: points.len() })
    }

    /// F and ∂F/∂x with one program, on this thread.
    pub(crate) fn one(
        &self,
        program: &Program,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) {
        if self.axes < 3 {
            gradient.fill([0.0; 3]);
        }
        let x = Columns { data: gradient.as_flattened_mut(), stride: 3 };
        run(program, self.uniforms, Batch::of_points(points, self.axes), value, Want::Chosen { x });
    }

    /// Second derivatives with one program, on this thread.
    pub(crate) fn one_hessian(&self, program: &Program, points: &[[f64; 3]], out: &mut [[f64; 6]]) {
        let d = self.axes;
        let mut full = vec![0.0; points.len() * d * d];
        hessian(program, self.uniforms, Batch::of_points(points, d), &mut full);
        upper(&full, d, out);
    }
}

/// A run of points and the tape that is left around it.
struct Node<'a> {
    tape: &'a Tape,
    start: usize,
    end: usize,
}

/// The recursion from all points to leaves.
struct Cut<'a> {
    whole: &'a Whole<'a>,
    curve: &'a Curve<'a>,
    margin: f64,
    options: RegionOptions,
    /// Whether leaves keep their tapes instead of programs.
    tapes: bool,
}

impl Cut<'_> {
    fn descend(&self, node: &Node) -> Vec<Leaf> {
        let parts = self.curve.parts(node.start, node.end, LANES, self.options.leaf);
        let children = self.prune(node, &parts);
        let below = |(leaf, tape): (Leaf, Tape)| {
            if self.is_last(leaf.end - leaf.start) {
                return vec![Leaf { tape: self.tapes.then_some(tape), ..leaf }];
            }
            self.descend(&Node { tape: &tape, start: leaf.start, end: leaf.end })
        };
        if node.end - node.start > 1024 {
            children.into_par_iter().flat_map_iter(below).collect()
        } else {
            children.into_iter().flat_map(below).collect()
        }
    }

    /// Whether a run of this many points is a leaf.
    fn is_last(&self, points: usize) -> bool {
        points <= self.options.leaf.max(1)
    }

    /// The tape that is left of a node's in each part.
    fn prune(&self, node: &Node, parts: &[Part]) -> Vec<(Leaf, Tape)> {
        thread_local! {
            static SCRATCH: RefCell<Scratch> = RefCell::new(Scratch::default());
        }
        let Whole { spans, axes, .. } = self.whole;
        let tail = self.options.tail;
        SCRATCH.with_borrow_mut(|scratch| {
            let boxes: Vec<Aabb> = parts.iter().map(|p| p.bounds.grown(self.margin)).collect();
            scratch.pass.run(node.tape, spans, &boxes, *axes, node.tape.drops_tails(tail));
            node.tape.decide(spans, tail, boxes.len(), scratch);
            let one = |(lane, part): (usize, &Part)| {
                let tape = node.tape.pruned(spans, lane, scratch);
                // Only leaves are evaluated.
                let last = self.is_last(part.len());
                let program = if last && !self.tapes {
                    Program::new(&tape, Purpose::Inputs)
                } else {
                    Program::default()
                };
                let (start, end) = (part.start, part.end);
                (Leaf { start, end, bounds: boxes[lane], program, operations: tape.len(), tape: None }, tape)
            };
            parts.iter().enumerate().map(one).collect()
        })
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

/// Whether all points lie in the box, without a branch for each.
fn holds_all(b: &Aabb, points: &[[f64; 3]]) -> bool {
    let inside = |p: &[f64; 3]| {
        let axis = |a: usize| (b.lo[a] <= p[a]) & (p[a] <= b.hi[a]);
        axis(0) & axis(1) & axis(2)
    };
    points.iter().fold(true, |all, p| all & inside(p))
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
        let more =
            points[start..].iter().take_while(|p| std::ptr::eq(n.program_at(leaf, **p), program)).count();
        let run = (start, start + more, program);
        start += more;
        Some(run)
    })
}

impl Surface for Narrowed<'_> {
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
            if holds_all(&leaf.bounds, points) {
                return self.whole.one(&leaf.program, points, v, g);
            }
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
