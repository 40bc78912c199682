//! Spreading floaters whose number is fixed: Gaussian repulsion (WH94 section 4.1) with a heavy ball, projected.
//!
//! One step evaluates the field once a floater. All lengths are multiples of σ, so that a run is the same at every
//! scale; the constants were measured on spheres, tori, blobs and gyroids of 500 to 100,000 floaters.

use isoswarm_field::{FieldError, Surface};
use pulp::Arch;
use rayon::prelude::*;

use crate::constraint::{CHUNK, Walls, evaluate};
use crate::kernel::gauss;
use crate::neighbors::Neighbors;
use crate::swarm::Swarm;
use crate::vector::{V3, add, distance, norm, scale, sub, unit};

/// Repulsion ends at this many σ: at 3 it stalls, beyond 4 it costs more than it brings.
const CUTOFF: f64 = 4.0;
/// Lists are drawn this many σ wider, so that they serve several steps.
const SKIN: f64 = 0.6;
/// Longest displacement of a step in σ.
const LONGEST: f64 = 0.3;
/// Motion in σ after which the field is narrowed anew.
const NARROW: f64 = 2.0;

/// What one step did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moved {
    /// Root mean square of the displacements, in σ.
    pub(crate) rms: f64,
    /// Largest displacement (length).
    pub(crate) most: f64,
}

/// A swarm that is being spread over a surface.
pub(crate) struct Relaxation<'s> {
    surface: &'s dyn Surface,
    narrowed: Option<Box<dyn Surface + 's>>,
    walls: Walls,
    /// Gradients up to this length count as zero.
    least: f64,
    /// Radius of repulsion of a floater of size 1.
    sigma: f64,
    /// Displacement per force.
    gain: f64,
    /// Part of the last displacement that is kept: the heavy ball.
    momentum: f64,
    pub(crate) swarm: Swarm,
    /// Σ exp(-r²/2σ²) over the neighbours at the start of the last step.
    pub(crate) energy: Vec<f64>,
    pub(crate) evaluations: u64,
    lists: Neighbors,
    moved_since_lists: f64,
    moved_since_narrowing: f64,
    next: Vec<V3>,
    value: Vec<f64>,
    gradient: Vec<V3>,
}

impl<'s> Relaxation<'s> {
    pub(crate) fn new(surface: &'s dyn Surface, walls: Walls, swarm: Swarm, least: f64) -> Self {
        Self {
            surface,
            narrowed: None,
            walls,
            least,
            sigma: 1.0,
            gain: 0.0,
            momentum: 0.0,
            swarm,
            energy: Vec::new(),
            evaluations: 0,
            lists: Neighbors::default(),
            moved_since_lists: f64::INFINITY,
            moved_since_narrowing: f64::INFINITY,
            next: Vec::new(),
            value: Vec::new(),
            gradient: Vec::new(),
        }
    }

    /// Changes the population: everything derived from it is forgotten.
    pub(crate) fn populate(&mut self, swarm: Swarm) {
        self.swarm = swarm;
        self.moved_since_lists = f64::INFINITY;
        self.moved_since_narrowing = f64::INFINITY;
    }

    /// Changes the radius of repulsion (length), the gain and the momentum of the steps to come.
    pub(crate) fn tune(&mut self, sigma: f64, gain: f64, momentum: f64) {
        (self.sigma, self.gain, self.momentum) = (sigma, gain, momentum);
        self.moved_since_lists = f64::INFINITY;
    }

    /// The present neighbours: all within 4 σ and a little more.
    pub(crate) fn lists(&mut self) -> &Neighbors {
        let least_size = self.swarm.size.iter().fold(1.0f64, |m, &s| m.min(s));
        if 2.0 * self.moved_since_lists > SKIN * self.sigma * least_size {
            self.lists = self.swarm.neighbors((CUTOFF + SKIN) * self.sigma);
            self.moved_since_lists = 0.0;
        }
        &self.lists
    }

    /// One step: forces, displacements in the tangent plane, one Newton step back to the surface.
    pub(crate) fn step(&mut self) -> Result<Moved, FieldError> {
        let n = self.swarm.len();
        if n == 0 {
            return Ok(Moved::default());
        }
        self.lists();
        self.next.resize(n, [0.0; 3]);
        self.energy.resize(n, 0.0);
        self.displace();
        if self.moved_since_narrowing > NARROW * self.sigma {
            self.narrowed = self.surface.narrowed(&self.swarm.points, (NARROW + LONGEST) * self.sigma)?;
            self.moved_since_narrowing = 0.0;
        }
        let surface = self.narrowed.as_deref().unwrap_or(self.surface);
        evaluate(surface, &mut self.evaluations, &self.next, &mut self.value, &mut self.gradient)?;
        let moved = self.settle();
        std::mem::swap(&mut self.swarm.points, &mut self.next);
        self.moved_since_lists += moved.most;
        self.moved_since_narrowing += moved.most;
        Ok(moved)
    }

    /// Forces from the present positions; displaced positions into `next`.
    fn displace(&mut self) {
        let Self { walls, sigma, swarm, energy, lists, next, gain, momentum, .. } = self;
        let (gain, momentum) = (*gain, *momentum);
        let Swarm { points, normals, velocity, size, .. } = swarm;
        let (points, normals, size, sigma) = (&points[..], &normals[..], &size[..], *sigma);
        let arch = Arch::new();
        next.par_chunks_mut(CHUNK)
            .zip(velocity.par_chunks_mut(CHUNK))
            .zip(energy.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(c, ((next, velocity), energy))| {
                arch.dispatch(Displace {
                    gain,
                    momentum,
                    first: c * CHUNK,
                    points,
                    normals,
                    size,
                    sigma,
                    lists,
                    walls,
                    next,
                    velocity,
                    energy,
                });
            });
    }

