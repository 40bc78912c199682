//! Products with J and Jᵀ, the rows read once each: sums in a fixed number of parts and a fixed order.

use pulp::Arch;
use rayon::prelude::*;

pub(crate) use crate::control::sums::dot;

/// Parts into which rows are split; each sums for itself.
const PARTS: usize = 16;
/// Rows of a part, at least.
const ROWS: usize = 32;
/// Numbers in J from which threads pay.
const PARALLEL: usize = 1 << 15;

/// A row-major matrix.
#[derive(Clone, Copy)]
pub(crate) struct Matrix<'a> {
    pub(crate) rows: &'a [f64],
    pub(crate) width: usize,
}

/// What is done with each row.
#[derive(Clone, Copy, PartialEq)]
enum Pass {
    /// w = J p.
    Forward,
    /// out = Jᵀ u.
    Backward,
    /// w = J p and out = Jᵀ w.
    Both,
    /// out = Σ of squares in each column.
    Squares,
}

/// Some of the rows.
struct Part<'a> {
    pass: Pass,
    rows: &'a [f64],
    width: usize,
    /// p, or the part of u.
    input: &'a [f64],
    w: &'a mut [f64],
    out: &'a mut [f64],
}

#[inline(always)]
fn axpy(out: &mut [f64], u: f64, row: &[f64]) {
    for (o, r) in out.iter_mut().zip(row) {
        *o += u * r;
    }
}

impl pulp::NullaryFnOnce for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Part { pass, rows, width, input, w, out } = self;
        let rows = rows.chunks_exact(width);
        match pass {
            Pass::Forward => rows.zip(w).for_each(|(row, w)| *w = dot(row, input)),
            Pass::Backward => rows.zip(input).for_each(|(row, u)| axpy(out, *u, row)),
            Pass::Both => rows.zip(w).for_each(|(row, w)| {
                *w = dot(row, input);
                axpy(out, *w, row);
            }),
            Pass::Squares => rows.for_each(|row| {
                for (o, r) in out.iter_mut().zip(row) {
                    *o += r * r;
                }
            }),
        }
    }
}

impl Matrix<'_> {
    /// Number of rows.
    pub(crate) fn count(&self) -> usize {
        self.rows.len() / self.width.max(1)
    }

    /// J p
    pub(crate) fn times(&self, p: &[f64]) -> Vec<f64> {
        let mut w = vec![0.0; self.count()];
        self.run(Pass::Forward, p, &mut w);
        w
    }

    /// Jᵀ u
    pub(crate) fn transposed(&self, u: &[f64]) -> Vec<f64> {
        self.run(Pass::Backward, u, &mut [])
    }

    /// J p and Jᵀ J p.
    pub(crate) fn both(&self, p: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut w = vec![0.0; self.count()];
        let out = self.run(Pass::Both, p, &mut w);
        (w, out)
    }

    /// Σ of squares in each column.
    pub(crate) fn squares(&self) -> Vec<f64> {
        self.run(Pass::Squares, &[], &mut [])
    }

    /// Runs the pass over all parts; the sums of the columns where it makes them.
    fn run(&self, pass: Pass, input: &[f64], w: &mut [f64]) -> Vec<f64> {
        let width = self.width;
        if width == 0 || self.rows.is_empty() {
            return vec![0.0; width];
        }
        let some = self.count().div_ceil(PARTS).max(ROWS);
        let count = self.count().div_ceil(some);
        let length = if pass == Pass::Forward { 0 } else { width };
        let mut sums = vec![0.0; count * length];
        let mut parts = Vec::with_capacity(count);
        let (mut rest_w, mut rest_sums) = (w, &mut sums[..]);
        for (i, rows) in self.rows.chunks(some * width).enumerate() {
            let n = rows.len() / width;
            let w_left = rest_w.len();
            let (own, later) = std::mem::take(&mut rest_w).split_at_mut(n.min(w_left));
            let (out, further) = std::mem::take(&mut rest_sums).split_at_mut(length);
            (rest_w, rest_sums) = (later, further);
            let input = if pass == Pass::Backward { &input[i * some..i * some + n] } else { input };
            parts.push(Part { pass, rows, width, input, w: own, out });
        }
        let arch = Arch::new();
        if self.rows.len() < PARALLEL {
            parts.into_iter().for_each(|p| arch.dispatch(p));
        } else {
            parts.into_par_iter().for_each(|p| arch.dispatch(p));
        }
        let mut total = sums[..length].to_vec();
        for part in sums.chunks_exact(length.max(1)).skip(1) {
            total.iter_mut().zip(part).for_each(|(t, v)| *t += v);
        }
        total
    }
}
