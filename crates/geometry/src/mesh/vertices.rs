//! The vertices of a mesh under construction, and what keeps them on the surface and on the faces of the bounds.

use isoswarm_field::vector::{V3, along, distance, dot, norm, unit};
use isoswarm_field::{Aabb, FieldError, Surface};
use isoswarm_particles::{Grid, Samples};
use rayon::prelude::*;

use super::connect::NONE;

/// Distance from a face, in spacings, up to which a sample counts as on it.
const ON_FACE: f64 = 1e-4;

/// How often the reach in which a neighbour is looked for is doubled.
const DOUBLINGS: i32 = 6;

/// Vertices as columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    pub(super) points: Vec<V3>,
    /// Outward unit normals; zero where the gradient vanishes.
    pub(super) normals: Vec<V3>,
    /// Distance to the neighbours.
    pub(super) spacing: Vec<f64>,
    /// Bit a: on a face of the bounds across axis a.
    pub(super) faces: Vec<u8>,
    /// Number of the point of a crease that a vertex is, which stays where it is; [`NONE`] for all others.
    pub(super) crease: Vec<u32>,
}

impl Vertices {
    /// The samples, those next to a face of the bounds on it.
    pub(super) fn of(samples: &Samples, bounds: &Aabb) -> Self {
        let mut out = Self {
            points: samples.points.clone(),
            normals: samples.normals.clone(),
            spacing: samples.radii.iter().map(|r| 2.0 * r).collect(),
            faces: Vec::new(),
            crease: vec![NONE; samples.points.len()],
        };
        let on_creases = samples.creases.as_ref().map_or(0, |c| c.points.len());
        (0..on_creases).for_each(|i| out.crease[i] = i as u32);
        out.space_alone();
        for (p, s) in out.points.iter_mut().zip(&out.spacing) {
            out.faces.push(snap(p, bounds, ON_FACE * s));
        }
        out
    }

    /// Samples that see no neighbour within their own size, as beside a step of the density, are as far from others as their nearest is.
    fn space_alone(&mut self) {
        let alone: Vec<usize> = (0..self.len()).filter(|&i| self.spacing[i] <= 0.0).collect();
        let known = (self.len() - alone.len()) as f64;
        if alone.is_empty() || known == 0.0 {
            return;
        }
        let mean = self.spacing.iter().sum::<f64>() / known;
        let grid = Grid::new(&self.points, None, 2.0 * mean);
        for i in alone {
            let nearest = (1..=DOUBLINGS).find_map(|k| {
                let (p, reach) = (self.points[i], mean * 2f64.powi(k));
                let mut nearest = f64::INFINITY;
                grid.near(p, reach, |j| {
                    if j as usize != i {
                        nearest = nearest.min(distance(p, self.points[j as usize]));
                    }
                });
                (nearest <= reach && nearest > 0.0).then_some(nearest)
            });
            self.spacing[i] = nearest.unwrap_or(mean);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Mean spacing.
    pub(super) fn mean(&self) -> f64 {
        self.spacing.iter().sum::<f64>() / self.spacing.len().max(1) as f64
    }

    pub(super) fn push(&mut self, point: V3, normal: V3, spacing: f64, faces: u8) {
        self.points.push(point);
        self.normals.push(normal);
        self.spacing.push(spacing);
        self.faces.push(faces);
        self.crease.push(NONE);
    }

    /// Whether vertex `i` is a point of a crease.
    #[inline(always)]
    pub(super) fn on_crease(&self, i: usize) -> bool {
        self.crease[i] != NONE
    }

    /// Keeps those for which `keep` holds.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        fn only<T>(column: &mut Vec<T>, keep: &impl Fn(usize) -> bool) {
            let mut i = 0;
            column.retain(|_| {
                i += 1;
                keep(i - 1)
            });
        }
        only(&mut self.points, &keep);
        only(&mut self.normals, &keep);
        only(&mut self.spacing, &keep);
        only(&mut self.faces, &keep);
        only(&mut self.crease, &keep);
    }

    /// The spacing, as rings want it: one number where all are about equal.
    pub(super) fn reach(&self) -> Vec<f64> {
        let mean = self.mean();
        if self.spacing.iter().all(|s| (s / mean - 1.0).abs() < 0.5) {
            vec![mean]
        } else {
            self.spacing.clone()
        }
    }

    /// The axes of the faces of the bounds that both vertices lie on, as bits.
    pub(super) fn common_faces(&self, i: u32, j: u32) -> u8 {
        self.faces[i as usize] & self.faces[j as usize]
    }

    /// Whether two vertices lie on one face of the bounds.
    pub(super) fn share_face(&self, i: u32, j: u32) -> bool {
        let (i, j) = (i as usize, j as usize);
        share_face(self.faces[i], self.faces[j], self.points[i], self.points[j])
    }
}

/// Whether two points on faces lie on one and the same.
pub(super) fn share_face(a: u8, b: u8, p: V3, q: V3) -> bool {
    (0..3).any(|k| (a & b) >> k & 1 == 1 && p[k] == q[k])
}

/// Puts a point that is next to a face of the bounds on it; gives the axes of those faces as bits.
pub(super) fn snap(p: &mut V3, bounds: &Aabb, near: f64) -> u8 {
    let mut bits = 0;
    for a in 0..3 {
        for face in [bounds.lo[a], bounds.hi[a]] {
            if (p[a] - face).abs() <= near {
                p[a] = face;
                bits |= 1 << a;
            }
        }
    }
    bits
}

/// Moves points onto F = 0 by at most so many Newton steps, each no longer than `longest`; coordinates across the faces that
/// a point lies on stay. Gives |F|/|∇F| at the last evaluation; points for which that is not finite, or which would
/// move farther, stay where they were and get infinity. `normals` are those of the last evaluation.
pub(super) fn pull(
    surface: &dyn Surface,
    points: &mut [V3],
    normals: &mut [V3],
    faces: &[u8],
    longest: impl Fn(usize) -> f64 + Sync,
    steps: usize,
) -> Result<Vec<f64>, FieldError> {
    let n = points.len();
    let mut left = vec![f64::INFINITY; n];
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    if n == 0 {
        return Ok(left);
    }
    for _ in 0..steps {
        surface.value_gradient(points, &mut value, &mut gradient)?;
        let columns = points.par_iter_mut().zip(normals.par_iter_mut()).zip(left.par_iter_mut());
        columns.enumerate().with_min_len(2048).for_each(|(i, ((point, normal), left))| {
            let (value, gradient) = (value[i], gradient[i]);
            let mut g = gradient;
            (0..3).filter(|a| faces[i] >> a & 1 == 1).for_each(|a| g[a] = 0.0);
            let length = norm(gradient);
            *left = value.abs() / length;
            let k = -value / dot(g, g);
            if value == 0.0 && length > 0.0 {
                (*normal, *left) = (unit(gradient), 0.0);
            } else if k.is_finite() && k.abs() * norm(g) <= longest(i) {
                *point = along(*point, k, g);
                *normal = unit(gradient);
            } else {
                *left = f64::INFINITY;
            }
        });
    }
    Ok(left)
}
