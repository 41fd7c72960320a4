//! Where an explicit step ends: the projection of its end onto the laws, and whether it is taken.

use metriplectic_dynamics::SecondLaw;

use super::flow::{Combination, Limit, Projected, ProjectionError, StageFlow, Target};
use super::memory::{LastStep, Produced};
use super::refused::Refused;
use super::rest;
use super::stage::produced;
use super::trial::Trial;
use crate::step::{Element, EntropyStep, Laws, Vector};

/// The fraction of the round-off of an increment by which the entropy may fall: less than what the certificate
/// counts as a fall.
/// A factor of four fails `tests/explicit.rs::unstable_equilibria_are_left_or_kept`.
const FALL: f64 = 0.875;
/// The entropy that is produced in a step, in units of the round-off of the entropy, by friction that is idle.
/// A factor of four fails `tests/explicit.rs::a_sound_stiff_model_runs_in_steps_that_are_far_too_long`.
const IDLE: f64 = 0.25;
/// The length of a projection in units of the error that is allowed.
/// A factor of four fails `tests/open/main.rs::a_system_without_entropy_is_isothermal`.
const FAR: f64 = 10.0;

/// Where a step ends.
pub(super) struct Landed<F: StageFlow> {
    pub(super) end: Projected<F>,
    pub(super) produced: Produced,
    pub(super) how: EntropyStep,
}

/// How far a state may be moved onto its laws.
enum Bounds<V> {
    /// At most these entries, in units of the errors that are allowed, or in these.
    Allowed(V, Option<V>),
    /// At most half of the step, with the sizes at its start.
    HalfOfStep { sizes: V, units: Option<V> },
}

/// The projection of the end of a step onto the laws, and the decision whether it is taken.
pub(super) struct Onto<'a, F: StageFlow> {
    pub(super) trial: &'a Trial<'a, F>,
    pub(super) last: &'a LastStep<F::Vector>,
    pub(super) produced: Produced,
    /// The round-off of the entropy at the start, if it is known.
    pub(super) round_off: Option<f64>,
}

