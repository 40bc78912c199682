//! Principal curvatures, from the Hessian or, where there is none, from the neighbours.

use isoswarm_field::Surface;
use rayon::prelude::*;

use crate::neighbors::Neighbors;
use crate::swarm::Swarm;
use crate::vector::{V3, distance, dot, frame, norm, sub, unit};

/// Floaters whose curvatures one task computes, at least.
const TASK: usize = 256;
/// Floaters whose Hessians are held at a time.
const BATCH: usize = 1 << 16;

/// Distances to the nearest neighbour, in radii of curvature, from which on a curvature is doubted.
const STEEP: f64 = 1.0;
/// Cosine between the normals of floaters that are on one side of a crease, as far as they tell.
const LEVEL: f64 = 0.7;

/// Principal curvatures of the surface through each point, largest magnitude first (1/model units; positive where convex seen
/// from outside), from the Hessian: of F = 0 for points on it, of the level that they are on for others. NaN where the field
/// has no second derivatives or its gradient vanishes.
pub fn principal_curvatures(surface: &dyn Surface, points: &[V3]) -> Vec<[f64; 2]> {
    let mut out = Vec::with_capacity(points.len());
    for points in points.chunks(BATCH) {
        let n = points.len();
        let (mut value, mut gradient, mut hessian) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[0.0; 6]; n]);
        let narrowed = surface.narrowed(points, 0.0).ok().flatten();
        let surface = narrowed.as_deref().unwrap_or(surface);
        let known = surface.value_gradient(points, &mut value, &mut gradient).is_ok()
            && surface.hessian(points, &mut hessian).is_ok();
        out.par_extend((0..n).into_par_iter().with_min_len(TASK).map(|k| {
            let normal = unit(gradient[k]);
            if known && normal != [0.0; 3] && hessian[k].iter().all(|h| h.is_finite()) {
                of_hessian(gradient[k], normal, hessian[k], surface.axes())
            } else {
                [f64::NAN; 2]
            }
        }));
    }
    out
}

/// Principal curvatures of every floater, largest magnitude first; positive where convex seen from outside.
pub(crate) fn principal(
    surface: &dyn Surface,
    swarm: &Swarm,
    lists: &Neighbors,
    axes: usize,
) -> Vec<[f64; 2]> {
    let mut out = Vec::with_capacity(swarm.len());
    for (batch, points) in swarm.points.chunks(BATCH).enumerate() {
        let n = points.len();
        let (mut value, mut gradient, mut hessian) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[0.0; 6]; n]);
        let narrowed = surface.narrowed(points, 0.0).ok().flatten();
        let surface = narrowed.as_deref().unwrap_or(surface);
        let known = surface.value_gradient(points, &mut value, &mut gradient).is_ok()
            && surface.hessian(points, &mut hessian).is_ok();
        let curvature = |k: usize| {
            let i = batch * BATCH + k;
            let normal = swarm.normals[i];
            if normal == [0.0; 3] {
                return [f64::NAN; 2];
            }
            let exact = known && hessian[k].iter().all(|h| h.is_finite());
            if !exact {
                return of_neighbors(swarm, lists, i, axes, |_| true);
            }
            let own = of_hessian(gradient[k], normal, hessian[k], axes);
            let nearest = lists.of(i).iter().map(|&j| distance(swarm.points[j as usize], swarm.points[i]));
            if own[0].abs() * nearest.fold(f64::INFINITY, f64::min) <= STEEP {
                return own;
            }
            // A distance that switches on the surface (|max(q, 0)| of a box) has second derivatives that are nothing but rounding
            // there: the neighbours on the same side know better.
            let level = |j: usize| dot(swarm.normals[j], normal) > LEVEL && !swarm.is_held(j);
            let seen = of_neighbors(swarm, lists, i, axes, level);
            if seen[0].abs() < own[0].abs() { seen } else { own }
        };
        out.par_extend((0..n).into_par_iter().with_min_len(TASK).map(curvature));
    }
    out
}

/// Goldman's formulas: the eigenvalues of the Hessian, restricted to the tangent plane, over |∇F|.
pub(crate) fn of_hessian(gradient: V3, normal: V3, h: [f64; 6], axes: usize) -> [f64; 2] {
    let times = |v: V3| {
        [
            h[0] * v[0] + h[1] * v[1] + h[2] * v[2],
            h[1] * v[0] + h[3] * v[1] + h[4] * v[2],
            h[2] * v[0] + h[4] * v[1] + h[5] * v[2],
        ]
    };
    let length = norm(gradient);
    if axes == 2 {
        let t = [-normal[1], normal[0], 0.0];
        return [dot(t, times(t)) / length, 0.0];
    }
    let (u, v) = frame(normal);
    let (hu, hv) = (times(u), times(v));
    eigenvalues(dot(u, hu) / length, dot(u, hv) / length, dot(v, hv) / length)
}

