//! An open system for explicit methods: stages with clock and ledger, and the projection of the point alone.

use metriplectic_dynamics::exchange::Exchange;
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Dimension, Space as _};

use super::clock::Clock;
use super::state::{Booked, OpenState};
use super::system::{Direction, OpenSystem, StateOf};
use super::vector::OpenVector;
use crate::explicit::{Limit, Projected, ProjectionError, StageFlow, Target};
use crate::step::{CountOf, Dim, Laws, Numbers};
use crate::system::{JetsOf, LawJets};

/// The laws of an open system at a state, with the differentials of the system's own.
#[derive(Clone, Debug)]
pub struct OpenGradients<N: Dimension, C: Dimension> {
    jets: LawJets<N, C>,
    values: Laws<C::Array<f64>>,
}

/// The laws of an open system with the differentials of the system `Y`.
type OpenGradientsOf<Y> = OpenGradients<Dim<Y>, CountOf<Y>>;

impl<Y, C, X> StageFlow for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    type Gradients = OpenGradientsOf<Y>;

    fn gradients(&self, x: &StateOf<Y>) -> Option<OpenGradientsOf<Y>> {
        let view = self.frozen(x.time);
        let jets = view.gradients(&x.x)?;
        Some(self.gradients_at(x, jets))
    }

    fn values(&self, gradients: &OpenGradientsOf<Y>) -> Laws<Numbers<Y>> {
        gradients.values
    }

    fn velocity(
        &self,
        x: &StateOf<Y>,
        OpenGradients { jets, .. }: &OpenGradientsOf<Y>,
    ) -> Option<(Direction<Y, X>, f64)> {
        let t = x.time;
        let w = jets.covectors();
        let (v, _) = self.frozen(t).velocity(&x.x, jets)?;
        let mut production = self.internal_production(t, &x.x, w)?;
        let mut booked = Booked::nothing();
        if X::PORTS + X::BATHS > 0 {
            let exchanged = self.exchanged(t, &x.x, [&w.energy, &w.entropy]).ok()?;
            production += exchanged.production;
            booked.entries = exchanged.entries;
        }
        let velocity = OpenVector { v: v.0, clock: 1.0, booked };
        production.is_finite().then_some((velocity, production))
    }

    fn stage(&self, x: &StateOf<Y>, q: &Direction<Y, X>) -> Option<StateOf<Y>> {
        let view = self.frozen(x.time);
        let point = view.stage(&x.x, &Self::components(q))?;
        Some(self.advanced(x, q, point))
    }

    fn stage_rates(
        &self,
        x: &StateOf<Y>,
        (q, y): (&Direction<Y, X>, &StateOf<Y>),
        v: &Direction<Y, X>,
    ) -> Direction<Y, X> {
        let rates = Y::Manifold::stage_rates(&x.x, (&q.v, &y.x), &v.v);
        let mut booked = v.booked;
        if C::RUNS {
            booked.parameter = self.power(y.time, &y.x) - self.power(y.time, &x.x);
        }
        OpenVector { v: rates, clock: v.clock, booked }
    }

    fn stage_coordinates(&self, x: &StateOf<Y>, y: &StateOf<Y>) -> Direction<Y, X> {
        self.direction(x, y, Y::Manifold::stage_coordinates(&x.x, &y.x))
    }

    /// Moves the point alone. The energy of the system is to be the target and what has flowed in, its entropy the target
    /// less what the baths have gained.
    fn project(
        &self,
        y: StateOf<Y>,
        target: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError> {
        let OpenState { x, time, ledger } = y;
        let (laws, of_baths) = (ledger.targets(target.laws), ledger.entropy_of_baths());
        let has_entropy = self.closed().second_law() == SecondLaw::Exact;
        let units = target.units.map(Self::components);
        let limit = target.limit.map(|limit| Self::components(&limit.entries()));
        let inner = Target {
            laws: &laws,
            with_entropy: target.with_entropy && has_entropy,
            limit: limit.as_ref().map(Limit::Entries),
            units: units.as_ref(),
            error: None,
        };
        let view = self.frozen(time);
        let Projected { x, gradients, entropy, entropy_round_off } = view.project(x, &inner)?;
        // Without an entropy of its own, the system leaves that of the baths as it is.
        let entropy = if has_entropy { entropy } else { 0.0 };
        let x = OpenState { x, time, ledger };
        Ok(Projected {
            gradients: self.gradients_at(&x, gradients),
            x,
            entropy: entropy + of_baths,
            entropy_round_off: entropy_round_off + 2.0 * f64::EPSILON * of_baths.abs(),
        })
    }
}

impl<Y, C, X> OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    /// The gradients of the open system, from those of the system at this state.
    fn gradients_at(&self, x: &StateOf<Y>, jets: JetsOf<Y>) -> OpenGradientsOf<Y> {
        OpenGradients { values: x.ledger.balanced(jets.values()), jets }
    }
}
