//! Runs with the default scheme.

use metriplectic_manifolds::{Cayley, ChartMidpoint, Exponential, Projection, WeylMidpoint};

use crate::midpoint::Scheme;
use crate::run::checkpoint::{Checkpoint, ResumeError};
use crate::run::error::RunError;
use crate::run::method::Method as _;
use crate::run::schedule::Schedule;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::step::{Element, Flow, Stepper};

/// Runs a system with the default scheme of a retraction:
/// `WeylMidpoint.run(&system, x0, Span::steps(0.1, 1000))`.
///
/// A retraction of your own runs by `Scheme::new(mine).run(..)`.
pub trait Run: Sized {
    /// [`Method::run`](crate::Method::run) with the defaults.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::run`](crate::Method::run).
    fn run<F: Flow>(
        self,
        system: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>>
    where
        Scheme<Self>: Stepper<F>,
    {
        Scheme::new(self).run(system, x0, schedule)
    }

    /// [`Method::steps`](crate::Method::steps) with the defaults.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::steps`](crate::Method::steps).
    fn steps<F: Flow>(
        self,
        system: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Steps<'_, F, Scheme<Self>>, RunError<F::Space>>
    where
        Scheme<Self>: Stepper<F>,
    {
        Scheme::new(self).steps(system, x0, schedule)
    }

    /// [`Method::resume`](crate::Method::resume) with the defaults.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::resume`](crate::Method::resume).
    fn resume<'a, F: Flow>(
        self,
        system: &'a F,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, F, Scheme<Self>>, ResumeError>
    where
        Scheme<Self>: Stepper<F>,
    {
        Scheme::new(self).resume(system, checkpoint)
    }
}

impl Run for WeylMidpoint {}
impl Run for ChartMidpoint {}
impl Run for Exponential {}
impl Run for Projection {}
impl Run for Cayley {}
