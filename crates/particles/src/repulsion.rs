//! The repulsion between floaters of fixed number: Gaussian (WH94 eq. 6), in single precision.
//!
//! Distances are taken in double precision and then measured in σ, so that only the force is rounded: to 1e-6 of what one
//! neighbour exerts, at any place and scale.

use crate::kernel::gauss_single;
use crate::neighbors::Neighbors;
use crate::swarm::share;
use crate::vector::V3;

/// Repulsion ends at this many σ: at 3 it stalls, beyond 4 it costs more than it brings.
pub(crate) const CUTOFF: f64 = 4.0;

/// Neighbours that are handled side by side. The sums run over as many partial sums, whatever the width of the
/// machine's vectors, so that they give the same bits everywhere.
const LANES: usize = 8;

/// The force of a Gaussian fades below σ, so that pressure (over a crease, against the bounds) could hold floaters on
/// one spot. So much stronger is it made towards a distance of zero; beyond σ it is the Gaussian's.
const CORE: f32 = 8.0;

/// Σ share r^ij exp(-|r^ij|²/2σ²), σ² the mean of the squares of both where sizes differ, and Σ share | |r|²/σ² - 1 | exp(...),
/// which bounds how fast it changes.
#[inline(always)]
pub(crate) fn repulsion(
    i: usize,
    points: &[V3],
    normals: &[V3],
    near: &[u32],
    size: &[f64],
    sigma: f64,
) -> (V3, f64) {
    /// Half the square of the cutoff.
    const END: f32 = (0.5 * CUTOFF * CUTOFF) as f32;
    let p = points[i];
    let inverse = 1.0 / sigma;
    let mut sums = [[0.0f32; LANES]; 4];
    for near in near.chunks(LANES) {
        // Beyond the cutoff, so that lanes without a neighbour add nothing.
        let (mut x, mut y, mut z) = ([1e3f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        let mut marks = 0;
        for (l, &entry) in near.iter().enumerate() {
            let q = points[(entry & !Neighbors::MARK) as usize];
            x[l] = ((p[0] - q[0]) * inverse) as f32;
            y[l] = ((p[1] - q[1]) * inverse) as f32;
            z[l] = ((p[2] - q[2]) * inverse) as f32;
            marks |= entry;
        }
        let mut square = [0.0f32; LANES];
        let mut least = f32::INFINITY;
        for l in 0..LANES {
            square[l] = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
            least = if square[l] < least { square[l] } else { least };
        }
        if least == 0.0 {
            part_coincident(i, near, [&mut x, &mut y, &mut z], &mut square);
        }
        let (mut part, mut half) = ([1.0f32; LANES], [0.5f32; LANES]);
        if marks & Neighbors::MARK != 0 {
            for (l, &entry) in near.iter().enumerate().filter(|e| e.1 & Neighbors::MARK != 0) {
                let j = (entry & !Neighbors::MARK) as usize;
                part[l] = share(p, points[j], normals[i], normals[j]) as f32;
            }
        }
        if !size.is_empty() {
            for (l, &entry) in near.iter().enumerate() {
                let (a, b) = (size[i], size[(entry & !Neighbors::MARK) as usize]);
                half[l] = (1.0 / (a * a + b * b)) as f32;
            }
        }
        for l in 0..LANES {
            let u = half[l] * square[l];
            let near = if u < END { u } else { END };
            let w = if u < END { gauss_single(near) } else { 0.0 };
            let t = if u < 0.5 { 1.0 - 2.0 * u } else { 0.0 };
            let w = part[l] * (w + CORE * w * (t * t));
            sums[0][l] += w * x[l];
            sums[1][l] += w * y[l];
            sums[2][l] += w * z[l];
            sums[3][l] += w * (2.0 * u - 1.0).abs();
        }
    }
    let [fx, fy, fz, stiffness] = sums.map(fold);
    ([sigma * fx, sigma * fy, sigma * fz], stiffness)
}

/// On one spot there is no direction; any will do if the other takes the opposite one.
#[cold]
#[inline(never)]
fn part_coincident(i: usize, near: &[u32], [x, y, z]: [&mut [f32; LANES]; 3], square: &mut [f32; LANES]) {
    for (l, &entry) in near.iter().enumerate() {
        if square[l] != 0.0 {
            continue;
        }
        let way = if i < (entry & !Neighbors::MARK) as usize { 1e-3 } else { -1e-3 };
        (x[l], y[l], z[l]) = (way, 0.7 * way, 0.4 * way);
        square[l] = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
    }
}

/// The sum of the lanes in a fixed order.
#[inline(always)]
pub(crate) fn fold(v: [f32; LANES]) -> f64 {
    f64::from(((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])))
}
