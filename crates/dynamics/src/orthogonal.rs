//! Projections off covectors, one after another.
//!
//! A tensor is made to kill a covector `w` by the projections
//!
//! ```math
//! P^T\alpha = \alpha - \frac{G^*(w,\alpha)}{G^*(w,w)}\, w, \qquad
//! P\,v = v - \frac{\langle w, v\rangle}{G^*(w,w)}\, \sharp w ,
//! ```
//!
//! of covectors and of vectors: `⟨w, Pv⟩ = 0`. Several covectors are first made orthogonal to each
//! other by Gram and Schmidt, which is the inverse `C^{ab}` of their Gram matrix in the remark of
//! Bloch, Farré Puiggalí, Martín de Diego (2024, §2.2), without forming it: a covector that depends
//! on those before it is found by what is left of it, and left out.

use metriplectic_fields::{Column, Dimension, Scalar, Square};
use metriplectic_manifolds::InnerProduct;

/// The share of a covector that has to be left after those before it are taken out of it; below, it
/// is their combination up to round-off.
const INDEPENDENT: f64 = 1e-10;

/// The independent share of a momentum's covector at which it starts to be left out.
///
/// Where the covectors are dependent, at a relative equilibrium, the projection off all of them jumps,
/// and nearby it amplifies round-off by the reciprocal of the share `σ`. There the momentum is kept
/// without it: it is a function of the others to first order, so a step that keeps the others changes it
/// by no more than the order of `h³σ`.
const SOFT: f64 = 1e-6;

/// The weight of a projection off a momentum's covector with the independent share `σ`.
fn weight(share: f64) -> f64 {
    (1.0 + (SOFT / share).powi(4)).recip()
}

/// Covectors made orthogonal to each other.
#[derive(Clone, Copy, Debug)]
pub struct Orthogonal<N: Dimension, D: Scalar = f64> {
    normals: N::Array<Option<Normal<N, D>>>,
    len: usize,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
struct Normal<N: Dimension, D: Scalar> {
    /// The covector `n`.
    n: N::Vector<D>,
    /// The vector `♯n`.
    sharp: N::Vector<D>,
    /// `G*(n, n)`.
    square: D,
    /// The share that it is of the covector it was made of.
    share: f64,
}

impl<N: Dimension, D: Scalar> Default for Orthogonal<N, D> {
    fn default() -> Self {
        Self { normals: N::array(|_| None), len: 0 }
    }
}

impl<N: Dimension, D: Scalar> Orthogonal<N, D> {
    /// The number of covectors.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a covector, and gives the share of it that is orthogonal to those before it. It is left
    /// out if this is round-off.
    pub fn push(&mut self, g: &impl InnerProduct<N::Vector<D>>, w: &N::Vector<D>) -> f64 {
        let size = g.orthonormal(w).magnitude();
        // A second pass takes out what the rounding of the first has left.
        let mut n = *w;
        for _ in 0..2 {
            n = self.off_covector(0, &n);
        }
        let hat = g.orthonormal(&n);
        let share = if size > 0.0 { hat.magnitude() / size } else { 0.0 };
        if share > INDEPENDENT && self.len < N::LEN {
            let normal = Normal { n, sharp: g.raise(&hat), square: hat.dot(&hat), share };
            self.normals[self.len] = Some(normal);
            self.len += 1;
        }
        share
    }

    /// The covector `Pᵀα` without its parts along the covectors from the `first` on.
    #[inline]
    pub fn off_covector(&self, first: usize, alpha: &N::Vector<D>) -> N::Vector<D> {
        let mut alpha = *alpha;
        for Normal { n, sharp, square, .. } in self.normals.as_ref()[first..].iter().flatten() {
            alpha -= *n * (sharp.dot(&alpha) / *square);
        }
        alpha
    }

    /// The vector `Pv` that the covectors from the `first` on kill.
    #[inline]
    pub fn off_vector(&self, first: usize, v: &N::Vector<D>) -> N::Vector<D> {
        let mut v = *v;
        for Normal { n, sharp, square, .. } in self.normals.as_ref()[first..].iter().flatten() {
            v -= *sharp * (n.dot(&v) / *square);
        }
        v
    }

