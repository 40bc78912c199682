//! The change of the parameters that control points ask for (WH94 eqs. 6 to 8).
//!
//! Minimise |Δq - Q|² in the metric of the parameters so that F stays 0 at each pin: Fq·Δq + Fx·d + F = 0, one row a
//! pin. The rows are divided by |Fx|, so that they and their residuals are lengths. They are factored as they are: the matrix
//! J Jᵀ of eq. 7 would square the condition number. A pin on a line or in a plane adds columns along which it may give way; a
//! soft pin adds a column that lets it be missed at a cost. Columns that are nothing in every row are left out.

use super::factor::Factors;
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
    /// n × m.
    pub(crate) q_gradient: Vec<f64>,
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
        let row = |i: usize| &rows.q_gradient[i * m..(i + 1) * m];
        let scale: Vec<f64> = (0..n)
            .map(|i| {
                let size = norm(rows.gradient[i]);
                let fine = size > least
                    && size.is_finite()
                    && rows.value[i].is_finite()
                    && row(i).iter().all(|v| v.is_finite());
                if fine { pins[i].weight / size } else { 0.0 }
            })
            .collect();
        let mut kept = vec![false; m];
        for i in (0..n).filter(|&i| scale[i] > 0.0) {
            let entry = |j: usize| row(i)[j].abs() / metric[j];
            let usable = |&j: &usize| metric[j] > 0.0 && !held[j];
            let largest = (0..m).filter(usable).map(entry).fold(0.0, f64::max);
            for j in (0..m).filter(usable) {
                kept[j] |= entry(j) > NOTHING * largest;
            }
        }
        let kept: Vec<u32> = (0..m as u32).filter(|&j| kept[j as usize]).collect();
        let unit: Vec<f64> = kept.iter().map(|&j| 1.0 / metric[j as usize]).collect();
        let square = |i: usize| {
            let own = kept.iter().zip(&unit).map(|(&j, u)| scale[i] * row(i)[j as usize] * u);
            own.map(|v| v * v).sum::<f64>()
        };
        let damping = if damping > 0.0 {
            damping * (0..n).filter(|&i| scale[i] > 0.0).map(square).fold(0.0, f64::max).sqrt()
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
        let mut a = vec![0.0; n * width];
        for i in 0..n {
            let out = &mut a[i * width..(i + 1) * width];
            for (k, &j) in kept.iter().enumerate() {
                out[k] = scale[i] * row(i)[j as usize] * unit[k];
            }
        }
        for (k, e) in extra.iter().enumerate() {
            let k = kept.len() + k;
            match *e {
                Extra::Slack { row, softness } => a[row * width + k] = softness,
                Extra::Way { row, direction } => {
                    a[row * width + k] = scale[row] * dot(rows.gradient[row], direction);
                }
            }
        }
        for (i, s) in scale.iter().enumerate() {
            if *s == 0.0 {
                a[i * width..(i + 1) * width].fill(0.0);
            }
        }
        let precedence: Vec<u8> = pins.iter().map(Pin::precedence).collect();
        let factors = Factors::new(a, width, &precedence, tolerance);
        let weight = pins.iter().map(|p| p.weight).collect();
        Self { kept, unit, extra, scale, weight, factors, count: n, freedom: m }
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
        let solved = self.factors.solve(&b);
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
    pub(crate) system: System,
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
}

/// The change nearest to the desired one that meets the pins within the limits: parameters that would leave are set to their
/// limits, and the others make up for them.
pub(crate) fn constrained(wanted: &Wanted<'_>) -> Within {
    let Wanted { rows, pins, metric, room, desired, change, least, tolerance, damping } = *wanted;
    let m = metric.len();
    let mut base: Vec<f64> = (0..m).map(|j| desired[j].clamp(room[j].0, room[j].1)).collect();
    let mut held = vec![false; m];
    for round in 0.. {
        let system = System::new(rows, pins, metric, &held, least, (tolerance, damping));
        let rest: Vec<f64> = (0..pins.len())
            .map(|i| {
                let row = &rows.q_gradient[i * m..(i + 1) * m];
                change[i]
                    - row.iter().zip(&base).map(|(a, b)| if *b == 0.0 { 0.0 } else { a * b }).sum::<f64>()
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
