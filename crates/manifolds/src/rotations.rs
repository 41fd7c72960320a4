//! The rotation group SO(3).
//!
//! - **Point and velocity**: a matrix `R` with `RᵀR = 1`, `det R = 1`; the body angular velocity `Ω`,
//!   `R' = R Ω̂` with `Ω̂ v = Ω × v`.
//! - **Frame**: `R ê_k`, the rotations about the axes of the body.
//! - **Chart**: the exponential of the group (Rodrigues 1840) and its logarithm,
//!
//! ```math
//! \varphi_R(q) = R \exp(\hat q), \qquad
//! \exp(\hat q) = 1 + \frac{\sin\theta}{\theta} \hat q + \frac{1 - \cos\theta}{\theta^2} \hat q^2,
//! \quad \theta = |q| .
//! ```
//!
//! The chart ends with one step `R ← R(3 − RᵀR)/2` of the polar iteration (Higham 2008, ch. 8), so that
//! every matrix of a run is orthogonal to round-off and
//! [never drifts](mod@crate::manifold#why-points-do-not-drift). The logarithm uses the quaternion of largest
//! pivot (Shepperd 1978). From `θ = 10⁻¹⁵` to `π − 10⁻¹⁰` the logarithm of a rounded rotation was measured
//! within `3ε` of the exact logarithm, relative to `θ`. The functions [`exp`], [`log`], [`dexp`] and [`dexp_inverse`] are right at `q = 0` for
//! dual numbers of every order.
//!
//! - **Stages** of explicit methods: Cayley's map, `ψ_R(q) = R (1 + (q̂ + ½q̂²)/(1 + |q|²/4))`, up to `|q| = 4`.
//! - **Geodesics** of the bi-invariant metric `⟨â, b̂⟩ = a·b` are `R exp(tΩ̂)`, `log_R(Y) = log(RᵀY)`, up to
//!   the injectivity radius π. Longer geodesics are refused. The curvature is ¼ (do Carmo 1992, ch. 4,
//!   exercise 1).
//! - **Other metrics** are inner products on so(3), by [`Metric::field`](crate::Metric::field), whose
//!   logarithms are also refused at half a turn, where two straight lines of the chart are equally long. A
//!   constant inner product `J` is left-invariant. Its geodesics are the motions of the free rigid body,
//!   `JΩ' = JΩ × Ω` (Euler; Arnold 1966). [`Cayley`](crate::Cayley) is a retraction for all of them.
//! - **Brackets**: none by default. `Nambu`, with the entropy as its Casimir,
//!
//! ```math
//! R' = R\, \hat\Omega, \qquad \Omega = \lambda \frac{dS \times dH}{\sqrt{\det g}},
//! ```
//!
//! the differentials along the frame. Attitudes with momenta, `T*SO(3) = SO(3) × R³`, have `Symplectic`;
//! see [`product`](mod@crate::product).

mod bi_invariant;

use std::f64::consts::PI;

use metriplectic_fields::series::stumpff;
use metriplectic_fields::{ChartPoint, MatrixJet, Real, Scalar, Space, Square, dot, product_rule};
use nalgebra::{Const, Matrix3, Vector3, Vector4};
use rand::{Rng, RngExt};

use crate::rotation_vector::{moved, orthogonal, product, quaternion, rodrigues, spun, turn};
use crate::sphere::along;
use crate::{Manifold, PointError, StepPath, StepPathJet};

pub use crate::rotation_vector::{dexp, dexp_inverse, exp, hat, log, vee};

/// The rotation group `SO(3)`: 3 × 3 rotation matrices, with tangent vectors in the body frame and the
/// bi-invariant metric as the canonical one; see the [module](mod@crate::rotations).
///
/// ```
/// use metriplectic_manifolds::{Canonical, Riemannian, Rotations, rotations};
/// use nalgebra::{Matrix3, vector};
/// let omega = vector![0.3, -2.0, 1.5];
/// let end = rotations::exp(&omega);
/// let back = Riemannian::<Rotations>::log(&Canonical, &Matrix3::identity(), &end).unwrap();
/// assert!((back - omega).norm() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rotations;

impl Rotations {
    /// The group with its bi-invariant metric.
    pub const fn bi_invariant() -> Self {
        Self
    }
}

impl Space for Rotations {
    type Dim = Const<3>;
    type Velocity = Const<3>;
    type Point<D: Scalar> = Matrix3<D>;

    #[inline]
    fn constant<D: Scalar>(x: &Matrix3<f64>) -> Matrix3<D> {
        x.map(D::from)
    }

    #[inline]
    fn real<D: Scalar>(x: &Matrix3<D>) -> Matrix3<f64> {
        x.map(|entry| entry.re())
    }

