//! The constraint that locks particles onto a surface (WH94 section 3), as pure functions.
//!
//! The faces of the bounds are constraints too: a particle that would leave stays on the face and slides along the
//! curve in which the face clips the surface.

use isoswarm_field::{Aabb, FieldError, Surface};
use rayon::prelude::*;

use crate::vector::{V3, along, dot, norm, unit};

/// Points that one task handles; fixed, so that sums over tasks do not depend on the number of threads.
pub(crate) const CHUNK: usize = 1024;

/// The velocity of a floater (WH94 eq. 5): the closest to `desired` (P, length per time) that keeps F = 0 at rate
/// `phi` (1/time) while the parameters move. `gradient` is ∂F/∂x, `parameter_term` (∂F/∂q)·q̇.
///
/// Where the gradient is not longer than `least` (≥ 0, units of F per length) the surface is ill-defined and the
/// floater rests.
pub fn floater_velocity(
    desired: [f64; 3],
    value: f64,
    gradient: [f64; 3],
    parameter_term: f64,
    phi: f64,
    least: f64,
) -> [f64; 3] {
    let square = dot(gradient, gradient);
    if !(square > least * least && square.is_finite() && value.is_finite() && parameter_term.is_finite()) {
        return [0.0; 3];
    }
    let lambda = (dot(gradient, desired) + parameter_term + phi * value) / square;
    along(desired, -lambda, gradient)
}

/// `v`, or the nearer limit (`lo` for NaN): one instruction a limit, where `f64::max` takes many.
#[inline(always)]
pub(crate) fn within(v: f64, lo: f64, hi: f64) -> f64 {
    let v = if v > lo { v } else { lo };
    if v < hi { v } else { hi }
}

/// The bounds as constraints on particles that are on F = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Walls {
    pub(crate) lo: V3,
    pub(crate) hi: V3,
    pub(crate) axes: usize,
}

impl Walls {
    pub(crate) fn new(bounds: &Aabb, axes: usize) -> Self {
        let mut walls = Self { lo: bounds.lo, hi: bounds.hi, axes };
        for a in axes..3 {
            walls.lo[a] = 0.0;
            walls.hi[a] = 0.0;
        }
        walls
    }

    /// Whether the point is on a face (or beyond).
    #[inline(always)]
    pub(crate) fn touches(&self, p: V3) -> bool {
        (0..self.axes).any(|a| p[a] <= self.lo[a] || p[a] >= self.hi[a])
    }

    #[inline(always)]
    pub(crate) fn clamp(&self, p: V3) -> V3 {
        [0, 1, 2].map(|a| within(p[a], self.lo[a], self.hi[a]))
    }

    /// Whether moving from `p` along `v` leaves through a face of axis `a` at once.
    #[inline(always)]
    fn blocks(&self, p: V3, v: V3, a: usize) -> bool {
        (p[a] <= self.lo[a] && v[a] < 0.0) || (p[a] >= self.hi[a] && v[a] > 0.0)
    }

    /// The part of `v` that neither leaves the tangent plane of `normal` (unit or zero) nor the bounds.
    #[inline(always)]
    pub(crate) fn slide(&self, p: V3, normal: V3, v: V3) -> V3 {
        let t = along(v, -dot(v, normal), normal);
        if self.touches(p) { self.slide_on_face(p, normal, t, v) } else { t }
    }

    #[cold]
    fn slide_on_face(&self, p: V3, normal: V3, mut t: V3, v: V3) -> V3 {
        let mut free = [true; 3];
        for _ in 0..self.axes {
            let Some(a) = (0..self.axes).find(|&a| free[a] && self.blocks(p, t, a)) else { return t };
            free[a] = false;
            let n = unit([0, 1, 2].map(|a| if free[a] { normal[a] } else { 0.0 }));
            let w = [0, 1, 2].map(|a| if free[a] { v[a] } else { 0.0 });
            t = along(w, -dot(w, n), n);
        }
        if (0..self.axes).any(|a| self.blocks(p, t, a)) { [0.0; 3] } else { t }
    }

    /// One Newton step from `p` towards F = 0 along the gradient, no longer than `longest`, that stays in the bounds:
    /// a coordinate that would leave is set to the face and the others make up for it. `None` where the gradient is
    /// not longer than `least` or something is not finite.
    #[inline(always)]
    pub(crate) fn newton(&self, p: V3, value: f64, gradient: V3, longest: f64, least: f64) -> Option<V3> {
        let square = dot(gradient, gradient);
        if !(square > least * least && square.is_finite() && value.is_finite()) {
            return None;
        }
        let mut k = -value / square;
        let length = value.abs() / square.sqrt();
        if length > longest {
            k *= longest / length;
        }
        let q = along(p, k, gradient);
        let inside = (0..3).all(|a| q[a] >= self.lo[a] && q[a] <= self.hi[a]);
        if inside { Some(q) } else { Some(self.newton_on_face(p, -k * square, gradient, longest)) }
    }

