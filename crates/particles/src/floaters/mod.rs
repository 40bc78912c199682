//! The floaters of Witkin and Heckbert, "Using Particles to Sample and Control Implicit Surfaces" (SIGGRAPH '94),
//! sections 3.3, 4 and 5, in full.
//!
//! Printed forms that do not work as they stand are corrected: β is 2.5/σ^i (the printed 10 has a unit), the
//! self term is left out of all sums, children are displaced by ±½σ and projected, radii are held below σ^max, and a
//! Newton step follows Euler's, so that φΔt need not be small.

mod forces;
pub mod modes;

use isoswarm_field::{Aabb, Surface};
use rayon::prelude::*;

use crate::Error;
use crate::constraint::{CHUNK, Target, Walls, evaluate, floater_velocity, project, within};
use crate::neighbors::Grid;
use crate::rng::{Rng, Stream};
use crate::vector::{V3, add, along, dot, norm, scale, sub, unit};
use forces::{Force, Kept, forces};

/// The constants of WH94 section 5; lengths in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Δt, time step.
    pub dt: f64,
    /// φ, feedback that keeps floaters on the surface (1/time).
    pub phi: f64,
    /// ρ, feedback that keeps floaters energised (1/time).
    pub rho: f64,
    /// α, repulsion amplitude.
    pub alpha: f64,
    /// Ê, desired energy.
    pub e_hat: f64,
    /// β times σ^i, which prevents division by zero in eq. 12; WH94 prints β = 10 for one size of surface.
    pub beta_sigma: f64,
    /// σ̂, desired repulsion radius.
    pub sigma_hat: f64,
    /// σ^max, largest repulsion radius.
    pub sigma_max: f64,
    /// γ, speed in σ^i below which a floater is near equilibrium.
    pub gamma: f64,
    /// ν, part of Ê that a floater must have to split.
    pub nu: f64,
    /// δ, part of σ̂ below which a floater may die.
    pub delta: f64,
    /// Whether radii adapt (section 4.3) and floaters split and die (section 4.4); otherwise σ^i stays as it is.
    pub adaptive: bool,
    /// From so many floaters on none splits: however large the surface grows, memory does not run out. 20 million by default.
    pub most: usize,
}

impl Parameters {
    /// WH94's for a surface of the given diameter: σ^max = max(d/2, 1.5 σ̂).
    pub fn new(diameter: f64, sigma_hat: f64) -> Self {
        Self {
            dt: 0.03,
            phi: 15.0,
            rho: 15.0,
            alpha: 6.0,
            e_hat: 0.8 * 6.0,
            beta_sigma: 2.5,
            sigma_hat,
            sigma_max: (diameter / 2.0).max(1.5 * sigma_hat),
            gamma: 4.0,
            nu: 0.2,
            delta: 0.7,
            adaptive: true,
            most: 20_000_000,
        }
    }
}

impl Parameters {
    /// For floaters on a surface that moves, where a step must bring as much as it can: feedback is a whole Newton step
    /// (φΔt = 1), Δt and γ are larger. A cylinder that is stretched fourfold in ten steps is evenly covered after thirty more
    /// steps (CV .07) instead of fifty; at rest nothing is born and nothing dies.
    pub fn live(diameter: f64, sigma_hat: f64) -> Self {
        let dt = 0.05;
        Self { dt, phi: 1.0 / dt, gamma: 5.0, ..Self::new(diameter, sigma_hat) }
    }
}

