//! What is known of a mesh.

use isoswarm_field::vector::V3;
use isoswarm_particles::{Samples, Status};

use super::quality::Quality;
use super::{Mesh, Topology};

/// How a mesh came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshReport {
    /// Counts, components, Euler characteristics, boundaries, faults.
    pub topology: Topology,
    /// How good the triangles are.
    pub quality: Quality,
    /// Triangles that closed holes where the stars of vertices did not agree.
    pub filled: usize,
    /// Edges flipped.
    pub flips: usize,
    /// Vertices that were inserted to repair the mesh.
    pub inserted: usize,
    /// Vertices that were removed to repair the mesh.
    pub removed: usize,
    /// Places where the mesh is not guaranteed to be right, model units.
    pub doubtful: Vec<V3>,
    /// What the user should know, a sentence each.
    pub warnings: Vec<String>,
}

impl MeshReport {
    pub(super) fn describe(
        &mut self,
        mesh: &Mesh,
        topology: &Topology,
        samples: &Samples,
        holes: &[Vec<u32>],
        left_out: &[u32],
    ) {
        self.topology = topology.clone();
        self.quality = mesh.quality();
        self.warnings.extend(samples.report.warnings.iter().cloned());
        if let Status::NotConverged(why) = &samples.report.status {
            self.warnings.push(format!("the swarm did not converge: {why}"));
        }
        if !holes.is_empty() {
            self.warnings.push(format!("{} holes could not be closed", holes.len()));
        }
        if !left_out.is_empty() {
            self.warnings.push(format!("{} samples belong to no triangle", left_out.len()));
        }
        self.doubtful.extend(left_out.iter().map(|&v| mesh.points[v as usize]));
        self.doubtful.extend(holes.iter().map(|h| mesh.points[h[0] as usize]));
    }
}
