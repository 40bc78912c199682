//! Progress, time limit and Ctrl-C, seen from the calling thread while the core works without the interpreter.
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, TryLockError};
use std::time::{Duration, Instant};

use isoswarm_particles::{Phase, Progress, ProgressFn, Stop};
use pyo3::prelude::*;

/// How often the interpreter is asked whether the user pressed Ctrl-C.
const SIGNALS: Duration = Duration::from_millis(100);
/// How often the user's progress function is called.
const REPORTS: Duration = Duration::from_millis(50);
/// How often work in the thread pool asks the calling thread whether to go on.
const QUESTIONS: Duration = Duration::from_millis(5);
/// How long a thread of the pool waits for the answer before it sees whether there is other work.
const WAIT: Duration = Duration::from_micros(100);
/// Held by the one run that is in the thread pool: a thread of it that waits takes up what work there is, which must not be another run.
static IN_POOL: Mutex<()> = Mutex::new(());

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

    /// Does `work` in the thread pool: it has many short loops, and for each of them a thread of the pool would have to be woken from
    /// here. Progress is seen from the calling thread all the same. `here`: on the calling thread, since it calls
    /// the user's functions; so are runs beside another.
    pub fn over<T: Send>(&mut self, here: bool, work: impl FnOnce(&mut ProgressFn<'_>) -> T + Send) -> T {
        let alone = match IN_POOL.try_lock() {
            Ok(guard) => Some(guard),
            Err(TryLockError::Poisoned(guard)) => Some(guard.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        };
        if here || alone.is_none() {
            drop(alone);
            return work(&mut |p| self.tick(p));
        }
        let (ask, asked) = channel();
        let (answer, answered) = channel();
        let mut result = None;
        rayon::in_place_scope(|scope| {
            let result = &mut result;
            scope.spawn(move |_| {
                let mut last: Option<(Instant, Phase)> = None;
                let mut tick = |p: &Progress| {
                    let now = Instant::now();
                    if last.is_some_and(|(then, phase)| phase == p.phase && now - then < QUESTIONS) {
                        return ControlFlow::Continue(());
                    }
                    last = Some((now, p.phase));
                    // A calling thread that is gone has panicked.
                    let goes_on = ask.send(*p).ok().and_then(|()| await_answer(&answered));
                    goes_on.unwrap_or(ControlFlow::Break(Stop::Cancelled))
                };
                *result = Some(work(&mut tick));
            });
            for p in asked {
                // Whoever has stopped asking has panicked, which the end of the scope passes on.
                let _ = answer.send(self.tick(&p));
            }
        });
        result.expect("a panic of the work ends the scope")
    }

    /// [`Self::look`] for a run of the sampler.
    fn tick(&mut self, p: &Progress) -> ControlFlow<Stop> {
        self.look(None, |py, f| {
            f.call1(py, (name(p.phase), p.fraction, p.floaters, p.steps))?;
            Ok(true)
        })
    }
}

/// The answer; `None` where none will come. The user's function that is called meanwhile may need the thread pool, of which this may be
/// the only thread.
fn await_answer<T>(answered: &Receiver<T>) -> Option<T> {
    loop {
        match answered.recv_timeout(WAIT) {
            Ok(answer) => return Some(answer),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => drop(rayon::yield_now()),
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
