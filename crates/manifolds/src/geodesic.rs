//! Geodesics of a metric that is given as a matrix field, in one chart after the other.
//!
//! In Hamiltonian form, with `p = g v` and the Hamiltonian `½ p·g⁻¹p`,
//!
//! ```math
//! q' = g^{-1} p, \qquad p'_k = \tfrac12\, v^T (\partial_k g)\, v, \qquad v = g^{-1} p ,
//! ```
//!
//! so that only first derivatives of the metric appear, and with the derivatives `δq`, `δp` along the
//! initial velocity
//!
//! ```math
//! \delta q' = \delta v = g^{-1} \bigl( \delta p - (\partial_{\delta q} g) v \bigr), \qquad
//! \delta p'_k = v^T (\partial_k g)\, \delta v
//!             + \tfrac12\, v^T (\partial_{\delta q} \partial_k g)\, v .
//! ```
//!
//! Hyper-dual numbers give `g`, `∂g` and `∂∂g`. A geodesic near the edge of its chart continues in the chart
//! around the point that it has reached.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, MatrixJet, Scalar, Space, Square, Vector,
    along_slopes,
};
use num_dual::Dual;

use crate::chart_metric::{metric, metric_jet};
pub(crate) use crate::extrapolation::TOLERANCE as ACCURACY;
use crate::extrapolation::{self, Start, State};
use crate::metric::GeodesicEnd;
use crate::metric_error::stopped;
use crate::{Manifold, MetricError};

/// The shortest piece of a geodesic, in a unit of time.
const SHORTEST: f64 = 1e-6;
/// Doublings of this length, over which an obstacle is looked for.
const LOOK_AHEAD: i32 = 9;
/// The number of pieces of a geodesic, which bounds the cost in a very uneven metric.
const PIECES: usize = 1024;

/// A point of the phase space of geodesics.
pub(crate) struct Phase<M: Space, D: Scalar> {
    pub(crate) q: Vector<M, D>,
    pub(crate) p: Vector<M, D>,
    /// The size of the coordinates of the chart at the start of the geodesic. The accuracy is relative to it.
    pub(crate) size: f64,
}

// By hand, because a derive would ask it of `M`.
impl<M: Space, D: Scalar> Clone for Phase<M, D> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Space, D: Scalar> Copy for Phase<M, D> {}

impl<M: Space, D: Scalar> State for Phase<M, D> {
    fn plus(&self, other: &Self, h: f64) -> Self {
        let h = D::from(h);
        Self { q: self.q + other.q * h, p: self.p + other.p * h, size: self.size }
    }

    fn distance(&self, other: &Self) -> f64 {
        let q = relative((self.q - other.q).magnitude(), self.size + self.q.magnitude());
        let p = relative((self.p - other.p).magnitude(), self.p.magnitude());
        q.max(p)
    }

    fn is_finite(&self) -> bool {
        self.q.is_finite() && self.p.is_finite()
    }
}

/// Divides a difference by a size; 0 if the difference is 0.
pub(crate) fn relative(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

/// The size of the coordinates of the chart at a point.
pub(crate) fn size_at<M: Manifold>(x: &M::Point<f64>) -> f64 {
    let scales = M::scales(x);
    (0..M::Dim::LEN).map(|i| scales[i]).fold(0.0, f64::max)
}

/// The rate of a real phase point, from `⌈n/2⌉` evaluations of the metric.
fn rate<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    at: &Phase<M, f64>,
) -> Option<Phase<M, f64>> {
    let g = metric_jet(field, x, &at.q);
    let v = g.value.solve(&at.p)?;
    Some(Phase { q: v, p: force(&g, &v), size: at.size })
}

/// The rate `½ vᵀ (∂_k g) v` of the momentum.
fn force<M: Space>(g: &MatrixJet<M>, v: &Vector<M>) -> Vector<M> {
    Vector::<M>::from_index(|k| 0.5 * v.dot(&(g.slopes[k] * *v)))
}

/// The rate at any scalar by its definition, with one more dual number.
fn rate_at_scalar<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    at: &Phase<M, D>,
) -> Option<Phase<M, D>> {
    let mut value = Matrix::<M, D>::zeros();
    let slopes = M::Dim::array(|k| {
        let q = Vector::<M, Dual<D>>::from_index(|i| {
            Dual::new(at.q[i], if i == k { D::one() } else { D::zero() })
        });
        let g = metric(field, &ChartPoint { base: x.clone(), q });
        value = Matrix::<M, D>::from_entries(|i, j| g[(i, j)].re);
        Matrix::<M, D>::from_entries(|i, j| g[(i, j)].eps)
    });
    let v = value.solve(&at.p)?;
    let p = Vector::<M, D>::from_index(|k| v.dot(&(slopes[k] * v)) * 0.5);
    Some(Phase { q: v, p, size: at.size })
}

