//! isoswarm-particles: what lives on a surface.
//!
//! [`sample`] spreads floaters over F = 0 and gives them back with normals, areas and curvature, after the floaters of
//! Witkin and Heckbert (SIGGRAPH '94, "WH94").

mod constraint;
pub mod control;
pub mod creases;
mod curvature;
mod edges;
mod error;
mod even;
mod fences;
mod finish;
pub mod floaters;
mod front;
mod kernel;
pub mod metrics;
mod neighbors;
mod options;
pub mod parametric;
mod population;
mod project;
mod random;
mod relax;
mod report;
mod repulsion;
mod resume;
mod rings;
pub mod rng;
mod run;
mod sample;
mod search;
mod seeding;
mod sizing;
mod stars;
mod swarm;
mod tangential;

use isoswarm_field::vector;

pub use constraint::floater_velocity;
pub use curvature::principal_curvatures;
pub use error::Error;
pub use neighbors::{Grid, Neighbors, Reach, spatial_order};
pub use options::{
    Amount, Density, DensityFn, FindCreases, Method, Options, Phase, Progress, ProgressFn, Stop,
};
pub use project::project;
pub use report::{Evenness, Report, Samples, Status};
pub use rings::Rings;
pub use sample::{Places, places, sample};
pub use search::Search;
pub use swarm::same_sheet;
pub use tangential::{Change, normal_keeping_velocity, surface_velocity};
