//! Triangles over the swarm: floaters are the vertices.
//!
//! [`mesh`] samples a surface and meshes the samples; [`mesh_samples`] meshes samples that are there. Both give a [`Mesh`] and a
//! [`MeshReport`], which says what was reached and where it was not. [`Topology`] checks any faces, [`Quality`] measures any triangles.
//! A [`LiveMesh`] follows a swarm that moves.
//!
//! ```
//! use isoswarm_field::{Aabb, Field, text};
//! use isoswarm_geometry::{MeshOptions, Resolution, mesh};
//!
//! let torus = Field::new(&text::parse("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)", &[])?)?;
//! let bounds = Aabb::new([-1.6, -1.6, -0.6], [1.6, 1.6, 0.6]);
//! let made = mesh(&torus, &bounds, MeshOptions { resolution: Resolution::Count(1000), ..Default::default() })?;
//! assert!(made.report.topology.is_closed() && made.report.topology.genus() == [1]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bend;
mod border;
mod build;
mod circumsphere;
mod coarse;
mod connect;
mod corners;
mod crease;
mod error;
mod fill;
mod intersect;
mod live;
mod outlines;
mod patch;
mod pieces;
mod quality;
mod repair;
mod report;
pub(crate) mod sides;
mod sizes;
mod smooth;
mod stitch;
mod subdivide;
pub(crate) mod topology;
mod valence;
mod vertices;

pub use build::{MeshOptions, Meshed, Resolution, Rule, mesh, mesh_samples};
pub use live::{LiveMesh, LiveUpdate};
pub use patch::mesh_patch;
pub use quality::{FaceQuality, Quality};
pub use report::MeshReport;
pub use topology::{Fault, Topology};

use std::borrow::Cow;
use std::collections::HashMap;

use isoswarm_field::vector::{V3, cross, dot, norm, scale, sub};

use crate::{GeometryError, PointCloud};

/// Triangles over points, counter-clockwise seen from outside. Columns other than `points` and `faces` are empty or hold
/// a row for each point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, (n, 3), model units.
    pub points: Vec<[f64; 3]>,
    /// Outward unit normals of the surface at the vertices, (n, 3); zero where it has none.
    pub normals: Vec<[f64; 3]>,
    /// Principal curvatures at the vertices, (n, 2), 1 / model units; NaN where the surface has none.
    pub curvatures: Vec<[f64; 2]>,
    /// Stable identities of the vertices, (n,): a vertex can be followed while the surface moves.
    pub ids: Vec<u64>,
    /// Numbers of the vertices of each triangle, (f, 3).
    pub faces: Vec<[u32; 3]>,
    /// Outward unit normals of the surface at the corners of each triangle, (f, 3, 3), where it has creases: there a vertex has one
    /// on each side. Empty where all are those of the vertices.
    pub corner_normals: Vec<[[f64; 3]; 3]>,
}

impl Mesh {
    /// A mesh of bare points and triangles.
    pub fn new(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Self {
        Self { points, faces, ..Self::default() }
    }

    /// The vertices with their columns.
    pub fn cloud(&self) -> PointCloud<'_> {
        let normals = Some(&self.normals[..]).filter(|c| !c.is_empty());
        let curvatures = Some(&self.curvatures[..]).filter(|c| !c.is_empty());
        PointCloud { normals, curvatures, ..PointCloud::new(&self.points) }
    }

    /// Checks that all columns are equally long, coordinates finite, and that the faces name vertices that are there.
    ///
    /// # Errors
    /// What [`PointCloud::check`] says, [`GeometryError::ColumnLength`] and [`GeometryError::NoSuchVertex`].
    pub fn check(&self) -> Result<(), GeometryError> {
        self.cloud().check()?;
        let n = self.points.len();
        if !self.ids.is_empty() && self.ids.len() != n {
            return Err(GeometryError::ColumnLength { column: "ids", expected: n, given: self.ids.len() });
        }
        let f = self.faces.len();
        if !self.corner_normals.is_empty() && self.corner_normals.len() != f {
            let given = self.corner_normals.len();
            return Err(GeometryError::ColumnLength { column: "corner_normals", expected: f, given });
        }
        match self.faces.iter().position(|f| f.iter().any(|&v| v as usize >= n)) {
            Some(face) => Err(GeometryError::NoSuchVertex { face, given: self.faces[face], vertices: n }),
            None => Ok(()),
        }
    }

    /// The mesh with a vertex for each normal at the corners of its triangles, for programs that know one normal a vertex: those on
    /// creases are there once a side, with the same coordinates, curvatures and ids, and no triangle joins the sides.
    pub fn sharp(&self) -> Cow<'_, Mesh> {
        if self.corner_normals.is_empty() || self.normals.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut out = Self { corner_normals: Vec::new(), ..self.clone() };
        // The vertices that there are of each with another normal than its own; the first keeps its number.
        let mut copies: HashMap<u32, Vec<u32>> = HashMap::new();
        for (face, normals) in out.faces.iter_mut().zip(&self.corner_normals) {
            for (v, normal) in face.iter_mut().zip(normals) {
                let copies = copies.entry(*v).or_default();
                let known = copies.iter().find(|&&c| out.normals[c as usize] == *normal);
                let vertex = known.copied().unwrap_or_else(|| {
                    let i = *v as usize;
                    if copies.is_empty() {
                        out.normals[i] = *normal;
                        copies.push(*v);
                        return *v;
                    }
                    copies.push(out.points.len() as u32);
                    out.points.push(self.points[i]);
                    out.normals.push(*normal);
                    out.curvatures.extend(self.curvatures.get(i));
                    out.ids.extend(self.ids.get(i));
                    out.points.len() as u32 - 1
                });
                *v = vertex;
            }
        }
        Cow::Owned(out)
    }

    /// The corners of triangle `f`.
    pub fn corners(&self, f: usize) -> [V3; 3] {
        self.faces[f].map(|v| self.points[v as usize])
    }

    /// Normal of triangle `f` with twice its area as length.
    pub fn face_vector(&self, f: usize) -> V3 {
        let [a, b, c] = self.corners(f);
        cross(sub(b, a), sub(c, a))
    }

    /// Area of all triangles.
    pub fn area(&self) -> f64 {
        (0..self.faces.len()).map(|f| 0.5 * norm(self.face_vector(f))).sum()
    }

    /// Volume that the triangles enclose, by Gauss; it says nothing for a mesh with a boundary.
    pub fn volume(&self) -> f64 {
        // From a vertex, not from the origin, which may be far away.
        let Some(&o) = self.points.first() else { return 0.0 };
        let one = |f| {
            let a = sub(self.corners(f)[0], o);
            dot(a, scale(self.face_vector(f), 1.0 / 6.0))
        };
        (0..self.faces.len()).map(one).sum()
    }

    /// Counts and faults: see [`Topology`].
    pub fn topology(&self) -> Topology {
        Topology::of(self.points.len(), &self.faces)
    }
}
