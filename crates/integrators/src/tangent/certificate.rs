//! The laws of the tangent of a run.

use std::fmt;

use nalgebra::DVector;

use super::columns::{Carried, LawRows, row};
use super::error::Unlinearised;
use crate::round_off::bound::BROKEN;
use crate::step::digits::counted;

/// The laws of a tangent, each as its largest error relative to its terms `Σ_i |∂_iF T_ij|`, over all columns and steps.
///
/// Errors of `ε` times the condition of a step are round-off. They do not follow from the laws of the run, so they
/// judge the tangent by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// Steps with a derivative.
    pub steps: usize,
    /// The largest error of `dH(x_k) T_k = dH(x₀) T_0`.
    pub energy: f64,
    /// The largest error of `dL_a(x_k) T_k = dL_a(x₀) T_0`.
    pub invariants: f64,
    /// The largest error of `dS(x_k) T_k = δ(S₀ + Σ h Σ b_i σ_i)`, for explicit methods. For schemes that of
    /// `dS(x') T' − dS(x) T = δ(h ⟨w_S, K̃ w_S⟩)`, of one column on each step whose number is a power of two. `None` where the method does not
    /// say what it has produced.
    pub entropy: Option<f64>,
    /// Whether the step sizes followed a tolerance, and are frozen.
    pub frozen: bool,
    /// Whether friction is not damped by the steps: `T` is then the derivative of the steps, and not that of the motion.
    pub undamped: bool,
    /// Whether a step of `Radau` or of an explicit method has left the state at rest. Its map has no derivative there, but another slope in
    /// each direction, because it is corrected along differences that vanish there. `T` is then the derivative without the correction, from
    /// which each slope differs by the local error of the method. Steps of a `Scheme` and of `Gauss` have a derivative at rest.
    pub at_rest: bool,
    /// How far the derivatives at the end differ from those of the run with a ten times larger tolerance, or with steps twice as large,
    /// relative to each column: of a [tangent to an accuracy](crate::Tangents::tangent_to).
    pub difference: Option<f64>,
}

impl Sensitivity {
    /// Enters the second law in a step.
    pub(super) fn enter_entropy(&mut self, law: Option<f64>) {
        if let Some(error) = law {
            self.entropy = Some(worse(self.entropy.unwrap_or(0.0), error));
        }
    }

    /// Enters the derivatives at a state with these differentials of its laws and these sizes of its directions. The round-off is
    /// relative to the terms of a law.
    pub(super) fn enter(
        &mut self,
        here: &LawRows<DVector<f64>>,
        scales: &DVector<f64>,
        carried: &Carried,
        rounding: f64,
    ) -> Result<(), Unlinearised> {
        let off = |df: &DVector<f64>, law: &DVector<f64>| {
            let [here, sizes] = row(df, &carried.t);
            let terms = df.abs().dot(scales);
            (0..df.len()).fold(0.0, |worst, j| {
                let (off, size) = ((here[j] - law[j]).abs(), sizes[j] + law[j].abs());
                // The column of a direction on which nothing depends is rounding, relative to a unit of that direction.
                let unit = terms / scales[j];
                let size = if off <= rounding * unit { size.max(unit) } else { size };
                worse(worst, if off == 0.0 { 0.0 } else { off / size })
            })
        };
        let energy = off(&here.energy, &carried.laws.energy);
        let listed = here.invariants.iter().zip(&carried.laws.invariants);
        let invariants = listed.fold(0.0, |worst, (df, law)| worse(worst, off(df, law)));
        let worst = worse(energy, invariants);
        if worst > BROKEN || worst.is_nan() {
            return Err(Unlinearised::LawBroken { off: worst });
        }
        self.steps += 1;
        self.energy = self.energy.max(energy);
        self.invariants = self.invariants.max(invariants);
        if carried.laws.entropy_is_known {
            let entropy = off(&here.entropy, &carried.laws.entropy);
            self.entropy = Some(self.entropy.unwrap_or(0.0).max(entropy));
        }
        Ok(())
    }
}

/// The larger of two numbers, where NaN is the largest.
pub(super) fn worse(old: f64, new: f64) -> f64 {
    if new > old || new.is_nan() { new } else { old }
}

impl fmt::Display for Sensitivity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let steps = counted(self.steps, "step", "steps");
        write!(f, "sensitivity: |dH T − dH₀| ≤ {:.1e} of its terms", self.energy)?;
        if self.invariants > 0.0 {
            write!(f, ", |dL T − dL₀| ≤ {:.1e}", self.invariants)?;
        }
        if let Some(entropy) = self.entropy {
            write!(f, ", |dS T − δS| ≤ {entropy:.1e}")?;
        }
        write!(f, ", over {steps}{}", if self.frozen { ", frozen" } else { "" })?;
        if let Some(difference) = self.difference {
            write!(
                f,
                "\n             and {difference:.1e} of T from that of the next coarser run"
            )?;
        }
        if self.undamped {
            write!(
                f,
                "\n             it is the derivative of the steps, which do not damp the friction, and not that of the motion"
            )?;
        }
        if self.at_rest {
            write!(
                f,
                "\n             these steps have no derivative at rest: it is known there to the local error, and those of `Gauss` have one"
            )?;
        }
        Ok(())
    }
}
