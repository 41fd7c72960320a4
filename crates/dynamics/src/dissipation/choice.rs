//! The dissipation of a system in the making.

use super::{MetricDissipation, NoDissipation};

/// What a [`SystemBuilder`](crate::SystemBuilder) holds for a dissipation: none yet, that of the
/// metric since there is an entropy, or one that was [`Given`] and stays.
pub trait Choice {
    /// The dissipation that the system will have.
    type Dissipation;
    /// The choice once there is an entropy.
    type WithEntropy;

    /// The choice once there is an entropy.
    fn with_entropy(self) -> Self::WithEntropy;

    /// The dissipation that the system will have.
    fn chosen(self) -> Self::Dissipation;
}

/// A dissipation that was given, whatever is said of the entropy before or after.
#[derive(Clone, Copy, Debug)]
pub struct Given<K>(pub(crate) K);

impl Choice for NoDissipation {
    type Dissipation = Self;
    type WithEntropy = MetricDissipation;

    fn with_entropy(self) -> MetricDissipation {
        MetricDissipation
    }

    fn chosen(self) -> Self {
        self
    }
}

impl Choice for MetricDissipation {
    type Dissipation = Self;
    type WithEntropy = Self;

    fn with_entropy(self) -> Self {
        self
    }

    fn chosen(self) -> Self {
        self
    }
}

impl<K> Choice for Given<K> {
    type Dissipation = K;
    type WithEntropy = Self;

    fn with_entropy(self) -> Self {
        self
    }

    fn chosen(self) -> K {
        self.0
    }
}
