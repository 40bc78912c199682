//! Rings of samples next to the borders of the piece that they lie on.
//!
//! A surface with creases is cut along them into pieces; a sample on a crease is there once for each piece that it borders, and knows
//! who comes before and after it on the border, the piece on the left. Rings must not reach over borders: a sample's star is that of
//! the constrained Delaunay triangulation of its piece, the Delaunay star among the samples that it sees from its own place without
//! looking over a border (if a circle through it held another sample that can be seen from within the triangle, that one could be seen
//! from the corner too). It is found by wrapping: after a neighbour comes the one that sees the edge to it under the largest angle.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::math::atan2;

use crate::neighbors::Grid;
use crate::rings::Rings;
use crate::vector::{V3, add, distance, dot, frame, norm, scale, sub, tangential};

/// Nobody comes before or after.
const NOBODY: u32 = u32::MAX;
/// How far others are looked for, in local spacings.
const REACH: f64 = 3.2;
/// How far samples see those on borders that are much closer to each other than they are, in local spacings, and how much closer that is.
const SIGHT: f64 = 2.0;
const COARSER: f64 = 2.0;
/// Cosine between normals from which on down samples are on different pieces, or too far apart on a bent one.
const LEVEL: f64 = 0.2;
/// How much the chord between two samples may lean more than that of an arc.
const LEANING: f64 = 0.25;
/// Turn of the normal (radians) from which on an arc is not unrolled.
const FOLDED: f64 = 2.6;
/// Sine of an angle up to which directions are the same.
const SAME: f64 = 1e-9;
/// Difference of the cotangents under which an edge is seen, over 1 plus their size, up to which the samples are on one circle.
const COCIRCULAR: f64 = 1e-4;
/// Most entries of a ring.
const MOST: usize = 64;

/// A neighbour in the tangent plane of a sample.
#[derive(Clone, Copy, Debug)]
struct Seen {
    j: u32,
    at: [f64; 2],
}

/// Borders between pieces.
pub(crate) struct Fences<'a> {
    points: &'a [V3],
    normals: &'a [V3],
    /// Who comes after and before a sample on a border.
    borders: &'a [[u32; 2]],
    grid: Grid,
    near: Vec<bool>,
    /// How far each sample looks.
    reach: Vec<f64>,
    /// Whether a sample lies on a face of the bounds, on which.
    walls: Vec<[i8; 3]>,
}

/// Working memory.
#[derive(Default)]
pub(crate) struct View {
    seen: Vec<Seen>,
    /// Those of them that are on borders, in rising order.
    fenced: Vec<u32>,
    edges: Vec<([f64; 2], [f64; 2], [u32; 2])>,
    tied: Vec<Seen>,
}

impl<'a> Fences<'a> {
    /// `walls`: for each coordinate of a point on which face it lies, -1, 0 (none) or 1.
    pub(crate) fn new(
        points: &'a [V3],
        normals: &'a [V3],
        spacing: &'a [f64],
        borders: &'a [[u32; 2]],
        walls: Vec<[i8; 3]>,
    ) -> Self {
        let mean = spacing.iter().sum::<f64>() / spacing.len() as f64;
        let grid = Grid::new(points, None, (REACH * mean).max(f64::MIN_POSITIVE));
        let mut near: Vec<bool> = borders.iter().map(|b| *b != [NOBODY; 2]).collect();
        let at = |i: usize| spacing[if spacing.len() == 1 { 0 } else { i }];
        let widest = spacing.iter().fold(0.0f64, |m, &s| m.max(s));
        let on: Vec<u32> = (0..points.len() as u32).filter(|&i| near[i as usize]).collect();
        let fence = Grid::new(points, Some(on), (REACH * widest).max(f64::MIN_POSITIVE));
        for i in 0..points.len() {
            if !near[i] {
                let mut close = false;
                // A border passes by that ends further away.
                let reach = REACH * at(i) + widest;
                fence.near(points[i], reach, |j| close |= distance(points[j as usize], points[i]) <= reach);
                near[i] = close;
            }
        }
        let mut reach: Vec<f64> = (0..points.len()).map(|i| REACH * at(i)).collect();
        if spacing.len() > 1 {
            // Who is on a border sees those that see it, if they are much farther apart.
            for j in (0..points.len()).filter(|&j| near[j] && borders[j] == [NOBODY; 2]) {
                fence.near(points[j], SIGHT * at(j), |i| {
                    let d = distance(points[i as usize], points[j]);
                    if d <= SIGHT * at(j) && at(j) > COARSER * at(i as usize) {
                        reach[i as usize] = reach[i as usize].max(d);
                    }
                });
            }
        }
        Self { points, normals, borders, grid, near, reach, walls }
    }

