//! The distance between triangles and surface: measured, and brought below a limit.

use isoswarm_field::vector::{V3, distance, norm};
use isoswarm_field::{FieldError, Surface};
use rayon::prelude::*;

use super::connect::Triangles;
use super::crease::Segments;
use super::report::MeshReport;
use super::smooth::smooth;
use super::vertices::{Vertices, pull};

/// Most rounds of refinement.
const ROUNDS: usize = 8;
/// Rounds of smoothing in each of the first of them.
const SMOOTHING: usize = 2;
const SMOOTHED: usize = 5;

/// One edge in so many that is split makes the others move.
const FEW: usize = 20;

/// |F|/|∇F| at the points: their distance from the surface, to first order.
pub(super) fn distances(surface: &dyn Surface, points: &[V3]) -> Result<Vec<f64>, FieldError> {
    let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    if !points.is_empty() {
        surface.value_gradient(points, &mut value, &mut gradient)?;
    }
    Ok(value.iter().zip(&gradient).map(|(v, g)| if *v == 0.0 { 0.0 } else { v.abs() / norm(*g) }).collect())
}

/// The centre of each face.
pub(super) fn centres(points: &[V3], faces: &[[u32; 3]]) -> Vec<V3> {
    let one = |f: &[u32; 3]| {
        let [p, q, r] = f.map(|v| points[v as usize]);
        [0, 1, 2].map(|a| (p[a] + q[a] + r[a]) / 3.0)
    };
    faces.par_iter().with_min_len(4096).map(one).collect()
}

/// Splits edges until no centre of a triangle and no middle of an edge is farther from the surface than `most`.
pub(super) fn refine(
    surface: &dyn Surface,
    most: f64,
    segments: &Segments,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<(), FieldError> {
    // Faces that have changed since they were measured.
    let mut fresh = vec![true; triangles.faces.len()];
    for round in 0..ROUNDS {
        let wanted = bad_edges(surface, most, segments, triangles, vertices, &fresh, report)?;
        if wanted.is_empty() {
            return chords(surface, most, segments, vertices, report);
        }
        let measured = triangles.faces.clone();
        let changed = wanted.len();
        let again = split(surface, triangles, vertices, held, report, wanted)?;
        report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
        // Where few edges are too far off the others stay.
        let many = FEW * changed > triangles.faces.len();
        for _ in 0..if round < SMOOTHED && many { SMOOTHING } else { 0 } {
            smooth(surface, triangles, vertices, held)?;
            report.evaluations += vertices.len() as u64;
            report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
        }
        let moved = round < SMOOTHED && many;
        let same = |f: usize| !moved && measured.get(f) == Some(&triangles.faces[f]);
        fresh = (0..triangles.faces.len()).map(|f| !same(f)).collect();
        again.into_iter().for_each(|f| fresh[f] = true);
    }
    let all = vec![true; triangles.faces.len()];
    let left = bad_edges(surface, most, segments, triangles, vertices, &all, report)?;
    if !left.is_empty() {
        report.warnings.push(format!(
            "{} edges are still farther than {most:e} from the surface or next to a triangle that is; the surface may bend sharply there",
            left.len()
        ));
        let places =
            left.iter().map(|&(f, k)| vertices.points[triangles.faces[f as usize][k as usize] as usize]);
        report.doubtful.extend(places.take(MeshReport::MOST_PLACES));
    }
    chords(surface, most, segments, vertices, report)
}

/// Tells of edges on creases that cut a bend by more than `most`: those where the crease could not be followed.
fn chords(
    surface: &dyn Surface,
    most: f64,
    segments: &Segments,
    vertices: &Vertices,
    report: &mut MeshReport,
) -> Result<(), FieldError> {
    let edges = segments.edges(vertices);
    let middles: Vec<V3> = edges
        .iter()
        .map(|e| {
            let [p, q] = e.map(|v| vertices.points[v as usize]);
            [0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a])
        })
        .collect();
    let off = distances(surface, &middles)?;
    report.evaluations += middles.len() as u64;
    let long: Vec<V3> = middles.into_iter().zip(off).filter(|(_, d)| *d > most).map(|(p, _)| p).collect();
    if !long.is_empty() {
        report.warnings.push(format!(
            "{} edges on the surface's creases cut bends by more than {most:e}, where their creases could not be followed; see the doubtful \
             places",
            long.len()
        ));
        report.doubtful.extend(long.into_iter().take(MeshReport::MOST_PLACES));
    }
    Ok(())
}

