//! A metric from a closure with parameters, on `M × Rᴾ`.
//!
//! The parameters have the cometric of [`Inert`], so that nothing moves them. The geometry of a step is that of one `θ`: the one
//! in the middle of a path from `(x, θ)` to `(x', θ')`, which is the same seen from both ends. At `θ' = θ`, where runs are, it is
//! the metric at `θ`; the derivatives along `θ` and along `θ'` are half of the one along the parameters each.

mod near;

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Form, Matrix, MatrixField, Real, Scalar, Space, Square, Vector,
};
use nalgebra::SVector;

use crate::field_metric::{FieldMetric, on_first_half, on_second_half};
use crate::geodesic;
use crate::geodesic_jet::{ArrivalJet, GeodesicJet};
use crate::metric::{Factored, GeodesicEnd, MetricError};
use crate::product_metric::Block;
use crate::{
    Euclidean, Inert, Manifold, Product, Riemannian, Slopes, Split, StepPath, StepPathJet, Times,
};

/// A metric `g(x, θ)` given as a closure `|x, θ| -> matrix`, with the matrices of
/// [`Metric::field`](crate::Metric::field): a metric on `M` for each `θ ∈ Rᴾ`, and on `M × Rᴾ` with the cometric zero along `θ`.
///
/// ```
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::{Euclidean, ParametricMetric, Riemannian};
/// use nalgebra::{Matrix2, Vector1, Vector2, vector};
///
/// let g = ParametricMetric::new(|x: &Vector2<Real>, t: &Vector1<Real>| {
///     Matrix2::from_diagonal(&Vector2::new(t.x, x.x * x.x + 1.0))
/// });
/// let at = g.at_parameters(&vector![4.0.into()]);
/// assert_eq!(Riemannian::<Euclidean<2>>::norm(&at, &vector![0.0, 0.0], &vector![1.0, 0.0]).unwrap(), 2.0);
/// // Where it is not positive it is an error.
/// let bad = g.at_parameters(&vector![(-4.0).into()]);
/// assert!(Riemannian::<Euclidean<2>>::norm(&bad, &vector![0.0, 0.0], &vector![1.0, 0.0]).is_err());
/// ```
pub struct ParametricMetric<F>(Arc<F>);

/// The matrix field `g(·, θ)` at one `θ`.
pub struct MatrixAtParameters<F, const P: usize> {
    field: Arc<F>,
    theta: SVector<Real, P>,
}

/// The metric at one `θ`.
pub type MetricAtParameters<F, const P: usize> = FieldMetric<MatrixAtParameters<F, P>>;

// By hand, because closures have no `Debug`, and a pointer to one is cloned whatever it is.
impl<F> Clone for ParametricMetric<F> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<F> fmt::Debug for ParametricMetric<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ParametricMetric").finish_non_exhaustive()
    }
}

impl<F, const P: usize> Clone for MatrixAtParameters<F, P> {
    fn clone(&self) -> Self {
        Self { field: Arc::clone(&self.field), theta: self.theta }
    }
}

impl<F, const P: usize> fmt::Debug for MatrixAtParameters<F, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MatrixAtParameters").field("theta", &self.theta.map(|t| t.re)).finish()
    }
}

impl<F> ParametricMetric<F> {
    /// Makes the metric of a closure `|x, θ| -> matrix`.
    pub fn new(field: F) -> Self {
        Self(Arc::new(field))
    }

    /// The metric on `M` at one `θ`. It evaluates the closure as one that captures `θ` is evaluated, with the same bits.
    pub fn at_parameters<const P: usize>(
        &self,
        theta: &SVector<Real, P>,
    ) -> MetricAtParameters<F, P> {
        FieldMetric::new(MatrixAtParameters { field: Arc::clone(&self.0), theta: *theta })
    }

    /// The metric on `M` at a real `θ`.
    fn still<const P: usize>(&self, theta: &SVector<f64, P>) -> MetricAtParameters<F, P> {
        self.at_parameters(&Euclidean::<P>::constant::<Real>(theta))
    }
}

impl<M, F, const P: usize> MatrixField<M> for MatrixAtParameters<F, P>
where
    M: Space,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Form<M, D> {
        let closure = |x: &M::Point<Real>| (self.field)(x, &self.theta);
        MatrixField::<M>::at(&closure, x)
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Form<M, Real> {
        (self.field)(x, &self.theta)
    }
}

/// The product with the parameters.
type Wide<M, const P: usize> = Product<M, Euclidean<P>>;

