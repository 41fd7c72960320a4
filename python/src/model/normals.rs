//! Projections off covectors, one after another, as those of `metriplectic_dynamics::orthogonal` for a number of
//! directions that is known at run time.

use metriplectic_equations::room::with_numbers;

use super::metric::Inner;

/// The fraction of a covector that must be orthogonal to those before it.
const INDEPENDENT: f64 = 1e-10;

/// Computes `⟨w, v⟩`.
pub(super) fn dot(w: &[f64], v: &[f64]) -> f64 {
    w.iter().zip(v).map(|(w, v)| w * v).sum()
}

/// Covectors made orthogonal to each other by Gram and Schmidt.
#[derive(Debug)]
pub(super) struct Normals<'a> {
    inner: Inner<'a>,
    n: usize,
    /// For each covector `n`, `♯n` and `G*(n, n)`.
    room: &'a mut [f64],
    len: usize,
}

impl<'a> Normals<'a> {
    /// The numbers that so many covectors take.
    pub(super) const fn room(n: usize, count: usize) -> usize {
        count * (2 * n + 1)
    }

    /// Begins with no covector, in a room of [`room`](Self::room) numbers.
    pub(super) const fn new(inner: Inner<'a>, n: usize, room: &'a mut [f64]) -> Self {
        Self { inner, n, room, len: 0 }
    }

    /// The number of covectors.
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    fn from(&self, first: usize) -> impl Iterator<Item = (&[f64], &[f64], f64)> {
        let n = self.n;
        let listed = self.room.chunks_exact(2 * n + 1).take(self.len).skip(first);
        listed.map(move |normal| (&normal[..n], &normal[n..2 * n], normal[2 * n]))
    }

    /// Adds a covector, and returns the fraction of it that is orthogonal to those before it. A fraction that is round-off is omitted.
    pub(super) fn push(&mut self, w: &[f64]) -> f64 {
        let n = self.n;
        with_numbers(2 * n, |numbers| {
            let (rest, hat) = numbers.split_at_mut(n);
            self.inner.orthonormal(w, hat);
            let size = magnitude(hat);
            rest.copy_from_slice(w);
            // The second pass removes the rounding error of the first.
            for _ in 0..2 {
                self.project_covector(0, rest);
            }
            self.inner.orthonormal(rest, hat);
            let left = magnitude(hat);
            let fraction = if size > 0.0 { left / size } else { 0.0 };
            if fraction > INDEPENDENT && self.len < n {
                let normal = &mut self.room[self.len * (2 * n + 1)..][..2 * n + 1];
                normal[..n].copy_from_slice(rest);
                self.inner.vector(hat, &mut normal[n..2 * n]);
                normal[2 * n] = dot(hat, hat);
                self.len += 1;
            }
            fraction
        })
    }

    /// Projects a covector off those from the `first` on.
    pub(super) fn project_covector(&self, first: usize, alpha: &mut [f64]) {
        for (normal, sharp, square) in self.from(first) {
            let part = dot(sharp, alpha) / square;
            alpha.iter_mut().zip(normal).for_each(|(alpha, n)| *alpha -= n * part);
        }
    }

    /// Projects a vector, so that the covectors from the `first` on annihilate it.
    pub(super) fn project_vector(&self, first: usize, v: &mut [f64]) {
        for (normal, sharp, square) in self.from(first) {
            let part = dot(normal, v) / square;
            v.iter_mut().zip(sharp).for_each(|(v, sharp)| *v -= sharp * part);
        }
    }
}

/// Computes `|v|` without overflow.
fn magnitude(v: &[f64]) -> f64 {
    metriplectic_fields::length(v)
}
