//! Interval search in a sum of bumps: the boxes that may contain a zero.

use std::sync::Arc;

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::{Bump, Sum};
use crate::FieldError;
use crate::math;
use crate::surface::{Aabb, Cells, Surface};

/// Relative slack that covers rounding in an exponent and in a sum.
const SLACK: f64 = 1e-12;

/// What bumps that are left out when points in the boxes are evaluated may move the surface, in sides of a box: the
/// boxes hold the whole surface all the same.
const SEEN: f64 = 1e-9;

struct Open {
    bounds: Aabb,
    /// The bumps that count in an ancestor of the box.
    bumps: Arc<Vec<u32>>,
}

/// The boxes of side at most `side` (larger if they would be more than `most`) that may contain zeros.
pub(super) fn search<'a>(sum: &'a Sum, bounds: &Aabb, side: f64, most: usize) -> Cells<'a> {
    let all = Arc::new((0..sum.bumps.len() as u32).collect::<Vec<_>>());
    let mut level = vec![Open { bounds: *bounds, bumps: all }];
    let mut present = longest(bounds);
    while present > side && level.len() * 4 <= most && !level.is_empty() {
        let next: Vec<Vec<Open>> = level.par_iter().with_min_len(4).map(|open| divide(sum, open)).collect();
        level = next.into_iter().flatten().collect();
        present *= 0.5;
    }
    let boxes = level.iter().map(|o| o.bounds).collect();
    let evaluate = sum.shortened(SEEN * present).map(|s| Box::new(s) as Box<dyn Surface>);
    Cells { boxes, side: present, evaluate: evaluate.unwrap_or_else(|| Box::new(Borrowed(sum))) }
}

fn longest(b: &Aabb) -> f64 {
    (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max)
}

/// The parts of a box, halved along every axis that is not much shorter than the longest, where there may be a zero.
fn divide(sum: &Sum, open: &Open) -> Vec<Open> {
    let counting: Vec<u32> = open.bumps.iter().copied().filter(|&i| sum.counts(i, &open.bounds)).collect();
    let bumps = Arc::new(counting);
    let long = longest(&open.bounds);
    let mut parts = vec![open.bounds];
    for a in (0..3).rev() {
        if open.bounds.hi[a] - open.bounds.lo[a] > 0.6 * long {
            let middle = 0.5 * (open.bounds.lo[a] + open.bounds.hi[a]);
            parts = parts
                .into_iter()
                .flat_map(|b| {
                    let (mut low, mut high) = (b, b);
                    low.hi[a] = middle;
                    high.lo[a] = middle;
                    [low, high]
                })
                .collect();
        }
    }
    let list: Vec<Bump> = bumps.iter().map(|&i| sum.bumps[i as usize]).collect();
    let arch = Arch::new();
    parts.retain(|bounds| {
        let (lo, hi) = arch.dispatch(Range { sum, bumps: &list, bounds });
        lo <= 0.0 && hi >= 0.0
    });
    parts.into_iter().map(|bounds| Open { bounds, bumps: bumps.clone() }).collect()
}

/// The range of the sum in a box.
pub(super) struct Range<'a> {
    pub(super) sum: &'a Sum,
    pub(super) bumps: &'a [Bump],
    pub(super) bounds: &'a Aabb,
}

/// Bumps that are handled side by side.
const LANES: usize = 16;

impl NullaryFnOnce for Range<'_> {
    type Output = (f64, f64);

    /// Outward: with slack for rounding and for the bumps that have been left out.
    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let Self { sum, bumps, bounds } = self;
        let (mut lo, mut hi) = ([0.0; LANES], [0.0; LANES]);
        for part in bumps.chunks(LANES) {
            let (mut near, mut far) = ([0.0; LANES], [0.0; LANES]);
            let mut factor = [0.0; LANES];
            for j in 0..LANES {
                let b = &part[j.min(part.len() - 1)];
                factor[j] = if j < part.len() { b.factor } else { 0.0 };
                (near[j], far[j]) = (b.level, b.level);
                for a in 0..3 {
                    let (below, above) = (bounds.lo[a] - b.center[a], b.center[a] - bounds.hi[a]);
                    let least = below.max(above).max(0.0);
                    let most = below.min(above);
                    near[j] -= b.weight[a] * (least * least);
                    far[j] -= b.weight[a] * (most * most);
                }
            }
            for j in 0..LANES {
                near[j] = factor[j] * math::exp(near[j]);
                far[j] = factor[j] * math::exp(far[j]);
            }
            for j in 0..LANES {
                lo[j] += near[j].min(far[j]);
                hi[j] += near[j].max(far[j]);
            }
        }
        let (lo, hi) = (lo.iter().sum::<f64>(), hi.iter().sum::<f64>());
        let slack = SLACK * (lo.abs() + hi.abs() + sum.offset.abs()) + sum.tail * sum.bumps.len() as f64;
        (sum.offset + lo - slack, sum.offset + hi + slack)
    }
}

/// The sum itself, as the evaluator of the boxes.
struct Borrowed<'a>(&'a Sum);

impl Surface for Borrowed<'_> {
    fn any_thread(&self) -> bool {
        true
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        self.0.value_gradient(points, value, gradient)
    }

    fn hessian(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) -> Result<(), FieldError> {
        self.0.hessian(points, out)
    }
}
