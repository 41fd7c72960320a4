//! Points at each scalar, and the chart around a point.

use std::fmt::Debug;

use nalgebra::{Const, SMatrix};
use num_dual::Dual64;

use crate::{Column, Dimension, Factors, MatrixJet, Real, Scalar, Square};

/// Components of a vector or covector on `M`.
pub type Vector<M, D = f64> = <<M as Space>::Dim as Dimension>::Vector<D>;

/// Components of a bilinear form or linear map on `M`.
pub type Matrix<M, D = f64> = <<M as Space>::Dim as Dimension>::Matrix<D>;

/// A velocity as it is written by hand: entries of a tangent vector of the embedding, a body angular
/// velocity; see [`Space::embed`].
pub type Velocity<M, D = f64> = <<M as Space>::Velocity as Dimension>::Vector<D>;

/// A tensor as it is written by hand: a square matrix that acts on velocities (a metric) or on
/// covectors dual to them (a Poisson tensor).
pub type Form<M, D = f64> = <<M as Space>::Velocity as Dimension>::Matrix<D>;

/// The points of a manifold at every scalar, and around each real point `x` a chart
/// `φ_x: Rⁿ → M` with `φ_x(0) = x`.
///
/// Derivatives of fields are taken along the `n` directions of this chart, never along the ambient
/// entries of a point, and components of tangent vectors and covectors refer to its coordinate
/// frame `∂φ_x/∂qⁱ`.
///
/// Users do not see the frame of a chart. They write a tensor in the terms of a velocity
/// ([`embed`](Self::embed)), which needs no chart: the components themselves on a vector space,
/// the entries of `x'` on a sphere, the body angular velocity on SO(3).
///
/// Laws: 1. `φ_x(0) = x`; 2. `φ_x⁻¹(φ_x(q)) = q` near `q = 0`; 3. both at dual numbers too;
/// 4. `real` undoes `constant`; 5. `seeds` are the chart at dual numbers.
pub trait Space: Clone + Debug + PartialEq + Send + Sync + 'static {
    /// The dimension `n`.
    type Dim: Dimension;
    /// The number of entries of a velocity: `n` on vector spaces and groups, more where velocities
    /// are written in the space around.
    type Velocity: Dimension;
    /// A point with entries in `D`: a vector in Rⁿ, a matrix on a group, a pair on a product.
    type Point<D: Scalar>: Clone + Debug + PartialEq + Send + Sync + 'static;

    /// Embeds a real point in the scalar `D`.
    fn constant<D: Scalar>(x: &Self::Point<f64>) -> Self::Point<D>;

    /// Returns the real part of a point.
    fn real<D: Scalar>(x: &Self::Point<D>) -> Self::Point<f64>;

    /// Computes the point `φ_x(q)`.
    fn chart<D: Scalar>(x: &Self::Point<f64>, q: &Vector<Self, D>) -> Self::Point<D>;

    /// Returns the points `φ_x(ε₁ e_i + ε₂ e_j)`, by `i` and `j`, which give the derivatives of fields. An index
    /// beyond the dimension seeds nothing.
    #[inline]
    fn seeds(x: &Self::Point<f64>) -> impl Fn(usize, usize) -> Self::Point<Real> {
        let x = x.clone();
        move |i, j| {
            let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
            let seed = |k| Real::new(0.0, part(k, i), part(k, j), 0.0);
            Self::chart(&x, &Vector::<Self, Real>::from_index(seed))
        }
    }

    /// Computes the coordinates `φ_x⁻¹(y)`, for `y` near `x`.
    fn coordinates<D: Scalar>(x: &Self::Point<f64>, y: &Self::Point<D>) -> Vector<Self, D>;

    /// Computes the velocity `θ(x) v` of a tangent vector with the components `v` in the frame of the chart of
    /// `x`: linear in `v`, and one to one.
    fn embed<D: Scalar>(x: &ChartPoint<Self, D>, v: &Vector<Self, D>) -> Velocity<Self, D>;

    /// Computes the matrix `θᵀ A θ` of a bilinear form on velocities, in the frame of the chart.
    fn covariant<D: Scalar>(x: &ChartPoint<Self, D>, a: &Form<Self, D>) -> Matrix<Self, D> {
        let theta = frame(x);
        let image = Self::Dim::array(|j| *a * theta[j]);
        Matrix::<Self, D>::from_entries(|i, j| theta[i].dot(&image[j]))
    }

    /// Computes the same matrix with its first derivatives along the chart, at the real coordinates `q` of the chart at
    /// `x`, from the form `a(i, j)` at `φ_x(q + ε₁ e_i + ε₂ e_j)`.
    fn covariant_jet(
        x: &Self::Point<f64>,
        q: &Vector<Self>,
        a: impl Fn(usize, usize) -> Form<Self, Real>,
    ) -> MatrixJet<Self> {
        let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
        MatrixJet::new(|i, j| {
            let seed = |k| Real::new(q[k], part(k, i), part(k, j), 0.0);
            let at = ChartPoint { base: x.clone(), q: Vector::<Self, Real>::from_index(seed) };
            Self::covariant(&at, &a(i, j))
        })
    }

    /// Computes the matrix `θ⁺ A θ⁺ᵀ` of a bilinear form on covectors dual to velocities, in the frame of the
    /// chart, with `θ⁺ = (θᵀθ)⁻¹θᵀ`; `None` at the edge of the chart, where it has no frame.
    fn contravariant<D: Scalar>(
        x: &ChartPoint<Self, D>,
        a: &Form<Self, D>,
    ) -> Option<Matrix<Self, D>> {
        let theta = frame(x);
        let gram = Matrix::<Self, D>::from_entries(|i, j| theta[i].dot(&theta[j])).factor()?;
        // The columns of θ⁺ᵀ = θ (θᵀθ)⁻¹.
        let mut dual = theta;
        for k in 0..Self::Dim::LEN {
            let weights = gram.solve(&Vector::<Self, D>::basis(k))?;
            let mut sum = Velocity::<Self, D>::zero();
            for j in 0..Self::Dim::LEN {
                sum += theta[j] * weights[j];
            }
            dual[k] = sum;
        }
        let image = Self::Dim::array(|j| *a * dual[j]);
        Some(Matrix::<Self, D>::from_entries(|i, j| dual[i].dot(&image[j])))
    }

    /// Says whether this is `Rⁿ` in all but its bracket: the entries of a point are its coordinates, the chart is `φ_x(q) = x + q`, and sizes,
    /// membership and products with covectors are those of columns.
    #[doc(hidden)]
    const IS_VECTOR_SPACE: bool = false;

    /// Whether [`stage_rates`](Self::stage_rates) returns the velocity that it is given, as in charts that are
    /// translations.
    const RATES_ARE_VELOCITIES: bool = false;

    /// Computes the point `ψ_x(q)` of the chart in which explicit methods take their stages. It agrees with
    /// `φ_x` to first order at `q = 0`, and may be cheaper: rational where `φ_x` has angles. The default is `φ_x`.
    ///
    /// Laws: 1. `ψ_x(0) = x`, in the frame of `φ_x`; 2. [`stage_coordinates`](Self::stage_coordinates) is its
    /// inverse; 3. [`stage_rates`](Self::stage_rates) is the derivative of this inverse.
    #[inline]
    fn stage(x: &Self::Point<f64>, q: &Vector<Self>) -> Self::Point<f64> {
        Self::chart(x, q)
    }

    /// Computes the coordinates `ψ_x⁻¹(y)`.
    #[inline]
    fn stage_coordinates(x: &Self::Point<f64>, y: &Self::Point<f64>) -> Vector<Self> {
        Self::coordinates(x, y)
    }

    /// Computes the rates `q'` at `y = ψ_x(q)` for the velocity `v` in the frame of the chart at `y`. The default
    /// is `d/dε φ_x⁻¹(φ_y(εv))`, by a dual number.
    #[inline]
    fn stage_rates(
        x: &Self::Point<f64>,
        (q, y): (&Vector<Self>, &Self::Point<f64>),
        v: &Vector<Self>,
    ) -> Vector<Self> {
        let _ = q;
        let moved = Vector::<Self, Dual64>::from_index(|i| Dual64::new(0.0, v[i]));
        let rates = Self::coordinates(x, &Self::chart(y, &moved));
        Vector::<Self>::from_index(|i| rates[i].eps)
    }

    /// Returns whether a stage may be taken at the coordinates `q`. The default is [`is_near`](Self::is_near).
    #[inline]
    fn is_stage(q: &Vector<Self>) -> bool {
        Self::is_near(q)
    }

    /// Returns whether the point with coordinates `q` is less than half the way to the edge of the chart. A
    /// chart of the whole space has no edge. Long curves change to another chart before the edge, and a logarithm
    /// is not looked for beyond twice this distance.
    #[inline]
    fn is_near(_q: &Vector<Self>) -> bool {
        true
    }
}

