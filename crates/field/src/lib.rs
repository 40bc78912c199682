//! isoswarm-field: what a surface is.
pub mod arrange;
mod bumps;
mod closed;
mod cut;
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
mod one;
pub mod op;
mod plain;
mod pool;
mod program;
mod prune;
mod regions;
pub mod scalar;
mod sparse;
pub mod surface;
pub mod switches;
mod tape;
#[cfg(any(test, feature = "testkit"))]
pub mod testkit;
pub mod text;
pub mod vector;
pub mod vm;
pub mod wide;

/// Where code is downloaded before it runs, one copy of a loop serves all that it could be compiled for apart. Results have the
/// same bits.
pub const SMALL: bool = cfg!(target_arch = "wasm32");

pub use dual::Dual;
pub use error::FieldError;
pub use field::{CompiledPiece, Field, Piece, Pieces, Ranges, Regularity};
pub use graph::{Graph, MAX_AXES, Node};
pub use interval::Interval;
pub use model::{Callback, Leaf, Lowered, Model, ParamInfo};
pub use op::Op;
pub use pool::in_pool;
pub use regions::{Narrowed, RegionOptions};
pub use scalar::Scalar;
pub use sparse::SparseRows;
pub use surface::{Aabb, Cells, Parametric, Surface};
pub use switches::Switches;
pub use tape::Tape;
