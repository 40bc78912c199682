//! Python functions as opaque leaves. They are called on the calling thread, once for all points.
use std::cell::RefCell;

use isoswarm_field::model::Param;
use isoswarm_field::{Aabb, Callback, FieldError};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;

thread_local! {
    /// The exception behind the last error that was passed through the core, which carries text only.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// Keeps the exception until [`raised`] asks for it; its text.
pub fn keep(error: PyErr) -> String {
    let message = error.to_string();
    RAISED.set(Some(error));
    message
}

/// The exception that was kept, if any.
pub fn raised() -> Option<PyErr> {
    RAISED.take()
}

/// A batch function with its derivatives, already wrapped so that their answers are checked. Each takes the points and
/// the values of the parameters.
pub struct Function {
    /// In messages and files.
    pub name: String,
    /// The function's own parameters: name and value.
    pub parameters: Vec<(String, f64)>,
    /// (n, 3) to (n,).
    pub value: Py<PyAny>,
    /// (n, 3) to (n, 3).
    pub gradient: Option<Py<PyAny>>,
    /// (n, 3) to (n, p), one column a parameter.
    pub parameter_gradient: Option<Py<PyAny>>,
    /// Where the surface is.
    pub bounds: Option<Aabb>,
}

impl Function {
    fn attach(&self, work: impl FnOnce(Python<'_>) -> PyResult<()>) -> Result<(), FieldError> {
        Python::attach(work).map_err(|e| FieldError::Callback { name: self.name.clone(), reason: keep(e) })
    }
}

impl Callback for Function {
    fn name(&self) -> &str {
        &self.name
    }

    fn parameters(&self) -> Vec<Param> {
        self.parameters.iter().map(|(name, value)| Param::new(name.as_str(), *value)).collect()
    }

    fn value(&self, points: &[[f64; 3]], q: &[f64], value: &mut [f64]) -> Result<(), FieldError> {
        self.attach(|py| fill(answer(py, &self.value, points, q)?, value))
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        q: &[f64],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Option<Result<(), FieldError>> {
        let function = self.gradient.as_ref()?;
        Some(self.attach(|py| {
            fill(answer(py, &self.value, points, q)?, value)?;
            let rows: PyReadonlyArray2<'_, f64> = answer(py, function, points, q)?.extract()?;
            gradient.copy_from_slice(&arrays::points(&self.name, &rows)?);
            Ok(())
        }))
    }

    fn parameter_gradient(
        &self,
        points: &[[f64; 3]],
        q: &[f64],
        slopes: &mut [f64],
    ) -> Option<Result<(), FieldError>> {
        let function = self.parameter_gradient.as_ref()?;
        Some(self.attach(|py| {
            let rows: PyReadonlyArray2<'_, f64> = answer(py, function, points, q)?.extract()?;
            slopes.iter_mut().zip(rows.as_array()).for_each(|(slope, v)| *slope = *v);
            Ok(())
        }))
    }

    fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }
}

/// What a function of points and parameters answers.
fn answer<'py>(
    py: Python<'py>,
    f: &Py<PyAny>,
    points: &[[f64; 3]],
    q: &[f64],
) -> PyResult<Bound<'py, PyAny>> {
    f.bind(py).call1((arrays::from_rows(py, points.to_vec())?, q.to_vec()))
}

fn fill(answer: Bound<'_, PyAny>, out: &mut [f64]) -> PyResult<()> {
    let values: PyReadonlyArray1<'_, f64> = answer.extract()?;
    out.copy_from_slice(&arrays::column(&values));
    Ok(())
}

/// Fills `out` from a batch function without parameters.
pub fn call(py: Python<'_>, f: &Py<PyAny>, points: &[[f64; 3]], out: &mut [f64]) -> PyResult<()> {
    fill(answer(py, f, points, &[])?, out)
}
