//! The derivatives of the residuals of a fit: all of them, or where a model is local those that matter.

use isoswarm_field::{Parametric, SparseRows};
use rayon::prelude::*;

use super::Measure;
use super::linear::WIDEST;
use super::passes::Matrix;
use super::problem::{Problem, State};
use crate::Error;
use crate::vector::{V3, norm};

/// Step for the derivative of |∇F| along the normal, in diagonals of the points' box.
const STEP: f64 = 1e-5;
/// Largest correction of an entry of J for the change of |∇F|, relative to the entries: beyond, the step met a crease.
const CREASE: f64 = 10.0;
/// Up to so many parameters all derivatives are held,
const FEW: usize = 256;
/// and where this part of them or more is other than nothing: of those for which JᵀJ is formed, at the full speed of the processor
/// where rows are full, and of more
const FULL: (f64, f64) = (0.06, 0.25);
/// (as so many of the points tell).
const PROBES: usize = 16;
/// Derivatives that one task handles.
const TASK: usize = 1 << 14;

/// The part of the derivatives that is other than nothing where a model is local; `None` where all are held.
pub(super) fn local_part(surface: &dyn Parametric, points: &[V3]) -> Result<Option<f64>, Error> {
    let m = surface.freedom();
    if m <= FEW || points.is_empty() {
        return Ok(None);
    }
    let some: Vec<V3> = points.iter().step_by(points.len().div_ceil(PROBES)).copied().collect();
    let (mut value, mut gradient) = (vec![0.0; some.len()], vec![[0.0; 3]; some.len()]);
    let rows = surface.sparse_parameter_gradient(&some, &mut value, &mut gradient)?;
    let part = rows.entries() as f64 / (some.len() * m) as f64;
    let full = if m <= WIDEST { FULL.0 } else { FULL.1 };
    Ok((part < full).then_some(part))
}

/// The least squares that stand for the loss at some q, besides J.
pub(crate) struct Linearised {
    /// f of |J z + f|².
    pub(crate) f: Vec<f64>,
    /// J over the derivatives of the distances, for each row.
    pub(crate) factor: Vec<f64>,
}

/// J, and room for the next.
pub(crate) enum Jacobian {
    All {
        j: Vec<f64>,
        /// Another of the same size.
        spare: Vec<f64>,
        width: usize,
    },
    Local(SparseRows),
}

impl Jacobian {
    /// Nothing yet: for those derivatives that matter near each point, or for all.
    pub(crate) fn new(surface: &dyn Parametric, local: bool) -> Self {
        let width = surface.freedom();
        if local {
            Self::Local(SparseRows::new(width))
        } else {
            Self::All { j: Vec::new(), spare: Vec::new(), width }
        }
    }

    pub(crate) fn matrix(&self) -> Matrix<'_> {
        match self {
            Self::All { j, width, .. } => Matrix::Dense { rows: j, width: *width },
            Self::Local(rows) => Matrix::Sparse(rows),
        }
    }
}

/// What becomes of a row of ∂F/∂q: for an entry v, and w a step behind, a v + b (v - w).
#[derive(Clone, Copy)]
struct Factors {
    a: f64,
    b: f64,
}

impl Factors {
    #[inline(always)]
    fn entry(self, v: f64, w: f64) -> f64 {
        let bend = self.b * (v - w);
        let most = CREASE * self.a * v.abs().max(w.abs());
        self.a * v + if bend.abs() <= most { bend } else { 0.0 }
    }
}

