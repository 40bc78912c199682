//! Opaque leaves: the functions that people pass in. Each is called for all points at once, on the calling thread,
//! before the tapes that use its output run on the pool.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::differences::{self, OfParameters, STEP, beside, extent};
use super::evaluate::{Sweep, Target};
use super::{CHUNK, Field, Part};
use crate::kernel::{Batch, Want, run};
use crate::model::{Callback, Leaf, Payload};
use crate::tape::Tape;
use crate::{FieldError, Graph, MAX_AXES};

/// A leaf and how to compute the coordinates it is called at.
#[derive(Clone)]
pub(super) struct LeafStage {
    pub name: String,
    pub callback: Arc<dyn Callback>,
    inputs: Vec<Part>,
    /// The numbers of its own parameters.
    params: Range<usize>,
}

impl std::fmt::Debug for LeafStage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LeafStage({})", self.name)
    }
}

impl LeafStage {
    pub(super) fn new(graph: &Graph, leaf: &Leaf) -> Self {
        let inputs = leaf.inputs.iter().map(|&n| Part::new(Tape::new(graph, n))).collect();
        Self { name: leaf.name.clone(), callback: leaf.callback.clone(), inputs, params: leaf.params.clone() }
    }
}

/// What the leaves answered: (n, L) values, and their derivatives with respect to the field's coordinates
/// (n, L, d) and, where they are wanted, to its free parameters (n, L, m) or to time (n, L, 1): through where a leaf is
/// called, and through the leaf's own parameters.
#[derive(Default)]
pub(super) struct LeafOutputs {
    pub value: Vec<f64>,
    gradient: Vec<f64>,
    parameters: Vec<f64>,
    leaves: usize,
}

/// Which derivatives of the leaves are wanted.
#[derive(Clone, Copy)]
pub(super) enum Slopes<'a> {
    None,
    /// With respect to the coordinates.
    Points,
    /// And to `count` free parameters: the column of each parameter, or none.
    Parameters {
        columns: &'a [Option<usize>],
        count: usize,
    },
    /// And to time, where each parameter of the model has this rate.
    Rate(&'a [f64]),
}

impl Slopes<'_> {
    /// Numbers a point and leaf besides those for the coordinates.
    fn width(self) -> usize {
        match self {
            Slopes::None | Slopes::Points => 0,
            Slopes::Parameters { count, .. } => count,
            Slopes::Rate(_) => 1,
        }
    }
}

impl LeafOutputs {
    /// Adds (∂F/∂leaf)(∂leaf/∂x) to component `c` of the gradient.
    pub(super) fn chain(&self, adjoints: &[f64], gradient: &mut [f64], shape: (usize, usize, usize)) {
        self.add_products(adjoints, &self.gradient, gradient, shape);
    }

    /// Adds (∂F/∂leaf)(∂leaf/∂q) to component `c` of ∂F/∂q: (n, k, m), or of the rate: (n, k, 1).
    pub(super) fn chain_parameters(&self, adjoints: &[f64], q: &mut [f64], shape: (usize, usize, usize)) {
        self.add_products(adjoints, &self.parameters, q, shape);
    }

    fn add_products(
        &self,
        adjoints: &[f64],
        slopes: &[f64],
        to: &mut [f64],
        (k, c, d): (usize, usize, usize),
    ) {
        if self.leaves == 0 || d == 0 {
            return;
        }
        let points = adjoints.chunks_exact(self.leaves).zip(slopes.chunks_exact(self.leaves * d));
        for ((adjoint, slopes), g) in points.zip(to.chunks_exact_mut(k * d)) {
            for (w, slope) in adjoint.iter().zip(slopes.chunks_exact(d)) {
                for a in 0..d {
                    g[c * d + a] += w * slope[a];
                }
            }
        }
    }
}

