//! How large triangles are where: sampling for a mesh.

use isoswarm_field::vector::V3;
use isoswarm_field::{Aabb, Surface};
use isoswarm_particles as particles;
use isoswarm_particles::{Amount, Density, Error, Options, ProgressFn, Samples, Status};

use super::build::Resolution;

/// Turn of the normal from vertex to vertex (radians) up to which stars agree.
pub(super) const TURN: f64 = 0.7;
/// Where it is larger for more than one sample in so many, the sizes follow the curvature.
const FEW: usize = 2000;
/// Part of the vertices that may go where the surface bends more than the spacing allows.
const SHARE: f64 = 0.5;
/// Steps of samples that start from others.
const STEPS: usize = 10;
/// Samples that tell the curvature where a distance is asked for.
const PILOT: usize = 4000;
/// Area of a vertex' cell over the square of the distance to the nearest, on average.
pub(super) const CELL: f64 = 0.94;
/// Of the distance asked for, what sizes aim at.
const AIM: f64 = 0.8;
/// Largest spacing in lengths of the diagonal of the samples' box.
const WIDEST: f64 = 0.05;

/// Samples whose spacing suits a mesh.
pub(super) struct Sampled {
    pub(super) samples: Samples,
    /// Points at which the field was evaluated besides.
    pub(super) evaluations: u64,
    pub(super) warnings: Vec<String>,
}

/// Samples a surface as finely as asked, and finer where its curvature demands it.
pub(super) fn sample(
    surface: &dyn Surface,
    bounds: &Aabb,
    resolution: Resolution,
    density: Density<'_>,
    creases: bool,
    (seed, most): (u64, usize),
    progress: Option<&mut ProgressFn<'_>>,
) -> Result<Sampled, Error> {
    let amount = match resolution {
        Resolution::Count(n) => Amount::Count(n),
        Resolution::Spacing(s) => Amount::Spacing(s),
        Resolution::Error(e) if e > 0.0 && e.is_finite() => Amount::Count(PILOT),
        Resolution::Error(e) => {
            let (expected, given) = ("a positive, finite distance".into(), e.to_string());
            return Err(Error::Option { name: "error", expected, given });
        }
    };
    // The progress goes to the first run; the second, where there is one, starts from its result.
    let mut progress = progress;
    let mut tell = |p: &particles::Progress| match &mut progress {
        Some(f) => f(p),
        None => std::ops::ControlFlow::Continue(()),
    };
    let search: Option<particles::FindCreases> = creases.then_some(particles::creases::find);
    let first = particles::sample(
        surface,
        bounds,
        Options {
            amount,
            density,
            creases: search,
            more: true,
            seed,
            most,
            progress: Some(&mut tell),
            ..Options::default()
        },
    )?;
    let (mut warnings, mut resolution) = (Vec::new(), resolution);
    if let (Some(n), Resolution::Count(_) | Resolution::Spacing(_)) = (first.report.more, resolution) {
        warnings.push(format!(
            "the surface's edges would take more than half of the vertices asked for: about {n} were taken instead"
        ));
        resolution = Resolution::Count(n);
    }
    let mut out = Sampled { samples: first, evaluations: 0, warnings };
    let stopped =
        matches!(&out.samples.report.status, Status::NotConverged(_)) && out.samples.points.is_empty();
    if out.samples.points.is_empty() || stopped {
        return Ok(out);
    }
    let Some(plan) = Plan::new(&out.samples, resolution, &density)? else { return Ok(out) };
    out.warnings.extend(plan.warning());
    if plan.turn.is_some() {
        // Vertices that would not resolve it there are missed elsewhere.
        return Ok(out);
    }
    let sizes = |points: &[V3], result: &mut [f64]| plan.density(surface, points, result);
    let n = (plan.count.ceil() as usize).clamp(out.samples.report.components.max(12), most.max(1));
    if plan.count > most as f64 {
        return Err(Error::TooMany { estimate: plan.count, bytes: 300.0 * plan.count, limit: most });
    }
    let start = out.samples.points.clone();
    let second = particles::sample(
        surface,
        bounds,
        Options {
            amount: Amount::Count(n),
            density: Density::Function(&sizes),
            creases: search,
            more: true,
            // The curvature at a tip has no bound.
            even_creases: matches!(density, Density::Uniform),
            seed,
            most,
            start: Some(&start),
            // Smoothing evens out what is left.
            steps: Some(STEPS),
            progress: Some(&mut tell),
            ..Options::default()
        },
    )?;
    out.evaluations = out.samples.report.evaluations;
    out.samples = Samples {
        report: particles::Report { status: out.samples.report.status, ..second.report },
        ..second
    };
    Ok(out)
}

/// Vertices per area that keep a distance from the surface.
#[derive(Clone, Copy)]
pub(super) struct ErrorSizes {
    /// At least so many.
    base: f64,
    /// And so many times the curvature.
    factor: f64,
    /// And so many times its square.
    turning: f64,
}

impl ErrorSizes {
    /// For a distance (> 0) and the box around the surface.
    pub(super) fn new(most: f64, extent: &Aabb) -> Self {
        // The middle of an equilateral triangle of side h is κh²/6 off, that of an edge κh²/8.
        let factor = 1.0 / (CELL * 6.0 * AIM * most);
        Self { base: 1.0 / (CELL * (WIDEST * extent.diagonal()).powi(2)), factor, turning: 0.0 }
    }

