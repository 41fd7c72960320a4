//! Lie algebras, by their structure constants or by matrices.

use metriplectic_fields::{Column, Scalar, Square};
use nalgebra::{SMatrix, SVector};

/// A Lie algebra of dimension `N` by its structure constants, `[e_a, e_b] = C_ab^d e_d`.
///
/// It stores only the nonzero constants.
#[derive(Clone, Debug, PartialEq)]
pub struct LieAlgebra<const N: usize> {
    nonzero: Vec<StructureConstant>,
    /// The values of the constants, if they are those of so(3) at the [known places](ROTATIONS).
    rotations: Option<[f64; 6]>,
}

/// The relative size below which matrices of a basis count as dependent, and commutators as in their span.
const SPAN_TOLERANCE: f64 = 1e-12;

/// One nonzero `C_ab^d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StructureConstant {
    /// The first factor `e_a`.
    pub a: usize,
    /// The second factor `e_b`.
    pub b: usize,
    /// The component `e_d` of the bracket.
    pub d: usize,
    /// The value `C_ab^d`.
    pub value: f64,
}

impl<const N: usize> LieAlgebra<N> {
    /// Makes the algebra with `[e_a, e_b] = constants[a][b][d] e_d`.
    ///
    /// # Errors
    ///
    /// [`AlgebraError`] with the failing indices if a constant is not finite, if `C_ab^d ≠ −C_ba^d`,
    /// or if the Jacobi identity
    /// `C_ab^e C_ec^d + C_bc^e C_ea^d + C_ca^e C_eb^d = 0` fails beyond round-off.
    pub fn new(constants: &[[[f64; N]; N]; N]) -> Result<Self, AlgebraError> {
        // Each of the 3N products of the Jacobi identity is rounded once and added once.
        Self::checked(constants, 6.0 * N as f64 * f64::EPSILON)
    }

    /// Makes the algebra of the given constants if their laws hold to a relative `tolerance`.
    fn checked(constants: &[[[f64; N]; N]; N], tolerance: f64) -> Result<Self, AlgebraError> {
        let c = |a: usize, b: usize, d: usize| constants[a][b][d];
        let largest = finite_maximum(constants)?;
        for (a, b, d) in triples(N) {
            let size = (c(a, b, d) + c(b, a, d)).abs();
            if size > tolerance * largest {
                return Err(AlgebraError::NotAntisymmetric { a, b, d, size });
            }
        }
        for (a, b, d) in triples(N) {
            for k in 0..N {
                let cyclic = |e: usize| {
                    c(a, b, e) * c(e, k, d) + c(b, k, e) * c(e, a, d) + c(k, a, e) * c(e, b, d)
                };
                let size = (0..N).map(cyclic).sum::<f64>().abs();
                if size > tolerance * largest * largest {
                    return Err(AlgebraError::NoJacobiIdentity { a, b, c: k, d, size });
                }
            }
        }
        let nonzero: Vec<_> = triples(N)
            .map(|(a, b, d)| StructureConstant { a, b, d, value: c(a, b, d) })
            .filter(|constant| constant.value != 0.0)
            .collect();
        Ok(Self::known(nonzero))
    }

    /// Makes the algebra spanned by matrices, with the commutator `[A, B] = AB − BA`.
    ///
    /// # Errors
    ///
    /// [`AlgebraError::NotIndependent`] if the matrices are linearly dependent,
    /// [`AlgebraError::NotClosed`] if a commutator leaves their span, and those of [`new`](Self::new).
    pub fn of_matrices<const R: usize>(
        basis: &[SMatrix<f64, R, R>; N],
    ) -> Result<Self, AlgebraError> {
        let gram = SMatrix::<f64, N, N>::from_fn(|a, b| basis[a].dot(&basis[b]));
        let factor = Square::cholesky(&gram).map_err(|_| AlgebraError::NotIndependent)?;
        if (0..N).any(|a| factor[(a, a)].powi(2) <= SPAN_TOLERANCE * gram[(a, a)]) {
            return Err(AlgebraError::NotIndependent);
        }
        let mut constants = [[[0.0; N]; N]; N];
        for a in 0..N {
            for b in a + 1..N {
                let commutator = basis[a] * basis[b] - basis[b] * basis[a];
                let traces = SVector::<f64, N>::from_fn(|d, _| basis[d].dot(&commutator));
                let components =
                    Square::solve(&gram, &traces).ok_or(AlgebraError::NotIndependent)?;
                let span: SMatrix<f64, R, R> = (0..N).map(|d| basis[d] * components[d]).sum();
                let size = (commutator - span).norm();
                if size > SPAN_TOLERANCE * commutator.norm() {
                    return Err(AlgebraError::NotClosed { a, b, size });
                }
                constants[a][b] = components.into();
                constants[b][a] = (-components).into();
            }
        }
        Self::checked(&constants, SPAN_TOLERANCE)
    }

    /// Makes the algebra of constants that are known to satisfy the laws.
    pub(crate) fn known(nonzero: Vec<StructureConstant>) -> Self {
        Self { rotations: rotations(&nonzero), nonzero }
    }

