//! Creases in a mesh: their points are vertices that stay, and the segments between them edges that no flip removes.

use std::collections::HashMap;

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, cross, dot, sub};
use isoswarm_particles::creases::Creases;

use super::connect::{NONE, Triangles};
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
        let mut face_of = vec![NONE; vertices.len()];
        for (f, corners) in triangles.faces.iter().enumerate() {
            corners.iter().for_each(|&v| face_of[v as usize] = f as u32);
        }
        let mut work = Work { segments: self, triangles, vertices, face_of, flips: 0 };
        let missing = self.edges(vertices).into_iter().filter(|&[a, b]| !work.join(a, b)).collect();
        (work.flips, missing)
    }
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
            let fan = self.around(a);
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

    /// The faces around a vertex, at a boundary those that are joined to the one that is known.
    fn around(&self, v: u32) -> Vec<usize> {
        let first = self.face_of[v as usize];
        let mut out = Vec::new();
        for back in [false, true] {
            let mut f = first;
            while f != NONE && out.len() < 256 {
                if !(back && f == first) {
                    out.push(f as usize);
                }
                let Some(k) = self.triangles.corner(f as usize, v) else { break };
                f = self.triangles.across[f as usize][if back { k } else { (k + 2) % 3 }];
                if f == first {
                    return out;
                }
            }
        }
        out
    }
}

/// How far `b` lies to the left of `a`, seen from where `up` points.
fn turns(a: V3, b: V3, up: V3) -> f64 {
    dot(cross(a, b), up)
}
