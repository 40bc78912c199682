//! A surface cut along its creases: its vertices on creases once for each piece that they border.
//!
//! Around a point of a crease the surface falls into sectors, each between two half edges (the ways along creases that leave the point):
//! one starts on the left of a half edge and ends, counter-clockwise, on the right of another one, where the normals of these sides are
//! the same. Each sector is a copy of the point, with the sector's normal. Pieces are stitched as if there was nothing else; put together
//! again they fit, for both sides of a crease have the same segments.

use std::f64::consts::{PI, TAU};

use isoswarm_field::arrange::Arrange;
use isoswarm_field::math::atan2;
use isoswarm_field::vector::{V3, add, along, cross, distance, dot, sub, tangential, unit};
use isoswarm_particles::Grid;
use isoswarm_particles::creases::Creases;

use super::connect::NONE;
use super::stitch::Stitched;
use super::vertices::Vertices;

/// Cosines between the normals of the two ends of a sector, each where those before leave ends over: on one piece they are equal but where
/// the corner is singular or was not found exactly, and pieces that meet at a small angle are told apart.
const SAME: [f64; 3] = [0.9999, 0.95, 0.5];
/// How far around a point of a crease normals are looked at where it is the tip of a piece, in spacings.
const AROUND: f64 = 2.5;
/// Samples keep this distance from segments of creases, in lengths of the segment.
const NEAR: f64 = 0.2;
/// Cosine between normals from which on a sample may lie on the piece beside a crease.
const LEVEL: f64 = 0.2;

/// A way along a crease from one vertex to the next.
#[derive(Clone, Copy, Debug)]
struct Half {
    from: u32,
    to: u32,
    /// Normals at `from` on the left and on the right.
    left: V3,
    right: V3,
}

/// Vertices and copies of them as columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Pieces {
    pub(super) points: Vec<V3>,
    pub(super) normals: Vec<V3>,
    pub(super) spacing: Vec<f64>,
    /// Who comes after and before a copy on the border of its piece, which lies on the left; empty without creases.
    pub(super) borders: Vec<[u32; 2]>,
    /// The vertex of each.
    pub(super) vertex: Vec<u32>,
}

impl Pieces {
    /// Without creases: the vertices as they are.
    pub(super) fn whole(vertices: &Vertices) -> Self {
        Self {
            points: vertices.points.clone(),
            normals: vertices.normals.clone(),
            spacing: vertices.reach(),
            borders: Vec::new(),
            vertex: (0..vertices.len() as u32).collect(),
        }
    }

    /// Cuts along creases.
    pub(super) fn cut(vertices: &Vertices, creases: &Creases) -> Self {
        let halves = halves(vertices, creases);
        if halves.is_empty() {
            return Self::whole(vertices);
        }
        let mut leaving: Vec<Vec<u32>> = vec![Vec::new(); vertices.len()];
        for (h, half) in halves.iter().enumerate() {
            leaving[half.from as usize].push(h as u32);
        }
        let mut out = Self::default();
        let reach = vertices.reach();
        let mut add_copy = |v: usize, normal: V3| {
            out.points.push(vertices.points[v]);
            out.normals.push(normal);
            out.vertex.push(v as u32);
            if reach.len() > 1 {
                out.spacing.push(reach[v]);
            }
            out.points.len() as u32 - 1
        };
        // The copies of the sectors that start and that end at a half edge.
        let (mut starting, mut ending) = (vec![NONE; halves.len()], vec![NONE; halves.len()]);
        for (v, leaving) in leaving.iter().enumerate() {
            if leaving.is_empty() {
                add_copy(v, vertices.normals[v]);
                continue;
            }
            let sectors = sectors(vertices, &halves, leaving);
            let sides = sectors
                .iter()
                .map(|s| [s.0.map(|h| halves[h as usize].left), s.1.map(|g| halves[g as usize].right)]);
            let sides: Vec<[Option<V3>; 2]> = sides.collect();
            let single: Vec<V3> = sides.iter().filter(|s| !singular(s)).map(between).collect();
            for (&(start, end), sides) in sectors.iter().zip(&sides) {
                let other = if singular(sides) { around(vertices, v, &single) } else { None };
                let copy = add_copy(v, other.unwrap_or_else(|| between(sides)));
                start.into_iter().for_each(|h| starting[h as usize] = copy);
                end.into_iter().for_each(|g| ending[g as usize] = copy);
            }
        }
        if reach.len() == 1 {
            out.spacing = reach;
        }
        out.borders = vec![[NONE; 2]; out.points.len()];
        for h in 0..halves.len() {
            // The piece on the left of a half edge is on the right of the way back.
            let (from, to) = (starting[h], ending[h ^ 1]);
            if from != NONE && to != NONE {
                out.borders[from as usize][0] = to;
                out.borders[to as usize][1] = from;
            }
        }
        out
    }

