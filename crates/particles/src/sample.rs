//! The main job: samples of a surface.

use isoswarm_field::{Aabb, Surface};

use crate::Error;
use crate::creases::{CreaseOptions, Creases, SizeFn};
use crate::edges::EdgeFloaters;
use crate::even::{self, Spread, Wish};
use crate::finish::{finish, project_exactly};
use crate::floaters::modes;
use crate::metrics::mean_nearest;
use crate::options::{Amount, Density, FindCreases, Method, Options, Phase};
use crate::population::census;
use crate::random;
use crate::report::{Samples, Status};
use crate::run::Run;
use crate::seeding::{self, Seeds};
use crate::sizing::Sizing;
use crate::vector::V3;

/// Memory of a run per floater in bytes, for estimates.
const BYTES: f64 = 300.0;
/// Uniform points wanted from the seeding, enough for the coarsest level: so many, or a part of the samples where those
/// are few.
const SEEDS: usize = 4000;
pub(crate) const FEWEST_SEEDS: usize = 1000;
/// Most samples on creases, for each that there is.
const SHARE: f64 = 0.5;
/// Searches for creases until they go with the number of samples.
const SEARCHES: usize = 3;
/// Seeds where there are creases.
const MANY_SEEDS: usize = 16_000;

/// Samples the part of the surface F = 0 that lies in `bounds` (finite corners, lo < hi on each of the surface's axes).
///
/// The result does not depend on the number of threads. A surface that is not there gives no samples and the status
/// [`Status::Empty`]; a run that does not reach its goal, or is stopped, gives what it has and
/// [`Status::NotConverged`].
///
/// # Errors
/// Options and bounds that make no sense, fewer samples than components, more than `most`, a density that is not one,
/// and whatever the field reports.
pub fn sample(surface: &dyn Surface, bounds: &Aabb, options: Options<'_>) -> Result<Samples, Error> {
    check(surface, bounds, &options)?;
    let mut options = options;
    let mut run = Run::new(options.seed, options.progress.take());
    run.tell(Phase::Seeding, 0.0, 0);
    let aim = if options.method == Method::Even { seeds_for(options.amount) } else { SEEDS };
    match look_for(surface, &mut run, bounds, aim, seeding::BOXES)? {
        Ok(seeds) => sample_from(surface, bounds, &mut run, &seeds, aim, options, None),
        Err(nothing) => Ok(*nothing),
    }
}

/// Even points, and nothing of what else is known of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Places {
    /// Those of [`sample`] (model units).
    pub points: Vec<[f64; 3]>,
    /// Mean distance between a point and its nearest neighbour (model units).
    pub spacing: f64,
}

/// The points that [`sample`] gives with these options and no others, for those who measure nothing: evenly placed, at most `most`,
/// settled in at most `steps` at full resolution. `None` where there is no surface.
///
/// # Errors
/// Those of [`sample`].
pub fn places(
    surface: &dyn Surface,
    bounds: &Aabb,
    amount: Amount,
    seed: u64,
    most: usize,
    steps: Option<usize>,
) -> Result<Option<Places>, Error> {
    check_bounds(surface, bounds)?;
    check_amount(amount, most)?;
    let mut run = Run::new(seed, None);
    let (Some(seeds), _) = seeding::seed(surface, &mut run, bounds, seeds_for(amount), seeding::BOXES)?
    else {
        return Ok(None);
    };
    let n = population(&seeds, amount, most)?;
    if n < seeds.components {
        return Err(Error::TooFew { n, components: seeds.components });
    }
    let wish = Wish {
        amount,
        n,
        density: Density::Uniform,
        edges: None,
        start: None,
        most_steps: steps,
        coarse_steps: None,
    };
    let Spread { mut swarm, unit, .. } = even::spread(&mut run, surface, &seeds, wish)?;
    project_exactly(&mut run, surface, &seeds, &mut swarm, unit)?;
    let spacing = mean_nearest(&census(&swarm, &seeds.walls, unit));
    Ok(Some(Places { points: swarm.points, spacing }))
}

