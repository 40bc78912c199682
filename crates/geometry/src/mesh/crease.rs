//! Creases in a mesh: their points are vertices that stay, and the segments between them edges that no flip removes.

use std::collections::HashMap;

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, cross, distance, dot, sub, unit};
use isoswarm_field::{Aabb, Surface};
use isoswarm_particles as particles;
use isoswarm_particles::creases::Creases;

use super::Mesh;
use super::connect::{NONE, Triangles};
use super::report::MeshReport;
use super::vertices::Vertices;

/// Most flips for one segment.
const FLIPS: usize = 64;
/// Most edges that it may cross.
const CROSSED: usize = 16;

/// The segments of creases, between numbers of crease points.
#[derive(Clone, Debug, Default)]
pub(super) struct Segments {
    /// Both ends, smaller number first, in rising order.
    pairs: Vec<(u32, u32)>,
}

impl Segments {
    pub(super) fn of(creases: Option<&Creases>) -> Self {
        let all = creases.into_iter().flat_map(|c| &c.edges).flat_map(|e| e.segments());
        let mut pairs: Vec<(u32, u32)> =
            all.filter(|[a, b]| a != b).map(|[a, b]| (a.min(b), a.max(b))).collect();
        pairs.arrange();
        pairs.dedup();
        Self { pairs }
    }

    /// Whether there is a segment between two vertices.
    #[inline(always)]
    pub(super) fn joins(&self, vertices: &Vertices, a: u32, b: u32) -> bool {
        let (a, b) = (vertices.crease[a as usize], vertices.crease[b as usize]);
        a != NONE && b != NONE && self.pairs.binary_search(&(a.min(b), a.max(b))).is_ok()
    }

    /// The segments as edges between vertices that there are.
    pub(super) fn edges(&self, vertices: &Vertices) -> Vec<[u32; 2]> {
        let place = places(vertices);
        self.pairs.iter().filter_map(|(a, b)| Some([*place.get(a)?, *place.get(b)?])).collect()
    }

    /// Flips edges until all segments are edges, as far as that is possible; gives the number of flips, and the segments that
    /// are none.
    pub(super) fn insert(&self, triangles: &mut Triangles, vertices: &Vertices) -> (usize, Vec<[u32; 2]>) {
        if self.pairs.is_empty() {
            return (0, Vec::new());
        }
        let face_of = face_of(triangles, vertices.len());
        let mut work = Work { segments: self, triangles, vertices, face_of, flips: 0 };
        let missing = self.edges(vertices).into_iter().filter(|&[a, b]| !work.join(a, b)).collect();
        (work.flips, missing)
    }
}

/// Puts vertices on the edges that are creases until no middle of one is farther than `most` from its crease; gives the segments that
/// there are then.
pub(super) fn refine(
    surface: &dyn Surface,
    bounds: &Aabb,
    creases: &mut Creases,
    most: f64,
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    report: &mut MeshReport,
) -> Result<Segments, particles::Error> {
    let done = particles::creases::refine(surface, bounds, creases, most)?;
    report.evaluations += done.evaluations;
    let segments = Segments::of(Some(creases));
    let normals = creases.mean_normals();
    let (mut place, mut face_of) = (places(vertices), face_of(triangles, vertices.len()));
    for [a, b, new] in done.splits {
        let (Some(&a), Some(&b)) = (place.get(&a), place.get(&b)) else { continue };
        let Some((f, k)) = triangles.edge(&face_of, a, b) else { continue };
        let u = vertices.len() as u32;
        let spacing = 0.5 * distance(vertices.points[a as usize], vertices.points[b as usize]);
        vertices.push(creases.points[new as usize], normals[new as usize], spacing, 0);
        vertices.crease[u as usize] = new;
        held.push(true);
        place.insert(new, u);
        let fresh = triangles.faces.len();
        let other = triangles.across[f][k];
        triangles.split(f, k, u);
        face_of.push(NONE);
        let changed = [f as u32, other].into_iter().filter(|g| *g != NONE);
        for g in changed.chain(fresh as u32..triangles.faces.len() as u32) {
            triangles.faces[g as usize].iter().for_each(|&v| face_of[v as usize] = g);
        }
        report.inserted += 1;
    }
    report.flips += triangles.delaunay(&vertices.points, |a, b| segments.joins(vertices, a, b));
    Ok(segments)
}

