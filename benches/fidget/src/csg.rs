//! F and ∂F/∂x at points on the surface of a model with many minima and maxima.

use crate::timing::{Uniform, fastest};
use fidget::context::Context;
use fidget::eval::{BulkEvaluator, Function, MathFunction, TracingEvaluator};
use fidget::jit::JitFunction;
use fidget::types::{Grad, Interval};
use fidget::var::Var;

/// A model in fidget's form.
pub struct Model {
    function: JitFunction,
    axes: [Option<usize>; 3],
}

/// Points of one region of space and the box around them.
pub struct Region {
    lo: [f32; 3],
    hi: [f32; 3],
    range: std::ops::Range<usize>,
    children: Vec<Region>,
}

/// How tapes are made for a region.
#[derive(Clone, Copy, Debug)]
pub enum Descent {
    /// Every leaf simplifies the whole tape.
    Leaves,
    /// Every node of the tree simplifies its parent's tape.
    Tree,
}

impl Model {
    /// Reads a `.vm` text.
    pub fn new(text: &str) -> Self {
        let (context, root) = Context::from_text(text.as_bytes()).expect("a .vm model");
        let function = JitFunction::new(&context, &[root]).expect("the node is in the context");
        let axes = [Var::X, Var::Y, Var::Z].map(|v| function.vars().get(&v));
        Self { function, axes }
    }

    /// Length of the tape.
    pub fn size(&self) -> usize {
        self.function.size()
    }

    fn inputs<T: From<f32> + Copy>(&self, columns: &[Vec<T>; 3]) -> Vec<Vec<T>> {
        let mut inputs = vec![Vec::new(); self.function.vars().len()];
        for a in 0..3 {
            if let Some(i) = self.axes[a] {
                inputs[i] = columns[a].clone();
            }
        }
        inputs
    }

