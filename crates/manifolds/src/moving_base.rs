//! Charts of stages around a base point that moves: what the derivative of an explicit step along its start needs.
//!
//! A base `x_ε = φ_x(εδ)` has the frame of the chart of `x` there, to first order in `ε`. On a sphere it is
//! `E − ε x δᵀ`, on SO(3) the rotations about the axes of the body.

use metriplectic_fields::series::stumpff;
use metriplectic_fields::{Column as _, Dimension, Real, Space, Vector, Velocity, dot};
use nalgebra::{Matrix3, SMatrix, SVector, Vector1, Vector3};
use num_dual::{Dual64, DualNum as _};

use crate::product::{Product, Times};
use crate::rotation_vector::{exp, hat, rodrigues};
use crate::sphere::frame;
use crate::{Chart, Euclidean, HalfLine, LieDual, Rotations, Sphere};

/// A space whose stages and charts are known around a base that moves, at dual numbers.
///
/// The base is `x_ε = φ_x(εδ)`. Laws: 1. at `δ = 0` they are those of [`Space`]; 2.
/// [`stage_rates_from`](Self::stage_rates_from) is the derivative of the inverse of [`stage_from`](Self::stage_from); 3.
/// [`chart_from`](Self::chart_from) is `x_ε` at `q = 0`.
pub trait MovingBase: Space {
    /// The point `ψ_{x_ε}(q)` of the chart of stages.
    fn stage_from(
        x: &Self::Point<f64>,
        delta: &Vector<Self>,
        q: &Vector<Self, Dual64>,
    ) -> Self::Point<Dual64>;

    /// The rates `q'` in the chart of stages at `x_ε` of the velocity `a` at `y = ψ_{x_ε}(q)`.
    fn stage_rates_from(
        base: (&Self::Point<f64>, &Vector<Self>),
        at: (&Vector<Self, Dual64>, &Self::Point<Dual64>),
        a: &Velocity<Self, Dual64>,
    ) -> Vector<Self, Dual64>;

    /// The end of the geodesic of the canonical metric from `x_ε` with the velocity `a`.
    fn moved_from(
        x: &Self::Point<f64>,
        delta: &Vector<Self>,
        a: &Velocity<Self, Dual64>,
    ) -> Self::Point<Dual64>;

    /// The point `φ_{x_ε}(q)` of the chart, with `ε = ε₁`.
    fn chart_from(
        x: &Self::Point<f64>,
        delta: &Vector<Self>,
        q: &Vector<Self, Real>,
    ) -> Self::Point<Real>;
}

/// A dual number as one along `ε₁`.
fn first(a: Dual64) -> Real {
    Real::new(a.re, a.eps, 0.0, 0.0)
}

macro_rules! translated {
    ($space:ident) => {
        impl<const N: usize> MovingBase for $space<N> {
            #[inline]
            fn stage_from(
                x: &SVector<f64, N>,
                delta: &SVector<f64, N>,
                q: &SVector<Dual64, N>,
            ) -> SVector<Dual64, N> {
                SVector::from_fn(|i, _| q[i] + Dual64::new(x[i], delta[i]))
            }

            #[inline]
            fn stage_rates_from(
                _: (&SVector<f64, N>, &SVector<f64, N>),
                _: (&SVector<Dual64, N>, &SVector<Dual64, N>),
                a: &SVector<Dual64, N>,
            ) -> SVector<Dual64, N> {
                *a
            }

            #[inline]
            fn moved_from(
                x: &SVector<f64, N>,
                delta: &SVector<f64, N>,
                a: &SVector<Dual64, N>,
            ) -> SVector<Dual64, N> {
                Self::stage_from(x, delta, a)
            }

            #[inline]
            fn chart_from(
                x: &SVector<f64, N>,
                delta: &SVector<f64, N>,
                q: &SVector<Real, N>,
            ) -> SVector<Real, N> {
                SVector::from_fn(|i, _| q[i] + first(Dual64::new(x[i], delta[i])))
            }
        }
    };
}
translated!(Euclidean);
translated!(LieDual);
translated!(Chart);

