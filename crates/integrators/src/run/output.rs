//! States between steps: at the times that were asked for, at events, and at any time of the last step.

use metriplectic_dynamics::SecondLaw;

use crate::run::corners::{self, Fixed};
use crate::run::course::Course;
use crate::run::ending::Ending;
use crate::run::event::path::Path;
use crate::run::event::{Event, Events, Found, Interruption};
use crate::run::rounding::rounding;
use crate::run::schedule::Schedule;
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::run::stepping::{AnyStepper, Stepping};
use crate::run::steps::Steps;
use crate::run::watching::{StepBefore, Watching};
use crate::step::dense::{Target, between, says_between};
use crate::step::{
    Element, Excursion, Flow, JumpError, Laws, StepEnds, StepError, StepStart, Stepper,
};

impl<F: Flow + ?Sized, M: Stepper<F>> Steps<'_, F, M> {
    /// The state at a time in the last step, on the [dense output](Stepper::between) of the method; `None` at other
    /// times, or if the flow does not say what lies between two states.
    ///
    /// The entropy is between those at the ends of the step. That of two times in one step of `Gauss` or `Radau` may fall by
    /// the error of the method; that of [outputs](Self::outputs) never falls.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let mut steps = WeylMidpoint.steps(&body, Vector3::new(0.4, 0.5, 0.3), 0.1)?;
    /// while steps.state().time < 1.0 {
    ///     steps.advance()?;
    /// }
    /// let state = steps.at(0.98).expect("it lies in the last step");
    /// assert_eq!(state.time, 0.98);
    /// assert!(steps.at(0.5).is_none());
    /// # Ok(())
    /// # }
    /// ```
    pub fn at(&mut self, time: f64) -> Option<State<F::Space>> {
        let Self { method, flow, memory, course } = self;
        course.at(time, &mut Stepping { method, flow: *flow, memory, tried: None })
    }

    /// The states at the [times asked for](crate::Watch::output_at) in the last step, as far as the iterator has not
    /// yielded them.
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
    /// let span = Span::steps(0.1, 10).output_every(0.04);
    /// let mut steps = WeylMidpoint.steps(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// steps.advance()?;
    /// let times: Vec<f64> = steps.outputs().map(|state| state.time).collect();
    /// assert_eq!(times, [0.04, 0.08]);
    /// # Ok(())
    /// # }
    /// ```
    pub fn outputs(&self) -> impl Iterator<Item = &State<F::Space>> {
        self.course.watching.iter().flat_map(|watching| &watching.queue)
    }

    /// The [events](crate::Watch::event) found since the last call.
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
    /// let span = Span::until(20.0).event("node", |p: &Vector3<f64>| p.y);
    /// let mut steps = WeylMidpoint.steps(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// while let Some(state) = steps.next() {
    ///     state?;
    ///     for event in steps.take_events() {
    ///         println!("{event}");
    ///     }
    /// }
    /// # Ok(())
    /// # }
    /// ```
    pub fn take_events(&mut self) -> Vec<Event<F::Space>> {
        self.course.take_events()
    }

    /// The outputs and events of a schedule, for a run that was resumed: closures are not in a checkpoint. Nothing
    /// else of the schedule is used. What lies before the present time is over, and the rest is as in the run that
    /// was put down, bit for bit.
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
    /// # let start = Vector3::new(0.4, 0.5, 0.3);
    /// let span = Span::steps(0.1, 100).output_every(0.25);
    /// let mut steps = WeylMidpoint.steps(&body, start, span.clone())?;
    /// for _ in 0..50 {
    ///     steps.advance()?;
    /// }
    /// let resumed = WeylMidpoint.resume(&body, &steps.checkpoint())?.watching(span.clone())?.run()?;
    /// let whole = WeylMidpoint.run(&body, start, span)?;
    /// assert_eq!(resumed.states()[1..], whole.states()[21..]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`SpanError`] if a time is outside of the run, or an event is one of other points.
    pub fn watching(mut self, schedule: impl Into<Schedule>) -> Result<Self, SpanError> {
        self.course.watch(schedule.into())?;
        Ok(self)
    }
}

