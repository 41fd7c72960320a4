//! The scheme as published, for any system.

use metriplectic_dynamics::{Metriplectic, SecondLaw};

/// A system that is integrated by [`SecondLaw::Published`], whatever it asks for itself: for
/// comparisons of the two schemes.
#[derive(Clone, Copy, Debug)]
pub struct Published<'a, Y>(pub &'a Y);

impl<Y: Metriplectic> Metriplectic for Published<'_, Y> {
    type Manifold = Y::Manifold;
    type Metric = Y::Metric;
    type Bracket = Y::Bracket;
    type Dissipation = Y::Dissipation;
    type Energy = Y::Energy;
    type Entropy = Y::Entropy;
    type Invariants = Y::Invariants;

    fn manifold(&self) -> &Y::Manifold {
        self.0.manifold()
    }

    fn metric(&self) -> &Y::Metric {
        self.0.metric()
    }

    fn bracket(&self) -> &Y::Bracket {
        self.0.bracket()
    }

    fn dissipation(&self) -> &Y::Dissipation {
        self.0.dissipation()
    }

    fn energy(&self) -> &Y::Energy {
        self.0.energy()
    }

    fn entropy(&self) -> &Y::Entropy {
        self.0.entropy()
    }

    fn invariants(&self) -> &Y::Invariants {
        self.0.invariants()
    }

    fn second_law(&self) -> SecondLaw {
        match self.0.second_law() {
            SecondLaw::NoEntropy => SecondLaw::NoEntropy,
            _ => SecondLaw::Published,
        }
    }
}
