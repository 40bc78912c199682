//! Vertices moved within the surface so that triangles become better shaped.

use isoswarm_field::vector::{V3, along, cross, dot, norm, sub, tangential, unit};
use isoswarm_field::{FieldError, Surface};
use rayon::prelude::*;

use super::connect::Triangles;

/// Moves every vertex that is not `fixed` to the mean of its triangles' circumcentres, weighted by area, in its tangent plane
/// (optimal Delaunay triangulations: Chen and Holst 2011; Alliez et al. 2005), and back to the surface by a Newton step. What would turn a
/// triangle over stays. Gives the largest move in lengths of edges.
pub(super) fn smooth(
    surface: &dyn Surface,
    triangles: &Triangles,
    points: &mut [V3],
    normals: &mut [V3],
    fixed: &[bool],
) -> Result<f64, FieldError> {
    let n = points.len();
    let (mut sum, mut weight, mut longest) = (vec![[0.0; 3]; n], vec![0.0; n], vec![0.0f64; n]);
    for f in &triangles.faces {
        let t = f.map(|v| points[v as usize]);
        let (centre, area, side) = aim(t);
        for &v in f {
            let v = v as usize;
            sum[v] = along(sum[v], area, centre);
            weight[v] += area;
            longest[v] = longest[v].max(side);
        }
    }
    let mut next: Vec<V3> = (0..n)
        .into_par_iter()
        .with_min_len(4096)
        .map(|v| {
            if fixed[v] || weight[v] <= 0.0 || normals[v] == [0.0; 3] {
                return points[v];
            }
            let to = sum[v].map(|s| s / weight[v]);
            let step = tangential(sub(to, points[v]), normals[v]);
            let length = norm(step);
            let most = 0.25 * longest[v];
            along(points[v], if length > most { most / length } else { 1.0 }, step)
        })
        .collect();
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    surface.value_gradient(&next, &mut value, &mut gradient)?;
    let mut front = normals.to_vec();
    for v in 0..n {
        let g = gradient[v];
        let square = dot(g, g);
        if fixed[v] || next[v] == points[v] {
            next[v] = points[v];
            continue;
        }
        let k = value[v] / square;
        if !(k.is_finite() && k.abs() * square.sqrt() < 0.25 * longest[v]) {
            next[v] = points[v];
            continue;
        }
        next[v] = along(next[v], -k, g);
        front[v] = unit(g);
    }
    undo_turned(triangles, points, normals, &mut next, &mut front);
    let moved = (0..n)
        .filter(|&v| longest[v] > 0.0)
        .map(|v| norm(sub(next[v], points[v])) / longest[v])
        .fold(0.0, f64::max);
    points.copy_from_slice(&next);
    normals.copy_from_slice(&front);
    Ok(moved)
}

/// Puts back the vertices of triangles that would face the other way, until there are none.
fn undo_turned(triangles: &Triangles, points: &[V3], normals: &[V3], next: &mut [V3], front: &mut [V3]) {
    for _ in 0..8 {
        let turned: Vec<u32> = triangles
            .faces
            .par_iter()
            .with_min_len(4096)
            .filter(|f| {
                let [a, b, c] = f.map(|v| points[v as usize]);
                let [p, q, r] = f.map(|v| next[v as usize]);
                let was = cross(sub(b, a), sub(c, a));
                dot(was, cross(sub(q, p), sub(r, p))) <= 0.2 * dot(was, was)
                    && f.iter().any(|&v| points[v as usize] != next[v as usize])
            })
            .flat_map_iter(|f| *f)
            .collect();
        if turned.is_empty() {
            return;
        }
        for v in turned {
            next[v as usize] = points[v as usize];
            front[v as usize] = normals[v as usize];
        }
    }
}

/// Where a triangle draws its corners (its circumcentre or, where that lies outside, a point of the way there from the centroid), its area and its
/// longest side.
fn aim([a, b, c]: [V3; 3]) -> (V3, f64, f64) {
    let (x, y, z) = (sub(b, a), sub(c, a), sub(c, b));
    let (xx, yy, zz) = (dot(x, x), dot(y, y), dot(z, z));
    let w = cross(x, y);
    let square = dot(w, w);
    let third = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
    let side = xx.max(yy).max(zz).sqrt();
    if square <= 1e-12 * side.powi(4) {
        return (third, 0.5 * square.sqrt(), side);
    }
    // Barycentric weights of the circumcentre: a² (b² + c² - a²) for the corner opposite of side a.
    let s = [zz * (xx + yy - zz), yy * (xx + zz - yy), xx * (yy + zz - xx)];
    let least = s.iter().fold(f64::INFINITY, |m, &v| m.min(v));
    let total = s[0] + s[1] + s[2];
    // As far as the edge where the triangle is obtuse.
    let t = if least < 0.0 { (total / 3.0) / (total / 3.0 - least) } else { 1.0 };
    let bary = s.map(|v| (1.0 - t) / 3.0 + t * v / total);
    let centre = [0, 1, 2].map(|k| bary[0] * a[k] + bary[1] * b[k] + bary[2] * c[k]);
    (centre, 0.5 * square.sqrt(), side)
}
