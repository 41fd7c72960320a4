//! A rigid body with friction inside.

use metriplectic_dynamics::{LiePoisson, MetricDissipation, Scaled, System};
use metriplectic_fields::Real;
use metriplectic_integrators::Error;
use metriplectic_manifolds::{Canonical, LieDual};
use nalgebra::Vector3;
use num_dual::DualNum;

use crate::parameter::{not_negative, positive};

/// A free rigid body whose energy is constant while its angular momentum `p` grows, on so(3)* (Morrison 1986, §5; Materassi and
/// Morrison 2018; Bloch, Farré Puiggalí and Martín de Diego 2024):
///
/// ```math
/// H = \sum_i \frac{p_i^2}{2 I_i}, \qquad S = \tfrac12 |p|^2, \qquad
/// \dot p = p \times \omega + \tau \bigl(|\omega|^2 p - (\omega \cdot p)\, \omega\bigr), \qquad \omega_i = p_i/I_i .
/// ```
///
/// The body comes to turn about its axis of largest inertia. If `I₁ = I₂`, the component along the axis obeys
/// `p₃² = P/(1 + (P/p₃(0)² − 1) exp(−rt))` with `P = 2 E I₃` and `r = 4 E τ (1/I₁ − 1/I₃)`.
///
/// ```
/// use metriplectic_integrators::{Error, Method, Scheme, Span};
/// use metriplectic_manifolds::WeylMidpoint;
/// use metriplectic_models::DampedRigidBody;
/// use nalgebra::vector;
///
/// # fn main() -> Result<(), Error> {
/// let body = DampedRigidBody { inertia: [10.0, 5.0, 1.0], time: 1.0 };
/// let start = vector![0.001, -1.0, 0.001];
/// let run = Scheme::new(WeylMidpoint).run(&body.system()?, start, Span::steps(0.1, 1000))?;
/// assert!(run.certificate().keeps_energy() && run.last().point.x.abs() > 1.41);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedRigidBody {
    /// The principal moments of inertia `I₁`, `I₂`, `I₃`, kg m².
    pub inertia: [f64; 3],
    /// The strength `τ` of the friction, s: a time, by which the angular velocity is multiplied twice.
    pub time: f64,
}

impl DampedRigidBody {
    /// Returns the system.
    ///
    /// # Errors
    ///
    /// [`ParameterError`](crate::ParameterError), as an [`Error`], if a moment of inertia is not positive, or the time negative.
    pub fn system(
        self,
    ) -> Result<
        System<
            LieDual<3>,
            Canonical,
            LiePoisson,
            Scaled<impl Fn(&Vector3<Real>) -> Real + Copy, MetricDissipation>,
            impl Fn(&Vector3<Real>) -> Real + Copy,
            impl Fn(&Vector3<Real>) -> Real + Copy,
        >,
        Error,
    > {
        let Self { inertia: [x, y, z], time } = self;
        positive([("inertia[0]", x), ("inertia[1]", y), ("inertia[2]", z)])?;
        not_negative([("time", time)])?;
        let system = System::on(LieDual::so3())
            .energy(move |p: &Vector3<Real>| {
                (p.x.powi(2) / x + p.y.powi(2) / y + p.z.powi(2) / z) * 0.5
            })
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .dissipation(MetricDissipation::scaled(move |_: &Vector3<Real>| Real::from(time)))
            .build()?;
        Ok(system)
    }
}
