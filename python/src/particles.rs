//! isoswarm-particles for Python: sampling.
use isoswarm_field::{Aabb, Field};
use isoswarm_particles::{self as core, Amount, Density, Evenness, Method, Options, Report, Samples, Status};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::callback;
use crate::creases::Creases;
use crate::errors;
use crate::field::Model;
use crate::watch::Watch;

/// What is asked for, besides the surface.
struct Request {
    amount: Amount,
    bounds: Aabb,
    method: Method,
    density: Option<DensityRequest>,
    creases: bool,
    seed: u64,
    start: Option<Vec<[f64; 3]>>,
    most: usize,
    steps: Option<usize>,
    time_limit: Option<f64>,
    progress: Option<Py<PyAny>>,
}

/// A density other than uniform.
enum DensityRequest {
    /// By curvature.
    Curvature,
    /// By a checked batch function: (n, 3) to (n,).
    Function(Py<PyAny>),
}

/// The method by its name in Python.
fn method(name: &str) -> PyResult<Method> {
    Ok(match name {
        "floaters" => Method::Even,
        "random" => Method::Random,
        "adaptive" => Method::Adaptive,
        "simple" => Method::Simple,
        "fissioning" => Method::Fissioning,
        _ => {
            return Err(PyValueError::new_err(format!(
                "method: expected floaters, adaptive, simple, fissioning or random, given {name:?}"
            )));
        }
    })
}

/// Samples a surface with the interpreter released; columns and report as a dictionary. Exactly one of `n` and
/// `spacing` is given; what the user passed has been checked for its type.
#[pyfunction]
#[pyo3(signature = (model, *, n, spacing, lo, hi, method, density, creases, seed, start, most, steps, time_limit, progress))]
pub fn sample<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    n: Option<usize>,
    spacing: Option<f64>,
    lo: [f64; 3],
    hi: [f64; 3],
    method: &str,
    density: Option<Bound<'py, PyAny>>,
    creases: bool,
    seed: u64,
    start: Option<PyReadonlyArray2<'py, f64>>,
    most: usize,
    steps: Option<usize>,
    time_limit: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let amount = match (n, spacing) {
        (Some(n), None) => Amount::Count(n),
        (None, Some(spacing)) => Amount::Spacing(spacing),
        _ => return Err(PyValueError::new_err("expected either n or spacing")),
    };
    let request = Request {
        amount,
        bounds: Aabb::new(lo, hi),
        method: self::method(method)?,
        density: density.map(|d| {
            if d.is_callable() { DensityRequest::Function(d.unbind()) } else { DensityRequest::Curvature }
        }),
        creases,
        seed,
        start: start.map(|points| arrays::points("start", &points)).transpose()?,
        most,
        steps,
        time_limit,
        progress,
    };
    let field = model.get().field()?.as_ref();
    let samples = py.detach(|| run(field, request))?;
    columns(py, samples)
}

/// Runs detached; takes the interpreter back only for the user's functions and for Ctrl-C.
fn run(field: &Field, request: Request) -> PyResult<Samples> {
    let mut watch = Watch::new(request.progress, request.time_limit);
    let here = field.is_opaque() || matches!(request.density, Some(DensityRequest::Function(_)));
    let result = watch.over(here, |progress| {
        let function;
        let density = match &request.density {
            None => Density::Uniform,
            Some(DensityRequest::Curvature) => Density::Curvature,
            Some(DensityRequest::Function(f)) => {
                function = |points: &[[f64; 3]], out: &mut [f64]| {
                    Python::attach(|py| callback::call(py, f, points, out)).map_err(callback::keep)
                };
                Density::Function(&function)
            }
        };
        core::sample(
            field,
            &request.bounds,
            Options {
                amount: request.amount,
                method: request.method,
                density,
                creases: request.creases.then_some(core::creases::find),
                more: false,
                even_creases: false,
                seed: request.seed,
                start: request.start.as_deref(),
                most: request.most,
                steps: request.steps,
                progress: Some(progress),
            },
        )
    });
    match watch.raised {
        Some(error) => Err(error),
        None => result.map_err(errors::particles),
    }
}

