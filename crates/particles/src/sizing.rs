//! Relative sizes of floaters from a density.

use isoswarm_field::Surface;
use isoswarm_field::arrange::median;

use crate::Error;
use crate::curvature;
use crate::neighbors::Neighbors;
use crate::options::Density;
use crate::swarm::Swarm;
use crate::vector::V3;

/// Densities are kept within this factor of their mean (over the surface), so that sizes stay within a factor of 64.
const RANGE: f64 = 4096.0;
/// The same where curvature sets the density.
const CURVATURE_RANGE: f64 = 4.0;

/// A density with its mean over the surface.
#[derive(Clone, Copy)]
pub(crate) struct Sizing<'a> {
    density: Density<'a>,
    mean: f64,
}

impl<'a> Sizing<'a> {
    pub(crate) fn uniform() -> Self {
        Self { density: Density::Uniform, mean: 1.0 }
    }

    /// Takes the mean over points that are uniform by area; gives the density there too (empty where uniform).
    pub(crate) fn new(
        density: Density<'a>,
        surface: &dyn Surface,
        uniform: &Swarm,
        spacing: f64,
        axes: usize,
    ) -> Result<(Self, Vec<f64>), Error> {
        let mut sizing = Self { density, mean: 1.0 };
        let values = sizing.values(surface, uniform, spacing, axes)?;
        if !values.is_empty() {
            sizing.mean = values.iter().sum::<f64>() / values.len() as f64;
            if sizing.mean.is_nan() || sizing.mean <= 0.0 {
                // A plane has no curvature anywhere.
                return Ok((Self::uniform(), Vec::new()));
            }
        }
        let relative = values.iter().map(|v| sizing.limit(v / sizing.mean)).collect();
        Ok((sizing, relative))
    }

    pub(crate) fn is_uniform(&self) -> bool {
        matches!(self.density, Density::Uniform)
    }

    fn limit(&self, relative: f64) -> f64 {
        let range = if matches!(self.density, Density::Curvature) { CURVATURE_RANGE } else { RANGE };
        relative.clamp(1.0 / range, range)
    }

    /// The density at each floater, not normalised; empty where it is the same everywhere.
    fn values(
        &self,
        surface: &dyn Surface,
        swarm: &Swarm,
        unit: f64,
        axes: usize,
    ) -> Result<Vec<f64>, Error> {
        match self.density {
            Density::Uniform => Ok(Vec::new()),
            Density::Function(f) => {
                let mut out = vec![f64::NAN; swarm.len()];
                f(&swarm.points, &mut out).map_err(|reason| Error::Density { reason })?;
                check(&swarm.points, &out)?;
                Ok(out)
            }
            Density::Curvature => {
                let lists: Neighbors = swarm.neighbors(2.0 * unit);
                let k = curvature::principal(surface, swarm, &lists, axes);
                let squares: Vec<f64> = k.iter().map(|k| k[0] * k[0] + k[1] * k[1]).collect();
                // Creases and singular points, where it is undefined, count as ordinary ones.
                let mut known: Vec<f64> = squares.iter().copied().filter(|s| s.is_finite()).collect();
                let Some(median) = median(&mut known) else {
                    return Ok(vec![0.0; swarm.len()]);
                };
                // A few points of extreme curvature do not set the scale for all others.
                let most = if median > 0.0 { 100.0 * median } else { f64::INFINITY };
                Ok(squares.iter().map(|s| if s.is_finite() { s.min(most) } else { median }).collect())
            }
        }
    }

    /// The sizes at places of a density by function (all 1 for others).
    pub(crate) fn at(&self, points: &[V3], out: &mut [f64]) -> Result<(), Error> {
        out.fill(1.0);
        if let Density::Function(f) = self.density {
            f(points, out).map_err(|reason| Error::Density { reason })?;
            check(points, out)?;
            out.iter_mut().for_each(|v| *v = 1.0 / self.limit(*v / self.mean).sqrt());
        }
        Ok(())
    }

    /// Gives every floater its size.
    pub(crate) fn apply(
        &self,
        surface: &dyn Surface,
        swarm: &mut Swarm,
        unit: f64,
        axes: usize,
    ) -> Result<(), Error> {
        if self.is_uniform() {
            return Ok(());
        }
        // Curvature comes from the neighbours of equal-sized floaters.
        swarm.size.clear();
        let values = self.values(surface, swarm, unit, axes)?;
        swarm.size = values
            .iter()
            .map(|v| {
                let relative = self.limit(v / self.mean);
                if axes == 2 { 1.0 / relative } else { 1.0 / relative.sqrt() }
            })
            .collect();
        Ok(())
    }
}

fn check(points: &[V3], density: &[f64]) -> Result<(), Error> {
    match (0..points.len()).find(|&i| !(density[i] > 0.0 && density[i].is_finite())) {
        None => Ok(()),
        Some(i) => Err(Error::Density {
            reason: format!(
                "expected positive, finite values, given {} at {:?}; bound the function from below",
                density[i], points[i]
            ),
        }),
    }
}
