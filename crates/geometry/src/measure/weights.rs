//! Weights of the vertices, so that Σ w f(p) is the integral of f over the surface.
//!
//! Over each triangle f is taken from the vertices around it: from the parabola that fits them best, or from the
//! triangle's own corners where there are too few on the same sheet. Constants are met exactly, so the weights add up to
//! the area; smooth functions to the fourth order of the distance between vertices, on regular meshes.

use isoswarm_field::vector::{V3, add, dot, frame, norm, scale, sub, unit};
use rayon::prelude::*;

use crate::mesh::Mesh;

/// Terms of a parabola in two coordinates.
const TERMS: usize = 6;
/// Fewest vertices that a parabola is fitted to.
const LEAST: usize = 8;
/// Vertices whose normals differ from the triangle's by more than 60° lie on another sheet or beyond a crease.
const SAME_SHEET: f64 = 0.5;

/// Integrals of the parabola's terms and of the three barycentric coordinates over one triangle.
pub(super) type Moments = [f64; TERMS + 3];

/// A triangle's frame: coordinates in units of its size.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    centre: V3,
    u: V3,
    v: V3,
    normal: V3,
}

impl Frame {
    pub(super) fn new([a, b, c]: [V3; 3]) -> Self {
        let normal = unit(isoswarm_field::vector::cross(sub(b, a), sub(c, a)));
        let size = norm(sub(b, a)).max(norm(sub(c, a))).max(norm(sub(c, b)));
        let (u, v) = frame(if normal == [0.0; 3] { [0.0, 0.0, 1.0] } else { normal });
        let centre = scale(add(add(a, b), c), 1.0 / 3.0);
        Self { centre, u: scale(u, 1.0 / size), v: scale(v, 1.0 / size), normal }
    }

    fn terms(&self, p: V3) -> [f64; TERMS] {
        let r = sub(p, self.centre);
        let (x, y) = (dot(r, self.u), dot(r, self.v));
        [1.0, x, y, x * x, x * y, y * y]
    }

    /// Adds a node to the moments.
    pub(super) fn add(&self, moments: &mut Moments, point: V3, bary: [f64; 3], measure: f64) {
        for (m, t) in moments.iter_mut().zip(self.terms(point).into_iter().chain(bary)) {
            *m += t * measure;
        }
    }
}

/// The vertices that share a triangle with each, in rows.
struct Rings {
    start: Vec<u32>,
    list: Vec<u32>,
}

impl Rings {
    fn new(mesh: &Mesh) -> Self {
        let mut pairs: Vec<(u32, u32)> =
            mesh.faces.iter().flat_map(|f| [0, 1, 2].map(|k| (f[k], f[(k + 1) % 3]))).collect();
        pairs.extend(mesh.faces.iter().flat_map(|f| [0, 1, 2].map(|k| (f[(k + 1) % 3], f[k]))));
        pairs.sort_unstable();
        pairs.dedup();
        let mut start = vec![0u32; mesh.points.len() + 1];
        pairs.iter().for_each(|p| start[p.0 as usize + 1] += 1);
        for v in 0..mesh.points.len() {
            start[v + 1] += start[v];
        }
        Self { start, list: pairs.into_iter().map(|p| p.1).collect() }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.list[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }
}

/// The weights, from the moments of each triangle.
pub(super) fn weights(mesh: &Mesh, normals: &[V3], moments: &[Moments]) -> Vec<f64> {
    let rings = Rings::new(mesh);
    let of_face = |f: usize| {
        let corners = mesh.faces[f];
        let frame = Frame::new(mesh.corners(f));
        let mut near: Vec<u32> = corners.iter().flat_map(|&v| rings.of(v)).copied().collect();
        near.sort_unstable();
        near.dedup();
        near.retain(|&v| corners.contains(&v) || dot(normals[v as usize], frame.normal) > SAME_SHEET);
        fit(mesh, &frame, &near, &moments[f])
            .unwrap_or_else(|| corners.iter().enumerate().map(|(k, &v)| (v, moments[f][TERMS + k])).collect())
    };
    let parts: Vec<Vec<(u32, f64)>> =
        (0..mesh.faces.len()).into_par_iter().with_min_len(256).map(of_face).collect();
    let mut out = vec![0.0; mesh.points.len()];
    for (v, w) in parts.into_iter().flatten() {
        out[v as usize] += w;
    }
    out
}

/// Weights of the vertices `near` a triangle that integrate the parabola which fits best over it.
fn fit(mesh: &Mesh, frame: &Frame, near: &[u32], moments: &Moments) -> Option<Vec<(u32, f64)>> {
    if near.len() < LEAST {
        return None;
    }
    let rows: Vec<([f64; TERMS], f64)> = near
        .iter()
        .map(|&v| {
            let terms = frame.terms(mesh.points[v as usize]);
            // Nearer vertices count more.
            let square = terms[3] + terms[5];
            (terms, 1.0 / (0.1 + square * square))
        })
        .collect();
    let mut a = [[0.0; TERMS]; TERMS];
    for (t, w) in &rows {
        for i in 0..TERMS {
            for j in 0..=i {
                a[i][j] += w * t[i] * t[j];
            }
        }
    }
    let mut right = [0.0; TERMS];
    right.copy_from_slice(&moments[..TERMS]);
    let c = cholesky(a, right)?;
    let weight = |(t, w): &([f64; TERMS], f64)| w * (0..TERMS).map(|i| t[i] * c[i]).sum::<f64>();
    Some(near.iter().zip(&rows).map(|(&v, row)| (v, weight(row))).collect())
}

/// Solves A x = b for a symmetric A given by its lower half; `None` where it is nearly singular.
fn cholesky(mut a: [[f64; TERMS]; TERMS], mut b: [f64; TERMS]) -> Option<[f64; TERMS]> {
    for j in 0..TERMS {
        let whole = a[j][j];
        for k in 0..j {
            a[j][j] -= a[j][k] * a[j][k];
        }
        // Written so that NaN fails too.
        if !matches!(a[j][j].partial_cmp(&(1e-6 * whole)), Some(std::cmp::Ordering::Greater)) {
            return None;
        }
        a[j][j] = a[j][j].sqrt();
        for i in j + 1..TERMS {
            for k in 0..j {
                a[i][j] -= a[i][k] * a[j][k];
            }
            a[i][j] /= a[j][j];
        }
    }
    for i in 0..TERMS {
        for k in 0..i {
            b[i] -= a[i][k] * b[k];
        }
        b[i] /= a[i][i];
    }
    for i in (0..TERMS).rev() {
        for k in i + 1..TERMS {
            b[i] -= a[k][i] * b[k];
        }
        b[i] /= a[i][i];
    }
    Some(b)
}
