//! The metric around one `θ`, in which geodesics have derivatives along the parameters.

use metriplectic_fields::{
    ChartPoint, Column as _, Dimension, Form, Real, Space as _, Vector, Velocity, power_of_two,
};
use nalgebra::SVector;

use super::{ParametricMetric, Wide, block};
use crate::{Euclidean, Manifold, Times};

/// The cometric of the parameters on the way of a geodesic, relative to that of the state: so small that they stay.
const STILL: f64 = 1.0 / (1_u128 << 100) as f64;

/// The metric around one `θ`, in units in which the parameters change it as much as the path is long.
pub(super) struct Near<'a, F, const P: usize> {
    field: &'a F,
    theta: SVector<f64, P>,
    pub(super) units: SVector<f64, P>,
    diagonal: f64,
}

impl<F, const P: usize> Near<'_, F, P> {
    /// The closure `|x, τ| -> g(x, θ + s τ)` on the product.
    pub(super) fn matrix<M>(
        &self,
        (x, tau): &(M::Point<Real>, SVector<Real, P>),
    ) -> Form<Wide<M, P>, Real>
    where
        M: Times<Euclidean<P>>,
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        let theta = SVector::<Real, P>::from_fn(|k, _| tau[k] * self.units[k] + self.theta[k]);
        block::<M, P>(&(self.field)(x, &theta), self.diagonal)
    }
}

impl<F> ParametricMetric<F> {
    /// The metric near `θ`, for a path from `x` with the velocity `d`.
    pub(super) fn near<M, const P: usize>(
        &self,
        x: &M::Point<f64>,
        theta: &SVector<f64, P>,
        d: &Vector<M>,
    ) -> Near<'_, F, P>
    where
        M: Manifold + Times<Euclidean<P>>,
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        let place = (x.clone(), *theta);
        let seeded = Wide::<M, P>::seeds(&place);
        let n = <M::Velocity as Dimension>::LEN;
        let largest = |form: &Form<M, Real>, part: fn(&Real) -> f64| {
            let entries = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
            entries.fold(0.0, |most: f64, (i, j)| most.max(part(&form[(i, j)]).abs()))
        };
        let at = |k: usize| {
            let (x, t) = seeded(M::Dim::LEN + k, M::Dim::LEN + k);
            (self.0)(&x, &t)
        };
        let unit = |size: f64| {
            if size > 0.0 && size.is_finite() { power_of_two(size) } else { 1.0 }
        };
        let length = Velocity::<M>::magnitude(&M::embed(&ChartPoint::centre(x), d));
        let size = largest(&at(0), |g| g.re);
        let units =
            SVector::from_fn(|k, _| unit(size / largest(&at(k), |g| g.eps1)) / unit(length));
        Near { field: &self.0, theta: *theta, units, diagonal: unit(size) / STILL }
    }
}
