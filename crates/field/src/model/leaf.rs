//! Opaque leaves: functions of the caller's that no expression describes.

use std::ops::Range;
use std::sync::Arc;

use super::Param;
use crate::{Aabb, FieldError, Node};

/// A function F(x, q) that is only known by its values, with any number of parameters q of its own. It is called for all
/// points at once, on the calling thread, never from the thread pool.
///
/// `q` has one number for each of [`Callback::parameters`], in their order: the present values of the node.
pub trait Callback: Send + Sync {
    /// The name under which files refer to it.
    fn name(&self) -> &str;

    /// The parameters that it takes, as a new node has them: numbers, each with a name of its own.
    fn parameters(&self) -> Vec<Param> {
        Vec::new()
    }

    /// F at each point, into `value` of the same length.
    fn value(&self, points: &[[f64; 3]], q: &[f64], value: &mut [f64]) -> Result<(), FieldError>;

    /// F and ∂F/∂x at each point; `None` where the function has no gradient of its own, so that it is
    /// differentiated numerically (HBJF02 eq. 7 with its division by ε).
    fn value_gradient(
        &self,
        _points: &[[f64; 3]],
        _q: &[f64],
        _value: &mut [f64],
        _gradient: &mut [[f64; 3]],
    ) -> Option<Result<(), FieldError>> {
        None
    }

    /// ∂F/∂q at each point, one row of `q.len()` numbers a point, of which those of frozen parameters are not used; `None`
    /// where the function has none of its own, so that it is differentiated numerically (HBJF02 eq. 8 with its
    /// division by ε). Only called where some parameter is free and the derivative is needed.
    fn parameter_gradient(
        &self,
        _points: &[[f64; 3]],
        _q: &[f64],
        _slopes: &mut [f64],
    ) -> Option<Result<(), FieldError>> {
        None
    }

    /// A box that contains the surface, where it is known.
    fn bounds(&self) -> Option<Aabb> {
        None
    }
}

/// An opaque leaf of a lowered model. Its output is the graph's input number `MAX_AXES + k`, with k its place
/// in [`super::Lowered::leaves`].
#[derive(Clone)]
pub struct Leaf {
    /// The function.
    pub callback: Arc<dyn Callback>,
    /// The coordinates at which it is called. They may depend on the outputs of leaves before this one.
    pub inputs: Vec<Node>,
    /// The numbers of its parameters in [`super::Lowered::params`].
    pub params: Range<usize>,
    /// The name in error messages: the node's, or the function's.
    pub name: String,
}

impl std::fmt::Debug for Leaf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Leaf({}, {:?}, {:?})", self.name, self.inputs, self.params)
    }
}

/// Why `params` are not those of the function, if they are not.
pub(super) fn mismatch(callback: &dyn Callback, params: &[Param]) -> Option<String> {
    let expected = callback.parameters();
    let list = |params: &[Param]| match params {
        [] => "none".to_string(),
        _ => params.iter().map(|p| &*p.name).collect::<Vec<_>>().join(", "),
    };
    if !expected.iter().map(|p| &p.name).eq(params.iter().map(|p| &p.name)) {
        return Some(format!(
            "expected the parameters of `{}` ({}), given {}",
            callback.name(),
            list(&expected),
            list(params)
        ));
    }
    let mut seen = rustc_hash::FxHashSet::default();
    if let Some(p) = params.iter().find(|p| !seen.insert(&*p.name)) {
        return Some(format!("`{}` has two parameters called {}", callback.name(), p.name));
    }
    params.iter().find(|p| p.expr.is_some()).map(|p| {
        format!(
            "the parameter {} is given by an expression, but `{}` takes numbers: give a number, or put the \
             dependence into the function",
            p.name,
            callback.name()
        )
    })
}
