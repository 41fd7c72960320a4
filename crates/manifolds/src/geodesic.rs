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
//! Hyper-dual numbers give `g`, `∂g` and `∂∂g`. A geodesic that comes near the edge of its chart goes
//! on in the chart around the point it has reached.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Factors, Matrix, MatrixField, MatrixJet, Real, Scalar, Space,
    Square, Vector, along_slopes,
};
use num_dual::{Dual, Dual64};

pub(crate) use crate::extrapolation::TOLERANCE as ACCURACY;
use crate::extrapolation::{self, State};
use crate::metric::GeodesicEnd;
use crate::{Manifold, MetricError};

/// A piece of a geodesic shorter than this, in a unit of time, is not worth pursuing.
const SHORTEST: f64 = 1e-6;
/// Doublings of a piece of that length, over which an obstacle is looked for.
const LOOK_AHEAD: i32 = 9;
/// Pieces that a geodesic may take, so that one through a very uneven metric comes to an end.
const PIECES: usize = 1024;

/// A point of the phase space of geodesics.
struct Phase<M: Space, D: Scalar> {
    q: Vector<M, D>,
    p: Vector<M, D>,
    /// The size of the chart's coordinates where the geodesic starts, that its accuracy is relative to.
    size: f64,
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

/// `difference / size`, where no difference is none.
fn relative(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

/// The size of the coordinates of the chart at a point.
fn size_at<M: Manifold>(x: &M::Point<f64>) -> f64 {
    let scales = M::scales(x);
    (0..M::Dim::LEN).map(|i| scales[i]).fold(0.0, f64::max)
}

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
        // The derivative of one displacement by another, which begins as a number of order one.
        let dq = (self.dq - other.dq).magnitude() / (1.0 + self.dq.magnitude());
        let dp = relative((self.dp - other.dp).magnitude(), self.dp.magnitude());
        self.at.distance(&other.at).max(dq).max(dp)
    }

    fn is_finite(&self) -> bool {
        self.at.is_finite() && self.dq.magnitude().is_finite() && self.dp.magnitude().is_finite()
    }
}

/// The metric in the frame of the chart, at any scalar.
#[inline]
pub(crate) fn metric<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
) -> Matrix<M, D> {
    M::covariant(x, &field.at(&x.point()))
}

/// The metric at `φ_x(q + ε₁ e_i + ε₂ e_j)`; an index beyond the dimension seeds nothing.
#[inline]
fn seeded<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
    [i, j]: [usize; 2],
) -> Matrix<M, Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    let q = Vector::<M, Real>::from_index(|k| Real::new(q[k], part(k, i), part(k, j), 0.0));
    let at = ChartPoint { base: x.clone(), q };
    M::covariant(&at, &field.at_real(&at.point()))
}

/// The metric and its derivatives along the chart at `x`, at the point with coordinates `q`.
pub(crate) fn metric_jet<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
) -> MatrixJet<M> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    M::covariant_jet(x, q, |i, j| {
        let seed = |k| Real::new(q[k], part(k, i), part(k, j), 0.0);
        field.at_real(&M::chart(x, &Vector::<M, Real>::from_index(seed)))
    })
}

/// A part of a matrix of hyper-dual numbers.
fn part<M: Space>(a: &Matrix<M, Real>, pick: impl Fn(&Real) -> f64) -> Matrix<M> {
    Matrix::<M>::from_entries(|i, j| pick(&a[(i, j)]))
}

/// The rate of a real phase point, from `⌈n/2⌉` evaluations of the metric.
fn rate<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    at: &Phase<M, f64>,
) -> Option<Phase<M, f64>> {
    let g = metric_jet(field, x, &at.q);
    let v = g.value.solve(&at.p)?;
    let force = Vector::<M>::from_index(|k| 0.5 * v.dot(&(g.slopes[k] * v)));
    Some(Phase { q: v, p: force, size: at.size })
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

/// The rate at any scalar, by one more dual number: the definition.
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

/// A point and a velocity of one chart, in the chart centred at the point itself.
fn centred<M: Space, D: Scalar>(
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

/// What stops a geodesic at a real point of a chart, or a little ahead of it.
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
        MetricError::stopped(time, &metric(field, &place))
    })
}

