//! The laws of a force: it does no work, and produces the entropy whose growth is promised.

use super::at::{Place, all_finite, dot};
use super::balance::{self, worse};
use super::findings::Findings;
use super::table::{Row, zeros};
use crate::{Covectors, ENERGY, ENTROPY, ModelError, Part, SecondLaw};

/// Checks that `⟨w, f(w)⟩ = 0` for `dH` and for the discrete gradient `w`, and that `⟨dS, f⟩ ≥ 0` at the state
/// and on a step from it.
pub(super) fn examine(
    place: &Place<'_>,
    w: Option<&[f64]>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { at, units, ref energy, ref entropy } = place;
    if at.model.is_zero(Part::Gyroscopic) {
        return Ok(());
    }
    let here = place.differentials();
    let jet = at.linearise(Part::Gyroscopic, here, &energy.df);
    let jet = jet.map_err(|source| at.unusable(source))?;
    let derivatives = jet.along_x.max_abs() + jet.along_w.max_abs() + jet.tensor.max_abs();
    if !derivatives.is_finite() {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "force", point });
    }
    let force = |w: Covectors<'_>| {
        at.apply(Part::Gyroscopic, w, w.energy).map_err(|source| at.unusable(source))
    };
    for w in [Some(&energy.df[..]), w].into_iter().flatten() {
        let size = balance::pairing(w, &force(Covectors { energy: w, ..here })?, units);
        let error = |point, size| ModelError::ForceDoesWork { point, size };
        findings.note("⟨dH, force⟩ = 0", size, error);
    }
    if at.model.second_law() == SecondLaw::Exact {
        let sizes: Row = energy.df.iter().map(|w| w.abs()).collect();
        let terms: Row = (0..sizes.len())
            .map(|i| (0..sizes.len()).map(|j| jet.tensor[(i, j)].abs() * sizes[j]).sum())
            .collect();
        let differentials = [energy.df.clone(), entropy.df.clone()];
        for [w, s] in [differentials].into_iter().chain(covectors_of_a_step(place, &terms)) {
            let force = force(Covectors { energy: &w, entropy: &s })?;
            let falls = dot(&s, &force) < 0.0;
            let size = if falls { balance::pairing(&s, &force, units) } else { 0.0 };
            let error = |point, size| ModelError::ForceDestroysEntropy { point, size };
            findings.note("⟨dS, force⟩ ≥ 0", worse(0.0, size), error);
        }
    }
    Ok(())
}

/// The fraction of the size of a coordinate by which the terms of the velocity move it in
/// [`covectors_of_a_step`].
const STEP: f64 = 0.1;

/// The mean differentials of energy and entropy along a step around the state, by Simpson's rule: the
/// covectors that a scheme has there, up to its order. `force` are the absolute terms of the force.
fn covectors_of_a_step(place: &Place<'_>, force: &[f64]) -> Option<[Row; 2]> {
    let &Place { at, units, ref energy, ref entropy } = place;
    let n = units.len();
    let tensor = at.tensor(Part::Reversible, place.differentials()).ok()?;
    let term = |i: usize| {
        let reversible = (0..n).map(|j| tensor[(i, j)].abs() * energy.df[j].abs()).sum::<f64>();
        (reversible + force[i]) / units[i]
    };
    let rate = (0..n).map(term).fold(0.0, f64::max);
    let mut velocity = zeros(n);
    at.model.velocity(at.t, at.x, &mut velocity)?;
    let factor = 0.5 * STEP / rate;
    let means = [(ENERGY, energy), (ENTROPY, entropy)].map(|(law, here)| {
        let end = |sign: f64| {
            let q: Row = velocity.iter().map(|v| v * factor * sign).collect();
            let mut df = zeros(n);
            at.model.differential_at(law, at.t, at.x, &q, &mut df);
            df
        };
        let (before, after) = (end(-1.0), end(1.0));
        (0..n).map(|i| (before[i] + here.df[i] * 4.0 + after[i]) * (1.0 / 6.0)).collect::<Row>()
    });
    // A step may lead out of the domain of the model.
    means.iter().all(|mean| all_finite(mean)).then_some(means)
}
