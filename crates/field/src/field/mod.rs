//! A model ready for evaluation: compiled, with its parameters' present values.

mod bounds;
mod cells;
mod leaves;
mod surface;

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use crate::interval::Interval;
use crate::kernel::{Batch, Columns, Rows, Want, hessian, run};
use crate::model::{Lowered, Model, ParamInfo};
use crate::program::{Program, Purpose};
use crate::scalar::Scalar;
use crate::tape::Tape;
use crate::{Aabb, Dual, FieldError, MAX_AXES};
use leaves::{LeafOutputs, LeafStage, Slopes};

/// Points that one task evaluates.
const CHUNK: usize = 1024;

/// What does not change with the parameters' values.
#[derive(Debug)]
struct Compiled {
    parts: Vec<Part>,
    leaves: Vec<LeafStage>,
    axes: usize,
}

/// One function, compiled for each purpose.
#[derive(Clone, Debug)]
struct Part {
    tape: Tape,
    value: Program,
    inputs: Program,
    /// Made when a derivative with respect to parameters is first asked for.
    everything: OnceLock<Program>,
}

impl Part {
    fn new(tape: Tape) -> Part {
        let program = |purpose| Program::new(&tape, purpose);
        let (value, inputs) = (program(Purpose::Value), program(Purpose::Inputs));
        Part { value, inputs, tape, everything: OnceLock::new() }
    }
}

/// F(x, q) with its present parameters: values, derivatives and intervals at points. F < 0 inside.
///
/// Points are flat row-major slices of `axes()` numbers a point. Results for several components come component
/// by component within a point: a gradient of a field with k components and d axes is (n, k, d).
///
/// ```
/// use isoswarm_field::{Field, text};
/// let field = Field::new(&text::parse("x^2 + y^2 + z^2 - r^2", &[("r", 2.0)])?)?;
/// let mut value = [0.0];
/// field.value(&[0.0, 0.0, 3.0], &mut value)?;
/// assert_eq!(value, [5.0]);
/// # Ok::<(), isoswarm_field::FieldError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Field {
    model: Model,
    compiled: Arc<Compiled>,
    params: Vec<ParamInfo>,
    /// The uniforms of each component's tape at the present values.
    uniforms: Vec<Vec<f64>>,
}

impl Field {
    /// Compiles a model.
    pub fn new(model: &Model) -> Result<Field, FieldError> {
        let Lowered { graph, roots, axes, params, leaves } = model.lower()?;
        let parts = roots.iter().map(|&r| Part::new(Tape::new(&graph, r))).collect();
        let leaves = leaves.iter().map(|l| LeafStage::new(&graph, l)).collect();
        let mut field = Field {
            model: model.clone(),
            compiled: Arc::new(Compiled { parts, leaves, axes }),
            params,
            uniforms: Vec::new(),
        };
        field.refresh();
        Ok(field)
    }

    fn refresh(&mut self) {
        let values: Vec<f64> = self.params.iter().map(|p| p.value).collect();
        self.uniforms = self.compiled.parts.iter().map(|p| p.tape.uniforms.evaluate(&values)).collect();
    }

    /// The tree that the field was compiled from, with the values it had then.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of coordinates: 3, or 2 for curves in the plane.
    pub fn axes(&self) -> usize {
        self.compiled.axes
    }

    /// Number of equations F = 0: 1 for a surface.
    pub fn components(&self) -> usize {
        self.compiled.parts.len()
    }

    /// Whether any part is an opaque function; then there are no intervals.
    pub fn is_opaque(&self) -> bool {
        !self.compiled.leaves.is_empty()
    }

    /// Operations carried out for a point, over all components.
    pub fn operations(&self) -> usize {
        self.compiled.parts.iter().map(|p| p.tape.len()).sum()
    }

    /// The compiled function of one component.
    pub fn tape(&self, component: usize) -> &Tape {
        &self.compiled.parts[component].tape
    }

    /// All parameters, in the order of HBJF02 section 3.
    pub fn parameters(&self) -> &[ParamInfo] {
        &self.params
    }

    /// The number of the parameter with this path.
    pub fn parameter(&self, path: &str) -> Result<usize, FieldError> {
        self.params.iter().position(|p| p.path == path).ok_or_else(|| {
            let mut known: Vec<&str> = self.params.iter().take(20).map(|p| p.path.as_str()).collect();
            if self.params.len() > known.len() {
                known.push("…");
            }
            FieldError::UnknownParameter { path: path.into(), known: known.join(", ") }
        })
    }

