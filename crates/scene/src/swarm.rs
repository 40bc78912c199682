//! The floaters of a scene: how they are settled on a surface, and how they live on it.

use isoswarm_field::{Aabb, Field, Surface};
use isoswarm_particles::floaters::{Floaters, Parameters};
use isoswarm_particles::{self as particles, Options, Samples, places, sample};

use crate::settings::{Amount, Focus, Settings};
use crate::vector::{norm, sub, unit};
use crate::{Error, Scene};

/// With radii at σ̂ the mean distance to the nearest neighbour settles at this many σ̂.
const NEAREST: f64 = 1.72;
/// Radius of a floater at rest as a part of σ̂, so that new ones neither split nor shrink at once.
const AT_REST: f64 = 0.85;
/// A floater survives a sudden change if the surface is no farther than so many spacings.
const SURVIVAL: f64 = 2.0;
/// Floaters farther off than so many spacings are looked after.
const LOST: f64 = 1.0;
/// New floaters keep this many spacings from those that survive.
const APART: f64 = 0.75;

/// If more than this part of the floaters survives a change, new ones may not be needed.
const STAY: f64 = 0.9;
/// Spacing of a coarse look at the surface, as a part of its size.
const COARSE: f64 = 0.1;
/// Where curvature sets the density it stays within this factor of that in the middle.
const BENDS: f64 = 4.0;
/// What may be left out of the field while the surface moves under the floaters, in spacings: far less than a step moves it.
const SKETCHED: f64 = 3e-4;
/// A place on the surface without a floater within so many spacings has not been seen yet.
const UNSEEN: f64 = 4.0;

/// Floaters and what they aim at.
#[derive(Clone, Debug, Default)]
pub(crate) struct Swarm {
    pub(crate) floaters: Floaters,
    /// Mean distance between neighbours that they aim at (model units).
    pub(crate) spacing: f64,
    /// Diagonal of the box around them (model units).
    pub(crate) size: f64,
    /// Floaters that have split and that have died in steps.
    pub(crate) births: u64,
    pub(crate) deaths: u64,
}

impl Swarm {
    /// Floaters at known places, before they are settled.
    pub(crate) fn of(points: &[[f64; 3]], spacing: f64) -> Self {
        let floaters = Floaters::new(points, AT_REST * spacing / NEAREST);
        let mut swarm = Self { floaters, spacing, ..Self::default() };
        swarm.measure();
        swarm
    }

    /// Floaters for a surface: those of `self` that are near it stay, and where there are none new ones come.
    pub(crate) fn settled(
        &self,
        field: &Field,
        bounds: &Aabb,
        settings: &Settings,
    ) -> Result<Option<Self>, Error> {
        let aim = match settings.amount {
            Amount::Spacing(s) => s,
            Amount::Count(_) => self.spacing,
        };
        if aim > 0.0 && aim == self.spacing && !self.floaters.is_empty() {
            // Where most stay and a coarse look finds no place without any there is nothing more to do.
            let mut same = self.clone();
            same.floaters.retain_near(field, bounds, SURVIVAL * aim)?;
            let most = same.floaters.len() as f64 > STAY * self.floaters.len() as f64;
            if most && same.covers(field, bounds, settings.seed)? {
                same.measure();
                return Ok(Some(same));
            }
        }
        let amount = match settings.amount {
            Amount::Spacing(s) => particles::Amount::Spacing(s),
            Amount::Count(n) if self.spacing == 0.0 => particles::Amount::Count(n),
            Amount::Count(_) => particles::Amount::Spacing(self.spacing),
        };
        let Some(fresh) = places(field, bounds, amount, settings.seed, Settings::MOST, None)? else {
            return Ok(None);
        };
        let spacing = match settings.amount {
            Amount::Spacing(s) => s,
            Amount::Count(_) if self.spacing == 0.0 => fresh.spacing,
            Amount::Count(_) => self.spacing,
        };
        let mut next = Self { spacing, size: 0.0, ..self.clone() };
        let sigma = AT_REST * spacing / NEAREST;
        next.floaters.retain_near(field, bounds, SURVIVAL * spacing)?;
        next.floaters.admit(&fresh.points, APART * spacing, sigma);
        next.orient(field)?;
        next.measure();
        Ok(Some(next))
    }