    /// Whether a copy is on the border of a piece.
    pub(super) fn on_border(&self, v: u32) -> bool {
        self.borders.get(v as usize).is_some_and(|b| *b != [NONE; 2])
    }

    /// Triangles and holes between vertices instead of copies. A vertex is left out where all its copies are.
    pub(super) fn join(&self, mut stitched: Stitched) -> Stitched {
        let vertex = |v: u32| self.vertex[v as usize];
        stitched.faces.iter_mut().for_each(|f| *f = f.map(vertex));
        stitched.holes.iter_mut().flatten().for_each(|v| *v = vertex(*v));
        let mut used = vec![false; self.vertex.iter().max().map_or(0, |v| *v as usize + 1)];
        stitched.faces.iter().flatten().for_each(|&v| used[v as usize] = true);
        stitched.left_out.iter_mut().for_each(|v| *v = vertex(*v));
        stitched.left_out.retain(|&v| !used[v as usize]);
        stitched.left_out.arrange();
        stitched.left_out.dedup();
        stitched
    }
}

/// Whether a sector has all kinds of normals, as at the tip of a cone.
fn singular(sides: &[Option<V3>; 2]) -> bool {
    matches!(sides, [Some(n), Some(m)] if dot(*n, *m) <= SAME[2])
}

/// The normal in the middle between the ends of a sector.
fn between(sides: &[Option<V3>; 2]) -> V3 {
    unit(sides.iter().flatten().copied().fold([0.0; 3], add))
}

/// The mean normal of the free vertices around `v` that do not lie on pieces with these normals.
fn around(vertices: &Vertices, v: usize, others: &[V3]) -> Option<V3> {
    let reach = AROUND * vertices.spacing[v];
    let near = |&i: &usize| {
        let n = vertices.normals[i];
        !vertices.on_crease(i)
            && distance(vertices.points[i], vertices.points[v]) < reach
            && others.iter().all(|m| dot(n, *m) < SAME[1])
    };
    let sum = (0..vertices.len()).filter(near).fold([0.0; 3], |s, i| add(s, vertices.normals[i]));
    (sum != [0.0; 3]).then(|| unit(sum))
}

/// Removes the samples that are so close to a segment of a crease that triangles between them would be slivers, or that lie beyond it, where
/// the crease bends. Gives how many.
pub(super) fn clear(vertices: &mut Vertices, creases: &Creases) -> usize {
    let halves = halves(vertices, creases);
    let free: Vec<u32> = (0..vertices.len() as u32).filter(|&v| !vertices.on_crease(v as usize)).collect();
    let longest =
        |m: f64, h: &Half| m.max(distance(vertices.points[h.from as usize], vertices.points[h.to as usize]));
    let reach = (0.5 + NEAR) * halves.iter().fold(0.0, longest);
    if free.is_empty() || reach == 0.0 {
        return 0;
    }
    let grid = Grid::new(&vertices.points, Some(free), reach);
    let mut dead = vec![false; vertices.len()];
    for h in &halves {
        let (a, b) = (vertices.points[h.from as usize], vertices.points[h.to as usize]);
        let (way, length) = (sub(b, a), distance(a, b));
        grid.near([0, 1, 2].map(|k| 0.5 * a[k] + 0.5 * b[k]), (0.5 + NEAR) * length, |v| {
            let (p, n) = (vertices.points[v as usize], vertices.normals[v as usize]);
            let part = (dot(sub(p, a), way) / (length * length)).clamp(0.0, 1.0);
            let close = distance(p, along(a, part, way)) < NEAR * length;
            dead[v as usize] |= close && (dot(n, h.left) > LEVEL || n == [0.0; 3]);
        });
    }
    let before = vertices.len();
    vertices.retain(|v| !dead[v]);
    before - vertices.len()
}

