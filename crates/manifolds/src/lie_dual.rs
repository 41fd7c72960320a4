//! The dual `g*` of a Lie algebra, the phase space of reduced mechanical systems.
//!
//! If the energy of a mechanical system on a group `G` is left-invariant, the configuration drops out of the
//! equations. The state is then the momentum in the body frame, `μ ∈ g*` (Marsden and Ratiu 1999, ch. 13; Bloch, Farré
//! Puiggalí and Martín de Diego 2024, §3). With `[e_a, e_b] = C_ab^d e_d`:
//!
//! - **Point and velocity**: columns of the components `μ_a = ⟨μ, e_a⟩` and of `μ'_a`.
//! - **Frame**: the dual basis `e^a`, the same everywhere.
//! - **Chart**: `φ_μ(q) = μ + q`.
//! - **Geodesics**: straight lines, as on [Rⁿ](mod@crate::euclidean).
//! - **Bracket**: `LiePoisson` by default,
//!
//! ```math
//! \mu' = \mathrm{ad}^*_{\xi}\, \mu, \qquad
//! \mu'_b = C_{ab}^d\, \xi^a \mu_d, \qquad \xi = dH(\mu) .
//! ```
//!
//! The flow stays on a coadjoint orbit, on which the Casimirs are constant: the functions with
//! `ad*_{dC} μ = 0`. An entropy is a function of Casimirs.
//!
//! | dual | brackets | Casimirs |
//! |---|---|---|
//! | [`so3`](LieDual::so3), [`su2`](LieDual::su2) | `[e_a, e_b] = ε_abc e_c`, up to scale | `½\|μ\|²` |
//! | [`sl2`](LieDual::sl2) | `[H, E] = 2E`, `[H, F] = −2F`, `[E, F] = H` | `½μ_H² + 2 μ_E μ_F` |
//! | [`heisenberg`](LieDual::heisenberg) | `[e_1, e_2] = e_3` | `μ_3` |
//! | [`se3`](LieDual::se3), `(M, Γ)` | `[R_a, R_b] = ε_abc R_c`, `[R_a, T_b] = ε_abc T_c` | `M·Γ`, `\|Γ\|²` |
//! | [`so4`](LieDual::so4), `(J, N)` | those of se(3), and `[N_a, N_b] = ε_abc J_c` | `J·N`, `\|J\|² + \|N\|²` |
//! | [`new`](LieDual::new), [`of`](LieDual::of) | yours, from structure constants or from matrices | |
//!
//! ```
//! use metriplectic_manifolds::LieDual;
//! use nalgebra::{Vector3, Vector6, vector};
//!
//! let casimir: Vector3<f64> = vector![0.3, 2.0 * -0.7, 2.0 * 0.5]; // dC of sl(2)* at (0.3, 0.5, −0.7)
//! assert_eq!(LieDual::sl2().algebra().coadjoint(&casimir, &vector![0.3, 0.5, -0.7]).norm(), 0.0);
//!
//! let (m, gamma) = ([1.0, 2.0, 4.0], [0.5, -1.0, 3.0]);
//! let state = Vector6::from_iterator(m.into_iter().chain(gamma));
//! let area = Vector6::from_iterator(gamma.into_iter().chain(m)); // d(M·Γ)
//! assert_eq!(LieDual::se3().algebra().coadjoint(&area, &state).norm(), 0.0);
//! assert_eq!(LieDual::so4().algebra().coadjoint(&area, &state).norm(), 0.0);
//! ```

use metriplectic_fields::{ChartPoint, Column, Real, Scalar, Space};
use nalgebra::{Const, SMatrix, SVector};
use rand::{Rng, RngExt};

use crate::Manifold;
use crate::euclidean::vector_space;

pub use crate::lie_algebra::{AlgebraError, LieAlgebra, StructureConstant};

/// The dual `g*` of a Lie algebra: momenta `μ = μ_a e^a`; see the [module](mod@crate::lie_dual).
///
/// ```
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::vector;
/// // On so(3)* the coadjoint action is the cross product, `ad*_ξ p = p × ξ`.
/// let (p, xi) = (vector![1.0, 2.0, 3.0], vector![-1.0, 0.5, 2.0]);
/// assert_eq!(LieDual::so3().algebra().coadjoint(&xi, &p), p.cross(&xi));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LieDual<const N: usize> {
    algebra: LieAlgebra<N>,
}

vector_space!(LieDual);

