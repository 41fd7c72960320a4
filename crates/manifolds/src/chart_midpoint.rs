//! The symmetric retraction along straight lines of the chart.

use metriplectic_equations::Path;
use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Real, Scalar, Square, Vector};
use num_dual::{Dual, Dual64};

use crate::metric::{ROUNDED, stretched};
use crate::metric_error::finite_column;
use crate::{
    Manifold, MetricError, Nodes, PointPair, Retraction, Riemannian, StepPath, StepPathJet, Tangent,
};

/// The midpoint retraction along the straight line `t ↦ φ_x(tu)` of the chart at `x`, for any metric:
///
/// ```math
/// z = \varphi_x(u/2), \qquad hv = \frac{d}{dt} \varphi_x(tu) \Big|_{t = 1/2}, \qquad x' = \varphi_x(u) .
/// ```
///
/// These lines are the geodesics of the manifold's *canonical* metric: straight lines on Rⁿ and in a
/// [`Chart`](crate::Chart), great circles on Sⁿ, one-parameter subgroups on SO(3). So this is
/// [`WeylMidpoint`](crate::WeylMidpoint) of the canonical metric, in closed form. The metric of the system enters
/// a step through its inner product at `z` alone, and is evaluated once for each residual.
///
/// Schemes built on it have order 2, and satisfy both laws exactly, like those of every symmetric retraction.
/// They cost a tenth to a hundredth of those along the geodesics of a [`Metric::field`](crate::Metric::field). Two
/// properties of [`WeylMidpoint`](crate::WeylMidpoint) are missing: a step in other coordinates differs by
/// `O(h³)`, and an edge of the chart at infinite distance can be reached by a finite step.
///
/// On a manifold of your own the chart is the one that you write. The retraction is symmetric if the chart is
/// normal for some metric, and schemes built on it have order 2 for every chart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChartMidpoint;

/// Refuses a displacement that the chart does not reach.
#[inline]
pub(crate) fn reached<M: Manifold>(u: &Vector<M>) -> Result<(), MetricError> {
    if M::is_near(&(*u * 0.5)) { Ok(()) } else { Err(beyond::<M>(u)) }
}

/// The error of a displacement that the chart does not reach, or of one that is NaN.
#[cold]
fn beyond<M: Manifold>(u: &Vector<M>) -> MetricError {
    MetricError::OutOfChart { distance: u.magnitude() }
}

impl<M: Manifold, G: Riemannian<M>> Retraction<M, G> for ChartMidpoint {
    const PATH: Option<Path> = Some(Path::Chart);

