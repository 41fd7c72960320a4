//! Where an implicit step of a metriplectic system starts.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Dimension, Space};

use super::{Laws, StepStart};

/// The dimension of the manifold of a system.
pub(crate) type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

pub(crate) use metriplectic_dynamics::metriplectic::CountOf;

/// A number for each further invariant of a system.
pub type Numbers<Y> = <CountOf<Y> as Dimension>::Array<f64>;

/// Corrections of the errors of earlier steps: the numbers `φe` in `⟨w, d⟩ = F(x') − F(x) + φe`.
pub(crate) type DriftCorrection<Y> = Laws<Numbers<Y>>;

/// Where an implicit step starts.
#[derive(Debug)]
pub(crate) struct Start<'a, Y: Metriplectic> {
    /// The system.
    pub(crate) system: &'a Y,
    /// The point `x`.
    pub(crate) x: &'a Point<Y>,
    /// The time at which the step starts, for its errors; that of the whole step for a part of it.
    pub(crate) time: f64,
    /// The step size.
    pub(crate) h: f64,
    /// The laws at `x`.
    pub(crate) values: Laws<Numbers<Y>>,
    /// The round-off `H(x) − H(x₀)` that earlier steps have left, and that of the entropy, since
    /// something was dissipated, and of the further invariants.
    pub(crate) accumulated_error: DriftCorrection<Y>,
}

impl<'a, Y: Metriplectic> Start<'a, Y> {
    pub(crate) fn of(
        &StepStart { flow: system, x, time, values, reference, .. }: &StepStart<'a, Y>,
        h: f64,
    ) -> Self {
        let accumulated_error = Self::accumulated([&values, &reference]);
        Self { system, x, time, h, values, accumulated_error }
    }

    /// Returns the round-off that earlier steps have left of the laws, from those at the start of a step and of the run.
    pub(crate) fn accumulated([values, reference]: [&Laws<Numbers<Y>>; 2]) -> DriftCorrection<Y> {
        Laws {
            energy: values.energy - reference.energy,
            entropy: values.entropy - reference.entropy,
            invariants: CountOf::<Y>::array(|k| values.invariants[k] - reference.invariants[k]),
        }
    }
}
