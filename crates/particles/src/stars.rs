//! Each sample's Voronoi cell in its tangent plane, and with it its Delaunay star.
//!
//! Neighbours on the same sheet are unfolded into the tangent plane at their distance along the surface; the cell is
//! what the bisectors leave of a disc, and the neighbours whose bisectors bound it are the star.

use isoswarm_field::arrange::Arrange;
use rayon::prelude::*;

use crate::constraint::Walls;
use crate::neighbors::Neighbors;
use crate::vector::{V3, along, distance, dot, frame, norm, scale, sub, tangential};

/// Bisectors shorter than this part of the distance between the floaters that they separate do not count as shared
/// edges: four floaters on one circle are not neighbours across both diagonals.
const SHORT: f64 = 0.05;

/// Most vertices of a cell; further bisectors are ignored (six are usual).
const VERTICES: usize = 32;

/// Cells that one task computes.
const TASK: usize = 128;

/// Bits of a neighbour's place in its list; those in places beyond do not bound cells.
const PLACE: u64 = 0xffff;

/// Tag of an edge that is no bisector.
pub(crate) const OPEN: u32 = u32::MAX;
/// Tag of an edge on a face of the bounds.
pub(crate) const WALL: u32 = u32::MAX - 1;

/// The cell of one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// Area (length, on a curve).
    pub(crate) area: f64,
    /// Distance to the nearest neighbour; infinite where there is none.
    pub(crate) nearest: f64,
    /// Mean distance to the star; 0 where there is none.
    pub(crate) mean: f64,
    /// Largest distance from the sample to a corner of its cell.
    pub(crate) hole: f32,
    /// From the sample to that corner.
    pub(crate) corner: [f32; 3],
    /// Number of neighbours in the star.
    pub(crate) valence: u32,
    /// Whether some direction is bounded by no neighbour and no face.
    pub(crate) open: bool,
    /// Whether the cell ends at a face of the bounds.
    pub(crate) clipped: bool,
}

/// A convex polygon around the origin; `tag[k]` belongs to the edge from vertex k to vertex k + 1.
struct Polygon {
    n: usize,
    now: Outline,
    /// Where the next outline is written.
    next: Outline,
}

struct Outline {
    x: [f64; VERTICES],
    y: [f64; VERTICES],
    tag: [u32; VERTICES],
}

impl Outline {
    #[inline(always)]
    fn set(&mut self, k: usize, x: f64, y: f64, tag: u32) {
        (self.x[k], self.y[k], self.tag[k]) = (x, y, tag);
    }
}

impl Polygon {
    fn new() -> Self {
        let outline = || Outline { x: [0.0; VERTICES], y: [0.0; VERTICES], tag: [OPEN; VERTICES] };
        Self { n: 0, now: outline(), next: outline() }
    }

