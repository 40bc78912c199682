//! One linearised problem: min |J z + f|² + λ|z|² over some of z.
//!
//! Conjugate gradients on J itself, preconditioned with the Cholesky factor of JᵀJ + λ (see `dense`): one or two passes over
//! J reach what an orthogonal factorisation reaches, at half of its operations, and another λ costs a small factorisation.
//! Where J does not care z is 0, as exactly as λ lets it: λ is never 0 where J may be deficient.

use super::dense::Upper;
use super::passes::{Matrix, dot};

/// Largest number of columns for which JᵀJ is formed; and where rows have few entries, so that passes over J cost little
/// beside a factorisation.
pub(super) const WIDEST: usize = 4096;
const WIDEST_SPARSE: usize = 1024;
/// Part of the gradient that may remain, and iterations, with and without the factor: without it steps are rough, and more of them do it.
const WITH: (f64, usize) = (1e-13, 40);
const WITHOUT: (f64, usize) = (1e-3, 400);

/// J with scaled columns.
pub(crate) struct Linear<'a> {
    j: Matrix<'a>,
    /// Factor of each column; 0 takes it out.
    scale: &'a [f64],
    gram: Option<Upper>,
}

/// A solution.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// z, in scaled columns.
    pub(crate) z: Vec<f64>,
    /// J z
    pub(crate) effect: Vec<f64>,
}

impl<'a> Linear<'a> {
    pub(crate) fn new(j: Matrix<'a>, scale: &'a [f64]) -> Self {
        let gram = match j {
            Matrix::Dense { rows, width } => (width <= WIDEST).then(|| Upper::gram(rows, scale)),
            Matrix::Sparse(rows) => (rows.width() <= WIDEST_SPARSE).then(|| Upper::sparse_gram(rows, scale)),
        };
        Self { j, scale, gram }
    }

    /// Jᵀ u in scaled columns.
    pub(crate) fn transposed(&self, u: &[f64]) -> Vec<f64> {
        let mut g = self.j.transposed(u);
        g.iter_mut().zip(self.scale).for_each(|(g, c)| *g *= c);
        g
    }

    /// Length in parameters of a unit of z.
    pub(crate) fn scale(&self) -> &[f64] {
        self.scale
    }

    /// J z
    pub(crate) fn times(&self, z: &[f64]) -> Vec<f64> {
        self.j.times(&self.scaled(z))
    }

    fn scaled(&self, z: &[f64]) -> Vec<f64> {
        z.iter().zip(self.scale).map(|(z, c)| z * c).collect()
    }

    /// The system with this damping and without the columns that are held.
    pub(crate) fn damped(&self, damping: f64, held: &[bool]) -> Damped<'_> {
        let skip: Vec<bool> = held.iter().zip(self.scale).map(|(held, c)| *held || *c == 0.0).collect();
        let factor = self.gram.as_ref().map(|g| g.factored(damping, &skip));
        Damped { linear: self, damping, skip, factor }
    }
}

/// A [`Linear`] with damping, ready for right-hand sides.
pub(crate) struct Damped<'a> {
    linear: &'a Linear<'a>,
    damping: f64,
    skip: Vec<bool>,
    factor: Option<Upper>,
}

