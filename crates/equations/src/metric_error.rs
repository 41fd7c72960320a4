//! A metric that cannot be used.

/// A metric that cannot be used.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// An entry is NaN or infinite.
    #[error(
        "entry ({row}, {column}) of the metric is {value}; every entry must be a finite number"
    )]
    EntryNotFinite {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// Its value.
        value: f64,
    },
    /// A quantity of a metric and of points is NaN, because they are, or beyond the range of
    /// numbers.
    #[error(
        "{quantity} is {value}, which is not a finite number; take finite points, closer together"
    )]
    NotFinite {
        /// The quantity that is not finite.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A point is at or beyond the edge of the chart at another one: on Sⁿ its antipode, on SO(3) half
    /// a turn.
    #[error(
        "the chart at one point does not reach the other, at the coordinate distance {distance}; take \
         a smaller step, or points that are closer together"
    )]
    OutOfChart {
        /// The norm of the coordinates; NaN where there are no coordinates.
        distance: f64,
    },
    /// A metric that is said to be the canonical one has another matrix.
    #[error(
        "the metric is said to be the canonical one, but its entry ({row}, {column}) is {value}"
    )]
    NotCanonical {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// Its value.
        value: f64,
    },
    /// `g ≠ gᵀ`.
    #[error(
        "the metric is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ by {size:.3e}"
    )]
    NotSymmetric {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The difference to its mirror image.
        size: f64,
    },
    /// Not positive definite.
    #[error("the metric is {0}")]
    NotPositive(#[from] NotPositive),
    /// A geodesic leaves the chart: the metric beyond is not a number.
    #[error(
        "the geodesic runs into the edge of the chart at {time:.3} of its way, where the metric is not a \
         finite number; take a smaller step, or a metric in which the edge is far"
    )]
    Edge {
        /// The fraction of the way that was followed.
        time: f64,
    },
    /// A geodesic comes to a place where its metric is not positive.
    #[error(
        "at {time:.3} of the way of a geodesic the metric is {not_positive}; take a smaller step, or \
         leave the place out of the domain"
    )]
    Degenerate {
        /// The fraction of the way that was followed.
        time: f64,
        /// The pivot.
        not_positive: NotPositive,
    },
    /// A geodesic through a metric that varies too much along it.
    #[error(
        "the geodesic was followed for {time:.3} of its way in {pieces} pieces, and the metric is too \
         uneven to go on; take a smaller step, and look for what is not smooth in the metric"
    )]
    Uneven {
        /// The fraction of the way that was followed.
        time: f64,
        /// The pieces that were tried.
        pieces: usize,
    },
    /// No geodesic was found between two points.
    #[error(
        "no geodesic was found to a point at the coordinate distance {distance:.3e}; the best one \
         misses it by {missed_by:.1e}; take points that are closer together"
    )]
    NoLogarithm {
        /// The coordinate distance of the points.
        distance: f64,
        /// How far off the best geodesic ends.
        missed_by: f64,
    },
    /// Two points, or the ends of a step, are so far apart that no shortest geodesic, or more than one shortest
    /// geodesic, joins them.
    #[error(
        "a geodesic of length {length:.6} reaches the cut locus, which starts at {radius:.6}; take a \
         smaller step, or points that are closer together"
    )]
    CutLocus {
        /// The length of the geodesic.
        length: f64,
        /// The injectivity radius.
        radius: f64,
    },
}

crate::debug_is_the_sentence!(MetricError);

/// A matrix that should be positive definite has a pivot that is not.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[error("not positive definite: the Cholesky pivot {index} is {pivot:.3e}")]
pub struct NotPositive {
    /// The row of the failing pivot.
    pub index: usize,
    /// Its value.
    pub pivot: f64,
}

crate::debug_is_the_sentence!(NotPositive);
