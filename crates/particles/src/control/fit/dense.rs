//! JᵀJ and its Cholesky factor, by tiles that stay in registers.
//!
//! The factor is never used to solve anything alone: it preconditions an iteration on J itself (see `linear`), which is
//! why JᵀJ, whose condition is the square of J's, is good enough. Every entry is summed in the order of the rows, lanes run across
//! columns, nothing is fused: the same bits on any number of threads and at any vector width.

use isoswarm_field::SparseRows;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Columns of a packed panel.
const PANEL: usize = 16;
/// Rows of a tile in registers.
const TILE: usize = 8;
/// Rows of J that are packed at a time.
const DEPTH: usize = 256;
/// Rows that are factored at a time.
const BLOCK: usize = 64;
/// Smallest pivot of a matrix whose diagonal is at most about 1.
const PIVOT: f64 = 1e-14;

/// A symmetric matrix, or a triangular factor: row-major, the upper half is used, padded to whole panels.
#[derive(Clone, Debug)]
pub(crate) struct Upper {
    size: usize,
    stride: usize,
    data: Vec<f64>,
}

/// `rows` of a matrix in panels of [`PANEL`] columns: panel, then row, then column.
struct Packed<'a> {
    data: &'a [f64],
    depth: usize,
}

/// Adds (or subtracts) AᵀA to the rows of one panel, from the diagonal on.
struct Strip<'a> {
    packed: &'a Packed<'a>,
    panel: usize,
    /// [`PANEL`] rows of the matrix.
    out: &'a mut [f64],
    stride: usize,
    /// Panel of the matrix in which panel 0 of `packed` lies.
    first: usize,
    sign: f64,
}

impl WithSimd for Strip<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Strip { packed, panel, out, stride, first, sign } = self;
        let length = packed.depth * PANEL;
        let a = &packed.data[panel * length..(panel + 1) * length];
        let piece = 2 * S::F64_LANES;
        let sign = simd.splat_f64s(sign);
        for (other, b) in packed.data.chunks_exact(length).enumerate().skip(panel) {
            for half in 0..PANEL / TILE {
                for begin in (0..PANEL).step_by(piece) {
                    let mut sum = [[simd.splat_f64s(0.0); 2]; TILE];
                    for (a, b) in a.chunks_exact(PANEL).zip(b.chunks_exact(PANEL)) {
                        let a: &[f64; TILE] = a[half * TILE..][..TILE].try_into().expect("a tile");
                        let (b, _) = S::as_simd_f64s(&b[begin..begin + piece]);
                        let (b0, b1) = (b[0], b[1]);
                        for i in 0..TILE {
                            let x = simd.splat_f64s(a[i]);
                            sum[i][0] = simd.add_f64s(sum[i][0], simd.mul_f64s(x, b0));
                            sum[i][1] = simd.add_f64s(sum[i][1], simd.mul_f64s(x, b1));
                        }
                    }
                    for (i, sum) in sum.iter().enumerate() {
                        let at = (half * TILE + i) * stride + (first + other) * PANEL + begin;
                        let (to, _) = S::as_mut_simd_f64s(&mut out[at..at + piece]);
                        to[0] = simd.add_f64s(to[0], simd.mul_f64s(sign, sum[0]));
                        to[1] = simd.add_f64s(to[1], simd.mul_f64s(sign, sum[1]));
                    }
                }
            }
        }
    }
}

impl Upper {
    /// (J diag(c))ᵀ (J diag(c)) for the rows of J, `c.len()` numbers each.
    pub(crate) fn gram(rows: &[f64], c: &[f64]) -> Self {
        let (size, panels) = (c.len(), c.len().div_ceil(PANEL));
        let stride = panels * PANEL;
        let mut data = vec![0.0; stride * stride];
        let mut packed = vec![0.0; stride * DEPTH];
        for block in rows.chunks(DEPTH * size.max(1)) {
            let depth = block.len() / size;
            let packed = &mut packed[..stride * depth];
            packed.par_chunks_mut(depth * PANEL).enumerate().for_each(|(p, to)| {
                let begin = p * PANEL;
                let end = size.min(begin + PANEL);
                for (to, row) in to.chunks_exact_mut(PANEL).zip(block.chunks_exact(size)) {
                    for ((to, v), c) in to.iter_mut().zip(&row[begin..end]).zip(&c[begin..end]) {
                        *to = v * c;
                    }
                }
            });
            add(&mut data, stride, &Packed { data: packed, depth }, 0, 1.0);
        }
        Self { size, stride, data }
    }