/// One floater per row.
#[derive(Clone, Debug, Default)]
pub struct Floaters {
    /// Positions p^i.
    pub points: Vec<[f64; 3]>,
    /// Unit normals, zero where the gradient vanishes.
    pub normals: Vec<[f64; 3]>,
    /// Repulsion radii σ^i.
    pub sigma: Vec<f64>,
    /// Velocities of the last step.
    pub velocity: Vec<[f64; 3]>,
    /// Energies D^i of the last step.
    pub energy: Vec<f64>,
    /// Stable identities: never used twice.
    pub id: Vec<u64>,
    /// Desired radius of each in the next step, as a part of σ̂: a density. Empty: 1 for all. A step empties it.
    pub size: Vec<f64>,
    /// Largest distance |F|/|∇F| at the beginning of the last step (model units); infinite if F was not finite somewhere.
    pub off: f64,
    next_id: u64,
    steps: u64,
    /// Normals at the beginning of the last step.
    facing: Vec<[f64; 3]>,
    /// Steps for which each still counts as one on a crease.
    crease: Vec<u8>,
    /// Who is near whom; made when needed.
    kept: Option<Kept>,
}

impl PartialEq for Floaters {
    fn eq(&self, other: &Self) -> bool {
        let columns = |f: &Self| (f.next_id, f.steps, f.id == other.id, f.points == other.points);
        columns(self) == columns(other)
            && self.normals == other.normals
            && self.sigma == other.sigma
            && self.velocity == other.velocity
            && self.energy == other.energy
            && self.size == other.size
    }
}

/// A step of more than this part of the radius is followed by Newton steps.
const FAR_STEP: f64 = 0.1;

/// A floater whose normal turns by more than this (its cosine) in a step of less than its radius lies on a crease,
const SHARP: f64 = 0.5;
/// and counts as one that does for so many steps.
const CREASE_STEPS: u8 = 32;

/// A floater after a step.
struct Moved {
    point: V3,
    velocity: V3,
    sigma: f64,
    /// |F|/|∇F| before it.
    off: f64,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Happened {
    /// Floaters that split.
    pub births: usize,
    /// Floaters that died.
    pub deaths: usize,
}

impl Floaters {
    /// Floaters at the points with one radius for all.
    pub fn new(points: &[[f64; 3]], sigma: f64) -> Self {
        let n = points.len();
        Self {
            points: points.to_vec(),
            normals: vec![[0.0; 3]; n],
            sigma: vec![sigma; n],
            velocity: vec![[0.0; 3]; n],
            energy: vec![0.0; n],
            id: (0..n as u64).collect(),
            size: Vec::new(),
            off: 0.0,
            next_id: n as u64,
            steps: 0,
            facing: vec![[0.0; 3]; n],
            crease: vec![0; n],
            kept: None,
        }
    }

    /// σ̂ of one floater.
    fn desired_radius(&self, i: usize, p: &Parameters) -> f64 {
        p.sigma_hat * self.size.get(i).copied().unwrap_or(1.0)
    }

    /// Number of floaters.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// One differential step in the order of WH94 section 5 (control points, which come first there, are not here).
    ///
    /// `motion` is (∂F/∂q)·q̇ at each floater while the surface moves, or empty. `bounds` clip the surface: their
    /// faces are constraints. `evaluations` is increased by the number of points at which F is evaluated.
    ///
    /// # Errors
    /// What the field reports.
    pub fn step(
        &mut self,
        surface: &dyn Surface,
        bounds: &Aabb,
        motion: &[f64],
        parameters: &Parameters,
        seed: u64,
        evaluations: &mut u64,
    ) -> Result<Happened, Error> {
        let walls = Walls::new(bounds, surface.axes());
        let p = parameters;
        let (mut value, mut gradient) = (Vec::new(), Vec::new());
        evaluate(surface, evaluations, &self.points, &mut value, &mut gradient)?;
        let sheets = self.turn(&gradient, p.dt);
        let length: Vec<f64> = gradient.iter().map(|&g| norm(g)).collect();
        let least = 1e-9 * mean(&length);

        // Repulsion forces between floaters set their desired velocities P^i (eq. 9).
        let force = forces(&self.points, &sheets, &self.sigma, p.alpha, &mut self.kept);

        // Actual velocities, constrained by the surface and its motion (eq. 5); changes of the repulsion radii (eqs. 12, 10 and 13);
        // Euler's method for both.
        let each = (0..self.len()).into_par_iter().with_min_len(CHUNK);
        let moved: Vec<Moved> = each
            .map(|i| {
                let moving = motion.get(i).copied().unwrap_or(0.0);
                self.moved(i, &walls, p, (value[i], gradient[i], length[i], moving), least, &force[i])
            })
            .collect();
        self.off = 0.0;
        for (i, m) in moved.into_iter().enumerate() {
            self.off = if m.off.is_nan() { f64::INFINITY } else { self.off.max(m.off) };
            (self.points[i], self.velocity[i], self.sigma[i]) = (m.point, m.velocity, m.sigma);
            self.energy[i] = force[i].energy;
        }
        self.project(surface, &walls, p, least, evaluations)?;
        let happened = if p.adaptive {
            self.fission_and_death(surface, &walls, p, seed, least, evaluations)?
        } else {
            Happened::default()
        };
        self.steps += 1;
        self.size.clear();
        Ok(happened)
    }

