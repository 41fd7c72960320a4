//! The Lie-Poisson bracket with a force.

use std::fmt;

use metriplectic_fields::{Column, Real, Scalar, ScalarField, Space};
use metriplectic_manifolds::{Euclidean, LieDual, MetricError, Riemannian};
use nalgebra::{SMatrix, SVector};

use super::lie_poisson::coadjoint_jet;
use super::{Bracket, BracketArgs, BracketJet, LiePoisson};

/// A smooth force `𝓕: g → g*` on a Lie algebra of dimension `N`, in a basis and its dual basis. Any
/// such map is a force.
///
/// Implemented by every closure `Fn(&SVector<Real, N>) -> SVector<Real, N>`. Implement it by hand,
/// with the one method [`at`](Self::at), for a type that should be evaluated at each scalar directly:
///
/// ```
/// use metriplectic_dynamics::Force;
/// use metriplectic_fields::Scalar;
/// use nalgebra::Vector3;
///
/// /// `𝓕(Ω) = c |Ω|² Ω × e₃`.
/// struct Swirl { strength: f64 }
///
/// impl Force<3> for Swirl {
///     fn at<D: Scalar>(&self, omega: &Vector3<D>) -> Vector3<D> {
///         Vector3::new(omega.y, -omega.x, D::zero()) * (omega.dot(omega) * self.strength)
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a force on a Lie algebra of dimension {N}",
    label = "expected a function of one velocity that returns one covector",
    note = "a closure takes a velocity over `Real` and returns a column over `Real`: `|xi: &Vector3<Real>| xi * 0.1.into()`",
    note = "a type of your own implements `Force` with the generic method `at`"
)]
pub trait Force<const N: usize> {
    /// The components of `𝓕(ξ)` at any scalar.
    fn at<D: Scalar>(&self, xi: &SVector<D, N>) -> SVector<D, N>;

    /// Evaluates the force at the scalar of closures, at which a closure needs no lift.
    #[inline]
    fn at_real(&self, xi: &SVector<Real, N>) -> SVector<Real, N> {
        self.at(xi)
    }

    /// `𝓕(ξ)` and the matrix `∂𝓕_i/∂ξ^j` at a real velocity, in `⌈N/2⌉` evaluations.
    #[inline]
    fn jet1(&self, xi: &SVector<f64, N>) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
        let (mut value, mut slope) = (SVector::repeat(f64::NAN), SMatrix::<f64, N, N>::zeros());
        let seeded = Euclidean::<N>::seeds(xi);
        for j in (0..N).step_by(2) {
            let f = self.at_real(&seeded(j, j + 1));
            value = f.map(|f| f.re);
            slope.set_column(j, &f.map(|f| f.eps1));
            if j + 1 < N {
                slope.set_column(j + 1, &f.map(|f| f.eps2));
            }
        }
        (value, slope)
    }
}

#[diagnostic::do_not_recommend]
impl<F, const N: usize> Force<N> for F
where
    F: Fn(&SVector<Real, N>) -> SVector<Real, N>,
{
    #[inline]
    fn at<D: Scalar>(&self, xi: &SVector<D, N>) -> SVector<D, N> {
        if const { D::NDERIV == 0 } {
            return self(&xi.map(|xi| xi.re().into())).map(|f| f.re.into());
        }
        // Each component is a scalar field on the algebra, which has its lift.
        SVector::from_index(|i| {
            ScalarField::<Euclidean<N>>::at(&|xi: &SVector<Real, N>| self(xi)[i], xi)
        })
    }

    #[inline]
    fn at_real(&self, xi: &SVector<Real, N>) -> SVector<Real, N> {
        self(xi)
    }
}

/// The [Lie-Poisson bracket](LiePoisson) with a [`Force`], the forced Lie-Poisson equations (Bloch,
/// Farré Puiggalí, Martín de Diego 2024, §3, eq. "flp"):
///
/// ```math
/// \mu' = \mathrm{ad}^*_\xi \bigl( \mu + \mathcal F(\xi) \bigr), \qquad \xi = dH(\mu) .
/// ```
///
/// Every `𝓕` conserves `H`, because `⟨ad*_ξ 𝓕, ξ⟩ = ⟨𝓕, [ξ, ξ]⟩ = 0`. In a step `w_H` takes the place of
/// `ξ`, with the same result. A Casimir `C` changes at the rate
/// `C' = ⟨𝓕(ξ), [ξ, dC]⟩` (eq. "cas").
///
/// [`SystemBuilder::force`](crate::SystemBuilder::force) makes this bracket. On a product it is part of a
/// pair: `(ForcedLiePoisson(force), Zero)`.
#[derive(Clone, Copy)]
pub struct ForcedLiePoisson<F>(pub F);

// By hand, because closures have no `Debug`.
impl<F> fmt::Debug for ForcedLiePoisson<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ForcedLiePoisson").finish_non_exhaustive()
    }
}

impl<const N: usize, G, F> Bracket<LieDual<N>, G> for ForcedLiePoisson<F>
where
    G: Riemannian<LieDual<N>>,
    F: Force<N>,
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G, D>,
        alpha: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        LiePoisson.apply(at, alpha)
    }

    #[inline]
    fn linearise(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G>,
        alpha: &SVector<f64, N>,
    ) -> Result<BracketJet<LieDual<N>>, MetricError> {
        LiePoisson.linearise(at, alpha)
    }

    fn is_forced(&self) -> bool {
        true
    }

    #[inline]
    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G, D>,
        w: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        Ok(at.space.algebra().coadjoint(w, &self.0.at(w)))
    }

    #[inline]
    fn linearise_force(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G>,
        w: &SVector<f64, N>,
    ) -> Result<BracketJet<LieDual<N>>, MetricError> {
        let (force, slope) = self.0.jet1(w);
        let jet = coadjoint_jet(at.space.algebra(), w, &force);
        // The force depends on `w` and not on the point.
        Ok(BracketJet {
            along_z: SMatrix::zeros(),
            tensor: jet.tensor + jet.along_z * slope,
            ..jet
        })
    }
}
