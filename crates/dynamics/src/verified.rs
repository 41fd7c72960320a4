//! A verified system is a system, with the parts of the one that was verified.

use crate::metriplectic::{Metriplectic, SecondLaw};
use crate::parts_of;
use crate::verification::Verified;

impl<Y: Metriplectic + ?Sized> Metriplectic for Verified<'_, Y> {
    parts_of!(self.system: Y {
        manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation, energy: Energy, entropy: Entropy,
        invariants: Invariants,
    });

    fn second_law(&self) -> SecondLaw {
        self.system.second_law()
    }

    fn is_verified(&self) -> bool {
        true
    }
}
