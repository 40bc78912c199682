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

#[cfg(test)]
mod tests {
    use super::*;

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
}
