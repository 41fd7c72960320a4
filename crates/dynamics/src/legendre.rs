//! The Legendre transform of a reduced Lagrangian on a Lie algebra.

use std::fmt;

use metriplectic_fields::newton::{self, Cause, Limits, Problem, Progress};
use metriplectic_fields::{Column, Factors, Jet1, Jet2, Scalar, ScalarField, Square};
use metriplectic_manifolds::{Euclidean, LieDual};
use nalgebra::{SMatrix, SVector};

/// The Legendre transform of a reduced Lagrangian `l: g → R`, as the energy that it is on `g*`:
///
/// ```math
/// \mu = \frac{\partial l}{\partial \xi}, \qquad h(\mu) = \langle \mu, \xi(\mu) \rangle - l(\xi(\mu)),
/// \qquad dh = \xi(\mu), \qquad \mathrm{Hess}\, h = (\mathrm{Hess}\, l)^{-1} .
/// ```
///
/// Damped Newton iterations with the Hessian of `l` find `ξ(μ)` to round-off, from `ξ = 0` or another
/// [start](Self::near). The formulas above then give differential and Hessian of `h`. The second-order Taylor
/// expansion, which is exact there, gives `h` at every scalar of derivative order ≤ 2.
///
/// Where there is no `ξ(μ)`, `h` is NaN, which the verification of a model names.
/// [`velocity`](Self::velocity) returns the reason.
#[derive(Clone, Copy)]
pub struct Legendre<L, const N: usize> {
    lagrangian: L,
    start: SVector<f64, N>,
}

// By hand, because closures have no `Debug`.
impl<L, const N: usize> fmt::Debug for Legendre<L, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Legendre").field("start", &self.start).finish_non_exhaustive()
    }
}

/// The limits of Newton's method. A correction is tried at 40 lengths.
const LIMITS: Limits = Limits { iterations: 100, halvings: 39 };

/// A Hessian is degenerate if its reciprocal condition number is below this. No digit of a solution would be
/// right.
const DEGENERATE: f64 = 16.0 * f64::EPSILON;

impl<L: ScalarField<Euclidean<N>>, const N: usize> Legendre<L, N> {
    /// The transform of the Lagrangian `l`, a closure `|ξ| -> Real` or any other [`ScalarField`].
    pub fn of(l: L) -> Self {
        Self { lagrangian: l, start: SVector::zeros() }
    }

    /// Starts Newton's method at `xi` instead of 0. Use it if the Hessian of `l` is degenerate at 0, or if a
    /// momentum has several velocities and you need the velocity near `xi`.
    #[must_use]
    pub fn near(self, xi: SVector<f64, N>) -> Self {
        Self { start: xi, ..self }
    }

    /// Computes the momentum `μ = ∂l/∂ξ`.
    pub fn momentum(&self, xi: &SVector<f64, N>) -> SVector<f64, N> {
        self.lagrangian.jet1(xi).df
    }

    /// Computes the velocity `ξ(μ)`, at which `∂l/∂ξ = μ`.
    ///
    /// # Errors
    ///
    /// [`LegendreError`] if `l` is not finite at the start, if its Hessian is degenerate, or if no such `ξ` is
    /// found.
    pub fn velocity(&self, mu: &SVector<f64, N>) -> Result<SVector<f64, N>, LegendreError> {
        let problem = Inversion { legendre: self, mu };
        let start = self.finite_jet(&self.start).ok_or_else(|| not_finite(&self.start))?;
        newton::solve(&problem, (self.start, start), LIMITS)
    }

    /// The jet of `l`, if it is a number.
    fn finite_jet(&self, xi: &SVector<f64, N>) -> Option<Jet2<Euclidean<N>>> {
        Some(self.lagrangian.jet2(xi)).filter(Jet2::is_finite)
    }

    /// `ξ(μ)`, or not a number.
    fn velocity_or_nan(&self, mu: &SVector<f64, N>) -> SVector<f64, N> {
        self.velocity(mu).unwrap_or_else(|_| SVector::repeat(f64::NAN))
    }
}

/// The equation `∂l/∂ξ = μ`, to be solved for `ξ`.
struct Inversion<'a, L, const N: usize> {
    legendre: &'a Legendre<L, N>,
    mu: &'a SVector<f64, N>,
}

