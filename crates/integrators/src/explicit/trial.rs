//! A step that is tried, and one that was taken.

use super::flow::StageFlow;
use super::tableau::Tableau;
use crate::step::{StepEnds, StepStart};

/// A step that is tried.
pub(super) struct Trial<'a, F: StageFlow> {
    pub(super) tableau: &'static Tableau,
    pub(super) start: &'a StepStart<'a, F>,
    pub(super) h: f64,
}

/// The coefficients of a method, as far as they are known when it is compiled: it is compiled without the stages of others.
pub(super) trait Kind {
    /// Says whether its stages are those of Chebyshev's recursion.
    const IS_CHEBYSHEV: bool = false;
    /// Says whether its rows may be those of the method of order 8, which are compiled as constants.
    const MAY_BE_EIGHT: bool = false;
    /// Says whether its rows may be those of the method of order 5.
    const MAY_BE_FIVE: bool = false;
}

/// A step that was taken.
pub(super) struct Done<'a, F: StageFlow> {
    pub(super) tableau: &'static Tableau,
    pub(super) ends: &'a StepEnds<'a, F>,
}