    /// Newton-corrects `next`, takes the new normals and measures the motion.
    fn settle(&mut self) -> Moved {
        let Self { walls, least, sigma, swarm, next, value, gradient, .. } = self;
        let (walls, least, sigma) = (*walls, *least, *sigma);
        let points = &swarm.points[..];
        let size = &swarm.size[..];
        let parts: Vec<(f64, f64)> = next
            .par_chunks_mut(CHUNK)
            .zip(swarm.normals.par_chunks_mut(CHUNK))
            .zip(swarm.velocity.par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(c, ((next, normals), velocity))| {
                let (mut square, mut most) = (0.0, 0.0f64);
                for k in 0..next.len() {
                    let i = c * CHUNK + k;
                    let own = sigma * if size.is_empty() { 1.0 } else { size[i] };
                    match walls.newton(next[k], value[i], gradient[i], LONGEST * own, least) {
                        Some(q) => {
                            next[k] = q;
                            normals[k] = unit(gradient[i]);
                        }
                        // Where the surface is ill-defined the floater rests (WH94 section 5).
                        None => {
                            next[k] = points[i];
                            velocity[k] = [0.0; 3];
                        }
                    }
                    let d = distance(next[k], points[i]);
                    square += (d / own) * (d / own);
                    most = most.max(d);
                }
                (square, most)
            })
            .collect();
        let square: f64 = parts.iter().map(|p| p.0).sum();
        let most = parts.iter().fold(0.0f64, |m, p| m.max(p.1));
        Moved { rms: (square / points.len() as f64).sqrt(), most }
    }

    /// Forgets the momentum.
    pub(crate) fn rest(&mut self) {
        self.swarm.velocity.iter_mut().for_each(|v| *v = [0.0; 3]);
    }
}

/// One task of [`Relaxation::displace`].
struct Displace<'a> {
    first: usize,
    gain: f64,
    momentum: f64,
    points: &'a [V3],
    normals: &'a [V3],
    size: &'a [f64],
    sigma: f64,
    lists: &'a Neighbors,
    walls: &'a Walls,
    next: &'a mut [V3],
    velocity: &'a mut [V3],
    energy: &'a mut [f64],
}

/// Neighbours that are handled side by side. The sums run over as many partial sums, whatever the width of the
/// machine's vectors, so that they give the same bits everywhere.
const LANES: usize = 8;

impl pulp::NullaryFnOnce for Displace<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            gain,
            momentum,
            first,
            points,
            normals,
            size,
            sigma,
            lists,
            walls,
            next,
            velocity,
            energy,
        } = self;
        for k in 0..next.len() {
            let i = first + k;
            let p = points[i];
            let own = sigma * if size.is_empty() { 1.0 } else { size[i] };
            let (force, e) = repulsion(i, points, lists.of(i), size, sigma);
            let push = add(scale(velocity[k], momentum), scale(force, gain));
            let mut v = walls.slide(p, normals[i], push);
            let length = norm(v);
            if length > LONGEST * own {
                v = scale(v, LONGEST * own / length);
            }
            let q = walls.clamp(add(p, v));
            velocity[k] = sub(q, p);
            next[k] = q;
            energy[k] = e;
        }
    }
}

/// Σ r^ij exp(-|r^ij|²/2σ²) and Σ exp(-|r^ij|²/2σ²), σ² the mean of the squares of both where sizes differ.
#[inline(always)]
fn repulsion(i: usize, points: &[V3], near: &[u32], size: &[f64], sigma: f64) -> (V3, f64) {
    let p = points[i];
    let equal = -0.5 / (sigma * sigma);
    let mut fx = [0.0; LANES];
    let mut fy = [0.0; LANES];
    let mut fz = [0.0; LANES];
    let mut e = [0.0; LANES];
    for near in near.chunks(LANES) {
        let (mut x, mut y, mut z, mut half) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [equal; LANES]);
        // Beyond the cutoff, so that lanes without a neighbour add nothing.
        x[near.len()..].fill(1e3 * sigma);
        for (l, &j) in near.iter().enumerate() {
            let q = points[j as usize];
            x[l] = p[0] - q[0];
            y[l] = p[1] - q[1];
            z[l] = p[2] - q[2];
        }
        if !size.is_empty() {
            for (l, &j) in near.iter().enumerate() {
                let (a, b) = (size[i], size[j as usize]);
                half[l] = 2.0 * equal / (a * a + b * b);
            }
        }
        for l in 0..LANES {
            let u = -half[l] * (x[l] * x[l] + y[l] * y[l] + z[l] * z[l]);
            let w = if u < 0.5 * CUTOFF * CUTOFF { gauss(u.min(0.5 * CUTOFF * CUTOFF)) } else { 0.0 };
            fx[l] += w * x[l];
            fy[l] += w * y[l];
            fz[l] += w * z[l];
            e[l] += w;
        }
    }
    ([fold(fx), fold(fy), fold(fz)], fold(e))
}

/// The sum of the lanes in a fixed order.
#[inline(always)]
fn fold(v: [f64; LANES]) -> f64 {
    ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]))
}
