//! A model ready for evaluation: compiled, with its parameters' present values.

mod bounds;
pub(crate) mod cells;
mod differences;
mod evaluate;
mod intervals;
mod leaves;
mod minorant;
mod pieces;
mod rows;
mod smooth;
mod surface;

pub use smooth::Regularity;

use std::sync::{Arc, OnceLock};

use crate::bumps::{Recipe, Sum, Terms};
use crate::kernel::Batch;
use crate::model::{Lowered, Model, ParamInfo};
use crate::program::{Program, Purpose};
use crate::tape::Tape;
use crate::{Aabb, FieldError};
use leaves::{LeafOutputs, LeafStage};
pub use pieces::{CompiledPiece, Piece, Pieces, Ranges};

/// Points that one task evaluates.
const CHUNK: usize = 1024;

/// What does not change with the parameters' values.
#[derive(Debug)]
struct Compiled {
    parts: Vec<Part>,
    leaves: Vec<LeafStage>,
    axes: usize,
    /// The terms of the first component, where it is a sum; found when first asked for.
    terms: OnceLock<Option<Terms>>,
    /// How the first component is a sum of bumps, if it is one; found when first asked for.
    recipe: OnceLock<Option<Recipe>>,
}

/// One function, compiled for each purpose.
#[derive(Clone, Debug)]
struct Part {
    tape: Tape,
    value: Program,
    inputs: Program,
    /// Made when a derivative with respect to parameters is first asked for.
    everything: OnceLock<Program>,
}

impl Part {
    fn new(tape: Tape) -> Part {
        let program = |purpose| Program::new(&tape, purpose);
        let (value, inputs) = (program(Purpose::Value), program(Purpose::Inputs));
        Part { value, inputs, tape, everything: OnceLock::new() }
    }
}

/// F(x, q) with its present parameters: values, derivatives and intervals at points. F < 0 inside.
///
/// Points are flat row-major slices of `axes()` numbers a point. Results for several components come component
/// by component within a point: a gradient of a field with k components and d axes is (n, k, d).
///
/// ```
/// use isoswarm_field::{Field, text};
/// let field = Field::new(&text::parse("x^2 + y^2 + z^2 - r^2", &[("r", 2.0)])?)?;
/// let mut value = [0.0];
/// field.value(&[0.0, 0.0, 3.0], &mut value)?;
/// assert_eq!(value, [5.0]);
/// # Ok::<(), isoswarm_field::FieldError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Field {
    model: Model,
    compiled: Arc<Compiled>,
    params: Vec<ParamInfo>,
    /// The uniforms of each component's tape at the present values.
    uniforms: Vec<Vec<f64>>,
    /// The first component as a sum of bumps at the present values, if it is one; found when first asked for.
    bumps: OnceLock<Option<Arc<Sum>>>,
}

impl Field {
    /// Compiles a model.
    pub fn new(model: &Model) -> Result<Field, FieldError> {
        if model.is_hidden() {
            return Err(FieldError::Invalid(
                "every part of the model is hidden, so that it has no surface: show one of them".into(),
            ));
        }
        let Lowered { graph, roots, axes, params, leaves } = model.lower()?;
        let parts = roots.iter().map(|&r| Part::new(Tape::new(&graph, r))).collect();
        let leaves = leaves.iter().map(|l| LeafStage::new(&graph, l)).collect();
        let mut field = Field {
            model: model.clone(),
            compiled: Arc::new(Compiled {
                parts,
                leaves,
                axes,
                terms: OnceLock::new(),
                recipe: OnceLock::new(),
            }),
            params,
            uniforms: Vec::new(),
            bumps: OnceLock::new(),
        };
        field.refresh();
        Ok(field)
    }

    fn refresh(&mut self) {
        let values: Vec<f64> = self.params.iter().map(|p| p.value).collect();
        self.uniforms = self.compiled.parts.iter().map(|p| p.tape.uniforms.evaluate(&values)).collect();
        self.bumps = OnceLock::new();
    }

    /// The tree that the field was compiled from, with the values it had then; see [`Field::current_model`].
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of coordinates: 3, or 2 for curves in the plane.
    pub fn axes(&self) -> usize {
        self.compiled.axes
    }

    /// Number of equations F = 0: 1 for a surface.
    pub fn components(&self) -> usize {
        self.compiled.parts.len()
    }

    /// Whether any part is an opaque function; then there are no intervals.
    pub fn is_opaque(&self) -> bool {
        !self.compiled.leaves.is_empty()
    }

    /// Operations carried out for a point, over all components.
    pub fn operations(&self) -> usize {
        self.compiled.parts.iter().map(|p| p.tape.len()).sum()
    }

    /// The compiled function of one component.
    pub fn tape(&self, component: usize) -> &Tape {
        &self.compiled.parts[component].tape
    }

    /// All parameters, in the order of HBJF02 section 3.
    pub fn parameters(&self) -> &[ParamInfo] {
        &self.params
    }

