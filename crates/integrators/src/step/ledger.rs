//! The exchange of an open system, for its certificate.

use std::sync::Arc;

/// The work and the heat of an event that changes the state, into the system, and the entropy that its surroundings gain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct EventExchange {
    /// The work.
    pub work: f64,
    /// The heat.
    pub heat: f64,
    /// The entropy that the surroundings gain, `−Q/T`.
    pub entropy: f64,
}

/// Estimates of how far the entries of a ledger are off: the sums over the steps of the largest error of an entry of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct LedgerErrors {
    /// Of the work of the time, and of that of a port.
    pub work: f64,
    /// Of the heat of a bath.
    pub heat: f64,
    /// Of the entropy that a bath has gained.
    pub entropy: f64,
}

impl LedgerErrors {
    /// Makes these errors of work, heat and entropy.
    #[must_use]
    pub const fn new(work: f64, heat: f64, entropy: f64) -> Self {
        Self { work, heat, entropy }
    }

    /// Adds the errors of two steps.
    #[must_use]
    pub(crate) fn and(self, next: Self) -> Self {
        Self {
            work: self.work + next.work,
            heat: self.heat + next.heat,
            entropy: self.entropy + next.entropy,
        }
    }
}

/// The exchange of an open system since the start of a run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LedgerSummary {
    /// The work of the time in the energy; `None` if the energy does not depend on it.
    pub parameter: Option<f64>,
    /// The work of each port.
    pub work: Vec<(Arc<str>, f64)>,
    /// The heat of each bath.
    pub heat: Vec<(Arc<str>, f64)>,
    /// The entropy of the system alone.
    pub system_entropy: f64,
}

/// Each list as a map from names to numbers.
#[cfg(feature = "serde")]
impl serde::Serialize for LedgerSummary {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct as _;

        struct Map<'a>(&'a [(Arc<str>, f64)]);
        impl serde::Serialize for Map<'_> {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|(name, number)| (&**name, number)))
            }
        }
        let mut summary = serializer.serialize_struct("LedgerSummary", 4)?;
        summary.serialize_field("parameter", &self.parameter)?;
        summary.serialize_field("work", &Map(&self.work))?;
        summary.serialize_field("heat", &Map(&self.heat))?;
        summary.serialize_field("system_entropy", &self.system_entropy)?;
        summary.end()
    }
}
