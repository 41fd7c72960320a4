//! What a run is asked to look at between its steps: states at given times, and events.

use crate::run::event::Request;
use crate::run::span::{Schedule, SpanError};

/// Asks a run for states at given times and for events, whatever its steps are: the steps stay the same, to the
/// last bit. Each schedule has these methods: [`Span`](crate::Span), [`Until`](crate::Until), [`Schedule`], and a
/// step size alone.
///
/// Such a state lies between two steps, on the dense output of the method
/// ([`Method::between`](crate::Method::between)). It keeps the laws as the steps do: `H` and the further invariants
/// have the values of the run, and `S` does not fall from one output to a later one.
pub trait Watch: Into<Schedule> {
    /// Records the states at these times, in place of those after each step. The trajectory holds the start, the
    /// states at these times, and the last state. The iterator over [`Steps`](crate::Steps) yields the same states
    /// after the start. Without any time these are the start and the last state.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(10.0).output_at([0.5, 1.0, 2.0, 5.0]);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let times: Vec<f64> = run.iter().map(|state| state.time).collect();
    /// assert_eq!(times, [0.0, 0.5, 1.0, 2.0, 5.0, 10.0]);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn output_at(self, times: impl IntoIterator<Item = f64>) -> Schedule {
        let mut schedule = self.into();
        let list = schedule.watch.times.get_or_insert_default();
        list.extend(times);
        list.sort_by(f64::total_cmp);
        list.dedup();
        schedule
    }

    /// Records the states at the times `t₀ + k Δt`, like [`output_at`](Self::output_at). An interval that changes no
    /// time of the run is [refused](crate::SpanError::OutputStandstill).
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(10.0).tolerance(1e-5).output_every(0.25);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.states().len(), 41);
    /// assert_eq!(run.states()[7].time, 1.75);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn output_every(self, interval: f64) -> Schedule {
        let mut schedule = self.into();
        schedule.watch.interval = Some(interval);
        schedule
    }

    /// Finds where a function of the point changes its sign, to the last digits of the time, and records the
    /// [events](crate::Trajectory::events) by their name. Say the type of the point in the closure.
    ///
    /// Both directions count unless you go on with [`rising`](Watched::rising) or [`falling`](Watched::falling),
    /// and the run goes on after it unless you say [`stop`](Watched::stop). Inside a step the function is looked at
    /// four times, so that two changes of sign in one step are found unless they lie closer than a fifth of it. A
    /// function that is zero at the start has no event there. A point where it is NaN is left out, inside a step and at
    /// its end: a change of sign across such points is an event at the first time after them.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(20.0)
    ///     .event("node", |p: &Vector3<f64>| p.y)
    ///     .event("apex", |p: &Vector3<f64>| p.z - 0.3).falling();
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let nodes = run.events().iter().filter(|event| &*event.name == "node");
    /// assert!(nodes.count() > 1);
    /// # Ok(())
    /// # }
    /// ```
    fn event<P: 'static>(
        self,
        name: impl Into<String>,
        function: impl Fn(&P) -> f64 + Send + Sync + 'static,
    ) -> Watched {
        self.event_in_time(name, move |_, x: &P| function(x))
    }

    /// The same for a function of the time and the point.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::steps(0.1, 50).event_in_time("line", |t, p: &Vector3<f64>| p.x - 0.1 * t);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let state = &run.events()[0].state;
    /// assert!((state.point.x - 0.1 * state.time).abs() < 1e-15);
    /// # Ok(())
    /// # }
    /// ```
    fn event_in_time<P: 'static>(
        self,
        name: impl Into<String>,
        function: impl Fn(f64, &P) -> f64 + Send + Sync + 'static,
    ) -> Watched {
        let mut schedule = self.into();
        schedule.watch.events.push(Request::new(name.into(), function));
        Watched(schedule)
    }
}

impl<S: Into<Schedule>> Watch for S {}

/// A schedule with an event, whose direction and consequence can be said; made by [`Watch::event`].
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Watched(Schedule);

impl Watched {
    fn with(mut self, change: impl FnOnce(&mut Request)) -> Self {
        if let Some(request) = self.0.watch.events.last_mut() {
            change(request);
        }
        self
    }

    /// The function has to rise through zero.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::Vector1;
    /// let span = Span::until(20.0).event("start", |x: &Vector1<f64>| x.x - 1.0).rising();
    /// ```
    pub fn rising(self) -> Self {
        self.with(|request| (request.rising, request.falling) = (true, false))
    }

    /// The function has to fall through zero.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::Vector1;
    /// let span = Span::until(20.0).event("ground", |height: &Vector1<f64>| height.x).falling();
    /// ```
    pub fn falling(self) -> Self {
        self.with(|request| (request.rising, request.falling) = (false, true))
    }

    /// Ends the run at the event, with [`Ending::Event`](crate::Ending::Event): the last state of the trajectory is
    /// the state there. The [checkpoint](crate::Checkpoint) of such a run is the end of the step in which the event
    /// lies: a run that is resumed from it has no outputs and events between the two.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Ending, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(20.0).event("node", |p: &Vector3<f64>| p.y).stop();
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.ending(), Ending::Event { index: 0 });
    /// assert_eq!(run.last(), &run.events()[0].state);
    /// assert!(run.last().time < 20.0 && run.last().point.y.abs() < 1e-15);
    /// # Ok(())
    /// # }
    /// ```
    pub fn stop(self) -> Self {
        self.with(|request| request.stops = true)
    }
}

