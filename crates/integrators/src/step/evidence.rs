//! Promises of a method, and the evidence and the effort of a step.

use super::LedgerErrors;

/// The laws that hold exactly on every step of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Promises {
    /// The energy is conserved.
    pub energy: bool,
    /// The entropy does not fall.
    pub entropy: bool,
    /// The further invariants are conserved.
    pub invariants: bool,
}

impl Promises {
    /// The energy and the further invariants are conserved, and the entropy does not fall if it is `entropy`
    /// that is promised.
    pub const fn all_laws(entropy: bool) -> Self {
        Self { energy: true, entropy, invariants: true }
    }

    /// Promises no law: the laws hold to the order of the method.
    pub const fn nothing() -> Self {
        Self { energy: false, entropy: false, invariants: false }
    }
}

/// Evidence of a step about the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evidence {
    /// The size `|w_S|` of the discrete gradient of the entropy, by which the bracket is projected;
    /// infinite where it has none.
    pub entropy_slope: f64,
    /// Whether anything was dissipated.
    pub dissipates: bool,
    /// The largest rate `h|K'|` of friction that the step does not damp.
    pub friction: f64,
    /// Whether the state is at rest: the displacement is no more than its own round-off.
    pub rests: bool,
    /// How the entropy at the end was found, by a method that projects onto it.
    pub entropy_step: Option<EntropyStep>,
    /// Whether the size of the step is near the edge of the region of stability of an explicit method.
    pub stability: bool,
    /// The laws in the stages of a method that has them.
    pub stages: Option<StageLaws>,
    /// The size of the shortest part between corners, of a step that a run has taken in parts; infinite for a whole one.
    pub shortest_part: f64,
    /// The estimated errors of what the step has booked; `None` for a closed system, and without an estimate.
    pub ledger: Option<LedgerErrors>,
}

/// The rate `h|K'|` of friction above which a step does not resolve it.
/// A factor of four fails `noise/sampler.rs::few_steps_may_be_too_long_for_friction`.
pub(crate) const RESOLVED: f64 = 1.0;

/// The laws in a step with stages.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StageLaws {
    /// The largest error of the energy and the further invariants in the step, relative to the sizes of their terms,
    /// before the last digits of the end.
    pub defect: f64,
    /// The entropy gained beside the production of friction: zero, but for a method that damps.
    pub surplus: f64,
}

impl StageLaws {
    /// Makes the laws of a step.
    pub(crate) const fn new(defect: f64, surplus: f64) -> Self {
        Self { defect, surplus }
    }

    /// Adds the laws of two parts.
    fn and(self, next: Self) -> Self {
        Self { defect: self.defect.max(next.defect), surplus: self.surplus + next.surplus }
    }
}

/// How a method that projects onto the laws found the entropy at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EntropyStep {
    /// By its production, `S(x') = S(x) + h Σ b_i σ_i`.
    Targeted,
    /// The other laws leave it free: near an equilibrium, where it depends on them.
    Free,
    /// The state was held, because the entropy would have fallen by round-off in any step.
    Held,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            entropy_slope: f64::INFINITY,
            dissipates: false,
            friction: 0.0,
            rests: false,
            entropy_step: None,
            stability: false,
            stages: None,
            shortest_part: f64::INFINITY,
            ledger: None,
        }
    }
}

impl Evidence {
    /// Of two parts of a step: rest is the last one's.
    pub(crate) fn and(self, next: Self) -> Self {
        Self {
            entropy_slope: self.entropy_slope.min(next.entropy_slope),
            dissipates: self.dissipates | next.dissipates,
            friction: self.friction.max(next.friction),
            rests: next.rests,
            entropy_step: next.entropy_step.or(self.entropy_step),
            stability: self.stability | next.stability,
            stages: match (self.stages, next.stages) {
                (Some(a), Some(b)) => Some(a.and(b)),
                (a, b) => a.or(b),
            },
            shortest_part: self.shortest_part.min(next.shortest_part),
            ledger: match (self.ledger, next.ledger) {
                (Some(a), Some(b)) => Some(a.and(b)),
                (a, b) => a.or(b),
            },
        }
    }
}

/// The sites of a large system that set the size of the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LimitingSites {
    /// The site with the largest local error, relative to the error that is allowed.
    pub error: Option<usize>,
    /// The site with the largest part of the direction in which the motion is stiffest.
    pub stiffness: Option<usize>,
}

impl LimitingSites {
    /// These sites, of the error and of the stiffness.
    pub const fn new(error: Option<usize>, stiffness: Option<usize>) -> Self {
        Self { error, stiffness }
    }
}

/// The effort of the solver of a method, in a step or in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Effort {
    /// Linear systems solved by Newton's method.
    pub iterations: usize,
    /// How often a step was approached through smaller ones from the same start.
    pub continued: usize,
    /// How often a step, or a part of it, was split in halves.
    pub splits: usize,
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.iterations += other.iterations;
        self.continued += other.continued;
        self.splits += other.splits;
    }
}
