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

use std::f64::consts::PI;

use metriplectic_fields::series::stumpff;
use metriplectic_fields::{
    ChartPoint, Column, MatrixJet, Real, Scalar, Space, Square, product_rule,
};
use nalgebra::{Const, Matrix3, SMatrix, Vector3, Vector4};
use num_dual::Dual;
use rand::{Rng, RngExt};

use crate::metric::{GeodesicEnd, MetricError};
use crate::metric_error::{finite, finite_column, within};
use crate::normal::Normal;
use crate::rotation_vector::{moved, orthogonal, product, quaternion, rodrigues, spun, turn};
use crate::sphere::along;
use crate::{Canonical, Manifold, PointError, Riemannian, Slopes, StepPath, StepPathJet};

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
        v + q.cross(v) * 0.5 + q * (0.25 * q.dot(v))
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
    /// `max |RᵀR − 1|`, and at least 2 for a reflection.
    fn defect(&self, x: &Matrix3<f64>) -> f64 {
        let gram = (x.tr_mul(x) - Matrix3::identity()).max_abs();
        if x.determinant() > 0.0 || gram.is_nan() { gram } else { gram.max(2.0) }
    }

    /// Row by row.
    fn entries(x: &Matrix3<f64>) -> Vec<f64> {
        x.transpose().iter().copied().collect()
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

/// The curvature of SO(3) with `⟨â, b̂⟩ = a·b`.
const CURVATURE: f64 = 0.25;

impl Riemannian<Rotations> for Canonical {
    type At<D: Scalar> = Normal<D, 3>;

    #[inline]
    fn at<D: Scalar>(&self, x: &ChartPoint<Rotations, D>) -> Result<Normal<D, 3>, MetricError> {
        Ok(Normal::at(&x.q, CURVATURE))
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<Rotations, D>) -> SMatrix<D, 3, 3> {
        Normal::at(&x.q, CURVATURE).matrix()
    }

    #[inline]
    fn volume_density<D: Scalar>(at: &Normal<D, 3>) -> Result<D, MetricError> {
        Ok(at.volume_density())
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<Rotations, D>,
        v: &Vector3<D>,
    ) -> Result<GeodesicEnd<Rotations, D>, MetricError> {
        let omega = dexp(&x.q) * v;
        within(PI, Column::magnitude(&omega))?;
        let end = orthogonal(&(x.point() * exp(&omega)));
        let base = Rotations::real(&end);
        // The body velocity is constant; the chart at the end reads it by one more dual number.
        let turned = end * hat(&omega);
        let moved = end.zip_map(&turned, Dual::new);
        let q = Rotations::coordinates(&base, &moved);
        let at = ChartPoint { base, q: finite_column("a coordinate of the end", q.map(|q| q.re))? };
        Ok((at, q.map(|q| q.eps)))
    }

    #[inline]
    fn end(&self, x: &Matrix3<f64>, v: &Vector3<f64>) -> Result<Matrix3<f64>, MetricError> {
        within(PI, v.norm())?;
        let end = Rotations::chart(x, v);
        finite("an entry of the end", end.sum())?;
        Ok(end)
    }

    #[inline]
    fn along(
        &self,
        x: &Matrix3<f64>,
        omega: &Vector3<f64>,
        t: f64,
    ) -> Result<Matrix3<Real>, MetricError> {
        within(PI, omega.norm())?;
        Ok(Rotations::line_at(x, omega, t))
    }

    fn log(&self, x: &Matrix3<f64>, y: &Matrix3<f64>) -> Result<Vector3<f64>, MetricError> {
        let q = Rotations::coordinates(x, y);
        within(PI, q.norm())?;
        finite_column("the logarithm", q)
    }

    #[inline]
    fn weyl_path(
        &self,
        x: &Matrix3<f64>,
        d: &Vector3<f64>,
    ) -> Result<StepPath<Rotations>, MetricError> {
        within(PI, d.norm())?;
        Ok(Rotations::line(x, d))
    }

    #[inline]
    fn weyl_jet(
        &self,
        x: &Matrix3<f64>,
        d: &Vector3<f64>,
    ) -> Result<StepPathJet<Rotations>, MetricError> {
        within(PI, d.norm())?;
        Ok(Rotations::line_jet(x, d))
    }

    fn slopes(&self, _: &Matrix3<f64>) -> Slopes<Rotations> {
        // In normal coordinates the metric is constant to first order.
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws;
    use crate::{Exponential, WeylMidpoint};
    use nalgebra::vector;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    proptest! {
        #[test]
        fn rotations_keep_the_laws(seed in any::<u64>(), u in prop::array::uniform3(-1.0..1.0)) {
            let x = Rotations.random(&mut ChaCha8Rng::seed_from_u64(seed));
            // Up to 3.1 radians.
            let u = Vector3::from(u) * (3.1 / 3.0_f64.sqrt());
            laws::manifold(&Rotations, &x, &u)?;
            laws::metric::<Rotations, _>(&Canonical, &x, &u)?;
            laws::retraction::<Rotations, _, _>(&WeylMidpoint, &Canonical, &x, &u)?;
            laws::retraction::<Rotations, _, _>(&Exponential, &Canonical, &x, &u)?;
            let y = Rotations::chart(&x, &u);
            laws::symmetric_retraction::<Rotations, _, _>(&WeylMidpoint, &Canonical, &x, &y)?;
        }

        #[test]
        fn dexp_is_the_derivative_of_exp(q in prop::array::uniform3(-2.0..2.0)) {
            let q = Vector3::from(q);
            for k in 0..3 {
                let seeded = Vector3::from_fn(|i, _| {
                    Real::new(q[i], if i == k { 1.0 } else { 0.0 }, 0.0, 0.0)
                });
                let moved = exp(&seeded);
                let slope = vee(&exp(&q).tr_mul(&moved.map(|entry| entry.eps1)));
                prop_assert!((slope - dexp(&q).column(k)).norm() < 1e-14);
            }
            prop_assert!((dexp(&q) * dexp_inverse(&q) - Matrix3::identity()).amax() < 1e-13);
        }
    }

    #[test]
    fn first_and_second_derivatives_are_right_at_the_identity() {
        let seeded = vector![
            Real::new(0.0, 1.0, 0.0, 0.0),
            Real::new(0.0, 0.0, 1.0, 0.0),
            Real::new(0.0, 0.0, 0.0, 0.0)
        ];
        let r = exp(&seeded);
        // exp(q̂) = 1 + q̂ + ½q̂²: first derivatives are the generators, the mixed second one is
        // ½(ê₁ê₂ + ê₂ê₁).
        let [e1, e2] = [Vector3::x(), Vector3::y()].map(|e: Vector3<f64>| hat(&e));
        assert_eq!(r.map(|entry| entry.eps1), e1);
        assert_eq!(r.map(|entry| entry.eps2), e2);
        assert_eq!(r.map(|entry| entry.eps1eps2), (e1 * e2 + e2 * e1) * 0.5);
        let back = log(&r);
        assert_eq!(back.map(|entry| entry.eps1), Vector3::x());
        assert_eq!(back.map(|entry| entry.eps2), Vector3::y());
        assert!(back.map(|entry| entry.eps1eps2).norm() < 1e-16);
    }

    /// `q = ε₁ e_i + ε₂ e_j`.
    fn seed(i: usize, j: usize) -> Vector3<Real> {
        let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
        Vector3::from_fn(|k, _| Real::new(0.0, part(k, i), part(k, j), 0.0))
    }

    #[test]
    fn all_second_derivatives_are_right_at_the_identity() {
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let q = seed(i, j);
            let [a, b] = [i, j].map(|k| hat(&Vector3::<f64>::ith(k, 1.0)));
            let square = a * b + b * a;
            // exp(q̂) = 1 + q̂ + ½q̂², dexp(q) = 1 − ½q̂ + q̂²/6, dexp⁻¹(q) = 1 + ½q̂ + q̂²/12, each + O(q³).
            for (name, value, first, second) in [
                ("exp", exp(&q), 1.0, 0.5),
                ("dexp", dexp(&q), -0.5, 1.0 / 6.0),
                ("dexp⁻¹", dexp_inverse(&q), 0.5, 1.0 / 12.0),
            ] {
                assert_eq!(value.map(|entry| entry.re), Matrix3::identity(), "{name}");
                assert_eq!(value.map(|entry| entry.eps1), a * first, "{name}");
                assert_eq!(value.map(|entry| entry.eps2), b * first, "{name}");
                let off = value.map(|entry| entry.eps1eps2) - square * second;
                assert!(off.amax() < 1e-16, "{name}, {i} and {j}: {off}");
            }
            // log((1 + ε₁â)(1 + ε₂b̂)) = ε₁a + ε₂b + ½ε₁ε₂ a × b (Baker, Campbell and Hausdorff).
            let product = exp(&seed(i, 3)) * exp(&seed(3, j));
            let sum = log(&product);
            assert_eq!(sum.map(|entry| entry.eps1), Vector3::ith(i, 1.0));
            assert_eq!(sum.map(|entry| entry.eps2), Vector3::ith(j, 1.0));
            let bracket = Vector3::<f64>::ith(i, 1.0).cross(&Vector3::ith(j, 1.0)) * 0.5;
            assert!((sum.map(|entry| entry.eps1eps2) - bracket).amax() < 1e-16, "{i} and {j}");
            assert!(log(&exp(&q)).map(|entry| entry.eps1eps2).amax() < 1e-16, "{i} and {j}");
        }
    }

    #[test]
    fn a_reflection_is_not_a_rotation() {
        let mirror = Matrix3::from_diagonal(&vector![1.0, 1.0, -1.0]);
        assert!(Rotations.check(&mirror).is_err());
        assert!(Rotations.check(&Rotations.project(&mirror)).is_ok());
    }

    #[test]
    fn quaternions_without_a_direction_are_refused() {
        assert_eq!(Rotations.from_quaternion([0.0; 4]), Err(PointError::NoDirection));
        for bad in [f64::NAN, f64::INFINITY] {
            let error = Rotations.from_quaternion([1.0, bad, 0.0, 0.0]).unwrap_err();
            assert!(matches!(error, PointError::NotFinite { index: 1, .. }), "{error}");
        }
        let half = Rotations.from_quaternion([0.0, 0.0, 1.0, 1.0]).unwrap();
        for size in [1e-320, 1e-200, 1e200, 1e308] {
            let r = Rotations.from_quaternion([0.0, 0.0, size, size]).unwrap();
            assert!((r - half).amax() < 1e-15, "{size}: {r}");
        }
    }

    #[test]
    fn what_is_not_finite_is_off_the_group_and_stays_so() {
        for bad in [f64::NAN, f64::INFINITY] {
            for (i, j) in [(0, 0), (2, 1)] {
                let mut r = Matrix3::identity();
                r[(i, j)] = bad;
                assert!(!Rotations.defect(&r).is_finite(), "{r}");
                assert!(Rotations.check(&Rotations.project(&r)).is_err());
            }
        }
        // Any rotation is nearest to zero; and no size is too large or too small.
        for scale in [0.0, 5e-324, 1e-200, 1e200, f64::MAX] {
            let projected = Rotations.project(&(Matrix3::identity() * scale));
            assert!((projected - Matrix3::identity()).amax() < 1e-15, "{scale}: {projected}");
        }
    }

    proptest! {
        #[test]
        fn quaternions_go_in_and_out(
            mut q in prop::array::uniform4(-0.9..0.9), largest in 0..4_usize, scale in 1e-3..1e3_f64,
        ) {
            // Each component has its turn as the pivot, with either sign.
            q[largest] = 1_f64.copysign(q[largest]);
            let q: Vector4<f64> = Vector4::from(q).normalize();
            let r = Rotations.from_quaternion((q * scale).into()).unwrap();
            prop_assert!(Rotations.defect(&r) < 1e-15);
            prop_assert!((r - Rotations.from_quaternion((-q).into()).unwrap()).amax() < 1e-15);
            let v = vector![q[1], q[2], q[3]];
            let turned = v * (2.0 * v.dot(&Vector3::x()))
                + Vector3::x() * (q[0] * q[0] - v.norm_squared())
                + v.cross(&Vector3::x()) * (2.0 * q[0]);
            prop_assert!((r.column(0) - turned).norm() < 1e-15);
            let back = Vector4::from(Rotations.to_quaternion(&r));
            prop_assert!(back[0] >= 0.0);
            prop_assert!((back - q * 1_f64.copysign(q[0])).norm() < 1e-15);
        }
    }
}
