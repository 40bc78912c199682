//! A field as the particles see it.

use std::sync::Arc;

use super::{Field, cells};
use crate::bumps::{Recipe, Sum};
use crate::regions::{Narrowed, RegionOptions, Whole};
use crate::surface::{Aabb, Cells, Parametric, Surface};
use crate::switches::Switches;
use crate::{FieldError, Interval, SparseRows};

/// Tapes up to this length gain nothing from pruning.
const SHORT: usize = 24;

/// What all dropped exponentials together may move the surface, relative to its diameter.
const TAIL: f64 = 1e-13;

impl Field {
    /// The first component with its uniforms.
    pub(super) fn whole(&self) -> Whole<'_> {
        Whole {
            tape: self.tape(0),
            program: &self.compiled.parts[0].inputs,
            uniforms: &self.uniforms[0],
            spans: self.spans(0),
            axes: self.axes(),
        }
    }

    /// The uniforms of a component's tape.
    #[cfg(test)]
    pub(crate) fn uniforms(&self, component: usize) -> &[f64] {
        &self.uniforms[component]
    }

    /// The field as a sum of bumps, which needs no pruning, if it is one.
    pub(super) fn bumps(&self) -> Option<&Sum> {
        let plain = self.axes() == 3 && self.components() == 1 && !self.is_opaque();
        let find = || {
            let recipe = self.compiled.recipe.get_or_init(|| Recipe::of(self.tape(0))).as_ref()?;
            recipe.sum(self.tape(0), &self.uniforms[0]).map(Arc::new)
        };
        plain.then(|| self.bumps.get_or_init(find).as_deref())?
    }

    /// Flat coordinates, `axes()` numbers a point.
    fn packed(&self, points: &[[f64; 3]]) -> Vec<f64> {
        points.iter().flat_map(|p| &p[..self.axes()]).copied().collect()
    }

    /// The change of F, for each exponential, that moves the surface by [`TAIL`] of the points' diameter where
    /// the gradient is at its smallest among a sample of them.
    pub(super) fn tail(&self, points: &[[f64; 3]]) -> Result<f64, FieldError> {
        let exps = self.tape(0).exps;
        let Some(bounds) = Aabb::around(points).filter(|_| exps > 0) else { return Ok(0.0) };
        let sample: Vec<[f64; 3]> = points.iter().step_by(points.len().div_ceil(64)).copied().collect();
        let (mut value, mut gradient) = (vec![0.0; sample.len()], vec![[0.0; 3]; sample.len()]);
        Surface::value_gradient(self, &sample, &mut value, &mut gradient)?;
        let smallest = gradient
            .iter()
            .map(|g| g.iter().map(|v| v * v).sum::<f64>().sqrt())
            .filter(|g| *g > 0.0)
            .fold(f64::INFINITY, f64::min);
        let budget = TAIL * smallest * bounds.diagonal();
        Ok(if budget.is_finite() { budget / exps as f64 } else { 0.0 })
    }

    /// The same before any point of the surface is known: from the range of F on a coarse lattice.
    fn tail_in(&self, bounds: &Aabb) -> f64 {
        let exps = self.tape(0).exps;
        if exps == 0 {
            return 0.0;
        }
        const SIDE: usize = 5;
        let at = |i: usize, a: usize| {
            bounds.lo[a] + (bounds.hi[a] - bounds.lo[a]) * (i as f64 + 0.5) / SIDE as f64
        };
        let d = self.axes();
        let mut points = Vec::new();
        for i in 0..SIDE.pow(d as u32) {
            points.extend((0..d).map(|a| at(i / SIDE.pow(a as u32) % SIDE, a)));
        }
        let mut value = vec![0.0; points.len() / d];
        if self.value(&points, &mut value).is_err() {
            return 0.0;
        }
        let finite = value.iter().filter(|v| v.is_finite());
        let (lo, hi) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        if hi > lo { TAIL * (hi - lo) / exps as f64 } else { 0.0 }
    }

    /// A faster evaluator for points that stay where they are, within `margin`, while the parameters stay in
    /// `spans` (one interval a parameter): the tapes are pruned for both.
    pub fn narrowed_for(
        &self,
        points: &[[f64; 3]],
        margin: f64,
        spans: Option<&[Interval]>,
        options: RegionOptions,
    ) -> Result<Narrowed<'_>, FieldError> {
        self.no_intervals()?;
        let mut whole = self.whole();
        if let Some(spans) = spans {
            let expected = self.params.len();
            if spans.len() != expected {
                let (expected, given) = (format!("{expected} intervals"), spans.len().to_string());
                return Err(FieldError::Shape { what: "spans", expected, given });
            }
            whole.spans = self.tape(0).uniforms.evaluate(spans);
        }
        let leaves = whole.leaves(points, margin, options);
        Ok(Narrowed { whole, leaves })
    }
}

