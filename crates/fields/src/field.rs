//! Smooth functions on a manifold: scalar fields (energy, entropy) and matrix fields (metric,
//! Poisson tensor).

use crate::{
    ChartPoint, Column, Dimension, Evaluation, Form, Matrix, Real, Scalar, Space, Square, Vector,
};

/// A smooth function `f: M → R`.
///
/// Every closure `Fn(&M::Point<Real>) -> Real` implements it. To evaluate a type at each scalar directly,
/// implement the one method [`at`](Self::at):
///
/// ```
/// # use metriplectic_fields::{Scalar, ScalarField};
/// # use metriplectic_manifolds::LieDual;
/// # use nalgebra::SVector;
/// struct KineticEnergy { inertia: [f64; 3] }
///
/// impl ScalarField<LieDual<3>> for KineticEnergy {
///     fn at<D: Scalar>(&self, p: &SVector<D, 3>) -> D {
///         let term = |i: usize| p[i] * p[i] * (0.5 / self.inertia[i]);
///         term(0) + term(1) + term(2)
///     }
/// }
/// ```
///
/// Laws ([`laws::scalar_field`](crate::laws::scalar_field)): 1. `jet1` and `jet2` agree with `at`;
/// 2. `f(φ(tv)) − f − t df·v` falls like `t²`; 3. with the Hessian term, like `t³`; 4. `differential_at` and
/// `hessian_at` agree with `at` off the centre of the chart.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a scalar field on `{M}`",
    label = "expected a function of one point that returns one number",
    note = "a closure takes a point over `Real` and returns a `Real`: `|p: &Vector3<Real>| p.norm_squared() * 0.5`",
    note = "a type of your own implements `ScalarField` with the generic method `at`"
)]
pub trait ScalarField<M: Space> {
    /// Says whether the field is constant by construction, so that its differential is zero. A system whose entropy is
    /// constant has no friction, and does not evaluate its dissipation.
    const IS_CONSTANT: bool = false;

    /// Evaluates `f(x)` at any scalar.
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D;

    /// Says what the derivatives come from, and tries to record a function that is written to be recorded.
    fn evaluation(&self, x: &M::Point<f64>) -> Evaluation {
        let _ = x;
        Evaluation::Function
    }

    /// Evaluates `f(x)` at the scalar of closures, at which a closure needs no lift.
    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        self.at(x)
    }

    /// Computes value and differential at a real point, in `⌈n/2⌉` evaluations.
    #[inline]
    fn jet1(&self, x: &M::Point<f64>) -> Jet1<M> {
        let n = M::Dim::LEN;
        let mut value = f64::NAN;
        let mut df = Vector::<M>::zero();
        let seeded = M::seeds(x);
        for i in (0..n).step_by(2) {
            let f = self.at_real(&seeded(i, i + 1));
            value = f.re;
            df[i] = f.eps1;
            if i + 1 < n {
                df[i + 1] = f.eps2;
            }
        }
        Jet1 { value, df }
    }

    /// Computes value, differential and Hessian at a real point, in `n(n+1)/2` evaluations.
    #[inline]
    fn jet2(&self, x: &M::Point<f64>) -> Jet2<M> {
        let mut value = f64::NAN;
        let mut df = Vector::<M>::zero();
        let mut hf = Matrix::<M>::zeros();
        let seeded = M::seeds(x);
        for i in 0..M::Dim::LEN {
            for j in i..M::Dim::LEN {
                let f = self.at_real(&seeded(i, j));
                value = f.re;
                df[i] = f.eps1;
                hf[(i, j)] = f.eps1eps2;
                hf[(j, i)] = f.eps1eps2;
            }
        }
        Jet2 { value, df, hf }
    }

    /// Computes the differential at the real coordinates `q` in the frame of the chart at `x`, which need not be its
    /// centre, in `⌈n/2⌉` evaluations.
    #[inline]
    fn differential_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Vector<M> {
        let n = M::Dim::LEN;
        let mut df = Vector::<M>::zero();
        for i in (0..n).step_by(2) {
            let f = self.at_real(&seeded::<M>(x, q, i, i + 1));
            df[i] = f.eps1;
            if i + 1 < n {
                df[i + 1] = f.eps2;
            }
        }
        df
    }

    /// Computes the Hessian at the real coordinates `q` of the chart at `x`, which need not be its centre, in `n(n+1)/2`
    /// evaluations.
    #[inline]
    fn hessian_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Matrix<M> {
        let mut hf = Matrix::<M>::zeros();
        for i in 0..M::Dim::LEN {
            for j in i..M::Dim::LEN {
                hf[(i, j)] = self.at_real(&seeded::<M>(x, q, i, j)).eps1eps2;
                hf[(j, i)] = hf[(i, j)];
            }
        }
        hf
    }
}

