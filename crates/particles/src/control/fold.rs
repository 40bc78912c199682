//! Many sparse columns folded into few: A = [L 0] Hᵀ with orthogonal H, where a row of A has entries in few of the columns.
//!
//! The multifrontal method for sparse orthogonal factors (Duff and Reid 1983; Matstoms 1994): row by row, in the order of least
//! degree, the columns with an entry in the row are gathered as a small dense matrix (a front), which reflections from the
//! right make triangular. The row then has one column; the others that are left wait for later rows. Lengths of rows and
//! what depends on what are those of A, so that the least solution of L is that of A.

use super::factor::reflect;
use super::sums::dot;
use isoswarm_field::arrange::Arrange;

/// The columns that a row shares with others, made triangular.
#[derive(Clone, Debug)]
struct Front {
    columns: Vec<u32>,
    /// Vector k begins at column k.
    vectors: Vec<f64>,
    /// 2/|v|² of each vector; 0: no reflection.
    beta: Vec<f64>,
}

/// H of A = [L 0] Hᵀ; see the module.
#[derive(Clone, Debug)]
pub(super) struct Fold {
    fronts: Vec<Front>,
    /// The columns of A that hold L.
    kept: Vec<u32>,
    width: usize,
}

/// Entries of a matrix: of each row its columns and values.
pub(super) type Entries = [Vec<(u32, f64)>];

/// Rows below which folding does not pay, and the part of a matrix that may be other than nothing.
const FEWEST: usize = 8;
const FULL: f64 = 0.25;

/// Whether folding pays for `n` rows of `width` columns with so many entries in all.
pub(super) fn pays(n: usize, entries: usize, width: usize) -> bool {
    n >= FEWEST && width >= 2 * n && (entries as f64) < FULL * n as f64 * width as f64
}

/// A column that is left of a front: its entries belong to the rows of the front from `skip` on.
struct Piece {
    column: u32,
    front: usize,
    skip: usize,
    values: Vec<f64>,
}

/// What fronts are made of.
struct Folder {
    columns: Columns,
    /// The rows by turns, and the turn of each row.
    order: Vec<usize>,
    turn: Vec<usize>,
    /// Columns that wait for a turn: those of the matrix whose first row it is, and what is left of fronts.
    fresh: Vec<Vec<u32>>,
    waiting: Vec<Vec<Piece>>,
    /// The rows of each front so far, by turns.
    supports: Vec<Vec<usize>>,
    /// Place of a row in the present front.
    place: Vec<usize>,
}

/// Not in the front.
const ABSENT: usize = usize::MAX;

impl Folder {
    fn new(rows: &Entries, width: usize) -> Self {
        let n = rows.len();
        let columns = Columns::new(rows, width);
        let order = least_degree(&columns, n);
        let mut turn = vec![0; n];
        order.iter().enumerate().for_each(|(k, &i)| turn[i] = k);
        let mut fresh: Vec<Vec<u32>> = vec![Vec::new(); n];
        for c in 0..width {
            if let Some(first) = columns.of(c).iter().map(|e| turn[e.0 as usize]).min() {
                fresh[first].push(c as u32);
            }
        }
        let waiting = (0..n).map(|_| Vec::new()).collect();
        Self { columns, order, turn, fresh, waiting, supports: Vec::new(), place: vec![ABSENT; n] }
    }

    /// The columns that have waited for this turn.
    fn arrived(&mut self, k: usize) -> (Vec<u32>, Vec<Piece>) {
        (std::mem::take(&mut self.fresh[k]), std::mem::take(&mut self.waiting[k]))
    }

    /// The rows in which they have entries, by turns.
    fn support(&mut self, fresh: &[u32], waiting: &[Piece]) -> Vec<usize> {
        let Self { columns, turn, supports, place, .. } = self;
        let of_fresh = fresh.iter().flat_map(|&c| columns.of(c as usize)).map(|e| turn[e.0 as usize]);
        let of_waiting = waiting.iter().flat_map(|p| supports[p.front][p.skip..].iter().copied());
        let mut support: Vec<usize> = Vec::new();
        for t in of_fresh.chain(of_waiting) {
            if std::mem::replace(&mut place[t], 0) == ABSENT {
                support.push(t);
            }
        }
        support.arrange();
        support.iter().enumerate().for_each(|(r, &t)| place[t] = r);
        support
    }

    /// The front as a dense matrix of the support's rows.
    fn assemble(&mut self, fresh: &[u32], waiting: &[Piece], support: &[usize]) -> Vec<f64> {
        let Self { columns, turn, supports, place, .. } = self;
        let w = fresh.len() + waiting.len();
        let mut a = vec![0.0; support.len() * w];
        for (j, &c) in fresh.iter().enumerate() {
            columns.of(c as usize).iter().for_each(|e| a[place[turn[e.0 as usize]] * w + j] = e.1);
        }
        for (j, p) in waiting.iter().enumerate() {
            let rows = &supports[p.front][p.skip..];
            rows.iter().zip(&p.values).for_each(|(&t, v)| a[place[t] * w + fresh.len() + j] = *v);
        }
        support.iter().for_each(|&t| place[t] = ABSENT);
        a
    }
}

