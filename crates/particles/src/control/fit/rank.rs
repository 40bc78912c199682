//! How many parameters, or combinations of them, the points determine.

use super::dense::Upper;
use super::linear::WIDEST;
use super::passes::{Matrix, dot};
use crate::control::factor::Factors;

/// Operations up to which the orthogonal factorisation is made at once.
const SMALL: f64 = 3e7;
/// What JᵀJ can tell from rounding.
const SURE: f64 = 2e-8;
/// Steps of inverse iteration.
const STEPS: usize = 4;
/// Largest number of entries of J with all its zeros.
const MOST: usize = 1 << 26;

/// The rank of J diag(scale), whose columns have about unit length or are nothing; singular values below `tolerance` do not count.
///
/// A large J is first looked at by inverse iteration: the quotient |J z|/|z| that it ends with bounds the smallest singular value from above
/// and comes close to it; if it is well above the tolerance the rank is full. Otherwise, and for a small J, rows are factored with
/// pivoting. Where rows have few entries and are too many for that it is only told how many columns and rows have any: the rank is no
/// higher.
pub(crate) fn rank(j: Matrix<'_>, scale: &[f64], tolerance: f64) -> usize {
    let kept: Vec<usize> = (0..scale.len()).filter(|&k| scale[k] > 0.0).collect();
    let (n, m) = (j.count(), kept.len());
    if n == 0 || m == 0 {
        return 0;
    }
    let cost = n as f64 * m as f64 * n.min(m) as f64;
    if cost > SMALL && n >= m && m <= WIDEST && smallest(j, scale, m) > SURE.max(2.0 * tolerance) {
        return m;
    }
    let mut rows = Vec::new();
    match j {
        Matrix::Dense { rows: all, width } => {
            rows.reserve_exact(n * m);
            for row in all.chunks_exact(width) {
                rows.extend(kept.iter().map(|&k| row[k] * scale[k]));
            }
        }
        Matrix::Sparse(all) if n.saturating_mul(m) > MOST => {
            let live = (0..n).filter(|&i| all.entries_of(i).any(|(_, v)| v != 0.0)).count();
            return live.min(m);
        }
        Matrix::Sparse(all) => {
            let mut place = vec![0; scale.len()];
            kept.iter().enumerate().for_each(|(at, &k)| place[k] = at);
            rows.resize(n * m, 0.0);
            for (i, row) in rows.chunks_exact_mut(m).enumerate() {
                all.entries_of(i)
                    .filter(|e| scale[e.0] > 0.0)
                    .for_each(|(k, v)| row[place[k]] = v * scale[k]);
            }
        }
    }
    Factors::new(rows, m, &vec![0; n], tolerance).rank()
}

/// About the smallest singular value.
fn smallest(j: Matrix<'_>, scale: &[f64], m: usize) -> f64 {
    let skip: Vec<bool> = scale.iter().map(|c| *c == 0.0).collect();
    let gram = match j {
        Matrix::Dense { rows, .. } => Upper::gram(rows, scale),
        Matrix::Sparse(rows) => Upper::sparse_gram(rows, scale),
    };
    let factor = gram.factored(1e-15, &skip);
    let mut z: Vec<f64> = (0..scale.len())
        .map(|k| if skip[k] { 0.0 } else { 1.0 + 0.5 * ((k * 7919) % 101) as f64 / 101.0 })
        .collect();
    let mut least = f64::INFINITY;
    for _ in 0..STEPS {
        factor.solve(&mut z);
        let size = dot(&z, &z).sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return 0.0;
        }
        z.iter_mut().for_each(|v| *v /= size);
        let scaled: Vec<f64> = z.iter().zip(scale).map(|(z, c)| z * c).collect();
        let effect = j.times(&scaled);
        least = least.min(dot(&effect, &effect).sqrt());
    }
    // Relative to the largest, which is at most the root of the number of columns of unit length.
    least / (m as f64).sqrt()
}
