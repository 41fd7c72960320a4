//! Rⁿ.
//!
//! - **Point and velocity**: columns `x` and `x'` of `n` numbers.
//! - **Frame**: the unit vectors, the same everywhere.
//! - **Chart**: `φ_x(q) = x + q`.
//! - **Geodesics** of the dot product and of every constant matrix are straight lines,
//!   `exp_x(v) = x + v` and `log_x(y) = y − x`, each entry rounded once. The next step compensates the rounding
//!   error of the addition. A metric from a closure has the numerical geodesics of
//!   [`field_metric`](mod@crate::field_metric).
//! - **Brackets**: none by default. `Symplectic` on R²ⁿ, `q' = ∂H/∂p` and `p' = −∂H/∂q`;
//!   `Poisson::constant` for another skew matrix; `AreaForm` on R² and `Nambu` on R³,
//!   `x' = ∇S × ∇H`; `Poisson::field` for a matrix that varies (Hairer, Lubich and Wanner 2006, §VII.2).

use metriplectic_fields::{ChartPoint, Column, Real, Scalar, Space};
use nalgebra::{Const, SMatrix, SVector};
use rand::{Rng, RngExt};

use crate::Manifold;

/// The flat space Rⁿ, with the dot product as its canonical metric; see the
/// [module](mod@crate::euclidean).
///
/// ```
/// use metriplectic_manifolds::{Euclidean, Manifold};
/// assert!(Euclidean::<2>.check(&nalgebra::vector![1.0, 2.0]).is_ok());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Euclidean<const N: usize>;

/// The velocity in a frame that is the same everywhere: its components.
macro_rules! components_are_velocities {
    ($n:expr) => {
        #[inline]
        fn embed<D: Scalar>(_: &ChartPoint<Self, D>, v: &SVector<D, $n>) -> SVector<D, $n> {
            *v
        }

        #[inline]
        fn covariant<D: Scalar>(
            _: &ChartPoint<Self, D>,
            a: &SMatrix<D, $n, $n>,
        ) -> SMatrix<D, $n, $n> {
            *a
        }

        #[inline]
        fn contravariant<D: Scalar>(
            _: &ChartPoint<Self, D>,
            a: &SMatrix<D, $n, $n>,
        ) -> Option<SMatrix<D, $n, $n>> {
            Some(*a)
        }
    };
}
pub(crate) use components_are_velocities;

/// The sum `Σ_i |w_i v_i|`, in which the unit of an entry cancels.
#[inline]
pub(crate) fn sum_of_terms<V: Column<f64>>(w: &V, v: &V) -> f64 {
    (0..V::LEN).fold(0.0, |sum, i| sum + (w[i] * v[i]).abs())
}

/// The charts of a part of a vector space.
macro_rules! translations {
    ($space:ident, $is_vector_space:literal) => {
        impl<const N: usize> Space for $space<N> {
            type Dim = Const<N>;
            type Velocity = Const<N>;
            type Point<D: Scalar> = SVector<D, N>;

            #[inline]
            fn constant<D: Scalar>(x: &SVector<f64, N>) -> SVector<D, N> {
                Column::embed(x)
            }

            #[inline]
            fn real<D: Scalar>(x: &SVector<D, N>) -> SVector<f64, N> {
                Column::real(x)
            }

            #[inline]
            fn chart<D: Scalar>(x: &SVector<f64, N>, q: &SVector<D, N>) -> SVector<D, N> {
                Column::from_index(|i| q[i] + x[i])
            }

            /// A copy of the point in which two entries are seeded.
            #[inline]
            fn seeds(x: &SVector<f64, N>) -> impl Fn(usize, usize) -> SVector<Real, N> {
                // The sum of the chart, which has no zero with a sign.
                let x: SVector<Real, N> = Column::from_index(|k| Real::from(0.0 + x[k]));
                move |i, j| {
                    let mut seeded = x;
                    if i < N {
                        seeded[i].eps1 = 1.0;
                    }
                    if j < N {
                        seeded[j].eps2 = 1.0;
                    }
                    seeded
                }
            }

            #[inline]
            fn coordinates<D: Scalar>(x: &SVector<f64, N>, y: &SVector<D, N>) -> SVector<D, N> {
                Column::from_index(|i| y[i] - x[i])
            }

            const IS_VECTOR_SPACE: bool = $is_vector_space;

            const RATES_ARE_VELOCITIES: bool = true;

            /// The chart is a translation.
            #[inline]
            fn stage_rates(
                _: &SVector<f64, N>,
                _: (&SVector<f64, N>, &SVector<f64, N>),
                v: &SVector<f64, N>,
            ) -> SVector<f64, N> {
                *v
            }

            $crate::euclidean::components_are_velocities!(N);
        }

        impl<const N: usize> $crate::Flat for $space<N> {}
    };
}
pub(crate) use translations;

/// The entries of points that are columns of numbers, their sizes, and straight lines between them.
macro_rules! columns {
    () => {
        $crate::flat::straight_lines!();

        fn entries(x: &SVector<f64, N>) -> Vec<f64> {
            x.iter().copied().collect()
        }

        #[inline]
        fn write(x: &SVector<f64, N>, put: &mut impl FnMut(f64)) {
            x.iter().copied().for_each(put);
        }

        fn assemble(next: &mut impl FnMut() -> f64) -> SVector<f64, N> {
            Column::from_index(|_| next())
        }

        #[inline]
        fn magnitude(x: &SVector<f64, N>) -> f64 {
            Column::magnitude(x)
        }

        #[inline]
        fn scales(x: &SVector<f64, N>) -> SVector<f64, N> {
            x.abs()
        }

        #[inline]
        fn pairing_size(w: &SVector<f64, N>, v: &SVector<f64, N>) -> f64 {
            $crate::euclidean::sum_of_terms(w, v)
        }

        /// Returns the point itself.
        fn project(&self, x: &SVector<f64, N>) -> SVector<f64, N> {
            *x
        }
    };
}
pub(crate) use columns;

/// The charts of a vector space, and its membership: every finite column of numbers is a point.
macro_rules! vector_space {
    ($space:ident) => {
        $crate::euclidean::translations!($space, true);

        impl<const N: usize> Manifold for $space<N> {
            const ENTRIES: usize = N;

            $crate::euclidean::columns!();

            fn defect(&self, x: &SVector<f64, N>) -> f64 {
                if x.is_finite() { 0.0 } else { f64::NAN }
            }

            fn random(&self, rng: &mut impl Rng) -> SVector<f64, N> {
                Column::from_index(|_| rng.random_range(-1.0..1.0))
            }
        }
    };
}
pub(crate) use vector_space;

vector_space!(Euclidean);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointError;
    use nalgebra::vector;

    #[test]
    fn a_point_with_a_nan_names_its_entry() {
        let error = Euclidean::<3>.check(&vector![0.0, f64::NAN, 1.0]).unwrap_err();
        assert!(matches!(error, PointError::NotFinite { index: 1, .. }));
        let error = Euclidean::<3>.check(&vector![0.0, 1.0, f64::INFINITY]).unwrap_err();
        assert!(matches!(error, PointError::NotFinite { index: 2, .. }));
    }
}