/// Adds (n, width) from the gradients (n, 3) at a leaf's coordinates, given those coordinates' derivatives (empty where
/// all are 0), to leaf `l` of (n, L, width).
fn through_coordinates<'a>(
    gradient: &[[f64; 3]],
    jacobian: impl Iterator<Item = &'a Vec<f64>>,
    out: &mut [f64],
    (count, l, width): (usize, usize, usize),
) {
    for (i, column) in jacobian.enumerate().filter(|(_, c)| !c.is_empty()) {
        for (j, (g, slopes)) in gradient.iter().zip(column.chunks_exact(width)).enumerate() {
            let row = &mut out[(j * count + l) * width..][..width];
            row.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += g[i] * slope);
        }
    }
}

/// One of a leaf's coordinates at each point: its values (n), and as far as they are wanted its derivatives with
/// respect to the field's coordinates (n, d) and to parameters (n, width), or nothing where those are all 0.
struct Coordinate {
    value: Vec<f64>,
    slope: Vec<f64>,
    movement: Vec<f64>,
}

impl Coordinate {
    /// `before` are the leaves that this coordinate may depend on.
    fn new(part: &Part, params: &[f64], batch: &Batch, wanted: Slopes, before: &LeafOutputs) -> Self {
        let (n, d, leaves, width) = (batch.len(), batch.axes, batch.leaves, wanted.width());
        let uniforms = part.tape.uniforms.evaluate(params);
        let mut value = vec![0.0; n];
        if let Slopes::None = wanted {
            value.par_chunks_mut(CHUNK).enumerate().for_each(|(k, v)| {
                run(&part.value, &uniforms, batch.slice(k * CHUNK, v.len()), v, Want::Value);
            });
            return Self { value, slope: Vec::new(), movement: Vec::new() };
        }
        let (mut slope, mut adjoints) = (vec![0.0; n * d], vec![0.0; n * leaves]);
        let (rates, columns) = match wanted {
            Slopes::Rate(rates) => (Some(rates), None),
            Slopes::Parameters { columns, count } if count > 0 => (None, Some(columns)),
            _ => (None, None),
        };
        let sweep = Sweep::new(part, &uniforms, *batch, rates, columns);
        let follows = part.inputs.inputs.iter().any(|&k| k as usize >= MAX_AXES);
        let moves = width > 0 && (follows || !sweep.at_rest());
        let mut movement = vec![0.0; if moves { n * width } else { 0 }];
        let own = moves.then_some(&mut movement[..]);
        let (rate, q) = if rates.is_some() { (own, None) } else { (None, own) };
        sweep.run(Target { value: &mut value, gradient: &mut slope, rate, q }, &mut adjoints, width);
        before.chain(&adjoints, &mut slope, (1, 0, d));
        before.chain_parameters(&adjoints, &mut movement, (1, 0, width));
        Self { value, slope, movement }
    }
}

impl Field {
    /// Calls every leaf for all points: once, and where it does not know the derivatives that are wanted as often as
    /// differences need.
    pub(super) fn leaf_outputs(
        &self,
        points: &[f64],
        stride: usize,
        wanted: Slopes,
    ) -> Result<LeafOutputs, FieldError> {
        let (leaves, d) = (&self.compiled.leaves, self.axes());
        let (n, count, width) = (points.len() / stride, leaves.len(), wanted.width());
        let mut out = LeafOutputs { leaves: count, ..Default::default() };
        if count == 0 {
            return Ok(out);
        }
        let slopes = !matches!(wanted, Slopes::None);
        out.value = vec![0.0; n * count];
        out.gradient = vec![0.0; if slopes { n * count * d } else { 0 }];
        out.parameters = vec![0.0; n * count * width];
        let params: Vec<f64> = self.params.iter().map(|p| p.value).collect();
        for (l, leaf) in leaves.iter().enumerate() {
            let batch = Batch { points, stride, axes: d, outputs: &out.value, leaves: count };
            let inputs: Vec<Coordinate> =
                leaf.inputs.iter().map(|part| Coordinate::new(part, &params, &batch, wanted, &out)).collect();
            let at: Vec<[f64; 3]> = (0..n).map(|j| std::array::from_fn(|i| inputs[i].value[j])).collect();
            let q = &params[leaf.params.clone()];
            let mut value = vec![0.0; n];
            if slopes {
                let mut gradient = vec![[0.0; 3]; n];
                match leaf.callback.value_gradient(&at, q, &mut value, &mut gradient) {
                    Some(result) => result?,
                    None => differences::gradient(&*leaf.callback, &at, q, &mut value, &mut gradient)?,
                }
                let slope = inputs.iter().map(|c| &c.slope);
                through_coordinates(&gradient, slope, &mut out.gradient, (count, l, d));
                let movement = inputs.iter().map(|c| &c.movement);
                through_coordinates(&gradient, movement, &mut out.parameters, (count, l, width));
                self.own_slopes(leaf, &at, &value, wanted, |j, column, slope| {
                    out.parameters[(j * count + l) * width + column] += slope;
                })?;
            } else {
                leaf.callback.value(&at, q, &mut value)?;
            }
            for (j, v) in value.iter().enumerate() {
                out.value[j * count + l] = *v;
            }
        }
        Ok(out)
    }