    /// The nonzero structure constants.
    pub fn constants(&self) -> &[StructureConstant] {
        &self.nonzero
    }

    /// Computes the bracket `[ξ, η]^d = C_ab^d ξ^a η^b`.
    pub fn bracket<D: Scalar>(&self, xi: &SVector<D, N>, eta: &SVector<D, N>) -> SVector<D, N> {
        let mut sum = <SVector<D, N> as Column<D>>::zero();
        for c in &self.nonzero {
            sum[c.d] += xi[c.a] * eta[c.b] * c.value;
        }
        sum
    }

    /// Computes the coadjoint action `(ad*_ξ μ)_b = C_ab^d ξ^a μ_d`, that is `⟨ad*_ξ μ, η⟩ = ⟨μ, [ξ, η]⟩`.
    #[inline(always)]
    pub fn coadjoint<D: Scalar>(&self, xi: &SVector<D, N>, mu: &SVector<D, N>) -> SVector<D, N> {
        // A cross product: the compiler knows its indices, and there is no loop.
        if N == 3
            && let Some([p, m, q, n, r, o]) = self.rotations
        {
            return Column::from_index(|i| match i {
                0 => xi[1] * mu[2] * m + xi[2] * mu[1] * r,
                1 => xi[0] * mu[2] * p + xi[2] * mu[0] * n,
                _ => xi[1] * mu[0] * q + xi[0] * mu[1] * o,
            });
        }
        self.coadjoint_by_constants(xi, mu)
    }

    /// The sum over the constants, one after the other.
    fn coadjoint_by_constants<D: Scalar>(
        &self,
        xi: &SVector<D, N>,
        mu: &SVector<D, N>,
    ) -> SVector<D, N> {
        let mut sum = <SVector<D, N> as Column<D>>::zero();
        for c in &self.nonzero {
            sum[c.b] += xi[c.a] * mu[c.d] * c.value;
        }
        sum
    }
}

/// The indices of the constants of so(3), in the order of [`LieDual::so3`](crate::LieDual::so3).
const ROTATIONS: [(usize, usize, usize); 6] =
    [(0, 1, 2), (1, 0, 2), (1, 2, 0), (2, 1, 0), (2, 0, 1), (0, 2, 1)];

/// The values of constants that have the indices of so(3).
fn rotations(nonzero: &[StructureConstant]) -> Option<[f64; 6]> {
    let all: &[StructureConstant; 6] = nonzero.try_into().ok()?;
    (all.map(|c| (c.a, c.b, c.d)) == ROTATIONS).then(|| all.map(|c| c.value))
}

/// All `(a, b, d)` with each index below `n`.
fn triples(n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n * n * n).map(move |k| (k / (n * n), (k / n) % n, k % n))
}

/// The largest `|C_ab^d|`, or the first one that is not finite.
fn finite_maximum<const N: usize>(constants: &[[[f64; N]; N]; N]) -> Result<f64, AlgebraError> {
    let mut largest = 0.0_f64;
    for (a, b, d) in triples(N) {
        let value = constants[a][b][d];
        if !value.is_finite() {
            return Err(AlgebraError::NotFinite { a, b, d, value });
        }
        largest = largest.max(value.abs());
    }
    Ok(largest)
}

/// Structure constants that do not make a Lie algebra.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AlgebraError {
    /// A constant is NaN or infinite.
    #[error("the structure constant C_({a},{b})^{d} is {value}; every one must be a finite number")]
    NotFinite {
        /// First index.
        a: usize,
        /// Second index.
        b: usize,
        /// Upper index.
        d: usize,
        /// The value.
        value: f64,
    },
    /// `C_ab^d ≠ −C_ba^d`.
    #[error("C_({a},{b})^{d} + C_({b},{a})^{d} = {size:.3e}, but a Lie bracket is antisymmetric")]
    NotAntisymmetric {
        /// First index.
        a: usize,
        /// Second index.
        b: usize,
        /// Upper index.
        d: usize,
        /// `|C_ab^d + C_ba^d|`.
        size: f64,
    },
    /// The Jacobi identity fails.
    #[error(
        "[[e_{a}, e_{b}], e_{c}] + cyclic has the component {size:.3e} along e_{d}, \
         but a Lie bracket satisfies the Jacobi identity"
    )]
    NoJacobiIdentity {
        /// First element.
        a: usize,
        /// Second element.
        b: usize,
        /// Third element.
        c: usize,
        /// Component of the double bracket.
        d: usize,
        /// Its absolute value.
        size: f64,
    },
    /// Basis matrices are linearly dependent.
    #[error("the basis matrices are linearly dependent")]
    NotIndependent,
    /// A commutator leaves the span of the basis.
    #[error("the commutator of basis matrices {a} and {b} leaves their span by {size:.3e}")]
    NotClosed {
        /// First matrix.
        a: usize,
        /// Second matrix.
        b: usize,
        /// Norm of the part outside the span.
        size: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(AlgebraError);
