//! Control points: the surface follows particles (WH94 section 3.4, HBJF02 section 5).

mod drag;
mod factor;
mod metric;
mod pin;
mod solve;

pub use drag::{ControlStep, StepOptions, step};
pub use metric::sensitivity;
pub use pin::{Guide, Pin};
