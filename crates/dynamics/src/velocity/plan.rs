//! The covectors that the bracket is made to annihilate, and where their projections fade out.

use std::fmt::Debug;

use super::covectors::Covectors;
use crate::bracket::Bracket;
use crate::invariants::{Invariants, Kind};
use crate::metriplectic::{CountOf, Metriplectic, SecondLaw};

/// The independent fraction `σ = μ` of a Casimir's covector at which its projection in `Π̃` has half its weight,
/// `1/(1 + (μ/σ)⁴)`.
///
/// Where the Casimir depends on the entropy or on the Casimirs before it, `σ = 0`, the projection jumps. A
/// discrete gradient differs from a differential by `O(h²)`, so a fraction below that is an error of the
/// discretisation: its direction is arbitrary, and the equation of a step is then stiff in it. `μ = 10⁻⁶` is
/// too small for the quartic Casimir of so(5)* at `h = 0.2`. Without its projection a Casimir changes by
/// less than `μ|dC||v|` per unit of time.
pub const CASIMIR: f64 = 1e-4;

/// The bound for a momentum. Near a relative equilibrium it is a function of the other fields to first order,
/// so a step that conserves these changes it by no more than the order of `h³σ`.
pub const MOMENTUM: f64 = 1e-6;

/// Which covectors the bracket is made to annihilate.
pub(super) struct ProjectionPlan {
    /// Whether it annihilates the covector of the entropy.
    pub(super) entropy: bool,
    /// Whether it must be projected for this, or for the covectors of the Casimirs.
    pub(super) projected: bool,
    /// Whether there are momenta.
    pub(super) momenta: bool,
}

impl ProjectionPlan {
    #[inline]
    pub(super) fn of<Y, V>(system: &Y, w: &Covectors<CountOf<Y>, V>) -> Self
    where
        Y: Metriplectic + ?Sized,
        V: Copy + Debug + Send + Sync,
    {
        let entropy = system.second_law() == SecondLaw::Exact;
        let moves = !system.bracket().is_zero();
        let already = system.bracket().annihilates_entropy();
        let has = |kind| if const { Y::Invariants::COUNT > 0 } { w.has(kind) } else { false };
        let projected = moves && (entropy && !already || has(Kind::Casimir));
        Self { entropy, projected, momenta: moves && has(Kind::Momentum) }
    }
}
