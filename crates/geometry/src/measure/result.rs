//! What is reported: from sums of integrals to measures with errors.

use isoswarm_field::vector::V3;

use super::directions::boundary;
use super::gaps::Gaps;
use super::integrals::{
    AREA, BUILT_IN, GAUSSIAN_CURVATURE, MEAN_CURVATURE, SHELL_FIRST, SHELL_SECOND, SOLID_FIRST, SOLID_SECOND,
    Sums, THIN_PLATE, VOLUME, WILLMORE,
};
use crate::mesh::{Mesh, Topology};

/// The error is so many times the difference of the two rules.
const SAFETY: f64 = 2.0;

/// A number and how far it may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Bound on its error; an estimate that is meant to hold, not a proof.
    pub error: f64,
}

/// Centre and inertia of a body of density 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Centroid (model units).
    pub centroid: [Estimate; 3],
    /// Inertia tensor about the centroid, ∫ (r·r I - r rᵀ): xx, xy, xz, yy, yz, zz (model units to the fifth for a solid,
    /// to the fourth for a shell).
    pub inertia: [Estimate; 6],
}

/// Measures of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Measures {
    /// Area.
    pub area: Estimate,
    /// Volume where F < 0; `None` for a surface that bounds none.
    pub volume: Option<Estimate>,
    /// Centre and inertia of the solid F < 0; `None` where there is no volume.
    pub solid: Option<Moment>,
    /// Centre and inertia of the surface itself, as a thin shell.
    pub shell: Moment,
    /// ∫ H dA with H = (κ₁ + κ₂)/2, positive where convex. The four curvature integrals are `None` where the field has no
    /// second derivatives.
    pub mean_curvature: Option<Estimate>,
    /// ∫ κ₁ κ₂ dA: 2π times the Euler characteristic of a closed surface (Gauss and Bonnet).
    pub gaussian_curvature: Option<Estimate>,
    /// ∫ H² dA, Willmore's energy: 4π for a sphere, no less for any closed surface.
    pub willmore: Option<Estimate>,
    /// ∫ (κ₁² + κ₂²) dA, the energy of a thin plate.
    pub thin_plate: Option<Estimate>,
    /// The Euler characteristic that the mesh has.
    pub euler: i64,
    /// ∫ K dA / 2π - χ, which is 0 for a closed surface without creases whose topology the mesh has.
    pub gauss_bonnet: Option<f64>,
    /// The user's integrals, in their order.
    pub integrals: Vec<Estimate>,
    /// Weights of the mesh's vertices: Σ w f(p) approximates ∫ f dA, and Σ w is the area. Empty where not asked for.
    pub weights: Vec<f64>,
    /// Places where the quadrature did not settle, and ends of the surface: at most 1000.
    pub places: Vec<[f64; 3]>,
    /// What is not guaranteed, and why; empty where all is well.
    pub notes: Vec<String>,
    /// Whether the errors can be relied on: the mesh covers the surface once, as far as can be told. Not so where it has holes inside
    /// the bounds or is no oriented manifold: then the errors are wide guesses.
    pub reliable: bool,
}

/// Centroid and inertia from ∫ 1, ∫ x and ∫ x xᵀ, coordinates relative to the origin that they were taken from.
fn moment(mass: f64, first: &[f64], second: &[f64]) -> [f64; 9] {
    let c = [0, 1, 2].map(|a| first[a] / mass);
    let about = |k: usize, i: usize, j: usize| second[k] - mass * c[i] * c[j];
    let (xx, xy, xz) = (about(0, 0, 0), about(1, 0, 1), about(2, 0, 2));
    let (yy, yz, zz) = (about(3, 1, 1), about(4, 1, 2), about(5, 2, 2));
    [c[0], c[1], c[2], yy + zz, -xy, -xz, xx + zz, -yz, xx + yy]
}

fn solid(s: &[f64]) -> Vec<f64> {
    moment(s[VOLUME], &s[SOLID_FIRST..], &s[SOLID_SECOND..SOLID_SECOND + 6]).to_vec()
}

fn shell(s: &[f64]) -> Vec<f64> {
    moment(s[AREA], &s[SHELL_FIRST..], &s[SHELL_SECOND..SHELL_SECOND + 6]).to_vec()
}

/// Estimates of functions of the integrals.
struct Errors {
    reported: Vec<f64>,
    check: Vec<f64>,
    slack: Vec<f64>,
}

