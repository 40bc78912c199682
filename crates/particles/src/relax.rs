//! Spreading floaters whose number is fixed: Gaussian repulsion (WH94 section 4.1) with a heavy ball, projected.
//!
//! One step evaluates the field once a floater. All lengths are multiples of σ, so that a run is the same at every
//! scale; the constants were measured on spheres, tori, blobs and gyroids of 500 to 100,000 floaters.

use isoswarm_field::{FieldError, Surface};
use pulp::Arch;
use rayon::prelude::*;

use crate::constraint::{Target, Walls, evaluate, project_together};
use crate::neighbors::Neighbors;
use crate::repulsion::{CUTOFF, repulsion};
use crate::swarm::{FREE, Swarm};
use crate::vector::{V3, add, distance, dot, norm, scale, sub, unit};

/// Distance in σ down to which two floaters that approach each other may go unseen: a force of a hundredth of that between
/// neighbours.
const UNSEEN: f64 = 3.2;
/// Longest displacement of a step in σ.
const LONGEST: f64 = 0.3;
/// Floaters that one task handles; fixed, so that sums over tasks do not depend on the number of threads.
const CHUNK: usize = 128;
/// Cosine of the turn of a normal in one step from which on more than one Newton step is taken.
const TURNED: f64 = 0.8;
/// The same for the length of the Newton step in lengths of the step before it: on a smooth surface it is the half of
/// the step over the radius of curvature.
const ASTRAY: f64 = 0.25;
/// Distance from the surface in σ at which a floater that went astray is taken back.
const LOST: f64 = 0.01;
/// Motion in σ after which the field is narrowed anew.
const NARROW: f64 = 2.0;

/// What one step did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moved {
    /// Root mean square of the displacements, in σ.
    pub(crate) rms: f64,
    /// Largest displacement (length).
    most: f64,
    /// Part of the floaters that have gone farther than the lists allow for.
    away: f64,
}

/// How a swarm is being spread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Radius of repulsion of a floater of size 1 (length).
    pub(crate) sigma: f64,
    /// Displacement per force.
    pub(crate) gain: f64,
    /// Part of the last displacement that is kept: the heavy ball.
    pub(crate) momentum: f64,
    /// Lists of neighbours are drawn this many σ wider than repulsion reaches, and serve until too many floaters have gone so
    /// far that there may be two at less than [`UNSEEN`] that are not in them.
    pub(crate) skin: f64,
    /// Part of the floaters that may go farther than the lists allow for before they are drawn anew.
    pub(crate) stray: f64,
}

/// A swarm that is being spread over a surface.
pub(crate) struct Relaxation<'s> {
    surface: &'s dyn Surface,
    narrowed: Option<Box<dyn Surface + 's>>,
    walls: Walls,
    /// Gradients up to this length count as zero.
    least: f64,
    pace: Pace,
    pub(crate) swarm: Swarm,
    pub(crate) evaluations: u64,
    lists: Neighbors,
    /// How far a floater of size 1 sees in the lists.
    sight: f64,
    /// Length of the way of each floater since the lists were drawn, in its sight.
    way: Vec<f32>,
    /// Part of the floaters that have gone farther than the lists allow for.
    away: f64,
    moved_since_narrowing: f64,
    next: Vec<V3>,
    value: Vec<f64>,
    gradient: Vec<V3>,
    /// Floaters whose normal turned much in this step: they went over a crease or around a sharp bend.
    turned: Vec<u32>,
    /// Their normals before.
    before: Vec<V3>,
}

impl<'s> Relaxation<'s> {
    pub(crate) fn new(surface: &'s dyn Surface, walls: Walls, swarm: Swarm, least: f64) -> Self {
        Self {
            surface,
            narrowed: None,
            walls,
            least,
            pace: Pace { sigma: 1.0, gain: 0.0, momentum: 0.0, skin: 1.0, stray: 0.0 },
            swarm,
            evaluations: 0,
            lists: Neighbors::default(),
            sight: 0.0,
            way: Vec::new(),
            away: f64::INFINITY,
            moved_since_narrowing: f64::INFINITY,
            next: Vec::new(),
            value: Vec::new(),
            gradient: Vec::new(),
            turned: Vec::new(),
            before: Vec::new(),
        }
    }

    /// Changes the population: everything derived from it is forgotten.
    pub(crate) fn populate(&mut self, swarm: Swarm) {
        self.swarm = swarm;
        self.away = f64::INFINITY;
        self.moved_since_narrowing = f64::INFINITY;
    }

    /// Takes the swarm out and gives back the memory of everything else.
    pub(crate) fn release(&mut self) -> Swarm {
        self.lists = Neighbors::default();
        self.narrowed = None;
        (self.next, self.value, self.gradient, self.way) = Default::default();
        (self.away, self.moved_since_narrowing) = (f64::INFINITY, f64::INFINITY);
        std::mem::take(&mut self.swarm)
    }

    /// Changes the pace of the steps to come. Lists of neighbours that reach far enough go on to serve.
    pub(crate) fn tune(&mut self, pace: Pace) {
        self.pace = pace;
        if self.away.is_finite() {
            let room = self.room();
            let away = self.way.iter().filter(|w| **w > room).count();
            self.away = if room > 0.0 { away as f64 / self.way.len().max(1) as f64 } else { f64::INFINITY };
        }
    }

