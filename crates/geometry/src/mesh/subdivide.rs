//! Every triangle into four: what meshes made coarse to fine grow by.

use isoswarm_field::vector::distance;
use isoswarm_field::{FieldError, Surface};

use super::connect::{NONE, Triangles};
use super::vertices::{Vertices, pull};

/// Newton steps that bring the middle of an edge to the surface.
const STEPS: usize = 2;
/// How far the middle of an edge may be from the surface, in lengths of the edge: an arc that turns by a radian rises by an
/// eighth of its chord, and some edges are longer than the spacing.
const FAR: f64 = 0.2;

/// Puts a vertex on the middle of every edge, on the surface (on the face of the bounds that both ends share), and makes four triangles
/// of each. Where some did not get there, nothing but their edges, each as a face and the corner at which it begins: there the triangles
/// are not those of a surface that is resolved.
pub(super) fn subdivide(
    surface: &dyn Surface,
    triangles: &Triangles,
    vertices: &mut Vertices,
) -> Result<Result<Triangles, Vec<(u32, u8)>>, FieldError> {
    let first = vertices.len();
    let middle = middles(triangles, vertices);
    let spacing = vertices.spacing[first..].to_vec();
    let before = vertices.points[first..].to_vec();
    let Vertices { points, normals, faces, .. } = &mut *vertices;
    let (points, normals, faces) = (&mut points[first..], &mut normals[first..], &faces[first..]);
    let left = pull(surface, points, normals, faces, |i| spacing[i], STEPS)?;
    let there = |i: usize| left[i].is_finite() && distance(points[i], before[i]) <= 2.0 * FAR * spacing[i];
    let astray: Vec<bool> = (0..points.len()).map(|i| !there(i)).collect();
    if astray.contains(&true) {
        vertices.retain(|i| i < first);
        let mut seen = vec![false; astray.len()];
        let mut edges = Vec::new();
        for (f, numbers) in middle.iter().enumerate() {
            for (k, &number) in numbers.iter().enumerate() {
                let i = number as usize - first;
                if astray[i] && !std::mem::replace(&mut seen[i], true) {
                    edges.push((f as u32, k as u8));
                }
            }
        }
        return Ok(Err(edges));
    }
    vertices.spacing[..first].iter_mut().for_each(|s| *s *= 0.5);
    Ok(Ok(children(triangles, &middle)))
}

/// Adds the middles of the edges; gives their numbers for each edge of each triangle.
fn middles(triangles: &Triangles, vertices: &mut Vertices) -> Vec<[u32; 3]> {
    let mut middle = vec![[NONE; 3]; triangles.faces.len()];
    for f in 0..triangles.faces.len() {
        for k in 0..3 {
            // Each edge is seen first from the face with the smaller number.
            if middle[f][k] != NONE {
                continue;
            }
            let (a, b) = (triangles.faces[f][k], triangles.faces[f][(k + 1) % 3]);
            let (p, q) = (vertices.points[a as usize], vertices.points[b as usize]);
            let on_boundary = triangles.across[f][k] == NONE && vertices.share_face(a, b);
            let faces = if on_boundary { vertices.common_faces(a, b) } else { 0 };
            let number = vertices.len() as u32;
            let at = [0, 1, 2].map(|k| 0.5 * p[k] + 0.5 * q[k]);
            vertices.push(at, vertices.normals[a as usize], 0.5 * distance(p, q), faces);
            middle[f][k] = number;
            if let Some((_, _, g, l)) = triangles.opposite(f, k) {
                middle[g][l] = number;
            }
        }
    }
    middle
}

/// The triangles at the corners of face `f` are 4 f to 4 f + 2, the one between them 4 f + 3.
fn children(triangles: &Triangles, middle: &[[u32; 3]]) -> Triangles {
    let mut out = Triangles::default();
    out.faces.reserve(4 * triangles.faces.len());
    out.across.reserve(4 * triangles.faces.len());
    for (f, (v, m)) in triangles.faces.iter().zip(middle).enumerate() {
        let other = |k: usize| triangles.opposite(f, k).map(|(_, _, g, l)| (4 * g, l));
        let f = 4 * f as u32;
        for k in 0..3 {
            let before = (k + 2) % 3;
            out.faces.push([v[k], m[k], m[before]]);
            // The edge runs the other way in the other face: this corner is at its end there.
            let after = other(k).map_or(NONE, |(g, l)| (g + (l + 1) % 3) as u32);
            out.across.push([after, f + 3, other(before).map_or(NONE, |(g, l)| (g + l) as u32)]);
        }
        out.faces.push([m[0], m[1], m[2]]);
        out.across.push([f + 1, f + 2, f]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_know_their_neighbours() {
        // An octahedron and, with a face less, its boundary.
        let faces: Vec<[u32; 3]> =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        for n in [8, 7] {
            let parents = Triangles::new(faces[..n].to_vec());
            let mut vertices = Vertices::default();
            for k in 0..6 {
                let mut p = [0.0; 3];
                p[k / 2] = if k % 2 == 0 { 1.0 } else { -1.0 };
                vertices.push(p, p, 1.0, 0);
            }
            let middle = middles(&parents, &mut vertices);
            assert_eq!(vertices.len(), 6 + 12);
            let made = children(&parents, &middle);
            assert_eq!(made.faces.len(), 4 * n);
            assert_eq!(made.across, Triangles::new(made.faces.clone()).across);
        }
    }
}
