//! The balance of the laws of a run.

mod text;

#[cfg(feature = "serde")]
use std::fmt;

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::Evaluated;

use crate::round_off::bound::of_a_law;
use crate::run::checked::checked_states;
use crate::run::jump::{Exchanged, JumpBalance};
use crate::step::evidence::RESOLVED;
use crate::step::{
    Effort, Element, EntropyStep, EventExchange, Evidence, Flow, Laws, LedgerErrors, LedgerSummary,
    LimitingSites, NoiseSummary, Promises, Taken,
};

/// The balance of a run: what became of the two laws, of the manifold, and what it cost.
///
/// All figures of the laws are evaluated from the closures at the stored points, none from the
/// terms of the scheme.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Certificate {
    /// The energy `H(x₀)`.
    pub initial_energy: f64,
    /// `max |H(x_k) − H(x₀)|`.
    pub max_energy_error: f64,
    /// The size `|H| + Σ_i |∂_iH x_i|` of the terms of the energy, to which its round-off is relative: at
    /// the start, or where the error asked for a larger one.
    pub energy_scale: f64,
    /// The entropy `S(x₀)`; 0 without an entropy.
    pub initial_entropy: f64,
    /// `min (S(x_{k+1}) − S(x_k))`; 0 before the first step.
    pub min_entropy_increment: f64,
    /// `S(x_n) − S(x₀)`.
    pub entropy_gained: f64,
    /// Steps on which the entropy fell by more than its round-off
    /// `4ε (|S| + Σ_i |∂_iS x_i|)`.
    pub entropy_falls: usize,
    /// `min |w_S|`, the size of the discrete gradient of the entropy in the exact scheme, which has
    /// order 2 as long as this is large against `h²`; infinite (in JSON, null) without such a one.
    pub min_entropy_slope: f64,
    /// The balances of the further invariants, in their order.
    pub invariants: Vec<InvariantBalance>,
    /// `max` of the manifold's defect.
    pub max_manifold_defect: f64,
    /// Steps taken.
    pub steps: usize,
    /// The size of the smallest step taken, and of the smallest part of one that a corner or a jump has cut; 0 before the first
    /// step.
    pub smallest_step: f64,
    /// The size of the largest step taken; 0 before the first step.
    pub largest_step: f64,
    /// Steps that were tried and given up, because their error was above the tolerance or because
    /// they were not solved.
    pub rejected: usize,
    /// Rejected steps on which the entropy would have fallen.
    pub falls_avoided: usize,
    /// Steps of a method that projects onto the laws, by how the entropy was found.
    pub projected_steps: ProjectedSteps,
    /// The balance of the laws in steps with stages; `None` for another method.
    pub stages: Option<StageBalance>,
    /// The effort of the solver, in all steps.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub effort: Effort,
    /// Linear systems solved in the worst step.
    pub worst_iterations: usize,
    /// The largest local error of a step, relative to the sizes of the entries, as estimated on a few steps:
    /// those whose number is a power of two. `None` where there is no estimate, and infinite (in JSON, null) where a
    /// step is longer than a chart, so that nothing is known of its error. Where friction is stiff it is
    /// too large by a factor of about `h|K'|`. With [`stages`](Self::stages) it is the error of the polynomial
    /// inside a step, which is larger than the one at its end.
    pub local_error: Option<f64>,
    /// The entry whose size, which its errors are relative to, differs most from the largest one that it has reached,
    /// by more than a factor of 100. It is looked for in steps that follow a tolerance, where
    /// their number is a power of two and at the end of the run.
    pub misjudged_size: Option<MisjudgedSize>,
    /// The steps of a system that takes the time in which nothing has changed its motion, although they were long enough for
    /// something to happen between the times at which a method looks; `None` without such steps.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub rest_in_time: Option<RestInTime>,
    /// The sites of a large system that set the size of the steps: the site with the largest of these local errors,
    /// relative to the error that is allowed, and the site where the motion was stiffest when this was last found.
    /// [`RungeKuttaChebyshev`](crate::RungeKuttaChebyshev) looks for it, and the other explicit methods if stability
    /// bounds a step. Both are `None` in a system without sites.
    pub limiting_sites: LimitingSites,
    /// The states at which the laws of the model were checked, the start and the end among them. Those at which a step
    /// was held or failed are checked too, and not counted. 0 for a flow that does not
    /// [check](crate::Flow::rechecks) them; a lattice checks them at the start and at the end.
    pub checked_states: usize,
    /// Whether the model was verified before the run, by [`Verify::verified`](metriplectic_dynamics::Verify::verified), and
    /// not around its start.
    pub verified_before: bool,
    /// The promises of the method.
    pub promises: Promises,
    /// The promise of the model about its entropy; serialized as the name of the variant.
    #[cfg_attr(feature = "serde", serde(serialize_with = "by_name"))]
    pub second_law: SecondLaw,
    /// The largest rate `h|K'|` of the friction in a step, with `K'` the derivative of `K dS` along the
    /// state, from the Jacobians that were formed; 0 without dissipation, and in steps that damp it. The midpoint
    /// rule damps no deviation that decays much faster than a step: it is multiplied by almost −1.
    pub friction: f64,
    /// The exchange of an open system; `None` for a closed one. The energy of an open system is `H − W − Q`, and
    /// its entropy that of the system and its baths.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub exchange: Option<LedgerSummary>,
    /// How far the entries of the ledger of an open system are off, as the method estimates it. The entries add up to the
    /// balance in each step, so that the first law says nothing of their errors. `None` for a closed system, and for a
    /// tableau without an embedded error.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub exchange_errors: Option<LedgerErrors>,
    /// The balance of each event at which the state has [jumped](crate::Watched::jump).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub jumps: Vec<JumpBalance>,
    /// How often each event has happened, in the order in which they were asked for.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub event_counts: Vec<EventCount>,
    /// The events whose functions vary in a step faster than looks at them tell: some may not have been found.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub unsure_events: Vec<UnsureEvent>,
    /// The names of events with a [jump](crate::Watched::jump) whose function is zero at the start, where the state does not jump.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub events_at_start: Vec<String>,
    /// The work and heat of jumps of a system whose states have no ledger.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) exchanged_in_jumps: Exchanged,
    /// The thermal noise of the run; `None` for one without.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub noise: Option<NoiseSummary>,
    /// Whether the dissipation was projected so that it keeps the energy, and is not quite the tensor
    /// that was written down ([`ProjectedDissipation`](metriplectic_dynamics::ProjectedDissipation)).
    pub projected: bool,
    /// The largest eigenvalue `|K| = G*(dH, dH)` of `K` at the start of the run, in units of `κ = 1`, if the friction is
    /// that of the metric and no scale was chosen; `None` for another one.
    ///
    /// A system with an entropy has this friction by default.
    /// [`MetricDissipation::scaled`](metriplectic_dynamics::MetricDissipation::scaled) scales it, and
    /// [`NoDissipation`](metriplectic_dynamics::NoDissipation) removes it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub default_friction: Option<f64>,
    /// Which fields are evaluated from a recording, and why others are not; empty where none is written to be recorded.
    /// Serialized as sentences.
    #[cfg_attr(
        feature = "serde",
        serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_sentences")
    )]
    pub evaluated: Vec<Evaluated>,
}

