//! The account of a run while it is under way.

use std::ops::ControlFlow;

use crate::options::{Phase, Progress, ProgressFn, Stop};

/// Counters, progress and cancellation, shared by all parts of a run.
pub(crate) struct Run<'a> {
    pub(crate) seed: u64,
    pub(crate) evaluations: u64,
    pub(crate) births: u64,
    pub(crate) deaths: u64,
    pub(crate) steps: usize,
    /// Why the run was asked to stop.
    pub(crate) stop: Option<Stop>,
    pub(crate) warnings: Vec<String>,
    progress: Option<&'a mut ProgressFn<'a>>,
    fraction: f64,
}

impl<'a> Run<'a> {
    pub(crate) fn new(seed: u64, progress: Option<&'a mut ProgressFn<'a>>) -> Self {
        Self {
            seed,
            evaluations: 0,
            births: 0,
            deaths: 0,
            steps: 0,
            stop: None,
            warnings: Vec::new(),
            progress,
            fraction: 0.0,
        }
    }

    /// Reports progress; whether to go on.
    pub(crate) fn tell(&mut self, phase: Phase, fraction: f64, floaters: usize) -> bool {
        self.fraction = self.fraction.max(fraction.min(1.0));
        let now = Progress { phase, fraction: self.fraction, floaters, steps: self.steps };
        if self.stop.is_none()
            && let Some(f) = &mut self.progress
            && let ControlFlow::Break(why) = f(&now)
        {
            self.stop = Some(why);
        }
        self.stop.is_none()
    }
}