/// Eigenvalues of a symmetric matrix of two rows, largest magnitude first.
fn eigenvalues(a: f64, b: f64, c: f64) -> [f64; 2] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let r = (half * half + b * b).sqrt();
    if mean >= 0.0 { [mean + r, mean - r] } else { [mean - r, mean + r] }
}

/// Least squares for the shape operator S: the change of the normal towards each neighbour is S times the way there.
pub(crate) fn of_neighbors(
    swarm: &Swarm,
    lists: &Neighbors,
    i: usize,
    axes: usize,
    keep: impl Fn(usize) -> bool,
) -> [f64; 2] {
    let (p, n) = (swarm.points[i], swarm.normals[i]);
    let near = lists.of(i).iter().map(|&j| j as usize).filter(|&j| swarm.normals[j] != [0.0; 3] && keep(j));
    if axes == 2 {
        let t = [-n[1], n[0], 0.0];
        let (mut a, mut b) = (0.0, 0.0);
        for j in near {
            let (x, y) = (dot(sub(swarm.points[j], p), t), dot(sub(swarm.normals[j], n), t));
            a += x * x;
            b += x * y;
        }
        return if a > 0.0 { [b / a, 0.0] } else { [f64::NAN; 2] };
    }
    let (u, v) = frame(n);
    // Normal equations of the three entries (s0, s1, s2) of S: (x s0 + y s1, x s1 + y s2) = change of the normal.
    let (mut xx, mut xy, mut yy, mut r) = (0.0, 0.0, 0.0, [0.0; 3]);
    for j in near {
        let (way, change) = (sub(swarm.points[j], p), sub(swarm.normals[j], n));
        let w = 1.0 / dot(way, way);
        let (x, y) = (dot(way, u), dot(way, v));
        let (cx, cy) = (dot(change, u), dot(change, v));
        xx += w * x * x;
        xy += w * x * y;
        yy += w * y * y;
        r = [r[0] + w * x * cx, r[1] + w * (y * cx + x * cy), r[2] + w * y * cy];
    }
    // [xx xy 0; xy xx+yy xy; 0 xy yy] s = r
    let m = xx + yy;
    let det = xx * (m * yy - xy * xy) - xy * xy * yy;
    if det.is_nan() || det <= 1e-12 * m * m * m {
        return [f64::NAN; 2];
    }
    let s0 = (r[0] * (m * yy - xy * xy) - xy * (r[1] * yy - xy * r[2])) / det;
    let s1 = (xx * (r[1] * yy - xy * r[2]) - xy * (r[0] * yy)) / det;
    let s2 = (xx * (m * r[2] - xy * r[1]) - xy * (xy * r[2]) + r[0] * xy * xy) / det;
    eigenvalues(s0, s1, s2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hessian_of_a_torus_and_a_circle() {
        // F = (sqrt(x²+y²) - 2)² + z² - 1/4 at the outer equator (2.5, 0, 0): curvatures 2 and 1/2.5.
        let g = [1.0, 0.0, 0.0];
        let h = [2.0, 0.0, 0.0, 2.0 * 0.5 / 2.5, 0.0, 2.0];
        let k = of_hessian(g, g, h, 3);
        assert!((k[0] - 2.0).abs() < 1e-14 && (k[1] - 0.4).abs() < 1e-14, "{k:?}");
        let k = of_hessian([4.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0, 2.0, 0.0, 0.0], 2);
        assert_eq!(k, [0.5, 0.0]);
    }

    #[test]
    fn neighbours_of_a_saddle() {
        // z = (3x² - y²)/2, normals (-3x, y, 1)/|.|, outward up: convex seen from above means negative here.
        let at =
            |x: f64, y: f64| ([x, y, 1.5 * x * x - 0.5 * y * y], crate::vector::unit([-3.0 * x, y, 1.0]));
        let mut swarm = Swarm::default();
        swarm.push(at(0.0, 0.0).0, at(0.0, 0.0).1, 0, None);
        for k in 0..7 {
            let a = f64::from(k) * 0.9;
            let (p, n) = at(0.01 * a.cos(), 0.01 * a.sin());
            swarm.push(p, n, 0, None);
        }
        let lists = swarm.neighbors(0.011);
        let k = of_neighbors(&swarm, &lists, 0, 3, |_| true);
        assert!((k[0] + 3.0).abs() < 5e-3 && (k[1] - 1.0).abs() < 5e-3, "{k:?}");
    }
}
