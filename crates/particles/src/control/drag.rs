//! One step of the control points, in the order of WH94 section 5.

use isoswarm_field::{FieldError, Parametric, SparseRows};

use super::pin::Pin;
use super::solve::{Change, Known, Rows, System, Wanted, constrained};
use crate::Error;
use crate::vector::{V3, along, dot, norm, scale, sub};

/// Part of a row below which it depends on the others. Two pins nearer to each other than this part of the
/// model's size act as one.
const RANK_TOLERANCE: f64 = 1e-6;
/// Feedback corrections after a step, with the same derivatives.
const CORRECTIONS: usize = 6;
/// Pins that are not dragged rest where they are off the surface by no more than this part of the tolerance: that is rounding.
const AT_REST: f64 = 1e-3;
/// What is tried, one after the other, until the surface does what its derivatives promise: the part of the step, and how much pins
/// may be missed for the sake of a smaller change (a part of the longest row; what is missed is made up for by later steps). Pins that
/// all but depend on each other ask for enormous changes: for them a shorter step is as bad, a damped one is not.
const TRIALS: [(f64, f64); 11] = [
    (1.0, 0.0),
    (0.5, 0.0),
    (1.0, 1e-3),
    (0.5, 1e-2),
    (0.5, 3e-2),
    (0.25, 0.1),
    (0.125, 0.1),
    (0.03, 0.1),
    (0.01, 0.1),
    (0.003, 0.1),
    (0.001, 0.1),
];
/// A held pin may be off by this part of the step while a drag is under way, before corrections.
const LOOSE: f64 = 0.02;
/// A lower limit below this stands for "above 0".
const SMALLEST: f64 = 1e-300;
/// Held pins farther off than so many tolerances were not met before, and need only be met better: by this part of what a
/// step aims at.
const UNMET: f64 = 100.0;
const ENOUGH: f64 = 0.3;
/// Newton steps that bring a pin back onto the surface where the surface does not follow it.
const LANDINGS: usize = 8;

/// How far and how exactly; lengths in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOptions {
    /// Longest way of a pin in a step.
    pub longest: f64,
    /// Part of the way to its target that a dragged pin goes in a step, above 0 to 1: a spring between the pin and
    /// the hand (WH94 section 5).
    pub gain: f64,
    /// Distance within which pins hold.
    pub tolerance: f64,
}

/// What a step of the control points did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlStep {
    /// Change of the parameters.
    pub q_change: Vec<f64>,
    /// Pins that are met independently of each other.
    pub rank: usize,
    /// |F|/|∇F| at each pin's place (a length; infinite where F has no gradient).
    pub residual: Vec<f64>,
    /// How far each pin has moved over the surface instead of with it (a tangential vector, model units).
    pub slip: Vec<[f64; 3]>,
    /// Longest way of a dragged pin towards its target (model units).
    pub moved: f64,
    /// Parameters at a limit that wanted to go beyond: their numbers in q.
    pub at_limit: Vec<usize>,
    /// How often the step was tried again, shorter or damped.
    pub retries: usize,
    /// Nothing could move.
    pub stuck: bool,
}

/// One step: the pins' desired motion, the parameters' change that follows (WH94 eqs. 6 to 8) and the pins' new places.
///
/// Held pins stay within the tolerance of the surface or, where they contradict each other, as near as weighted least squares
/// can; dragged pins go as far as the surface follows. `metric` is the cost of a unit change of each parameter (see
/// [`super::sensitivity`]), `desired` the change that is wanted where the pins do not care (Q, eq. 6; empty: none).
///
/// # Errors
/// Pins that make no sense and what the field reports; the surface and the pins then are as they were.
pub fn step(
    surface: &mut dyn Parametric,
    pins: &mut [Pin],
    metric: &[f64],
    desired: &[f64],
    options: &StepOptions,
) -> Result<ControlStep, Error> {
    pins.iter().try_for_each(Pin::check)?;
    let q = surface.q();
    let before = pins.to_vec();
    let result = attempt(surface, pins, metric, desired, options, &q);
    if result.is_err() {
        pins.copy_from_slice(&before);
        surface.set_q(&q)?;
    }
    result
}

