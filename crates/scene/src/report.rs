//! How a drag went.

/// Why a drag ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The pins are where they were dragged to.
    Reached,
    /// Nothing moved any more: the model, its limits or other pins do not allow it.
    Stuck,
    /// It took all the steps that it was given.
    StepLimit,
    /// It was let go.
    Released,
    /// It was asked to stop.
    Cancelled,
    /// It has not: the hand still holds.
    Held,
}

impl Ending {
    /// `"reached"`, `"stuck"`, `"step limit"`, `"released"`, `"cancelled"`, `"held"`.
    pub fn name(self) -> &'static str {
        match self {
            Ending::Reached => "reached",
            Ending::Stuck => "stuck",
            Ending::StepLimit => "step limit",
            Ending::Released => "released",
            Ending::Cancelled => "cancelled",
            Ending::Held => "held",
        }
    }
}

/// How a drag went; lengths in model units.
#[derive(Clone, Debug, PartialEq)]
pub struct DragReport {
    /// Whether all dragged pins are where they were dragged to.
    pub reached: bool,
    /// Why it ended.
    pub ending: Ending,
    /// Largest distance between a dragged pin and where it should be.
    pub distance: f64,
    /// Pins that the parameters could meet independently of each other at the end, and...
    pub rank: usize,
    /// ...all pins.
    pub pins: usize,
    /// Largest distance between a pin and the surface.
    pub residual: f64,
    /// How far each dragged pin has slipped over the surface instead of moving it (a vector): implicit surfaces are
    /// slippery.
    pub slip: Vec<(u64, [f64; 3])>,
    /// Steps it took.
    pub steps: usize,
    /// Paths of the parameters that were held back by their bounds at the end.
    pub at_limit: Vec<String>,
}

/// How a fit went; lengths in model units.
#[derive(Clone, Debug, PartialEq)]
pub struct FitReport {
    /// Whether the parameters are the best nearby.
    pub converged: bool,
    /// Why it ended.
    pub reason: String,
    /// Root of the mean square distance between the surface and the points, whatever the loss; weights count squared, pins and
    /// points that were left out not at all.
    pub rms: f64,
    /// The largest distance of these points.
    pub largest: f64,
    /// Points that were left out: of weight 0, or where F has no gradient.
    pub skipped: usize,
    /// Parameters, or combinations of them, that the points determine, of...
    pub rank: usize,
    /// ...the free parameters.
    pub freedom: usize,
    /// Steps taken or tried.
    pub iterations: usize,
    /// Paths of the parameters that ended at a bound and would go on.
    pub at_limit: Vec<String>,
}

/// How well a part takes on the effect of an adapter; lengths in model units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TransferReport {
    /// Root mean square distance between the part's surface and the deformed one.
    pub rms: f64,
    /// The largest such distance.
    pub largest: f64,
    /// The largest distance as a part of the size: how far off the part is.
    pub relative: f64,
    /// Parameters of the part, or combinations of them, that the deformation determines, of...
    pub rank: usize,
    /// ...its free parameters.
    pub freedom: usize,
    /// Paths within the part of the parameters that are at a bound and would go on.
    pub at_limit: Vec<String>,
}
