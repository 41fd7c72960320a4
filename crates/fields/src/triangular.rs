//! Symmetric positive matrices and their Cholesky factors, of a size that is known to the compiler or at run time.

use std::ops::{Index, IndexMut};

use metriplectic_equations::NotPositive;

use crate::scalar::Scalar;

/// The largest difference of an entry from its mirror image, relative to the size that an entry of a positive matrix can have: the
/// roundings of a closure.
/// A factor of four fails `triangular.rs::a_matrix_is_symmetric_up_to_roundings`.
const SYMMETRIC: f64 = 64.0 * f64::EPSILON;

/// Finds an entry of a matrix of `n` rows that differs from its mirror image by more than roundings, with the difference: relative to
/// `√(g_ii g_jj)`, the size that an entry can have in a positive matrix, in its own unit.
#[inline]
pub fn asymmetric<D: Scalar>(
    n: usize,
    g: &impl Index<(usize, usize), Output = D>,
) -> Option<(usize, usize, f64)> {
    for i in 0..n {
        for j in 0..i {
            let size = (g[(i, j)].re() - g[(j, i)].re()).abs();
            if size > 0.0 && size > SYMMETRIC * entry_size(g, i, j) {
                return Some((i, j, size));
            }
        }
    }
    None
}

/// The size `√(g_ii g_jj)` of an entry of a positive matrix.
#[cold]
fn entry_size<D: Scalar>(g: &impl Index<(usize, usize), Output = D>, i: usize, j: usize) -> f64 {
    g[(i, i)].re().abs().sqrt() * g[(j, j)].re().abs().sqrt()
}

/// Fills the lower triangle `L` of `g = L Lᵀ` (Cholesky), from the lower triangle of a matrix of `n` rows.
///
/// # Errors
///
/// [`NotPositive`] with the first pivot that is not a positive finite number.
#[inline]
pub fn factor<D: Scalar, A>(n: usize, g: &A, l: &mut A) -> Result<(), NotPositive>
where
    A: Index<(usize, usize), Output = D> + IndexMut<(usize, usize)>,
{
    for j in 0..n {
        let mut pivot = g[(j, j)];
        for k in 0..j {
            pivot -= l[(j, k)] * l[(j, k)];
        }
        if !(pivot.re() > 0.0 && pivot.re().is_finite()) {
            return Err(NotPositive { index: j, pivot: pivot.re() });
        }
        l[(j, j)] = pivot.sqrt();
        for i in j + 1..n {
            let mut entry = g[(i, j)];
            for k in 0..j {
                entry -= l[(i, k)] * l[(j, k)];
            }
            l[(i, j)] = entry / l[(j, j)];
        }
    }
    Ok(())
}

/// Solves `L x = b` for a lower triangular `L` of `n` rows with nonzero diagonal; `x` is `b` before.
#[inline]
pub fn solve<D: Scalar>(
    n: usize,
    l: &impl Index<(usize, usize), Output = D>,
    x: &mut impl IndexMut<usize, Output = D>,
) {
    for i in 0..n {
        for k in 0..i {
            let known = l[(i, k)] * x[k];
            x[i] -= known;
        }
        x[i] /= l[(i, i)];
    }
}

/// Solves `Lᵀ x = b` for a lower triangular `L` of `n` rows with nonzero diagonal; `x` is `b` before.
#[inline]
pub fn solve_transpose<D: Scalar>(
    n: usize,
    l: &impl Index<(usize, usize), Output = D>,
    x: &mut impl IndexMut<usize, Output = D>,
) {
    for i in (0..n).rev() {
        for k in i + 1..n {
            let known = l[(k, i)] * x[k];
            x[i] -= known;
        }
        x[i] /= l[(i, i)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn a_matrix_is_symmetric_up_to_roundings() {
        let off = |roundings: f64| {
            let off = 6.0 * roundings * f64::EPSILON;
            asymmetric(2, &Matrix2::new(4.0, 1.0 + off, 1.0, 9.0))
        };
        assert!(off(32.0).is_none());
        assert!(matches!(off(128.0), Some((1, 0, size)) if size > 0.0));
    }
}