impl Problem<'_> {
    /// Derivatives of the distances into `jacobian`, with the factors that weights and loss give them.
    pub(crate) fn linearise(
        &self,
        surface: &dyn Parametric,
        state: &State,
        jacobian: &mut Jacobian,
    ) -> Result<Linearised, Error> {
        let n = self.points.len();
        let (mut f, mut factor) = (vec![0.0; n], vec![0.0; n]);
        for (i, t) in state.distance.iter().enumerate().filter(|(_, t)| !t.is_nan()) {
            let (row, right) = self.loss.factors(*t);
            (factor[i], f[i]) = (self.weight(i) * row, self.weight(i) * right * t);
        }
        let h = STEP * self.diagonal();
        let largest = state.distance.iter().fold(0.0f64, |a, t| a.max(t.abs()));
        // On the surface the change of |∇F| does not matter.
        let bent = matches!(self.measure, Measure::Distance) && h > 0.0 && largest > 1e-12 * self.diagonal();
        let behind: Option<Vec<V3>> = bent.then(|| self.behind(state, h));
        let factors: Vec<Factors> = (0..n).map(|i| self.factors(state, i, factor[i], h)).collect();
        match jacobian {
            Jacobian::All { j, spare, width } => {
                self.fill(surface, j, spare, *width, behind.as_deref(), &factors)?;
            }
            Jacobian::Local(rows) => *rows = self.local(surface, behind.as_deref(), &factors)?,
        }
        Ok(Linearised { f, factor })
    }

    /// The points a step behind the surface.
    fn behind(&self, state: &State, h: f64) -> Vec<V3> {
        let one = |(i, p): (usize, &V3)| {
            let g = state.gradient[i];
            let s = if state.distance[i].is_nan() { 0.0 } else { h / norm(g) };
            [0, 1, 2].map(|a| p[a] - s * g[a])
        };
        self.points.iter().enumerate().map(one).collect()
    }

    /// t = f/N:  dt = (G² df − f G dG)/N³ with G = |∇F|, and dG from the derivatives a step behind; `k` times that.
    fn factors(&self, state: &State, i: usize, k: f64, h: f64) -> Factors {
        if k == 0.0 {
            return Factors { a: 0.0, b: 0.0 };
        }
        if let Measure::Scaled(lengths) = self.measure {
            return Factors { a: k * lengths[i], b: 0.0 };
        }
        let (f, g) = (state.off[i], norm(state.gradient[i]));
        let n2 = self.inverse_squared(f, state.gradient[i]);
        let n3 = n2 * n2.sqrt();
        Factors { a: k * g * g * n3, b: if h > 0.0 { -k * f * g * n3 / h } else { 0.0 } }
    }

    fn fill(
        &self,
        surface: &dyn Parametric,
        j: &mut Vec<f64>,
        spare: &mut Vec<f64>,
        m: usize,
        behind: Option<&[V3]>,
        factors: &[Factors],
    ) -> Result<(), Error> {
        let n = self.points.len();
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        j.resize(n * m, 0.0);
        surface.parameter_gradient(self.points, &mut value, &mut gradient, j)?;
        if let Some(behind) = behind {
            spare.resize(n * m, 0.0);
            surface.parameter_gradient(behind, &mut value, &mut gradient, spare)?;
        }
        if m == 0 {
            return Ok(());
        }
        let few = TASK / m + 1;
        let spare = &spare[..];
        j.par_chunks_mut(few * m).enumerate().for_each(|(c, rows)| {
            for (k, row) in rows.chunks_exact_mut(m).enumerate() {
                let i = c * few + k;
                let factor = factors[i];
                if factor.a == 0.0 && factor.b == 0.0 {
                    row.fill(0.0);
                } else if behind.is_some() {
                    let behind = &spare[i * m..(i + 1) * m];
                    row.iter_mut().zip(behind).for_each(|(v, w)| *v = factor.entry(*v, *w));
                } else {
                    row.iter_mut().for_each(|v| *v *= factor.a);
                }
            }
        });
        Ok(())
    }

    fn local(
        &self,
        surface: &dyn Parametric,
        behind: Option<&[V3]>,
        factors: &[Factors],
    ) -> Result<SparseRows, Error> {
        let (n, m) = (self.points.len(), surface.freedom());
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        let here = surface.sparse_parameter_gradient(self.points, &mut value, &mut gradient)?;
        let behind = match behind {
            Some(points) => Some(surface.sparse_parameter_gradient(points, &mut value, &mut gradient)?),
            None => None,
        };
        let mut rows = SparseRows::new(m);
        let (mut there, mut values) = (vec![0.0; m], Vec::new());
        for (i, &factor) in factors.iter().enumerate() {
            let columns = if factor.a == 0.0 && factor.b == 0.0 { &[][..] } else { here.row(i).0 };
            values.clear();
            match behind.as_ref().filter(|_| !columns.is_empty()) {
                Some(behind) => {
                    behind.entries_of(i).for_each(|(k, w)| there[k] = w);
                    values.extend(here.entries_of(i).map(|(k, v)| factor.entry(v, there[k])));
                    behind.entries_of(i).for_each(|(k, _)| there[k] = 0.0);
                }
                None if columns.is_empty() => {}
                None => values.extend(here.row(i).1.iter().map(|v| v * factor.a)),
            }
            rows.push_block(columns, &values);
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use isoswarm_field::Field;

    use super::*;
    use crate::control::fit::tests::{field, sphere};
    use crate::control::fit::{FitOptions, Loss, check_size, levenberg};

    /// Small blobs all over the unit sphere, each a little off.
    fn many(count: usize) -> Field {
        let size = 0.8 * (4.0 * std::f64::consts::PI / count as f64).sqrt();
        let rows: Vec<String> = sphere(count)
            .iter()
            .map(|c| format!("{}, {}, {}, {size}", 0.97 * c[0], 0.96 * c[1], 0.98 * c[2]))
            .collect();
        field(&format!("blobs(0.5, {})", rows.join(", ")), &[])
    }

    #[test]
    fn what_is_left_out_of_a_local_model_is_nothing() {
        let f = many(1600);
        let mut points: Vec<V3> = sphere(300).iter().map(|p| p.map(|v| 1.02 * v)).collect();
        let weights: Vec<f64> = (0..300).map(|i| f64::from(i % 3)).collect();
        assert!(local_part(&f, &points).unwrap().is_some());
        // Far away nothing is near.
        points[4] = [9.0, 0.0, 0.0];
        for measure in [Measure::Distance, Measure::Scaled(&vec![0.5; 300])] {
            let problem = Problem::new(&points, None, Some(&weights), measure, Loss::Huber(0.01));
            let state = problem.state(&f).unwrap().unwrap();
            let rows = |local: bool| {
                let mut jacobian = Jacobian::new(&f, local);
                problem.linearise(&f, &state, &mut jacobian).unwrap();
                match jacobian {
                    Jacobian::All { j, .. } => j,
                    Jacobian::Local(rows) => rows.to_dense(),
                }
            };
            let (all, local) = (rows(false), rows(true));
            let most = all.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            assert!(most > 0.1);
            for (k, (a, l)) in all.iter().zip(&local).enumerate() {
                // A difference over 1e-5 of the diagonal is known to some 1e-8.
                assert!((a - l).abs() < 1e-7 * most, "{k}: {a} {l}");
            }
        }
    }

    #[test]
    fn a_local_model_is_fitted_as_well() {
        let points: Vec<V3> = sphere(900).iter().map(|p| p.map(|v| 1.05 * v)).collect();
        let run = |local: bool| {
            let mut f = many(100);
            let before = f.q();
            let options = &mut FitOptions { iterations: 30, ..FitOptions::default() };
            let jacobian = Jacobian::new(&f, local);
            let fit = levenberg::run(&mut f, &points, options, jacobian).unwrap();
            assert_ne!(f.q(), before);
            fit
        };
        let (all, local) = (run(false), run(true));
        assert!(local.rms < 1e-3 && (local.rms / all.rms - 1.0).abs() < 0.05, "{} {}", local.rms, all.rms);
        assert!(local.rank.abs_diff(all.rank) < 3, "{} {}", local.rank, all.rank);
    }

    #[test]
    fn large_models_are_fitted_without_a_factor() {
        let mut f = many(400);
        let points: Vec<V3> = sphere(3000).iter().map(|p| p.map(|v| 1.01 * v)).collect();
        let before = Problem::new(&points, None, None, Measure::Distance, Loss::Squares);
        let start = before.state(&f).unwrap().unwrap().summary(&before).rms;
        let options = &mut FitOptions { iterations: 5, ..FitOptions::default() };
        let jacobian = Jacobian::new(&f, true);
        let found = levenberg::run(&mut f, &points, options, jacobian).unwrap();
        assert!(found.rms < 0.2 * start, "{} from {start}", found.rms);
        // What is nothing needs no room.
        let many = vec![[1.0, 0.0, 0.0]; 200_000];
        assert!(check_size(&f, &many, None).is_err() && check_size(&f, &many, Some(0.1)).is_ok());
    }
}
