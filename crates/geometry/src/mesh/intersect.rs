//! Triangles of a mesh that pass through each other.

use isoswarm_field::vector::V3;
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use super::Mesh;

/// Triangles in a leaf of the tree.
const LEAF: usize = 4;
/// So many pairs are reported at most.
const MOST: usize = 10_000;

/// A box.
#[derive(Clone, Copy)]
struct Span {
    lo: V3,
    hi: V3,
}

impl Span {
    const NONE: Self = Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] };

    fn with(self, other: Self) -> Self {
        Self {
            lo: [0, 1, 2].map(|a| self.lo[a].min(other.lo[a])),
            hi: [0, 1, 2].map(|a| self.hi[a].max(other.hi[a])),
        }
    }

    #[inline(always)]
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|a| self.lo[a] <= other.hi[a] && other.lo[a] <= self.hi[a])
    }
}

impl Mesh {
    /// Pairs of faces that pass through each other, by exact predicates; at most 10,000. Faces that share an edge are not compared, and faces
    /// in one plane that overlap are not found.
    pub fn self_intersections(&self) -> Vec<[u32; 2]> {
        let tree = Tree::new(self);
        let parts: Vec<Vec<[u32; 2]>> = (0..self.faces.len().div_ceil(512))
            .into_par_iter()
            .map(|c| {
                let mut out = Vec::new();
                for f in c * 512..((c + 1) * 512).min(self.faces.len()) {
                    tree.visit(&tree.spans[f], |g| {
                        if (g as usize) > f && self.cross(f, g as usize) {
                            out.push([f as u32, g]);
                        }
                    });
                }
                out.sort_unstable();
                out.truncate(MOST);
                out
            })
            .collect();
        let mut all = parts.concat();
        all.truncate(MOST);
        all
    }

    /// Whether two faces pass through each other.
    fn cross(&self, f: usize, g: usize) -> bool {
        let (s, t) = (self.faces[f], self.faces[g]);
        let shared = s.iter().filter(|v| t.contains(v)).count();
        if shared > 1 {
            return false;
        }
        let at = |v: u32| {
            let [x, y, z] = self.points[v as usize];
            Coord3D { x, y, z }
        };
        // An edge of one that has no corner in common with the other passes through it.
        let pierces = |s: [u32; 3], t: [u32; 3]| {
            let [a, b, c] = t.map(at);
            let side = s.map(|v| if t.contains(&v) { 0.0 } else { orient3d(a, b, c, at(v)) });
            (0..3).any(|k| {
                let l = (k + 1) % 3;
                if t.contains(&s[k]) || t.contains(&s[l]) || side[k] * side[l] >= 0.0 {
                    return false;
                }
                let (p, q) = (at(s[k]), at(s[l]));
                let turn = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
                turn.iter().all(|v| *v >= 0.0) || turn.iter().all(|v| *v <= 0.0)
            })
        };
        pierces(s, t) || pierces(t, s)
    }
}

/// Boxes around triangles in a balanced tree over their Morton order.
struct Tree {
    spans: Vec<Span>,
    order: Vec<u32>,
    /// Level by level from the leaves, each half as long as the one before.
    levels: Vec<Vec<Span>>,
}

impl Tree {
    fn new(mesh: &Mesh) -> Self {
        let spans: Vec<Span> = mesh
            .faces
            .iter()
            .map(|f| {
                f.iter()
                    .map(|&v| mesh.points[v as usize])
                    .fold(Span::NONE, |s, p| s.with(Span { lo: p, hi: p }))
            })
            .collect();
        let all = spans.iter().fold(Span::NONE, |s, t| s.with(*t));
        let cell = (0..3).map(|a| all.hi[a] - all.lo[a]).fold(0.0, f64::max) / 1024.0;
        let centres: Vec<V3> =
            spans.iter().map(|s| [0, 1, 2].map(|a| 0.5 * s.lo[a] + 0.5 * s.hi[a])).collect();
        let order = isoswarm_particles::spatial_order(&centres, cell.max(f64::MIN_POSITIVE));
        let leaf = |c: &[u32]| c.iter().fold(Span::NONE, |s, &f| s.with(spans[f as usize]));
        let mut levels: Vec<Vec<Span>> = vec![order.chunks(LEAF).map(leaf).collect()];
        while levels[levels.len() - 1].len() > 1 {
            let up = levels[levels.len() - 1]
                .chunks(2)
                .map(|c| c.iter().fold(Span::NONE, |s, t| s.with(*t)))
                .collect();
            levels.push(up);
        }
        Self { spans, order, levels }
    }

    fn visit(&self, span: &Span, mut f: impl FnMut(u32)) {
        let mut stack = vec![(self.levels.len() - 1, 0)];
        while let Some((level, k)) = stack.pop() {
            if self.levels[level].get(k).is_none_or(|s| !s.meets(span)) {
                continue;
            }
            if level > 0 {
                stack.extend([(level - 1, 2 * k), (level - 1, 2 * k + 1)]);
                continue;
            }
            for &g in self.order.iter().skip(k * LEAF).take(LEAF) {
                if self.spans[g as usize].meets(span) {
                    f(g);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_cross_are_found() {
        let points = vec![
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.5, 0.5, -1.0],
            [0.5, 0.5, 1.0],
            [3.0, 3.0, 0.5],
            [0.6, 0.2, 0.5],
            [3.0, 0.0, 4.0],
            [4.0, 0.0, 3.0],
        ];
        let mesh = Mesh::new(points.clone(), vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        assert_eq!(mesh.self_intersections(), [[0, 1]]);
        // With a common corner: only the opposite edge can pass through.
        let mesh = Mesh::new(points, vec![[0, 1, 2], [0, 3, 4], [0, 7, 8]]);
        assert_eq!(mesh.self_intersections(), [[0, 1]]);
        assert!(Mesh::default().self_intersections().is_empty());
    }
}
