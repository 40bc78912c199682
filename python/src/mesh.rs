//! isoswarm-geometry for Python: meshes of surfaces.
use isoswarm_field::Aabb;
use isoswarm_geometry::{
    self as core, FaceQuality, Mesh, MeshOptions, MeshReport, Meshed, Quality, Resolution, Rule,
};
use isoswarm_particles::{Density, Report, Samples, Status};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::callback;
use crate::creases::Creases;
use crate::errors;
use crate::field::Model;
use crate::watch::Watch;

/// The rule by its name in Python.
fn rule(name: &str) -> PyResult<Rule> {
    match name {
        "delaunay" => Ok(Rule::Delaunay),
        "circumsphere" => Ok(Rule::Circumsphere),
        _ => Err(PyValueError::new_err(format!("rule: expected delaunay or circumsphere, given {name:?}"))),
    }
}

/// Meshes a surface with the interpreter released; columns and report as a dictionary. Exactly one of `n`, `spacing` and `error`
/// is given. `proof`: the box in which the topology is proven to compare the mesh with, and the number of boxes for that.
#[pyfunction]
#[pyo3(signature = (model, *, n, spacing, error, lo, hi, rule, density, creases, smoothing, intersections, seed, most, time_limit,
    progress, proof))]
pub fn mesh<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    n: Option<usize>,
    spacing: Option<f64>,
    error: Option<f64>,
    lo: [f64; 3],
    hi: [f64; 3],
    rule: &str,
    density: Option<Bound<'py, PyAny>>,
    creases: bool,
    smoothing: Option<usize>,
    intersections: bool,
    seed: u64,
    most: usize,
    time_limit: Option<f64>,
    progress: Option<Py<PyAny>>,
    proof: Option<([f64; 3], [f64; 3], usize)>,
) -> PyResult<Bound<'py, PyDict>> {
    let resolution = match (n, spacing, error) {
        (Some(n), None, None) => Resolution::Count(n),
        (None, Some(spacing), None) => Resolution::Spacing(spacing),
        (None, None, Some(error)) => Resolution::Error(error),
        _ => return Err(PyValueError::new_err("expected one of n, spacing and error")),
    };
    let rule = self::rule(rule)?;
    let curvature = density.as_ref().is_some_and(|d| !d.is_callable());
    let density = density.filter(|d| d.is_callable()).map(Bound::unbind);
    let surface = model.get().field()?.as_ref();
    let mut made = py.detach(|| {
        let mut watch = Watch::new(progress, time_limit);
        let result = watch.over(surface.is_opaque() || density.is_some(), |progress| {
            let function = |points: &[[f64; 3]], out: &mut [f64]| match &density {
                Some(f) => Python::attach(|py| callback::call(py, f, points, out)).map_err(callback::keep),
                None => Ok(()),
            };
            let density = match (&density, curvature) {
                (Some(_), _) => Density::Function(&function),
                (None, true) => Density::Curvature,
                (None, false) => Density::Uniform,
            };
            let mut options = MeshOptions {
                resolution,
                rule,
                density,
                creases,
                intersections,
                seed,
                most,
                progress: Some(progress),
                ..Default::default()
            };
            options.smoothing = smoothing.unwrap_or(options.smoothing);
            core::mesh(surface, &Aabb::new(lo, hi), options)
        });
        match watch.raised {
            Some(error) => Err(error),
            None => result.map_err(errors::particles),
        }
    })?;
    if let Some((lo, hi, boxes)) = proof {
        made.report.certify(&crate::certify::certificate(py, surface, &Aabb::new(lo, hi), boxes)?);
    }
    columns(py, made)
}

/// Meshes samples.
#[pyfunction]
#[pyo3(signature = (model, points, normals, radii, creases, *, components, unmet, lo, hi, rule, smoothing, intersections))]
pub fn mesh_samples<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    points: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
    radii: PyReadonlyArray1<'py, f64>,
    creases: Option<Bound<'py, Creases>>,
    components: usize,
    unmet: String,
    lo: [f64; 3],
    hi: [f64; 3],
    rule: &str,
    smoothing: Option<usize>,
    intersections: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let status = if unmet.is_empty() { Status::Converged } else { Status::NotConverged(unmet) };
    let samples = Samples {
        creases: creases.map(|c| c.get().inner.clone()),
        ..bare_samples(&points, &normals, &radii, components, status)?
    };
    let rule = self::rule(rule)?;
    let surface = model.get().field()?.as_ref();
    let work = || {
        let mut options = MeshOptions { rule, intersections, ..Default::default() };
        options.smoothing = smoothing.unwrap_or(options.smoothing);
        core::mesh_samples(surface, &Aabb::new(lo, hi), &samples, &options)
    };
    let made = py.detach(work).map_err(errors::particles)?;
    columns(py, made)
}

/// Samples as far as the mesher looks at them.
pub fn bare_samples(
    points: &PyReadonlyArray2<'_, f64>,
    normals: &PyReadonlyArray2<'_, f64>,
    radii: &PyReadonlyArray1<'_, f64>,
    components: usize,
    status: Status,
) -> PyResult<Samples> {
    Ok(Samples {
        points: arrays::points("points", points)?,
        normals: arrays::points("normals", normals)?,
        radii: arrays::column(radii),
        report: Report { status, components, ..Report::default() },
        ..Samples::default()
    })
}

/// A mesh that follows a swarm.
#[pyclass(module = "isoswarm._core")]
pub struct LiveMesh(core::LiveMesh);

#[pymethods]
impl LiveMesh {
    #[new]
    fn new(lo: [f64; 3], hi: [f64; 3]) -> Self {
        Self(core::LiveMesh::new(Aabb::new(lo, hi)))
    }

