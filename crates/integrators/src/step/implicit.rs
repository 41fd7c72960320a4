//! Implicit methods that are compiled with the library.

use crate::newton::Newton;

/// An implicit method with its options, whose steps in plain numbers are compiled with the library.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
#[non_exhaustive]
pub enum Implicit {
    /// The scheme of the Weyl midpoint with the discrete gradient of Gonzalez.
    Midpoint {
        /// Solves the equation of a step.
        newton: Newton,
        /// How often a step that is not solved is split in halves.
        splits: usize,
    },
    /// A Gauss method.
    Gauss {
        /// Its stages.
        stages: usize,
    },
    /// A Radau method.
    Radau {
        /// Its stages.
        stages: usize,
    },
}

/// The largest number of variables with which implicit methods are compiled with the library.
pub(crate) const COMPILED: usize = 4;
