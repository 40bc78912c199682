//! `isoswarm._core`: the Rust core as Python sees it. Glue only; one file per core crate.
use pyo3::prelude::*;

/// The Rust core of isoswarm. Use it through the package `isoswarm`, which documents and checks.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
