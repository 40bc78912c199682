//! The boundary of a clipped surface: no vertex but those on a face of the bounds may lie next to it.

use isoswarm_field::vector::{V3, distance};
use isoswarm_field::{Aabb, FieldError, Surface};
use isoswarm_particles::{Grid, Rings};

use super::vertices::{Vertices, pull};

/// Most rounds.
const ROUNDS: usize = 5;
/// A vertex nearer to a face than this part of the spacing moves onto it; one farther off gets a neighbour there.
const NEAR: f64 = 0.45;
/// Distance that vertices on the boundary keep, in spacings.
const APART: f64 = 0.4;

/// Moves vertices whose cells reach the bounds onto them, or puts a vertex there. Gives how many came and went.
pub(super) fn clear(
    surface: &dyn Surface,
    bounds: &Aabb,
    vertices: &mut Vertices,
) -> Result<(usize, usize), FieldError> {
    let (mut came, mut went) = (0, 0);
    if vertices.faces.iter().all(|f| *f == 0) {
        return Ok((0, 0));
    }
    for _ in 0..ROUNDS {
        let rings = Rings::find(&vertices.points, &vertices.normals, bounds, &vertices.reach());
        let close: Vec<(usize, usize, f64, f64)> = (0..vertices.len())
            .filter(|&i| {
                vertices.faces[i] == 0 && !vertices.on_crease(i) && rings.of(i).contains(&Rings::WALL)
            })
            .filter_map(|i| {
                nearest_face(vertices.points[i], vertices.normals[i], bounds).map(|(a, f, d)| (i, a, f, d))
            })
            .collect();
        if close.is_empty() {
            break;
        }
        let mut points: Vec<V3> = close
            .iter()
            .map(|&(i, a, face, _)| {
                let mut p = vertices.points[i];
                p[a] = face;
                p
            })
            .collect();
        let mut normals: Vec<V3> = close.iter().map(|c| vertices.normals[c.0]).collect();
        let faces: Vec<u8> = close.iter().map(|c| 1 << c.1).collect();
        let left = pull(surface, &mut points, &mut normals, &faces, |k| vertices.spacing[close[k].0], 8)?;
        let before = vertices.len();
        let mut dead = vec![false; before];
        for (k, &(i, .., d)) in close.iter().enumerate() {
            let spacing = vertices.spacing[i];
            if left[k] > 1e-3 * spacing || !bounds.contains(points[k]) {
                continue;
            }
            if d < NEAR * spacing {
                (vertices.points[i], vertices.normals[i], vertices.faces[i]) =
                    (points[k], normals[k], faces[k]);
            } else {
                vertices.push(points[k], normals[k], spacing, faces[k]);
                dead.push(false);
            }
        }
        // Of two on the boundary that are too close, the later one goes.
        let on: Vec<u32> = (0..vertices.len() as u32).filter(|&i| vertices.faces[i as usize] != 0).collect();
        let widest = vertices.spacing.iter().fold(0.0f64, |m, &s| m.max(s));
        let grid = Grid::new(&vertices.points, Some(on.clone()), APART * widest);
        let on_crease = |i: usize| vertices.on_crease(i);
        for &i in &on {
            let i = i as usize;
            let apart = APART * vertices.spacing[i];
            let corner = vertices.faces[i].count_ones() > 1;
            grid.near(vertices.points[i], apart, |j| {
                let j = j as usize;
                let other = vertices.faces[j].count_ones() > 1;
                let near = j != i
                    && !on_crease(i)
                    && !dead[j]
                    && distance(vertices.points[i], vertices.points[j]) < apart;
                dead[i] |= near && !corner && (other || on_crease(j) || j < i);
            });
        }
        let gone = dead.iter().filter(|d| **d).count();
        came += vertices.len() - before;
        went += gone;
        vertices.retain(|i| !dead[i]);
    }
    Ok((came, went))
}

/// The face of the bounds that is nearest along the surface: its axis, its coordinate and the distance.
fn nearest_face(p: V3, n: V3, bounds: &Aabb) -> Option<(usize, f64, f64)> {
    let mut best: Option<(usize, f64, f64)> = None;
    for a in 0..3 {
        let slope = (1.0 - n[a] * n[a]).max(1e-4).sqrt();
        for face in [bounds.lo[a], bounds.hi[a]] {
            let d = (p[a] - face).abs() / slope;
            if best.is_none_or(|b| d < b.2) {
                best = Some((a, face, d));
            }
        }
    }
    best
}
