//! The laws of the dissipation.

use metriplectic_fields::{ChartPoint, Square, Vector};

use super::balance::{self, ROUNDING};
use super::findings::Findings;
use super::place::{Place, unusable};
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
    let size = balance::asymmetry::<Y::Manifold>(&tensor, 1.0, units, ROUNDING).relative();
    findings.note("Kᵀ = K", size, |point| ModelError::DissipationNotSymmetric { point, size });
    let size = balance::indefiniteness::<Y::Manifold>(&tensor, units);
    findings.note("K ⪰ 0", size, |point| ModelError::DissipationNotPositive { point, size });
    let size = balance::product::<Y::Manifold>(&tensor, &energy.df, units);
    findings.note("K dH = 0", size, |point| ModelError::EnergyNotKept { point, size });
    if let Some(w) = w {
        let tensor = k.tensor(&g, w).map_err(&metric)?;
        if tensor.max_abs().is_finite() {
            let size = balance::product::<Y::Manifold>(&tensor, w, units);
            findings.note("K_w w = 0", size, |point| ModelError::CovectorNotAnnihilated {
                point,
                size,
            });
        }
    }
    Ok(())
}
