//! A run without its method.

use metriplectic_dynamics::SecondLaw;

use crate::run::certificate::{Certificate, InvariantBalance};
use crate::run::controller::{Rule, StepSize};
use crate::run::direction::direction;
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::event::LastNumber;
use crate::run::judged::Judged;
use crate::run::least_sizes::least_sizes;
use crate::run::progress::Progress;
use crate::run::schedule::{Schedule, Size};
use crate::run::sequence::Frozen;
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::run::watching::{StepBefore, Watching};
use crate::step::scales::larger;
use crate::step::{
    Element, Flow, Laws, LedgerSummary, NoiseSummary, Promises, Scales, StepError, StepStart,
    Stepper, Vector as _,
};

/// The statements of a method about a run before its first step.
#[derive(Clone, Debug)]
pub(super) struct Said {
    pub(super) rule: Rule,
    pub(super) promises: Promises,
    pub(super) noise: Option<NoiseSummary>,
}

impl Said {
    /// Asks a method about a run of this flow from a time on.
    #[inline]
    pub(super) fn by<F: Flow + ?Sized, M: Stepper<F>>(method: &M, flow: &F, start: f64) -> Self {
        let (promises, noise) = (method.promises(flow), method.noise(flow));
        Self { rule: Rule::of(method, start), promises, noise }
    }
}

/// All of a run but the method and its memory. The flow is any one with these states and numbers
/// ([`AnyFlow`](crate::step::AnyFlow)), so that a run is compiled once for each space.
pub(super) struct Course<'a, F: Flow + ?Sized> {
    pub(super) flow: &'a F,
    pub(super) rule: Rule,
    pub(super) progress: Progress<F::Vector>,
    /// The steps of another run.
    pub(super) frozen: Frozen,
    pub(super) state: State<F::Space>,
    /// The laws at the state.
    pub(super) values: Laws<F::Numbers>,
    /// The entropy after the last step that dissipated.
    pub(super) entropy: f64,
    pub(super) promises: Promises,
    pub(super) certificate: Certificate,
    pub(super) failed: bool,
    /// The step before the state, for what lies between them.
    pub(super) before: StepBefore<F>,
    /// The step that the last jump has cut, for what differentiates it.
    pub(super) cut: Option<StepBefore<F>>,
    pub(super) watching: Option<Box<Watching<F::Space>>>,
    /// The last numbers of functions of events that had no value where the run was put down, until its first step.
    pub(super) last_numbers: Vec<LastNumber>,
}

