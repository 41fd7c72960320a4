//! Metrics on a product, factor by factor.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use metriplectic_fields::{ChartPoint, Dimension, Matrix, Real, Scalar, Space, Square, Vector};

use crate::metric::GeodesicEnd;
use crate::product::{Product, Times};
use crate::{
    Canonical, InnerProduct, MetricAt, MetricError, MetricJet, Riemannian, Slopes, StepPath,
    StepPathJet,
};

/// A metric on a product in which the factors are orthogonal: a metric on each factor, of which the left one may depend on the
/// point of the right factor.
pub trait Split<A: Times<B>, B: Space>: Riemannian<Product<A, B>> {
    /// The metric on the left factor.
    type Left: Riemannian<A>;
    /// The metric on the right factor.
    type Right: Riemannian<B>;
    /// A pointer to the metric on the left factor.
    type LeftRef<'a>: Deref<Target = Self::Left>
    where
        Self: 'a;

    /// The metric on the left factor, where the right one is at `y`.
    fn left(&self, y: &B::Point<f64>) -> Self::LeftRef<'_>;

    /// The metric on the right factor.
    fn right(&self) -> &Self::Right;

    /// Returns whether the metric is the sum of its parts: the left one does not depend on the right factor.
    #[inline]
    fn is_sum(&self) -> bool {
        true
    }

    /// The inner product on each factor.
    fn inner_halves<D: Scalar>(at: &Self::At<D>) -> InnerHalves<A, B, Self, D>;
}

/// The metric on each factor of a sum.
trait Sum<A: Times<B>, B: Space>: Split<A, B> {
    fn factors(&self) -> (&Self::Left, &Self::Right);
}

/// The inner products of a product metric on the factors.
pub type InnerHalves<A, B, G, D> = (
    <<G as Split<A, B>>::Left as Riemannian<A>>::At<D>,
    <<G as Split<A, B>>::Right as Riemannian<B>>::At<D>,
);

/// A product metric at a point, on each factor.
pub type MetricHalves<'a, A, B, G, D> =
    (MetricAt<'a, A, <G as Split<A, B>>::Left, D>, MetricAt<'a, B, <G as Split<A, B>>::Right, D>);

impl<'a, A: Times<B>, B: Space, G: Split<A, B>, D: Scalar> MetricAt<'a, Product<A, B>, G, D> {
    /// Returns the metric of each factor at its part of the point, of which `left` is [`Split::left`].
    ///
    /// # Errors
    ///
    /// The errors of [`inner`](MetricAt::inner).
    #[inline]
    pub fn halves<'b>(
        &self,
        left: &'b G::Left,
        (x, y): (&'b ChartPoint<A, D>, &'b ChartPoint<B, D>),
    ) -> Result<MetricHalves<'b, A, B, G, D>, MetricError>
    where
        'a: 'b,
    {
        let (a, b) = G::inner_halves(self.inner()?);
        Ok((MetricAt::known(left, x, a), MetricAt::known(self.metric.right(), y, b)))
    }
}

impl<A: Times<B>, B: Space, G: Riemannian<A>, F: Riemannian<B>> Sum<A, B> for (G, F) {
    #[inline]
    fn factors(&self) -> (&G, &F) {
        (&self.0, &self.1)
    }
}

impl<A: Times<B>, B: Space> Sum<A, B> for Canonical
where
    Self: Riemannian<A> + Riemannian<B>,
{
    #[inline]
    fn factors(&self) -> (&Self, &Self) {
        (self, self)
    }
}

impl<A: Times<B>, B: Space, G: Riemannian<A>, F: Riemannian<B>> Split<A, B> for (G, F) {
    type Left = G;
    type Right = F;
    type LeftRef<'a>
        = &'a G
    where
        Self: 'a;

    #[inline]
    fn left(&self, _: &B::Point<f64>) -> &G {
        &self.0
    }

    #[inline]
    fn right(&self) -> &F {
        &self.1
    }

    #[inline]
    fn inner_halves<D: Scalar>(at: &Self::At<D>) -> (G::At<D>, F::At<D>) {
        (at.left, at.right)
    }
}

impl<A: Times<B>, B: Space> Split<A, B> for Canonical
where
    Self: Riemannian<A> + Riemannian<B>,
{
    type Left = Self;
    type Right = Self;
    type LeftRef<'a> = &'a Self;

    #[inline]
    fn left(&self, _: &B::Point<f64>) -> &Self {
        self
    }

    #[inline]
    fn right(&self) -> &Self {
        self
    }

    #[inline]
    fn inner_halves<D: Scalar>(
        at: &<Self as Riemannian<Product<A, B>>>::At<D>,
    ) -> InnerHalves<A, B, Self, D> {
        (at.left, at.right)
    }
}

