//! The change of the parameters that control points ask for (WH94 eqs. 6 to 8).
//!
//! Minimise |Δq - Q|² in the metric of the parameters so that F stays 0 at each pin: Fq·Δq + Fx·d + F = 0, one row a
//! pin. The rows are divided by |Fx|, so that they and their residuals are lengths. They are factored as they are: the matrix
//! J Jᵀ of eq. 7 would square the condition number. A pin on a line or in a plane adds columns along which it may give way; a
//! soft pin adds a column that lets it be missed at a cost. Columns that are nothing in every row are left out; where rows have
//! entries in few of the others, these are folded into few first.

use std::cell::RefCell;
use std::rc::Rc;

use isoswarm_field::SparseRows;

use super::factor::Factors;
use super::fold::{self, Fold};
use super::pin::{Guide, Pin};
use crate::vector::{V3, cross, dot, norm};

/// Part of a row's largest entry below which entries count as nothing.
const NOTHING: f64 = 1e-13;
/// Rounds in which parameters at their limits are taken out before the rest is cut off.
const ROUNDS: usize = 12;

/// F and its derivatives at the pins.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    pub(crate) value: Vec<f64>,
    pub(crate) gradient: Vec<V3>,
    /// n rows of as many columns as there are parameters.
    pub(crate) q_gradient: SparseRows,
}

/// Marks parameters without a column.
const NONE: u32 = u32::MAX;

/// An entry of a pin's equation.
#[derive(Clone, Copy)]
struct Entry {
    column: u32,
    /// In lengths, for a change of the parameter at unit cost.
    value: f64,
    /// Whether it is more than nothing beside the others of the row.
    counts: bool,
}

/// The rows as lengths at unit costs, without what cannot be used.
fn scaled(rows: &Rows, scale: &[f64], metric: &[f64], held: &[bool]) -> Vec<Vec<Entry>> {
    let unit = |(cost, held): (&f64, &bool)| if *cost > 0.0 && !held { 1.0 / cost } else { 0.0 };
    let unit: Vec<f64> = metric.iter().zip(held).map(unit).collect();
    let one = |i: usize| -> Vec<Entry> {
        if scale[i] == 0.0 {
            return Vec::new();
        }
        let usable = || rows.q_gradient.entries_of(i).filter(|&(j, _)| unit[j] > 0.0);
        let largest = usable().map(|(j, v)| v.abs() * unit[j]).fold(0.0, f64::max);
        let entry = |(j, v): (usize, f64)| Entry {
            column: j as u32,
            value: scale[i] * v * unit[j],
            counts: v.abs() * unit[j] > NOTHING * largest,
        };
        usable().map(entry).collect()
    };
    (0..scale.len()).map(one).collect()
}

/// A column beside those of parameters.
#[derive(Clone, Copy, Debug)]
enum Extra {
    /// The row may be missed.
    Slack { row: usize, softness: f64 },
    /// The pin may give way along a direction.
    Way { row: usize, direction: V3 },
}

/// The equations of the pins, factored.
#[derive(Clone, Debug)]
pub(crate) struct System {
    /// Parameters that have a column.
    kept: Vec<u32>,
    /// Change of the parameter for a unit of its column.
    unit: Vec<f64>,
    extra: Vec<Extra>,
    /// Weight over |Fx| of each row; 0 where F is not defined or its gradient vanishes.
    scale: Vec<f64>,
    weight: Vec<f64>,
    /// Makes the columns few, where rows have entries in few of many.
    fold: Option<Fold>,
    factors: Factors,
    count: usize,
    freedom: usize,
}

/// A change of the parameters and of the pins.
#[derive(Clone, Debug)]
pub(crate) struct Change {
    pub(crate) q: Vec<f64>,
    /// How far each pin gives way along its line or plane.
    pub(crate) way: Vec<V3>,
    /// What is missed at each pin (a signed length).
    pub(crate) residual: Vec<f64>,
}

/// The factors of a matrix given by the entries of its rows, folded or not.
fn factored(
    matrix: &fold::Entries,
    width: usize,
    folds: bool,
    precedence: &[u8],
    tolerance: f64,
) -> (Option<Fold>, Factors) {
    if folds {
        let (fold, l) = Fold::new(matrix, width);
        let factors = Factors::new(l, fold.width(), precedence, tolerance);
        return (Some(fold), factors);
    }
    let mut a = vec![0.0; matrix.len() * width];
    for (row, entries) in a.chunks_exact_mut(width.max(1)).zip(matrix) {
        entries.iter().for_each(|&(k, v)| row[k as usize] = v);
    }
    (None, Factors::new(a, width, precedence, tolerance))
}