/// Steps of a method that projects onto the laws; all are zero for another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ProjectedSteps {
    /// Steps whose entropy is the one that their production asks for.
    pub targeted: usize,
    /// Steps near an equilibrium, where the other laws leave the entropy free, and it has not fallen.
    pub free: usize,
    /// Steps that leave the state where it is, because each one would have let the entropy fall by round-off.
    pub held: usize,
    /// Steps whose size is near the edge of the region of stability: stability, and not the tolerance, sets it.
    pub stability: usize,
}

impl ProjectedSteps {
    /// All steps.
    #[must_use]
    pub const fn all(&self) -> usize {
        self.targeted + self.free + self.held
    }

    fn enter(&mut self, evidence: &Evidence) {
        match evidence.entropy_step {
            Some(EntropyStep::Targeted) => self.targeted += 1,
            Some(EntropyStep::Free) => self.free += 1,
            Some(EntropyStep::Held) => self.held += 1,
            None => {}
        }
        self.stability += usize::from(evidence.stability);
    }
}

/// The balance of the laws in steps of a method with stages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct StageBalance {
    /// The largest error of the energy and the further invariants in one step, relative to the sizes of their terms.
    pub defect: f64,
    /// The entropy gained beside the production of friction: what
    /// [`Radau`](crate::Radau) adds where it damps.
    pub surplus: f64,
}