/// The inner products on the factors, as one on the product.
pub struct Block<A, B, D, P, Q> {
    pub(crate) left: P,
    right: Q,
    factors: PhantomData<(A, B, D)>,
}

impl<A, B, D, P, Q> Block<A, B, D, P, Q> {
    pub(crate) const fn new(left: P, right: Q) -> Self {
        Self { left, right, factors: PhantomData }
    }
}

impl<A, B, D, P: Clone, Q: Clone> Clone for Block<A, B, D, P, Q> {
    fn clone(&self) -> Self {
        Self { left: self.left.clone(), right: self.right.clone(), factors: PhantomData }
    }
}

impl<A, B, D, P: Copy, Q: Copy> Copy for Block<A, B, D, P, Q> {}

impl<A, B, D, P: fmt::Debug, Q: fmt::Debug> fmt::Debug for Block<A, B, D, P, Q> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Block").field(&self.left).field(&self.right).finish()
    }
}

impl<A, B, D, P, Q> InnerProduct<Vector<Product<A, B>, D>> for Block<A, B, D, P, Q>
where
    A: Times<B>,
    B: Space,
    D: Scalar,
    P: InnerProduct<Vector<A, D>>,
    Q: InnerProduct<Vector<B, D>>,
{
    #[inline]
    fn flat(&self, v: &Vector<Product<A, B>, D>) -> Vector<Product<A, B>, D> {
        let (a, b) = Product::<A, B>::split(v);
        Product::<A, B>::join(&self.left.flat(&a), &self.right.flat(&b))
    }

    #[inline]
    fn orthonormal(&self, alpha: &Vector<Product<A, B>, D>) -> Vector<Product<A, B>, D> {
        let (a, b) = Product::<A, B>::split(alpha);
        Product::<A, B>::join(&self.left.orthonormal(&a), &self.right.orthonormal(&b))
    }

    #[inline]
    fn from_orthonormal(&self, alpha: &Vector<Product<A, B>, D>) -> Vector<Product<A, B>, D> {
        let (a, b) = Product::<A, B>::split(alpha);
        Product::<A, B>::join(&self.left.from_orthonormal(&a), &self.right.from_orthonormal(&b))
    }
}

/// The derivatives of a sum of metrics on the factors.
fn of_factors<A: Times<B>, B: Space>(a: &Slopes<A>, b: &Slopes<B>) -> Slopes<Product<A, B>> {
    if a.is_none() && b.is_none() {
        return None;
    }
    let (left, right) = (Matrix::<A>::zeros(), Matrix::<B>::zeros());
    let n = A::Dim::LEN;
    Some(A::SumDim::array(|k| match (k < n, a, b) {
        (true, Some(a), _) => Product::<A, B>::block(&a[k], &right),
        (false, _, Some(b)) => Product::<A, B>::block(&left, &b[k - n]),
        _ => Matrix::<Product<A, B>>::zeros(),
    }))
}

