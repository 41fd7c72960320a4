//! Geodesics with their derivatives along the initial velocity.

use metriplectic_fields::{
    Column, Dimension, Factors, Matrix, MatrixField, Space, Square, Vector, along_slopes,
};
use num_dual::Dual64;

use crate::chart_metric::{dg_v, metric_jet, part, seeded};
use crate::extrapolation::State;
use crate::geodesic::{Departure, Phase, centred, ended, relative, size_at, travel};
use crate::{Manifold, MetricError};

/// A point of the phase space with its derivatives along the initial velocity.
struct Bundle<M: Space> {
    at: Phase<M, f64>,
    dq: Matrix<M>,
    dp: Matrix<M>,
}

impl<M: Space> Clone for Bundle<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Space> Copy for Bundle<M> {}

impl<M: Space> State for Bundle<M> {
    fn plus(&self, other: &Self, h: f64) -> Self {
        let at = self.at.plus(&other.at, h);
        Self { at, dq: self.dq + other.dq * h, dp: self.dp + other.dp * h }
    }

    fn distance(&self, other: &Self) -> f64 {
        // The derivative of a displacement by another, which is of order one at the start.
        let dq = (self.dq - other.dq).magnitude() / (1.0 + self.dq.magnitude());
        let dp = relative((self.dp - other.dp).magnitude(), self.dp.magnitude());
        self.at.distance(&other.at).max(dq).max(dp)
    }

    fn is_finite(&self) -> bool {
        self.at.is_finite() && self.dq.magnitude().is_finite() && self.dp.magnitude().is_finite()
    }
}

/// The rate of a phase point with its derivatives, from `n(n+1)/2` evaluations of the metric.
fn rate_of_bundle<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    bundle: &Bundle<M>,
) -> Option<Bundle<M>> {
    let n = M::Dim::LEN;
    let Bundle { at, dq, dp } = bundle;
    let first = seeded(field, x, &at.q, [0, 0]);
    let factors = part::<M>(&first, |g| g.re).factor()?;
    let v = factors.solve(&at.p)?;
    // Columns (∂_k g) v, and the symmetric matrix ½ vᵀ (∂_j ∂_k g) v.
    let (mut dg_v, mut bend) = (Matrix::<M>::zeros(), Matrix::<M>::zeros());
    for k in 0..n {
        for j in k..n {
            let g = if (j, k) == (0, 0) { first } else { seeded(field, x, &at.q, [k, j]) };
            let second = 0.5 * v.dot(&(part::<M>(&g, |g| g.eps1eps2) * v));
            (bend[(j, k)], bend[(k, j)]) = (second, second);
            if j == k {
                let column = part::<M>(&g, |g| g.eps1) * v;
                for i in 0..n {
                    dg_v[(i, k)] = column[i];
                }
            }
        }
    }
    let force = dg_v.transpose_times(&v) * 0.5;
    let (lag, mut dv) = (*dp - dg_v * *dq, Matrix::<M>::zeros());
    for k in 0..n {
        let column = Vector::<M>::from_index(|i| lag[(i, k)]);
        let column = factors.solve(&column)?;
        for i in 0..n {
            dv[(i, k)] = column[i];
        }
    }
    let transposed = Matrix::<M>::from_entries(|i, j| dg_v[(j, i)]);
    Some(Bundle {
        at: Phase { q: v, p: force, size: at.size },
        dq: dv,
        dp: transposed * dv + bend * *dq,
    })
}

/// A real point of a geodesic, its velocity, and the derivatives of both along a parameter of `n`
/// directions, in the frame of the chart at the point.
pub(crate) struct GeodesicJet<M: Space> {
    pub(crate) point: M::Point<f64>,
    pub(crate) velocity: Vector<M>,
    pub(crate) dpoint: Matrix<M>,
    pub(crate) dvelocity: Matrix<M>,
}

/// Where a geodesic with derivatives ends, in the last of its charts.
pub(crate) struct ArrivalJet<M: Space> {
    /// The centre of this chart.
    base: M::Point<f64>,
    end: Bundle<M>,
}

impl<M: Manifold> ArrivalJet<M> {
    /// Follows the geodesic for a unit of time.
    ///
    /// # Errors
    ///
    /// The errors of [`travel`].
    pub(crate) fn of(
        field: &impl MatrixField<M>,
        start: &GeodesicJet<M>,
    ) -> Result<Self, MetricError> {
        let recentre = |base: &M::Point<f64>, y: &Bundle<M>| {
            let jet = into_velocities(field, base, y)?;
            let centred = recentred(base, &y.at.q, &jet);
            let bundle = into_momenta(field, &centred, y.at.size);
            Some((centred.point, bundle))
        };
        let state = into_momenta(field, start, size_at::<M>(&start.point));
        let rate = |base: &M::Point<f64>, y: &Bundle<M>| rate_of_bundle(field, base, y);
        let departure = Departure { point: &start.point, state, slope: None };
        let (base, end) = travel(field, departure, rate, |y| y.at.q, recentre)?;
        Ok(Self { base, end })
    }

