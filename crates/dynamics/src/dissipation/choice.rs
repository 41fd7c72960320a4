//! The dissipation of a system in the making.

use super::{MetricDissipation, NoDissipation};

/// The dissipation that a [`SystemBuilder`](crate::SystemBuilder) holds: none yet, the dissipation of the
/// metric once there is an entropy, none once there is a force, or one that was [`Given`].
pub trait Choice {
    /// The dissipation that the system will have.
    type Dissipation;
    /// The choice once there is an entropy.
    type WithEntropy;

    /// The choice once there is a force, which produces the entropy in place of the metric.
    type WithForce;

    /// The choice once there is an entropy.
    fn with_entropy(self) -> Self::WithEntropy;

    /// The choice once there is a force.
    fn with_force(self) -> Self::WithForce;

    /// The dissipation that the system will have.
    fn chosen(self) -> Self::Dissipation;
}

/// A dissipation that was given. An entropy or a force, before or after, does not change it.
#[derive(Clone, Copy, Debug)]
pub struct Given<K>(pub(crate) K);

impl Choice for NoDissipation {
    type Dissipation = Self;
    type WithEntropy = MetricDissipation;
    type WithForce = Given<Self>;

    fn with_force(self) -> Given<Self> {
        Given(self)
    }

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
    type WithForce = Given<NoDissipation>;

    fn with_force(self) -> Given<NoDissipation> {
        Given(NoDissipation)
    }

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
    type WithForce = Self;

    fn with_force(self) -> Self {
        self
    }

    fn with_entropy(self) -> Self {
        self
    }

    fn chosen(self) -> K {
        self.0
    }
}
