//! All critical points of a height function on F = 0 in a box, by branch and prune with Krawczyk's operator.
//!
//! A box is dropped where one of the equations F = 0, ∇F·u = 0, ∇F·v = 0 surely has no solution in it. Where Krawczyk's
//! operator maps a box into itself there is exactly one solution, and it is not degenerate. A singular point of the
//! surface solves the equations whatever the direction, and its Jacobian is singular: what remains of the boxes there is
//! never proven, so that a proof says that the surface is smooth, too.

use isoswarm_field::vector::V3;
use isoswarm_field::{Aabb, FieldError, Interval, Regularity};
use rayon::prelude::*;

use super::Budget;
use super::system::{I3, M3, System, at, centre, inner, mean_value, meet, point};

/// A critical point, proven to be the only one in its domain.
#[derive(Clone, Debug)]
pub(super) struct Critical {
    /// A tiny box that contains it.
    pub(super) at: Aabb,
    /// A box in which it is the only one.
    domain: Aabb,
    /// Number of directions in which the height falls: 0 at a minimum, 1 at a saddle, 2 at a maximum.
    pub(super) index: u8,
}

impl Critical {
    /// (-1)^index
    pub(super) fn sign(&self) -> i64 {
        if self.index == 1 { -1 } else { 1 }
    }
}

/// What the search came to.
pub(super) struct Found {
    pub(super) points: Vec<Critical>,
    /// Boxes about which nothing could be proven.
    pub(super) doubtful: Vec<Aabb>,
    /// Whether there were too few boxes.
    pub(super) exhausted: bool,
}

/// Boxes narrower than this part of the whole are given up.
const NARROWEST: f64 = 1e-9;
/// The same at kinks, where nothing can be proven but that there is no critical point.
const NARROWEST_AT_KINKS: f64 = 1e-3;
/// How far a box is grown before Krawczyk's operator is tried, in parts of its width: solutions on the boundary of two
/// boxes are found in both.
const MARGIN: f64 = 0.125;
/// A box that the operator does not narrow to this part of its width is divided.
const WORTHWHILE: f64 = 0.6;
/// Boxes in doubt that end the search.
const MOST_DOUBTS: usize = 300;

enum Outcome {
    Empty,
    Unique(Critical),
    Parts(Vec<Aabb>),
    Doubtful,
}

/// Searches the box, looking at `most` boxes or fewer.
pub(super) fn search(
    system: &System<'_>,
    bounds: &Aabb,
    most: usize,
    budget: &mut Budget<'_>,
) -> Result<Found, FieldError> {
    let narrowest = NARROWEST * bounds.diagonal();
    let mut found = Found { points: Vec::new(), doubtful: Vec::new(), exhausted: false };
    let mut left = most;
    let mut level = vec![*bounds];
    while !level.is_empty() {
        found.exhausted = level.len() > left || !budget.spend(level.len());
        if found.exhausted || found.doubtful.len() > MOST_DOUBTS {
            found.doubtful.extend(level);
            break;
        }
        left -= level.len();
        let outcomes: Vec<Outcome> = level
            .par_iter()
            .with_min_len(16)
            .map(|b| examine(system, b, bounds, narrowest))
            .collect::<Result<_, FieldError>>()?;
        let mut next = Vec::new();
        for (b, outcome) in level.iter().zip(outcomes) {
            match outcome {
                Outcome::Empty => {}
                Outcome::Parts(parts) => next.extend(parts),
                Outcome::Doubtful => found.doubtful.push(*b),
                Outcome::Unique(c) => add(&mut found, c),
            }
        }
        level = next;
    }
    Ok(found)
}

/// Adds a point unless it was found before.
fn add(found: &mut Found, new: Critical) {
    for old in &found.points {
        if inside(&new.at, &old.domain) || inside(&old.at, &new.domain) {
            return;
        }
        if touch(&new.at, &old.at) {
            // Neither the same for sure nor another.
            found.doubtful.push(new.at);
            return;
        }
    }
    found.points.push(new);
}

/// Whether one box contains the other.
fn inside(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| b.lo[k] <= a.lo[k] && a.hi[k] <= b.hi[k])
}