    /// Where a floater goes. Where the gradient vanishes the surface is ill-defined and it rests. A step does not exceed σ̂ or σ^i,
    /// whichever is larger.
    fn moved(
        &self,
        i: usize,
        walls: &Walls,
        p: &Parameters,
        (value, gradient, length, moving): (f64, V3, f64, f64),
        least: f64,
        force: &Force,
    ) -> Moved {
        let off = value.abs() / length;
        let off = if value.is_finite() && !off.is_finite() { 0.0 } else { off };
        let desired = walls.slide(self.points[i], self.normals[i], force.desired);
        let v = floater_velocity(desired, value, gradient, moving, p.phi, least);
        let (fastest, square) = (self.desired_radius(i, p).max(self.sigma[i]) / p.dt, dot(v, v));
        let velocity = if square > fastest * fastest { scale(v, fastest / square.sqrt()) } else { v };
        let point = walls.clamp(along(self.points[i], p.dt, velocity));
        let mut sigma = self.sigma[i];
        if p.adaptive {
            // Not to less than half in a step, and never beyond σ^max.
            let rate = radius_rate(force, sigma, p);
            sigma = within(sigma + p.dt * rate, 0.5 * sigma, p.sigma_max);
        }
        Moved { point, velocity, sigma, off }
    }

    /// Takes the normals over, and gives those by which floaters tell who is on their sheet: none, which means all sheets, for those
    /// that lie on a crease.
    ///
    /// What pushes a floater on a face towards a sharp edge pushes it over, onto the other face, where the others push it back: it
    /// stays at the edge, and its normal is now that of the one face, now that of the other. If it counted for one face at
    /// a time, the energies of all around it would change from step to step, and births and deaths would never cease.
    fn turn(&mut self, gradient: &[V3], dt: f64) -> Vec<V3> {
        let mut came = false;
        for (i, &g) in gradient.iter().enumerate() {
            let (old, new) = (self.facing[i], unit(g));
            let sharp = old != [0.0; 3]
                && new != [0.0; 3]
                && dot(old, new) < SHARP
                && norm(self.velocity[i]) * dt < self.sigma[i];
            came |= sharp && self.crease[i] == 0;
            self.crease[i] = if sharp { CREASE_STEPS } else { self.crease[i].saturating_sub(1) };
            (self.normals[i], self.facing[i]) = (new, new);
        }
        if came {
            self.kept = None;
        }
        let on = |(n, left): (&V3, &u8)| if *left > 0 { [0.0; 3] } else { *n };
        self.normals.iter().zip(&self.crease).map(on).collect()
    }