/// The point `φ_x(q + ε₁ e_i + ε₂ e_j)`. An index beyond the dimension seeds nothing.
#[inline]
pub fn seeded<M: Space>(x: &M::Point<f64>, q: &Vector<M>, i: usize, j: usize) -> M::Point<Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    let seed = |k| Real::new(q[k], part(k, i), part(k, j), 0.0);
    M::chart(x, &Vector::<M, Real>::from_index(seed))
}

/// A number is the constant field with this value.
#[diagnostic::do_not_recommend]
impl<M: Space> ScalarField<M> for f64 {
    const IS_CONSTANT: bool = true;

    #[inline]
    fn at<D: Scalar>(&self, _: &M::Point<D>) -> D {
        D::from(*self)
    }

    #[inline]
    fn jet1(&self, _: &M::Point<f64>) -> Jet1<M> {
        Jet1 { value: *self, df: Vector::<M>::zero() }
    }

    #[inline]
    fn jet2(&self, _: &M::Point<f64>) -> Jet2<M> {
        Jet2 { value: *self, df: Vector::<M>::zero(), hf: Matrix::<M>::zeros() }
    }

    #[inline]
    fn differential_at(&self, _: &M::Point<f64>, _: &Vector<M>) -> Vector<M> {
        Vector::<M>::zero()
    }

    #[inline]
    fn hessian_at(&self, _: &M::Point<f64>, _: &Vector<M>) -> Matrix<M> {
        Matrix::<M>::zeros()
    }
}

/// `f(x)` and `df(x)` in the coordinate frame of the chart at `x`.
#[derive(Debug)]
pub struct Jet1<M: Space> {
    /// The value.
    pub value: f64,
    /// The differential `∂f/∂qⁱ`.
    pub df: Vector<M>,
}

// By hand, because a derive would require `M: Copy`.
impl<M: Space> Clone for Jet1<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Space> Copy for Jet1<M> {}

impl<M: Space> Clone for Jet2<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M: Space> Copy for Jet2<M> {}

impl<M: Space> Jet1<M> {
    /// Returns whether value and differential are finite.
    pub fn is_finite(&self) -> bool {
        self.value.is_finite() && self.df.is_finite()
    }
}

/// `f(x)`, `df(x)` and the Hessian in the coordinates of the chart at `x`.
#[derive(Debug)]
pub struct Jet2<M: Space> {
    /// The value.
    pub value: f64,
    /// The differential `∂f/∂qⁱ`.
    pub df: Vector<M>,
    /// The matrix `∂²f/∂qⁱ∂qʲ`.
    pub hf: Matrix<M>,
}

impl<M: Space> Jet2<M> {
    /// Returns whether value, differential and Hessian are finite.
    pub fn is_finite(&self) -> bool {
        self.value.is_finite() && self.df.is_finite() && self.hf.max_abs().is_finite()
    }
}

