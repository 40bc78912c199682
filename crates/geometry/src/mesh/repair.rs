//! What stitching left open is closed by more vertices, around the places where it is open.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, cross, distance, dot, scale, sub, unit};
use isoswarm_field::{Aabb, FieldError, Surface};
use isoswarm_particles::Grid;
use isoswarm_particles::creases::Creases;

use super::connect::{NONE, Triangles};
use super::crease::Segments;
use super::live::lies_over;
use super::pieces::Pieces;
use super::stitch::{Stitched, stitch, stitch_pieces};
use super::vertices::{Vertices, pull};

/// Most rounds: each halves the spacing around what is open.
const ROUNDS: usize = 6;
/// Most vertices that are inserted, for each there is, and besides.
const PER_VERTEX: f64 = 1.0;
const BESIDES: f64 = 1000.0;
/// A new vertex keeps this distance from others, in spacings.
const APART: f64 = 0.45;

/// Rounds without progress that end the repair.
const PATIENCE: usize = 2;

/// What became of the repair.
#[derive(Default)]
pub(super) struct Repaired {
    pub(super) triangles: Triangles,
    pub(super) filled: usize,
    pub(super) inserted: usize,
    /// Vertices at places that stay open.
    pub(super) open: Vec<u32>,
    /// Vertices without a triangle.
    pub(super) left_out: Vec<u32>,
}

/// Stitches the vertices, and again with more vertices where that leaves holes.
pub(super) fn stitch_whole(
    surface: &dyn Surface,
    bounds: &Aabb,
    vertices: &mut Vertices,
    creases: Option<&Creases>,
) -> Result<Repaired, FieldError> {
    let first = vertices.len();
    let most = (first as f64 * PER_VERTEX + BESIDES) as usize;
    let mut best: Option<(Vertices, Repaired)> = None;
    let segments = Segments::of(creases);
    let mut idle = 0;
    for round in 0..=ROUNDS {
        let Stitched { faces, holes, left_out, filled } = match creases {
            Some(creases) => stitch_pieces(&Pieces::cut(vertices, creases), bounds),
            None => stitch(&vertices.points, &vertices.normals, bounds, &vertices.reach()),
        };
        let mut triangles = Triangles::new(faces);
        let left_out = take_in(vertices, &mut triangles, left_out);
        let open = open_places(vertices, &triangles, &left_out);
        let inserted = vertices.len() - first;
        let done = open.is_empty() || round == ROUNDS || inserted >= most;
        let better = best.as_ref().is_none_or(|b| open.len() < b.1.open.len());
        idle = if better { 0 } else { idle + 1 };
        let more = if done || idle == PATIENCE { None } else { Some((triangles.clone(), open.clone())) };
        if better {
            best = Some((vertices.clone(), Repaired { triangles, filled, inserted, open, left_out }));
        }
        let Some((triangles, open)) = more else { break };
        if refine(surface, bounds, vertices, &segments, &triangles, &holes, &open)? == 0 {
            break;
        }
    }
    // Where more vertices did not help, those that were there stay as they were.
    let (kept, repaired) = best.unwrap_or_default();
    *vertices = kept;
    Ok(repaired)
}

/// From so many vertices without a triangle on the mesh is no surface yet, and they stay.
const MOST_LEFT_OUT: usize = 256;

/// Puts vertices without a triangle into those that they lie over, as where the density has a step and the stars on both sides do not see
/// them alike. Gives those that lie over none.
fn take_in(vertices: &Vertices, triangles: &mut Triangles, left_out: Vec<u32>) -> Vec<u32> {
    if left_out.is_empty() || left_out.len() > MOST_LEFT_OUT {
        return left_out;
    }
    let Vertices { points, normals, spacing, .. } = vertices;
    let widest = spacing.iter().fold(0.0f64, |m, &s| m.max(s));
    let grid = Grid::new(points, None, 2.0 * widest);
    let mut near = vec![false; vertices.len()];
    for &v in &left_out {
        grid.near(points[v as usize], 2.0 * widest, |w| near[w as usize] = true);
    }
    let close = |f: &[u32; 3]| f.iter().any(|&v| near[v as usize]);
    let mut candidates: Vec<usize> =
        (0..triangles.faces.len()).filter(|&f| close(&triangles.faces[f])).collect();
    let mut left = Vec::new();
    for v in left_out {
        let off = |f: usize| {
            let [a, b, c] = triangles.faces[f].map(|w| points[w as usize]);
            dot(unit(cross(sub(b, a), sub(c, a))), sub(points[v as usize], a)).abs()
        };
        let over = candidates.iter().copied().filter(|&f| lies_over(triangles.faces[f], v, points, normals));
        let nearest = over.map(|f| (off(f), f)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match nearest {
            Some((off, f)) if off < 0.5 * spacing[v as usize] => {
                triangles.insert(f, v);
                candidates.extend([triangles.faces.len() - 2, triangles.faces.len() - 1]);
            }
            _ => left.push(v),
        }
    }
    left
}

/// Vertices at edges with one face that are not on the bounds, at points where the surface touches itself, and without a face.
pub(super) fn open_places(vertices: &Vertices, triangles: &Triangles, left_out: &[u32]) -> Vec<u32> {
    let mut out = left_out.to_vec();
    for (f, across) in triangles.faces.iter().zip(&triangles.across) {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            if across[k] == NONE && !vertices.share_face(a, b) {
                out.extend([a, b]);
            }
        }
    }
    out.extend(triangles.pinched(vertices.len()));
    out.arrange();
    out.dedup();
    out
}

