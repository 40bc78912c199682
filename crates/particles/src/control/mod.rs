//! Control points: the surface follows particles (WH94 section 3.4, HBJF02 section 5).

mod drag;
mod factor;
mod fit;
mod fold;
mod metric;
mod pin;
mod solve;
mod sums;
mod transfer;

pub use drag::{ControlStep, StepOptions, step};
pub use fit::{
    Distances, Fit, FitOptions, FitProgress, FitProgressFn, FitStatus, Loss, Measure, fit, fit_residuals,
};
pub use metric::sensitivity;
pub use pin::{Guide, Pin};
pub use transfer::{FieldPoints, Transfer, TransferOptions, carry, transfer, transfer_from};

/// Two unit vectors that span the tangent plane of a surface with gradient `gradient` (any where that is zero).
pub fn tangents(gradient: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let n = crate::vector::unit(gradient);
    crate::vector::frame(if n == [0.0; 3] { [0.0, 0.0, 1.0] } else { n })
}
