//! Vectors and matrices of a length that is known at run time, or when this library is compiled.

use std::fmt;
use std::ops::{Index, IndexMut};

use metriplectic_fields::length;
use smallvec::SmallVec;

use crate::numbers::{Lengths, List};

/// The number of variables up to which sums are taken in the order of types, term by term.
/// A factor of four fails `implicit/algebra.rs::sums_of_few_numbers_have_the_bits_of_types`.
pub(super) const FEW: usize = 8;

/// The vector of `n` numbers that are given by their index.
#[inline]
pub(super) fn vector<V: List>(n: usize, mut number: impl FnMut(usize) -> f64) -> V {
    let mut v = V::room(|| n);
    v.numbers_mut().iter_mut().enumerate().for_each(|(i, to)| *to = number(i));
    v
}

/// `Σ_i a_i b_i`.
#[inline]
pub(super) fn dot(a: &impl List, b: &impl List) -> f64 {
    let mut terms = a.numbers().iter().zip(b.numbers()).map(|(a, b)| a * b);
    let first = terms.next().unwrap_or(0.0);
    terms.fold(first, |sum, term| sum + term)
}

/// `Σ_j f(a_ij) v_j` for the rows of a matrix, four rows at once and each in two sums, which the processor adds at once.
fn times_rows(a: &[f64], v: &[f64], to: &mut [f64], f: impl Fn(f64) -> f64) {
    let n = v.len();
    let (pairs, last) = v.as_chunks::<2>();
    let mut fours = a.chunks_exact(4 * n);
    let mut of_fours = to.chunks_exact_mut(4);
    for (rows, to) in fours.by_ref().zip(of_fours.by_ref()) {
        let rows: [&[f64]; 4] = std::array::from_fn(|i| &rows[i * n..(i + 1) * n]);
        let mut sums = [[0.0; 2]; 4];
        let halves = rows.map(|row| row.as_chunks::<2>().0);
        let halves = halves.map(|row| &row[..pairs.len()]);
        for (j, v) in pairs.iter().enumerate() {
            for (sums, row) in sums.iter_mut().zip(&halves) {
                *sums = [sums[0] + f(row[j][0]) * v[0], sums[1] + f(row[j][1]) * v[1]];
            }
        }
        for ((to, sums), row) in to.iter_mut().zip(sums).zip(rows) {
            let rest = last.iter().zip(&row[n - last.len()..]);
            *to = rest.fold(sums[0] + sums[1], |sum, (v, a)| sum + f(*a) * v);
        }
    }
    let others = fours.remainder().chunks_exact(n).zip(of_fours.into_remainder());
    for (row, to) in others {
        *to = row.iter().zip(v).fold(0.0, |sum, (a, v)| sum + f(*a) * v);
    }
}

/// The numbers of a row from its first to its last that is not zero, with the place of the first.
fn extent(row: &[f64]) -> (usize, &[f64]) {
    let is_number = |a: &f64| *a != 0.0;
    let Some(first) = row.iter().position(is_number) else { return (0, &[]) };
    let end = row.iter().rposition(is_number).map_or(first, |last| last + 1);
    (first, &row[first..end])
}

/// `Σ_i |a_i| |b_i|`.
#[inline]
pub(super) fn sum_of_terms(a: &impl List, b: &impl List) -> f64 {
    let mut terms = a.numbers().iter().zip(b.numbers()).map(|(a, b)| (a * b).abs());
    let first = terms.next().unwrap_or(0.0);
    terms.fold(first, |sum, term| sum + term)
}

/// The Euclidean norm, also if squares overflow or underflow.
#[inline]
pub(super) fn magnitude(v: &impl List) -> f64 {
    length(v.numbers())
}

/// Returns whether every number is finite.
#[inline]
pub(super) fn is_finite(v: &impl List) -> bool {
    v.numbers().iter().fold(0.0, |sum, v| sum + 0.0 * v) == 0.0
}

/// `v += c w`.
#[inline]
pub(super) fn add(v: &mut impl List, c: f64, w: &impl List) {
    v.numbers_mut().iter_mut().zip(w.numbers()).for_each(|(v, w)| *v += w * c);
}

/// A square matrix, row by row.
pub(crate) struct Matrix<L: Lengths> {
    n: usize,
    a: L::Matrix,
}

