//! Repulsion between floaters with radii of their own (WH94 section 4.3).

use std::sync::Arc;

use pulp::Arch;
use rayon::prelude::*;

use crate::kernel::gauss_single;
use crate::neighbors::{Neighbors, Reach};
use crate::repulsion::fold;
use crate::swarm::{doubt, share};
use crate::vector::{V3, dot, sub};

/// Energies are cut off at this many σ: exp(-8) of their peak.
const CUTOFF: f64 = 4.0;

/// What the others do to a floater.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Force {
    /// Desired velocity P^i (eq. 9).
    pub(super) desired: V3,
    /// D^i = Σ_j E^ij.
    pub(super) energy: f64,
    /// ∂D^i/∂σ^i (eq. 13).
    pub(super) energy_by_sigma: f64,
}

/// Lists of neighbours that serve for several steps: they reach a little farther than the forces.
#[derive(Clone)]
pub(super) struct Kept {
    lists: Arc<Neighbors>,
    points: Vec<V3>,
    /// How far each list reaches; one number where all reach equally far.
    reach: Vec<f64>,
}

/// How much farther lists reach than the forces.
const SKIN: f64 = 1.15;
/// Radii that differ by less share one reach, which is faster to find.
const ALIKE: f64 = 2.0;

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kept({} lists)", self.points.len())
    }
}

impl Kept {
    fn new(points: &[V3], normals: &[V3], sigma: &[f64]) -> Self {
        let mark = |i: usize, j: usize| {
            doubt(points[i], points[j], normals[i], normals[j]).map(|d| if d { Neighbors::MARK } else { 0 })
        };
        let largest = sigma.iter().fold(0.0f64, |a, &b| a.max(b));
        let mean = sigma.iter().sum::<f64>() / sigma.len().max(1) as f64;
        let (reach, lists) = if largest <= ALIKE * mean {
            let reach = SKIN * CUTOFF * largest;
            (vec![reach], Neighbors::find_marked(points, Reach::Same(reach), mark))
        } else {
            let reach: Vec<f64> = sigma.iter().map(|s| SKIN * CUTOFF * s).collect();
            let lists = Neighbors::find_marked(points, Reach::Each(&reach), mark);
            (reach, lists)
        };
        Self { lists: Arc::new(lists), points: points.to_vec(), reach }
    }

    /// Whether no two floaters that were out of reach can act on each other by now.
    fn serves(&self, points: &[V3], sigma: &[f64]) -> bool {
        if points.len() != self.points.len() {
            return false;
        }
        let far = |(p, q): (&V3, &V3)| {
            let r = sub(*p, *q);
            dot(r, r)
        };
        let moved = points.iter().zip(&self.points).map(far).fold(0.0, f64::max).sqrt();
        let reach = |i: usize| if self.reach.len() == 1 { self.reach[0] } else { self.reach[i] };
        sigma.iter().enumerate().all(|(i, s)| CUTOFF * s + 2.0 * moved <= reach(i))
    }
}

/// Forces on all floaters. The sums exclude the floater itself, and others as far as they lie on other sheets of the surface (see
/// [`share`]). `kept` holds the lists from step to step; it must be emptied when floaters come or go, or a normal turns suddenly.
pub(super) fn forces(
    points: &[V3],
    normals: &[V3],
    sigma: &[f64],
    alpha: f64,
    kept: &mut Option<Kept>,
) -> Vec<Force> {
    if !kept.as_ref().is_some_and(|k| k.serves(points, sigma)) {
        *kept = Some(Kept::new(points, normals, sigma));
    }
    let lists = &kept.as_ref().expect("made above").lists;
    let inverse: Vec<f64> = sigma.iter().map(|s| 1.0 / (s * s)).collect();
    let mut force = vec![Force::default(); points.len()];
    let arch = Arch::new();
    force.par_chunks_mut(CHUNK).enumerate().for_each(|(c, force)| {
        arch.dispatch(Sums {
            first: c * CHUNK,
            force,
            points,
            normals,
            sigma,
            inverse: &inverse,
            alpha,
            lists,
        });
    });
    force
}

/// Floaters that one task handles.
const CHUNK: usize = 1024;
/// Pairs that are evaluated together: a fixed number, so that no vector width changes a sum.
const LANES: usize = 8;
/// Where the energies end, in u = d²/2σ².
const END: f32 = (0.5 * CUTOFF * CUTOFF) as f32;

/// The sums over the neighbours of some floaters, in single precision: distances are taken in double precision and then measured
/// in σ^i, so that a force is rounded to 2e-5 of what one neighbour exerts, at any place and scale.
struct Sums<'a> {
    first: usize,
    force: &'a mut [Force],
    points: &'a [V3],
    normals: &'a [V3],
    sigma: &'a [f64],
    /// 1/σ²
    inverse: &'a [f64],
    alpha: f64,
    lists: &'a Neighbors,
}