/// Seeds to aim at for even samples.
fn seeds_for(amount: Amount) -> usize {
    match amount {
        Amount::Count(n) => (n / 4).clamp(FEWEST_SEEDS, SEEDS),
        Amount::Spacing(_) => SEEDS,
    }
}

/// Samples a surface that has been found, by seeds of which so many were aimed at. `coarse_steps`: of the method `even` at its coarsest
/// level, where fewer than usual will do.
pub(crate) fn sample_from(
    surface: &dyn Surface,
    bounds: &Aabb,
    run: &mut Run<'_>,
    seeds: &Seeds<'_>,
    aim: usize,
    options: Options<'_>,
    coarse_steps: Option<usize>,
) -> Result<Samples, Error> {
    let Options { amount, method, density, creases, more, even_creases, start, most, steps, .. } = options;
    run.tell(Phase::Seeding, 0.05, seeds.points.len());
    let n = population(seeds, amount, most)?;
    let creases = match creases.filter(|_| method == Method::Even) {
        Some(find) => {
            let most = if more { most } else { n };
            let all = seeds.uniform_swarm();
            let apart = even::spacing_for_count(seeds.area, all.len(), seeds.walls.axes);
            let varies = matches!(density, Density::Function(_)) && !even_creases;
            let density = if varies { density } else { Density::Uniform };
            let sizing = Sizing::new(density, surface, &all, apart, seeds.walls.axes)?.0;
            find_creases(find, surface, bounds, seeds, (amount, n, most), &sizing, run)?
        }
        None => None,
    };
    let (creases, raised) = match creases {
        Some(OnCreases { creases, n: taken }) => (Some(creases), (taken != n).then_some(taken)),
        None => (None, None),
    };
    let (amount, n) = raised.map_or((amount, n), |n| (Amount::Count(n), n));
    let many;
    let mut seeds = seeds;
    if creases.is_some() && aim < n.min(MANY_SEEDS) {
        // Between creases every part of the surface needs seeds of its own.
        many = match look_for(surface, run, bounds, n.min(MANY_SEEDS), seeding::BOXES)? {
            Ok(seeds) => seeds,
            Err(nothing) => return Ok(*nothing),
        };
        seeds = &many;
    }
    if method != Method::Random && n < seeds.components {
        return Err(Error::TooFew { n, components: seeds.components });
    }
    match method {
        Method::Even => {
            let edges = creases.as_ref().map(|c| EdgeFloaters::new(c, seeds));
            let wish =
                Wish { amount, n, density, edges: edges.as_ref(), start, most_steps: steps, coarse_steps };
            let Spread { swarm, unit, unmet } = even::spread(run, surface, seeds, wish)?;
            let status = unmet.map_or(Status::Converged, Status::NotConverged);
            let mut samples = finish(run, surface, seeds, swarm, unit, status, creases)?;
            samples.report.more = raised;
            verify(&mut samples, amount);
            Ok(samples)
        }
        Method::Random => random::scatter(run, surface, seeds, n, density),
        Method::Adaptive | Method::Simple | Method::Fissioning => {
            modes::run(run, surface, seeds, method, n, amount, steps.unwrap_or(modes::STEPS))
        }
    }
}

/// Looks for the surface; a result without samples where there is none or the search was stopped.
pub(crate) fn look_for<'s>(
    surface: &'s dyn Surface,
    run: &mut Run<'_>,
    bounds: &Aabb,
    aim: usize,
    fine: usize,
) -> Result<Result<Seeds<'s>, Box<Samples>>, Error> {
    match seeding::seed(surface, run, bounds, aim, fine) {
        Err(e) => match run.stop {
            Some(why) => {
                Ok(Err(Box::new(Samples::none(Status::NotConverged(why.reason().into()), false, run))))
            }
            None => Err(e.into()),
        },
        Ok((Some(seeds), _)) => Ok(Ok(seeds)),
        Ok((None, certified)) => Ok(Err(Box::new(Samples::none(Status::Empty, certified, run)))),
    }
}