    /// Sets one value. It must be finite and inside the parameter's bounds; a discrete parameter, being part of
    /// the model's structure, is changed on the model.
    pub fn set_value(&mut self, index: usize, value: f64) -> Result<(), FieldError> {
        let p = &mut self.params[index];
        let (lo, hi) = p.bounds;
        if p.discrete {
            return Err(FieldError::Invalid(format!(
                "`{}` is discrete, a part of the model's structure: make the model anew with another value",
                p.path
            )));
        }
        if !(value.is_finite() && lo <= value && value <= hi) {
            return Err(FieldError::Invalid(format!("`{}` must lie in [{lo}, {hi}], given {value}", p.path)));
        }
        p.value = value;
        self.refresh();
        Ok(())
    }

    /// Takes a parameter out of q, or puts it back.
    pub fn set_frozen(&mut self, index: usize, frozen: bool) {
        self.params[index].frozen = frozen;
    }

    /// The numbers of the parameters that form q: neither frozen nor discrete.
    pub fn free(&self) -> Vec<usize> {
        (0..self.params.len()).filter(|&i| !self.params[i].frozen && !self.params[i].discrete).collect()
    }

    /// The vector q.
    pub fn q(&self) -> Vec<f64> {
        self.free().iter().map(|&i| self.params[i].value).collect()
    }

    /// Sets the vector q; see [`Field::set_value`].
    pub fn set_q(&mut self, q: &[f64]) -> Result<(), FieldError> {
        let free = self.free();
        if q.len() != free.len() {
            let (expected, given) = (format!("{} numbers", free.len()), q.len().to_string());
            return Err(FieldError::Shape { what: "q", expected, given });
        }
        let mut next = self.clone();
        for (&i, &v) in free.iter().zip(q) {
            let p = &mut next.params[i];
            if !(v.is_finite() && p.bounds.0 <= v && v <= p.bounds.1) {
                let (lo, hi) = p.bounds;
                return Err(FieldError::Invalid(format!("`{}` must lie in [{lo}, {hi}], given {v}", p.path)));
            }
            p.value = v;
        }
        next.refresh();
        *self = next;
        Ok(())
    }

    fn count(&self, points: &[f64]) -> Result<usize, FieldError> {
        if points.len().is_multiple_of(self.axes()) {
            return Ok(points.len() / self.axes());
        }
        Err(FieldError::Shape {
            what: "points",
            expected: format!("{} numbers a point", self.axes()),
            given: format!("{} numbers", points.len()),
        })
    }

    fn expect(what: &'static str, slice: &[f64], expected: usize) -> Result<(), FieldError> {
        if slice.len() == expected {
            return Ok(());
        }
        Err(FieldError::Shape {
            what,
            expected: format!("{expected} numbers"),
            given: slice.len().to_string(),
        })
    }

    fn batch<'a>(&self, points: &'a [f64], outputs: &'a LeafOutputs) -> Batch<'a> {
        let leaves = self.compiled.leaves.len();
        Batch { points, stride: self.axes(), axes: self.axes(), outputs: &outputs.value, leaves }
    }

    /// F: (n, k).
    pub fn value(&self, points: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        let (n, k) = (self.count(points)?, self.components());
        Self::expect("value", value, n * k)?;
        let outputs = self.leaf_outputs(points, self.axes(), Slopes::None)?;
        let batch = self.batch(points, &outputs);
        for c in 0..k {
            let (program, uniforms) = (&self.compiled.parts[c].value, &self.uniforms[c]);
            value.par_chunks_mut(CHUNK * k).enumerate().for_each(|(i, out)| {
                let part = batch.slice(i * CHUNK, out.len() / k);
                if k == 1 {
                    run(program, uniforms, part, out, Want::Value);
                } else {
                    let mut one = vec![0.0; out.len() / k];
                    run(program, uniforms, part, &mut one, Want::Value);
                    spread(&one, out, k, c);
                }
            });
        }
        Ok(())
    }

    /// F (n, k) and ∂F/∂x (n, k, d).
    pub fn gradient(
        &self,
        points: &[f64],
        value: &mut [f64],
        gradient: &mut [f64],
    ) -> Result<(), FieldError> {
        self.differentiate(points, value, gradient, None, None)
    }

