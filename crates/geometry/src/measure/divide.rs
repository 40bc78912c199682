//! Triangles divided where their corners' normals are far apart.
//!
//! A patch stands over its triangle along directions between the normals at its corners. Where a triangle reaches around a
//! rim that is thinner than itself those normals oppose each other, the directions between them vanish, and dividing the patch does
//! not help: its parts have the same directions. So edges whose ends turn too much get a vertex on the surface between them, with the
//! normal there, in all of their triangles at once: the patches still cover the surface once.

use std::collections::BTreeMap;

use isoswarm_field::vector::{V3, add, along, distance, dot, norm, unit};
use isoswarm_field::{FieldError, Surface};

use crate::mesh::Mesh;

/// Edges with a smaller cosine between the directions at their ends are divided.
const TURNED: f64 = 0.7;
/// So often, one after the other.
const ROUNDS: usize = 12;
/// Sums of two directions shorter than this say nothing.
const OPPOSED: f64 = 0.3;
/// Places along a direction at which the surface is looked for, so many a length of the edge: triangles may cut off a rim that sticks out
/// farther than they are large.
const STATIONS: usize = 24;
const PER_LENGTH: usize = 8;
/// Halvings of the interval in which it was found.
const HALVINGS: usize = 48;

/// A mesh without such edges, and where its triangles lie in those of the mesh it came from.
pub(super) struct Divided {
    pub(super) mesh: Mesh,
    /// Directions of the vertices.
    pub(super) directions: Vec<V3>,
    /// For each triangle that it is a part of, and the barycentric coordinates of its corners there.
    pub(super) part_of: Vec<(u32, [[f64; 3]; 3])>,
}

impl Divided {
    /// Divides until no edge is left that turns too much and can be divided; to `most` triangles more at most.
    pub(super) fn new(
        surface: &dyn Surface,
        mesh: &Mesh,
        directions: &[V3],
        most: usize,
    ) -> Result<Self, FieldError> {
        let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut out = Self {
            mesh: Mesh::new(mesh.points.clone(), mesh.faces.clone()),
            directions: directions.to_vec(),
            part_of: (0..mesh.faces.len() as u32).map(|f| (f, whole)).collect(),
        };
        let room = mesh.faces.len().saturating_add(most);
        for _ in 0..ROUNDS {
            let edges = out.turning();
            if edges.is_empty() || out.mesh.faces.len() + 2 * edges.len() > room {
                break;
            }
            let found = out.between(surface, &edges)?;
            if found.is_empty() {
                break;
            }
            out.split(&found);
        }
        Ok(out)
    }

    /// Edges between triangles whose ends' directions differ too much.
    fn turning(&self) -> Vec<[u32; 2]> {
        let turns = |a: u32, b: u32| {
            let (p, q) = (self.mesh.points[a as usize], self.mesh.points[b as usize]);
            dot(self.directions[a as usize], self.directions[b as usize]) < TURNED && p != q
        };
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for f in &self.mesh.faces {
            let sides = [0, 1, 2].map(|k| [f[k], f[(k + 1) % 3]]);
            edges.extend(sides.into_iter().filter(|[a, b]| turns(*a, *b)).map(|[a, b]| [a.min(b), a.max(b)]));
        }
        edges.sort_unstable();
        // Those on a boundary stay: there the directions keep to the bounds.
        edges.chunk_by(|a, b| a == b).filter(|same| same.len() > 1).map(|same| same[0]).collect()
    }

