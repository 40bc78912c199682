//! isoswarm-field: what a surface is.
mod dual;
mod error;
mod eval;
mod field;
pub mod graph;
mod interval;
pub mod json;
mod kernel;
mod lanes;
pub mod math;
pub mod model;
pub mod op;
mod plain;
mod program;
mod prune;
mod regions;
pub mod scalar;
pub mod surface;
mod tape;
#[cfg(feature = "testkit")]
pub mod testkit;
#[cfg(any(test, feature = "testkit"))]
pub mod testkit;
pub mod text;
pub mod vm;
pub use dual::Dual;
pub use error::FieldError;
pub use field::Field;
pub use graph::{Graph, MAX_AXES, Node};
pub use interval::Interval;
pub use model::{Callback, Leaf, Lowered, Model, ParamInfo};
pub use op::Op;
pub use regions::{Narrowed, RegionOptions};
pub use scalar::Scalar;
pub use surface::{Aabb, Cells, Surface};
pub use tape::Tape;
