//! The dissipation of a closure of the point alone, projected.

use std::fmt;

use metriplectic_fields::{Column, MatrixField, Scalar, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricAt, MetricError, Riemannian};

use super::Dissipation;
use super::kulkarni_nomizu::form;

/// The dissipation of a symmetric positive semidefinite matrix field `K` that does not depend on the
/// covector `w` to be annihilated. The metric of the system projects it off `w`:
///
/// ```math
/// K_w = Q\, K\, Q^T, \qquad Q = 1 - \frac{♯w \otimes w}{\langle w, ♯w \rangle} .
/// ```
///
/// The field is a closure `|x| -> K` or any other [`MatrixField`], acting on covectors dual to the
/// [`velocity`](metriplectic_fields::Space::embed) of the space. `Qᵀw = 0`, so `K_w` annihilates `w`
/// for every `K`. Where `K` annihilates `w` already, nothing changes. Otherwise the projection spreads
/// friction onto variables that had none, and [`is_projected`](Dissipation::is_projected) reports it. A
/// closure `|x, w| -> K` that annihilates `w` by itself ([`FieldDissipation`](super::FieldDissipation)) is
/// then the better model. Where `w = 0`, `K` is not projected.
///
/// ```
/// use metriplectic_dynamics::{ProjectedDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Matrix3, Vector3};
/// let friction = |_: &Vector3<Real>| Matrix3::from_diagonal(&Vector3::new(0.1, 0.1, 0.0)).cast();
/// let system = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .dissipation(ProjectedDissipation(friction))
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct ProjectedDissipation<F>(pub F);

impl<F> fmt::Debug for ProjectedDissipation<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ProjectedDissipation").finish_non_exhaustive()
    }
}

impl<M: Manifold, G: Riemannian<M>, F: MatrixField<M>> Dissipation<M, G>
    for ProjectedDissipation<F>
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let tensor = form(&self.0, g.x)?;
        let sharp = g.inner()?.sharp(w);
        let square = w.dot(&sharp);
        if square.re() == 0.0 {
            return Ok(tensor * *alpha);
        }
        let v = tensor * (*alpha - *w * (alpha.dot(&sharp) / square));
        Ok(v - sharp * (w.dot(&v) / square))
    }

    fn is_projected(&self) -> bool {
        true
    }
}