    /// Whether a border may matter for the ring of a sample.
    #[inline(always)]
    pub(crate) fn matter(&self, i: usize) -> bool {
        self.near[i]
    }

    fn reach(&self, i: usize) -> f64 {
        self.reach[i]
    }

    /// The ring of sample `i`: where it is on a border, from who comes after it to who comes before it, and [`Rings::FENCE`].
    pub(crate) fn ring(&self, i: usize, view: &mut View, out: &mut Vec<u32>) {
        let from = out.len();
        self.look(i, view);
        self.around(i, view, out);
        if self.walls[i] == [0; 3] {
            return;
        }
        // Between two that lie on the same face of the bounds as `i` is that face.
        let on = |j: u32| {
            let wall = |a: usize| self.walls[i][a] != 0 && self.walls[i][a] == self.walls[j as usize][a];
            j < Rings::FENCE && (0..3).any(wall)
        };
        let ring = out.split_off(from);
        for (k, &j) in ring.iter().enumerate() {
            out.push(j);
            if ring.len() > 2 && on(j) && on(ring[(k + 1) % ring.len()]) {
                out.push(Rings::WALL);
            }
        }
    }

    fn around(&self, i: usize, view: &mut View, out: &mut Vec<u32>) {
        let [after, before] = self.borders[i];
        let from = out.len();
        let place = |j: u32| view.seen.iter().position(|s| s.j == j);
        match (place(after), place(before)) {
            (Some(first), last) => {
                self.wrap(i, first, view, false, out);
                let closed = out.last().is_some_and(|&j| j == before);
                if last.is_none() {
                    out.push(if before == NOBODY { Rings::WALL } else { Rings::OPEN });
                } else {
                    if !closed {
                        out.extend([Rings::OPEN, before]);
                    }
                    out.push(Rings::FENCE);
                }
            }
            (None, Some(last)) => {
                self.wrap(i, last, view, true, out);
                out[from..].reverse();
                out.push(if after == NOBODY { Rings::WALL } else { Rings::OPEN });
            }
            (None, None) => {
                let far = |s: &Seen| s.at[0] * s.at[0] + s.at[1] * s.at[1];
                let nearest = (0..view.seen.len())
                    .min_by(|&a, &b| far(&view.seen[a]).total_cmp(&far(&view.seen[b])).then(a.cmp(&b)));
                let Some(first) = nearest else {
                    out.push(Rings::OPEN);
                    return;
                };
                if self.wrap(i, first, view, false, out) {
                    return;
                }
                // A gap: the rest from the other side.
                let ahead = out.split_off(from);
                self.wrap(i, first, view, true, out);
                out[from..].reverse();
                out.extend_from_slice(&ahead[1..]);
                out.push(if self.walls[i] == [0; 3] { Rings::OPEN } else { Rings::WALL });
            }
        }
    }

