//! A mesh that follows a swarm.
//!
//! From frame to frame most edges stay. Dead vertices are collapsed into a neighbour, newborn ones put into the triangle
//! they lie over, and edges flipped until the mesh is Delaunay again. Where the surface has changed its topology, triangles no
//! longer face as their vertices do: there it is stitched anew, and everywhere if that does not join what is around it.

use isoswarm_field::Aabb;
use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, cross, distance, dot, norm, sub};
use isoswarm_particles::Grid;
use rayon::prelude::*;

use super::connect::{NONE, Triangles};
use super::stitch::stitch;
use super::{Mesh, vertices};

/// Cosine between a triangle and a vertex below which it does not belong to the surface there.
const LEVEL: f64 = 0.3;
/// Longest edge, in spacings, that a mesh which follows its surface has.
const LONGEST: f64 = 3.0;
/// Newborn vertices and dead ones, as a part of all, from which on stitching anew is faster.
const MANY: f64 = 0.1;
/// Triangles with a vertex this close to a place that is stitched anew are replaced, in spacings,
const INNER: f64 = 3.0;
/// and vertices this close take part, so that the replaced ones are what they would be if all did.
const OUTER: f64 = 7.0;
/// Where more than this part of all vertices takes part, all do.
const MOST: f64 = 0.5;
/// A vertex this close to a face of the bounds, in spacings, is on it.
const ON_FACE: f64 = 1e-3;

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiveUpdate {
    /// Vertices that came.
    pub born: usize,
    /// Vertices that went.
    pub died: usize,
    /// Edges flipped.
    pub flips: usize,
    /// Vertices whose triangles were stitched anew; 0 where none or all were.
    pub restitched: usize,
    /// Whether everything was stitched anew.
    pub stitched: bool,
    /// Edges with one triangle that do not lie on the bounds, and vertices without a triangle: 0 for a mesh without holes.
    pub open: usize,
}

/// Triangles over a swarm that moves; its vertices are the swarm's floaters, told apart by their identities.
///
/// ```
/// use isoswarm_field::Aabb;
/// use isoswarm_geometry::LiveMesh;
///
/// let mut live = LiveMesh::new(Aabb::new([-2.0; 3], [2.0; 3]));
/// let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
/// let normals = corners.map(|p| p.map(|c| c / 3f64.sqrt()));
/// live.update(&corners, &normals, &[7, 8, 9, 11], 2.8);
/// assert_eq!(live.mesh().ids, [7, 8, 9, 11]);
/// ```
#[derive(Clone, Debug)]
pub struct LiveMesh {
    bounds: Aabb,
    mesh: Mesh,
    across: Vec<[u32; 3]>,
    /// What was open after the last update.
    was_open: usize,
}

impl LiveMesh {
    /// An empty mesh of a surface in `bounds`.
    pub fn new(bounds: Aabb) -> Self {
        Self { bounds, mesh: Mesh::default(), across: Vec::new(), was_open: 0 }
    }

    /// The mesh after the last update. Rows are those of the swarm.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Follows the swarm: positions, outward unit normals and identities (each different) of the floaters, and their spacing (model units, > 0).
    ///
    /// # Panics
    /// Where the lengths differ.
    pub fn update(&mut self, points: &[V3], normals: &[V3], ids: &[u64], spacing: f64) -> LiveUpdate {
        assert!(
            points.len() == normals.len() && points.len() == ids.len(),
            "a normal and an identity for each point"
        );
        let mut out = LiveUpdate::default();
        let mut follows = !self.mesh.faces.is_empty() && self.follow(points, normals, ids, spacing, &mut out);
        self.mesh.points = points.to_vec();
        self.mesh.normals = normals.to_vec();
        self.mesh.ids = ids.to_vec();
        if follows {
            out.open = self.open(spacing);
            follows = out.restitched == 0 || out.open <= self.was_open;
        }
        if !follows {
            (out.stitched, out.restitched) = (true, 0);
            let faces = stitch(points, normals, &self.bounds, &[spacing]).faces;
            let mut triangles = Triangles::new(faces);
            out.flips += triangles.delaunay(points, |_, _| false);
            (self.mesh.faces, self.across) = (triangles.faces, triangles.across);
            out.open = self.open(spacing);
        }
        self.was_open = out.open;
        out
    }

