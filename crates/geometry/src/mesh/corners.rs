//! Where the surface passes through the edges of the bounds: the corners of its boundary.

use isoswarm_field::vector::{V3, distance, unit};
use isoswarm_field::{Aabb, FieldError, Surface};

use super::vertices::Vertices;

/// Intervals along an edge in which a root is looked for.
const FEWEST: f64 = 16.0;
const MOST: f64 = 4096.0;
/// Halvings of an interval: down to the last bits.
const HALVINGS: usize = 54;
/// Samples closer to a corner than this part of their spacing give way to it.
const NEAR: f64 = 0.6;

/// Puts a vertex on every corner and removes those too close to one. Gives how many came and went.
pub(super) fn place(
    surface: &dyn Surface,
    bounds: &Aabb,
    vertices: &mut Vertices,
) -> Result<(usize, usize), FieldError> {
    if vertices.faces.iter().all(|f| *f == 0) {
        return Ok((0, 0));
    }
    let spacing = vertices.mean();
    let found = find(surface, bounds, spacing)?;
    let before = vertices.len();
    let points = vertices.points.clone();
    let spacings = vertices.spacing.clone();
    let on_crease: Vec<bool> = (0..before).map(|i| vertices.on_crease(i)).collect();
    vertices
        .retain(|i| on_crease[i] || found.iter().all(|(c, _)| distance(points[i], *c) > NEAR * spacings[i]));
    let gone = before - vertices.len();
    let (mut value, mut gradient) = (vec![0.0; found.len()], vec![[0.0; 3]; found.len()]);
    let places: Vec<V3> = found.iter().map(|f| f.0).collect();
    surface.value_gradient(&places, &mut value, &mut gradient)?;
    for ((p, faces), g) in found.iter().zip(gradient) {
        vertices.push(*p, unit(g), spacing, *faces);
    }
    Ok((found.len(), gone))
}

/// The roots of F on the twelve edges, with the axes of the two faces as bits.
fn find(surface: &dyn Surface, bounds: &Aabb, spacing: f64) -> Result<Vec<(V3, u8)>, FieldError> {
    let mut spans: Vec<(V3, V3, u8)> = Vec::new();
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let m = (2.0 * (bounds.hi[axis] - bounds.lo[axis]) / spacing).clamp(FEWEST, MOST).ceil();
        for side in 0..4 {
            let at = |k: f64| {
                let mut p = [0.0; 3];
                p[axis] = if k >= m {
                    bounds.hi[axis]
                } else {
                    bounds.lo[axis] + (bounds.hi[axis] - bounds.lo[axis]) * (k / m)
                };
                p[b] = if side & 1 == 0 { bounds.lo[b] } else { bounds.hi[b] };
                p[c] = if side & 2 == 0 { bounds.lo[c] } else { bounds.hi[c] };
                p
            };
            for k in 0..m as usize {
                spans.push((at(k as f64), at(k as f64 + 1.0), 1 << b | 1 << c));
            }
        }
    }
    let values = |points: &[V3]| -> Result<Vec<f64>, FieldError> {
        let (mut value, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        surface.value_gradient(points, &mut value, &mut gradient)?;
        Ok(value)
    };
    let ends: Vec<V3> = spans.iter().flat_map(|s| [s.0, s.1]).collect();
    let value = values(&ends)?;
    let mut low: Vec<(V3, V3, u8, bool)> = Vec::new();
    for (s, v) in spans.iter().zip(value.chunks_exact(2)) {
        if (v[0] < 0.0) != (v[1] < 0.0) && v[0].is_finite() && v[1].is_finite() {
            low.push((s.0, s.1, s.2, v[0] < 0.0));
        }
    }
    for _ in 0..HALVINGS {
        let middle: Vec<V3> = low.iter().map(|s| [0, 1, 2].map(|a| 0.5 * s.0[a] + 0.5 * s.1[a])).collect();
        for ((s, m), v) in low.iter_mut().zip(&middle).zip(values(&middle)?) {
            if (v < 0.0) == s.3 {
                s.0 = *m;
            } else {
                s.1 = *m;
            }
        }
    }
    Ok(low.into_iter().map(|s| (s.1, s.2)).collect())
}
