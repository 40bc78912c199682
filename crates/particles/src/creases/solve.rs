//! Newton's method onto creases: least steps to where F and one or two differences of switches are 0.

use isoswarm_field::switches::{Desk, Local, Route, Switches};

use crate::vector::{V3, along, cross, distance, dot, norm, scale, sub, unit};

/// Rounds of Newton's method.
const ROUNDS: usize = 40;
/// Sine between a gradient and the span of the others from which on up it counts as independent.
const INDEPENDENT: f64 = 1e-5;
/// What is left of a step, over the scale of the coordinates, that counts as rounding.
const ROUNDING: f64 = 1e-15;
/// The same for what may be left where rounding is worse.
const SLOPPY: f64 = 1e-11;
/// Distance, over the scale, within which the sides of a switch count as equal.
const TIED: f64 = 1e-9;

/// What is 0 on a set besides F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Condition {
    /// The difference of this switch.
    Switch(u32),
    /// The distance from a face of the bounds: axis and coordinate.
    Face(usize, f64),
}

/// A point on F = G = 0.
#[derive(Clone, Debug)]
pub(super) struct OnCurve {
    pub(super) p: V3,
    /// Unit tangent of the curve.
    pub(super) t: V3,
    /// The switches there.
    pub(super) local: Local,
}

/// Finds points of creases of one function.
pub(super) struct Solver<'a> {
    pub(super) switches: &'a Switches<'a>,
    pub(super) everywhere: Route,
    /// Size of the coordinates, which rounding is relative to.
    pub(super) scale: f64,
}

/// Where a search may go and with what.
pub(super) struct Search<'r> {
    pub(super) route: &'r Route,
    /// It fails beyond this distance from where it starts.
    pub(super) reach: f64,
}

impl<'a> Solver<'a> {
    pub(super) fn new(switches: &'a Switches<'a>, scale: f64) -> Self {
        Self { switches, everywhere: switches.everywhere(), scale }
    }

    /// Distance within which the sides of a switch count as equal.
    pub(super) fn tie(&self) -> f64 {
        TIED * self.scale
    }

    /// F and the switches that matter at a point.
    pub(super) fn local(&self, route: &Route, p: V3, desk: &mut Desk) -> Local {
        let mut local = Local::default();
        self.switches.at(route, p, self.tie(), desk, &mut local);
        local
    }

    /// The point near `from` where F and all conditions are 0, of which with F `rank` are independent; and a basis of the
    /// span of their gradients.
    pub(super) fn solve(
        &self,
        search: &Search<'_>,
        from: V3,
        conditions: &[Condition],
        rank: usize,
        desk: &mut Desk,
    ) -> Option<(V3, Vec<V3>)> {
        let (mut p, mut last) = (from, f64::INFINITY);
        let mut local = Local::default();
        let mut rows = Vec::with_capacity(conditions.len() + 1);
        for round in 0..ROUNDS {
            self.switches.at(search.route, p, self.tie(), desk, &mut local);
            rows.clear();
            rows.push((local.value, local.gradient));
            for c in conditions {
                rows.push(match *c {
                    Condition::Switch(s) => {
                        let d = self.switches.difference(s, desk);
                        (d.value, d.gradient)
                    }
                    Condition::Face(a, at) => (p[a] - at, [0, 1, 2].map(|b| f64::from(u8::from(a == b)))),
                });
            }
            let (step, basis) = least_step(&rows)?;
            let length = norm(step);
            if basis.len() != rank || !length.is_finite() {
                return None;
            }
            let longest = 0.5 * search.reach;
            p = along(p, if length > longest { longest / length } else { 1.0 }, step);
            let away = distance(p, from);
            if away.is_nan() || away > search.reach {
                return None;
            }
            let rounded = length <= ROUNDING * self.scale;
            // Steps that no longer shrink are rounding, too.
            let stalls = round > 2 && length <= SLOPPY * self.scale && length >= 0.5 * last;
            if rounded || stalls {
                return Some((p, basis));
            }
            last = length;
        }
        None
    }

    /// The point of F = G = 0 near `from`, where the switch matters.
    pub(super) fn on_curve(
        &self,
        search: &Search<'_>,
        from: V3,
        switch: u32,
        desk: &mut Desk,
    ) -> Option<OnCurve> {
        let (p, basis) = self.solve(search, from, &[Condition::Switch(switch)], 2, desk)?;
        let local = self.local(search.route, p, desk);
        local.of(switch)?;
        let t = unit(cross(basis[0], basis[1]));
        (t != [0.0; 3]).then_some(OnCurve { p, t, local })
    }
}

/// The shortest step that takes all rows (value, gradient) to 0 in first order, and an orthonormal basis of the span of the
/// gradients. Gradients in the span of others are left out: their rows follow.
fn least_step(rows: &[(f64, V3)]) -> Option<(V3, Vec<V3>)> {
    let mut left: Vec<(f64, V3)> = Vec::with_capacity(rows.len());
    for &(value, gradient) in rows {
        let length = norm(gradient);
        if !(length > 0.0 && length.is_finite() && value.is_finite()) {
            return None;
        }
        left.push((value / length, scale(gradient, 1.0 / length)));
    }
    // Modified Gram-Schmidt; each row's value is what the part of the step along the basis so far leaves of it.
    let (mut step, mut basis) = ([0.0; 3], Vec::with_capacity(3));
    while basis.len() < 3 {
        let best =
            (0..left.len()).max_by(|&a, &b| norm(left[a].1).total_cmp(&norm(left[b].1)).then(b.cmp(&a)))?;
        let (value, rest) = left[best];
        let length = norm(rest);
        if length < INDEPENDENT {
            break;
        }
        let q = scale(rest, 1.0 / length);
        let y = -value / length;
        step = along(step, y, q);
        for (value, rest) in &mut left {
            let part = dot(*rest, q);
            *value += part * y;
            *rest = sub(*rest, scale(q, part));
        }
        basis.push(q);
    }
    Some((step, basis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_solve_their_rows_and_are_shortest() {
        let rows = [(0.3, [1.0, 2.0, -0.5]), (-0.2, [0.1, 4.0, 0.9])];
        let (step, basis) = least_step(&rows).unwrap();
        for (value, gradient) in rows {
            assert!((value + dot(gradient, step)).abs() < 1e-14);
        }
        assert_eq!(basis.len(), 2);
        assert!(dot(step, cross(basis[0], basis[1])).abs() < 1e-15);
        // A third row that follows from the two changes nothing.
        let third = (0.1, [1.1, 6.0, 0.4]);
        let (same, basis) = least_step(&[rows[0], rows[1], third]).unwrap();
        assert!(distance(step, same) < 1e-14 && basis.len() == 2);
    }
}