/// The end of a geodesic, unless its metric has no inverse there.
fn ended<M: Space, T>(
    field: &impl MatrixField<M>,
    end: &M::Point<f64>,
    found: Option<T>,
) -> Result<T, MetricError> {
    found.ok_or_else(|| {
        let (at, time) = (ChartPoint::centre(end), 1.0);
        obstacle(field, time, &at, &Vector::<M>::zero()).unwrap_or(MetricError::Edge { time })
    })
}

/// Follows a geodesic for a unit of time: `rate` in the chart at a point, `position` of a state, and
/// `recentre` to the chart at the state itself. The last state is recentred too.
///
/// # Errors
///
/// With the time reached, [`MetricError::Edge`] if the geodesic runs out of the chart,
/// [`MetricError::Degenerate`] where the metric is not positive, and [`MetricError::Uneven`] if it is
/// neither and the pieces are used up, or too short.
fn travel<M: Space, Y: State>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    start: Y,
    rate: impl Fn(&M::Point<f64>, &Y) -> Option<Y>,
    position: impl Fn(&Y) -> Vector<M>,
    recentre: impl Fn(&M::Point<f64>, &Y) -> Option<(M::Point<f64>, Y)>,
) -> Result<(M::Point<f64>, Y), MetricError> {
    let (mut base, mut here) = (x.clone(), start);
    let (mut time, mut h) = (0.0, 1.0_f64);
    for pieces in 1..=PIECES {
        h = h.min(1.0 - time);
        let next = extrapolation::step(&|y: &Y| rate(&base, y), &here, h);
        match next.filter(|next| M::is_near(&position(&next.state))) {
            Some(next) => {
                here = next.state;
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
                let velocity = rate(&base, &here).map(|rate| position(&rate));
                let at = ChartPoint { q: position(&here), base };
                let obstacle =
                    obstacle(field, time, &at, &(velocity.unwrap_or(Vector::<M>::zero()) * h));
                return Err(obstacle.unwrap_or(MetricError::Uneven { time, pieces }));
            }
        }
        let finished = time >= 1.0;
        if finished || !M::is_near(&(position(&here) * 2.0)) {
            (base, here) = recentre(&base, &here).ok_or_else(|| {
                let at = ChartPoint { base: base.clone(), q: position(&here) };
                obstacle(field, time, &at, &Vector::<M>::zero())
                    .unwrap_or(MetricError::Edge { time })
            })?;
        }
        if finished {
            return Ok((base, here));
        }
    }
    Err(MetricError::Uneven { time, pieces: PIECES })
}

/// The geodesic from `x` with velocity `v`, followed for a unit of time at any scalar: its end,
/// centred, and its velocity there.
///
/// # Errors
///
/// Those of [`travel`].
pub(crate) fn follow<M: Manifold, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
    v: &Vector<M, D>,
) -> Result<GeodesicEnd<M, D>, MetricError> {
    let recentre = |base: &M::Point<f64>, y: &Phase<M, D>| {
        let g = metric(field, &ChartPoint { base: base.clone(), q: y.q });
        let (at, v) = centred::<M, D>(base, &y.q, &g.solve(&y.p)?);
        let p = metric(field, &at) * v;
        Some((at.base, Phase { q: at.q, p, size: y.size }))
    };
    let size = size_at::<M>(&x.base);
    let start = Phase::<M, D> { q: x.q, p: metric(field, x) * *v, size };
    let rate = |base: &M::Point<f64>, y: &Phase<M, D>| rate_at_scalar(field, base, y);
    let (base, end) = travel::<M, _>(field, &x.base, start, rate, |y| y.q.real(), recentre)?;
    let end_point = ChartPoint { base, q: end.q };
    let v = metric(field, &end_point).solve(&end.p);
    let v = ended(field, &end_point.base, v)?;
    Ok((end_point, v))
}

