//! Projections off covectors, one after another.
//!
//! A tensor is made to annihilate a covector `w` by the projections
//!
//! ```math
//! P^T\alpha = \alpha - \frac{G^*(w,\alpha)}{G^*(w,w)}\, w, \qquad
//! P\,v = v - \frac{\langle w, v\rangle}{G^*(w,w)}\, \sharp w ,
//! ```
//!
//! of covectors and of vectors: `⟨w, Pv⟩ = 0`. Several covectors are first made orthogonal to each
//! other by Gram and Schmidt. This has the effect of the inverse `C^{ab}` of their Gram matrix in the remark
//! of Bloch, Farré Puiggalí, Martín de Diego (2024, §2.2), without forming it. A covector whose orthogonal
//! part is round-off depends on those before it, and is omitted.
//!
//! This projection jumps where a covector becomes dependent. The faded projections do not. With the independent fraction
//! `σ = |n|/|w|` of the covector `w` whose orthogonal part is `n`, each has the weight `1/(1 + r)`,
//! `r = (μ/σ)⁴`,
//!
//! ```math
//! P_\mu^T\alpha = \alpha - \frac{1}{1 + r}\, \frac{G^*(n,\alpha)}{G^*(n,n)}\, n .
//! ```
//!
//! The first covector has `σ = 1` and full weight, up to `μ⁴`.

use metriplectic_fields::{Column, Dimension, Scalar, Square};
use metriplectic_manifolds::InnerProduct;

/// The fraction of a covector that must be orthogonal to those before it. A covector with a smaller
/// fraction is their combination up to round-off.
const INDEPENDENT: f64 = 1e-10;

/// `square/w`, where the weight `w = 1/(1 + r)`, `r = (μ/σ)⁴`, fades out a projection off a covector whose
/// independent fraction `σ = √(square/size)` falls below `μ`.
#[inline]
fn faded<D: Scalar>(square: D, size: D, mu: f64) -> D {
    square + square * (size / square * (mu * mu)).powi(2)
}

/// The inner product in which sizes `s` are units: `G(u, v) = Σ u_i v_i / s_i²`. The shortest way to a level of
/// a function is then the one that changes each component by a like fraction of its size, and whether covectors are
/// independent depends on no unit.
#[derive(Clone, Copy, Debug)]
pub struct InUnits<V>(pub V);

impl<V: Column<f64>> InnerProduct<V> for InUnits<V> {
    fn flat(&self, v: &V) -> V {
        V::from_index(|i| v[i] / self.0[i] / self.0[i])
    }

    fn orthonormal(&self, alpha: &V) -> V {
        V::from_index(|i| alpha[i] * self.0[i])
    }

    fn from_orthonormal(&self, a: &V) -> V {
        V::from_index(|i| a[i] * self.0[i])
    }
}

/// Covectors made orthogonal to each other.
#[derive(Clone, Copy, Debug)]
pub struct Orthogonal<N: Dimension, D: Scalar = f64> {
    normals: N::Array<Option<Normal<N, D>>>,
    len: usize,
}

/// A covector made orthogonal, and what projections off it need.
#[derive(Clone, Copy, Debug)]
struct Normal<N: Dimension, D: Scalar> {
    /// The covector `n`.
    n: N::Vector<D>,
    /// The vector `♯n`.
    sharp: N::Vector<D>,
    /// `G*(n, n)`.
    square: D,
    /// `G*(w, w)` of the covector `w` whose orthogonal part is `n`.
    size: D,
}

impl<N: Dimension, D: Scalar> Default for Orthogonal<N, D> {
    fn default() -> Self {
        Self { normals: N::array(|_| None), len: 0 }
    }
}

impl<N: Dimension, D: Scalar> Orthogonal<N, D> {
    /// Returns the number of covectors.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there are no covectors.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a covector, and returns the fraction of it that is orthogonal to those before it. If this fraction
    /// is round-off, the covector is omitted.
    pub fn push(&mut self, g: &impl InnerProduct<N::Vector<D>>, w: &N::Vector<D>) -> f64 {
        let whole = g.orthonormal(w);
        // The second pass removes the rounding error of the first.
        let mut n = *w;
        for _ in 0..2 {
            n = self.project_covector(0, &n);
        }
        let hat = g.orthonormal(&n);
        let size = whole.magnitude();
        let fraction = if size > 0.0 { hat.magnitude() / size } else { 0.0 };
        if fraction > INDEPENDENT && self.len < N::LEN {
            let (square, size) = (hat.dot(&hat), whole.dot(&whole));
            let normal = Normal { n, sharp: g.from_orthonormal(&hat), square, size };
            self.normals[self.len] = Some(normal);
            self.len += 1;
        }
        fraction
    }

    /// Projects a covector: `Pᵀα`, without its parts along the covectors from the `first` on.
    #[inline]
    pub fn project_covector(&self, first: usize, alpha: &N::Vector<D>) -> N::Vector<D> {
        let mut alpha = *alpha;
        for Normal { n, sharp, square, .. } in self.normals.as_ref()[first..].iter().flatten() {
            alpha -= *n * (sharp.dot(&alpha) / *square);
        }
        alpha
    }

