//! `isoswarm._core`: the Rust core as Python sees it. Glue only; one file for each core crate, and what they share.
mod arrays;
mod callback;
mod certify;
mod creases;
mod errors;
mod field;
mod geometry;
mod measure;
mod mesh;
mod parametric;
mod particles;
mod render;
mod scene;
mod watch;

use pyo3::prelude::*;

/// The Rust core of isoswarm. Use it through the package `isoswarm`, which documents and checks.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::certify::certify;
    #[pymodule_export]
    use crate::creases::Creases;
    #[pymodule_export]
    use crate::field::{Model, kinds};
    #[pymodule_export]
    use crate::geometry::{Cloud, animate, save_mesh, write_bytes};
    #[pymodule_export]
    use crate::measure::measures;
    #[pymodule_export]
    use crate::mesh::{LiveMesh, mesh, mesh_samples, triangle_quality};
    #[pymodule_export]
    use crate::parametric::patch;
    #[pymodule_export]
    use crate::particles::{measure, project, sample, surface_velocity};
    #[pymodule_export]
    use crate::render::{Solid, Triangles, colors, render};

    #[pymodule_export]
    use crate::scene::{Scene, format_of, read_script};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