impl<L: ScalarField<Euclidean<N>>, const N: usize> Problem for Inversion<'_, L, N> {
    type Iterate = (SVector<f64, N>, Jet2<Euclidean<N>>);
    type Correction = SVector<f64, N>;
    type Root = SVector<f64, N>;
    type Error = LegendreError;

    fn correct(
        &self,
        (xi, jet): &Self::Iterate,
    ) -> Result<Progress<Self::Root, Self::Correction>, LegendreError> {
        let error = self.mu - jet.df;
        let step = regular(&jet.hf, xi)? * error;
        let next = xi + step;
        // Newton's method squares the relative error, so this correction is the last one; and so it is at
        // the rounding of dl.
        let rounding = 16.0 * f64::EPSILON * (self.mu.norm() + jet.hf.norm() * xi.norm());
        let last = step.norm() <= f64::EPSILON.sqrt() * next.norm() || error.norm() <= rounding;
        Ok(if last { Progress::Root(next) } else { Progress::Correction(step, 1.0) })
    }

    fn advance(
        &self,
        (xi, jet): &Self::Iterate,
        step: &SVector<f64, N>,
        length: f64,
    ) -> Option<Self::Iterate> {
        let next = xi + step * length;
        let next_jet = self.legendre.finite_jet(&next)?;
        let closer = (self.mu - next_jet.df).norm() < (self.mu - jet.df).norm();
        closer.then_some((next, next_jet))
    }

    fn stop(
        &self,
        (_, jet): Self::Iterate,
        _: Cause,
        iterations: usize,
    ) -> Result<Self::Root, LegendreError> {
        Err(LegendreError::NoVelocity { residual: (self.mu - jet.df).norm(), iterations })
    }
}

// What is missing where an energy should be is a closure.
#[diagnostic::do_not_recommend]
impl<L: ScalarField<Euclidean<N>>, const N: usize> ScalarField<LieDual<N>> for Legendre<L, N> {
    fn at<D: Scalar>(&self, mu: &SVector<D, N>) -> D {
        const {
            assert!(
                D::NDERIV <= 2,
                "the energy of a Lagrangian has derivatives up to order 2, and this scalar asks for \
                 more"
            );
        }
        let real = mu.map(|m| m.re());
        let d = |i: usize| mu[i] - real[i];
        match D::NDERIV {
            0 => {
                let xi = self.velocity_or_nan(&real);
                D::from(
                    real.dot(&xi) - ScalarField::<Euclidean<N>>::at::<f64>(&self.lagrangian, &xi),
                )
            }
            1 => {
                let jet: Jet1<LieDual<N>> = self.jet1(&real);
                (0..N).fold(D::from(jet.value), |h, i| h + d(i) * jet.df[i])
            }
            _ => {
                let jet: Jet2<LieDual<N>> = self.jet2(&real);
                (0..N).fold(D::from(jet.value), |h, i| {
                    let bend = (0..N).fold(D::zero(), |sum, j| sum + d(j) * jet.hf[(i, j)]);
                    h + d(i) * (bend * 0.5 + jet.df[i])
                })
            }
        }
    }

    fn jet1(&self, mu: &SVector<f64, N>) -> Jet1<LieDual<N>> {
        let xi = self.velocity_or_nan(mu);
        let l: f64 = ScalarField::<Euclidean<N>>::at(&self.lagrangian, &xi);
        Jet1 { value: mu.dot(&xi) - l, df: xi }
    }

    fn jet2(&self, mu: &SVector<f64, N>) -> Jet2<LieDual<N>> {
        let xi = self.velocity_or_nan(mu);
        let l = self.lagrangian.jet2(&xi);
        let hf = inverse(&l.hf).unwrap_or_else(|| SMatrix::repeat(f64::NAN));
        Jet2 { value: mu.dot(&xi) - l.value, df: xi, hf: (hf + hf.transpose()) * 0.5 }
    }
}

/// The inverse of a matrix, column by column.
fn inverse<const N: usize>(a: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let (factors, mut inverse) = (a.factor()?, SMatrix::<f64, N, N>::zeros());
    for j in 0..N {
        let column: SVector<f64, N> = Factors::solve(&factors, &Column::basis(j))?;
        inverse.set_column(j, &column);
    }
    Some(inverse)
}

/// The inverse of a Hessian, unless it is degenerate.
fn regular<const N: usize>(
    hessian: &SMatrix<f64, N, N>,
    xi: &SVector<f64, N>,
) -> Result<SMatrix<f64, N, N>, LegendreError> {
    let inverse = inverse(hessian).ok_or_else(|| degenerate(0.0, xi))?;
    let reciprocal_condition = (hessian.norm() * inverse.norm()).recip();
    if reciprocal_condition > DEGENERATE {
        Ok(inverse)
    } else {
        Err(degenerate(reciprocal_condition, xi))
    }
}

fn degenerate<const N: usize>(reciprocal_condition: f64, xi: &SVector<f64, N>) -> LegendreError {
    LegendreError::Degenerate { reciprocal_condition, xi: xi.iter().copied().collect() }
}

fn not_finite<const N: usize>(xi: &SVector<f64, N>) -> LegendreError {
    LegendreError::NotFinite { xi: xi.iter().copied().collect() }
}