/// The chart is the logarithm of a ratio.
impl MovingBase for HalfLine {
    fn stage_from(x: &Vector1<f64>, delta: &Vector1<f64>, q: &Vector1<Dual64>) -> Vector1<Dual64> {
        Vector1::new((q.x + Dual64::new(0.0, delta.x)).exp() * x.x)
    }

    fn stage_rates_from(
        _: (&Vector1<f64>, &Vector1<f64>),
        (_, y): (&Vector1<Dual64>, &Vector1<Dual64>),
        a: &Vector1<Dual64>,
    ) -> Vector1<Dual64> {
        Vector1::new(a.x / y.x)
    }

    fn moved_from(x: &Vector1<f64>, delta: &Vector1<f64>, a: &Vector1<Dual64>) -> Vector1<Dual64> {
        let y = Dual64::new(x.x, x.x * delta.x);
        Vector1::new((a.x / y).exp() * y)
    }

    fn chart_from(x: &Vector1<f64>, delta: &Vector1<f64>, q: &Vector1<Real>) -> Vector1<Real> {
        Vector1::new((q.x + first(Dual64::new(0.0, delta.x))).exp() * x.x)
    }
}

/// The base of a sphere that moves along `δ`, and its frame `E − ε x δᵀ`.
fn moving<const A: usize, const N: usize>(
    x: &SVector<f64, A>,
    delta: &SVector<f64, N>,
) -> (SVector<Dual64, A>, SMatrix<Dual64, A, N>) {
    let e = frame::<A, N>(x);
    let along = e * delta;
    let base = SVector::from_fn(|i, _| Dual64::new(x[i], along[i]));
    (base, SMatrix::from_fn(|i, j| Dual64::new(e[(i, j)], -x[i] * delta[j])))
}

macro_rules! spheres {
    ($($n:literal in $a:literal),+) => {$(
        impl MovingBase for Sphere<$n> {
            /// Stereographic, `((1 − s) x + E q)/(1 + s)` with `s = |q|²/4`.
            fn stage_from(
                x: &SVector<f64, $a>,
                delta: &SVector<f64, $n>,
                q: &SVector<Dual64, $n>,
            ) -> SVector<Dual64, $a> {
                let (x, e) = moving::<$a, $n>(x, delta);
                let s = dot(q, q) * 0.25;
                (x * (-s + 1.0) + e * q) * (s + 1.0).recip()
            }

            /// `(2Eᵀa − q (x·a))/(1 + x·y)`.
            fn stage_rates_from(
                (x, delta): (&SVector<f64, $a>, &SVector<f64, $n>),
                (q, y): (&SVector<Dual64, $n>, &SVector<Dual64, $a>),
                a: &SVector<Dual64, $a>,
            ) -> SVector<Dual64, $n> {
                let (x, e) = moving::<$a, $n>(x, delta);
                let two = Dual64::from(2.0);
                (e.tr_mul(a) * two - q * dot(&x, a)) * (dot(&x, y) + 1.0).recip()
            }

            fn moved_from(
                x: &SVector<f64, $a>,
                delta: &SVector<f64, $n>,
                a: &SVector<Dual64, $a>,
            ) -> SVector<Dual64, $a> {
                let (x, _) = moving::<$a, $n>(x, delta);
                let [cosine, sine, ..] = stumpff(dot(a, a));
                x * cosine + a * sine
            }

            fn chart_from(
                x: &SVector<f64, $a>,
                delta: &SVector<f64, $n>,
                q: &SVector<Real, $n>,
            ) -> SVector<Real, $a> {
                let (x, e) = moving::<$a, $n>(x, delta);
                let [cosine, sine, ..] = stumpff(dot(q, q));
                x.map(first) * cosine + e.map(first) * q * sine
            }
        }
    )+};
}
spheres!(1 in 2, 2 in 3, 3 in 4, 4 in 5, 5 in 6, 6 in 7, 7 in 8);

