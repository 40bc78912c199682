//! Floaters in (u, v) that repel each other in space (WH94 section 4.1, with a heavy ball).

use isoswarm_field::FieldError;
use rayon::prelude::*;

use super::{Patch, Places, pull_back};
use crate::kernel::gauss;
use crate::neighbors::{Neighbors, Reach};
use crate::swarm::same_sheet;
use crate::vector::{V3, add, cross, distance, dot, norm, scale, sub, tangential, unit};

/// Radius of repulsion in square roots of a floater's share, gain, momentum and steps of each phase: from random places,
/// then with longer steps, then among nearest neighbours only.
const PHASES: [(f64, f64, f64, usize); 3] =
    [(0.45, 0.72, 0.9, 60), (0.42, 2.5, 0.8, 80), (0.31, 5.0, 0.7, 16)];
/// Repulsion ends at so many radii; lists are drawn this much wider and serve for a few steps.
const CUTOFF: f64 = 4.0;
const SKIN: f64 = 0.8;
const SERVE: usize = 4;
/// Longest step in radii.
const LONGEST: f64 = 0.3;
/// Root mean square step in radii at which the middle phase ends.
const SETTLED: f64 = 0.02;
/// The same at which floaters count as at rest.
const AT_REST: f64 = 0.1;
/// A floater that lands farther than this many steps from where it set out stays there.
const ASTRAY: f64 = 3.0;
/// Part of a parameter's range that a floater moves at most in a step: near poles parameters are all direction.
const TURN: f64 = 0.25;

/// What came of it.
pub(super) struct Relaxed {
    pub(super) uv: Vec<[f64; 2]>,
    pub(super) steps: usize,
    pub(super) settled: bool,
}

/// Spreads floaters, the first `fixed` of which stay where they are; `share` is the square root of a floater's area.
pub(super) fn relax(
    patch: &Patch<'_>,
    mut uv: Vec<[f64; 2]>,
    fixed: usize,
    share: f64,
) -> Result<Relaxed, FieldError> {
    let mut places = patch.look(&uv)?;
    let mut velocity = vec![[0.0; 3]; uv.len()];
    let (mut steps, mut rms) = (0, f64::INFINITY);
    for (k, (sigma, gain, momentum, most)) in PHASES.into_iter().enumerate() {
        let sigma = sigma * share;
        let mut lists = Neighbors::default();
        for step in 0..most {
            if step % SERVE == 0 {
                lists = surroundings(patch, &places, (CUTOFF + SKIN) * sigma);
            }
            let moved = displace(&places, &lists, &velocity, (sigma, gain, momentum), fixed);
            rms = settle(patch, &mut uv, &mut places, &mut velocity, moved, sigma)? / sigma;
            steps += 1;
            if k == 1 && rms < SETTLED {
                break;
            }
        }
    }
    Ok(Relaxed { uv, steps, settled: rms < AT_REST })
}

fn normals(places: &Places) -> Vec<V3> {
    (0..places.x.len()).map(|i| unit(cross(places.xu[i], places.xv[i]))).collect()
}

/// Who is near whom on one sheet. A surface with one side has no outward normals: theirs are turned as needed.
fn surroundings(patch: &Patch<'_>, places: &Places, reach: f64) -> Neighbors {
    let normals = normals(places);
    let turns = patch.domain.is_twisted();
    Neighbors::find(&places.x, Reach::Same(reach), |i, j| {
        let (n, m) = (normals[i], normals[j]);
        let m = if turns && dot(n, m) < 0.0 { scale(m, -1.0) } else { m };
        same_sheet(places.x[i], places.x[j], n, m)
    })
}

/// Displacements in the tangent planes.
fn displace(
    places: &Places,
    lists: &Neighbors,
    velocity: &[V3],
    (sigma, gain, momentum): (f64, f64, f64),
    fixed: usize,
) -> Vec<V3> {
    let (reach, twice) = (CUTOFF * sigma, 0.5 / (sigma * sigma));
    (0..places.x.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| {
            if i < fixed {
                return [0.0; 3];
            }
            let x = places.x[i];
            let mut force = [0.0; 3];
            for &j in lists.of(i) {
                let r = sub(x, places.x[j as usize]);
                let square = dot(r, r);
                if square < reach * reach {
                    force = add(force, scale(r, gauss(square * twice)));
                }
            }
            let n = unit(cross(places.xu[i], places.xv[i]));
            let d = tangential(add(scale(force, gain), scale(velocity[i], momentum)), n);
            let length = norm(d);
            if length > LONGEST * sigma { scale(d, LONGEST * sigma / length) } else { d }
        })
        .collect()
}

/// Moves the floaters, and gives the root mean square of how far they came.
fn settle(
    patch: &Patch<'_>,
    uv: &mut [[f64; 2]],
    places: &mut Places,
    velocity: &mut [V3],
    moved: Vec<V3>,
    sigma: f64,
) -> Result<f64, FieldError> {
    let domain = patch.domain();
    let aim: Vec<[f64; 2]> = (0..uv.len())
        .map(|i| {
            let change = pull_back(places.xu[i], places.xv[i], moved[i]);
            let bounded = |a: usize| {
                let most = TURN * domain.length(a);
                if change[a].is_finite() { change[a].clamp(-most, most) } else { 0.0 }
            };
            domain.inside([uv[i][0] + bounded(0), uv[i][1] + bounded(1)], &patch.poles)
        })
        .collect();
    let next = patch.look(&aim)?;
    let mut sum = 0.0;
    for i in 0..uv.len() {
        let way = distance(next.x[i], places.x[i]);
        if way.is_nan() || way > ASTRAY * norm(moved[i]) + 1e-3 * sigma {
            velocity[i] = [0.0; 3];
            continue;
        }
        velocity[i] = sub(next.x[i], places.x[i]);
        (uv[i], places.x[i], places.xu[i], places.xv[i]) = (aim[i], next.x[i], next.xu[i], next.xv[i]);
        sum += way * way;
    }
    Ok((sum / uv.len().max(1) as f64).sqrt())
}
