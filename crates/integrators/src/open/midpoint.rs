//! The scheme of the paper for open systems.
//!
//! ```math
//! W_t = \tfrac12 \bigl[ H(t', x') - H(t, x') + H(t', x) - H(t, x) \bigr], \qquad
//! \bar H = \tfrac12 \bigl[ H(t, \cdot) + H(t', \cdot) \bigr]
//! ```
//!
//! With `w_H` a discrete gradient of `H̄`, and ports and baths at the middle of the step, `ΔH = W_t + ⟨w_H, d⟩` and
//! `⟨w_H, d⟩ = Σ W_a + Σ Q_b`, with `W_a = h⟨w_H, F_a⟩` and `Q_b = h⟨w_H, R_b A_b⟩`.

use metriplectic_dynamics::exchange::{Entries as _, Exchange};
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_manifolds::Retraction;

use super::balance::balanced;
use super::clock::Clock;
use super::halves::{self, Failure};
use super::state::{Booked, OpenState};
use super::system::OpenSystem;
use super::view::Frozen;
use crate::discrete_gradient::DiscreteGradient;
use crate::midpoint::{MidpointMemory, Scheme, Solution};
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{
    Dim, Flow as _, Laws, Promises, Refusal, Start, StepError, StepStart, Stepper, Taken, name_of,
};

impl<Y, C, X, R, W> Stepper<OpenSystem<Y, C, X>> for Scheme<R, W>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Memory = MidpointMemory<Dim<Y>>;

    const HAS_DEFAULT_BETWEEN: bool = true;

    fn name(&self) -> String {
        format!("Scheme<{}, {}>", name_of::<R>(), name_of::<W>())
    }

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, system: &OpenSystem<Y, C, X>) -> Promises {
        Promises::all_laws(system.entropy_law() == SecondLaw::Exact)
    }

    fn step(
        &self,
        start: &StepStart<'_, OpenSystem<Y, C, X>>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<OpenSystem<Y, C, X>>, StepError> {
        let mut whole = true;
        halves::take(start, h, self.splits, &mut |start, h, fallbacks| {
            if !std::mem::replace(&mut whole, false) {
                *memory = MidpointMemory::default();
            }
            open_step(self, start, h, memory, fallbacks)
        })
    }

    fn attempt(
        &self,
        start: &StepStart<'_, OpenSystem<Y, C, X>>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<OpenSystem<Y, C, X>>, Refusal> {
        open_step(self, start, h, memory, Fallbacks::FirstTries)
            .map_err(|failure| failure.into_refusal(start.time, h))
    }
}

/// Solves a step, and books it.
fn open_step<Y, C, X, R, W>(
    scheme: &Scheme<R, W>,
    start: &StepStart<'_, OpenSystem<Y, C, X>>,
    h: f64,
    memory: &mut MidpointMemory<Dim<Y>>,
    fallbacks: Fallbacks,
) -> Result<Taken<OpenSystem<Y, C, X>>, Failure>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let system = start.flow;
    let OpenState { x, time, ledger } = start.x;
    let times = [*time, time + h];
    let view = system.between(times);
    let invariants = start.values.invariants;
    let values =
        Laws { energy: view.energy_at(x), entropy: system.closed().entropy_at(x), invariants };
    let accumulated_error =
        Start::<Frozen<'_, Y, C, X>>::accumulated([&start.values, &start.reference]);
    let inner = Start { system: &view, x, time: *time, h, values, accumulated_error };
    let solved = scheme.solution(&inner, memory, fallbacks);
    let Solution { end, z, energy, entropy, mut evidence, effort } =
        solved.map_err(|(cause, residual, effort)| Failure { cause, residual, effort })?;
    let edge = || Failure { cause: Cause::Edge, residual: f64::INFINITY, effort };
    let middle = times[0] + 0.5 * (times[1] - times[0]);
    let rates = system.exchanged(middle, &z, [&energy, &entropy]).map_err(|_| edge())?;
    let work = [&end, x].map(|x| system.frozen_work(times, x));
    let booked = Booked {
        parameter: 0.5 * (work[0] + work[1]),
        entries: X::Entries::from_index(|i| h * rates.entries.get(i)),
    };
    let x = OpenState { x: end, time: times[1], ledger: ledger.with(&booked) };
    let (x, values) = balanced(start, x, effort)?;
    // The entropy changes where heat flows, too.
    evidence.dissipates |= rates.production != 0.0;
    evidence.rests = false;
    evidence.ledger = system.against_trapezoid(start.x, &x, h);
    Ok(Taken { x, values, evidence, effort })
}
