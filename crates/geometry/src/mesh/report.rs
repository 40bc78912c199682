//! What is known of a mesh.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, dot};
use isoswarm_field::{FieldError, Surface};
use isoswarm_particles::{Samples, Status};

use super::error::{centres, distances};
use super::quality::Quality;
use super::vertices::Vertices;
use super::{Fault, Mesh, Topology};

/// How a mesh came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshReport {
    /// Counts, components, Euler characteristics, boundaries, faults.
    pub topology: Topology,
    /// How good the triangles are.
    pub quality: Quality,
    /// Largest distance |F|/|∇F| of a triangle's centre from the surface, model units.
    pub max_distance: f64,
    /// Edges of the mesh that are creases of the surface: numbers of both ends.
    pub creases: Vec<[u32; 2]>,
    /// Vertices that are corners or tips of the surface.
    pub corners: Vec<u32>,
    /// Pairs of faces that pass through each other; empty where they were not looked for.
    pub self_intersections: Vec<[u32; 2]>,
    /// Triangles that closed holes where the stars of vertices did not agree.
    pub filled: usize,
    /// Edges flipped.
    pub flips: usize,
    /// Vertices besides the samples and the middles of edges that double the resolution: at corners of the boundary, for repair, for the
    /// distance, for valences.
    pub inserted: usize,
    /// Samples that are no vertices: too close to a corner, in the way of a manifold, of low valence.
    pub removed: usize,
    /// Points at which the field was evaluated, sampling included.
    pub evaluations: u64,
    /// Places where the mesh is not guaranteed to be right, model units, those where it is open or no manifold first; at most
    /// [`MeshReport::MOST_PLACES`].
    pub doubtful: Vec<V3>,
    /// What the user should know, a sentence each.
    pub warnings: Vec<String>,
    /// Whether the mesh has the topology that is proven of the surface; `None` where none was proven, or asked for: see
    /// [`MeshReport::certify`].
    pub certified: Option<bool>,
}

impl MeshReport {
    /// So many doubtful places are listed.
    pub const MOST_PLACES: usize = 10_000;

    /// Whether the mesh is a consistently oriented manifold whose boundary, if any, lies on the bounds, with as many components as the swarm, and
    /// does not pass through itself as far as that was looked for.
    pub fn is_sound(&self) -> bool {
        self.topology.is_manifold() && self.doubtful.is_empty() && self.self_intersections.is_empty()
    }

    pub(super) fn not_on_creases(&mut self, vertices: &Vertices, missing: &[[u32; 2]]) {
        if missing.is_empty() {
            return;
        }
        self.warnings.push(format!(
            "{} parts of the surface's edges are crossed by triangles, where details are finer than the triangles; see the \
             doubtful places",
            missing.len()
        ));
        let places = missing.iter().map(|[a, _]| vertices.points[*a as usize]);
        self.doubtful.extend(places.take(Self::MOST_PLACES));
    }

    pub(super) fn left_out(&mut self, vertices: &Vertices, left_out: &[u32]) {
        if left_out.is_empty() {
            return;
        }
        self.warnings.push(format!(
            "{} samples belong to no triangle and were left out; see the doubtful places",
            left_out.len()
        ));
        self.doubtful.extend(left_out.iter().map(|&v| vertices.points[v as usize]));
    }

    pub(super) fn describe(
        &mut self,
        surface: &dyn Surface,
        mesh: &Mesh,
        samples: &Samples,
        intersections: bool,
    ) -> Result<(), FieldError> {
        let find = || if intersections { mesh.self_intersections() } else { Vec::new() };
        ((self.topology, self.quality), self.self_intersections) =
            rayon::join(|| (mesh.topology(), mesh.quality()), find);
        let off = distances(surface, &centres(&mesh.points, &mesh.faces))?;
        self.evaluations += off.len() as u64;
        self.max_distance = off.into_iter().filter(|d| d.is_finite()).fold(0.0, f64::max);
        self.judge(mesh, samples);
        self.doubtful.truncate(Self::MOST_PLACES);
        Ok(())
    }

    /// Puts in words what is not as it should be.
    fn judge(&mut self, mesh: &Mesh, samples: &Samples) {
        self.warnings.extend(samples.report.warnings.iter().cloned());
        match &samples.report.status {
            Status::NotConverged(why) => self.warnings.push(format!("the swarm did not converge: {why}")),
            Status::Empty => self.warnings.push("there is no surface in the bounds".into()),
            Status::Converged => {}
        }
        let at = |v: u32| mesh.points[v as usize];
        for fault in &self.topology.faults {
            match *fault {
                Fault::Edge { ends } | Fault::Orientation { ends } => self.doubtful.push(at(ends[0])),
                Fault::Vertex { vertex } | Fault::Isolated { vertex } => self.doubtful.push(at(vertex)),
                Fault::Missing { .. } | Fault::Degenerate { .. } => {}
            }
        }
        if !self.topology.is_manifold() {
            self.warnings.push(format!("the mesh is no manifold: {} faults", self.topology.faults.len()));
        }
        if !self.doubtful.is_empty() {
            self.warnings.push(format!(
                "not guaranteed at {} places, listed as doubtful: where the surface is singular, or thinner or more bent than the spacing",
                self.doubtful.len()
            ));
        }
        if !self.self_intersections.is_empty() {
            self.warnings.push(format!(
                "{} pairs of triangles pass through each other",
                self.self_intersections.len()
            ));
            let places = self.self_intersections.iter().map(|p| mesh.corners(p[0] as usize)[0]);
            self.doubtful.extend(places);
        }
        let (parts, known) = (self.topology.components(), samples.report.components);
        if parts != known && !mesh.faces.is_empty() {
            self.warnings.push(format!("the mesh has {parts} components, the swarm {known}"));
        }
        self.doubtful.arrange_by(|p, q| p.partial_cmp(q).unwrap_or(std::cmp::Ordering::Equal));
        self.doubtful.dedup();
        let bent = self.bent(mesh);
        if !bent.is_empty() {
            self.warnings.push(format!(
                "the surface bends by more than 60 degrees within {} triangles, listed as doubtful: a crease, a singular point, or details finer \
                 than the spacing",
                bent.len()
            ));
            self.doubtful.extend(bent);
        }
        let singular = mesh.normals.iter().filter(|n| **n == [0.0; 3]).count();
        if singular > 0 {
            self.warnings.push(format!("{singular} vertices lie where the gradient vanishes"));
        }
    }
}

impl MeshReport {
    /// Centres of triangles whose corners' normals are more than 60 degrees apart; vertices on creases, which have more than one, do not
    /// count.
    fn bent(&self, mesh: &Mesh) -> Vec<V3> {
        let mut edged = vec![false; mesh.points.len()];
        self.creases.iter().flatten().chain(&self.corners).for_each(|&v| edged[v as usize] = true);
        let apart = |f: &[u32; 3]| {
            (0..3).any(|k| {
                let (a, b) = (f[k] as usize, f[(k + 1) % 3] as usize);
                !edged[a] && !edged[b] && dot(mesh.normals[a], mesh.normals[b]) < 0.5
            })
        };
        let faces: Vec<[u32; 3]> = mesh.faces.iter().copied().filter(apart).collect();
        centres(&mesh.points, &faces)
    }
}
