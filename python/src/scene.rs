//! isoswarm-scene for Python: scenes. Commands come as JSON, which is what they are in files.
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard};

use isoswarm_field::model;
use isoswarm_field::{Field, Surface};
use isoswarm_particles::control::Guide;
use isoswarm_scene::{
    self as core, Change, Command, DragReport, FitReport, Progress, Settings, TransferReport,
};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::{self, FileFormatError};
use crate::field::{self, Corners, Model, Parameter};
use crate::watch::Watch;

/// Points, normals, radii and identities of the floaters.
type Columns<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u64>>,
);

/// A scene. Used by one at a time: whoever comes in between, such as a progress function, is told so.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Scene {
    inner: Mutex<core::Scene>,
}

impl Scene {
    fn of(scene: core::Scene) -> Self {
        Self { inner: Mutex::new(scene) }
    }

    fn lock(&self) -> PyResult<MutexGuard<'_, core::Scene>> {
        self.inner.try_lock().map_err(|_| {
            PyRuntimeError::new_err(
                "the scene is at work: a progress function sees it through its argument, and other threads wait for \
                 the end of the call",
            )
        })
    }
}

#[pymethods]
impl Scene {
    /// A scene of a model; settings as JSON.
    #[new]
    fn new(py: Python<'_>, model: &Bound<'_, Model>, settings: &str) -> PyResult<Self> {
        let (tree, settings) = (model.get().tree(), read_settings(settings)?);
        py.detach(|| core::Scene::new(tree, settings)).map(Self::of).map_err(errors::scene)
    }

