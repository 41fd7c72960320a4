//! Square matrices of scalars, of a size that the compiler knows.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub, SubAssign};

use approx::RelativeEq;
use metriplectic_equations::NotPositive;
use nalgebra::{ArrayStorage, Const, SMatrix, SVector};
use num_dual::linalg::LU;

use crate::column::{Column, SQUARES, scaled_norm};
use crate::scalar::Scalar;
use crate::triangular;

/// A square matrix of scalars.
pub trait Square<D: Scalar>:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + RelativeEq<Epsilon = D>
    + Index<(usize, usize), Output = D>
    + IndexMut<(usize, usize)>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<D, Output = Self>
    + Mul<Output = Self>
    + Mul<Self::Column, Output = Self::Column>
    + AddAssign
    + SubAssign
{
    /// A column of the same height.
    type Column: Column<D>;

    /// Makes the matrix whose entry in row `i`, column `j` is `f(i, j)`.
    fn from_entries(f: impl FnMut(usize, usize) -> D) -> Self;

    /// Makes the matrix whose `j`-th column is `f(j)`.
    #[inline]
    fn from_columns(mut f: impl FnMut(usize) -> Self::Column) -> Self {
        let mut matrix = Self::zeros();
        for j in 0..Self::Column::LEN {
            let column = f(j);
            for i in 0..Self::Column::LEN {
                matrix[(i, j)] = column[i];
            }
        }
        matrix
    }

    /// The `j`-th column.
    #[inline]
    fn column_at(&self, j: usize) -> Self::Column {
        Self::Column::from_index(|i| self[(i, j)])
    }

    /// The matrix, factored.
    type Factors: Factors<Self::Column>;

    /// Computes the LU decomposition with row pivoting; `None` if the matrix is singular or not a number.
    fn factor(&self) -> Option<Self::Factors>;

    /// Solves `A x = b`; `None` if `A` is singular or not a number.
    #[inline]
    fn solve(&self, b: &Self::Column) -> Option<Self::Column> {
        self.factor()?.solve(b)
    }

    /// Computes the inverse; `None` if the matrix is singular or not a number.
    fn inverse(&self) -> Option<Self> {
        let factors = self.factor()?;
        let mut inverse = Self::zeros();
        for j in 0..Self::Column::LEN {
            let column = factors.solve(&Self::Column::basis(j))?;
            for i in 0..Self::Column::LEN {
                inverse[(i, j)] = column[i];
            }
        }
        Some(inverse)
    }

    /// The matrix of zeros.
    #[inline]
    fn zeros() -> Self {
        Self::from_entries(|_, _| D::zero())
    }

    /// The identity matrix.
    #[inline]
    fn one() -> Self {
        Self::from_entries(|i, j| if i == j { D::one() } else { D::zero() })
    }

    /// `a bᵀ`.
    #[inline]
    fn outer(a: &Self::Column, b: &Self::Column) -> Self {
        Self::from_entries(|i, j| a[i] * b[j])
    }

    /// `Aᵀ b`, the row `bᵀ A` as a column.
    #[inline]
    fn transpose_times(&self, b: &Self::Column) -> Self::Column {
        Self::Column::from_index(|j| {
            let mut sum = self[(0, j)] * b[0];
            for i in 1..Self::Column::LEN {
                sum += self[(i, j)] * b[i];
            }
            sum
        })
    }

    /// Computes the Frobenius norm of the real parts.
    #[inline]
    fn magnitude(&self) -> f64 {
        let mut sum = 0.0;
        for j in 0..Self::Column::LEN {
            for i in 0..Self::Column::LEN {
                sum += self[(i, j)].re() * self[(i, j)].re();
            }
        }
        let n = Self::Column::LEN;
        if SQUARES.contains(&sum) {
            sum.sqrt()
        } else {
            scaled_norm((0..n * n).map(|k| self[(k / n, k % n)].re()))
        }
    }

    /// The matrix of the absolute values of the real parts.
    #[inline]
    fn abs(&self) -> Self {
        Self::from_entries(|i, j| D::from(self[(i, j)].re().abs()))
    }

    /// Computes the lower triangular `L` with `A = L Lᵀ` (Cholesky), read from the lower triangle of `A`.
    ///
    /// # Errors
    ///
    /// [`NotPositive`] with the first pivot that is not a positive finite number.
    #[inline]
    fn cholesky(&self) -> Result<Self, NotPositive> {
        let mut l = Self::zeros();
        triangular::factor(Self::Column::LEN, self, &mut l)?;
        Ok(l)
    }

    /// Solves `L x = b` for a lower triangular `L` with nonzero diagonal.
    #[inline]
    fn solve_lower(&self, b: &Self::Column) -> Self::Column {
        let mut x = *b;
        triangular::solve(Self::Column::LEN, self, &mut x);
        x
    }

    /// Solves `Lᵀ x = b` for a lower triangular `L` with nonzero diagonal.
    #[inline]
    fn solve_lower_transpose(&self, b: &Self::Column) -> Self::Column {
        let mut x = *b;
        triangular::solve_transpose(Self::Column::LEN, self, &mut x);
        x
    }

    /// Computes the root of the determinant of a symmetric positive matrix, from its Cholesky factor.
    ///
    /// # Errors
    ///
    /// [`NotPositive`] if the matrix is not positive definite.
    #[inline]
    fn root_determinant(&self) -> Result<D, NotPositive> {
        let l = self.cholesky()?;
        Ok((0..Self::Column::LEN).fold(D::one(), |product, i| product * l[(i, i)]))
    }

    /// Returns the largest `|A_ij|` over the real parts; NaN if any entry is NaN.
    #[inline]
    fn max_abs(&self) -> f64 {
        let mut worst = 0.0_f64;
        for j in 0..Self::Column::LEN {
            for i in 0..Self::Column::LEN {
                let size = self[(i, j)].re().abs();
                if size > worst || size.is_nan() {
                    worst = size;
                }
            }
        }
        worst
    }
}

