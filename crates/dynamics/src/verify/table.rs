//! Tensors and vectors as plain numbers, so that what judges them is compiled once, and not for every model.

use std::ops::{Index, IndexMut};

use metriplectic_fields::{Column, Square};

/// The entries of a square matrix.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    n: usize,
    /// Row by row.
    entries: Vec<f64>,
}

impl Table {
    /// Copies the entries of a matrix.
    pub(crate) fn of<A: Square<f64>>(a: &A) -> Self {
        let n = A::Column::LEN;
        let mut entries = Vec::with_capacity(n * n);
        for i in 0..n {
            for j in 0..n {
                entries.push(a[(i, j)]);
            }
        }
        Self { n, entries }
    }

    /// Makes the table of the entries `f(i, j)`.
    pub(super) fn from_entries(n: usize, f: impl Fn(usize, usize) -> f64) -> Self {
        Self { n, entries: pairs(n).map(|(i, j)| f(i, j)).collect() }
    }

    /// The number of rows.
    pub(super) const fn len(&self) -> usize {
        self.n
    }

    /// Row by row.
    pub(super) fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// The largest absolute value of an entry, and NaN if one is NaN.
    pub(super) fn max_abs(&self) -> f64 {
        self.entries.iter().map(|entry| entry.abs()).fold(0.0, super::balance::worse)
    }
}

impl Index<(usize, usize)> for Table {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.entries[i * self.n + j]
    }
}

impl IndexMut<(usize, usize)> for Table {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.entries[i * self.n + j]
    }
}

/// Copies the components of a vector.
pub(crate) fn components<V: Column<f64>>(v: &V) -> Vec<f64> {
    let mut values = Vec::with_capacity(V::LEN);
    append(&mut values, v);
    values
}

/// Appends the components of a vector.
pub(super) fn append<V: Column<f64>>(values: &mut Vec<f64>, v: &V) {
    for i in 0..V::LEN {
        values.push(v[i]);
    }
}

/// All pairs of indices below `n`, row by row.
pub(super) fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |i| (0..n).map(move |j| (i, j)))
}