    /// The number of the parameter with this path.
    pub fn parameter(&self, path: &str) -> Result<usize, FieldError> {
        self.params.iter().position(|p| p.path == path).ok_or_else(|| {
            let mut known: Vec<&str> = self.params.iter().take(20).map(|p| p.path.as_str()).collect();
            if self.params.len() > known.len() {
                known.push("…");
            }
            FieldError::UnknownParameter { path: path.into(), known: known.join(", ") }
        })
    }

    /// Sets one value. It must be finite and inside the parameter's bounds; a discrete parameter, being part of
    /// the model's structure, is changed on the model.
    pub fn set_value(&mut self, index: usize, value: f64) -> Result<(), FieldError> {
        let p = &mut self.params[index];
        let (lo, hi) = p.bounds;
        if p.discrete {
            return Err(FieldError::Invalid(format!(
                "`{}` is discrete, a part of the model's structure: make the model anew with another value",
                p.path
            )));
        }
        if !(value.is_finite() && lo <= value && value <= hi) {
            return Err(FieldError::Invalid(format!("`{}` must {}, given {value}", p.path, range(lo, hi))));
        }
        p.value = value;
        self.refresh();
        Ok(())
    }

    /// Takes a parameter out of q, or puts it back.
    pub fn set_frozen(&mut self, index: usize, frozen: bool) {
        self.params[index].frozen = frozen;
    }

    /// Sets the smallest and largest value of a parameter; its present value must lie between.
    pub fn set_bounds(&mut self, index: usize, lo: f64, hi: f64) -> Result<(), FieldError> {
        let p = &mut self.params[index];
        if !(lo <= p.value && p.value <= hi) {
            return Err(FieldError::Invalid(format!(
                "the bounds of `{}` must contain its value {}, given [{lo}, {hi}]",
                p.path, p.value
            )));
        }
        p.bounds = (lo, hi);
        Ok(())
    }

    /// Sets what counts as a typical change of a parameter: finite and above 0.
    pub fn set_scale(&mut self, index: usize, scale: f64) -> Result<(), FieldError> {
        let p = &mut self.params[index];
        if !(scale.is_finite() && scale > 0.0) {
            return Err(FieldError::Invalid(format!(
                "the scale of `{}` must be finite and above 0, given {scale}",
                p.path
            )));
        }
        p.scale = scale;
        Ok(())
    }

    /// The tree with the parameters' present values and settings.
    pub fn current_model(&self) -> Result<Model, FieldError> {
        self.model.with_parameters(&self.params)
    }

    /// The numbers of the parameters that form q: neither frozen nor discrete.
    pub fn free(&self) -> Vec<usize> {
        (0..self.params.len()).filter(|&i| self.params[i].is_free()).collect()
    }

    /// The vector q.
    pub fn q(&self) -> Vec<f64> {
        self.free().iter().map(|&i| self.params[i].value).collect()
    }

    /// Sets the vector q; see [`Field::set_value`].
    pub fn set_q(&mut self, q: &[f64]) -> Result<(), FieldError> {
        let free = self.params.iter().filter(|p| p.is_free());
        if q.len() != free.clone().count() {
            let (expected, given) = (format!("{} numbers", free.count()), q.len().to_string());
            return Err(FieldError::Shape { what: "q", expected, given });
        }
        for (p, &v) in free.zip(q) {
            let (lo, hi) = p.bounds;
            if !(v.is_finite() && lo <= v && v <= hi) {
                return Err(FieldError::Invalid(format!("`{}` must {}, given {v}", p.path, range(lo, hi))));
            }
        }
        for (p, &v) in self.params.iter_mut().filter(|p| p.is_free()).zip(q) {
            p.value = v;
        }
        self.refresh();
        Ok(())
    }

    fn count(&self, points: &[f64]) -> Result<usize, FieldError> {
        if points.len().is_multiple_of(self.axes()) {
            return Ok(points.len() / self.axes());
        }
        Err(FieldError::Shape {
            what: "points",
            expected: format!("{} numbers a point", self.axes()),
            given: format!("{} numbers", points.len()),
        })
    }

    fn expect(what: &'static str, slice: &[f64], expected: usize) -> Result<(), FieldError> {
        if slice.len() == expected {
            return Ok(());
        }
        Err(FieldError::Shape {
            what,
            expected: format!("{expected} numbers"),
            given: slice.len().to_string(),
        })
    }

    fn batch<'a>(&self, points: &'a [f64], outputs: &'a LeafOutputs) -> Batch<'a> {
        let leaves = self.compiled.leaves.len();
        Batch { points, stride: self.axes(), axes: self.axes(), outputs: &outputs.value, leaves }
    }

    /// A box that contains the whole surface, or `None` where the search finds no end to it.
    pub fn bounds(&self) -> Option<Aabb> {
        bounds::find(self)
    }
}

/// What bounds ask of a value, in words.
fn range(lo: f64, hi: f64) -> String {
    match (lo, hi) {
        (f64::NEG_INFINITY, f64::INFINITY) => "be finite".into(),
        (f64::MIN_POSITIVE, f64::INFINITY) => "be finite and above 0".into(),
        (f64::MIN_POSITIVE, _) => format!("lie above 0 and up to {hi}"),
        _ => format!("lie in [{lo}, {hi}]"),
    }
}
