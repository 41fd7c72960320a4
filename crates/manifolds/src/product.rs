//! Products `A × B`.
//!
//! - **Point and velocity**: a pair of points, which a closure takes apart; the velocity of the first
//!   factor, with that of the second below it.
//! - **Frame and chart**: those of the factors, `φ_{(a,b)}(q, r) = (φ_a(q), φ_b(r))`.
//! - **Geodesics** of a pair of metrics `(gA, gB)` are pairs of geodesics, as accurate as those of the
//!   factors, with `d² = d_A² + d_B²` (Lee 2018, ch. 2, for the product metric). The limits of the factors
//!   apply. [`Canonical`](crate::Canonical) is the pair of the canonical metrics.
//!   One [closure](crate::Metric::field) for the full matrix couples the
//!   factors, and its geodesics are numerical.
//! - **Brackets**: none by default. The Casimirs of a pair, `{f, g} = {f, g}_A + {f, g}_B`, are functions of
//!   the Casimirs of both. With `(AreaForm, Zero)` on `S² × R` each function of the second factor is a
//!   Casimir, so an entropy there does not change the precession. `Symplectic` on
//!   `Rⁿ × Rⁿ`, and on `SO(3) × R³` trivialised from the left,
//!
//! ```math
//! R' = R\, \widehat{\alpha_p}, \qquad p' = p \times \alpha_p - \alpha_R
//! ```
//!
//! (Marsden and Ratiu 1999, §13.5).

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Plus, Real, Scalar, Space, Square, Vector, Velocity,
};
use rand::Rng;

use crate::{Manifold, PointError, StepPath, StepPathJet};

/// The product `A × B`: a state with two parts, such as a direction with an internal energy
/// (`S² × R`) or an attitude with an angular momentum (`SO(3) × R³`). A factor may be a product again.
/// All factors together have at most 127 variables; one `Euclidean<N>` may have 256. See the
/// [module](mod@crate::product).
///
/// ```
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::{Euclidean, Manifold, Product, Sphere};
/// use nalgebra::{Vector1, Vector3, vector};
///
/// let spin_and_energy = Product(Sphere::<2>::round(), Euclidean::<1>);
/// let _energy = |(n, e): &(Vector3<Real>, Vector1<Real>)| n.z + e.x;
/// assert!(spin_and_energy.check(&(vector![0.0, 0.6, 0.8], vector![3.0])).is_ok());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Product<A, B>(pub A, pub B);

/// Spaces whose dimensions can be added: the left and the right factor of a product. It is implemented for
/// all such spaces. Stable Rust does not add the numbers of two types, so nalgebra has a table of their sums, which ends
/// at 127.
#[diagnostic::on_unimplemented(
    message = "a product has at most 127 variables, and its velocities have at most 127 entries",
    label = "the factors `{Self}` and `{B}` have more together, or are no spaces",
    note = "one `Euclidean<N>` may have 256 variables, and a `Lattice` has any number"
)]
pub trait Times<B: Space>: Space {
    /// The dimension of the product.
    type SumDim: Dimension;
    /// The number of entries of its velocities.
    type SumVelocity: Dimension;
}

#[diagnostic::do_not_recommend]
impl<A: Space, B: Space> Times<B> for A
where
    A::Dim: Plus<B::Dim>,
    A::Velocity: Plus<B::Velocity>,
{
    type SumDim = <A::Dim as Plus<B::Dim>>::Sum;
    type SumVelocity = <A::Velocity as Plus<B::Velocity>>::Sum;
}

/// `(a, b)` as one column.
fn stack<D: Scalar, P: Column<D>, Q: Column<D>, S: Column<D>>(a: &P, b: &Q) -> S {
    S::from_index(|i| if i < P::LEN { a[i] } else { b[i - P::LEN] })
}

impl<A: Times<B>, B: Space> Product<A, B> {
    /// The components of a vector or covector on each factor.
    #[inline]
    pub fn split<D: Scalar>(v: &Vector<Self, D>) -> (Vector<A, D>, Vector<B, D>) {
        let left = Vector::<A, D>::from_index(|i| v[i]);
        (left, Vector::<B, D>::from_index(|i| v[i + A::Dim::LEN]))
    }

    /// The components of a vector or covector of the product, from those on the factors.
    #[inline]
    pub fn join<D: Scalar>(a: &Vector<A, D>, b: &Vector<B, D>) -> Vector<Self, D> {
        stack(a, b)
    }