    /// The same for momenta: a projection off a covector that is nearly dependent on those before it
    /// fades out.
    #[inline]
    pub fn off_momenta(&self, first: usize, v: &N::Vector<D>) -> N::Vector<D> {
        let mut v = *v;
        for Normal { n, sharp, square, share } in self.normals.as_ref()[first..].iter().flatten() {
            v -= *sharp * (n.dot(&v) / *square * weight(*share));
        }
        v
    }
}

/// The same at real points, with the derivatives along the unknown of a step: every quantity comes
/// with the matrix of its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct OrthogonalJet<N: Dimension> {
    normals: N::Array<Option<NormalJet<N>>>,
    len: usize,
    amplification: f64,
}

#[derive(Clone, Copy, Debug)]
struct NormalJet<N: Dimension> {
    n: Moving<N>,
    sharp: Moving<N>,
    square: f64,
    slope: N::Vector<f64>,
    share: f64,
}

/// The components of a vector or covector, and their derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct Moving<N: Dimension> {
    /// The components.
    pub value: N::Vector<f64>,
    /// Their derivatives, a column for each direction.
    pub slope: N::Matrix<f64>,
}

impl<N: Dimension> Moving<N> {
    /// `self − weight along (functional·self) / square`, where the quotient has derivatives too.
    #[inline]
    fn without(
        &self,
        (along, weight): (&Self, f64),
        functional: &Self,
        square: f64,
        slope: &N::Vector<f64>,
    ) -> Self {
        let square = square / weight;
        let slope = *slope * weight.recip();
        let c = functional.value.dot(&self.value) / square;
        let dc = (functional.slope.transpose_times(&self.value)
            + self.slope.transpose_times(&functional.value)
            - slope * c)
            * square.recip();
        Self {
            value: self.value - along.value * c,
            slope: self.slope - along.slope * c - N::Matrix::<f64>::outer(&along.value, &dc),
        }
    }
}

impl<N: Dimension> Default for OrthogonalJet<N> {
    fn default() -> Self {
        Self { normals: N::array(|_| None), len: 0, amplification: 0.0 }
    }
}

impl<N: Dimension> OrthogonalJet<N> {
    /// The number of covectors.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// By how much projections amplify round-off: the sum of the reciprocal shares of the covectors
    /// that are independent of those before them.
    pub const fn amplification(&self) -> f64 {
        self.amplification
    }

    /// Adds a covector; `turned(v)` is the derivative of `g v` along the unknown, for a fixed `v`.
    pub fn push(
        &mut self,
        g: &impl InnerProduct<N::Vector<f64>>,
        turned: impl Fn(&N::Vector<f64>) -> N::Matrix<f64>,
        w: &Moving<N>,
    ) {
        let size = g.orthonormal(&w.value).magnitude();
        let n = self.off_covector(0, &self.off_covector(0, w));
        let hat = g.orthonormal(&n.value);
        if hat.magnitude() > INDEPENDENT * size && self.len < N::LEN {
            let value = g.raise(&hat);
            // g ♯n = n, so g ∂♯n = ∂n − (∂g) ♯n.
            let bend = n.slope - turned(&value);
            let slope = N::Matrix::<f64>::from_columns(|k| g.sharp(&bend.column_at(k)));
            let sharp = Moving { value, slope };
            let slope = slope.transpose_times(&n.value) + n.slope.transpose_times(&value);
            let share = hat.magnitude() / size;
            let normal = NormalJet { n, sharp, square: hat.dot(&hat), slope, share };
            self.normals[self.len] = Some(normal);
            self.len += 1;
            self.amplification += weight(share) / share;
        }
    }

    /// [`Orthogonal::off_covector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn off_covector(&self, first: usize, alpha: &Moving<N>) -> Moving<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*alpha, |alpha, NormalJet { n, sharp, square, slope, .. }| {
            alpha.without((n, 1.0), sharp, *square, slope)
        })
    }

    /// [`Orthogonal::off_vector`] with derivatives.
    #[inline]
    #[must_use]
    pub fn off_vector(&self, first: usize, v: &Moving<N>) -> Moving<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*v, |v, NormalJet { n, sharp, square, slope, .. }| {
            v.without((sharp, 1.0), n, *square, slope)
        })
    }
    /// [`Orthogonal::off_momenta`] with derivatives, for weights that stay what they are.
    #[inline]
    #[must_use]
    pub fn off_momenta(&self, first: usize, v: &Moving<N>) -> Moving<N> {
        let normals = self.normals.as_ref()[first..].iter().flatten();
        normals.fold(*v, |v, NormalJet { n, sharp, square, slope, share }| {
            v.without((sharp, weight(*share)), n, *square, slope)
        })
    }
}
