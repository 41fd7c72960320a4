//! Errors of entries that are not a state.

/// A point that is not on the manifold.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PointError {
    /// An entry is NaN or infinite.
    #[error("entry {index} of the point is {value}; every entry must be a finite number")]
    NotFinite {
        /// Which entry.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A list of entries has another length than a point.
    #[error("{found} entries do not make a point, which has {expected}")]
    Length {
        /// How many there are.
        found: usize,
        /// How many a point has.
        expected: usize,
    },
    /// All entries are zero, where only their direction counts.
    #[error("all entries are zero, which have no direction")]
    NoDirection,
    /// The point is not in the domain of the chart.
    #[error("the point is outside the domain of its chart; start inside")]
    OutsideChart,
    /// The point is too far off the manifold.
    #[error(
        "the point is {defect:.3e} off the manifold ({allowed:.1e} is allowed); project it first"
    )]
    OffManifold {
        /// How far off.
        defect: f64,
        /// How far it may be.
        allowed: f64,
    },
}

crate::debug_is_the_sentence!(PointError);