    /// How far floaters may go before the lists of neighbours are drawn anew, in the lists' sight.
    fn room(&self) -> f32 {
        (0.5 * (1.0 - UNSEEN * self.pace.sigma / self.sight)) as f32
    }

    /// Draws the lists of neighbours anew where motion demands it.
    fn look_around(&mut self) {
        if self.away > self.pace.stray {
            // First give back the memory of the old ones.
            self.lists = Neighbors::default();
            self.sight = (CUTOFF + self.pace.skin) * self.pace.sigma;
            self.lists = self.swarm.surroundings(self.sight);
            self.way.clear();
            self.way.resize(self.swarm.len(), 0.0);
            self.away = 0.0;
        }
    }

    /// One step: forces, displacements in the tangent plane, one Newton step back to the surface.
    pub(crate) fn step(&mut self) -> Result<Moved, FieldError> {
        let n = self.swarm.len();
        if n == 0 {
            return Ok(Moved::default());
        }
        self.look_around();
        self.next.resize(n, [0.0; 3]);
        self.displace();
        let sigma = self.pace.sigma;
        if self.moved_since_narrowing > NARROW * sigma {
            self.narrowed = self.surface.narrowed(&self.swarm.points, (NARROW + LONGEST) * sigma)?;
            self.moved_since_narrowing = 0.0;
        }
        let surface = self.narrowed.as_deref().unwrap_or(self.surface);
        evaluate(surface, &mut self.evaluations, &self.next, &mut self.value, &mut self.gradient)?;
        let mut moved = self.settle();
        if !self.turned.is_empty() {
            self.settle_turned(&mut moved)?;
        }
        std::mem::swap(&mut self.swarm.points, &mut self.next);
        self.away = moved.away;
        self.moved_since_narrowing += moved.most;
        Ok(moved)
    }

    /// Forces from the present positions; displaced positions into `next`.
    fn displace(&mut self) {
        let Self { walls, pace, swarm, lists, next, .. } = self;
        let Pace { sigma, gain, momentum, .. } = *pace;
        let Swarm { points, normals, velocity, size, held, .. } = swarm;
        let (points, normals, size, held) = (&points[..], &normals[..], &size[..], &held[..]);
        let arch = Arch::new();
        let tasks = next.par_chunks_mut(CHUNK).zip(velocity.par_chunks_mut(CHUNK));
        tasks.enumerate().for_each(|(c, (next, velocity))| {
            arch.dispatch(Displace {
                gain,
                momentum,
                first: c * CHUNK,
                points,
                normals,
                size,
                held,
                sigma,
                lists,
                walls,
                next,
                velocity,
            });
        });
    }

