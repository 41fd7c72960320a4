//! The canonical bracket of a phase space.

use metriplectic_fields::{Column, Scalar};
use metriplectic_manifolds::rotations::dexp_inverse;
use metriplectic_manifolds::{Euclidean, MetricError, Product, Riemannian, Rotations, Times};
use nalgebra::{SVector, Vector3, Vector6};

use super::{Bracket, Site};

/// The canonical bracket of positions and momenta, without Casimirs:
///
/// | phase space | state | `x' = Π α` |
/// |---|---|---|
/// | R²ⁿ, [`Euclidean<2n>`](Euclidean) | `(q, p)` in one column | `q' = α_p`, `p' = −α_q` |
/// | `Rⁿ × Rⁿ`, [`Product`] | the pair `(q, p)` | the same |
/// | `T*SO(3)`, `Product<Rotations, Euclidean<3>>` | `(R, p)`, `p` in the body frame | `R' = R α̂_p`, `p' = p × α_p − α_R` |
///
/// On `T*SO(3)`, trivialised from the left, `α_R` is the derivative along the body rotations,
/// `α_R·Ω = d/dt H(R exp(tΩ̂))` (Marsden and Ratiu 1999, §13.5; the momentum `Rp` in space is conserved
/// by every `H` that does not depend on `R`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Symplectic;

impl<const N: usize, G: Riemannian<Euclidean<N>>> Bracket<Euclidean<N>, G> for Symplectic {
    fn apply<D: Scalar>(
        &self,
        _: &Site<'_, Euclidean<N>, G, D>,
        alpha: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        const { assert!(N.is_multiple_of(2), "positions and momenta come in pairs: R²ⁿ") }
        let n = N / 2;
        Ok(SVector::from_index(|i| if i < n { alpha[i + n] } else { -alpha[i - n] }))
    }
}

impl<const N: usize, G> Bracket<Product<Euclidean<N>, Euclidean<N>>, G> for Symplectic
where
    Euclidean<N>: Times<Euclidean<N>>,
    G: Riemannian<Product<Euclidean<N>, Euclidean<N>>>,
{
    fn apply<D: Scalar>(
        &self,
        _: &Site<'_, Product<Euclidean<N>, Euclidean<N>>, G, D>,
        alpha: &metriplectic_fields::Vector<Product<Euclidean<N>, Euclidean<N>>, D>,
    ) -> Result<metriplectic_fields::Vector<Product<Euclidean<N>, Euclidean<N>>, D>, MetricError>
    {
        let (along_q, along_p) = Product::<Euclidean<N>, Euclidean<N>>::split(alpha);
        Ok(Product::<Euclidean<N>, Euclidean<N>>::join(&along_p, &-along_q))
    }
}

impl<G> Bracket<Product<Rotations, Euclidean<3>>, G> for Symplectic
where
    G: Riemannian<Product<Rotations, Euclidean<3>>>,
{
    fn apply<D: Scalar>(
        &self,
        at: &Site<'_, Product<Rotations, Euclidean<3>>, G, D>,
        alpha: &Vector6<D>,
    ) -> Result<Vector6<D>, MetricError> {
        let (attitude, p) = Product::parts(at.x);
        let (along_q, omega) = Product::<Rotations, Euclidean<3>>::split(alpha);
        // Chart velocities are dexp⁻¹ Ω, so body covectors are dexp⁻ᵀ α.
        let from_body = dexp_inverse(&attitude.q);
        let (p, torque): (Vector3<D>, _) = (p.point(), from_body.tr_mul(&along_q));
        let gyration = Vector3::new(
            p.y * omega.z - p.z * omega.y,
            p.z * omega.x - p.x * omega.z,
            p.x * omega.y - p.y * omega.x,
        );
        Ok(Product::<Rotations, Euclidean<3>>::join(&(from_body * omega), &(gyration - torque)))
    }
}