impl Fold {
    /// H, and L row-major with one column for each of [`Fold::width`].
    pub(super) fn new(rows: &Entries, width: usize) -> (Self, Vec<f64>) {
        let mut folder = Folder::new(rows, width);
        let mut fold = Fold { fronts: Vec::new(), kept: Vec::new(), width };
        // The entries of the columns that are kept, by the turns of their rows.
        let mut last: Vec<Vec<f64>> = Vec::new();
        for k in 0..rows.len() {
            let (fresh, waiting) = folder.arrived(k);
            if fresh.is_empty() && waiting.is_empty() {
                continue;
            }
            let support = folder.support(&fresh, &waiting);
            let a = folder.assemble(&fresh, &waiting, &support);
            let columns: Vec<u32> = fresh.iter().copied().chain(waiting.iter().map(|p| p.column)).collect();
            let (s, w) = (support.len(), columns.len());
            let (vectors, beta, l) = triangular(a, s, w);
            let count = beta.len();
            let below = |c: usize| (c..s).map(|r| l[r * count + c]).collect();
            for c in 1..count {
                let piece =
                    Piece { column: columns[c], front: folder.supports.len(), skip: c, values: below(c) };
                folder.waiting[support[c]].push(piece);
            }
            last.push(below(0));
            fold.kept.push(columns[0]);
            fold.fronts.push(Front { columns, vectors, beta });
            folder.supports.push(support);
        }
        let count = fold.kept.len();
        let mut out = vec![0.0; rows.len() * count];
        for (c, (support, values)) in folder.supports.iter().zip(&last).enumerate() {
            for (&t, v) in support.iter().zip(values) {
                out[folder.order[t] * count + c] = *v;
            }
        }
        (fold, out)
    }

    /// Number of columns of L.
    pub(super) fn width(&self) -> usize {
        self.kept.len()
    }

    /// H (z, 0): a solution of L z = b as one of A x = b.
    pub(super) fn unfold(&self, z: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.width];
        self.kept.iter().zip(z).for_each(|(&c, z)| x[c as usize] = *z);
        let mut own = Vec::new();
        for f in self.fronts.iter().rev() {
            own.clear();
            own.extend(f.columns.iter().map(|&c| x[c as usize]));
            let mut end = f.vectors.len();
            for k in (0..f.beta.len()).rev() {
                let v = &f.vectors[end - (own.len() - k)..end];
                end -= v.len();
                let s = f.beta[k] * dot(&own[k..], v);
                own[k..].iter_mut().zip(v).for_each(|(x, v)| *x -= s * v);
            }
            f.columns.iter().zip(&own).for_each(|(&c, v)| x[c as usize] = *v);
        }
        x
    }
}

/// The vectors of the reflections that make the s × w matrix lower triangular, their factors, and the triangle: s rows of as
/// many numbers as there are reflections.
fn triangular(mut a: Vec<f64>, s: usize, w: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let count = s.min(w);
    let (mut vectors, mut beta) = (Vec::with_capacity(count * w), Vec::with_capacity(count));
    let mut l = vec![0.0; s * count];
    for k in 0..count {
        let (head, below) = a.split_at_mut((k + 1) * w);
        l[k * count..k * count + k].copy_from_slice(&head[k * w..k * w + k]);
        let v = &mut head[k * w + k..];
        let length = dot(v, v).sqrt();
        if length > 0.0 && length.is_finite() {
            let alpha = if v[0] > 0.0 { -length } else { length };
            let scale = 1.0 / (length * (length + v[0].abs()));
            l[k * count + k] = alpha;
            v[0] -= alpha;
            reflect(v, scale, below, w, k);
            beta.push(scale);
        } else {
            beta.push(0.0);
        }
        vectors.extend_from_slice(v);
    }
    for r in count..s {
        l[r * count..(r + 1) * count].copy_from_slice(&a[r * w..r * w + count]);
    }
    (vectors, beta, l)
}

