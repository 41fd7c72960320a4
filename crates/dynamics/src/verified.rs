//! A verified system is a system, with the parts of the one that was verified.

use crate::metriplectic::{Metriplectic, SecondLaw};
use crate::verification::Verified;

impl<Y: Metriplectic + ?Sized> Metriplectic for Verified<'_, Y> {
    type Manifold = Y::Manifold;
    type Metric = Y::Metric;
    type Bracket = Y::Bracket;
    type Dissipation = Y::Dissipation;
    type Energy = Y::Energy;
    type Entropy = Y::Entropy;
    type Invariants = Y::Invariants;

    fn manifold(&self) -> &Y::Manifold {
        self.system.manifold()
    }

    fn metric(&self) -> &Y::Metric {
        self.system.metric()
    }

    fn bracket(&self) -> &Y::Bracket {
        self.system.bracket()
    }

    fn dissipation(&self) -> &Y::Dissipation {
        self.system.dissipation()
    }

    fn energy(&self) -> &Y::Energy {
        self.system.energy()
    }

    fn entropy(&self) -> &Y::Entropy {
        self.system.entropy()
    }

    fn invariants(&self) -> &Y::Invariants {
        self.system.invariants()
    }

    fn second_law(&self) -> SecondLaw {
        self.system.second_law()
    }

    fn is_verified(&self) -> bool {
        true
    }
}
