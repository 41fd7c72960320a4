//! The canonical bracket of a phase space.

use metriplectic_fields::{Column, Scalar, Vector};
use metriplectic_manifolds::rotations::dexp_inverse;
use metriplectic_manifolds::{
    Chart, Euclidean, MetricError, Product, Riemannian, Rotations, Sphere, Times,
};
use nalgebra::{Const, SVector, Vector3, Vector6};

use super::{Bracket, BracketArgs};

/// The canonical bracket of positions and momenta, without Casimirs:
///
/// | phase space | state | `x' = Π α` |
/// |---|---|---|
/// | R²ⁿ, [`Euclidean<2n>`](Euclidean) | `(q, p)` in one column | `q' = α_p`, `p' = −α_q` |
/// | `U ⊂ R²ⁿ`, [`Chart<2n>`](Chart) | the same | the same |
/// | `Rⁿ × Rⁿ`, [`Product`] | the pair `(q, p)` | the same |
/// | `T*U = U × Rⁿ`, `Product<Chart<n>, Euclidean<n>>` | the same | the same |
/// | `T*S¹`, `Product<Sphere<1>, Euclidean<1>>` | `(x, p)` | `θ' = α_p`, `p' = −α_θ` with the angle `θ` |
/// | `T*SO(3)`, `Product<Rotations, Euclidean<3>>` | `(R, p)`, `p` in the body frame | `R' = R α̂_p`, `p' = p × α_p − α_R` |
///
/// On `T*SO(3)`, trivialised from the left, `α_R` is the derivative along the body rotations,
/// `α_R·Ω = d/dt H(R exp(tΩ̂))` (Marsden and Ratiu 1999, §13.5; the momentum `Rp` in space is conserved
/// by every `H` that does not depend on `R`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Symplectic;

/// A dimension in which every position has its momentum: 2, 4, …, 128.
#[diagnostic::on_unimplemented(
    message = "`Symplectic` needs a momentum for every position, an even dimension up to 128, and this is `{Self}`",
    label = "this space has another dimension",
    note = "a constant bracket with further variables, such as `s` in `(q, p, s)`, is `Poisson::constant(matrix)?`"
)]
pub trait EvenDimension {}

macro_rules! even {
    ($($n:literal)+) => {$(
        #[diagnostic::do_not_recommend]
        impl EvenDimension for Const<$n> {}
    )+};
}
even!(2 4 6 8 10 12 14 16 18 20 22 24 26 28 30 32 34 36 38 40 42 44 46 48 50 52 54 56 58 60 62 64);
even!(66 68 70 72 74 76 78 80 82 84 86 88 90 92 94 96 98 100 102 104 106 108 110 112 114 116 118);
even!(120 122 124 126 128);

/// Positions and momenta in one column.
macro_rules! on_a_column {
    ($($space:ident),+) => {$(
        impl<const N: usize, G: Riemannian<$space<N>>> Bracket<$space<N>, G> for Symplectic
        where
            Const<N>: EvenDimension,
        {
            fn apply<D: Scalar>(
                &self,
                _: &BracketArgs<'_, $space<N>, G, D>,
                alpha: &SVector<D, N>,
            ) -> Result<SVector<D, N>, MetricError> {
                let n = N / 2;
                Ok(SVector::from_index(|i| if i < n { alpha[i + n] } else { -alpha[i - n] }))
            }
        }
    )+};
}
on_a_column!(Euclidean, Chart);

/// The cotangent bundle of a space whose frame is that of global coordinates.
macro_rules! on_a_cotangent_product {
    ($([$($n:ident)?] $space:ty, $fibre:ty);+) => {$(
        impl<$(const $n: usize,)? G> Bracket<Product<$space, $fibre>, G> for Symplectic
        where
            $space: Times<$fibre>,
            G: Riemannian<Product<$space, $fibre>>,
        {
            fn apply<D: Scalar>(
                &self,
                _: &BracketArgs<'_, Product<$space, $fibre>, G, D>,
                alpha: &Vector<Product<$space, $fibre>, D>,
            ) -> Result<Vector<Product<$space, $fibre>, D>, MetricError> {
                let (along_q, along_p) = Product::<$space, $fibre>::split(alpha);
                // The two columns have the same size, which their types do not show.
                let forward = Column::from_index(|i| along_p[i]);
                let back = Column::from_index(|i| -along_q[i]);
                Ok(Product::<$space, $fibre>::join(&forward, &back))
            }
        }
    )+};
}
on_a_cotangent_product!(
    [N] Euclidean<N>, Euclidean<N>;
    [N] Chart<N>, Euclidean<N>;
    [] Sphere<1>, Euclidean<1>
);

impl<G> Bracket<Product<Rotations, Euclidean<3>>, G> for Symplectic
where
    G: Riemannian<Product<Rotations, Euclidean<3>>>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Product<Rotations, Euclidean<3>>, G, D>,
        alpha: &Vector6<D>,
    ) -> Result<Vector6<D>, MetricError> {
        let (attitude, p) = Product::parts(at.g.x);
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