/// The half edges; each stands beside its way back.
fn halves(vertices: &Vertices, creases: &Creases) -> Vec<Half> {
    let mut place = vec![NONE; creases.points.len()];
    for (v, &c) in vertices.crease.iter().enumerate().filter(|(_, c)| **c != NONE) {
        place[c as usize] = v as u32;
    }
    let mut out = Vec::new();
    for edge in &creases.edges {
        let n = edge.points.len();
        for (k, [a, b]) in edge.segments().enumerate() {
            let (from, to) = (place[a as usize], place[b as usize]);
            if from == NONE || to == NONE || from == to {
                continue;
            }
            let ([left, right], [far_left, far_right]) = (edge.normals[k], edge.normals[(k + 1) % n]);
            out.push(Half { from, to, left, right });
            out.push(Half { from: to, to: from, left: far_right, right: far_left });
        }
    }
    out
}

/// The sectors around a vertex, as the half edges at which they start and end; none where they reach the bounds.
fn sectors(vertices: &Vertices, halves: &[Half], leaving: &[u32]) -> Vec<(Option<u32>, Option<u32>)> {
    let at = |v: u32| vertices.points[v as usize];
    let half = |h: u32| &halves[h as usize];
    match *leaving {
        // In the middle of a crease.
        [a, b] if !on_walls(vertices, half(a)) => return vec![(Some(a), Some(b)), (Some(b), Some(a))],
        // It fades.
        [a] if !on_walls(vertices, half(a)) => return vec![(Some(a), Some(a))],
        _ => {}
    }
    let way = |h: u32| sub(at(half(h).to), at(half(h).from));
    let mut out = Vec::new();
    let (mut starts, mut ends) = (leaving.to_vec(), leaving.to_vec());
    for (level, least) in SAME.into_iter().enumerate() {
        let mut pairs: Vec<(f64, u32, u32)> = Vec::new();
        for &h in &starts {
            for &g in ends.iter().filter(|g| **g != h) {
                let (n, m) = (half(h).left, half(g).right);
                if dot(n, m) > least {
                    let up = unit(add(n, m));
                    let (a, b) = (tangential(way(h), up), tangential(way(g), up));
                    let angle = atan2(dot(cross(a, b), up), dot(a, b));
                    let angle = if angle < 0.0 { angle + TAU } else { angle };
                    // Of two sectors of a cone the gaps between them may be narrower than they are: by normals alone these would be the
                    // sectors.
                    if angle <= PI || level != 1 {
                        pairs.push((angle, h, g));
                    }
                }
            }
        }
        pairs.arrange_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, h, g) in pairs {
            if starts.contains(&h) && ends.contains(&g) {
                starts.retain(|&s| s != h);
                ends.retain(|&e| e != g);
                out.push((Some(h), Some(g)));
            }
        }
    }
    // Off the bounds what is left over belongs together, as at the tip of a cone, where a piece has all kinds of normals.
    if let ([h], [g]) = (&starts[..], &ends[..])
        && h != g
        && !on_walls(vertices, half(*h))
    {
        out.push((Some(*h), Some(*g)));
        return out;
    }
    out.extend(starts.into_iter().map(|h| (Some(h), None)));
    out.extend(ends.into_iter().map(|g| (None, Some(g))));
    out
}

fn on_walls(vertices: &Vertices, half: &Half) -> bool {
    vertices.faces[half.from as usize] != 0
}
