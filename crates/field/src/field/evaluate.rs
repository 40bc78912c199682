//! Values and derivatives at points: component by component, chunk by chunk over the threads, then the chain rule
//! through opaque leaves.

use rayon::prelude::*;

use super::leaves::{LeafOutputs, Slopes};
use super::{CHUNK, Field, Part};
use crate::FieldError;
use crate::bumps::Sum;
use crate::kernel::{Batch, Columns, Rows, Want, hessian, run};
use crate::program::{Program, Purpose};

/// See [`Field::many_bumps`].
const MANY_BUMPS: usize = 64;

impl Field {
    /// F: (n, k). A sum of many Gaussian bumps, such as a molecule, leaves out tails that together move its surface by at most
    /// 1e-13 of its diameter.
    pub fn value(&self, points: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        let (n, k) = (self.count(points)?, self.components());
        Self::expect("value", value, n * k)?;
        if let Some(sum) = self.many_bumps() {
            sum.exactly(points.as_chunks().0, value, None);
            return Ok(());
        }
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
        if let Some(sum) = self.many_bumps() {
            let n = self.count(points)?;
            Self::expect("value", value, n)?;
            Self::expect("gradient", gradient, 3 * n)?;
            sum.exactly(points.as_chunks().0, value, Some(gradient.as_chunks_mut().0));
            return Ok(());
        }
        self.differentiate(points, value, gradient, None, None)
    }

    /// The field as a sum of bumps, where these are so many that a grid of them beats the tape. What it leaves out moves the surface
    /// by 1e-13 of its diameter at most.
    fn many_bumps(&self) -> Option<&Sum> {
        self.bumps().filter(|sum| sum.len() >= MANY_BUMPS)
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
        let slopes = match (&rate, &q) {
            (Some((rates, _)), _) => Slopes::Rate(rates),
            (_, Some(_)) => Slopes::Parameters { columns: &columns, count: m },
            _ => Slopes::Points,
        };
        let outputs = self.leaf_outputs(points, d, slopes)?;
        let batch = self.batch(points, &outputs);
        let mut adjoints = vec![0.0; n * self.compiled.leaves.len()];
        for c in 0..k {
            let rates = rate.as_ref().map(|(rates, _)| *rates);
            let columns = q.is_some().then_some(&columns[..]);
            let sweep = Sweep::new(&self.compiled.parts[c], &self.uniforms[c], batch, rates, columns);
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
            sweep.run(target, &mut adjoints, m);
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
            if let Some(q) = &mut q {
                outputs.chain_parameters(&adjoints, q, (k, c, m));
            }
            if let Some((_, rate)) = &mut rate {
                outputs.chain_parameters(&adjoints, rate, (k, c, 1));
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
}

/// One function with its derivatives at all points, chunk by chunk over the threads.
pub(super) struct Sweep<'a> {
    program: &'a Program,
    uniforms: &'a [f64],
    batch: Batch<'a>,
    /// The rates of the uniforms, where some are not 0.
    rates: Option<Vec<f64>>,
    /// Where the free parameters go, where the function depends on some.
    rows: Option<Rows<'a>>,
}

impl<'a> Sweep<'a> {
    /// `rates`: of all parameters of the model; `columns`: of each in ∂F/∂q.
    pub(super) fn new(
        part: &'a Part,
        uniforms: &'a [f64],
        batch: Batch<'a>,
        rates: Option<&[f64]>,
        columns: Option<&[Option<usize>]>,
    ) -> Self {
        let rates =
            rates.map(|r| part.tape.uniforms.rates(uniforms, r)).filter(|r| r.iter().any(|v| *v != 0.0));
        let rows = columns.map(|c| Rows::new(&part.tape.uniforms, c)).filter(|r| !r.columns.is_empty());
        let program = if rates.is_some() || rows.is_some() {
            part.everything.get_or_init(|| Program::new(&part.tape, Purpose::Everything))
        } else {
            &part.inputs
        };
        Self { program, uniforms, batch, rates, rows }
    }

    /// Whether no derivative with respect to parameters or time is other than 0, but for those through leaves.
    pub(super) fn at_rest(&self) -> bool {
        self.rates.is_none() && self.rows.is_none()
    }

    /// Fills the target and the adjoints of the leaves; ∂F/∂q has `m` columns.
    pub(super) fn run(&self, target: Target, adjoints: &mut [f64], m: usize) {
        let (d, leaves) = (self.batch.axes, self.batch.leaves);
        chunks(target, adjoints, (d, leaves, m)).into_par_iter().for_each(|chunk| {
            let Chunk { start, value, gradient, rate, mut q, adjoints } = chunk;
            let part = self.batch.slice(start, value.len());
            let x = Columns { data: gradient, stride: d };
            let leaves = Columns { data: adjoints, stride: leaves };
            // Parameters that F does not depend on have no row to write.
            if let Some(q) = &mut q
                && self.rows.as_ref().is_none_or(|rows| rows.columns.len() < m)
            {
                q.fill(0.0);
            }
            let want = match (rate, q, &self.rates, &self.rows) {
                (Some(rate), _, Some(rates), _) => Want::Rate { x, leaves, rates, rate },
                (_, Some(data), _, Some(rows)) => {
                    Want::Parameters { x, leaves, rows, q: Columns { data, stride: m } }
                }
                (rate, ..) => {
                    rate.into_iter().for_each(|rate| rate.fill(0.0));
                    Want::Gradient { x, leaves }
                }
            };
            run(self.program, self.uniforms, part, value, want);
        });
    }
}

/// Where the results of one function go.
pub(super) struct Target<'a> {
    pub value: &'a mut [f64],
    pub gradient: &'a mut [f64],
    pub rate: Option<&'a mut [f64]>,
    pub q: Option<&'a mut [f64]>,
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