    fn step_path<D: Scalar>(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError> {
        reached::<M>(&u.real())?;
        let middle = M::chart(x, &moving::<M, D>(u));
        // One more dual number carries the velocity at the middle to the chart there.
        let base = M::real(&M::chart(x, &(*u * D::from(0.5))));
        let q = M::coordinates(&base, &middle);
        let z = ChartPoint { base, q: Vector::<M, D>::from_index(|i| q[i].re) };
        let d = Vector::<M, D>::from_index(|i| q[i].eps);
        Ok(StepPath { z, d, end: M::chart(x, u) })
    }

    #[inline]
    fn real_step_path(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPath<M>, MetricError> {
        reached::<M>(u)?;
        Ok(M::line(x, u))
    }

    #[inline]
    fn end(&self, _: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        reached::<M>(u)?;
        let quantity = "a coordinate of the end";
        M::line_end(x, u).ok_or(MetricError::NotFinite { quantity, value: f64::NAN })
    }

    #[inline]
    fn along(&self, _: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<Nodes<M>, MetricError> {
        reached::<M>(u)?;
        Ok(Nodes { ends: [M::line_at(x, u, 0.0), M::line_at(x, u, 1.0)], middle: None })
    }

    #[inline]
    fn lost_digits(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
        end: &M::Point<f64>,
    ) -> Vector<M> {
        M::lost_digits(x, u, end)
    }

    /// A few roundings: the line is in closed form, whatever the metric is.
    fn accuracy(&self, _: &G) -> f64 {
        ROUNDED
    }

    #[inline]
    fn step_path_jet(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError> {
        reached::<M>(u)?;
        Ok(M::line_jet(x, u))
    }

    /// On a normal chart `x = φ_z(−d/2)`. Any other chart has the start `x` whose line passes `z` with the
    /// displacement `d`, which is found by iteration from there.
    fn pair(&self, metric: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError> {
        let Tangent { base: z, vector: d } = tangent;
        let (mut q, mut best) = (*d * -0.5, f64::INFINITY);
        for _ in 0..PASSES {
            reached::<M>(&(q * 2.0))?;
            let x = M::chart(z, &q);
            let u = finite_column("a coordinate of the pair", M::coordinates(&x, z))? * 2.0;
            let wrong = M::line(&x, &u).d - *d;
            let error = wrong.magnitude();
            // Round-off ends the iteration: the next correction is no better.
            if error <= ROUNDED * d.magnitude() || 2.0 * error > best {
                let end = self.end(metric, &x, &u)?;
                return Ok((x, end));
            }
            best = error;
            q += wrong * 0.5;
        }
        Err(MetricError::NoLogarithm { distance: d.magnitude(), missed_by: best })
    }

    fn inverse(
        &self,
        _: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError> {
        let u = finite_column("the logarithm", M::coordinates(x, y))?;
        reached::<M>(&u)?;
        let StepPath { z, d, .. } = M::line(x, &u);
        Ok(Tangent { base: z.base, vector: d })
    }
}

/// The passes of the iteration for a start, which each reduce the error by the square of the displacement in
/// units of the curvature of the chart.
const PASSES: usize = 60;

/// The coordinates `(½ + ε) u`, whose `ε`-part is the velocity of the line `t ↦ tu` at its middle.
#[inline]
fn moving<M: Manifold, D: Scalar>(u: &Vector<M, D>) -> Vector<M, Dual<D>> {
    Vector::<M, Dual<D>>::from_index(|i| Dual::new(u[i] * 0.5, u[i]))
}

/// The middle and the end of a straight line of the chart, by one dual number.
pub(crate) fn line<M: Manifold>(x: &M::Point<f64>, u: &Vector<M>) -> StepPath<M> {
    let middle = M::chart(x, &Vector::<M, Dual64>::from_index(|i| Dual64::new(u[i] * 0.5, u[i])));
    let base = M::real(&middle);
    let q = M::coordinates(&base, &middle);
    let d = Vector::<M>::from_index(|i| q[i].eps);
    StepPath { z: ChartPoint::centre(&base), d, end: M::chart(x, u) }
}

/// Computes the line with the derivatives along `u`: `ε₁` moves along the line, and `ε₂` changes `u`.
pub(crate) fn line_jet<M: Manifold>(x: &M::Point<f64>, u: &Vector<M>) -> StepPathJet<M> {
    let StepPath { z, d, end } = M::line(x, u);
    let zero = Matrix::<M>::zeros();
    let mut jet = StepPathJet::<M> { z: z.base, dz: zero, d, dd: zero, end, dend: zero };
    for k in 0..M::Dim::LEN {
        let one = |i: usize| if i == k { 1.0 } else { 0.0 };
        let seed = |i| Real::new(u[i] * 0.5, u[i], one(i) * 0.5, one(i));
        let middle = M::chart(x, &Vector::<M, Real>::from_index(seed));
        let q = M::coordinates(&jet.z, &middle);
        let turned = Vector::<M, Dual64>::from_index(|i| Dual64::new(u[i], one(i)));
        let moved = M::coordinates(&jet.end, &M::chart(x, &turned));
        for i in 0..M::Dim::LEN {
            jet.dz[(i, k)] = q[i].eps2;
            jet.dd[(i, k)] = q[i].eps1eps2;
            jet.dend[(i, k)] = moved[i].eps;
        }
    }
    jet
}

/// The point of a straight line of the chart at time `t`, with its first and second derivative.
pub(crate) fn line_at<M: Manifold>(x: &M::Point<f64>, u: &Vector<M>, t: f64) -> M::Point<Real> {
    M::chart(x, &stretched::<M>(u, t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canonical, Euclidean, HalfLine, Product, Rotations, Sphere, laws};
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    /// The laws of the retraction, and that the closed forms are what the chart says.
    fn keeps_the_laws<M: Manifold>(
        space: &M,
        seed: u64,
        numbers: &[f64],
    ) -> Result<(), TestCaseError>
    where
        Canonical: Riemannian<M>,
    {
        let x = space.random(&mut ChaCha8Rng::seed_from_u64(seed));
        let u = Vector::<M>::from_index(|i| numbers[i]);
        laws::retraction::<M, _, _>(&ChartMidpoint, &Canonical, &x, &u)?;
        laws::symmetric_retraction::<M, _, _>(&ChartMidpoint, &Canonical, &x, &M::chart(&x, &u))?;
        let apart = |a: &M::Point<f64>, b: &M::Point<f64>| M::coordinates(a, b).magnitude();
        let (closed, defined) = (M::line_jet(&x, &u), line_jet::<M>(&x, &u));
        let path = line::<M>(&x, &u);
        let mut errors = vec![
            apart(&closed.z, &path.z.base),
            apart(&closed.end, &path.end),
            (closed.d - path.d).magnitude(),
            (closed.dz - defined.dz).max_abs(),
            (closed.dd - defined.dd).max_abs(),
            (closed.dend - defined.dend).max_abs(),
        ];
        for t in [0.0, 1.0] {
            let (closed, defined) = (M::line_at(&x, &u, t), line_at::<M>(&x, &u, t));
            let base = M::real(&closed);
            let (a, b) = (M::coordinates(&base, &closed), M::coordinates(&base, &defined));
            for i in 0..M::Dim::LEN {
                errors.extend([a[i].eps1 - b[i].eps1, a[i].eps1eps2 - b[i].eps1eps2]);
            }
        }
        let worst = errors.into_iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        // Coordinates of at most 2.5 on charts with a unit curvature.
        prop_assert!(worst < 1e-13, "{worst:e}");
        Ok(())
    }

    proptest! {
        #[test]
        fn every_space_keeps_the_laws(
            seed in any::<u64>(), u in prop::array::uniform7(-0.9..0.9),
        ) {
            keeps_the_laws(&Euclidean::<5>, seed, &u)?;
            keeps_the_laws(&HalfLine, seed, &u)?;
            keeps_the_laws(&Sphere::<1>, seed, &u)?;
            keeps_the_laws(&Sphere::<2>, seed, &u)?;
            keeps_the_laws(&Sphere::<7>, seed, &u)?;
            keeps_the_laws(&Rotations, seed, &u)?;
            keeps_the_laws(&Product(Product(Sphere::<2>, HalfLine), Euclidean::<1>), seed, &u)?;
        }
    }

    #[test]
    fn a_line_beyond_the_chart_is_refused() {
        let x = nalgebra::vector![0.0, 0.0, 1.0];
        for u in [nalgebra::vector![3.2, 0.0], nalgebra::vector![f64::NAN, 0.0]] {
            let end = Retraction::<Sphere<2>, _>::end(&ChartMidpoint, &Canonical, &x, &u);
            assert!(matches!(end, Err(MetricError::OutOfChart { .. })), "{end:?}");
        }
        let antipode =
            Retraction::<Sphere<2>, _>::inverse(&ChartMidpoint, &Canonical, &x, &-x).unwrap_err();
        assert!(matches!(antipode, MetricError::OutOfChart { .. } | MetricError::NotFinite { .. }));
        let one = nalgebra::vector![1.0];
        let end = Retraction::<HalfLine, _>::end(&ChartMidpoint, &Canonical, &one, &(one * 1e4));
        assert!(matches!(end, Err(MetricError::NotFinite { .. })), "{end:?}");
    }
}
