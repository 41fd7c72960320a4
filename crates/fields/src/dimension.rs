//! Dimensions that the compiler knows.
//!
//! A manifold names its [`Dimension`] once. Generic code then needs only [`Column`] and [`Square`], without
//! allocator bounds. The concrete types are nalgebra's [`SVector`] and [`SMatrix`], so concrete code can use all
//! of nalgebra.

use std::fmt::Debug;
use std::ops::IndexMut;

use nalgebra::{Const, DimAdd, SMatrix, SVector};

use crate::column::Column;
use crate::scalar::Scalar;
use crate::square::Square;

/// The dimension of a manifold. [`Const<N>`] is the only implementation.
pub trait Dimension: Copy + Debug + Send + Sync + 'static {
    /// The dimension as a number.
    const LEN: usize;
    /// `N` scalars: coordinates, components of a tangent vector or of a covector.
    type Vector<D: Scalar>: Column<D>;
    /// `N × N` scalars: a bilinear form or a linear map in a frame.
    type Matrix<D: Scalar>: Square<D, Column = Self::Vector<D>>;
    /// `N` values of any kind.
    type Array<T: Copy + Debug + Send + Sync>: Copy
        + Debug
        + Send
        + Sync
        + IndexMut<usize, Output = T>
        + AsRef<[T]>;

    /// The array whose `i`-th value is `f(i)`.
    fn array<T: Copy + Debug + Send + Sync>(f: impl FnMut(usize) -> T) -> Self::Array<T>;
}

impl<const N: usize> Dimension for Const<N> {
    const LEN: usize = N;
    type Vector<D: Scalar> = SVector<D, N>;
    type Matrix<D: Scalar> = SMatrix<D, N, N>;
    type Array<T: Copy + Debug + Send + Sync> = [T; N];

    #[inline]
    fn array<T: Copy + Debug + Send + Sync>(mut f: impl FnMut(usize) -> T) -> [T; N] {
        // Most systems have no further invariants: their closures are not compiled.
        if const { N == 0 } {
            return nothing();
        }
        // A loop over indices, of which the compiler makes less than of `std::array::from_fn`.
        let (mut values, mut i) = ([f(0); N], 1);
        while i < N {
            values[i] = f(i);
            i += 1;
        }
        values
    }
}

/// The array of no values.
fn nothing<T, const N: usize>() -> [T; N] {
    std::array::from_fn(|_| unreachable!("an array of no values has no value"))
}

/// Dimensions that can be added: those of the factors of a product.
pub trait Plus<N: Dimension>: Dimension {
    /// The sum of the two.
    type Sum: Dimension;
}

impl<const N: usize, const K: usize, const SUM: usize> Plus<Const<K>> for Const<N>
where
    Self: DimAdd<Const<K>, Output = Const<SUM>>,
{
    type Sum = Const<SUM>;
}
