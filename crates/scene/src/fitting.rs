//! Parameters that follow points.

use isoswarm_particles::control::{Distances, FitOptions, Loss, fit};

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
        // Without pins.
        let summary = Distances::of(&found.residuals[..points.len()], Some(&weight));
        if summary.skipped == points.len() {
            return Err(Error::option(
                "points",
                "a point or more with a weight above 0 at which F has a gradient (pins do not count)",
                format!("{} of which none can be used; raise the weights or move the points", points.len()),
            ));
        }
        self.remember();
        let paths: Vec<String> =
            field.parameters().iter().filter(|p| p.is_free()).map(|p| p.path.clone()).collect();
        self.now.state.field = field;
        self.resettle("this fit")?;
        let fit = FitReport {
            converged: found.status.is_converged(),
            reason: found.status.to_string(),
            rms: summary.rms,
            largest: summary.largest,
            skipped: summary.skipped,
            rank: found.rank,
            freedom: found.freedom,
            iterations: found.iterations,
            at_limit: found.at_limit.iter().filter_map(|&i| paths.get(i).cloned()).collect(),
        };
        Ok(Change { parameters: true, fit: Some(fit), ..Change::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Amount, Command, Settings};
    use isoswarm_field::text;

    fn scene(formula: &str) -> Scene {
        let settings = Settings { amount: Amount::Count(150), ..Settings::default() };
        Scene::new(&text::parse(formula, &[]).unwrap(), settings).unwrap()
    }

    fn points(s: &mut Scene, points: &[V], weights: &[f64]) -> Result<FitReport, Error> {
        let (points, weights) = (points.to_vec(), weights.to_vec());
        let command = Command::Fit { points, weights, loss: FitLoss::Squares, iterations: 50 };
        Ok(s.apply(command)?.fit.unwrap())
    }

    type V = [f64; 3];

    #[test]
    fn points_without_a_say_are_refused_and_some_are_counted() {
        let mut s = scene("ellipsoid(1, 1.5, 0.8)");
        let q = s.field().q();
        let around = [[1.1, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 0.8]];
        for pinned in [false, true] {
            for (p, w) in [(&[[0.0; 3]; 3], &[][..]), (&around, &[0.0; 3][..])] {
                let e = points(&mut s, p, w).unwrap_err().to_string();
                assert!(e.contains("none can be used"), "{e}");
                assert_eq!(s.field().q(), q);
            }
            if !pinned {
                s.pin([1.0, 0.0, 0.0]).unwrap();
            }
        }
        let mut s = scene("ellipsoid(1, 1.5, 0.8)");
        let report = points(&mut s, &around, &[1.0, 0.0, 1.0]).unwrap();
        assert!(report.skipped == 1 && report.converged, "{report:?}");
    }

    #[test]
    fn pins_do_not_dilute_the_distance_of_the_points() {
        // The pin holds r = 1; the points lie on spheres of 1.1 and 1.3.
        let mut s = scene("sphere(1)");
        s.pin([1.0, 0.0, 0.0]).unwrap();
        let around = [[0.0, 1.1, 0.0], [0.0, -1.1, 0.0], [0.0, 0.0, 1.3], [0.0, 0.0, -1.3]];
        let report = points(&mut s, &around, &[]).unwrap();
        let expected = ((0.01 + 0.09) / 2.0f64).sqrt();
        assert!((report.rms - expected).abs() < 0.05 * expected, "{report:?}");
        assert_eq!(report.skipped, 0);
    }
}
