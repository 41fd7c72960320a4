//! Where a run is on its schedule: what its next step depends on beside the state and the memory of the method.

use crate::run::controller::{Pace, StepSize};
use crate::run::corners::Corners;
use crate::run::direction::direction;
use crate::run::ending::Ending;
use crate::run::judged::Judged;
use crate::step::{Scales, Vector};

#[cfg(feature = "serde")]
use crate::step::exact;

/// Where a run is on its schedule.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Progress<V> {
    pub(crate) step_size: StepSize<V>,
    /// The time at which the run started.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) start: f64,
    /// Whether it goes back in time; steps of one size are then negative.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) backward: bool,
    pub(crate) count: Option<usize>,
    pub(crate) every: usize,
    /// The most states to record.
    pub(crate) most: Option<usize>,
    /// The sizes of the entries so far, where errors or rest are judged by them.
    pub(crate) scales: Scales<V>,
    /// The sizes at the start and those reached, where errors are judged by them.
    pub(crate) judged: Option<Judged<V>>,
    /// The times across which no step goes.
    pub(crate) corners: Corners,
    /// The tolerance of rest.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) rest: Option<f64>,
    /// The largest velocity of each entry so far, where rest is looked for.
    pub(crate) largest_velocity: V,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) ending: Option<Ending>,
}

impl<V> Progress<V> {
    /// Whether errors or rest are judged by the sizes of the entries.
    pub(crate) const fn judges_sizes(&self) -> bool {
        self.rest.is_some() || matches!(self.step_size, StepSize::Adaptive(_))
    }

    /// Converts the numbers of the entries to another form; they are told apart by their names.
    pub(crate) fn convert<W, E>(
        &self,
        convert: impl Fn(&'static str, &V) -> Result<W, E>,
    ) -> Result<Progress<W>, E> {
        let Self { start, backward, count, every, most, rest, ending, .. } = *self;
        let step_size = self.step_size.convert(&convert)?;
        let scales = Scales {
            sizes: convert("sizes of the entries", &self.scales.sizes)?,
            terms: convert("sizes of the terms", &self.scales.terms)?,
        };
        let judged = self.judged.as_ref().map(|Judged { first, reached }| {
            let [first, reached] = [first, reached].map(|v| convert("sizes at the start", v));
            Ok(Judged { first: first?, reached: reached? })
        });
        let judged = judged.transpose()?;
        let largest_velocity = convert("largest velocities", &self.largest_velocity)?;
        Ok(Progress {
            step_size,
            start,
            backward,
            count,
            every,
            most,
            scales,
            judged,
            corners: self.corners.clone(),
            rest,
            largest_velocity,
            ending,
        })
    }

    /// Sets the sizes of the steps that follow a tolerance.
    pub(crate) const fn set_pace(&mut self, pace: Pace) {
        if let StepSize::Adaptive(controller) = &mut self.step_size {
            controller.pace = pace;
        }
    }

    /// The sign of the time of the run, and of its steps.
    pub(crate) const fn direction(&self) -> f64 {
        direction(self.backward)
    }

    /// When the run ends; in a run without an end, when the next step from `time` does.
    pub(crate) fn next_end(&self, time: f64) -> f64 {
        match &self.step_size {
            StepSize::Fixed(h) if self.count.is_none() => time + h,
            _ => self.end(),
        }
    }

    /// When the run ends; infinite if it does not.
    pub(crate) fn end(&self) -> f64 {
        match &self.step_size {
            StepSize::Fixed(h) => {
                let never = h.signum() * f64::INFINITY;
                self.count.map_or(never, |count| self.start + count as f64 * h)
            }
            StepSize::Adaptive(controller) => controller.pace.end,
        }
    }
}

impl<V: Vector> Progress<V> {
    /// The error that is allowed in a step of size `h`, with entries of their sizes so far or of these; none in steps of one
    /// size.
    pub(crate) fn allowed(&self, relative_error: f64, sizes: Option<&V>, h: f64) -> V {
        let Scales { sizes: so_far, terms } = &self.scales;
        match &self.step_size {
            StepSize::Adaptive(controller) => {
                controller.allowed_at(relative_error, [sizes.unwrap_or(so_far), terms], h)
            }
            StepSize::Fixed(_) => so_far.zero(),
        }
    }
}