/// A face of each vertex, where it has any.
fn face_of(triangles: &Triangles, vertices: usize) -> Vec<u32> {
    let mut out = vec![NONE; vertices];
    for (f, corners) in triangles.faces.iter().enumerate() {
        corners.iter().for_each(|&v| out[v as usize] = f as u32);
    }
    out
}

/// Normals at the corners of a mesh's triangles: at points of creases that of the side along which the triangle lies. `crease`: as in
/// [`Vertices::crease`].
pub(super) fn corner_normals(creases: &Creases, crease: &[u32], mesh: &Mesh) -> Vec<[V3; 3]> {
    let sides = creases.side_normals();
    let one = |f: usize| {
        let front = unit(mesh.face_vector(f));
        mesh.faces[f].map(|v| match crease[v as usize] {
            NONE => mesh.normals[v as usize],
            c => {
                let nearest =
                    sides[c as usize].iter().max_by(|a, b| dot(**a, front).total_cmp(&dot(**b, front)));
                // A tip has a normal in every direction.
                nearest.copied().unwrap_or(front)
            }
        })
    };
    (0..mesh.faces.len()).map(one).collect()
}

/// The vertices that are corners of creases.
pub(super) fn corners(creases: Option<&Creases>, vertices: &Vertices) -> Vec<u32> {
    let place = places(vertices);
    creases.into_iter().flat_map(|c| &c.corners).filter_map(|c| place.get(c).copied()).collect()
}

/// The vertex of each point of a crease.
fn places(vertices: &Vertices) -> HashMap<u32, u32> {
    let on = vertices.crease.iter().enumerate().filter(|(_, c)| **c != NONE);
    on.map(|(v, c)| (*c, v as u32)).collect()
}

struct Work<'a> {
    segments: &'a Segments,
    triangles: &'a mut Triangles,
    vertices: &'a Vertices,
    face_of: Vec<u32>,
    flips: usize,
}

impl Work<'_> {
    /// Whether an edge from `a` to `b` could be made.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let (mut a, mut b) = (a, b);
        let mut stuck = 0;
        for _ in 0..FLIPS {
            let fan = self.triangles.around(&self.face_of, a);
            if fan.iter().any(|&f| self.triangles.corner(f, b).is_some()) {
                return true;
            }
            if self.step(a, b, &fan) {
                stuck = 0;
            } else {
                stuck += 1;
                if stuck == 2 {
                    return false;
                }
                (a, b) = (b, a);
            }
        }
        false
    }

    /// Flips the first edge that the way from `a` to `b` crosses and that is a diagonal of a convex quadrangle. Whether there was one.
    fn step(&mut self, a: u32, b: u32, fan: &[usize]) -> bool {
        let at = |v: u32| self.vertices.points[v as usize];
        let up = self.vertices.normals[a as usize];
        let (p, way) = (at(a), sub(at(b), at(a)));
        let crossed = fan.iter().find_map(|&f| {
            let k = self.triangles.corner(f, a)?;
            let (right, left) = (self.triangles.faces[f][(k + 1) % 3], self.triangles.faces[f][(k + 2) % 3]);
            let between = turns(sub(at(right), p), way, up) > 0.0 && turns(way, sub(at(left), p), up) > 0.0;
            between.then_some((f, (k + 1) % 3))
        });
        let Some((mut f, mut k)) = crossed else { return false };
        for _ in 0..CROSSED {
            let Some((c, d, g, l)) = self.triangles.opposite(f, k) else { return false };
            let (right, left) = (self.triangles.faces[f][k], self.triangles.faces[f][(k + 1) % 3]);
            if self.segments.joins(self.vertices, right, left) {
                return false;
            }
            let new = sub(at(d), at(c));
            let convex =
                turns(sub(at(right), at(c)), new, up) > 0.0 && turns(new, sub(at(left), at(c)), up) > 0.0;
            if convex && self.triangles.flip(f, k) {
                for h in [f, g] {
                    self.triangles.faces[h].iter().for_each(|&v| self.face_of[v as usize] = h as u32);
                }
                self.flips += 1;
                return true;
            }
            if d == b {
                return false;
            }
            // Face g is left, right, d from corner l on: the way leaves it to the right or to the left of d.
            let d_is_left = turns(way, sub(at(d), p), up) > 0.0;
            (f, k) = (g, if d_is_left { (l + 1) % 3 } else { (l + 2) % 3 });
        }
        false
    }
}

/// How far `b` lies to the left of `a`, seen from where `up` points.
fn turns(a: V3, b: V3, up: V3) -> f64 {
    dot(cross(a, b), up)
}