fn attempt(
    surface: &mut dyn Parametric,
    pins: &mut [Pin],
    metric: &[f64],
    desired: &[f64],
    options: &StepOptions,
    q: &[f64],
) -> Result<ControlStep, Error> {
    let (n, m) = (pins.len(), q.len());
    let none = vec![0.0; m];
    let desired = if desired.is_empty() { &none } else { desired };
    let places: Vec<V3> = pins.iter().map(|p| p.at).collect();
    let rows = differentiate(surface, &places)?;
    let least = negligible(&rows.gradient);
    let metric = &effective(&rows, metric, &surface.scales(), least, options.tolerance)[..];
    let off: Vec<f64> = (0..n).map(|i| distance_of(rows.value[i], rows.gradient[i], least)).collect();
    let rests = |i: usize| pins[i].target.is_none() && off[i] <= AT_REST * options.tolerance;
    if desired.iter().all(|d| *d == 0.0) && (0..n).all(rests) {
        // Nothing wants to move: not a bit of q changes.
        return Ok(unmoved(&rows, pins, metric, off, least));
    }
    let wishes = wishes(pins, options);
    let limits = surface.limits();
    let room: Vec<(f64, f64)> = limits.iter().zip(q).map(|(&l, &q)| room(l, q)).collect();
    let squared = |i: usize| {
        let wanted = rows.value[i] + dot(rows.gradient[i], wishes[i]);
        distance_of(wanted, rows.gradient[i], least).powi(2)
    };
    let exact = (0..n).filter(|&i| pins[i].softness == 0.0).map(squared);
    let unmet: f64 = exact.filter(|v| v.is_finite()).sum();
    let known = Known::default();
    for (retries, (part, damping)) in TRIALS.into_iter().enumerate() {
        let d: Vec<V3> = wishes.iter().map(|&w| scale(w, part)).collect();
        let wanted: Vec<f64> = desired.iter().map(|v| v * part).collect();
        let solve = |change: &[f64]| {
            constrained(&Wanted {
                rows: &rows,
                pins,
                metric,
                room: &room,
                desired: &wanted,
                change,
                least,
                tolerance: RANK_TOLERANCE,
                damping,
                known: &known,
            })
        };
        // Where F should be afterwards.
        let mut goal: Vec<f64> = rows.value.iter().map(|f| f * (1.0 - part)).collect();
        let change = |goal: &[f64]| -> Vec<f64> {
            (0..n).map(|i| goal[i] - rows.value[i] - dot(rows.gradient[i], d[i])).collect()
        };
        let mut within = solve(&change(&goal));
        // A surface that would have to come to a pin from afar comes nearer by no more than a step.
        let afar = (0..n)
            .filter(|&i| pins[i].target.is_none() && off[i].is_finite())
            .map(|i| off[i] - within.change.residual[i].abs())
            .fold(0.0, f64::max);
        let mut fraction = part;
        if part * afar > options.longest {
            let less = options.longest / afar;
            fraction = less;
            for i in 0..n {
                goal[i] = if off[i] < 1e-3 * options.longest { 0.0 } else { rows.value[i] * (1.0 - less) };
            }
            within = solve(&change(&goal));
        }
        let mut held = vec![false; m];
        within.at_limit.iter().for_each(|&j| held[j] = true);
        let trial = Trial {
            system: &within.system,
            first: &within.change,
            metric,
            held,
            damping,
            q,
            room: &room,
            limits: &limits,
            goal: &goal,
            afar: (afar > UNMET * options.tolerance).then_some((unmet, fraction)),
            options,
        };
        let ends: Vec<V3> =
            (0..n).map(|i| along(along(places[i], 1.0, d[i]), 1.0, within.change.way[i])).collect();
        if let Some(landed) = trial.correct(surface, pins, ends, part)? {
            return finish(surface, pins, landed, &within, q, retries);
        }
    }
    surface.set_q(q)?;
    Ok(ControlStep { retries: TRIALS.len(), stuck: true, ..unmoved(&rows, pins, metric, off, least) })
}

