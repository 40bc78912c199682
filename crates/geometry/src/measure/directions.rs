//! The direction in which each vertex is moved onto the surface.

use isoswarm_field::vector::{V3, add, dot, norm, unit};
use isoswarm_field::{Aabb, Surface};

use crate::GeometryError;
use crate::mesh::sides::open_sides;
use crate::mesh::{Mesh, Topology};

/// A vertex this near a face of the bounds, in parts of their diagonal, lies on it.
pub(super) const ON_FACE: f64 = 1e-9;

/// Length of the sum of a vertex' triangles' vectors, over the sum of their lengths, below which they do not lie in one plane, nearly.
const BENT: f64 = 0.8;

/// Directions and normals of the vertices.
pub(super) struct Directions {
    /// Unit normals of the surface; those of the mesh where the surface has none.
    pub(super) normals: Vec<V3>,
    /// The same, but within the faces of the bounds for vertices on a boundary there.
    pub(super) at: Vec<V3>,
}

pub(super) fn directions(
    surface: &dyn Surface,
    mesh: &Mesh,
    topology: &Topology,
    bounds: Option<&Aabb>,
) -> Result<Directions, GeometryError> {
    let n = mesh.points.len();
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    surface.value_gradient(&mesh.points, &mut value, &mut gradient)?;
    let (mut of_mesh, mut size) = (vec![[0.0; 3]; n], vec![0.0; n]);
    for (f, corners) in mesh.faces.iter().enumerate() {
        let vector = mesh.face_vector(f);
        for &v in corners {
            of_mesh[v as usize] = add(of_mesh[v as usize], vector);
            size[v as usize] += norm(vector);
        }
    }
    let normal = |v: usize| {
        let own = unit(gradient[v]);
        // A gradient against the triangles belongs to another sheet, or to none.
        let flat = unit(of_mesh[v]);
        // Triangles that reach around a rim face many ways, and their mean says little.
        let bent = norm(of_mesh[v]) < BENT * size[v] && own != [0.0; 3];
        if bent || dot(own, flat) > 0.1 { own } else { flat }
    };
    let normals: Vec<V3> = (0..n).map(normal).collect();
    let mut at = normals.clone();
    if let Some(bounds) = bounds.filter(|_| topology.boundaries > 0) {
        boundary(mesh)
            .into_iter()
            .for_each(|v| at[v as usize] = in_faces(mesh.points[v as usize], at[v as usize], bounds));
    }
    Ok(Directions { normals, at })
}

/// Vertices at edges of one triangle only.
pub(super) fn boundary(mesh: &Mesh) -> Vec<u32> {
    let open = open_sides(mesh.points.len(), &mesh.faces);
    let mut out: Vec<u32> = open.into_iter().flat_map(|(a, b, _)| [a, b]).collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// The part of `d` that lies in all faces of the bounds that the point is on.
fn in_faces(p: V3, d: V3, bounds: &Aabb) -> V3 {
    let near = ON_FACE * bounds.diagonal();
    let on = |a: usize| (p[a] - bounds.lo[a]).abs() <= near || (p[a] - bounds.hi[a]).abs() <= near;
    unit([0, 1, 2].map(|a| if on(a) { 0.0 } else { d[a] }))
}
