//! The inner product of a model at a state, and its derivatives along the unknown of a step.

use metriplectic_equations::Model;
use metriplectic_fields::triangular;

use super::algebra::{Matrix, vector};
use crate::numbers::{Lengths, List};

/// A symmetric positive matrix `g`, and its Cholesky factor, `g = l lᵀ`.
#[derive(Clone, Debug)]
pub(crate) struct Factored<L: Lengths> {
    g: Matrix<L>,
    l: Matrix<L>,
}

impl<L: Lengths> Factored<L> {
    /// Factors a matrix; `None` if it is not symmetric and positive.
    fn of(g: Matrix<L>) -> Option<Self> {
        let n = g.n();
        let mut l = Matrix::zeros(n);
        triangular::asymmetric(n, &g).is_none().then_some(())?;
        triangular::factor(n, &g, &mut l).ok()?;
        Some(Self { g, l })
    }

    /// The covector `♭v = g v`.
    pub(super) fn flat(&self, v: &L::Vector) -> L::Vector {
        self.g.times(v)
    }

    /// The components `l⁻¹α` of a covector in an orthonormal coframe.
    pub(super) fn orthonormal(&self, alpha: &L::Vector) -> L::Vector {
        let mut a = alpha.clone();
        triangular::solve(self.l.n(), &self.l, &mut a);
        a
    }

    /// The vector `l⁻ᵀa` with these orthonormal components.
    pub(super) fn with_components(&self, a: &L::Vector) -> L::Vector {
        let mut v = a.clone();
        triangular::solve_transpose(self.l.n(), &self.l, &mut v);
        v
    }

    /// The vector `♯α = g⁻¹α`.
    pub(super) fn sharp(&self, alpha: &L::Vector) -> L::Vector {
        self.with_components(&self.orthonormal(alpha))
    }
}

/// The metric at a state; `None` for the canonical one.
#[derive(Clone, Debug)]
pub(crate) struct Metric<L: Lengths>(Option<Box<Factored<L>>>);

impl<L: Lengths> Metric<L> {
    /// The canonical one.
    pub(crate) const CANONICAL: Self = Self(None);

    /// The metric of a model at a state; `None` where it cannot be used.
    pub(super) fn at(model: &dyn Model, x: &L::State, n: usize) -> Option<Self> {
        let (mut g, nothing) = (Matrix::<L>::zeros(n), L::Vector::room(|| n));
        model.metric(x.numbers(), nothing.numbers(), g.numbers_mut());
        Some(Self(Some(Box::new(Factored::of(g)?))))
    }

    /// The units in which covectors are orthonormal.
    #[inline]
    pub(super) fn units(&self) -> Units<'_, L> {
        self.0.as_ref().map_or(Units::Canonical, |factored| Units::Metric(factored))
    }
}

/// The metric at a state with its derivatives along the unknown of a step, which moves the state by `dz`.
pub(super) struct MetricAlong<'a, L: Lengths> {
    pub(super) factored: &'a Factored<L>,
    /// The derivatives along the chart.
    slopes: Vec<Matrix<L>>,
    dz: &'a Matrix<L>,
}

impl<'a, L: Lengths> MetricAlong<'a, L> {
    /// `None` for the canonical metric.
    pub(super) fn of(
        metric: &'a Metric<L>,
        model: &dyn Model,
        (x, dz): (&L::State, &'a Matrix<L>),
    ) -> Option<Self> {
        let factored = metric.0.as_deref()?;
        let n = factored.g.n();
        let mut all = vec![0.0; n * n * n];
        let mut slopes = Vec::new();
        if model.metric_slopes(x.numbers(), &mut all) {
            let of = |entries: &[f64]| Matrix::of(n, |i, j| entries[i * n + j]);
            slopes.extend(all.chunks_exact(n * n).map(of));
        }
        Some(Self { factored, slopes, dz })
    }

    /// The derivative of `g v`, for a fixed `v`.
    pub(super) fn of_flat(&self, v: &L::Vector) -> Matrix<L> {
        let n = self.factored.g.n();
        if self.slopes.is_empty() {
            return Matrix::zeros(n);
        }
        let columns: Vec<L::Vector> = self.slopes.iter().map(|slope| slope.times(v)).collect();
        Matrix::of(n, |i, k| columns[k][i]).product(self.dz)
    }
}

/// Units in which the components of covectors are orthonormal: the canonical ones, those of a metric, or sizes `s` with
/// `G(u, v) = Σ u_i v_i / s_i²`.
#[derive(Debug)]
pub(super) enum Units<'a, L: Lengths> {
    /// Of the canonical inner product.
    Canonical,
    /// Of these sizes.
    Sizes(&'a L::Vector),
    /// Of a metric.
    Metric(&'a Factored<L>),
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for Units<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: Lengths> Copy for Units<'_, L> {}

impl<L: Lengths> Units<'_, L> {
    /// The covector `♭v`.
    #[inline]
    pub(super) fn flat(&self, v: &L::Vector) -> L::Vector {
        match self {
            Self::Canonical => v.clone(),
            Self::Sizes(sizes) => vector(v.numbers().len(), |i| v[i] / sizes[i] / sizes[i]),
            Self::Metric(factored) => factored.flat(v),
        }
    }

    /// The components of a covector.
    #[inline]
    pub(super) fn orthonormal(&self, alpha: &L::Vector) -> L::Vector {
        match self {
            Self::Canonical => alpha.clone(),
            Self::Sizes(sizes) => vector(alpha.numbers().len(), |i| alpha[i] * sizes[i]),
            Self::Metric(factored) => factored.orthonormal(alpha),
        }
    }

    /// The vector with these components.
    #[inline]
    pub(super) fn with_components(&self, a: &L::Vector) -> L::Vector {
        match self {
            Self::Canonical | Self::Sizes(_) => self.orthonormal(a),
            Self::Metric(factored) => factored.with_components(a),
        }
    }

    /// The vector `♯α`.
    #[inline]
    pub(super) fn sharp(&self, alpha: &L::Vector) -> L::Vector {
        self.with_components(&self.orthonormal(alpha))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::AtRunTime;
    use crate::step::Directions;

    #[test]
    fn a_factor_undoes_its_matrix() {
        let g = |off: f64| {
            let rows = [[4.0, 1.0 + off], [1.0, 9.0]];
            Factored::<AtRunTime>::of(Matrix::of(2, |i, j| rows[i][j]))
        };
        assert!(g(0.1).is_none());
        let g = g(0.0).unwrap();
        let v = Directions::of(&[0.3, -0.7]);
        let back = g.sharp(&g.flat(&v));
        assert!((0..2).all(|i| (back[i] - v[i]).abs() <= 4.0 * f64::EPSILON));
        let a = g.orthonormal(&g.flat(&v));
        let square = 4.0 * 0.09 - 2.0 * 0.21 + 9.0 * 0.49;
        assert!((a[0] * a[0] + a[1] * a[1] - square).abs() <= 8.0 * f64::EPSILON * square);
    }
}