    /// Brings the triangles up to date. Whether that could be done.
    fn follow(
        &mut self,
        points: &[V3],
        normals: &[V3],
        ids: &[u64],
        spacing: f64,
        out: &mut LiveUpdate,
    ) -> bool {
        let mut triangles = Triangles {
            faces: std::mem::take(&mut self.mesh.faces),
            across: std::mem::take(&mut self.across),
        };
        // Around these the triangles are not known.
        let mut spots = Vec::new();
        if self.mesh.ids != ids {
            let (now, born) = renumber(&self.mesh.ids, ids);
            let dead: Vec<u32> = (0..now.len() as u32).filter(|&v| now[v as usize] == NONE).collect();
            (out.born, out.died) = (born.len(), dead.len());
            if (born.len() + dead.len()) as f64 > MANY * ids.len() as f64 {
                return false;
            }
            bury(&mut triangles, &self.mesh.points, &dead);
            triangles.faces.iter_mut().for_each(|f| *f = f.map(|v| now[v as usize]));
            let torn: Vec<bool> = triangles.faces.iter().map(|f| f.contains(&NONE)).collect();
            if torn.contains(&true) {
                let of_torn =
                    triangles.faces.iter().zip(&torn).filter(|(_, torn)| **torn).flat_map(|(f, _)| f);
                spots.extend(of_torn.filter(|v| **v != NONE));
                triangles.drop_faces(&torn);
            }
            bear(&mut triangles, points, normals, &born, spacing, &mut spots);
        }
        out.flips = triangles.delaunay(points, |_, _| false);
        let misfit = |f: &&[u32; 3]| !fits(f, points, normals, spacing);
        let misfits: Vec<&[u32; 3]> = triangles.faces.par_iter().with_min_len(4096).filter(misfit).collect();
        spots.extend(misfits.into_iter().flatten());
        let followed = spots.is_empty() || {
            spots.arrange();
            spots.dedup();
            let done = restitch(&mut triangles, &spots, points, normals, &self.bounds, spacing);
            out.restitched = done.unwrap_or(0);
            done.is_some()
        };
        (self.mesh.faces, self.across) = (triangles.faces, triangles.across);
        followed
    }

    /// Edges off the bounds with one face, and vertices without one.
    fn open(&self, spacing: f64) -> usize {
        let mut used = vec![false; self.mesh.points.len()];
        let mut open = 0;
        let bits = |v: u32| {
            let mut p = self.mesh.points[v as usize];
            let bits = vertices::snap(&mut p, &self.bounds, ON_FACE * spacing);
            (bits, p)
        };
        for (f, across) in self.mesh.faces.iter().zip(&self.across) {
            f.iter().for_each(|&v| used[v as usize] = true);
            for k in 0..3 {
                if across[k] == NONE {
                    let ((a, p), (b, q)) = (bits(f[k]), bits(f[(k + 1) % 3]));
                    open += usize::from(!vertices::share_face(a, b, p, q));
                }
            }
        }
        open + used.iter().filter(|u| !**u).count()
    }
}

/// For each of the old identities its new row ([`NONE`] for the dead), and the rows of those that are new.
fn renumber(old: &[u64], new: &[u64]) -> (Vec<u32>, Vec<u32>) {
    let sorted = |ids: &[u64]| {
        let mut rows: Vec<(u64, u32)> = ids.iter().zip(0..).map(|(&id, row)| (id, row)).collect();
        rows.arrange();
        rows
    };
    let (a, b) = (sorted(old), sorted(new));
    let mut now = vec![NONE; old.len()];
    let mut born = Vec::new();
    let mut k = 0;
    for &(id, row) in &b {
        while a.get(k).is_some_and(|x| x.0 < id) {
            k += 1;
        }
        match a.get(k) {
            Some(&(same, before)) if same == id => now[before as usize] = row,
            _ => born.push(row),
        }
    }
    born.arrange();
    (now, born)
}

/// Whether a triangle lies along the surface at its corners and is not too long.
fn fits(f: &[u32; 3], points: &[V3], normals: &[V3], spacing: f64) -> bool {
    let [a, b, c] = f.map(|v| points[v as usize]);
    let front = cross(sub(b, a), sub(c, a));
    let length = norm(front);
    let most = LONGEST * spacing;
    f.iter().all(|&v| normals[v as usize] == [0.0; 3] || dot(front, normals[v as usize]) > LEVEL * length)
        && distance(a, b) < most
        && distance(b, c) < most
        && distance(c, a) < most
}

/// Stitches the surroundings of some vertices anew; how many vertices have new triangles. `None` where they are too many.
fn restitch(
    triangles: &mut Triangles,
    spots: &[u32],
    points: &[V3],
    normals: &[V3],
    bounds: &Aabb,
    spacing: f64,
) -> Option<usize> {
    let most = MOST * points.len() as f64;
    if spots.len() as f64 > most {
        return None;
    }
    let (inner, outer) = (INNER * spacing, OUTER * spacing);
    let grid = Grid::new(points, None, outer);
    let (mut near, mut takes_part) = (vec![false; points.len()], vec![false; points.len()]);
    let mut local = Vec::new();
    for &spot in spots {
        let p = points[spot as usize];
        grid.near(p, outer, |v| {
            let d = distance(points[v as usize], p);
            near[v as usize] |= d < inner;
            if d < outer && !std::mem::replace(&mut takes_part[v as usize], true) {
                local.push(v);
            }
        });
        if local.len() as f64 > most {
            return None;
        }
    }
    local.arrange();
    let pick = |from: &[V3]| local.iter().map(|&v| from[v as usize]).collect::<Vec<V3>>();
    let (local_points, local_normals) = (pick(points), pick(normals));
    let mut patch = Triangles::new(stitch(&local_points, &local_normals, bounds, &[spacing]).faces);
    patch.delaunay(&local_points, |_, _| false);
    let replaced = |f: &[u32; 3]| f.iter().any(|&v| near[v as usize]);
    let mut faces = std::mem::take(&mut triangles.faces);
    faces.retain(|f| !replaced(f));
    let new = patch.faces.into_iter().map(|f| f.map(|v| local[v as usize]));
    faces.extend(new.filter(replaced));
    *triangles = Triangles::new(faces);
    Some(near.iter().filter(|n| **n).count())
}