    /// Starts anew with a regular octagon of circumradius `r`, turned so that no edge is parallel to an axis of the
    /// frame.
    fn octagon(&mut self, r: f64) {
        const C: [[f64; 2]; 8] = [
            [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
            [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
            [-0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
            [-0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
            [-0.923_879_532_511_286_7, -0.382_683_432_365_089_8],
            [-0.382_683_432_365_089_8, -0.923_879_532_511_286_7],
            [0.382_683_432_365_089_8, -0.923_879_532_511_286_7],
            [0.923_879_532_511_286_7, -0.382_683_432_365_089_8],
        ];
        self.n = 8;
        for (k, c) in C.iter().enumerate() {
            self.now.set(k, r * c[0], r * c[1], OPEN);
        }
    }

    /// Keeps the part where a·x ≤ b; the new edge gets the tag. Whether that changed anything.
    fn clip(&mut self, a: [f64; 2], b: f64, tag: u32) -> bool {
        let n = self.n.min(VERTICES);
        let mut s = [0.0; VERTICES];
        let mut outside = 0;
        for k in 0..n {
            s[k] = a[0] * self.now.x[k] + a[1] * self.now.y[k] - b;
            outside += usize::from(s[k] > 0.0);
        }
        if outside == 0 || (outside < n && n + 2 > VERTICES) {
            return false;
        }
        let (now, next) = (&self.now, &mut self.next);
        let mut m = 0;
        for k in 0..n {
            let l = if k + 1 == n { 0 } else { k + 1 };
            let inside = s[k] <= 0.0;
            if inside {
                next.set(m, now.x[k], now.y[k], now.tag[k]);
                m += 1;
            }
            if inside != (s[l] <= 0.0) {
                let t = s[k] / (s[k] - s[l]);
                let (x, y) = (now.x[k] + t * (now.x[l] - now.x[k]), now.y[k] + t * (now.y[l] - now.y[k]));
                // Leaving: the new edge starts here. Entering: the rest of the old edge does.
                next.set(m, x, y, if inside { tag } else { now.tag[k] });
                m += 1;
            }
        }
        for k in 0..m {
            self.now.set(k, next.x[k], next.y[k], next.tag[k]);
        }
        self.n = m;
        true
    }

    /// The corner that is farthest from the origin, and the square of its distance.
    fn farthest(&self) -> ([f64; 2], f64) {
        let mut best = ([0.0; 2], 0.0);
        for k in 0..self.n {
            let (x, y) = (self.now.x[k], self.now.y[k]);
            if x * x + y * y > best.1 {
                best = ([x, y], x * x + y * y);
            }
        }
        best
    }

    /// The vector from vertex k to vertex k + 1, after vertex k.
    fn edge(&self, k: usize) -> ([f64; 2], [f64; 2]) {
        let l = if k + 1 == self.n { 0 } else { k + 1 };
        let (x, y) = (self.now.x[k], self.now.y[k]);
        ([x, y], [self.now.x[l] - x, self.now.y[l] - y])
    }

    fn area(&self) -> f64 {
        let twice = |(p, d): ([f64; 2], [f64; 2])| p[0] * d[1] - p[1] * d[0];
        0.5 * (0..self.n).map(|k| twice(self.edge(k))).sum::<f64>()
    }
}

/// Length along the surface between two points a distance `d` apart by the chord `r`, estimated from their normals:
/// along an arc where the normals differ little, over a crease where they differ much.
pub(crate) fn along_surface(r: V3, d: f64, n: V3, m: V3) -> f64 {
    let c = dot(n, m);
    if c > 0.999_999 || n == [0.0; 3] || m == [0.0; 3] {
        return d;
    }
    let c = c.max(-0.5);
    // θ²/24 of the chord, with θ² = 2 (1 - cos θ).
    let arc = d * (1.0 + (1.0 - c) / 12.0);
    if c > 0.7 {
        return arc;
    }
    let crease =
        (0.5 * (norm(tangential(r, n)) + norm(tangential(r, m))) * 2.0 / (1.0 + c)).clamp(arc, 2.0 * d);
    let t = ((0.7 - c) / 0.4).min(1.0);
    arc + t * (crease - arc)
}

/// Working memory for cells, used for one after the other.
pub(crate) struct Desk {
    cell: Polygon,
    /// Neighbours by distance: the bits of the square of the distance, the lowest of them replaced by the place in the list.
    near: Vec<u64>,
    /// Numbers of those whose bisectors cut, and the lengths of the ways to them along the surface.
    lengths: Vec<(u32, f64)>,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { cell: Polygon::new(), near: Vec::new(), lengths: Vec::new() }
    }
}

/// What a cell is computed from.
pub(crate) struct Stars<'a> {
    pub(crate) points: &'a [V3],
    pub(crate) normals: &'a [V3],
    pub(crate) lists: &'a Neighbors,
    pub(crate) walls: &'a Walls,
    /// Half the reach of the lists: cells end there.
    pub(crate) radius: f64,
    /// Relative sizes, or empty.
    pub(crate) size: &'a [f64],
}

impl Stars<'_> {
    /// The cells of all samples, in parallel.
    pub(crate) fn cells(&self) -> Vec<Cell> {
        (0..self.points.len())
            .into_par_iter()
            .with_min_len(TASK)
            .map_init(Desk::new, |desk, i| self.cell(i, desk, |_, _| {}))
            .collect()
    }

    /// The cell of sample `i`; `star(j, length)` is called for each neighbour in the star with the length of the
    /// edge between the cells.
    pub(crate) fn cell(&self, i: usize, desk: &mut Desk, star: impl FnMut(u32, f64)) -> Cell {
        if self.walls.axes == 2 { self.cell_on_curve(i, star) } else { self.cell_on_surface(i, desk, star) }
    }

    fn reach(&self, i: usize) -> f64 {
        if self.size.is_empty() { self.radius } else { self.radius * self.size[i] }
    }

    /// Whether the bounds clip the surface around a sample: then it or a neighbour lies on a face. A face that is near
    /// but not reached does not matter.
    fn at_walls(&self, i: usize, others: &[u32], radius: f64) -> bool {
        let (walls, p) = (self.walls, self.points[i]);
        // Faces beyond the radius do not clip.
        (0..walls.axes).any(|a| p[a] - walls.lo[a] < radius || walls.hi[a] - p[a] < radius)
            && (walls.touches(p) || others.iter().any(|&j| walls.touches(self.points[j as usize])))
    }

    /// Clips the disc around sample `i` to its cell by the bisectors to those of `others` (numbers, repetitions do no
    /// harm) nearer than twice `radius`. Gives the distance to the nearest, the farthest corner of the cell and the square
    /// of its distance; the cell and the lengths of the ways along the surface are left on the desk.
    fn outline(&self, i: usize, others: &[u32], radius: f64, desk: &mut Desk) -> (f64, V3, f64) {
        let Desk { cell, near, lengths } = desk;
        let (p, n) = (self.points[i], self.normals[i]);
        let (u, v) = frame(if n == [0.0; 3] { [0.0, 0.0, 1.0] } else { n });
        let least = self.by_distance(p, others, radius, near);
        cell.octagon(radius);
        if self.at_walls(i, others, radius) {
            self.clip_by_walls(p, u, v, radius, cell);
        }
        lengths.clear();
        let mut farthest = cell.farthest();
        for &key in near.iter() {
            let j = others[(key & PLACE) as usize];
            let r = sub(self.points[j as usize], p);
            let square = dot(r, r);
            // The way along the surface is longer than the chord.
            if 0.25 * square >= farthest.1 {
                break;
            }
            let flat = [dot(r, u), dot(r, v)];
            let (d, length) = (square.sqrt(), (flat[0] * flat[0] + flat[1] * flat[1]).sqrt());
            if length < 1e-3 * d {
                continue;
            }
            let s = along_surface(r, d, n, self.normals[j as usize]);
            let q = [flat[0] * s / length, flat[1] * s / length];
            if cell.clip(q, 0.5 * s * s, j) {
                farthest = cell.farthest();
                lengths.push((j, s));
            }
        }
        let (corner, square) = farthest;
        (least.sqrt(), along(scale(u, corner[0]), corner[1], v), square)
    }

    /// The tags around the cell of sample `i`, counter-clockwise seen from the side to which its normal points.
    pub(crate) fn ring(&self, i: usize, others: &[u32], radius: f64, desk: &mut Desk, out: &mut Vec<u32>) {
        self.outline(i, others, radius, desk);
        out.extend_from_slice(&desk.cell.now.tag[..desk.cell.n]);
    }

    fn cell_on_surface(&self, i: usize, desk: &mut Desk, mut star: impl FnMut(u32, f64)) -> Cell {
        let (nearest, corner, square) = self.outline(i, self.lists.of(i), self.reach(i), desk);
        let Desk { cell, lengths, .. } = desk;
        let mut out = Cell {
            area: cell.area(),
            nearest,
            mean: 0.0,
            hole: square.sqrt() as f32,
            corner: corner.map(|c| c as f32),
            valence: 0,
            open: false,
            clipped: false,
        };
        for k in 0..cell.n {
            match cell.now.tag[k] {
                OPEN => out.open = true,
                WALL => out.clipped = true,
                j => {
                    let s = lengths.iter().find(|c| c.0 == j).map_or(0.0, |c| c.1);
                    let (_, way) = cell.edge(k);
                    let edge = (way[0] * way[0] + way[1] * way[1]).sqrt();
                    if edge > SHORT * s {
                        out.valence += 1;
                        out.mean += s;
                        star(j, edge);
                    }
                }
            }
        }
        out.mean /= f64::from(out.valence.max(1));
        out
    }

    /// The area of the cell of sample `i` on its own side of creases: among those of `others` that are on that side, within
    /// `radius`, and within the lines of `segments`, each from point to point of a crease.
    pub(crate) fn area_beside(
        &self,
        i: usize,
        others: &[u32],
        segments: &[[V3; 2]],
        radius: f64,
        cell: &mut Desk,
    ) -> f64 {
        let Desk { cell, near, .. } = cell;
        let (p, n) = (self.points[i], self.normals[i]);
        let (u, v) = frame(if n == [0.0; 3] { [0.0, 0.0, 1.0] } else { n });
        cell.octagon(radius);
        if self.at_walls(i, others, radius) {
            self.clip_by_walls(p, u, v, radius, cell);
        }
        let flat = |q: V3| {
            let r = sub(q, p);
            [dot(r, u), dot(r, v)]
        };
        let mut lines: Vec<([f64; 2], f64)> = Vec::new();
        for s in segments {
            let (a, b) = (flat(s[0]), flat(s[1]));
            let d = [b[0] - a[0], b[1] - a[1]];
            let square = d[0] * d[0] + d[1] * d[1];
            let foot = -(a[0] * d[0] + a[1] * d[1]) / square;
            // Beyond its ends a segment bounds nothing.
            if !(-1e-9..=1.0 + 1e-9).contains(&foot) {
                continue;
            }
            let to = [a[0] + foot * d[0], a[1] + foot * d[1]];
            let b = to[0] * to[0] + to[1] * to[1];
            cell.clip(to, b, WALL);
            lines.push((to, b));
        }
        self.by_distance(p, others, radius, near);
        for &key in near.iter() {
            let j = others[(key & PLACE) as usize];
            let d = distance(self.points[j as usize], p);
            if 0.25 * d * d >= cell.farthest().1 {
                break;
            }
            let q = flat(self.points[j as usize]);
            let length = (q[0] * q[0] + q[1] * q[1]).sqrt();
            if length < 1e-3 * d {
                continue;
            }
            let s = along_surface(sub(self.points[j as usize], p), d, n, self.normals[j as usize]);
            let q = [q[0] * s / length, q[1] * s / length];
            if lines.iter().all(|(a, b)| a[0] * q[0] + a[1] * q[1] <= *b) {
                cell.clip(q, 0.5 * s * s, j);
            }
        }
        cell.area()
    }

    /// Those of `others` whose bisectors reach within `radius` of `p`, by distance, as [`Desk`] keeps them; and the square of the
    /// distance to the nearest one.
    fn by_distance(&self, p: V3, others: &[u32], radius: f64, near: &mut Vec<u64>) -> f64 {
        near.clear();
        let reach = 4.0 * radius * radius;
        let mut least = f64::INFINITY;
        for (k, &j) in others.iter().enumerate() {
            let r = sub(self.points[j as usize], p);
            let square = dot(r, r);
            least = least.min(square);
            if square > 0.0 && square <= reach && k as u64 <= PLACE {
                // Of numbers above zero the larger one has the larger bits.
                near.push((square.to_bits() & !PLACE) | k as u64);
            }
        }
        near.arrange();
        least
    }

    fn clip_by_walls(&self, p: V3, u: V3, v: V3, radius: f64, cell: &mut Polygon) {
        for a in 0..3 {
            if self.walls.hi[a] - p[a] < radius {
                cell.clip([u[a], v[a]], self.walls.hi[a] - p[a], WALL);
            }
            if p[a] - self.walls.lo[a] < radius {
                cell.clip([-u[a], -v[a]], p[a] - self.walls.lo[a], WALL);
            }
        }
    }

    fn cell_on_curve(&self, i: usize, mut star: impl FnMut(u32, f64)) -> Cell {
        let (p, n) = (self.points[i], self.normals[i]);
        let radius = self.reach(i);
        let t = [-n[1], n[0], 0.0];
        let at_walls = self.at_walls(i, self.lists.of(i), radius);
        let mut side = [(2.0 * radius, OPEN); 2];
        let mut nearest = f64::INFINITY;
        for &j in self.lists.of(i) {
            let r = sub(self.points[j as usize], p);
            let d = norm(r);
            nearest = nearest.min(d);
            let way = usize::from(dot(r, t) > 0.0);
            let s = along_surface(r, d, n, self.normals[j as usize]);
            if s < side[way].0 {
                side[way] = (s, j);
            }
        }
        let mut out = Cell {
            area: 0.0,
            nearest,
            mean: 0.0,
            hole: 0.0,
            corner: [0.0; 3],
            valence: 0,
            open: false,
            clipped: false,
        };
        for (way, (s, j)) in side.into_iter().enumerate() {
            let mut half = 0.5 * s;
            let mut wall = false;
            for a in 0..2 {
                let ta = if way == 1 { t[a] } else { -t[a] };
                let room = if ta > 0.0 { self.walls.hi[a] - p[a] } else { p[a] - self.walls.lo[a] };
                if at_walls && ta != 0.0 && room < half * ta.abs() {
                    half = room / ta.abs();
                    wall = true;
                }
            }
            out.area += half;
            if half as f32 > out.hole {
                out.hole = half as f32;
                out.corner = scale(t, if way == 1 { half } else { -half }).map(|c| c as f32);
            }
            out.clipped |= wall;
            if j == OPEN {
                out.open |= !wall;
            } else {
                out.valence += 1;
                out.mean += s;
                star(j, s);
            }
        }
        out.mean /= f64::from(out.valence.max(1));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isoswarm_field::Aabb;

    fn lattice(hexagonal: bool) -> Vec<V3> {
        let mut points = Vec::new();
        for b in -6..=6i32 {
            for a in -6..=6i32 {
                let shift = if hexagonal { 0.5 * f64::from(b) } else { 0.0 };
                let rise = if hexagonal { 0.75f64.sqrt() } else { 1.0 };
                points.push([f64::from(a) + shift, rise * f64::from(b), 0.0]);
            }
        }
        points
    }

    fn centre(points: &[V3], walls: &Walls) -> (Cell, Vec<u32>) {
        let normals = vec![[0.0, 0.0, 1.0]; points.len()];
        let lists = Neighbors::find(points, crate::neighbors::Reach::Same(2.6), |_, _| true);
        let stars = Stars { points, normals: &normals, lists: &lists, walls, radius: 1.3, size: &[] };
        let mut star = Vec::new();
        let cell = stars.cell(6 * 13 + 6, &mut Desk::new(), |j, _| star.push(j));
        (cell, star)
    }

    #[test]
    fn lattices_have_their_cells() {
        let wide = Walls::new(&Aabb::new([-99.0; 3], [99.0; 3]), 3);
        let (cell, star) = centre(&lattice(true), &wide);
        assert!((cell.area - 0.75f64.sqrt()).abs() < 1e-14 && cell.valence == 6 && !cell.open, "{cell:?}");
        assert!((f64::from(cell.hole) - 1.0 / 3f64.sqrt()).abs() < 1e-7 && (cell.mean - 1.0).abs() < 1e-14);
        assert_eq!(star.len(), 6);
        let (cell, _) = centre(&lattice(false), &wide);
        assert!((cell.area - 1.0).abs() < 1e-14 && cell.valence == 4, "{cell:?}");
    }

    #[test]
    fn a_face_cuts_the_cell() {
        let walls = Walls::new(&Aabb::new([-99.0, -99.0, -99.0], [0.0, 99.0, 99.0]), 3);
        let (cell, _) = centre(&lattice(false), &walls);
        assert!((cell.area - 0.5).abs() < 1e-14 && cell.clipped && !cell.open, "{cell:?}");
    }

    #[test]
    fn lengths_along_a_crease_and_an_arc() {
        // A cube's edge: .3 on one face, .4 on the other.
        let s = along_surface([0.3, -0.4, 0.0], 0.5, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        assert!((s - 0.7).abs() < 1e-12, "{s}");
        // An arc of .4 radians on the unit circle.
        let (a, b) = ([0.0, 1.0, 0.0], [0.4f64.sin(), 0.4f64.cos(), 0.0]);
        let s = along_surface(sub(b, a), norm(sub(b, a)), a, b);
        assert!((s - 0.4).abs() < 2e-4, "{s}");
    }
}