impl Surface for Field {
    fn axes(&self) -> usize {
        Field::axes(self)
    }

    fn any_thread(&self) -> bool {
        !self.is_opaque()
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<(), FieldError> {
        if let Some(sum) = self.bumps() {
            return sum.value_gradient(points, value, gradient);
        }
        if self.components() != 1 {
            return Err(FieldError::Invalid(format!(
                "a surface has one equation, this field has {}",
                self.components()
            )));
        }
        if Field::axes(self) == 3 {
            return self.gradient(points.as_flattened(), value, gradient.as_flattened_mut());
        }
        let mut packed = vec![0.0; points.len() * 2];
        self.gradient(&self.packed(points), value, &mut packed)?;
        unpack(&packed, gradient);
        Ok(())
    }

    fn hessian(&self, points: &[[f64; 3]], out: &mut [[f64; 6]]) -> Result<(), FieldError> {
        if let Some(sum) = self.bumps() {
            return sum.hessian(points, out);
        }
        let d = Field::axes(self);
        let mut full = vec![0.0; points.len() * d * d];
        Field::hessian(self, &self.packed(points), &mut full)?;
        crate::regions::upper(&full, d, out);
        Ok(())
    }

    fn narrowed<'a>(
        &'a self,
        points: &[[f64; 3]],
        margin: f64,
    ) -> Result<Option<Box<dyn Surface + 'a>>, FieldError> {
        if self.is_opaque() || self.components() != 1 || self.tape(0).len() <= SHORT || self.bumps().is_some()
        {
            return Ok(None);
        }
        let options = RegionOptions { tail: self.tail(points)?, ..Default::default() };
        if !self.tape(0).may_be_pruned(options.tail) {
            return Ok(None);
        }
        Ok(Some(Box::new(self.narrowed_for(points, margin, None, options)?)))
    }

    fn sketch<'a>(&'a self, error: f64) -> Option<Box<dyn Surface + 'a>> {
        self.bumps()?.sketch(error)
    }

    fn cells(&self, bounds: &Aabb, side: f64, most: usize) -> Option<Cells<'_>> {
        if let Some(sum) = self.bumps() {
            return sum.cells(bounds, side, most);
        }
        (!self.is_opaque() && self.components() == 1)
            .then(|| cells::search(self.whole(), bounds, side, most, self.tail_in(bounds)))
    }

    fn switches(&self) -> Option<Switches<'_>> {
        (!self.is_opaque() && self.components() == 1).then(|| Switches::new(self.whole()))
    }
}

impl Parametric for Field {
    fn freedom(&self) -> usize {
        self.params.iter().filter(|p| p.is_free()).count()
    }

    fn q(&self) -> Vec<f64> {
        Field::q(self)
    }

    fn set_q(&mut self, q: &[f64]) -> Result<(), FieldError> {
        Field::set_q(self, q)
    }

    fn limits(&self) -> Vec<(f64, f64)> {
        self.params.iter().filter(|p| p.is_free()).map(|p| p.bounds).collect()
    }

    fn scales(&self) -> Vec<f64> {
        self.params.iter().filter(|p| p.is_free()).map(|p| p.scale).collect()
    }

    fn parameter_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
        q_gradient: &mut [f64],
    ) -> Result<(), FieldError> {
        if Field::axes(self) == 3 {
            return self.parameter_gradient(
                points.as_flattened(),
                value,
                gradient.as_flattened_mut(),
                q_gradient,
            );
        }
        let mut packed = vec![0.0; points.len() * 2];
        self.parameter_gradient(&self.packed(points), value, &mut packed, q_gradient)?;
        unpack(&packed, gradient);
        Ok(())
    }

    fn sparse_parameter_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<SparseRows, FieldError> {
        if let Some(rows) = self.local_rows(points, value, gradient)? {
            return Ok(rows);
        }
        let m = self.freedom();
        let mut q = vec![0.0; points.len() * m];
        Parametric::parameter_gradient(self, points, value, gradient, &mut q)?;
        Ok(SparseRows::all(m, points.len(), q))
    }
}

/// Gradients in the plane as gradients in space.
fn unpack(packed: &[f64], gradient: &mut [[f64; 3]]) {
    for (g, p) in gradient.iter_mut().zip(packed.chunks_exact(2)) {
        *g = [p[0], p[1], 0.0];
    }
}
