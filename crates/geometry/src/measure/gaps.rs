//! What a mesh that does not cover the surface once may be off by.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use isoswarm_field::Aabb;
use isoswarm_field::vector::{V3, distance, norm};

use super::directions::ON_FACE;
use crate::mesh::sides::open_sides;
use crate::mesh::topology::Parts;
use crate::mesh::{Fault, Mesh, Topology};

/// A hole may hide so many times the largest flat surface that its rim can span: the surface bulges or folds there.
const FOLDED: f64 = 2.0;

/// Holes and faults of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gaps {
    /// Boundary loops that do not lie in the faces of the bounds.
    pub(super) holes: usize,
    /// Area of surface that may be missing or counted twice.
    pub(super) area: f64,
}

pub(super) fn gaps(mesh: &Mesh, topology: &Topology, bounds: Option<&Aabb>) -> Gaps {
    let mut out = Gaps::default();
    if topology.is_closed() {
        return out;
    }
    for length in holes(mesh, bounds) {
        out.holes += 1;
        // A loop of this length bounds no flat surface, nor any minimal one, larger than a disc.
        out.area += FOLDED * length * length / (4.0 * PI);
    }
    if topology.is_manifold() {
        return out;
    }
    if topology.faults.len() >= Topology::MOST_FAULTS {
        out.area += mesh.area();
        return out;
    }
    let mut doubtful = vec![false; mesh.points.len()];
    let mut area = 0.0;
    let size = |f: usize| 0.5 * norm(mesh.face_vector(f));
    for fault in &topology.faults {
        match *fault {
            Fault::Missing { .. } | Fault::Isolated { .. } => {}
            Fault::Degenerate { face } => area += size(face as usize),
            Fault::Edge { ends } | Fault::Orientation { ends } => {
                ends.iter().for_each(|&v| doubtful[v as usize] = true);
            }
            Fault::Vertex { vertex } => doubtful[vertex as usize] = true,
        }
    }
    let touched = (0..mesh.faces.len()).filter(|&f| mesh.faces[f].iter().any(|&v| doubtful[v as usize]));
    out.area += FOLDED * (area + touched.map(size).sum::<f64>());
    out
}

/// Lengths of the loops of edges with one triangle that lie inside the bounds; one that leaves the box anywhere is a hole with the part
/// inside.
fn holes(mesh: &Mesh, bounds: Option<&Aabb>) -> Vec<f64> {
    let near = bounds.map_or(0.0, |b| ON_FACE * b.diagonal());
    let on_face = |ends: [V3; 2]| {
        bounds.is_some_and(|b| {
            (0..3).any(|a| [b.lo[a], b.hi[a]].iter().any(|w| ends.iter().all(|p| (p[a] - w).abs() <= near)))
        })
    };
    let mut loops = Parts::new(mesh.points.len());
    let inside: Vec<(u32, f64)> = open_sides(mesh.points.len(), &mesh.faces)
        .into_iter()
        .map(|(a, b, _)| (a, b, [a, b].map(|v| mesh.points[v as usize])))
        .filter(|(.., ends)| !on_face(*ends))
        .map(|(a, b, [p, q])| {
            loops.join(a, b);
            (a, distance(p, q))
        })
        .collect();
    let mut length = BTreeMap::new();
    for (v, l) in inside {
        *length.entry(loops.root(v)).or_insert(0.0) += l;
    }
    length.into_values().collect()
}