/// Converts a point and a velocity of a chart to the chart centred at the point.
pub(crate) fn centred<M: Space, D: Scalar>(
    x: &M::Point<f64>,
    q: &Vector<M, D>,
    v: &Vector<M, D>,
) -> GeodesicEnd<M, D> {
    let moving = Vector::<M, Dual<D>>::from_index(|i| Dual::new(q[i], v[i]));
    let point = M::chart(x, &moving);
    let base = M::real(&point);
    let q = M::coordinates(&base, &point);
    let velocity = Vector::<M, D>::from_index(|i| q[i].eps);
    (ChartPoint { base, q: Vector::<M, D>::from_index(|i| q[i].re) }, velocity)
}

/// Finds what stops a geodesic at a real point of a chart, or a little ahead of it.
#[cold]
fn obstacle<M: Space>(
    field: &impl MatrixField<M>,
    time: f64,
    at: &ChartPoint<M>,
    ahead: &Vector<M>,
) -> Option<MetricError> {
    let places = (0..=LOOK_AHEAD).map(|k| if k == 0 { 0.0 } else { 2_f64.powi(k) });
    places.into_iter().find_map(|t| {
        let place = ChartPoint { base: at.base.clone(), q: at.q + *ahead * t };
        stopped(time, &metric(field, &place))
    })
}

/// Returns the end of a geodesic, or the error of a metric without an inverse there.
pub(crate) fn ended<M: Space, T>(
    field: &impl MatrixField<M>,
    end: &M::Point<f64>,
    found: Option<T>,
) -> Result<T, MetricError> {
    found.ok_or_else(|| {
        let (at, time) = (ChartPoint::centre(end), 1.0);
        obstacle(field, time, &at, &Vector::<M>::zero()).unwrap_or(MetricError::Edge { time })
    })
}

/// Where a geodesic starts in the chart at a point.
pub(crate) struct Departure<'a, M: Space, Y> {
    pub(crate) point: &'a M::Point<f64>,
    pub(crate) state: Y,
    /// The rate there, if it is known.
    pub(crate) slope: Option<Y>,
}

/// Follows a geodesic for a unit of time: `rate` in the chart at a point, `position` of a state, and
/// `recentre` to the chart at the state itself. Returns the last state in the chart at the point.
///
/// # Errors
///
/// With the time reached, [`MetricError::Edge`] if the geodesic runs out of the chart,
/// [`MetricError::Degenerate`] where the metric is not positive, and [`MetricError::Uneven`] if it is
/// neither and the pieces are used up, or too short.
pub(crate) fn travel<M: Space, Y: State>(
    field: &impl MatrixField<M>,
    start: Departure<'_, M, Y>,
    rate: impl Fn(&M::Point<f64>, &Y) -> Option<Y>,
    position: impl Fn(&Y) -> Vector<M>,
    recentre: impl Fn(&M::Point<f64>, &Y) -> Option<(M::Point<f64>, Y)>,
) -> Result<(M::Point<f64>, Y), MetricError> {
    let Departure { point, state: mut here, mut slope } = start;
    let mut base = point.clone();
    let (mut time, mut h) = (0.0, 1.0_f64);
    for pieces in 1..=PIECES {
        h = h.min(1.0 - time);
        slope = slope.or_else(|| rate(&base, &here));
        let next = slope.and_then(|slope| {
            extrapolation::step(&|y: &Y| rate(&base, y), &Start { state: here, slope }, h)
        });
        match next.filter(|next| M::is_near(&position(&next.state))) {
            Some(next) => {
                (here, slope) = (next.state, None);
                // A sum of halves and quarters is exact.
                time += h;
                if next.easy {
                    h *= 2.0;
                }
            }
            None if h > SHORTEST => {
                h *= 0.5;
                continue;
            }
            None => {
                let velocity = slope.map(|rate| position(&rate));
                let at = ChartPoint { q: position(&here), base };
                let obstacle =
                    obstacle(field, time, &at, &(velocity.unwrap_or(Vector::<M>::zero()) * h));
                return Err(obstacle.unwrap_or(MetricError::Uneven { time, pieces }));
            }
        }
        if time >= 1.0 {
            return Ok((base, here));
        }
        if !M::is_near(&(position(&here) * 2.0)) {
            (base, here) = recentre(&base, &here).ok_or_else(|| {
                let at = ChartPoint { base: base.clone(), q: position(&here) };
                obstacle(field, time, &at, &Vector::<M>::zero())
                    .unwrap_or(MetricError::Edge { time })
            })?;
        }
    }
    Err(MetricError::Uneven { time, pieces: PIECES })
}