    #[inline]
    fn chart<D: Scalar>(x: &Matrix3<f64>, q: &Vector3<D>) -> Matrix3<D> {
        orthogonal(&moved(x, &exp(q)))
    }

    /// `R (1 + ε₁ ê_i + ε₂ ê_j + ½ε₁ε₂ (ê_i ê_j + ê_j ê_i))`, whose last term has the entries
    /// `½(R_ri δ_jc + R_rj δ_ic) − R_rc δ_ij`.
    #[inline]
    fn seeds(x: &Matrix3<f64>) -> impl Fn(usize, usize) -> Matrix3<Real> {
        let x = *x;
        let turned = [spun(&x, &Vector3::x()), spun(&x, &Vector3::y()), spun(&x, &Vector3::z())];
        move |i, j| {
            let turn = |k: usize, r, c| if k < 3 { turned[k][(r, c)] } else { 0.0 };
            let half = |k: usize, r| if k < 3 { 0.5 * x[(r, k)] } else { 0.0 };
            Matrix3::from_fn(|r, c| {
                let mut bend = if i == j && i < 3 { -x[(r, c)] } else { 0.0 };
                if c == i {
                    bend += half(j, r);
                }
                if c == j {
                    bend += half(i, r);
                }
                Real::new(x[(r, c)], turn(i, r, c), turn(j, r, c), bend)
            })
        }
    }

    #[inline]
    fn coordinates<D: Scalar>(x: &Matrix3<f64>, y: &Matrix3<D>) -> Vector3<D> {
        log(&(Self::constant::<D>(x).tr_mul(y)))
    }

    /// The body angular velocity `Ω = dexp(q) v` of `R' = R Ω̂`.
    #[inline]
    fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector3<D>) -> Vector3<D> {
        dexp(&at.q) * v
    }

    /// With `θ = dexp(q)`.
    fn covariant<D: Scalar>(at: &ChartPoint<Self, D>, a: &Matrix3<D>) -> Matrix3<D> {
        let theta = dexp(&at.q);
        product(&theta.transpose(), &product(a, &theta))
    }

    #[inline]
    fn covariant_jet(
        _: &Matrix3<f64>,
        q: &Vector3<f64>,
        a: impl Fn(usize, usize) -> Matrix3<Real>,
    ) -> MatrixJet<Self> {
        product_rule(|k| dexp(&along(q, k)), a)
    }

    /// Cayley's map, `R (1 + (q̂ + ½q̂²)/(1 + |q|²/4))`.
    #[inline]
    fn stage(x: &Matrix3<f64>, q: &Vector3<f64>) -> Matrix3<f64> {
        let scale = (1.0 + 0.25 * q.norm_squared()).recip();
        orthogonal(&moved(x, &rodrigues(q, scale, 0.5 * scale)))
    }

    /// Twice the ratio of the vector of the quaternion to its scalar.
    #[inline]
    fn stage_coordinates(x: &Matrix3<f64>, y: &Matrix3<f64>) -> Vector3<f64> {
        let [w, i, j, k] = quaternion(&x.tr_mul(y));
        Vector3::new(i, j, k) * (2.0 / w)
    }

    /// `v + ½ q×v + ¼ q (q·v)`.
    #[inline]
    fn stage_rates(
        _: &Matrix3<f64>,
        (q, _): (&Vector3<f64>, &Matrix3<f64>),
        v: &Vector3<f64>,
    ) -> Vector3<f64> {
        v + q.cross(v) * 0.5 + q * (0.25 * dot(q, v))
    }

    #[inline]
    fn is_stage(q: &Vector3<f64>) -> bool {
        q.norm_squared() <= 16.0
    }

    #[inline]
    fn is_near(q: &Vector3<f64>) -> bool {
        q.norm() < 0.5 * PI
    }
}

impl Manifold for Rotations {
    const ENTRIES: usize = 9;

    /// `max |RᵀR − 1|`, and at least 2 for a reflection.
    fn defect(&self, x: &Matrix3<f64>) -> f64 {
        let gram = (x.tr_mul(x) - Matrix3::identity()).max_abs();
        if x.determinant() > 0.0 || gram.is_nan() { gram } else { gram.max(2.0) }
    }

    /// Row by row.
    fn entries(x: &Matrix3<f64>) -> Vec<f64> {
        x.transpose().iter().copied().collect()
    }

