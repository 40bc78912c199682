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

    /// To be called at least a few times a second. Asks whether the user pressed Ctrl-C, and calls the user's function by
    /// `report` when that is due: when `due` says so, or every 50 ms where it says nothing. False ends the run.
    pub fn look(
        &mut self,
        due: Option<bool>,
        report: impl FnOnce(Python<'_>, &Py<PyAny>) -> PyResult<bool>,
    ) -> ControlFlow<Stop> {
        let now = Instant::now();
        let report_now = due.unwrap_or(now >= self.next_report);
        let callback = self.callback.as_ref().filter(|_| report_now);
        if callback.is_some() || now >= self.next_signal {
            self.next_signal = now + SIGNALS;
            if callback.is_some() {
                self.next_report = now + REPORTS;
            }
            let asked = Python::attach(|py| {
                py.check_signals()?;
                callback.map_or(Ok(true), |f| report(py, f))
            });
            match asked {
                Ok(true) => {}
                Ok(false) => return ControlFlow::Break(Stop::Cancelled),
                Err(error) => {
                    self.raised = Some(error);
                    return ControlFlow::Break(Stop::Cancelled);
                }
            }
        }
        match self.deadline {
            Some(deadline) if now >= deadline => ControlFlow::Break(Stop::TimeLimit),
            _ => ControlFlow::Continue(()),
        }
    }

    /// [`Self::look`] for a run of the sampler.
    pub fn tick(&mut self, p: &Progress) -> ControlFlow<Stop> {
        self.look(None, |py, f| {
            f.call1(py, (name(p.phase), p.fraction, p.floaters, p.steps))?;
            Ok(true)
        })
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