/// The same from a real point: the end and the velocity there, in the frame of the chart at the end.
///
/// # Errors
///
/// Those of [`follow`].
pub(crate) fn follow_real<M: Manifold>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Result<(M::Point<f64>, Vector<M>), MetricError> {
    let value = |at: &ChartPoint<M>| metric(field, at);
    let recentre = |base: &M::Point<f64>, y: &Phase<M, f64>| {
        let g = value(&ChartPoint { base: base.clone(), q: y.q });
        let (at, v) = centred::<M, f64>(base, &y.q, &g.solve(&y.p)?);
        let p = value(&at) * v;
        Some((at.base, Phase { q: Vector::<M>::zero(), p, size: y.size }))
    };
    let (q, p) = (Vector::<M>::zero(), value(&ChartPoint::centre(x)) * *v);
    let start = Phase::<M, f64> { q, p, size: size_at::<M>(x) };
    let (end, y) =
        travel::<M, _>(field, x, start, |base, y| rate(field, base, y), |y| y.q, recentre)?;
    let v = value(&ChartPoint::centre(&end)).solve(&y.p);
    let v = ended(field, &end, v)?;
    Ok((end, v))
}

/// A real point of a geodesic, its velocity, and the derivatives of both along a parameter of `n`
/// directions, in the frame of the chart at the point.
pub(crate) struct GeodesicJet<M: Space> {
    pub(crate) point: M::Point<f64>,
    pub(crate) velocity: Vector<M>,
    pub(crate) dpoint: Matrix<M>,
    pub(crate) dvelocity: Matrix<M>,
}

/// Follows a geodesic with its derivatives for a unit of time.
///
/// # Errors
///
/// Those of [`follow`].
pub(crate) fn follow_jet<M: Manifold>(
    field: &impl MatrixField<M>,
    start: &GeodesicJet<M>,
) -> Result<GeodesicJet<M>, MetricError> {
    let recentre = |base: &M::Point<f64>, y: &Bundle<M>| {
        let jet = into_velocities(field, base, y)?;
        let centred = recentred(base, &y.at.q, &jet);
        let bundle = into_momenta(field, &centred, y.at.size);
        Some((centred.point, bundle))
    };
    let bundle = into_momenta(field, start, size_at::<M>(&start.point));
    let rate = |base: &M::Point<f64>, y: &Bundle<M>| rate_of_bundle(field, base, y);
    let (base, end) = travel::<M, _>(field, &start.point, bundle, rate, |y| y.at.q, recentre)?;
    ended(field, &base, into_velocities(field, &base, &end))
}

/// Columns `(∂_k g) v` at a real point of a chart, with `g` itself.
fn dg_v<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
    v: &Vector<M>,
) -> (Matrix<M>, Matrix<M>) {
    let g = metric_jet(field, x, q);
    (g.value, along_slopes::<M>(&g.slopes, v))
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
    let (g, _) = dg_v(field, x, &y.at.q, &Vector::<M>::zero());
    let factors = g.factor()?;
    let velocity = factors.solve(&y.at.p)?;
    let (_, dg_v) = dg_v(field, x, &y.at.q, &velocity);
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

/// A jet at the point with coordinates `q` of the chart at `x`, in the chart at that point.
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

/// The acceleration `−Γ(v, v)` of the geodesic through a real point, with the Christoffel symbols of
/// the metric: `g a = ½∇(vᵀ g v) − (∂_v g) v`.
pub(crate) fn acceleration<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Option<Vector<M>> {
    let (g, dg_v) = dg_v(field, x, &Vector::<M>::zero(), v);
    g.solve(&(dg_v.transpose_times(v) * 0.5 - dg_v * *v))
}