/// The derivatives of a symmetric form in the frame of a chart by the product rule,
/// `∂_k(θᵀAθ) = θᵀ(∂_kA)θ + B + Bᵀ` with `B = (∂_kθ)ᵀ A θ`, in real numbers: a faster
/// [`Space::covariant_jet`] for a space whose `theta(k)` is `θ` with its derivative along the `k`-th
/// direction of the chart.
#[inline]
pub fn product_rule<M, const A: usize, const N: usize>(
    theta: impl Fn(usize) -> SMatrix<Dual64, A, N>,
    a: impl Fn(usize, usize) -> SMatrix<Real, A, A>,
) -> MatrixJet<M>
where
    M: Space<Dim = Const<N>>,
{
    let mut last = a(0, 1);
    let form = last.map(|a| a.re);
    let frame = theta(0).map(|theta| theta.re);
    // Row by row of Aᵀθ and Aθ, which are the same for a symmetric form.
    let image = SMatrix::<f64, A, N>::from_fn(|i, j| inner(A, |l| form[(i, l)] * frame[(l, j)]));
    let along = |other: &SMatrix<f64, A, N>, image: &SMatrix<f64, A, N>| {
        SMatrix::<f64, N, N>::from_fn(|i, j| inner(A, |l| other[(l, i)] * image[(l, j)]))
    };
    let slopes = std::array::from_fn(|k| {
        if k > 0 && k % 2 == 0 {
            last = a(k, k + 1);
        }
        let slope = last.map(|a| if k % 2 == 0 { a.eps1 } else { a.eps2 });
        let bend = along(&theta(k).map(|theta| theta.eps), &image);
        let moved =
            SMatrix::<f64, A, N>::from_fn(|i, j| inner(A, |l| slope[(i, l)] * frame[(l, j)]));
        along(&frame, &moved) + bend + bend.transpose()
    });
    MatrixJet { value: along(&frame, &image), slopes }
}

