//! Poisson brackets: the skew tensor `Π` that turns a differential into a velocity.

mod constant;
mod field;
mod force;
mod lie_poisson;
mod nambu;
mod product;
mod scaled;
mod symplectic;
mod zero;

pub use constant::ConstantPoisson;
pub use field::FieldPoisson;
pub use force::{Force, ForcedLiePoisson};
pub use lie_poisson::LiePoisson;
pub use nambu::{AreaForm, Casimirs, Nambu, NoCasimir, OfEntropy, Rows};
pub use symplectic::{EvenDimension, Symplectic};
pub use zero::Zero;

use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Scalar, Space, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};
use nalgebra::SMatrix;
use num_dual::Dual64;

/// The arguments of a bracket: the point, and the parts of the system that it may use.
#[derive(Debug)]
pub struct BracketArgs<'a, M: Manifold, G: Riemannian<M>, D: Scalar = f64> {
    /// The manifold.
    pub space: &'a M,
    /// The point `g.x` with the metric there, whose volume form the Nambu brackets need.
    pub g: &'a MetricAt<'a, M, G, D>,
    /// The covector of the entropy there: `dS`, or a discrete gradient of `S`. Only brackets that are
    /// built from their Casimir use it.
    pub s: &'a Vector<M, D>,
}

/// A Poisson tensor `Π`, acting on covectors: `{f, g} = Π(df, dg)`, `x' = Π dH`.
///
/// An implementation writes one method, [`apply`](Self::apply), at any scalar.
///
/// Laws ([`laws::bracket`](crate::laws::bracket)): 1. `Π` is skew; 2. Jacobi identity
/// `Π^{il}∂_lΠ^{jk} + cyclic = 0`, unless [`is_poisson`](Self::is_poisson) says otherwise;
/// 3. `linearise` is the derivative of `apply`; 4. `Π α` is linear in `α`; 5. `⟨w, force(w)⟩ = 0`,
/// and `linearise_force` is the derivative of `force`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a bracket on `{M}`",
    note = "a Poisson tensor of your own is `Poisson::field(|x| matrix)` or `Poisson::constant(matrix)?`"
)]
pub trait Bracket<M: Manifold, G: Riemannian<M>> {
    /// Says whether the tensor is evaluated from a recording.
    const IS_RECORDED: bool = false;

    /// Computes the vector `Π(x) α`, with components in the frame of the chart of `x`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the bracket needs the metric and it cannot be used at `x`.
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError>;

    /// Computes `Πα` at the centre of a chart, with its derivatives along the point, along the covector of
    /// the entropy, and along `α`.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        by_dual_numbers(self, at, alpha)
    }

    /// Computes the matrix `Π(x)`.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn tensor<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError> {
        let mut tensor = Matrix::<M, D>::zeros();
        for j in 0..M::Dim::LEN {
            let column = self.apply(at, &Vector::<M, D>::basis(j))?;
            for i in 0..M::Dim::LEN {
                tensor[(i, j)] = column[i];
            }
        }
        Ok(tensor)
    }

    /// Returns whether `Π` satisfies the Jacobi identity. A skew tensor that violates it is an almost Poisson
    /// tensor ([`AlmostPoisson`]). It conserves the energy, so verification accepts it.
    fn is_poisson(&self) -> bool {
        true
    }

    /// Returns whether there is a [`force`](Self::force).
    fn is_forced(&self) -> bool {
        false
    }

    /// Computes the vector that a force adds to `Πw + K_w dS`, for the covector `w` of the energy. `w`
    /// annihilates this vector, as it annihilates `Πw`. The vector need not be linear in `w`. It is zero unless
    /// [`is_forced`](Self::is_forced). [`ForcedLiePoisson`] has a force.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn force<D: Scalar>(
        &self,
        _at: &BracketArgs<'_, M, G, D>,
        _w: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(Vector::<M, D>::zero())
    }

    /// Computes the force at the centre of a chart, with its derivatives along the point and along the covector
    /// of the entropy. The derivative along `w` takes the place of the tensor.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn linearise_force(
        &self,
        at: &BracketArgs<'_, M, G>,
        w: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        force_by_dual_numbers(self, at, w)
    }

    /// Returns whether the bracket is zero by construction, so that nothing moves reversibly.
    fn is_zero(&self) -> bool {
        false
    }

    /// Returns whether `Π` is built from the covector of the entropy in [`BracketArgs`] and annihilates every
    /// such covector. It then also annihilates a discrete gradient of the entropy.
    fn annihilates_entropy(&self) -> bool {
        self.is_zero()
    }
}

