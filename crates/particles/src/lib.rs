//! isoswarm-particles: what lives on a surface.
//!
//! [`sample`] spreads floaters over F = 0 and gives them back with normals, areas and curvature, after the floaters of
//! Witkin and Heckbert (SIGGRAPH '94, "WH94").

mod error;
mod options;
mod report;
mod sample;

pub use error::Error;
pub use options::{Amount, Density, DensityFn, Method, Options, Phase, Progress, ProgressFn, Stop};
pub use report::{Evenness, Report, Samples, Status};
pub use sample::sample;
