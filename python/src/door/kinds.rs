//! The kinds of systems: closed ones and open ones, with and without noise.

use metriplectic_dynamics::noise::Uniform;
use metriplectic_integrators::open::Ledger;
use metriplectic_integrators::step::StateSpace;
use metriplectic_integrators::{
    Entries, Flow, FromEquations, Listed, Noisy, OpenEquations, OpenState, State,
};

use super::interrupt::Interruptible;
use super::schedule::Point;

/// A closed system.
pub(crate) type Closed = FromEquations<Interruptible>;
/// A system with surroundings.
pub(crate) type Open = OpenEquations<Interruptible>;

/// A kind of system, and what is recorded of its states.
pub(crate) trait Kind: Listed + Flow<Space: StateSpace<Element: Recorded>> + Sync {
    /// Computes the energy and the entropy of the system at a state, without what has flowed in.
    fn fields(&self, state: &State<Self::Space>) -> [f64; 2];
}

/// A state with the entries of its ledger.
pub(crate) trait Recorded: Point {
    /// Returns the ledger, if there is one.
    fn ledger(&self) -> Option<&Ledger> {
        None
    }
}

impl Recorded for Entries {}

impl Recorded for OpenState<Entries> {
    fn ledger(&self) -> Option<&Ledger> {
        Some(&self.ledger)
    }
}

impl Kind for Closed {
    fn fields(&self, state: &State<Self::Space>) -> [f64; 2] {
        [state.energy, state.entropy]
    }
}

impl Kind for Open {
    fn fields(&self, state: &State<Self::Space>) -> [f64; 2] {
        [self.energy_at(&state.point), self.entropy_at(&state.point)]
    }
}

impl Kind for Noisy<Closed, Uniform> {
    fn fields(&self, state: &State<Self::Space>) -> [f64; 2] {
        self.flow().fields(state)
    }
}

impl Kind for Noisy<Open, Uniform> {
    fn fields(&self, state: &State<Self::Space>) -> [f64; 2] {
        self.flow().fields(state)
    }
}