/// The last step of a run with noise.
struct OnPath<'s, 'a, F: Flow + ?Sized> {
    course: &'s Course<'a, F>,
    method: &'s mut dyn AnyStepper<F>,
}

impl<F: Flow + ?Sized> Path<F::Space> for OnPath<'_, '_, F> {
    fn state(&mut self, theta: f64) -> Option<State<F::Space>> {
        self.course.inside(theta, self.method)
    }

    fn has_excursion(&mut self, excursion: &Excursion<'_, Element<F>>) -> Option<bool> {
        let StepBefore { h, in_parts, .. } = self.course.before;
        if in_parts {
            return None;
        }
        self.method.excursion(self.course.start_of_last(), h, excursion)
    }
}

impl<F: Flow + ?Sized> Course<'_, F> {
    /// Takes up the outputs and events of a schedule.
    pub(super) fn watch(&mut self, schedule: Schedule) -> Result<(), SpanError> {
        self.watching = {
            let last = if self.before.h == 0.0 { self.last_numbers.as_slice() } else { &[] };
            let counts = self.certificate.event_counts.as_slice();
            Watching::new(schedule.watch, &self.progress, &self.state, (last, counts))?
        };
        if let Some(watching) = &self.watching {
            self.certificate.event_counts = watching.events.counts();
        }
        Ok(())
    }

    /// The events found since the last call.
    pub(super) fn take_events(&mut self) -> Vec<Event<F::Space>> {
        self.watching.as_mut().map_or_else(Vec::new, |watching| std::mem::take(&mut watching.found))
    }

    /// The state at a time in the last step.
    fn at(&mut self, time: f64, method: &mut dyn AnyStepper<F>) -> Option<State<F::Space>> {
        let [start, end] = [self.before.state.time, self.state.time];
        let allowed = rounding(self.progress.start, end);
        let inside = time >= start.min(end) - allowed && time <= start.max(end) + allowed;
        if inside { self.inside(self.fraction(time), method) } else { None }
            .map(|state| State { time, ..state })
    }

    /// A time of the last step as a fraction of it.
    fn fraction(&self, time: f64) -> f64 {
        let [start, end] = [self.before.state.time, self.state.time];
        if (end - time).abs() <= rounding(self.progress.start, end) {
            1.0
        } else {
            ((time - start) / (end - start)).max(0.0)
        }
    }

    /// Whether the entropy never falls.
    fn has_entropy(&self) -> bool {
        self.promises.entropy && self.flow.entropy_law() != SecondLaw::NoEntropy
    }

    /// The state at a fraction of the last step.
    fn inside(&self, theta: f64, method: &mut dyn AnyStepper<F>) -> Option<State<F::Space>> {
        if theta >= 1.0 {
            return Some(self.state.clone());
        }
        if self.is_noisy() {
            return self.on_path(theta, method);
        }
        let (has_entropy, reference) = (self.has_entropy(), self.reference(self.before.entropy));
        let Self { flow, before, state, values, progress, .. } = self;
        let corners = &progress.corners;
        let (x, end, h) = (&before.state.point, &state.point, before.h);
        let (values, reference_of_run) = ([&before.values, values], &reference);
        let step = StepEnds { flow: *flow, x, end, h, values, reference: reference_of_run };
        let times = [before.state.time, state.time];
        let at = |point: Element<F>| {
            let Laws { energy, entropy, .. } = flow.laws(&point);
            let time = along(times, theta);
            State { step: before.state.step, time, point, energy, entropy }
        };
        let is_between = |inside: &State<F::Space>| {
            let round_off = || flow.entropy_round_off([x, end]);
            let out = (before.state.entropy - inside.entropy).max(inside.entropy - state.entropy);
            inside.energy.is_finite() && (!has_entropy || out <= 0.0 || out <= round_off())
        };
        let promises = self.promises;
        // A step of that size, where the method does not know what lies in this one: after a step in parts, and after
        // one that is longer than a chart.
        let smaller_step = |method: &dyn AnyStepper<F>| {
            if !says_between(*flow, x) {
                return None;
            }
            let (values, reference) = (before.values.clone(), reference.clone());
            let start =
                StepStart { flow: *flow, x, time: times[0], values, reference, allowed: None };
            let size = Fixed { h: theta * h, end: times[0] + theta * (times[1] - times[0]) };
            let (mut start, mut taken) = (Some(start), None);
            method.afresh(&mut |method| {
                let start = start.take();
                taken = start.and_then(|start| corners::step(method, start, size, corners).ok());
            });
            let taken = taken?;
            let inside = at(taken.x);
            if is_between(&inside) {
                return Some(inside);
            }
            let entropy =
                inside.entropy.clamp(before.state.entropy, state.entropy.max(before.state.entropy));
            let target = Target::new(&step, promises, theta, Some(entropy));
            Some(at(target.reached_from(&inside.point, || end.clone())))
        };
        let known = if before.in_parts { None } else { method.between(&step, theta) };
        // The output of any method serves one that finds no entropy between those of the ends.
        known
            .map(at)
            .filter(is_between)
            .or_else(|| smaller_step(method).filter(is_between))
            .or_else(|| between(&step, promises, theta).map(at))
    }

    /// Looks at the step that was just taken.
    #[inline(never)]
    pub(super) fn look(&mut self, method: &mut dyn AnyStepper<F>) -> Result<(), StepError> {
        let Some(mut watching) = self.watching.take() else { return Ok(()) };
        watching.queue.clear();
        let found = self.find(&mut watching, method);
        let (time, h) = (self.before.state.time, self.before.h);
        let looked = match found {
            None => Err(method.nothing_between(time, h)),
            Some(None) => Ok(()),
            Some(Some(with_it)) => {
                method.restart();
                self.jump(&mut watching, &with_it)
            }
        };
        let piled_up = watching.events.piled_up().cloned();
        self.watching = Some(watching);
        let looked = match piled_up {
            Some(event) => Err(StepError::Jump { time, event, error: JumpError::PilesUp }),
            None => looked,
        };
        if let Err(StepError::Jump { .. }) = looked {
            method.restart();
            self.take_back();
        }
        if let Some(watching) = &self.watching {
            watching.events.enter(&mut self.certificate.event_counts);
        }
        looked
    }

    /// Finds the events in the last step, and then the outputs up to its end or to the event that stops the run or changes the
    /// state. Returns the events at the same time if the state is to jump.
    fn find(
        &mut self,
        watching: &mut Watching<F::Space>,
        method: &mut dyn AnyStepper<F>,
    ) -> Option<Option<Vec<(usize, bool)>>> {
        let (mut stopped_at, mut jumps) = (None, None);
        if !watching.events.is_empty() {
            let Found { events, end, unsure } = self.events(&mut watching.events, method)?;
            if let (Some(event), Some(end)) = (events.last(), end) {
                stopped_at = Some(event.state.clone());
                let index = event.index;
                self.progress.ending = match end {
                    Interruption::Stop => Some(Ending::Event { index }),
                    Interruption::Jump { with_it } => {
                        jumps = Some(with_it);
                        None
                    }
                };
            }
            for (name, time) in unsure {
                self.certificate.note_unsure_event(&name, time);
            }
            watching.found.extend(events);
        }
        if !watching.outputs.is_empty() {
            let last = stopped_at.as_ref().unwrap_or(&self.state);
            let mut before = self.before.state.clone();
            let along_run = |time: f64| self.progress.direction() * time;
            while let Some(time) = watching.outputs.next(last.time) {
                let time = if along_run(time - last.time) > 0.0 { last.time } else { time };
                let state = self.output(time, [&before, last], method)?;
                before.clone_from(&state);
                watching.queue.push_back(state);
            }
        }
        if self.progress.ending.is_some() {
            let last = stopped_at.unwrap_or_else(|| self.state.clone());
            if watching.replaces_steps() || self.ending().is_some_and(Ending::is_event) {
                let direction = self.progress.direction();
                let is_over = |state: &State<F::Space>| direction * (state.time - last.time) >= 0.0;
                while watching.queue.back().is_some_and(is_over) {
                    watching.queue.pop_back();
                }
                watching.queue.push_back(last);
            }
        }
        Some(jumps)
    }

    /// The events of the last step.
    fn events(
        &self,
        events: &mut Events<F::Space>,
        method: &mut dyn AnyStepper<F>,
    ) -> Option<Found<F::Space>> {
        if self.is_noisy() {
            let ends = [&self.before.state, &self.state];
            return events.of_path(ends, &mut OnPath { course: self, method });
        }
        let ends = [self.before.state.clone(), self.state.clone()];
        let (laws, reference) = (
            [self.before.values.clone(), self.values.clone()],
            self.reference(self.before.entropy),
        );
        let (x, end, values) = (&ends[0].point, &ends[1].point, laws.each_ref());
        let (flow, h) = (self.flow, self.before.h);
        let step = StepEnds { flow, x, end, h, values, reference: &reference };
        events.of_step(&step, ends.each_ref(), &mut |theta| self.inside(theta, method))
    }

    /// Whether the run is a path with noise.
    const fn is_noisy(&self) -> bool {
        self.certificate.noise.is_some()
    }

    /// The start of the last step.
    fn start_of_last(&self) -> StepStart<'_, F> {
        let StepBefore { state, values, entropy, .. } = &self.before;
        let reference = self.reference(*entropy);
        let (x, values) = (&state.point, values.clone());
        StepStart { flow: self.flow, x, time: state.time, values, reference, allowed: None }
    }

    /// The state at a fraction of the last step of a path with noise; `None` if its numbers do not say it, and in a step that a corner cuts.
    fn on_path(&self, theta: f64, method: &mut dyn AnyStepper<F>) -> Option<State<F::Space>> {
        let StepBefore { state, h, in_parts, .. } = &self.before;
        if theta <= 0.0 {
            return Some(state.clone());
        }
        if *in_parts {
            return None;
        }
        let point = method.on_path(self.start_of_last(), [*h, theta])?;
        let time = along([state.time, self.state.time], theta);
        let point = self.flow.clocked(&point, time).unwrap_or(point);
        let Laws { energy, entropy, .. } = self.flow.laws(&point);
        let known = State { step: state.step, time, point, energy, entropy };
        energy.is_finite().then_some(known)
    }

    /// The state at a time, after another one in the same step and before the state `last`. Where its entropy is beyond
    /// one of these by more than round-off, it is moved onto theirs; where there is none, it is the nearer one of them.
    fn output(
        &self,
        time: f64,
        [before, last]: [&State<F::Space>; 2],
        method: &mut dyn AnyStepper<F>,
    ) -> Option<State<F::Space>> {
        let theta = self.fraction(time);
        let state = State { time, ..self.inside(theta, method)? };
        if !self.has_entropy() {
            return Some(state);
        }
        let is_between = |entropy: f64| {
            let round_off = || self.flow.entropy_round_off([&before.point, &state.point]);
            let out = (before.entropy - entropy).max(entropy - last.entropy);
            out <= 0.0 || out <= round_off()
        };
        if is_between(state.entropy) {
            return Some(state);
        }
        let reference = self.reference(self.before.entropy);
        let (x, end, h) = (&self.before.state.point, &self.state.point, self.before.h);
        let values = [&self.before.values, &self.values];
        let step = StepEnds { flow: self.flow, x, end, h, values, reference: &reference };
        let entropy = state.entropy.min(last.entropy).max(before.entropy);
        let point = Target::new(&step, self.promises, theta, Some(entropy)).near(&state.point);
        if let Some(point) = point {
            let Laws { energy, entropy, .. } = self.flow.laws(&point);
            if is_between(entropy) {
                return Some(State { point, energy, entropy, ..state });
            }
        }
        let nearer = if time - before.time < last.time - time { before } else { last };
        Some(State { time, step: state.step, ..nearer.clone() })
    }
}

/// The time at a fraction of a step, not beyond its end.
fn along([start, end]: [f64; 2], theta: f64) -> f64 {
    (start + theta * (end - start)).clamp(start.min(end), start.max(end))
}
