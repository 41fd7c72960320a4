//! A run between two steps, as it is saved.

use crate::run::certificate::Certificate;
use crate::run::event::LastNumber;
use crate::run::progress::Progress;
use crate::step::Saved;
use crate::step::exact::Exact;

#[cfg(feature = "serde")]
use crate::step::exact;

/// A run between two steps, but for its system and the options of its method.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(super) struct SavedRun {
    /// The name of the method.
    pub(super) method: String,
    pub(super) step: usize,
    pub(super) time: Exact,
    pub(super) point: Vec<Exact>,
    /// The velocity there; empty where it cannot be evaluated.
    pub(super) velocity: Vec<Exact>,
    pub(super) energy: Exact,
    pub(super) entropy: Exact,
    /// The entropy after the last step that dissipated.
    pub(super) kept_entropy: Exact,
    pub(super) invariants: Vec<Exact>,
    pub(super) memory: Saved,
    pub(super) events: Vec<LastNumber>,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(super) balance: Certificate,
    pub(super) progress: Progress<Vec<Exact>>,
}

impl SavedRun {
    pub(super) fn point(&self) -> impl Iterator<Item = f64> {
        self.point.iter().map(|x| x.0)
    }
}
