//! The sides of triangles by the edge they lie on.

use isoswarm_field::arrange::Arrange;
use rayon::prelude::*;

/// A side of a face: the smaller and the larger of its vertices, and three times the number of the face plus that of the corner where it
/// starts.
pub(crate) type Side = (u32, u32, u32);

/// The sides of all faces in rising order, so that those of an edge follow each other. Faces for which `good` does not hold, which may name
/// vertices that are not there, are left out.
pub(crate) fn sides(vertices: usize, faces: &[[u32; 3]], good: impl Fn(usize) -> bool) -> Vec<Side> {
    let side = |v: &[u32; 3], k: usize| {
        let (a, b) = (v[k], v[(k + 1) % 3]);
        (a.min(b), a.max(b))
    };
    // Sorted by the smaller vertex by counting, each of its few sides by comparison.
    let mut start = vec![0u32; vertices + 1];
    let kept = || faces.iter().enumerate().filter(|(f, _)| good(*f));
    for (_, v) in kept() {
        (0..3).for_each(|k| start[side(v, k).0 as usize + 1] += 1);
    }
    for v in 0..vertices {
        start[v + 1] += start[v];
    }
    let mut out = vec![(0, 0, 0); start[vertices] as usize];
    let mut next = start.clone();
    for (f, v) in kept() {
        for k in 0..3 {
            let (a, b) = side(v, k);
            let place = &mut next[a as usize];
            out[*place as usize] = (a, b, (3 * f + k) as u32);
            *place += 1;
        }
    }
    const CHUNK: usize = 4096;
    let mut parts = Vec::new();
    let mut rest = &mut out[..];
    for first in (0..vertices).step_by(CHUNK) {
        let last = (first + CHUNK).min(vertices);
        let (part, after) = rest.split_at_mut((start[last] - start[first]) as usize);
        parts.push((first, last, part));
        rest = after;
    }
    parts.into_par_iter().for_each(|(first, last, part)| {
        for v in first..last {
            let (from, to) = (start[v] - start[first], start[v + 1] - start[first]);
            part[from as usize..to as usize].arrange();
        }
    });
    out
}

/// The sides that no other face shares.
pub(crate) fn open_sides(vertices: usize, faces: &[[u32; 3]]) -> Vec<Side> {
    let alone = |edge: &[Side]| if let [side] = *edge { Some(side) } else { None };
    sides(vertices, faces, |_| true).chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter_map(alone).collect()
}

/// Vertices whose faces form more than one fan, in rising order. `across` names the face on the other side of each edge, `u32::MAX` where there is
/// none; faces may be oriented against each other.
pub(crate) fn pinched(vertices: usize, faces: &[[u32; 3]], across: &[[u32; 3]]) -> Vec<u32> {
    let (mut face_of, mut count) = (vec![u32::MAX; vertices], vec![0u32; vertices]);
    for (f, v) in faces.iter().enumerate() {
        for &v in v {
            face_of[v as usize] = f as u32;
            count[v as usize] += 1;
        }
    }
    // How many faces come after `first` around `v` over its edge to `w`, and whether they come back to it.
    let walk = |v: u32, first: u32, mut w: u32| {
        let (mut f, mut seen) = (first as usize, 0);
        while seen < count[v as usize] {
            let Some(k) = faces[f].iter().position(|&u| u == v) else { break };
            let next = faces[f][(k + 1) % 3] == w;
            let g = across[f][if next { k } else { (k + 2) % 3 }];
            if g == u32::MAX {
                break;
            }
            f = g as usize;
            let Some(l) = faces[f].iter().position(|&u| u == v) else { break };
            let (b, c) = (faces[f][(l + 1) % 3], faces[f][(l + 2) % 3]);
            w = if b == w { c } else { b };
            seen += 1;
            if g == first {
                return (seen, true);
            }
        }
        (seen, false)
    };
    let whole = |v: u32| {
        let first = face_of[v as usize];
        let Some(k) = faces[first as usize].iter().position(|&u| u == v) else { return true };
        let [b, c] = [1, 2].map(|i| faces[first as usize][(k + i) % 3]);
        match walk(v, first, b) {
            (seen, true) => seen == count[v as usize],
            (seen, false) => seen + 1 + walk(v, first, c).0 == count[v as usize],
        }
    };
    (0..vertices as u32)
        .into_par_iter()
        .with_min_len(2048)
        .filter(|&v| face_of[v as usize] != u32::MAX && !whole(v))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::topology::Parts;

    #[test]
    fn sides_are_in_order() {
        let faces: Vec<[u32; 3]> =
            (0..9000u32).map(|f| [(7 * f) % 5003, (11 * f + 1) % 5003, (13 * f + 5) % 5003]).collect();
        let found = sides(5003, &faces, |f| f % 5 != 0);
        assert_eq!(found.len(), 3 * (9000 - 1800));
        assert!(found.is_sorted());
        for &(a, b, s) in &found {
            let (f, k) = (s as usize / 3, s as usize % 3);
            let (x, y) = (faces[f][k], faces[f][(k + 1) % 3]);
            assert_eq!((a, b), (x.min(y), x.max(y)));
        }
        assert!(sides(0, &[], |_| true).is_empty());
    }

    #[test]
    fn fans_are_the_sets_of_corners_that_edges_join() {
        let mut torn = 0;
        for seed in 0..200u64 {
            let vertex = |i: u64| {
                let mixed = (64 * seed + i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as u32 % 7
            };
            let faces: Vec<[u32; 3]> = (0..8)
                .map(|f| [vertex(3 * f), vertex(3 * f + 1), vertex(3 * f + 2)])
                .filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0])
                .collect();
            let mut across = vec![[u32::MAX; 3]; faces.len()];
            let mut fans = Parts::new(3 * faces.len());
            let corner = |f: usize, v: u32| (3 * f + faces[f].iter().position(|&w| w == v).unwrap()) as u32;
            for edge in sides(7, &faces, |_| true).chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
                if let [(a, b, s), (_, _, t)] = *edge {
                    let [(f, k), (g, l)] = [s, t].map(|s| (s as usize / 3, s as usize % 3));
                    (across[f][k], across[g][l]) = (g as u32, f as u32);
                    for v in [a, b] {
                        fans.join(corner(f, v), corner(g, v));
                    }
                }
            }
            let expected: Vec<u32> = (0..7)
                .filter(|&v| {
                    let around = (0..faces.len()).filter(|&f| faces[f].contains(&v));
                    let mut roots: Vec<u32> = around.map(|f| fans.root(corner(f, v))).collect();
                    roots.sort_unstable();
                    roots.dedup();
                    roots.len() > 1
                })
                .collect();
            torn += expected.len();
            assert_eq!(pinched(7, &faces, &across), expected, "{seed}: {faces:?}");
        }
        assert!(torn > 100);
    }
}
