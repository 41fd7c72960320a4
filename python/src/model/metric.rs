//! The metric of a space: the canonical one, or a recorded matrix on a flat space.

use std::ops::{Index, IndexMut};

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{MetricError, NotPositive};
use metriplectic_fields::triangular;

use super::reals::with_reals;
use super::tapes::OfState;

/// A symmetric positive matrix of each state of a flat space.
#[derive(Clone, Debug)]
pub(super) struct Metric {
    n: usize,
    tape: OfState,
}

/// A matrix of `n` rows in a row.
struct Rows<N> {
    n: usize,
    numbers: N,
}

impl<N: AsRef<[f64]>> Index<(usize, usize)> for Rows<N> {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.numbers.as_ref()[i * self.n + j]
    }
}

impl<N: AsRef<[f64]> + AsMut<[f64]>> IndexMut<(usize, usize)> for Rows<N> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.numbers.as_mut()[i * self.n + j]
    }
}

/// An inner product at a state, with an orthonormal coframe.
#[derive(Clone, Copy, Debug)]
pub(super) enum Inner<'a> {
    /// The metric in which the frame of the chart is orthonormal.
    Canonical,
    /// The metric in which these sizes are units.
    Units(&'a [f64]),
    /// The metric of a matrix `g = L Lᵀ`.
    Factored {
        /// The factor, row by row.
        l: &'a [f64],
    },
}

impl Inner<'_> {
    /// Computes the components `L⁻¹α` of a covector in an orthonormal coframe.
    pub(super) fn orthonormal(self, alpha: &[f64], to: &mut [f64]) {
        to.copy_from_slice(alpha);
        match self {
            Self::Canonical => {}
            Self::Units(units) => to.iter_mut().zip(units).for_each(|(to, unit)| *to *= unit),
            Self::Factored { l } => {
                triangular::solve(to.len(), &Rows { n: to.len(), numbers: l }, &mut Column(to));
            }
        }
    }

    /// Computes the vector `L⁻ᵀa` with orthonormal components.
    pub(super) fn vector(self, a: &[f64], to: &mut [f64]) {
        to.copy_from_slice(a);
        match self {
            Self::Canonical => {}
            Self::Units(units) => to.iter_mut().zip(units).for_each(|(to, unit)| *to *= unit),
            Self::Factored { l } => {
                triangular::solve_transpose(
                    to.len(),
                    &Rows { n: to.len(), numbers: l },
                    &mut Column(to),
                );
            }
        }
    }

    /// Computes the vector `♯α`.
    pub(super) fn sharp(self, alpha: &[f64], to: &mut [f64]) {
        with_numbers(alpha.len(), |hat| {
            self.orthonormal(alpha, hat);
            self.vector(hat, to);
        });
    }
}

/// A column of numbers.
struct Column<'a>(&'a mut [f64]);

impl Index<usize> for Column<'_> {
    type Output = f64;

    fn index(&self, i: usize) -> &f64 {
        &self.0[i]
    }
}

impl IndexMut<usize> for Column<'_> {
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.0[i]
    }
}

impl Metric {
    /// Makes a metric of a tape of `n × n` entries, which does not depend on the time.
    pub(super) const fn new(n: usize, tape: OfState) -> Self {
        Self { n, tape }
    }

    /// Evaluates the matrix, without a check.
    pub(super) fn matrix(&self, x: &[f64], g: &mut [f64]) {
        self.tape.tape.evaluate(x, g);
    }

    /// Calls `f` with the inner product at a state.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not finite, not symmetric, or not positive.
    pub(super) fn with_inner<T>(
        &self,
        x: &[f64],
        f: impl FnOnce(Inner<'_>) -> T,
    ) -> Result<T, MetricError> {
        let n = self.n;
        with_numbers(2 * n * n, |room| {
            let (g, l) = room.split_at_mut(n * n);
            self.matrix(x, g);
            if let Some(k) = g.iter().position(|entry| !entry.is_finite()) {
                return Err(MetricError::EntryNotFinite { row: k / n, column: k % n, value: g[k] });
            }
            let (g, mut factor) = (Rows { n, numbers: g }, Rows { n, numbers: l });
            if let Some((row, column, size)) = triangular::asymmetric(n, &g) {
                return Err(MetricError::NotSymmetric { row, column, size });
            }
            triangular::factor(n, &g, &mut factor).map_err(|error: NotPositive| error)?;
            Ok(f(Inner::Factored { l: factor.numbers }))
        })
    }

    /// Evaluates the derivatives of the matrix along each direction.
    pub(super) fn slopes(&self, x: &[f64], slopes: &mut [f64]) {
        let n = self.n;
        with_reals(n + n * n, |room| {
            let (y, g) = room.split_at_mut(n);
            y.iter_mut().zip(x).for_each(|(y, x)| y.re = *x);
            for k in (0..n).step_by(2) {
                y[k].eps1 = 1.0;
                if k + 1 < n {
                    y[k + 1].eps2 = 1.0;
                }
                self.tape.tape.evaluate(y, g);
                y[k].eps1 = 0.0;
                for (entry, g) in g.iter().enumerate() {
                    slopes[k * n * n + entry] = g.eps1;
                    if k + 1 < n {
                        slopes[(k + 1) * n * n + entry] = g.eps2;
                    }
                }
                if k + 1 < n {
                    y[k + 1].eps2 = 0.0;
                }
            }
        });
    }
}
