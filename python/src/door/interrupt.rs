//! A system that looks up from its work: for signals of the interpreter, and for a progress bar.

use std::cell::Cell;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metriplectic_equations::{
    Covectors, Equations, FrictionTerms, Kind, Model, PointError, SecondLaw, Sizes, Terms,
};
use pyo3::prelude::*;

/// Evaluations between two looks at the watch.
const EVALUATIONS: u32 = 256;
/// The time between two looks at the signals of the interpreter.
const PATIENCE: Duration = Duration::from_millis(50);

/// Looks for signals while a run goes on without the interpreter, and calls a function of the time that it has reached.
pub(crate) struct Look {
    evaluations: AtomicU32,
    last: Mutex<Instant>,
    stopped: AtomicBool,
    /// The bits of the time that a run has reached.
    time: AtomicU64,
    progress: Option<Py<PyAny>>,
    error: Mutex<Option<PyErr>>,
}

impl fmt::Debug for Look {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Look").field("stopped", &self.stopped).finish_non_exhaustive()
    }
}

/// Takes a lock, which holds a value that no panic leaves half made.
fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

thread_local! {
    /// True while this thread is in Python: a look does not begin inside another one.
    static IS_LOOKING: Cell<bool> = const { Cell::new(false) };
}

impl Look {
    /// A look that calls `progress` with the time reached, twenty times a second.
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Arc<Self> {
        Arc::new(Self {
            evaluations: AtomicU32::new(0),
            last: Mutex::new(Instant::now()),
            stopped: AtomicBool::new(false),
            time: AtomicU64::new(f64::NAN.to_bits()),
            progress,
            error: Mutex::new(None),
        })
    }

    /// Returns whether the time that is reached is asked for.
    pub(crate) fn has_progress(&self) -> bool {
        self.progress.is_some()
    }

    /// Notes the time that a run has reached.
    pub(crate) fn note(&self, time: f64) {
        self.time.store(time.to_bits(), Ordering::Relaxed);
    }

    /// Takes the error of a signal, or of the function that was called.
    pub(crate) fn take_error(&self) -> Option<PyErr> {
        locked(&self.error).take()
    }

    /// Counts an evaluation, and returns whether the run goes on.
    #[inline]
    fn goes_on(&self) -> bool {
        // Lost counts do no harm.
        let count = self.evaluations.load(Ordering::Relaxed).wrapping_add(1);
        self.evaluations.store(count, Ordering::Relaxed);
        if count.is_multiple_of(EVALUATIONS) {
            self.look();
        }
        !self.stopped.load(Ordering::Relaxed)
    }

    #[cold]
    fn look(&self) {
        let mut last = locked(&self.last);
        if last.elapsed() < PATIENCE || IS_LOOKING.get() {
            return;
        }
        *last = Instant::now();
        drop(last);
        IS_LOOKING.set(true);
        let outcome = Python::attach(|py| {
            py.check_signals()?;
            let time = f64::from_bits(self.time.load(Ordering::Relaxed));
            match &self.progress {
                Some(progress) if !time.is_nan() => progress.call1(py, (time,)).map(drop),
                _ => Ok(()),
            }
        });
        IS_LOOKING.set(false);
        if let Err(error) = outcome {
            *locked(&self.error) = Some(error);
            self.stopped.store(true, Ordering::Relaxed);
        }
    }
}

/// A system of recorded functions in a run that a signal ends: from then on it has no values, so that the step fails and the run
/// hands over what it has reached.
#[derive(Clone)]
pub(crate) struct Interruptible {
    system: Arc<dyn FrictionTerms + Send + Sync>,
    look: Arc<Look>,
    is_verified: bool,
}

impl fmt::Debug for Interruptible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Interruptible").field("look", &self.look).finish_non_exhaustive()
    }
}

impl Interruptible {
    /// A system that looks up by `look`.
    pub(crate) fn new(
        system: Arc<dyn FrictionTerms + Send + Sync>,
        look: Arc<Look>,
        is_verified: bool,
    ) -> Self {
        Self { system, look, is_verified }
    }
}

impl Equations for Interruptible {
    fn sizes(&self) -> Sizes {
        self.system.sizes()
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        if self.look.goes_on() {
            self.system.values(t, x, values);
        } else {
            values.fill(f64::NAN);
        }
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        if self.look.goes_on() {
            self.system.differentials(t, x, values, w);
        } else {
            values.fill(f64::NAN);
            w.fill(f64::NAN);
        }
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        if self.look.goes_on() { self.system.velocity(t, x, v) } else { None }
    }

    fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        if self.look.goes_on() { self.system.velocity_with(t, x, w, v) } else { None }
    }

    fn stage(&self, t: f64, x: &[f64], q: &[f64], rates: &mut [f64]) -> Option<f64> {
        if self.look.goes_on() { self.system.stage(t, x, q, rates) } else { None }
    }

    fn second_law(&self) -> SecondLaw {
        self.system.second_law()
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.system.kind(invariant)
    }

    fn energy_depends_on_time(&self) -> bool {
        self.system.energy_depends_on_time()
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        self.system.power(t, x)
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.system.check(x)
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.system.defect(x)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        self.system.scales(x, sizes);
    }

    fn is_vector_space(&self) -> bool {
        self.system.is_vector_space()
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        self.system.chart(x, q, y);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        self.system.coordinates(x, y, q)
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        self.system.stage_state(x, q, y)
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        self.system.stage_coordinates(x, y, q);
    }

    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        self.system.stage_rates(x, q, y, v, rates);
    }

    fn is_verified(&self) -> bool {
        self.is_verified
    }

    fn model(&self) -> Option<&dyn Model> {
        self.system.model()
    }
}

impl FrictionTerms for Interruptible {
    fn term_count(&self) -> usize {
        self.system.term_count()
    }

    fn terms(&self, t: f64, x: &[f64], w: Covectors<'_>, term: &mut Terms<'_>) {
        self.system.terms(t, x, w, term);
    }
}