/// Whether two boxes share a point.
pub(super) fn touch(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k])
}

fn examine(system: &System<'_>, b: &Aabb, bounds: &Aabb, narrowest: f64) -> Result<Outcome, FieldError> {
    let value = system.value(b)?;
    if !value.has_zero() {
        return Ok(Outcome::Empty);
    }
    let width = (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max);
    let give_up = width < narrowest;
    let undecided = || if give_up { Outcome::Doubtful } else { Outcome::Parts(halves(b, None)) };
    let wide = grown(b);
    let regularity = system.regularity(&wide)?;
    if regularity == Regularity::Broken {
        return Ok(undecided());
    }
    // A direction along which F grows or falls strictly makes the surface a graph over the plane across it, and the height
    // a coordinate there, at kinks as well: no critical point.
    let gradient = system.gradient(b)?;
    let f = system.equations(value, &gradient);
    let c = centre(b);
    let value_here = system.value(&at(c))?;
    if f.iter().any(|f| !f.has_zero()) || !mean_value(value_here, &gradient, b, c).has_zero() {
        return Ok(Outcome::Empty);
    }
    if regularity == Regularity::Kinked {
        let narrow = width < narrowest / NARROWEST * NARROWEST_AT_KINKS;
        return Ok(if narrow { Outcome::Doubtful } else { Outcome::Parts(halves(b, None)) });
    }
    let hessian = system.hessian(&wide)?;
    if hessian.iter().flatten().any(|h| !h.magnitude().is_finite()) {
        return Ok(undecided());
    }
    let jacobian = system.jacobian(system.gradient(&wide)?, &hessian);
    let here = system.equations(value_here, &system.gradient(&at(c))?);
    // The second and third equation by the mean value theorem.
    if (1..3).any(|k| !mean_value(here[k], &jacobian[k], b, c).has_zero()) {
        return Ok(Outcome::Empty);
    }
    let Some(k) = krawczyk(&jacobian, &here, &wide, c) else {
        return Ok(if give_up { Outcome::Doubtful } else { Outcome::Parts(halves(b, Some(&jacobian))) });
    };
    let narrowed = intersection(&k, b);
    let Some(narrowed) = narrowed else { return Ok(Outcome::Empty) };
    let strictly = (0..3).all(|a| wide.lo[a] < k[a].lo && k[a].hi < wide.hi[a]);
    if strictly {
        let tight = tighten(system, Aabb::new(k.map(|v| v.lo), k.map(|v| v.hi)))?;
        if !touch(&tight, b) || !touch(&tight, bounds) {
            return Ok(Outcome::Empty);
        }
        return Ok(match index(system, &tight)? {
            Some(index) => Outcome::Unique(Critical { at: tight, domain: wide, index }),
            None => Outcome::Doubtful,
        });
    }
    if give_up {
        return Ok(Outcome::Doubtful);
    }
    let shrunk = (0..3).map(|a| (narrowed.hi[a] - narrowed.lo[a]) / (b.hi[a] - b.lo[a])).fold(1.0, f64::min);
    Ok(Outcome::Parts(if shrunk < WORTHWHILE { vec![narrowed] } else { halves(&narrowed, Some(&jacobian)) }))
}

/// The box with its margin.
fn grown(b: &Aabb) -> Aabb {
    let margin = [0, 1, 2].map(|a| MARGIN * (b.hi[a] - b.lo[a]) + 1e-300);
    Aabb::new([0, 1, 2].map(|a| b.lo[a] - margin[a]), [0, 1, 2].map(|a| b.hi[a] + margin[a]))
}

fn intersection(k: &I3, b: &Aabb) -> Option<Aabb> {
    let mut out = *b;
    for a in 0..3 {
        let m = meet(k[a], Interval::new(b.lo[a], b.hi[a]))?;
        (out.lo[a], out.hi[a]) = (m.lo, m.hi);
    }
    Some(out)
}

