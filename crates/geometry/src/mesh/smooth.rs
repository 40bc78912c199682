//! Vertices moved within the surface so that triangles become better shaped.

use isoswarm_field::vector::{V3, add, along, cross, dot, norm, scale, sub, tangential, unit};
use isoswarm_field::{FieldError, Surface};
use rayon::prelude::*;

use super::connect::{NONE, Triangles};
use super::vertices::{Vertices, pull};

/// Longest move of a step, in lengths of the longest edge at the vertex.
const LONGEST: f64 = 0.25;

/// Moves every vertex that is not `held` to the mean of its triangles' circumcentres, weighted by area, in its tangent plane
/// (optimal Delaunay triangulations: Chen and Holst 2011; Alliez et al. 2005), those on a face of the bounds to the middle between their
/// neighbours there, and all back to the surface by a Newton step. What would turn a triangle over stays. Gives the root mean square move in
/// lengths of edges.
pub(super) fn smooth(
    surface: &dyn Surface,
    triangles: &Triangles,
    vertices: &mut Vertices,
    held: &[bool],
) -> Result<f64, FieldError> {
    let n = vertices.len();
    let (mut sum, mut weight, mut longest) = (vec![[0.0; 3]; n], vec![0.0; n], vec![0.0f64; n]);
    let mut ends = vec![0u8; n];
    let aims: Vec<Aim> = triangles
        .faces
        .par_iter()
        .with_min_len(2048)
        .map(|f| aim(f.map(|v| vertices.points[v as usize])))
        .collect();
    for ((f, across), &Aim { centre, area, side, .. }) in
        triangles.faces.iter().zip(&triangles.across).zip(&aims)
    {
        for k in 0..3 {
            let (v, next) = (f[k] as usize, f[(k + 1) % 3]);
            longest[v] = longest[v].max(side);
            if vertices.faces[v] == 0 {
                sum[v] = along(sum[v], area, centre);
                weight[v] += area;
            }
            if across[k] == NONE {
                for (v, w) in [(v, next as usize), (next as usize, v)] {
                    if vertices.faces[v] != 0 {
                        sum[v] = along(sum[v], 1.0, vertices.points[w]);
                        weight[v] += 1.0;
                        ends[v] += 1;
                    }
                }
            }
        }
    }
    let still = |v: usize| {
        let face = vertices.faces[v];
        held[v] || weight[v] <= 0.0 || (face != 0 && (face.count_ones() > 1 || ends[v] != 2))
    };
    let mut next: Vec<V3> = (0..n)
        .into_par_iter()
        .with_min_len(4096)
        .map(|v| {
            let (p, normal) = (vertices.points[v], vertices.normals[v]);
            if still(v) || normal == [0.0; 3] {
                return p;
            }
            let way = sub(sum[v].map(|s| s / weight[v]), p);
            let step = match vertices.faces[v] {
                0 => tangential(way, normal),
                face => {
                    let a = face.trailing_zeros() as usize;
                    let mut across = [0.0; 3];
                    across[a] = 1.0;
                    let t = unit(cross(normal, across));
                    t.map(|c| c * dot(way, t))
                }
            };
            let (length, most) = (norm(step), LONGEST * longest[v]);
            along(p, if length > most { most / length } else { 1.0 }, step)
        })
        .collect();
    let mut normals = vertices.normals.clone();
    let left = pull(surface, &mut next, &mut normals, &vertices.faces, |v| LONGEST * longest[v], 1)?;
    for v in 0..n {
        if still(v) || left[v].is_infinite() {
            (next[v], normals[v]) = (vertices.points[v], vertices.normals[v]);
        }
    }
    undo_turned(triangles, &aims, vertices, &mut next, &mut normals);
    let squares = |v: usize| {
        let d = sub(next[v], vertices.points[v]);
        if longest[v] > 0.0 { dot(d, d) / (longest[v] * longest[v]) } else { 0.0 }
    };
    let moved = ((0..n).map(squares).sum::<f64>() / n.max(1) as f64).sqrt();
    (vertices.points, vertices.normals) = (next, normals);
    Ok(moved)
}

/// Puts back the vertices of triangles that would face the other way, until there are none.
fn undo_turned(
    triangles: &Triangles,
    aims: &[Aim],
    vertices: &Vertices,
    next: &mut [V3],
    normals: &mut [V3],
) {
    for _ in 0..8 {
        let turned: Vec<u32> = triangles
            .faces
            .par_iter()
            .zip(aims)
            .with_min_len(4096)
            .filter(|(f, aim)| {
                let [p, q, r] = f.map(|v| next[v as usize]);
                dot(aim.normal, cross(sub(q, p), sub(r, p))) <= 0.8 * aim.area * aim.area
                    && f.iter().any(|&v| vertices.points[v as usize] != next[v as usize])
            })
            .flat_map_iter(|(f, _)| *f)
            .collect();
        if turned.is_empty() {
            return;
        }
        for v in turned {
            next[v as usize] = vertices.points[v as usize];
            normals[v as usize] = vertices.normals[v as usize];
        }
    }
}

/// What a triangle wants of its corners.
struct Aim {
    /// Where it draws them: its circumcentre or, where that lies outside, the point where the way there from the centroid leaves it.
    centre: V3,
    area: f64,
    /// The longest.
    side: f64,
    /// Twice the area long.
    normal: V3,
}

#[inline(always)]
fn aim([a, b, c]: [V3; 3]) -> Aim {
    let (x, y, z) = (sub(b, a), sub(c, a), sub(c, b));
    let (xx, yy, zz) = (dot(x, x), dot(y, y), dot(z, z));
    let normal = cross(x, y);
    let square = dot(normal, normal);
    let area = 0.5 * square.sqrt();
    let side = xx.max(yy).max(zz).sqrt();
    if square <= 1e-12 * side.powi(4) {
        let sum = add(add(a, b), c);
        return Aim { centre: [sum[0] / 3.0, sum[1] / 3.0, sum[2] / 3.0], area, side, normal };
    }
    // Barycentric weights of the circumcentre: a² (b² + c² - a²) for the corner opposite of side a.
    let s = [zz * (xx + yy - zz), yy * (xx + zz - yy), xx * (yy + zz - xx)];
    let least = s[0].min(s[1]).min(s[2]);
    let total = s[0] + s[1] + s[2];
    let t = if least < 0.0 { (total / 3.0) / (total / 3.0 - least) } else { 1.0 };
    let weight = |v: f64| (1.0 - t) / 3.0 + t * v / total;
    let centre = along(along(scale(a, weight(s[0])), weight(s[1]), b), weight(s[2]), c);
    Aim { centre, area, side, normal }
}
