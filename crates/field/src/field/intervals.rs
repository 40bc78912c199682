//! Intervals of a field and of its derivatives over boxes.

use super::Field;
use crate::interval::Interval;
use crate::scalar::Scalar;
use crate::{Dual, FieldError, MAX_AXES};

impl Field {
    /// The uniforms of a component as intervals, at the present values.
    pub(super) fn spans(&self, component: usize) -> Vec<Interval> {
        let values: Vec<Interval> = self.params.iter().map(|p| Interval::from_f64(p.value)).collect();
        self.tape(component).uniforms.evaluate(&values)
    }

    pub(super) fn no_intervals(&self) -> Result<(), FieldError> {
        match self.compiled.leaves.first() {
            None => Ok(()),
            Some(leaf) => Err(FieldError::Invalid(format!(
                "`{}` is an opaque function: it has no intervals; write it as a formula, or sample without them",
                leaf.name
            ))),
        }
    }

    /// Intervals of F over a box: one a component. An error where a part is opaque.
    pub fn interval(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let one = |c: usize| self.tape(c).interval(&self.spans(c), &inputs);
        Ok((0..self.components()).map(one).collect())
    }

    /// Intervals of ∂F/∂x over a box: (k, d).
    pub fn interval_gradient(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        let inputs = self.box_inputs(lo, hi)?;
        let mut out = Vec::new();
        for c in 0..self.components() {
            let mut gradient = vec![Interval::ZERO; self.axes()];
            self.tape(c).interval_gradient(&self.spans(c), &inputs, &mut gradient);
            out.extend(gradient);
        }
        Ok(out)
    }

    /// Intervals of the second derivatives over a box: (k, d, d).
    pub fn interval_hessian(&self, lo: &[f64], hi: &[f64]) -> Result<Vec<Interval>, FieldError> {
        use crate::plain::{Adjoints, forward, reverse};
        let (inputs, d) = (self.box_inputs(lo, hi)?, self.axes());
        let constant = |v| Dual { v, d: [Interval::ZERO; 3] };
        let mut out = Vec::new();
        for c in 0..self.components() {
            let tape = self.tape(c);
            let spans: Vec<Dual<Interval>> = self.spans(c).into_iter().map(constant).collect();
            let mut lanes = inputs.map(constant);
            for a in 0..d {
                lanes[a] = Dual::variable(inputs[a], a);
            }
            let (mut values, mut adjoints) = (Vec::new(), Adjoints::default());
            forward(tape, &spans, &lanes, &mut values);
            reverse(tape, &spans, &values, &mut adjoints);
            for i in 0..d {
                let row = tape.input(i).map_or([Interval::ZERO; 3], |at| adjoints.list[at].d);
                out.extend(&row[..d]);
            }
        }
        Ok(out)
    }

    pub(super) fn box_inputs(&self, lo: &[f64], hi: &[f64]) -> Result<[Interval; MAX_AXES], FieldError> {
        self.no_intervals()?;
        let d = self.axes();
        Self::expect("lo", lo, d)?;
        Self::expect("hi", hi, d)?;
        let mut inputs = [Interval::ZERO; MAX_AXES];
        for a in 0..d {
            // Written so that NaN fails too.
            if !matches!(
                lo[a].partial_cmp(&hi[a]),
                Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)
            ) {
                return Err(FieldError::Invalid(format!(
                    "a box needs lo <= hi, given [{}, {}] on axis {a}",
                    lo[a], hi[a]
                )));
            }
            inputs[a] = Interval::new(lo[a], hi[a]);
        }
        Ok(inputs)
    }
}