/// The halves of a box across the axis along which the equations change most, or across its longest.
fn halves(b: &Aabb, jacobian: Option<&M3>) -> Vec<Aabb> {
    let width = |a: usize| b.hi[a] - b.lo[a];
    let smear = |a: usize| match jacobian {
        None => width(a),
        Some(j) => j
            .iter()
            .map(|row| {
                let all: f64 = (0..3).map(|k| row[k].magnitude() * width(k)).sum();
                if all > 0.0 { row[a].magnitude() * width(a) / all } else { 0.0 }
            })
            .fold(0.0, f64::max),
    };
    let mut axis = (0..3).max_by(|&i, &j| smear(i).total_cmp(&smear(j))).unwrap_or(0);
    let longest = (0..3).max_by(|&i, &j| width(i).total_cmp(&width(j))).unwrap_or(0);
    if width(axis) < 1e-3 * width(longest) {
        axis = longest;
    }
    let middle = 0.5 * b.lo[axis] + 0.5 * b.hi[axis];
    let (mut low, mut high) = (*b, *b);
    low.hi[axis] = middle;
    high.lo[axis] = middle;
    vec![low, high]
}

/// Inverse of a matrix of numbers.
fn inverse(m: &[V3; 3]) -> Option<[V3; 3]> {
    use isoswarm_field::vector::{cross, dot, scale};
    let (a, b, c) = (cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    let det = dot(m[0], a);
    if !(det.is_finite() && det != 0.0) {
        return None;
    }
    let columns = [a, b, c].map(|v| scale(v, 1.0 / det));
    let out = [0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i]]);
    out.iter().flatten().all(|v| v.is_finite()).then_some(out)
}

/// Krawczyk's operator over `b` (Moore, Kearfott, Cloud, "Introduction to Interval Analysis", 8.2): contains every solution
/// in b; where it lies inside b there is exactly one. `None` where the Jacobian's middle has no inverse.
fn krawczyk(jacobian: &M3, at_centre: &I3, b: &Aabb, c: V3) -> Option<I3> {
    let middle = jacobian.map(|row| row.map(|v| 0.5 * v.lo + 0.5 * v.hi));
    let y = inverse(&middle)?;
    let mut out = [Interval::ZERO; 3];
    for i in 0..3 {
        let mut k = point(c[i]) - inner(y[i], at_centre);
        for j in 0..3 {
            let column = [jacobian[0][j], jacobian[1][j], jacobian[2][j]];
            let one = if i == j { point(1.0) } else { Interval::ZERO };
            k = k + (one - inner(y[i], &column)) * (Interval::new(b.lo[j], b.hi[j]) - point(c[j]));
        }
        out[i] = k;
    }
    Some(out)
}

/// Narrows a box with exactly one solution.
fn tighten(system: &System<'_>, mut b: Aabb) -> Result<Aabb, FieldError> {
    for _ in 0..12 {
        let c = centre(&b);
        let jacobian = system.jacobian(system.gradient(&b)?, &system.hessian(&b)?);
        let here = system.equations(system.value(&at(c))?, &system.gradient(&at(c))?);
        let Some(next) = krawczyk(&jacobian, &here, &b, c).and_then(|k| intersection(&k, &b)) else { break };
        let progress = (0..3).any(|a| next.hi[a] - next.lo[a] < 0.5 * (b.hi[a] - b.lo[a]));
        b = next;
        if !progress {
            break;
        }
    }
    Ok(b)
}

/// The index of the only critical point in the box, where that can be told.
fn index(system: &System<'_>, b: &Aabb) -> Result<Option<u8>, FieldError> {
    let rise = inner(system.h, &system.gradient(b)?);
    let hessian = system.hessian(b)?;
    let times = |w: V3| [0, 1, 2].map(|i| inner(w, &hessian[i]));
    let (hu, hv) = (times(system.u), times(system.v));
    let (uu, uv, vv) = (inner(system.u, &hu), inner(system.u, &hv), inner(system.v, &hv));
    let det = uu * vv - uv * uv;
    if rise.has_zero() || det.has_zero() {
        return Ok(None);
    }
    if det.hi < 0.0 {
        return Ok(Some(1));
    }
    // The height over the tangent plane bends like -F_uu / F_h.
    let bend = -(uu / rise);
    Ok(if bend.has_zero() { None } else { Some(if bend.lo > 0.0 { 0 } else { 2 }) })
}