    /// The text of a file of a scene, and the functions that it names.
    #[staticmethod]
    fn from_json(py: Python<'_>, source: &str, functions: Vec<(String, Bound<'_, Model>)>) -> PyResult<Self> {
        let functions = field::functions(functions)?;
        py.detach(|| core::Scene::from_json(source, Settings::default(), &functions))
            .map(Self::of)
            .map_err(errors::scene)
    }

    /// The scene as the text of a file.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        let guard = self.lock()?;
        let scene: &core::Scene = &guard;
        py.detach(|| scene.to_json()).map_err(errors::scene)
    }

    /// Carries out a command. `progress` gets (steps, most, remaining, clock, floaters, pins) at each multiple of `every`
    /// on the clock, or up to 20 times a second; false ends the command where it is.
    #[pyo3(signature = (command, progress, every))]
    fn apply<'py>(
        &self,
        py: Python<'py>,
        command: &str,
        progress: Option<Py<PyAny>>,
        every: Option<u64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let command: Command =
            serde_json::from_str(command).map_err(|e| PyValueError::new_err(format!("command: {e}")))?;
        let mut guard = self.lock()?;
        let scene: &mut core::Scene = &mut guard;
        let (result, raised) = py.detach(|| {
            let mut watch = Watch::new(progress, None);
            let result = scene.apply_with(command, &mut |scene, progress| {
                let due = every.map(|k| scene.clock().is_multiple_of(k));
                let flow = watch.look(due, |py, f| report(py, f, scene, progress));
                if flow.is_break() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            (result, watch.raised)
        });
        match raised {
            Some(error) => Err(error),
            None => change(py, result.map_err(errors::scene)?),
        }
    }

    /// Learns the functions of a model, so that texts can refer to them by name.
    fn learn(&self, model: &Bound<'_, Model>) -> PyResult<()> {
        let mut scene = self.lock()?;
        let mut known = scene.model().map_err(errors::scene)?.functions();
        for new in model.get().tree().functions() {
            let name = new.name();
            if known.iter().any(|f| f.name() == name && !Arc::ptr_eq(f, &new)) {
                return Err(PyValueError::new_err(format!(
                    "there are two functions called `{name}`; give one another name: iso.from_function(…, name=…)"
                )));
            }
            known.push(new);
        }
        scene.learn_functions(model.get().tree());
        Ok(())
    }

    /// The model with the present values.
    fn model(&self) -> PyResult<Model> {
        let scene = self.lock()?;
        Ok(Model::compiled(scene.model().map_err(errors::scene)?, scene.field().clone()))
    }

    fn parameters(&self) -> PyResult<Vec<Parameter>> {
        Ok(self.lock()?.field().parameters().iter().cloned().map(field::parameter).collect())
    }

    /// (path, kind, name, level, operands) of each node.
    fn nodes(&self) -> PyResult<Vec<(String, &'static str, Option<String>, usize, usize)>> {
        let nodes = self.lock()?.model().map_err(errors::scene)?.nodes();
        let row = |n: model::NodeInfo| {
            let name = n.model().name().map(str::to_string);
            (n.path, n.kind, name, n.level, n.operands)
        };
        Ok(nodes.into_iter().map(row).collect())
    }

    /// The settings as JSON.
    fn settings(&self) -> PyResult<String> {
        to_json(self.lock()?.settings())
    }

    #[getter]
    fn axes(&self) -> PyResult<usize> {
        Ok(self.lock()?.field().axes())
    }

    #[getter]
    fn clock(&self) -> PyResult<u64> {
        Ok(self.lock()?.clock())
    }

    #[getter]
    fn spacing(&self) -> PyResult<f64> {
        Ok(self.lock()?.frame().spacing)
    }

    #[getter]
    fn is_held(&self) -> PyResult<bool> {
        Ok(self.lock()?.is_held())
    }

    /// How many commands can be undone, and redone.
    #[getter]
    fn history(&self) -> PyResult<(usize, usize)> {
        Ok(self.lock()?.history())
    }

    #[getter]
    fn bounds(&self) -> PyResult<Corners> {
        let scene = self.lock()?;
        let b = scene.frame().bounds;
        Ok((b.lo, b.hi))
    }

    fn floaters<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        columns(py, &*self.lock()?)
    }

    /// What is known of each pin.
    fn pins<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let scene = self.lock()?;
        let off = scene.residuals().map_err(errors::scene)?;
        scene.pins().iter().zip(off).map(|(p, off)| pin(py, p, off)).collect()
    }

    /// Numbers of the pins, by name where they have one.
    fn pin_names(&self) -> PyResult<Vec<(u64, Option<String>)>> {
        Ok(self.lock()?.pins().iter().map(|p| (p.id, p.name.clone())).collect())
    }

    /// Positions of the pins, and the surface's normals there.
    fn marks<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        marks(py, &*self.lock()?)
    }

    /// How well the part under an adapter follows it, while one is on.
    fn transfer<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.lock()?.adapting().cloned().map(|r| transfer(py, r)).transpose()
    }

    /// The path of the part under an adapter, and the kind of the adapter's node, while one is on.
    fn adapter(&self) -> PyResult<Option<(String, String)>> {
        let scene = self.lock()?;
        let (Some(path), Some((node, _))) = (scene.adapted_path(), scene.adapter()) else { return Ok(None) };
        let node = scene.field().model().node(node).map_err(errors::field)?;
        Ok(Some((path.to_string(), node.kind().name.to_string())))
    }

    /// The part under an adapter with its parameters as they follow it, while one is on.
    fn adapted(&self) -> PyResult<Option<Model>> {
        let scene = self.lock()?;
        let model = |f: &Field| Ok(Model::compiled(f.current_model().map_err(errors::field)?, f.clone()));
        scene.adapted().map(model).transpose()
    }

    /// How many commands have been given.
    #[getter]
    fn given(&self) -> PyResult<usize> {
        Ok(self.lock()?.log().len())
    }

    /// What has been done, as the text of a script.
    fn log(&self) -> PyResult<String> {
        Ok(core::script_to_json(self.lock()?.log()))
    }
}

/// What a file says that it is, where it is JSON.
#[pyfunction]
pub fn format_of(py: Python<'_>, text: &str) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Header {
        format: Option<String>,
    }
    py.detach(|| serde_json::from_str::<Header>(text).ok()?.format)
}

/// The commands of a script as JSON, each with the time for which it waits.
#[pyfunction]
pub fn read_script(py: Python<'_>, text: &str) -> PyResult<Vec<(Option<u64>, String)>> {
    let entries = py.detach(|| core::script_from_json(text)).map_err(errors::scene)?;
    entries.iter().map(|e| Ok((e.at, to_json(&e.command)?))).collect()
}

