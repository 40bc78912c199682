//! Opaque leaves: the functions that people pass in. Each is called once for all points, on the calling thread,
//! before the tapes that use its output run on the pool.

use std::sync::Arc;

use rayon::prelude::*;

use super::{CHUNK, Field, Part};
use crate::kernel::{Batch, Columns, Rows, Want, run};
use crate::model::{Callback, Leaf};
use crate::program::{Program, Purpose};
use crate::tape::Tape;
use crate::{Aabb, FieldError, Graph};

/// A leaf and how to compute the coordinates it is called at.
#[derive(Clone)]
pub(super) struct LeafStage {
    pub name: String,
    pub callback: Arc<dyn Callback>,
    inputs: Vec<Part>,
}

impl std::fmt::Debug for LeafStage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LeafStage({})", self.name)
    }
}

impl LeafStage {
    pub(super) fn new(graph: &Graph, leaf: &Leaf) -> Self {
        let inputs = leaf.inputs.iter().map(|&n| Part::new(Tape::new(graph, n))).collect();
        Self { name: leaf.name.clone(), callback: leaf.callback.clone(), inputs }
    }
}

/// What the leaves answered: (n, L) values, and their derivatives with respect to the field's coordinates
/// (n, L, d) and, where they are wanted, to its free parameters (n, L, m): those that move where a leaf is called.
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
}

impl LeafOutputs {
    /// Adds (∂F/∂leaf)(∂leaf/∂x) to component `c` of the gradient.
    pub(super) fn chain(&self, adjoints: &[f64], gradient: &mut [f64], shape: (usize, usize, usize)) {
        self.add_products(adjoints, &self.gradient, gradient, shape);
    }