    /// So many that a mesh with a `part`th of the vertices turns by no more than `turn` radians from vertex to vertex.
    pub(super) fn with_turn(self, turn: f64, part: f64) -> Self {
        Self { turning: part / (CELL * turn * turn), ..self }
    }

    /// At the points; the least where the curvature is not known.
    pub(super) fn density(
        &self,
        surface: &dyn Surface,
        points: &[V3],
        out: &mut [f64],
    ) -> Result<(), String> {
        self.of(&particles::principal_curvatures(surface, points), out);
        out.iter_mut().filter(|d| d.is_nan()).for_each(|d| *d = self.base);
        Ok(())
    }

    /// For the curvatures; NaN where they are not known.
    pub(super) fn of(&self, curvatures: &[[f64; 2]], out: &mut [f64]) {
        for (d, k) in out.iter_mut().zip(curvatures) {
            let bend = k[0].abs();
            let wanted = (self.factor * bend).max(self.turning * bend * bend);
            *d = if wanted.is_finite() { wanted.max(self.base) } else { f64::NAN };
        }
    }
}

/// Sizes from curvature.
struct Plan<'a> {
    density: Density<'a>,
    /// Vertices per area: so much times the density that was asked for,
    base: f64,
    /// or so much times a power of the curvature.
    factor: f64,
    /// The power: 1 for a distance, 2 for a turn of the normal.
    power: i32,
    /// Vertices it takes.
    count: f64,
    /// Part of the samples that bend too much.
    bent: f64,
    /// Turn from vertex to vertex, where it exceeds [`TURN`].
    turn: Option<f64>,
}

impl<'a> Plan<'a> {
    /// `None` where the samples will do.
    fn new(samples: &Samples, resolution: Resolution, density: &Density<'a>) -> Result<Option<Self>, Error> {
        let bend = |i: usize| samples.curvatures[i][0].abs();
        let known = |i: usize| bend(i).is_finite();
        let n = samples.points.len();
        if let Resolution::Error(e) = resolution {
            let extent = Aabb::around(&samples.points).unwrap_or(Aabb::new([0.0; 3], [1.0; 3]));
            let ErrorSizes { base, factor, .. } = ErrorSizes::new(e, &extent);
            let mut plan =
                Self { density: Density::Uniform, base, factor, power: 1, count: 0.0, bent: 0.0, turn: None };
            let least = plan.base;
            plan.count = (0..n)
                .map(|i| samples.areas[i] * if known(i) { least.max(factor * bend(i)) } else { least })
                .sum();
            return Ok(Some(plan));
        }
        if matches!(density, Density::Curvature) {
            return Ok(None);
        }
        let spacing = |i: usize| 2.0 * samples.radii[i];
        let bent = (0..n).filter(|&i| known(i) && bend(i) * spacing(i) > TURN).count();
        if bent * FEW <= n {
            return Ok(None);
        }
        let mut asked = vec![1.0; n];
        if let Density::Function(f) = density {
            f(&samples.points, &mut asked).map_err(|reason| Error::Density { reason })?;
        }
        // Vertices that a turn takes where it is the smaller, with the base in proportion.
        let total = match resolution {
            Resolution::Count(n) => n as f64,
            _ => f64::INFINITY,
        };
        let sum = |base: f64, factor: f64| -> f64 {
            let one = |i: usize| {
                samples.areas[i]
                    * (base * asked[i]).max(if known(i) { factor * bend(i).powi(2) } else { 0.0 })
            };
            (0..n).map(one).sum()
        };
        let mut turn = TURN;
        let mut base = n as f64 / (0..n).map(|i| samples.areas[i] * asked[i]).sum::<f64>();
        let factor = |turn: f64| 1.0 / (CELL * turn * turn);
        if total.is_finite() {
            let bending = sum(0.0, factor(turn));
            if bending > SHARE * total {
                turn *= (bending / (SHARE * total)).sqrt();
            }
            let (mut low, mut high) = (0.0, base);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if sum(middle, factor(turn)) > total { high = middle } else { low = middle }
            }
            base = high;
        }
        let count = if total.is_finite() { total } else { sum(base, factor(turn)) };
        let bent = bent as f64 / n as f64;
        let turn_off = (turn > 1.5 * TURN).then_some(turn);
        Ok(Some(Self {
            density: *density,
            base,
            factor: factor(turn),
            power: 2,
            count,
            bent,
            turn: turn_off,
        }))
    }

    fn warning(&self) -> Option<String> {
        let turn = self.turn?;
        Some(format!(
            "{:.1} % of the samples lie where the surface bends by more than {TURN} radians within their spacing, and would if half of \
             the vertices went there; about {:.0} vertices resolve it",
            100.0 * self.bent,
            self.count * (turn / TURN).powi(2),
        ))
    }

    fn density(&self, surface: &dyn Surface, points: &[V3], out: &mut [f64]) -> Result<(), String> {
        let asked = |out: &mut [f64]| -> Result<(), String> {
            match self.density {
                Density::Function(f) => f(points, out),
                _ => {
                    out.fill(1.0);
                    Ok(())
                }
            }
        };
        asked(out)?;
        let curvatures = particles::principal_curvatures(surface, points);
        for (d, k) in out.iter_mut().zip(curvatures) {
            let bend = k[0].abs();
            let wanted = if bend.is_finite() { self.factor * bend.powi(self.power) } else { 0.0 };
            *d = (self.base * *d).max(wanted);
        }
        Ok(())
    }
}
