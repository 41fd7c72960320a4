//! Geodesics of a metric that is given as a matrix field, in one chart.
//!
//! In Hamiltonian form, with `p = g v` and the Hamiltonian `½ p·g⁻¹p`,
//!
//! ```math
//! q' = g^{-1} p, \qquad p'_k = \tfrac12\, v^T (\partial_k g)\, v, \qquad v = g^{-1} p ,
//! ```
//!
//! so that only first derivatives of the metric appear; dual numbers give them. The equations are
//! integrated by extrapolation of the modified midpoint rule (Gragg 1965, Bulirsch and Stoer 1966),
//! which finds its own steps and orders and works at every scalar. A geodesic that comes near the edge
//! of its chart goes on in the chart around the point it has reached.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, Scalar, Space, Square, Vector,
};
use num_dual::Dual;

use crate::MetricError;
use crate::metric::GeodesicEnd;

/// The relative error of a geodesic.
const TOLERANCE: f64 = 1e-13;
/// Substeps of the midpoint rule, before extrapolation.
const SUBSTEPS: [u32; 10] = [2, 4, 6, 8, 10, 12, 14, 16, 18, 20];
/// A piece of a geodesic shorter than this, in a unit of time, is not worth pursuing.
const SHORTEST: f64 = 1e-6;

/// A point of the phase space of geodesics.
struct Phase<M: Space, D: Scalar> {
    q: Vector<M, D>,
    p: Vector<M, D>,
}

// By hand, because a derive would ask it of `M`.
impl<M: Space, D: Scalar> Clone for Phase<M, D> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Space, D: Scalar> Copy for Phase<M, D> {}

impl<M: Space, D: Scalar> Phase<M, D> {
    /// `self + other · h`.
    fn plus(&self, other: &Self, h: f64) -> Self {
        let h = D::from(h);
        Self { q: self.q + other.q * h, p: self.p + other.p * h }
    }

    /// The largest difference to another point, relative to the sizes of position and momentum.
    fn distance(&self, other: &Self) -> f64 {
        let q = (self.q - other.q).magnitude() / (1.0 + self.q.magnitude());
        let p = (self.p - other.p).magnitude() / self.p.magnitude().max(f64::MIN_POSITIVE);
        q.max(p)
    }

    fn is_finite(&self) -> bool {
        self.q.is_finite() && self.p.is_finite()
    }
}

/// The metric at `x + q`, and its derivatives along the chart.
type Slopes<M, D> = (Matrix<M, D>, <<M as Space>::Dim as Dimension>::Array<Matrix<M, D>>);

/// The metric in the frame of the chart, at any scalar.
#[inline]
pub(crate) fn metric<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
) -> Matrix<M, D> {
    M::covariant(x, &field.at(&x.point()))
}

/// The metric and its derivatives at any scalar, by one more dual number.
fn slopes<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M, D>,
) -> Slopes<M, D> {
    let mut value = Matrix::<M, D>::zeros();
    let slopes = M::Dim::array(|k| {
        let q = Vector::<M, Dual<D>>::from_index(|i| {
            Dual::new(q[i], if i == k { D::one() } else { D::zero() })
        });
        let g = metric(field, &ChartPoint { base: x.clone(), q });
        value = Matrix::<M, D>::from_entries(|i, j| g[(i, j)].re);
        Matrix::<M, D>::from_entries(|i, j| g[(i, j)].eps)
    });
    (value, slopes)
}

/// The velocity `g⁻¹p` and the derivative of the phase point.
fn derivative<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    at: &Phase<M, D>,
) -> Option<Phase<M, D>> {
    let (g, slopes) = slopes(field, x, &at.q);
    let v = g.solve(&at.p)?;
    let p = Vector::<M, D>::from_index(|k| v.dot(&(slopes[k] * v)) * 0.5);
    Some(Phase { q: v, p })
}

