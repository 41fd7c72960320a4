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

/// A step that was taken.
pub(super) struct Done<'a, F: StageFlow> {
    pub(super) tableau: &'static Tableau,
    pub(super) ends: &'a StepEnds<'a, F>,
}