/// Edges of fresh faces that are too far off, and the longest edge of each fresh face that is.
fn bad_edges(
    surface: &dyn Surface,
    most: f64,
    segments: &Segments,
    triangles: &Triangles,
    vertices: &Vertices,
    fresh: &[bool],
    report: &mut MeshReport,
) -> Result<Vec<(u32, u8)>, FieldError> {
    let mut out: Vec<(u32, u8)> = Vec::new();
    let chosen: Vec<usize> = (0..fresh.len()).filter(|&f| fresh[f]).collect();
    let faces: Vec<[u32; 3]> = chosen.iter().map(|&f| triangles.faces[f]).collect();
    let centre = distances(surface, &centres(&vertices.points, &faces))?;
    let mut edges: Vec<(u32, u8)> = Vec::new();
    for ((&f, v), off) in chosen.iter().zip(&faces).zip(&centre) {
        let side =
            |k: usize| distance(vertices.points[v[k] as usize], vertices.points[v[(k + 1) % 3] as usize]);
        if *off > most {
            // What is split in the middle leaves the crease.
            let free = (0..3).filter(|&k| !segments.joins(vertices, v[k], v[(k + 1) % 3]));
            out.extend(free.max_by(|&i, &j| side(i).total_cmp(&side(j))).map(|k| (f as u32, k as u8)));
        }
        // Each edge as seen from one of its faces.
        let seen = |g: u32| (g as usize) < f && fresh[g as usize];
        edges.extend((0..3u8).filter(|&k| !seen(triangles.across[f][k as usize])).map(|k| (f as u32, k)));
    }
    let middles: Vec<V3> = edges
        .par_iter()
        .with_min_len(4096)
        .map(|&(f, k)| {
            let v = triangles.faces[f as usize];
            let (p, q) =
                (vertices.points[v[k as usize] as usize], vertices.points[v[(k as usize + 1) % 3] as usize]);
            [0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a])
        })
        .collect();
    let off = distances(surface, &middles)?;
    report.evaluations += (centre.len() + middles.len()) as u64;
    out.extend(edges.into_iter().zip(off).filter(|(_, d)| *d > most).map(|(e, _)| e));
    out.retain(|&(f, k)| {
        let v = triangles.faces[f as usize];
        !segments.joins(vertices, v[k as usize], v[(k as usize + 1) % 3])
    });
    Ok(out)
}

/// Puts a vertex in the middle of each edge, where its faces have not been split already. Gives the faces where that was not
/// so, or where it did not get to the surface.
pub(super) fn split(
    surface: &dyn Surface,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
    edges: Vec<(u32, u8)>,
) -> Result<Vec<usize>, FieldError> {
    let mut again = Vec::new();
    let mut touched = vec![false; triangles.faces.len()];
    let (mut points, mut normals, mut faces, mut chosen, mut spacing) =
        (vec![], vec![], vec![], vec![], vec![]);
    for (f, k) in edges {
        let (f, k) = (f as usize, k as usize);
        let g = triangles.across[f][k];
        if touched[f] || touched.get(g as usize).is_some_and(|t| *t) {
            again.push(f);
            continue;
        }
        touched[f] = true;
        if let Some(t) = touched.get_mut(g as usize) {
            *t = true;
        }
        let (a, b) = (triangles.faces[f][k], triangles.faces[f][(k + 1) % 3]);
        let (p, q) = (vertices.points[a as usize], vertices.points[b as usize]);
        points.push([0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a]));
        normals.push(vertices.normals[a as usize]);
        let on_boundary = g == super::connect::NONE && vertices.share_face(a, b);
        faces.push(if on_boundary { vertices.faces[a as usize] & vertices.faces[b as usize] } else { 0 });
        spacing.push(0.5 * distance(p, q));
        chosen.push((f, k));
    }
    let left = pull(surface, &mut points, &mut normals, &faces, |i| spacing[i], 4)?;
    report.evaluations += 4 * points.len() as u64;
    for (i, (f, k)) in chosen.into_iter().enumerate() {
        if left[i].is_finite() {
            let u = vertices.len() as u32;
            vertices.push(points[i], normals[i], spacing[i], faces[i]);
            held.push(false);
            triangles.split(f, k, u);
            report.inserted += 1;
        } else {
            again.push(f);
        }
    }
    Ok(again)
}