impl System {
    /// Factors the rows of `pins`. `metric[j]` is the cost of a unit change of q_j; parameters with no cost have no
    /// effect anywhere and, like those that are `held`, get no column. Gradients up to `least` count as zero. Rows may be missed
    /// where that saves much: by `damping`, a part of the longest row.
    pub(crate) fn new(
        rows: &Rows,
        pins: &[Pin],
        metric: &[f64],
        held: &[bool],
        least: f64,
        (tolerance, damping): (f64, f64),
    ) -> Self {
        let (n, m) = (pins.len(), metric.len());
        let scale: Vec<f64> = (0..n)
            .map(|i| {
                let size = norm(rows.gradient[i]);
                let fine = size > least
                    && size.is_finite()
                    && rows.value[i].is_finite()
                    && rows.q_gradient.row(i).1.iter().all(|v| v.is_finite());
                if fine { pins[i].weight / size } else { 0.0 }
            })
            .collect();
        let entries = scaled(rows, &scale, metric, held);
        let mut place = vec![NONE; m];
        entries.iter().flatten().filter(|e| e.counts).for_each(|e| place[e.column as usize] = 0);
        let kept: Vec<u32> = (0..m as u32).filter(|&j| place[j as usize] != NONE).collect();
        kept.iter().enumerate().for_each(|(k, &j)| place[j as usize] = k as u32);
        let unit: Vec<f64> = kept.iter().map(|&j| 1.0 / metric[j as usize]).collect();
        let square = |row: &Vec<Entry>| {
            row.iter().filter(|e| place[e.column as usize] != NONE).map(|e| e.value * e.value).sum::<f64>()
        };
        let damping =
            if damping > 0.0 { damping * entries.iter().map(square).fold(0.0, f64::max).sqrt() } else { 0.0 };
        let mut extra = Vec::new();
        for (i, pin) in pins.iter().enumerate() {
            let softness = pin.softness.max(damping);
            if softness > 0.0 {
                extra.push(Extra::Slack { row: i, softness });
            }
            extra.extend(pin.guide.ways().into_iter().map(|direction| Extra::Way { row: i, direction }));
        }
        let width = kept.len() + extra.len();
        let list = |row: &Vec<Entry>, all: bool| -> Vec<(u32, f64)> {
            let own = row.iter().filter(|e| (all || e.counts) && place[e.column as usize] != NONE);
            own.map(|e| (place[e.column as usize], e.value)).collect()
        };
        let mut matrix: Vec<Vec<(u32, f64)>> = entries.iter().map(|row| list(row, false)).collect();
        let folds = fold::pays(&matrix, kept.len());
        if !folds {
            matrix = entries.iter().map(|row| list(row, true)).collect();
        }
        for (k, e) in extra.iter().enumerate() {
            let (row, value) = match *e {
                Extra::Slack { row, softness } => (row, softness),
                Extra::Way { row, direction } => (row, scale[row] * dot(rows.gradient[row], direction)),
            };
            if scale[row] > 0.0 {
                matrix[row].push(((kept.len() + k) as u32, value));
            }
        }
        let precedence: Vec<u8> = pins.iter().map(Pin::precedence).collect();
        let (fold, factors) = factored(&matrix, width, folds, &precedence, tolerance);
        let weight = pins.iter().map(|p| p.weight).collect();
        Self { kept, unit, extra, scale, weight, fold, factors, count: n, freedom: m }
    }

    /// Number of pins that are met independently of each other (soft ones count).
    pub(crate) fn rank(&self) -> usize {
        self.factors.rank()
    }

    /// Whether F has a gradient at pin i.
    pub(crate) fn regular(&self, i: usize) -> bool {
        self.scale[i] > 0.0
    }

