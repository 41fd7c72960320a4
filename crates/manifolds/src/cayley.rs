//! The Cayley retraction of SO(3).

use metriplectic_fields::{ChartPoint, Column, Scalar, Space, dot};
use nalgebra::{Matrix3, Vector3};

use crate::metric::{MetricError, stretched};
use crate::rotation_vector::{dexp_inverse, hat, orthogonal};
use crate::{Nodes, PointPair, Retraction, Riemannian, Rotations, StepPath, StepPathJet, Tangent};

/// The symmetric Cayley retraction of SO(3), for any metric:
///
/// ```math
/// R_h(R\hat\Omega) = \bigl(R\,\mathrm{cay}(-h\Omega/2),\ R\,\mathrm{cay}(h\Omega/2)\bigr), \qquad
/// \mathrm{cay}(a) = (1 - \hat a/2)^{-1} (1 + \hat a/2)
/// = 1 + \frac{\hat a + \hat a^2/2}{1 + |a|^2/4} .
/// ```
///
/// It is rational, has order 2, and conserves the energy exactly like every other retraction
/// (Cayley 1846; Bogfjellmo
/// and Marthinsen 2016 for its use in integrators). `cay(a)` turns by `2 atan(|a|/2)` about `a`, so the
/// displacement of a step by the angle `θ` has the length `4 tan(θ/4)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cayley;

/// `cay(a)`.
fn cayley<D: Scalar>(a: &Vector3<D>) -> Matrix3<D> {
    let (turn, scale) = (hat(a), (dot(a, a) * 0.25 + 1.0).recip());
    Matrix3::from_diagonal_element(D::one()) + (turn + turn * turn * D::from(0.5)) * scale
}

/// `R cay(a)`, orthogonal to round-off.
fn turned<D: Scalar>(r: &Matrix3<D>, a: &Vector3<D>) -> Matrix3<D> {
    orthogonal(&(r * cayley(a)))
}

impl<G: Riemannian<Rotations>> Retraction<Rotations, G> for Cayley {
    fn step_path<D: Scalar>(
        &self,
        _: &G,
        x: &Matrix3<f64>,
        u: &Vector3<D>,
    ) -> Result<StepPath<Rotations, D>, MetricError> {
        let half = u * D::from(0.5);
        let middle = turned(&Rotations::constant(x), &half);
        let z = ChartPoint::<Rotations, D>::around(&middle);
        // The body velocity u in the frame of the chart at z.
        let d = dexp_inverse(&z.q) * u;
        Ok(StepPath { z, d, end: turned(&middle, &half) })
    }

    #[inline]
    fn real_step_path(
        &self,
        _: &G,
        x: &Matrix3<f64>,
        u: &Vector3<f64>,
    ) -> Result<StepPath<Rotations>, MetricError> {
        let half = u * 0.5;
        let z = turned(x, &half);
        Ok(StepPath { z: ChartPoint::centre(&z), d: *u, end: turned(&z, &half) })
    }

    fn end(&self, _: &G, x: &Matrix3<f64>, u: &Vector3<f64>) -> Result<Matrix3<f64>, MetricError> {
        let half = u * 0.5;
        Ok(turned(&turned(x, &half), &half))
    }

    fn along(
        &self,
        _: &G,
        x: &Matrix3<f64>,
        u: &Vector3<f64>,
    ) -> Result<Nodes<Rotations>, MetricError> {
        Nodes::of(|t| {
            let half = stretched::<Rotations>(&(u * 0.5), t);
            Ok(turned(&turned(&Rotations::constant(x), &half), &half))
        })
    }

    /// `cay(a)` turns its body by `B(a) δa` for a change `δa`, `B(a) = (1 − â/2)/(1 + |a|²/4)`. With `a = u/2`:
    /// `∂z = ½B`, `∂x' = ½(cay(a)ᵀ + 1) B`, and `∂d = 1 − ½û ∂z`, because the chart at `z` reads the body velocity
    /// `u` at `q` as `u + ½q × u + …`.
    #[inline]
    fn step_path_jet(
        &self,
        metric: &G,
        x: &Matrix3<f64>,
        u: &Vector3<f64>,
    ) -> Result<StepPathJet<Rotations>, MetricError> {
        let StepPath { z, d, end } = self.real_step_path(metric, x, u)?;
        let half = u * 0.5;
        let one = Matrix3::identity();
        let dz = (one - hat(&half) * 0.5) * (0.5 / (1.0 + 0.25 * half.norm_squared()));
        let dend = (cayley(&half).transpose() + one) * dz;
        Ok(StepPathJet { z: z.base, dz, d, dd: one - hat(u) * dz * 0.5, end, dend })
    }

    fn pair(
        &self,
        _: &G,
        tangent: &Tangent<Rotations>,
    ) -> Result<PointPair<Rotations>, MetricError> {
        let half = tangent.vector * 0.5;
        Ok((turned(&tangent.base, &-half), turned(&tangent.base, &half)))
    }

    /// `d = 4 tan(θ/4)` about the axis of `xᵀy`, and `z` half way.
    fn inverse(
        &self,
        _: &G,
        x: &Matrix3<f64>,
        y: &Matrix3<f64>,
    ) -> Result<Tangent<Rotations>, MetricError> {
        let q = Rotations::coordinates(x, y);
        crate::metric_error::within(std::f64::consts::PI, q.norm())?;
        let theta = Column::magnitude(&q);
        let stretch = if theta > 0.0 { (0.25 * theta).tan() / (0.25 * theta) } else { 1.0 };
        Ok(Tangent { base: Rotations::chart(x, &(q * 0.5)), vector: q * stretch })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canonical, Manifold, laws};
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    proptest! {
        #[test]
        fn the_cayley_retraction_keeps_the_laws(
            seed in any::<u64>(), u in prop::array::uniform3(-1.5..1.5),
        ) {
            let x = Rotations.random(&mut ChaCha8Rng::seed_from_u64(seed));
            let u = Vector3::from(u);
            laws::retraction::<Rotations, _, _>(&Cayley, &Canonical, &x, &u)?;
            let y = Rotations::chart(&x, &u);
            laws::symmetric_retraction::<Rotations, _, _>(&Cayley, &Canonical, &x, &y)?;
        }
    }
}
