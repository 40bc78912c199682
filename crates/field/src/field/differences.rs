//! Numerical derivatives of opaque leaves: HBJF02 eqs. 7 and 8 with the division by ε that they lack, and with central
//! differences. The function is called for all points at once, on the calling thread.

use crate::model::{Callback, ParamInfo};
use crate::{Aabb, FieldError};

/// Step of a central difference, relative to the extent of the points or to the size of a parameter: the cube root
/// of the rounding error.
pub(super) const STEP: f64 = 6e-6;

/// The length that steps in space are relative to.
pub(super) fn extent(points: &[[f64; 3]], bounds: Option<Aabb>) -> f64 {
    let diagonal = bounds.or_else(|| Aabb::around(points)).map_or(0.0, |b| b.diagonal());
    let size = points.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    let length = if diagonal > 0.0 { diagonal } else { size };
    if length > 0.0 && length.is_finite() { length } else { 1.0 }
}

/// The coordinate `by` beside that of a point, or the face of the bounds between: beyond them a function need not be defined.
pub(super) fn beside(p: &[f64], axis: usize, by: f64, bounds: Option<Aabb>) -> f64 {
    let to = p[axis] + by;
    let room = |b: &Aabb| {
        (0..p.len()).all(|a| b.lo[a] <= p[a] && p[a] <= b.hi[a]) && b.hi[axis] - b.lo[axis] > by.abs()
    };
    bounds.filter(room).map_or(to, |b| to.clamp(b.lo[axis], b.hi[axis]))
}

/// F and ∂F/∂x by central differences, one-sided at the faces of the function's bounds, in one call of the function.
pub(super) fn gradient(
    callback: &dyn Callback,
    points: &[[f64; 3]],
    q: &[f64],
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) -> Result<(), FieldError> {
    let n = points.len();
    let bounds = callback.bounds();
    let h = STEP * extent(points, bounds);
    let mut all = Vec::with_capacity(7 * n);
    all.extend_from_slice(points);
    for axis in 0..3 {
        for side in [h, -h] {
            all.extend(points.iter().map(|p| {
                let mut q = *p;
                q[axis] = beside(p, axis, side, bounds);
                q
            }));
        }
    }
    let mut values = vec![0.0; 7 * n];
    callback.value(&all, q, &mut values)?;
    value.copy_from_slice(&values[..n]);
    for axis in 0..3 {
        let (ahead, behind) = ((1 + 2 * axis) * n, (2 + 2 * axis) * n);
        for i in 0..n {
            // The step that was really taken, after rounding.
            let step = all[ahead + i][axis] - all[behind + i][axis];
            gradient[i][axis] = (values[ahead + i] - values[behind + i]) / step;
        }
    }
    Ok(())
}

/// A leaf at fixed points, as a function of its parameters.
pub(super) struct OfParameters<'a> {
    pub callback: &'a dyn Callback,
    pub points: &'a [[f64; 3]],
    /// The leaf's parameters.
    pub params: &'a [ParamInfo],
    /// F at the points, at the present values.
    pub value: &'a [f64],
}