    /// Adds (∂F/∂leaf)(∂leaf/∂q) to component `c` of ∂F/∂q: (n, k, m).
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

/// (n, width) from the gradients (n, 3) at a leaf's coordinates, given those coordinates' derivatives: into leaf `l`
/// of (n, L, width).
fn through_coordinates(
    gradient: &[[f64; 3]],
    jacobian: &[Vec<f64>],
    out: &mut [f64],
    (count, l, width): (usize, usize, usize),
) {
    for (j, g) in gradient.iter().enumerate() {
        for a in 0..width {
            out[(j * count + l) * width + a] =
                jacobian.iter().zip(g).map(|(column, g)| g * column[j * width + a]).sum();
        }
    }
}

/// Step of a central difference, relative to the extent of the points: the cube root of the rounding error.
const STEP: f64 = 6e-6;

/// The length that differences are relative to.
fn extent(points: &[[f64; 3]], bounds: Option<Aabb>) -> f64 {
    let diagonal = bounds.or_else(|| Aabb::around(points)).map_or(0.0, |b| b.diagonal());
    let size = points.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let length = if diagonal > 0.0 { diagonal } else { size };
    if length > 0.0 && length.is_finite() { length } else { 1.0 }
}

/// F and its gradient by central differences, in one call of the function.
fn differences(
    leaf: &LeafStage,
    points: &[[f64; 3]],
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) -> Result<(), FieldError> {
    let n = points.len();
    let h = STEP * extent(points, leaf.callback.bounds());
    let mut all = Vec::with_capacity(7 * n);
    all.extend_from_slice(points);
    for axis in 0..3 {
        for side in [h, -h] {
            all.extend(points.iter().map(|p| {
                let mut p = *p;
                p[axis] += side;
                p
            }));
        }
    }
    let mut values = vec![0.0; 7 * n];
    leaf.callback.value(&all, &mut values)?;
    value.copy_from_slice(&values[..n]);
    for axis in 0..3 {
        let (ahead, behind) = ((1 + 2 * axis) * n, (2 + 2 * axis) * n);
        for i in 0..n {
            // The step that was really taken, after rounding.
            let step = all[ahead + i][axis] - all[behind + i][axis];
            gradient[i][axis] = (values[ahead + i] - values[behind + i]) / step;
        }
    }
    Ok(())
}

/// The derivatives of one of a leaf's coordinates with respect to the free parameters: (n, m).
fn coordinate_parameters(
    part: &Part,
    uniforms: &[f64],
    batch: &Batch,
    columns: &[Option<usize>],
    m: usize,
) -> Vec<f64> {
    let (n, d, leaves) = (batch.len(), batch.axes, batch.leaves);
    let mut q = vec![0.0; n * m];
    let rows = Rows::new(&part.tape.uniforms, columns);
    if rows.columns.is_empty() {
        return q;
    }
    let program = Program::new(&part.tape, Purpose::Everything);
    q.par_chunks_mut(CHUNK * m).enumerate().for_each(|(k, data)| {
        let points = batch.slice(k * CHUNK, data.len() / m);
        let n = points.len();
        let (mut value, mut x, mut adjoints) = (vec![0.0; n], vec![0.0; n * d], vec![0.0; n * leaves]);
        let x = Columns { data: &mut x, stride: d };
        let leaves = Columns { data: &mut adjoints, stride: leaves };
        let q = Columns { data, stride: m };
        run(&program, uniforms, points, &mut value, Want::Parameters { x, leaves, rows: &rows, q });
    });
    q
}

impl Field {
    /// Calls every leaf once for all points.
    pub(super) fn leaf_outputs(
        &self,
        points: &[f64],
        stride: usize,
        wanted: Slopes,
    ) -> Result<LeafOutputs, FieldError> {
        let (leaves, d) = (&self.compiled.leaves, self.axes());
        let n = points.len() / stride;
        let count = leaves.len();
        let mut out = LeafOutputs { leaves: count, ..Default::default() };
        if count == 0 {
            return Ok(out);
        }
        let slopes = !matches!(wanted, Slopes::None);
        let (columns, m) = match wanted {
            Slopes::Parameters { columns, count } => (Some(columns), count),
            _ => (None, 0),
        };
        out.parameters = vec![0.0; n * count * m];
        out.value = vec![0.0; n * count];
        out.gradient = vec![0.0; if slopes { n * count * d } else { 0 }];
        for (l, leaf) in leaves.iter().enumerate() {
            let mut at = vec![[0.0; 3]; n];
            // ∂(coordinate i)/∂x, (n, d) for each i.
            let mut jacobian: Vec<Vec<f64>> = Vec::new();
            // ∂(coordinate i)/∂q, (n, m) for each i.
            let mut movement: Vec<Vec<f64>> = Vec::new();
            for (i, part) in leaf.inputs.iter().enumerate() {
                let uniforms =
                    part.tape.uniforms.evaluate(&self.params.iter().map(|p| p.value).collect::<Vec<_>>());
                let batch = Batch { points, stride, axes: d, outputs: &out.value, leaves: count };
                let mut column = vec![0.0; n];
                let mut slope = vec![0.0; if slopes { n * d } else { 0 }];
                let mut adjoints = vec![0.0; if slopes { n * count } else { 0 }];
                if slopes {
                    let parts = column.par_chunks_mut(CHUNK).zip(slope.par_chunks_mut(CHUNK * d));
                    parts.zip(adjoints.par_chunks_mut(CHUNK * count)).enumerate().for_each(
                        |(k, ((v, x), a))| {
                            let x = Columns { data: x, stride: d };
                            let leaves = Columns { data: a, stride: count };
                            let points = batch.slice(k * CHUNK, v.len());
                            run(&part.inputs, &uniforms, points, v, Want::Gradient { x, leaves });
                        },
                    );
                    out.chain(&adjoints, &mut slope, (1, 0, d));
                    jacobian.push(slope);
                    if let (Some(columns), true) = (columns, m > 0) {
                        let mut q = coordinate_parameters(part, &uniforms, &batch, columns, m);
                        out.chain_parameters(&adjoints, &mut q, (1, 0, m));
                        movement.push(q);
                    }
                } else {
                    column.par_chunks_mut(CHUNK).enumerate().for_each(|(k, v)| {
                        run(&part.value, &uniforms, batch.slice(k * CHUNK, v.len()), v, Want::Value);
                    });
                }
                for (p, v) in at.iter_mut().zip(&column) {
                    p[i] = *v;
                }
            }
            let mut value = vec![0.0; n];
            if slopes {
                let mut gradient = vec![[0.0; 3]; n];
                match leaf.callback.value_gradient(&at, &mut value, &mut gradient) {
                    Some(result) => result?,
                    None => differences(leaf, &at, &mut value, &mut gradient)?,
                }
                through_coordinates(&gradient, &jacobian, &mut out.gradient, (count, l, d));
                if m > 0 {
                    through_coordinates(&gradient, &movement, &mut out.parameters, (count, l, m));
                }
            } else {
                leaf.callback.value(&at, &mut value)?;
            }
            for (j, v) in value.iter().enumerate() {
                out.value[j * count + l] = *v;
            }
        }
        Ok(out)
    }

    /// Second derivatives by central differences of the gradient.
    pub(super) fn numerical_hessian(&self, points: &[f64], out: &mut [f64]) -> Result<(), FieldError> {
        let (d, k) = (self.axes(), self.components());
        let n = points.len() / d;
        let rows: Vec<[f64; 3]> =
            points.chunks_exact(d).map(|p| std::array::from_fn(|a| if a < d { p[a] } else { 0.0 })).collect();
        let declared = self.compiled.leaves.iter().find_map(|l| l.callback.bounds());
        let h = 20.0 * STEP * extent(&rows, declared);
        let mut shifted = points.to_vec();
        let mut value = vec![0.0; n * k];
        let mut sides = [vec![0.0; n * k * d], vec![0.0; n * k * d]];
        for b in 0..d {
            for (side, gradient) in [h, -h].into_iter().zip(&mut sides) {
                for (p, q) in shifted.chunks_exact_mut(d).zip(points.chunks_exact(d)) {
                    p.copy_from_slice(q);
                    p[b] += side;
                }
                self.gradient(&shifted, &mut value, gradient)?;
            }
            for i in 0..n * k * d {
                out[i * d + b] = (sides[0][i] - sides[1][i]) / (2.0 * h);
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