/// An entry of a state whose errors were relative to a size that is not its own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct MisjudgedSize {
    /// The direction of the chart, or of that of a site of a lattice.
    pub direction: usize,
    /// The size that errors were relative to: the one estimated at the start of the run if the entry has grown beyond
    /// it, and the one at its end if the entry has not reached it.
    pub judged: f64,
    /// The largest size of the entry in the run.
    pub reached: f64,
}

/// Steps in which nothing has changed the motion of a system that takes the time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct RestInTime {
    /// How many.
    pub steps: usize,
    /// How long they were together.
    pub time: f64,
    /// The longest of them.
    pub longest: f64,
}

/// How often an event has happened in a run.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct EventCount {
    /// The name of the event.
    pub name: String,
    /// The number of times.
    pub count: usize,
}

/// An event whose function was looked at in steps where its values did not agree with each other.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct UnsureEvent {
    /// The name of the event.
    pub name: String,
    /// The number of such steps.
    pub steps: usize,
    /// The first time from which on they did not agree.
    pub first: f64,
}

/// The balance of a further invariant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct InvariantBalance {
    /// Why it is conserved; serialized as its name.
    #[cfg_attr(feature = "serde", serde(serialize_with = "by_name"))]
    pub kind: Kind,
    /// Its value `L(x₀)`.
    pub initial: f64,
    /// `max |L(x_k) − L(x₀)|`.
    pub max_error: f64,
    /// The size `|L| + Σ_i |∂_iL x_i|` of its terms, like [`Certificate::energy_scale`].
    pub scale: f64,
}

impl InvariantBalance {
    /// Whether it was kept to round-off: `|L − L₀| ≤ 50 ε (|L| + Σ_i |∂_iL x_i|)`.
    pub const fn is_kept(&self) -> bool {
        self.max_error <= of_a_law(self.scale)
    }
}

/// The rate `h|K'|` of friction from which on a step is stiff: the midpoint rule leaves two thirds of a
/// deviation that decays at this rate, with the opposite sign.
/// A factor of four fails `tests/stiff_friction.rs::two_temperatures_come_together`.
const STIFF: f64 = 10.0;

#[cfg(feature = "serde")]
fn by_name<S: serde::Serializer>(name: &impl fmt::Debug, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&format_args!("{name:?}"))
}

#[cfg(feature = "serde")]
fn as_sentences<S: serde::Serializer>(list: &[Evaluated], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(list.iter().map(Evaluated::to_string))
}

/// A step that was taken, and its size.
pub(crate) struct StepOf<'a, F: Flow + ?Sized> {
    pub(crate) taken: &'a Taken<F>,
    pub(crate) h: f64,
}