    /// Puts a vertex on the surface between the ends of each edge, where there is one; gives their numbers.
    fn between(
        &mut self,
        surface: &dyn Surface,
        edges: &[[u32; 2]],
    ) -> Result<BTreeMap<[u32; 2], u32>, FieldError> {
        let n = edges.len();
        let ends = |e: &[u32; 2]| e.map(|v| self.mesh.points[v as usize]);
        let start: Vec<V3> = edges
            .iter()
            .map(|e| {
                let [p, q] = ends(e);
                [0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a])
            })
            .collect();
        let length: Vec<f64> = edges.iter().map(|e| distance(ends(e)[0], ends(e)[1])).collect();
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        surface.value_gradient(&start, &mut value, &mut gradient)?;
        let inside: Vec<bool> = value.iter().map(|v| *v < 0.0).collect();
        let way: Vec<V3> = (0..n)
            .map(|i| {
                let [a, b] = edges[i].map(|v| self.directions[v as usize]);
                let sum = add(a, b);
                let out = unit(if norm(sum) > OPPOSED { sum } else { gradient[i] });
                if inside[i] { out } else { out.map(|c| -c) }
            })
            .collect();
        // The surface lies between these distances from the middle.
        let (mut near, mut far) = (vec![0.0; n], vec![f64::NAN; n]);
        let at = |i: usize, t: f64| along(start[i], t, way[i]);
        for k in 1..=STATIONS {
            let part = k as f64 / PER_LENGTH as f64;
            let points: Vec<V3> = (0..n).map(|i| at(i, part * length[i])).collect();
            surface.value_gradient(&points, &mut value, &mut gradient)?;
            for i in 0..n {
                let t = part * length[i];
                if !far[i].is_nan() {
                    continue;
                }
                if (value[i] < 0.0) == inside[i] { near[i] = t } else { far[i] = t }
            }
        }
        let middle = |near: &[f64], far: &[f64], i: usize| at(i, 0.5 * (near[i] + far[i]));
        let chosen: Vec<usize> = (0..n).filter(|&i| far[i].is_finite()).collect();
        let m = chosen.len();
        let (mut value, mut gradient) = (vec![0.0; m], vec![[0.0; 3]; m]);
        for _ in 0..HALVINGS {
            let points: Vec<V3> = chosen.iter().map(|&i| middle(&near, &far, i)).collect();
            surface.value_gradient(&points, &mut value, &mut gradient)?;
            for (k, &i) in chosen.iter().enumerate() {
                let t = 0.5 * (near[i] + far[i]);
                if (value[k] < 0.0) == inside[i] { near[i] = t } else { far[i] = t }
            }
        }
        let mut found = BTreeMap::new();
        for (k, &i) in chosen.iter().enumerate() {
            let normal = unit(gradient[k]);
            if normal == [0.0; 3] || !normal.iter().all(|c| c.is_finite()) {
                continue;
            }
            found.insert(edges[i], self.mesh.points.len() as u32);
            self.mesh.points.push(middle(&near, &far, i));
            self.directions.push(normal);
        }
        Ok(found)
    }

    /// Divides the triangles of the edges that got a vertex.
    fn split(&mut self, found: &BTreeMap<[u32; 2], u32>) {
        let (mut faces, mut part_of) = (Vec::new(), Vec::new());
        for (f, (v, (face, corners))) in self.mesh.faces.iter().zip(&self.part_of).enumerate() {
            let on = |k: usize| {
                let (a, b) = (v[k], v[(k + 1) % 3]);
                found.get(&[a.min(b), a.max(b)]).copied()
            };
            // The outline, corner by corner, each with the place in the triangle of the mesh.
            let middle = |k: usize| [0, 1, 2].map(|a| 0.5 * corners[k][a] + 0.5 * corners[(k + 1) % 3][a]);
            let new = [0, 1, 2].map(on);
            let mut add = |t: [(u32, [f64; 3]); 3]| {
                faces.push(t.map(|(v, _)| v));
                part_of.push((*face, t.map(|(_, b)| b)));
            };
            let corner = |k: usize| (v[k % 3], corners[k % 3]);
            let many = new.iter().flatten().count();
            if many == 0 {
                faces.push(self.mesh.faces[f]);
                part_of.push(self.part_of[f]);
                continue;
            }
            if let [Some(x), Some(y), Some(z)] = new {
                let m = [(x, middle(0)), (y, middle(1)), (z, middle(2))];
                (0..3).for_each(|k| add([corner(k), m[k], m[(k + 2) % 3]]));
                add(m);
                continue;
            }
            // Begins at a side with a vertex, whose next has one too if there are two.
            let first = (0..3).find(|&k| new[k].is_some() && (many == 1 || new[(k + 1) % 3].is_some()));
            let Some(k) = first else { continue };
            let Some(x) = new[k].map(|x| (x, middle(k))) else { continue };
            match new[(k + 1) % 3].map(|y| (y, middle((k + 1) % 3))) {
                None => {
                    add([corner(k), x, corner(k + 2)]);
                    add([x, corner(k + 1), corner(k + 2)]);
                }
                Some(y) => {
                    add([x, corner(k + 1), y]);
                    // The shorter diagonal of what is left.
                    let apart =
                        |a: u32, b: u32| distance(self.mesh.points[a as usize], self.mesh.points[b as usize]);
                    if apart(v[k], y.0) <= apart(x.0, v[(k + 2) % 3]) {
                        add([corner(k), x, y]);
                        add([corner(k), y, corner(k + 2)]);
                    } else {
                        add([corner(k), x, corner(k + 2)]);
                        add([x, y, corner(k + 2)]);
                    }
                }
            }
        }
        (self.mesh.faces, self.part_of) = (faces, part_of);
    }
}
