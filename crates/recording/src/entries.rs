//! The entries of a point, at any scalar.

use metriplectic_fields::{Column, Dimension, Matrix, Real, Scalar, Square, Vector, seeded};
use metriplectic_manifolds::{
    Chart, Euclidean, HalfLine, LieDual, Manifold, Product, Rotations, Sphere, Times,
};
use nalgebra::{Matrix3, SVector};

/// A space whose points are lists of entries at any scalar: the inputs of a tape.
///
/// All spaces of this library are. A space of your own says how its points are written.
///
/// Laws: 1. [`point`](Self::point) undoes [`list`](Self::list); 2. the entries are those of
/// [`Manifold::entries`], in their order, [`COUNT`](Self::COUNT) of them; 3. [`pull_back`](Self::pull_back) is the transpose
/// of the derivative of the chart, and [`bend`](Self::bend) its second derivative; so are [`pull_back_at`](Self::pull_back_at)
/// and [`bend_at`](Self::bend_at) off the centre.
pub trait PointEntries: Manifold {
    /// The number of entries.
    const COUNT: usize;

    /// Says whether the entries are the coordinates, and the chart is `φ_x(q) = x + q`.
    const IS_TRANSLATION: bool = false;

    /// Passes the entries on, one by one.
    fn list<D: Scalar>(x: &Self::Point<D>, put: &mut impl FnMut(D));

    /// Makes the point with the entries `next()`, `next()`, …
    fn point<D: Scalar>(next: &mut impl FnMut() -> D) -> Self::Point<D>;

    /// Computes `Σ_e w_e ∂x_e/∂qⁱ`, the differential along the chart at `x` of a function with the derivatives `w_e` by
    /// the entries.
    #[inline]
    fn pull_back(x: &Self::Point<f64>, w: &[f64]) -> Vector<Self> {
        if Self::IS_TRANSLATION {
            return Vector::<Self>::from_index(|i| w[i]);
        }
        pulled::<Self>(&Self::seeds(x), w)
    }

    /// Computes `Σ_e w_e ∂²x_e/∂qⁱ∂qʲ`, what the curvature of the chart at `x` adds to a Hessian.
    #[inline]
    fn bend(x: &Self::Point<f64>, w: &[f64]) -> Matrix<Self> {
        if Self::IS_TRANSLATION {
            return Matrix::<Self>::zeros();
        }
        bent::<Self>(&Self::seeds(x), w)
    }

    /// Computes the same sum `Σ_e w_e ∂x_e/∂qⁱ` at the coordinates `q` of the chart at `x`, off its centre.
    #[inline]
    fn pull_back_at(x: &Self::Point<f64>, q: &Vector<Self>, w: &[f64]) -> Vector<Self> {
        if Self::IS_TRANSLATION {
            return Vector::<Self>::from_index(|i| w[i]);
        }
        pulled::<Self>(&|i, j| seeded::<Self>(x, q, i, j), w)
    }

    /// Computes the same sum `Σ_e w_e ∂²x_e/∂qⁱ∂qʲ` at the coordinates `q` of the chart at `x`, off its centre.
    #[inline]
    fn bend_at(x: &Self::Point<f64>, q: &Vector<Self>, w: &[f64]) -> Matrix<Self> {
        if Self::IS_TRANSLATION {
            return Matrix::<Self>::zeros();
        }
        bent::<Self>(&|i, j| seeded::<Self>(x, q, i, j), w)
    }
}

/// `Σ_e w_e ∂x_e/∂qⁱ`, from the points `φ(q + ε₁ e_i + ε₂ e_j)`.
#[inline]
fn pulled<M: PointEntries>(
    seeded: &impl Fn(usize, usize) -> M::Point<Real>,
    w: &[f64],
) -> Vector<M> {
    let mut df = Vector::<M>::zero();
    let n = M::Dim::LEN;
    for i in (0..n).step_by(2) {
        let mut weights = w.iter();
        M::list(&seeded(i, i + 1), &mut |entry| {
            let w = weights.next().copied().unwrap_or(f64::NAN);
            df[i] += entry.eps1 * w;
            if i + 1 < n {
                df[i + 1] += entry.eps2 * w;
            }
        });
    }
    df
}

