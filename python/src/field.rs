//! isoswarm-field for Python: models, evaluation, files.
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use isoswarm_field::model::{self, Payload, Value, kinds_json};
use isoswarm_field::{Aabb, Callback, Field, FieldError, json, text, vm};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays;
use crate::callback::Function;
use crate::errors::{self, TooLargeError};

/// Points between two looks at Ctrl-C.
const CHUNK: usize = 16_384;

/// A model, compiled when it is first evaluated.
#[pyclass(frozen, module = "isoswarm._core")]
pub struct Model {
    tree: model::Model,
    compiled: OnceLock<Arc<Field>>,
    bounds: OnceLock<Option<Aabb>>,
}

/// (path, value, frozen, lowest, highest, scale, discrete, unit).
pub type Parameter = (String, f64, bool, f64, f64, f64, bool, &'static str);
pub type Corners = ([f64; 3], [f64; 3]);

/// A parameter as Python's `Parameters` takes it.
pub fn parameter(p: model::ParamInfo) -> Parameter {
    (p.path, p.value, p.frozen, p.bounds.0, p.bounds.1, p.scale, p.discrete, p.unit)
}

impl Model {
    fn of(tree: model::Model) -> Self {
        Self { tree, compiled: OnceLock::new(), bounds: OnceLock::new() }
    }

    /// A tree with its field, which has the same values.
    pub fn compiled(tree: model::Model, field: Field) -> Self {
        Self { compiled: OnceLock::from(Arc::new(field)), ..Self::of(tree) }
    }

    /// The tree.
    pub fn tree(&self) -> &model::Model {
        &self.tree
    }

    fn made(tree: Result<model::Model, FieldError>) -> PyResult<Self> {
        tree.map(Self::of).map_err(errors::field)
    }

    /// The compiled field.
    pub fn field(&self) -> PyResult<&Arc<Field>> {
        if let Some(field) = self.compiled.get() {
            return Ok(field);
        }
        let field = Field::new(&self.tree).map_err(errors::field)?;
        Ok(self.compiled.get_or_init(|| Arc::new(field)))
    }

    /// Runs `evaluate` on the points, flat, in chunks between which Ctrl-C is heard; opaque functions get all
    /// points at once. Each point gives `width` numbers.
    fn evaluate(
        &self,
        py: Python<'_>,
        points: &PyReadonlyArray2<'_, f64>,
        width: usize,
        evaluate: impl Fn(&Field, &[f64], &mut [f64]) -> Result<(), FieldError> + Send + Sync,
    ) -> PyResult<Vec<f64>> {
        let field = self.field()?;
        let (n, axes) = (arrays::count("X", points)?, field.axes());
        let mut out = zeros(n, width)?;
        let chunk = if field.is_opaque() { n.max(1) } else { CHUNK };
        let mut some = Vec::new();
        for (k, out) in out.chunks_mut((chunk * width).max(1)).enumerate() {
            arrays::some_points(points, k * chunk..((k + 1) * chunk).min(n), axes, &mut some);
            py.detach(|| evaluate(field, &some, out)).map_err(errors::field)?;
            py.check_signals()?;
        }
        Ok(out)
    }

    /// One component only, which is all that a surface has.
    fn single(&self) -> PyResult<&Arc<Field>> {
        let field = self.field()?;
        match field.components() {
            1 => Ok(field),
            k => Err(PyValueError::new_err(format!(
                "expected a field with one component, this one has {k}; take its operands one by one"
            ))),
        }
    }
}

/// n · width zeros, or an error instead of a process that is ended for want of memory.
fn zeros(n: usize, width: usize) -> PyResult<Vec<f64>> {
    let mut out = Vec::new();
    let count = n.checked_mul(width).filter(|c| *c <= isize::MAX as usize / 8);
    match count.map(|c| (c, out.try_reserve_exact(c))) {
        Some((c, Ok(()))) => {
            out.resize(c, 0.0);
            Ok(out)
        }
        _ => Err(TooLargeError::new_err(format!(
            "{n} points with {width} numbers each ({:.1e} bytes) do not fit into memory; pass fewer points at a time",
            8.0 * n as f64 * width as f64
        ))),
    }
}

/// The function of a field made with `from_function`, in the plane or in space.
fn function_of(tree: &model::Model) -> Option<Arc<dyn Callback>> {
    match (tree.payload(), tree.kind().name) {
        (Payload::Callback(function), _) => Some(function.clone()),
        (_, "planar") => function_of(&tree.operands()[0]),
        _ => None,
    }
}

/// Functions by the names that a file has for them.
pub type Functions = HashMap<String, Arc<dyn Callback>>;

/// The functions of fields that are one function each.
pub fn functions(named: Vec<(String, Bound<'_, Model>)>) -> PyResult<Functions> {
    let one = |(name, model): (String, Bound<'_, Model>)| match function_of(&model.get().tree) {
        Some(function) => Ok((name, function)),
        None => Err(PyValueError::new_err(format!(
            "functions: expected a field made with from_function for `{name}`, given a `{}`",
            model.get().kind()
        ))),
    };
    named.into_iter().map(one).collect()
}

/// An argument of a node: a number or a model.
fn value(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(model) = object.cast::<Model>() {
        return Ok(Value::Model(model.get().tree.clone()));
    }
    Ok(Value::Number(object.extract::<f64>()?))
}

#[pymethods]
impl Model {
    /// A formula; names with their values.
    #[staticmethod]
    fn parse(py: Python<'_>, source: &str, names: Vec<(String, f64)>, axes: usize) -> PyResult<Self> {
        let names: Vec<(&str, f64)> = names.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let options = text::Options { axes, ..text::Options::default() };
        Self::made(py.detach(|| text::parse_with(source, &names, options)))
    }

    /// The text of a `.vm` file.
    #[staticmethod]
    fn from_vm(py: Python<'_>, source: &str) -> PyResult<Self> {
        Self::made(py.detach(|| vm::parse_vm(source)))
    }

    /// The text of an `.iso.json` file, and the functions that it names.
    #[staticmethod]
    fn from_json(py: Python<'_>, source: &str, functions: Vec<(String, Bound<'_, Model>)>) -> PyResult<Self> {
        let known = self::functions(functions)?;
        Self::made(py.detach(|| json::from_json_with(source, &|name| known.get(name).cloned())))
    }

    /// The model as the text of an `.iso.json` file.
    fn to_json(&self, py: Python<'_>) -> String {
        py.detach(|| json::to_json(&self.tree))
    }

    /// The model as the text of a `.vm` file.
    fn to_vm(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| vm::Program::of(&self.tree)).map(|program| program.to_text()).map_err(errors::field)
    }

    /// The model as a formula, as far as there is one.
    fn to_text(&self, py: Python<'_>) -> String {
        py.detach(|| self.tree.to_string())
    }

    /// A node of a kind: operands and parameters as in text.
    #[staticmethod]
    fn node(kind: &str, positional: &Bound<'_, PyList>, keyword: &Bound<'_, PyDict>) -> PyResult<Self> {
        let positional = positional.iter().map(|a| value(&a)).collect::<PyResult<Vec<_>>>()?;
        let keyword = keyword
            .iter()
            .map(|(key, a)| Ok((key.extract::<String>()?, value(&a)?)))
            .collect::<PyResult<Vec<_>>>()?;
        Self::made(model::Model::call(kind, positional, keyword))
    }

    /// A function of points and of its parameters (name and value), its derivatives, and where its surface is.
    #[staticmethod]
    fn function(
        name: String,
        parameters: Vec<(String, f64)>,
        value: Py<PyAny>,
        gradient: Option<Py<PyAny>>,
        parameter_gradient: Option<Py<PyAny>>,
        bounds: Option<Corners>,
    ) -> PyResult<Self> {
        let bounds = bounds.map(|(lo, hi)| Aabb::new(lo, hi));
        let function = Function { name, parameters, value, gradient, parameter_gradient, bounds };
        Self::made(model::Model::function(Arc::new(function)))
    }

    #[getter]
    fn kind(&self) -> &'static str {
        self.tree.kind().name
    }

    #[getter]
    fn name(&self) -> Option<&str> {
        self.tree.name()
    }

    #[getter]
    fn is_solid(&self) -> bool {
        self.tree.is_solid()
    }

    #[getter]
    fn is_opaque(&self) -> PyResult<bool> {
        Ok(self.field()?.is_opaque())
    }

    #[getter]
    fn operations(&self) -> PyResult<usize> {
        Ok(self.field()?.operations())
    }

    #[getter]
    fn axes(&self) -> PyResult<usize> {
        Ok(self.field()?.axes())
    }

    fn bounds(&self, py: Python<'_>) -> PyResult<Option<Corners>> {
        let field = self.field()?;
        Ok(py.detach(|| *self.bounds.get_or_init(|| field.bounds())).map(|b| (b.lo, b.hi)))
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.tree.parameters().into_iter().map(parameter).collect()
    }

    fn with_value(&self, path: &str, value: f64) -> PyResult<Self> {
        Self::made(self.tree.with_value(path, value))
    }

    fn with_frozen(&self, path: &str, frozen: bool) -> PyResult<Self> {
        Self::made(self.tree.with_frozen(path, frozen))
    }

    fn with_bounds(&self, path: &str, lowest: f64, highest: f64) -> PyResult<Self> {
        Self::made(self.tree.with_bounds(path, lowest, highest))
    }

    fn with_scale(&self, path: &str, scale: f64) -> PyResult<Self> {
        Self::made(self.tree.with_scale(path, scale))
    }

    fn named(&self, name: &str) -> PyResult<Self> {
        Self::made(self.tree.named(name))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Model>().is_ok_and(|other| other.get().tree == self.tree)
    }

    /// F, (n,).
    fn value<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.single()?;
        let out = self.evaluate(py, &points, 1, |field, x, out| field.value(x, out))?;
        Ok(arrays::from_column(py, out))
    }

    /// F, (n,), and ∂F/∂x, (n, 3).
    fn value_gradient<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)> {
        let axes = self.single()?.axes();
        let rows = self.evaluate(py, &points, 4, |field, x, out| {
            let n = out.len() / 4;
            let (mut value, mut gradient) = (vec![0.0; n], vec![0.0; n * axes]);
            field.gradient(x, &mut value, &mut gradient)?;
            for (i, row) in out.chunks_exact_mut(4).enumerate() {
                row[0] = value[i];
                row[1..=axes].copy_from_slice(&gradient[i * axes..(i + 1) * axes]);
            }
            Ok(())
        })?;
        let value = rows.chunks_exact(4).map(|r| r[0]).collect();
        let gradient = rows.chunks_exact(4).map(|r| [r[1], r[2], r[3]]).collect();
        Ok((arrays::from_column(py, value), arrays::from_rows(py, gradient)?))
    }

    /// ∂F/∂q of the free parameters, (n, m).
    fn parameter_gradient<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let field = self.single()?;
        let (m, axes) = (field.free().len(), field.axes());
        let out = self.evaluate(py, &points, m, |field, x, out| {
            let n = x.len() / axes;
            let (mut value, mut gradient) = (vec![0.0; n], vec![0.0; n * axes]);
            field.parameter_gradient(x, &mut value, &mut gradient, out)
        })?;
        let n = points.as_array().nrows();
        arrays::matrix(py, out, n, m)
    }

    /// ∂²F/∂x², (n, 3, 3).
    fn hessian<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let axes = self.single()?.axes();
        let out = self.evaluate(py, &points, 9, |field, x, out| {
            let mut all = vec![0.0; out.len() / 9 * axes * axes];
            field.hessian(x, &mut all)?;
            for (row, h) in out.chunks_exact_mut(9).zip(all.chunks_exact(axes * axes)) {
                for i in 0..axes {
                    row[3 * i..3 * i + axes].copy_from_slice(&h[axes * i..axes * (i + 1)]);
                }
            }
            Ok(())
        })?;
        arrays::cube(py, out)
    }

    /// (lowest, highest) of F over a box.
    fn interval(&self, lo: [f64; 3], hi: [f64; 3]) -> PyResult<(f64, f64)> {
        let field = self.single()?;
        let axes = field.axes();
        let found = field.interval(&lo[..axes], &hi[..axes]).map_err(errors::field)?;
        Ok((found[0].lo, found[0].hi))
    }
}

/// The table of kinds as JSON.
#[pyfunction]
pub fn kinds() -> String {
    kinds_json()
}
