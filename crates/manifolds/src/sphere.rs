//! The unit spheres Sⁿ, n = 1 … 7,
//!
//! ```math
//! S^n = \{ x \in \mathbb R^{n+1} : |x| = 1 \}, \qquad
//! T_x S^n = \{ v \in \mathbb R^{n+1} : x^T v = 0 \} .
//! ```
//!
//! - **Point and velocity**: columns `x` and `x'` of `n + 1` numbers.
//! - **Frame**: orthonormal columns `E(x)` with `det[x, E] = +1`, those of the Householder reflection
//!   that takes the last axis to `∓x`.
//! - **Chart**: normal coordinates, which end with one step `ν` of Newton's iteration for `|y| = 1`, so that
//!   every point of a run has norm 1 to round-off and
//!   [never drifts](mod@crate::manifold#why-points-do-not-drift),
//!
//! ```math
//! \varphi_x(q) = \nu\Bigl(\cos|q|\, x + \frac{\sin|q|}{|q|}\, E q\Bigr), \qquad
//! \nu(y) = \tfrac12 (3 - |y|^2)\, y ,
//! ```
//!
//! ```math
//! \varphi_x^{-1}(y) = \frac{\theta}{\sin\theta}\, E^T (y \mp x), \qquad
//! \theta = \mathrm{atan2}\bigl(|E^T (y \mp x)|,\ x^T y\bigr) ,
//! ```
//!
//! with the sign that makes `y ∓ x` short. `Eᵀx = 0`, so both signs are exact, and the short one has more digits.
//! - **Geodesics** of the round metric are great circles, `exp_x(v) = φ_x(v)` and
//!   `log_x(y) = φ_x⁻¹(y)`, up to the injectivity radius π (Absil, Mahony and Sepulchre 2008, §5.4). Longer
//!   geodesics are refused. From `θ = 10⁻¹⁵` to `π − 10⁻¹⁰` the logarithm of rounded points was measured within
//!   `8ε min(θ, 1)/(π − θ)` of their exact logarithm, whose direction is undefined at the antipode. Their
//!   distance was measured within `3ε min(θ, 1)`.
//! - **Stages** of explicit methods: stereographic coordinates, `ψ_x(q) = ((1 − s) x + E q)/(1 + s)` with
//!   `s = |q|²/4`, up to `|q| = 4`.
//! - **Other metrics** are forms on Rⁿ⁺¹, by [`Metric::field`](crate::Metric::field);
//!   [`Projection`](crate::Projection) is a retraction for all of them.
//! - **Brackets**: none by default. `AreaForm` on S², `x' = x × ∇H` (Marsden and Ratiu 1999,
//!   §2), without a Casimir; `Nambu` on S³, with the volume `det[x, a, b, c]`, and with `n − 2` Casimirs on Sⁿ;
//!   `Poisson::field` with a bivector of Rⁿ⁺¹.

use std::f64::consts::PI;

use metriplectic_fields::series::{angle_over_sine, stumpff};
use metriplectic_fields::{ChartPoint, Column, MatrixJet, Real, Scalar, Space, product_rule};
use nalgebra::{Const, SMatrix, SVector};
use num_dual::{Dual, Dual64};
use rand::{Rng, RngExt};

use crate::metric::{GeodesicEnd, MetricError};
use crate::metric_error::{finite_column, within};
use crate::normal::Normal;
use crate::{Canonical, Manifold, Riemannian, Slopes, StepPath, StepPathJet};

/// The unit sphere `Sⁿ = { x ∈ Rⁿ⁺¹ : |x| = 1 }` for `n = 1 … 7`, with the round metric as its
/// canonical one; see the [module](mod@crate::sphere).
///
/// ```
/// use metriplectic_manifolds::{Canonical, Manifold, Riemannian, Sphere};
/// use nalgebra::vector;
/// let (x, y) = (vector![1.0, 0.0, 0.0], vector![0.0, 0.0, 1.0]);
/// let quarter = Riemannian::<Sphere<2>>::log(&Canonical, &x, &y).unwrap();
/// assert!((quarter.norm() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sphere<const N: usize>;

impl<const N: usize> Sphere<N> {
    /// The sphere with its round metric.
    pub const fn round() -> Self {
        Self
    }
}

