//! isoswarm-field: what a surface is.
mod error;
pub mod graph;
pub mod math;
pub mod op;
pub mod scalar;
pub mod surface;
pub use error::FieldError;
pub use graph::{Graph, Node};
pub use op::Op;
pub use scalar::Scalar;
pub use surface::{Aabb, Cells, Surface};
