//! Interval enclosures of a field and its derivatives over boxes, and of the equations of its critical points.

use isoswarm_field::vector::{V3, frame};
use isoswarm_field::{Aabb, Field, FieldError, Interval, Regularity};

pub(super) type I3 = [Interval; 3];
pub(super) type M3 = [I3; 3];

/// Exactly v.
pub(super) fn point(v: f64) -> Interval {
    Interval::new(v, v)
}

/// a · b for a vector of numbers and one of intervals.
pub(super) fn inner(a: V3, b: &I3) -> Interval {
    point(a[0]) * b[0] + point(a[1]) * b[1] + point(a[2]) * b[2]
}

/// The part that two intervals share, if any.
pub(super) fn meet(a: Interval, b: Interval) -> Option<Interval> {
    let (lo, hi) = (a.lo.max(b.lo), a.hi.min(b.hi));
    (lo <= hi).then(|| Interval::new(lo, hi))
}

/// Centre of a box.
pub(super) fn centre(b: &Aabb) -> V3 {
    [0, 1, 2].map(|a| 0.5 * b.lo[a] + 0.5 * b.hi[a])
}

/// A box around a point.
pub(super) fn at(p: V3) -> Aabb {
    Aabb::new(p, p)
}

/// A field, its intervals, and the direction h of the height whose critical points are sought: F = 0, ∇F · u = 0,
/// ∇F · v = 0, where u, v complete h to a frame.
pub(super) struct System<'a> {
    pub(super) field: &'a Field,
    pub(super) h: V3,
    pub(super) u: V3,
    pub(super) v: V3,
    /// Whether F is smooth all over the bounds.
    smooth: bool,
}

impl<'a> System<'a> {
    pub(super) fn new(field: &'a Field, h: V3, bounds: &Aabb) -> Result<Self, FieldError> {
        let (u, v) = frame(h);
        let smooth = field.regularity(&bounds.lo, &bounds.hi)? == Regularity::Smooth;
        Ok(Self { field, h, u, v, smooth })
    }

    /// How regular F is over a box, which may stick out of the bounds a little.
    pub(super) fn regularity(&self, b: &Aabb) -> Result<Regularity, FieldError> {
        if self.smooth { Ok(Regularity::Smooth) } else { self.field.regularity(&b.lo, &b.hi) }
    }

    /// F over a box.
    pub(super) fn value(&self, b: &Aabb) -> Result<Interval, FieldError> {
        Ok(self.field.interval(&b.lo, &b.hi)?[0])
    }

    /// ∇F over a box.
    pub(super) fn gradient(&self, b: &Aabb) -> Result<I3, FieldError> {
        let g = self.field.interval_gradient(&b.lo, &b.hi)?;
        Ok([g[0], g[1], g[2]])
    }

    /// The second derivatives over a box.
    pub(super) fn hessian(&self, b: &Aabb) -> Result<M3, FieldError> {
        let h = self.field.interval_hessian(&b.lo, &b.hi)?;
        Ok([[h[0], h[1], h[2]], [h[3], h[4], h[5]], [h[6], h[7], h[8]]])
    }

    /// Rows of the Jacobian of the system: ∇F, H u, H v.
    pub(super) fn jacobian(&self, gradient: I3, hessian: &M3) -> M3 {
        let times = |w: V3| [0, 1, 2].map(|i| inner(w, &hessian[i]));
        [gradient, times(self.u), times(self.v)]
    }

    /// The three equations, given F and ∇F.
    pub(super) fn equations(&self, value: Interval, gradient: &I3) -> I3 {
        [value, inner(self.u, gradient), inner(self.v, gradient)]
    }
}

/// f over a box by the mean value theorem: f(c) + ∇f(X)·(X - c).
pub(super) fn mean_value(at_centre: Interval, slope: &I3, b: &Aabb, c: V3) -> Interval {
    (0..3).fold(at_centre, |sum, a| sum + slope[a] * (Interval::new(b.lo[a], b.hi[a]) - point(c[a])))
}

/// Whether F surely has no zero in a box.
pub(super) fn excludes(system: &System<'_>, b: &Aabb) -> Result<bool, FieldError> {
    if !system.value(b)?.has_zero() {
        return Ok(true);
    }
    if system.regularity(b)? == Regularity::Broken {
        return Ok(false);
    }
    let slope = system.gradient(b)?;
    let c = centre(b);
    Ok(!mean_value(system.value(&at(c))?, &slope, b, c).has_zero())
}
