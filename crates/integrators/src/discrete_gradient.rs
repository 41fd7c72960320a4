//! Discrete gradients: covectors that account exactly for the change of a function along a step.
//!
//! | type | mean covector `w̄` | order of a symmetric scheme | fields per step |
//! |---|---|---|---|
//! | [`Gonzalez`] | `dF(z)` | 2 | one differential |
//! | [`MeanValue`] | `∫₀¹ dF(φ_z(q(s))) ds`, `q` the segment in the chart at `z` | 2 | four differentials |
//! | [`ItohAbe`] | difference quotients, one coordinate of that chart after the other | 1 | `n + 1` values, `4n` slopes where they are small |
//! | [`SymmetricItohAbe`] | the mean of these from `x` to `x'` and from `x'` to `x` | 2 | twice as many |
//!
//! Each is completed by the correction of Gonzalez (1996),
//!
//! ```math
//! w = \bar w + \frac{F(x') - F(x) - \langle\bar w, d\rangle}{G(d, d)}\, \flat d ,
//! \qquad \langle w, d\rangle = F(x') - F(x) ,
//! ```
//!
//! with the displacement `d = hv` of the step's path. It is all there is to [`Gonzalez`]; for the
//! others it is the defect of the quadrature, and of a chart that is not normal for the metric.

mod gonzalez;
mod itoh_abe;
mod mean_value;

pub use gonzalez::Gonzalez;
pub use itoh_abe::{ItohAbe, SymmetricItohAbe};
pub use mean_value::MeanValue;

use std::fmt::Debug;

use metriplectic_fields::{ChartPoint, Column, Matrix, Scalar, ScalarField, Space, Square, Vector};
use metriplectic_manifolds::{
    InnerProduct, Manifold, MetricError, Retraction, Riemannian, StepPath, StepPathJet,
};
use num_dual::Dual64;

use crate::round_off::stable_gradient::{Segment, StableGradient};
use crate::step::GradientKind;

/// A discrete gradient on a manifold (Bloch, Farré Puiggalí, Martín de Diego 2024, eq. "discGrad-m",
/// with the missing step size restored): a covector `w` at the base `z` of a path from `x` to `x'`
/// with the displacement `d`.
///
/// The one method to write is [`mean`](Self::mean), at any scalar.
///
/// Laws ([`laws::discrete_gradient`](crate::laws::discrete_gradient)): 1. `⟨w, d⟩ = F(x') − F(x)`;
/// 2. `w → dF(z)` as the points meet; 3. what is evaluated safely is the definition.
pub trait DiscreteGradient: Copy + Debug + Send + Sync {
    /// Names it, if it is one of this library.
    #[doc(hidden)]
    const KIND: Option<GradientKind> = None;

    /// The covector `w̄` before its correction, in the frame of the chart of the base point.
    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D>;

    /// Computes the mean covector at real points.
    #[inline]
    fn real_mean<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M>,
    ) -> Vector<M> {
        self.mean(f, x, path)
    }

    /// Computes the mean covector at real points, with its derivatives along the unknown of the path, in a chart that
    /// stays where it is.
    #[inline]
    fn mean_jet<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPathJet<M>,
    ) -> (Vector<M>, Matrix<M>) {
        by_dual_numbers(self, f, x, path)
    }

    /// Says whether the mean covector is the differential `dF(z)`.
    const IS_DIFFERENTIAL: bool = false;

    /// Computes the mean covector with its derivatives along the unknowns of the paths from either end of a step, which have one
    /// base.
    #[inline]
    fn mean_jets<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        [x, y]: [&M::Point<f64>; 2],
        [there, back]: [&StepPathJet<M>; 2],
    ) -> (Vector<M>, [Matrix<M>; 2]) {
        let (mean, slope) = self.mean_jet(f, x, there);
        (mean, [slope, self.mean_jet(f, y, back).1])
    }

    /// The slope `⟨dF(z), d⟩` at the base point.
    #[inline]
    fn slope_at_base<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        z: &M::Point<f64>,
        d: &Vector<M>,
        _mean: &Vector<M>,
    ) -> f64 {
        f.jet1(z).df.dot(d)
    }

    /// The covector `w` by its definition, from the value `start = F(x)`; a step evaluates it by
    /// [`StableGradient`], which is safe against round-off.
    fn covector<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        g: &impl InnerProduct<Vector<M, D>>,
        (x, start): (&M::Point<f64>, f64),
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        let mean = self.mean(f, x, path);
        let flat = g.flat(&path.d);
        let defect = f.at(&path.end) - start - mean.dot(&path.d);
        mean + flat * (defect / flat.dot(&path.d))
    }
}

