//! Why no run starts with a tableau.

/// A tableau with which no run starts.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableauError {
    /// There are too many stages.
    #[error(
        "the tableau `{name}` has {found} stages, with the start, the end and those of its dense output; a step has \
         room for {most}"
    )]
    Stages {
        /// The name of the tableau.
        name: &'static str,
        /// How many there are.
        found: usize,
        /// The most that there may be.
        most: usize,
    },
    /// A row names a stage that is not known where the row is used.
    #[error(
        "row {row} of {part} of the tableau `{name}` names stage {stage}; {known} stages are known there"
    )]
    Unknown {
        /// The name of the tableau.
        name: &'static str,
        /// The part of the tableau.
        part: &'static str,
        /// Which row of this part, counted from 0.
        row: usize,
        /// The stage that it names.
        stage: usize,
        /// How many are known, counted from stage 0.
        known: usize,
    },
    /// The weights do not have the order of the method.
    #[error(
        "the tableau `{name}` misses a condition of order {order} by {off:.1e}, relative to its terms; \
         look for a wrong weight with `laws::tableau`"
    )]
    Order {
        /// The name of the tableau.
        name: &'static str,
        /// The order that it was given.
        order: u32,
        /// The largest residual of a condition, relative to its terms.
        off: f64,
    },
    /// The row of an error does not vanish up to its order.
    #[error(
        "row {which} for the error of the tableau `{name}` misses a condition of order {order} by {off:.1e}, relative to \
         its terms; look for a wrong weight with `laws::tableau`"
    )]
    Error {
        /// The name of the tableau.
        name: &'static str,
        /// Which of the two errors, counted from 0.
        which: usize,
        /// The order that it was given.
        order: u32,
        /// The largest residual of a condition, relative to its terms.
        off: f64,
    },
    /// The row of an error vanishes in the order above its own too, as a row of zeros does: steps would follow nothing.
    #[error(
        "row {which} for the error of the tableau `{name}` vanishes above its order {order} too, so that it estimates \
         nothing; write the weights of the end less those of a method of order {order}"
    )]
    NothingEstimated {
        /// The name of the tableau.
        name: &'static str,
        /// Which of the two errors, counted from 0.
        which: usize,
        /// The order that it was given.
        order: u32,
    },
    /// The rows of the dense output miss the order of the method less one.
    #[error(
        "the dense output of the tableau `{name}` misses a condition of order {order} by {off:.1e}, relative to its terms; \
         look for a wrong weight with `laws::tableau`, or leave it out"
    )]
    Dense {
        /// The name of the tableau.
        name: &'static str,
        /// The order of the method less one.
        order: u32,
        /// The largest residual of a condition, relative to its terms.
        off: f64,
    },
    /// The steps are to follow a tolerance, and nothing estimates their error.
    #[error(
        "the steps follow a tolerance, and the tableau `{name}` of order {order} has no row for their error; give it one \
         by `Tableau::error`, or take steps of one size"
    )]
    NoError {
        /// The name of the tableau.
        name: &'static str,
        /// Its order.
        order: u32,
    },
}

metriplectic_equations::debug_is_the_sentence!(TableauError);