// By hand, because lengths have neither.
impl<L: Lengths> Clone for Matrix<L> {
    #[inline]
    fn clone(&self) -> Self {
        Self { n: self.n, a: self.a.clone() }
    }
}

impl<L: Lengths> fmt::Debug for Matrix<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.a.numbers().chunks(self.n().max(1))).finish()
    }
}

impl<L: Lengths> Index<(usize, usize)> for Matrix<L> {
    type Output = f64;

    #[inline]
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.a.numbers()[i * self.n() + j]
    }
}

impl<L: Lengths> IndexMut<(usize, usize)> for Matrix<L> {
    #[inline]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        let n = self.n();
        &mut self.a.numbers_mut()[i * n + j]
    }
}

impl<L: Lengths> Matrix<L> {
    /// The matrix of zeros.
    #[inline]
    pub(crate) fn zeros(n: usize) -> Self {
        Self { n, a: L::Matrix::room(|| n * n) }
    }

    /// The matrix whose entry in row `i`, column `j` is `f(i, j)`.
    #[inline]
    pub(super) fn of(n: usize, f: impl Fn(usize, usize) -> f64) -> Self {
        let mut matrix = Self::zeros(n);
        for (i, row) in matrix.rows_mut().enumerate() {
            row.iter_mut().enumerate().for_each(|(j, to)| *to = f(i, j));
        }
        matrix
    }

    /// The multiple of the identity.
    #[inline]
    pub(crate) fn scaled_one(n: usize, c: f64) -> Self {
        Self::of(n, |i, j| if i == j { c } else { 0.0 })
    }

    /// The number of rows.
    #[inline]
    pub(super) fn n(&self) -> usize {
        L::directions(self.n)
    }

    /// All numbers, row by row.
    #[inline]
    pub(crate) fn numbers(&self) -> &[f64] {
        self.a.numbers()
    }

    /// All numbers, row by row, to be changed.
    #[inline]
    pub(super) fn numbers_mut(&mut self) -> &mut [f64] {
        self.a.numbers_mut()
    }

    #[inline]
    fn rows(&self) -> impl DoubleEndedIterator<Item = &[f64]> + ExactSizeIterator {
        self.a.numbers().chunks_exact(self.n().max(1))
    }