impl<const N: usize> LieDual<N> {
    /// The dual of a given algebra.
    pub const fn of(algebra: LieAlgebra<N>) -> Self {
        Self { algebra }
    }

    /// The dual of the algebra with `[e_a, e_b] = constants[a][b][d] e_d`.
    ///
    /// # Errors
    ///
    /// The errors of [`LieAlgebra::new`].
    pub fn new(constants: &[[[f64; N]; N]; N]) -> Result<Self, AlgebraError> {
        LieAlgebra::new(constants).map(Self::of)
    }

    /// The algebra.
    pub const fn algebra(&self) -> &LieAlgebra<N> {
        &self.algebra
    }

    /// From the brackets `[e_a, e_b] = value e_d` of a known algebra, one line for each pair.
    fn known(brackets: &[(usize, usize, usize, f64)]) -> Self {
        let nonzero = brackets
            .iter()
            .flat_map(|&(a, b, d, value)| {
                [
                    StructureConstant { a, b, d, value },
                    StructureConstant { a: b, b: a, d, value: -value },
                ]
            })
            .collect();
        Self::of(LieAlgebra::known(nonzero))
    }
}

impl LieDual<3> {
    /// `so(3)*`, the angular momenta of a body in the body frame: `[e_a, e_b] = ε_abc e_c`.
    pub fn so3() -> Self {
        Self::su2(1.0)
    }

    /// `su(2)*` in the basis where `[e_a, e_b] = scale · ε_abc e_c`: 1 for `−iσ_a/2` (the same
    /// constants as `so(3)`), 2 for `−iσ_a`.
    pub fn su2(scale: f64) -> Self {
        Self::known(&[(0, 1, 2, scale), (1, 2, 0, scale), (2, 0, 1, scale)])
    }

    /// `sl(2, R)*` in the basis `H = diag(1, −1)`, `E`, `F`: `[H, E] = 2E`, `[H, F] = −2F`,
    /// `[E, F] = H`.
    pub fn sl2() -> Self {
        Self::known(&[(0, 1, 1, 2.0), (0, 2, 2, -2.0), (1, 2, 0, 1.0)])
    }

    /// The dual of the Heisenberg algebra: `[e_1, e_2] = e_3`, with `e_3` central.
    pub fn heisenberg() -> Self {
        Self::known(&[(0, 1, 2, 1.0)])
    }
}

impl LieDual<6> {
    /// `se(3)*`, states `(M, Γ)`: angular momentum and the dual of translations, as in the heavy
    /// top. Rotations come first: `[R_a, R_b] = ε_abc R_c`, `[R_a, T_b] = ε_abc T_c`,
    /// `[T_a, T_b] = 0`.
    pub fn se3() -> Self {
        Self::known(&[
            (0, 1, 2, 1.0),
            (1, 2, 0, 1.0),
            (2, 0, 1, 1.0),
            (0, 4, 5, 1.0),
            (1, 5, 3, 1.0),
            (2, 3, 4, 1.0),
            (3, 1, 5, 1.0),
            (4, 2, 3, 1.0),
            (5, 0, 4, 1.0),
        ])
    }