    /// F, ∂F/∂x, and (∂F/∂q)·q̇ (n, k) for the rates `q_dot` of the free parameters: all that a floater needs
    /// to follow a moving surface (WH94 eq. 5).
    pub fn gradient_and_rate(
        &self,
        points: &[f64],
        q_dot: &[f64],
        value: &mut [f64],
        gradient: &mut [f64],
        rate: &mut [f64],
    ) -> Result<(), FieldError> {
        let free = self.free();
        Self::expect("q_dot", q_dot, free.len())?;
        Self::expect("rate", rate, value.len())?;
        let mut rates = vec![0.0; self.params.len()];
        for (&i, &r) in free.iter().zip(q_dot) {
            rates[i] = r;
        }
        self.differentiate(points, value, gradient, Some((&rates, rate)), None)
    }

    /// F, ∂F/∂x and all of ∂F/∂q (n, k, m) for the m free parameters, in one reverse sweep.
    pub fn parameter_gradient(
        &self,
        points: &[f64],
        value: &mut [f64],
        gradient: &mut [f64],
        q_gradient: &mut [f64],
    ) -> Result<(), FieldError> {
        let m = self.free().len();
        Self::expect("q_gradient", q_gradient, value.len() * m)?;
        self.differentiate(points, value, gradient, None, (m > 0).then_some(q_gradient))
    }

    /// The common part: component by component, chunk by chunk, then the chain rule through opaque leaves.
    fn differentiate(
        &self,
        points: &[f64],
        value: &mut [f64],
        gradient: &mut [f64],
        mut rate: Option<(&[f64], &mut [f64])>,
        mut q: Option<&mut [f64]>,
    ) -> Result<(), FieldError> {
        let (n, k, d) = (self.count(points)?, self.components(), self.axes());
        Self::expect("value", value, n * k)?;
        Self::expect("gradient", gradient, n * k * d)?;
        if n == 0 {
            return Ok(());
        }
        let m = q.as_ref().map_or(0, |q| q.len() / (n * k));
        let columns = self.columns();
        let free = self.free();
        let slopes = match (&rate, &q) {
            (None, None) => Slopes::Points,
            _ => Slopes::Parameters { columns: &columns, count: free.len() },
        };
        let outputs = self.leaf_outputs(points, d, slopes)?;
        let batch = self.batch(points, &outputs);
        let leaves = self.compiled.leaves.len();
        let mut adjoints = vec![0.0; n * leaves];
        for c in 0..k {
            let (part, uniforms) = (&self.compiled.parts[c], &self.uniforms[c]);
            let rates = rate.as_ref().map(|(r, _)| part.tape.uniforms.rates(uniforms, r));
            let rows = q.is_some().then(|| Rows::new(&part.tape.uniforms, &columns));
            let program = if rates.is_some() || rows.is_some() {
                part.everything.get_or_init(|| Program::new(&part.tape, Purpose::Everything))
            } else {
                &part.inputs
            };
            // One component writes straight into the results; several go through columns of their own.
            let mut own = (k > 1).then(|| Own::new(n, d, m, rate.is_some()));
            let target = match &mut own {
                None => Target {
                    value: &mut *value,
                    gradient: &mut *gradient,
                    rate: rate.as_mut().map(|r| &mut *r.1),
                    q: q.as_deref_mut(),
                },
                Some(own) => own.target(),
            };
            chunks(target, &mut adjoints, (d, leaves, m)).into_par_iter().for_each(|chunk| {
                let Chunk { start, value, gradient, rate, q, adjoints } = chunk;
                let part = batch.slice(start, value.len());
                let x = Columns { data: gradient, stride: d };
                let leaves = Columns { data: adjoints, stride: leaves };
                let want = match (rate, q, &rates, &rows) {
                    (Some(rate), _, Some(rates), _) => Want::Rate { x, leaves, rates, rate },
                    (_, Some(data), _, Some(rows)) => {
                        // Parameters that F does not depend on have no row to write.
                        if rows.columns.len() < m {
                            data.fill(0.0);
                        }
                        Want::Parameters { x, leaves, rows, q: Columns { data, stride: m } }
                    }
                    _ => Want::Gradient { x, leaves },
                };
                run(program, uniforms, part, value, want);
            });
            if let Some(own) = own {
                spread(&own.value, value, k, c);
                spread_rows(&own.gradient, gradient, k, c, d);
                if let Some((_, rate)) = &mut rate {
                    spread(&own.rate, rate, k, c);
                }
                if let Some(q) = &mut q {
                    spread_rows(&own.q, q, k, c, m);
                }
            }
            outputs.chain(&adjoints, gradient, (k, c, d));
            if let (Some(q), true) = (&mut q, leaves > 0) {
                outputs.chain_parameters(&adjoints, q, (k, c, m));
            }
            if let (Some((rates, rate)), true) = (&mut rate, leaves > 0) {
                let mut q = vec![0.0; n * free.len()];
                outputs.chain_parameters(&adjoints, &mut q, (1, 0, free.len()));
                for (i, row) in q.chunks_exact(free.len().max(1)).enumerate() {
                    rate[i * k + c] += row.iter().zip(&free).map(|(g, &p)| g * rates[p]).sum::<f64>();
                }
            }
        }
        Ok(())
    }