/// A jump of a run.
pub(crate) struct JumpOf<'a, F: Flow + ?Sized> {
    pub(crate) name: &'a str,
    /// The state after it.
    pub(crate) x: &'a Element<F>,
    /// The size of the step that it has cut, up to it.
    pub(crate) h: f64,
    /// The laws at the start of the step that it has cut, before it and after it.
    pub(crate) values: [&'a Laws<F::Numbers>; 3],
    pub(crate) exchange: &'a EventExchange,
    /// The rise of the entropy of the system and its surroundings.
    pub(crate) rise: f64,
    /// Whether the exchange is in the ledger of the state.
    pub(crate) is_booked: bool,
}

impl Certificate {
    /// Makes the certificate of a run that starts at `x0`, with these laws.
    pub(crate) fn start<F: Flow + ?Sized>(
        flow: &F,
        x0: &Element<F>,
        laws: &Laws<F::Numbers>,
        promises: Promises,
    ) -> Self {
        let sizes = flow.term_sizes(x0);
        let kinds = flow.kinds().into_iter().enumerate();
        Self {
            initial_energy: laws.energy,
            max_energy_error: 0.0,
            energy_scale: sizes.energy,
            initial_entropy: laws.entropy,
            min_entropy_increment: 0.0,
            entropy_gained: 0.0,
            entropy_falls: 0,
            min_entropy_slope: f64::INFINITY,
            invariants: kinds
                .map(|(k, kind)| InvariantBalance {
                    kind,
                    initial: laws.invariants.as_ref()[k],
                    max_error: 0.0,
                    scale: sizes.invariants.as_ref()[k],
                })
                .collect(),
            max_manifold_defect: flow.defect(x0),
            steps: 0,
            smallest_step: 0.0,
            largest_step: 0.0,
            rejected: 0,
            falls_avoided: 0,
            projected_steps: ProjectedSteps::default(),
            stages: None,
            effort: Effort::default(),
            worst_iterations: 0,
            local_error: None,
            misjudged_size: None,
            rest_in_time: None,
            limiting_sites: LimitingSites::default(),
            checked_states: checked_states(flow, 0),
            verified_before: flow.is_verified(),
            promises,
            second_law: flow.entropy_law(),
            friction: 0.0,
            exchange: flow.ledger(x0),
            exchange_errors: None,
            jumps: Vec::new(),
            event_counts: Vec::new(),
            unsure_events: Vec::new(),
            events_at_start: Vec::new(),
            exchanged_in_jumps: Exchanged::NOTHING,
            noise: None,
            projected: flow.is_projected(),
            default_friction: flow.default_friction(x0),
            evaluated: flow.evaluated(x0),
        }
    }

    /// Enters a step from a state with these laws.
    #[inline]
    pub(crate) fn enter<F: Flow + ?Sized>(
        &mut self,
        flow: &F,
        x: &Element<F>,
        before: &Laws<F::Numbers>,
        step: StepOf<'_, F>,
    ) {
        let StepOf { taken: Taken { x: next, values: after, evidence, effort }, h } = step;
        let shortest = h.min(evidence.shortest_part);
        self.smallest_step =
            if self.steps == 0 { shortest } else { self.smallest_step.min(shortest) };
        self.largest_step = self.largest_step.max(h);
        let error = (after.energy - self.reference_energy()).abs();
        self.max_energy_error = self.max_energy_error.max(error);
        // The terms of the energy are evaluated where the error asks for them, and not in every step.
        if error > of_a_law(self.energy_scale) {
            let size = flow.term_sizes(next).energy;
            // A balance has the round-off of what flowed in the step, too.
            let flowed =
                if self.exchange.is_some() { flow.energy_sizes([x, next])[1] } else { 0.0 };
            self.energy_scale = self.energy_scale.max(size).max(flowed);
        }
        let increment = after.entropy - before.entropy;
        self.min_entropy_increment =
            if self.steps == 0 { increment } else { self.min_entropy_increment.min(increment) };
        self.entropy_gained = self.gained(after.entropy);
        if increment < 0.0 && increment < -flow.entropy_round_off([x, next]) {
            self.entropy_falls += 1;
        }
        for (k, balance) in self.invariants.iter_mut().enumerate() {
            let error = (after.invariants.as_ref()[k] - balance.initial).abs();
            balance.max_error = balance.max_error.max(error);
            if balance.max_error > of_a_law(balance.scale) {
                let size = flow.term_sizes(next).invariants.as_ref()[k];
                balance.scale = balance.scale.max(size);
            }
        }
        self.min_entropy_slope = self.min_entropy_slope.min(evidence.entropy_slope);
        self.friction = self.friction.max(evidence.friction);
        self.max_manifold_defect = self.max_manifold_defect.max(flow.defect(next));
        self.steps += 1;
        if self.exchange.is_some() {
            self.exchange = flow.ledger(next);
        }
        self.exchange_errors = match (self.exchange_errors, evidence.ledger) {
            (Some(sum), Some(step)) => Some(sum.and(step)),
            (sum, step) => sum.or(step),
        };
        self.projected_steps.enter(evidence);
        if let Some(laws) = evidence.stages {
            let balance = self.stages.get_or_insert_default();
            balance.defect = balance.defect.max(laws.defect);
            balance.surplus += laws.surplus;
        }
        self.effort += *effort;
        self.worst_iterations = self.worst_iterations.max(effort.iterations);
    }