    /// Neighbours of `first` around sample `i` counter-clockwise, or clockwise, with it. Whether it came round.
    fn wrap(&self, i: usize, first: usize, view: &mut View, back: bool, out: &mut Vec<u32>) -> bool {
        let end = self.borders[i][usize::from(!back)];
        let turn = |a: [f64; 2], b: [f64; 2]| {
            let s = a[0] * b[1] - a[1] * b[0];
            if back { -s } else { s }
        };
        let from = out.len();
        let mut now = view.seen[first];
        out.push(now.j);
        for _ in 0..MOST {
            // The cotangent of the angle under which the edge to `now` is seen.
            let size = |a: [f64; 2]| (a[0] * a[0] + a[1] * a[1]).sqrt();
            let cotangent = |s: &Seen| {
                let sine = turn(now.at, s.at);
                if sine <= SAME * size(now.at) * size(s.at) {
                    return f64::INFINITY;
                }
                let (a, c) = (s.at, now.at);
                (a[0] * (a[0] - c[0]) + a[1] * (a[1] - c[1])) / sine
            };
            let best = view.seen.iter().fold(f64::INFINITY, |m, s| m.min(cotangent(s)));
            if best == f64::INFINITY {
                return false;
            }
            let limit = best + COCIRCULAR * (1.0 + best.abs());
            view.tied.clear();
            view.tied.extend(view.seen.iter().copied().filter(|s| cotangent(s) <= limit));
            now = choose(i as u32, now, &mut view.tied, turn);
            if let Some(k) = out[from..].iter().position(|&j| j == now.j) {
                // Round, if not from the very first.
                out.drain(from..from + k);
                return true;
            }
            out.push(now.j);
            if now.j == end {
                return true;
            }
        }
        false
    }

    /// What sample `i` sees on its piece.
    fn look(&self, i: usize, view: &mut View) {
        let View { seen, fenced, edges, .. } = view;
        seen.clear();
        fenced.clear();
        edges.clear();
        let own = self.borders[i];
        let (p, n) = (self.points[i], self.normals[i]);
        let axes = frame(if n == [0.0; 3] { [0.0, 0.0, 1.0] } else { n });
        let flat = |j: u32| self.unfold(p, n, axes, j as usize);
        let known = |j: u32| (j != NOBODY).then(|| flat(j));
        let i32 = i as u32;
        let mut add_seen = |j: u32| {
            let at = flat(j);
            if at[0] * at[0] + at[1] * at[1] > 1e-18 * self.reach(i).powi(2) {
                seen.push(Seen { j, at });
                if self.borders[j as usize] != [NOBODY; 2] {
                    fenced.push(j);
                }
            }
        };
        let nobody = |j: u32| j == NOBODY || j == i32;
        let other = own[1] != own[0];
        own.into_iter().take(1 + usize::from(other)).filter(|j| !nobody(*j)).for_each(&mut add_seen);
        // The grid comes to everybody once.
        self.grid.near(p, self.reach(i), |j| {
            let (q, m) = (self.points[j as usize], self.normals[j as usize]);
            if j != i32 && !own.contains(&j) && distance(p, q) <= self.reach(i) && together(sub(q, p), n, m) {
                add_seen(j);
            }
        });
        fenced.arrange();
        for s in seen.iter() {
            let [after, before] = self.borders[s.j as usize];
            if after != NOBODY {
                edges.push((s.at, flat(after), [s.j, after]));
            }
            if before != NOBODY && fenced.binary_search(&before).is_err() {
                edges.push((flat(before), s.at, [before, s.j]));
            }
        }
        // An edge bars the way only to who stands on its left.
        edges.retain(|(a, b, ends)| !ends.contains(&i32) && a[0] * b[1] - a[1] * b[0] > 0.0);
        let visible = |s: &Seen| {
            own.contains(&s.j)
                || (inside(own.map(known), s.at, own[0] == own[1])
                    && self.lets_see(s.j, i)
                    && !edges.iter().any(|(a, b, ends)| !ends.contains(&s.j) && crosses(s.at, *a, *b)))
        };
        let free: Vec<bool> = seen.iter().map(visible).collect();
        let mut k = 0;
        seen.retain(|_| {
            k += 1;
            free[k - 1]
        });
    }

    /// Whether sample `i` is on the side of the border that `j` is on, if it is on one.
    fn lets_see(&self, j: u32, i: usize) -> bool {
        let own = self.borders[j as usize];
        if own == [NOBODY; 2] || own.contains(&(i as u32)) {
            return true;
        }
        let (p, n) = (self.points[j as usize], self.normals[j as usize]);
        let axes = frame(if n == [0.0; 3] { [0.0, 0.0, 1.0] } else { n });
        let known = |k: u32| (k != NOBODY).then(|| self.unfold(p, n, axes, k as usize));
        inside(own.map(known), self.unfold(p, n, axes, i), own[0] == own[1])
    }