/// No change at all.
fn unmoved(rows: &Rows, pins: &[Pin], metric: &[f64], residual: Vec<f64>, least: f64) -> ControlStep {
    let m = metric.len();
    let system = System::new(rows, pins, metric, &vec![false; m], least, (RANK_TOLERANCE, 0.0));
    ControlStep {
        q_change: vec![0.0; m],
        rank: system.rank(),
        residual,
        slip: vec![[0.0; 3]; pins.len()],
        ..ControlStep::default()
    }
}

/// The ways that pins would like to go. Dragged pins go the same part of their ways: each shortened by itself, pins that
/// contradict each other would be weighed by their steps and not by what remains. Soft pins go no larger part.
fn wishes(pins: &[Pin], options: &StepOptions) -> Vec<V3> {
    let offsets: Vec<V3> =
        pins.iter().map(|p| p.target.map_or([0.0; 3], |t| p.guide.allowed(sub(t, p.at)))).collect();
    let part = |length: f64| {
        // The last bit at once, so that the spring arrives.
        let gain = if length < 0.25 * options.longest { 1.0 } else { options.gain };
        gain.min(options.longest / length.max(f64::MIN_POSITIVE))
    };
    let exact = |i: &usize| pins[*i].target.is_some() && pins[*i].softness == 0.0;
    let dragged: Vec<usize> = (0..pins.len()).filter(exact).collect();
    let common = part(dragged.iter().map(|&i| norm(offsets[i])).fold(0.0, f64::max));
    let several = dragged.len() > 1;
    let of = |(pin, offset): (&Pin, &V3)| match (pin.softness == 0.0, several) {
        (true, _) => scale(*offset, common),
        (false, true) => scale(*offset, part(norm(*offset)).min(common)),
        (false, false) => scale(*offset, part(norm(*offset))),
    };
    pins.iter().zip(&offsets).map(of).collect()
}

/// The metric without the parameters of pins that nothing can move: a pin that no parameter's typical change (its scale) moves by
/// more than `tolerance` has rounding for derivatives, and following them would take changes without end. Parameters that move
/// some pin keep their cost, the others get none and thus no column.
fn effective(rows: &Rows, metric: &[f64], scales: &[f64], least: f64, tolerance: f64) -> Vec<f64> {
    let mut metric = metric.to_vec();
    let effects = |i: usize| {
        let size = norm(rows.gradient[i]);
        let entries = rows.q_gradient.entries_of(i).filter(move |_| size > least);
        entries.map(move |(j, v)| (j, v.abs() * scales[j] / size))
    };
    let n = rows.gradient.len();
    let immovable = |i: &usize| effects(*i).all(|(_, v)| v <= tolerance);
    let doubtful: Vec<usize> = (0..n).filter(immovable).collect();
    if doubtful.is_empty() {
        return metric;
    }
    let mut moves = vec![false; metric.len()];
    (0..n).flat_map(&effects).filter(|e| e.1 > tolerance).for_each(|(j, _)| moves[j] = true);
    doubtful.into_iter().flat_map(&effects).filter(|e| !moves[e.0]).for_each(|(j, _)| metric[j] = 0.0);
    metric
}

/// How far a parameter may go down and up in a step. One that must be above 0, such as a radius, goes at most half of the way:
/// what has shrunk to nothing has no derivatives that could bring it back.
fn room((lo, hi): (f64, f64), q: f64) -> (f64, f64) {
    let down = lo - q;
    (if lo > 0.0 && lo < SMALLEST { 0.5 * down } else { down }, hi - q)
}

/// Gradients up to this length count as zero.
fn negligible(gradient: &[V3]) -> f64 {
    let lengths = gradient.iter().map(|&g| norm(g)).filter(|l| l.is_finite());
    1e-9 * lengths.fold(0.0, f64::max)
}