impl Damped<'_> {
    /// The z that minimises in the columns that are not held. `gradient`: Jᵀ f at z = 0, in scaled columns.
    pub(crate) fn solve(&self, gradient: &[f64]) -> Step {
        let (j, scale) = (self.linear.j, self.linear.scale);
        let m = scale.len();
        let (mut z, mut effect) = (vec![0.0; m], vec![0.0; j.count()]);
        let mut r: Vec<f64> = (0..m).map(|k| if self.skip[k] { 0.0 } else { -gradient[k] }).collect();
        let precondition = |r: &[f64]| {
            let mut h = r.to_vec();
            if let Some(factor) = &self.factor {
                factor.solve(&mut h);
            }
            h
        };
        let mut h = precondition(&r);
        let mut gamma = dot(&r, &h);
        let (remainder, most) = if self.factor.is_some() { WITH } else { WITHOUT };
        let enough = remainder * remainder * gamma;
        let mut p = h.clone();
        for _ in 0..most {
            if !(gamma > enough && gamma.is_finite()) {
                break;
            }
            let (w, mut v) = j.both(&self.linear.scaled(&p));
            for k in 0..m {
                v[k] = if self.skip[k] { 0.0 } else { v[k] * scale[k] + self.damping * p[k] };
            }
            let delta = dot(&w, &w) + self.damping * dot(&p, &p);
            if !(delta > 0.0 && delta.is_finite()) {
                break;
            }
            let alpha = gamma / delta;
            z.iter_mut().zip(&p).for_each(|(z, p)| *z += alpha * p);
            effect.iter_mut().zip(&w).for_each(|(e, w)| *e += alpha * w);
            r.iter_mut().zip(&v).for_each(|(r, v)| *r -= alpha * v);
            h = precondition(&r);
            let next = dot(&r, &h);
            let beta = next / gamma;
            gamma = next;
            p.iter_mut().zip(&h).for_each(|(p, h)| *p = h + beta * *p);
        }
        Step { z, effect }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::factor::Factors;
    use crate::rng::{Rng, Stream};

    fn random(n: usize, seed: u64) -> Vec<f64> {
        let rng = Rng::new(seed, Stream::Jitter);
        (0..n).map(|i| 2.0 * rng.unit(i as u64) - 1.0).collect()
    }

    /// The rows of J and below them √λ 1, factored orthogonally.
    fn direct(j: &[f64], m: usize, f: &[f64], damping: f64) -> Vec<f64> {
        let mut rows = j.to_vec();
        let mut b: Vec<f64> = f.iter().map(|v| -v).collect();
        if damping > 0.0 {
            for k in 0..m {
                let mut row = vec![0.0; m];
                row[k] = damping.sqrt();
                rows.extend(row);
                b.push(0.0);
            }
        }
        Factors::new(rows, m, &vec![0; b.len()], 1e-12).solve(&b).x
    }

    fn compare(n: usize, m: usize, damping: f64, spoil: impl Fn(&mut [f64])) {
        let mut j = random(n * m, 1);
        spoil(&mut j);
        let f = random(n, 2);
        let scale = vec![1.0 / (n as f64).sqrt(); m];
        let scaled: Vec<f64> = j.iter().map(|v| v * scale[0]).collect();
        let linear = Linear::new(Matrix::Dense { rows: &j, width: m }, &scale);
        let step = linear.damped(damping, &vec![false; m]).solve(&linear.transposed(&f));
        let expected = direct(&scaled, m, &f, damping);
        let size = expected.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        for (z, x) in step.z.iter().zip(&expected) {
            assert!((z - x).abs() < 1e-8 * size, "{n} {m} {damping}: {z} {x}");
        }
    }

    #[test]
    fn tall_wide_and_deficient_systems_as_by_orthogonal_factors() {
        compare(60, 20, 0.0, |_| ());
        compare(60, 20, 1e-2, |_| ());
        compare(10, 30, 1e-6, |_| ());
        compare(10, 30, 1e-7, |_| ());
        let twin = |j: &mut [f64]| j.chunks_exact_mut(20).for_each(|r| r[7] = 3.0 * r[2]);
        compare(60, 20, 1e-6, twin);
        // Condition 1e6: JᵀJ alone would leave four digits.
        compare(60, 20, 0.0, |j| j.chunks_exact_mut(20).for_each(|r| r[7] = r[2] + 1e-6 * r[7]));
    }

    #[test]
    fn what_is_held_stays() {
        let (n, m) = (40, 12);
        let (j, f, scale) = (random(n * m, 3), random(n, 4), vec![0.3; m]);
        let linear = Linear::new(Matrix::Dense { rows: &j, width: m }, &scale);
        let held: Vec<bool> = (0..m).map(|k| k % 3 == 0).collect();
        let step = linear.damped(1e-12, &held).solve(&linear.transposed(&f));
        assert!((0..m).filter(|&k| held[k]).all(|k| step.z[k] == 0.0));
        let left: Vec<f64> = step.effect.iter().zip(&f).map(|(e, f)| e + f).collect();
        let g = linear.transposed(&left);
        assert!((0..m).filter(|&k| !held[k]).all(|k| g[k].abs() < 1e-9), "{g:?}");
        let again = linear.times(&step.z);
        assert!(again.iter().zip(&step.effect).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
