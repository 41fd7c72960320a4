//! The laws of the dissipation.

use metriplectic_fields::{ChartPoint, Square, Vector};

use super::balance::{self, ROUNDING};
use super::findings::Findings;
use super::place::{Place, unusable};
use super::table::{Table, components};
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
    let size = balance::product(&tensor, &components(&energy.df), &units);
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
