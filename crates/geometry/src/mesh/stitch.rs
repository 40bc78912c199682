//! From rings of neighbours to triangles.
//!
//! Every vertex proposes the triangles of its own Delaunay star; those that all three corners propose are taken. At any vertex they
//! are a part of one ring, and no directed edge comes twice, so they form a consistently oriented manifold, with holes
//! where stars disagree: nearly cocircular vertices as a rule. The order of the rings leads around each hole, which is
//! closed by a triangulation of its outline.

use isoswarm_field::{Aabb, vector::V3};
use isoswarm_particles::Rings;
use rayon::prelude::*;

use super::fill;
use super::outlines::Open;
use super::pieces::Pieces;

/// Vertices that one task handles.
const CHUNK: usize = 512;
/// Longest outline of a hole that is closed.
const LONGEST: usize = 64;

/// What stitching gives.
#[derive(Debug, Default)]
pub(super) struct Stitched {
    /// Triangles, counter-clockwise seen from outside.
    pub(super) faces: Vec<[u32; 3]>,
    /// Outlines of holes that could not be closed, without those too long to follow.
    pub(super) holes: Vec<Vec<u32>>,
    /// Vertices that belong to no triangle.
    pub(super) left_out: Vec<u32>,
    /// Triangles that did not come from three stars that agree.
    pub(super) filled: usize,
}

/// Triangles over points on a surface. `spacing` as for [`Rings::find`].
pub(super) fn stitch(points: &[V3], normals: &[V3], bounds: &Aabb, spacing: &[f64]) -> Stitched {
    let rings = Rings::find(points, normals, bounds, spacing);
    over(points, normals, &rings, |votes, _| votes.outlines(), |_| false)
}

/// Triangles over pieces of a surface, each on its own.
pub(super) fn stitch_pieces(pieces: &Pieces, bounds: &Aabb) -> Stitched {
    let Pieces { points, normals, spacing, borders, .. } = pieces;
    let rings = Rings::find_on_pieces(points, normals, bounds, spacing, borders);
    if borders.is_empty() {
        return over(points, normals, &rings, |votes, _| votes.outlines(), |_| false);
    }
    let open = Open { points, normals, borders };
    // Entries of rings tell that the surface ends at the bounds.
    let ends = |a: u32, b: u32| {
        let ring = rings.of(b as usize);
        ring.iter().position(|&j| j == a).is_some_and(|k| ring[next(k, ring.len())] == Rings::WALL)
    };
    pieces.join(over(points, normals, &rings, |_, faces| open.outlines(faces, ends), |v| pieces.on_border(v)))
}

/// `outlines`: those of the holes that the votes leave between triangles; `fixed`: vertices that are not put into other triangles.
fn over(
    points: &[V3],
    normals: &[V3],
    rings: &Rings,
    outlines: impl Fn(&Votes<'_>, &[[u32; 3]]) -> Vec<Vec<u32>>,
    fixed: impl Fn(u32) -> bool,
) -> Stitched {
    let votes = Votes::count(rings);
    let mut out = Stitched { faces: votes.faces(), ..Stitched::default() };
    let agreed = out.faces.len();
    let mut patches = fill::Patches::new(points, normals, &votes);
    for outline in outlines(&votes, &out.faces) {
        if !patches.close(&outline, &mut out.faces) {
            out.holes.push(outline);
        }
    }
    let (fixed, free) = votes.alone().into_iter().partition(|&v| fixed(v));
    out.left_out = patches.insert(free, agreed, &mut out.faces);
    out.left_out.extend::<Vec<u32>>(fixed);
    out.filled = out.faces.len() - agreed;
    out
}

/// Which triangles of the stars are proposed by all their corners.
pub(super) struct Votes<'a> {
    rings: &'a Rings,
    /// For each entry of each ring: whether the triangle of the vertex, the entry and the next one is taken.
    taken: Vec<bool>,
}