impl<F: StageFlow> Onto<'_, F> {
    #[inline]
    pub(super) fn decide(&self, y: Element<F>) -> Result<Landed<F>, Refused> {
        let Self { trial: &Trial { start, .. }, last, produced, .. } = *self;
        let flow = start.flow;
        let bounds = self.bounds();
        let (limit, units) = match &bounds {
            Bounds::Allowed(entries, units) => {
                (Limit::Entries(entries), units.as_ref().or(start.allowed.as_ref()))
            }
            Bounds::HalfOfStep { sizes, units } => {
                (Limit::HalfOf { step: &last.end, sizes }, units.as_ref())
            }
        };
        let (factor, terms) = self.error_terms();
        let error = F::WEIGHS_ERRORS.then_some(Combination { factor, terms: &terms });
        let onto = |y, entropy, with_entropy| {
            let laws = Laws { entropy, ..start.reference.clone() };
            let limit = Some(limit);
            flow.project(y, &Target { laws: &laws, with_entropy, limit, units, error })
        };
        if flow.entropy_law() != SecondLaw::Exact {
            let end = onto(y, start.reference.entropy, false).map_err(refused)?;
            return Ok(Landed { end, produced, how: EntropyStep::Free });
        }
        let mut y = Some(y);
        if self.is_trusted()
            && let Some(y) = y.take()
        {
            let target = produced.plus(last.rise);
            if let Ok(end) = onto(y, target.sum, true)
                && !self.falls(&end)
            {
                let largest = produced.largest.max(end.entropy);
                let produced = Produced { largest, ..target };
                return Ok(Landed { end, produced, how: EntropyStep::Targeted });
            }
        }
        let again = || flow.stage(start.x, &last.end).ok_or(Refused::Outside(None));
        let y = y.map_or_else(again, Ok)?;
        let end = onto(y, produced.sum, false).map_err(refused)?;
        let least = produced.largest - 2.0 * end.entropy_round_off;
        if end.entropy < least || self.falls(&end) {
            if self.is_idle()
                && let Ok(end) = onto(again()?, produced.sum, true)
                && !self.falls(&end)
            {
                return Ok(Landed { end, produced, how: EntropyStep::Targeted });
            }
            return Err(Refused::Falls(last.rise));
        }
        let largest = produced.largest.max(end.entropy);
        let produced = Produced { largest, ..Produced::from(end.entropy) };
        Ok(Landed { end, produced, how: EntropyStep::Free })
    }

    /// The longest displacement, and the units of the entries unless they are the errors that are allowed.
    fn bounds(&self) -> Bounds<F::Vector> {
        let Self { trial: &Trial { start, .. }, last, .. } = *self;
        let flow = start.flow;
        if let Some(allowed) = &start.allowed {
            let begins =
                (0..allowed.len()).any(|i| allowed.get(i) == 0.0 && last.end.get(i) != 0.0);
            if begins {
                // An entry that begins to move has no size yet but its displacement.
                let most = |[error, end]: [f64; 2]| if error > 0.0 { error } else { end.abs() };
                let units = Vector::zip([allowed, &last.end], most);
                return Bounds::Allowed(units.map(|error| FAR * error), Some(units));
            }
            return Bounds::Allowed(allowed.map(|error| FAR * error), None);
        }
        let sizes = flow.sizes(start.x);
        // An entry that crosses zero has the size of its displacement. A flow that weighs errors has its own units.
        let size = |[end, size]: [f64; 2]| size.max(end.abs());
        let units = (!F::WEIGHS_ERRORS).then(|| Vector::zip([&last.end, &sizes], size));
        Bounds::HalfOfStep { sizes, units }
    }

    /// The terms of the embedded error with their common factor, if the flow weighs errors. Where that error needs the end of the
    /// step, the velocity at the start takes its place.
    fn error_terms(&self) -> (f64, Vec<(f64, &F::Vector)>) {
        let Self { trial: &Trial { tableau, h, .. }, last, .. } = *self;
        // A constant, so that other flows are compiled without a list.
        if const { !F::WEIGHS_ERRORS } {
            return (h, Vec::new());
        }
        let of = |&(stage, w): &(usize, f64)| (w, &last.stages[stage].velocity);
        match tableau.early_error {
            [] => (1.0, vec![of(&(0, 1.0))]),
            row => (h, row.iter().map(of).collect()),
        }
    }

    /// Whether the entropy that was produced may be aimed at.
    fn is_trusted(&self) -> bool {
        let Self { trial: &Trial { tableau, h, .. }, last, .. } = *self;
        let doubt = (h * produced(tableau.early_error, &last.stages)).abs();
        last.rise >= 0.0 && doubt <= 0.5 * last.rise
    }

    /// Whether friction produces nothing but round-off while the state moves: the entropy is aimed at as without friction.
    #[cold]
    fn is_idle(&self) -> bool {
        let Self { trial: &Trial { tableau, start, h }, last, .. } = *self;
        let flow = start.flow;
        let doubt = (h * produced(tableau.early_error, &last.stages)).abs();
        let round_off = flow.entropy_round_off([start.x, start.x]);
        last.rise.abs() + doubt <= IDLE * round_off
            && !rest::is_reached(flow, start, &last.stages[0].velocity)
    }

    /// Whether the entropy at the end is below the one at the start by more than its round-off. Near an equilibrium,
    /// where every change is round-off, the flow says whether it falls.
    fn falls(&self, end: &Projected<F>) -> bool {
        let start = self.trial.start;
        let flow = start.flow;
        let rise = flow.values(&end.gradients).entropy - start.values.entropy;
        let known = self.round_off.zip(flow.entropy_round_off_of(&end.gradients));
        let round_off = match known {
            Some((start, end)) => start.max(end),
            None => flow.entropy_round_off_to([start.x, &end.x], &end.gradients),
        };
        if rise.abs() > round_off {
            return rise < 0.0;
        }
        let dissipates = self.last.stages[0].production != 0.0;
        rise < -FALL * round_off || (dissipates && flow.falls_below_round_off(start.x, &end.x))
    }
}

fn refused(error: ProjectionError) -> Refused {
    match error {
        ProjectionError::Outside => Refused::Outside(None),
        ProjectionError::NoEntropy | ProjectionError::Far => Refused::Far,
    }
}
