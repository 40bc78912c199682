//! A slow evaluator to compare with: node by node over the graph, without folding, registers or blocks.

use crate::graph::Expr;
use crate::op::{Op, apply, is_flat, pull};
use crate::scalar::Scalar;
use crate::{Field, FieldError, Lowered, MAX_AXES, Node};

/// F and its derivatives at a point, with what is needed to judge other evaluators there.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// F.
    pub value: f64,
    /// ∂F/∂x, ∂F/∂y, ∂F/∂z.
    pub gradient: [f64; 3],
    /// ∂F/∂(parameter), for all parameters of the model.
    pub parameters: Vec<f64>,
    /// The sums of the absolute values of all terms of the gradient: what its rounding errors are relative to.
    pub gradient_size: [f64; 3],
    /// The same for the parameters.
    pub parameter_sizes: Vec<f64>,
    /// Number of operations.
    pub operations: usize,
    /// About how wrong F may be by rounding.
    pub noise: f64,
    /// Whether all values on the way to F and to the gradient are finite: only then do intervals say anything.
    pub regular: bool,
    /// Whether no kink, step or pole is within about a thousandth.
    pub smooth: bool,
    /// The largest absolute value or derivative on the way.
    pub largest: f64,
}

/// A lowered model, evaluated node by node.
pub struct Reference {
    lowered: Lowered,
    /// For each component, the nodes that it needs, in order.
    needed: Vec<Vec<usize>>,
}

impl Reference {
    /// Lowers the field's model. `None` where it has opaque leaves.
    pub fn new(field: &Field) -> Result<Option<Reference>, FieldError> {
        let lowered = field.model().lower()?;
        if !lowered.leaves.is_empty() {
            return Ok(None);
        }
        let needed = lowered.roots.iter().map(|&r| reached(&lowered, r)).collect();
        Ok(Some(Reference { lowered, needed }))
    }

    /// Component `component` at a point, with the parameters' values `q` (all of them).
    pub fn at(&self, component: usize, p: [f64; 3], q: &[f64]) -> Sample {
        let (nodes, root) = (&self.needed[component], self.lowered.roots[component].0 as usize);
        let exprs = &self.lowered.graph.exprs;
        let mut v = vec![0.0; exprs.len()];
        let mut s = Sample { regular: true, smooth: true, operations: nodes.len(), ..Default::default() };
        for &i in nodes {
            v[i] = match exprs[i] {
                Expr::Const(bits) => f64::from_bits(bits),
                Expr::Param(k) => q[k as usize],
                Expr::Input(k) => p[k as usize],
                Expr::Op(op, operands) => {
                    let [a, b, c] = operands.map(|n: Node| v[n.0 as usize]);
                    s.smooth &= is_smooth(op, a, b);
                    apply(op, a, b, c)
                }
            };
            s.regular &= v[i].is_finite();
            s.largest = s.largest.max(v[i].abs());
        }
        let (mut adjoint, mut size) = (vec![0.0; exprs.len()], vec![0.0; exprs.len()]);
        (adjoint[root], size[root]) = (1.0, 1.0);
        s.parameters = vec![0.0; q.len()];
        s.parameter_sizes = vec![0.0; q.len()];
        for &i in nodes.iter().rev() {
            s.regular &= f64::is_finite(adjoint[i]);
            s.noise += size[i] * v[i].abs() * f64::EPSILON * 4.0;
            s.largest = s.largest.max(size[i]);
            match exprs[i] {
                Expr::Const(_) => {}
                Expr::Param(k) => {
                    (s.parameters[k as usize], s.parameter_sizes[k as usize]) = (adjoint[i], size[i])
                }
                Expr::Input(k) if (k as usize) < MAX_AXES.min(3) => {
                    (s.gradient[k as usize], s.gradient_size[k as usize]) = (adjoint[i], size[i]);
                }
                Expr::Input(_) => {}
                Expr::Op(op, operands) => {
                    let [a, b, _] = operands.map(|n: Node| v[n.0 as usize]);
                    for k in (0..op.arity()).filter(|&k| !is_flat(op, k)) {
                        let to = operands[k].0 as usize;
                        adjoint[to] += pull(op, k, adjoint[i], a, b, v[i]);
                        size[to] += pull(op, k, size[i], a, b, v[i]).abs();
                    }
                }
            }
        }
        s.value = v[root];
        s
    }
}

/// The nodes that a root depends on, operands first.
pub(super) fn reached(lowered: &Lowered, root: Node) -> Vec<usize> {
    let mut seen = vec![false; lowered.graph.len()];
    seen[root.0 as usize] = true;
    for i in (0..seen.len()).rev() {
        if let (true, Expr::Op(op, operands)) = (seen[i], lowered.graph.exprs[i]) {
            operands[..op.arity()].iter().for_each(|o| seen[o.0 as usize] = true);
        }
    }
    (0..seen.len()).filter(|&i| seen[i]).collect()
}

/// Whether the operation has all derivatives around its operands.
fn is_smooth(op: Op, a: f64, b: f64) -> bool {
    const MARGIN: f64 = 1e-3;
    let far = |d: f64, size: f64| d.abs() > MARGIN * (1.0 + size.abs());
    let off_integer = |v: f64| (v - Scalar::round(v)).abs() > MARGIN;
    match op {
        Op::Abs | Op::Sqrt | Op::Ln => far(a, 0.0),
        Op::Asin | Op::Acos => far(1.0 - a * a, 0.0),
        Op::Floor | Op::Ceil => off_integer(a),
        Op::Round => off_integer(a + 0.5),
        Op::Min | Op::Max | Op::Less => far(a - b, a),
        Op::Div => far(b, 0.0),
        Op::Tan => far(a.cos(), 0.0),
        Op::Pow => far(a, 0.0) && b.abs() < 100.0,
        Op::Atan2 => far(a, 0.0) || b > MARGIN,
        Op::Mod => far(b, 0.0) && off_integer(a / b),
        _ => true,
    }
}

impl Reference {
    /// Number of exponentials that the first component takes.
    pub fn exponentials(&self) -> usize {
        let is_exp = |&&i: &&usize| matches!(self.lowered.graph.exprs[i], Expr::Op(Op::Exp, _));
        self.needed[0].iter().filter(is_exp).count()
    }
}