    /// Newton steps after Euler's. Where the feedback was a whole Newton step itself (φΔt = 1), only those that have moved so far
    /// that the surface may have curved away: the others are corrected by the next step's feedback.
    fn project(
        &mut self,
        surface: &dyn Surface,
        walls: &Walls,
        p: &Parameters,
        least: f64,
        evaluations: &mut u64,
    ) -> Result<(), Error> {
        let target = Target {
            tolerance: 1e-4 * p.sigma_hat,
            longest: p.sigma_max.min(4.0 * p.sigma_hat),
            least,
            rounds: 3,
        };
        if (p.phi * p.dt - 1.0).abs() > 1e-9 {
            project(surface, evaluations, walls, &mut self.points, &mut self.normals, target)?;
            return Ok(());
        }
        let far = |&i: &usize| {
            let (v, allowed) = (self.velocity[i], FAR_STEP / p.dt * self.sigma[i]);
            dot(v, v) > allowed * allowed
        };
        let movers: Vec<usize> = (0..self.len()).filter(far).collect();
        if movers.is_empty() {
            return Ok(());
        }
        let mut points: Vec<V3> = movers.iter().map(|&i| self.points[i]).collect();
        let mut normals: Vec<V3> = movers.iter().map(|&i| self.normals[i]).collect();
        project(surface, evaluations, walls, &mut points, &mut normals, target)?;
        for (k, &i) in movers.iter().enumerate() {
            (self.points[i], self.normals[i]) = (points[k], normals[k]);
        }
        Ok(())
    }

    /// Tests each floater for fission and death (section 4.4).
    fn fission_and_death(
        &mut self,
        surface: &dyn Surface,
        walls: &Walls,
        p: &Parameters,
        seed: u64,
        least: f64,
        evaluations: &mut u64,
    ) -> Result<Happened, Error> {
        let close = |i: usize| {
            let (s, wanted) = (self.sigma[i], self.desired_radius(i, p));
            s < p.delta * wanted || s > wanted || s >= p.sigma_max
        };
        if !(0..self.len()).any(close) {
            return Ok(Happened::default());
        }
        let chance = Rng::new(seed, Stream::Death).child(self.steps);
        let way = Rng::new(seed, Stream::Fission).child(self.steps);
        let (mut next, mut children) = (Self { next_id: self.next_id, ..Self::default() }, Vec::new());
        let mut happened = Happened::default();
        for i in 0..self.len() {
            let (sigma, wanted) = (self.sigma[i], self.desired_radius(i, p));
            let still = norm(self.velocity[i]) < p.gamma * sigma;
            let huge = sigma >= p.sigma_max;
            let ripe = self.energy[i] > p.nu * p.e_hat && sigma > wanted;
            let small = sigma < p.delta * wanted;
            if still && (huge || ripe) && self.len() + happened.births < p.most {
                // Both children get σ/√2 and lie ±½σ from their parent in a random tangential direction.
                let direction = way.direction(self.id[i], walls.axes);
                let tangent = unit(walls.slide(self.points[i], self.normals[i], direction));
                let offset = scale(tangent, (0.5 * sigma).min(p.sigma_hat));
                for place in [add(self.points[i], offset), sub(self.points[i], offset)] {
                    let id = next.next_id;
                    next.next_id += 1;
                    children.push(next.len());
                    next.push(
                        walls.clamp(place),
                        self.normals[i],
                        sigma / std::f64::consts::SQRT_2,
                        self.energy[i],
                        id,
                    );
                }
                happened.births += 1;
            } else if still
                && small
                && self.len() - happened.deaths > 1
                && chance.unit(self.id[i]) > sigma / (p.delta * wanted)
            {
                happened.deaths += 1;
            } else {
                next.push(self.points[i], self.normals[i], sigma, self.energy[i], self.id[i]);
                *next.velocity.last_mut().expect("pushed above") = self.velocity[i];
                *next.facing.last_mut().expect("pushed above") = self.facing[i];
                *next.crease.last_mut().expect("pushed above") = self.crease[i];
            }
        }
        let mut points: Vec<V3> = children.iter().map(|&k| next.points[k]).collect();
        let mut normals: Vec<V3> = children.iter().map(|&k| next.normals[k]).collect();
        let target = Target { tolerance: 1e-4 * p.sigma_hat, longest: p.sigma_hat, least, rounds: 4 };
        project(surface, evaluations, walls, &mut points, &mut normals, target)?;
        for (k, &at) in children.iter().enumerate() {
            next.points[at] = points[k];
            next.normals[at] = normals[k];
        }
        (next.steps, next.off) = (self.steps, self.off);
        if happened == Happened::default() {
            next.kept = self.kept.take();
        }
        *self = next;
        Ok(happened)
    }

