//! Steps in a row.

use std::fmt;

use crate::round_off::bound::{ROUNDED, breaks_first_law};
use crate::run::certificate::{Certificate, StepOf};
use crate::run::controller::{Pace, StepSize};
use crate::run::corners::{self, Fixed, Stop};
use crate::run::course::{Course, Said};
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::run::stepping::Stepping;
use crate::step::dense::says_between;
use crate::step::scales::{larger, relative};
use crate::step::{
    AnyFlow, Effort, Element, EntropyStep, Evidence, Flow, Laws, LimitingSites, Memory as _,
    Refusal, Scales, StepEnds, StepError, StepStart, Stepper, Taken, Vector as _, both, in_room,
};

/// The iterator over the states of a run after its start, in constant memory; ended by an error, or
/// where its schedule ends. With a step size alone it is endless. It yields the state after each step, or those at
/// the [times asked for](crate::Watch::output_at) and the last one. An endless iterator over such times ends with them.
///
/// Made by [`Method::steps`](crate::Method::steps) or [`Run::steps`](crate::Run::steps).
pub struct Steps<'a, F: Flow + ?Sized, M: Stepper<F>> {
    pub(super) method: M,
    pub(super) flow: &'a F,
    pub(super) memory: M::Memory,
    pub(super) course: Course<'a, AnyFlow<'a, F>>,
}

impl<F: Flow + ?Sized, M: Stepper<F>> fmt::Debug for Steps<'_, F, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps")
            .field("state", &self.course.state)
            .field("memory", &self.memory)
            .field("certificate", &self.course.certificate)
            .finish_non_exhaustive()
    }
}

/// A step of a run.
struct Advance<F: Flow + ?Sized> {
    taken: Taken<F>,
    h: f64,
    time: f64,
}

