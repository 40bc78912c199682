//! More vertices where a piece between creases bends within a triangle, as in bores that are narrow beside the spacing.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, add, cross, distance, dot, norm, sub, unit};
use isoswarm_field::{FieldError, Surface};

use super::connect::{NONE, Triangles};
use super::crease::Segments;
use super::report::MeshReport;
use super::vertices::{Vertices, pull};

/// Most rounds: each halves the turn.
const ROUNDS: usize = 4;
/// Cosine between the normals at the ends of an edge from which on down it is split.
const BENT: f64 = 0.64;
/// Cosine between the normal of a new vertex and the middle of those at the ends from which on down it is on another piece.
const SAME: f64 = 0.7;
/// Most vertices that come, for each there is.
const MOST: f64 = 0.5;

/// Distance of the middle of an edge from the surface, over its length, from which on it is split where an end is on a crease: that of an arc
/// that turns as much.
const OFF: f64 = 0.12;

/// Splits edges, creases excepted, between whose ends the surface turns much. Vertices on creases have more than one normal: of edges there
/// it counts how far they are off the surface.
pub(super) fn refine(
    surface: &dyn Surface,
    segments: &Segments,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<(), FieldError> {
    let most = vertices.len() + (MOST * vertices.len() as f64) as usize;
    for _ in 0..ROUNDS {
        let edges = bent(surface, segments, triangles, vertices, report)?;
        if edges.is_empty() || vertices.len() + edges.len() > most {
            break;
        }
        let ends: Vec<[usize; 2]> = edges
            .iter()
            .map(|&(f, k)| [triangles.faces[f][k], triangles.faces[f][(k + 1) % 3]].map(|v| v as usize))
            .collect();
        let mut points: Vec<V3> = ends
            .iter()
            .map(|&[a, b]| [0, 1, 2].map(|k| 0.5 * vertices.points[a][k] + 0.5 * vertices.points[b][k]))
            .collect();
        let length = |&[a, b]: &[usize; 2]| distance(vertices.points[a], vertices.points[b]);
        let front = |f: usize| {
            let [a, b, c] = triangles.faces[f].map(|v| vertices.points[v as usize]);
            unit(cross(sub(b, a), sub(c, a)))
        };
        let middle = |&(f, k): &(usize, usize)| {
            let [a, b] = [k, (k + 1) % 3].map(|k| triangles.faces[f][k] as usize);
            if vertices.on_crease(a) || vertices.on_crease(b) {
                unit(add(front(f), front(triangles.across[f][k] as usize)))
            } else {
                unit(add(vertices.normals[a], vertices.normals[b]))
            }
        };
        let mut normals: Vec<V3> = edges.iter().map(middle).collect();
        let (wanted, lengths): (Vec<V3>, Vec<f64>) = (normals.clone(), ends.iter().map(length).collect());
        let left = pull(surface, &mut points, &mut normals, &vec![0; edges.len()], |i| 0.5 * lengths[i], 6)?;
        report.evaluations += 6 * points.len() as u64;
        let mut came = 0;
        for (i, &(f, k)) in edges.iter().enumerate() {
            if left[i] <= 1e-3 * lengths[i] && dot(normals[i], wanted[i]) > SAME {
                vertices.push(points[i], normals[i], 0.5 * lengths[i], 0);
                held.push(false);
                triangles.split(f, k, vertices.len() as u32 - 1);
                came += 1;
            }
        }
        report.inserted += came;
        report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
        if came == 0 {
            break;
        }
    }
    Ok(())
}

/// Bent edges, at most one a triangle, as a face and the corner where it starts, the most bent ones first.
fn bent(
    surface: &dyn Surface,
    segments: &Segments,
    triangles: &Triangles,
    vertices: &Vertices,
    report: &mut MeshReport,
) -> Result<Vec<(usize, usize)>, FieldError> {
    let (mut beside, mut middles) = (Vec::new(), Vec::new());
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    for (f, (v, across)) in triangles.faces.iter().zip(&triangles.across).enumerate() {
        for k in 0..3 {
            let (a, b) = (v[k] as usize, v[(k + 1) % 3] as usize);
            let free = !vertices.on_crease(a) && !vertices.on_crease(b);
            if free && across[k] != NONE && f < across[k] as usize {
                let cosine = dot(vertices.normals[a], vertices.normals[b]);
                if cosine < BENT {
                    found.push((cosine, f, k));
                }
            } else if across[k] != NONE
                && f < across[k] as usize
                && !segments.joins(vertices, v[k], v[(k + 1) % 3])
            {
                let (p, q) = (vertices.points[a], vertices.points[b]);
                beside.push((f, k, distance(p, q)));
                middles.push([0, 1, 2].map(|k| 0.5 * p[k] + 0.5 * q[k]));
            }
        }
    }
    let (mut value, mut gradient) = (vec![0.0; middles.len()], vec![[0.0; 3]; middles.len()]);
    surface.value_gradient(&middles, &mut value, &mut gradient)?;
    report.evaluations += middles.len() as u64;
    for ((&(f, k, length), v), g) in beside.iter().zip(&value).zip(&gradient) {
        let off = v.abs() / norm(*g);
        if off > OFF * length && off.is_finite() {
            // The cosine between the normals at the ends of the arc: cos 4φ, tan φ = 2 off / length.
            let half = 2.0 / (1.0 + (2.0 * off / length).powi(2)) - 1.0;
            found.push((2.0 * half * half - 1.0, f, k));
        }
    }
    found.arrange_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut touched = vec![false; triangles.faces.len()];
    found.retain(|&(_, f, k)| {
        let g = triangles.across[f][k] as usize;
        !(std::mem::replace(&mut touched[f], true) | std::mem::replace(&mut touched[g], true))
    });
    Ok(found.into_iter().map(|(_, f, k)| (f, k)).collect())
}