/// `Σ_e w_e ∂²x_e/∂qⁱ∂qʲ`, from the points `φ(q + ε₁ e_i + ε₂ e_j)`.
fn bent<M: PointEntries>(seeded: &impl Fn(usize, usize) -> M::Point<Real>, w: &[f64]) -> Matrix<M> {
    let mut hf = Matrix::<M>::zeros();
    for j in 0..M::Dim::LEN {
        for i in 0..=j {
            let (mut sum, mut weights) = (0.0, w.iter());
            M::list(&seeded(i, j), &mut |entry| {
                sum += entry.eps1eps2 * weights.next().copied().unwrap_or(f64::NAN);
            });
            (hf[(i, j)], hf[(j, i)]) = (sum, sum);
        }
    }
    hf
}

macro_rules! columns {
    () => {
        #[inline]
        fn list<D: Scalar>(x: &Self::Point<D>, put: &mut impl FnMut(D)) {
            x.iter().copied().for_each(put);
        }

        #[inline]
        fn point<D: Scalar>(next: &mut impl FnMut() -> D) -> Self::Point<D> {
            SVector::from_fn(|_, _| next())
        }
    };
}

macro_rules! translations {
    ($($space:ident)*) => {$(
        impl<const N: usize> PointEntries for $space<N> {
            const COUNT: usize = N;
            const IS_TRANSLATION: bool = true;

            columns!();
        }
    )*};
}

translations!(Euclidean LieDual Chart);

macro_rules! spheres {
    ($($n:literal in $count:literal),*) => {$(
        impl PointEntries for Sphere<$n> {
            const COUNT: usize = $count;

            columns!();
        }
    )*};
}

spheres!(1 in 2, 2 in 3, 3 in 4, 4 in 5, 5 in 6, 6 in 7, 7 in 8);

impl PointEntries for HalfLine {
    const COUNT: usize = 1;

    columns!();
}

/// A rotation is written row by row.
impl PointEntries for Rotations {
    const COUNT: usize = 9;

    #[inline]
    fn list<D: Scalar>(x: &Matrix3<D>, put: &mut impl FnMut(D)) {
        x.transpose().iter().copied().for_each(put);
    }

    #[inline]
    fn point<D: Scalar>(next: &mut impl FnMut() -> D) -> Matrix3<D> {
        Matrix3::from_fn(|_, _| next()).transpose()
    }
}

/// A point of a product is written as those of its factors, one after the other.
impl<A: PointEntries + Times<B>, B: PointEntries> PointEntries for Product<A, B> {
    const COUNT: usize = A::COUNT + B::COUNT;
    const IS_TRANSLATION: bool = A::IS_TRANSLATION && B::IS_TRANSLATION;

    #[inline]
    fn list<D: Scalar>((a, b): &Self::Point<D>, put: &mut impl FnMut(D)) {
        A::list(a, put);
        B::list(b, put);
    }

    #[inline]
    fn point<D: Scalar>(next: &mut impl FnMut() -> D) -> Self::Point<D> {
        let a = A::point(next);
        (a, B::point(next))
    }

    #[inline]
    fn pull_back((a, b): &Self::Point<f64>, w: &[f64]) -> Vector<Self> {
        let (left, right) = w.split_at(A::COUNT);
        Self::join(&A::pull_back(a, left), &B::pull_back(b, right))
    }

    #[inline]
    fn bend((a, b): &Self::Point<f64>, w: &[f64]) -> Matrix<Self> {
        let (left, right) = w.split_at(A::COUNT);
        Self::block(&A::bend(a, left), &B::bend(b, right))
    }

    #[inline]
    fn pull_back_at((a, b): &Self::Point<f64>, q: &Vector<Self>, w: &[f64]) -> Vector<Self> {
        let ((qa, qb), (left, right)) = (Self::split(q), w.split_at(A::COUNT));
        Self::join(&A::pull_back_at(a, &qa, left), &B::pull_back_at(b, &qb, right))
    }

    #[inline]
    fn bend_at((a, b): &Self::Point<f64>, q: &Vector<Self>, w: &[f64]) -> Matrix<Self> {
        let ((qa, qb), (left, right)) = (Self::split(q), w.split_at(A::COUNT));
        Self::block(&A::bend_at(a, &qa, left), &B::bend_at(b, &qb, right))
    }
}