/// A momentum without a velocity.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LegendreError {
    /// The Lagrangian or a derivative is not a number where Newton's method starts.
    #[error(
        "the Lagrangian or one of its derivatives is not a finite number at ξ = {xi:?}; start \
         elsewhere, `Legendre::of(l).near(xi)`"
    )]
    NotFinite {
        /// Where.
        xi: Vec<f64>,
    },
    /// The Hessian of the Lagrangian is singular to round-off, so that momenta do not determine
    /// velocities.
    #[error(
        "the Hessian of the Lagrangian is degenerate at ξ = {xi:?}: its reciprocal condition number \
         is {reciprocal_condition:.1e}; if it is regular elsewhere, start there, \
         `Legendre::of(l).near(xi)`"
    )]
    Degenerate {
        /// `1/(|A||A⁻¹|)` of the Hessian `A`, 0 if it is singular.
        reciprocal_condition: f64,
        /// Where.
        xi: Vec<f64>,
    },
    /// Newton's method has not found a velocity.
    #[error(
        "no velocity was found: |∂l/∂ξ − μ| is still {residual:.1e} after {iterations} Newton iterations; the \
         momentum may be out of reach of this Lagrangian, or start nearer, `Legendre::of(l).near(xi)`"
    )]
    NoVelocity {
        /// `|∂l/∂ξ − μ|` at the best velocity.
        residual: f64,
        /// Newton iterations taken.
        iterations: usize,
    },
}

