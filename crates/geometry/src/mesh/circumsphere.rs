//! The rule of Szeliski and Tonnesen (SIGGRAPH '92, section 5), to compare with.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::vector::{V3, add, cross, distance, dot, scale, sub};
use isoswarm_particles::{Neighbors, Reach, same_sheet};
use rayon::prelude::*;

/// Reach of the lists of neighbours in spacings; a triangle's circumscribed circle is no larger than half of that.
const REACH: f64 = 2.4;

/// All triangles of three neighbours whose smallest circumscribed sphere (about the centre of their circle) holds no other vertex of the same
/// sheet. Where four vertices are on a circle, both diagonals pass: the result need not be a manifold.
pub(super) fn triangles(points: &[V3], normals: &[V3], spacing: &[f64]) -> Vec<[u32; 3]> {
    let keep = |i: usize, j: usize| same_sheet(points[i], points[j], normals[i], normals[j]);
    let reach: Vec<f64> = spacing.iter().map(|s| REACH * s).collect();
    let lists = match reach[..] {
        [one] => Neighbors::find(points, Reach::Same(one), keep),
        _ => Neighbors::find(points, Reach::Each(&reach), keep),
    };
    let rows: Vec<Vec<[u32; 3]>> = (0..points.len().div_ceil(256))
        .into_par_iter()
        .map(|c| {
            let mut out = Vec::new();
            for i in c * 256..((c + 1) * 256).min(points.len()) {
                let mut near = lists.of(i).to_vec();
                near.arrange();
                for (k, &a) in near.iter().enumerate().filter(|(_, a)| **a as usize > i) {
                    for &b in &near[k + 1..] {
                        let t = [i, a as usize, b as usize];
                        out.extend(passes(points, normals, &near, t).then(|| facing(points, normals, t)));
                    }
                }
            }
            out
        })
        .collect();
    rows.concat()
}

fn passes(points: &[V3], normals: &[V3], near: &[u32], t: [usize; 3]) -> bool {
    let [p, q, r] = t.map(|v| points[v]);
    if !same_sheet(q, r, normals[t[1]], normals[t[2]]) {
        return false;
    }
    let (x, y) = (sub(q, p), sub(r, p));
    let w = cross(x, y);
    let square = dot(w, w);
    if square == 0.0 {
        return false;
    }
    let to = scale(add(scale(cross(w, x), dot(y, y)), scale(cross(y, w), dot(x, x))), 0.5 / square);
    let centre = add(p, to);
    let radius = dot(to, to).sqrt() * (1.0 - 1e-9);
    near.iter().all(|&j| {
        let j = j as usize;
        j == t[1] || j == t[2] || distance(points[j], centre) >= radius
    })
}

/// Turned so that it faces as its corners do.
fn facing(points: &[V3], normals: &[V3], [a, b, c]: [usize; 3]) -> [u32; 3] {
    let front = cross(sub(points[b], points[a]), sub(points[c], points[a]));
    let n = add(add(normals[a], normals[b]), normals[c]);
    if dot(front, n) >= 0.0 { [a as u32, b as u32, c as u32] } else { [a as u32, c as u32, b as u32] }
}