/// An orthonormal basis of the tangent space at `x`, with `det[x, E] = +1`: the columns of the
/// Householder reflection `1 − a aᵀ/(1 + |x_N|)` along `a = x ± e_N`, which takes the last axis to
/// `∓x`, all but the last.
#[inline]
pub(crate) fn frame<const A: usize, const N: usize>(x: &SVector<f64, A>) -> SMatrix<f64, A, N> {
    let sign = 1.0_f64.copysign(x[N]);
    let scale = (1.0 + x[N].abs()).recip();
    // The reflection has determinant −1 and last column −sign·x, so det[E, x] = sign.
    let oriented = if N.is_multiple_of(2) { sign } else { -sign };
    SMatrix::from_fn(|i, j| {
        let entry = match i {
            _ if i == N => -sign * x[j],
            _ if i == j => 1.0 - scale * x[i] * x[j],
            _ => -scale * x[i] * x[j],
        };
        if j == 0 { oriented * entry } else { entry }
    })
}

/// `E q` at a scalar.
#[inline]
pub(crate) fn spread<D: Scalar, const A: usize, const N: usize>(
    e: &SMatrix<f64, A, N>,
    q: &SVector<D, N>,
) -> SVector<D, A> {
    SVector::from_fn(|i, _| (0..N).fold(D::zero(), |sum, j| sum + q[j] * e[(i, j)]))
}

/// `Eᵀ v` at a scalar.
#[inline]
pub(crate) fn components<D: Scalar, const A: usize, const N: usize>(
    e: &SMatrix<f64, A, N>,
    v: &SVector<D, A>,
) -> SVector<D, N> {
    SVector::from_fn(|j, _| (0..A).fold(D::zero(), |sum, i| sum + v[i] * e[(i, j)]))
}

/// The derivative of the chart at `q`, whose columns are the velocities of its frame:
/// `x' = c₁ E v − (q·v) (c₁ x + (c₂ − c₃) E q)`, with the Stumpff functions at `|q|²`.
#[inline]
fn pushforward<D: Scalar, const A: usize, const N: usize>(
    x: &SVector<f64, A>,
    q: &SVector<D, N>,
) -> SMatrix<D, A, N> {
    let (e, [_, c1, c2, c3]) = (frame::<A, N>(x), stumpff(q.dot(q)));
    let along = spread(&e, q) * (c2 - c3);
    SMatrix::from_fn(|i, k| c1 * e[(i, k)] - (along[i] + c1 * x[i]) * q[k])
}

/// `q + ε e_k`.
#[inline]
pub(crate) fn along<const N: usize>(q: &SVector<f64, N>, k: usize) -> SVector<Dual64, N> {
    SVector::from_fn(|i, _| Dual64::new(q[i], if i == k { 1.0 } else { 0.0 }))
}

/// The point at time `t` of the great circle from `x` with velocity `v`, and its velocity there:
/// `c₀(t²s) x + t c₁(t²s) v` with `s = |v|²`.
#[inline]
fn great_circle<D: Scalar, const A: usize>(
    x: &SVector<D, A>,
    v: &SVector<D, A>,
    t: f64,
) -> [SVector<D, A>; 2] {
    let s = v.dot(v);
    let [cosine, sine, ..] = stumpff(s * (t * t));
    [x * cosine + v * (sine * t), v * cosine - x * (s * sine * t)]
}

/// The angle between two points, by the lengths of the sides and not by the arc cosine, which has no
/// digits for near points; it is not a number where a point is not finite.
#[inline]
pub(crate) fn angle<const A: usize>(x: &SVector<f64, A>, y: &SVector<f64, A>) -> f64 {
    let sides = [(y - x).norm(), (y + x).norm()];
    if sides[1].is_finite() { 2.0 * sides[0].atan2(sides[1]) } else { f64::NAN }
}

/// Brings a point that is on the sphere up to round-off back to it, by one step of Newton's iteration
/// `x ← x(3 − |x|²)/2` for the norm of the real part.
#[inline]
fn polished<D: Scalar, const A: usize>(x: &SVector<D, A>) -> SVector<D, A> {
    let square = x.iter().fold(0.0, |sum, entry| sum + entry.re() * entry.re());
    let scale = 1.5 - 0.5 * square;
    x.map(|entry| entry * scale)
}

