//! A bracket times a number.

use metriplectic_fields::{Matrix, Scalar, Vector};
use metriplectic_manifolds::{Manifold, MetricError, Riemannian};

use super::{Bracket, BracketArgs, BracketJet};
use crate::dissipation::Scaled;

/// The bracket `c Π`, from a number `c` and any bracket `Π`, in this order. It brings the bracket into the units of the energy.
///
/// A moment `μm` of an electron, with the unit vector `m` and the gyromagnetic ratio `γ > 0`, precesses by `m' = −γ m × B` (Landau and
/// Lifshitz 1935). With an energy in joules its bracket is that of the sphere times `γ/μ`:
///
/// ```
/// use metriplectic_dynamics::{AreaForm, BuildError, Scaled, System, VectorField};
/// use metriplectic_fields::{ChartPoint, Real, Space};
/// use metriplectic_manifolds::Sphere;
/// use nalgebra::{Vector3, vector};
///
/// let (gamma, mu, field) = (1.76e11, 9.27e-24, 0.5); // 1/(T s), J/T, T
/// let spin = System::on(Sphere::<2>::round())
///     .bracket(Scaled(gamma / mu, AreaForm))
///     .energy(move |m: &Vector3<Real>| -m.z * (mu * field))
///     .build()?;
/// let x = ChartPoint::centre(&vector![1.0, 0.0, 0.0]);
/// let velocity = Sphere::<2>::embed(&x, &spin.velocity(&x).unwrap());
/// assert!((velocity - vector![0.0, gamma * field, 0.0]).amax() < 1e-4);
/// # Ok::<(), BuildError>(())
/// ```
impl<M, G, B> Bracket<M, G> for Scaled<f64, B>
where
    M: Manifold,
    G: Riemannian<M>,
    B: Bracket<M, G>,
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(self.1.apply(at, alpha)? * D::from(self.0))
    }

    #[inline]
    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        Ok(self.1.linearise(at, alpha)?.scaled(self.0))
    }

    fn tensor<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError> {
        Ok(self.1.tensor(at)? * D::from(self.0))
    }

    fn is_poisson(&self) -> bool {
        self.1.is_poisson()
    }

    fn is_forced(&self) -> bool {
        self.1.is_forced()
    }

    /// The force of `Π` as it is, without the factor.
    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        w: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        self.1.force(at, w)
    }

    fn linearise_force(
        &self,
        at: &BracketArgs<'_, M, G>,
        w: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        self.1.linearise_force(at, w)
    }

    fn is_zero(&self) -> bool {
        self.0 == 0.0 || self.1.is_zero()
    }

    fn annihilates_entropy(&self) -> bool {
        self.1.annihilates_entropy()
    }
}

impl<M: Manifold> BracketJet<M> {
    /// Multiplies the bracket by a number.
    fn scaled(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            along_z: self.along_z * factor,
            along_s: self.along_s * factor,
            tensor: self.tensor * factor,
        }
    }
}