    /// The block-diagonal matrix of a matrix on each factor.
    #[inline]
    pub fn block<D: Scalar>(a: &Matrix<A, D>, b: &Matrix<B, D>) -> Matrix<Self, D> {
        let n = A::Dim::LEN;
        Matrix::<Self, D>::from_entries(|i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)],
            (false, false) => b[(i - n, j - n)],
            _ => D::zero(),
        })
    }

    /// The parts of a chart point.
    #[inline]
    pub fn parts<D: Scalar>(x: &ChartPoint<Self, D>) -> (ChartPoint<A, D>, ChartPoint<B, D>) {
        let (a, b) = Self::split(&x.q);
        (ChartPoint { base: x.base.0.clone(), q: a }, ChartPoint { base: x.base.1.clone(), q: b })
    }
}

impl<A: Times<B>, B: Space> Space for Product<A, B> {
    type Dim = A::SumDim;
    type Velocity = A::SumVelocity;
    type Point<D: Scalar> = (A::Point<D>, B::Point<D>);

    const IS_VECTOR_SPACE: bool = A::IS_VECTOR_SPACE && B::IS_VECTOR_SPACE;

    #[inline]
    fn constant<D: Scalar>((a, b): &Self::Point<f64>) -> Self::Point<D> {
        (A::constant(a), B::constant(b))
    }

    #[inline]
    fn real<D: Scalar>((a, b): &Self::Point<D>) -> Self::Point<f64> {
        (A::real(a), B::real(b))
    }

    #[inline]
    fn chart<D: Scalar>((a, b): &Self::Point<f64>, q: &Vector<Self, D>) -> Self::Point<D> {
        let (qa, qb) = Self::split(q);
        (A::chart(a, &qa), B::chart(b, &qb))
    }

    #[inline]
    fn seeds((a, b): &Self::Point<f64>) -> impl Fn(usize, usize) -> Self::Point<Real> {
        let (n, a, b) = (A::Dim::LEN, A::seeds(a), B::seeds(b));
        // An index of `A` is beyond the dimension of `B` once it has been shifted.
        let shifted = move |k: usize| if k < n { B::Dim::LEN } else { k - n };
        move |i, j| (a(i, j), b(shifted(i), shifted(j)))
    }

    #[inline]
    fn coordinates<D: Scalar>((a, b): &Self::Point<f64>, y: &Self::Point<D>) -> Vector<Self, D> {
        Self::join(&A::coordinates(a, &y.0), &B::coordinates(b, &y.1))
    }

    #[inline]
    fn embed<D: Scalar>(x: &ChartPoint<Self, D>, v: &Vector<Self, D>) -> Velocity<Self, D> {
        let ((xa, xb), (va, vb)) = (Self::parts(x), Self::split(v));
        stack(&A::embed(&xa, &va), &B::embed(&xb, &vb))
    }

    const RATES_ARE_VELOCITIES: bool = A::RATES_ARE_VELOCITIES && B::RATES_ARE_VELOCITIES;

    #[inline]
    fn stage((a, b): &Self::Point<f64>, q: &Vector<Self>) -> Self::Point<f64> {
        let (qa, qb) = Self::split(q);
        (A::stage(a, &qa), B::stage(b, &qb))
    }

    #[inline]
    fn stage_coordinates((a, b): &Self::Point<f64>, y: &Self::Point<f64>) -> Vector<Self> {
        Self::join(&A::stage_coordinates(a, &y.0), &B::stage_coordinates(b, &y.1))
    }

    #[inline]
    fn stage_rates(
        (a, b): &Self::Point<f64>,
        (q, y): (&Vector<Self>, &Self::Point<f64>),
        v: &Vector<Self>,
    ) -> Vector<Self> {
        let ((qa, qb), (va, vb)) = (Self::split(q), Self::split(v));
        let first = A::stage_rates(a, (&qa, &y.0), &va);
        Self::join(&first, &B::stage_rates(b, (&qb, &y.1), &vb))
    }

    #[inline]
    fn is_stage(q: &Vector<Self>) -> bool {
        let (a, b) = Self::split(q);
        A::is_stage(&a) && B::is_stage(&b)
    }

    #[inline]
    fn is_near(q: &Vector<Self>) -> bool {
        let (a, b) = Self::split(q);
        A::is_near(&a) && B::is_near(&b)
    }
}

impl<A: Times<B>, B: Space> StepPath<Product<A, B>> {
    /// Puts the paths of the factors together.
    #[inline]
    pub fn of_factors(a: StepPath<A>, b: StepPath<B>) -> Self {
        let q = Product::<A, B>::join(&a.z.q, &b.z.q);
        Self {
            z: ChartPoint { base: (a.z.base, b.z.base), q },
            d: Product::<A, B>::join(&a.d, &b.d),
            end: (a.end, b.end),
        }
    }
}