fn distance_of(value: f64, gradient: V3, least: f64) -> f64 {
    let size = norm(gradient);
    if size > least { value.abs() / size } else { f64::INFINITY }
}

fn differentiate(surface: &dyn Parametric, points: &[V3]) -> Result<Rows, FieldError> {
    let n = points.len();
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    let q_gradient = if n > 0 {
        surface.sparse_parameter_gradient(points, &mut value, &mut gradient)?
    } else {
        SparseRows::new(surface.freedom())
    };
    Ok(Rows { value, gradient, q_gradient })
}

/// A change that is tried.
struct Trial<'a> {
    system: &'a System,
    first: &'a Change,
    metric: &'a [f64],
    /// Parameters that are held at a limit.
    held: Vec<bool>,
    damping: f64,
    q: &'a [f64],
    room: &'a [(f64, f64)],
    limits: &'a [(f64, f64)],
    goal: &'a [f64],
    /// Where held pins are off the surface to begin with: the sum of squared distances that is to vanish, and the part of
    /// it that is aimed at.
    afar: Option<(f64, f64)>,
    options: &'a StepOptions,
}

/// Where it led.
struct Landed {
    places: Vec<V3>,
    value: Vec<f64>,
    gradient: Vec<V3>,
}

impl Trial<'_> {
    /// Makes the change, and corrects what it leaves with the same factors. `None` where the surface does not do what its
    /// derivatives promised.
    fn correct(
        &self,
        surface: &mut dyn Parametric,
        pins: &[Pin],
        mut places: Vec<V3>,
        part: f64,
    ) -> Result<Option<Landed>, Error> {
        let n = places.len();
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        let mut change = self.first.q.clone();
        let exact: Vec<bool> = (0..n).map(|i| pins[i].softness == 0.0 && self.system.regular(i)).collect();
        let mut last = f64::INFINITY;
        let mut first: Option<(f64, Vec<f64>, Vec<V3>)> = None;
        let (mut renewed, mut spent) = (None, 0);
        for round in 0.. {
            let moved = |(a, b): (&f64, &f64)| if *b == 0.0 { *a } else { a + b };
            let next: Vec<f64> = self.q.iter().zip(&change).map(moved).collect();
            if !next.iter().all(|v| v.is_finite()) {
                return Ok(None);
            }
            surface.set_q(&self.clamped(next))?;
            if n == 0 {
                break;
            }
            surface.value_gradient(&places, &mut value, &mut gradient)?;
            let least = negligible(&gradient);
            // How far off, beyond what the linear system already had to give up.
            let mut worst = 0.0f64;
            for i in (0..n).filter(|&i| exact[i]) {
                let missed = value[i] - self.goal[i];
                let off = distance_of(missed, gradient[i], least) - 1.01 * self.first.residual[i].abs();
                worst = worst.max(if off.is_nan() { f64::INFINITY } else { off });
            }
            let loose = self.options.tolerance.max(LOOSE * part * self.options.longest);
            if worst <= self.options.tolerance {
                break;
            }
            if round == 0 && self.afar.is_some() {
                let off = |i: usize| distance_of(value[i], gradient[i], least).powi(2);
                let unmet = (0..n).filter(|&i| exact[i]).map(off).sum();
                first = Some((unmet, surface.q(), places.clone()));
            }
            if spent == CORRECTIONS || worst > 0.7 * last {
                if worst > loose {
                    return self.better(surface, first);
                }
                // Near, but the derivatives have changed too much on the way: once more with those of this place.
                if renewed.is_some() {
                    break;
                }
                renewed = Some(self.renewed(surface, pins, &places)?);
                spent = 0;
            }
            spent += 1;
            last = worst;
            let back: Vec<f64> =
                (0..n).map(|i| if exact[i] { self.goal[i] - value[i] } else { 0.0 }).collect();
            let more = renewed.as_ref().unwrap_or(self.system).solve(&back);
            for j in 0..change.len() {
                change[j] = (change[j] + more.q[j]).clamp(self.room[j].0, self.room[j].1);
            }
            for (place, way) in places.iter_mut().zip(&more.way) {
                *place = along(*place, 1.0, *way);
            }
        }
        Ok(Some(Landed { places, value, gradient }))
    }

    /// The system at the present q and places.
    fn renewed(&self, surface: &dyn Parametric, pins: &[Pin], places: &[V3]) -> Result<System, Error> {
        let rows = differentiate(surface, places)?;
        let least = negligible(&rows.gradient);
        Ok(System::new(&rows, pins, self.metric, &self.held, least, (RANK_TOLERANCE, self.damping)))
    }

    /// Pins that were not met before either need only be met better: then the change as it was before corrections will do.
    fn better(
        &self,
        surface: &mut dyn Parametric,
        first: Option<(f64, Vec<f64>, Vec<V3>)>,
    ) -> Result<Option<Landed>, Error> {
        let (Some((before, fraction)), Some((unmet, q, places))) = (self.afar, first) else {
            return Ok(None);
        };
        if unmet.is_nan() || unmet > (1.0 - ENOUGH * fraction) * before {
            return Ok(None);
        }
        surface.set_q(&q)?;
        let (mut value, mut gradient) = (vec![0.0; places.len()], vec![[0.0; 3]; places.len()]);
        surface.value_gradient(&places, &mut value, &mut gradient)?;
        Ok(Some(Landed { places, value, gradient }))
    }

    /// q + room may round to a number just beyond a limit.
    fn clamped(&self, mut q: Vec<f64>) -> Vec<f64> {
        for (v, (lo, hi)) in q.iter_mut().zip(self.limits) {
            *v = v.clamp(*lo, *hi);
        }
        q
    }
}

