//! Opaque leaves: functions of the caller's that no expression describes.

use std::sync::Arc;

use crate::{Aabb, FieldError, Node};

/// A function F(x) that is only known by its values. It is called once for all points, on the calling thread,
/// never from the thread pool.
pub trait Callback: Send + Sync {
    /// The name under which files refer to it.
    fn name(&self) -> &str;

    /// F at each point, into `value` of the same length.
    fn value(&self, points: &[[f64; 3]], value: &mut [f64]) -> Result<(), FieldError>;

    /// F and ∂F/∂x at each point; `None` where the function has no gradient of its own, so that it is
    /// differentiated numerically (HBJF02 eq. 7 with its division by ε).
    fn value_gradient(
        &self,
        _points: &[[f64; 3]],
        _value: &mut [f64],
        _gradient: &mut [[f64; 3]],
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
    /// The name in error messages: the node's, or the function's.
    pub name: String,
}

impl std::fmt::Debug for Leaf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Leaf({}, {:?})", self.name, self.inputs)
    }
}
