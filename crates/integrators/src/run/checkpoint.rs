//! A run that is put down and taken up again.
//!
//! A [`Checkpoint`] holds all that the next steps depend on: the state, what the scheme remembers
//! (the displacements that it extrapolates, the Jacobian that it tries first, the digits that rounding has lost), the sizes of the
//! steps, and the balance so far. A run that is resumed from it takes the same steps as one that was
//! never interrupted, bit for bit.
//!
//! ```
//! # use metriplectic_dynamics::System;
//! # use metriplectic_fields::Real;
//! # use metriplectic_integrators::{Run, Span};
//! # use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! # use nalgebra::Vector3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let body = System::on(LieDual::so3())
//! #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
//! #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//! #     .build()?;
//! # let start = Vector3::new(0.4, 0.5, 0.3);
//! let span = Span::until(20.0).tolerance(1e-5);
//! let mut steps = WeylMidpoint.steps(&body, start, span)?;
//! for _ in 0..100 {
//!     steps.advance()?;
//! }
//! let checkpoint = steps.checkpoint();
//! # #[cfg(feature = "serde")] {
//! let text = serde_json::to_string(&checkpoint)?; // with the feature `serde`
//! # assert_eq!(serde_json::from_str::<metriplectic_integrators::Checkpoint>(&text)?, checkpoint);
//! # }
//!
//! // In another process, perhaps.
//! let resumed = WeylMidpoint.resume(&body, &checkpoint)?.run()?;
//! let whole = WeylMidpoint.run(&body, start, span)?;
//! assert_eq!(resumed.last(), whole.last());
//! assert_eq!(resumed.certificate(), whole.certificate());
//! # Ok(())
//! # }
//! ```
//!
//! The system is not in it, since closures cannot be written down: resume with the same one. Nor are outputs at
//! given times and events: say them again ([`Steps::watching`](crate::Steps::watching)). If the function of an event is
//! not a number there, its last number is in the checkpoint, so that a change of sign across the gap is found. Another system is noticed if its energy, its
//! entropy, a further invariant or its velocity has another value at the point, by more than the round-off of its
//! terms. The model is not verified around the point; it is checked on the way like that of any run.
//!
//! The [name](crate::Stepper::name) of the method is in it, and another method is refused. To the name of a
//! [`Tableau`](crate::Tableau) of your own a digest of its coefficients is added, so that two tableaus of one name are two
//! methods. The options of the method are not in it: they decide how hard a step is tried and not which equation it solves,
//! so a run that failed may go on with more corrections or more splits.
//!
//! A file has a checksum over the bits of all of its numbers. A file with another number is refused
//! ([`ResumeError::Altered`]), and one with other digits of the same number is not.
//!
//! # Going on
//!
//! A run that has reached its end goes on from its last [checkpoint](crate::Trajectory::checkpoint), with a
//! later one:
//!
//! ```
//! # use metriplectic_dynamics::System;
//! # use metriplectic_fields::Real;
//! # use metriplectic_integrators::{Run, Span};
//! # use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! # use nalgebra::Vector3;
//! # fn main() -> Result<(), metriplectic_integrators::Error> {
//! # let body = System::on(LieDual::so3())
//! #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
//! #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//! #     .build()?;
//! # let start = Vector3::new(0.4, 0.5, 0.3);
//! let first = WeylMidpoint.run(&body, start, Span::steps(0.1, 100))?;
//! let later = first.checkpoint().clone().with_steps(300)?;
//! let extended = WeylMidpoint.resume(&body, &later)?.run()?;
//! let whole = WeylMidpoint.run(&body, start, Span::steps(0.1, 300))?;
//! assert_eq!(extended.last(), whole.last());
//! # Ok(())
//! # }
//! ```
//!
//! With steps of one size this is the run that would have gone on, bit for bit. With steps that follow a
//! tolerance ([`Checkpoint::with_end`]) it is this run as long as no step has been shortened to meet the
//! former end, as those at the end are.
//!
//! # Digits
//!
//! In formats for people the numbers are written as strings, `"0.1"`. Some readers of numbers are off
//! by a digit, `serde_json` without its feature `float_roundtrip` among them, and JSON has no
//! infinity; strings are read by the standard library, which is exact.
//!
//! # What "bit for bit" means
//!
//! A run is a sequence of floating-point operations in a fixed order: there are no threads in it, no
//! clock, no random number after verification, and no hash map. So the same program gives the same
//! bits, in every run and in every thread. Between *different* programs this cannot be promised. The
//! functions `sin`, `exp`, `ln` and powers come from the mathematical library of the system, whose last digits differ from
//! one to the next; another compiler, or other options of the same, may fold a constant in
//! another way or contract `a*b + c`; and another processor has another library. There the laws hold all the
//! same, to the same round-off, but the digits of two long runs need not agree.

