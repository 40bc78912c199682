//! Triangles of a mesh that pass through each other.

use std::ops::Range;

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, along, cross, dot, norm, sub};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

use super::Mesh;
use super::error::centres;

/// Boxes that are compared with one at a time.
const WIDE: usize = 8;
/// Leaves of the tree that one task handles; a fixed number.
const TASK: usize = 32;
/// How much larger boxes are than what they hold, in lengths of the whole: more than single precision is off.
const ROOM: f32 = 2e-7;
/// Faces that one task prepares, at least.
const CHUNK: usize = 2048;
/// So many pairs are reported at most.
const MOST: usize = 10_000;

/// A box in lengths of the whole.
#[derive(Clone, Copy)]
struct Span {
    lo: [f32; 3],
    hi: [f32; 3],
}

/// Some boxes, coordinate by coordinate.
struct Spans {
    lo: [[f32; WIDE]; 3],
    hi: [[f32; WIDE]; 3],
}

impl Spans {
    /// The places that nothing takes meet nothing.
    fn of(spans: &[Span]) -> Self {
        let mut out = Self { lo: [[f32::INFINITY; WIDE]; 3], hi: [[f32::NEG_INFINITY; WIDE]; 3] };
        for (k, s) in spans.iter().enumerate() {
            for a in 0..3 {
                (out.lo[a][k], out.hi[a][k]) = (s.lo[a], s.hi[a]);
            }
        }
        out
    }

    fn one(&self, k: usize) -> Span {
        Span { lo: self.lo.map(|c| c[k]), hi: self.hi.map(|c| c[k]) }
    }

    /// The box around them.
    fn around(&self) -> Span {
        let least = |c: [f32; WIDE]| c.into_iter().fold(f32::INFINITY, f32::min);
        let most = |c: [f32; WIDE]| c.into_iter().fold(f32::NEG_INFINITY, f32::max);
        Span { lo: self.lo.map(least), hi: self.hi.map(most) }
    }

    /// Which of them meet a box, as bits.
    #[inline(always)]
    fn meeting(&self, span: &Span) -> u32 {
        let mut gap = [f32::NEG_INFINITY; WIDE];
        for a in 0..3 {
            for k in 0..WIDE {
                let (below, above) = (self.lo[a][k] - span.hi[a], span.lo[a] - self.hi[a][k]);
                let wider = if below > above { below } else { above };
                gap[k] = if wider > gap[k] { wider } else { gap[k] };
            }
        }
        gap.iter().enumerate().fold(0, |bits, (k, g)| bits | u32::from(*g <= 0.0) << k)
    }
}

/// The vertices of some faces, corner by corner. Those that are not tame have no number.
struct Corners([[u32; WIDE]; 3]);

/// What stands for a vertex that is not tame, and for one in a face that is compared with others: the two differ.
const WILD: [u32; 2] = [u32::MAX, u32::MAX - 1];

impl Corners {
    fn of(faces: impl Iterator<Item = [u32; 3]>, tame: &[bool]) -> Self {
        let mut out = Self([[WILD[0]; WIDE]; 3]);
        for (k, face) in faces.enumerate() {
            for (corner, &v) in out.0.iter_mut().zip(&face) {
                corner[k] = if tame[v as usize] { v } else { WILD[0] };
            }
        }
        out
    }

    fn one(&self, k: usize) -> [u32; 3] {
        self.0.map(|c| if c[k] == WILD[0] { WILD[1] } else { c[k] })
    }

    /// Which of them have a tame vertex in common with a face, as bits: they do not pass through it.
    #[inline(always)]
    fn joined(&self, face: &[u32; 3]) -> u32 {
        let mut same = [0u32; WIDE];
        for corner in &self.0 {
            for v in face {
                for k in 0..WIDE {
                    same[k] |= u32::from(corner[k] == *v);
                }
            }
        }
        same.iter().enumerate().fold(0, |bits, (k, s)| bits | s << k)
    }
}

/// The places of the bits that are set.
fn places(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let k = bits.trailing_zeros() as usize;
        (bits != 0).then(|| {
            bits &= bits - 1;
            k
        })
    })
}

