//! isoswarm-geometry for Python: files and pictures.
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use isoswarm_geometry::{self as core, Background, GeometryError, Mesh, Picture, PictureOptions, PointCloud};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays;
use crate::errors;

/// Points and their columns, copied from Python.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Cloud {
    points: Vec<[f64; 3]>,
    normals: Option<Vec<[f64; 3]>>,
    radii: Option<Vec<f64>>,
    areas: Option<Vec<f64>>,
    curvatures: Option<Vec<[f64; 2]>>,
    colors: Option<Vec<[f64; 3]>>,
}

impl Cloud {
    pub fn borrowed(&self) -> PointCloud<'_> {
        PointCloud {
            points: &self.points,
            normals: self.normals.as_deref(),
            radii: self.radii.as_deref(),
            areas: self.areas.as_deref(),
            curvatures: self.curvatures.as_deref(),
            colors: self.colors.as_deref(),
        }
    }
}

#[pymethods]
impl Cloud {
    #[new]
    #[pyo3(signature = (points, normals=None, radii=None, areas=None, curvatures=None, colors=None))]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        normals: Option<PyReadonlyArray2<'_, f64>>,
        radii: Option<PyReadonlyArray1<'_, f64>>,
        areas: Option<PyReadonlyArray1<'_, f64>>,
        curvatures: Option<PyReadonlyArray2<'_, f64>>,
        colors: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        Ok(Self {
            points: arrays::points("points", &points)?,
            normals: normals.map(|a| arrays::points("normals", &a)).transpose()?,
            radii: radii.map(|a| arrays::column(&a)),
            areas: areas.map(|a| arrays::column(&a)),
            curvatures: curvatures.map(|a| arrays::rows("curvatures", &a)).transpose()?,
            colors: colors.map(|a| arrays::points("colors", &a)).transpose()?,
        })
    }

    /// Writes the file that the ending asks for: .ply, .obj, .csv or .npz; whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| core::save(path, &self.borrowed())).map_err(errors::geometry)
    }

    /// A picture as (height, width, PNG).
    #[pyo3(signature = (*, width, height, azimuth, elevation, style, coloring, transparent, disc_scale, supersampling,
        frame=None, ground=true))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        width: u32,
        height: u32,
        azimuth: f64,
        elevation: f64,
        style: &str,
        coloring: &str,
        transparent: bool,
        disc_scale: Option<f64>,
        supersampling: u32,
        frame: Option<PyReadonlyArray2<'py, f64>>,
        ground: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let mut options = PictureOptions {
            width,
            height,
            azimuth,
            elevation,
            style: style.parse().map_err(errors::geometry)?,
            disc_scale,
            supersampling,
            ground,
            ..PictureOptions::default()
        };
        options.coloring = coloring.parse().map_err(errors::geometry)?;
        if transparent {
            options.background = Background::Transparent;
        }
        let frame = frame.map(|points| arrays::points("frame", &points)).transpose()?;
        let png = interruptible(py, |stop| {
            core::render_framed(&self.borrowed(), frame.as_deref(), &options, stop)
                .and_then(|picture: Picture| picture.to_png())
        })?;
        Ok(PyBytes::new(py, &png))
    }
}

/// Runs `work` on another thread, so that this one can see Ctrl-C and tell it to stop.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> Result<T, GeometryError> + Send,
) -> PyResult<T> {
    watched(py, None, |stop, _| work(stop))
}

/// [`interruptible`] that tells a Python function every 50 ms what part of the work is done; an exception there ends it.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&AtomicBool, &(dyn Fn(f64) + Sync)) -> Result<T, GeometryError> + Send,
) -> PyResult<T> {
    const REPORTS: Duration = Duration::from_millis(50);
    let stop = AtomicBool::new(false);
    let part = AtomicU64::new(0);
    // Parts are positive: their bits are in their order.
    let told = |done: f64| {
        part.fetch_max(done.max(0.0).to_bits(), Ordering::Relaxed);
    };
    std::thread::scope(|scope| {
        let worker = scope.spawn(|| work(&stop, &told));
        let mut raised = None;
        let mut next = Instant::now() + REPORTS;
        while !worker.is_finished() {
            py.detach(|| std::thread::sleep(Duration::from_millis(2)));
            let mut asked = py.check_signals();
            if let (Some(f), true) = (progress, asked.is_ok() && Instant::now() >= next) {
                next = Instant::now() + REPORTS;
                asked = f.call1(py, (f64::from_bits(part.load(Ordering::Relaxed)),)).map(drop);
            }
            if let (None, Err(error)) = (&raised, asked) {
                stop.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
        }
        let result = py.detach(|| worker.join());
        match (raised, result) {
            (Some(error), _) => Err(error),
            (None, Ok(result)) => result.map_err(errors::geometry),
            (None, Err(panic)) => std::panic::resume_unwind(panic),
        }
    })
}

/// Frames, each a PNG, as one animated PNG.
#[pyfunction]
pub fn animate<'py>(py: Python<'py>, frames: Vec<Vec<u8>>, seconds: f64) -> PyResult<Bound<'py, PyBytes>> {
    let png = interruptible(py, |_| core::animate(&frames, seconds))?;
    Ok(PyBytes::new(py, &png))
}

/// Saves triangles over points in the format that the path's ending names; columns that are left out are not written. Normals at
/// corners: three rows a triangle.
#[pyfunction]
#[pyo3(signature = (path, points, faces, normals=None, curvatures=None, ids=None, *, corner_normals=None, sharp=None))]
pub fn save_mesh(
    py: Python<'_>,
    path: PathBuf,
    points: PyReadonlyArray2<'_, f64>,
    faces: PyReadonlyArray2<'_, i64>,
    normals: Option<PyReadonlyArray2<'_, f64>>,
    curvatures: Option<PyReadonlyArray2<'_, f64>>,
    ids: Option<PyReadonlyArray1<'_, u64>>,
    corner_normals: Option<PyReadonlyArray2<'_, f64>>,
    sharp: Option<bool>,
) -> PyResult<()> {
    let corners =
        corner_normals.map(|a| arrays::points("corner_normals", &a)).transpose()?.unwrap_or_default();
    let mesh = Mesh {
        corner_normals: corners.as_chunks::<3>().0.to_vec(),
        points: arrays::points("points", &points)?,
        normals: normals.map(|a| arrays::points("normals", &a)).transpose()?.unwrap_or_default(),
        curvatures: curvatures.map(|a| arrays::rows("curvatures", &a)).transpose()?.unwrap_or_default(),
        ids: ids.map(|a| arrays::column(&a)).unwrap_or_default(),
        faces: arrays::faces(&faces)?,
    };
    py.detach(|| core::save_mesh(&path, &mesh, sharp)).map_err(errors::geometry)
}

/// Writes a file whole or not at all.
#[pyfunction]
pub fn write_bytes(py: Python<'_>, path: PathBuf, content: Vec<u8>) -> PyResult<()> {
    py.detach(|| core::write_atomically(&path, |out| out.write_all(&content))).map_err(errors::geometry)
}