    /// Newton-corrects `next`, takes the new normals and measures the motion.
    fn settle(&mut self) -> Moved {
        let room = self.room();
        let Self { walls, least, pace, sight, swarm, next, value, gradient, way, .. } = self;
        let (walls, least, sigma, part) = (*walls, *least, pace.sigma, pace.sigma / *sight);
        let points = &swarm.points[..];
        let size = &swarm.size[..];
        let held = &swarm.held[..];
        let parts: Vec<(f64, f64, usize, Vec<(u32, V3)>)> = next
            .par_chunks_mut(CHUNK)
            .zip(swarm.normals.par_chunks_mut(CHUNK))
            .zip(swarm.velocity.par_chunks_mut(CHUNK))
            .zip(way.par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(c, (((next, normals), velocity), way))| {
                let (mut square, mut most, mut away, mut turned) = (0.0, 0.0f64, 0usize, Vec::new());
                for k in 0..next.len() {
                    let i = c * CHUNK + k;
                    if held.get(i).is_some_and(|h| *h != FREE) {
                        continue;
                    }
                    let own = sigma * if size.is_empty() { 1.0 } else { size[i] };
                    match walls.newton(next[k], value[i], gradient[i], LONGEST * own, least) {
                        Some(q) => {
                            let normal = unit(gradient[i]);
                            let (off, went) = (distance(q, next[k]), norm(velocity[k]));
                            let astray = off > ASTRAY * went && off > 0.01 * own;
                            if astray || dot(normal, normals[k]) < TURNED {
                                turned.push((i as u32, normals[k]));
                            }
                            next[k] = q;
                            normals[k] = normal;
                            velocity[k] = sub(q, points[i]);
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
                    way[k] += (d / own * part) as f32;
                    away += usize::from(way[k] > room);
                }
                (square, most, away, turned)
            })
            .collect();
        let square: f64 = parts.iter().map(|p| p.0).sum();
        let most = parts.iter().fold(0.0f64, |m, p| m.max(p.1));
        self.turned.clear();
        self.turned.extend(parts.iter().flat_map(|p| &p.3).map(|t| t.0));
        self.before.clear();
        self.before.extend(parts.iter().flat_map(|p| &p.3).map(|t| t.1));
        let (n, away) = (points.len() as f64, parts.iter().map(|p| p.2).sum::<usize>() as f64);
        Moved { rms: (square / n).sqrt(), most, away: away / n }
    }

    /// Further Newton steps for those that turned: behind a crease one step is not enough.
    fn settle_turned(&mut self, moved: &mut Moved) -> Result<(), FieldError> {
        let sigma = self.pace.sigma;
        let own = |i: usize| sigma * self.swarm.size.get(i).copied().unwrap_or(1.0);
        let mut points: Vec<V3> = self.turned.iter().map(|&i| self.next[i as usize]).collect();
        let mut normals: Vec<V3> = self.turned.iter().map(|&i| self.swarm.normals[i as usize]).collect();
        let target =
            Target { tolerance: 1e-3 * sigma, longest: LONGEST * sigma, least: self.least, rounds: 4 };
        let among = Among {
            field: self.narrowed.as_deref().filter(|_| MANY * self.turned.len() > self.next.len()),
            whole: self.surface,
            all: &self.next,
            chosen: &self.turned,
        };
        let together = if among.field.is_some() { target.rounds } else { 0 };
        let count = &mut self.evaluations;
        let left = project_together(&among, count, &self.walls, &mut points, &mut normals, target, together)?;
        for (k, &i) in self.turned.iter().enumerate() {
            let i = i as usize;
            let (old, new) = (self.swarm.points[i], points[k]);
            let d = distance(new, old);
            // Not farther than a step with its correction goes: beyond that it is another place.
            if d < 3.0 * LONGEST * own(i) && left[k] < LOST * own(i) {
                self.next[i] = new;
                self.swarm.normals[i] = normals[k];
                self.swarm.velocity[i] = sub(new, old);
                moved.most = moved.most.max(d);
            } else {
                // Beyond a thin rim Newton's method finds no way back: rest where the step began.
                self.next[i] = old;
                self.swarm.normals[i] = self.before[k];
                self.swarm.velocity[i] = [0.0; 3];
            }
        }
        Ok(())
    }

    /// Forgets the momentum.
    pub(crate) fn rest(&mut self) {
        self.swarm.velocity.iter_mut().for_each(|v| *v = [0.0; 3]);
    }
}

/// From this part of all floaters on it is cheaper to evaluate all on the narrowed field, which wants all of them, than
/// the few on the whole one.
const MANY: usize = 64;

/// Some floaters among all that a narrowed field knows.
struct Among<'a> {
    field: Option<&'a (dyn Surface + 'a)>,
    whole: &'a dyn Surface,
    all: &'a [V3],
    chosen: &'a [u32],
}

impl Surface for Among<'_> {
    fn axes(&self) -> usize {
        self.whole.axes()
    }

    fn value_gradient(&self, p: &[V3], value: &mut [f64], gradient: &mut [V3]) -> Result<(), FieldError> {
        let Some(field) = self.field.filter(|_| p.len() == self.chosen.len()) else {
            return self.whole.value_gradient(p, value, gradient);
        };
        let mut all = self.all.to_vec();
        for (k, &i) in self.chosen.iter().enumerate() {
            all[i as usize] = p[k];
        }
        let (mut values, mut gradients) = (vec![0.0; all.len()], vec![[0.0; 3]; all.len()]);
        field.value_gradient(&all, &mut values, &mut gradients)?;
        for (k, &i) in self.chosen.iter().enumerate() {
            (value[k], gradient[k]) = (values[i as usize], gradients[i as usize]);
        }
        Ok(())
    }

    fn hessian(&self, points: &[V3], hessian: &mut [[f64; 6]]) -> Result<(), FieldError> {
        self.whole.hessian(points, hessian)
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
    /// As in [`Swarm::held`].
    held: &'a [u32],
    sigma: f64,
    lists: &'a Neighbors,
    walls: &'a Walls,
    next: &'a mut [V3],
    velocity: &'a mut [V3],
}

impl pulp::NullaryFnOnce for Displace<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { gain, momentum, first, points, normals, size, held, sigma, lists, walls, next, velocity } =
            self;
        for k in 0..next.len() {
            let i = first + k;
            let p = points[i];
            if held.get(i).is_some_and(|h| *h != FREE) {
                (next[k], velocity[k]) = (p, [0.0; 3]);
                continue;
            }
            let own = sigma * if size.is_empty() { 1.0 } else { size[i] };
            let (force, stiffness) = repulsion(i, points, normals, lists.of(i), size, sigma);
            let gain = gain * (STIFF / stiffness.max(STIFF));
            let push = add(scale(velocity[k], momentum), scale(force, gain));
            let mut v = walls.slide(p, normals[i], push);
            let length = norm(v);
            if length > LONGEST * own {
                v = scale(v, LONGEST * own / length);
            }
            let q = walls.clamp(add(p, v));
            velocity[k] = sub(q, p);
            next[k] = q;
        }
    }
}

/// How fast the force changes with the place of a floater in a lattice with neighbours at 2.2 σ. Where it changes faster
/// (in a crowd, or in a crevice, where the neighbours on both sides count) steps are so much shorter: else they would
/// go too far, and come back, for ever.
const STIFF: f64 = 1.6;
