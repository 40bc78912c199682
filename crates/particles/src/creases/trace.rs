//! Following one crease from a point on it to where it ends.

use isoswarm_field::arrange::Arrange;
use isoswarm_field::switches::{Desk, Local, Route};
use isoswarm_field::{Aabb, FieldError, Surface};

use super::sides::{self, Shape, Side};
use super::solve::{Condition, OnCurve, Search, Solver};
use crate::vector::{V3, along, distance, dot, norm, sub};

/// Turn of the tangent in a step (radians) at which steps are made shorter, and from which on they are tried again.
const TURN: f64 = 0.08;
const MOST_TURN: f64 = 0.16;
/// Shortest step, in longest ones, before a trace gives up.
const SHORTEST: f64 = 1e-7;
/// Distance before and behind a place where a switch changes sides at which the crease is looked at, in longest steps.
const BESIDE: f64 = 1e-3;
/// Turn of the tangent or of a normal there (radians) that makes it a corner.
const KINK: f64 = 0.02;
/// Most steps of a trace.
const MOST_STEPS: usize = 1_000_000;

/// How an edge ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At a corner, where a third piece of the surface joins.
    Corner,
    /// At a face of the bounds.
    Wall,
    /// Where the angle between the sides has faded to nothing.
    Fade,
    /// Nowhere in particular: it could not be followed further.
    Lost,
}

/// A point of a crease with its sides.
#[derive(Clone, Debug)]
pub(super) struct Knot {
    pub(super) p: V3,
    /// Unit tangent, in the direction of the trace.
    pub(super) t: V3,
    /// Left and right side.
    pub(super) sides: [Side; 2],
}

impl Knot {
    /// The same for who walks the other way.
    pub(super) fn reversed(&self) -> Self {
        let [left, right] = self.sides;
        Self { p: self.p, t: self.t.map(|c| -c), sides: [right, left] }
    }
}

/// What a trace needs to know.
pub(super) struct Tracer<'a> {
    pub(super) solver: Solver<'a>,
    pub(super) surface: &'a dyn Surface,
    pub(super) bounds: Aabb,
    /// Longest step.
    pub(super) step: f64,
    /// Radius of the circle that sides are looked at on.
    pub(super) radius: f64,
    /// Angle between normals (radians) that makes a crease.
    pub(super) least: f64,
    pub(super) evaluations: u64,
    pub(super) desk: Desk,
    /// What of the function matters around the place that was last looked at.
    pub(super) near: Option<(Aabb, Route)>,
    /// Tips: creases that lead there get too narrow beside the radius to be seen before they are there.
    pub(super) tips: Vec<V3>,
}

/// Cosine between a crease and the way from its last point that can be seen to a tip, at least, where it leads there.
const AHEAD: f64 = 0.99;

/// Half the side of the box around a place in which [`Tracer::near`] serves, in longest steps.
const AROUND: f64 = 6.0;

/// One way along a crease.
pub(super) struct Way {
    /// Without the point where it starts.
    pub(super) knots: Vec<Knot>,
    /// `None` where it came back to its start.
    pub(super) end: Option<End>,
}

/// Where a step leads.
enum Step {
    /// To a point of the same crease.
    On(OnCurve, Box<Knot>),
    /// To its end, at a point or nowhere.
    End(Option<Knot>, End),
    /// Too far.
    Shorter,
}