impl pulp::NullaryFnOnce for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { first, force, points, normals, sigma, inverse, alpha, lists } = self;
        for (k, force) in force.iter_mut().enumerate() {
            let i = first + k;
            let (p, own) = (points[i], sigma[i]);
            let (unit, square) = (1.0 / own, own * own);
            let (mut sum, mut energy, mut slope) = ([[0.0f32; LANES]; 3], [0.0f32; LANES], [0.0f32; LANES]);
            for some in lists.of(i).chunks(LANES) {
                // Lanes without a neighbour are out of reach.
                let mut r = [[1e3f32; LANES], [0.0; LANES], [0.0; LANES]];
                let mut ratio = [1.0f32; LANES];
                let (mut part, mut marks) = ([1.0f32; LANES], 0);
                for (l, &entry) in some.iter().enumerate() {
                    let j = (entry & !Neighbors::MARK) as usize;
                    let q = points[j];
                    marks |= entry;
                    r[0][l] = ((p[0] - q[0]) * unit) as f32;
                    r[1][l] = ((p[1] - q[1]) * unit) as f32;
                    r[2][l] = ((p[2] - q[2]) * unit) as f32;
                    ratio[l] = (square * inverse[j]) as f32;
                }
                if marks & Neighbors::MARK != 0 {
                    for (l, &entry) in some.iter().enumerate().filter(|e| e.1 & Neighbors::MARK != 0) {
                        let j = (entry & !Neighbors::MARK) as usize;
                        part[l] = share(p, points[j], normals[i], normals[j]) as f32;
                    }
                }
                for l in 0..LANES {
                    let u = 0.5 * (r[0][l] * r[0][l] + r[1][l] * r[1][l] + r[2][l] * r[2][l]);
                    let (ij, ji) = (part[l] * faded(u), part[l] * faded(u * ratio[l]));
                    // Eq. 9 with r^ji = -r^ij: (σ^i)² [r^ij/(σ^i)² E^ij + r^ij/(σ^j)² E^ji].
                    let push = ij + ji * ratio[l];
                    sum[0][l] += push * r[0][l];
                    sum[1][l] += push * r[1][l];
                    sum[2][l] += push * r[2][l];
                    energy[l] += ij;
                    slope[l] += u * ij;
                }
            }
            *force = Force {
                desired: sum.map(|s| alpha * own * fold(s)),
                energy: alpha * fold(energy),
                energy_by_sigma: 2.0 * alpha * unit * fold(slope),
            };
        }
    }
}

/// exp(-u), cut off.
#[inline(always)]
fn faded(u: f32) -> f32 {
    let e = gauss_single(if u < END { u } else { END });
    if u < END { e } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::rng::{Rng, Stream};

    /// α exp(-d²/2σ²), cut off.
    fn energy(alpha: f64, d2: f64, sigma: f64) -> f64 {
        let u = 0.5 * d2 / (sigma * sigma);
        if u < f64::from(END) { alpha * (-u).exp() } else { 0.0 }
    }

    /// E^i = Σ_j (E^ij + E^ji).
    fn total(points: &[V3], sigma: &[f64], i: usize) -> f64 {
        (0..points.len())
            .filter(|&j| j != i)
            .map(|j| {
                let r = sub(points[i], points[j]);
                energy(6.0, dot(r, r), sigma[i]) + energy(6.0, dot(r, r), sigma[j])
            })
            .sum()
    }

    #[test]
    fn velocities_and_radii_follow_the_energy() {
        let rng = Rng::new(4, Stream::Jitter);
        let points: Vec<V3> = (0..40).map(|i| [0, 1, 2].map(|a| rng.unit(3 * i + a))).collect();
        let sigma: Vec<f64> = (0..40).map(|i| 0.15 + 0.2 * rng.unit(1000 + i)).collect();
        let force = forces(&points, &[[0.0; 3]; 40], &sigma, 6.0, &mut None);
        let h = 1e-6;
        for i in 0..40 {
            for a in 0..3 {
                let (mut up, mut down) = (points.clone(), points.clone());
                up[i][a] += h;
                down[i][a] -= h;
                let slope = (total(&up, &sigma, i) - total(&down, &sigma, i)) / (2.0 * h);
                let expected = -sigma[i] * sigma[i] * slope;
                // In single precision; the cutoff lets pairs drop out, which moves the difference by up to 6 exp(-8) σ²/h per pair.
                assert!((force[i].desired[a] - expected).abs() < 2e-5 * (1.0 + expected.abs()), "{i} {a}");
            }
            let d = |s: f64| {
                let others = (0..40).filter(|&j| j != i);
                others
                    .map(|j| {
                        let r = sub(points[i], points[j]);
                        energy(6.0, dot(r, r), s)
                    })
                    .sum::<f64>()
            };
            let slope = (d(sigma[i] + h) - d(sigma[i] - h)) / (2.0 * h);
            assert!((force[i].energy - d(sigma[i])).abs() < 2e-5 * d(sigma[i]).max(1.0));
            assert!((force[i].energy_by_sigma - slope).abs() < 2e-5 * (1.0 + slope.abs()), "{i}");
        }
    }
}
