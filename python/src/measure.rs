//! isoswarm-geometry for Python: measures.
use isoswarm_field::{Aabb, Field};
use isoswarm_geometry::{
    self as core, Estimate, GeometryError, Integrand, MeasureOptions, Measures, MeshOptions, Meshed, Moment,
    Resolution,
};
use isoswarm_particles::{Samples, Status};
use numpy::{PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::callback;
use crate::errors;
use crate::field::Model;
use crate::mesh::bare_samples;
use crate::watch::Watch;

/// Measures a surface with the interpreter released. Either `n` or `spacing` is given, or the columns of samples, whose
/// places the mesh's vertices keep. `integrands` are checked batch functions of (n, 6) arrays: points and normals.
#[pyfunction]
#[pyo3(signature = (model, *, n, spacing, samples, lo, hi, seed, tolerance, most, curvature, integrands))]
pub fn measures<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    n: Option<usize>,
    spacing: Option<f64>,
    samples: Option<(
        PyReadonlyArray2<'py, f64>,
        PyReadonlyArray2<'py, f64>,
        PyReadonlyArray1<'py, f64>,
        usize,
    )>,
    lo: [f64; 3],
    hi: [f64; 3],
    seed: u64,
    tolerance: f64,
    most: usize,
    curvature: bool,
    integrands: Vec<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let surface = model.get().field()?.as_ref();
    let bounds = Aabb::new(lo, hi);
    let given = samples
        .map(|(points, normals, radii, components)| {
            bare_samples(&points, &normals, &radii, components, Status::Converged)
        })
        .transpose()?;
    let resolution = match (n, spacing) {
        (Some(n), _) => Resolution::Count(n),
        (None, spacing) => Resolution::Spacing(spacing.unwrap_or(f64::NAN)),
    };
    let request =
        Request { samples: given, resolution, bounds, seed, tolerance, most, curvature, integrands };
    let (Meshed { mesh, report }, found) = py.detach(|| run(surface, &request))?;
    let out = dictionary(py, found)?;
    out.set_item("warnings", report.warnings)?;
    out.set_item("points", arrays::from_rows(py, mesh.points)?)?;
    let faces: Vec<i64> = mesh.faces.iter().flatten().map(|v| i64::from(*v)).collect();
    let count = mesh.faces.len();
    out.set_item("faces", numpy::IntoPyArray::into_pyarray(faces, py).reshape([count, 3])?)?;
    Ok(out)
}

/// What is asked for, besides the surface.
struct Request {
    samples: Option<Samples>,
    resolution: Resolution,
    bounds: Aabb,
    seed: u64,
    tolerance: f64,
    most: usize,
    curvature: bool,
    integrands: Vec<Py<PyAny>>,
}

/// Runs on the calling thread, detached; takes the interpreter back only for the user's functions and for Ctrl-C.
fn run(surface: &Field, request: &Request) -> PyResult<(Meshed, Measures)> {
    let mut watch = Watch::new(None, None);
    let meshed = match &request.samples {
        Some(samples) => {
            let options = MeshOptions { smoothing: 0, intersections: false, ..Default::default() };
            core::mesh_samples(surface, &request.bounds, samples, &options)
        }
        None => {
            let (resolution, seed) = (request.resolution, request.seed);
            watch.over(surface.is_opaque(), |progress| {
                let options = MeshOptions {
                    resolution,
                    seed,
                    intersections: false,
                    progress: Some(progress),
                    ..Default::default()
                };
                core::mesh(surface, &request.bounds, options)
            })
        }
    };
    if let Some(raised) = watch.raised {
        return Err(raised);
    }
    let meshed = meshed.map_err(errors::particles)?;
    if meshed.mesh.faces.is_empty() {
        return Err(PyValueError::new_err(
            "the surface has no triangles in the bounds: there is nothing to measure",
        ));
    }
    let functions: Vec<Box<Integrand<'_>>> = request.integrands.iter().map(integrand).collect();
    let mut goes_on = |_| watch.look(None, |_, _| Ok(true)).is_continue();
    let options = MeasureOptions {
        tolerance: request.tolerance,
        most: request.most,
        bounds: Some(request.bounds),
        curvature: request.curvature,
        integrands: functions.iter().map(AsRef::as_ref).collect(),
        goes_on: Some(&mut goes_on),
        ..Default::default()
    };
    let found = core::measure(surface, &meshed.mesh, options);
    if let Some(raised) = watch.raised {
        return Err(raised);
    }
    match found {
        Ok(found) => Ok((meshed, found)),
        Err(error @ GeometryError::Integrand(_)) => {
            Err(callback::raised().unwrap_or_else(|| errors::geometry(error)))
        }
        Err(error) => Err(errors::geometry(error)),
    }
}

/// A batch function of points and normals for the core.
fn integrand(f: &Py<PyAny>) -> Box<Integrand<'_>> {
    Box::new(move |points, normals, out| {
        let rows: Vec<[f64; 6]> =
            points.iter().zip(normals).map(|(p, n)| [p[0], p[1], p[2], n[0], n[1], n[2]]).collect();
        Python::attach(|py| {
            let answer = f.bind(py).call1((arrays::from_rows(py, rows)?,))?;
            let values: PyReadonlyArray1<'_, f64> = answer.extract()?;
            out.copy_from_slice(&arrays::column(&values));
            Ok(())
        })
        .map_err(callback::keep)
    })
}

fn pair(e: Estimate) -> (f64, f64) {
    (e.value, e.error)
}

fn moment(m: &Moment) -> (Vec<(f64, f64)>, Vec<(f64, f64)>) {
    (m.centroid.iter().map(|e| pair(*e)).collect(), m.inertia.iter().map(|e| pair(*e)).collect())
}

/// The measures as Python's dataclass takes them: an estimate is a pair.
fn dictionary(py: Python<'_>, m: Measures) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("area", pair(m.area))?;
    d.set_item("volume", m.volume.map(pair))?;
    d.set_item("solid", m.solid.as_ref().map(moment))?;
    d.set_item("shell", moment(&m.shell))?;
    d.set_item("mean_curvature", m.mean_curvature.map(pair))?;
    d.set_item("gaussian_curvature", m.gaussian_curvature.map(pair))?;
    d.set_item("willmore", m.willmore.map(pair))?;
    d.set_item("thin_plate", m.thin_plate.map(pair))?;
    d.set_item("euler", m.euler)?;
    d.set_item("gauss_bonnet", m.gauss_bonnet)?;
    d.set_item("integrals", m.integrals.into_iter().map(pair).collect::<Vec<_>>())?;
    d.set_item("weights", arrays::from_column(py, m.weights))?;
    d.set_item("places", arrays::from_rows(py, m.places)?)?;
    d.set_item("notes", m.notes)?;
    d.set_item("reliable", m.reliable)?;
    Ok(d)
}