/// The discrete gradient of `f` on the path with the initial displacement `u` from `x`, safe against
/// round-off: the covector at the base point with `⟨w, d⟩ = F(x') − F(x)`.
///
/// # Errors
///
/// [`MetricError`] if the path cannot be followed.
pub fn along<M, G, R, W>(
    gradient: &W,
    f: &impl ScalarField<M>,
    metric: &G,
    retraction: &R,
    (x, u): (&M::Point<f64>, &Vector<M>),
) -> Result<Vector<M>, MetricError>
where
    M: Manifold,
    G: Riemannian<M>,
    R: Retraction<M, G>,
    W: DiscreteGradient,
{
    let path = retraction.real_step_path(metric, x, u)?;
    let (g, mean) = (metric.at(&path.z)?, gradient.real_mean(f, x, &path));
    let values = [f.at(x), f.at(&path.end)];
    let nodes = retraction.along(metric, x, u)?;
    let base = || gradient.slope_at_base(f, &path.z.base, &path.d, &mean);
    let stable =
        StableGradient::new(f, &mean, &Segment::new(&path.d, &path.end), values, base, || nodes);
    Ok(stable.covector(0.0, &g, &path.d))
}

/// The definition of [`DiscreteGradient::mean_jet`]: one dual number for each direction.
fn by_dual_numbers<M: Manifold>(
    gradient: &impl DiscreteGradient,
    f: &impl ScalarField<M>,
    x: &M::Point<f64>,
    jet: &StepPathJet<M>,
) -> (Vector<M>, Matrix<M>) {
    let along = |value: &Vector<M>, slope: &Matrix<M>, k: usize| {
        Vector::<M, Dual64>::from_index(|i| Dual64::new(value[i], slope[(i, k)]))
    };
    let (zero, mut value) = (Vector::<M>::zero(), Vector::<M>::zero());
    let slope = Matrix::<M>::from_columns(|k| {
        let path = StepPath {
            z: ChartPoint { base: jet.z.clone(), q: along(&zero, &jet.dz, k) },
            d: along(&jet.d, &jet.dd, k),
            end: M::chart(&jet.end, &along(&zero, &jet.dend, k)),
        };
        let mean = gradient.mean(f, x, &path);
        value = mean.real();
        Vector::<M>::from_index(|i| mean[i].eps)
    });
    (value, slope)
}

/// The ends of a path in the chart at its base.
fn segment<M: Manifold, D: Scalar>(
    x: &M::Point<f64>,
    path: &StepPath<M, D>,
) -> (Vector<M, D>, Vector<M, D>) {
    let base = &path.z.base;
    (M::coordinates(base, &M::constant(x)), M::coordinates(base, &path.end))
}

/// The partial derivative `∂f/∂qⁱ` at the coordinates `q` in the chart at `x`.
fn partial<M: Space, D: Scalar>(
    f: &impl ScalarField<M>,
    x: &M::Point<f64>,
    q: &Vector<M, D>,
    i: usize,
) -> D {
    use num_dual::Dual;
    let seed = |k| Dual::new(q[k], if k == i { D::one() } else { D::zero() });
    f.at(&M::chart(x, &Vector::<M, Dual<D>>::from_index(seed))).eps
}

/// Nodes and weights of the Gauss-Legendre rule of order 8 on `[0, 1]`.
pub(crate) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gauss_rule_is_exact_to_degree_seven() {
        for degree in 0..8 {
            let sum: f64 = GAUSS.iter().map(|(s, weight)| weight * s.powi(degree)).sum();
            assert!((sum - f64::from(degree + 1).recip()).abs() < 1e-16, "degree {degree}");
        }
    }
}
