//! Projections off covectors, one after another, as in [`metriplectic_dynamics::orthogonal`], whose formulas they are: of covectors
//! and vectors in plain numbers, and of these with their derivatives along the unknown of a step.

use smallvec::SmallVec;

use super::algebra::{Matrix, add, dot, magnitude, vector};
use super::metric::{MetricAlong, Units};
use super::parts::WithJacobian;
use crate::numbers::{Lengths, List};
use crate::round_off::bound::INDEPENDENT;

/// `square/w`, where the weight `w = 1/(1 + r)`, `r = (μ/σ)⁴`, fades out a projection off a covector whose independent
/// fraction `σ = √(square/size)` falls below `μ`.
#[inline]
fn faded(square: f64, size: f64, mu: f64) -> f64 {
    square + square * (size / square * (mu * mu)).powi(2)
}

/// A covector made orthogonal, and what projections off it need.
struct Normal<L: Lengths> {
    /// The covector `n`.
    n: L::Vector,
    /// The vector `♯n`.
    sharp: L::Vector,
    /// `G*(n, n)`.
    square: f64,
    /// `G*(w, w)` of the covector `w` whose orthogonal part is `n`.
    size: f64,
}

/// Covectors made orthogonal to each other.
pub(super) struct Orthogonal<L: Lengths>(SmallVec<[Normal<L>; 2]>);

impl<L: Lengths> Orthogonal<L> {
    pub(super) fn none() -> Self {
        Self(SmallVec::new())
    }

    /// Returns the number of covectors.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Adds a covector. If the fraction of it that is orthogonal to those before it is round-off, it is omitted.
    pub(super) fn push(&mut self, g: Units<'_, L>, w: &L::Vector) {
        let whole = g.orthonormal(w);
        // The second pass removes the rounding error of the first.
        let n = self.project_covector(0, &self.project_covector(0, w));
        let hat = g.orthonormal(&n);
        let size = magnitude(&whole);
        let fraction = if size > 0.0 { magnitude(&hat) / size } else { 0.0 };
        if fraction > INDEPENDENT && self.0.len() < w.numbers().len() {
            let (square, size) = (dot(&hat, &hat), dot(&whole, &whole));
            self.0.push(Normal { n, sharp: g.with_components(&hat), square, size });
        }
    }

    /// Projects a covector: `Pᵀα`, without its parts along the covectors from the `first` on.
    #[inline]
    pub(super) fn project_covector(&self, first: usize, alpha: &L::Vector) -> L::Vector {
        let mut alpha = alpha.clone();
        for Normal { n, sharp, square, .. } in &self.0[first..] {
            let c = dot(sharp, &alpha) / *square;
            add(&mut alpha, -c, n);
        }
        alpha
    }

    /// Projects a vector: `Pv`, which the covectors from the `first` on annihilate.
    #[inline]
    pub(super) fn project_vector(&self, first: usize, v: &L::Vector) -> L::Vector {
        let mut v = v.clone();
        for Normal { n, sharp, square, .. } in &self.0[first..] {
            let c = dot(n, &v) / *square;
            add(&mut v, -c, sharp);
        }
        v
    }

    /// [`project_covector`](Self::project_covector) with projections that fade out below the fraction `mu`.
    #[inline]
    pub(super) fn faded_covector(&self, first: usize, alpha: &L::Vector, mu: f64) -> L::Vector {
        let mut alpha = alpha.clone();
        for Normal { n, sharp, square, size } in &self.0[first..] {
            let c = dot(sharp, &alpha) / faded(*square, *size, mu);
            add(&mut alpha, -c, n);
        }
        alpha
    }

    /// [`project_vector`](Self::project_vector) with projections that fade out below the fraction `mu`.
    #[inline]
    pub(super) fn faded_vector(&self, first: usize, v: &L::Vector, mu: f64) -> L::Vector {
        let mut v = v.clone();
        for Normal { n, sharp, square, size } in &self.0[first..] {
            let c = dot(n, &v) / faded(*square, *size, mu);
            add(&mut v, -c, sharp);
        }
        v
    }

    /// Adds the covector `w`, and returns the vector `v − ⟨w, v⟩ ♯n/G*(n, n)` with the part `n` of `w` that is orthogonal to
    /// the covectors before it. Fades out below the fraction `mu`.
    pub(super) fn without(
        &mut self,
        g: Units<'_, L>,
        w: &L::Vector,
        v: L::Vector,
        mu: f64,
    ) -> L::Vector {
        let len = self.0.len();
        self.push(g, w);
        let mut v = v;
        if let Some(Normal { sharp, square, size, .. }) = self.0.get(len) {
            let c = dot(w, &v) / faded(*square, *size, mu);
            add(&mut v, -c, sharp);
        }
        v
    }
}