/// The pins at their new places.
fn finish(
    surface: &mut dyn Parametric,
    pins: &mut [Pin],
    landed: Landed,
    within: &super::solve::Within,
    q: &[f64],
    retries: usize,
) -> Result<ControlStep, Error> {
    let Landed { places, value, gradient } = landed;
    let n = pins.len();
    let least = negligible(&gradient);
    let mut report = ControlStep {
        q_change: surface.q().iter().zip(q).map(|(a, b)| a - b).collect(),
        rank: within.system.rank(),
        residual: (0..n).map(|i| distance_of(value[i], gradient[i], least)).collect(),
        slip: vec![[0.0; 3]; n],
        at_limit: within.at_limit.clone(),
        retries,
        ..ControlStep::default()
    };
    for i in 0..n {
        let from = pins[i].at;
        let mut to = places[i];
        if pins[i].target.is_some() && pins[i].softness == 0.0 {
            // Where the surface does not follow, a dragged pin comes back to it.
            to = land(surface, to, &pins[i], &mut report.residual[i])?;
            let step = sub(to, from);
            let size = norm(gradient[i]);
            let normal = if size > least { scale(gradient[i], 1.0 / size) } else { [0.0; 3] };
            report.slip[i] = along(step, -dot(step, normal), normal);
            let offset = sub(pins[i].target.unwrap_or(to), from);
            report.moved = report.moved.max(dot(step, offset) / norm(offset).max(f64::MIN_POSITIVE));
        }
        pins[i].at = to;
    }
    Ok(report)
}

/// Newton steps from a pin's place to the surface, along what its guide allows.
fn land(surface: &dyn Parametric, place: V3, pin: &Pin, left: &mut f64) -> Result<V3, FieldError> {
    let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
    let (mut best, mut p) = (place, place);
    for round in 0..LANDINGS {
        surface.value_gradient(&[p], &mut value, &mut gradient)?;
        if round > 0 {
            let off = value[0].abs() / norm(gradient[0]);
            if off.is_nan() || off >= *left {
                break;
            }
            (best, *left) = (p, off);
        }
        let way = pin.guide.allowed(gradient[0]);
        let square = dot(way, way);
        let across = square > 1e-24 * dot(gradient[0], gradient[0]);
        if !across || value[0] == 0.0 {
            break;
        }
        p = along(best, -value[0] / square, way);
    }
    Ok(best)
}