/// The definition of [`Bracket::linearise`]: one dual number for each direction.
pub(crate) fn by_dual_numbers<M: Manifold, G: Riemannian<M>>(
    bracket: &(impl Bracket<M, G> + ?Sized),
    at: &BracketArgs<'_, M, G>,
    alpha: &Vector<M>,
) -> Result<BracketJet<M>, MetricError> {
    let zero = Matrix::<M>::zeros();
    let value = bracket.apply(at, alpha)?;
    let mut jet =
        BracketJet::<M> { value, along_z: zero, along_s: zero, tensor: bracket.tensor(at)? };
    let (s, alpha) = (Vector::<M, Dual64>::embed(at.s), Vector::<M, Dual64>::embed(alpha));
    let &BracketArgs { space, g: &MetricAt { metric, x, .. }, .. } = at;
    let still = ChartPoint::centre(&x.base);
    let still = MetricAt::new(metric, &still);
    for k in 0..M::Dim::LEN {
        let e = epsilon::<M>(k);
        let moved = ChartPoint { base: x.base.clone(), q: e };
        let moved = MetricAt::new(metric, &moved);
        let along_z = bracket.apply(&BracketArgs { space, g: &moved, s: &s }, &alpha)?;
        let along_s = bracket.apply(&BracketArgs { space, g: &still, s: &(s + e) }, &alpha)?;
        for i in 0..M::Dim::LEN {
            jet.along_z[(i, k)] = along_z[i].eps;
            jet.along_s[(i, k)] = along_s[i].eps;
        }
    }
    Ok(jet)
}

/// The definition of [`Bracket::linearise_force`]: one dual number for each direction.
pub(crate) fn force_by_dual_numbers<M: Manifold, G: Riemannian<M>>(
    bracket: &(impl Bracket<M, G> + ?Sized),
    at: &BracketArgs<'_, M, G>,
    w: &Vector<M>,
) -> Result<BracketJet<M>, MetricError> {
    let zero = Matrix::<M>::zeros();
    let value = bracket.force(at, w)?;
    let mut jet = BracketJet::<M> { value, along_z: zero, along_s: zero, tensor: zero };
    let (s, w) = (Vector::<M, Dual64>::embed(at.s), Vector::<M, Dual64>::embed(w));
    let &BracketArgs { space, g: &MetricAt { metric, x, .. }, .. } = at;
    let still = ChartPoint::centre(&x.base);
    let still = MetricAt::new(metric, &still);
    for k in 0..M::Dim::LEN {
        let e = epsilon::<M>(k);
        let moved = ChartPoint { base: x.base.clone(), q: e };
        let moved = MetricAt::new(metric, &moved);
        let along_z = bracket.force(&BracketArgs { space, g: &moved, s: &s }, &w)?;
        let along_s = bracket.force(&BracketArgs { space, g: &still, s: &(s + e) }, &w)?;
        let along_w = bracket.force(&BracketArgs { space, g: &still, s: &s }, &(w + e))?;
        for i in 0..M::Dim::LEN {
            jet.along_z[(i, k)] = along_z[i].eps;
            jet.along_s[(i, k)] = along_s[i].eps;
            jet.tensor[(i, k)] = along_w[i].eps;
        }
    }
    Ok(jet)
}

/// Chart coordinates `ε e_k`.
pub(crate) fn epsilon<M: Space>(k: usize) -> Vector<M, Dual64> {
    Vector::<M, Dual64>::from_index(|i| Dual64::new(0.0, if i == k { 1.0 } else { 0.0 }))
}

/// `Πα` at a real point, with its derivatives.
#[derive(Clone, Debug)]
pub struct BracketJet<M: Manifold> {
    /// The vector `Πα`.
    pub value: Vector<M>,
    /// `∂(Πα)/∂z` in the chart at `z`.
    pub along_z: Matrix<M>,
    /// `∂(Πα)/∂s`, along the covector of the entropy.
    pub along_s: Matrix<M>,
    /// `∂(Πα)/∂α`, the tensor itself.
    pub tensor: Matrix<M>,
}

/// A manifold that comes with a bracket. The others start from [`Zero`].
#[diagnostic::on_unimplemented(
    message = "a system on `{Self}` has no bracket to start from",
    note = "a manifold of your own implements `NaturalBracket`, with `Zero` if no bracket comes with it"
)]
pub trait NaturalBracket: Manifold {
    /// The bracket of a system that is given no other.
    type Bracket;

