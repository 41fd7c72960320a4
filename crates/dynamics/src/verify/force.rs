//! The laws of a force: it does no work, and produces the entropy whose growth is promised.

use metriplectic_fields::{ChartPoint, Column, Dimension, Square, Vector};

use super::balance::{self, worse};
use super::findings::Findings;
use super::place::{Place, unusable};
use super::table::components;
use crate::bracket::Bracket;
use crate::metriplectic::{Dim, Metriplectic, SecondLaw};
use crate::model_error::ModelError;
use crate::velocity::differentials;

/// Checks that `⟨w, f(w)⟩ = 0` for `dH` and for the discrete gradient `w`, and that `⟨dS, f⟩ ≥ 0` at the point
/// and on a step from it.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    w: Option<&Vector<Y::Manifold>>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref energy, ref entropy } = place;
    if !system.bracket().is_forced() {
        return Ok(());
    }
    let metric = unusable::<Y::Manifold>(x);
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&centre);
    let args = system.bracket_args(&g, &entropy.df);
    let jet = system.bracket().linearise_force(&args, &energy.df).map_err(&metric)?;
    let derivatives = jet.along_z.max_abs() + jet.along_s.max_abs() + jet.tensor.max_abs();
    if !derivatives.is_finite() {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "force", point });
    }
    let sizes = components(units);
    let pairing = |alpha: &Vector<Y::Manifold>, v: &Vector<Y::Manifold>| {
        balance::pairing(&components(alpha), &components(v), &sizes)
    };
    for w in [Some(&energy.df), w].into_iter().flatten() {
        let force = system.bracket().force(&args, w).map_err(&metric)?;
        let size = pairing(w, &force);
        let error = |point, size| ModelError::ForceDoesWork { point, size };
        findings.note("⟨dH, force⟩ = 0", size, error);
    }
    if system.second_law() == SecondLaw::Exact {
        let here = [energy.df, entropy.df];
        let terms = jet.tensor.abs() * energy.df.abs();
        for [w, s] in [here].into_iter().chain(covectors_of_a_step(place, &terms)) {
            let force =
                system.bracket().force(&system.bracket_args(&g, &s), &w).map_err(&metric)?;
            let falls = s.dot(&force) < 0.0;
            let size = if falls { pairing(&s, &force) } else { 0.0 };
            let error = |point, size| ModelError::ForceDestroysEntropy { point, size };
            findings.note("⟨dS, force⟩ ≥ 0", worse(0.0, size), error);
        }
    }
    Ok(())
}

/// The fraction of the size of a coordinate by which the terms of the velocity move it in
/// [`covectors_of_a_step`].
const STEP: f64 = 0.1;

/// The mean differentials of energy and entropy along a step around the point, by Simpson's rule: the
/// covectors that a scheme has there, up to its order. `force` are the absolute terms of the force.
fn covectors_of_a_step<Y: Metriplectic + ?Sized>(
    &Place { system, x, units, .. }: &Place<'_, Y>,
    force: &Vector<Y::Manifold>,
) -> Option<[Vector<Y::Manifold>; 2]> {
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let w = differentials(system, &centre);
    let g = system.metric_at(&centre);
    let tensor = system.bracket().tensor(&system.bracket_args(&g, &w.entropy)).ok()?;
    let terms = tensor.abs() * w.energy.abs() + *force;
    let rate = (0..Dim::<Y>::LEN).map(|i| terms[i] / units[i]).fold(0.0, f64::max);
    let half = system.velocity(&centre).ok()? * (0.5 * STEP / rate);
    let end = |q| differentials(system, &ChartPoint::<Y::Manifold> { base: x.clone(), q });
    let (before, after) = (end(-half), end(half));
    let mean = |a, b, c| (a + b * 4.0 + c) * (1.0 / 6.0);
    let means: [Vector<Y::Manifold>; 2] = [
        mean(before.energy, w.energy, after.energy),
        mean(before.entropy, w.entropy, after.entropy),
    ];
    // A step may lead out of the domain of the model.
    means.iter().all(Column::is_finite).then_some(means)
}