/// A factored matrix, which solves for any number of right-hand sides.
pub trait Factors<V> {
    /// Solves `A x = b`; `None` if it is not a number.
    fn solve(&self, b: &V) -> Option<V>;
}

impl<D: Scalar, const N: usize> Square<D> for SMatrix<D, N, N> {
    type Column = SVector<D, N>;

    #[inline]
    fn from_entries(mut f: impl FnMut(usize, usize) -> D) -> Self {
        let mut columns = [[D::zero(); N]; N];
        for (j, column) in columns.iter_mut().enumerate() {
            for (i, entry) in column.iter_mut().enumerate() {
                *entry = f(i, j);
            }
        }
        Self::from_array_storage(ArrayStorage(columns))
    }

    type Factors = LU<D, Const<N>>;

    #[inline]
    fn factor(&self) -> Option<LU<D, Const<N>>> {
        LU::new(*self).ok()
    }
}

impl<D: Scalar, const N: usize> Factors<SVector<D, N>> for LU<D, Const<N>> {
    #[inline]
    fn solve(&self, b: &SVector<D, N>) -> Option<SVector<D, N>> {
        let x = Self::solve(self, b);
        Column::is_finite(&x).then_some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};
    use num_dual::Dual64;

    const A: Matrix3<f64> = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0);

    #[test]
    fn cholesky_factor_reproduces_the_matrix() {
        let l = Square::cholesky(&A).unwrap();
        assert!((l * l.transpose() - A).abs().max() < 1e-15);
        let b = Vector3::new(1.0, -2.0, 3.0);
        let x = l.solve_lower_transpose(&l.solve_lower(&b));
        assert!((A * x - b).norm() < 1e-14);
    }

    #[test]
    fn cholesky_names_the_failing_pivot() {
        let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -2.0, 3.0));
        assert_eq!(Square::cholesky(&indefinite), Err(NotPositive { index: 1, pivot: -2.0 }));
        let mut nan = A;
        nan[(2, 2)] = f64::NAN;
        assert_eq!(Square::cholesky(&nan).unwrap_err().index, 2);
    }

    #[test]
    fn solve_carries_derivatives() {
        // (A + ε B) x = b  ⇒  x' = −A⁻¹ B x
        let b = Vector3::new(1.0, 2.0, 3.0);
        let perturbed = Matrix3::from_fn(|i, j| Dual64::new(A[(i, j)], (i + 2 * j) as f64));
        let x = Square::solve(&perturbed, &b.cast()).unwrap();
        let direction = Matrix3::from_fn(|i, j| (i + 2 * j) as f64);
        let x0 = A.lu().solve(&b).unwrap();
        let expected = -(A.lu().solve(&(direction * x0)).unwrap());
        for i in 0..3 {
            assert!((x[i].re - x0[i]).abs() < 1e-14);
            assert!((x[i].eps - expected[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn a_singular_matrix_has_no_solution() {
        assert_eq!(Square::solve(&Matrix3::<f64>::zeros(), &Vector3::zeros()), None);
        let nan = Matrix3::from_element(f64::NAN);
        assert_eq!(Square::solve(&nan, &Vector3::new(1.0, 0.0, 0.0)), None);
    }
}
