//! Rows of equations that matter more or less: minimum-norm least squares by a rank-revealing orthogonal factorisation.
//!
//! A (n × m) = P L Hᵀ by Householder reflections from the right with pivoting among rows: rows are what is contiguous, a
//! row is a pin and a column a parameter. Rows come in ranks of precedence: those of a later rank are met as well
//! as they can be without touching what the earlier ones achieved. Plain loops in a fixed order: the same bits on any number of
//! threads and at any vector width.

use isoswarm_field::arrange::Arrange;
use pulp::Arch;
use rayon::prelude::*;

use super::sums::dot;

/// Numbers to update from which threads pay.
const PARALLEL: usize = 1 << 16;

/// row -= beta (row·v) v for each row: the reflection of many rows.
struct Reflect<'a> {
    v: &'a [f64],
    beta: f64,
    rows: &'a mut [f64],
    width: usize,
    from: usize,
}

impl pulp::NullaryFnOnce for Reflect<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for row in self.rows.chunks_exact_mut(self.width) {
            let row = &mut row[self.from..];
            let k = self.beta * dot(row, self.v);
            for (x, y) in row.iter_mut().zip(self.v) {
                *x -= k * y;
            }
        }
    }
}

/// The factors of a system; see the module.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    width: usize,
    /// Row k: L up to k - 1, then the vector of reflection k; rows beyond the rank: L up to the rank.
    rows: Vec<f64>,
    diagonal: Vec<f64>,
    beta: Vec<f64>,
    /// Place of each factored row in the system.
    order: Vec<usize>,
    /// For each precedence: one beyond its last row, and the rank up to there.
    blocks: Vec<(usize, usize)>,
}

/// What [`Factors::solve`] gives.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    /// x, the smallest of those that leave the least residual.
    pub(crate) x: Vec<f64>,
    /// A x - b.
    pub(crate) residual: Vec<f64>,
}

impl Factors {
    /// Factors the rows (row-major, `width` numbers each; `precedence[i]` of row i, 0 first). What remains of a row below
    /// `tolerance` times the longest row counts as nothing: the row depends on others.
    pub(crate) fn new(mut rows: Vec<f64>, width: usize, precedence: &[u8], tolerance: f64) -> Self {
        let n = precedence.len();
        assert_eq!(rows.len(), n * width, "a row of {width} numbers for each precedence");
        // The rows of each precedence together, in their order.
        let mut order: Vec<usize> = (0..n).collect();
        if !precedence.is_sorted() {
            order.arrange_by_key(|&i| precedence[i]);
            rows = order.iter().flat_map(|&i| &rows[i * width..(i + 1) * width]).copied().collect();
        }
        let mut norms: Vec<f64> = rows.chunks_exact(width.max(1)).map(|r| dot(r, r)).collect();
        norms.resize(n, 0.0);
        let mut first = norms.clone();
        let longest = norms.iter().fold(0.0f64, |a, &b| a.max(b)).sqrt();
        let least = tolerance * longest;
        let (mut diagonal, mut beta) = (Vec::new(), Vec::new());
        let mut blocks = Vec::new();
        let mut k = 0;
        let last = precedence.iter().copied().max().unwrap_or(0);
        let mut begin = 0;
        for p in 0..=last {
            let end = begin + order[begin..].iter().take_while(|&&i| precedence[i] == p).count();
            // Rows that turned out dependent stay between the rank and the end of their block: pivots are swapped to
            // the front of what is left of the block, and L's columns go by the rank.
            let mut at = begin;
            while at < end && k < width {
                let pivot = (at..end).fold(at, |best, i| if norms[i] > norms[best] { i } else { best });
                swap_rows(&mut rows, width, at, pivot);
                order.swap(at, pivot);
                norms.swap(at, pivot);
                first.swap(at, pivot);
                let row = &rows[at * width + k..(at + 1) * width];
                let length = dot(row, row).sqrt();
                if length.is_nan() || length <= least {
                    break;
                }
                // Row k becomes (.., -sign(x₀)|x|, 0, ..).
                let alpha = if row[0] > 0.0 { -length } else { length };
                let (head, below) = rows.split_at_mut((at + 1) * width);
                let v = &mut head[at * width + k..];
                let scale = 1.0 / (length * (length + v[0].abs()));
                v[0] -= alpha;
                reflect(v, scale, below, width, k);
                for i in at + 1..n {
                    let l = rows[i * width + k];
                    norms[i] = (norms[i] - l * l).max(0.0);
                    // Differences lose digits: once most of a row is gone it is measured again.
                    if norms[i] < 1e-6 * first[i] {
                        let row = &rows[i * width + k + 1..(i + 1) * width];
                        norms[i] = dot(row, row);
                        first[i] = norms[i];
                    }
                }
                diagonal.push(alpha);
                beta.push(scale);
                at += 1;
                k += 1;
            }
            blocks.push((end, k));
            begin = end;
        }
        Self { width, rows, diagonal, beta, order, blocks }
    }

