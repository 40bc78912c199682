//! isoswarm-field: what a surface is.
mod error;
pub mod math;
pub mod surface;
pub use error::FieldError;
pub use surface::{Aabb, Cells, Surface};
