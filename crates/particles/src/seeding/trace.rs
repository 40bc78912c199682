//! Walks along a surface: does a way on it lead from one point to another?

use isoswarm_field::{FieldError, Surface};

use super::look;
use crate::constraint::Walls;
use crate::run::Run;
use crate::vector::{V3, along, cross, distance, dot, frame, norm, scale, sub, unit};

/// Most evaluations of a walk.
const STEPS: usize = 160;
/// Longest way, in distances between the points: a half circle is 1.6.
const WAY: f64 = 6.0;
/// Largest turn in a step (cosine), before the step is halved.
const TURN: f64 = 0.9;

/// A walk from `from` to `to` along the curve in which a plane through both cuts the surface.
struct Walk {
    pair: usize,
    to: V3,
    to_normal: V3,
    /// Unit normal of the plane, with the sign that makes its cross product with ∇F lead ahead.
    plane: V3,
    /// Last place that is accepted, and the unit tangent there.
    at: V3,
    tangent: V3,
    step: f64,
    length: f64,
    longest: f64,
}

/// Which of the pairs of points ((position, unit normal) both on the surface) are connected by a way of moderate
/// length. All walks advance together, so the field is evaluated for many points at a time.
pub(crate) fn connected(
    surface: &dyn Surface,
    run: &mut Run<'_>,
    walls: &Walls,
    pairs: &[[(V3, V3); 2]],
) -> Result<Vec<bool>, FieldError> {
    let mut linked = vec![false; pairs.len()];
    let mut walks: Vec<Walk> = pairs.iter().enumerate().flat_map(|(i, p)| start(i, *p, walls.axes)).collect();
    let (mut value, mut gradient) = (Vec::new(), Vec::new());
    for _ in 0..STEPS {
        walks.retain(|w| !linked[w.pair]);
        if walks.is_empty() {
            break;
        }
        // Predict, then correct twice within the plane.
        let mut place: Vec<V3> = walks.iter().map(|w| along(w.at, w.step, w.tangent)).collect();
        let mut ahead = Vec::new();
        for round in 0..2 {
            look(surface, run, &within(walls, &place), &mut value, &mut gradient)?;
            if round == 0 {
                ahead.clone_from(&gradient);
            }
            for (k, w) in walks.iter().enumerate() {
                let g = in_plane(gradient[k], w.plane);
                let move_by = -value[k] / dot(g, g);
                // Where the gradient vanishes there is no way to correct: the step will not pass for smooth.
                if move_by.is_finite() {
                    let step = scale(g, move_by);
                    let short = (w.step / norm(step)).min(1.0);
                    place[k] = along(place[k], short, step);
                }
            }
        }
        look(surface, run, &within(walls, &place), &mut value, &mut gradient)?;
        let mut next = Vec::with_capacity(walks.len());
        for (k, w) in walks.into_iter().enumerate() {
            if let Some(w) = advance(w, place[k], value[k], gradient[k], ahead[k], walls, &mut linked) {
                next.push(w);
            }
        }
        walks = next;
    }
    Ok(linked)
}

fn in_plane(g: V3, plane: V3) -> V3 {
    along(g, -dot(g, plane), plane)
}

fn start(pair: usize, [(p, n), (q, m)]: [(V3, V3); 2], axes: usize) -> Vec<Walk> {
    let d = distance(p, q);
    if d == 0.0 {
        return Vec::new();
    }
    let mut plane = if axes == 2 { [0.0, 0.0, 1.0] } else { unit(cross(n, sub(q, p))) };
    if axes == 3 && norm(cross(n, sub(q, p))) < 1e-3 * d {
        plane = frame(n).0;
    }
    [1.0, -1.0]
        .into_iter()
        .map(|s| Walk {
            pair,
            to: q,
            to_normal: m,
            plane: scale(plane, s),
            at: p,
            tangent: unit(cross(scale(plane, s), n)),
            step: d / 4.0,
            length: 0.0,
            longest: WAY * d,
        })
        .collect()
}

/// The places, or the nearest within the walls: nothing is known of F beyond.
fn within(walls: &Walls, places: &[V3]) -> Vec<V3> {
    places.iter().map(|p| walls.clamp(*p)).collect()
}

/// Accepts the step, or halves it; `None` ends the walk. `g` is the gradient at the place, `ahead` the one at the end
/// of the step before it was corrected.
fn advance(
    mut w: Walk,
    place: V3,
    value: f64,
    g: V3,
    ahead: V3,
    walls: &Walls,
    linked: &mut [bool],
) -> Option<Walk> {
    let g = in_plane(g, w.plane);
    let normal = unit(g);
    let mut tangent = cross(w.plane, normal);
    let moved = distance(place, w.at);
    let smooth = dot(tangent, w.tangent) > TURN
        && value.abs() <= 0.02 * w.step * norm(g)
        && moved > 0.3 * w.step
        && moved < 2.0 * w.step;
    if !smooth {
        w.step *= 0.5;
        // At a crease no step is smooth: step over it once it is short. On the crease itself the gradient may be that
        // of either side; beyond it there is no doubt.
        let over = w.step < 2e-3 * w.longest / WAY && value.abs() <= 0.1 * w.step * norm(g);
        if !over {
            return (w.step > 1e-5 * w.longest / WAY && normal != [0.0; 3]).then_some(w);
        }
        tangent = cross(w.plane, unit(in_plane(ahead, w.plane)));
        w.length += w.step;
    }
    w.length += moved;
    // The target lies on this step's stretch of the curve.
    let near = distance(place, w.to).min(distance(w.at, w.to));
    if near <= 0.75 * moved.max(w.step) && dot(unit(in_plane(w.to_normal, w.plane)), normal) > 0.3 {
        linked[w.pair] = true;
        return None;
    }
    w.at = place;
    w.tangent = tangent;
    w.step = (w.step * 1.5).min(w.longest / WAY / 4.0);
    let inside = (0..walls.axes).all(|a| place[a] >= walls.lo[a] && place[a] <= walls.hi[a]);
    (w.length < w.longest && inside).then_some(w)
}