/// Creases and the number of samples that they go with.
struct OnCreases {
    creases: Creases,
    n: usize,
}

/// The creases, with points at the distance that samples will have or a little more, no more than [`SHARE`] of the samples, whose number
/// is raised up to `most` for that. `None` where there are none, or too many.
fn find_creases(
    find: FindCreases,
    surface: &dyn Surface,
    bounds: &Aabb,
    seeds: &Seeds<'_>,
    (amount, asked, most): (Amount, usize, usize),
    sizing: &Sizing<'_>,
    run: &mut Run<'_>,
) -> Result<Option<OnCreases>, Error> {
    let spacing_for = |n: usize| even::spacing_for_count(seeds.area, n, seeds.walls.axes);
    let room = |n: usize| (SHARE * n.saturating_sub(seeds.components) as f64) as usize;
    let at = |points: &[V3], out: &mut [f64]| sizing.at(points, out);
    let sizes: Option<&SizeFn<'_>> = if sizing.is_uniform() { None } else { Some(&at) };
    let mut n = asked;
    // What is found depends a little on the spacing: at last what there is room for at all will do.
    for k in 1..=SEARCHES {
        let spacing = match amount {
            Amount::Spacing(s) if n == asked => s,
            _ => spacing_for(n),
        };
        let found = {
            let mut tell = |part: f64| run.tell(Phase::Seeding, 0.05 + 0.05 * part, 0);
            find(
                surface,
                bounds,
                CreaseOptions { most: room(n), sizes, ..CreaseOptions::new(spacing) },
                &mut tell,
            )?
        };
        let taken = found.points.len();
        let fit = taken <= room(n) || k == SEARCHES && taken + seeds.components < n;
        let widest = |n: usize| found.count(CreaseOptions::STRETCH * spacing_for(n));
        let needed = if fit { n } else { first(n, |n| widest(n) <= room(n)) };
        if fit || needed > most {
            run.warnings.extend(found.warnings.iter().cloned());
        }
        if fit {
            return Ok((taken > 0).then_some(OnCreases { creases: found, n }));
        }
        if needed > most {
            run.warnings.push(format!(
                "the surface's edges would take {} of the {n} samples, more than half: no samples were placed on them; ask for at \
                 least {needed}",
                found.count(spacing)
            ));
            return Ok(None);
        }
        n = needed;
    }
    Ok(None)
}