/// The vector that is projected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    Vector,
    Covector,
}

/// [`Orthogonal`], where every quantity has its derivatives along the unknown of a step.
pub(crate) struct OrthogonalJet<L: Lengths>(SmallVec<[NormalJet<L>; 1]>);

struct NormalJet<L: Lengths> {
    /// The covector `n`.
    n: WithJacobian<L>,
    /// The vector `♯n`, if it is another one.
    sharp: Option<WithJacobian<L>>,
    square: Number<L>,
    size: Number<L>,
}

/// A number, and its derivatives along the unknown of a step.
struct Number<L: Lengths> {
    value: f64,
    slope: L::Vector,
}

impl<L: Lengths> Clone for Number<L> {
    fn clone(&self) -> Self {
        Self { value: self.value, slope: self.slope.clone() }
    }
}

impl<L: Lengths> NormalJet<L> {
    #[inline]
    fn sharp(&self) -> &WithJacobian<L> {
        self.sharp.as_ref().unwrap_or(&self.n)
    }

    /// [`faded`] with derivatives: with `σ² = square/size` it is `d(square/w) = (1 − r) d square + 2 r σ² d size`.
    fn faded(&self, mu: f64) -> Number<L> {
        let Self { square, size, .. } = self;
        let fraction = square.value / size.value;
        let r = (mu * mu / fraction).powi(2);
        let (of_square, of_size) = (1.0 - r, 2.0 * r * fraction);
        let n = square.slope.numbers().len();
        Number {
            value: faded(square.value, size.value, mu),
            slope: vector(n, |i| square.slope[i] * of_square + size.slope[i] * of_size),
        }
    }
}

/// The square of a covector, and its derivatives.
fn square<L: Lengths>(w: &WithJacobian<L>) -> Number<L> {
    let mut slope = w.slope.transpose_times(&w.value);
    slope.numbers_mut().iter_mut().for_each(|slope| *slope *= 2.0);
    Number { value: dot(&w.value, &w.value), slope }
}

/// The square `G*(n, n)` of a covector with this vector `♯n`, and its derivatives: `∂(n·g⁻¹n) = 2 ♯n·∂n − ♯n·(∂g)♯n`.
fn square_in<L: Lengths>(
    g: &MetricAlong<'_, L>,
    n: &WithJacobian<L>,
    sharp: &L::Vector,
) -> Number<L> {
    let (first, second) = (n.slope.transpose_times(sharp), g.of_flat(sharp).transpose_times(sharp));
    let slope = vector(first.numbers().len(), |i| 2.0 * first[i] - second[i]);
    Number { value: dot(sharp, &n.value), slope }
}

/// `v − along (functional·v)/square`, where the quotient has derivatives too.
fn without<L: Lengths>(
    v: WithJacobian<L>,
    along: &WithJacobian<L>,
    functional: &WithJacobian<L>,
    square: &Number<L>,
) -> WithJacobian<L> {
    let c = dot(&functional.value, &v.value) / square.value;
    let reciprocal = square.value.recip();
    let (first, second) =
        (functional.slope.transpose_times(&v.value), v.slope.transpose_times(&functional.value));
    let n = first.numbers().len();
    let dc: L::Vector = vector(n, |i| (first[i] + second[i] - square.slope[i] * c) * reciprocal);
    let WithJacobian { mut value, mut slope, .. } = v;
    add(&mut value, -c, &along.value);
    slope.add(-c, &along.slope);
    slope.add_outer(-1.0, &along.value, &dc);
    WithJacobian::new(value, slope)
}

impl<L: Lengths> OrthogonalJet<L> {
    pub(crate) fn none() -> Self {
        Self(SmallVec::new())
    }

    /// Returns the number of covectors.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the factor by which projections amplify round-off, if they fade out below the fraction `mu`: the sum of `w/σ`
    /// over the covectors from the `first` on.
    pub(super) fn amplification(&self, first: usize, mu: f64) -> f64 {
        let normals = self.0[first..].iter();
        normals
            .map(|NormalJet { square, size, .. }| {
                let fraction = (square.value / size.value).sqrt();
                square.value / (faded(square.value, size.value, mu) * fraction)
            })
            .sum()
    }

