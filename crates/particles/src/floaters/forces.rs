//! Repulsion between floaters with radii of their own (WH94 section 4.3).

use std::sync::Arc;

use isoswarm_field::wide::{Single, Wide, WideSingle};
use pulp::Arch;
use rayon::prelude::*;

use crate::kernel::gauss_single;
use crate::neighbors::{Neighbors, Reach};
use crate::repulsion::fold;
use crate::swarm::share;
use crate::vector::{V3, dot, sub};

/// Energies are cut off at this many σ, .0005 of their peak: between the second and the third ring of floaters at rest, where
/// fewest come and go.
const CUTOFF: f64 = 3.9;

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
const SKIN: f64 = 1.1;
/// Radii that differ by less share one reach, which is faster to find.
const ALIKE: f64 = 2.0;

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kept({} lists)", self.points.len())
    }
}

impl Kept {
    fn new(points: &[V3], normals: &[V3], sigma: &[f64]) -> Self {
        let largest = sigma.iter().fold(0.0f64, |a, &b| a.max(b));
        let mean = sigma.iter().sum::<f64>() / sigma.len().max(1) as f64;
        let (reach, lists) = if largest <= ALIKE * mean {
            let reach = SKIN * CUTOFF * largest;
            (vec![reach], Neighbors::on_sheets(points, normals, Reach::Same(reach)))
        } else {
            let reach: Vec<f64> = sigma.iter().map(|s| SKIN * CUTOFF * s).collect();
            let lists = Neighbors::on_sheets(points, normals, Reach::Each(&reach));
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
    let places = Places::new(points, sigma);
    let mut force = vec![Force::default(); points.len()];
    let arch = Arch::new();
    force.par_chunks_mut(CHUNK).enumerate().for_each(|(c, force)| {
        arch.dispatch(Sums {
            first: c * CHUNK,
            force,
            points,
            normals,
            sigma,
            alpha,
            lists,
            places: &places,
        });
    });
    force
}

/// Floaters that one task handles.
const CHUNK: usize = 1024;
/// Pairs that are evaluated together: a fixed number, so that no vector width changes a sum.
const LANES: usize = 8;
/// Vectors that hold them.
const PARTS: usize = LANES / Single::WIDTH;
/// A [`Places`]' row.
type Row = <Single as WideSingle>::Row;
/// Where the energies end, in u = d²/2σ².
const END: f32 = (0.5 * CUTOFF * CUTOFF) as f32;

/// Floaters in single precision, a quarter of the loads and conversions of double precision.
struct Places {
    /// For each floater its place and its σ ([`Self::row`]); then one that is out of everybody's reach, for lanes without a neighbour.
    rows: Vec<Row>,
    /// The middle of the swarm.
    middle: V3,
    /// Half the size of the swarm.
    size: f64,
    /// The least σ.
    least: f64,
    /// Whether places are too coarse, so that differences are taken in double precision.
    coarse: bool,
}

/// Half sizes of a swarm in least σ beyond which places in single precision are off by more than 6e-5 σ.
const FINE: f64 = 1024.0;
/// Where the floater is that is out of reach, in half sizes: finite in σ.
const OUT: f32 = 1e12;

impl Places {
    fn new(points: &[V3], sigma: &[f64]) -> Self {
        let least = sigma.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            (lo, hi) = ([0, 1, 2].map(|a| lo[a].min(p[a])), [0, 1, 2].map(|a| hi[a].max(p[a])));
        }
        let middle = [0, 1, 2].map(|a| 0.5 * (lo[a] + hi[a]));
        let size = (0..3).map(|a| hi[a] - middle[a]).fold(least, f64::max);
        let mut places = Self { rows: Vec::new(), middle, size, least, coarse: size > FINE * least };
        let row = |(&p, &s): (&V3, &f64)| Single::row(places.row(p, middle, s));
        let mut rows: Vec<Row> = points.iter().zip(sigma).map(row).collect();
        rows.push(Single::row([OUT, 0.0, 0.0, 0.0]));
        places.rows = rows;
        places
    }

    /// The place of a floater from `origin` in half sizes of the swarm, and the square of the least σ over its own.
    #[inline(always)]
    fn row(&self, p: V3, origin: V3, sigma: f64) -> [f32; 4] {
        let per_size = 1.0 / self.size;
        let [x, y, z] = [0, 1, 2].map(|a| ((p[a] - origin[a]) * per_size) as f32);
        [x, y, z, ((self.least / sigma) * (self.least / sigma)) as f32]
    }
}

/// The sums over the neighbours of some floaters, in single precision: a force is rounded to 2e-5 of what one neighbour exerts, or as
/// [`FINE`] says, at any place and scale.
struct Sums<'a> {
    first: usize,
    force: &'a mut [Force],
    points: &'a [V3],
    normals: &'a [V3],
    sigma: &'a [f64],
    alpha: f64,
    lists: &'a Neighbors,
    places: &'a Places,
}

impl pulp::NullaryFnOnce for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for k in 0..self.force.len() {
            self.force[k] = self.sum(self.first + k);
        }
    }
}