impl From<Watched> for Schedule {
    fn from(Watched(schedule): Watched) -> Self {
        schedule
    }
}

/// What a schedule asks a run to look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Requests {
    /// Times of outputs, in their order, if a list was given.
    pub(crate) times: Option<Vec<f64>>,
    /// The interval of outputs from the start on.
    pub(crate) interval: Option<f64>,
    pub(crate) events: Vec<Request>,
}

impl Requests {
    pub(crate) const fn has_outputs(&self) -> bool {
        self.times.is_some() || self.interval.is_some()
    }

    /// Accepts outputs of a run from `start` to `end` that have different times up to `seen`.
    pub(crate) fn check(&self, [start, end]: [f64; 2], seen: f64) -> Result<(), SpanError> {
        let last = end + rounding(start, end);
        let outside = |time: &&f64| !(**time >= start && **time <= last && time.is_finite());
        if let Some(&time) = self.times.iter().flatten().find(outside) {
            return Err(SpanError::Output { time, start, end });
        }
        match self.interval {
            Some(interval) if !(interval > 0.0 && interval.is_finite()) => {
                Err(SpanError::OutputInterval { interval })
            }
            Some(interval) if interval <= rounding(start, seen) => {
                let time = if seen.abs() > start.abs() { seen } else { start };
                Err(SpanError::OutputStandstill { time, interval })
            }
            _ => Ok(()),
        }
    }
}

/// By how much a time of a run that began at `start` may differ from another expression of the same time.
pub(crate) fn rounding(start: f64, time: f64) -> f64 {
    2.0 * f64::EPSILON * start.abs().max(time.abs())
}

/// The outputs of a run that are still to come.
#[derive(Clone, Debug)]
pub(crate) struct Outputs {
    start: f64,
    times: Option<Vec<f64>>,
    interval: Option<f64>,
    /// How many of the times are over, and how many intervals.
    index: usize,
    count: usize,
}

impl Outputs {
    /// Those after `time` in a run that began at `start`.
    pub(crate) fn after(
        time: f64,
        start: f64,
        times: Option<Vec<f64>>,
        interval: Option<f64>,
    ) -> Self {
        let mut outputs = Self { start, times, interval, index: 0, count: 0 };
        let done = time + rounding(start, time);
        outputs.index = outputs.listed().partition_point(|t| *t <= done);
        if let Some(interval) = interval {
            // The quotient may be off by its rounding.
            let quotient = ((done - start) / interval).floor().max(1.0) - 1.0;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is a whole number that is not negative, and saturates"
            )]
            let before = quotient as usize;
            outputs.count = before;
            while outputs.in_interval().is_some_and(|t| t <= done) {
                outputs.count += 1;
            }
        }
        outputs
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.times.is_none() && self.interval.is_none()
    }

    /// Returns whether no output is left, however long the run goes on.
    pub(crate) fn are_over(&self) -> bool {
        self.index == self.listed().len() && self.interval.is_none()
    }

    fn listed(&self) -> &[f64] {
        self.times.as_deref().unwrap_or_default()
    }

    /// The next multiple of the interval.
    fn in_interval(&self) -> Option<f64> {
        Some(self.start + (self.count + 1) as f64 * self.interval?)
    }

    /// The next output up to `time`, or so near to it that it is the same time.
    pub(crate) fn next(&mut self, time: f64) -> Option<f64> {
        let last = time + rounding(self.start, time);
        let listed = self.listed().get(self.index).copied().filter(|t| *t <= last);
        let counted = self.in_interval().filter(|t| *t <= last);
        let next = match (listed, counted) {
            (Some(a), Some(b)) => a.min(b),
            (a, b) => a.or(b)?,
        };
        self.index += usize::from(listed.is_some_and(|t| t <= next));
        self.count += usize::from(counted.is_some_and(|t| t <= next));
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_taken_up_where_they_were_left() {
        for start in [0.0, -3.0, 1e6] {
            let times = vec![start + 0.25, start + 0.3, start + 1.0, start + 2.75];
            let (step, interval) = (0.07, 0.1);
            let time = |n: u32| start + f64::from(n) * step;
            let ahead =
                |n: u32| Outputs::after(time(n), start, Some(times.clone()), Some(interval));
            let mut whole = ahead(0);
            let mut all = Vec::new();
            for n in 1..=50 {
                let mut resumed = ahead(n - 1);
                while let Some(t) = whole.next(time(n)) {
                    assert_eq!(resumed.next(time(n)), Some(t));
                    all.push(t);
                }
                assert_eq!(resumed.next(time(n)), None);
            }
            assert!(all.is_sorted_by(|a, b| a < b), "{all:?}");
            // 35 multiples up to 3.5, and 0.25 and 2.75, which are none of them.
            assert!((37..=39).contains(&all.len()), "{} from {start}", all.len());
        }
    }
}