    /// Adds to `terms` the absolute terms that the projection of a vector, or of a covector, off the covectors from the `first` on
    /// subtracts, if it fades out below the fraction `mu`, times a factor.
    pub(super) fn add_terms(
        &self,
        first: usize,
        (v, of): (&L::Vector, Of),
        mu: f64,
        (terms, factor): (&mut L::Vector, f64),
    ) {
        for normal in &self.0[first..] {
            let NormalJet { n, square, size, .. } = normal;
            let [functional, along] = match of {
                Of::Vector => [n, normal.sharp()],
                Of::Covector => [normal.sharp(), n],
            };
            let square = faded(square.value, size.value, mu);
            let pairs = functional.value.numbers().iter().zip(v.numbers());
            let c = pairs.fold(0.0, |sum, (n, v)| sum + n.abs() * v.abs()) / square;
            let to = terms.numbers_mut().iter_mut().zip(along.value.numbers());
            to.for_each(|(to, n)| *to += n.abs() * c * factor);
        }
    }

    /// Adds a covector, in the canonical metric.
    pub(crate) fn push(&mut self, w: &WithJacobian<L>) {
        let n = self.twice(w);
        let most = w.value.numbers().len();
        if magnitude(&n.value) > INDEPENDENT * magnitude(&w.value) && self.0.len() < most {
            let of_n = square(&n);
            let size = if self.0.is_empty() { of_n.clone() } else { square(w) };
            self.0.push(NormalJet { n, sharp: None, square: of_n, size });
        }
    }

    /// Adds a covector, in a metric; without one it is the canonical.
    pub(super) fn push_in(&mut self, g: Option<&MetricAlong<'_, L>>, w: &WithJacobian<L>) {
        let Some(g) = g else { return self.push(w) };
        let n = self.twice(w);
        let [hat, whole] = [&n, w].map(|w| g.factored.orthonormal(&w.value));
        let most = w.value.numbers().len();
        if magnitude(&hat) > INDEPENDENT * magnitude(&whole) && self.0.len() < most {
            let value = g.factored.with_components(&hat);
            // g ♯n = n, so g ∂♯n = ∂n − (∂g) ♯n.
            let mut bend = n.slope.clone();
            bend.add(-1.0, &g.of_flat(&value));
            let slope = bend.map_columns(|column| g.factored.sharp(column));
            let of_n = square_in(g, &n, &value);
            let size = if self.0.is_empty() {
                of_n.clone()
            } else {
                square_in(g, w, &g.factored.with_components(&whole))
            };
            let sharp = Some(WithJacobian::new(value, slope));
            self.0.push(NormalJet { n, sharp, square: of_n, size });
        }
    }

    /// Projects a covector. The second pass removes the rounding error of the first.
    fn twice(&self, w: &WithJacobian<L>) -> WithJacobian<L> {
        if self.0.is_empty() { w.clone() } else { self.covector(0, self.covector(0, w.clone())) }
    }

    /// Projects a vector off the covectors from the `first` on.
    pub(crate) fn vector(&self, first: usize, v: WithJacobian<L>) -> WithJacobian<L> {
        let normals = self.0[first..].iter();
        normals.fold(v, |v, normal| without(v, normal.sharp(), &normal.n, &normal.square))
    }

    /// Projects a covector.
    pub(crate) fn covector(&self, first: usize, w: WithJacobian<L>) -> WithJacobian<L> {
        let normals = self.0[first..].iter();
        normals.fold(w, |w, normal| without(w, &normal.n, normal.sharp(), &normal.square))
    }

    /// [`vector`](Self::vector) or [`covector`](Self::covector) with projections that fade out below the fraction `mu`.
    pub(super) fn faded(
        &self,
        first: usize,
        (v, of): (WithJacobian<L>, Of),
        mu: f64,
    ) -> WithJacobian<L> {
        let normals = self.0[first..].iter();
        normals.fold(v, |v, normal| {
            let [along, functional] = match of {
                Of::Vector => [normal.sharp(), &normal.n],
                Of::Covector => [&normal.n, normal.sharp()],
            };
            without(v, along, functional, &normal.faded(mu))
        })
    }

    /// [`Orthogonal::without`] with derivatives.
    pub(super) fn without(
        &mut self,
        g: Option<&MetricAlong<'_, L>>,
        w: &WithJacobian<L>,
        v: WithJacobian<L>,
        mu: f64,
    ) -> WithJacobian<L> {
        let len = self.0.len();
        self.push_in(g, w);
        match self.0.get(len) {
            Some(normal) => without(v, normal.sharp(), w, &normal.faded(mu)),
            None => v,
        }
    }
}

/// The sum of a matrix times a multiple of the identity, `c A`.
pub(super) fn scaled<L: Lengths>(a: Matrix<L>, c: f64) -> Matrix<L> {
    a.map(|a| a * c)
}
