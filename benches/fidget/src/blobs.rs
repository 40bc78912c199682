//! F = -log(sum over blobs of exp(-k (|x - c| - r))) / k: every parameter matters at every point.

use crate::timing::{Uniform, fastest};
use fidget::context::{Context, Node};
use fidget::eval::{BulkEvaluator, Function, MathFunction};
use fidget::jit::JitFunction;
use fidget::types::Grad;
use fidget::var::Var;

/// Sharpness of the smooth minimum, in 1/length.
pub const K: f64 = 8.0;

/// Centre and radius of a blob.
pub type Blob = [f64; 4];

/// `count` blobs in the cube of side two around the origin.
pub fn blobs(count: usize) -> Vec<Blob> {
    let mut u = Uniform(1);
    (0..count)
        .map(|_| {
            let c = [(); 3].map(|()| u.between(-1.0, 1.0));
            [c[0], c[1], c[2], u.between(0.1, 0.3)]
        })
        .collect()
}

/// `count` points in the same cube.
pub fn points(count: usize) -> Vec<[f64; 3]> {
    let mut u = Uniform(2);
    (0..count).map(|_| [(); 3].map(|()| u.between(-1.2, 1.2))).collect()
}

/// F and its derivatives by x and q, in f64 and written out by hand: what both evaluators have to agree with.
pub fn reference(blobs: &[Blob], p: [f64; 3]) -> (f64, [f64; 3], Vec<f64>) {
    let distance = |b: &Blob| (0..3).map(|a| (p[a] - b[a]).powi(2)).sum::<f64>().sqrt();
    let weight: Vec<f64> = blobs.iter().map(|b| (-K * (distance(b) - b[3])).exp()).collect();
    let sum: f64 = weight.iter().sum();
    let mut fx = [0.0; 3];
    let mut fq = Vec::with_capacity(4 * blobs.len());
    for (b, w) in blobs.iter().zip(&weight) {
        let (w, d) = (w / sum, distance(b));
        for a in 0..3 {
            fx[a] += w * (p[a] - b[a]) / d;
            fq.push(-w * (p[a] - b[a]) / d);
        }
        fq.push(-w);
    }
    (-sum.ln() / K, fx, fq)
}

/// Seconds a point that fidget's JIT needs for F, ∂F/∂x and all of ∂F/∂q, three derivatives a pass, and the
/// largest relative error of its ∂F/∂q.
pub fn fidget(blobs: &[Blob], points: &[[f64; 3]], batch: usize, runs: usize) -> (f64, f64) {
    let mut context = Context::new();
    let variables: Vec<Var> = (0..4 * blobs.len()).map(|_| Var::new()).collect();
    let root = graph(&mut context, &variables);
    let function = JitFunction::new(&context, &[root]).expect("the node is in the context");
    let tape = function.grad_slice_tape(Default::default());
    let mut evaluate = JitFunction::new_grad_slice_eval();
    let index = |v: &Var| function.vars().get(v).expect("every variable is used");
    let axes = [Var::X, Var::Y, Var::Z].map(|v| index(&v));
    let q: Vec<usize> = variables.iter().map(index).collect();

    let mut inputs = vec![vec![Grad::from(0.0); batch]; function.vars().len()];
    for (i, b) in blobs.iter().enumerate() {
        for a in 0..4 {
            inputs[q[4 * i + a]].fill(Grad::from(b[a] as f32));
        }
    }
    let mut error = 0f64;
    let mut fq = vec![0f32; batch * q.len()];
    let seconds = fastest(runs, || {
        for chunk in points.chunks_exact(batch) {
            for (a, &axis) in axes.iter().enumerate() {
                for (slot, p) in inputs[axis].iter_mut().zip(chunk) {
                    *slot = Grad::from(p[a] as f32);
                    seed(slot, a, 1.0);
                }
            }
            std::hint::black_box(evaluate.eval(&tape, &inputs).expect("all inputs are given"));
            for (a, &axis) in axes.iter().enumerate() {
                inputs[axis].iter_mut().for_each(|slot| seed(slot, a, 0.0));
            }
            for (pass, three) in q.chunks(3).enumerate() {
                for (a, &v) in three.iter().enumerate() {
                    inputs[v].iter_mut().for_each(|slot| seed(slot, a, 1.0));
                }
                let out = evaluate.eval(&tape, &inputs).expect("all inputs are given");
                for (row, g) in fq.chunks_exact_mut(q.len()).zip(&out[0]) {
                    for a in 0..three.len() {
                        row[3 * pass + a] = g.d(a);
                    }
                }
                for (a, &v) in three.iter().enumerate() {
                    inputs[v].iter_mut().for_each(|slot| seed(slot, a, 0.0));
                }
            }
        }
    });
    let last = points.chunks_exact(batch).next_back().expect("at least one batch of points");
    for (row, p) in fq.chunks_exact(q.len()).zip(last) {
        for (given, expected) in row.iter().zip(reference(blobs, *p).2) {
            error = error.max((f64::from(*given) - expected).abs());
        }
    }
    (seconds / (points.len() / batch * batch) as f64, error)
}

fn seed(slot: &mut Grad, a: usize, value: f32) {
    match a {
        0 => slot.dx = value,
        1 => slot.dy = value,
        _ => slot.dz = value,
    }
}

fn graph(c: &mut Context, variables: &[Var]) -> Node {
    let axes = c.axes();
    graph_at(c, axes, variables)
}

/// F at any point.
pub fn graph_at(c: &mut Context, axes: [Node; 3], variables: &[Var]) -> Node {
    let mut sum = c.constant(0.0);
    for blob in variables.chunks_exact(4) {
        let mut squares = c.constant(0.0);
        for a in 0..3 {
            let d = c.sub(axes[a], blob[a]).expect("nodes of this context");
            let d = c.square(d).expect("nodes of this context");
            squares = c.add(squares, d).expect("nodes of this context");
        }
        let distance = c.sqrt(squares).expect("nodes of this context");
        let depth = c.sub(distance, blob[3]).expect("nodes of this context");
        let power = c.mul(depth, -K as f32).expect("nodes of this context");
        let weight = c.exp(power).expect("nodes of this context");
        sum = c.add(sum, weight).expect("nodes of this context");
    }
    let log = c.ln(sum).expect("nodes of this context");
    c.mul(log, (-1.0 / K) as f32).expect("nodes of this context")
}
