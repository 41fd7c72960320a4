//! The scheme as published, for any system.

use metriplectic_dynamics::{Metriplectic, SecondLaw, parts_of};

/// A system that is integrated by [`SecondLaw::Published`], whatever it asks for itself: for
/// comparisons of the two schemes.
#[derive(Clone, Copy, Debug)]
pub struct Published<'a, Y>(pub &'a Y);

impl<Y: Metriplectic> Metriplectic for Published<'_, Y> {
    parts_of!(self.0: Y {
        manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation, energy: Energy, entropy: Entropy,
        invariants: Invariants,
    });

    fn second_law(&self) -> SecondLaw {
        match self.0.second_law() {
            SecondLaw::NoEntropy => SecondLaw::NoEntropy,
            _ => SecondLaw::Published,
        }
    }
}