/// Collapses dead vertices into their nearest neighbours, as far as that can be done.
fn bury(triangles: &mut Triangles, points: &[V3], dead: &[u32]) {
    if dead.is_empty() {
        return;
    }
    let mut face_of = vec![NONE; points.len()];
    for (f, v) in triangles.faces.iter().enumerate() {
        v.iter().for_each(|&v| face_of[v as usize] = f as u32);
    }
    let mut gone = vec![false; triangles.faces.len()];
    for &v in dead {
        // One that had no triangle is missed by nobody.
        if face_of[v as usize] == NONE {
            continue;
        }
        let Some(fan) = triangles.fan(v, face_of[v as usize] as usize) else { continue };
        let mut order: Vec<usize> = (0..fan.len()).collect();
        let way = |k: &usize| distance(points[fan[*k].1 as usize], points[v as usize]);
        order.arrange_by(|i, j| way(i).total_cmp(&way(j)).then(i.cmp(j)));
        let Some(&k) = order.iter().find(|&&k| triangles.may_collapse(&fan, k)) else { continue };
        triangles.collapse(v, &fan, k);
        let n = fan.len();
        let (f, g) = (fan[k].0, fan[(k + n - 1) % n].0);
        (gone[f as usize], gone[g as usize]) = (true, true);
        // Corners that pointed to a face that is gone.
        for j in 0..n {
            let w = fan[j].1;
            let stays = |j: usize| (fan[j].0 != f && fan[j].0 != g).then_some(fan[j].0);
            // Both faces at this neighbour may be gone; the one over the edge is not.
            let other = stays(j).or_else(|| stays((j + n - 1) % n)).or_else(|| (0..n).find_map(stays));
            face_of[w as usize] = other.unwrap_or(NONE);
        }
    }
    triangles.drop_faces(&gone);
}

/// Puts new vertices into the triangles that they lie over; those that lie over none are added to `spots`.
fn bear(
    triangles: &mut Triangles,
    points: &[V3],
    normals: &[V3],
    born: &[u32],
    spacing: f64,
    spots: &mut Vec<u32>,
) {
    if born.is_empty() {
        return;
    }
    let mut face_of = vec![NONE; points.len()];
    for (f, v) in triangles.faces.iter().enumerate() {
        v.iter().for_each(|&v| face_of[v as usize] = f as u32);
    }
    let grid = Grid::new(points, None, spacing);
    for &u in born {
        let p = points[u as usize];
        let mut near: Vec<(f64, u32)> = Vec::new();
        grid.near(p, 2.0 * spacing, |v| {
            let d = distance(points[v as usize], p);
            if v != u && face_of[v as usize] != NONE && d < 2.0 * spacing {
                near.push((d, v));
            }
        });
        near.arrange_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut found = None;
        for &(_, v) in near.iter().take(6) {
            let Some(fan) = triangles.fan(v, face_of[v as usize] as usize) else { continue };
            found =
                fan.iter().map(|f| f.0 as usize).find(|&f| lies_over(triangles.faces[f], u, points, normals));
            if found.is_some() {
                break;
            }
        }
        let Some(f) = found else {
            spots.push(u);
            continue;
        };
        triangles.insert(f, u);
        face_of[u as usize] = f as u32;
        // The two new faces are the last ones; the corners of `f` have moved to them.
        for g in triangles.faces.len() - 2..triangles.faces.len() {
            triangles.faces[g].iter().for_each(|&v| face_of[v as usize] = g as u32);
        }
    }
}

/// Whether vertex `u` splits a triangle in three that face as it does.
pub(super) fn lies_over(f: [u32; 3], u: u32, points: &[V3], normals: &[V3]) -> bool {
    let p = points[u as usize];
    let n = normals[u as usize];
    (0..3).all(|k| {
        let (a, b) = (points[f[k] as usize], points[f[(k + 1) % 3] as usize]);
        dot(cross(sub(b, a), sub(p, a)), n) > 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities_are_followed() {
        let (now, born) = renumber(&[5, 2, 9, 4], &[9, 11, 2, 4]);
        assert_eq!(now, [NONE, 2, 0, 3]);
        assert_eq!(born, [1]);
    }
}