    /// `value` is what the step must undo: F, or less where the step is shortened.
    #[cold]
    fn newton_on_face(&self, p: V3, value: f64, gradient: V3, longest: f64) -> V3 {
        let mut q = self.clamp(p);
        let mut free = [true; 3];
        for _ in 0..=self.axes {
            let g = [0, 1, 2].map(|a| if free[a] { gradient[a] } else { 0.0 });
            let square = dot(g, g);
            if square <= 1e-12 * dot(gradient, gradient) {
                return q;
            }
            let residual = value + dot(gradient, [q[0] - p[0], q[1] - p[1], q[2] - p[2]]);
            let mut k = -residual / square;
            let length = k.abs() * norm(g);
            if length > longest {
                k *= longest / length;
            }
            let next = along(q, k, g);
            let clamped = self.clamp(next);
            q = clamped;
            if next == clamped {
                return q;
            }
            for a in 0..3 {
                if next[a] != clamped[a] {
                    free[a] = false;
                }
            }
        }
        q
    }
}

/// F and ∂F/∂x of `surface` at the points into vectors of the right length.
pub(crate) fn evaluate(
    surface: &dyn Surface,
    count: &mut u64,
    points: &[V3],
    value: &mut Vec<f64>,
    gradient: &mut Vec<V3>,
) -> Result<(), FieldError> {
    value.resize(points.len(), 0.0);
    gradient.resize(points.len(), [0.0; 3]);
    if points.is_empty() {
        return Ok(());
    }
    *count += points.len() as u64;
    surface.value_gradient(points, value, gradient)
}

/// From so many points on a narrowed field pays.
const MANY: usize = 2048;
/// Rounds in which all points stay together for it.
const TOGETHER: usize = 3;
/// How far, in longest steps, most points move.
const NEARBY: f64 = 0.2;

/// How [`project`] goes about its work.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// Distance |F|/|∇F| that is good enough.
    pub(crate) tolerance: f64,
    /// Longest single step.
    pub(crate) longest: f64,
    /// Gradients up to this length count as zero.
    pub(crate) least: f64,
    /// Most evaluations of a point.
    pub(crate) rounds: usize,
}

/// Moves the points onto the surface by safeguarded Newton steps and gives the distance |F|/|∇F| that is left at each
/// (infinite where the gradient vanishes or nothing finite was found). The best place visited counts, so a point never
/// ends farther off than it started; only points that still improve are evaluated again. `normals` are those of the
/// last places, zero where there is none.
pub(crate) fn project(
    surface: &dyn Surface,
    count: &mut u64,
    walls: &Walls,
    points: &mut [V3],
    normals: &mut [V3],
    target: Target,
) -> Result<Vec<f64>, FieldError> {
    // Many points are worth a field that is narrowed to where they are. It wants all of them, in their order, so that
    // none drops out in the first rounds.
    let narrowed =
        if points.len() < MANY { None } else { surface.narrowed(points, NEARBY * target.longest)? };
    let Some(field) = narrowed else {
        return project_together(surface, count, walls, points, normals, target, 0);
    };
    let near = Target { rounds: TOGETHER.min(target.rounds), ..target };
    let mut left = project_together(field.as_ref(), count, walls, points, normals, near, TOGETHER)?;
    let far: Vec<usize> = (0..points.len()).filter(|&i| left[i] > target.tolerance).collect();
    let mut places: Vec<V3> = far.iter().map(|&i| points[i]).collect();
    let mut frames: Vec<V3> = far.iter().map(|&i| normals[i]).collect();
    let rest = project_together(surface, count, walls, &mut places, &mut frames, target, 0)?;
    for (k, &i) in far.iter().enumerate() {
        if rest[k] <= left[i] {
            (points[i], normals[i], left[i]) = (places[k], frames[k], rest[k]);
        }
    }
    Ok(left)
}

