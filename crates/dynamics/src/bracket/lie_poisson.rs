//! The Lie-Poisson bracket on the dual of a Lie algebra.

use metriplectic_fields::{Column, Scalar};
use metriplectic_manifolds::{LieAlgebra, LieDual, MetricError, Riemannian};
use nalgebra::{SMatrix, SVector};

use super::{Bracket, BracketArgs, BracketJet, NaturalBracket};

/// The Lie-Poisson bracket `{f, g}(μ) = ⟨μ, [df, dg]⟩` up to the sign of the left-invariant
/// convention: `x' = Π dH` reads
///
/// ```math
/// \mu'_b = C_{ab}^d\, \xi^a \mu_d, \qquad \xi = dH(\mu),
/// ```
///
/// that is `μ' = ad*_ξ μ` (Marsden and Ratiu 1999, §10.7; Bloch, Farré Puiggalí, Martín de Diego
/// 2024, eq. "flp" without force). On so(3)*, `Π dH = p × dH`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiePoisson;

impl<const N: usize, G: Riemannian<LieDual<N>>> Bracket<LieDual<N>, G> for LiePoisson {
    #[inline(always)]
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G, D>,
        alpha: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        Ok(at.space.algebra().coadjoint(alpha, &at.g.x.point()))
    }

    #[inline]
    fn linearise(
        &self,
        at: &BracketArgs<'_, LieDual<N>, G>,
        alpha: &SVector<f64, N>,
    ) -> Result<BracketJet<LieDual<N>>, MetricError> {
        Ok(coadjoint_jet(at.space.algebra(), alpha, &at.g.x.point()))
    }
}

/// `ad*_ξ μ`, with its derivatives along `μ` and, as the tensor, along `ξ`.
#[inline]
pub(super) fn coadjoint_jet<const N: usize>(
    algebra: &LieAlgebra<N>,
    xi: &SVector<f64, N>,
    mu: &SVector<f64, N>,
) -> BracketJet<LieDual<N>> {
    let zero = SMatrix::zeros();
    let mut jet = BracketJet::<LieDual<N>> {
        value: Column::zero(),
        along_z: zero,
        along_s: zero,
        tensor: zero,
    };
    for c in algebra.constants() {
        let (slope, entry) = (c.value * xi[c.a], c.value * mu[c.d]);
        jet.value[c.b] += slope * mu[c.d];
        jet.along_z[(c.b, c.d)] += slope;
        jet.tensor[(c.b, c.a)] += entry;
    }
    jet
}

impl<const N: usize> NaturalBracket for LieDual<N> {
    type Bracket = LiePoisson;

    fn natural_bracket(&self) -> LiePoisson {
        LiePoisson
    }
}