impl OfParameters<'_> {
    /// ∂F/∂q of the parameters that `free` marks, one column each: exact where the function has them, otherwise by
    /// two calls a parameter. 0 for a parameter whose bounds leave it no room.
    pub(super) fn columns(&self, free: &[bool]) -> Result<Vec<Option<Vec<f64>>>, FieldError> {
        let p = self.params.len();
        if !free.contains(&true) {
            return Ok(vec![None; p]);
        }
        let exact = self.exact()?;
        let column = |j: usize| match &exact {
            Some(slopes) => Ok(slopes.iter().skip(j).step_by(p).copied().collect()),
            None => self.partial(j),
        };
        (0..p).map(|j| free[j].then(|| column(j)).transpose()).collect()
    }

    /// (∂F/∂q)·q̇ at each point; `None` where nothing moves. Exact where the function has derivatives, otherwise
    /// by two calls in the direction of q̇.
    pub(super) fn rate(&self, q_dot: &[f64]) -> Result<Option<Vec<f64>>, FieldError> {
        if q_dot.iter().all(|r| *r == 0.0) {
            return Ok(None);
        }
        if let Some(slopes) = self.exact()? {
            let rows = slopes.chunks_exact(q_dot.len());
            // Parameters at rest may have no derivative.
            let product =
                |row: &[f64]| row.iter().zip(q_dot).filter(|(_, r)| **r != 0.0).map(|(g, r)| g * r).sum();
            return Ok(Some(rows.map(product).collect()));
        }
        if let Some(rate) = self.along(q_dot, 0.5)? {
            return Ok(Some(rate));
        }
        // Bounds are in the way both ahead and behind, though not of each parameter by itself.
        let mut rate = vec![0.0; self.points.len()];
        for (j, r) in q_dot.iter().enumerate().filter(|(_, r)| **r != 0.0) {
            for (sum, slope) in rate.iter_mut().zip(self.partial(j)?) {
                *sum += r * slope;
            }
        }
        Ok(Some(rate))
    }

    fn q(&self) -> Vec<f64> {
        self.params.iter().map(|p| p.value).collect()
    }

    /// The function's own derivatives, one row a point.
    fn exact(&self) -> Result<Option<Vec<f64>>, FieldError> {
        let mut slopes = vec![0.0; self.points.len() * self.params.len()];
        match self.callback.parameter_gradient(self.points, &self.q(), &mut slopes) {
            Some(result) => result.map(|()| Some(slopes)),
            None => Ok(None),
        }
    }

    /// ∂F/∂q of one parameter.
    fn partial(&self, j: usize) -> Result<Vec<f64>, FieldError> {
        let mut direction = vec![0.0; self.params.len()];
        direction[j] = 1.0;
        Ok(self.along(&direction, 1e-6)?.unwrap_or_else(|| vec![0.0; self.points.len()]))
    }

    /// The derivative of t ↦ F(q + t·direction) at 0 from two calls within the bounds, exact for parabolas; `None`
    /// where the bounds leave less than the part `least` of a step on either side.
    fn along(&self, direction: &[f64], least: f64) -> Result<Option<Vec<f64>>, FieldError> {
        let (mut fastest, mut ahead, mut behind) = (0.0f64, f64::INFINITY, f64::INFINITY);
        for (p, &r) in self.params.iter().zip(direction).filter(|(_, r)| **r != 0.0) {
            fastest = fastest.max(r.abs() / p.value.abs().max(p.scale));
            let (mut to, mut from) = ((p.bounds.1 - p.value) / r.abs(), (p.value - p.bounds.0) / r.abs());
            if r < 0.0 {
                std::mem::swap(&mut to, &mut from);
            }
            (ahead, behind) = (ahead.min(to), behind.min(from));
        }
        let Some((a, b)) = places(behind, ahead, STEP / fastest, least) else { return Ok(None) };
        let at = |t: f64| -> Result<Vec<f64>, FieldError> {
            let moved = |(p, r): (&ParamInfo, &f64)| (p.value + t * r).clamp(p.bounds.0, p.bounds.1);
            let q: Vec<f64> = self.params.iter().zip(direction).map(moved).collect();
            let mut value = vec![0.0; self.points.len()];
            self.callback.value(self.points, &q, &mut value)?;
            Ok(value)
        };
        let (at_a, at_b) = (at(a)?, at(b)?);
        let (weight_a, weight_b) = (b / (a * (b - a)), -a / (b * (b - a)));
        let slope = |((f, a), b): ((&f64, &f64), &f64)| weight_a * (a - f) + weight_b * (b - f);
        Ok(Some(self.value.iter().zip(&at_a).zip(&at_b).map(slope).collect()))
    }
}

/// Two places beside 0, at best `h` to each side, where there is room for `behind` and `ahead`.
fn places(behind: f64, ahead: f64, h: f64, least: f64) -> Option<(f64, f64)> {
    if behind >= h && ahead >= h {
        return Some((h, -h));
    }
    let (room, sign) = if ahead >= behind { (ahead, 1.0) } else { (behind, -1.0) };
    let far = room.min(2.0 * h);
    (far > least * h).then_some((sign * 0.5 * far, sign * far))
}
