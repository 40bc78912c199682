//! Progress, time limit and Ctrl-C, seen from the calling thread while the core works without the interpreter.
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use isoswarm_particles::{Phase, Progress, Stop};
use pyo3::prelude::*;

/// How often the interpreter is asked whether the user pressed Ctrl-C.
const SIGNALS: Duration = Duration::from_millis(100);
/// How often the user's progress function is called.
const REPORTS: Duration = Duration::from_millis(50);

/// Watches over a run.
pub struct Watch {
    callback: Option<Py<PyAny>>,
    deadline: Option<Instant>,
    next_signal: Instant,
    next_report: Instant,
    /// What Python raised: an interruption, or an exception in the progress function.
    pub raised: Option<PyErr>,
}

impl Watch {
    /// Starts the clock. `limit` in seconds must be finite and ≥ 0.
    pub fn new(callback: Option<Py<PyAny>>, limit: Option<f64>) -> Self {
        let now = Instant::now();
        let deadline = limit.and_then(|s| now.checked_add(Duration::try_from_secs_f64(s).ok()?));
        Self { callback, deadline, next_signal: now, next_report: now, raised: None }
    }

    /// To be called at least a few times a second.
    pub fn tick(&mut self, progress: &Progress) -> ControlFlow<Stop> {
        let now = Instant::now();
        let report = now >= self.next_report && self.callback.is_some();
        if report || now >= self.next_signal {
            self.next_signal = now + SIGNALS;
            if report {
                self.next_report = now + REPORTS;
            }
            if let Err(error) = Python::attach(|py| {
                py.check_signals()?;
                if let (true, Some(f)) = (report, &self.callback) {
                    f.call1(
                        py,
                        (name(progress.phase), progress.fraction, progress.floaters, progress.steps),
                    )?;
                }
                Ok(())
            }) {
                self.raised = Some(error);
                return ControlFlow::Break(Stop::Cancelled);
            }
        }
        match self.deadline {
            Some(deadline) if now >= deadline => ControlFlow::Break(Stop::TimeLimit),
            _ => ControlFlow::Continue(()),
        }
    }
}

/// The phase as Python sees it.
fn name(phase: Phase) -> &'static str {
    match phase {
        Phase::Seeding => "seeding",
        Phase::Relaxing => "relaxing",
        Phase::Finishing => "finishing",
    }
}