impl Sums<'_> {
    /// The force on floater `i`.
    #[inline(always)]
    fn sum(&self, i: usize) -> Force {
        let Self { points, normals, alpha, places, .. } = self;
        let Places { rows, middle, coarse, .. } = places;
        let origin = if *coarse { points[i] } else { *middle };
        let own = self.sigma[i];
        let [x, y, z, _] = places.row(points[i], origin, own).map(Single::splat);
        let unit = Single::splat((places.size / own) as f32);
        let square = Single::splat(((own / places.least) * (own / places.least)) as f32);
        let none = [Single::splat(0.0); PARTS];
        // Force, energy and slope.
        let mut sums = [none; 5];
        for some in self.lists.of(i).chunks(LANES) {
            let mut at = full(some, (places.rows.len() - 1) as u32);
            let mut part = [Single::splat(1.0); PARTS];
            // Marked ones come last.
            if some[some.len() - 1] & Neighbors::MARK != 0 {
                let mut shares = [1.0f32; LANES];
                for (part, at) in shares.iter_mut().zip(&mut at) {
                    if *at & Neighbors::MARK != 0 {
                        *at &= !Neighbors::MARK;
                        let j = *at as usize;
                        *part = share(points[i], points[j], normals[i], normals[j]) as f32;
                    }
                }
                for l in 0..PARTS {
                    part[l] = Single::load(&shares[l * Single::WIDTH..]);
                }
            }
            let seen;
            let rows = if *coarse {
                seen = self.fine(i, &mut at);
                &seen
            } else {
                &rows[..]
            };
            // As columns; loops, because what takes closures is not always inlined, and then without wide vectors.
            let mut near = [none; 4];
            for l in 0..PARTS {
                let columns = Single::columns(rows, &at[l * Single::WIDTH..]);
                (near[0][l], near[1][l], near[2][l], near[3][l]) =
                    (columns[0], columns[1], columns[2], columns[3]);
            }
            for l in 0..PARTS {
                let (x, y, z) = ((x - near[0][l]) * unit, (y - near[1][l]) * unit, (z - near[2][l]) * unit);
                let ratio = near[3][l] * square;
                let u = Single::splat(0.5) * (x * x + y * y + z * z);
                let (ij, ji) = (part[l] * faded(u), part[l] * faded(u * ratio));
                // Eq. 9 with r^ji = -r^ij: (σ^i)² [r^ij/(σ^i)² E^ij + r^ij/(σ^j)² E^ji].
                let push = ij + ji * ratio;
                sums[0][l] += push * x;
                sums[1][l] += push * y;
                sums[2][l] += push * z;
                sums[3][l] += ij;
                sums[4][l] += u.if_less(Single::splat(END), u * ij, Single::splat(0.0));
            }
        }
        // Hidden, for else the compiler takes the vectors apart in the loop already.
        let [x, y, z, energy, slope] = totals(std::hint::black_box(&sums));
        Force {
            desired: [alpha * own * x, alpha * own * y, alpha * own * z],
            energy: alpha * energy,
            energy_by_sigma: 2.0 * alpha / own * slope,
        }
    }

    /// The rows of floaters, as far as there are such, seen from floater `i`; `at` then says where in them they are.
    #[cold]
    fn fine(&self, i: usize, at: &mut [u32; LANES]) -> [Row; LANES] {
        let mut rows = [self.places.rows[self.points.len()]; LANES];
        for l in 0..LANES {
            if let Some(&q) = self.points.get(at[l] as usize) {
                rows[l] = Single::row(self.places.row(q, self.points[i], self.sigma[at[l] as usize]));
            }
            at[l] = l as u32;
        }
        rows
    }
}

/// The sums over all lanes.
#[inline(always)]
fn totals(sums: &[[Single; PARTS]; 5]) -> [f64; 5] {
    let mut totals = [0.0; 5];
    for (total, parts) in totals.iter_mut().zip(sums) {
        let mut lanes = [0.0; LANES];
        for l in 0..PARTS {
            parts[l].store(&mut lanes[l * Single::WIDTH..]);
        }
        *total = fold(lanes);
    }
    totals
}

/// A chunk of a list as full lanes; those without a neighbour have `none`.
#[inline(always)]
fn full(some: &[u32], none: u32) -> [u32; LANES] {
    if let Ok(full) = some.try_into() {
        return full;
    }
    let mut lanes = [none; LANES];
    for (lane, entry) in lanes.iter_mut().zip(some) {
        *lane = *entry;
    }
    lanes
}

/// exp(-u), cut off.
#[inline(always)]
fn faded(u: Single) -> Single {
    let end = Single::splat(END);
    u.if_less(end, gauss_single(u.if_less(end, u, end)), Single::splat(0.0))
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

    #[test]
    fn forces_are_as_exact_where_parts_are_far_apart() {
        // One cloud, and the same with a twin so far away that single precision holds nothing of either.
        let rng = Rng::new(4, Stream::Jitter);
        let cloud: Vec<V3> = (0..40).map(|i| [0, 1, 2].map(|a| rng.unit(3 * i + a))).collect();
        let sigma: Vec<f64> = (0..40).map(|i| 0.15 + 0.2 * rng.unit(1000 + i)).collect();
        let alone = forces(&cloud, &[[0.0; 3]; 40], &sigma, 6.0, &mut None);
        for (away, exact) in [(200.0, 5e-3), (1e3, 1e-4), (1e9, 1e-4)] {
            let twin = cloud.iter().map(|p| [p[0] + away, p[1], p[2]]);
            let both: Vec<V3> = cloud.iter().copied().chain(twin).collect();
            let twice: Vec<f64> = sigma.iter().chain(&sigma).copied().collect();
            let force = forces(&both, &[[0.0; 3]; 80], &twice, 6.0, &mut None);
            for (i, (a, b)) in force.iter().zip(&alone).enumerate() {
                let off = sub(a.desired, b.desired);
                assert!(dot(off, off).sqrt() < exact, "{i} at {away}: {off:?}");
                assert!((a.energy - b.energy).abs() < exact, "{i} at {away}: {}", a.energy - b.energy);
            }
        }
    }
}