/// [`project`] on the field as it is. In the first `together` rounds no point drops out.
pub(crate) fn project_together(
    surface: &dyn Surface,
    count: &mut u64,
    walls: &Walls,
    points: &mut [V3],
    normals: &mut [V3],
    target: Target,
    together: usize,
) -> Result<Vec<f64>, FieldError> {
    let mut left = vec![f64::INFINITY; points.len()];
    let mut active: Vec<u32> = (0..points.len() as u32).collect();
    let mut trial: Vec<V3> = points.to_vec();
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    for round in 0..target.rounds {
        evaluate(surface, count, &trial, &mut value, &mut gradient)?;
        // The arithmetic in tasks, the bookkeeping in order.
        let after: Vec<(f64, Option<V3>)> = (0..active.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|k| {
                let off = value[k].abs() / norm(gradient[k]);
                (off, walls.newton(trial[k], value[k], gradient[k], target.longest, target.least))
            })
            .collect();
        let mut still = Vec::with_capacity(active.len());
        let mut next = Vec::with_capacity(active.len());
        for (k, &i) in active.iter().enumerate() {
            let i = i as usize;
            let (off, step) = after[k];
            let stays = round + 1 < together;
            if step.is_none() && value[k] == 0.0 {
                // On the surface, at a singular point.
                points[i] = trial[k];
                normals[i] = [0.0; 3];
            }
            let Some(step) = step else {
                if stays {
                    still.push(i as u32);
                    next.push(trial[k]);
                }
                continue;
            };
            let better = off < left[i];
            if better {
                points[i] = trial[k];
                normals[i] = unit(gradient[k]);
                left[i] = off;
            }
            // A step that made it worse is tolerated while far away (the way may lead over a ridge), not when close.
            if off > target.tolerance
                && (better || (off > 1e-6 * target.longest && round < target.rounds / 2))
            {
                still.push(i as u32);
                next.push(step);
            } else if stays {
                still.push(i as u32);
                next.push(points[i]);
            }
        }
        active = still;
        trial = next;
        if active.is_empty() {
            break;
        }
    }
    Ok(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_solves_the_constrained_problem() {
        // Minimise |v - P|²/2 subject to Fx·v + Fq·q̇ + φF = 0: the KKT conditions.
        let (p, f, g, fq, phi) = ([0.3, -1.2, 0.7], 0.05, [1.5, -0.2, 2.5], 0.8, 15.0);
        let v = floater_velocity(p, f, g, fq, phi, 1e-9);
        assert!((dot(g, v) + fq + phi * f).abs() < 1e-13);
        let r = crate::vector::cross(crate::vector::sub(v, p), g);
        assert!(norm(r) < 1e-13);
        let t = floater_velocity(p, 0.0, g, 0.0, phi, 1e-9);
        assert!(dot(t, g).abs() < 1e-14);
        assert_eq!(floater_velocity(p, 1.0, [0.0; 3], 0.0, phi, 1e-9), [0.0; 3]);
        assert_eq!(floater_velocity(p, f64::NAN, g, 0.0, phi, 1e-9), [0.0; 3]);
    }

    #[test]
    fn feedback_decays_as_the_paper_says() {
        // F = |x|² - 1 is linear along no line, so use a plane: F = n·x, where Euler decays as (1 - φΔt)^k exactly.
        let (g, phi, dt) = ([0.0, 3.0, 4.0], 15.0, 0.03);
        let mut x = [0.2, 0.5, 1.0];
        let f0 = dot(g, x);
        for _ in 0..10 {
            x = along(x, dt, floater_velocity([0.0; 3], dot(g, x), g, 0.0, phi, 0.0));
        }
        assert!((dot(g, x) - f0 * (1.0f64 - phi * dt).powi(10)).abs() < 1e-13);
    }

    #[test]
    fn a_face_keeps_particles_and_lets_them_slide() {
        let walls = Walls::new(&Aabb::new([0.0; 3], [1.0; 3]), 3);
        // The plane x + y = 1.9, whose nearest point to (1, .95, .5) is outside.
        let g = [1.0, 1.0, 0.0];
        let p = [1.0, 0.95, 0.5];
        let q = walls.newton(p, 0.05, g, 1.0, 1e-9).unwrap();
        assert!((q[0] + q[1] - 1.9).abs() < 1e-15 && q[0] <= 1.0, "{q:?}");
        let q = walls.newton([1.0, 0.8, 0.5], -0.1, g, 1.0, 1e-9).unwrap();
        assert_eq!(q[0], 1.0);
        assert!((q[1] - 0.9).abs() < 1e-15);
        // A push out through the face becomes a motion along the clip curve (here the z direction).
        let t = walls.slide([1.0, 0.9, 0.5], unit(g), [0.5, -0.5, 0.25]);
        assert!(t[0] == 0.0 && t[1].abs() < 1e-16 && (t[2] - 0.25).abs() < 1e-16, "{t:?}");
        let t = walls.slide([1.0, 0.9, 0.5], unit(g), [-0.5, 0.5, 0.25]);
        assert!((t[0] + 0.5).abs() < 1e-15 && (t[1] - 0.5).abs() < 1e-15);
    }
}
