//! Triangles that know their neighbours: flips.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, add, cross, dot, norm, sub};
use rayon::prelude::*;

use super::sides::{pinched, sides};

/// No face on the other side.
pub(super) const NONE: u32 = u32::MAX;

/// Faces and, for the edge from corner k to corner k + 1 of each, the face on its other side.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangles {
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) across: Vec<[u32; 3]>,
}

impl Triangles {
    /// Finds the neighbours. Edges of more than two faces, or of two that run along it in the same direction, get none.
    pub(super) fn new(faces: Vec<[u32; 3]>) -> Self {
        let vertices = faces.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        let sides = sides(vertices, &faces, |_| true);
        let mut across = vec![[NONE; 3]; faces.len()];
        for edge in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            if let [(_, _, s), (_, _, t)] = *edge {
                let ((f, k), (g, l)) = (place(s), place(t));
                if faces[f][k] != faces[g][l] {
                    across[f][k] = g as u32;
                    across[g][l] = f as u32;
                }
            }
        }
        Self { faces, across }
    }

    /// The corner of face `g` at which the edge from `a` starts.
    #[inline(always)]
    pub(super) fn corner(&self, g: usize, a: u32) -> Option<usize> {
        self.faces[g].iter().position(|&v| v == a)
    }

    /// The two vertices opposite of edge `k` of face `f`, and where the edge is in the other face.
    pub(super) fn opposite(&self, f: usize, k: usize) -> Option<(u32, u32, usize, usize)> {
        let g = self.across[f][k];
        if g == NONE {
            return None;
        }
        let g = g as usize;
        let l = self.corner(g, self.faces[f][(k + 1) % 3])?;
        Some((self.faces[f][(k + 2) % 3], self.faces[g][(l + 2) % 3], g, l))
    }

    /// Whether two vertices are joined by an edge, as seen from the fan of faces around `c` that has face `f`.
    pub(super) fn joined(&self, c: u32, d: u32, f: usize) -> bool {
        let mut g = f;
        for _ in 0..64 {
            let Some(k) = self.corner(g, c) else { return true };
            if self.faces[g][(k + 1) % 3] == d || self.faces[g][(k + 2) % 3] == d {
                return true;
            }
            let other = self.across[g][(k + 2) % 3];
            if other == NONE {
                break;
            }
            g = other as usize;
            if g == f {
                return false;
            }
        }
        // At a boundary: the other way round as well.
        let mut g = f;
        for _ in 0..64 {
            let Some(k) = self.corner(g, c) else { return true };
            if self.faces[g][(k + 1) % 3] == d || self.faces[g][(k + 2) % 3] == d {
                return true;
            }
            let other = self.across[g][k];
            if other == NONE {
                return false;
            }
            g = other as usize;
        }
        true
    }

    /// The faces around vertex `v`, counter-clockwise from face `f` on, each with the neighbour that comes first in it; `None` where
    /// they do not close.
    pub(super) fn fan(&self, v: u32, f: usize) -> Option<Vec<(u32, u32)>> {
        let mut out = Vec::with_capacity(8);
        let mut g = f;
        for _ in 0..64 {
            let k = self.corner(g, v)?;
            out.push((g as u32, self.faces[g][(k + 1) % 3]));
            let other = self.across[g][(k + 2) % 3];
            if other == NONE {
                return None;
            }
            g = other as usize;
            if g == f {
                return Some(out);
            }
        }
        None
    }

    /// The faces around a vertex, of which `face_of` knows one, at a boundary those that are joined to it.
    pub(super) fn around(&self, face_of: &[u32], v: u32) -> Vec<usize> {
        let first = face_of[v as usize];
        let mut out = Vec::new();
        for back in [false, true] {
            let mut f = first;
            while f != NONE && out.len() < 256 {
                if !(back && f == first) {
                    out.push(f as usize);
                }
                let Some(k) = self.corner(f as usize, v) else { break };
                f = self.across[f as usize][if back { k } else { (k + 2) % 3 }];
                if f == first {
                    return out;
                }
            }
        }
        out
    }

    /// The edge between two vertices: a face, and the corner at which it begins there.
    pub(super) fn edge(&self, face_of: &[u32], a: u32, b: u32) -> Option<(usize, usize)> {
        self.around(face_of, a).into_iter().find_map(|f| {
            let k = (0..3).find(|&k| {
                let (p, q) = (self.faces[f][k], self.faces[f][(k + 1) % 3]);
                (p, q) == (a, b) || (p, q) == (b, a)
            })?;
            Some((f, k))
        })
    }

    /// Vertices of 0 to n - 1 whose faces form more than one fan.
    pub(super) fn pinched(&self, n: usize) -> Vec<u32> {
        pinched(n, &self.faces, &self.across)
    }

    /// The face over the edge of face `f` that starts at `a`.
    pub(super) fn over(&self, f: usize, a: u32) -> u32 {
        self.corner(f, a).map_or(NONE, |k| self.across[f][k])
    }

    /// Makes face `f` what it says, and tells its neighbours.
    pub(super) fn set(&mut self, f: usize, corners: [u32; 3], across: [u32; 3]) {
        self.faces[f] = corners;
        self.across[f] = across;
        for k in 0..3 {
            // The neighbour runs along the edge the other way.
            self.relink(across[k], corners[(k + 1) % 3], f as u32);
        }
    }

    /// Puts vertex `u` on edge `k` of face `f`: each of the edge's faces becomes two.
    pub(super) fn split(&mut self, f: usize, k: usize, u: u32) {
        let other = self.opposite(f, k);
        let (a, b, c) = (self.faces[f][k], self.faces[f][(k + 1) % 3], self.faces[f][(k + 2) % 3]);
        let (bc, ca) = (self.across[f][(k + 1) % 3], self.across[f][(k + 2) % 3]);
        let x = self.faces.len();
        self.faces.push([u, b, c]);
        self.across.push([NONE; 3]);
        let Some((_, d, g, l)) = other else {
            self.set(f, [a, u, c], [NONE, x as u32, ca]);
            self.set(x, [u, b, c], [NONE, bc, f as u32]);
            return;
        };
        let (ad, db) = (self.across[g][(l + 1) % 3], self.across[g][(l + 2) % 3]);
        let y = self.faces.len();
        self.faces.push([u, d, b]);
        self.across.push([NONE; 3]);
        self.faces[f] = [a, u, c];
        self.faces[g] = [u, a, d];
        self.set(f, [a, u, c], [g as u32, x as u32, ca]);
        self.set(g, [u, a, d], [f as u32, ad, y as u32]);
        self.set(x, [u, b, c], [y as u32, bc, f as u32]);
        self.set(y, [u, d, b], [g as u32, db, x as u32]);
    }

    /// Puts vertex `u` into face `f`, which becomes three; the other two come last.
    pub(super) fn insert(&mut self, f: usize, u: u32) {
        let ([a, b, c], [ab, bc, ca]) = (self.faces[f], self.across[f]);
        let (x, y) = (self.faces.len(), self.faces.len() + 1);
        self.faces.extend([[b, c, u], [c, a, u]]);
        self.across.extend([[NONE; 3]; 2]);
        self.faces[f] = [a, b, u];
        self.set(f, [a, b, u], [ab, x as u32, y as u32]);
        self.set(x, [b, c, u], [bc, y as u32, f as u32]);
        self.set(y, [c, a, u], [ca, f as u32, x as u32]);
    }

    /// Whether the vertex with this fan can be collapsed into its neighbour `k` without changing the topology.
    pub(super) fn may_collapse(&self, fan: &[(u32, u32)], k: usize) -> bool {
        let n = fan.len();
        if n < 4 {
            return false;
        }
        let w = fan[k].1;
        (2..n - 1).all(|s| {
            let x = fan[(k + s) % n].1;
            x != w && !self.joined(w, x, fan[k].0 as usize)
        })
    }

    /// Collapses vertex `v` with the given fan into its neighbour `k`. The two faces at that edge stay in the list, without
    /// a neighbour that knows of them: to be dropped.
    pub(super) fn collapse(&mut self, v: u32, fan: &[(u32, u32)], k: usize) {
        let n = fan.len();
        let at = |s: usize| fan[(k + s) % n];
        let w = at(0).1;
        // The face after the edge, (v, w, w1), and the one before it, (v, w0, w).
        let (f, w1) = (at(0).0 as usize, at(1).1);
        let (g, w0) = (at(n - 1).0 as usize, at(n - 1).1);
        let (over_f, over_g) = (self.over(f, w), self.over(g, w0));
        let (after, before) = (at(1).0 as usize, at(n - 2).0 as usize);
        for s in 1..n - 1 {
            let h = at(s).0 as usize;
            if let Some(c) = self.corner(h, v) {
                self.faces[h][c] = w;
            }
        }
        // (w, w1, ..) has the edge from w to w1 now, and (w, .., w0) that from w0 to w.
        if let Some(c) = self.corner(after, w) {
            self.across[after][c] = over_f;
        }
        self.relink(over_f, w1, after as u32);
        if let Some(c) = self.corner(before, w0) {
            self.across[before][c] = over_g;
        }
        self.relink(over_g, w, before as u32);
    }

    /// Keeps the faces that are not `dead`.
    pub(super) fn drop_faces(&mut self, dead: &[bool]) {
        let mut number = Vec::with_capacity(dead.len());
        let mut n = 0;
        for d in dead {
            number.push(if *d { NONE } else { n });
            n += u32::from(!d);
        }
        let live = |k: &usize| !dead[*k];
        self.faces = (0..dead.len()).filter(live).map(|k| self.faces[k]).collect();
        self.across = (0..dead.len())
            .filter(live)
            .map(|k| self.across[k].map(|g| if g == NONE { NONE } else { number[g as usize] }))
            .collect();
    }

    /// Replaces edge `k` of face `f` by the other diagonal of its two faces. Whether that was possible: not where there is such an
    /// edge already.
    pub(super) fn flip(&mut self, f: usize, k: usize) -> bool {
        let Some((c, d, g, l)) = self.opposite(f, k) else { return false };
        if c == d || self.joined(c, d, f) {
            return false;
        }
        let (a, b) = (self.faces[f][k], self.faces[f][(k + 1) % 3]);
        let (ca, bc) = (self.across[f][(k + 2) % 3], self.across[f][(k + 1) % 3]);
        let (ad, db) = (self.across[g][(l + 1) % 3], self.across[g][(l + 2) % 3]);
        self.faces[f] = [c, a, d];
        self.across[f] = [ca, ad, g as u32];
        self.faces[g] = [d, b, c];
        self.across[g] = [db, bc, f as u32];
        self.relink(ad, d, f as u32);
        self.relink(bc, c, g as u32);
        true
    }

    /// The edge of face `g` that starts at `a` has face `f` on its other side.
    fn relink(&mut self, g: u32, a: u32, f: u32) {
        if g != NONE
            && let Some(k) = self.corner(g as usize, a)
        {
            self.across[g as usize][k] = f;
        }
    }

    /// Flips edges until the angles opposite of each add up to no more than π, where that leaves the triangles on the
    /// side to which they face. Gives the number of flips. `keep(a, b)`: edges that stay.
    pub(super) fn delaunay(&mut self, points: &[V3], keep: impl Fn(u32, u32) -> bool) -> usize {
        let mut flips = 0;
        // Only an edge opposite of an obtuse angle may be flipped: of which a triangle has one at most.
        let first = |f: usize| {
            let at = self.faces[f].map(|v| points[v as usize]);
            let obtuse = |k: &usize| {
                let (a, b, c) = (at[*k], at[(k + 1) % 3], at[(k + 2) % 3]);
                dot(sub(a, c), sub(b, c)) < 0.0
            };
            let k = (0..3).find(obtuse)?;
            self.wants_flip(points, f, k).then(|| self.across[f][k].min(f as u32))
        };
        let mut todo: Vec<u32> =
            (0..self.faces.len()).into_par_iter().with_min_len(2048).filter_map(first).collect();
        todo.arrange();
        todo.dedup();
        let mut queued = vec![false; self.faces.len()];
        todo.iter().for_each(|&f| queued[f as usize] = true);
        for _ in 0..ROUNDS {
            let mut next = Vec::new();
            for &f in &todo {
                queued[f as usize] = false;
                for k in 0..3 {
                    let f = f as usize;
                    let [a, b] = [self.faces[f][k], self.faces[f][(k + 1) % 3]];
                    if !keep(a, b) && self.wants_flip(points, f, k) {
                        let g = self.across[f][k] as usize;
                        if self.flip(f, k) {
                            flips += 1;
                            for h in [f, g] {
                                if !std::mem::replace(&mut queued[h], true) {
                                    next.push(h as u32);
                                }
                            }
                            break;
                        }
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            todo = next;
        }
        flips
    }

    fn wants_flip(&self, points: &[V3], f: usize, k: usize) -> bool {
        let Some((c, d, ..)) = self.opposite(f, k) else { return false };
        let at = |v: u32| points[v as usize];
        let (a, b) = (at(self.faces[f][k]), at(self.faces[f][(k + 1) % 3]));
        let (c, d) = (at(c), at(d));
        // cot γ + cot δ < 0
        let (ca, cb, da, db) = (sub(a, c), sub(b, c), sub(a, d), sub(b, d));
        let (cos_c, cos_d) = (dot(ca, cb), dot(da, db));
        if cos_c >= 0.0 && cos_d >= 0.0 {
            // Neither is obtuse.
            return false;
        }
        let (s, t) = (cross(ca, cb), cross(db, da));
        let (ls, lt) = (norm(s), norm(t));
        let sum = cos_c * lt + cos_d * ls;
        if sum >= -SLACK * ls.max(lt) * dot(sub(a, b), sub(a, b)) {
            return false;
        }
        let front = add(s, t);
        let (p, q) = (cross(sub(a, c), sub(d, c)), cross(sub(b, d), sub(c, d)));
        dot(p, front) > 0.0 && dot(q, front) > 0.0
    }
}

/// Most rounds of flips.
const ROUNDS: usize = 64;
/// What the cotangents of opposite angles may fall short of 0: cocircular vertices stay as they are.
const SLACK: f64 = 1e-9;

fn place(side: u32) -> (usize, usize) {
    (side as usize / 3, side as usize % 3)
}
