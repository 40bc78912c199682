//! A surface that is looked for once and sampled more than once.

use isoswarm_field::{Aabb, Surface};

use crate::Error;
use crate::options::{Options, ProgressFn};
use crate::report::Samples;
use crate::run::Run;
use crate::sample::{FEWEST_SEEDS, check, look_for, sample_from};
use crate::seeding::Seeds;

/// Boxes to aim at, and lines along each axis: enough for the seeds of some thousand points.
const BOXES: usize = 3 * FEWEST_SEEDS / 2;

/// Where a surface is: what [`sample`](crate::sample) begins with, kept for several samplings of some thousand points.
///
/// ```
/// use isoswarm_field::{Aabb, Field, text};
/// use isoswarm_particles::{Amount, Options, Search};
///
/// let sphere = Field::new(&text::parse("x^2+y^2+z^2-1", &[])?)?;
/// let search = Search::new(&sphere, &Aabb::new([-1.2; 3], [1.2; 3]), 0, None)?;
/// // The area, to a few percent.
/// let area = search.integral(|points, out| Ok(out[..points.len()].fill(1.0)))?;
/// assert!((area - 12.57).abs() < 1.5);
/// let samples = search.sample(Options { amount: Amount::Count(500), ..Options::default() })?;
/// assert_eq!(samples.points.len(), 500);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Search<'s> {
    surface: &'s dyn Surface,
    bounds: Aabb,
    seed: u64,
    evaluations: u64,
    /// Seeds, or the result where there is nothing to sample.
    found: Result<Seeds<'s>, Box<Samples>>,
}

impl<'s> Search<'s> {
    /// Looks for the part of F = 0 in `bounds` (finite corners, lo < hi), by the random choices of `seed`. `progress` may stop the search.
    ///
    /// # Errors
    /// Bounds that make no sense and whatever the field reports.
    pub fn new<'p>(
        surface: &'s dyn Surface,
        bounds: &Aabb,
        seed: u64,
        progress: Option<&'p mut ProgressFn<'p>>,
    ) -> Result<Self, Error> {
        check(surface, bounds, &Options::default())?;
        let mut run = Run::new(seed, progress);
        let found = look_for(surface, &mut run, bounds, FEWEST_SEEDS, BOXES)?;
        Ok(Self { surface, bounds: *bounds, seed, evaluations: run.evaluations, found })
    }

    /// Whether there is something to sample.
    pub fn is_empty(&self) -> bool {
        self.found.is_err()
    }

    /// The box around the points that were found.
    pub fn extent(&self) -> Option<Aabb> {
        Aabb::around(&self.found.as_ref().ok()?.points)
    }

    /// The integral of a function over the surface (the area, for 1), from a thousand random points or more: to a few percent, more
    /// where the function varies much. Points where it is not finite do not count.
    ///
    /// # Errors
    /// [`Error::Density`] with the message of the function.
    pub fn integral(&self, f: impl Fn(&[[f64; 3]], &mut [f64]) -> Result<(), String>) -> Result<f64, Error> {
        let Ok(seeds) = &self.found else { return Ok(0.0) };
        let points = &seeds.points[..seeds.uniform];
        let mut values = vec![0.0; points.len()];
        f(points, &mut values).map_err(|reason| Error::Density { reason })?;
        let finite = values.into_iter().filter(|v| v.is_finite());
        let (sum, count) = finite.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
        Ok(seeds.area * sum / count.max(1) as f64)
    }

    /// Samples what was found, as [`sample`](crate::sample) does. The seed of the options does not count; evaluations of the search
    /// are counted each time.
    ///
    /// # Errors
    /// Those of [`sample`](crate::sample).
    pub fn sample(&self, options: Options<'_>) -> Result<Samples, Error> {
        self.sample_in_steps(options, None)
    }

    /// As [`Search::sample`], with at most so many steps at the coarsest level: for samples that something else evens out.
    ///
    /// # Errors
    /// Those of [`sample`](crate::sample).
    pub fn sample_roughly(&self, options: Options<'_>, steps: usize) -> Result<Samples, Error> {
        self.sample_in_steps(options, Some(steps))
    }

    fn sample_in_steps(&self, options: Options<'_>, coarse_steps: Option<usize>) -> Result<Samples, Error> {
        check(self.surface, &self.bounds, &options)?;
        let seeds = match &self.found {
            Ok(seeds) => seeds,
            Err(nothing) => return Ok((**nothing).clone()),
        };
        let mut options = options;
        let mut run = Run::new(self.seed, options.progress.take());
        run.evaluations = self.evaluations;
        sample_from(self.surface, &self.bounds, &mut run, seeds, FEWEST_SEEDS, options, coarse_steps)
    }
}