/// The result as Python's `Samples` takes it.
fn columns(py: Python<'_>, samples: Samples) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("points", arrays::from_rows(py, samples.points)?)?;
    d.set_item("normals", arrays::from_rows(py, samples.normals)?)?;
    d.set_item("radii", arrays::from_column(py, samples.radii))?;
    d.set_item("areas", arrays::from_column(py, samples.areas))?;
    d.set_item("curvatures", arrays::from_rows(py, samples.curvatures)?)?;
    let component: Vec<i64> = samples.component.into_iter().map(i64::from).collect();
    d.set_item("component", numpy::IntoPyArray::into_pyarray(component, py))?;
    d.set_item("creases", samples.creases.map(|inner| Creases { inner }))?;
    d.set_item("report", report(py, &samples.report)?)?;
    Ok(d)
}

/// The report as Python's `Report` takes it.
fn report<'py>(py: Python<'py>, r: &Report) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("status", r.status.name())?;
    d.set_item(
        "reason",
        match &r.status {
            Status::NotConverged(reason) => reason.as_str(),
            Status::Converged | Status::Empty => "",
        },
    )?;
    d.set_item("components", r.components)?;
    d.set_item("certified", r.certified)?;
    d.set_item("resolution", r.resolution)?;
    d.set_item("max_error", r.max_error)?;
    d.set_item("evenness", evenness(py, &r.evenness)?)?;
    d.set_item("spacing", r.spacing)?;
    d.set_item("area", r.area)?;
    d.set_item("on_bounds", r.on_bounds)?;
    d.set_item("singular", r.singular)?;
    d.set_item("steps", r.steps)?;
    d.set_item("evaluations", r.evaluations)?;
    d.set_item("births", r.births)?;
    d.set_item("deaths", r.deaths)?;
    d.set_item("warnings", &r.warnings)?;
    Ok(d)
}

/// How evenly points lie; `bounds` is the box that clips the surface.
#[pyfunction]
pub fn measure<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
    bounds: Option<([f64; 3], [f64; 3])>,
    axes: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (points, normals) = (arrays::points("points", &points)?, arrays::points("normals", &normals)?);
    if points.len() != normals.len() {
        let (n, m) = (points.len(), normals.len());
        return Err(PyValueError::new_err(format!(
            "normals: expected {n} rows, one for each point, given {m}"
        )));
    }
    let bounds = bounds.map(|(lo, hi)| Aabb::new(lo, hi));
    let found = py.detach(|| core::metrics::evenness(&points, &normals, bounds.as_ref(), axes));
    evenness(py, &found)
}

/// Evenness as Python's dataclass takes it.
pub fn evenness<'py>(py: Python<'py>, found: &Evenness) -> PyResult<Bound<'py, PyDict>> {
    let e = PyDict::new(py);
    e.set_item("rho_min", found.rho_min)?;
    e.set_item("rho_avg", found.rho_avg)?;
    e.set_item("cv", found.cv)?;
    e.set_item("six_valent", found.six_valent)?;
    e.set_item("coverage", found.coverage)?;
    Ok(e)
}

/// The points moved onto the surface, and the distance |F|/|∇F| that is left at each.
#[pyfunction]
pub fn project<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    points: PyReadonlyArray2<'py, f64>,
    size: f64,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
    let surface = model.get().field()?.as_ref();
    let mut points = arrays::points("X", &points)?;
    let left = py.detach(|| core::project(surface, &mut points, size)).map_err(errors::field)?;
    Ok((arrays::from_rows(py, points)?, arrays::from_column(py, left)))
}

/// Velocities of points of a moving surface that keep their normals, or turn them with `spin`, (n, 3). `rates` are those of
/// parameters, by their paths; the others rest.
#[pyfunction]
pub fn surface_velocity<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    points: PyReadonlyArray2<'py, f64>,
    rates: Vec<(String, f64)>,
    spin: [f64; 3],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let field = model.get().field()?.as_ref();
    let points = arrays::points("X", &points)?;
    let free = field.free();
    let mut change = vec![0.0; free.len()];
    for (path, rate) in rates {
        let number = field.parameter(&path).map_err(errors::field)?;
        let Some(k) = free.iter().position(|&i| i == number) else {
            let message = format!("rates: {path} is frozen or discrete, it does not change");
            return Err(PyValueError::new_err(message));
        };
        change[k] = rate;
    }
    let velocity =
        py.detach(|| core::surface_velocity(field, &points, &change, spin)).map_err(errors::field)?;
    arrays::from_rows(py, velocity)
}