    /// Projects a vector: `Pv`, which the covectors from the `first` on annihilate.
    #[inline]
    pub fn project_vector(&self, first: usize, v: &N::Vector<D>) -> N::Vector<D> {
        let mut v = *v;
        for Normal { n, sharp, square, .. } in self.normals.as_ref()[first..].iter().flatten() {
            v -= *sharp * (n.dot(&v) / *square);
        }
        v
    }

    /// [`project_covector`](Self::project_covector) with projections that fade out below the fraction `mu`.
    #[inline]
    pub fn faded_covector(&self, first: usize, alpha: &N::Vector<D>, mu: f64) -> N::Vector<D> {
        let mut alpha = *alpha;
        for Normal { n, sharp, square, size } in self.normals.as_ref()[first..].iter().flatten() {
            alpha -= *n * (sharp.dot(&alpha) / faded(*square, *size, mu));
        }
        alpha
    }

    /// [`project_vector`](Self::project_vector) with projections that fade out below the fraction `mu`.
    #[inline]
    pub fn faded_vector(&self, first: usize, v: &N::Vector<D>, mu: f64) -> N::Vector<D> {
        let mut v = *v;
        for Normal { n, sharp, square, size } in self.normals.as_ref()[first..].iter().flatten() {
            v -= *sharp * (n.dot(&v) / faded(*square, *size, mu));
        }
        v
    }
}

impl<N: Dimension, D: Scalar> Orthogonal<N, D> {
    /// Adds the covector `w`, and returns the vector `v − ⟨w, v⟩ ♯n/G*(n, n)` with the part `n` of `w` that
    /// is orthogonal to the covectors before it: `w` annihilates this vector, and they act on it as on
    /// `v`. Fades out below the fraction `mu`.
    pub fn without(
        &mut self,
        g: &impl InnerProduct<N::Vector<D>>,
        w: &N::Vector<D>,
        v: &N::Vector<D>,
        mu: f64,
    ) -> N::Vector<D> {
        let len = self.len;
        self.push(g, w);
        match self.normals.as_ref().get(len).and_then(Option::as_ref) {
            Some(Normal { sharp, square, size, .. }) => {
                *v - *sharp * (w.dot(v) / faded(*square, *size, mu))
            }
            None => *v,
        }
    }
}

/// [`Orthogonal`] at real points, where every quantity has its derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct OrthogonalJet<N: Dimension> {
    normals: N::Array<Option<NormalJet<N>>>,
    len: usize,
}

#[derive(Clone, Copy, Debug)]
struct NormalJet<N: Dimension> {
    n: WithJacobian<N>,
    sharp: WithJacobian<N>,
    square: Number<N>,
    size: Number<N>,
}

impl<N: Dimension> NormalJet<N> {
    /// [`faded`] with derivatives: with `σ² = square/size` it is
    /// `d(square/w) = (1 − r) d square + 2 r σ² d size`.
    #[inline]
    fn faded(&self, mu: f64) -> Number<N> {
        let fraction = self.square.value / self.size.value;
        let r = (mu * mu / fraction).powi(2);
        Number {
            value: faded(self.square.value, self.size.value, mu),
            slope: self.square.slope * (1.0 - r) + self.size.slope * (2.0 * r * fraction),
        }
    }
}

/// A number, and its derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
struct Number<N: Dimension> {
    value: f64,
    slope: N::Vector<f64>,
}

/// The components of a vector or covector, and their derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct WithJacobian<N: Dimension> {
    /// The components.
    pub value: N::Vector<f64>,
    /// Their derivatives, a column for each direction.
    pub slope: N::Matrix<f64>,
}

impl<N: Dimension> WithJacobian<N> {
    /// `self − along (functional·self) / square`, where the quotient has derivatives too.
    #[inline]
    fn without(&self, along: &Self, functional: &Self, square: &Number<N>) -> Self {
        let Number { value: square, slope } = square;
        let c = functional.value.dot(&self.value) / *square;
        let dc = (functional.slope.transpose_times(&self.value)
            + self.slope.transpose_times(&functional.value)
            - *slope * c)
            * square.recip();
        Self {
            value: self.value - along.value * c,
            slope: self.slope - along.slope * c - N::Matrix::<f64>::outer(&along.value, &dc),
        }
    }
}

impl<N: Dimension> Default for OrthogonalJet<N> {
    fn default() -> Self {
        Self { normals: N::array(|_| None), len: 0 }
    }
}

impl<N: Dimension> OrthogonalJet<N> {
    /// Returns the number of covectors.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there are no covectors.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the factor by which projections amplify round-off, if they fade out below the fraction `mu`:
    /// the sum of `w/σ` over the covectors from the `first` on.
    pub fn amplification(&self, first: usize, mu: f64) -> f64 {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals
            .map(|NormalJet { square, size, .. }| {
                let fraction = (square.value / size.value).sqrt();
                square.value / (faded(square.value, size.value, mu) * fraction)
            })
            .sum()
    }

