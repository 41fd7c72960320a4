//! The last step of a run, for what differentiates it.

use crate::run::controller::StepSize;
use crate::run::corners::{Corners, Fixed, Interval};
use crate::run::steps::Steps;
use crate::step::{EntropyStep, Flow, Laws, Memory as _, Saved, Scales, StepStart, Stepper};

/// The last step of a run.
#[derive(Debug)]
pub(crate) struct LastStep<'a, F: Flow + ?Sized> {
    pub(crate) start: StepStart<'a, F>,
    pub(crate) h: f64,
    pub(crate) in_parts: bool,
    pub(crate) entropy_step: Option<EntropyStep>,
    pub(crate) stage_count: Option<u32>,
    pub(crate) stage_velocities: Vec<f64>,
    corners: &'a Corners,
    /// The time at its end.
    end: f64,
    is_of_one_size: bool,
}

impl<F: Flow + ?Sized> LastStep<'_, F> {
    /// The intervals between corners of the step.
    pub(crate) fn intervals(&self) -> Vec<Interval> {
        self.intervals_up_to(self.h, self.end)
    }

    /// The intervals between corners of a step of this size up to a time.
    pub(crate) fn intervals_up_to(&self, h: f64, end: f64) -> Vec<Interval> {
        let (corners, time) = (self.corners, self.start.time);
        if self.is_of_one_size && !corners.is_empty() {
            return corners.intervals(time, Fixed { h, end });
        }
        let (behind, is_corner) = (corners.behind(time), corners.behind(end).is_some());
        vec![Interval { behind, h, recorded: end, is_corner }]
    }

    /// Times before and behind the corner at a time; `None` if there is no corner.
    pub(crate) fn around_corner(&self, time: f64) -> Option<[f64; 2]> {
        self.corners.around(time)
    }

    /// Returns whether a corner lies in the step, or no farther from it than it is long.
    pub(crate) fn is_near_corner(&self) -> bool {
        self.corners.is_near([self.start.time, self.end])
    }
}

impl<'a, F: Flow + ?Sized, M: Stepper<F>> Steps<'a, F, M> {
    /// The system.
    pub(crate) const fn flow(&self) -> &'a F {
        self.flow
    }

    /// The method.
    pub(crate) const fn method(&self) -> &M {
        &self.method
    }

    /// The sizes by which the next step is judged.
    pub(crate) fn scales(&self) -> Scales<F::Vector> {
        self.course.progress.scales.clone()
    }

    /// The memory before the next step, without what the method extrapolates from.
    pub(crate) fn saved_memory(&self) -> Saved {
        let mut saved = Saved::default();
        self.memory.beside().save(&mut saved);
        saved
    }

    /// The sizes that the entries have, or soon have: by the scales of steps that follow a tolerance, and by the motion in all steps of
    /// one size.
    pub(crate) fn known_sizes(&self) -> F::Vector {
        match &self.course.progress.step_size {
            StepSize::Fixed(size) => {
                let span = self.course.progress.count.map_or(*size, |count| count as f64 * size);
                Scales::at(self.flow, &self.course.state.point, Some(span.abs())).sizes
            }
            StepSize::Adaptive(_) => self.scales().sizes,
        }
    }

    /// Returns whether the steps follow a tolerance.
    pub(crate) const fn is_adaptive(&self) -> bool {
        matches!(self.course.progress.step_size, StepSize::Adaptive(_))
    }

    /// The step that the last jump has cut, as it was taken; `None` if there was no jump.
    pub(crate) fn cut_step(&self, scales: &Scales<F::Vector>) -> Option<LastStep<'_, F>> {
        let before = self.course.cut.as_ref()?;
        let allowed = match &self.course.progress.step_size {
            StepSize::Fixed(_) => None,
            StepSize::Adaptive(controller) => {
                Some(controller.allowed(&self.course.rule, scales, before.h))
            }
        };
        let values = before.values.clone();
        // The references of the run are those after the jump.
        let reference = Laws { entropy: before.entropy, ..values.clone() };
        let (x, time) = (&before.state.point, before.state.time);
        Some(LastStep {
            start: StepStart { flow: self.flow, x, time, values, reference, allowed },
            h: before.h,
            in_parts: before.in_parts,
            entropy_step: before.entropy_step,
            stage_count: None,
            stage_velocities: Vec::new(),
            corners: &self.course.progress.corners,
            end: time + before.h,
            is_of_one_size: !self.is_adaptive(),
        })
    }

    /// The last step, with the errors that it was allowed if it was judged by these sizes.
    pub(crate) fn last_step(&self, scales: &Scales<F::Vector>) -> LastStep<'_, F> {
        let before = &self.course.before;
        let allowed = match &self.course.progress.step_size {
            StepSize::Fixed(_) => None,
            StepSize::Adaptive(controller) => {
                Some(controller.allowed(&self.course.rule, scales, before.h))
            }
        };
        let values = before.values.clone();
        let entropy = if self.course.promises.entropy { before.entropy } else { values.entropy };
        let reference: Laws<F::Numbers> = self.course.reference(entropy);
        let (x, time) = (&before.state.point, before.state.time);
        let start = StepStart { flow: self.flow, x, time, values, reference, allowed };
        let entropy_step = before.entropy_step;
        let stage_count = self.memory.stage_count();
        let stage_velocities = self.memory.stage_velocities();
        let (corners, end) = (&self.course.progress.corners, self.course.state.time);
        LastStep {
            start,
            h: before.h,
            in_parts: before.in_parts,
            entropy_step,
            stage_count,
            stage_velocities,
            corners,
            end,
            is_of_one_size: !self.is_adaptive(),
        }
    }
}