impl<'a, F: Flow + ?Sized> Course<'a, F> {
    /// Verifies the model, and starts.
    pub(super) fn start(
        flow: &'a F,
        Said { rule, promises, noise }: Said,
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>> {
        schedule.check_tolerance(&rule)?;
        if schedule.rest.is_some() && flow.depends_on_time() {
            return Err(SpanError::NoRestInTime.into());
        }
        let x0 = flow.begin(x0, schedule.start)?;
        if schedule.backward {
            check_backward(flow, &x0, noise.is_some())?;
        }
        flow.check(&x0)?;
        flow.examine(&x0)?;
        let values = flow.laws(&x0);
        let mut certificate =
            Certificate { noise, ..Certificate::start(flow, &x0, &values, promises) };
        let mut scales = Scales::at(flow, &x0, schedule.span());
        let Schedule {
            size,
            start,
            backward,
            count,
            every,
            most,
            rest,
            watch,
            mut corners,
            frozen,
        } = schedule;
        frozen.begin();
        corners.start = start;
        let step_size = match size {
            Size::Fixed(h) => StepSize::Fixed(direction(backward) * h),
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
        if let StepSize::Adaptive(controller) = &step_size
            && flow.depends_on_time()
        {
            scales = scales.or(&least_sizes(flow, &x0, [start, controller.pace.end]));
        }
        let progress = Progress {
            step_size,
            start,
            backward,
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
        let (energy, entropy) = (values.energy, values.entropy);
        let state = State { step: 0, time: start, point: x0, energy, entropy };
        let mut watching = Watching::new(watch, &progress, &state, (&[], &[]))?;
        if let Some(watching) = &mut watching {
            let names = watching.events.begin(&state).into_iter();
            certificate.events_at_start = names.map(|name| name.to_string()).collect();
            certificate.event_counts = watching.events.counts();
        }
        let before = StepBefore {
            state: state.clone(),
            values: values.clone(),
            entropy,
            h: 0.0,
            in_parts: false,
            entropy_step: None,
        };
        let mut course = Self {
            flow,
            rule,
            progress,
            frozen,
            state,
            before,
            watching,
            cut: None,
            last_numbers: Vec::new(),
            values,
            entropy,
            promises,
            certificate,
            failed: false,
        };
        course.rest(true);
        Ok(course)
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub(super) const fn ending(&self) -> Option<Ending> {
        if self.failed { Some(Ending::Stopped) } else { self.progress.ending }
    }

    /// The laws at the start of the run, with this entropy.
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
    pub(super) fn from(&self, allowed: Option<F::Vector>) -> StepStart<'_, F> {
        let entropy = if self.promises.entropy { self.entropy } else { self.values.entropy };
        let reference = self.reference(entropy);
        let (State { point: x, time, .. }, values) = (&self.state, self.values.clone());
        StepStart { flow: self.flow, x, time: *time, values, reference, allowed }
    }

    /// Whether the certificate may name a site.
    pub(super) fn has_sites(&self) -> bool {
        self.progress.scales.sizes.sites().is_some()
    }

    /// Compares the sizes that errors are relative to with those that the state has reached.
    #[cold]
    pub(super) fn judge_sizes(&mut self) {
        let Progress { step_size, judged, scales, start, ending, .. } = &self.progress;
        if let (StepSize::Adaptive(controller), Some(judged)) = (step_size, judged) {
            let relative_to = controller.judged_by(&scales.sizes);
            let noise = scales.rounding(self.state.time - start);
            let has_ended = ending.is_some();
            self.certificate.misjudged_size = judged.worst(&relative_to, &noise, has_ended);
        }
    }

    /// Ends the run if the state is at rest.
    #[inline]
    pub(super) fn rest(&mut self, moved: bool) {
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
    pub(super) fn dependent(
        &self,
        &State { time, ref point, .. }: &State<F::Space>,
    ) -> Option<StepError> {
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
    #[inline]
    pub(super) fn check_invariants(&self, before: &State<F::Space>) -> Result<(), StepError> {
        let broken = |balance: &InvariantBalance| balance.max_error > NOT_CONSERVED * balance.scale;
        if self.promises.invariants && self.certificate.invariants.iter().any(broken) {
            self.dependent(before).map_or(Ok(()), Err)
        } else {
            Ok(())
        }
    }
}

/// Accepts a flow that has a run back in time: `x' = Π d(−H)`, by steps of a negative size.
fn check_backward<F: Flow + ?Sized>(
    flow: &F,
    x0: &Element<F>,
    is_noisy: bool,
) -> Result<(), SpanError> {
    let exchanges = |ledger: LedgerSummary| !(ledger.work.is_empty() && ledger.heat.is_empty());
    if is_noisy {
        Err(SpanError::BackwardNoise)
    } else if flow.ledger(x0).is_some_and(exchanges) {
        Err(SpanError::BackwardExchange)
    } else if flow.entropy_law() != SecondLaw::NoEntropy {
        Err(SpanError::BackwardEntropy)
    } else {
        Ok(())
    }
}

/// The error of a further invariant, relative to its terms, above which it is no longer conserved. What
/// fades out of `Π̃` stays far below it: `10⁻⁴h²`.
const NOT_CONSERVED: f64 = 1e-4;
