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

mod frame;
mod round;

use std::f64::consts::PI;

use metriplectic_fields::series::{angle_over_sine, stumpff};
use metriplectic_fields::{ChartPoint, Column, MatrixJet, Real, Scalar, Space, dot, product_rule};
use nalgebra::{Const, SMatrix, SVector};
use rand::{Rng, RngExt};

use crate::{Manifold, StepPath, StepPathJet};

pub(crate) use frame::{along, angle, components, frame, normalised, spread};
use frame::{great_circle, great_circle_jet, polished, pushforward};

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
                let [cosine, sine, ..] = stumpff(dot(q, q));
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
                let cosine = dot(y, &Column::embed(x));
                // Eᵀx = 0, and the shorter one of y − x and y + x has the digits of y across x.
                let side = 1_f64.copysign(cosine.re());
                let short = SVector::<D, $a>::from_fn(|i, _| y[i] - side * x[i]);
                let tangent = components(&frame::<$a, $n>(x), &short);
                tangent * angle_over_sine(dot(&tangent, &tangent), cosine)
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
                let s = 0.25 * dot(q, q);
                polished(&((x * (1.0 - s) + frame::<$a, $n>(x) * q) / (1.0 + s)))
            }

            /// `q = 2Eᵀy/(1 + x·y)`.
            #[inline]
            fn stage_coordinates(x: &SVector<f64, $a>, y: &SVector<f64, $a>) -> SVector<f64, $n> {
                // Eᵀx = 0, and y − x has the digits of y across x.
                frame::<$a, $n>(x).tr_mul(&(y - x)) * (2.0 / (1.0 + dot(x, y)))
            }

            /// `(2Eᵀa − q (x·a))/(1 + x·y)` with `a = E(y) v`.
            #[inline]
            fn stage_rates(
                x: &SVector<f64, $a>,
                (q, y): (&SVector<f64, $n>, &SVector<f64, $a>),
                v: &SVector<f64, $n>,
            ) -> SVector<f64, $n> {
                let a = frame::<$a, $n>(y) * v;
                (frame::<$a, $n>(x).tr_mul(&a) * 2.0 - q * dot(x, &a)) / (1.0 + dot(x, y))
            }

            #[inline]
            fn is_stage(q: &SVector<f64, $n>) -> bool {
                dot(q, q) <= 16.0
            }

            #[inline]
            fn is_near(q: &SVector<f64, $n>) -> bool {
                q.norm() < 0.5 * PI
            }
        }

        impl Manifold for Sphere<$n> {
            const ENTRIES: usize = $a;

            fn defect(&self, x: &SVector<f64, $a>) -> f64 {
                (x.norm() - 1.0).abs()
            }

            fn entries(x: &SVector<f64, $a>) -> Vec<f64> {
                x.iter().copied().collect()
            }

            #[inline]
            fn write(x: &SVector<f64, $a>, put: &mut impl FnMut(f64)) {
                x.iter().copied().for_each(put);
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
                let (v, s) = (frame::<$a, $n>(x) * u, dot(u, u));
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
    };
}

sphere!(1 in 2);
sphere!(2 in 3);
sphere!(3 in 4);
sphere!(4 in 5);
sphere!(5 in 6);
sphere!(6 in 7);
sphere!(7 in 8);

/// A normally distributed number (Box and Muller 1958).
fn gaussian(rng: &mut impl Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random_range(f64::MIN_POSITIVE..1.0), rng.random_range(0.0..1.0));
    (-2.0 * u.ln()).sqrt() * (2.0 * PI * v).cos()
}

#[cfg(test)]
mod tests;