/// A number above `from` that is the first from which on something holds, but for gaps that are small beside it.
fn first(from: usize, holds: impl Fn(usize) -> bool) -> usize {
    let further = |n: usize| n + n / 4 + 1;
    let (mut low, mut high) = (from, further(from));
    while high < usize::MAX / 2 && !holds(high) {
        (low, high) = (high, further(high));
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// How many samples, to begin with where a spacing is asked for.
fn population(seeds: &Seeds<'_>, amount: Amount, most: usize) -> Result<usize, Error> {
    let estimate = match amount {
        Amount::Count(n) => n as f64,
        Amount::Spacing(s) => even::count_for_spacing(seeds.area, s, seeds.walls.axes),
    };
    if estimate > most as f64 {
        return Err(Error::TooMany { estimate, bytes: BYTES * estimate, limit: most });
    }
    Ok(match amount {
        Amount::Count(n) => n,
        Amount::Spacing(_) => (estimate.round() as usize).max(seeds.components),
    })
}

/// What evenness a result must have to pass for converged: well below what smooth surfaces reach (.95 and .03), and what is
/// left where there are creases or features finer than the spacing.
const POOR_AVERAGE: f64 = 0.85;
const POOR_VARIATION: f64 = 0.1;
/// What a sample may be off the surface, in spacings.
const INEXACT: f64 = 1e-3;
/// From so many samples on it must be a number, and from so many it counts.
const SEVERAL: usize = 12;
const MANY: usize = 100;

/// Marks what was not reached.
fn verify(samples: &mut Samples, amount: Amount) {
    let report = &mut samples.report;
    if report.status != Status::Converged {
        return;
    }
    if let Amount::Count(n) = amount
        && samples.points.len() != n
    {
        let got = samples.points.len();
        report.status = Status::NotConverged(format!(
            "{got} samples found room, {n} were asked for: check that the surface is larger than a point and does not lie in \
             a face of the bounds (enlarge them if it does)"
        ));
        return;
    }
    if !(report.max_error <= INEXACT * report.spacing || report.spacing == 0.0) {
        report.status = Status::NotConverged(format!(
            "a sample is {:.1e} off the surface: the surface is too thin or its gradient vanishes there; ask for more samples",
            report.max_error
        ));
        return;
    }
    let e = &report.evenness;
    let measured = [e.rho_min, e.rho_avg, e.cv].iter().all(|v| v.is_finite());
    if samples.points.len() >= SEVERAL && !measured {
        report.status = Status::NotConverged(
            "the evenness of the samples is not a number: the surface has next to no area in the bounds; enlarge them".into(),
        );
        return;
    }
    if samples.points.len() >= MANY && (e.rho_avg < POOR_AVERAGE || e.cv > POOR_VARIATION) {
        report.status = Status::NotConverged(format!(
            "the samples are uneven: their distances are {:.2} of the densest packing's on average and vary by {:.0} % \
             ({POOR_AVERAGE} and {:.0} % are the limits); where the surface has details finer than the spacing, ask for more \
             samples",
            e.rho_avg,
            100.0 * e.cv,
            100.0 * POOR_VARIATION,
        ));
    }
    let Amount::Spacing(wanted) = amount else { return };
    let off = report.spacing / wanted - 1.0;
    if off.abs() > 0.05 {
        report.status = Status::NotConverged(format!(
            "the mean distance between neighbours is {:.4e}, asked for {wanted:.4e}: \
             the surface has room for no other number of samples near it",
            report.spacing
        ));
    }
}

fn check_bounds(surface: &dyn Surface, bounds: &Aabb) -> Result<(), Error> {
    let fine = |a: usize| {
        bounds.lo[a].is_finite()
            && bounds.hi[a].is_finite()
            && bounds.lo[a] < bounds.hi[a]
            && (bounds.hi[a] - bounds.lo[a]).is_finite()
    };
    if !(0..surface.axes()).all(fine) {
        return Err(Error::Bounds { given: format!("{:?} to {:?}", bounds.lo, bounds.hi) });
    }
    Ok(())
}

fn wrong(name: &'static str, expected: &str, given: String) -> Result<(), Error> {
    Err(Error::Option { name, expected: expected.into(), given })
}

fn check_amount(amount: Amount, most: usize) -> Result<(), Error> {
    match amount {
        Amount::Count(0) => wrong("n", "at least 1", "0".into()),
        Amount::Count(n) if n > most => {
            Err(Error::TooMany { estimate: n as f64, bytes: BYTES * n as f64, limit: most })
        }
        Amount::Spacing(s) if !(s.is_finite() && s > 0.0) => {
            wrong("spacing", "a positive, finite length", s.to_string())
        }
        _ => Ok(()),
    }
}

pub(crate) fn check(surface: &dyn Surface, bounds: &Aabb, options: &Options<'_>) -> Result<(), Error> {
    check_bounds(surface, bounds)?;
    check_amount(options.amount, options.most)?;
    if let Some(start) = options.start {
        if let Some(p) = start.iter().find(|p| p.iter().any(|v| !v.is_finite())) {
            return wrong("start", "finite points", format!("{p:?}"));
        }
        if start.is_empty() {
            return wrong("start", "at least one point (leave it out to start afresh)", "none".into());
        }
        if options.method != Method::Even {
            return wrong("start", "the method `even`", format!("{:?}", options.method));
        }
    }
    Ok(())
}
