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
        // Change of a parameter at unit cost; 0 for those that get no column.
        let free = |(cost, held): (&f64, &bool)| if *cost > 0.0 && !held { 1.0 / cost } else { 0.0 };
        let unit: Vec<f64> = metric.iter().zip(held).map(free).collect();
        // The entries of a row as lengths at unit costs, over its scale.
        let entries = |i: usize| {
            let regular = scale[i] > 0.0;
            rows.q_gradient.entries_of(i).filter(move |_| regular).map(|(j, v)| (j, v * unit[j]))
        };
        let least_entry: Vec<f64> =
            (0..n).map(|i| NOTHING * entries(i).map(|(_, v)| v.abs()).fold(0.0, f64::max)).collect();
        let (mut place, mut count) = (vec![NONE; m], 0);
        for (i, least) in least_entry.iter().enumerate() {
            for (j, v) in entries(i) {
                if v.abs() > *least {
                    (place[j], count) = (0, count + 1);
                }
            }
        }
        let kept: Vec<u32> = (0..m as u32).filter(|&j| place[j as usize] != NONE).collect();
        kept.iter().enumerate().for_each(|(k, &j)| place[j as usize] = k as u32);
        let place = &place[..];
        let kept_entries = |i: usize| entries(i).filter(move |&(j, _)| place[j] != NONE);
        let damping = if damping > 0.0 {
            let square =
                |i: usize| kept_entries(i).map(|(_, v)| (scale[i] * v) * (scale[i] * v)).sum::<f64>();
            damping * (0..n).map(square).fold(0.0, f64::max).sqrt()
        } else {
            0.0
        };
        let mut extra = Vec::new();
        for (i, pin) in pins.iter().enumerate() {
            let softness = pin.softness.max(damping);
            if softness > 0.0 {
                extra.push(Extra::Slack { row: i, softness });
            }
            extra.extend(pin.guide.ways().into_iter().map(|direction| Extra::Way { row: i, direction }));
        }
        let width = kept.len() + extra.len();
        let beside = extra.iter().enumerate().map(|(k, e)| match *e {
            Extra::Slack { row, softness } => (row, kept.len() + k, softness),
            Extra::Way { row, direction } => {
                (row, kept.len() + k, scale[row] * dot(rows.gradient[row], direction))
            }
        });
        let beside = beside.filter(|&(row, ..)| scale[row] > 0.0);
        let precedence: Vec<u8> = pins.iter().map(Pin::precedence).collect();
        let (fold, factors) = if fold::pays(n, count, kept.len()) {
            let mut matrix: Vec<Vec<(u32, f64)>> = (0..n)
                .map(|i| {
                    let counting = kept_entries(i).filter(|(_, v)| v.abs() > least_entry[i]);
                    counting.map(|(j, v)| (place[j], scale[i] * v)).collect()
                })
                .collect();
            beside.for_each(|(row, column, value)| matrix[row].push((column as u32, value)));
            let (fold, l) = Fold::new(&matrix, width);
            let factors = Factors::new(l, fold.width(), &precedence, tolerance);
            (Some(fold), factors)
        } else {
            let mut matrix = vec![0.0; n * width];
            for i in 0..n {
                kept_entries(i).for_each(|(j, v)| matrix[i * width + place[j] as usize] = scale[i] * v);
            }
            beside.for_each(|(row, column, value)| matrix[row * width + column] = value);
            (None, Factors::new(matrix, width, &precedence, tolerance))
        };
        let unit: Vec<f64> = kept.iter().map(|&j| unit[j as usize]).collect();
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
