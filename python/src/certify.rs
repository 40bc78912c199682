//! isoswarm-geometry for Python: proofs of topology.
use isoswarm_field::{Aabb, Field};
use isoswarm_geometry::{self as core, Certificate, CertifyOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::field::{Corners, Model};
use crate::watch::Watch;

/// Proves the topology of a surface as far as `boxes` boxes go, with the interpreter released.
#[pyfunction]
#[pyo3(signature = (model, *, lo, hi, boxes))]
pub fn certify<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    lo: [f64; 3],
    hi: [f64; 3],
    boxes: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let field = model.get().field()?.as_ref();
    dictionary(py, certificate(py, field, &Aabb::new(lo, hi), boxes)?)
}

/// The certificate, with the interpreter released.
pub fn certificate(py: Python<'_>, field: &Field, bounds: &Aabb, boxes: usize) -> PyResult<Certificate> {
    let mut watch = Watch::new(None, None);
    let found = py.detach(|| {
        let mut goes_on = |_| watch.look(None, |_, _| Ok(true)).is_continue();
        core::certify(field, bounds, CertifyOptions { boxes, goes_on: Some(&mut goes_on) })
    });
    match watch.raised {
        Some(raised) => Err(raised),
        None => found.map_err(errors::geometry),
    }
}

/// The certificate as Python's dataclass takes it.
fn dictionary(py: Python<'_>, c: Certificate) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("proven", c.proven)?;
    d.set_item("euler", c.euler)?;
    let components: Vec<(i64, i64, Option<Vec<usize>>)> =
        c.components.into_iter().map(|c| (c.euler, c.genus, c.inside)).collect();
    d.set_item("components", components)?;
    d.set_item("critical", (c.critical[0], c.critical[1], c.critical[2]))?;
    d.set_item("boxes", c.boxes)?;
    let doubtful: Vec<Corners> = c.doubtful.iter().map(|b| (b.lo, b.hi)).collect();
    d.set_item("doubtful", doubtful)?;
    d.set_item("reason", c.reason)?;
    Ok(d)
}