    /// The same of rows with few entries.
    pub(crate) fn sparse_gram(rows: &SparseRows, c: &[f64]) -> Self {
        let size = c.len();
        let stride = size.div_ceil(PANEL) * PANEL;
        let mut data = vec![0.0; stride * stride];
        for i in 0..rows.len() {
            for (a, v) in rows.entries_of(i) {
                let (v, to) = (v * c[a], &mut data[a * stride..(a + 1) * stride]);
                for (b, w) in rows.entries_of(i).filter(|e| e.0 >= a) {
                    to[b] += v * (w * c[b]);
                }
            }
        }
        Self { size, stride, data }
    }

    /// The upper triangular R with RᵀR = self + `damping` · 1, where rows and columns with `skip` are left out (they become
    /// those of the identity). A pivot that is not above rounding becomes 1e-14: R only preconditions.
    pub(crate) fn factored(&self, damping: f64, skip: &[bool]) -> Self {
        let (size, stride) = (self.size, self.stride);
        let mut r = self.clone();
        for i in 0..stride {
            let row = &mut r.data[i * stride..(i + 1) * stride];
            if i >= size || skip[i] {
                row.fill(0.0);
                row[i] = 1.0;
                continue;
            }
            row[i] += damping;
            for j in (i..size).filter(|&j| skip[j]) {
                row[j] = 0.0;
            }
        }
        let mut packed = vec![0.0; stride * BLOCK];
        for begin in (0..stride).step_by(BLOCK) {
            let end = stride.min(begin + BLOCK);
            factor_rows(&mut r.data[begin * stride..end * stride], stride, begin);
            let depth = end - begin;
            let packed = &mut packed[..(stride - end) * depth];
            let (done, below) = r.data.split_at_mut(end * stride);
            let rows = &done[begin * stride..];
            packed.par_chunks_mut(depth * PANEL).enumerate().for_each(|(p, to)| {
                for (to, row) in to.chunks_exact_mut(PANEL).zip(rows.chunks_exact(stride)) {
                    to.copy_from_slice(&row[end + p * PANEL..][..PANEL]);
                }
            });
            add(below, stride, &Packed { data: packed, depth }, end / PANEL, -1.0);
        }
        r
    }

    /// x := R⁻¹ R⁻ᵀ x
    pub(crate) fn solve(&self, x: &mut [f64]) {
        Arch::new().dispatch(Solve { r: self, x });
    }

    /// An entry of the symmetric matrix.
    #[cfg(test)]
    fn entry(&self, i: usize, j: usize) -> f64 {
        self.data[i.min(j) * self.stride + i.max(j)]
    }
}

struct Solve<'a> {
    r: &'a Upper,
    x: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (r, x) = (self.r, self.x);
        let row = |i: usize| &r.data[i * r.stride + i..i * r.stride + r.size];
        for i in 0..r.size {
            let row = row(i);
            let v = x[i] / row[0];
            x[i] = v;
            for (x, r) in x[i + 1..].iter_mut().zip(&row[1..]) {
                *x -= v * r;
            }
        }
        for i in (0..r.size).rev() {
            let row = row(i);
            x[i] = (x[i] - super::passes::dot(&row[1..], &x[i + 1..])) / row[0];
        }
    }
}

fn add(data: &mut [f64], stride: usize, packed: &Packed<'_>, first: usize, sign: f64) {
    let arch = Arch::new();
    data.par_chunks_mut(PANEL * stride).enumerate().for_each(|(panel, out)| {
        arch.dispatch(Strip { packed, panel, out, stride, first, sign });
    });
}