/// The base `R (1 + ε δ̂)`.
fn turned(x: &Matrix3<f64>, delta: &Vector3<f64>) -> Matrix3<Dual64> {
    let along = x * hat(delta);
    Matrix3::from_fn(|i, j| Dual64::new(x[(i, j)], along[(i, j)]))
}

impl MovingBase for Rotations {
    /// Cayley's map.
    fn stage_from(x: &Matrix3<f64>, delta: &Vector3<f64>, q: &Vector3<Dual64>) -> Matrix3<Dual64> {
        let scale = (dot(q, q) * 0.25 + 1.0).recip();
        turned(x, delta) * rodrigues(q, scale, scale * 0.5)
    }

    /// `v + ½ q×v + ¼ q (q·v)` with the body angular velocity `v`.
    fn stage_rates_from(
        _: (&Matrix3<f64>, &Vector3<f64>),
        (q, _): (&Vector3<Dual64>, &Matrix3<Dual64>),
        a: &Vector3<Dual64>,
    ) -> Vector3<Dual64> {
        let half = Dual64::from(0.5);
        a + q.cross(a) * half + q * (dot(q, a) * 0.25)
    }

    fn moved_from(x: &Matrix3<f64>, delta: &Vector3<f64>, a: &Vector3<Dual64>) -> Matrix3<Dual64> {
        turned(x, delta) * exp(a)
    }

    fn chart_from(x: &Matrix3<f64>, delta: &Vector3<f64>, q: &Vector3<Real>) -> Matrix3<Real> {
        turned(x, delta).map(first) * exp(q)
    }
}

/// The velocities of the factors.
fn velocities<A: Times<B>, B: Space>(
    a: &Velocity<Product<A, B>, Dual64>,
) -> (Velocity<A, Dual64>, Velocity<B, Dual64>) {
    let n = <A::Velocity as Dimension>::LEN;
    let left = Velocity::<A, Dual64>::from_index(|i| a[i]);
    (left, Velocity::<B, Dual64>::from_index(|i| a[i + n]))
}

impl<A: MovingBase + Times<B>, B: MovingBase> MovingBase for Product<A, B> {
    fn stage_from(
        (a, b): &Self::Point<f64>,
        delta: &Vector<Self>,
        q: &Vector<Self, Dual64>,
    ) -> Self::Point<Dual64> {
        let ((da, db), (qa, qb)) = (Self::split(delta), Self::split(q));
        (A::stage_from(a, &da, &qa), B::stage_from(b, &db, &qb))
    }

    fn stage_rates_from(
        ((a, b), delta): (&Self::Point<f64>, &Vector<Self>),
        (q, (ya, yb)): (&Vector<Self, Dual64>, &Self::Point<Dual64>),
        velocity: &Velocity<Self, Dual64>,
    ) -> Vector<Self, Dual64> {
        let ((da, db), (qa, qb)) = (Self::split(delta), Self::split(q));
        let (va, vb) = velocities::<A, B>(velocity);
        let first = A::stage_rates_from((a, &da), (&qa, ya), &va);
        Self::join(&first, &B::stage_rates_from((b, &db), (&qb, yb), &vb))
    }

    fn moved_from(
        (a, b): &Self::Point<f64>,
        delta: &Vector<Self>,
        velocity: &Velocity<Self, Dual64>,
    ) -> Self::Point<Dual64> {
        let ((da, db), (va, vb)) = (Self::split(delta), velocities::<A, B>(velocity));
        (A::moved_from(a, &da, &va), B::moved_from(b, &db, &vb))
    }

    fn chart_from(
        (a, b): &Self::Point<f64>,
        delta: &Vector<Self>,
        q: &Vector<Self, Real>,
    ) -> Self::Point<Real> {
        let ((da, db), (qa, qb)) = (Self::split(delta), Self::split(q));
        (A::chart_from(a, &da, &qa), B::chart_from(b, &db, &qb))
    }
}
