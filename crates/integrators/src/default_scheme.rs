//! Runs with the default scheme.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_manifolds::{
    Cayley, ChartMidpoint, Exponential, Projection, Retraction, WeylMidpoint,
};

use crate::midpoint::Scheme;
use crate::run::checkpoint::{Checkpoint, ResumeError};
use crate::run::error::RunError;
use crate::run::method::Method as _;
use crate::run::schedule::Schedule;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;

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
    fn run<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).run(system, x0, schedule)
    }

    /// [`Method::steps`](crate::Method::steps) with the defaults.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::steps`](crate::Method::steps).
    fn steps<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        schedule: impl Into<Schedule>,
    ) -> Result<Steps<'_, Y, Scheme<Self>>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).steps(system, x0, schedule)
    }

    /// [`Method::resume`](crate::Method::resume) with the defaults.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::resume`](crate::Method::resume).
    fn resume<'a, Y>(
        self,
        system: &'a Y,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, Y, Scheme<Self>>, ResumeError>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).resume(system, checkpoint)
    }
}

impl Run for WeylMidpoint {}
impl Run for ChartMidpoint {}
impl Run for Exponential {}
impl Run for Projection {}
impl Run for Cayley {}