/// A form on `M` as one on `M × Rᴾ`, with a number on the diagonal of the parameters.
fn block<M: Times<Euclidean<P>>, const P: usize>(
    form: &Form<M, Real>,
    diagonal: f64,
) -> Form<Wide<M, P>, Real> {
    let n = <M::Velocity as Dimension>::LEN;
    Form::<Wide<M, P>, Real>::from_entries(|i, j| match (i < n, j < n) {
        (true, true) => form[(i, j)],
        (false, false) if i == j => Real::from(diagonal),
        _ => Real::from(0.0),
    })
}

impl<F> ParametricMetric<F> {
    /// The matrix at any scalar, in the frame of the chart of `M`.
    fn first<M, D, const P: usize>(&self, x: &ChartPoint<Wide<M, P>, D>) -> Matrix<M, D>
    where
        M: Times<Euclidean<P>>,
        D: Scalar,
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        let closure =
            |(x, t): &(M::Point<Real>, SVector<Real, P>)| block::<M, P>(&(self.0)(x, t), 0.0);
        let form = MatrixField::<Wide<M, P>>::at(&closure, &x.point());
        M::covariant(&Wide::<M, P>::parts(x).0, &Form::<M, D>::from_entries(|i, j| form[(i, j)]))
    }
}

/// A path of `M` at the `θ` in the middle of one from `θ` to `θ + δ`.
fn beside<M: Times<Euclidean<P>>, const P: usize>(
    path: StepPath<M>,
    theta: &SVector<f64, P>,
    delta: &SVector<f64, P>,
) -> StepPath<Wide<M, P>> {
    StepPath::of_factors(
        path,
        StepPath { z: ChartPoint::centre(&(theta + delta * 0.5)), d: *delta, end: theta + delta },
    )
}

