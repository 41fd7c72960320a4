//! The residuals `R_i = Y_i − h V_i` of a step with stages, along its unknowns.

use nalgebra::{DMatrix, DVector};

use super::super::super::error::Unlinearised;
use super::along::{Around, Number};
use super::heat::Heating;
use super::law::LawAlong;
use super::stage::{Flat, Stage};

/// The derivatives of a step at its root.
pub(super) struct Derivatives {
    /// Of the residuals, one stage after another.
    pub(super) residual: DMatrix<f64>,
    /// Of the entropy that is produced.
    pub(super) produced: DVector<f64>,
}

/// The derivatives of a step.
pub(super) fn derivatives(around: &Around<'_>) -> Result<Derivatives, Unlinearised> {
    let &Around { ref parts, tableau, .. } = around;
    let (n, columns, s) = (around.n(), around.columns(), tableau.stages);
    let laws = parts.each_law(|law| LawAlong::of(around, law));
    let listed = || [&laws.energy, &laws.entropy].into_iter().chain(&laws.invariants);
    if !listed().all(LawAlong::is_finite) {
        return Err(Unlinearised::NotSmooth);
    }
    let flat = Flat::of(around);
    let is_corrected = (around.still().is_none(), around.still().is_none() && parts.is_exact);
    let one = DMatrix::identity(n, n);
    let mut stages: Vec<Stage> = (0..s)
        .map(|i| {
            let mut w = laws.map(|law| law.covectors[i].clone());
            if is_corrected.0 {
                w.energy.add_times(&flat.share(&laws.energy.lost), &flat.flat[i]);
            }
            if is_corrected.1 {
                w.entropy.add_times(&flat.share(&laws.entropy.lost), &flat.flat[i]);
            }
            for (w, law) in w.invariants.iter_mut().zip(&laws.invariants) {
                w.add_times(&flat.share(&law.lost), &flat.flat[i]);
            }
            let c = &tableau.matrix[i];
            Stage { place: around.state(c), moved: around.spread((1.0, c), &one), w }
        })
        .collect();
    let mut heat = None;
    if let Some(still) = around.still() {
        let lost = [&laws.energy.lost, &laws.entropy.lost];
        heat = Some(Heating { around, still, flat: &flat, lost }.add(&mut stages)?);
    }
    let size = around.size();
    let mut produced = heat.as_ref().map_or_else(|| Number::zero(columns), |h| h.gain.clone());
    let mut residual = DMatrix::zeros(s * n, columns);
    for (i, stage) in stages.iter().enumerate() {
        let [velocity, friction] = stage.velocity(around)?;
        let mut off = around.displacement(i);
        off.add_times(&size.scaled(-1.0), &velocity);
        if let Some(heat) = &heat {
            off.add(-1.0, &heat.displacements[i]);
        }
        let growth = size.times(&stage.w.entropy.dot(&friction));
        produced = Number::sum([1.0, tableau.weights[i]], [&produced, &growth]);
        residual.rows_mut(i * n, n).copy_from(&off.slope);
    }
    Ok(Derivatives { residual, produced: produced.row })
}