    /// `count` points of F = 0 in the box: where random lines along the axes cross it, by bisection.
    pub fn surface_points(&self, lo: [f32; 3], hi: [f32; 3], count: usize) -> Vec<[f32; 3]> {
        const STEPS: usize = 256;
        const LINES: usize = 256;
        let tape = self.function.float_slice_tape(Default::default());
        let mut evaluate = JitFunction::new_float_slice_eval();
        let mut values = |points: &[[f32; 3]]| -> Vec<f32> {
            let columns = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect());
            evaluate.eval(&tape, &self.inputs(&columns)).expect("all inputs are given")[0].to_vec()
        };
        let mut u = Uniform(3);
        let mut found = Vec::new();
        let mut axis = 0;
        while found.len() < count {
            let mut points = Vec::with_capacity(LINES * STEPS);
            for _ in 0..LINES {
                let start = [0, 1, 2].map(|a| u.between(lo[a].into(), hi[a].into()) as f32);
                for k in 0..STEPS {
                    let mut p = start;
                    p[axis] = lo[axis] + (hi[axis] - lo[axis]) * k as f32 / (STEPS - 1) as f32;
                    points.push(p);
                }
            }
            let f = values(&points);
            let crosses = |i: &usize| i % STEPS + 1 < STEPS && (f[*i] < 0.0) != (f[i + 1] < 0.0);
            let brackets: Vec<usize> = (0..points.len()).filter(crosses).collect();
            let mut a: Vec<_> = brackets.iter().map(|&i| points[i]).collect();
            let mut b: Vec<_> = brackets.iter().map(|&i| points[i + 1]).collect();
            for _ in 0..24 {
                let middle: Vec<_> =
                    a.iter().zip(&b).map(|(a, b)| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))).collect();
                if middle.is_empty() {
                    break;
                }
                for (i, value) in values(&middle).into_iter().enumerate() {
                    let same = (value < 0.0) == (f[brackets[i]] < 0.0);
                    *(if same { &mut a[i] } else { &mut b[i] }) = middle[i];
                }
            }
            found.extend(a);
            axis = (axis + 1) % 3;
        }
        found.truncate(count);
        found
    }

    /// Seconds for F and ∂F/∂x at all points with the JIT on the whole tape.
    pub fn whole(&self, points: &[[f32; 3]], runs: usize) -> f64 {
        let tape = self.function.grad_slice_tape(Default::default());
        let mut evaluate = JitFunction::new_grad_slice_eval();
        let mut out = vec![Grad::from(0.0); points.len()];
        let mut inputs = vec![Vec::new(); self.function.vars().len()];
        fastest(runs, || {
            for (chunk, out) in points.chunks(512).zip(out.chunks_mut(512)) {
                self.fill(&mut inputs, chunk);
                out.copy_from_slice(&evaluate.eval(&tape, &inputs).expect("all inputs are given")[0]);
            }
        })
    }

    /// Seconds for the same with a tape that is simplified and assembled for every leaf, that time included,
    /// the length of the leaves' tapes (a mean over points), and the largest difference from the whole tape.
    pub fn simplified(
        &self,
        points: &[[f32; 3]],
        root: &Region,
        descent: Descent,
        runs: usize,
    ) -> (f64, f64, f32) {
        let mut out = vec![Grad::from(0.0); points.len()];
        let mut length = 0.0;
        let mut run = Run::new(self, points, &mut out);
        let seconds = fastest(runs, || {
            run.length = 0;
            let tape = run.model.function.interval_tape(Default::default());
            match descent {
                Descent::Leaves => run.leaves(root, &tape),
                Descent::Tree => run.tree(root, &run.model.function.clone()),
            }
            length = run.length as f64 / points.len() as f64;
        });
        let whole = self.function.grad_slice_tape(Default::default());
        let mut evaluate = JitFunction::new_grad_slice_eval();
        let mut inputs = vec![Vec::new(); self.function.vars().len()];
        self.fill(&mut inputs, points);
        let expected = evaluate.eval(&whole, &inputs).expect("all inputs are given");
        let difference = out.iter().zip(&expected[0]).map(|(a, b)| (a.v - b.v).abs()).fold(0.0, f32::max);
        (seconds, length, difference)
    }

    fn fill(&self, inputs: &mut [Vec<Grad>], points: &[[f32; 3]]) {
        for a in 0..3 {
            if let Some(i) = self.axes[a] {
                let one = [0, 1, 2].map(|b| if a == b { 1.0 } else { 0.0 });
                inputs[i].clear();
                inputs[i].extend(points.iter().map(|p| Grad::new(p[a], one[0], one[1], one[2])));
            }
        }
    }
}

type IntervalTape = <<JitFunction as Function>::IntervalEval as TracingEvaluator>::Tape;

struct Run<'a> {
    model: &'a Model,
    points: &'a [[f32; 3]],
    out: &'a mut [Grad],
    length: usize,
    interval: <JitFunction as Function>::IntervalEval,
    gradient: <JitFunction as Function>::GradSliceEval,
    workspace: <JitFunction as Function>::Workspace,
    functions: Vec<<JitFunction as Function>::Storage>,
    tapes: Vec<<JitFunction as Function>::TapeStorage>,
    inputs: Vec<Vec<Grad>>,
}

impl<'a> Run<'a> {
    fn new(model: &'a Model, points: &'a [[f32; 3]], out: &'a mut [Grad]) -> Self {
        Self {
            model,
            points,
            out,
            length: 0,
            interval: JitFunction::new_interval_eval(),
            gradient: JitFunction::new_grad_slice_eval(),
            workspace: Default::default(),
            functions: Vec::new(),
            tapes: Vec::new(),
            inputs: vec![Vec::new(); model.function.vars().len()],
        }
    }