/// Follows the geodesic from `x` with velocity `v` for a unit of time, at any scalar. Returns its end, centred,
/// and its velocity there.
///
/// # Errors
///
/// The errors of [`travel`].
pub(crate) fn follow<M: Manifold, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
    v: &Vector<M, D>,
) -> Result<GeodesicEnd<M, D>, MetricError> {
    let end = |base: &M::Point<f64>, y: &Phase<M, D>| {
        let g = metric(field, &ChartPoint { base: base.clone(), q: y.q });
        Some(centred::<M, D>(base, &y.q, &g.solve(&y.p)?))
    };
    let recentre = |base: &M::Point<f64>, y: &Phase<M, D>| {
        let (at, v) = end(base, y)?;
        let p = metric(field, &at) * v;
        Some((at.base, Phase { q: at.q, p, size: y.size }))
    };
    let size = size_at::<M>(&x.base);
    let state = Phase::<M, D> { q: x.q, p: metric(field, x) * *v, size };
    let rate = |base: &M::Point<f64>, y: &Phase<M, D>| rate_at_scalar(field, base, y);
    let start = Departure { point: &x.base, state, slope: None };
    let (base, y) = travel(field, start, rate, |y| y.q.real(), recentre)?;
    ended(field, &base, end(&base, &y))
}

/// Where a geodesic from a real point ends, in the last of its charts.
pub(crate) struct Arrival<M: Space> {
    /// The centre of this chart.
    base: M::Point<f64>,
    end: Phase<M, f64>,
}

impl<M: Manifold> Arrival<M> {
    /// Follows the geodesic from `x` with velocity `v` for a unit of time.
    ///
    /// # Errors
    ///
    /// The errors of [`travel`].
    pub(crate) fn of(
        field: &impl MatrixField<M>,
        x: &M::Point<f64>,
        v: &Vector<M>,
    ) -> Result<Self, MetricError> {
        let recentre = |base: &M::Point<f64>, y: &Phase<M, f64>| {
            let (end, v) = centred_real(field, base, y)?;
            let p = metric(field, &ChartPoint::<M>::centre(&end)) * v;
            Some((end, Phase { q: Vector::<M>::zero(), p, size: y.size }))
        };
        let (q, size) = (Vector::<M>::zero(), size_at::<M>(x));
        let g = metric_jet(field, x, &q);
        let state = Phase::<M, f64> { q, p: g.value * *v, size };
        let slope = Phase { q: *v, p: force(&g, v), size };
        // A metric without an inverse has no geodesics, whatever the velocity is.
        let slope = g.value.factor().is_some().then_some(slope);
        let start = Departure { point: x, state, slope };
        let rate = |base: &M::Point<f64>, y: &Phase<M, f64>| rate(field, base, y);
        let (base, end) = travel(field, start, rate, |y| y.q, recentre)?;
        Ok(Self { base, end })
    }

    /// The end, without an evaluation of the metric.
    pub(crate) fn point(&self) -> M::Point<f64> {
        M::chart(&self.base, &self.end.q)
    }

    /// The end with the velocity in the frame of the chart there.
    ///
    /// # Errors
    ///
    /// The error of a metric without an inverse there.
    pub(crate) fn with_velocity(
        &self,
        field: &impl MatrixField<M>,
    ) -> Result<(M::Point<f64>, Vector<M>), MetricError> {
        ended(field, &self.base, centred_real(field, &self.base, &self.end))
    }
}

/// The point and the velocity of a phase point in the chart at `x`, in the chart at the point itself.
fn centred_real<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    y: &Phase<M, f64>,
) -> Option<(M::Point<f64>, Vector<M>)> {
    let g = metric(field, &ChartPoint::<M> { base: x.clone(), q: y.q });
    let (at, v) = centred::<M, f64>(x, &y.q, &g.solve(&y.p)?);
    Some((at.base, v))
}

/// Follows a geodesic from a real point. Returns the end, and the velocity in the frame of the chart there.
///
/// # Errors
///
/// The errors of [`follow`].
pub(crate) fn follow_real<M: Manifold>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Result<(M::Point<f64>, Vector<M>), MetricError> {
    Arrival::of(field, x, v)?.with_velocity(field)
}

/// Computes the acceleration `−Γ(v, v)` of the geodesic through a real point, with the Christoffel symbols of
/// the metric.
pub(crate) fn acceleration<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Option<Vector<M>> {
    bend(&metric_jet(field, x, &Vector::<M>::zero()), v)
}

/// Computes the acceleration from the metric at a point: `g a = ½∇(vᵀ g v) − (∂_v g) v`.
fn bend<M: Space>(g: &MatrixJet<M>, v: &Vector<M>) -> Option<Vector<M>> {
    let dg_v = along_slopes::<M>(&g.slopes, v);
    g.value.solve(&(dg_v.transpose_times(v) * 0.5 - dg_v * *v))
}
