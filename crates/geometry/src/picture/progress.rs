//! How far a picture has come.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Told the part that is done, 0 to 1, between steps, from whichever thread did them.
pub(super) type Told<'a> = &'a (dyn Fn(f64) + Sync);

/// The parts of a picture's work by what is done in them.
pub(super) const CAST: (f64, f64) = (0.0, 0.5);
pub(super) const LIGHT: (f64, f64) = (0.5, 0.8);
pub(super) const RASTER: (f64, f64) = (0.8, 1.0);

/// A stretch of the work, in steps.
pub(super) struct Stage<'a> {
    told: Told<'a>,
    from: f64,
    to: f64,
    steps: usize,
    done: AtomicUsize,
}

impl<'a> Stage<'a> {
    /// The work from one part to another.
    pub fn new(told: Told<'a>, from: f64, to: f64, steps: usize) -> Self {
        told(from);
        Self { told, from, to, steps: steps.max(1), done: AtomicUsize::new(0) }
    }

    /// A step is done.
    pub fn tick(&self) {
        let done = (self.done.fetch_add(1, Ordering::Relaxed) + 1).min(self.steps);
        (self.told)(self.from + (self.to - self.from) * done as f64 / self.steps as f64);
    }
}