    /// The energy that the run keeps: that of its start, and what jumps have brought in.
    #[inline]
    pub(crate) const fn reference_energy(&self) -> f64 {
        self.exchanged_in_jumps.energy_after(self.initial_energy)
    }

    /// The gain of the entropy and of that of the surroundings of events.
    fn gained(&self, entropy: f64) -> f64 {
        (entropy - self.initial_entropy) + self.exchanged_in_jumps.entropy[0]
    }

    /// Enters a jump at the end of a step that it has cut.
    pub(crate) fn enter_jump<F: Flow + ?Sized>(&mut self, flow: &F, jump: &JumpOf<'_, F>) {
        let JumpOf { name, x, h, values: [start, before, after], exchange, rise, is_booked } =
            *jump;
        self.smallest_step = self.smallest_step.min(h);
        self.max_energy_error =
            self.max_energy_error.max((before.energy - self.reference_energy()).abs());
        self.min_entropy_increment = self.min_entropy_increment.min(before.entropy - start.entropy);
        if !is_booked {
            self.exchanged_in_jumps.enter(exchange);
        }
        self.entropy_gained = self.gained(after.entropy);
        if self.exchange.is_some() {
            self.exchange = flow.ledger(x);
        }
        let known = self.jumps.iter().position(|balance| balance.name == name);
        let index = known.unwrap_or_else(|| {
            self.jumps.push(JumpBalance::new(name.to_owned()));
            self.jumps.len() - 1
        });
        self.jumps[index].enter(exchange, rise);
    }

    /// Notes a step of size `h` in which nothing has changed the motion.
    #[cold]
    pub(crate) fn note_rest(&mut self, h: f64) {
        let rest = self.rest_in_time.get_or_insert_default();
        rest.steps += 1;
        rest.time += h;
        rest.longest = rest.longest.max(h);
    }

    /// Notes that the looks at the function of an event did not agree in a step.
    pub(crate) fn note_unsure_event(&mut self, name: &str, time: f64) {
        match self.unsure_events.iter_mut().find(|event| event.name == name) {
            Some(event) => event.steps += 1,
            None => {
                let name = name.to_owned();
                self.unsure_events.push(UnsureEvent { name, steps: 1, first: time });
            }
        }
    }

    /// Notes an estimate of the local error, relative to the state, and the sites that set the step.
    pub(crate) const fn note_local_error(&mut self, error: f64, sites: LimitingSites) {
        let before = match self.local_error {
            Some(before) => before,
            None => 0.0,
        };
        self.local_error = Some(before.max(error));
        if error > before {
            self.limiting_sites.error = sites.error;
        }
        if sites.stiffness.is_some() {
            self.limiting_sites.stiffness = sites.stiffness;
        }
    }

