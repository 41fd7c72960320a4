//! A system whose model has been verified.

use crate::system::{Metriplectic, Point, SecondLaw};
use crate::{ModelError, verify};

/// A system whose model was verified once; made by [`Metriplectic::verified`].
///
/// Verification costs as much as some tens of steps, once a run. In a study of many short runs of one model
/// that is most of the work, and all of it the same. A run of a verified system judges the laws at its own
/// start alone: that it lies on the manifold, that values and derivatives are numbers, and that every law
/// holds there.
///
/// ```
/// use metriplectic_dynamics::{Metriplectic, System};
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
    system: &'a Y,
}

// By hand, because a derive would ask it of `Y`.
impl<Y: ?Sized> Clone for Verified<'_, Y> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: ?Sized> Copy for Verified<'_, Y> {}

impl<'a, Y: Metriplectic + ?Sized> Verified<'a, Y> {
    pub(crate) fn around(system: &'a Y, x0: &Point<Y>) -> Result<Self, ModelError> {
        system.verify(x0, verify::RADIUS)?;
        Ok(Self { system })
    }
}

impl<Y: Metriplectic + ?Sized> Metriplectic for Verified<'_, Y> {
    type Manifold = Y::Manifold;
    type Metric = Y::Metric;
    type Bracket = Y::Bracket;
    type Dissipation = Y::Dissipation;
    type Energy = Y::Energy;
    type Entropy = Y::Entropy;
    type Invariants = Y::Invariants;

    fn manifold(&self) -> &Y::Manifold {
        self.system.manifold()
    }

    fn metric(&self) -> &Y::Metric {
        self.system.metric()
    }

    fn bracket(&self) -> &Y::Bracket {
        self.system.bracket()
    }

    fn dissipation(&self) -> &Y::Dissipation {
        self.system.dissipation()
    }

    fn energy(&self) -> &Y::Energy {
        self.system.energy()
    }

    fn entropy(&self) -> &Y::Entropy {
        self.system.entropy()
    }

    fn invariants(&self) -> &Y::Invariants {
        self.system.invariants()
    }

    fn second_law(&self) -> SecondLaw {
        self.system.second_law()
    }

    fn check_start(&self, x0: &Point<Self>) -> Result<(), ModelError> {
        verify::at_one_point(self.system, x0)
    }
}