    /// The column of each parameter in q.
    fn columns(&self) -> Vec<Option<usize>> {
        let mut columns = vec![None; self.params.len()];
        for (column, i) in self.free().into_iter().enumerate() {
            columns[i] = Some(column);
        }
        columns
    }

    /// Second derivatives (n, k, d, d). Where there are opaque leaves, by central differences of the gradient.
    pub fn hessian(&self, points: &[f64], out: &mut [f64]) -> Result<(), FieldError> {
        let (n, k, d) = (self.count(points)?, self.components(), self.axes());
        Self::expect("hessian", out, n * k * d * d)?;
        if self.is_opaque() {
            return self.numerical_hessian(points, out);
        }
        let outputs = LeafOutputs::default();
        let batch = self.batch(points, &outputs);
        for c in 0..k {
            let (program, uniforms) = (&self.compiled.parts[c].inputs, &self.uniforms[c]);
            out.par_chunks_mut(CHUNK / 4 * k * d * d).enumerate().for_each(|(i, out)| {
                let part = batch.slice(i * (CHUNK / 4), out.len() / (k * d * d));
                let mut one = vec![0.0; part.len() * d * d];
                hessian(program, uniforms, part, &mut one);
                spread_rows(&one, out, k, c, d * d);
            });
        }
        Ok(())
    }

    /// The uniforms of a component as intervals, at the present values.
    fn spans(&self, component: usize) -> Vec<Interval> {
        let values: Vec<Interval> = self.params.iter().map(|p| Interval::from_f64(p.value)).collect();
        self.tape(component).uniforms.evaluate(&values)
    }

    fn no_intervals(&self) -> Result<(), FieldError> {
        match self.compiled.leaves.first() {
            None => Ok(()),
            Some(leaf) => Err(FieldError::Invalid(format!(
                "`{}` is an opaque function: it has no intervals; write it as a formula, or sample without them",
                leaf.name
            ))),
        }
    }

    /// Intervals of F over a box: one a component. An error where a part is opaque.
    pub fn interval(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let one = |c: usize| self.tape(c).interval(&self.spans(c), &inputs);
        Ok((0..self.components()).map(one).collect())
    }

    /// Intervals of ∂F/∂x over a box: (k, d).
    pub fn interval_gradient(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let mut out = Vec::new();
        for c in 0..self.components() {
            let mut gradient = vec![Interval::ZERO; self.axes()];
            self.tape(c).interval_gradient(&self.spans(c), &inputs, &mut gradient);
            out.extend(gradient);
        }
        Ok(out)
    }

    /// Intervals of the second derivatives over a box: (k, d, d).
    pub fn interval_hessian(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        use crate::plain::{forward, reverse};
        let (inputs, d) = (self.box_inputs(lo, hi)?, self.axes());
        let constant = |v| Dual { v, d: [Interval::ZERO; 3] };
        let mut out = Vec::new();
        for c in 0..self.components() {
            let tape = self.tape(c);
            let spans: Vec<Dual<Interval>> = self.spans(c).into_iter().map(constant).collect();
            let mut lanes = inputs.map(constant);
            for a in 0..d {
                lanes[a] = Dual::variable(inputs[a], a);
            }
            let (mut values, mut adjoints) = (Vec::new(), Vec::new());
            forward(tape, &spans, &lanes, &mut values);
            reverse(tape, &spans, &values, &mut adjoints);
            for i in 0..d {
                let row = tape.input(i).map_or([Interval::ZERO; 3], |at| adjoints[at].d);
                out.extend(&row[..d]);
            }
        }
        Ok(out)
    }

