//! How far a run goes, what of it is recorded, and its events, as Python says them.

use std::sync::Arc;

use metriplectic_fields::Real;
use metriplectic_integrators::{Entries, OpenState, Schedule, Span, Watch as _};
use pyo3::prelude::*;
use pyo3::types::PyAny;

use super::errors::SpanError;
use super::interrupt::Look;
use super::tapes::{Function, tape};

/// The arguments of a run that say when it ends and what it records.
#[derive(Clone, Debug, FromPyObject)]
pub(crate) struct Times {
    start: f64,
    end: Option<f64>,
    h: Option<f64>,
    steps: Option<usize>,
    tol: f64,
    every: Option<f64>,
    at: Option<Vec<f64>>,
    each: Option<usize>,
    at_most: Option<usize>,
    rest: Option<f64>,
    corners: Vec<f64>,
    sampled: Option<f64>,
    first_step: Option<f64>,
    least_step: Option<f64>,
    largest_step: Option<f64>,
    scale: Option<Vec<f64>>,
    absolute: Option<Vec<f64>>,
    backward: bool,
}

impl Times {
    /// Makes the schedule, without its events.
    ///
    /// # Errors
    ///
    /// `SpanError` if the numbers contradict each other. What the library refuses is its error later.
    pub(crate) fn schedule(&self) -> PyResult<Schedule> {
        let mut schedule = self.size()?.starting_at(self.start);
        if self.backward {
            schedule = schedule.backward();
        }
        if let Some(each) = self.each {
            schedule = schedule.every(each);
        }
        if let Some(most) = self.at_most {
            schedule = schedule.at_most(most);
        }
        if let Some(rest) = self.rest {
            schedule = schedule.until_rest(rest);
        }
        if let Some(every) = self.every {
            schedule = schedule.output_every(every);
        }
        if let Some(times) = &self.at {
            schedule = schedule.output_at(times.iter().copied());
        }
        if !self.corners.is_empty() {
            schedule = schedule.corners(self.corners.iter().copied());
        }
        if let Some(interval) = self.sampled {
            schedule = schedule.sampled(interval);
        }
        Ok(schedule)
    }

    fn size(&self) -> PyResult<Schedule> {
        match (self.h, self.steps, self.end) {
            (Some(h), Some(steps), _) => Ok(Span::steps(h, steps).into()),
            (Some(h), None, Some(end)) => {
                let count = if self.backward { self.start - end } else { end - self.start } / h;
                let steps = count.round();
                // The refusal of a size or an end that makes no sense is that of the library.
                if !(h > 0.0 && count > 0.0 && count.is_finite()) {
                    return Ok(if h > 0.0 {
                        Span::until(end).into()
                    } else {
                        Span::steps(h, 1).into()
                    });
                }
                if steps < 1.0 || (count - steps).abs() > 1e-9 * steps || steps > 1e15 {
                    return Err(SpanError::new_err(format!(
                        "from t = {} to t = {end} are {count} steps of size {h}; the end must be a whole number of steps away, \
                         or say their number by `steps=`",
                        self.start
                    )));
                }
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "it is a whole number from 1 to 10¹⁵"
                )]
                Ok(Span::steps(h, steps as usize).into())
            }
            (Some(_), None, None) => Err(SpanError::new_err(
                "steps of one size have no end; say when by `t=`, or how many by `steps=`",
            )),
            (None, Some(_), _) => {
                Err(SpanError::new_err("`steps=` counts steps of one size; say it by `h=`"))
            }
            (None, None, None) => Err(SpanError::new_err("say when the run ends, by `t=`")),
            (None, None, Some(end)) => self.until(end),
        }
    }

    fn until(&self, end: f64) -> PyResult<Schedule> {
        let mut until = Span::until(end).tolerance(self.tol);
        if let Some(h) = self.first_step {
            until = until.first_step(h);
        }
        if let Some(h) = self.least_step {
            until = until.least_step(h);
        }
        if let Some(h) = self.largest_step {
            until = until.largest_step(h);
        }
        match (&self.scale, &self.absolute) {
            (None, None) => Ok(until.into()),
            (Some(sizes), None) => Ok(until.scale_listed(sizes)),
            (None, Some(errors)) => Ok(until.absolute_listed(errors)),
            (Some(_), Some(_)) => Err(SpanError::new_err("give `scale=` or `absolute=`, not both")),
        }
    }
}

/// An event as Python says it.
#[derive(Debug, FromPyObject)]
pub(crate) struct Event<'py> {
    name: String,
    function: Bound<'py, PyAny>,
    direction: i8,
    /// The number of the event that ends the run; 0 if none does.
    stop: usize,
    jump: Option<Bound<'py, PyAny>>,
    heat_at: Option<f64>,
    may_lower_entropy: bool,
    resolution: Option<f64>,
}

/// An event with its functions read.
#[derive(Clone, Debug)]
pub(crate) struct Watched {
    name: String,
    function: Function,
    direction: i8,
    /// The number of the event that ends the run; 0 if none does.
    stop: usize,
    jump: Option<Function>,
    heat_at: Option<f64>,
    may_lower_entropy: bool,
    resolution: Option<f64>,
}