    /// `so(4)* ≅ so(3)* ⊕ so(3)*` in the basis `(J, N)` of rotations and boosts of Euclidean
    /// four-space: `[J_a, J_b] = ε_abc J_c`, `[J_a, N_b] = ε_abc N_c`, `[N_a, N_b] = ε_abc J_c`.
    pub fn so4() -> Self {
        let boosts = Self::known(&[(3, 4, 2, 1.0), (4, 5, 0, 1.0), (5, 3, 1, 1.0)]);
        let constants = [Self::se3(), boosts].map(|dual| dual.algebra.constants().to_vec());
        Self::of(LieAlgebra::known(constants.concat()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix4, vector};

    /// The dense constants of an algebra, so that the ready-made ones pass through the checks.
    fn dense<const N: usize>(space: &LieDual<N>) -> [[[f64; N]; N]; N] {
        let mut constants = [[[0.0; N]; N]; N];
        for c in space.algebra().constants() {
            constants[c.a][c.b][c.d] += c.value;
        }
        constants
    }

    #[test]
    fn ready_made_algebras_pass_the_checks() {
        assert!(LieDual::new(&dense(&LieDual::so3())).is_ok());
        assert!(LieDual::new(&dense(&LieDual::su2(2.0))).is_ok());
        assert!(LieDual::new(&dense(&LieDual::sl2())).is_ok());
        assert!(LieDual::new(&dense(&LieDual::heisenberg())).is_ok());
        assert!(LieDual::new(&dense(&LieDual::se3())).is_ok());
        assert!(LieDual::new(&dense(&LieDual::so4())).is_ok());
    }

    /// An elementary rotation generator of R⁴: `e_j e_iᵀ − e_i e_jᵀ`.
    fn rotation(i: usize, j: usize) -> Matrix4<f64> {
        let mut generator = Matrix4::zeros();
        generator[(j, i)] = 1.0;
        generator[(i, j)] = -1.0;
        generator
    }

    /// A translation in homogeneous coordinates.
    fn translation(i: usize) -> Matrix4<f64> {
        let mut generator = Matrix4::zeros();
        generator[(i, 3)] = 1.0;
        generator
    }

    #[test]
    fn ready_made_algebras_are_the_commutators_of_their_matrices() {
        let rotations = [rotation(1, 2), rotation(2, 0), rotation(0, 1)];
        let [x, y, z] = rotations;
        let so3 = LieAlgebra::of_matrices(&rotations).unwrap();
        assert_eq!(dense(&LieDual::of(so3)), dense(&LieDual::so3()));
        let se3 =
            LieAlgebra::of_matrices(&[x, y, z, translation(0), translation(1), translation(2)]);
        assert_eq!(dense(&LieDual::of(se3.unwrap())), dense(&LieDual::se3()));
        let so4 =
            LieAlgebra::of_matrices(&[x, y, z, rotation(0, 3), rotation(1, 3), rotation(2, 3)]);
        assert_eq!(dense(&LieDual::of(so4.unwrap())), dense(&LieDual::so4()));
        let sl2 = LieAlgebra::of_matrices(&[
            Matrix2::new(1.0, 0.0, 0.0, -1.0),
            Matrix2::new(0.0, 1.0, 0.0, 0.0),
            Matrix2::new(0.0, 0.0, 1.0, 0.0),
        ]);
        assert_eq!(dense(&LieDual::of(sl2.unwrap())), dense(&LieDual::sl2()));
    }

    #[test]
    fn bad_constants_name_their_indices() {
        let mut constants = dense(&LieDual::so3());
        constants[0][1][2] = 1.5;
        let error = LieDual::new(&constants).unwrap_err();
        assert_eq!(error, AlgebraError::NotAntisymmetric { a: 0, b: 1, d: 2, size: 0.5 });

        // Antisymmetric, but [[e_0, e_1], e_2] + cyclic = [e_0, e_2] = −e_1 ≠ 0.
        let mut constants = dense(&LieDual::so3());
        (constants[0][1][0], constants[1][0][0]) = (1.0, -1.0);
        let error = LieDual::new(&constants).unwrap_err();
        assert_eq!(error, AlgebraError::NoJacobiIdentity { a: 0, b: 1, c: 2, d: 1, size: 1.0 });

        let mut constants = dense(&LieDual::se3());
        constants[3][4][5] = f64::NAN;
        let error = LieDual::new(&constants).unwrap_err();
        assert!(matches!(error, AlgebraError::NotFinite { a: 3, b: 4, d: 5, .. }));
    }

    #[test]
    fn matrices_that_do_not_close_are_refused() {
        let pair = [rotation(1, 2), rotation(2, 0)];
        assert!(matches!(
            LieAlgebra::of_matrices(&pair),
            Err(AlgebraError::NotClosed { a: 0, b: 1, .. })
        ));
        let twice = [rotation(1, 2), rotation(1, 2) * 2.0];
        assert_eq!(LieAlgebra::of_matrices(&twice), Err(AlgebraError::NotIndependent));
    }

    #[test]
    fn coadjoint_is_the_transpose_of_the_bracket() {
        let se3 = LieDual::se3();
        let xi = vector![0.3, -1.2, 0.7, 2.0, -0.4, 0.1];
        let mu = vector![1.5, 0.2, -0.8, 0.6, -1.1, 0.9];
        let eta = vector![-0.7, 0.4, 1.3, -0.2, 0.5, 2.2];
        let left = se3.algebra().coadjoint(&xi, &mu).dot(&eta);
        let right = mu.dot(&se3.algebra().bracket(&xi, &eta));
        assert!(f64::abs(left - right) < 1e-14);
    }
}
