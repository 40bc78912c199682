//! Meshes by marching tetrahedra, for tests of what works on any mesh: their triangles are as poor as they come.
#![allow(dead_code)]

use std::collections::HashMap;

use isoswarm_field::vector::{add, cross, dot, scale, sub};
use isoswarm_field::{Aabb, Field, Surface, text};
use isoswarm_geometry::Mesh;

/// A surface by its formula.
pub fn surface(formula: &str) -> Field {
    Field::new(&text::parse(formula, &[]).unwrap()).unwrap()
}

/// The surface in the box, by `n` cells along each axis; vertices are moved onto it along the lattice's edges.
pub fn mesh(surface: &dyn Surface, bounds: &Aabb, n: [usize; 3]) -> Mesh {
    let at = |i: [usize; 3]| {
        [0, 1, 2].map(|a| bounds.lo[a] + (bounds.hi[a] - bounds.lo[a]) * i[a] as f64 / n[a] as f64)
    };
    let number = |i: [usize; 3]| (i[0] * (n[1] + 1) + i[1]) * (n[2] + 1) + i[2];
    let nodes: Vec<[f64; 3]> = (0..=n[0])
        .flat_map(|i| (0..=n[1]).flat_map(move |j| (0..=n[2]).map(move |k| [i, j, k])))
        .map(at)
        .collect();
    let evaluate = |p: &[[f64; 3]]| {
        let (mut v, mut g) = (vec![0.0; p.len()], vec![[0.0; 3]; p.len()]);
        surface.value_gradient(p, &mut v, &mut g).unwrap();
        v
    };
    let value = evaluate(&nodes);
    let (mut crossed, mut numbers) = (Vec::new(), HashMap::new());
    let mut vertex = |a: usize, b: usize| {
        let edge = (a.min(b), a.max(b));
        *numbers.entry(edge).or_insert_with(|| {
            crossed.push(edge);
            crossed.len() as u32 - 1
        })
    };
    const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut faces = Vec::new();
    for i in 0..n[0] {
        for j in 0..n[1] {
            for k in 0..n[2] {
                for path in PATHS {
                    let mut corner = [i, j, k];
                    let mut tet = [number(corner); 4];
                    for (s, a) in path.into_iter().enumerate() {
                        corner[a] += 1;
                        tet[s + 1] = number(corner);
                    }
                    let (inside, outside): (Vec<usize>, Vec<usize>) =
                        tet.iter().partition(|v| value[**v] < 0.0);
                    let mut v = |a: usize, b: usize| vertex(inside[a], outside[b]);
                    let triangles: Vec<[u32; 3]> = match inside.len() {
                        1 => vec![[v(0, 0), v(0, 1), v(0, 2)]],
                        3 => vec![[v(0, 0), v(1, 0), v(2, 0)]],
                        2 => {
                            let (a, b, c, d) = (v(0, 0), v(0, 1), v(1, 1), v(1, 0));
                            vec![[a, b, c], [a, c, d]]
                        }
                        _ => continue,
                    };
                    let mean = |v: &[usize]| {
                        scale(v.iter().fold([0.0; 3], |s, &i| add(s, nodes[i])), 1.0 / v.len() as f64)
                    };
                    faces.extend(triangles.into_iter().map(|t| (t, sub(mean(&outside), mean(&inside)))));
                }
            }
        }
    }
    let points = roots(&crossed, &nodes, &value, evaluate);
    let oriented = |(t, out): ([u32; 3], [f64; 3])| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        if dot(cross(sub(b, a), sub(c, a)), out) < 0.0 { [t[0], t[2], t[1]] } else { t }
    };
    let faces = faces.into_iter().map(oriented).collect();
    Mesh::new(points, faces)
}

/// Zeros on the lattice's edges, by the method of Illinois.
fn roots(
    crossed: &[(usize, usize)],
    nodes: &[[f64; 3]],
    value: &[f64],
    evaluate: impl Fn(&[[f64; 3]]) -> Vec<f64>,
) -> Vec<[f64; 3]> {
    let mut ends: Vec<[(f64, f64); 2]> =
        crossed.iter().map(|e| [(0.0, value[e.0]), (1.0, value[e.1])]).collect();
    let place = |e: &(usize, usize), t: f64| add(nodes[e.0], scale(sub(nodes[e.1], nodes[e.0]), t));
    for _ in 0..25 {
        let t: Vec<f64> = ends.iter().map(|[a, b]| a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1)).collect();
        let v = evaluate(&crossed.iter().zip(&t).map(|(e, t)| place(e, *t)).collect::<Vec<_>>());
        for ((e, t), v) in ends.iter_mut().zip(t).zip(v) {
            if (v < 0.0) == (e[1].1 < 0.0) {
                e[0].1 *= 0.5
            } else {
                e[0] = e[1]
            }
            e[1] = if v == 0.0 { e[1] } else { (t, v) };
            if e[0].1 == 0.0 || e[0].0 == e[1].0 || (e[0].1 < 0.0) == (e[1].1 < 0.0) {
                *e = [(t, -1.0), (t + 1e-30, 1.0)];
            }
        }
    }
    crossed.iter().zip(&ends).map(|(e, [_, b])| place(e, b.0)).collect()
}
