//! Columns of scalars, of a size that the compiler knows.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, RangeInclusive, Sub, SubAssign};

use approx::RelativeEq;
use nalgebra::{ArrayStorage, SVector};

use crate::scalar::Scalar;

/// A column of scalars: a vector or a covector in components.
pub trait Column<D: Scalar>:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + RelativeEq<Epsilon = D>
    + Index<usize, Output = D>
    + IndexMut<usize>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<D, Output = Self>
    + AddAssign
    + SubAssign
{
    /// The number of components.
    const LEN: usize;

    /// The components in an array.
    type Row: Copy + Send + Sync + AsRef<[D]> + AsMut<[D]>;

    /// Cuts numbers into rows of [`LEN`](Self::LEN) and leaves out a shorter rest, so that a row is read with one test of its
    /// place.
    fn rows(numbers: &[D]) -> &[Self::Row];

    /// Cuts numbers into rows that are written.
    fn rows_mut(numbers: &mut [D]) -> &mut [Self::Row];

    /// The column of the numbers in a row.
    #[inline(always)]
    fn of_row(row: &Self::Row) -> Self {
        let row = row.as_ref();
        Self::from_index(|k| row[k])
    }

    /// Writes the components into a row.
    #[inline(always)]
    fn write(&self, row: &mut Self::Row) {
        for (k, number) in row.as_mut().iter_mut().enumerate() {
            *number = self[k];
        }
    }

    /// Makes the column whose `i`-th component is `f(i)`.
    fn from_index(f: impl FnMut(usize) -> D) -> Self;

    /// Computes `Σ_i a_i b_i`, a covector on a vector.
    fn dot(&self, other: &Self) -> D;

    /// The column of zeros.
    #[inline]
    fn zero() -> Self {
        Self::from_index(|_| D::zero())
    }

    /// The `k`-th basis vector.
    #[inline]
    fn basis(k: usize) -> Self {
        Self::from_index(|i| if i == k { D::one() } else { D::zero() })
    }

    /// The real components, embedded in this scalar.
    #[inline]
    fn embed<R: Column<f64>>(real: &R) -> Self {
        Self::from_index(|i| D::from(real[i]))
    }

    /// The real parts of the components.
    #[inline]
    fn real<R: Column<f64>>(&self) -> R {
        R::from_index(|i| self[i].re())
    }

    /// Computes the Euclidean norm of the real parts, also if their squares overflow or underflow.
    #[inline]
    fn magnitude(&self) -> f64 {
        let mut sum = 0.0;
        for i in 0..Self::LEN {
            sum += self[i].re() * self[i].re();
        }
        if SQUARES.contains(&sum) {
            sum.sqrt()
        } else {
            scaled_norm((0..Self::LEN).map(|i| self[i].re()))
        }
    }

    /// The column of the absolute values of the real parts.
    #[inline]
    fn abs(&self) -> Self {
        Self::from_index(|i| D::from(self[i].re().abs()))
    }

    /// Returns whether every real part is finite.
    #[inline]
    fn is_finite(&self) -> bool {
        // Zero times a number is zero if it is finite, and NaN otherwise: one test for all of them.
        (0..Self::LEN).fold(0.0, |sum, i| sum + 0.0 * self[i].re()) == 0.0
    }
}

impl<D: Scalar, const N: usize> Column<D> for SVector<D, N> {
    const LEN: usize = N;

    type Row = [D; N];

    #[inline(always)]
    fn rows(numbers: &[D]) -> &[[D; N]] {
        numbers.as_chunks().0
    }

    #[inline(always)]
    fn rows_mut(numbers: &mut [D]) -> &mut [[D; N]] {
        numbers.as_chunks_mut().0
    }

    #[inline]
    fn from_index(mut f: impl FnMut(usize) -> D) -> Self {
        // Of all ways to write this loop it is the cheapest to compile, and columns are made everywhere.
        let mut entries = [D::zero(); N];
        let mut left = entries.as_mut_slice();
        let mut i = 0;
        while let [entry, rest @ ..] = left {
            *entry = f(i);
            (left, i) = (rest, i + 1);
        }
        Self::from_array_storage(ArrayStorage([entries]))
    }

    #[inline]
    fn dot(&self, other: &Self) -> D {
        let mut sum = self[0] * other[0];
        for i in 1..N {
            sum += self[i] * other[i];
        }
        sum
    }
}

/// Computes `Σ_i a_i b_i` in the order of nalgebra, of whose `dot` the compiler makes two thousand lines for each scalar and length.
#[inline]
pub fn dot<D: Scalar, const N: usize>(a: &SVector<D, N>, b: &SVector<D, N>) -> D {
    if const { N >= 8 } {
        return a.dot(b);
    }
    let product = |i: usize| a[i] * b[i];
    match N {
        2 => product(0) + product(1),
        3 => product(0) + product(1) + product(2),
        4 => (product(0) + product(2)) + (product(1) + product(3)),
        _ => {
            let (mut sum, mut i) = (D::zero(), 0);
            while i < N {
                sum += product(i);
                i += 1;
            }
            sum
        }
    }
}

/// The sums of squares without overflow or underflow.
pub(crate) const SQUARES: RangeInclusive<f64> = 1e-280..=1e280;

/// Computes the length of a list of numbers, also where their squares overflow or underflow.
#[must_use]
#[inline]
pub fn length(numbers: &[f64]) -> f64 {
    let sum = numbers.iter().fold(0.0, |sum, number| sum + number * number);
    if SQUARES.contains(&sum) { sum.sqrt() } else { scaled_norm(numbers.iter().copied()) }
}

/// The norm of numbers whose squares underflow or overflow, from the numbers in units of a power of two
/// near the largest.
#[cold]
pub(crate) fn scaled_norm(entries: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = entries.clone().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    if largest == 0.0 || !largest.is_finite() {
        // `max` ignores NaN, which must appear in the result.
        return entries.fold(largest, |sum, entry| sum + entry.abs());
    }
    let unit = power_of_two(largest);
    entries.fold(0.0, |sum, entry| sum + (entry / unit).powi(2)).sqrt() * unit
}

/// Returns the power of two at or below a positive number, at least the least normal number. A division by it
/// is exact.
#[must_use]
pub fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.max(f64::MIN_POSITIVE).to_bits() & f64::INFINITY.to_bits())
}

#[cfg(test)]
mod tests {
    use num_dual::Dual64;

    use super::*;

    #[test]
    fn a_product_has_the_bits_of_nalgebra() {
        macro_rules! agree {
            ($($n:literal)*) => {$({
                let a = SVector::<f64, $n>::from_fn(|i, _| (i as f64 + 0.7).sin() * 3.0);
                let b = SVector::<f64, $n>::from_fn(|i, _| (i as f64 * 1.3 + 0.1).cos());
                let zero = SVector::<f64, $n>::repeat(-0.0);
                for (a, b) in [(a, b), (zero, b), (b, zero)] {
                    assert_eq!(dot(&a, &b).to_bits(), a.dot(&b).to_bits(), "{}", $n);
                    let seed = |v: f64| Dual64::new(v, 1.0 - v);
                    let [here, there] = [dot(&a.map(seed), &b.map(seed)), a.map(seed).dot(&b.map(seed))];
                    assert_eq!(here.eps.to_bits(), there.eps.to_bits(), "{}", $n);
                }
            })*};
        }
        agree!(1 2 3 4 5 6 7 8 9 17);
    }
}