/// One row of the extrapolation: the midpoint rule with `n` substeps over `h`, smoothed by Gragg.
fn midpoint_rule<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    start: &Phase<M, D>,
    h: f64,
    n: u32,
) -> Option<Phase<M, D>> {
    let step = h / f64::from(n);
    let mut before = *start;
    let mut here = start.plus(&derivative(field, x, start)?, step);
    for _ in 1..n {
        let next = before.plus(&derivative(field, x, &here)?, 2.0 * step);
        (before, here) = (here, next);
    }
    let last = here.plus(&derivative(field, x, &here)?, step);
    let smooth = before.plus(&last, 1.0);
    let smooth = Phase::<M, D> { q: smooth.q * D::from(0.5), p: smooth.p * D::from(0.5) };
    smooth.is_finite().then_some(smooth)
}

/// One extrapolated step; `None` if it does not converge or leaves the chart.
fn extrapolated<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    start: &Phase<M, D>,
    h: f64,
) -> Option<Phase<M, D>> {
    let mut table: [Option<Phase<M, D>>; SUBSTEPS.len()] = [None; SUBSTEPS.len()];
    for (row, &n) in SUBSTEPS.iter().enumerate() {
        // Aitken and Neville: the table of the row above is overwritten from the left.
        let mut entry = midpoint_rule(field, x, start, h, n)?;
        let mut change = f64::INFINITY;
        for column in 1..=row {
            let above = table[column - 1].replace(entry)?;
            let ratio = f64::from(n) / f64::from(SUBSTEPS[row - column]);
            let weight = 1.0 / (ratio * ratio - 1.0);
            let better = entry.plus(&entry.plus(&above, -1.0), weight);
            change = better.distance(&entry);
            entry = better;
        }
        table[row] = Some(entry);
        if change <= TOLERANCE * h.max(0.1) {
            return Some(entry);
        }
    }
    None
}

/// A point and a velocity of one chart, in the chart centred at the point itself.
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

/// The geodesic from `x` with velocity `v`, followed for a unit of time: its end, centred, and its
/// velocity there.
///
/// # Errors
///
/// [`MetricError::Lost`] with the time reached, if the geodesic runs into the edge of the chart or
/// into a place where the metric is not positive.
pub(crate) fn follow<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
    v: &Vector<M, D>,
) -> Result<GeodesicEnd<M, D>, MetricError> {
    let mut base = x.base.clone();
    let mut here = Phase::<M, D> { q: x.q, p: metric(field, x) * *v };
    let (mut time, mut h) = (0.0, 1.0_f64);
    loop {
        h = h.min(1.0 - time);
        let next = extrapolated(field, &base, &here, h);
        match next.filter(|next| M::is_near(&next.q.real())) {
            Some(next) => {
                here = next;
                // A sum of halves and quarters is exact.
                time += h;
                h *= 2.0;
            }
            None if h > SHORTEST => {
                h *= 0.5;
                continue;
            }
            None => return Err(MetricError::Lost { time }),
        }
        let finished = time >= 1.0;
        if finished || !M::is_near(&(here.q.real::<Vector<M>>() * 2.0)) {
            let at = ChartPoint { base: base.clone(), q: here.q };
            let v = metric(field, &at).solve(&here.p).ok_or(MetricError::Lost { time })?;
            let (centre, v) = centred(&base, &here.q, &v);
            if finished {
                return Ok((centre, v));
            }
            here = Phase { q: centre.q, p: metric(field, &centre) * v };
            base = centre.base;
        }
    }
}

/// The acceleration `−Γ(v, v)` of the geodesic through a real point, with the Christoffel symbols of
/// the metric: `g a = ½∇(vᵀ g v) − (∂_v g) v`.
pub(crate) fn acceleration<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Option<Vector<M>> {
    let jet = field.covariant_jet(x);
    let mut force = Vector::<M>::from_index(|k| 0.5 * v.dot(&(jet.slopes[k] * *v)));
    for k in 0..M::Dim::LEN {
        force -= (jet.slopes[k] * *v) * v[k];
    }
    jet.value.solve(&force)
}
