//! Methods that are compiled with the library.

use std::any::Any;

use metriplectic_equations::Path;

use crate::newton::Newton;

/// The discrete gradients of this library.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GradientKind {
    /// [`Gonzalez`](crate::Gonzalez).
    Gonzalez,
    /// [`MeanValue`](crate::MeanValue).
    MeanValue,
    /// [`ItohAbe`](crate::ItohAbe).
    ItohAbe,
    /// [`SymmetricItohAbe`](crate::SymmetricItohAbe).
    SymmetricItohAbe,
}

/// A method with its options, whose steps in plain numbers are compiled with the library.
#[derive(Clone, Copy, Debug)]
#[doc(hidden)]
#[non_exhaustive]
pub enum Compiled {
    /// An explicit method, by its [`Tableau`](crate::Tableau), which this module does not know.
    Explicit(&'static (dyn Any + Send + Sync)),
    /// A scheme.
    Midpoint {
        /// Its name in a checkpoint.
        name: fn() -> String,
        /// The path and the discrete gradient.
        line: PathOfStep,
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

/// The step of a scheme: the path of a retraction of this library, and a discrete gradient.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathOfStep {
    /// The path: a straight line on a vector space.
    pub path: Path,
    /// The discrete gradient.
    pub gradient: GradientKind,
}

/// Calls a macro with the directions and the entries with which explicit methods are compiled with the library.
macro_rules! explicit_lengths {
    ($with:ident) => {
        $with!((2, 2)(3, 3)(4, 4)(6, 6)(2, 3)(3, 4)(3, 9)(6, 12))
    };
}
pub(crate) use explicit_lengths;

/// Calls a macro with the numbers of variables with which implicit methods are compiled with the library.
macro_rules! implicit_lengths {
    ($with:ident) => {
        $with!(1 2 3 4)
    };
}
pub(crate) use implicit_lengths;

/// Returns whether explicit methods of so many directions and entries are compiled with the library.
pub(crate) const fn has_explicit(directions: usize, entries: usize) -> bool {
    macro_rules! is_one_of {
        ($(($n:literal, $e:literal))*) => {
            false $(|| directions == $n && entries == $e)*
        };
    }
    explicit_lengths!(is_one_of)
}

/// Returns whether implicit methods of so many variables are compiled with the library.
pub(crate) const fn has_implicit(variables: usize) -> bool {
    macro_rules! is_one_of {
        ($($n:literal)*) => {
            false $(|| variables == $n)*
        };
    }
    implicit_lengths!(is_one_of)
}