/// Divides by the norm of the real part, which leaves derivatives along the sphere alone.
#[inline]
pub(crate) fn normalised<D: Scalar, const A: usize>(x: &SVector<D, A>) -> SVector<D, A> {
    let norm = Column::magnitude(x);
    x.map(|entry| entry / norm)
}

macro_rules! sphere {
    ($n:literal in $a:literal) => {
        impl Space for Sphere<$n> {
            type Dim = Const<$n>;
            type Velocity = Const<$a>;
            type Point<D: Scalar> = SVector<D, $a>;

            #[inline]
            fn constant<D: Scalar>(x: &SVector<f64, $a>) -> SVector<D, $a> {
                Column::embed(x)
            }

            #[inline]
            fn real<D: Scalar>(x: &SVector<D, $a>) -> SVector<f64, $a> {
                Column::real(x)
            }

            #[inline]
            fn chart<D: Scalar>(x: &SVector<f64, $a>, q: &SVector<D, $n>) -> SVector<D, $a> {
                let [cosine, sine, ..] = stumpff(q.dot(q));
                let along = spread(&frame::<$a, $n>(x), q) * sine;
                polished(&SVector::from_fn(|i, _| along[i] + cosine * x[i]))
            }

            /// `x + ε₁ E_i + ε₂ E_j − ε₁ε₂ δ_ij x`, because `cos|q| = 1 − |q|²/2` for a seed.
            #[inline]
            fn seeds(x: &SVector<f64, $a>) -> impl Fn(usize, usize) -> SVector<Real, $a> {
                let (x, e) = (*x, frame::<$a, $n>(x));
                move |i, j| {
                    let entry = |row, column| if column < $n { e[(row, column)] } else { 0.0 };
                    let bend = if i == j && i < $n { -1.0 } else { 0.0 };
                    SVector::from_fn(|k, _| Real::new(x[k], entry(k, i), entry(k, j), bend * x[k]))
                }
            }

            fn coordinates<D: Scalar>(x: &SVector<f64, $a>, y: &SVector<D, $a>) -> SVector<D, $n> {
                let cosine = y.dot(&Column::embed(x));
                // Eᵀx = 0, and the shorter one of y − x and y + x has the digits of y across x.
                let side = 1_f64.copysign(cosine.re());
                let short = SVector::<D, $a>::from_fn(|i, _| y[i] - side * x[i]);
                let tangent = components(&frame::<$a, $n>(x), &short);
                tangent * angle_over_sine(tangent.dot(&tangent), cosine)
            }

            fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &SVector<D, $n>) -> SVector<D, $a> {
                let theta = pushforward(&at.base, &at.q);
                SVector::from_fn(|i, _| {
                    (0..$n).fold(D::zero(), |sum, k| sum + theta[(i, k)] * v[k])
                })
            }

            fn covariant<D: Scalar>(
                at: &ChartPoint<Self, D>,
                a: &SMatrix<D, $a, $a>,
            ) -> SMatrix<D, $n, $n> {
                let theta = pushforward(&at.base, &at.q);
                theta.tr_mul(&SMatrix::<D, $a, $n>::from_fn(|i, k| {
                    (0..$a).fold(D::zero(), |sum, j| sum + a[(i, j)] * theta[(j, k)])
                }))
            }

            #[inline]
            fn covariant_jet(
                x: &SVector<f64, $a>,
                q: &SVector<f64, $n>,
                a: impl Fn(usize, usize) -> SMatrix<Real, $a, $a>,
            ) -> MatrixJet<Self> {
                product_rule(|k| pushforward(x, &along(q, k)), a)
            }

            /// Stereographic, `((1 − s) x + E q)/(1 + s)` with `s = |q|²/4`.
            #[inline]
            fn stage(x: &SVector<f64, $a>, q: &SVector<f64, $n>) -> SVector<f64, $a> {
                let s = 0.25 * q.norm_squared();
                polished(&((x * (1.0 - s) + frame::<$a, $n>(x) * q) / (1.0 + s)))
            }

            /// `q = 2Eᵀy/(1 + x·y)`.
            #[inline]
            fn stage_coordinates(x: &SVector<f64, $a>, y: &SVector<f64, $a>) -> SVector<f64, $n> {
                // Eᵀx = 0, and y − x has the digits of y across x.
                frame::<$a, $n>(x).tr_mul(&(y - x)) * (2.0 / (1.0 + x.dot(y)))
            }

            /// `(2Eᵀa − q (x·a))/(1 + x·y)` with `a = E(y) v`.
            #[inline]
            fn stage_rates(
                x: &SVector<f64, $a>,
                (q, y): (&SVector<f64, $n>, &SVector<f64, $a>),
                v: &SVector<f64, $n>,
            ) -> SVector<f64, $n> {
                let a = frame::<$a, $n>(y) * v;
                (frame::<$a, $n>(x).tr_mul(&a) * 2.0 - q * x.dot(&a)) / (1.0 + x.dot(y))
            }

            #[inline]
            fn is_stage(q: &SVector<f64, $n>) -> bool {
                q.norm_squared() <= 16.0
            }

            #[inline]
            fn is_near(q: &SVector<f64, $n>) -> bool {
                q.norm() < 0.5 * PI
            }
        }

        impl Manifold for Sphere<$n> {
            fn defect(&self, x: &SVector<f64, $a>) -> f64 {
                (x.norm() - 1.0).abs()
            }

            fn entries(x: &SVector<f64, $a>) -> Vec<f64> {
                x.iter().copied().collect()
            }

            fn assemble(next: &mut impl FnMut() -> f64) -> SVector<f64, $a> {
                SVector::<f64, $a>::from_fn(|_, _| next())
            }

            #[inline]
            fn magnitude(_: &SVector<f64, $a>) -> f64 {
                1.0
            }

            /// By projection of the ambient vector.
            #[inline]
            fn transport(
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
                v: &SVector<f64, $n>,
            ) -> SVector<f64, $n> {
                frame::<$a, $n>(y).tr_mul(&(frame::<$a, $n>(x) * v))
            }

            #[inline]
            fn transport_all(
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
                vectors: &mut [SVector<f64, $n>],
            ) {
                let turn = frame::<$a, $n>(y).tr_mul(&frame::<$a, $n>(x));
                for v in vectors {
                    *v = turn * *v;
                }
            }

            /// The great circle, with `γ'(½) = c₀ U − ½s c₁ x`, `U = E(x) u` and the Stumpff functions at
            /// `s/4 = |u|²/4`.
            #[inline]
            fn line(x: &SVector<f64, $a>, u: &SVector<f64, $n>) -> StepPath<Self> {
                let [z, velocity] = great_circle(x, &(frame::<$a, $n>(x) * u), 0.5);
                let z = polished(&z);
                let d = frame::<$a, $n>(&z).tr_mul(&velocity);
                StepPath { z: ChartPoint::centre(&z), d, end: Self::chart(x, u) }
            }

            #[inline]
            fn line_jet(x: &SVector<f64, $a>, u: &SVector<f64, $n>) -> StepPathJet<Self> {
                great_circle_jet::<Self, $a, $n>(x, u)
            }

            /// The end of a finite displacement is a point.
            #[inline]
            fn line_end(x: &SVector<f64, $a>, u: &SVector<f64, $n>) -> Option<SVector<f64, $a>> {
                Some(Self::chart(x, u))
            }

            /// With the velocity of the great circle, and `γ'' = −|u|² γ`.
            #[inline]
            fn line_at(x: &SVector<f64, $a>, u: &SVector<f64, $n>, t: f64) -> SVector<Real, $a> {
                let (v, s) = (frame::<$a, $n>(x) * u, u.norm_squared());
                let [y, dy] = if t > 0.0 { great_circle(x, &v, t) } else { [*x, v] };
                SVector::from_fn(|i, _| Real::new(y[i], dy[i], dy[i], -s * y[i]))
            }

            /// `x/|x|`; the centre is equally far from all points, and has entries that are not
            /// numbers.
            fn project(&self, x: &SVector<f64, $a>) -> SVector<f64, $a> {
                // So that no square overflows or vanishes.
                normalised(&(x / x.amax()))
            }

            /// Uniform: the direction of a Gaussian vector (Muller 1959).
            fn random(&self, rng: &mut impl Rng) -> SVector<f64, $a> {
                normalised(&SVector::<f64, $a>::from_fn(|_, _| gaussian(rng)))
            }
        }

        impl Riemannian<Sphere<$n>> for Canonical {
            type At<D: Scalar> = Normal<D, $n>;

            #[inline]
            fn at<D: Scalar>(
                &self,
                x: &ChartPoint<Sphere<$n>, D>,
            ) -> Result<Normal<D, $n>, MetricError> {
                Ok(Normal::at(&x.q, 1.0))
            }

            fn matrix<D: Scalar>(&self, x: &ChartPoint<Sphere<$n>, D>) -> SMatrix<D, $n, $n> {
                Normal::at(&x.q, 1.0).matrix()
            }

            #[inline]
            fn volume_density<D: Scalar>(at: &Normal<D, $n>) -> Result<D, MetricError> {
                Ok(at.volume_density())
            }

            fn exp<D: Scalar>(
                &self,
                x: &ChartPoint<Sphere<$n>, D>,
                v: &SVector<D, $n>,
            ) -> Result<GeodesicEnd<Sphere<$n>, D>, MetricError> {
                // The chart is pushed forward, and pulled back at the end, by one more dual number.
                let moved = SVector::from_fn(|i, _| Dual::new(x.q[i], v[i]));
                let start = Sphere::<$n>::chart(&x.base, &moved);
                let (point, velocity) = (start.map(|p| p.re), start.map(|p| p.eps));
                within(PI, Column::magnitude(&velocity))?;
                let [point, velocity] = great_circle(&point, &velocity, 1.0);
                let point = polished(&point);
                let base = Sphere::<$n>::real(&point);
                let end = SVector::from_fn(|i, _| Dual::new(point[i], velocity[i]));
                let q = Sphere::<$n>::coordinates(&base, &end);
                Ok((ChartPoint { base, q: q.map(|q| q.re) }, q.map(|q| q.eps)))
            }

            #[inline]
            fn end(
                &self,
                x: &SVector<f64, $a>,
                v: &SVector<f64, $n>,
            ) -> Result<SVector<f64, $a>, MetricError> {
                within(PI, v.norm())?;
                finite_column("an entry of the end", Sphere::<$n>::chart(x, v))
            }

            #[inline]
            fn along(
                &self,
                x: &SVector<f64, $a>,
                v: &SVector<f64, $n>,
                t: f64,
            ) -> Result<SVector<Real, $a>, MetricError> {
                within(PI, v.norm())?;
                Ok(Sphere::<$n>::line_at(x, v, t))
            }

            fn log(
                &self,
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
            ) -> Result<SVector<f64, $n>, MetricError> {
                within(PI, angle(x, y))?;
                finite_column("the logarithm", Sphere::<$n>::coordinates(x, y))
            }

            fn distance(
                &self,
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
            ) -> Result<f64, MetricError> {
                let length = angle(x, y);
                within(PI, length)?;
                // The sides of near points have the rounding of their norms, which the chart leaves out.
                Ok(if length < 1.0 { Sphere::<$n>::coordinates(x, y).norm() } else { length })
            }

            #[inline]
            fn weyl_path(
                &self,
                x: &SVector<f64, $a>,
                d: &SVector<f64, $n>,
            ) -> Result<StepPath<Sphere<$n>>, MetricError> {
                within(PI, d.norm())?;
                Ok(Sphere::<$n>::line(x, d))
            }

            #[inline]
            fn weyl_jet(
                &self,
                x: &SVector<f64, $a>,
                d: &SVector<f64, $n>,
            ) -> Result<StepPathJet<Sphere<$n>>, MetricError> {
                within(PI, d.norm())?;
                Ok(Sphere::<$n>::line_jet(x, d))
            }

            fn slopes(&self, _: &SVector<f64, $a>) -> Slopes<Sphere<$n>> {
                // In normal coordinates the metric is constant to first order.
                None
            }
        }
    };
}