    /// `max |H(x_k) − H(x₀)| / |H(x₀)|`; the absolute error if `H(x₀) = 0`.
    pub fn max_relative_energy_error(&self) -> f64 {
        if self.initial_energy == 0.0 {
            self.max_energy_error
        } else {
            self.max_energy_error / self.initial_energy.abs()
        }
    }

    /// Whether the first law was kept to round-off: `|H − H₀| ≤ 50 ε (|H| + Σ_i |∂_iH x_i|)`.
    pub const fn keeps_energy(&self) -> bool {
        self.max_energy_error <= of_a_law(self.energy_scale)
    }

    /// Whether friction is so stiff at these step sizes that the method does not damp it.
    ///
    /// Friction that the method has damped does not count. [`is_resolved`](Self::is_resolved) says whether a step was
    /// longer than its transient.
    pub const fn is_stiff(&self) -> bool {
        self.friction > STIFF
    }

    /// Returns whether a run has refused more than half as many steps as it has taken, as it does at a corner in time.
    const fn refuses_often(&self) -> bool {
        self.rejected >= REFUSED && 2 * self.rejected > self.steps
    }

    /// Returns whether no step is known to be too long for the motion: the local errors that were estimated are below a tenth of
    /// the state, friction is [damped](Self::is_stiff), and damping has added at most a hundredth of what the entropy
    /// gained. With noise no rate of friction exceeds 1.
    pub fn is_resolved(&self) -> bool {
        let is_followed = self.local_error.is_none_or(|error| error <= UNRESOLVED);
        let is_sampled = self.noise.is_none() || self.friction <= RESOLVED;
        is_followed && is_sampled && !self.is_stiff() && !self.skips_a_transient()
    }

    /// Returns whether damping has added more than a hundredth of what the entropy gained, beyond round-off.
    fn skips_a_transient(&self) -> bool {
        let of_friction = ADDED * self.entropy_gained.abs();
        let least = of_friction.max(of_a_law(self.initial_entropy.abs()));
        self.stages.is_some_and(|StageBalance { surplus, .. }| surplus > least)
    }

    /// Whether the entropy fell on no step by more than its round-off, in a run without noise. With noise the second law holds in
    /// the mean alone, so this is false for every path, also for one on which the entropy happened to rise.
    pub const fn keeps_entropy(&self) -> bool {
        self.noise.is_none() && self.entropy_falls == 0
    }

    /// Whether every further invariant was kept to round-off.
    pub fn keeps_invariants(&self) -> bool {
        self.invariants.iter().all(InvariantBalance::is_kept)
    }
}

/// Refused steps from which on they may be those at a corner in time.
/// A factor of four fails `run/certificate/tests.rs::refused_steps_of_a_driven_run_ask_for_a_corner`.
const REFUSED: usize = 8;

/// The local error, relative to the sizes of the entries, from which on a motion is not resolved.
/// A factor of four fails `run/certificate/tests.rs::one_is_no_plural`.
const UNRESOLVED: f64 = 0.1;

/// The fraction of the gain of the entropy that damping may add where a motion is resolved.
/// A factor of four fails `run/certificate/tests.rs::one_is_no_plural`.
const ADDED: f64 = 0.01;

/// The fraction of steps at the edge of stability from which on stability sets the steps of a run.
/// A factor of four fails `run/certificate/tests.rs::stability_sets_the_steps_where_more_than_half_of_them_are_at_its_edge`.
const AT_THE_EDGE: f64 = 0.5;

impl Certificate {
    /// Whether stability, and not the tolerance, sets the steps of an explicit method.
    pub const fn is_limited_by_stability(&self) -> bool {
        self.projected_steps.stability as f64 > AT_THE_EDGE * self.steps as f64
    }
}

#[cfg(test)]
mod tests;
