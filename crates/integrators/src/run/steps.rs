//! Steps in a row.

use std::fmt;

use crate::round_off::bound::{ROUNDED, breaks_first_law};
use crate::run::certificate::{Certificate, InvariantBalance, StepOf};
use crate::run::controller::{Controller, Rule, StepSize};
use crate::run::corners::{self, Stop};
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::event::LastNumber;
use crate::run::judged::Judged;
use crate::run::progress::Progress;
use crate::run::schedule::{Schedule, Size};
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::run::watching::{StepBefore, Watching};
use crate::step::dense::says_between;
use crate::step::scales::{larger, relative};
use crate::step::{
    Effort, Element, EntropyStep, Flow, Laws, LimitingSites, Memory as _, Promises, Refusal,
    Scales, StepEnds, StepError, StepStart, Stepper, Taken, Vector as _,
};

/// The iterator over the states of a run after its start, in constant memory; ended by an error, or
/// where its schedule ends. With a step size alone it is endless. It yields the state after each step, or those at
/// the [times asked for](crate::Watch::output_at) and the last one. An endless iterator over such times ends with them.
///
/// Made by [`Method::steps`](crate::Method::steps) or [`Run::steps`](crate::Run::steps).
pub struct Steps<'a, F: Flow, M: Stepper<F>> {
    pub(super) method: M,
    pub(super) flow: &'a F,
    pub(super) rule: Rule,
    pub(super) progress: Progress<F::Vector>,
    pub(super) state: State<F::Space>,
    /// The laws at the state.
    pub(super) values: Laws<F::Numbers>,
    /// The entropy after the last step that dissipated.
    pub(super) entropy: f64,
    pub(super) memory: M::Memory,
    pub(super) promises: Promises,
    pub(super) certificate: Certificate,
    pub(super) failed: bool,
    /// The step before the state, for what lies between them.
    pub(super) before: StepBefore<F>,
    pub(super) watching: Option<Box<Watching<F::Space>>>,
    /// Those of the functions of events that had no value where the run was put down, until its first step.
    pub(super) last_numbers: Vec<LastNumber>,
}

impl<F: Flow, M: Stepper<F>> fmt::Debug for Steps<'_, F, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { state, certificate, memory, .. } = self;
        f.debug_struct("Steps")
            .field("state", state)
            .field("memory", memory)
            .field("certificate", certificate)
            .finish_non_exhaustive()
    }
}

/// A step of a run.
struct Advance<F: Flow> {
    taken: Taken<F>,
    h: f64,
    time: f64,
}

impl<'a, F: Flow, M: Stepper<F>> Steps<'a, F, M> {
    /// Verifies the model, and starts.
    pub(crate) fn start(
        method: M,
        flow: &'a F,
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>> {
        schedule.check()?;
        method.check(!schedule.is_fixed())?;
        let rule = Rule::of(&method, schedule.start);
        schedule.check_tolerance(&rule)?;
        if schedule.rest.is_some() && flow.depends_on_time() {
            return Err(SpanError::NoRestInTime.into());
        }
        let x0 = flow.begin(x0, schedule.start);
        flow.check(&x0)?;
        flow.examine(&x0)?;
        let promises = method.promises(flow);
        let certificate =
            Certificate { noise: method.noise(flow), ..Certificate::start(flow, &x0, promises) };
        let scales = Scales::at(flow, &x0, schedule.span());
        let Schedule { size, start, count, every, most, rest, watch, mut corners } = schedule;
        corners.start = start;
        let step_size = match size {
            Size::Fixed(h) => StepSize::Fixed(h),
            Size::Tolerance(adaptive) => {
                StepSize::Adaptive(adaptive.controller(&rule, flow, &x0, &scales)?)
            }
        };
        let largest_velocity = scales.sizes.zero();
        let judged = match &step_size {
            StepSize::Fixed(_) => None,
            StepSize::Adaptive(controller) => {
                Some(Judged::new(&controller.judged_by(&scales.sizes), flow.sizes(&x0)))
            }
        };
        let progress = Progress {
            step_size,
            start,
            count,
            every,
            most,
            scales,
            judged,
            corners,
            rest,
            largest_velocity,
            ending: None,
        };
        let values = flow.laws(&x0);
        let (energy, entropy) = (values.energy, values.entropy);
        let state = State { step: 0, time: start, point: x0, energy, entropy };
        let watching = Watching::new(watch, &progress, &state, &[])?;
        let before = StepBefore {
            state: state.clone(),
            values: values.clone(),
            entropy,
            h: 0.0,
            in_parts: false,
            entropy_step: None,
        };
        let mut steps = Self {
            method,
            flow,
            rule,
            progress,
            state,
            before,
            watching,
            last_numbers: Vec::new(),
            values,
            entropy,
            memory: M::Memory::default(),
            promises,
            certificate,
            failed: false,
        };
        steps.rest(true);
        Ok(steps)
    }

    /// The state reached so far.
    pub const fn state(&self) -> &State<F::Space> {
        &self.state
    }

    /// The balance of the steps taken so far.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub const fn ending(&self) -> Option<Ending> {
        if self.failed { Some(Ending::Stopped) } else { self.progress.ending }
    }

