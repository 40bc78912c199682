//! Vertices with too few or too many triangles: taken out, or split in two.

use isoswarm_field::vector::{V3, distance, unit};

use super::connect::{NONE, Triangles};
use super::vertices::Vertices;

/// Vertices with this many triangles or fewer are taken out.
const FEW: usize = 4;
/// Vertices with this many or more are split.
const MANY: usize = 8;
/// How far the halves of a split vertex move towards their neighbours.
const SPREAD: f64 = 0.25;

/// Takes out inner vertices with four triangles or fewer and splits those with eight or more: others than 5 to 7 make poor
/// triangles wherever they are. Gives how many vertices came and went; numbers of vertices and faces change.
pub(super) fn mend(
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
) -> (usize, usize) {
    let before = vertices.len();
    let mut face_of = vec![NONE; before];
    let mut valence = vec![0usize; before];
    for (f, v) in triangles.faces.iter().enumerate() {
        for &v in v {
            face_of[v as usize] = f as u32;
            valence[v as usize] += 1;
        }
    }
    let mut touched = vec![false; before];
    let mut dead = vec![false; before];
    let mut dead_faces = vec![false; triangles.faces.len()];
    let (mut came, mut went) = (0, 0);
    for v in 0..before {
        let few = valence[v] > 0 && valence[v] <= FEW;
        if !(few || valence[v] >= MANY) || held[v] || vertices.faces[v] != 0 {
            continue;
        }
        let Some(fan) = triangles.fan(v as u32, face_of[v] as usize) else { continue };
        // Each neighbourhood once a pass.
        if touched[v] || fan.iter().any(|&(_, w)| touched[w as usize]) {
            continue;
        }
        let done = if few {
            take_out(triangles, vertices, &valence, &fan, &mut dead_faces)
        } else {
            split(triangles, vertices, &valence, v, &fan)
        };
        if done {
            touched[v] = true;
            fan.iter().for_each(|&(_, w)| touched[w as usize] = true);
            (dead[v], went, came) = (few, went + usize::from(few), came + usize::from(!few));
            if !few {
                held.push(false);
                dead.push(false);
                dead_faces.resize(triangles.faces.len(), false);
            }
        }
    }
    if went > 0 {
        triangles.drop_faces(&dead_faces);
        drop_vertices(triangles, vertices, held, &dead);
    }
    (came, went)
}

/// Keeps the vertices that are not `dead`, which must belong to no face.
pub(super) fn drop_vertices(
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    held: &mut Vec<bool>,
    dead: &[bool],
) {
    let mut number = Vec::with_capacity(dead.len());
    let mut n = 0;
    for d in dead {
        number.push(n);
        n += u32::from(!d);
    }
    triangles.faces.iter_mut().for_each(|f| *f = f.map(|v| number[v as usize]));
    vertices.retain(|i| !dead[i]);
    let mut i = 0;
    held.retain(|_| {
        i += 1;
        !dead[i - 1]
    });
}

/// Replaces the three or four triangles of a vertex by one or two.
fn take_out(
    triangles: &mut Triangles,
    vertices: &Vertices,
    valence: &[usize],
    fan: &[(u32, u32)],
    dead: &mut [bool],
) -> bool {
    let link: Vec<u32> = fan.iter().map(|f| f.1).collect();
    let outer: Vec<u32> = fan.iter().map(|&(f, w)| triangles.over(f as usize, w)).collect();
    if let [f, g, h] = fan.iter().map(|f| f.0 as usize).collect::<Vec<_>>()[..] {
        triangles.set(f, [link[0], link[1], link[2]], [outer[0], outer[1], outer[2]]);
        (dead[g], dead[h]) = (true, true);
        return true;
    }
    let [f, g, h, i] = fan.iter().map(|f| f.0 as usize).collect::<Vec<_>>()[..] else { return false };
    // The ends of the new edge keep their valence, the others lose a triangle.
    let loss = |k: usize| {
        let poor = |w: u32| valence[w as usize] < 6;
        usize::from(poor(link[(k + 1) % 4])) + usize::from(poor(link[(k + 3) % 4]))
    };
    let length =
        |k: usize| distance(vertices.points[link[k] as usize], vertices.points[link[k + 2] as usize]);
    let k = if (loss(0), length(0)) <= (loss(1), length(1)) { 0 } else { 1 };
    let w = |s: usize| link[(k + s) % 4];
    let o = |s: usize| outer[(k + s) % 4];
    if loss(k) == 2 || w(0) == w(2) || triangles.joined(w(0), w(2), fan[k].0 as usize) {
        return false;
    }
    triangles.set(f, [w(0), w(1), w(2)], [o(0), o(1), g as u32]);
    triangles.set(g, [w(0), w(2), w(3)], [f as u32, o(2), o(3)]);
    (dead[h], dead[i]) = (true, true);
    true
}

/// Splits a vertex in two that share its neighbours.
fn split(
    triangles: &mut Triangles,
    vertices: &mut Vertices,
    valence: &[usize],
    v: usize,
    fan: &[(u32, u32)],
) -> bool {
    let n = fan.len();
    let half = n / 2;
    // Two opposite neighbours get a triangle more: those with the fewest.
    let load = |k: usize| valence[fan[k].1 as usize] + valence[fan[(k + half) % n].1 as usize];
    let Some(k) = (0..n).min_by_key(|&k| (load(k), k)) else { return false };
    let w = |s: usize| fan[(k + s) % n].1;
    let face = |s: usize| fan[(k + s) % n].0;
    let (p, normal) = (vertices.points[v], vertices.normals[v]);
    let towards = |from: usize, to: usize| -> V3 {
        let count = (to - from) as f64;
        let mut q = p;
        for s in from..to {
            for a in 0..3 {
                q[a] += SPREAD * (vertices.points[w(s) as usize][a] - p[a]) / count;
            }
        }
        q
    };
    let (one, other) = (towards(1, half), towards(half + 1, n));
    let u = vertices.len() as u32;
    let spacing = vertices.spacing[v];
    vertices.points[v] = one;
    vertices.push(other, unit(normal), spacing, 0);
    // (v, w_half, u) and (v, u, w_0).
    let (x, y) = (triangles.faces.len() as u32, triangles.faces.len() as u32 + 1);
    for s in half..n {
        let f = face(s) as usize;
        if let Some(c) = triangles.corner(f, v as u32) {
            triangles.faces[f][c] = u;
        }
    }
    let v = v as u32;
    triangles.faces.push([v, w(half), u]);
    triangles.across.push([NONE; 3]);
    triangles.faces.push([v, u, w(0)]);
    triangles.across.push([NONE; 3]);
    triangles.set(x as usize, [v, w(half), u], [face(half - 1), face(half), y]);
    triangles.set(y as usize, [v, u, w(0)], [x, face(n - 1), face(0)]);
    true
}