    /// Normals for those that have come and have not taken a step yet.
    pub(crate) fn orient(&mut self, field: &Field) -> Result<(), Error> {
        let n = self.floaters.points.len();
        let (mut f, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
        Surface::value_gradient(field, &self.floaters.points, &mut f, &mut g)?;
        for (normal, g) in self.floaters.normals.iter_mut().zip(&g) {
            *normal = unit(*g).unwrap_or_default();
        }
        Ok(())
    }

    fn measure(&mut self) {
        self.size = Aabb::around(&self.floaters.points).map_or(0.0, |b| b.diagonal()).max(self.spacing);
    }

    /// Makes floaters smaller, and so more, near the points.
    pub(crate) fn look_at(&mut self, points: &[[f64; 3]], focus: Focus) {
        let size = |p: &[f64; 3]| {
            let d = points.iter().map(|q| norm(sub(*p, *q))).fold(f64::INFINITY, f64::min);
            // From the factor at the point to 1 at twice the radius, smoothly.
            let t = (0.25 * (d / focus.radius) * (d / focus.radius)).min(1.0);
            1.0 - (1.0 - focus.factor) * (1.0 - t) * (1.0 - t)
        };
        self.resize(size);
    }

    /// Makes each floater so many times as large in the next step.
    fn resize(&mut self, factor: impl Fn(&[f64; 3]) -> f64) {
        let floaters = &mut self.floaters;
        floaters.size.resize(floaters.points.len(), 1.0);
        floaters.size.iter_mut().zip(&floaters.points).for_each(|(size, p)| *size *= factor(p));
    }

    /// Makes floaters smaller, and so more, where the surface is curved more than in the middle of them, and larger where it is less.
    pub(crate) fn look_at_bends(&mut self, field: &Field, strength: f64) {
        let k = particles::principal_curvatures(field, &self.floaters.points);
        let squares: Vec<f64> = k.iter().map(|k| k[0] * k[0] + k[1] * k[1]).collect();
        // Creases and singular points, where it is undefined, count as ordinary ones.
        let mut known: Vec<f64> = squares.iter().copied().filter(|s| s.is_finite()).collect();
        let Some(median) = isoswarm_field::arrange::median(&mut known) else { return };
        let relative = |s: f64| if s.is_finite() && median > 0.0 { s / median } else { 1.0 };
        let size = |s: &f64| 1.0 / relative(*s).clamp(1.0 / BENDS, BENDS).sqrt();
        self.floaters.size.resize(squares.len(), 1.0);
        for (own, s) in self.floaters.size.iter_mut().zip(&squares) {
            *own *= 1.0 + strength * (size(s) - 1.0);
        }
    }

    /// Whether there are floaters wherever a coarse look finds the surface: a part of it may be new.
    pub(crate) fn covers(&self, field: &Field, bounds: &Aabb, seed: u64) -> Result<bool, Error> {
        let coarse = (COARSE * self.size).max(self.spacing);
        let amount = particles::Amount::Spacing(coarse);
        let look = places(field, bounds, amount, seed, Settings::MOST, Some(1))?;
        let mut floaters = self.floaters.clone();
        floaters.admit(look.as_ref().map_or(&[], |l| &l.points), UNSEEN * self.spacing, self.spacing);
        Ok(floaters.len() == self.floaters.len())
    }

    /// Moves the floaters along with the surface F = 0, before the change of its parameters, as if painted on it; see
    /// [`particles::surface_velocity`]. No farther along the surface than it moves anywhere: where it is nearly flat normals say little.
    pub(crate) fn follow(&mut self, field: &Field, change: &[f64]) -> Result<(), Error> {
        if field.axes() != 3 || change.iter().all(|c| *c == 0.0) {
            return Ok(());
        }
        let points = &mut self.floaters.points;
        let n = points.len();
        let velocity = particles::surface_velocity(field, points, change, [0.0; 3])?;
        let (mut f, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
        Surface::value_gradient(field, points, &mut f, &mut g)?;
        let across = |v: &[f64; 3], g: &[f64; 3]| {
            let n = unit(*g).unwrap_or_default();
            let s = isoswarm_field::vector::dot(*v, n);
            [0, 1, 2].map(|a| s * n[a])
        };
        let normal: Vec<[f64; 3]> = velocity.iter().zip(&g).map(|(v, g)| across(v, g)).collect();
        let most = normal.iter().map(|v| norm(*v)).fold(0.0, f64::max);
        for ((p, v), n) in points.iter_mut().zip(&velocity).zip(&normal) {
            let along = sub(*v, *n);
            let part = (most / norm(along).max(f64::MIN_POSITIVE)).min(1.0);
            *p = [0, 1, 2].map(|a| p[a] + n[a] + part * along[a]);
        }
        Ok(())
    }

    /// One step on the surface as it is now. While it is `moving`, floaters are led by a sketch of the field where there is one. False
    /// where no floater is left on it.
    pub(crate) fn step(
        &mut self,
        field: &Field,
        bounds: &Aabb,
        seed: u64,
        moving: bool,
    ) -> Result<bool, Error> {
        let most = Settings::MOST;
        let parameters = Parameters { most, ..Parameters::live(self.size, self.spacing / NEAREST) };
        let sketch = if moving { field.sketch(SKETCHED * self.spacing) } else { None };
        let surface = sketch.as_deref().unwrap_or(field);
        let happened = self.floaters.step(surface, bounds, &[], &parameters, seed, &mut 0)?;
        self.births += happened.births as u64;
        self.deaths += happened.deaths as u64;
        if self.floaters.off > LOST * self.spacing {
            // The surface has run away from some, or a part of it is gone.
            let mut rest = self.floaters.clone();
            rest.retain_near(field, bounds, SURVIVAL * self.spacing)?;
            if rest.is_empty() {
                return Ok(false);
            }
            self.floaters = rest;
        }
        Ok(true)
    }
}

/// The box that clips the surface.
pub(crate) fn bounds_of(field: &Field, settings: &Settings) -> Result<Aabb, Error> {
    if let Some([lo, hi]) = settings.bounds {
        return Ok(Aabb::new(lo, hi));
    }
    let found = field.bounds().ok_or(Error::Unbounded)?;
    Ok(found.grown(0.05 * found.diagonal()))
}

impl Scene {
    /// Even samples of the surface as it is now, started from the floaters: exactly as many as `n`, or with the scene's
    /// spacing. See [`isoswarm_particles::sample`].
    pub fn samples(&self, n: Option<usize>) -> Result<Samples, Error> {
        let swarm = &self.now.swarm;
        let amount = match n {
            Some(n) => particles::Amount::Count(n),
            None => particles::Amount::Spacing(swarm.spacing),
        };
        let options = Options {
            amount,
            seed: self.now.state.settings.seed,
            start: Some(&swarm.floaters.points),
            most: Settings::MOST,
            ..Options::default()
        };
        Ok(sample(&self.now.state.field, &self.now.state.bounds, options)?)
    }
}
