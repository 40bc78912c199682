//! Pictures of solids, meshes and points together, by ray casting.
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isoswarm_field::{Aabb, Field};
use isoswarm_geometry::render::{Clip, Plane};
use isoswarm_geometry::{self as core, Background, Drawn, Mesh, PictureOptions, PointCloud, Subject};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays;
use crate::errors;
use crate::field::Model;
use crate::geometry::{Cloud, watched};

/// A solid F < 0 of a picture.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Solid {
    field: Arc<Field>,
    values: Option<Arc<Field>>,
    clip: Clip,
    capped: bool,
    opacity: f64,
    section: core::Section,
}

#[pymethods]
impl Solid {
    #[new]
    #[pyo3(signature = (model, lo, hi, *, planes, capped, opacity, section, values=None))]
    fn new(
        model: &Model,
        lo: [f64; 3],
        hi: [f64; 3],
        planes: Vec<([f64; 3], f64)>,
        capped: bool,
        opacity: f64,
        section: &str,
        values: Option<&Model>,
    ) -> PyResult<Self> {
        let planes = planes.into_iter().map(|(normal, offset)| Plane { normal, offset }).collect();
        Ok(Self {
            field: model.field()?.clone(),
            values: values.map(|v| v.field().cloned()).transpose()?,
            clip: Clip { bounds: Aabb::new(lo, hi), planes },
            capped,
            opacity,
            section: section.parse().map_err(errors::geometry)?,
        })
    }
}

impl Solid {
    fn borrowed(&self) -> core::Solid<'_> {
        core::Solid {
            field: &self.field,
            clip: self.clip.clone(),
            capped: self.capped,
            opacity: self.opacity,
            section: self.section,
            values: self.values.as_deref(),
        }
    }

    fn is_opaque(&self) -> bool {
        self.field.is_opaque() || self.values.as_ref().is_some_and(|v| v.is_opaque())
    }
}

/// Triangles of a picture.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Triangles {
    mesh: Mesh,
    style: core::MeshStyle,
    colors: Option<Vec<[f64; 3]>>,
}

#[pymethods]
impl Triangles {
    #[new]
    #[pyo3(signature = (points, faces, style, *, normals=None, curvatures=None, colors=None))]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
        style: &str,
        normals: Option<PyReadonlyArray2<'_, f64>>,
        curvatures: Option<PyReadonlyArray2<'_, f64>>,
        colors: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        let faces = faces.as_array();
        if faces.ncols() != 3 {
            let given = faces.dim();
            return Err(PyValueError::new_err(format!("faces: expected shape (f, 3), given {given:?}")));
        }
        let number = |v: i64| {
            let wrong =
                || PyValueError::new_err(format!("faces: expected numbers of points, from 0 on, given {v}"));
            u32::try_from(v).map_err(|_| wrong())
        };
        let rows = faces.rows().into_iter().map(|r| Ok([number(r[0])?, number(r[1])?, number(r[2])?]));
        let mesh = Mesh {
            points: arrays::points("points", &points)?,
            normals: normals.map(|a| arrays::points("normals", &a)).transpose()?.unwrap_or_default(),
            curvatures: curvatures.map(|a| arrays::rows("curvatures", &a)).transpose()?.unwrap_or_default(),
            faces: rows.collect::<PyResult<_>>()?,
            ..Mesh::default()
        };
        let colors = colors.map(|a| arrays::points("colors", &a)).transpose()?;
        Ok(Self { mesh, style: style.parse().map_err(errors::geometry)?, colors })
    }
}

/// A picture as (PNG, pixels (height, width, 4), whether it is empty, whether intervals prove it).
#[pyfunction]
#[pyo3(signature = (cloud, solids, meshes, *, width, height, azimuth, elevation, up, field_of_view, projection, style,
    coloring, transparent, disc_scale, supersampling, ground, shadow, ambient_occlusion, frame=None, progress=None))]
pub fn render<'py>(
    py: Python<'py>,
    cloud: Option<PyRef<'py, Cloud>>,
    solids: Vec<PyRef<'py, Solid>>,
    meshes: Vec<PyRef<'py, Triangles>>,
    width: u32,
    height: u32,
    azimuth: f64,
    elevation: f64,
    up: [f64; 3],
    field_of_view: f64,
    projection: &str,
    style: &str,
    coloring: &str,
    transparent: bool,
    disc_scale: Option<f64>,
    supersampling: u32,
    ground: bool,
    shadow: f64,
    ambient_occlusion: f64,
    frame: Option<PyReadonlyArray2<'py, f64>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyArray3<u8>>, bool, bool)> {
    let mut options = PictureOptions {
        width,
        height,
        azimuth,
        elevation,
        up,
        field_of_view,
        projection: projection.parse().map_err(errors::geometry)?,
        style: style.parse().map_err(errors::geometry)?,
        coloring: coloring.parse().map_err(errors::geometry)?,
        disc_scale,
        supersampling,
        ground,
        shadow,
        ambient_occlusion,
        ..PictureOptions::default()
    };
    if transparent {
        options.background = Background::Transparent;
    }
    let frame = frame.map(|points| arrays::points("frame", &points)).transpose()?;
    let opaque = solids.iter().any(|s| s.is_opaque());
    let subject = Subject {
        cloud: cloud.as_deref().map_or_else(PointCloud::default, Cloud::borrowed),
        solids: solids.iter().map(|s| s.borrowed()).collect(),
        meshes: meshes
            .iter()
            .map(|t| core::MeshLook { mesh: &t.mesh, style: t.style, colors: t.colors.as_deref() })
            .collect(),
    };
    let work = |stop: &AtomicBool, told: &(dyn Fn(f64) + Sync)| {
        let drawn = core::draw_told(&subject, frame.as_deref(), &options, stop, told)?;
        let png = drawn.picture.to_png()?;
        Ok((drawn, png))
    };
    // A Python function is called on the thread that asks, where its exceptions are known.
    let (drawn, png): (Drawn, Vec<u8>) = if opaque {
        py.detach(|| work(&AtomicBool::new(false), &|_| {})).map_err(errors::geometry)?
    } else {
        watched(py, progress.as_ref(), work)?
    };
    let shape = [height as usize, width as usize, 4];
    let pixels = drawn.picture.rgba.into_pyarray(py).reshape(shape)?;
    Ok((PyBytes::new(py, &png), pixels, drawn.empty, drawn.certified))
}

/// sRGB colours for numbers, (n, 3): `sequential` from the smallest to the largest, or `diverging` about zero.
#[pyfunction]
pub fn colors<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
    map: &str,
) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
    let map = match map {
        "sequential" => core::Colormap::Sequential,
        "diverging" => core::Colormap::Diverging,
        _ => {
            let message = format!("colormap: expected sequential or diverging, given {map:?}");
            return Err(PyValueError::new_err(message));
        }
    };
    arrays::from_rows(py, core::colors(&arrays::column(&values), map))
}