/// Factors `rows`, which begin at column and row `begin` of the matrix: what is above has been taken off already.
fn factor_rows(rows: &mut [f64], stride: usize, begin: usize) {
    let depth = rows.len() / stride;
    // The square at the diagonal first.
    let mut inverse = [0.0; BLOCK];
    for k in 0..depth {
        let (above, below) = rows.split_at_mut((k + 1) * stride);
        let row = &mut above[k * stride + begin..k * stride + begin + depth];
        let pivot = if row[k] > PIVOT { row[k].sqrt() } else { PIVOT.sqrt() };
        inverse[k] = 1.0 / pivot;
        row[k] = pivot;
        row[k + 1..].iter_mut().for_each(|v| *v *= inverse[k]);
        for i in k + 1..depth {
            let v = row[i];
            let other = &mut below[(i - k - 1) * stride + begin..][..depth];
            for j in i..depth {
                other[j] -= v * row[j];
            }
        }
    }
    // Then the columns to its right, a panel at a time: R₁₁ᵀ R₁₂ = what is there.
    let square: Vec<f64> =
        rows.chunks_exact(stride).flat_map(|r| r[begin..begin + depth].iter().copied()).collect();
    let rest = stride - begin - depth;
    let mut columns = vec![0.0; rest * depth];
    columns.par_chunks_mut(depth * PANEL).enumerate().for_each(|(p, out)| {
        let at = begin + depth + p * PANEL;
        for (k, out) in out.chunks_exact_mut(PANEL).enumerate() {
            out.copy_from_slice(&rows[k * stride + at..][..PANEL]);
        }
        Arch::new().dispatch(Forward { square: &square, inverse: &inverse, out, depth });
    });
    rows.par_chunks_mut(stride).enumerate().for_each(|(k, row)| {
        for (p, to) in row[begin + depth..].chunks_exact_mut(PANEL).enumerate() {
            to.copy_from_slice(&columns[(p * depth + k) * PANEL..][..PANEL]);
        }
    });
}

struct Forward<'a> {
    square: &'a [f64],
    inverse: &'a [f64; BLOCK],
    out: &'a mut [f64],
    depth: usize,
}

impl pulp::NullaryFnOnce for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (rows, _) = self.out.as_chunks_mut::<PANEL>();
        for k in 0..self.depth {
            let (done, rest) = rows.split_at_mut(k);
            let mut row = rest[0];
            for (i, above) in done.iter().enumerate() {
                let v = self.square[i * self.depth + k];
                for j in 0..PANEL {
                    row[j] -= v * above[j];
                }
            }
            rest[0] = row.map(|v| v * self.inverse[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};

    fn random(n: usize, m: usize, seed: u64) -> Vec<f64> {
        let rng = Rng::new(seed, Stream::Jitter);
        (0..n * m).map(|i| 2.0 * rng.unit(i as u64) - 1.0).collect()
    }

    #[test]
    fn the_gram_matrix_is_that_of_the_scaled_columns() {
        for (n, m) in [(1, 1), (3, 7), (300, 33), (517, 150)] {
            let (j, c) = (random(n, m, 1), random(1, m, 2));
            let g = Upper::gram(&j, &c);
            for a in 0..m {
                for b in a..m {
                    let plain: f64 = (0..n).map(|i| j[i * m + a] * c[a] * (j[i * m + b] * c[b])).sum();
                    assert!((g.entry(a, b) - plain).abs() < 1e-13 * n as f64, "{n} {m} {a} {b}");
                }
            }
        }
    }

    #[test]
    fn the_factor_solves_what_is_not_skipped() {
        for m in [1, 5, 64, 65, 200] {
            let j = random(m + 20, m, 3);
            let g = Upper::gram(&j, &vec![1.0; m]);
            let skip: Vec<bool> = (0..m).map(|i| i % 7 == 3).collect();
            let r = g.factored(0.25, &skip);
            let b = random(1, m, 4);
            let mut x = b.clone();
            r.solve(&mut x);
            for i in 0..m {
                let row: f64 = (0..m).filter(|&k| !skip[k]).map(|k| g.entry(i, k) * x[k]).sum();
                let expected = if skip[i] { x[i] } else { row + 0.25 * x[i] };
                assert!((expected - b[i]).abs() < 1e-11, "{m} {i}");
            }
        }
    }

    #[test]
    fn a_singular_matrix_has_a_factor_that_is_finite() {
        let g = Upper::gram(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0], &[1.0; 3]);
        let mut x = vec![1.0, 2.0, 3.0];
        g.factored(0.0, &[false; 3]).solve(&mut x);
        assert!(x.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let j = random(400, 130, 5);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Upper::gram(&j, &vec![1.0; 130]).factored(1e-3, &[false; 130]).data)
        };
        assert_eq!(run(1), run(3));
    }
}