impl<A: Times<B>, B: Space> StepPathJet<Product<A, B>> {
    /// Puts the paths of the factors together, with their derivatives.
    #[inline]
    pub fn of_factors(a: StepPathJet<A>, b: StepPathJet<B>) -> Self {
        Self {
            z: (a.z, b.z),
            dz: Product::<A, B>::block(&a.dz, &b.dz),
            d: Product::<A, B>::join(&a.d, &b.d),
            dd: Product::<A, B>::block(&a.dd, &b.dd),
            end: (a.end, b.end),
            dend: Product::<A, B>::block(&a.dend, &b.dend),
        }
    }
}

impl<A: Manifold + Times<B>, B: Manifold> Manifold for Product<A, B> {
    const ENTRIES: usize =
        if A::ENTRIES > 0 && B::ENTRIES > 0 { A::ENTRIES + B::ENTRIES } else { 0 };

    /// Returns the larger defect of the two factors.
    fn defect(&self, (a, b): &Self::Point<f64>) -> f64 {
        let (a, b) = (self.0.defect(a), self.1.defect(b));
        if a.is_nan() || a > b { a } else { b }
    }

    #[inline]
    fn is_inside(&self, (a, b): &Self::Point<f64>) -> bool {
        self.0.is_inside(a) && self.1.is_inside(b)
    }

    fn entries((a, b): &Self::Point<f64>) -> Vec<f64> {
        let mut entries = A::entries(a);
        entries.extend(B::entries(b));
        entries
    }

