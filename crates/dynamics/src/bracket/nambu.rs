//! The brackets of a volume form: area form on a surface, Nambu on a 3-manifold.

use metriplectic_fields::{ChartPoint, Column, Dimension, Scalar, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricError, Riemannian, Rotations, Sphere};
use nalgebra::{Const, Matrix2, Matrix3, Vector2, Vector3};

use super::{Bracket, BracketJet, NaturalBracket, Site, Zero};

/// The derivative of `ln(1/√det g)` along the chart at its centre, `−½ tr(g⁻¹ ∂_k g)`.
#[inline]
fn density_slope<M: Manifold, G: Riemannian<M>>(
    metric: &G,
    x: &ChartPoint<M>,
) -> Result<Vector<M>, MetricError> {
    let mut slope = Vector::<M>::zero();
    let Some(slopes) = metric.slopes(&x.base) else { return Ok(slope) };
    let g = metric.at(x)?;
    for i in 0..M::Dim::LEN {
        let row = g.sharp(&Vector::<M>::basis(i));
        for k in 0..M::Dim::LEN {
            slope[k] -= 0.5 * (slopes[k] * row)[i];
        }
    }
    Ok(slope)
}

/// The bracket of the area form of an oriented surface,
///
/// ```math
/// (\Pi\, dH)^i = -\frac{\varepsilon^{ij} H_j}{\sqrt{\det g}} ,
/// ```
///
/// which on the round sphere is `x' = x × dH` (Marsden and Ratiu 1999, §2). It is nondegenerate: only
/// constants are Casimirs, so an entropy on a surface needs a bracket of [`Zero`],
/// [`SecondLaw::Published`](crate::SecondLaw::Published), or a factor of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaForm;

impl<M: Manifold<Dim = Const<2>>, G: Riemannian<M>> Bracket<M, G> for AreaForm {
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &Site<'_, M, G, D>,
        alpha: &Vector2<D>,
    ) -> Result<Vector2<D>, MetricError> {
        let density = at.metric.volume(at.x)?.recip();
        Ok(Vector2::new(-alpha.y * density, alpha.x * density))
    }

    #[inline]
    fn linearise(
        &self,
        at: &Site<'_, M, G>,
        alpha: &Vector2<f64>,
    ) -> Result<BracketJet<M>, MetricError> {
        let density = at.metric.volume(at.x)?.recip();
        let value = Vector2::new(-alpha.y * density, alpha.x * density);
        let along_z = value * density_slope(at.metric, at.x)?.transpose();
        let tensor = Matrix2::new(0.0, -density, density, 0.0);
        Ok(BracketJet { value, along_z, along_s: Matrix2::zeros(), tensor })
    }
}

/// The Nambu bracket of an oriented Riemannian 3-manifold (Nambu 1973), with the entropy itself as
/// its Casimir:
///
/// ```math
/// (\Pi\, dH)^i = \lambda \frac{\varepsilon^{ijk} S_j H_k}{\sqrt{\det g}} .
/// ```
///
/// So `H`, `S` and a metric are enough. On R³ with `S = |p|²/2` it is the Lie-Poisson bracket of
/// so(3)*; on SO(3), in the body frame, `Ω = dS × dH / √det g` and `R' = R Ω̂`; on S³ the orientation
/// is `vol(a, b, c) = det[x, a, b, c]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nambu {
    /// The factor `λ`.
    pub factor: f64,
}

impl Default for Nambu {
    fn default() -> Self {
        Self { factor: 1.0 }
    }
}

impl<M: Manifold<Dim = Const<3>>, G: Riemannian<M>> Bracket<M, G> for Nambu {
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &Site<'_, M, G, D>,
        alpha: &Vector3<D>,
    ) -> Result<Vector3<D>, MetricError> {
        let (s, density) = (at.s, at.metric.volume(at.x)?.recip() * self.factor);
        let cross = Vector3::new(
            s.y * alpha.z - s.z * alpha.y,
            s.z * alpha.x - s.x * alpha.z,
            s.x * alpha.y - s.y * alpha.x,
        );
        Ok(cross * density)
    }

    #[inline]
    fn linearise(
        &self,
        at: &Site<'_, M, G>,
        alpha: &Vector3<f64>,
    ) -> Result<BracketJet<M>, MetricError> {
        let density = at.metric.volume(at.x)?.recip() * self.factor;
        let hat = |a: Vector3<f64>| Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0);
        let value = at.s.cross(alpha) * density;
        let along_z = value * density_slope(at.metric, at.x)?.transpose();
        let (along_s, tensor) = (hat(alpha * -density), hat(at.s * density));
        Ok(BracketJet { value, along_z, along_s, tensor })
    }
    fn kills_its_entropy(&self) -> bool {
        true
    }
}

impl NaturalBracket for Rotations {
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}

impl<const N: usize> NaturalBracket for Sphere<N>
where
    Self: Manifold,
{
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}
