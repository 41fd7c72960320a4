//! Numbers for the directions of a flow, of a length that is known at compile time or not.

use std::fmt::Debug;

use metriplectic_fields::Column;

/// A number for each direction of a [`Flow`](crate::Flow): `Vec<f64>`, or the [`Components`] of a vector of
/// fixed length.
pub trait Vector: Clone + Debug {
    /// How many there are.
    fn len(&self) -> usize;

    /// The number of direction `i`.
    fn get(&self, i: usize) -> f64;

    /// As many numbers, given by their index.
    #[must_use]
    fn with(&self, number: impl FnMut(usize) -> f64) -> Self;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A function of each number.
    #[must_use]
    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        self.with(|i| f(self.get(i)))
    }

    /// The numbers in a list.
    fn to_list(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.get(i)).collect()
    }
}

impl Vector for Vec<f64> {
    fn len(&self) -> usize {
        self.len()
    }

    fn get(&self, i: usize) -> f64 {
        self[i]
    }

    fn with(&self, number: impl FnMut(usize) -> f64) -> Self {
        (0..self.len()).map(number).collect()
    }
}

/// The components of a vector of fixed length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Components<V>(pub V);

impl<V: Column<f64>> Vector for Components<V> {
    #[inline]
    fn len(&self) -> usize {
        V::LEN
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        self.0[i]
    }

    #[inline]
    fn with(&self, number: impl FnMut(usize) -> f64) -> Self {
        Self(V::from_index(number))
    }
}
