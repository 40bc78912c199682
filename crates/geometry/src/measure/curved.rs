//! Triangles bent onto the surface.
//!
//! Over a flat triangle with corners pᵢ stands the patch y(b) = Σ bᵢ pᵢ + t d/|d|, d = Σ bᵢ dᵢ, where F(y) = 0. The dᵢ are
//! the normals at the corners, so that neighbours meet along the same curves: the patches cover the surface once.

use isoswarm_field::vector::{V3, along, cross, dot, norm, scale, sub, unit};
use isoswarm_field::{FieldError, Surface};

use super::rules::{NODES, degree_6, degree_8};

/// Most evaluations of a node on its way to the surface.
const ROUNDS: usize = 14;
/// A step shorter than this part of the coordinates' size ends the way.
const ARRIVED: f64 = 4.0 * f64::EPSILON;
/// A node whose last step is no longer than this part of the triangle has arrived too: rounding keeps it moving.
const NEAR: f64 = 1e-8;
/// A node farther off than this many longest sides of its triangle is lost.
const LOST: f64 = 1.5;
/// Least cosine between the way to the surface and its normal.
const GRAZING: f64 = 0.02;

/// A triangle with directions at its corners.
#[derive(Clone, Copy)]
pub(super) struct Flat {
    /// Corners.
    pub(super) p: [V3; 3],
    /// Directions in which they are moved.
    pub(super) d: [V3; 3],
}

impl Flat {
    fn mix(b: [f64; 3], v: &[V3; 3]) -> V3 {
        [0, 1, 2].map(|a| b[0] * v[0][a] + b[1] * v[1][a] + b[2] * v[2][a])
    }

    fn longest(&self) -> f64 {
        (0..3).map(|k| norm(sub(self.p[(k + 1) % 3], self.p[k]))).fold(0.0, f64::max)
    }
}

/// A part of a triangle of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// The triangle.
    pub(super) face: u32,
    /// How often it was divided by four.
    pub(super) depth: u8,
    /// Barycentric coordinates of the part's corners.
    pub(super) corners: [[f64; 3]; 3],
}

impl Leaf {
    /// The whole of a triangle.
    pub(super) fn whole(face: u32) -> Self {
        Self { face, depth: 0, corners: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// Four parts of equal size.
    pub(super) fn quarters(&self) -> [Self; 4] {
        let [a, b, c] = self.corners;
        let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]].map(|corners| Self {
            face: self.face,
            depth: self.depth + 1,
            corners,
        })
    }

    /// Part of the triangle's area.
    pub(super) fn part(&self) -> f64 {
        // A power of two: exact.
        (0..self.depth).fold(1.0, |part, _| 0.25 * part)
    }

    fn at(&self, b: [f64; 3]) -> [f64; 3] {
        Flat::mix(b, &self.corners)
    }
}

/// The nodes of both rules in each of a number of leaves, on the surface: [`NODES`] rows a leaf.
pub(super) struct Nodes {
    /// Barycentric coordinates in the mesh's triangle.
    pub(super) bary: Vec<[f64; 3]>,
    /// Points on the surface.
    pub(super) points: Vec<V3>,
    /// Unit normals there.
    pub(super) normals: Vec<V3>,
    /// ∇F there.
    pub(super) gradient: Vec<V3>,
    /// Second derivatives there; empty where they were not asked for or the field has none.
    pub(super) hessian: Vec<[f64; 6]>,
    /// n · (∂y/∂u × ∂y/∂v): signed area of the surface over that of the parameters, times the node's weight.
    pub(super) measure: Vec<f64>,
    /// Whether the node got to the surface; where not, point and measure are those of the flat triangle.
    pub(super) reached: Vec<bool>,
}

impl Nodes {
    /// Puts the nodes of `leaves` onto the surface. All points of a call to the surface are passed at once, on the calling
    /// thread.
    pub(super) fn place(
        surface: &dyn Surface,
        leaves: &[Leaf],
        flat: impl Fn(u32) -> Flat,
        second: bool,
    ) -> Result<Self, FieldError> {
        let rules: Vec<_> = degree_6().into_iter().chain(degree_8()).collect();
        let flats: Vec<Flat> = leaves.iter().map(|l| flat(l.face)).collect();
        let mut way = Way::new(leaves, &flats, &rules);
        let margin = flats.iter().map(Flat::longest).fold(0.0, f64::max) * 0.25;
        let narrowed = surface.narrowed(&way.place, margin)?;
        let near = narrowed.as_deref().unwrap_or(surface);
        way.go(surface, near)?;
        let mut out = way.arrive(leaves, &flats, &rules);
        if second {
            let mut hessian = vec![[0.0; 6]; out.points.len()];
            if near.hessian(&out.points, &mut hessian).is_ok() {
                out.hessian = hessian;
            }
        }
        Ok(out)
    }
}

/// Nodes on their way along lines.
struct Way {
    bary: Vec<[f64; 3]>,
    start: Vec<V3>,
    direction: Vec<V3>,
    t: Vec<f64>,
    longest: Vec<f64>,
    place: Vec<V3>,
    value: Vec<f64>,
    gradient: Vec<V3>,
    arrived: Vec<bool>,
}