sphere!(1 in 2);
sphere!(2 in 3);
sphere!(3 in 4);
sphere!(4 in 5);
sphere!(5 in 6);
sphere!(6 in 7);
sphere!(7 in 8);

/// The midpoint path in closed form. With `U = E(x) d`, `s = |d|²` and the Stumpff functions at
/// `s/4`: `z = c₀ x + ½c₁ U`, `γ'(½) = c₀ U − ½s c₁ x`, differentiated by `c₀' = −½c₁` and
/// `c₁' = −½(c₂ − c₃)`. The frames at `z` and `x'` turn ambient vectors into components; the chart at
/// `z` is normal, so the derivative of components is the projected ambient derivative.
#[inline]
fn great_circle_jet<M, const A: usize, const N: usize>(
    x: &SVector<f64, A>,
    d: &SVector<f64, N>,
) -> StepPathJet<M>
where
    M: Space<Dim = Const<N>>,
    M::Point<f64>: From<[f64; A]>,
{
    let (e, s) = (frame::<A, N>(x), d.norm_squared());
    let u = e * d;
    // E(y)ᵀ of E(x), x and U.
    let seen_from = |y: &SVector<f64, A>| {
        let at_y = frame::<A, N>(y);
        (at_y.tr_mul(&e), at_y.tr_mul(x), at_y.tr_mul(&u))
    };
    let [c0, c1, c2, c3] = stumpff(0.25 * s);
    let slope = -0.5 * (c2 - c3);
    let z = polished(&(x * c0 + u * (0.5 * c1)));
    let (turn, along_x, along_u) = seen_from(&z);
    let dz = turn * (0.5 * c1) + (along_u * slope - along_x * c1) * (d * 0.25).transpose();
    let lean = along_x * (c1 + 0.25 * s * slope) + along_u * (0.25 * c1);
    let (velocity, dv) =
        (along_u * c0 - along_x * (0.5 * s * c1), turn * c0 - lean * d.transpose());

    let [c0, c1, c2, c3] = stumpff(s);
    let end = polished(&(x * c0 + u * c1));
    let (turn, along_x, along_u) = seen_from(&end);
    let dend = turn * c1 - (along_x * c1 + along_u * (c2 - c3)) * d.transpose();
    StepPathJet {
        z: entries_of(&z).into(),
        dz,
        d: velocity,
        dd: dv,
        end: entries_of(&end).into(),
        dend,
    }
}