    /// Returns this bracket.
    fn natural_bracket(&self) -> Self::Bracket;
}

/// Poisson tensors of your own.
#[derive(Clone, Copy, Debug)]
pub enum Poisson {}

impl Poisson {
    /// A skew matrix that is constant, as in canonical coordinates.
    ///
    /// ```
    /// use metriplectic_dynamics::Poisson;
    /// use nalgebra::Matrix2;
    /// assert!(Poisson::constant(Matrix2::new(0.0, 1.0, -1.0, 0.0)).is_ok());
    /// assert!(Poisson::constant(Matrix2::new(0.0, 1.0, 1.0, 0.0)).is_err());
    /// ```
    ///
    /// # Errors
    ///
    /// [`PoissonError`] if the matrix is not finite or not skew.
    pub fn constant<const N: usize>(
        tensor: SMatrix<f64, N, N>,
    ) -> Result<ConstantPoisson<N>, PoissonError> {
        ConstantPoisson::new(tensor)
    }

    /// The tensor `Π(x)` from a closure or any other
    /// [`MatrixField`](metriplectic_fields::MatrixField), acting on covectors dual to the
    /// [`velocity`](metriplectic_fields::Space::embed) of the space. Verification checks at sampled
    /// points that it is skew and satisfies the Jacobi identity. [`AlmostPoisson::field`] need not satisfy it.
    ///
    /// On a sphere the matrix is a bivector of the space around, `x' = A ∇H`; on S²,
    /// `|x: &Vector3<Real>| x.cross_matrix()` is the area form. On SO(3) it acts on body covectors and gives `Ω`.
    pub const fn field<F>(field: F) -> FieldPoisson<F> {
        FieldPoisson::new(field)
    }
}

/// Skew tensors of your own that need not be Poisson, as those of nonholonomic systems are not.
///
/// Skewness alone conserves the energy. Verification does not require the Jacobi identity, and a
/// [`report`](crate::Verify::report) prints its defect without a verdict.
#[derive(Clone, Copy, Debug)]
pub enum AlmostPoisson {}

impl AlmostPoisson {
    /// The tensor of [`Poisson::field`], without the Jacobi identity: an almost Poisson bracket (van der
    /// Schaft and Maschke 1994; Cantrijn, de León and Martín de Diego 1999).
    ///
    /// A blade on the plane that does not slip sideways, at `(x, y)` with the direction `θ`, the momentum
    /// `p` along the blade, and the momentum `l` about it, is turned but not moved by a bracket with
    /// `{x, p} = cos θ`, `{y, p} = sin θ`, `{θ, l} = 1`:
    ///
    /// ```
    /// use metriplectic_dynamics::{AlmostPoisson, ModelError, Poisson, System, Verify};
    /// use metriplectic_fields::Real;
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{SMatrix, SVector, vector};
    /// use num_dual::DualNum;
    ///
    /// let bracket = |x: &SVector<Real, 5>| {
    ///     let mut pi = SMatrix::<Real, 5, 5>::zeros();
    ///     for (i, j, value) in [(0, 3, x[2].cos()), (1, 3, x[2].sin()), (2, 4, 1.0.into())] {
    ///         (pi[(i, j)], pi[(j, i)]) = (value, -value);
    ///     }
    ///     pi
    /// };
    /// let energy = |x: &SVector<Real, 5>| (x[3] * x[3] + x[4] * x[4]) * 0.5;
    /// let start = vector![0.0, 0.0, 0.3, 1.0, 0.5];
    /// let blade = System::on(Euclidean::<5>).bracket(AlmostPoisson::field(bracket)).energy(energy);
    /// assert!(blade.build()?.verify(&start, 0.1).is_ok());
    /// let refused = System::on(Euclidean::<5>).bracket(Poisson::field(bracket)).energy(energy);
    /// let error = refused.build()?.verify(&start, 0.1);
    /// assert!(matches!(error, Err(ModelError::NoJacobiIdentity { .. })));
    /// # Ok::<(), metriplectic_dynamics::BuildError>(())
    /// ```
    pub const fn field<F>(field: F) -> FieldPoisson<F> {
        FieldPoisson::almost(field)
    }
}

/// A constant matrix that is not a Poisson tensor.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoissonError {
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) of the Poisson tensor is not a finite number")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// `Π ≠ −Πᵀ`.
    #[error(
        "the Poisson tensor is not skew: entries ({row}, {column}) and ({column}, {row}) add up to {size:.3e}"
    )]
    NotSkew {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// `|Π_ij + Π_ji|`.
        size: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(PoissonError);