impl Way {
    fn new(leaves: &[Leaf], flats: &[Flat], rules: &[(f64, [f64; 3])]) -> Self {
        let n = leaves.len() * NODES;
        let mut way = Self {
            bary: Vec::with_capacity(n),
            start: Vec::with_capacity(n),
            direction: Vec::with_capacity(n),
            t: Vec::with_capacity(n),
            longest: flats.iter().map(Flat::longest).collect(),
            place: Vec::with_capacity(n),
            value: vec![0.0; n],
            gradient: vec![[0.0; 3]; n],
            arrived: vec![false; n],
        };
        for (leaf, flat) in leaves.iter().zip(flats) {
            for (_, b) in rules {
                let b = leaf.at(*b);
                let (x, d) = (Flat::mix(b, &flat.p), unit(Flat::mix(b, &flat.d)));
                // Half the mean height of the corners' tangent planes: exact for a sphere to third order.
                let height = |k: usize| {
                    let (n, cosine) = (unit(flat.d[k]), dot(unit(flat.d[k]), d));
                    if cosine > 0.5 { dot(sub(flat.p[k], x), n) / cosine } else { 0.0 }
                };
                let t = 0.5 * (b[0] * height(0) + b[1] * height(1) + b[2] * height(2));
                way.bary.push(b);
                way.start.push(x);
                way.direction.push(d);
                way.t.push(t);
                way.place.push(along(x, t, d));
            }
        }
        way
    }

    /// Newton's method along the lines. `near` is a faster equivalent for all points at once.
    fn go(&mut self, surface: &dyn Surface, near: &dyn Surface) -> Result<(), FieldError> {
        let mut active: Vec<u32> = (0..self.t.len() as u32).collect();
        for round in 0..ROUNDS {
            let all = active.len() * 2 > self.t.len();
            if all {
                near.value_gradient(&self.place, &mut self.value, &mut self.gradient)?;
            } else {
                self.evaluate(surface, &active)?;
            }
            active.retain(|&i| self.step(i as usize, round + 1 == ROUNDS));
            if active.is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn evaluate(&mut self, surface: &dyn Surface, active: &[u32]) -> Result<(), FieldError> {
        let points: Vec<V3> = active.iter().map(|&i| self.place[i as usize]).collect();
        let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        surface.value_gradient(&points, &mut value, &mut gradient)?;
        for (k, &i) in active.iter().enumerate() {
            (self.value[i as usize], self.gradient[i as usize]) = (value[k], gradient[k]);
        }
        Ok(())
    }

    /// One step of a node that has been evaluated; whether it goes on.
    fn step(&mut self, i: usize, last: bool) -> bool {
        let (d, g) = (self.direction[i], self.gradient[i]);
        let slope = dot(g, d);
        let longest = self.longest[i / NODES];
        let step = -self.value[i] / slope;
        let steep = slope.abs() > GRAZING * norm(g);
        if !(steep && step.is_finite() && self.t[i].abs() < LOST * longest) {
            return false;
        }
        let size = self.place[i].iter().fold(longest, |m, v| m.max(v.abs()));
        if step.abs() <= ARRIVED * size || (last && step.abs() <= NEAR * longest) {
            self.arrived[i] = true;
            return false;
        }
        if last {
            return false;
        }
        self.t[i] += step.clamp(-0.5 * longest, 0.5 * longest);
        self.place[i] = along(self.start[i], self.t[i], d);
        true
    }

    /// Measures of the nodes where they are now.
    fn arrive(self, leaves: &[Leaf], flats: &[Flat], rules: &[(f64, [f64; 3])]) -> Nodes {
        let n = self.t.len();
        let (mut normals, mut measure) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let mut points = self.place;
        for i in 0..n {
            let (leaf, flat) = (leaves[i / NODES], &flats[i / NODES]);
            let part = 0.5 * leaf.part() * rules[i % NODES].0;
            let (xu, xv) = (sub(flat.p[1], flat.p[0]), sub(flat.p[2], flat.p[0]));
            if !self.arrived[i] {
                let flat_normal = cross(xu, xv);
                points[i] = self.start[i];
                normals.push(unit(flat_normal));
                measure.push(part * norm(flat_normal));
                continue;
            }
            let (d, g) = (self.direction[i], self.gradient[i]);
            let length = norm(Flat::mix(self.bary[i], &flat.d));
            let slope = dot(g, d);
            let derivative = |x: V3, change: V3| {
                // Of d/|d|, then of t, from ∇F · ∂y = 0.
                let turn = scale(along(change, -dot(change, d), d), 1.0 / length);
                let moved = along(x, self.t[i], turn);
                along(moved, -dot(g, moved) / slope, d)
            };
            let yu = derivative(xu, sub(flat.d[1], flat.d[0]));
            let yv = derivative(xv, sub(flat.d[2], flat.d[0]));
            let normal = unit(g);
            normals.push(normal);
            measure.push(part * dot(normal, cross(yu, yv)));
        }
        Nodes {
            bary: self.bary,
            points,
            normals,
            gradient: self.gradient,
            hessian: Vec::new(),
            measure,
            reached: self.arrived,
        }
    }
}
