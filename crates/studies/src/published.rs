//! The scheme as published, for any system.

use metriplectic_dynamics::{Metriplectic, SecondLaw, parts_of};

/// A system that is integrated by its own scheme, or by [`SecondLaw::Published`] whatever it asks for itself:
/// for comparisons of the two. Both are of one type, so that one compiled run serves both.
#[derive(Clone, Copy, Debug)]
pub struct Compared<'a, Y> {
    system: &'a Y,
    published: bool,
}

impl<'a, Y: Metriplectic> Compared<'a, Y> {
    /// The system by its own scheme.
    pub const fn given(system: &'a Y) -> Self {
        Self { system, published: false }
    }

    /// The system by the published scheme.
    pub const fn published(system: &'a Y) -> Self {
        Self { system, published: true }
    }
}

impl<Y: Metriplectic> Metriplectic for Compared<'_, Y> {
    parts_of!(self.system: Y {
        manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation, energy: Energy, entropy: Entropy,
        invariants: Invariants,
    });

    fn second_law(&self) -> SecondLaw {
        match self.system.second_law() {
            SecondLaw::NoEntropy => SecondLaw::NoEntropy,
            _ if self.published => SecondLaw::Published,
            given => given,
        }
    }
}