    fn box_inputs(&self, lo: &[f64], hi: &[f64]) -> Result<[Interval; MAX_AXES], FieldError> {
        self.no_intervals()?;
        let d = self.axes();
        Self::expect("lo", lo, d)?;
        Self::expect("hi", hi, d)?;
        let mut inputs = [Interval::ZERO; MAX_AXES];
        for a in 0..d {
            // Written so that NaN fails too.
            if !matches!(
                lo[a].partial_cmp(&hi[a]),
                Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)
            ) {
                return Err(FieldError::Invalid(format!(
                    "a box needs lo <= hi, given [{}, {}] on axis {a}",
                    lo[a], hi[a]
                )));
            }
            inputs[a] = Interval::new(lo[a], hi[a]);
        }
        Ok(inputs)
    }

    /// A box that contains the whole surface, or `None` where the search finds no end to it.
    pub fn bounds(&self) -> Option<Aabb> {
        bounds::find(self)
    }
}

/// Where the results of one component go.
struct Target<'a> {
    value: &'a mut [f64],
    gradient: &'a mut [f64],
    rate: Option<&'a mut [f64]>,
    q: Option<&'a mut [f64]>,
}

/// Columns of one component among several.
struct Own {
    value: Vec<f64>,
    gradient: Vec<f64>,
    rate: Vec<f64>,
    q: Vec<f64>,
}

impl Own {
    fn new(n: usize, d: usize, m: usize, rate: bool) -> Own {
        let rates = if rate { n } else { 0 };
        Own { value: vec![0.0; n], gradient: vec![0.0; n * d], rate: vec![0.0; rates], q: vec![0.0; n * m] }
    }

    fn target(&mut self) -> Target<'_> {
        Target {
            value: &mut self.value,
            gradient: &mut self.gradient,
            rate: (!self.rate.is_empty()).then_some(&mut self.rate[..]),
            q: (!self.q.is_empty()).then_some(&mut self.q[..]),
        }
    }
}

/// One task's share of a target.
struct Chunk<'a> {
    start: usize,
    value: &'a mut [f64],
    gradient: &'a mut [f64],
    rate: Option<&'a mut [f64]>,
    q: Option<&'a mut [f64]>,
    adjoints: &'a mut [f64],
}

fn chunks<'a>(
    t: Target<'a>,
    adjoints: &'a mut [f64],
    (d, leaves, m): (usize, usize, usize),
) -> Vec<Chunk<'a>> {
    let mut out = Vec::with_capacity(t.value.len().div_ceil(CHUNK));
    let (mut value, mut gradient, mut rate, mut q, mut rest) = (t.value, t.gradient, t.rate, t.q, adjoints);
    let mut start = 0;
    while !value.is_empty() {
        let n = CHUNK.min(value.len());
        out.push(Chunk {
            start,
            value: take(&mut value, n),
            gradient: take(&mut gradient, n * d),
            rate: rate.as_mut().map(|r| take(r, n)),
            q: q.as_mut().map(|q| take(q, n * m)),
            adjoints: take(&mut rest, n * leaves),
        });
        start += n;
    }
    out
}

/// Cuts the first `n` numbers off.
fn take<'a>(slice: &mut &'a mut [f64], n: usize) -> &'a mut [f64] {
    let (head, tail) = std::mem::take(slice).split_at_mut(n);
    *slice = tail;
    head
}

/// Writes a column of one component into (n, k).
fn spread(one: &[f64], all: &mut [f64], k: usize, c: usize) {
    spread_rows(one, all, k, c, 1);
}

/// Writes rows of `width` numbers of one component into (n, k, width).
fn spread_rows(one: &[f64], all: &mut [f64], k: usize, c: usize, width: usize) {
    if width > 0 {
        for (row, to) in one.chunks_exact(width).zip(all.chunks_exact_mut(k * width)) {
            to[c * width..(c + 1) * width].copy_from_slice(row);
        }
    }
}