impl Tracer<'_> {
    /// A point of F = G = 0 near `from`.
    pub(super) fn near(&mut self, from: V3, switch: u32, reach: f64) -> Option<OnCurve> {
        let inside = |b: &Aabb| (0..3).all(|a| b.lo[a] <= from[a] - reach && from[a] + reach <= b.hi[a]);
        if !self.near.as_ref().is_some_and(|(b, _)| inside(b)) {
            let half = (AROUND * self.step).max(2.0 * reach);
            let around = Aabb::new(from.map(|v| v - half), from.map(|v| v + half));
            self.near = self.solver.switches.routes(&[around]).pop().map(|r| (around, r));
        }
        let route = self.near.as_ref().map_or(&self.solver.everywhere, |(_, r)| r);
        self.solver.on_curve(&Search { route, reach }, from, switch, &mut self.desk)
    }

    /// The point as one of a crease, if it is.
    pub(super) fn knot(&mut self, p: V3, t: V3) -> Result<Option<Knot>, FieldError> {
        let shape = sides::look(self.surface, &mut self.evaluations, p, t, self.radius, self.least)?;
        Ok(match shape {
            Shape::Crease(sides) => Some(Knot { p, t, sides }),
            _ => None,
        })
    }

    /// Whether a switch other than the crease's changes across the curve at a point: no place to begin.
    pub(super) fn is_special(&self, at: &OnCurve, switch: u32) -> bool {
        at.local.switches.iter().any(|d| {
            let g = norm(d.gradient);
            d.switch != switch
                && d.value.abs() <= self.solver.tie() * g
                && dot(d.gradient, at.t).abs() > 1e-3 * g
        })
    }

    /// Follows the crease of `switch` from a point on it.
    pub(super) fn follow(&mut self, start: &OnCurve, first: &Knot, switch: u32) -> Result<Way, FieldError> {
        let mut knots: Vec<Knot> = Vec::new();
        let mut here = start.clone();
        let (mut h, mut bend) = (self.step, [0.0; 3]);
        for _ in 0..MOST_STEPS {
            let before = knots.last().unwrap_or(first).clone();
            match self.step_from(&here, &before, switch, h, bend)? {
                Step::Shorter => {
                    h *= 0.5;
                    if h < SHORTEST * self.step {
                        return Ok(self.up_to_tip(knots, before, End::Lost));
                    }
                }
                Step::End(knot, end) => {
                    // A crease that fades is followed to where it is no more.
                    if end == End::Fade && h > SHORTEST * self.step {
                        h *= 0.5;
                        continue;
                    }
                    knots.extend(knot);
                    return Ok(self.up_to_tip(knots, before, end));
                }
                Step::On(next, knot) => {
                    if !knots.is_empty() && passes(&here.p, &next.p, here.t, first) {
                        return Ok(Way { knots, end: None });
                    }
                    let went = distance(here.p, next.p);
                    bend = sub(next.t, here.t).map(|c| c / went.max(f64::MIN_POSITIVE));
                    let turn = distance(here.t, next.t);
                    h = (h * (TURN / turn.max(1e-9)).clamp(0.5, 2.0)).min(self.step);
                    knots.push(*knot);
                    here = next;
                }
            }
        }
        Ok(Way { knots, end: Some(End::Lost) })
    }

    /// The way that has come to `last` and ends; where that is nowhere, at a tip ahead.
    fn up_to_tip(&self, mut knots: Vec<Knot>, last: Knot, end: End) -> Way {
        let leads = |tip: &V3| {
            let (way, length) = (sub(*tip, last.p), distance(*tip, last.p));
            length <= self.step && dot(way, last.t) >= AHEAD * length
        };
        let tip = self.tips.iter().copied().find(leads).filter(|_| matches!(end, End::Fade | End::Lost));
        if let Some(p) = tip {
            knots.push(Knot { p, ..last });
        }
        Way { knots, end: Some(if tip.is_some() { End::Corner } else { end }) }
    }

    fn step_from(
        &mut self,
        here: &OnCurve,
        knot: &Knot,
        switch: u32,
        h: f64,
        bend: V3,
    ) -> Result<Step, FieldError> {
        let guess = along(along(here.p, h, here.t), 0.5 * h * h, bend);
        let next = self.near(guess, switch, 0.5 * h);
        let smallest = 0.5 * h < SHORTEST * self.step;
        let Some(mut next) = next else {
            // Behind a corner the switch may matter no more.
            return match self.crossings(here, guess, None, switch, h).first() {
                Some(&c) if !smallest && self.passes_over(here, c, switch) => Ok(Step::Shorter),
                Some(&c) => self.end_at(c, here, knot, switch, h),
                None if smallest => Ok(Step::End(None, End::Lost)),
                None => Ok(Step::Shorter),
            };
        };
        if dot(next.t, here.t) < 0.0 {
            next.t = next.t.map(|c| -c);
        }
        for c in self.crossings(here, next.p, Some(&next), switch, h) {
            if self.is_corner(c, here, &next, knot, switch)? {
                if !smallest && self.passes_over(here, c, switch) {
                    return Ok(Step::Shorter);
                }
                return self.end_at(c, here, knot, switch, h);
            }
        }
        if !smallest && self.dips(here, next.p, next.t, &next.local, switch) {
            return Ok(Step::Shorter);
        }
        let chord = sub(next.p, here.p);
        let straight = dot(chord, here.t) > 0.95 * norm(chord);
        if !straight || distance(next.t, here.t) > MOST_TURN {
            return Ok(if smallest { Step::End(None, End::Lost) } else { Step::Shorter });
        }
        if !self.bounds.contains(next.p) {
            return self.wall(here, &next, switch, h);
        }
        let Some(found) = self.knot(next.p, next.t)? else { return Ok(Step::End(None, End::Fade)) };
        // Sides that turn at once are other sides.
        let turned = (0..2).any(|k| distance(found.sides[k].normal, knot.sides[k].normal) > 0.5);
        if turned && !smallest {
            return Ok(Step::Shorter);
        }
        Ok(Step::On(next, Box::new(found)))
    }

    /// The places on the way to `to` where another switch changes sides, in order.
    fn crossings(&mut self, here: &OnCurve, to: V3, next: Option<&OnCurve>, switch: u32, h: f64) -> Vec<V3> {
        let tie = self.solver.tie();
        let local = match next {
            Some(next) => next.local.clone(),
            None => self.solver.local(&self.solver.everywhere, to, &mut self.desk),
        };
        let mut found: Vec<(f64, V3)> = Vec::new();
        for d in here.local.switches.iter().filter(|d| d.switch != switch) {
            let there = match local.of(d.switch) {
                Some(there) => *there,
                None => {
                    self.solver.local(&self.solver.everywhere, to, &mut self.desk);
                    self.solver.switches.difference(d.switch, &self.desk)
                }
            };
            let (a, b) = (d.value / norm(d.gradient), there.value / norm(there.gradient));
            // Equal all along, or on the same side.
            if a.is_nan() || a.abs() <= tie || (a > 0.0) == (b > tie) && (a < 0.0) == (b < -tie) {
                continue;
            }
            let part = (a / (a - b)).clamp(0.0, 1.0);
            let guess = along(here.p, part, sub(to, here.p));
            let conditions = [Condition::Switch(switch), Condition::Switch(d.switch)];
            let search = Search { route: &self.solver.everywhere, reach: h };
            let Some((c, _)) = self.solver.solve(&search, guess, &conditions, 3, &mut self.desk) else {
                continue;
            };
            let way = dot(sub(c, here.p), here.t);
            let aside = norm(sub(c, along(here.p, way, here.t)));
            if way >= -tie && way <= 1.5 * h && aside <= 0.3 * h {
                found.push((way, c));
            }
        }
        found.arrange_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|f| f.1).collect()
    }

    /// [`Tracer::dips`] on the way to a corner; there slopes are those between its sides, so the way ends just before it.
    fn passes_over(&mut self, here: &OnCurve, c: V3, switch: u32) -> bool {
        let off = (BESIDE * self.step).min(0.5 * distance(here.p, c));
        let before = along(c, -off, here.t);
        let local = self.solver.local(&self.solver.everywhere, before, &mut self.desk);
        self.dips(here, before, here.t, &local, switch)
    }

    /// Whether on the way to `p` a switch that is open on the same side at both ends seems to close and to open again: by its slope at
    /// either end it would be closed in between.
    fn dips(&self, here: &OnCurve, p: V3, t: V3, local: &Local, switch: u32) -> bool {
        let (length, tie) = (distance(here.p, p), self.solver.tie());
        here.local.switches.iter().filter(|d| d.switch != switch).any(|d| {
            let Some(there) = local.of(d.switch) else { return false };
            let open = |v: f64, g: V3| v.abs() > tie * norm(g);
            let falls = |v: f64, slope: f64| v * slope < 0.0 && v.abs() < slope.abs() * length;
            (d.value > 0.0) == (there.value > 0.0)
                && open(d.value, d.gradient)
                && open(there.value, there.gradient)
                && falls(d.value, dot(d.gradient, here.t))
                && falls(there.value, -dot(there.gradient, t))
        })
    }

    /// Whether the crease or one of its sides turns at `c`.
    fn is_corner(
        &mut self,
        c: V3,
        here: &OnCurve,
        next: &OnCurve,
        knot: &Knot,
        switch: u32,
    ) -> Result<bool, FieldError> {
        let beside = BESIDE * self.step;
        let Some(before) = self.beside(c, here.t, -beside, switch)? else { return Ok(true) };
        let Some(behind) = self.beside(c, next.t, beside, switch)? else { return Ok(true) };
        let turned = |k: usize| distance(before.sides[k].normal, behind.sides[k].normal) > KINK;
        let strange = (0..2).any(|k| distance(before.sides[k].normal, knot.sides[k].normal) > 0.5);
        Ok(distance(before.t, behind.t) > KINK || turned(0) || turned(1) || strange)
    }

    /// The crease a little way off a place on it.
    fn beside(&mut self, c: V3, t: V3, off: f64, switch: u32) -> Result<Option<Knot>, FieldError> {
        let Some(mut at) = self.near(along(c, off, t), switch, 0.5 * off.abs()) else { return Ok(None) };
        if dot(at.t, t) < 0.0 {
            at.t = at.t.map(|v| -v);
        }
        self.knot(at.p, at.t)
    }

    /// The end of a crease at a corner, with the sides that it has just before.
    fn end_at(
        &mut self,
        c: V3,
        here: &OnCurve,
        knot: &Knot,
        switch: u32,
        h: f64,
    ) -> Result<Step, FieldError> {
        let way = distance(c, here.p);
        let off = (BESIDE * self.step).min(0.5 * way);
        let before = if off > 0.0 { self.beside(c, here.t, -off, switch)? } else { None };
        if before.is_none() && off > 0.0 && h > SHORTEST * self.step {
            // The corner of another crease, which details finer than the step have brought here.
            return Ok(Step::Shorter);
        }
        let last = before.unwrap_or_else(|| knot.clone());
        if distance(last.t, here.t) > MOST_TURN && h > SHORTEST * self.step {
            return Ok(Step::Shorter);
        }
        Ok(Step::End(Some(Knot { p: c, ..last }), End::Corner))
    }

    /// The end of a crease at the face of the bounds that the step leaves through first.
    fn wall(&mut self, here: &OnCurve, next: &OnCurve, switch: u32, h: f64) -> Result<Step, FieldError> {
        let Aabb { lo, hi } = self.bounds;
        let mut first: Option<(f64, Condition)> = None;
        for a in 0..3 {
            let (from, to) = (here.p[a], next.p[a]);
            let at = if to < lo[a] { lo[a] } else { hi[a] };
            if (lo[a]..=hi[a]).contains(&to) {
                continue;
            }
            let part = ((at - from) / (to - from)).clamp(0.0, 1.0);
            if first.is_none_or(|f| part < f.0) {
                first = Some((part, Condition::Face(a, at)));
            }
        }
        let Some((part, face)) = first else { return Ok(Step::Shorter) };
        let guess = along(here.p, part, sub(next.p, here.p));
        let search = Search { route: &self.solver.everywhere, reach: h };
        let conditions = [Condition::Switch(switch), face];
        let Some((p, _)) = self.solver.solve(&search, guess, &conditions, 3, &mut self.desk) else {
            return Ok(Step::Shorter);
        };
        let Some(mut at) = self.near(p, switch, 1e-3 * h) else { return Ok(Step::Shorter) };
        if dot(at.t, here.t) < 0.0 {
            at.t = at.t.map(|c| -c);
        }
        let knot = self.knot(p, at.t)?;
        Ok(Step::End(knot, End::Wall))
    }
}

/// Whether a step from `p` to `q` comes past the point where the trace began, in the same direction.
fn passes(p: &V3, q: &V3, t: V3, first: &Knot) -> bool {
    let (chord, way) = (sub(*q, *p), sub(first.p, *p));
    let length = norm(chord);
    let part = dot(way, chord) / length;
    let aside = norm(sub(way, chord.map(|c| c * part / length)));
    part > -1e-9 * length && part <= length * (1.0 + 1e-9) && aside <= 0.1 * length && dot(t, first.t) > 0.9
}
