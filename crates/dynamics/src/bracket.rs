//! Poisson brackets: the skew tensor `Π` that turns a differential into a velocity.

mod constant;
mod field;
mod lie_poisson;
mod zero;

pub use constant::ConstantPoisson;
pub use field::FieldPoisson;
pub use lie_poisson::LiePoisson;
pub use zero::Zero;

use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::Manifold;
use nalgebra::SMatrix;
use num_dual::Dual64;

/// A Poisson tensor `Π`, acting on covectors: `{f, g} = Π(df, dg)`, `x' = Π dH`.
///
/// The one method to write is [`apply`](Self::apply), at any scalar.
///
/// Laws ([`laws::bracket`](crate::laws::bracket)): 1. `Π` is skew; 2. Jacobi identity
/// `Π^{il}∂_lΠ^{jk} + cyclic = 0`; 3. `linearise` is the derivative of `apply`;
/// 4. `Π α` is linear in `α`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a bracket on `{M}`",
    note = "a Poisson tensor of your own is `Poisson::field(|x| matrix)` or `Poisson::constant(matrix)?`"
)]
pub trait Bracket<M: Manifold> {
    /// The vector `Π(x) α`, components in the frame of the chart of `x`.
    fn apply<D: Scalar>(
        &self,
        space: &M,
        x: &ChartPoint<M, D>,
        alpha: &Vector<M, D>,
    ) -> Vector<M, D>;

    /// `Πα` at a real point with its derivatives along `x` and `α`.
    fn linearise(&self, space: &M, z: &M::Point<f64>, alpha: &Vector<M>) -> BracketJet<M> {
        by_dual_numbers(self, space, z, alpha)
    }

    /// The matrix `Π(x)`.
    fn tensor<D: Scalar>(&self, space: &M, x: &ChartPoint<M, D>) -> Matrix<M, D> {
        let mut tensor = Matrix::<M, D>::zeros();
        for j in 0..M::Dim::LEN {
            let column = self.apply(space, x, &Vector::<M, D>::basis(j));
            for i in 0..M::Dim::LEN {
                tensor[(i, j)] = column[i];
            }
        }
        tensor
    }

    /// Whether the bracket is zero by construction, so that nothing moves reversibly.
    fn is_zero(&self) -> bool {
        false
    }
}

/// The definition of [`Bracket::linearise`]: one dual number for each direction.
pub(crate) fn by_dual_numbers<M: Manifold>(
    bracket: &(impl Bracket<M> + ?Sized),
    space: &M,
    z: &M::Point<f64>,
    alpha: &Vector<M>,
) -> BracketJet<M> {
    let centre = ChartPoint::centre(z);
    let value = bracket.apply(space, &centre, alpha);
    let mut along_z = Matrix::<M>::zeros();
    for k in 0..M::Dim::LEN {
        let moved = ChartPoint { base: z.clone(), q: epsilon::<M>(k) };
        let column = bracket.apply(space, &moved, &Column::embed(alpha));
        for i in 0..M::Dim::LEN {
            along_z[(i, k)] = column[i].eps;
        }
    }
    BracketJet { value, along_z, tensor: bracket.tensor(space, &centre) }
}

/// Chart coordinates `ε e_k`.
pub(crate) fn epsilon<M: Manifold>(k: usize) -> Vector<M, Dual64> {
    Vector::<M, Dual64>::from_index(|i| Dual64::new(0.0, if i == k { 1.0 } else { 0.0 }))
}

/// `Πα` at a real point, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct BracketJet<M: Manifold> {
    /// The vector `Πα`.
    pub value: Vector<M>,
    /// `∂(Πα)/∂z` in the chart at `z`.
    pub along_z: Matrix<M>,
    /// `∂(Πα)/∂α`, the tensor itself.
    pub tensor: Matrix<M>,
}

/// A manifold that comes with a bracket; the others start from [`Zero`].
pub trait NaturalBracket: Manifold {
    /// The bracket a system has unless it is given another one.
    type Bracket: Bracket<Self>;

    /// That bracket.
    fn natural_bracket(&self) -> Self::Bracket;
}

/// Poisson tensors of your own.
#[derive(Clone, Copy, Debug)]
pub enum Poisson {}

impl Poisson {
    /// The same skew matrix everywhere, as in canonical coordinates.
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
    /// [`MatrixField`](metriplectic_fields::MatrixField). It is checked at sampled points to be
    /// skew and to satisfy the Jacobi identity.
    pub const fn field<F>(field: F) -> FieldPoisson<F> {
        FieldPoisson::new(field)
    }
}

/// A constant matrix that is not a Poisson tensor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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
