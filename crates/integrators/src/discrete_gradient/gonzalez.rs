//! The midpoint discrete gradient.

use metriplectic_fields::{Matrix, Scalar, ScalarField, Vector, differential};
use metriplectic_manifolds::{Manifold, StepPath, StepPathJet};

use super::{DiscreteGradient, GradientKind};

/// The midpoint discrete gradient on a manifold (Gonzalez 1996; Bloch, Farré Puiggalí, Martín de
/// Diego 2024, eq. "gonzalez-m", with the missing step size restored):
///
/// ```math
/// w = dF(z) + \frac{F(x') - F(x) - dF(z)\,d}{G(d, d)}\, \flat d , \qquad d = hv .
/// ```
///
/// For a quadratic `F` on a flat space it is `dF(z)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gonzalez;

impl DiscreteGradient for Gonzalez {
    const KIND: Option<GradientKind> = Some(GradientKind::Gonzalez);

    #[inline]
    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        _: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        differential(f, &path.z)
    }

    #[inline]
    fn real_mean<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        _: &M::Point<f64>,
        path: &StepPath<M>,
    ) -> Vector<M> {
        f.jet1(&path.z.base).df
    }

    #[inline]
    fn mean_jet<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        _: &M::Point<f64>,
        path: &StepPathJet<M>,
    ) -> (Vector<M>, Matrix<M>) {
        let jet = f.jet2(&path.z);
        (jet.df, jet.hf * path.dz)
    }

    const IS_DIFFERENTIAL: bool = true;

    #[inline]
    fn mean_jets<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        _: [&M::Point<f64>; 2],
        paths: [&StepPathJet<M>; 2],
    ) -> (Vector<M>, [Matrix<M>; 2]) {
        let jet = f.jet2(&paths[0].z);
        (jet.df, paths.map(|path| jet.hf * path.dz))
    }

    #[inline]
    fn slope_at_base<M: Manifold>(
        &self,
        _: &impl ScalarField<M>,
        _: &M::Point<f64>,
        d: &Vector<M>,
        mean: &Vector<M>,
    ) -> f64 {
        use metriplectic_fields::Column;
        mean.dot(d)
    }
}