impl Event<'_> {
    /// Reads the functions.
    ///
    /// # Errors
    ///
    /// `TraceError` if they are no recordings.
    pub(crate) fn read(&self, theta: &Arc<[f64]>) -> PyResult<Watched> {
        let function =
            |program| tape(program).map(|tape| Function { tape, theta: Arc::clone(theta) });
        Ok(Watched {
            name: self.name.clone(),
            function: function(&self.function)?,
            direction: self.direction,
            stop: self.stop,
            jump: self.jump.as_ref().map(function).transpose()?,
            heat_at: self.heat_at,
            may_lower_entropy: self.may_lower_entropy,
            resolution: self.resolution,
        })
    }
}

/// A state of a run, of which functions see the entries.
pub(crate) trait Point: Clone + 'static {
    /// Returns the entries.
    fn entries(&self) -> &[f64];

    /// Returns the state with other entries, at the same time and with the same ledger.
    fn with(&self, entries: &[f64]) -> Self;
}

impl Point for Entries {
    fn entries(&self) -> &[f64] {
        self
    }

    fn with(&self, entries: &[f64]) -> Self {
        entries.into()
    }
}

impl Point for OpenState<Entries> {
    fn entries(&self) -> &[f64] {
        &self.x
    }

    fn with(&self, entries: &[f64]) -> Self {
        self.at(entries.into())
    }
}

/// Adds events to a schedule of states `P`. With parameters that have derivatives, the maps of jumps are given at moving numbers too.
pub(crate) fn watching<P: Point>(
    schedule: Schedule,
    events: &[Watched],
    derivatives: Derivatives,
) -> Schedule {
    events.iter().fold(schedule, |schedule, event| event.add::<P>(schedule, derivatives))
}

/// Adds what notes the time that a run has reached.
pub(crate) fn noting<P: Point>(schedule: Schedule, look: &Arc<Look>) -> Schedule {
    if !look.has_progress() {
        return schedule;
    }
    let look = Arc::clone(look);
    let note = move |t: f64, _: &P| {
        look.note(t);
        1.0
    };
    schedule.event_in_time(PROGRESS, note).into()
}

/// The name of the event that has no event: it notes the time.
pub(crate) const PROGRESS: &str = "progress";

/// Whether a run has derivatives, and along what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Derivatives {
    /// It has none.
    None,
    /// Along its start.
    Start,
    /// Along its start and parameters.
    Parameters,
}

impl Watched {
    /// Evaluates the function of the event at moving entries.
    pub(crate) fn value_at(&self, x: &[Real], t: f64) -> Real {
        self.function.outputs(x, Real::from(t))[0]
    }

    fn add<P: Point>(&self, schedule: Schedule, derivatives: Derivatives) -> Schedule {
        let function = self.function.clone();
        let value = move |t: f64, x: &P| function.value(x.entries(), t);
        let mut watched = schedule.event_in_time(self.name.clone(), value);
        if self.direction > 0 {
            watched = watched.rising();
        }
        if self.direction < 0 {
            watched = watched.falling();
        }
        if self.stop > 0 {
            watched = watched.stop_after(self.stop);
        }
        if let Some(dt) = self.resolution {
            watched = watched.resolution(dt);
        }
        let Some(map) = self.jump.clone() else {
            let function = self.function.clone();
            return match derivatives {
                Derivatives::Start if self.stop > 0 => {
                    watched.differentiable(move |t, x: &Vec<Real>| function.outputs(x, t)[0]).into()
                }
                Derivatives::Parameters if self.stop > 0 => watched
                    .differentiable(move |t, (x, theta): &(Vec<Real>, Vec<Real>)| {
                        function.outputs_at(x, t, theta)[0]
                    })
                    .into(),
                _ => watched.into(),
            };
        };
        let narrow = map.clone();
        let mut jumping = watched.jump(move |t, x: &P| x.with(&narrow.outputs(x.entries(), t)));
        if let Some(temperature) = self.heat_at {
            jumping = jumping.heat_at(temperature);
        }
        if self.may_lower_entropy {
            jumping = jumping.may_lower_entropy();
        }
        let function = self.function.clone();
        match derivatives {
            Derivatives::None => {}
            Derivatives::Start => {
                jumping = jumping.differentiable(
                    move |t, x: &Vec<Real>| function.outputs(x, t)[0],
                    move |t, x: &Vec<Real>| map.outputs(x, t),
                );
            }
            Derivatives::Parameters => {
                jumping = jumping.differentiable(
                    move |t, (x, theta): &(Vec<Real>, Vec<Real>)| {
                        function.outputs_at(x, t, theta)[0]
                    },
                    move |t, (x, theta): &(Vec<Real>, Vec<Real>)| {
                        (map.outputs_at(x, t, theta), theta.clone())
                    },
                );
            }
        }
        jumping.into()
    }
}