/// Entries by columns.
struct Columns {
    start: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Columns {
    fn new(rows: &Entries, width: usize) -> Self {
        let mut start = vec![0; width + 1];
        rows.iter().flatten().for_each(|e| start[e.0 as usize + 1] += 1);
        for c in 0..width {
            start[c + 1] += start[c];
        }
        let mut next = start.clone();
        let mut entries = vec![(0, 0.0); start[width]];
        for (i, row) in rows.iter().enumerate() {
            for &(c, v) in row {
                entries[next[c as usize]] = (i as u32, v);
                next[c as usize] += 1;
            }
        }
        Self { start, entries }
    }

    fn of(&self, c: usize) -> &[(u32, f64)] {
        &self.entries[self.start[c]..self.start[c + 1]]
    }
}

/// The rows in an order in which few others share columns with each, those that share only through earlier rows included.
fn least_degree(columns: &Columns, n: usize) -> Vec<usize> {
    let words = n.div_ceil(64);
    let mut near = vec![0u64; n * words];
    let mut mask = vec![0u64; words];
    for c in 0..columns.start.len() - 1 {
        let rows = columns.of(c);
        rows.iter().for_each(|e| mask[e.0 as usize / 64] |= 1 << (e.0 % 64));
        for e in rows {
            let own = &mut near[e.0 as usize * words..][..words];
            own.iter_mut().zip(&mask).for_each(|(a, b)| *a |= b);
        }
        rows.iter().for_each(|e| mask[e.0 as usize / 64] = 0);
    }
    let count = |near: &[u64], i: usize| -> u32 {
        near[i * words..(i + 1) * words].iter().map(|w| w.count_ones()).sum()
    };
    let mut degree: Vec<u32> = (0..n).map(|i| count(&near, i)).collect();
    let mut open = vec![true; n];
    let mut order = Vec::with_capacity(n);
    for _ in 0..n {
        let Some(i) = (0..n).filter(|&i| open[i]).min_by_key(|&i| degree[i]) else { break };
        open[i] = false;
        order.push(i);
        let mut own = near[i * words..(i + 1) * words].to_vec();
        own[i / 64] &= !(1 << (i % 64));
        for j in (0..n).filter(|&j| open[j] && own[j / 64] >> (j % 64) & 1 == 1) {
            let row = &mut near[j * words..(j + 1) * words];
            row.iter_mut().zip(&own).for_each(|(a, b)| *a |= b);
            row[i / 64] &= !(1 << (i % 64));
            degree[j] = count(&near, j);
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::factor::Factors;
    use crate::rng::{Rng, Stream};

    /// Rows along a line that each see a window of the columns.
    fn band(n: usize, width: usize, window: usize, seed: u64) -> Vec<Vec<(u32, f64)>> {
        let rng = Rng::new(seed, Stream::Jitter);
        (0..n)
            .map(|i| {
                // Not in the order of the line.
                let first = (i * 37 % n) * (width - window) / (n.max(2) - 1);
                let own = rng.child(i as u64);
                (0..window).map(|k| ((first + k) as u32, 2.0 * own.unit(k as u64) - 1.0)).collect()
            })
            .collect()
    }

    fn dense(rows: &Entries, width: usize) -> Vec<f64> {
        let mut a = vec![0.0; rows.len() * width];
        for (i, row) in rows.iter().enumerate() {
            row.iter().for_each(|&(c, v)| a[i * width + c as usize] = v);
        }
        a
    }

    fn compare(rows: &Entries, width: usize, precedence: &[u8]) -> usize {
        let n = rows.len();
        let rng = Rng::new(9, Stream::Jitter);
        let b: Vec<f64> = (0..n).map(|i| 2.0 * rng.unit(i as u64) - 1.0).collect();
        let direct = Factors::new(dense(rows, width), width, precedence, 1e-9);
        let (fold, l) = Fold::new(rows, width);
        assert!(fold.width() <= n);
        let folded = Factors::new(l, fold.width(), precedence, 1e-9);
        assert_eq!(folded.rank(), direct.rank());
        let (x, y) = (direct.solve(&b), folded.solve(&b));
        let size = x.x.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        for (u, v) in x.x.iter().zip(fold.unfold(&y.x)) {
            assert!((u - v).abs() < 1e-12 * size, "{u} {v}");
        }
        for (u, v) in x.residual.iter().zip(&y.residual) {
            assert!((u - v).abs() < 1e-12, "{u} {v}");
        }
        direct.rank()
    }

    #[test]
    fn the_least_solution_is_that_of_the_whole_matrix() {
        for (n, width, window) in [(8, 100, 20), (40, 900, 60), (100, 1500, 100), (5, 40, 40), (1, 9, 3)] {
            let rows = band(n, width, window, n as u64);
            assert_eq!(compare(&rows, width, &vec![0; n]), n);
            let precedence: Vec<u8> = (0..n).map(|i| (i % 3) as u8).collect();
            compare(&rows, width, &precedence);
        }
    }

    #[test]
    fn rows_that_depend_or_are_empty_are_counted_out() {
        let mut rows = band(30, 600, 40, 4);
        rows[7] = rows[3].iter().map(|&(c, v)| (c, -2.0 * v)).collect();
        rows[8].clear();
        // The sum of two rows.
        rows[9] = rows[10].iter().chain(&rows[11]).copied().collect();
        rows[9].sort_by_key(|e| e.0);
        let merged = rows[9].chunk_by(|a, b| a.0 == b.0).map(|c| (c[0].0, c.iter().map(|e| e.1).sum()));
        rows[9] = merged.collect();
        assert_eq!(compare(&rows, 600, &[0; 30]), 27);
    }

    #[test]
    fn more_rows_than_columns() {
        let rows = band(60, 20, 6, 5);
        assert_eq!(compare(&rows, 20, &[0; 60]), 20);
    }

    #[test]
    fn what_is_full_is_not_folded() {
        let pays = |n: usize, entries: usize| pays(n, n * entries, 900);
        assert!(pays(40, 60) && !pays(40, 600) && !pays(4, 60));
    }
}