    /// Returns the absolute terms that the projection of `v` off the covectors from the `first` on subtracts,
    /// if it fades out below the fraction `mu`.
    #[must_use]
    pub fn terms_of_vector(&self, first: usize, v: &N::Vector<f64>, mu: f64) -> N::Vector<f64> {
        self.terms(first, v, mu, |normal| (&normal.n, &normal.sharp))
    }

    /// Projects a covector.
    #[must_use]
    pub fn terms_of_covector(
        &self,
        first: usize,
        alpha: &N::Vector<f64>,
        mu: f64,
    ) -> N::Vector<f64> {
        self.terms(first, alpha, mu, |normal| (&normal.sharp, &normal.n))
    }

    /// `Σ |along_i| Σ_j |functional_j v_j| / square` over the covectors from the `first` on.
    fn terms(
        &self,
        first: usize,
        v: &N::Vector<f64>,
        mu: f64,
        parts: impl Fn(&NormalJet<N>) -> (&WithJacobian<N>, &WithJacobian<N>),
    ) -> N::Vector<f64> {
        let mut terms = N::Vector::<f64>::zero();
        for normal in self.normals.as_ref()[first..].iter().flatten() {
            let (functional, along) = parts(normal);
            let square = faded(normal.square.value, normal.size.value, mu);
            terms += along.value.abs() * (functional.value.abs().dot(&v.abs()) / square);
        }
        terms
    }

    /// Adds a covector. `dg_v(v)` is the derivative of `g v` along the unknown, for a fixed `v`.
    pub fn push(
        &mut self,
        g: &impl InnerProduct<N::Vector<f64>>,
        dg_v: impl Fn(&N::Vector<f64>) -> N::Matrix<f64>,
        w: &WithJacobian<N>,
    ) {
        let whole = g.orthonormal(&w.value);
        let n = self.project_covector(0, &self.project_covector(0, w));
        let hat = g.orthonormal(&n.value);
        if hat.magnitude() > INDEPENDENT * whole.magnitude() && self.len < N::LEN {
            let value = g.from_orthonormal(&hat);
            // g ♯n = n, so g ∂♯n = ∂n − (∂g) ♯n.
            let bend = n.slope - dg_v(&value);
            let slope = N::Matrix::<f64>::from_columns(|k| g.sharp(&bend.column_at(k)));
            let sharp = WithJacobian { value, slope };
            let square = square_jet(g, &dg_v, &n, &hat);
            let size = if self.is_empty() { square } else { square_jet(g, &dg_v, w, &whole) };
            self.normals[self.len] = Some(NormalJet { n, sharp, square, size });
            self.len += 1;
        }
    }

    /// [`Orthogonal::project_covector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn project_covector(&self, first: usize, alpha: &WithJacobian<N>) -> WithJacobian<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*alpha, |alpha, NormalJet { n, sharp, square, .. }| {
            alpha.without(n, sharp, square)
        })
    }

    /// [`Orthogonal::project_vector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn project_vector(&self, first: usize, v: &WithJacobian<N>) -> WithJacobian<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*v, |v, NormalJet { n, sharp, square, .. }| v.without(sharp, n, square))
    }

    /// [`Orthogonal::faded_covector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn faded_covector(
        &self,
        first: usize,
        alpha: &WithJacobian<N>,
        mu: f64,
    ) -> WithJacobian<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*alpha, |alpha, normal| {
            alpha.without(&normal.n, &normal.sharp, &normal.faded(mu))
        })
    }

    /// [`Orthogonal::faded_vector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn faded_vector(&self, first: usize, v: &WithJacobian<N>, mu: f64) -> WithJacobian<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*v, |v, normal| v.without(&normal.sharp, &normal.n, &normal.faded(mu)))
    }

    /// [`Orthogonal::without`] with derivatives.
    #[must_use]
    pub fn without(
        &mut self,
        g: &impl InnerProduct<N::Vector<f64>>,
        dg_v: impl Fn(&N::Vector<f64>) -> N::Matrix<f64>,
        w: &WithJacobian<N>,
        v: &WithJacobian<N>,
        mu: f64,
    ) -> WithJacobian<N> {
        let len = self.len;
        self.push(g, dg_v, w);
        match self.normals.as_ref().get(len).and_then(Option::as_ref) {
            Some(normal) => v.without(&normal.sharp, w, &normal.faded(mu)),
            None => *v,
        }
    }
}

/// The square `G*(n, n)` of a covector with the orthonormal components `hat`, and its derivatives:
/// `∂(n·g⁻¹n) = 2 ♯n·∂n − ♯n·(∂g)♯n`.
#[inline]
fn square_jet<N: Dimension>(
    g: &impl InnerProduct<N::Vector<f64>>,
    dg_v: &impl Fn(&N::Vector<f64>) -> N::Matrix<f64>,
    n: &WithJacobian<N>,
    hat: &N::Vector<f64>,
) -> Number<N> {
    let sharp = g.from_orthonormal(hat);
    let slope = n.slope.transpose_times(&sharp) * 2.0 - dg_v(&sharp).transpose_times(&sharp);
    Number { value: hat.dot(hat), slope }
}
