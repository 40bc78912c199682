//! Triangles of a mesh that pass through each other.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, along, cross, dot, norm, sub};
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use super::Mesh;

/// Triangles in a leaf of the tree.
const LEAF: usize = 4;
/// Pairs of nodes that are looked at in parallel, at least, where there are so many; a fixed number.
const TASKS: usize = 64;
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
        if self.faces.is_empty() {
            return Vec::new();
        }
        let tree = Tree::new(self);
        let tame = tame(&self.points, &self.faces);
        let planes: Vec<Plane> = (0..self.faces.len()).map(|f| Plane::new(self.corners(f))).collect();
        let parts: Vec<Vec<[u32; 2]>> = tree
            .tasks()
            .into_par_iter()
            .map(|task| {
                let mut out = Vec::new();
                tree.pairs(task, &mut |f, g| {
                    if out.len() < MOST && self.cross(f as usize, g as usize, &tame, &planes) {
                        out.push([f.min(g), f.max(g)]);
                    }
                });
                out
            })
            .collect();
        let mut all = parts.concat();
        all.arrange();
        all.truncate(MOST);
        all
    }

    /// Whether two faces pass through each other.
    fn cross(&self, f: usize, g: usize, tame: &[bool], planes: &[Plane]) -> bool {
        let (s, t) = (self.faces[f], self.faces[g]);
        let shared = s.map(|v| t[0] == v || t[1] == v || t[2] == v);
        match shared.iter().filter(|s| **s).count() {
            0 => {
                if planes[f].beside(&self.corners(g)) || planes[g].beside(&self.corners(f)) {
                    return false;
                }
            }
            1 => {
                if (0..3).any(|k| shared[k] && tame[s[k] as usize]) {
                    return false;
                }
            }
            _ => return false,
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

/// The plane of a face.
struct Plane {
    at: V3,
    /// Twice the area long.
    normal: V3,
    /// What a component along the normal may be off by rounding, per length.
    rounding: f64,
}

impl Plane {
    fn new([a, b, c]: [V3; 3]) -> Self {
        let (u, v) = (sub(b, a), sub(c, a));
        Self { at: a, normal: cross(u, v), rounding: ROUNDING * sum_of_parts(u) * sum_of_parts(v) }
    }

    /// Whether all corners of a face lie on one side, farther off than rounding can say otherwise.
    fn beside(&self, corners: &[V3; 3]) -> bool {
        let side = |q: V3| {
            let way = sub(q, self.at);
            let (d, sure) = (dot(self.normal, way), self.rounding * sum_of_parts(way));
            i32::from(d > sure) - i32::from(d < -sure)
        };
        let first = side(corners[0]);
        first != 0 && side(corners[1]) == first && side(corners[2]) == first
    }
}

/// What a determinant of three vectors may be off by rounding, as a part of the product of their lengths: some dozen roundings, with
/// plenty to spare.
const ROUNDING: f64 = 1e-14;

fn sum_of_parts(v: V3) -> f64 {
    v[0].abs() + v[1].abs() + v[2].abs()
}

/// For each vertex whether its triangles meet in their common edges alone, as they certainly do where they form one closed fan that,
/// seen along some direction, goes around the vertex once and faces the viewer everywhere.
fn tame(points: &[V3], faces: &[[u32; 3]]) -> Vec<bool> {
    let mut start = vec![0u32; points.len() + 1];
    faces.iter().flatten().for_each(|&v| start[v as usize + 1] += 1);
    for v in 0..points.len() {
        start[v + 1] += start[v];
    }
    // For each corner the other two vertices in their order.
    let mut around = vec![(0, 0); 3 * faces.len()];
    let mut next = start.clone();
    for f in faces {
        for k in 0..3 {
            let place = &mut next[f[k] as usize];
            around[*place as usize] = (f[(k + 1) % 3], f[(k + 2) % 3]);
            *place += 1;
        }
    }
    let one = |v: usize| {
        let fan = &around[start[v] as usize..start[v + 1] as usize];
        let p = points[v];
        let to = |w: u32| sub(points[w as usize], p);
        // Every neighbour ends one triangle and begins another: the fans are closed, and there is one if a ray meets one triangle.
        let closed = (3..=MANY).contains(&fan.len())
            && fan.iter().enumerate().all(|(i, x)| {
                fan.iter().filter(|y| y.0 == x.1).count() == 1 && fan[i + 1..].iter().all(|y| y.0 != x.0)
            });
        if !closed {
            return false;
        }
        let mut up = [0.0; 3];
        for &(a, b) in fan {
            let n = cross(to(a), to(b));
            up = along(up, 1.0 / norm(n), n);
        }
        // A ray along the first edge belongs to the triangle that begins there; any other that it meets goes around a second time.
        let first = fan[0].0;
        let ray = to(first);
        let aside = cross(up, ray);
        fan.iter().all(|&(a, b)| {
            let (x, y) = (to(a), to(b));
            let n = cross(x, y);
            let (before, after) = (dot(x, aside), dot(y, aside));
            let along_ray = after == 0.0 && dot(y, ray) > 0.0;
            let meets = before < 0.0 && after > 0.0 || along_ray;
            dot(n, up) > CLEAR * norm(n) * norm(up) && (a == first || b == first || !meets)
        })
    };
    (0..points.len()).into_par_iter().with_min_len(1024).map(one).collect()
}

/// Most triangles of a vertex that are looked at.
const MANY: usize = 16;
/// Cosine between a triangle and the direction in which it is seen, at least; so large that rounding does not matter.
const CLEAR: f64 = 0.1;

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

    /// The pairs of nodes of one level, each with itself too, whose boxes meet: all pairs of leaves whose boxes meet are below them.
    fn tasks(&self) -> Vec<[usize; 3]> {
        let level = self.levels.len() - 1;
        let mut tasks = vec![[level, 0, 0]];
        while tasks[0][0] > 0 && tasks.len() < TASKS {
            tasks = tasks.into_iter().flat_map(|task| self.below(task)).collect();
        }
        tasks
    }

    /// The pairs of children of a pair of nodes whose boxes meet.
    fn below(&self, [level, i, j]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        let spans = &self.levels[level - 1];
        let pairs = [(2 * i, 2 * j), (2 * i, 2 * j + 1), (2 * i + 1, 2 * j), (2 * i + 1, 2 * j + 1)];
        pairs.into_iter().enumerate().filter_map(move |(k, (a, b))| {
            // Of a node with itself the second and the third are the same.
            let new = (i != j || k != 2) && a.max(b) < spans.len();
            (new && (a == b || spans[a].meets(&spans[b]))).then_some([level - 1, a, b])
        })
    }

    /// Calls `f` for all pairs of faces with boxes that meet, of which one is below the one node and the other below the other.
    fn pairs(&self, task: [usize; 3], f: &mut impl FnMut(u32, u32)) {
        let mut stack = vec![task];
        while let Some([level, i, j]) = stack.pop() {
            if level > 0 {
                stack.extend(self.below([level, i, j]));
                continue;
            }
            let of = |k: usize| &self.order[k * LEAF..((k + 1) * LEAF).min(self.order.len())];
            for (k, &a) in of(i).iter().enumerate() {
                let span = &self.spans[a as usize];
                let others = if i == j { &of(i)[k + 1..] } else { of(j) };
                others.iter().filter(|b| span.meets(&self.spans[**b as usize])).for_each(|&b| f(a, b));
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
        assert_eq!(tame(&mesh.points, &mesh.faces), [false; 9]);
        assert!(Mesh::default().self_intersections().is_empty());
    }

    #[test]
    fn fans_that_go_around_once_are_tame() {
        let fan = |n: u32, turns: f64, height: f64| {
            let mut points = vec![[0.0, 0.0, height]];
            for k in 0..n {
                let a = turns * std::f64::consts::TAU * f64::from(k) / f64::from(n);
                points.push([a.cos(), a.sin(), 0.0]);
            }
            let faces: Vec<[u32; 3]> = (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect();
            tame(&points, &faces)[0]
        };
        assert!(fan(6, 1.0, 0.0) && fan(5, 1.0, 0.3) && fan(3, 1.0, -0.5));
        assert!(!fan(7, 2.0, 0.1), "twice around");
        assert!(!fan(6, 2.0, 0.1), "twice around, through the same points");
        assert!(!fan(6, 1.0, 100.0), "a spike");
        // Open: the last triangle is missing.
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0]];
        assert!(!tame(&points, &[[0, 1, 2], [0, 2, 3]])[0]);
    }

    #[test]
    fn sheets_that_cross_far_from_common_corners_are_found() {
        // Two octahedra that overlap, against the pairs that are found by comparing all with all.
        let octahedron = |o: f64, first: u32| {
            let points: Vec<V3> = (0..6)
                .map(|k| {
                    let mut p = [o, 0.3 * o, 0.1 * o];
                    p[k / 2] += if k % 2 == 0 { 1.0 } else { -1.0 };
                    p
                })
                .collect();
            let faces =
                [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
            (points, faces.map(|f: [u32; 3]| f.map(|v| v + first)))
        };
        let ((mut points, a), (more, b)) = (octahedron(0.0, 0), octahedron(0.9, 6));
        points.extend(more);
        let mesh = Mesh::new(points, [a, b].concat());
        let bare = vec![false; mesh.points.len()];
        let planes: Vec<Plane> = (0..mesh.faces.len()).map(|f| Plane::new(mesh.corners(f))).collect();
        let mut all = Vec::new();
        for f in 0..mesh.faces.len() {
            for g in f + 1..mesh.faces.len() {
                if mesh.cross(f, g, &bare, &planes) {
                    all.push([f as u32, g as u32]);
                }
            }
        }
        assert!(all.len() >= 6, "{all:?}");
        assert_eq!(mesh.self_intersections(), all);
    }
}
