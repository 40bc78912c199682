//! Products with J and Jᵀ, the rows read once each: sums in a fixed number of parts and a fixed order.

use isoswarm_field::SparseRows;
use pulp::Arch;
use rayon::prelude::*;

pub(crate) use crate::control::sums::dot;

/// Parts into which rows are split; each sums for itself.
const PARTS: usize = 16;
/// Rows of a part, at least.
const ROWS: usize = 32;
/// Numbers in J from which threads pay.
const PARALLEL: usize = 1 << 15;

/// The derivatives of the residuals, one row a point.
#[derive(Clone, Copy)]
pub(crate) enum Matrix<'a> {
    /// All entries, row-major.
    Dense { rows: &'a [f64], width: usize },
    /// Those of the few parameters that matter near each point.
    Sparse(&'a SparseRows),
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

/// Some of the rows: `count` from `first` on.
struct Part<'a> {
    pass: Pass,
    matrix: Matrix<'a>,
    first: usize,
    count: usize,
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
        let Part { pass, matrix, first, count, input, w, out } = self;
        match matrix {
            Matrix::Dense { rows, width } => {
                let rows = rows[first * width..(first + count) * width].chunks_exact(width);
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
            Matrix::Sparse(rows) => {
                for k in 0..count {
                    let entries = || rows.entries_of(first + k);
                    match pass {
                        Pass::Forward => w[k] = entries().map(|(j, v)| v * input[j]).sum(),
                        Pass::Backward => entries().for_each(|(j, v)| out[j] += v * input[k]),
                        Pass::Both => {
                            w[k] = entries().map(|(j, v)| v * input[j]).sum();
                            entries().for_each(|(j, v)| out[j] += v * w[k]);
                        }
                        Pass::Squares => entries().for_each(|(j, v)| out[j] += v * v),
                    }
                }
            }
        }
    }
}

impl Matrix<'_> {
    /// Number of rows.
    pub(crate) fn count(&self) -> usize {
        match self {
            Matrix::Dense { rows, width } => rows.len() / (*width).max(1),
            Matrix::Sparse(rows) => rows.len(),
        }
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        match self {
            Matrix::Dense { width, .. } => *width,
            Matrix::Sparse(rows) => rows.width(),
        }
    }

    /// Number of entries that are held.
    pub(crate) fn entries(&self) -> usize {
        match self {
            Matrix::Dense { rows, .. } => rows.len(),
            Matrix::Sparse(rows) => rows.entries(),
        }
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
        let (rows, width) = (self.count(), self.width());
        if width == 0 || rows == 0 {
            return vec![0.0; width];
        }
        let some = rows.div_ceil(PARTS).max(ROWS);
        let length = if pass == Pass::Forward { 0 } else { width };
        let mut sums = vec![0.0; rows.div_ceil(some) * length];
        let mut parts = Vec::with_capacity(PARTS);
        let (mut rest_w, mut rest_sums) = (w, &mut sums[..]);
        for first in (0..rows).step_by(some) {
            let count = some.min(rows - first);
            let w_left = rest_w.len();
            let (own, later) = std::mem::take(&mut rest_w).split_at_mut(count.min(w_left));
            let (out, further) = std::mem::take(&mut rest_sums).split_at_mut(length);
            (rest_w, rest_sums) = (later, further);
            let input = if pass == Pass::Backward { &input[first..first + count] } else { input };
            parts.push(Part { pass, matrix: *self, first, count, input, w: own, out });
        }
        let arch = Arch::new();
        if self.entries() < PARALLEL {
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