/// A smooth field of square matrices on `M`: a metric `g` that acts on velocities, a Poisson tensor
/// `Π` that acts on covectors dual to them. Velocities are those of [`Space::embed`]: components
/// on a vector space, entries of `x'` on a sphere, the body angular velocity on SO(3).
///
/// Every closure `Fn(&M::Point<Real>) -> Form<M, Real>` implements it. Another type implements the one
/// method [`at`](Self::at).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a matrix field on `{M}`",
    label = "expected a function of one point that returns one square matrix",
    note = "a closure takes a point over `Real` and returns a matrix over `Real`: `|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2))`",
    note = "a type of your own implements `MatrixField` with the generic method `at`"
)]
pub trait MatrixField<M: Space> {
    /// Says whether the field is evaluated from a recording.
    const IS_RECORDED: bool = false;

    /// Evaluates the matrix at `x`, at any scalar.
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Form<M, D>;

    /// Evaluates the matrix at the scalar of closures, at which a closure needs no lift.
    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Form<M, Real> {
        self.at(x)
    }

    /// Computes a metric in the frame of the chart at a real point, with its first derivatives along the
    /// chart, in `⌈n/2⌉` evaluations.
    fn covariant_jet(&self, x: &M::Point<f64>) -> MatrixJet<M> {
        let seeded = M::seeds(x);
        M::covariant_jet(x, &Vector::<M>::zero(), |i, j| self.at_real(&seeded(i, j)))
    }

    /// Computes a Poisson tensor in the frame of the chart at a real point, with its first derivatives along
    /// the chart, in `⌈n/2⌉` evaluations.
    fn contravariant_jet(&self, x: &M::Point<f64>) -> MatrixJet<M> {
        let seeded = M::seeds(x);
        MatrixJet::new(|i, j| {
            let tensor = M::contravariant(&seeds(x, i, j), &self.at_real(&seeded(i, j)));
            // A chart has a frame at its own centre.
            tensor.unwrap_or_else(Matrix::<M, Real>::zeros)
        })
    }
}

/// A matrix and its derivatives `∂A/∂qᵏ` along the chart at a real point.
#[derive(Clone, Copy, Debug)]
pub struct MatrixJet<M: Space> {
    /// The matrix `A`.
    pub value: Matrix<M>,
    /// Its derivative along each chart direction.
    pub slopes: <M::Dim as Dimension>::Array<Matrix<M>>,
}

impl<M: Space> MatrixJet<M> {
    /// The jet of a matrix that `seeded(i, j)` gives with the derivatives along the chart directions
    /// `i` and `j`, in `⌈n/2⌉` evaluations.
    pub fn new(seeded: impl Fn(usize, usize) -> Matrix<M, Real>) -> Self {
        let part = |a: &Matrix<M, Real>, pick: fn(&Real) -> f64| {
            Matrix::<M>::from_entries(|i, j| pick(&a[(i, j)]))
        };
        let mut last = seeded(0, 1);
        let value = part(&last, |a| a.re);
        let slopes = M::Dim::array(|k| {
            if k > 0 && k % 2 == 0 {
                last = seeded(k, k + 1);
            }
            part(&last, if k % 2 == 0 { |a| a.eps1 } else { |a| a.eps2 })
        });
        Self { value, slopes }
    }
}

/// The matrix with the columns `(∂_k A) v`, the derivative of `A v` along the chart, from the
/// `slopes` of `A`.
#[inline]
pub fn along_slopes<M: Space>(
    slopes: &<M::Dim as Dimension>::Array<Matrix<M>>,
    v: &Vector<M>,
) -> Matrix<M> {
    Matrix::<M>::from_columns(|k| slopes[k] * *v)
}

/// The centre of the chart at `x` with seeds along the directions `i` and `j`.
fn seeds<M: Space>(x: &M::Point<f64>, i: usize, j: usize) -> ChartPoint<M, Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    let q = Vector::<M, Real>::from_index(|k| Real::new(0.0, part(k, i), part(k, j), 0.0));
    ChartPoint { base: x.clone(), q }
}