fn to_json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| PyValueError::new_err(e.to_string()))
}

fn read_settings(text: &str) -> PyResult<Settings> {
    serde_json::from_str(text).map_err(|e| FileFormatError::new_err((format!("settings: {e}"), e.line())))
}

/// Calls a progress function; whether to go on.
fn report(py: Python<'_>, f: &Py<PyAny>, scene: &core::Scene, p: &Progress) -> PyResult<bool> {
    let model = Model::compiled(scene.model().map_err(errors::scene)?, scene.field().clone());
    let arguments =
        (p.steps, p.most, p.remaining, scene.clock(), columns(py, scene)?, marks(py, scene)?, model);
    f.call1(py, arguments)?.extract(py)
}

fn columns<'py>(py: Python<'py>, scene: &core::Scene) -> PyResult<Columns<'py>> {
    let f = scene.frame().floaters;
    Ok((
        arrays::from_rows(py, f.points.clone())?,
        arrays::from_rows(py, f.normals.clone())?,
        arrays::from_column(py, f.sigma.clone()),
        f.id.clone().into_pyarray(py),
    ))
}

fn marks<'py>(
    py: Python<'py>,
    scene: &core::Scene,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
    let points: Vec<[f64; 3]> = scene.pins().iter().map(|p| p.pin.at).collect();
    let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    scene.field().value_gradient(&points, &mut f, &mut g).map_err(errors::field)?;
    Ok((arrays::from_rows(py, points)?, arrays::from_rows(py, g)?))
}

/// A pin as Python's `Pin` reads it.
fn pin<'py>(py: Python<'py>, p: &core::ScenePin, distance: f64) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("id", p.id)?;
    d.set_item("name", p.name.as_deref())?;
    d.set_item("position", p.pin.at)?;
    d.set_item("distance", distance)?;
    d.set_item("weight", p.pin.weight)?;
    d.set_item("softness", p.pin.softness)?;
    d.set_item("grip", p.grip)?;
    let (line, plane) = match p.pin.guide {
        Guide::Free => (None, None),
        Guide::Line(v) => (Some(v), None),
        Guide::Plane(v) => (None, Some(v)),
    };
    d.set_item("line", line)?;
    d.set_item("plane", plane)?;
    Ok(d)
}

/// What a command did, as Python's results take it.
fn change(py: Python<'_>, c: Change) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("pin", c.pin)?;
    d.set_item("drag", c.drag.map(|r| drag(py, r)).transpose()?)?;
    d.set_item("fit", c.fit.map(|r| fit(py, r)).transpose()?)?;
    d.set_item("transfer", c.transfer.map(|r| transfer(py, r)).transpose()?)?;
    Ok(d)
}

fn drag(py: Python<'_>, r: DragReport) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("reached", r.reached)?;
    d.set_item("ending", r.ending.name())?;
    d.set_item("distance", r.distance)?;
    d.set_item("rank", r.rank)?;
    d.set_item("pins", r.pins)?;
    d.set_item("residual", r.residual)?;
    d.set_item("slip", r.slip)?;
    d.set_item("steps", r.steps)?;
    d.set_item("at_limit", r.at_limit)?;
    Ok(d)
}

fn fit(py: Python<'_>, r: FitReport) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("converged", r.converged)?;
    d.set_item("reason", r.reason)?;
    d.set_item("rms", r.rms)?;
    d.set_item("largest", r.largest)?;
    d.set_item("skipped", r.skipped)?;
    d.set_item("rank", r.rank)?;
    d.set_item("freedom", r.freedom)?;
    d.set_item("iterations", r.iterations)?;
    d.set_item("at_limit", r.at_limit)?;
    Ok(d)
}

fn transfer(py: Python<'_>, r: TransferReport) -> PyResult<Bound<'_, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("rms", r.rms)?;
    d.set_item("largest", r.largest)?;
    d.set_item("relative", r.relative)?;
    d.set_item("rank", r.rank)?;
    d.set_item("freedom", r.freedom)?;
    d.set_item("at_limit", r.at_limit)?;
    Ok(d)
}