    /// What the laws were at the start of the run, with this entropy.
    #[inline]
    pub(super) fn reference(&self, entropy: f64) -> Laws<F::Numbers> {
        let mut invariants = self.values.invariants.clone();
        for (k, balance) in self.certificate.invariants.iter().enumerate() {
            invariants[k] = balance.initial;
        }
        Laws { energy: self.certificate.reference_energy(), entropy, invariants }
    }

    /// Where the next step starts.
    #[inline]
    fn from(&self, allowed: Option<F::Vector>) -> StepStart<'_, F> {
        let entropy = if self.promises.entropy { self.entropy } else { self.values.entropy };
        let reference = self.reference(entropy);
        let values = self.values.clone();
        StepStart { x: &self.state.point, time: self.state.time, values, reference, allowed }
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`StepError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<&State<F::Space>, StepError> {
        if self.progress.ending.is_none() {
            let flow = self.flow;
            flow.with_room(|| self.take_step().map_err(|error| self.explained(error)))?;
        }
        Ok(&self.state)
    }

    /// Takes one step of a run that has not ended.
    fn take_step(&mut self) -> Result<(), StepError> {
        let step = self.state.step + 1;
        let Advance { mut taken, h, time } = match &self.progress.step_size {
            &StepSize::Fixed(h) => {
                let mut memory = std::mem::take(&mut self.memory);
                let time = self.progress.start + step as f64 * h;
                let h = self.left_of_a_step(h, time);
                let (system, size) = ((&self.method, self.flow), corners::Fixed { h, end: time });
                let corners = &self.progress.corners;
                let taken = corners::step(system, &self.from(None), size, corners, &mut memory);
                self.memory = memory;
                Advance { taken: taken?, h, time }
            }
            StepSize::Adaptive(controller) => self.controlled(controller.clone())?,
        };
        if let Some(clocked) = self.flow.clocked(&taken.x, time) {
            taken.values = self.flow.laws(&clocked);
            taken.x = clocked;
        }
        if !is_finite(&taken.values) {
            let time = self.state.time;
            return Err(StepError::OutOfDomain { time, h, tried: taken.effort });
        }
        let change = taken.values.energy - self.certificate.reference_energy();
        let sizes = || self.flow.energy_sizes([&self.state.point, &taken.x]);
        if self.promises.energy
            && let Some(size) = breaks_first_law(change, taken.values.energy, sizes)
        {
            let time = self.state.time;
            return Err(StepError::FirstLawBroken { time, h, change, size });
        }
        self.check_step(&taken)?;
        let entered = StepOf { taken: &taken, h };
        self.certificate.enter(self.flow, &self.state.point, &self.values, entered);
        let first_at_the_edge =
            taken.evidence.stability && self.certificate.limiting_sites.stiffness.is_none();
        if step.is_power_of_two() || (first_at_the_edge && self.has_sites()) {
            self.sample(&taken, h);
        }
        let Taken { x, values, evidence, effort } = taken;
        (self.before.h, self.before.entropy) = (h, self.entropy);
        self.before.in_parts = effort.splits > 0;
        self.before.entropy_step = evidence.entropy_step;
        if evidence.dissipates {
            self.entropy = values.entropy;
        }
        let (energy, entropy) = (values.energy, values.entropy);
        self.before.values = std::mem::replace(&mut self.values, values);
        let next = State { step, time, point: x, energy, entropy };
        self.before.state = std::mem::replace(&mut self.state, next);
        self.check_invariants(&self.before.state)?;
        let over = match &self.progress.step_size {
            StepSize::Fixed(_) => self.progress.count.is_some_and(|count| step >= count),
            StepSize::Adaptive(controller) => self.state.time >= controller.pace.end,
        };
        if over {
            self.progress.ending = Some(Ending::Span);
        }
        if self.progress.judges_sizes() {
            let here = self.flow.sizes(&self.state.point);
            self.progress.scales = self.progress.scales.or(&here);
            if let Some(judged) = &mut self.progress.judged {
                judged.reached = larger(&judged.reached, &here);
            }
        }
        self.rest(!evidence.rests);
        if step.is_power_of_two() || self.progress.ending.is_some() {
            self.judge_sizes();
        }
        if self.watching.is_some() {
            self.look()?;
        }
        self.recheck(evidence.entropy_step == Some(EntropyStep::Held))
    }

    /// Looks at what must hold on every step. Steps of one size between corners have been looked at one by one.
    #[inline]
    fn check_step(&self, taken: &Taken<F>) -> Result<(), StepError> {
        let fixed = matches!(self.progress.step_size, StepSize::Fixed(_));
        if !self.flow.depends_on_time() || (fixed && !self.progress.corners.is_empty()) {
            return Ok(());
        }
        self.flow.inspect([&self.state.point, &taken.x], fixed)
    }

    /// Whether the certificate may name a site.
    fn has_sites(&self) -> bool {
        self.progress.scales.sizes.sites().is_some()
    }

    /// Notes the local error of a step, and where it is largest, on the few whose number is a power of two and on the
    /// first one at the edge of stability.
    #[cold]
    fn sample(&mut self, Taken { x: end, values, .. }: &Taken<F>, h: f64) {
        let (flow, x) = (self.flow, &self.state.point);
        // The sizes that a step brings about count too, and the largest ones so far: an entry that has decayed to
        // round-off has no error relative to itself.
        let sizes = larger(&flow.sizes(x), &flow.sizes(end));
        self.progress.scales = self.progress.scales.or(&sizes);
        let sizes = self.progress.scales.sizes.clone();
        let norm = |error: &F::Vector| {
            let above =
                F::Vector::zip([error, &sizes], |[error, s]| (error.abs() - ROUNDED * s).max(0.0));
            relative(&above, &sizes)
        };
        let reference = self.reference(self.entropy);
        let step = StepEnds { x, end, h, values: [&self.values, values], reference: &reference };
        let Some(error) = self.method.error(flow, &step, &self.memory, norm) else {
            if says_between(flow, x) && flow.displacement(x, end).is_none() {
                self.certificate.note_local_error(f64::INFINITY, LimitingSites::default());
            }
            return;
        };
        let sites = if self.has_sites() {
            let allowed = match &self.progress.step_size {
                StepSize::Adaptive(controller) => {
                    controller.allowed(&self.rule, &self.progress.scales, h)
                }
                StepSize::Fixed(_) => sizes.clone(),
            };
            self.method.limiting_sites(flow, &step, &self.memory, &allowed)
        } else {
            LimitingSites::default()
        };
        self.certificate.note_local_error(error, sites);
    }

    /// Compares the sizes that errors are relative to with those that the state has reached.
    #[cold]
    fn judge_sizes(&mut self) {
        let Progress { step_size, judged, scales, start, ending, .. } = &self.progress;
        if let (StepSize::Adaptive(controller), Some(judged)) = (step_size, judged) {
            let relative_to = controller.judged_by(&scales.sizes);
            let noise = scales.rounding(self.state.time - start);
            let has_ended = ending.is_some();
            self.certificate.misjudged_size = judged.worst(&relative_to, &noise, has_ended);
        }
    }

    /// Tries steps until the controller accepts one. Not part of the loop over steps of one size, which
    /// is compiled for every system.
    #[inline(never)]
    fn controlled(
        &mut self,
        mut controller: Controller<F::Vector>,
    ) -> Result<Advance<F>, StepError> {
        let (flow, rule, time) = (self.flow, self.rule, self.state.time);
        let mut effort = Effort::default();
        let (mut tries, mut broken) = (0, None);
        let Stop { stop, recorded: target, .. } =
            self.progress.corners.stop(time, controller.pace.end);
        if self.progress.corners.has(time) {
            self.memory = M::Memory::default();
        }
        loop {
            tries += 1;
            if tries == TRIES {
                // An entry that begins to move only now has no size yet.
                let here = Scales::at(flow, &self.state.point, Some(controller.pace.end - time));
                self.progress.scales = self.progress.scales.and(&here);
            }
            let (h, last) = controller.pace.attempt(time, stop);
            if controller.pace.next < controller.pace.least(&rule) && !last {
                let (h, least) = (controller.pace.next, controller.pace.least(&rule));
                let too_small = StepError::TooSmall { time, h, least };
                let cause = broken.or_else(|| self.dependent(&self.state));
                return Err(cause.unwrap_or(too_small));
            }
            if time + h <= time {
                let standstill = StepError::Standstill { time, h: controller.pace.next };
                return Err(broken.unwrap_or(standstill));
            }
            let ratio = controller.pace.taken.map_or(1.0, |taken| h / taken);
            let mut memory = self.memory.rescaled(ratio);
            memory.take_room(&mut self.memory);
            let allowed = controller.allowed(&rule, &self.progress.scales, h);
            let start = self.from(Some(allowed));
            let end = self.method.attempt(flow, &start, h, &mut memory);
            let mut falls = false;
            let end = match end {
                Ok(taken) => {
                    effort += taken.effort;
                    is_finite(&taken.values).then_some(taken)
                }
                Err(Refusal { effort: wasted, error, second_law }) => {
                    effort += wasted;
                    // An entropy that falls in a step that hardly moves the state falls in a smaller one too.
                    if let Some(
                        never
                        @ (StepError::EntropyFalls { .. } | StepError::WrongDerivative { .. }),
                    ) = error
                    {
                        return Err(never);
                    }
                    broken = error.or(broken);
                    falls = second_law;
                    None
                }
            };
            let error = end.as_ref().and_then(|taken| {
                let scales = self.progress.scales.or(&flow.sizes(&taken.x));
                let allowed = controller.allowed(&rule, &scales, h);
                let values = [&self.values, &taken.values];
                let (x, reference) = (&self.state.point, &start.reference);
                let step = StepEnds { x, end: &taken.x, h, values, reference };
                let norm = |error: &F::Vector| relative(error, &allowed);
                self.method.error(flow, &step, &memory, norm).filter(|error| error.is_finite())
            });
            match (end, error) {
                (Some(taken), _) if taken.evidence.entropy_step == Some(EntropyStep::Held) => {
                    controller.pace.accept_held(&rule, h);
                    let before = std::mem::replace(&mut self.memory, memory);
                    self.memory.reuse(before);
                    let time = if last { target } else { time + h };
                    self.progress.step_size = StepSize::Adaptive(controller);
                    return Ok(Advance { taken: Taken { effort, ..taken }, h, time });
                }
                (None, _) if falls => {
                    controller.pace.reject_fall(h);
                    self.memory.refused(memory);
                    self.certificate.rejected += 1;
                    self.certificate.falls_avoided += 1;
                }
                (Some(taken), Some(error)) if error <= 1.0 => {
                    controller.pace.accept(&rule, h, error);
                    let before = std::mem::replace(&mut self.memory, memory);
                    self.memory.reuse(before);
                    let time = if last { target } else { time + h };
                    self.progress.step_size = StepSize::Adaptive(controller);
                    return Ok(Advance { taken: Taken { effort, ..taken }, h, time });
                }
                (_, error) => {
                    controller.pace.reject(&rule, h, error);
                    self.memory.reuse(memory);
                    self.certificate.rejected += 1;
                }
            }
        }
    }

    /// Ends the run if the state is at rest.
    fn rest(&mut self, moved: bool) {
        let Some(tolerance) = self.progress.rest else { return };
        let x = &self.state.point;
        let zero = self.progress.largest_velocity.zero();
        let Some(v) = self.flow.rates(x, &zero) else { return };
        let Progress { scales, largest_velocity, .. } = &mut self.progress;
        *largest_velocity = larger(largest_velocity, &v.map(f64::abs));
        // In units of the same sizes: an entry has been smaller than it is.
        let (speed, largest) = (scales.speed(&v), scales.speed(largest_velocity));
        if !moved || speed <= tolerance * largest {
            self.progress.ending = Some(Ending::Rest { speed, largest });
        }
    }

    /// The further invariant that depends on the other fields at a state, as an error.
    #[cold]
    fn dependent(&self, &State { time, ref point, .. }: &State<F::Space>) -> Option<StepError> {
        let (index, fraction) = self.flow.dependent_invariant(point)?;
        let change = self.certificate.invariants[index].max_error;
        Some(StepError::DependentInvariants { time, index, change, fraction })
    }

    /// Looks at the further invariants after a step.
    ///
    /// # Errors
    ///
    /// [`StepError::DependentInvariants`] if one is no longer conserved because its differential depends
    /// on those of the others.
    fn check_invariants(&self, before: &State<F::Space>) -> Result<(), StepError> {
        let broken = |balance: &InvariantBalance| balance.max_error > NOT_CONSERVED * balance.scale;
        if self.promises.invariants && self.certificate.invariants.iter().any(broken) {
            self.dependent(before).map_or(Ok(()), Err)
        } else {
            Ok(())
        }
    }
}

/// Whether the laws are numbers: a method without an equation to solve may step over the edge of a domain.
fn is_finite<L>(laws: &Laws<L>) -> bool {
    laws.energy.is_finite() && laws.entropy.is_finite()
}

/// Steps that are tried before the sizes of the entries are estimated anew.
const TRIES: usize = 3;

/// The error of a further invariant, relative to its terms, above which it is no longer conserved. What
/// fades out of `Π̃` stays far below it: `10⁻⁴h²`.
const NOT_CONSERVED: f64 = 1e-4;
