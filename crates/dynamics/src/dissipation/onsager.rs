//! The dissipation of a few terms of rank one.

use std::fmt;

use metriplectic_fields::{Form, Matrix, Real, Scalar, Square, Vector, Velocity};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};

use super::{Dissipation, DissipationJet, FieldDissipation};
use crate::exchange::Contact;

/// The dissipation of a closure `|x, w| -> [Contact; R]` of the point and of the covector to be annihilated,
///
/// ```math
/// K_w(x) = \sum_r \rho_r\, b_r b_r^{\mathsf T}, \qquad \rho_r \ge 0, \qquad \langle w, b_r \rangle = 0
/// ```
///
/// (Onsager 1931), with the rates `ρ_r` and the directions `b_r`, which are velocities as in
/// [`Space::embed`](metriplectic_fields::Space::embed). Build each `b` from the argument `w`. The terms are those of the
/// [noise](crate::noise) too, which a matrix would not have.
///
/// ```
/// use metriplectic_dynamics::{Contact, OnsagerDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector2, vector};
/// # use num_dual::DualNum;
/// // Two bodies with the energies (u, v) exchange heat.
/// let conduction = |u: &Vector2<Real>, w: &Vector2<Real>| {
///     [Contact { rate: u.x * u.y, along: vector![w.y, -w.x] }]
/// };
/// let bodies = System::on(Euclidean::<2>)
///     .energy(|u: &Vector2<Real>| u.x + u.y)
///     .entropy(|u: &Vector2<Real>| u.x.ln() * 3.0 + u.y.ln() * 5.0)
///     .dissipation(OnsagerDissipation(conduction))
///     .build();
/// assert!(bodies.is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct OnsagerDissipation<F>(pub F);

// By hand, because closures have no `Debug`.
impl<F> fmt::Debug for OnsagerDissipation<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OnsagerDissipation").finish_non_exhaustive()
    }
}

impl<F> OnsagerDissipation<F> {
    /// The sum of the terms, as a matrix on covectors dual to velocities.
    fn sum<M: Manifold, const R: usize>(
        &self,
        x: &M::Point<Real>,
        w: &Velocity<M, Real>,
    ) -> Form<M, Real>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; R],
    {
        let terms = (self.0)(x, w);
        Form::<M, Real>::from_entries(|i, j| {
            let entries = terms.iter().map(|term| term.along[i] * term.along[j] * term.rate);
            entries.fold(Real::from(0.0), |sum, entry| sum + entry)
        })
    }
}

impl<M, G, F, const R: usize> Dissipation<M, G> for OnsagerDissipation<F>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; R],
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let sum =
            FieldDissipation(|x: &M::Point<Real>, w: &Velocity<M, Real>| self.sum::<M, R>(x, w));
        sum.apply(g, w, alpha)
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let sum =
            FieldDissipation(|x: &M::Point<Real>, w: &Velocity<M, Real>| self.sum::<M, R>(x, w));
        sum.linearise(g, w, alpha)
    }

    fn tensor(&self, g: &MetricAt<'_, M, G>, w: &Vector<M>) -> Result<Matrix<M>, MetricError> {
        let sum =
            FieldDissipation(|x: &M::Point<Real>, w: &Velocity<M, Real>| self.sum::<M, R>(x, w));
        Dissipation::<M, G>::tensor(&sum, g, w)
    }
}