    /// The end with its velocity, in the frame of the chart there.
    ///
    /// # Errors
    ///
    /// The error of a metric without an inverse there.
    pub(crate) fn jet(&self, field: &impl MatrixField<M>) -> Result<GeodesicJet<M>, MetricError> {
        let jet = into_velocities(field, &self.base, &self.end);
        let jet = jet.map(|jet| recentred(&self.base, &self.end.at.q, &jet));
        ended(field, &self.base, jet)
    }

    /// The derivative of the end in the chart there, without an evaluation of the metric.
    pub(crate) fn derivative(&self) -> Matrix<M> {
        let Bundle { at, dq, .. } = &self.end;
        let point = M::chart(&self.base, &at.q);
        Matrix::<M>::from_columns(|k| {
            let moved = Vector::<M, Dual64>::from_index(|i| Dual64::new(at.q[i], dq[(i, k)]));
            let end = M::coordinates(&point, &M::chart(&self.base, &moved));
            Vector::<M>::from_index(|i| end[i].eps)
        })
    }
}

/// Follows a geodesic with its derivatives for a unit of time.
///
/// # Errors
///
/// The errors of [`travel`].
#[cfg(all(feature = "argmin", not(all(target_arch = "wasm32", target_os = "unknown"))))]
pub(crate) fn follow<M: Manifold>(
    field: &impl MatrixField<M>,
    start: &GeodesicJet<M>,
) -> Result<GeodesicJet<M>, MetricError> {
    ArrivalJet::of(field, start)?.jet(field)
}

/// `p = g v` and `δp = g δv + (∂_δq g) v`, at the centre of a chart.
fn into_momenta<M: Space>(
    field: &impl MatrixField<M>,
    jet: &GeodesicJet<M>,
    size: f64,
) -> Bundle<M> {
    let (g, dg_v) = dg_v(field, &jet.point, &Vector::<M>::zero(), &jet.velocity);
    Bundle {
        at: Phase { q: Vector::<M>::zero(), p: g * jet.velocity, size },
        dq: jet.dpoint,
        dp: g * jet.dvelocity + dg_v * jet.dpoint,
    }
}

/// The inverse of [`into_momenta`], at a point of the chart at `x`, in the frame of that chart.
fn into_velocities<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    y: &Bundle<M>,
) -> Option<GeodesicJet<M>> {
    let g = metric_jet(field, x, &y.at.q);
    let factors = g.value.factor()?;
    let velocity = factors.solve(&y.at.p)?;
    let dg_v = along_slopes::<M>(&g.slopes, &velocity);
    let lag = y.dp - dg_v * y.dq;
    let mut dvelocity = Matrix::<M>::zeros();
    for k in 0..M::Dim::LEN {
        let column = Vector::<M>::from_index(|i| lag[(i, k)]);
        let column = factors.solve(&column)?;
        for i in 0..M::Dim::LEN {
            dvelocity[(i, k)] = column[i];
        }
    }
    Some(GeodesicJet { point: x.clone(), velocity, dpoint: y.dq, dvelocity })
}

/// Converts a jet at the point with coordinates `q` of the chart at `x` to the chart at this point.
fn recentred<M: Space>(x: &M::Point<f64>, q: &Vector<M>, jet: &GeodesicJet<M>) -> GeodesicJet<M> {
    let mut result = GeodesicJet::<M> {
        point: x.clone(),
        velocity: jet.velocity,
        dpoint: Matrix::<M>::zeros(),
        dvelocity: Matrix::<M>::zeros(),
    };
    for k in 0..M::Dim::LEN {
        let moved = Vector::<M, Dual64>::from_index(|i| Dual64::new(q[i], jet.dpoint[(i, k)]));
        let velocity = Vector::<M, Dual64>::from_index(|i| {
            Dual64::new(jet.velocity[i], jet.dvelocity[(i, k)])
        });
        let (point, velocity) = centred::<M, Dual64>(x, &moved, &velocity);
        for i in 0..M::Dim::LEN {
            result.dpoint[(i, k)] = point.q[i].eps;
            result.dvelocity[(i, k)] = velocity[i].eps;
            result.velocity[i] = velocity[i].re;
        }
        result.point = point.base;
    }
    result
}