    /// The derivatives of a leaf with respect to its own parameters, called `add(point, column, slope)`.
    fn own_slopes(
        &self,
        leaf: &LeafStage,
        points: &[[f64; 3]],
        value: &[f64],
        wanted: Slopes,
        mut add: impl FnMut(usize, usize, f64),
    ) -> Result<(), FieldError> {
        let own = leaf.params.clone();
        let function =
            OfParameters { callback: &*leaf.callback, points, params: &self.params[own.clone()], value };
        match wanted {
            Slopes::None | Slopes::Points => {}
            Slopes::Parameters { columns, .. } => {
                let columns = &columns[own];
                let free: Vec<bool> = columns.iter().map(Option::is_some).collect();
                for (slopes, column) in function.columns(&free)?.iter().zip(columns) {
                    if let (Some(slopes), Some(column)) = (slopes, *column) {
                        slopes.iter().enumerate().for_each(|(j, s)| add(j, column, *s));
                    }
                }
            }
            Slopes::Rate(rates) => {
                let rate = function.rate(&rates[own])?.unwrap_or_default();
                rate.iter().enumerate().for_each(|(j, s)| add(j, 0, *s));
            }
        }
        Ok(())
    }

    /// Second derivatives by central differences of the gradient, one-sided at the faces of the bounds where the field is a function alone;
    /// functions within operators are asked a little beyond theirs.
    pub(super) fn numerical_hessian(&self, points: &[f64], out: &mut [f64]) -> Result<(), FieldError> {
        let (d, k) = (self.axes(), self.components());
        let n = points.len() / d;
        let rows: Vec<[f64; 3]> =
            points.chunks_exact(d).map(|p| std::array::from_fn(|a| if a < d { p[a] } else { 0.0 })).collect();
        let declared = self.compiled.leaves.iter().find_map(|l| l.callback.bounds());
        let h = 20.0 * STEP * extent(&rows, declared);
        let bounds = declared.filter(|_| matches!(self.model.payload(), Payload::Callback(_)));
        let mut shifted = points.to_vec();
        let mut value = vec![0.0; n * k];
        let mut sides = [vec![0.0; n * k * d], vec![0.0; n * k * d]];
        let mut steps = vec![0.0; n];
        for b in 0..d {
            steps.fill(0.0);
            for (side, gradient) in [h, -h].into_iter().zip(&mut sides) {
                let places = shifted.chunks_exact_mut(d).zip(points.chunks_exact(d));
                for ((p, q), step) in places.zip(&mut steps) {
                    p.copy_from_slice(q);
                    p[b] = beside(q, b, side, bounds);
                    *step += side.signum() * p[b];
                }
                self.gradient(&shifted, &mut value, gradient)?;
            }
            for i in 0..n * k * d {
                out[i * d + b] = (sides[0][i] - sides[1][i]) / steps[i / (k * d)];
            }
        }
        // Differences of a gradient are not quite symmetric.
        for m in out.chunks_exact_mut(d * d) {
            for i in 0..d {
                for j in 0..i {
                    let mean = 0.5 * (m[i * d + j] + m[j * d + i]);
                    (m[i * d + j], m[j * d + i]) = (mean, mean);
                }
            }
        }
        Ok(())
    }
}