metriplectic_equations::debug_is_the_sentence!(LegendreError);

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_fields::{ChartPoint, Real, hessian, laws};
    use nalgebra::{Matrix3, Vector3, vector};
    use num_dual::{Dual, Dual64, DualNum};
    use proptest::prelude::*;

    fn columns() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-3.0..3.0).prop_map(Vector3::from)
    }

    /// `l = −√(1 − |ξ|²)`, `h = √(1 + |μ|²)`: defined inside the unit ball only.
    fn relativistic(xi: &Vector3<Real>) -> Real {
        -(-xi.norm_squared() + 1.0).sqrt()
    }

    /// Convex, and of no special form.
    fn quartic(xi: &Vector3<Real>) -> Real {
        let weighted = xi.x * xi.x * 2.0 + xi.y * xi.y + xi.z * xi.z * 0.5;
        weighted * 0.5 + weighted * weighted * 0.25 + xi.x * xi.y * 0.3 + xi.z * 0.2
    }

    #[test]
    fn a_dual_number_carries_the_velocity() {
        let (legendre, mu, v) =
            (Legendre::of(quartic), vector![0.4, -0.7, 0.2], vector![1.0, -2.0, 0.5]);
        let jet: Jet1<LieDual<3>> = legendre.jet1(&mu);
        let h: Dual64 = legendre.at(&mu.zip_map(&v, Dual64::new));
        assert!((h.re - jet.value).abs() < 1e-15 && (h.eps - jet.df.dot(&v)).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn the_energy_of_a_lagrangian_is_a_field(mu in columns(), v in columns()) {
            laws::scalar_field::<LieDual<3>>(&Legendre::of(quartic), &mu, &v)?;
            laws::scalar_field::<LieDual<3>>(&Legendre::of(relativistic), &mu, &(v * 0.2))?;
        }

        #[test]
        fn the_velocity_undoes_the_momentum(mu in columns()) {
            let legendre = Legendre::<_, 3>::of(quartic);
            let back = legendre.momentum(&legendre.velocity(&mu)?);
            prop_assert!((back - mu).norm() <= 1e-14 * (1.0 + mu.norm()));
        }

        #[test]
        fn the_transform_of_a_root_is_its_closed_form_at_every_scalar(mu in columns(), v in columns()) {
            let legendre = Legendre::<_, 3>::of(relativistic);
            let jet: Jet2<LieDual<3>> = legendre.jet2(&mu);
            let h = (1.0 + mu.norm_squared()).sqrt();
            let xi = mu / h;
            prop_assert!((jet.value - h).abs() <= 1e-14 * h.powi(2), "{:e}", jet.value - h);
            // Near the speed of light ξ(μ) is well conditioned and Hess l grows like h³.
            prop_assert!((jet.df - xi).norm() <= 1e-13);
            let bend = (Matrix3::identity() - xi * xi.transpose()) / h;
            prop_assert!((jet.hf - bend).norm() <= 1e-11);
            let nested = mu.zip_map(&v, |m, v| Dual::new(Dual64::new(m, v), Dual64::new(1.0 - v, 0.3 * m)));
            let lifted: Dual<Dual64> = legendre.at(&nested);
            let defined = (nested.dot(&nested) + 1.0).sqrt();
            for (l, d) in [
                (lifted.re.re, defined.re.re),
                (lifted.re.eps, defined.re.eps),
                (lifted.eps.re, defined.eps.re),
                (lifted.eps.eps, defined.eps.eps),
            ] {
                prop_assert!((l - d).abs() <= 1e-10 * (1.0 + d.abs()), "{l} {d}");
            }
            let nested: Matrix3<f64> = hessian::<LieDual<3>, f64>(&legendre, &ChartPoint::centre(&mu));
            prop_assert!((nested - jet.hf).norm() <= 1e-13);
        }

        /// `h = ½ μᵀA⁻¹μ` for `l = ½ ξᵀAξ`, which is one correction and one refinement.
        #[test]
        fn a_quadratic_lagrangian_has_a_quadratic_energy(mu in columns(), b in columns()) {
            let a = Matrix3::identity() + b * b.transpose();
            let legendre =
                Legendre::<_, 3>::of(move |xi: &Vector3<Real>| xi.dot(&(a.cast::<Real>() * xi)) * 0.5);
            let expected = a.try_inverse().unwrap() * mu;
            let jet: Jet1<LieDual<3>> = legendre.jet1(&mu);
            prop_assert!((jet.df - expected).norm() <= 1e-13 * (1.0 + mu.norm()));
            prop_assert!((jet.value - 0.5 * mu.dot(&expected)).abs() <= 1e-13 * (1.0 + mu.norm_squared()));
        }
    }

    #[test]
    fn a_degenerate_hessian_is_an_error_with_its_number() {
        // The third velocity is not in the Lagrangian.
        let flat = Legendre::<_, 3>::of(|xi: &Vector3<Real>| xi.x * xi.x + xi.y * xi.y);
        let error = flat.velocity(&vector![1.0, 2.0, 0.0]).unwrap_err();
        assert_eq!(
            error,
            LegendreError::Degenerate { reciprocal_condition: 0.0, xi: vec![0.0; 3] }
        );
        // Hardly in it.
        let thin = Legendre::<_, 3>::of(|xi: &Vector3<Real>| {
            xi.norm_squared() - xi.z * xi.z * (1.0 - 1e-15)
        });
        let error = thin.velocity(&vector![1.0, 2.0, 0.0]).unwrap_err();
        assert!(
            matches!(error, LegendreError::Degenerate { reciprocal_condition, .. }
                if reciprocal_condition > 0.0 && reciprocal_condition < 1e-14),
            "{error}"
        );
        assert!(ScalarField::<LieDual<3>>::at::<f64>(&flat, &vector![1.0, 2.0, 0.0]).is_nan());
    }

    #[test]
    fn a_start_chooses_among_velocities_and_avoids_degenerate_ones() {
        // l = |ξ|⁴/4 has no Hessian at 0; h = ¾ |μ|^(4/3).
        let l = |xi: &Vector3<Real>| xi.norm_squared().powi(2) * 0.25;
        let mu = vector![0.0, 8.0, 0.0];
        let error = Legendre::of(l).velocity(&mu).unwrap_err();
        assert!(matches!(error, LegendreError::Degenerate { .. }), "{error}");
        let legendre = Legendre::of(l).near(vector![1.0, 1.0, 1.0]);
        assert!((legendre.velocity(&mu).unwrap() - vector![0.0, 2.0, 0.0]).norm() < 1e-14);
        assert!((ScalarField::<LieDual<3>>::at::<f64>(&legendre, &mu) - 12.0).abs() < 1e-13);
    }

    #[test]
    fn a_momentum_out_of_reach_is_an_error_with_its_number() {
        // |∂l/∂ξ| < 1 everywhere.
        let l = |xi: &Vector3<Real>| (xi.norm_squared() + 1.0).sqrt();
        let error = Legendre::of(l).velocity(&vector![0.0, 1.5, 0.0]).unwrap_err();
        // The search runs off to where l is straight.
        assert!(
            matches!(&error, LegendreError::Degenerate { reciprocal_condition, xi }
                if *reciprocal_condition < 1e-14 && xi[1] > 1e3),
            "{error}"
        );
        // A step that ends before μ is reached: dl = ξ exp(−ξ²) turns back at ξ² = ½.
        let l = |xi: &Vector3<Real>| -(-xi.norm_squared()).exp() * 0.5;
        let error = Legendre::of(l).velocity(&vector![0.0, 1.5, 0.0]).unwrap_err();
        assert!(
            matches!(error, LegendreError::NoVelocity { residual, .. } if residual >= 1.0),
            "{error}"
        );
        // The start is outside the domain.
        let error = Legendre::of(relativistic)
            .near(vector![2.0, 0.0, 0.0])
            .velocity(&vector![0.1, 0.0, 0.0]);
        assert_eq!(error, Err(LegendreError::NotFinite { xi: vec![2.0, 0.0, 0.0] }));
    }
}