    #[inline]
    fn rows_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        let n = self.n().max(1);
        self.a.numbers_mut().chunks_exact_mut(n)
    }

    /// A function of each entry.
    #[inline]
    pub(super) fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        self.numbers_mut().iter_mut().for_each(|a| *a = f(*a));
        self
    }

    /// The absolute values.
    #[inline]
    pub(super) fn abs(self) -> Self {
        self.map(f64::abs)
    }

    /// `A += c B`.
    #[inline]
    pub(super) fn add(&mut self, c: f64, other: &Self) {
        let pairs = self.a.numbers_mut().iter_mut().zip(other.a.numbers());
        pairs.for_each(|(a, b)| *a += b * c);
    }

    /// `A += c a bᵀ`.
    #[inline]
    pub(super) fn add_outer(&mut self, c: f64, a: &L::Vector, b: &L::Vector) {
        let n = self.n();
        for (i, row) in self.rows_mut().enumerate() {
            (0..n).for_each(|j| row[j] += c * (a[i] * b[j]));
        }
    }

    /// `A v`.
    #[inline]
    pub(super) fn times(&self, v: &L::Vector) -> L::Vector {
        let mut product = L::Vector::room(|| self.n());
        if self.n() > FEW {
            times_rows(self.numbers(), v.numbers(), product.numbers_mut(), |a| a);
            return product;
        }
        for (row, to) in self.rows().zip(product.numbers_mut()) {
            let mut terms = row.iter().zip(v.numbers()).map(|(a, v)| a * v);
            let first = terms.next().unwrap_or(0.0);
            *to = terms.fold(first, |sum, term| sum + term);
        }
        product
    }

    /// `|A| v`.
    #[inline]
    pub(super) fn abs_times(&self, v: &L::Vector) -> L::Vector {
        let mut product = L::Vector::room(|| self.n());
        if self.n() > FEW {
            times_rows(self.numbers(), v.numbers(), product.numbers_mut(), f64::abs);
            return product;
        }
        for (row, to) in self.rows().zip(product.numbers_mut()) {
            let mut terms = row.iter().zip(v.numbers()).map(|(a, v)| a.abs() * v);
            let first = terms.next().unwrap_or(0.0);
            *to = terms.fold(first, |sum, term| sum + term);
        }
        product
    }

    /// `Aᵀ v`, the row `vᵀ A` as a vector.
    #[inline]
    pub(super) fn transpose_times(&self, v: &L::Vector) -> L::Vector {
        let mut product = L::Vector::room(|| self.n());
        for (i, row) in self.rows().enumerate() {
            let to = product.numbers_mut().iter_mut().zip(row);
            if i == 0 {
                to.for_each(|(to, a)| *to = a * v[i]);
            } else {
                to.for_each(|(to, a)| *to += a * v[i]);
            }
        }
        product
    }

    /// `A B`.
    #[inline]
    pub(super) fn product(&self, other: &Self) -> Self {
        if self.n() > FEW {
            return self.sparse_product(other);
        }
        let mut product = Self::zeros(self.n());
        for (row, to) in self.rows().zip(product.rows_mut()) {
            for (k, (a, other)) in row.iter().zip(other.rows()).enumerate() {
                let to = to.iter_mut().zip(other);
                if k == 0 {
                    to.for_each(|(to, b)| *to = a * b);
                } else {
                    to.for_each(|(to, b)| *to += a * b);
                }
            }
        }
        product
    }

    /// `A B` without the zeros of `A`, and those at both ends of the rows of `B`: Hessians of chains and constant tensors have few other
    /// numbers.
    fn sparse_product(&self, other: &Self) -> Self {
        let mut product = Self::zeros(self.n());
        let extents: SmallVec<[(usize, &[f64]); 64]> = other.rows().map(extent).collect();
        for (row, to) in self.rows().zip(product.rows_mut()) {
            for (a, (first, other)) in row.iter().zip(&extents) {
                if *a != 0.0 {
                    let to = to[*first..].iter_mut().zip(*other);
                    to.for_each(|(to, b)| *to += a * b);
                }
            }
        }
        product
    }

    /// A function of each column.
    pub(super) fn map_columns(&self, f: impl Fn(&L::Vector) -> L::Vector) -> Self {
        let n = self.n();
        let mut matrix = Self::zeros(n);
        for k in 0..n {
            let column = f(&vector(n, |i| self[(i, k)]));
            (0..n).for_each(|i| matrix[(i, k)] = column[i]);
        }
        matrix
    }

    /// `tr A²`.
    pub(super) fn trace_of_square(&self) -> f64 {
        let n = self.n();
        (0..n).map(|i| (0..n).map(|j| self[(i, j)] * self[(j, i)]).sum::<f64>()).sum()
    }

    /// The Frobenius norm.
    #[inline]
    pub(super) fn magnitude(&self) -> f64 {
        magnitude(&self.a)
    }

    /// Solves `A X = B` for so many columns, row by row, by elimination with row pivoting; `None` if `A` is singular or not a number.
    fn solve_columns(&self, right: &mut [f64], columns: usize) -> Option<()> {
        let (n, mut a) = (self.n(), self.clone());
        let a = a.numbers_mut();
        let less = |row: &mut [f64], factor: f64, other: &[f64]| {
            row.iter_mut().zip(other).for_each(|(x, other)| *x -= factor * other);
        };
        for k in 0..n {
            let (mut largest, mut pivot) = (0.0, k);
            for i in k..n {
                let size = a[i * n + k].abs();
                if size > largest {
                    (largest, pivot) = (size, i);
                }
            }
            if largest == 0.0 {
                return None;
            }
            if pivot != k {
                (k..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
                (0..columns).for_each(|j| right.swap(k * columns + j, pivot * columns + j));
            }
            let (above, below) = a.split_at_mut((k + 1) * n);
            let (known, unknown) = right.split_at_mut((k + 1) * columns);
            let (above, known) = (&above[k * n..], &known[k * columns..]);
            // Rows of the identity fill up from their beginning.
            let (first, known) = if n > FEW { extent(known) } else { (0, known) };
            for (row, x) in below.chunks_exact_mut(n).zip(unknown.chunks_exact_mut(columns)) {
                let factor = row[k] / above[k];
                if n > FEW && factor == 0.0 {
                    continue;
                }
                less(&mut row[k + 1..], factor, &above[k + 1..]);
                less(&mut x[first..], factor, known);
            }
        }
        for i in (0..n).rev() {
            let (x, known) = right[i * columns..].split_at_mut(columns);
            for (k, known) in (i + 1..n).zip(known.chunks_exact(columns)) {
                if n <= FEW || a[i * n + k] != 0.0 {
                    less(x, a[i * n + k], known);
                }
            }
            x.iter_mut().for_each(|x| *x /= a[i * n + i]);
        }
        (right.iter().fold(0.0, |sum, x| sum + 0.0 * x) == 0.0).then_some(())
    }

    /// Solves `A x = b`; `None` if `A` is singular or not a number.
    pub(super) fn solve(&self, b: &L::Vector) -> Option<L::Vector> {
        let mut x = b.clone();
        self.solve_columns(x.numbers_mut(), 1)?;
        Some(x)
    }

    /// Computes the inverse; `None` if the matrix is singular or not a number.
    pub(super) fn inverse(&self) -> Option<Self> {
        let mut inverse = Self::scaled_one(self.n(), 1.0);
        self.solve_columns(inverse.numbers_mut(), self.n())?;
        Some(inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::AtRunTime;
    use crate::step::Directions;

    /// A matrix with zeros inside of its rows and at their ends, and with one row of zeros.
    fn matrix(n: usize, seed: f64) -> Matrix<AtRunTime> {
        let entry = |i: usize, j: usize| (seed + 1.7 * i as f64 + 0.9 * (i * j) as f64).sin();
        let is_zero = |i: usize, j: usize| i == 2 || (i + 2 * j).is_multiple_of(3) || j + 4 < i;
        Matrix::of(n, |i, j| if is_zero(i, j) { 0.0 } else { entry(i, j) })
    }

    #[test]
    fn products_of_many_numbers_are_those_of_their_definition() {
        for n in [3, 8, 9, 10, 11, 12, 15] {
            let (a, b) = (matrix(n, 0.3), matrix(n, 1.1));
            let v = vector::<Directions>(n, |i| (0.4 + i as f64).cos());
            let (product, times, sizes) = (a.product(&b), a.times(&v), a.abs_times(&v));
            // Sums of up to fifteen numbers of order one.
            let near = |x: f64, y: f64| (x - y).abs() <= 15.0 * f64::EPSILON;
            for i in 0..n {
                assert!(near(times[i], (0..n).map(|k| a[(i, k)] * v[k]).sum()), "{n}, {i}");
                assert!(near(sizes[i], (0..n).map(|k| a[(i, k)].abs() * v[k]).sum()), "{n}, {i}");
                for j in 0..n {
                    let sum = (0..n).map(|k| a[(i, k)] * b[(k, j)]).sum();
                    assert!(near(product[(i, j)], sum), "{n}, {i}, {j}");
                }
            }
        }
    }

    #[test]
    fn sums_of_few_numbers_have_the_bits_of_types() {
        let in_order = |n: usize| {
            let a: Matrix<AtRunTime> = Matrix::of(n, |i, j| (0.3 + (i * n + j) as f64).sin());
            let v = vector::<Directions>(n, |i| (0.4 + i as f64).cos());
            let of_row = |i: usize| (1..n).fold(a[(i, 0)] * v[0], |sum, k| sum + a[(i, k)] * v[k]);
            let product = a.times(&v);
            (0..n).all(|i| product[i].to_bits() == of_row(i).to_bits())
        };
        assert!(in_order(8) && !in_order(32));
    }

    #[test]
    fn an_inverse_of_many_numbers_undoes_its_matrix_with_any_pivots() {
        for n in [3, 9, 14] {
            // The largest numbers stand beside the diagonal, so that rows change their places.
            let few = matrix(n, 0.7);
            let a: Matrix<AtRunTime> =
                Matrix::of(n, |i, j| few[(i, j)] * 0.1 + if j == (i + 3) % n { 2.0 } else { 0.0 });
            let one = a.inverse().expect("it is regular").product(&a);
            for i in 0..n {
                for j in 0..n {
                    let wanted = if i == j { 1.0 } else { 0.0 };
                    assert!((one[(i, j)] - wanted).abs() < 1e-14, "{n}, {i}, {j}: {one:?}");
                }
            }
            assert!(matrix(n, 0.7).inverse().is_none(), "a row is zero");
        }
    }
}
