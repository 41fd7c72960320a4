//! The questions that a model answers about its laws.

use std::sync::atomic::{AtomicBool, Ordering};

use metriplectic_manifolds::Manifold;

use crate::{ModelError, Report};

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
    /// start, checks the laws at that start without samples around it. Use it for a study of many runs.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    fn verified(&self, x0: &M::Point<f64>) -> Result<Verified<'_, Self>, ModelError>;

    /// Checks the laws at `x0` alone, and returns the system with the certificate of the other members of a family. Use it
    /// for a system whose closures differ by their parameters from those of one that was [verified](Self::verified); a
    /// sweep chooses the rows that are (`Row::verified`).
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify), at `x0`.
    fn verified_as_member(&self, x0: &M::Point<f64>) -> Result<Verified<'_, Self>, ModelError>;

    /// Checks what a run requires before its first step: everything that [`verify`](Self::verify) does. If the system is
    /// [`Verified`], it checks the laws at `x0` alone; if a run has begun before, at `x0` with all derivatives. The tensors and the
    /// fields are those that the first start has been verified with, so that a further one costs a few steps.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    fn check_start(&self, x0: &M::Point<f64>) -> Result<(), ModelError>;

    /// Checks the laws at one state that a run has reached: finite differentials, a metric that can be used, a skew
    /// `Π` with `Π dS = 0`, a symmetric `K ⪰ 0` with `K dH = 0`, and the laws of a force and of the further
    /// invariants. A law is broken if it is off by `10⁻⁸` of its terms there and at states nearby. The Jacobi identity
    /// and the actions of symmetries are checked at the start alone.
    ///
    /// ```
    /// use metriplectic_dynamics::{ModelError, Poisson, System, Verify};
    /// use metriplectic_fields::Real;
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector3, vector};
    /// let bent = System::on(Euclidean::<3>)
    ///     .bracket(Poisson::constant(Vector3::z().cross_matrix()).unwrap())
    ///     .energy(|x: &Vector3<Real>| x.norm_squared())
    ///     .entropy(|x: &Vector3<Real>| if x.x.re > 2.0 { x.z + x.x * (x.x - 2.0) } else { x.z })
    ///     .build()
    ///     .unwrap();
    /// assert!(bent.verify(&vector![1.0, 1.0, 1.0], 0.1).is_ok());
    /// let law = bent.check_state(&vector![2.5, 1.0, 1.0]);
    /// assert!(matches!(law, Err(ModelError::EntropyNotCasimir { .. })));
    /// ```
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    fn check_state(&self, x: &M::Point<f64>) -> Result<(), ModelError>;

    /// Compares the derivatives of energy, entropy and further invariants with their values at one state.
    ///
    /// # Errors
    ///
    /// [`ModelError::WrongDerivative`].
    fn check_derivatives(&self, x: &M::Point<f64>) -> Result<(), ModelError>;

    /// Compares the derivatives of energy, entropy and further invariants with their values along two directions: a
    /// generic one, and one axis, which `turn` chooses. It costs five evaluations of each field and allocates nothing. If
    /// they contradict each other, it is [`check_derivatives`](Self::check_derivatives) that judges.
    ///
    /// # Errors
    ///
    /// [`ModelError::WrongDerivative`].
    fn look_at_derivatives(&self, x: &M::Point<f64>, turn: usize) -> Result<(), ModelError>;

    /// Looks for a broken law where a step fails: at `x`, at 16 states around it, each coordinate within a tenth of its
    /// size, and at the states `ahead`. States without values are left out.
    ///
    /// # Errors
    ///
    /// The errors of [`check_state`](Self::check_state) and [`check_derivatives`](Self::check_derivatives).
    fn check_around(&self, x: &M::Point<f64>, ahead: &[M::Point<f64>]) -> Result<(), ModelError>;
}

/// A system whose model was verified once; made by [`Verify::verified`].
///
/// Verification costs as much as some tens of steps, once a run. In a study of many short runs of one
/// model, it dominates the cost and repeats the same work. A run of a verified system checks the laws at its
/// start without samples around it: the start lies on the manifold, values and derivatives are finite, and the laws
/// of a [state](Verify::check_state) hold. It checks them again at its end and after each multiple of 149 steps, with
/// the [derivatives](Verify::look_at_derivatives) along two directions, and the certificate says that the model was
/// verified before.
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

/// Notes that the laws of a system have been verified around the start of a run of it.
#[doc(hidden)]
#[derive(Debug, Default)]
pub struct Begun(AtomicBool);

impl Begun {
    pub(crate) fn has(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn note(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A copy has the same parts.
impl Clone for Begun {
    fn clone(&self) -> Self {
        Self(AtomicBool::new(self.has()))
    }
}