    /// Number of independent rows.
    pub(crate) fn rank(&self) -> usize {
        self.diagonal.len()
    }

    /// Solves for one right-hand side, `b[i]` for row i.
    pub(crate) fn solve(&self, b: &[f64]) -> Solved {
        let (n, w) = (self.order.len(), self.width);
        let mut z: Vec<f64> = Vec::with_capacity(self.rank());
        let mut residual = vec![0.0; n];
        let (mut begin, mut before) = (0, 0);
        for &(end, rank) in &self.blocks {
            let own = rank - before;
            let mut rest: Vec<f64> = (begin..end)
                .map(|i| b[self.order[i]] - (0..before).map(|c| self.rows[i * w + c] * z[c]).sum::<f64>())
                .collect();
            let count = end - begin;
            // L restricted to the block: a triangle, and below it the rows that depend.
            let entry = |i: usize, c: usize| match i.cmp(&c) {
                std::cmp::Ordering::Less => 0.0,
                std::cmp::Ordering::Equal => self.diagonal[before + c],
                std::cmp::Ordering::Greater => self.rows[(begin + i) * w + before + c],
            };
            let part = if count == own {
                let mut part = vec![0.0; own];
                for i in 0..own {
                    let known: f64 = (0..i).map(|c| entry(i, c) * part[c]).sum();
                    part[i] = (rest[i] - known) / entry(i, i);
                }
                part
            } else {
                least_squares(count, own, &entry, &rest)
            };
            for i in 0..count {
                rest[i] = (0..own.min(i + 1)).map(|c| entry(i, c) * part[c]).sum::<f64>() - rest[i];
                residual[self.order[begin + i]] = rest[i];
            }
            z.extend(part);
            (begin, before) = (end, rank);
        }
        // x = H₀ H₁ … (z, 0).
        let mut x = vec![0.0; w];
        x[..z.len()].copy_from_slice(&z);
        let pivots = self.pivots();
        for k in (0..z.len()).rev() {
            let v = &self.rows[pivots[k] * w + k..(pivots[k] + 1) * w];
            let s = self.beta[k] * dot(&x[k..], v);
            for (x, v) in x[k..].iter_mut().zip(v) {
                *x -= s * v;
            }
        }
        Solved { x, residual }
    }

    /// The row that holds each reflection.
    fn pivots(&self) -> Vec<usize> {
        let (mut begin, mut before) = (0, 0);
        let mut pivots = Vec::with_capacity(self.rank());
        for &(end, rank) in &self.blocks {
            pivots.extend(begin..begin + rank - before);
            (begin, before) = (end, rank);
        }
        pivots
    }
}

pub(super) fn reflect(v: &[f64], beta: f64, rows: &mut [f64], width: usize, from: usize) {
    let arch = Arch::new();
    if rows.len() < PARALLEL {
        return arch.dispatch(Reflect { v, beta, rows, width, from });
    }
    let some = width * (rows.len() / width).div_ceil(8).max(1);
    rows.par_chunks_mut(some).for_each(|rows| arch.dispatch(Reflect { v, beta, rows, width, from }));
}

fn swap_rows(rows: &mut [f64], width: usize, i: usize, j: usize) {
    if i != j {
        let (a, b) = rows.split_at_mut(i.max(j) * width);
        a[i.min(j) * width..][..width].swap_with_slice(&mut b[..width]);
    }
}