impl<M, F, const P: usize> Riemannian<Wide<M, P>> for ParametricMetric<F>
where
    M: Manifold + Times<Euclidean<P>>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    type At<D: Scalar> = Block<M, Euclidean<P>, D, Factored<M::Dim, D>, Inert>;

    fn at<D: Scalar>(&self, x: &ChartPoint<Wide<M, P>, D>) -> Result<Self::At<D>, MetricError> {
        Ok(Block::new(Factored::new(self.first::<M, D, P>(x))?, Inert))
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<Wide<M, P>, D>) -> Matrix<Wide<M, P>, D> {
        Wide::<M, P>::block(&self.first::<M, D, P>(x), &Square::zeros())
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<Wide<M, P>, D>,
        v: &Vector<Wide<M, P>, D>,
    ) -> Result<GeodesicEnd<Wide<M, P>, D>, MetricError> {
        let ((a, t), (va, vt)) = (Wide::<M, P>::parts(x), Wide::<M, P>::split(v));
        let near = self.near::<M, P>(&a.base, &t.base, &Vector::<M>::from_index(|i| va[i].re()));
        let scaled = |t: &SVector<D, P>| {
            SVector::<D, P>::from_fn(|k, _| t[k] * D::from(near.units[k].recip()))
        };
        let field = |p: &(M::Point<Real>, SVector<Real, P>)| near.matrix::<M>(p);
        let tau = scaled(&(t.q + vt * D::from(0.5)));
        // The parameters beside the path stay where its middle has them.
        let start =
            ChartPoint { base: (a.base, Column::zero()), q: Wide::<M, P>::join(&a.q, &tau) };
        let velocity = Wide::<M, P>::join(&va, &Column::zero());
        let (end, velocity) = geodesic::follow::<Wide<M, P>, D>(&field, &start, &velocity)?;
        let ((end, _), (velocity, _)) = (Wide::<M, P>::parts(&end), Wide::<M, P>::split(&velocity));
        let q = Wide::<M, P>::join(&end.q, &(t.q + vt));
        Ok((ChartPoint { base: (end.base, t.base), q }, Wide::<M, P>::join(&velocity, &vt)))
    }

    fn end(
        &self,
        x: &(M::Point<f64>, SVector<f64, P>),
        v: &Vector<Wide<M, P>>,
    ) -> Result<(M::Point<f64>, SVector<f64, P>), MetricError> {
        Ok(Riemannian::<Wide<M, P>>::weyl_path(self, x, v)?.end)
    }

    fn along(
        &self,
        (x, theta): &(M::Point<f64>, SVector<f64, P>),
        v: &Vector<Wide<M, P>>,
        t: f64,
    ) -> Result<(M::Point<Real>, SVector<Real, P>), MetricError> {
        let (a, delta) = Wide::<M, P>::split(v);
        let g = self.still(&(theta + delta * 0.5));
        let parameters = Riemannian::<Euclidean<P>>::along(&Inert, theta, &delta, t)?;
        Ok((Riemannian::<M>::along(&g, x, &a, t)?, parameters))
    }

    fn log(
        &self,
        x: &(M::Point<f64>, SVector<f64, P>),
        y: &(M::Point<f64>, SVector<f64, P>),
    ) -> Result<Vector<Wide<M, P>>, MetricError> {
        let delta = y.1 - x.1;
        let g = self.still(&(x.1 + delta * 0.5));
        Ok(Wide::<M, P>::join(&Riemannian::<M>::log(&g, &x.0, &y.0)?, &delta))
    }

    fn weyl_path(
        &self,
        (x, theta): &(M::Point<f64>, SVector<f64, P>),
        d: &Vector<Wide<M, P>>,
    ) -> Result<StepPath<Wide<M, P>>, MetricError> {
        let (a, delta) = Wide::<M, P>::split(d);
        let g = self.still(&(theta + delta * 0.5));
        Ok(beside(Riemannian::<M>::weyl_path(&g, x, &a)?, theta, &delta))
    }

    fn weyl_jet(
        &self,
        (x, theta): &(M::Point<f64>, SVector<f64, P>),
        d: &Vector<Wide<M, P>>,
    ) -> Result<StepPathJet<Wide<M, P>>, MetricError> {
        let n = M::Dim::LEN;
        let (a, delta) = Wide::<M, P>::split(d);
        let path = Riemannian::<Wide<M, P>>::weyl_path(self, &(x.clone(), *theta), d)?;
        let near = self.near::<M, P>(x, &(theta + delta * 0.5), &a);
        let field = |p: &(M::Point<Real>, SVector<Real, P>)| near.matrix::<M>(p);
        // Half of δ is that of the middle, along which the geometry changes.
        let diagonal = |first: f64, last: &dyn Fn(usize) -> f64| {
            Matrix::<Wide<M, P>>::from_entries(|i, j| match i == j {
                true if i < n => first,
                true => last(i - n),
                false => 0.0,
            })
        };
        let half = GeodesicJet::<Wide<M, P>> {
            point: (x.clone(), Column::zero()),
            velocity: Wide::<M, P>::join(&(a * 0.5), &Column::zero()),
            dpoint: diagonal(0.0, &|k| 0.5 / near.units[k]),
            dvelocity: diagonal(0.5, &|_| 0.0),
        };
        let z = ArrivalJet::of(&field, &half).and_then(|middle| middle.jet(&field));
        let z = z.map_err(on_first_half)?;
        let end = ArrivalJet::of(&field, &z).map_err(on_second_half)?.derivative();
        // The first rows are those of `M`; those of the parameters are known.
        let rows = |a: &Matrix<Wide<M, P>>, factor: f64, last: f64| {
            Matrix::<Wide<M, P>>::from_entries(|i, j| match i < n {
                true => a[(i, j)] * factor,
                false if i == j => last,
                false => 0.0,
            })
        };
        Ok(StepPathJet {
            z: path.z.base,
            dz: rows(&z.dpoint, 1.0, 0.5),
            d: path.d,
            dd: rows(&z.dvelocity, 2.0, 1.0),
            end: path.end,
            dend: rows(&end, 1.0, 1.0),
        })
    }

    fn accuracy(&self) -> f64 {
        geodesic::ACCURACY
    }

    fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError> {
        at.left.root_determinant()
    }

    fn slopes(&self, x: &(M::Point<f64>, SVector<f64, P>)) -> Slopes<Wide<M, P>> {
        let closure =
            |(x, t): &(M::Point<Real>, SVector<Real, P>)| block::<M, P>(&(self.0)(x, t), 0.0);
        Some(MatrixField::<Wide<M, P>>::covariant_jet(&closure, x).slopes)
    }
}

/// A pointer to a metric at one `θ`, which it owns.
pub struct Owned<G>(G);

impl<G> fmt::Debug for Owned<G> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Owned").finish_non_exhaustive()
    }
}

impl<G> Deref for Owned<G> {
    type Target = G;

    fn deref(&self) -> &G {
        &self.0
    }
}

impl<M, F, const P: usize> Split<M, Euclidean<P>> for ParametricMetric<F>
where
    M: Manifold + Times<Euclidean<P>>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    type Left = MetricAtParameters<F, P>;
    type Right = Inert;
    type LeftRef<'a>
        = Owned<MetricAtParameters<F, P>>
    where
        Self: 'a;

    fn left(&self, theta: &SVector<f64, P>) -> Owned<MetricAtParameters<F, P>> {
        Owned(self.still(theta))
    }

    fn right(&self) -> &Inert {
        &Inert
    }

    fn is_sum(&self) -> bool {
        false
    }

    fn inner_halves<D: Scalar>(at: &Self::At<D>) -> (Factored<M::Dim, D>, Inert) {
        (at.left, Inert)
    }
}