    #[inline]
    fn write(x: &Matrix3<f64>, put: &mut impl FnMut(f64)) {
        x.transpose().iter().copied().for_each(put);
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Matrix3<f64> {
        Matrix3::from_fn(|_, _| next()).transpose()
    }

    #[inline]
    fn magnitude(_: &Matrix3<f64>) -> f64 {
        1.0
    }

    /// The one-parameter subgroup of the body velocity `u`.
    #[inline]
    fn line(x: &Matrix3<f64>, u: &Vector3<f64>) -> StepPath<Self> {
        let z = ChartPoint::centre(&moved(x, &exp(&(u * 0.5))));
        StepPath { z, d: *u, end: Self::chart(x, u) }
    }

    /// With the constant body velocity `u`: `z = R exp(û/2)`, `x' = R exp(û)`, differentiated by
    /// [`dexp`]. The chart at `z` reads the body velocity `Ω` at `q` as `dexp⁻¹(q) Ω = Ω + ½q × Ω + …`,
    /// so `∂d/∂u = 1 − ½û ∂z/∂u = ½(1 + exp(−û/2))`.
    #[inline]
    fn line_jet(x: &Matrix3<f64>, u: &Vector3<f64>) -> StepPathJet<Self> {
        let half = u * 0.5;
        let [_, c1, c2, c3] = stumpff(half.norm_squared());
        StepPathJet {
            z: moved(x, &rodrigues(&half, c1, c2)),
            dz: rodrigues(&half, -c2, c3) * 0.5,
            d: *u,
            dd: rodrigues(&half, -0.5 * c1, 0.5 * c2),
            end: Self::chart(x, u),
            dend: dexp(u),
        }
    }

    /// The end of a finite displacement is a point.
    #[inline]
    fn line_end(x: &Matrix3<f64>, u: &Vector3<f64>) -> Option<Matrix3<f64>> {
        Some(Self::chart(x, u))
    }

    /// `R(t)` with `R' = R Ω̂` and `R'' = R Ω̂²`.
    #[inline]
    fn line_at(x: &Matrix3<f64>, omega: &Vector3<f64>, t: f64) -> Matrix3<Real> {
        let r = if t > 0.0 { moved(x, &exp(&(omega * t))) } else { *x };
        let velocity = spun(&r, omega);
        let bend = spun(&velocity, omega);
        Matrix3::from_fn(|i, j| {
            let v = velocity[(i, j)];
            Real::new(r[(i, j)], v, v, bend[(i, j)])
        })
    }

    /// Returns the polar factor `R`, with `RᵀA` symmetric: the nearest rotation in the Frobenius norm, or one of
    /// several (Higham 1989). It returns a matrix that is not finite without change.
    fn project(&self, x: &Matrix3<f64>) -> Matrix3<f64> {
        let largest = x.max_abs();
        if !largest.is_finite() {
            return *x;
        }
        // So that no square overflows or vanishes.
        let svd = (x / largest.max(f64::MIN_POSITIVE)).svd(true, true);
        match (svd.u, svd.v_t) {
            (Some(mut u), Some(v_t)) => {
                if (u * v_t).determinant() < 0.0 {
                    u.column_mut(2).neg_mut();
                }
                orthogonal(&(u * v_t))
            }
            _ => *x,
        }
    }

    /// Uniform (Haar measure), from a uniform unit quaternion.
    fn random(&self, rng: &mut impl Rng) -> Matrix3<f64> {
        loop {
            let q = Vector4::<f64>::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let square = q.norm_squared();
            if square > 1e-6 && square <= 1.0 {
                return turn(q.into());
            }
        }
    }
}

impl Rotations {
    /// The rotation of a quaternion `[w, x, y, z]`, which need not have norm 1.
    ///
    /// ```
    /// use metriplectic_manifolds::{PointError, Rotations};
    /// let quarter = Rotations.from_quaternion([1.0, 0.0, 0.0, 1.0])?;
    /// assert!((quarter.m21 - 1.0).abs() < 1e-15);
    /// assert_eq!(Rotations.from_quaternion([0.0; 4]), Err(PointError::NoDirection));
    /// # Ok::<(), PointError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`PointError::NotFinite`] with the first bad entry, and [`PointError::NoDirection`] if all are
    /// zero.
    pub fn from_quaternion(&self, q: [f64; 4]) -> Result<Matrix3<f64>, PointError> {
        if let Some(index) = q.iter().position(|entry| !entry.is_finite()) {
            return Err(PointError::NotFinite { index, value: q[index] });
        }
        let largest = Vector4::from(q).amax();
        if largest > 0.0 {
            // So that no square overflows or vanishes.
            Ok(turn(q.map(|entry| entry / largest)))
        } else {
            Err(PointError::NoDirection)
        }
    }

    /// The unit quaternion `[w, x, y, z]`, `w ≥ 0`, of a rotation.
    #[must_use]
    pub fn to_quaternion(&self, r: &Matrix3<f64>) -> [f64; 4] {
        quaternion(r)
    }
}

#[cfg(test)]
mod tests;
