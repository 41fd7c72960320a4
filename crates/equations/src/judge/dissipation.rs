//! The laws of the dissipation.

use super::at::{At, Place};
use super::balance::{self, ROUNDING, TOLERANCE};
use super::findings::Findings;
use super::table::{Row, Table, pairs};
use crate::{Covectors, ENERGY, ModelError, Part};

/// Checks that `K` is symmetric and positive semidefinite, and that it annihilates `dH` and the discrete
/// gradient `w`.
pub(super) fn examine(
    place: &Place<'_>,
    w: Option<&[f64]>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { at, units, ref energy, ref entropy } = place;
    if at.model.is_zero(Part::Irreversible) {
        return Ok(());
    }
    let here = place.differentials();
    let jet = at.linearise(Part::Irreversible, here, &entropy.df);
    let jet = jet.map_err(|source| at.unusable(source))?;
    if !(jet.along_x.max_abs() + jet.along_w.max_abs()).is_finite() {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "dissipation", point });
    }
    let tensor = |w| at.tensor(Part::Irreversible, w).map_err(|source| at.unusable(source));
    let k = tensor(here)?;
    let size = balance::asymmetry(&k, 1.0, units, ROUNDING).relative();
    findings
        .note("Kᵀ = K", size, |point, size| ModelError::DissipationNotSymmetric { point, size });
    let size = balance::indefiniteness(&k, units);
    findings
        .note("K ⪰ 0", size, |point, size| ModelError::DissipationNotPositive { point, size });
    let size = annihilated(place, &k, &energy.df);
    findings.note("K dH = 0", size, |point, size| ModelError::EnergyNotKept { point, size });
    if let Some(w) = w {
        let k = tensor(Covectors { energy: w, ..here })?;
        if k.max_abs().is_finite() {
            let size = balance::product(&k, w, units);
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
pub(super) fn annihilated(place: &Place<'_>, k: &Table, alpha: &[f64]) -> f64 {
    let size = balance::product(k, alpha, place.units);
    if size <= TOLERANCE { size } else { beside_round_off(place.at, place.units, k, alpha) }
}

/// Measures the largest relative size of a row of `K α` beside the round-off of `K`.
pub(super) fn beside_round_off(at: At<'_>, units: &[f64], k: &Table, alpha: &[f64]) -> f64 {
    balance::product_rounded(k, Some(&rounding(at, units, k)), alpha, units)
}

/// Returns whether `K` at a place is round-off in every entry, so that its quotients say nothing of its derivatives.
pub(super) fn is_round_off(place: &Place<'_>) -> bool {
    let Ok(k) = place.at.tensor(Part::Irreversible, place.differentials()) else { return false };
    let rounding = rounding(place.at, place.units, &k);
    pairs(k.len()).all(|ij| k[ij].abs() <= ROUNDED * rounding[ij])
}

/// A few states may show less than the round-off by this factor.
const ROUNDED: f64 = 16.0;

/// How far the state is moved to see the round-off of a tensor, relative to the sizes of the coordinates.
const MOVED: f64 = 16.0 * f64::EPSILON;

/// The number of states that show the round-off of a tensor.
const STATES: usize = 4;

/// The round-off of the entries of `K`: their changes where each coordinate moves by some `ε` of its size.
fn rounding(at: At<'_>, units: &[f64], k: &Table) -> Table {
    let n = k.len();
    let changes = (0..STATES).filter_map(|state| {
        let q = units.iter().enumerate().map(|(i, unit)| {
            // Every state has other signs: those of the binary digits of its number, shifted along the axes.
            let sign = if (state >> (i % 2)) & 1 == 0 { 1.0 } else { -1.0 };
            sign * MOVED * unit / (1 + i % 3) as f64
        });
        let y = at.chart(&q.collect::<Row>());
        let there = at.moved_to(&y);
        let (_, energy) = there.jet(ENERGY);
        // A dissipation does not depend on the covector of the entropy.
        let w = Covectors { energy: &energy, entropy: &energy };
        let there = there.tensor(Part::Irreversible, w).ok()?;
        Some(Table::from_entries(n, |i, j| (there[(i, j)] - k[(i, j)]).abs()))
    });
    changes.fold(Table::zeros(n), |most, change| {
        Table::from_entries(n, |i, j| most[(i, j)].max(change[(i, j)]))
    })
}
