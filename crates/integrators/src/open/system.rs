//! A system with its surroundings.

use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use metriplectic_dynamics::exchange::{Exchange, Names, Rates, rates};
use metriplectic_dynamics::velocity::Covectors;
use metriplectic_dynamics::{Erase, Metriplectic, System, system::Point};
use metriplectic_fields::{ErasedField, Real, ScalarField, Space, Vector};
use metriplectic_manifolds::MetricError;

use super::clock::Clock;
use super::state::{Columns, Ledger, OpenState};
use super::vector::OpenVector;
use super::view::{Closed, Frozen};
use crate::step::CountOf;

/// A system `Y` with a clock `C` in its energy, and with the ports and baths `X`; built by
/// [`System::on`](metriplectic_dynamics::System::on) with the methods of [`OpenBuilder`](crate::OpenBuilder).
pub struct OpenSystem<Y, C, X> {
    closed: Y,
    exchange: X,
    columns: Arc<Columns>,
    clock: PhantomData<C>,
    verified: bool,
}

impl<Y: fmt::Debug, C, X> fmt::Debug for OpenSystem<Y, C, X> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenSystem").field("closed", &self.closed).finish_non_exhaustive()
    }
}

impl<Y, C, X> OpenSystem<Y, C, X> {
    pub(super) fn new(closed: Y, exchange: X, names: &Names) -> Self {
        let columns = Arc::new(Columns::new(names));
        Self { closed, exchange, columns, clock: PhantomData, verified: false }
    }

    /// Marks the system as one whose model was verified.
    pub(super) fn with_certificate(self) -> Self {
        Self { verified: true, ..self }
    }

    /// Whether the model was verified before the run.
    pub(super) const fn has_certificate(&self) -> bool {
        self.verified
    }

    pub(super) const fn closed(&self) -> &Y {
        &self.closed
    }

    pub(super) const fn exchange(&self) -> &X {
        &self.exchange
    }

    pub(super) const fn columns(&self) -> &Arc<Columns> {
        &self.columns
    }
}

impl<M, G, B, K, H, S, L, C, X> Erase for OpenSystem<System<M, G, B, K, H, S, L>, C, X>
where
    M: Space,
    C: Clock<M, H>,
    H: Send + Sync + 'static,
    S: ScalarField<M> + Send + Sync + 'static,
{
    type Erased = OpenSystem<System<M, G, B, K, C::Erased, ErasedField<M>, L>, C, X>;

    fn erased(self) -> Self::Erased {
        let Self { closed, exchange, columns, clock, verified } = self;
        let closed = closed.map_fields(C::erased, ErasedField::new);
        OpenSystem { closed, exchange, columns, clock, verified }
    }
}

/// The numbers of the ledger of an open system.
pub(super) type EntriesOf<Y, X> =
    <X as Exchange<<Y as Metriplectic>::Manifold, <Y as Metriplectic>::Metric>>::Entries;

/// A direction of an open system.
pub(super) type Direction<Y, X> =
    OpenVector<Vector<<Y as Metriplectic>::Manifold>, EntriesOf<Y, X>>;

/// The covectors of all laws of a system at a point.
pub(super) type CovectorsOf<Y> = Covectors<CountOf<Y>, Vector<<Y as Metriplectic>::Manifold>>;

/// A state of an open system.
pub(crate) type StateOf<Y> = OpenState<Point<Y>>;

impl<Y, C, X> OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    /// Returns the state in which a run starts at a point: its time is that of the run, and nothing is booked yet.
    pub fn start(&self, x: Point<Y>) -> OpenState<Point<Y>> {
        OpenState { x, time: 0.0, ledger: Ledger::empty(&self.columns) }
    }

    /// Evaluates the energy `H(t, x)` at a state. The energy of a [state of a run](crate::State) is the balance
    /// `H − W − Q` instead, which stays what it was at the start.
    pub fn energy_at(&self, state: &OpenState<Point<Y>>) -> f64 {
        self.energy(state.time, &state.x)
    }

    /// Evaluates the entropy `S(x)` of the system at a state, without that of the baths.
    pub fn entropy_at(&self, state: &OpenState<Point<Y>>) -> f64 {
        self.closed.entropy_at(&state.x)
    }

    /// The energy `H(t, x)`.
    #[inline]
    pub(super) fn energy(&self, t: f64, x: &Point<Y>) -> f64 {
        C::at::<f64>(self.closed.energy(), [t; 2], x)
    }

    /// The work `H(t', x) − H(t, x)` at a frozen point.
    #[inline]
    pub(super) fn frozen_work(&self, [t, end]: [f64; 2], x: &Point<Y>) -> f64 {
        if C::RUNS { self.energy(end, x) - self.energy(t, x) } else { 0.0 }
    }

    /// The rate `∂_tH(t, x)`.
    pub(crate) fn power(&self, t: f64, x: &Point<Y>) -> f64 {
        if !C::RUNS {
            return 0.0;
        }
        let t = Real::new(t, 1.0, 0.0, 0.0);
        C::in_time(self.closed.energy(), t, &Y::Manifold::constant(x)).eps1
    }

    /// The system between two times.
    #[inline]
    pub(super) fn between(&self, times: [f64; 2]) -> Frozen<'_, Y, C, X> {
        Frozen::new(&self.closed, &self.exchange, times)
    }

    /// The system at one time.
    #[inline]
    pub(super) fn frozen(&self, t: f64) -> Frozen<'_, Y, C, X> {
        self.between([t; 2])
    }

    /// The model without its surroundings, at one time.
    pub(super) fn without_exchange(&self, t: f64) -> Closed<'_, Y, C> {
        Closed::new(&self.closed, t, self.verified)
    }

    /// The index of the heat of each bath among the entries, and its temperature.
    pub(super) fn baths(&self, t: f64) -> Vec<(usize, f64)> {
        let mut temperatures = Vec::new();
        self.exchange.temperatures(t, &mut temperatures);
        self.columns.heats().zip(temperatures).collect()
    }

    /// Computes the motion by ports and baths at a point, with the covectors of energy and entropy there.
    pub(super) fn exchanged(
        &self,
        t: f64,
        x: &Point<Y>,
        w: [&Vector<Y::Manifold>; 2],
    ) -> Result<Rates<Y::Manifold, X::Entries>, MetricError> {
        rates(&self.exchange, (self.closed.metric(), x), t, w)
    }
}
