//! Python functions as opaque leaves. They are called on the calling thread, once for all points.
use std::cell::RefCell;

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

/// A batch function and its gradient, already wrapped so that their answers are checked.
pub struct Function {
    /// In messages and files.
    pub name: String,
    /// (n, 3) to (n,).
    pub value: Py<PyAny>,
    /// (n, 3) to (n, 3).
    pub gradient: Option<Py<PyAny>>,
    /// Where the surface is.
    pub bounds: Option<Aabb>,
}

impl Function {
    fn failed(&self, error: PyErr) -> FieldError {
        FieldError::Callback { name: self.name.clone(), reason: keep(error) }
    }
}

impl Callback for Function {
    fn name(&self) -> &str {
        &self.name
    }

    fn value(&self, points: &[[f64; 3]], value: &mut [f64]) -> Result<(), FieldError> {
        Python::attach(|py| call(py, &self.value, points, value)).map_err(|e| self.failed(e))
    }

    fn value_gradient(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Option<Result<(), FieldError>> {
        let function = self.gradient.as_ref()?;
        Some(
            Python::attach(|py| {
                call(py, &self.value, points, value)?;
                let answer = function.call1(py, (arrays::from_rows(py, points.to_vec())?,))?;
                let rows: PyReadonlyArray2<'_, f64> = answer.extract(py)?;
                gradient.copy_from_slice(&arrays::points(&self.name, &rows)?);
                Ok(())
            })
            .map_err(|e| self.failed(e)),
        )
    }

    fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }
}

/// Fills `out` from a batch function.
pub fn call(py: Python<'_>, f: &Py<PyAny>, points: &[[f64; 3]], out: &mut [f64]) -> PyResult<()> {
    let answer = f.call1(py, (arrays::from_rows(py, points.to_vec())?,))?;
    let values: PyReadonlyArray1<'_, f64> = answer.extract(py)?;
    out.copy_from_slice(&arrays::column(&values));
    Ok(())
}