    /// The smallest change for which F changes by `change[i]` at pin i.
    pub(crate) fn solve(&self, change: &[f64]) -> Change {
        let b: Vec<f64> = (0..self.count).map(|i| self.scale[i] * change[i]).collect();
        let b: Vec<f64> = b.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
        let mut solved = self.factors.solve(&b);
        if let Some(fold) = &self.fold {
            solved.x = fold.unfold(&solved.x);
        }
        let mut q = vec![0.0; self.freedom];
        for ((&j, unit), x) in self.kept.iter().zip(&self.unit).zip(&solved.x) {
            q[j as usize] = unit * x;
        }
        let mut way = vec![[0.0; 3]; self.count];
        let mut residual = solved.residual;
        for (e, x) in self.extra.iter().zip(&solved.x[self.kept.len()..]) {
            match *e {
                Extra::Slack { row, softness } => residual[row] -= x * softness,
                Extra::Way { row, direction } => {
                    (0..3).for_each(|a| way[row][a] += x * direction[a]);
                }
            }
        }
        for (r, w) in residual.iter_mut().zip(&self.weight) {
            *r /= w;
        }
        Change { q, way, residual }
    }
}

/// A change within the limits of the parameters: see [`constrained`].
pub(crate) struct Within {
    pub(crate) system: Rc<System>,
    pub(crate) change: Change,
    /// Parameters that are at a limit and wanted to go beyond.
    pub(crate) at_limit: Vec<usize>,
}

/// What [`constrained`] starts from.
pub(crate) struct Wanted<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) pins: &'a [Pin],
    pub(crate) metric: &'a [f64],
    /// How far each parameter may go down and up.
    pub(crate) room: &'a [(f64, f64)],
    /// Q: the change wanted where the pins do not care.
    pub(crate) desired: &'a [f64],
    /// F at the pins must change by so much.
    pub(crate) change: &'a [f64],
    pub(crate) least: f64,
    pub(crate) tolerance: f64,
    /// See [`System::new`].
    pub(crate) damping: f64,
    /// Factors of these rows that were made before.
    pub(crate) known: &'a Known,
}

/// The last system in which no parameter was held, and its damping: what is tried differs in the changes that are asked for.
#[derive(Default)]
pub(crate) struct Known(RefCell<Option<(f64, Rc<System>)>>);

impl Known {
    fn get(&self, damping: f64, make: impl FnOnce() -> Rc<System>) -> Rc<System> {
        let mut last = self.0.borrow_mut();
        match &*last {
            Some((at, system)) if *at == damping => system.clone(),
            _ => {
                let system = make();
                *last = Some((damping, system.clone()));
                system
            }
        }
    }
}

/// The change nearest to the desired one that meets the pins within the limits: parameters that would leave are set to their
/// limits, and the others make up for them.
pub(crate) fn constrained(wanted: &Wanted<'_>) -> Within {
    let Wanted { rows, pins, metric, room, desired, change, least, tolerance, damping, known } = *wanted;
    let m = metric.len();
    let mut base: Vec<f64> = (0..m).map(|j| desired[j].clamp(room[j].0, room[j].1)).collect();
    let mut held = vec![false; m];
    for round in 0.. {
        let make = || Rc::new(System::new(rows, pins, metric, &held, least, (tolerance, damping)));
        let system = if round == 0 { known.get(damping, make) } else { make() };
        let rest: Vec<f64> = (0..pins.len())
            .map(|i| {
                let effect = |(j, v): (usize, f64)| if base[j] == 0.0 { 0.0 } else { v * base[j] };
                change[i] - rows.q_gradient.entries_of(i).map(effect).sum::<f64>()
            })
            .collect();
        let mut solved = system.solve(&rest);
        let mut left = false;
        for j in 0..m {
            solved.q[j] += base[j];
            let inside = solved.q[j].clamp(room[j].0, room[j].1);
            if inside != solved.q[j] && !held[j] {
                (left, held[j], base[j]) = (true, true, inside);
            }
            solved.q[j] = inside;
        }
        if !left || round == ROUNDS {
            let at_limit = (0..m).filter(|&j| held[j]).collect();
            return Within { system, change: solved, at_limit };
        }
    }
    unreachable!("the last round returns")
}

impl Guide {
    /// The directions in which a pin may give way.
    fn ways(self) -> Vec<V3> {
        match self {
            Guide::Free => Vec::new(),
            Guide::Line(u) => vec![u],
            Guide::Plane(n) => {
                let (u, _) = crate::vector::frame(n);
                vec![u, cross(n, u)]
            }
        }
    }
}