    /// Keeps the floaters that are within `distance` of the surface (on it from then on), after it has changed suddenly.
    /// `bounds` clip it.
    pub fn retain_near(&mut self, surface: &dyn Surface, bounds: &Aabb, distance: f64) -> Result<(), Error> {
        let walls = Walls::new(bounds, surface.axes());
        let mut points: Vec<V3> = self.points.iter().map(|&p| walls.clamp(p)).collect();
        let mut normals = self.normals.clone();
        let target = Target { tolerance: 1e-6 * distance, longest: distance, least: 0.0, rounds: 12 };
        let left = project(surface, &mut 0, &walls, &mut points, &mut normals, target)?;
        let mut next = Self { next_id: self.next_id, steps: self.steps, ..Self::default() };
        for i in 0..self.len() {
            let near = left[i] <= 1e-3 * distance && norm(sub(points[i], self.points[i])) <= distance;
            if near {
                next.push(points[i], normals[i], self.sigma[i], self.energy[i], self.id[i]);
            }
        }
        *self = next;
        Ok(())
    }

    /// Adds those of the points that are farther than `apart` from all floaters there are, with radius `sigma`.
    pub fn admit(&mut self, points: &[[f64; 3]], apart: f64, sigma: f64) {
        let present = self.points.clone();
        let grid = Grid::new(&present, None, apart);
        for &p in points {
            let mut free = true;
            grid.near(p, apart, |j| free &= norm(sub(p, present[j as usize])) > apart);
            if free {
                self.kept = None;
                let id = self.next_id;
                self.next_id += 1;
                self.push(p, [0.0; 3], sigma, 0.0, id);
            }
        }
    }

    /// Global fissioning (section 4.2): every floater splits and all radii shrink by √2.
    pub fn split_all(&mut self, bounds: &Aabb, axes: usize, seed: u64) {
        let walls = Walls::new(bounds, axes);
        let way = Rng::new(seed, Stream::Fission).child(self.steps);
        let mut next = Self { next_id: self.next_id, steps: self.steps, ..Self::default() };
        for i in 0..self.len() {
            let direction = way.direction(self.id[i], axes);
            let tangent = unit(walls.slide(self.points[i], self.normals[i], direction));
            let offset = scale(tangent, 0.5 * self.sigma[i]);
            for place in [add(self.points[i], offset), sub(self.points[i], offset)] {
                let id = next.next_id;
                next.next_id += 1;
                let shrink = if axes == 2 { 2.0 } else { std::f64::consts::SQRT_2 };
                next.push(walls.clamp(place), self.normals[i], self.sigma[i] / shrink, 0.0, id);
            }
        }
        *self = next;
    }

    fn push(&mut self, point: V3, normal: V3, sigma: f64, energy: f64, id: u64) {
        self.points.push(point);
        self.normals.push(normal);
        self.sigma.push(sigma);
        self.velocity.push([0.0; 3]);
        self.energy.push(energy);
        self.facing.push([0.0; 3]);
        self.crease.push(0);
        self.id.push(id);
    }
}

/// σ̇^i (eq. 12), from Ḋ^i = -ρ (D^i - Ê) (eq. 10) and ∂D^i/∂σ^i (eq. 13).
fn radius_rate(force: &Force, sigma: f64, p: &Parameters) -> f64 {
    let d_rate = -p.rho * (force.energy - p.e_hat);
    d_rate / (force.energy_by_sigma + p.beta_sigma / sigma)
}

/// The mean of those that are finite, over all.
fn mean(length: &[f64]) -> f64 {
    length.iter().filter(|l| l.is_finite()).sum::<f64>() / length.len().max(1) as f64
}
