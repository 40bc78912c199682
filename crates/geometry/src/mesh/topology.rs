//! The one check that all meshes must pass: is it a manifold, consistently oriented, closed, and of which topology?

use isoswarm_field::arrange::Arrange;
use std::fmt;

use super::sides::{pinched, sides};

/// Something that a proper mesh does not have. Numbers are those of vertices and faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A face names a vertex that is not there.
    Missing {
        /// The face.
        face: u32,
    },
    /// A face names a vertex twice.
    Degenerate {
        /// The face.
        face: u32,
    },
    /// More than two faces meet at an edge.
    Edge {
        /// The edge's ends.
        ends: [u32; 2],
    },
    /// The two faces of an edge run along it in the same direction.
    Orientation {
        /// The edge's ends.
        ends: [u32; 2],
    },
    /// The faces around a vertex form more than one fan.
    Vertex {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex belongs to no face.
    Isolated {
        /// The vertex.
        vertex: u32,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::Missing { face } => write!(out, "face {face} names a vertex that is not there"),
            Fault::Degenerate { face } => write!(out, "face {face} names a vertex twice"),
            Fault::Edge { ends: [a, b] } => {
                write!(out, "more than two faces meet at the edge from {a} to {b}")
            }
            Fault::Orientation { ends: [a, b] } => {
                write!(out, "the faces at the edge from {a} to {b} are oriented against each other")
            }
            Fault::Vertex { vertex } => {
                write!(out, "the faces around vertex {vertex} form more than one fan")
            }
            Fault::Isolated { vertex } => write!(out, "vertex {vertex} belongs to no face"),
        }
    }
}

/// What the faces of a mesh say of its topology. A closed, oriented 2-manifold has no faults and no boundary.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Vertices, those that belong to no face included.
    pub vertices: usize,
    /// Edges, each once.
    pub edges: usize,
    /// Faces.
    pub faces: usize,
    /// Closed loops of edges that belong to one face only.
    pub boundaries: usize,
    /// Euler characteristic V - E + F of each connected component, in the order of their first faces.
    pub euler: Vec<i64>,
    /// What is wrong, at most [`Topology::MOST_FAULTS`].
    pub faults: Vec<Fault>,
    /// Connected component of each vertex; `u32::MAX` for those that belong to no face.
    pub component: Vec<u32>,
    boundary_of: Vec<usize>,
}

impl Topology {
    /// So many faults are listed; a mesh with more is no mesh.
    pub const MOST_FAULTS: usize = 1000;

    /// Looks at the faces over `vertices` vertices.
    pub fn of(vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut out = Self { vertices, faces: faces.len(), ..Self::default() };
        let good: Vec<bool> =
            faces.iter().enumerate().map(|(f, v)| out.names_vertices(f as u32, *v)).collect();
        if !good.iter().all(|g| *g) {
            // The others, as if these were not there.
            let kept: Vec<[u32; 3]> = faces.iter().zip(&good).filter(|(_, g)| **g).map(|(v, _)| *v).collect();
            out.look(&kept);
        } else {
            out.look(faces);
        }
        out
    }

    /// The same of faces that name three different vertices each.
    fn look(&mut self, faces: &[[u32; 3]]) {
        let sides = sides(self.vertices, faces, |_| true);
        let edges = || sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
        let mut parts = Parts::new(self.vertices);
        let mut open: Vec<(u32, u32)> = Vec::new();
        let mut across = vec![[u32::MAX; 3]; faces.len()];
        for edge in edges() {
            let (a, b, s) = edge[0];
            self.edges += 1;
            parts.join(a, b);
            match *edge {
                [_] => open.push((a, b)),
                [_, (_, _, t)] => {
                    let [(f, k), (g, l)] = [s, t].map(|s| (s as usize / 3, s as usize % 3));
                    if faces[f][k] == faces[g][l] {
                        self.fault(Fault::Orientation { ends: [a, b] });
                    }
                    (across[f][k], across[g][l]) = (g as u32, f as u32);
                }
                _ => self.fault(Fault::Edge { ends: [a, b] }),
            }
        }
        for vertex in pinched(self.vertices, faces, &across) {
            self.fault(Fault::Vertex { vertex });
        }
        self.component = vec![u32::MAX; self.vertices];
        let (mut number, mut many) = (vec![u32::MAX; self.vertices], 0);
        for &v in faces.iter().flatten() {
            if self.component[v as usize] != u32::MAX {
                continue;
            }
            let n = &mut number[parts.root(v) as usize];
            if *n == u32::MAX {
                (*n, many) = (many, many + 1);
            }
            self.component[v as usize] = *n;
        }
        self.euler = vec![0; many as usize];
        for v in 0..self.vertices {
            match self.component[v] {
                u32::MAX => self.fault(Fault::Isolated { vertex: v as u32 }),
                c => self.euler[c as usize] += 1,
            }
        }
        for edge in edges() {
            self.euler[self.component[edge[0].0 as usize] as usize] -= 1;
        }
        for v in faces {
            self.euler[self.component[v[0] as usize] as usize] += 1;
        }
        let mut loops = Parts::new(self.vertices);
        open.iter().for_each(|&(a, b)| loops.join(a, b));
        self.boundary_of = vec![0; many as usize];
        let mut roots: Vec<u32> = open.iter().map(|&(a, _)| loops.root(a)).collect();
        roots.arrange();
        roots.dedup();
        self.boundaries = roots.len();
        for r in roots {
            self.boundary_of[self.component[r as usize] as usize] += 1;
        }
    }

