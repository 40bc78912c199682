//! What a mesh that does not cover the surface once may be off by.

use std::f64::consts::PI;

use isoswarm_field::Aabb;
use isoswarm_field::vector::{norm, sub};

use super::directions::ON_FACE;
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

/// Lengths of the loops of edges with one triangle that lie inside the bounds.
fn holes(mesh: &Mesh, bounds: Option<&Aabb>) -> Vec<f64> {
    let mut sides: Vec<[u32; 2]> = mesh
        .faces
        .iter()
        .flat_map(|f| [0, 1, 2].map(|k| [f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3])]))
        .collect();
    sides.sort_unstable();
    let open: Vec<[u32; 2]> = sides.chunk_by(|a, b| a == b).filter(|c| c.len() == 1).map(|c| c[0]).collect();
    let near = bounds.map_or(0.0, |b| ON_FACE * b.diagonal());
    let on_face = |e: &[u32; 2]| {
        bounds.is_some_and(|b| {
            let ends = e.map(|v| mesh.points[v as usize]);
            (0..3).any(|a| [b.lo[a], b.hi[a]].iter().any(|w| ends.iter().all(|p| (p[a] - w).abs() <= near)))
        })
    };
    // Edges by the loops that they belong to, whole loops at once: one that leaves the box anywhere is a hole with the part inside.
    let mut loops: Vec<(u32, f64)> = Vec::new();
    let mut root: Vec<u32> = (0..mesh.points.len() as u32).collect();
    let find = |root: &mut Vec<u32>, mut v: u32| {
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    };
    let inside: Vec<&[u32; 2]> = open.iter().filter(|e| !on_face(e)).collect();
    for [a, b] in &inside {
        let (a, b) = (find(&mut root, *a), find(&mut root, *b));
        root[a.max(b) as usize] = a.min(b);
    }
    for [a, b] in inside {
        let length = norm(sub(mesh.points[*a as usize], mesh.points[*b as usize]));
        loops.push((find(&mut root, *a), length));
    }
    loops.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    loops.chunk_by(|a, b| a.0 == b.0).map(|c| c.iter().map(|e| e.1).sum()).collect()
}
