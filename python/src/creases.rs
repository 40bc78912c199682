//! isoswarm-particles for Python: creases.
use isoswarm_particles::creases as core;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays;

/// The creases of a surface: see `isoswarm.Creases`.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Creases {
    pub inner: core::Creases,
}

#[pymethods]
impl Creases {
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::from_rows(py, self.inner.points.clone())
    }

    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        numbers(py, &self.inner.corners)
    }

    /// Each edge: numbers of its points, whether it is closed, its length.
    fn edges<'py>(&self, py: Python<'py>) -> Vec<(Bound<'py, PyArray1<i64>>, bool, f64)> {
        self.inner.edges.iter().map(|e| (numbers(py, &e.points), e.closed, e.length)).collect()
    }

    #[getter]
    fn certified(&self) -> bool {
        self.inner.certified
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings.clone()
    }
}

fn numbers<'py>(py: Python<'py>, values: &[u32]) -> Bound<'py, PyArray1<i64>> {
    values.iter().map(|&v| i64::from(v)).collect::<Vec<_>>().into_pyarray(py)
}
