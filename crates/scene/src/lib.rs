//! isoswarm-scene: a model being edited.
//!
//! [`Scene`] is the only thing that changes: a model and its parameters, the floaters on its surface, control
//! points, settings and a clock. Everything that can be done to it is a [`Command`]; front-ends hold no algorithm.

mod adapting;
mod adapting_file;
mod apply;
mod command;
mod control;
mod editing;
mod error;
mod file;
mod fitting;
mod hold;
mod pick;
mod report;
mod scene;
mod settings;
mod swarm;
mod vector;

pub use apply::Change;
pub use command::{Along, Command, FitLoss, Hand, PinRef};
pub use control::ScenePin;
pub use error::Error;
#[cfg(feature = "schema")]
pub use file::schemas;
pub use file::{FORMAT, SCRIPT_FORMAT, VERSION, script_from_json, script_to_json};
pub use pick::Hit;
pub use report::{DragReport, Ending, FitReport, TransferReport};
pub use scene::{Entry, Frame, Progress, ProgressFn, Scene};
pub use settings::{Amount, Focus, Settings};
