//! Repulsion between floaters with radii of their own (WH94 section 4.3).

use rayon::prelude::*;

use crate::kernel::gauss;
use crate::neighbors::{Neighbors, Reach};
use crate::swarm::same_sheet;
use crate::vector::{V3, along, dot, sub};

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

/// α exp(-d²/2σ²), cut off.
fn energy(alpha: f64, d2: f64, sigma: f64) -> f64 {
    let u = 0.5 * d2 / (sigma * sigma);
    if u > 0.5 * CUTOFF * CUTOFF { 0.0 } else { alpha * gauss(u) }
}

/// Forces on all floaters. The sums exclude the floater itself and those on other sheets of the surface.
pub(super) fn forces(points: &[V3], normals: &[V3], sigma: &[f64], alpha: f64) -> Vec<Force> {
    let reach: Vec<f64> = sigma.iter().map(|s| CUTOFF * s).collect();
    let keep = |i: usize, j: usize| same_sheet(points[i], points[j], normals[i], normals[j]);
    let lists = Neighbors::find(points, Reach::Each(&reach), keep);
    (0..points.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|i| {
            let (own, mut force) = (sigma[i], Force::default());
            for &j in lists.of(i) {
                let j = j as usize;
                let r = sub(points[i], points[j]);
                let d2 = dot(r, r);
                let (ij, ji) = (energy(alpha, d2, own), energy(alpha, d2, sigma[j]));
                // Eq. 9 with r^ji = -r^ij: (σ^i)² [r^ij/(σ^i)² E^ij + r^ij/(σ^j)² E^ji].
                let ratio = own / sigma[j];
                force.desired = along(force.desired, ij + ratio * ratio * ji, r);
                force.energy += ij;
                force.energy_by_sigma += d2 * ij;
            }
            force.energy_by_sigma /= own * own * own;
            force
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Rng, Stream};

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
        let force = forces(&points, &[[0.0; 3]; 40], &sigma, 6.0);
        let h = 1e-6;
        for i in 0..40 {
            for a in 0..3 {
                let (mut up, mut down) = (points.clone(), points.clone());
                up[i][a] += h;
                down[i][a] -= h;
                let slope = (total(&up, &sigma, i) - total(&down, &sigma, i)) / (2.0 * h);
                let expected = -sigma[i] * sigma[i] * slope;
                // The cutoff lets pairs drop out, which moves the difference by up to 6 exp(-8) σ²/h per pair.
                assert!((force[i].desired[a] - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{i} {a}");
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
            assert!((force[i].energy - d(sigma[i])).abs() < 1e-9 * d(sigma[i]).max(1.0));
            assert!((force[i].energy_by_sigma - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{i}");
        }
    }
}
