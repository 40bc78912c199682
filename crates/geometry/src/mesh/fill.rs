//! Holes between triangles closed, and vertices that lie in them put in.

use std::collections::HashSet;

use isoswarm_field::vector::{V3, cross, dot, norm, sub};

use super::stitch::{Votes, real};

/// Closes holes one after the other.
pub(super) struct Patches<'a> {
    points: &'a [V3],
    normals: &'a [V3],
    votes: &'a Votes<'a>,
    /// Edges of the triangles that were added, smaller number first.
    edges: HashSet<(u32, u32)>,
}

impl<'a> Patches<'a> {
    pub(super) fn new(points: &'a [V3], normals: &'a [V3], votes: &'a Votes<'a>) -> Self {
        Self { points, normals, votes, edges: HashSet::new() }
    }

    /// Triangulates a hole with the given outline (the hole on its left) by cutting off the ear with the smallest circumcircle again and
    /// again. Whether that was possible; otherwise nothing is added.
    pub(super) fn close(&mut self, outline: &[u32], faces: &mut Vec<[u32; 3]>) -> bool {
        // Over creases not all three normals can be on the front.
        [true, false].into_iter().any(|all| self.close_with(outline, faces, all))
    }

    fn close_with(&mut self, outline: &[u32], faces: &mut Vec<[u32; 3]>, all: bool) -> bool {
        if outline.len() < 3 {
            return false;
        }
        let before = faces.len();
        let mut left = outline.to_vec();
        let mut fresh: Vec<(u32, u32)> = Vec::new();
        while left.len() > 3 {
            let n = left.len();
            let ear = |k: usize| [left[(k + n - 1) % n], left[k], left[(k + 1) % n]];
            let best = (0..n)
                .filter(|&k| self.is_ear(ear(k), &left, &fresh, all))
                .map(|k| (circumradius(ear(k).map(|v| self.points[v as usize])), k))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let Some((_, k)) = best else {
                faces.truncate(before);
                return false;
            };
            let face = ear(k);
            fresh.push((face[0].min(face[2]), face[0].max(face[2])));
            faces.push(face);
            left.remove(k);
        }
        let last = [left[0], left[1], left[2]];
        if !self.faces_outwards(last, all) {
            faces.truncate(before);
            return false;
        }
        faces.push(last);
        self.edges.extend(fresh);
        true
    }

    /// Whether a triangle has three corners and their normals, all or on average, on its front.
    fn faces_outwards(&self, face: [u32; 3], all: bool) -> bool {
        let [a, b, c] = face;
        if a == b || b == c || c == a {
            return false;
        }
        let [p, q, r] = face.map(|v| self.points[v as usize]);
        let front = cross(sub(q, p), sub(r, p));
        let side = face.map(|v| dot(front, self.normals[v as usize]));
        let bare = face.map(|v| self.normals[v as usize] == [0.0; 3]);
        front != [0.0; 3]
            && if all {
                (0..3).all(|k| bare[k] || side[k] > 0.0)
            } else {
                side[0] + side[1] + side[2] > 0.0 || bare == [true; 3]
            }
    }

    fn is_ear(&self, face: [u32; 3], outline: &[u32], fresh: &[(u32, u32)], all: bool) -> bool {
        let [a, b, c] = face;
        if !self.faces_outwards(face, all) {
            return false;
        }
        let chord = (a.min(c), a.max(c));
        if self.votes.has_edge(a, c) || self.edges.contains(&chord) || fresh.contains(&chord) {
            return false;
        }
        outline.iter().all(|&v| v == a || v == b || v == c || !self.covers(face, v))
    }

    /// Whether a vertex lies in the prism over a triangle.
    fn covers(&self, face: [u32; 3], v: u32) -> bool {
        let p = self.points[v as usize];
        let [a, b, c] = face.map(|v| self.points[v as usize]);
        let front = cross(sub(b, a), sub(c, a));
        [(a, b), (b, c), (c, a)].into_iter().all(|(s, t)| dot(cross(sub(t, s), sub(p, s)), front) > 0.0)
    }

    /// Splits triangles from number `first` on at the vertices that lie over them. Gives those that lie over none.
    pub(super) fn insert(&self, vertices: Vec<u32>, first: usize, faces: &mut Vec<[u32; 3]>) -> Vec<u32> {
        let mut left = Vec::new();
        for v in vertices {
            let near = |f: &[u32; 3]| f.iter().any(|w| self.votes.ring(v).iter().any(|j| real(*j) && j == w));
            let found = (first..faces.len()).find(|&f| {
                let [a, b, c] = faces[f];
                near(&faces[f])
                    && self.covers(faces[f], v)
                    && [[a, b, v], [b, c, v], [c, a, v]].into_iter().all(|t| self.faces_outwards(t, true))
            });
            match found {
                None => left.push(v),
                Some(f) => {
                    let [a, b, c] = faces[f];
                    faces[f] = [a, b, v];
                    faces.push([b, c, v]);
                    faces.push([c, a, v]);
                }
            }
        }
        left
    }
}

/// Radius of the circle through three points; infinite where they are on a line.
pub(super) fn circumradius([a, b, c]: [V3; 3]) -> f64 {
    let (x, y, z) = (sub(b, a), sub(c, b), sub(a, c));
    norm(x) * norm(y) * norm(z) / (2.0 * norm(cross(x, y)))
}
