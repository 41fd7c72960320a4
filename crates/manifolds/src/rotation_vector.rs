//! Rotation matrices by rotation vectors: exponential, logarithm, and their derivatives.

use metriplectic_fields::series::{angle_over_sine, stumpff};
use metriplectic_fields::{Scalar, dot};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The matrix of `v ↦ a × v`.
pub fn hat<D: Scalar>(a: &Vector3<D>) -> Matrix3<D> {
    let zero = D::zero();
    Matrix3::new(zero, -a.z, a.y, a.z, zero, -a.x, -a.y, a.x, zero)
}

/// The vector of the skew part of a matrix: `vee(hat(a)) = a`.
pub fn vee<D: Scalar>(m: &Matrix3<D>) -> Vector3<D> {
    Vector3::new(m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12) * D::from(0.5)
}

/// `1 + a q̂ + b q̂²`, the form of the functions below, with `q̂² = q qᵀ − |q|²`.
#[inline]
pub(crate) fn rodrigues<D: Scalar>(q: &Vector3<D>, a: D, b: D) -> Matrix3<D> {
    let (turn, bend) = (q * a, q * b);
    let [xx, yy, zz] = [bend.x * q.x, bend.y * q.y, bend.z * q.z];
    let [xy, xz, yz] = [bend.x * q.y, bend.x * q.z, bend.y * q.z];
    Matrix3::new(
        -(yy + zz) + 1.0,
        xy - turn.z,
        xz + turn.y,
        xy + turn.z,
        -(xx + zz) + 1.0,
        yz - turn.x,
        xz - turn.y,
        yz + turn.x,
        -(xx + yy) + 1.0,
    )
}

/// The rotation by the vector `q`: `exp(q̂)` by Rodrigues' formula, right under dual numbers of
/// every order at `q = 0`.
#[inline]
pub fn exp<D: Scalar>(q: &Vector3<D>) -> Matrix3<D> {
    let [_, c1, c2, _] = stumpff(dot(q, q));
    rodrigues(q, c1, c2)
}

/// The rotation vector of a matrix, `|q| ≤ π`: the inverse of [`exp`], accurate to a few `ε` up to
/// half a turn.
///
/// Through the quaternion `(w, v) = (cos θ/2, sin θ/2 · axis)` of largest pivot, and
/// `q = 2 atan2(|v|, w) v/|v|`.
pub fn log<D: Scalar>(r: &Matrix3<D>) -> Vector3<D> {
    let [w, x, y, z] = quaternion(r);
    let v = Vector3::new(x, y, z);
    v * (angle_over_sine(dot(&v, &v), w) * 2.0)
}

/// The unit quaternion `(w, x, y, z)`, `w ≥ 0`, of a rotation matrix, from the largest of its four
/// squared components (Shepperd 1978).
pub(crate) fn quaternion<D: Scalar>(r: &Matrix3<D>) -> [D; 4] {
    let trace = r.m11 + r.m22 + r.m33;
    let squares = [trace, r.m11 * 2.0 - trace, r.m22 * 2.0 - trace, r.m33 * 2.0 - trace];
    let pivot =
        (1..4).fold(0, |best, k| if squares[k].re() > squares[best].re() { k } else { best });
    let largest = (squares[pivot] + 1.0).sqrt() * 0.5;
    let scale = (largest * 4.0).recip();
    let skew = [r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12].map(|entry| entry * scale);
    let [xy, xz, yz] = [r.m12 + r.m21, r.m13 + r.m31, r.m23 + r.m32].map(|entry| entry * scale);
    let q = match pivot {
        0 => [largest, skew[0], skew[1], skew[2]],
        1 => [skew[0], largest, xy, xz],
        2 => [skew[1], xy, largest, yz],
        _ => [skew[2], xz, yz, largest],
    };
    if q[0].re() < 0.0 { q.map(|entry| -entry) } else { q }
}

/// The rotation of a quaternion `(w, x, y, z)` whose norm does not underflow.
pub(crate) fn turn([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner()
}

/// The left-trivialised derivative of the exponential: `exp(q̂)ᵀ d exp(q̂) = hat(dexp(q) dq)`,
///
/// ```math
/// \mathrm{dexp}(q) = 1 - \frac{1 - \cos\theta}{\theta^2} \hat q
///                      + \frac{\theta - \sin\theta}{\theta^3} \hat q^2 .
/// ```
#[inline]
pub fn dexp<D: Scalar>(q: &Vector3<D>) -> Matrix3<D> {
    let [_, _, c2, c3] = stumpff(dot(q, q));
    rodrigues(q, -c2, c3)
}

/// The inverse of [`dexp`], `1 + ½q̂ + (1 − ½θ cot ½θ)/θ² q̂²`, for `|q| < 2π`.
pub fn dexp_inverse<D: Scalar>(q: &Vector3<D>) -> Matrix3<D> {
    // With t = θ²/4 the weight is (c₁ − c₀)/(4t c₁), and c₁ − c₀ = t (c₂ − c₃).
    let [_, c1, c2, c3] = stumpff(dot(q, q) * 0.25);
    rodrigues(q, D::from(0.5), (c2 - c3) / c1 * 0.25)
}

/// `A B`, faster than the general product of nalgebra for so few entries.
#[inline]
pub(crate) fn product<D: Scalar>(a: &Matrix3<D>, b: &Matrix3<D>) -> Matrix3<D> {
    Matrix3::from_fn(|i, j| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)])
}

/// `A B` with a real matrix `B`.
#[inline]
fn times<D: Scalar>(a: &Matrix3<D>, b: &Matrix3<f64>) -> Matrix3<D> {
    Matrix3::from_fn(|i, j| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)])
}

/// `A B` with a real matrix `A`.
#[inline]
pub(crate) fn moved<D: Scalar>(a: &Matrix3<f64>, b: &Matrix3<D>) -> Matrix3<D> {
    Matrix3::from_fn(|i, j| b[(0, j)] * a[(i, 0)] + b[(1, j)] * a[(i, 1)] + b[(2, j)] * a[(i, 2)])
}

/// `A ω̂`.
#[inline]
pub(crate) fn spun(a: &Matrix3<f64>, omega: &Vector3<f64>) -> Matrix3<f64> {
    let [x, y, z] = [a.column(0), a.column(1), a.column(2)];
    Matrix3::from_columns(&[
        y * omega.z - z * omega.y,
        z * omega.x - x * omega.z,
        x * omega.y - y * omega.x,
    ])
}

/// One step of Newton's iteration for the polar factor, `R ← R(3 − RᵀR)/2` with the real part of
/// `RᵀR`. It squares the defect and does not change derivatives along the group.
#[inline]
pub(crate) fn orthogonal<D: Scalar>(r: &Matrix3<D>) -> Matrix3<D> {
    let real = r.map(|entry| entry.re());
    let dot = |i, j| real.column(i).dot(&real.column(j));
    let [xx, yy, zz] = [dot(0, 0), dot(1, 1), dot(2, 2)].map(|square| 1.5 - 0.5 * square);
    let [xy, xz, yz] = [dot(0, 1), dot(0, 2), dot(1, 2)].map(|product| -0.5 * product);
    times(r, &Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
}
