//! Parameters that follow points.

use isoswarm_particles::control::{FitOptions, Loss, fit};

use crate::scene::{Progress, ProgressFn, Scene};
use crate::{Change, Error, FitLoss, FitReport};

/// What a pin counts beside the points of a fit.
const PIN_WEIGHT: f64 = 1e3;

impl Scene {
    /// Fits the surface to points; pins count as points too, much more than the others.
    pub(crate) fn fit_points(
        &mut self,
        points: &[[f64; 3]],
        weights: &[f64],
        loss: FitLoss,
        iterations: usize,
        progress: &mut ProgressFn<'_>,
    ) -> Result<Change, Error> {
        if points.is_empty() {
            return Err(Error::option("points", "at least one point", "none"));
        }
        if !weights.is_empty() && weights.len() != points.len() {
            let expected = format!("{} numbers, one a point", points.len());
            return Err(Error::option("weights", expected, weights.len()));
        }
        let axes = self.field().axes();
        points.iter().try_for_each(|p| crate::command::check_place("points", *p, axes))?;
        let mut all = points.to_vec();
        let mut weight = if weights.is_empty() { vec![1.0; points.len()] } else { weights.to_vec() };
        for p in self.pins().iter().filter(|p| p.pin.softness == 0.0) {
            all.push(p.pin.at);
            weight.push(PIN_WEIGHT * p.pin.weight);
        }
        let mut field = self.field().clone();
        let mut report = |p: &isoswarm_particles::control::FitProgress| {
            progress(self, &Progress { steps: p.iteration, most: iterations, remaining: p.rms })
        };
        let options = FitOptions {
            weights: Some(&weight),
            loss: match loss {
                FitLoss::Squares => Loss::Squares,
                FitLoss::Huber(c) => Loss::Huber(c),
                FitLoss::Cauchy(c) => Loss::Cauchy(c),
                FitLoss::SoftL1(c) => Loss::SoftL1(c),
            },
            iterations,
            progress: Some(&mut report),
            ..FitOptions::default()
        };
        let found = fit(&mut field, &all, options)?;
        self.remember();
        let paths: Vec<String> =
            field.parameters().iter().filter(|p| p.is_free()).map(|p| p.path.clone()).collect();
        self.now.state.field = field;
        self.resettle("this fit")?;
        let largest = found.residuals[..points.len()]
            .iter()
            .filter(|d| !d.is_nan())
            .fold(0.0f64, |a, d| a.max(d.abs()));
        let fit = FitReport {
            converged: found.status.is_converged(),
            reason: found.status.to_string(),
            rms: found.rms,
            largest,
            rank: found.rank,
            freedom: found.freedom,
            iterations: found.iterations,
            at_limit: found.at_limit.iter().filter_map(|&i| paths.get(i).cloned()).collect(),
        };
        Ok(Change { parameters: true, fit: Some(fit), ..Change::default() })
    }
}