/// The entries of a column as an array.
fn entries_of<const A: usize>(x: &SVector<f64, A>) -> [f64; A] {
    (*x).into()
}

/// A normally distributed number (Box and Muller 1958).
fn gaussian(rng: &mut impl Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random_range(f64::MIN_POSITIVE..1.0), rng.random_range(0.0..1.0));
    (-2.0 * u.ln()).sqrt() * (2.0 * PI * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws;
    use crate::{Exponential, PointError, WeylMidpoint};
    use nalgebra::vector;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    macro_rules! keeps_the_laws {
        ($name:ident, $n:literal) => {
            proptest! {
                #[test]
                fn $name(seed in any::<u64>(), u in prop::array::uniform::<_, $n>(-1.0..1.0)) {
                    let sphere = Sphere::<$n>::round();
                    let x = sphere.random(&mut ChaCha8Rng::seed_from_u64(seed));
                    // Up to 2.9 radians.
                    let u = SVector::<f64, $n>::from(u) * (2.9 / f64::from($n as u8).sqrt());
                    laws::manifold(&sphere, &x, &u)?;
                    laws::metric::<Sphere<$n>, _>(&Canonical, &x, &u)?;
                    laws::retraction::<Sphere<$n>, _, _>(&WeylMidpoint, &Canonical, &x, &u)?;
                    laws::retraction::<Sphere<$n>, _, _>(&Exponential, &Canonical, &x, &u)?;
                    let y = Sphere::<$n>::chart(&x, &u);
                    laws::symmetric_retraction::<Sphere<$n>, _, _>(
                        &WeylMidpoint, &Canonical, &x, &y,
                    )?;
                }
            }
        };
    }
    keeps_the_laws!(the_circle_keeps_the_laws, 1);
    keeps_the_laws!(the_sphere_keeps_the_laws, 2);
    keeps_the_laws!(the_three_sphere_keeps_the_laws, 3);
    keeps_the_laws!(the_four_sphere_keeps_the_laws, 4);
    keeps_the_laws!(the_five_sphere_keeps_the_laws, 5);
    keeps_the_laws!(the_six_sphere_keeps_the_laws, 6);
    keeps_the_laws!(the_seven_sphere_keeps_the_laws, 7);

    #[test]
    fn the_frame_is_oriented_at_both_poles_and_between() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..100 {
            let x = Sphere::<2>.random(&mut rng);
            let e = frame::<3, 2>(&x);
            let determinant = nalgebra::Matrix3::from_columns(&[
                x,
                e.column(0).into_owned(),
                e.column(1).into_owned(),
            ])
            .determinant();
            assert!((determinant - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn what_has_no_nearest_point_is_found_by_its_defect() {
        for off in
            [vector![0.0, 0.0, 0.0], vector![f64::NAN, 1.0, 0.0], vector![f64::INFINITY, 1.0, 0.0]]
        {
            let projected = Sphere::<2>.project(&off);
            assert!(!Sphere::<2>.defect(&projected).is_finite(), "{projected}");
            assert!(matches!(Sphere::<2>.check(&projected), Err(PointError::NotFinite { .. })));
        }
        for scale in [1e-320, 1e-200, 1.0, 1e200] {
            let projected = Sphere::<2>.project(&(vector![3.0, 0.0, 4.0] * scale));
            assert!((projected - vector![0.6, 0.0, 0.8]).norm() < 1e-3, "{scale}: {projected}");
            assert!(Sphere::<2>.defect(&projected) < 1e-15);
        }
    }

    macro_rules! chart_at_its_centre {
        ($name:ident, $n:literal in $a:literal) => {
            /// `φ_x(q) = x + E q − ½|q|²x + O(q³)`, with the columns of `E` orthonormal and across `x`.
            #[test]
            fn $name() {
                const BOUND: f64 = 8.0 * f64::EPSILON;
                let mut rng = ChaCha8Rng::seed_from_u64(3);
                for x in (0..20).map(|_| Sphere::<$n>.random(&mut rng)) {
                    let mut columns = vec![x];
                    for (i, j) in (0..$n).flat_map(|i| (0..$n).map(move |j| (i, j))) {
                        let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
                        let seed = |k, _| Real::new(0.0, part(k, i), part(k, j), 0.0);
                        let y = Sphere::<$n>::chart(&x, &SVector::<Real, $n>::from_fn(seed));
                        assert!((y.map(|entry| entry.re) - x).norm() < BOUND);
                        let bend = x * if i == j { -1.0 } else { 0.0 };
                        assert!((y.map(|entry| entry.eps1eps2) - bend).norm() < BOUND);
                        let [along_i, along_j] =
                            [y.map(|entry| entry.eps1), y.map(|entry| entry.eps2)];
                        let right = part(i, j);
                        assert!((along_i.dot(&along_j) - right).abs() < BOUND, "{i} and {j}");
                        if j == 0 {
                            columns.push(along_i);
                        }
                        let back = Sphere::<$n>::coordinates(&x, &y);
                        assert!((back[i].eps1 - 1.0).abs() < BOUND);
                        assert!((back[j].eps2 - 1.0).abs() < BOUND);
                        assert!(back.iter().all(|entry| entry.eps1eps2.abs() < BOUND));
                    }
                    let turn = SMatrix::<f64, $a, $a>::from_columns(&columns);
                    assert!((turn.determinant() - 1.0).abs() < BOUND);
                    assert!(columns[1..].iter().all(|e| e.dot(&x).abs() < BOUND));
                }
            }
        };
    }
    chart_at_its_centre!(the_chart_of_the_circle_has_its_derivatives_at_the_centre, 1 in 2);
    chart_at_its_centre!(the_chart_of_the_sphere_has_its_derivatives_at_the_centre, 2 in 3);
    chart_at_its_centre!(the_chart_of_the_three_sphere_has_its_derivatives_at_the_centre, 3 in 4);
    chart_at_its_centre!(the_chart_of_the_four_sphere_has_its_derivatives_at_the_centre, 4 in 5);
    chart_at_its_centre!(the_chart_of_the_five_sphere_has_its_derivatives_at_the_centre, 5 in 6);
    chart_at_its_centre!(the_chart_of_the_six_sphere_has_its_derivatives_at_the_centre, 6 in 7);
    chart_at_its_centre!(the_chart_of_the_seven_sphere_has_its_derivatives_at_the_centre, 7 in 8);

    #[test]
    fn antipodes_and_longer_arcs_are_refused_with_their_length() {
        let x = vector![1.0, 0.0, 0.0];
        let error = Riemannian::<Sphere<2>>::log(&Canonical, &x, &-x).unwrap_err();
        assert!(
            matches!(error, MetricError::CutLocus { length, .. } if (length - PI).abs() < 1e-15)
        );
        let long = vector![0.0, 3.5];
        let error = Riemannian::<Sphere<2>>::weyl_jet(&Canonical, &x, &long).unwrap_err();
        assert!(
            matches!(error, MetricError::CutLocus { length, .. } if (length - 3.5).abs() < 1e-15)
        );
    }
}
