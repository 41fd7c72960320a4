//! The laws of the dissipation.

use metriplectic_fields::{ChartPoint, Column, ScalarField, Space, Square, Vector};

use super::balance::{self, ROUNDING, TOLERANCE};
use super::findings::Findings;
use super::place::{At, Place, unusable};
use super::table::{Table, components, pairs};
use crate::dissipation::Dissipation;
use crate::metriplectic::Metriplectic;
use crate::model_error::ModelError;

/// Checks that `K` is symmetric and positive semidefinite, and that it annihilates `dH` and the discrete
/// gradient `w`.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    w: Option<&Vector<Y::Manifold>>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref energy, ref entropy } = place;
    if system.dissipation().is_none() {
        return Ok(());
    }
    let metric = unusable::<Y::Manifold>(x);
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let (k, g) = (system.dissipation(), system.metric_at(&centre));
    let jet = k.linearise(&g, &energy.df, &entropy.df).map_err(&metric)?;
    if !(jet.along_z.max_abs() + jet.along_w.max_abs()).is_finite() {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "dissipation", point });
    }
    let tensor = k.tensor(&g, &energy.df).map_err(&metric)?;
    let (tensor, units) = (Table::of(&tensor), components(units));
    let size = balance::asymmetry(&tensor, 1.0, &units, ROUNDING).relative();
    findings
        .note("Kᵀ = K", size, |point, size| ModelError::DissipationNotSymmetric { point, size });
    let size = balance::indefiniteness(&tensor, &units);
    findings
        .note("K ⪰ 0", size, |point, size| ModelError::DissipationNotPositive { point, size });
    let size = annihilated(place, &tensor, &energy.df);
    findings.note("K dH = 0", size, |point, size| ModelError::EnergyNotKept { point, size });
    if let Some(w) = w {
        let tensor = k.tensor(&g, w).map_err(&metric)?;
        if tensor.max_abs().is_finite() {
            let size = balance::product(&Table::of(&tensor), &components(w), &units);
            let error = |point, size| ModelError::CovectorNotAnnihilated { point, size };
            findings.note("K_w w = 0", size, error);
        }
    }
    Ok(())
}

/// Measures the largest relative size of a row of `K α`, which should vanish.
///
/// A dissipation such as `b bᵀ`, `b = dH × p`, is small beside its terms where it hardly acts: near an equilibrium, or
/// everywhere. It has lost digits there. So a row that seems not to vanish is judged again with the round-off of `K`.
pub(super) fn annihilated<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    k: &Table,
    alpha: &Vector<Y::Manifold>,
) -> f64 {
    let size = balance::product(k, &components(alpha), &components(place.units));
    if size <= TOLERANCE { size } else { beside_round_off(place.at(), k, alpha) }
}

/// Measures the largest relative size of a row of `K α` beside the round-off of `K`.
pub(super) fn beside_round_off<Y: Metriplectic + ?Sized>(
    at: At<'_, Y>,
    k: &Table,
    alpha: &Vector<Y::Manifold>,
) -> f64 {
    let (alpha, units) = (components(alpha), components(at.units));
    balance::product_rounded(k, Some(&rounding(at, k)), &alpha, &units)
}

/// Returns whether `K` at a place is round-off in every entry, so that its quotients say nothing of its derivatives.
pub(super) fn is_round_off<Y: Metriplectic + ?Sized>(place: &Place<'_, Y>) -> bool {
    let centre = ChartPoint::<Y::Manifold>::centre(place.x);
    let g = place.system.metric_at(&centre);
    let Ok(k) = place.system.dissipation().tensor(&g, &place.energy.df) else { return false };
    let k = Table::of(&k);
    let rounding = rounding(place.at(), &k);
    pairs(k.len()).all(|ij| k[ij].abs() <= ROUNDED * rounding[ij])
}

/// A few states may show less than the round-off by this factor.
const ROUNDED: f64 = 16.0;

/// How far the state is moved to see the round-off of a tensor, relative to the sizes of the coordinates.
const MOVED: f64 = 16.0 * f64::EPSILON;

/// The number of states that show the round-off of a tensor.
const STATES: usize = 4;

/// The round-off of the entries of `K`: their changes where each coordinate moves by some `ε` of its size.
fn rounding<Y: Metriplectic + ?Sized>(at: At<'_, Y>, k: &Table) -> Table {
    let n = k.len();
    let changes = (0..STATES).filter_map(|state| {
        let q = Vector::<Y::Manifold>::from_index(|i| {
            // Every state has other signs: those of the binary digits of its number, shifted along the axes.
            let sign = if (state >> (i % 2)) & 1 == 0 { 1.0 } else { -1.0 };
            sign * MOVED * at.units[i] / (1 + i % 3) as f64
        });
        let y = Y::Manifold::chart(at.x, &q);
        let centre = ChartPoint::<Y::Manifold>::centre(&y);
        let dh = at.system.energy().jet1(&y).df;
        let there = at.system.dissipation().tensor(&at.system.metric_at(&centre), &dh).ok()?;
        Some(Table::from_entries(n, |i, j| (there[(i, j)] - k[(i, j)]).abs()))
    });
    let zero = Table::from_entries(n, |_, _| 0.0);
    changes
        .fold(zero, |most, change| Table::from_entries(n, |i, j| most[(i, j)].max(change[(i, j)])))
}