impl<'a, F: Flow + ?Sized, M: Stepper<F>> Steps<'a, F, M> {
    /// Verifies the model, and starts a run of a flow, which is given as any one with its states and numbers too.
    pub(crate) fn start_any(
        method: M,
        (flow, any): (&'a F, &'a AnyFlow<'a, F>),
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>> {
        schedule.check()?;
        method.check(!schedule.is_fixed())?;
        method.serves(flow)?;
        let said = Said::by(&method, flow, schedule.start);
        let course = Course::start(any, said, x0, schedule)?;
        let memory = method.memory();
        Ok(Self { method, flow, memory, course })
    }

    /// Verifies the model, and starts.
    pub(crate) fn start(
        method: M,
        flow: &'a F,
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>>
    where
        F: Sized,
    {
        Self::start_any(method, (flow, flow), x0, schedule)
    }

    /// The state reached so far.
    pub const fn state(&self) -> &State<F::Space> {
        &self.course.state
    }

    /// The balance of the steps taken so far.
    pub const fn certificate(&self) -> &Certificate {
        &self.course.certificate
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub const fn ending(&self) -> Option<Ending> {
        self.course.ending()
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`StepError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<&State<F::Space>, StepError> {
        if self.course.progress.ending.is_none() {
            let flow = self.flow;
            in_room(flow, || self.take_step().map_err(|error| self.course.explained(error)))?;
        }
        Ok(&self.course.state)
    }

    /// Takes one step of a run that has not ended.
    fn take_step(&mut self) -> Result<(), StepError> {
        let step = self.course.state.step + 1;
        if self.course.has_sites() {
            // The state before the last step is looked at no more, and leaves its array to this one.
            self.course.before.state = self.course.state.clone();
        }
        let behind = self.leave_corner();
        let Advance { mut taken, h, time } = match &self.course.progress.step_size {
            &StepSize::Fixed(h) => {
                let time = self.course.progress.start + step as f64 * h;
                let h = self.course.left_of_a_step(h, time);
                Advance { taken: self.fixed(Fixed { h, end: time })?, h, time }
            }
            StepSize::Adaptive(controller) => self.controlled(controller.pace, behind)?,
        };
        if let Some(clocked) = self.flow.clocked(&taken.x, time) {
            taken.values = self.flow.laws(&clocked);
            taken.x = clocked;
            self.memory.clocked();
        }
        if !is_finite(&taken.values) {
            let time = self.course.state.time;
            return Err(StepError::OutOfDomain { time, h, tried: taken.effort });
        }
        if let Some(broken) = self.broken_law(&taken, h) {
            return Err(broken);
        }
        self.check_step(&taken)?;
        let entered = StepOf { taken: &taken, h: h.abs() };
        self.course.certificate.enter(
            self.flow,
            &self.course.state.point,
            &self.course.values,
            entered,
        );
        let first_at_the_edge =
            taken.evidence.stability && self.course.certificate.limiting_sites.stiffness.is_none();
        if step.is_power_of_two() || (first_at_the_edge && self.course.has_sites()) {
            self.sample(&taken, h);
        }
        let Taken { x, values, evidence, effort } = taken;
        (self.course.before.h, self.course.before.entropy) = (h, self.course.entropy);
        self.course.before.in_parts = effort.splits > 0;
        self.course.before.entropy_step = evidence.entropy_step;
        if evidence.dissipates {
            self.course.entropy = values.entropy;
        }
        let (energy, entropy) = (values.energy, values.entropy);
        self.course.before.values = std::mem::replace(&mut self.course.values, values);
        let next = State { step, time, point: x, energy, entropy };
        self.course.before.state = std::mem::replace(&mut self.course.state, next);
        self.course.check_invariants(&self.course.before.state)?;
        let over = match &self.course.progress.step_size {
            StepSize::Fixed(_) => self.course.progress.count.is_some_and(|count| step >= count),
            StepSize::Adaptive(controller) => {
                let left = controller.pace.end - self.course.state.time;
                self.course.progress.direction() * left <= 0.0
            }
        };
        if over {
            self.course.progress.ending = Some(Ending::Span);
        }
        if self.course.progress.judges_sizes() {
            let here = self.flow.sizes(&self.course.state.point);
            self.course.progress.scales = self.course.progress.scales.or(&here);
            if let Some(judged) = &mut self.course.progress.judged {
                judged.reached = larger(&judged.reached, &here);
            }
        }
        self.course.rest(!evidence.rests);
        if step.is_power_of_two() || self.course.progress.ending.is_some() {
            self.course.judge_sizes();
        }
        if self.course.watching.is_some() {
            let Self { course, method, flow, memory } = self;
            course.look(&mut Stepping { method, flow: *flow, memory })?;
        }
        self.course.recheck(evidence.entropy_step == Some(EntropyStep::Held))
    }

    /// The error that names the first law, if a step has broken it.
    #[inline]
    fn broken_law(&self, taken: &Taken<F>, h: f64) -> Option<StepError> {
        let change = taken.values.energy - self.course.certificate.reference_energy();
        let sizes = || self.flow.energy_sizes([&self.course.state.point, &taken.x]);
        if !self.course.promises.energy {
            return None;
        }
        let size = breaks_first_law(change, taken.values.energy, sizes)?;
        Some(StepError::FirstLawBroken { time: self.course.state.time, h, change, size })
    }

    /// Sets the clock of the state behind the corner that it has reached, with the law of the next step. Returns the time
    /// there.
    #[inline]
    fn leave_corner(&mut self) -> Option<f64> {
        let behind = self.course.progress.corners.behind(self.course.state.time)?;
        if let Some(clocked) = self.flow.clocked(&self.course.state.point, behind) {
            self.course.values = self.flow.laws(&clocked);
            self.course.state.point = clocked;
        }
        Some(behind)
    }

    /// Takes a step of one size. The memory, which is large, stays where it is.
    #[inline]
    fn fixed(&mut self, size: Fixed) -> Result<Taken<F>, StepError> {
        if !self.course.progress.corners.is_empty() {
            return self.across_corners(size);
        }
        let Self { method, flow, memory, course } = self;
        method.step(&start_of(flow, course, None), size.h, memory)
    }

    /// Takes a step of one size in parts between corners.
    #[cold]
    fn across_corners(&mut self, size: Fixed) -> Result<Taken<F>, StepError> {
        let Self { method, flow, memory, course } = self;
        let (start, corners) = (course.from(None), &course.progress.corners);
        let method = &mut Stepping { method, flow: *flow, memory };
        let Taken { x, values, evidence, effort } = corners::step(method, &start, size, corners)?;
        Ok(Taken { x, values, evidence, effort })
    }

    /// Looks at what must hold on every step. Steps of one size between corners have been looked at one by one.
    #[inline]
    fn check_step(&self, taken: &Taken<F>) -> Result<(), StepError> {
        let fixed = matches!(self.course.progress.step_size, StepSize::Fixed(_));
        if !self.flow.depends_on_time() || (fixed && !self.course.progress.corners.is_empty()) {
            return Ok(());
        }
        self.flow.inspect([&self.course.state.point, &taken.x], fixed)
    }

    /// Notes the local error of a step, and where it is largest, on the few whose number is a power of two and on the
    /// first one at the edge of stability.
    #[cold]
    fn sample(&mut self, Taken { x: end, values, .. }: &Taken<F>, h: f64) {
        let (flow, x) = (self.flow, &self.course.state.point);
        // The sizes that a step brings about count too, and the largest ones so far: an entry that has decayed to
        // round-off has no error relative to itself.
        let sizes = larger(&flow.sizes(x), &flow.sizes(end));
        self.course.progress.scales = self.course.progress.scales.or(&sizes);
        let sizes = self.course.progress.scales.sizes.clone();
        let norm = |error: &F::Vector| {
            // In one pass, without an array of the numbers.
            F::Vector::norm_of([error, &sizes], |[error, s]| {
                let above = (error.abs() - ROUNDED * s).max(0.0);
                if above == 0.0 { 0.0 } else { above / s }
            })
        };
        let reference = self.course.reference(self.course.entropy);
        let (values, reference) = ([&self.course.values, values], &reference);
        let step = StepEnds { flow, x, end, h, values, reference };
        let Some(error) = self.method.error(&step, &self.memory, norm) else {
            if says_between(flow, x) && flow.displacement(x, end).is_none() {
                self.course.certificate.note_local_error(f64::INFINITY, LimitingSites::default());
            }
            return;
        };
        let sites = if self.course.has_sites() {
            let allowed = match &self.course.progress.step_size {
                StepSize::Adaptive(controller) => {
                    controller.allowed(&self.course.rule, &self.course.progress.scales, h)
                }
                StepSize::Fixed(_) => sizes.clone(),
            };
            self.method.limiting_sites(&step, &self.memory, &allowed)
        } else {
            LimitingSites::default()
        };
        self.course.certificate.note_local_error(error, sites);
    }

    /// Tries steps until the controller accepts one. Not part of the loop over steps of one size, which
    /// is compiled for every system.
    #[inline(never)]
    fn controlled(&mut self, mut pace: Pace, behind: Option<f64>) -> Result<Advance<F>, StepError> {
        let (flow, rule, time) = (self.flow, self.course.rule, self.course.state.time);
        let relative_error = pace.relative_error(&rule);
        let mut effort = Effort::default();
        let (mut tries, mut broken) = (0, None);
        let Stop { stop, recorded: target, .. } = self.course.progress.corners.stop(time, pace.end);
        // After a corner a step begins a few roundings later than its state is recorded.
        let begin = behind.unwrap_or(time);
        // Along the run, times and sizes are positive.
        let direction = self.course.progress.direction();
        let (along, stop) = (direction * begin, direction * stop);
        let ends = self.course.frozen.end(self.course.state.step, begin, direction);
        let mut frozen = ends.map(|end| direction * end);
        if behind.is_some() {
            self.memory = self.method.memory();
        }
        loop {
            tries += 1;
            if tries == TRIES {
                // An entry that begins to move only now has no size yet.
                let here =
                    Scales::at(flow, &self.course.state.point, Some((pace.end - time).abs()));
                self.course.progress.scales = self.course.progress.scales.and(&here);
            }
            let (size, last) = match frozen {
                Some(end) => (end.min(stop) - along, end >= stop),
                None => pace.attempt(along, stop),
            };
            let h = direction * size;
            if pace.next < pace.least(&rule) && !last && frozen.is_none() {
                let (h, least) = (pace.next, pace.least(&rule));
                let too_small = StepError::TooSmall { time, h, least };
                let cause = broken.or_else(|| self.course.dependent(&self.course.state));
                return Err(cause.unwrap_or(too_small));
            }
            if along + size <= along {
                let standstill = StepError::Standstill { time, h: pace.next };
                return Err(broken.unwrap_or(standstill));
            }
            let ratio = pace.taken.map_or(1.0, |taken| size / taken);
            let mut memory = self.memory.rescaled(ratio);
            memory.take_room(&mut self.memory);
            let allowed = self.course.progress.allowed(relative_error, None, h);
            let start = start_of(flow, &self.course, Some(allowed));
            let mut tried = self.method.attempt(&start, h, &mut memory);
            let (mut falls, mut is_taken, mut error) = (false, false, None);
            match &mut tried {
                Ok(taken) => {
                    effort += taken.effort;
                    taken.effort = effort;
                    let has_values = is_finite(&taken.values);
                    let law = self.broken_law(taken, h).filter(|_| has_values);
                    let (holds, reference) = (law.is_none() && has_values, &start.reference);
                    broken = law.or(broken);
                    let step = Tried { taken, reference, h, relative_error };
                    let is_held = taken.evidence.entropy_step == Some(EntropyStep::Held);
                    error = if holds { self.error(&step, &memory) } else { None };
                    let accepted = error.filter(|error| *error <= 1.0 || frozen.is_some());
                    if holds && is_held {
                        pace.accept_held(&rule, size);
                    } else if let Some(error) = accepted {
                        pace.accept(&rule, size, error);
                        self.look_at_rest(&mut pace, taken, size);
                    }
                    is_taken = holds && (is_held || accepted.is_some());
                }
                Err(Refusal { effort: wasted, error: refused, second_law }) => {
                    effort += *wasted;
                    let refused = refused.take();
                    // An entropy that falls in a step that hardly moves the state falls in a smaller one too.
                    if let Some(
                        never @ (StepError::EntropyFalls { .. }
                        | StepError::WrongDerivative { .. }
                        | StepError::Flow { .. }),
                    ) = refused
                    {
                        return Err(never);
                    }
                    broken = refused.or(broken);
                    falls = *second_law;
                }
            }
            if is_taken && let Ok(taken) = tried {
                let before = std::mem::replace(&mut self.memory, memory);
                self.memory.reuse(before);
                self.course.progress.set_pace(pace);
                let time = if last { target } else { begin + h };
                self.course.frozen.note(time);
                return Ok(Advance { taken, h, time });
            }
            // A step that cannot be taken is taken in parts.
            frozen = None;
            if falls {
                pace.reject_fall(size);
                self.memory.refused(memory);
                self.course.certificate.rejected += 1;
                self.course.certificate.falls_avoided += 1;
                continue;
            }
            if pace.may_jump(&rule, begin, size)
                && let Some(taken) = self.held_in_an_instant(begin + h)
            {
                pace.jumped(begin, size);
                self.memory = self.memory.restarted();
                self.course.progress.set_pace(pace);
                let time = if last { target } else { begin + h };
                self.course.frozen.note(time);
                return Ok(Advance { taken: Taken { effort, ..taken }, h, time });
            }
            pace.reject(&rule, size, error);
            self.memory.reuse(memory);
            self.course.certificate.rejected += 1;
        }
    }

    /// The error of a step that was tried, in units of the one allowed.
    #[inline]
    fn error(&self, step: &Tried<'_, F>, memory: &M::Memory) -> Option<f64> {
        let &Tried { taken, reference, h, relative_error } = step;
        let (flow, course) = (self.flow, &self.course);
        let sizes = larger(&course.progress.scales.sizes, &flow.sizes(&taken.x));
        let allowed = course.progress.allowed(relative_error, Some(&sizes), h);
        let values = [&course.values, &taken.values];
        let step = StepEnds { flow, x: &course.state.point, end: &taken.x, h, values, reference };
        let norm =
            |error: &F::Vector| relative(error, &allowed).max(error.beside_relative_to(&allowed));
        self.method.error(&step, memory, norm).filter(|error| error.is_finite())
    }
}

/// A step that was tried.
struct Tried<'a, F: Flow + ?Sized> {
    taken: &'a Taken<F>,
    reference: &'a Laws<F::Numbers>,
    h: f64,
    relative_error: f64,
}

impl<F: Flow + ?Sized, M: Stepper<F>> Steps<'_, F, M> {
    /// The step to a time so near that a jump of the law of motion between the two has no place in it: the state stays, and
    /// what the energy changes by is work of the time. `None` where states have no clock.
    #[cold]
    fn held_in_an_instant(&self, time: f64) -> Option<Taken<F>> {
        let x = self.flow.clocked(&self.course.state.point, time)?;
        let values = self.flow.laws(&x);
        let (evidence, effort) = (Evidence::default(), Effort::default());
        is_finite(&values).then_some(Taken { x, values, evidence, effort })
    }

    /// Bounds the next step where a system takes the time, and nothing has changed the motion in this one: what moves the state
    /// later would be stepped over.
    #[inline]
    fn look_at_rest(&mut self, pace: &mut Pace, taken: &Taken<F>, h: f64) {
        let longest = pace.longest_at_rest(&self.course.rule);
        if !self.flow.depends_on_time() || pace.next.max(h) < longest {
            return;
        }
        let relative_error = pace.relative_error(&self.course.rule);
        let allowed = self.course.progress.allowed(relative_error, None, h);
        let ends = [&self.course.state.point, &taken.x];
        if moves_on(self.flow, ends, &allowed, h) {
            pace.next = pace.next.min(longest);
            self.course.certificate.note_rest(h);
        }
    }
}

/// Returns whether the velocity is the same at both ends of a step of size `h`, but for what the error allows.
fn moves_on<F: Flow + ?Sized>(
    flow: &F,
    ends: [&Element<F>; 2],
    allowed: &F::Vector,
    h: f64,
) -> bool {
    let zero = allowed.zero();
    let [Some(start), Some(end)] = both(ends, |x| flow.rates(x, &zero)) else { return false };
    (0..zero.len()).all(|i| h * (end.get(i) - start.get(i)).abs() <= allowed.get(i))
}

/// Where the next step of this flow starts.
#[inline]
fn start_of<'s, F: Flow + ?Sized>(
    flow: &'s F,
    course: &'s Course<'_, AnyFlow<'_, F>>,
    allowed: Option<F::Vector>,
) -> StepStart<'s, F> {
    let StepStart { x, time, values, reference, allowed, .. } = course.from(allowed);
    StepStart { flow, x, time, values, reference, allowed }
}

/// Whether the laws are numbers: a method without an equation to solve may step over the edge of a domain.
fn is_finite<L>(laws: &Laws<L>) -> bool {
    laws.energy.is_finite() && laws.entropy.is_finite()
}

/// Steps that are tried before the sizes of the entries are estimated anew.
const TRIES: usize = 3;