    #[inline]
    fn write((a, b): &Self::Point<f64>, put: &mut impl FnMut(f64)) {
        A::write(a, put);
        B::write(b, put);
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Self::Point<f64> {
        (A::assemble(next), B::assemble(next))
    }

    #[inline]
    fn magnitude((a, b): &Self::Point<f64>) -> f64 {
        A::magnitude(a).hypot(B::magnitude(b))
    }

    #[inline]
    fn scales((a, b): &Self::Point<f64>) -> Vector<Self> {
        Self::join(&A::scales(a), &B::scales(b))
    }

    #[inline]
    fn pairing_size(w: &Vector<Self>, v: &Vector<Self>) -> f64 {
        let ((wa, wb), (va, vb)) = (Self::split(w), Self::split(v));
        A::pairing_size(&wa, &va) + B::pairing_size(&wb, &vb)
    }

    #[inline]
    fn leg((x, y): &Self::Point<Real>, a: usize) -> Velocity<Self, Real> {
        let n = A::Velocity::LEN;
        if a < n {
            stack(&A::leg(x, a), &Velocity::<B, Real>::zero())
        } else {
            stack(&Velocity::<A, Real>::zero(), &B::leg(y, a - n))
        }
    }

    fn project(&self, (a, b): &Self::Point<f64>) -> Self::Point<f64> {
        (self.0.project(a), self.1.project(b))
    }

    #[inline]
    fn transport(x: &Self::Point<f64>, y: &Self::Point<f64>, v: &Vector<Self>) -> Vector<Self> {
        let (a, b) = Self::split(v);
        Self::join(&A::transport(&x.0, &y.0, &a), &B::transport(&x.1, &y.1, &b))
    }

    #[inline]
    fn line(x: &Self::Point<f64>, u: &Vector<Self>) -> StepPath<Self> {
        let (a, b) = Self::split(u);
        StepPath::of_factors(A::line(&x.0, &a), B::line(&x.1, &b))
    }

    #[inline]
    fn line_jet(x: &Self::Point<f64>, u: &Vector<Self>) -> StepPathJet<Self> {
        let (a, b) = Self::split(u);
        StepPathJet::of_factors(A::line_jet(&x.0, &a), B::line_jet(&x.1, &b))
    }

    #[inline]
    fn line_end(x: &Self::Point<f64>, u: &Vector<Self>) -> Option<Self::Point<f64>> {
        let (a, b) = Self::split(u);
        Some((A::line_end(&x.0, &a)?, B::line_end(&x.1, &b)?))
    }

    #[inline]
    fn line_at(x: &Self::Point<f64>, u: &Vector<Self>, t: f64) -> Self::Point<Real> {
        let (a, b) = Self::split(u);
        (A::line_at(&x.0, &a, t), B::line_at(&x.1, &b, t))
    }

    #[inline]
    fn lost_digits(x: &Self::Point<f64>, u: &Vector<Self>, y: &Self::Point<f64>) -> Vector<Self> {
        let (a, b) = Self::split(u);
        Self::join(&A::lost_digits(&x.0, &a, &y.0), &B::lost_digits(&x.1, &b, &y.1))
    }

    fn random(&self, rng: &mut impl Rng) -> Self::Point<f64> {
        (self.0.random(rng), self.1.random(rng))
    }

    /// Lets each factor check its part. An entry is counted in the whole point.
    fn check(&self, (a, b): &Self::Point<f64>) -> Result<(), PointError> {
        self.0.check(a)?;
        self.1.check(b).map_err(|error| match error {
            PointError::NotFinite { index, value } => {
                PointError::NotFinite { index: A::entries(a).len() + index, value }
            }
            other => other,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Canonical, Euclidean, Exponential, HalfLine, Metric, PointError, Riemannian, Rotations,
        Sphere, WeylMidpoint, laws,
    };
    use nalgebra::{Matrix3, SMatrix, SVector, Vector1, Vector3, Vector6, vector};
    use num_dual::DualNum;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    type Spin = Product<Sphere<2>, HalfLine>;
    type Attitude = Product<Rotations, Euclidean<3>>;
    type Three = Product<Product<Sphere<1>, Euclidean<1>>, HalfLine>;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn products_keep_the_laws(seed in any::<u64>(), u in prop::array::uniform6(-1.0..1.0)) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let spin = Product(Sphere::<2>, HalfLine);
            let (x, v) = (spin.random(&mut rng), vector![u[0], u[1], u[2]]);
            laws::manifold::<Spin>(&spin, &x, &v)?;
            laws::metric::<Spin, _>(&Canonical, &x, &v)?;
            laws::retraction::<Spin, _, _>(&WeylMidpoint, &Canonical, &x, &v)?;
            laws::retraction::<Spin, _, _>(&Exponential, &Canonical, &x, &v)?;

            let attitude = Product(Rotations, Euclidean::<3>);
            let (x, v) = (attitude.random(&mut rng), Vector6::from(u));
            let metric = (Canonical, Metric::constant(Matrix3::from_diagonal(&vector![1.0, 2.0, 3.0])).unwrap());
            laws::manifold::<Attitude>(&attitude, &x, &v)?;
            laws::metric::<Attitude, _>(&metric, &x, &v)?;
            laws::retraction::<Attitude, _, _>(&WeylMidpoint, &metric, &x, &v)?;
            laws::symmetric_retraction::<Attitude, _, _>(
                &WeylMidpoint, &metric, &x, &Attitude::chart(&x, &v),
            )?;
        }

        #[test]
        fn a_product_may_be_a_factor(seed in any::<u64>(), u in prop::array::uniform3(-1.0..1.0)) {
            let space = Product(Product(Sphere::<1>, Euclidean::<1>), HalfLine);
            let x = space.random(&mut ChaCha8Rng::seed_from_u64(seed));
            laws::manifold::<Three>(&space, &x, &Vector3::from(u))?;
            laws::metric::<Three, _>(&Canonical, &x, &Vector3::from(u))?;
            laws::metric::<Three, _>(&((Canonical, Canonical), Canonical), &x, &Vector3::from(u))?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        /// The identity on `R³ × R`, restricted to `S² × R₊`, with `1/s²` on the half line.
        #[test]
        fn a_full_metric_that_is_the_canonical_one_gives_its_geodesics(
            seed in any::<u64>(), u in prop::array::uniform3(-0.8..0.8),
        ) {
            let field = Metric::field(|(_, s): &(Vector3<Real>, Vector1<Real>)| {
                let mut g = SMatrix::<Real, 4, 4>::identity();
                g[(3, 3)] = s.x.powi(-2);
                g
            });
            let space = Product(Sphere::<2>, HalfLine);
            let x = space.random(&mut ChaCha8Rng::seed_from_u64(seed));
            let u = SVector::from(u);
            let left = Riemannian::<Spin>::end(&field, &x, &u).unwrap();
            let right = Riemannian::<Spin>::end(&Canonical, &x, &u).unwrap();
            prop_assert!(Spin::coordinates(&left, &right).norm() < 1e-12);
            laws::metric::<Spin, _>(&field, &x, &u)?;
        }
    }

    #[test]
    fn a_bad_entry_of_either_factor_is_named() {
        let space = Product(Sphere::<2>, Euclidean::<1>);
        let off = space.check(&(vector![0.0, 0.0, 2.0], vector![1.0])).unwrap_err();
        assert!(matches!(off, PointError::OffManifold { .. }));
        let nan = space.check(&(vector![0.0, 0.0, 1.0], vector![f64::NAN])).unwrap_err();
        assert!(matches!(nan, PointError::NotFinite { index: 3, .. }));
        // Each factor has the last word on its own half.
        let space = Product(Euclidean::<1>, HalfLine);
        let zero = space.check(&(vector![1.0], vector![0.0])).unwrap_err();
        assert!(matches!(zero, PointError::OffManifold { defect, .. } if defect > 0.0));
    }
}
