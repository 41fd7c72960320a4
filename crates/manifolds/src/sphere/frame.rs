//! The frames of a sphere, and its great circles.

use metriplectic_fields::series::stumpff;
use metriplectic_fields::{Column, Scalar, Space, dot};
use nalgebra::{Const, SMatrix, SVector};
use num_dual::Dual64;

use crate::StepPathJet;

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
pub(super) fn pushforward<D: Scalar, const A: usize, const N: usize>(
    x: &SVector<f64, A>,
    q: &SVector<D, N>,
) -> SMatrix<D, A, N> {
    let (e, [_, c1, c2, c3]) = (frame::<A, N>(x), stumpff(dot(q, q)));
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
pub(super) fn great_circle<D: Scalar, const A: usize>(
    x: &SVector<D, A>,
    v: &SVector<D, A>,
    t: f64,
) -> [SVector<D, A>; 2] {
    let s = dot(v, v);
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
pub(super) fn polished<D: Scalar, const A: usize>(x: &SVector<D, A>) -> SVector<D, A> {
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

/// The midpoint path in closed form. With `U = E(x) d`, `s = |d|²` and the Stumpff functions at
/// `s/4`: `z = c₀ x + ½c₁ U`, `γ'(½) = c₀ U − ½s c₁ x`, differentiated by `c₀' = −½c₁` and
/// `c₁' = −½(c₂ − c₃)`. The frames at `z` and `x'` turn ambient vectors into components; the chart at
/// `z` is normal, so the derivative of components is the projected ambient derivative.
#[inline]
pub(super) fn great_circle_jet<M, const A: usize, const N: usize>(
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
