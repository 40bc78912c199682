//! More points on creases, where the segments between them are too far off.

use isoswarm_field::{Aabb, Surface};

use super::trace::{Knot, Tracer};
use super::{ANGLE, Creases};
use crate::Error;
use crate::vector::{V3, distance, dot, sub};

/// Most halvings of a segment.
const HALVINGS: u32 = 16;
/// How far the middle of a segment may be from its crease, in lengths of the segment: that of a half circle.
const FAR: f64 = 0.5;

/// What [`refine`] has done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finer {
    /// Numbers of the ends of each segment that was split, when it was, and of the new point between them.
    pub splits: Vec<[u32; 3]>,
    /// Points at which the field was evaluated.
    pub evaluations: u64,
}

/// Puts points on the creases of F = 0, found in `bounds`, between points that are there, until no middle of a segment is farther than
/// `most` from its crease. What cannot be followed stays as it is.
///
/// # Errors
/// Whatever the field reports.
///
/// ```
/// use isoswarm_field::{Aabb, Field, text};
/// use isoswarm_particles::creases::{CreaseOptions, creases, refine};
/// let balls = Field::new(&text::parse("min((x-0.6)^2 + y^2 + z^2 - 1, (x+0.6)^2 + y^2 + z^2 - 1)", &[])?)?;
/// let bounds = Aabb::new([-1.8; 3], [1.8; 3]);
/// let mut found = creases(&balls, &bounds, CreaseOptions::new(0.5))?;
/// let before = found.points.len();
/// // Segments of a circle of radius .8: twice as many are a quarter as far off.
/// let done = refine(&balls, &bounds, &mut found, 0.02)?;
/// assert_eq!((done.splits.len(), found.points.len()), (before, 2 * before));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn refine(
    surface: &dyn Surface,
    bounds: &Aabb,
    creases: &mut Creases,
    most: f64,
) -> Result<Finer, Error> {
    let mut out = Finer::default();
    let Some(switches) = surface.switches() else { return Ok(out) };
    let Creases { points, edges, .. } = creases;
    let longest = edges
        .iter()
        .flat_map(|e| e.segments())
        .map(|[a, b]| distance(points[a as usize], points[b as usize]))
        .fold(0.0, f64::max);
    let mut tracer = Tracer::new(surface, &switches, bounds, longest, ANGLE);
    for edge in edges {
        let (numbers, normals) = (std::mem::take(&mut edge.points), std::mem::take(&mut edge.normals));
        let n = numbers.len();
        let Some(&first) = numbers.first() else { continue };
        edge.points.push(first);
        edge.normals.push(normals[0]);
        let mut from = first;
        for k in 1..n + usize::from(edge.closed) {
            // Points still to be reached, the next one last, and how often their segments were halved.
            let mut ahead = vec![(numbers[k % n], normals[k % n], 0)];
            while let Some((to, sides, halved)) = ahead.pop() {
                let ends = [points[from as usize], points[to as usize]];
                let knot = match halved {
                    HALVINGS => None,
                    _ => between(&mut tracer, edge.switch, ends, most)?,
                };
                if let Some(knot) = knot {
                    let new = points.len() as u32;
                    points.push(knot.p);
                    out.splits.push([from, to, new]);
                    ahead.push((to, sides, halved + 1));
                    ahead.push((new, knot.sides.map(|s| s.normal), halved + 1));
                    continue;
                }
                if k < n || to != first {
                    edge.points.push(to);
                    edge.normals.push(sides);
                }
                from = to;
            }
        }
    }
    out.evaluations = tracer.evaluations;
    Ok(out)
}

/// The point of a crease next to the middle of a segment, if that is farther than `most` from it.
fn between(tracer: &mut Tracer<'_>, switch: u32, [p, q]: [V3; 2], most: f64) -> Result<Option<Knot>, Error> {
    let (way, length) = (sub(q, p), distance(p, q));
    let middle = [0, 1, 2].map(|a| 0.5 * p[a] + 0.5 * q[a]);
    let Some(at) = tracer.near(middle, switch, FAR * length) else { return Ok(None) };
    if distance(at.p, middle) <= most {
        return Ok(None);
    }
    let t = if dot(at.t, way) < 0.0 { at.t.map(|c| -c) } else { at.t };
    Ok(tracer.knot(at.p, t)?)
}