/// The metric of a product, factor by factor.
macro_rules! metric_of_the_factors {
    () => {
        type At<D: Scalar> = Block<
            A,
            B,
            D,
            <<Self as Split<A, B>>::Left as Riemannian<A>>::At<D>,
            <<Self as Split<A, B>>::Right as Riemannian<B>>::At<D>,
        >;

        #[inline]
        fn at<D: Scalar>(
            &self,
            x: &ChartPoint<Product<A, B>, D>,
        ) -> Result<Self::At<D>, MetricError> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::parts(x));
            Ok(Block { left: g.at(&a)?, right: f.at(&b)?, factors: PhantomData })
        }

        fn matrix<D: Scalar>(&self, x: &ChartPoint<Product<A, B>, D>) -> Matrix<Product<A, B>, D> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::parts(x));
            Product::<A, B>::block(&g.matrix(&a), &f.matrix(&b))
        }

        #[inline]
        fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError> {
            let left = <<Self as Split<A, B>>::Left as Riemannian<A>>::volume_density(&at.left)?;
            Ok(left * <<Self as Split<A, B>>::Right as Riemannian<B>>::volume_density(&at.right)?)
        }

        fn exp<D: Scalar>(
            &self,
            x: &ChartPoint<Product<A, B>, D>,
            v: &Vector<Product<A, B>, D>,
        ) -> Result<GeodesicEnd<Product<A, B>, D>, MetricError> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::parts(x));
            let (va, vb) = Product::<A, B>::split(v);
            let ((a, va), (b, vb)) = (g.exp(&a, &va)?, f.exp(&b, &vb)?);
            let q = Product::<A, B>::join(&a.q, &b.q);
            let end = ChartPoint { base: (a.base, b.base), q };
            Ok((end, Product::<A, B>::join(&va, &vb)))
        }

        fn end(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            v: &Vector<Product<A, B>>,
        ) -> Result<(A::Point<f64>, B::Point<f64>), MetricError> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::<A, B>::split(v));
            Ok((Riemannian::<A>::end(g, &x.0, &a)?, Riemannian::<B>::end(f, &x.1, &b)?))
        }

        fn along(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            v: &Vector<Product<A, B>>,
            t: f64,
        ) -> Result<(A::Point<Real>, B::Point<Real>), MetricError> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::<A, B>::split(v));
            Ok((Riemannian::<A>::along(g, &x.0, &a, t)?, Riemannian::<B>::along(f, &x.1, &b, t)?))
        }

        fn log(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            y: &(A::Point<f64>, B::Point<f64>),
        ) -> Result<Vector<Product<A, B>>, MetricError> {
            let (g, f) = Sum::<A, B>::factors(self);
            Ok(Product::<A, B>::join(
                &Riemannian::<A>::log(g, &x.0, &y.0)?,
                &Riemannian::<B>::log(f, &x.1, &y.1)?,
            ))
        }

        fn weyl_path(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            d: &Vector<Product<A, B>>,
        ) -> Result<StepPath<Product<A, B>>, MetricError> {
            let ((g, f), (da, db)) = (Sum::<A, B>::factors(self), Product::<A, B>::split(d));
            Ok(StepPath::of_factors(
                Riemannian::<A>::weyl_path(g, &x.0, &da)?,
                Riemannian::<B>::weyl_path(f, &x.1, &db)?,
            ))
        }

        fn weyl_jet(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            d: &Vector<Product<A, B>>,
        ) -> Result<StepPathJet<Product<A, B>>, MetricError> {
            let ((g, f), (da, db)) = (Sum::<A, B>::factors(self), Product::<A, B>::split(d));
            Ok(StepPathJet::of_factors(
                Riemannian::<A>::weyl_jet(g, &x.0, &da)?,
                Riemannian::<B>::weyl_jet(f, &x.1, &db)?,
            ))
        }

        fn accuracy(&self) -> f64 {
            let (g, f) = Sum::<A, B>::factors(self);
            Riemannian::<A>::accuracy(g).max(Riemannian::<B>::accuracy(f))
        }

        #[inline]
        fn lost_digits(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
            v: &Vector<Product<A, B>>,
            y: &(A::Point<f64>, B::Point<f64>),
        ) -> Vector<Product<A, B>> {
            let ((g, f), (a, b)) = (Sum::<A, B>::factors(self), Product::<A, B>::split(v));
            Product::<A, B>::join(
                &Riemannian::<A>::lost_digits(g, &x.0, &a, &y.0),
                &Riemannian::<B>::lost_digits(f, &x.1, &b, &y.1),
            )
        }

        fn slopes(&self, x: &(A::Point<f64>, B::Point<f64>)) -> Slopes<Product<A, B>> {
            let (g, f) = Sum::<A, B>::factors(self);
            let (a, b) = (Riemannian::<A>::slopes(g, &x.0), Riemannian::<B>::slopes(f, &x.1));
            of_factors::<A, B>(&a, &b)
        }

        fn jet(
            &self,
            x: &(A::Point<f64>, B::Point<f64>),
        ) -> Result<MetricJet<Product<A, B>, Self>, MetricError> {
            let (g, f) = Sum::<A, B>::factors(self);
            let (a, b) = (Riemannian::<A>::jet(g, &x.0)?, Riemannian::<B>::jet(f, &x.1)?);
            let at = Block { left: a.at, right: b.at, factors: PhantomData };
            Ok(MetricJet { at, slopes: of_factors::<A, B>(&a.slopes, &b.slopes) })
        }
    };
}

impl<A, B, G, F> Riemannian<Product<A, B>> for (G, F)
where
    A: Times<B>,
    B: Space,
    G: Riemannian<A>,
    F: Riemannian<B>,
{
    const IS_CANONICAL: bool = G::IS_CANONICAL && F::IS_CANONICAL;

    metric_of_the_factors!();
}

impl<A, B> Riemannian<Product<A, B>> for Canonical
where
    A: Times<B>,
    B: Space,
    Self: Riemannian<A> + Riemannian<B>,
{
    const IS_CANONICAL: bool =
        <Self as Riemannian<A>>::IS_CANONICAL && <Self as Riemannian<B>>::IS_CANONICAL;

    metric_of_the_factors!();
}