#[cfg(feature = "serde")]
mod checksum;
mod error;
#[cfg(feature = "serde")]
mod file;
#[cfg(feature = "serde")]
mod forms;
mod resume;
mod saved;
mod validation;

pub use error::ResumeError;
use saved::SavedRun;

use crate::run::controller::StepSize;
use crate::run::ending::Ending;
use crate::run::span_error::{SpanError, check_end, check_steps};

/// Where a run was put down; made by [`Steps::checkpoint`](crate::Steps::checkpoint), taken up by [`Method::resume`](crate::Method::resume).
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint(
    /// The run, or why the file that it was read from cannot be resumed.
    Result<Box<SavedRun>, ResumeError>,
);

/// The version of the format that is written and read. Each change of a field is a new version.
#[cfg(feature = "serde")]
const VERSION: u32 = 10;

impl Checkpoint {
    /// The run that was put down.
    fn run(&self) -> Result<&SavedRun, ResumeError> {
        self.0.as_deref().map_err(Clone::clone)
    }

    /// The name of the method; empty in a file that cannot be resumed.
    pub fn method(&self) -> &str {
        self.0.as_deref().map_or("", |run| &run.method)
    }

    /// The number of steps taken; 0 in a file that cannot be resumed.
    pub fn step(&self) -> usize {
        self.run().map_or(0, |run| run.step)
    }

    /// The time reached; not a number in a file that cannot be resumed.
    pub fn time(&self) -> f64 {
        self.run().map_or(f64::NAN, |run| run.time.0)
    }

    /// The entries of the point reached; none in a file that cannot be resumed.
    pub fn point(&self) -> impl Iterator<Item = f64> {
        self.run().into_iter().flat_map(SavedRun::point)
    }

    /// Changes the number of steps of one size, those taken so far among them: a run that has reached
    /// its end goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::AdaptiveSteps`] if its steps follow a tolerance; [`ResumeError::Span`] if it has taken
    /// as many already, or the end would be too late for a number; [`ResumeError::Version`] and
    /// [`ResumeError::Altered`] of a file.
    pub fn with_steps(self, count: usize) -> Result<Self, ResumeError> {
        let mut run = self.run()?.clone();
        let StepSize::Fixed(h) = run.progress.step_size else {
            return Err(ResumeError::AdaptiveSteps);
        };
        if count <= run.step {
            return Err(SpanError::NoSteps.into());
        }
        check_steps(run.progress.start, h, count)?;
        run.progress.count = Some(count);
        Ok(run.go_on())
    }

    /// Changes the end of a run in steps that follow its tolerance: a run that has reached its end
    /// goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::FixedSteps`] if its steps are of one size; [`ResumeError::Span`] if the end is not
    /// after the time reached; [`ResumeError::Version`] and [`ResumeError::Altered`] of a file.
    pub fn with_end(self, end: f64) -> Result<Self, ResumeError> {
        let mut run = self.run()?.clone();
        let StepSize::Adaptive(controller) = &mut run.progress.step_size else {
            return Err(ResumeError::FixedSteps);
        };
        check_end(run.time.0, end, run.progress.backward)?;
        controller.pace.end = end;
        Ok(run.go_on())
    }
}

impl From<SavedRun> for Checkpoint {
    fn from(run: SavedRun) -> Self {
        Self(Ok(Box::new(run)))
    }
}

impl SavedRun {
    fn go_on(mut self) -> Checkpoint {
        if matches!(self.progress.ending, Some(Ending::Span | Ending::Event { .. })) {
            self.progress.ending = None;
        }
        self.into()
    }
}