/// Inserts vertices in the middle of the edges around open places, creases excepted, and in the middle of holes. Gives how many.
fn refine(
    surface: &dyn Surface,
    bounds: &Aabb,
    vertices: &mut Vertices,
    segments: &Segments,
    triangles: &Triangles,
    holes: &[Vec<u32>],
    open: &[u32],
) -> Result<usize, FieldError> {
    let mut marked = vec![false; vertices.len()];
    open.iter().for_each(|&v| marked[v as usize] = true);
    // A ring more, so that sizes do not jump.
    let mut around = marked.clone();
    for f in triangles.faces.iter().filter(|f| f.iter().any(|&v| marked[v as usize])) {
        f.iter().for_each(|&v| around[v as usize] = true);
    }
    let mut places: Vec<(V3, V3, f64, u8)> = Vec::new();
    let middle = |places: &mut Vec<(V3, V3, f64, u8)>, i: u32, j: u32| {
        // A vertex that lies on a crease but is none of its points is in the way of the pieces on both sides.
        if segments.joins(vertices, i, j) {
            return;
        }
        let (i, j) = (i as usize, j as usize);
        let (p, q) = (vertices.points[i], vertices.points[j]);
        let faces =
            if vertices.share_face(i as u32, j as u32) { vertices.faces[i] & vertices.faces[j] } else { 0 };
        let spacing = 0.5 * vertices.spacing[i].min(vertices.spacing[j]);
        places.push(([0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a]), vertices.normals[i], spacing, faces));
    };
    for (f, across) in triangles.faces.iter().zip(&triangles.across) {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            if (a < b || across[k] == NONE) && (around[a as usize] && around[b as usize]) {
                middle(&mut places, a, b);
            }
        }
    }
    for hole in holes {
        let k = 1.0 / hole.len() as f64;
        let sum =
            hole.iter().fold([0.0; 3], |s, &v| [0, 1, 2].map(|a| s[a] + vertices.points[v as usize][a]));
        let v = hole[0] as usize;
        places.push((scale(sum, k), vertices.normals[v], 0.5 * vertices.spacing[v], 0));
        for (n, &i) in hole.iter().enumerate() {
            if let Some(&j) = hole.get(n + hole.len() / 2) {
                middle(&mut places, i, j);
            }
        }
    }
    for (v, near) in around.iter().enumerate() {
        if *near {
            vertices.spacing[v] *= if marked[v] { 0.5 } else { 0.75 };
        }
    }
    insert(surface, bounds, vertices, places)
}

/// Puts points (with a normal nearby, a spacing and faces) on the surface and adds those that keep their distance. Gives how many.
pub(super) fn insert(
    surface: &dyn Surface,
    bounds: &Aabb,
    vertices: &mut Vertices,
    places: Vec<(V3, V3, f64, u8)>,
) -> Result<usize, FieldError> {
    if places.is_empty() {
        return Ok(0);
    }
    let mut points: Vec<V3> = places.iter().map(|p| p.0).collect();
    let mut normals: Vec<V3> = places.iter().map(|p| p.1).collect();
    let faces: Vec<u8> = places.iter().map(|p| p.3).collect();
    let left = pull(surface, &mut points, &mut normals, &faces, |i| 2.0 * places[i].2, 8)?;
    let good: Vec<usize> =
        (0..points.len()).filter(|&i| left[i] <= 1e-3 * places[i].2 && bounds.contains(points[i])).collect();
    let mut all = vertices.points.clone();
    all.extend(good.iter().map(|&i| points[i]));
    let widest = good.iter().map(|&i| places[i].2).fold(0.0, f64::max);
    let grid = Grid::new(&all, None, (APART * widest).max(f64::MIN_POSITIVE));
    let old = vertices.len();
    let mut taken = vec![false; good.len()];
    let mut came = 0;
    for (k, &i) in good.iter().enumerate() {
        let apart = APART * places[i].2;
        let mut room = true;
        grid.near(points[i], apart, |j| {
            let j = j as usize;
            let there = j < old || taken[j - old];
            room &= !there || distance(all[j], points[i]) >= apart;
        });
        if room {
            taken[k] = true;
            vertices.push(points[i], normals[i], places[i].2, faces[i]);
            came += 1;
        }
    }
    Ok(came)
}