impl Mesh {
    /// Pairs of faces that pass through each other, by exact predicates; at most 10,000. Faces that share an edge are not compared, and faces
    /// in one plane that overlap are not found.
    pub fn self_intersections(&self) -> Vec<[u32; 2]> {
        if self.faces.is_empty() {
            return Vec::new();
        }
        let (tree, tame) = rayon::join(|| Tree::new(self), || tame(&self.points, &self.faces));
        let corners: Vec<Corners> = tree
            .order
            .par_chunks(WIDE)
            .with_min_len(CHUNK / WIDE)
            .map(|leaf| Corners::of(leaf.iter().map(|&f| self.faces[f as usize]), &tame))
            .collect();
        let (tree, corners, arch) = (&tree, &corners[..], Arch::new());
        let parts: Vec<Vec<[u32; 2]>> = (0..corners.len().div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let mut out = Vec::new();
                let leaves = task * TASK..((task + 1) * TASK).min(corners.len());
                let met = |f: u32, g: u32| {
                    if out.len() < MOST && self.cross(f as usize, g as usize) {
                        out.push([f.min(g), f.max(g)]);
                    }
                };
                arch.dispatch(Pairs { tree, corners, leaves, met });
                out
            })
            .collect();
        let mut all = parts.concat();
        all.arrange();
        all.truncate(MOST);
        all
    }

    /// Whether two faces pass through each other.
    fn cross(&self, f: usize, g: usize) -> bool {
        let (s, t) = (self.faces[f], self.faces[g]);
        match s.iter().filter(|v| t.contains(v)).count() {
            0 => {
                let (s, t) = (self.corners(f), self.corners(g));
                if Plane::new(s).beside(&t) || Plane::new(t).beside(&s) {
                    return false;
                }
            }
            1 => {}
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
    order: Vec<u32>,
    /// Level by level from the leaves, which hold [`WIDE`] triangles each, every node the boxes of as many below.
    levels: Vec<Vec<Spans>>,
}

impl Tree {
    fn new(mesh: &Mesh) -> Self {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &v in mesh.faces.as_flattened() {
            let p = mesh.points[v as usize];
            for a in 0..3 {
                (lo[a], hi[a]) = (lo[a].min(p[a]), hi[a].max(p[a]));
            }
        }
        let size = (0..3).map(|a| hi[a] - lo[a]).fold(f64::MIN_POSITIVE, f64::max);
        let place = |p: V3| [0, 1, 2].map(|a| ((p[a] - lo[a]) / size) as f32);
        let around = |f: &u32| {
            let mut span = Span { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };
            for p in mesh.corners(*f as usize).map(place) {
                for a in 0..3 {
                    span.lo[a] = span.lo[a].min(p[a] - ROOM);
                    span.hi[a] = span.hi[a].max(p[a] + ROOM);
                }
            }
            span
        };
        let order = isoswarm_particles::spatial_order(&centres(&mesh.points, &mesh.faces), size / 1024.0);
        let mut spans: Vec<Span> = order.par_iter().with_min_len(CHUNK).map(around).collect();
        let mut levels: Vec<Vec<Spans>> = Vec::new();
        loop {
            let level: Vec<Spans> = spans.chunks(WIDE).map(Spans::of).collect();
            spans = level.iter().map(Spans::around).collect();
            levels.push(level);
            if spans.len() <= 1 {
                return Self { order, levels };
            }
        }
    }
}

/// Calls `met` for all pairs of faces that have boxes that meet and no tame vertex in common, of which the first is in one of the leaves
/// and the second there or in a later one.
struct Pairs<'a, F: FnMut(u32, u32)> {
    tree: &'a Tree,
    corners: &'a [Corners],
    leaves: Range<usize>,
    met: F,
}

impl<F: FnMut(u32, u32)> NullaryFnOnce for Pairs<'_, F> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { tree: Tree { order, levels }, corners, leaves, mut met } = self;
        let mut stack = Vec::new();
        for i in leaves {
            let leaf = &levels[0][i];
            let whole = leaf.around();
            stack.push((levels.len() - 1, 0, whole));
            while let Some((level, node, span)) = stack.pop() {
                let boxes = &levels[level][node];
                if level > 0 {
                    let later = |k: &usize| (WIDE * node + k + 1) * WIDE.pow(level as u32 - 1) > i;
                    let below = places(boxes.meeting(&whole)).filter(later);
                    stack.extend(below.map(|k| (level - 1, WIDE * node + k, boxes.one(k))));
                    continue;
                }
                for a in places(leaf.meeting(&span)) {
                    // Of its own leaf the faces that come after it.
                    let after = if node == i { !1 << a } else { !0 };
                    let bits = boxes.meeting(&leaf.one(a)) & after;
                    let bits = if bits == 0 { 0 } else { bits & !corners[node].joined(&corners[i].one(a)) };
                    for k in places(bits) {
                        met(order[WIDE * i + a], order[WIDE * node + k]);
                    }
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
        let all = among_all(&mesh);
        assert!(all.len() >= 6, "{all:?}");
        assert_eq!(mesh.self_intersections(), all);
    }

    #[test]
    fn loose_triangles_of_all_sizes_are_compared_with_all_that_they_meet() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for (scale, at) in [(1.0, 0.0), (1e-9, 1.0), (1e12, -1e13)] {
            let mut points: Vec<V3> = Vec::new();
            for k in 0..900 {
                let (size, middle) = (0.8 / f64::from(1 + k % 17), [0; 3].map(|_| random()));
                let corner = |_| middle.map(|m| at + scale * (m + size * (random() - 0.5)));
                points.extend([0, 1, 2].map(corner));
            }
            let faces: Vec<[u32; 3]> = (0..900).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            let mesh = Mesh::new(points, faces);
            let all = among_all(&mesh);
            assert!(all.len() > 100, "{}", all.len());
            assert_eq!(mesh.self_intersections(), all);
        }
    }

    /// The pairs of faces that cross, by comparing all with all.
    fn among_all(mesh: &Mesh) -> Vec<[u32; 2]> {
        let mut all = Vec::new();
        for f in 0..mesh.faces.len() {
            for g in f + 1..mesh.faces.len() {
                if mesh.cross(f, g) {
                    all.push([f as u32, g as u32]);
                }
            }
        }
        all
    }
}