/// min |L z - b| for an n × r matrix of full rank, by Householder reflections of its columns.
fn least_squares(n: usize, r: usize, entry: &dyn Fn(usize, usize) -> f64, b: &[f64]) -> Vec<f64> {
    let mut columns: Vec<Vec<f64>> = (0..r).map(|c| (0..n).map(|i| entry(i, c)).collect()).collect();
    let mut b = b.to_vec();
    let mut diagonal = vec![0.0; r];
    for k in 0..r {
        let (head, rest) = columns.split_at_mut(k + 1);
        let v = &mut head[k][k..];
        let length = dot(v, v).sqrt();
        let alpha = if v[0] > 0.0 { -length } else { length };
        let beta = 1.0 / (length * (length + v[0].abs()));
        v[0] -= alpha;
        for column in rest.iter_mut().map(|c| &mut c[k..]).chain([&mut b[k..]]) {
            let s = beta * dot(column, v);
            for (x, y) in column.iter_mut().zip(v.iter()) {
                *x -= s * y;
            }
        }
        diagonal[k] = alpha;
    }
    let mut z = vec![0.0; r];
    for k in (0..r).rev() {
        let known: f64 = (k + 1..r).map(|c| columns[c][k] * z[c]).sum();
        z[k] = (b[k] - known) / diagonal[k];
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};

    fn random(n: usize, m: usize, seed: u64) -> Vec<f64> {
        let rng = Rng::new(seed, Stream::Jitter);
        (0..n * m).map(|i| 2.0 * rng.unit(i as u64) - 1.0).collect()
    }

    fn times(a: &[f64], m: usize, x: &[f64]) -> Vec<f64> {
        a.chunks_exact(m).map(|r| r.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
    }

    /// Aᵀ y.
    fn transposed(a: &[f64], m: usize, y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; m];
        for (r, y) in a.chunks_exact(m).zip(y) {
            r.iter().zip(&mut x).for_each(|(a, x)| *x += a * y);
        }
        x
    }

    fn largest(v: &[f64]) -> f64 {
        v.iter().fold(0.0, |a, b| a.max(b.abs()))
    }

    #[test]
    fn a_wide_system_gets_its_smallest_solution() {
        let (n, m) = (7, 53);
        let (a, b) = (random(n, m, 1), random(n, 1, 2));
        let f = Factors::new(a.clone(), m, &[0; 7], 1e-12);
        assert_eq!(f.rank(), 7);
        let s = f.solve(&b);
        for (l, b) in times(&a, m, &s.x).iter().zip(&b) {
            assert!((l - b).abs() < 1e-13);
        }
        assert!(largest(&s.residual) < 1e-13);
        // The smallest solution lies in the span of the rows: x = Aᵀy for the y of the normal equations.
        let gram: Vec<f64> = a.chunks_exact(m).flat_map(|r| times(&a, m, r)).collect();
        let y = Factors::new(gram, n, &[0; 7], 1e-14).solve(&b).x;
        let x = transposed(&a, m, &y);
        assert!(s.x.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-11));
    }

    #[test]
    fn a_tall_system_gets_the_least_squares() {
        let (n, m) = (40, 6);
        let (a, b) = (random(n, m, 3), random(n, 1, 4));
        let s = Factors::new(a.clone(), m, &vec![0; n], 1e-12).solve(&b);
        // The residual is orthogonal to the columns.
        assert!(largest(&transposed(&a, m, &s.residual)) < 1e-13);
        assert!(largest(&s.residual) > 0.1);
    }

    #[test]
    fn dependent_rows_are_counted_out() {
        let m = 12;
        let mut a = random(3, m, 5);
        let twice: Vec<f64> = a[..m].iter().map(|v| 2.0 * v).collect();
        a.extend(&twice);
        a.extend(vec![0.0; m]);
        let f = Factors::new(a.clone(), m, &[0; 5], 1e-9);
        assert_eq!(f.rank(), 3);
        // Consistent but for the row of zeros.
        let s = f.solve(&[1.0, -1.0, 0.5, 2.0, 3.0]);
        assert!((s.residual[4] + 3.0).abs() < 1e-15 && largest(&s.residual[..4]) < 1e-13);
        // Contradictory: rows 0 and 3 say x = 1 and x = 0 with weights 1 and 2: 1/5.
        let s = f.solve(&[1.0, -1.0, 0.5, 0.0, 0.0]);
        let l = times(&a, m, &s.x);
        assert!((l[0] - 0.2).abs() < 1e-13 && (l[1] + 1.0).abs() < 1e-13, "{l:?}");
    }

    #[test]
    fn precedence_keeps_what_came_first() {
        let m = 5;
        let mut a = random(3, m, 6);
        a.extend(random(6, m, 7));
        let precedence = [1, 0, 0, 1, 1, 2, 1, 2, 1];
        let b = random(9, 1, 8);
        let f = Factors::new(a.clone(), m, &precedence, 1e-12);
        let s = f.solve(&b);
        assert_eq!(f.rank(), 5);
        assert!(s.residual[1].abs() < 1e-13 && s.residual[2].abs() < 1e-13);
        let l = times(&a, m, &s.x);
        assert!((0..9).all(|i| (l[i] - b[i] - s.residual[i]).abs() < 1e-13));
        // Among x that meet rows 1 and 2, the rows of precedence 1 have the least squares: their gradient has no part in
        // the null space of rows 1 and 2.
        let second: Vec<usize> = (0..9).filter(|&i| precedence[i] == 1).collect();
        let rows: Vec<f64> = second.iter().flat_map(|&i| a[i * m..(i + 1) * m].to_vec()).collect();
        let res: Vec<f64> = second.iter().map(|&i| s.residual[i]).collect();
        let gradient = transposed(&rows, m, &res);
        let hold: Vec<f64> = a[m..3 * m].to_vec();
        let within = Factors::new(hold.clone(), m, &[0, 0], 1e-12).solve(&times(&hold, m, &gradient)).x;
        let outside: Vec<f64> = gradient.iter().zip(&within).map(|(a, b)| a - b).collect();
        assert!(largest(&outside) < 1e-13, "{outside:?}");
        assert!(largest(&gradient) > 1e-3);
    }

    #[test]
    fn nothing_is_fine() {
        let f = Factors::new(Vec::new(), 4, &[], 1e-9);
        assert_eq!((f.rank(), f.solve(&[]).x), (0, vec![0.0; 4]));
        let f = Factors::new(Vec::new(), 0, &[0, 0], 1e-9);
        assert_eq!(f.solve(&[1.0, 2.0]).residual, [-1.0, -2.0]);
    }
}
