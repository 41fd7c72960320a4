//! The questions that a model answers about its laws.

use metriplectic_manifolds::Manifold;

use crate::model_error::ModelError;
use crate::report::Report;

/// A model on the manifold `M` whose laws can be checked. Every [`Metriplectic`](crate::Metriplectic)
/// system is one.
pub trait Verify<M: Manifold> {
    /// Checks the laws of the model at `x0` and at 16 points around it, each coordinate within `radius` times
    /// its [size](Manifold::scales) there. A run does this first, with a radius of 0.1.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the point and the size of the violation.
    fn verify(&self, x0: &M::Point<f64>, radius: f64) -> Result<(), ModelError>;

    /// Lists the residual of every law of the model around `x0`. Read it when a new model misbehaves.
    fn report(&self, x0: &M::Point<f64>) -> Report;

    /// Verifies the model around `x0`, and returns the system with this certificate. A run of it, from any
    /// start, checks the laws at that start alone. Use it for a study of many runs.
    ///
    /// # Errors
    ///
    /// Those of [`verify`](Self::verify).
    fn verified(&self, x0: &M::Point<f64>) -> Result<Verified<'_, Self>, ModelError>;

    /// Checks what a run requires before its first step: everything that [`verify`](Self::verify) does, or
    /// the laws at `x0` alone if the system is [`Verified`].
    ///
    /// # Errors
    ///
    /// Those of [`verify`](Self::verify).
    fn check_start(&self, x0: &M::Point<f64>) -> Result<(), ModelError>;
}

/// A system whose model was verified once; made by [`Verify::verified`].
///
/// Verification costs as much as some tens of steps, once a run. In a study of many short runs of one
/// model, it dominates the cost and repeats the same work. A run of a verified system checks the laws at its
/// start alone: the start lies on the manifold, values and derivatives are finite, and every law holds.
///
/// ```
/// use metriplectic_dynamics::{System, Verify};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, vector};
/// # use metriplectic_dynamics::ModelError;
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5 + p.z * p.z * 0.1)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()
///     .unwrap();
/// let body = body.verified(&vector![0.9, 0.3, 0.2])?;
/// // `WeylMidpoint.run(&body, start, span)` for each start of the study:
/// for k in 1..100 {
///     body.check_start(&vector![0.9, 0.3, 0.002 * f64::from(k)])?;
/// }
/// # Ok::<(), ModelError>(())
/// ```
#[derive(Debug)]
#[must_use = "it is the verified system that a run accepts without verifying it again"]
pub struct Verified<'a, Y: ?Sized> {
    pub(crate) system: &'a Y,
}

// By hand, because a derive would require `Y: Clone`.
impl<Y: ?Sized> Clone for Verified<'_, Y> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: ?Sized> Copy for Verified<'_, Y> {}
