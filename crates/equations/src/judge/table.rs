//! Square matrices of a size that is known at run time.

use std::ops::{Index, IndexMut};

use smallvec::{SmallVec, smallvec};

/// Numbers in a row, without an allocation where they are few.
pub type Row = SmallVec<[f64; 8]>;

/// Makes a row of zeros.
pub(super) fn zeros(count: usize) -> Row {
    smallvec![0.0; count]
}

/// The entries of a square matrix.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    n: usize,
    /// Row by row.
    entries: SmallVec<[f64; 64]>,
}

impl Table {
    /// Makes the table of zeros.
    pub(crate) fn zeros(n: usize) -> Self {
        Self { n, entries: smallvec![0.0; n * n] }
    }

    /// Makes the table of the entries `f(i, j)`.
    pub(crate) fn from_entries(n: usize, f: impl Fn(usize, usize) -> f64) -> Self {
        Self { n, entries: pairs(n).map(|(i, j)| f(i, j)).collect() }
    }

    /// The number of rows.
    pub(super) const fn len(&self) -> usize {
        self.n
    }

    /// Row by row.
    pub(crate) fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// Row by row.
    pub(crate) fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// The column `j`.
    pub(super) fn column(&self, j: usize) -> Row {
        (0..self.n).map(|i| self[(i, j)]).collect()
    }

    /// The product with a vector.
    pub(super) fn times(&self, v: &[f64]) -> Row {
        self.entries.chunks_exact(self.n).map(|row| super::numbers::dot(row, v)).collect()
    }

    /// The largest absolute value of an entry, and NaN if one is NaN.
    pub(super) fn max_abs(&self) -> f64 {
        super::numbers::max_abs(&self.entries)
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

/// All pairs of indices below `n`, row by row.
pub(super) fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |i| (0..n).map(move |j| (i, j)))
}