    /// Sample `j` in the tangent plane of a sample at `p`: in the direction in which the normal turns the surface is an arc.
    fn unfold(&self, p: V3, n: V3, (u, v): (V3, V3), j: usize) -> [f64; 2] {
        let (r, m) = (sub(self.points[j], p), self.normals[j]);
        let mut along = r;
        let turn = tangential(m, n);
        let sine = norm(turn);
        if n != [0.0; 3] && m != [0.0; 3] && sine > 1e-6 {
            let way = scale(turn, 1.0 / sine);
            let angle = atan2(sine, dot(n, m));
            let stretch = if angle < FOLDED { angle / sine } else { 1.0 };
            along = add(r, scale(way, (stretch - 1.0) * dot(r, way)));
        }
        [dot(along, u), dot(along, v)]
    }
}

/// Whether two samples a way `r` apart may lie on one smooth piece, by their normals: the chord of an arc leans on both tangent planes by
/// half of what the normal turns.
fn together(r: V3, n: V3, m: V3) -> bool {
    if n == [0.0; 3] || m == [0.0; 3] {
        return true;
    }
    let (cosine, length, a, b) = (dot(n, m), norm(r), dot(r, n), dot(r, m));
    let lean = (0.5 - 0.5 * cosine).max(0.0).sqrt() + LEANING;
    cosine > LEVEL && a.abs().max(b.abs()) <= lean * length && (a + b).abs() <= 1.5 * LEANING * length
}

/// Whether a direction leads into a piece whose border goes on towards `after` and came from `before`, if it does.
fn inside([after, before]: [Option<[f64; 2]>; 2], way: [f64; 2], same: bool) -> bool {
    let cross = |a: [f64; 2], b: [f64; 2]| {
        let size = |v: [f64; 2]| (v[0] * v[0] + v[1] * v[1]).sqrt();
        (a[0] * b[1] - a[1] * b[0]) / (size(a) * size(b)).max(f64::MIN_POSITIVE)
    };
    match (after, before) {
        (None, None) => true,
        (Some(a), None) => cross(a, way) >= -SAME,
        (None, Some(b)) => cross(way, b) >= -SAME,
        _ if same => true,
        (Some(a), Some(b)) => {
            if cross(a, b) > SAME {
                cross(a, way) >= -SAME && cross(way, b) >= -SAME
            } else {
                !(cross(b, way) > SAME && cross(way, a) > SAME)
            }
        }
    }
}

/// Whether the way from 0 to `to` crosses the edge from `a` to `b`, which has 0 on its left, ends included.
fn crosses(to: [f64; 2], a: [f64; 2], b: [f64; 2]) -> bool {
    let turn = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let (way, size) = ([b[0] - a[0], b[1] - a[1]], to[0] * to[0] + to[1] * to[1]);
    let slack = SAME * (size * (way[0] * way[0] + way[1] * way[1])).sqrt();
    // `to` right of the edge, `a` right of the way and `b` left of it.
    turn(way, [to[0] - a[0], to[1] - a[1]]) < -slack && turn(to, a) <= slack && turn(to, b) >= -slack
}

/// Of samples on a circle with `i` and `now` the next neighbour: all triangles on that circle have the one with the smallest number.
fn choose(i: u32, now: Seen, tied: &mut [Seen], turn: impl Fn([f64; 2], [f64; 2]) -> f64) -> Seen {
    if let [one] = *tied {
        return one;
    }
    let angle = |s: &Seen| atan2(turn(now.at, s.at), now.at[0] * s.at[0] + now.at[1] * s.at[1]);
    tied.arrange_by(|a, b| angle(a).total_cmp(&angle(b)).then(a.j.cmp(&b.j)));
    let least = tied.iter().map(|s| s.j).fold(i.min(now.j), u32::min);
    let chosen = if least == i {
        tied.first()
    } else if least == now.j {
        tied.last()
    } else {
        tied.iter().find(|s| s.j == least)
    };
    chosen.copied().unwrap_or(now)
}