impl<'a> Votes<'a> {
    fn count(rings: &'a Rings) -> Self {
        let n = rings.len();
        let parts: Vec<Vec<bool>> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|c| {
                let mut out = Vec::with_capacity(8 * CHUNK);
                for i in c * CHUNK..((c + 1) * CHUNK).min(n) {
                    let ring = rings.of(i);
                    for (k, &a) in ring.iter().enumerate() {
                        let b = ring[next(k, ring.len())];
                        let i = i as u32;
                        out.push(
                            real(a)
                                && real(b)
                                && a != b
                                && follows(rings, a, b, i)
                                && follows(rings, b, i, a),
                        );
                    }
                }
                out
            })
            .collect();
        Self { rings, taken: parts.concat() }
    }

    fn taken(&self, i: u32, k: usize) -> bool {
        self.taken[self.rings.start(i as usize) + k]
    }

    fn faces(&self) -> Vec<[u32; 3]> {
        let parts: Vec<Vec<[u32; 3]>> = (0..self.rings.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|c| {
                let mut out = Vec::with_capacity(2 * CHUNK);
                for i in c * CHUNK..((c + 1) * CHUNK).min(self.rings.len()) {
                    let ring = self.rings.of(i);
                    for (k, &a) in ring.iter().enumerate() {
                        let (i, b) = (i as u32, ring[next(k, ring.len())]);
                        if i < a && i < b && self.taken(i, k) {
                            out.push([i, a, b]);
                        }
                    }
                }
                out
            })
            .collect();
        parts.concat()
    }

    /// Whether the edge belongs to a triangle that is taken.
    pub(super) fn has_edge(&self, a: u32, b: u32) -> bool {
        let ring = self.rings.of(a as usize);
        ring.iter()
            .position(|&j| j == b)
            .is_some_and(|k| self.taken(a, k) || self.taken(a, previous(k, ring.len())))
    }

    /// The neighbours of a vertex.
    pub(super) fn ring(&self, i: u32) -> &[u32] {
        self.rings.of(i as usize)
    }

    /// Vertices without a triangle.
    fn alone(&self) -> Vec<u32> {
        (0..self.rings.len() as u32).filter(|&i| !(0..self.ring(i).len()).any(|k| self.taken(i, k))).collect()
    }

    /// The outlines of the holes between the triangles, each with the hole on its left.
    fn outlines(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.taken.len()];
        let mut out = Vec::new();
        for i in 0..self.rings.len() as u32 {
            for k in 0..self.ring(i).len() {
                if self.borders_hole(i, k) && !seen[self.rings.start(i as usize) + k] {
                    out.extend(self.follow(i, k, &mut seen));
                }
            }
        }
        out
    }

    /// Whether no triangle lies on the left of the way from vertex `i` to its neighbour `k` but one on the right, and the bounds
    /// do not either.
    fn borders_hole(&self, i: u32, k: usize) -> bool {
        let ring = self.ring(i);
        if !real(ring[k]) || self.taken(i, k) || !self.taken(i, previous(k, ring.len())) {
            return false;
        }
        if ring[next(k, ring.len())] == Rings::WALL {
            return false;
        }
        let other = self.ring(ring[k]);
        other.iter().position(|&j| j == i).is_some_and(|m| other[previous(m, other.len())] != Rings::WALL)
    }

    /// Walks around a hole; `None` where the way is lost.
    fn follow(&self, first: u32, k: usize, seen: &mut [bool]) -> Option<Vec<u32>> {
        let (mut i, mut k) = (first, k);
        let begin = (i, k);
        let mut out = Vec::new();
        loop {
            seen[self.rings.start(i as usize) + k] = true;
            out.push(i);
            if out.len() > LONGEST {
                return None;
            }
            let a = self.ring(i)[k];
            (i, k) = (a, self.turn(a, i)?);
            if (i, k) == begin {
                return Some(out);
            }
        }
    }

    /// Having come to `a` from `i`: the entry of the ring of `a` at the other end of the gap, clockwise. A face of the bounds ends a
    /// gap: the way leads along it.
    fn turn(&self, a: u32, i: u32) -> Option<usize> {
        let ring = self.ring(a);
        let first = ring.iter().position(|&j| j == i)?;
        let mut t = first;
        loop {
            let before = previous(t, ring.len());
            let wall = ring[before] == Rings::WALL;
            if wall || self.taken(a, before) {
                return (real(ring[t]) && t != first).then_some(t);
            }
            t = before;
            if t == first {
                return None;
            }
        }
    }
}

/// Whether the entry is a sample.
#[inline(always)]
pub(super) fn real(entry: u32) -> bool {
    entry < Rings::FENCE
}

#[inline(always)]
fn next(k: usize, n: usize) -> usize {
    if k + 1 == n { 0 } else { k + 1 }
}

#[inline(always)]
fn previous(k: usize, n: usize) -> usize {
    if k == 0 { n - 1 } else { k - 1 }
}

/// Whether `b` comes right after `a` in the ring of `i`.
#[inline(always)]
fn follows(rings: &Rings, i: u32, a: u32, b: u32) -> bool {
    let ring = rings.of(i as usize);
    ring.iter().position(|&j| j == a).is_some_and(|k| ring[next(k, ring.len())] == b)
}
