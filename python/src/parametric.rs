//! Parametric surfaces for Python.
use isoswarm_geometry::mesh_patch;
use isoswarm_particles::Amount;
use isoswarm_particles::parametric::{Domain, Patch, Wrap};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors;
use crate::field::Model;
use crate::particles::evenness;

fn wrap(name: &str) -> PyResult<Wrap> {
    Ok(match name {
        "open" => Wrap::Open,
        "periodic" => Wrap::Periodic,
        "twisted" => Wrap::Twisted,
        _ => {
            return Err(PyValueError::new_err(format!("expected open, periodic or twisted, given {name:?}")));
        }
    })
}

/// Samples a parametric surface, a model of three components in the plane, and joins the samples by triangles where `faces`.
#[pyfunction]
#[pyo3(signature = (model, *, lo, hi, wraps, n, spacing, seed, most, faces))]
pub fn patch<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    lo: [f64; 2],
    hi: [f64; 2],
    wraps: [String; 2],
    n: Option<usize>,
    spacing: Option<f64>,
    seed: u64,
    most: usize,
    faces: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let field = model.get().field()?.as_ref();
    let domain = Domain { lo, hi, wrap: [wrap(&wraps[0])?, wrap(&wraps[1])?] };
    let amount = match (n, spacing) {
        (Some(n), None) => Amount::Count(n),
        (None, Some(spacing)) => Amount::Spacing(spacing),
        _ => return Err(PyValueError::new_err("expected either n or spacing")),
    };
    let made = py.detach(|| {
        let patch = Patch::new(field, domain)?;
        let samples = patch.sample(amount, seed, most)?;
        let mesh = faces.then(|| mesh_patch(&patch, &samples)).transpose()?;
        Ok((patch.poles(), samples, mesh))
    });
    let (poles, samples, mesh) = made.map_err(errors::particles)?;
    let d = PyDict::new(py);
    d.set_item("poles", poles)?;
    d.set_item("uv", arrays::from_rows(py, samples.uv)?)?;
    d.set_item("points", arrays::from_rows(py, samples.points)?)?;
    d.set_item("normals", arrays::from_rows(py, samples.normals)?)?;
    d.set_item("area", samples.area)?;
    d.set_item("spacing", samples.spacing)?;
    d.set_item("evenness", evenness(py, &samples.evenness)?)?;
    d.set_item("settled", samples.settled)?;
    if let Some(mesh) = mesh {
        let topology = mesh.topology();
        let rows: Vec<i64> = mesh.faces.iter().flatten().map(|v| i64::from(*v)).collect();
        d.set_item("faces", rows.into_pyarray(py).reshape([mesh.faces.len(), 3])?)?;
        d.set_item("euler", topology.total_euler())?;
        d.set_item("boundaries", topology.boundaries)?;
    }
    Ok(d)
}