    /// Whether there are no faults: a manifold, with or without boundary, consistently oriented.
    pub fn is_manifold(&self) -> bool {
        self.faults.is_empty()
    }

    /// Whether it is a manifold without boundary.
    pub fn is_closed(&self) -> bool {
        self.is_manifold() && self.boundaries == 0
    }

    /// Number of connected components.
    pub fn components(&self) -> usize {
        self.euler.len()
    }

    /// Euler characteristic of all components together.
    pub fn total_euler(&self) -> i64 {
        self.euler.iter().sum()
    }

    /// Genus of each component, its boundaries filled: (2 - χ - boundaries) / 2.
    pub fn genus(&self) -> Vec<i64> {
        self.euler.iter().zip(&self.boundary_of).map(|(chi, &b)| (2 - chi - b as i64) / 2).collect()
    }

    fn fault(&mut self, fault: Fault) {
        if self.faults.len() < Self::MOST_FAULTS && !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    /// Whether a face names three different vertices.
    fn names_vertices(&mut self, face: u32, v: [u32; 3]) -> bool {
        if v.iter().any(|&v| v as usize >= self.vertices) {
            self.fault(Fault::Missing { face });
            return false;
        }
        if v[0] == v[1] || v[1] == v[2] || v[2] == v[0] {
            self.fault(Fault::Degenerate { face });
            return false;
        }
        true
    }
}

/// Disjoint sets.
pub(crate) struct Parts {
    parent: Vec<u32>,
}

impl Parts {
    pub(crate) fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    pub(crate) fn root(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            self.parent[v as usize] = self.parent[self.parent[v as usize] as usize];
            v = self.parent[v as usize];
        }
        v
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The boundary of a tetrahedron over vertices `o` to `o + 3`.
    fn tetrahedron(o: u32) -> Vec<[u32; 3]> {
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|f| f.map(|v| v + o)).to_vec()
    }

    /// A torus of m × n quads.
    fn torus(m: u32, n: u32) -> Vec<[u32; 3]> {
        let at = |i: u32, j: u32| (i % m) * n + j % n;
        let quad = |(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        };
        (0..m).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(quad).collect()
    }

    #[test]
    fn closed_surfaces_have_their_genus() {
        let t = Topology::of(4, &tetrahedron(0));
        assert!(t.is_closed() && t.euler == [2] && t.genus() == [0] && t.edges == 6, "{t:?}");
        let t = Topology::of(20, &torus(4, 5));
        assert!(t.is_closed() && t.euler == [0] && t.genus() == [1], "{t:?}");
        let mut both = tetrahedron(0);
        both.extend(torus(4, 5).into_iter().map(|f| f.map(|v| v + 4)));
        let t = Topology::of(24, &both);
        assert!(t.is_closed() && t.euler == [2, 0] && t.genus() == [0, 1], "{t:?}");
        assert_eq!((t.component[0], t.component[4]), (0, 1));
    }

    #[test]
    fn holes_are_boundaries() {
        let mut faces = torus(6, 6);
        faces.swap_remove(40);
        faces.swap_remove(0);
        let t = Topology::of(36, &faces);
        assert!(t.is_manifold() && !t.is_closed(), "{t:?}");
        assert_eq!((t.boundaries, t.euler.clone(), t.genus()), (2, vec![-2], vec![1]));
    }

    #[test]
    fn every_fault_is_found() {
        let fault = |n, faces: &[[u32; 3]]| Topology::of(n, faces).faults;
        assert_eq!(fault(3, &[[0, 1, 7]])[0], Fault::Missing { face: 0 });
        assert_eq!(fault(3, &[[0, 1, 1]])[0], Fault::Degenerate { face: 0 });
        assert_eq!(fault(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]])[0], Fault::Edge { ends: [0, 1] });
        assert_eq!(fault(4, &[[0, 1, 2], [0, 1, 3]]), [Fault::Orientation { ends: [0, 1] }]);
        assert_eq!(fault(4, &[[0, 1, 2]]), [Fault::Isolated { vertex: 3 }]);
        // A face that is oriented against its neighbours tears no fan.
        let mut faces = tetrahedron(0);
        faces[0].swap(0, 1);
        let turned = fault(4, &faces);
        assert!(
            turned.len() == 3 && turned.iter().all(|f| matches!(f, Fault::Orientation { .. })),
            "{turned:?}"
        );
        // Two tetrahedra that touch at a vertex.
        let mut faces = tetrahedron(0);
        faces.extend(tetrahedron(4).into_iter().map(|f| f.map(|v| if v == 4 { 0 } else { v })));
        let t = Topology::of(8, &faces);
        assert_eq!(t.faults, [Fault::Vertex { vertex: 0 }, Fault::Isolated { vertex: 4 }]);
        assert_eq!(t.euler, [3]);
    }
}