    /// The function simplified for the region's box; `None`: nothing can be dropped.
    fn simplify(
        &mut self,
        region: &Region,
        function: &JitFunction,
        tape: &IntervalTape,
    ) -> Option<JitFunction> {
        let mut inputs = vec![Interval::from(0.0); self.model.function.vars().len()];
        for a in 0..3 {
            if let Some(i) = self.model.axes[a] {
                inputs[i] = Interval::new(region.lo[a], region.hi[a]);
            }
        }
        let (_, trace) = self.interval.eval(tape, &inputs).expect("all inputs are given");
        let storage = self.functions.pop().unwrap_or_default();
        trace.map(|t| function.simplify(t, storage, &mut self.workspace).expect("its own trace"))
    }

    fn evaluate(&mut self, region: &Region, function: &JitFunction) {
        let tape = function.grad_slice_tape(self.tapes.pop().unwrap_or_default());
        self.length += function.size() * region.range.len();
        self.model.fill(&mut self.inputs, &self.points[region.range.clone()]);
        let out = self.gradient.eval(&tape, &self.inputs).expect("all inputs are given");
        self.out[region.range.clone()].copy_from_slice(&out[0]);
        self.tapes.extend(fidget::eval::Tape::recycle(tape));
    }

    fn leaves(&mut self, region: &Region, tape: &IntervalTape) {
        for child in &region.children {
            self.leaves(child, tape);
        }
        if region.children.is_empty() {
            let function = self.model.function.clone();
            let simple = self.simplify(region, &function, tape);
            self.evaluate(region, simple.as_ref().unwrap_or(&function));
            self.functions.extend(simple.and_then(Function::recycle));
        }
    }

    fn tree(&mut self, region: &Region, function: &JitFunction) {
        let tape = function.interval_tape(self.tapes.pop().unwrap_or_default());
        let simple = self.simplify(region, function, &tape);
        self.tapes.extend(fidget::eval::Tape::recycle(tape));
        let function = simple.as_ref().unwrap_or(function);
        if region.children.is_empty() {
            self.evaluate(region, function);
        }
        for child in &region.children {
            self.tree(child, function);
        }
        self.functions.extend(simple.and_then(Function::recycle));
    }
}

impl Region {
    /// An octree with at most `most` points a leaf; sorts the points so that every node's are contiguous.
    pub fn octree(points: &mut [[f32; 3]], most: usize) -> Self {
        Self::build(points, 0, most, 16)
    }

    /// Number of leaves.
    pub fn leaves(&self) -> usize {
        if self.children.is_empty() { 1 } else { self.children.iter().map(Self::leaves).sum() }
    }

    fn build(points: &mut [[f32; 3]], start: usize, most: usize, depth: usize) -> Self {
        let mut lo = [f32::INFINITY; 3];
        let mut hi = [f32::NEG_INFINITY; 3];
        for p in points.iter() {
            for a in 0..3 {
                lo[a] = lo[a].min(p[a]);
                hi[a] = hi[a].max(p[a]);
            }
        }
        let mut region = Self { lo, hi, range: start..start + points.len(), children: Vec::new() };
        if points.len() > most && depth > 0 {
            let middle = [0, 1, 2].map(|a| 0.5 * (lo[a] + hi[a]));
            let octant = |p: &[f32; 3]| (0..3).map(|a| usize::from(p[a] >= middle[a]) << a).sum::<usize>();
            points.sort_by_key(octant);
            let mut rest = points;
            let mut start = start;
            for o in 0..8 {
                let (child, others) = rest.split_at_mut(rest.partition_point(|p| octant(p) <= o));
                if !child.is_empty() {
                    region.children.push(Self::build(child, start, most, depth - 1));
                    start += child.len();
                }
                rest = others;
            }
        }
        region
    }
}

/// Operations of a `.vm` text, and how many of them are minima or maxima.
pub fn count(text: &str) -> (usize, usize) {
    let names = text.lines().filter(|l| !l.starts_with('#')).filter_map(|l| l.split_whitespace().nth(1));
    let operations = names.filter(|n| *n != "const" && !n.starts_with("var-"));
    let choices = operations.clone().filter(|n| *n == "min" || *n == "max").count();
    (operations.count(), choices)
}