/// `Σ_l f(l)` over the first `n` numbers.
#[inline]
fn inner(n: usize, f: impl Fn(usize) -> f64) -> f64 {
    (0..n).fold(0.0, |sum, l| sum + f(l))
}

/// The columns of `θ`: the velocities of the chart's frame.
fn frame<M: Space, D: Scalar>(
    x: &ChartPoint<M, D>,
) -> <M::Dim as Dimension>::Array<Velocity<M, D>> {
    M::Dim::array(|k| M::embed(x, &Vector::<M, D>::basis(k)))
}

/// A point `φ_x(q)` written in the chart at the real point `x`: the place where a tensor is
/// evaluated, and the frame that its components refer to.
#[derive(Clone, Debug)]
pub struct ChartPoint<M: Space, D: Scalar = f64> {
    /// The centre `x` of the chart.
    pub base: M::Point<f64>,
    /// The coordinates `q`.
    pub q: Vector<M, D>,
}

impl<M: Space, D: Scalar> ChartPoint<M, D> {
    /// Makes the centre of the chart at `x`, `q = 0`.
    pub fn centre(x: &M::Point<f64>) -> Self {
        Self { base: x.clone(), q: Vector::<M, D>::zero() }
    }

    /// Makes a point in the chart centred at its real part.
    pub fn around(x: &M::Point<D>) -> Self {
        let base = M::real(x);
        let q = M::coordinates(&base, x);
        Self { base, q }
    }

    /// Computes the point `φ_x(q)`.
    pub fn point(&self) -> M::Point<D> {
        M::chart(&self.base, &self.q)
    }
}