    /// Follows the floaters; columns and report as a dictionary.
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        normals: PyReadonlyArray2<'py, f64>,
        ids: PyReadonlyArray1<'py, u64>,
        spacing: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (points, normals) = (arrays::points("points", &points)?, arrays::points("normals", &normals)?);
        let ids = arrays::column(&ids);
        if points.len() != normals.len() || points.len() != ids.len() {
            return Err(PyValueError::new_err("expected a normal and an identity for each point"));
        }
        let made = py.detach(|| {
            let done = self.0.update(&points, &normals, &ids, spacing);
            let mut mesh = self.0.mesh().clone();
            mesh.curvatures = vec![[f64::NAN; 2]; mesh.points.len()];
            let (topology, quality) = rayon::join(|| mesh.topology(), || mesh.quality());
            let report = MeshReport {
                topology,
                quality,
                max_distance: f64::NAN,
                flips: done.flips,
                inserted: done.born,
                removed: done.died,
                ..MeshReport::default()
            };
            Meshed { mesh, report }
        });
        columns(py, made)
    }
}

/// Quality of triangles: of each as columns, and of all.
#[pyfunction]
pub fn triangle_quality<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    faces: PyReadonlyArray2<'py, i64>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let mesh = Mesh::new(arrays::points("points", &points)?, arrays::faces(&faces)?);
    let n = mesh.points.len();
    if let Some(f) = mesh.faces.iter().find(|f| f.iter().any(|&v| v as usize >= n)) {
        return Err(PyValueError::new_err(format!("faces: expected vertex numbers below {n}, given {f:?}")));
    }
    let (each, all) = py.detach(|| (mesh.face_quality(), mesh.quality()));
    let d = PyDict::new(py);
    let column = |f: fn(&FaceQuality) -> f64| arrays::from_column(py, each.iter().map(f).collect());
    d.set_item("q", column(|t| t.q))?;
    d.set_item("radius_ratio", column(|t| t.radius_ratio))?;
    d.set_item("smallest_angle", column(|t| t.smallest_angle.to_degrees()))?;
    d.set_item("largest_angle", column(|t| t.largest_angle.to_degrees()))?;
    Ok((d, quality(py, &all)?))
}

fn columns(py: Python<'_>, made: Meshed) -> PyResult<Bound<'_, PyDict>> {
    let Meshed { mesh, report: r } = made;
    let d = PyDict::new(py);
    d.set_item("report", report(py, &r)?)?;
    d.set_item(
        "component",
        r.topology.component.iter().map(|&c| i64::from(c as i32)).collect::<Vec<_>>().into_pyarray(py),
    )?;
    d.set_item("points", arrays::from_rows(py, mesh.points)?)?;
    d.set_item("normals", arrays::from_rows(py, mesh.normals)?)?;
    d.set_item("curvatures", arrays::from_rows(py, mesh.curvatures)?)?;
    let n = mesh.faces.len();
    let faces: Vec<i64> = mesh.faces.into_flattened().into_iter().map(i64::from).collect();
    d.set_item("faces", numpy::PyArrayMethods::reshape(&faces.into_pyarray(py), [n, 3])?)?;
    d.set_item("ids", mesh.ids.into_pyarray(py))?;
    let corners = match mesh.corner_normals.len() {
        0 => None,
        n => {
            let rows = arrays::from_rows(py, mesh.corner_normals.into_flattened())?;
            Some(numpy::PyArrayMethods::reshape(&rows, [n, 3, 3])?)
        }
    };
    d.set_item("corner_normals", corners)?;
    Ok(d)
}

fn report<'py>(py: Python<'py>, r: &MeshReport) -> PyResult<Bound<'py, PyDict>> {
    let t = &r.topology;
    let d = PyDict::new(py);
    d.set_item("vertices", t.vertices)?;
    d.set_item("edges", t.edges)?;
    d.set_item("faces", t.faces)?;
    d.set_item("components", t.components())?;
    d.set_item("boundaries", t.boundaries)?;
    d.set_item("euler", t.total_euler())?;
    d.set_item("genus", t.genus())?;
    d.set_item("closed", t.is_closed())?;
    d.set_item("manifold", t.is_manifold())?;
    d.set_item("faults", t.faults.iter().map(ToString::to_string).collect::<Vec<_>>())?;
    d.set_item("sound", r.is_sound())?;
    d.set_item("quality", quality(py, &r.quality)?)?;
    d.set_item("max_distance", r.max_distance)?;
    d.set_item("self_intersections", r.self_intersections.len())?;
    d.set_item("inserted", r.inserted)?;
    d.set_item("removed", r.removed)?;
    d.set_item("filled", r.filled)?;
    d.set_item("flips", r.flips)?;
    d.set_item("evaluations", r.evaluations)?;
    d.set_item("doubtful", arrays::from_rows(py, r.doubtful.clone())?)?;
    d.set_item("certified", r.certified)?;
    d.set_item("warnings", &r.warnings)?;
    Ok(d)
}

fn quality<'py>(py: Python<'py>, q: &Quality) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("q_avg", q.q_avg)?;
    d.set_item("q_min", q.q_min)?;
    d.set_item("radius_ratio_avg", q.radius_ratio_avg)?;
    d.set_item("radius_ratio_min", q.radius_ratio_min)?;
    d.set_item("smallest_angle", q.smallest_angle)?;
    d.set_item("smallest_angle_avg", q.smallest_angle_avg)?;
    d.set_item("largest_angle", q.largest_angle)?;
    d.set_item("below_30", q.below_30)?;
    d.set_item("six_valent", q.six_valent)?;
    d.set_item("valence", (q.valence[0], q.valence[1]))?;
    Ok(d)
}