impl Errors {
    fn of(&self, f: impl Fn(&[f64]) -> Vec<f64>) -> Vec<Estimate> {
        let (value, check) = (f(&self.reported), f(&self.check));
        let mut error: Vec<f64> = value.iter().zip(&check).map(|(v, c)| SAFETY * (c - v).abs()).collect();
        let mut s = self.reported.clone();
        for j in 0..s.len() {
            s[j] = self.reported[j] + self.slack[j];
            f(&s).iter().zip(&value).zip(&mut error).for_each(|((m, v), e)| *e += (m - v).abs());
            s[j] = self.reported[j];
        }
        value.into_iter().zip(error).map(|(value, error)| Estimate { value, error }).collect()
    }

    fn one(&self, j: usize) -> Estimate {
        let value = self.reported[j];
        Estimate { value, error: SAFETY * (self.check[j] - value).abs() + self.slack[j] }
    }

    fn moment(&self, f: impl Fn(&[f64]) -> Vec<f64>, origin: V3) -> Moment {
        let all = self.of(f);
        let rounding = |o: f64| 2.0 * f64::EPSILON * o.abs();
        let at = |a: usize| Estimate {
            value: all[a].value + origin[a],
            error: all[a].error + rounding(origin[a]),
        };
        Moment { centroid: [at(0), at(1), at(2)], inertia: [3, 4, 5, 6, 7, 8].map(|k| all[k]) }
    }
}

/// The mesh that was integrated over, its topology, and what it may leave out.
pub(super) struct Over<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) topology: &'a Topology,
    pub(super) gaps: Gaps,
}

pub(super) fn collect(
    sums: &Sums,
    over: &Over,
    origin: V3,
    has_curvature: bool,
    weights: Vec<f64>,
    mut places: Vec<V3>,
) -> Measures {
    let Over { mesh, topology, gaps } = *over;
    let errors = Errors { reported: sums.reported(), check: sums.check(), slack: sums.slack(gaps.area) };
    let closed = topology.is_closed();
    let mut notes = Vec::new();
    let reliable = topology.is_manifold() && gaps.holes == 0;
    if !places.is_empty() {
        notes.push(format!(
            "the quadrature did not settle at {}{} places (creases, singular points, or triangles too coarse for the \
             surface); the errors account for it",
            places.len(),
            if places.len() == super::MOST_PLACES { " or more" } else { "" }
        ));
    }
    if !topology.is_manifold() {
        notes.push(format!(
            "the mesh is no oriented manifold ({}): it does not cover the surface once, so no number is guaranteed",
            topology.faults[0]
        ));
    } else if !closed {
        notes.push(format!(
            "the surface is open ({} boundary loops): it bounds no volume; close it, or intersect the model with a box",
            topology.boundaries
        ));
        if gaps.holes > 0 {
            notes.push(format!(
                "{} of the loops do not lie on the box: the mesh has holes there, and an area of about {:.1e} may be missing; the \
                 errors account for it as a guess. Ask for more samples, or for smaller ones where the surface bends",
                gaps.holes, gaps.area
            ));
        }
        let room = super::MOST_PLACES - places.len().min(super::MOST_PLACES);
        places.extend(boundary(mesh).into_iter().take(room).map(|v| mesh.points[v as usize]));
    }
    let curvature = |j: usize| has_curvature.then(|| errors.one(j));
    let gaussian = curvature(GAUSSIAN_CURVATURE);
    let euler = topology.total_euler();
    let gauss_bonnet = gaussian.filter(|_| closed).map(|k| k.value / std::f64::consts::TAU - euler as f64);
    if let (Some(off), Some(k)) = (gauss_bonnet, gaussian)
        && off.abs() > 1e-3 + k.error / std::f64::consts::TAU
    {
        notes.push(format!(
            "the Gaussian curvature integrates to {:.4} times 2π, and the mesh's Euler characteristic is {euler}: \
             the surface has creases or singular points, or the mesh has another topology than the surface",
            euler as f64 + off
        ));
    }
    Measures {
        area: errors.one(AREA),
        volume: closed.then(|| errors.one(VOLUME)),
        solid: closed.then(|| errors.moment(solid, origin)),
        shell: errors.moment(shell, origin),
        mean_curvature: curvature(MEAN_CURVATURE),
        gaussian_curvature: gaussian,
        willmore: curvature(WILLMORE),
        thin_plate: curvature(THIN_PLATE),
        euler,
        gauss_bonnet,
        integrals: (BUILT_IN..errors.reported.len()).map(|j| errors.one(j)).collect(),
        weights,
        places,
        notes,
        reliable,
    }
}
