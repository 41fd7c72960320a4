//! The independence of the further invariants from the other fields.
//!
//! Fractions are measured in units of the sizes of the coordinates. The metric of a product of unlike factors adds squares
//! of different units, and a differential that is independent in one unit would be round-off in another.

use metriplectic_fields::Vector;

use super::covectors::{Place, differentials};
use super::plan::ProjectionPlan;
use crate::bracket::Bracket;
use crate::in_numbers::units_at;
use crate::invariants::{Invariants, Kind};
use crate::metriplectic::{Dim, Metriplectic, SecondLaw};
use crate::orthogonal::{InUnits, Orthogonal};

/// Computes for each further invariant the smallest fraction of its differential at `x` that is independent of
/// the differentials of the other fields in its projections.
pub fn independence<Y: Metriplectic + ?Sized>(system: &Y, x: &Place<Y, f64>) -> Vec<f64> {
    // A constant, so that nothing is compiled for a system without further invariants.
    if const { Y::Invariants::COUNT == 0 } {
        return Vec::new();
    }
    let (w, g) = (differentials(system, x), in_units(system, x));
    let (mut casimirs, mut all) =
        (Orthogonal::<Dim<Y>>::default(), Orthogonal::<Dim<Y>>::default());
    if system.second_law() == SecondLaw::Exact && !system.bracket().is_zero() {
        casimirs.push(&g, &w.entropy);
    }
    if system.second_law() == SecondLaw::Exact {
        all.push(&g, &w.entropy);
    }
    all.push(&g, &w.energy);
    let listed = w.invariants.as_ref().iter().flatten();
    listed
        .map(|(kind, l)| {
            let among_all = all.push(&g, l);
            match kind {
                Kind::Casimir => casimirs.push(&g, l).min(among_all),
                Kind::Momentum => among_all,
            }
        })
        .collect()
}

/// Computes for each further invariant the smallest independent fraction of its differential at `x` in a
/// projection of a step. A Casimir is projected beside the entropy and the Casimirs before it. A momentum is
/// projected beside these, the energy and the momenta before it. Both are projected beside the energy and the
/// list before them.
///
/// [`independence`] also includes fractions beside the entropy *and* the energy. These vanish at every
/// equilibrium without an effect on a step.
pub fn projected_fractions<Y: Metriplectic + ?Sized>(system: &Y, x: &Place<Y, f64>) -> Vec<f64> {
    // A constant, so that nothing is compiled for a system without further invariants.
    if const { Y::Invariants::COUNT == 0 } {
        return Vec::new();
    }
    let (w, g) = (differentials(system, x), in_units(system, x));
    let mut bracket = Orthogonal::<Dim<Y>>::default();
    if ProjectionPlan::of(system, &w).entropy {
        bracket.push(&g, &w.entropy);
    }
    let casimirs: Vec<f64> = w.of_kind(Kind::Casimir).map(|c| bracket.push(&g, c)).collect();
    bracket.push(&g, &w.energy);
    let momenta: Vec<f64> = w.of_kind(Kind::Momentum).map(|j| bracket.push(&g, j)).collect();
    let (mut casimirs, mut momenta) = (casimirs.into_iter(), momenta.into_iter());

    let mut friction = Orthogonal::<Dim<Y>>::default();
    friction.push(&g, &w.energy);
    let listed = w.invariants.as_ref().iter().flatten();
    listed
        .map(|(kind, l)| {
            let in_bracket = match kind {
                Kind::Casimir => casimirs.next(),
                Kind::Momentum => momenta.next(),
            };
            let in_friction = friction.push(&g, l);
            in_bracket.map_or(in_friction, |fraction| fraction.min(in_friction))
        })
        .collect()
}

/// The sizes of the coordinates at `x` as units.
fn in_units<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Place<Y, f64>,
) -> InUnits<Vector<Y::Manifold>> {
    InUnits(units_at::<Y>(system, &x.point()))
}
