//! The equation of a step, and what its solution tells.

use std::fmt::Debug;

use metriplectic_fields::{Matrix, Space, Square, Vector};

/// An equation `F(u) = 0` for a tangent vector `u`.
pub trait Equation<M: Space> {
    /// Data of an evaluation beside the residual.
    type Evidence: Copy + Debug;

    /// `F(u)`, or `None` where it is not defined: outside the domain of a field, or beyond the reach
    /// of a geodesic.
    fn evaluate(&self, u: &Vector<M>) -> Option<Evaluated<M, Self::Evidence>>;

    /// `F(u)` with its Jacobian, or `None` where it is not defined.
    fn linearise(&self, u: &Vector<M>) -> Option<Linearised<M, Self::Evidence>>;

    /// `F(u)` alone.
    fn value(&self, u: &Vector<M>) -> Option<Vector<M>> {
        self.evaluate(u).map(|at| at.residual)
    }
}

/// The residual of an equation at one point.
#[derive(Clone, Copy, Debug)]
pub struct Evaluated<M: Space, E> {
    /// `F(u)`.
    pub residual: Vector<M>,
    /// Data of the evaluation beside the residual.
    pub evidence: E,
}

/// An equation at one point.
#[derive(Clone, Debug)]
pub struct Linearised<M: Space, E> {
    /// `F(u)`.
    pub residual: Vector<M>,
    /// `∂F/∂u`.
    pub jacobian: Matrix<M>,
    /// The round-off of `F(u)`.
    pub rounding: Rounding<M>,
    /// The rates of what the equation discretises.
    pub stiffness: Stiffness,
    /// Data of the evaluation beside the residual.
    pub evidence: E,
}

/// The rates of a motion in one step: the roots of the sums of squared eigenvalues, the same numbers in all
/// units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stiffness {
    /// `h|K'|` of the friction. The midpoint rule multiplies a deviation that decays at the rate `λ` by
    /// `(1 − hλ/2)/(1 + hλ/2)`, which tends to −1.
    pub friction: f64,
    /// `h|Π'|` of the reversible motion.
    pub rotation: f64,
}

/// The round-off of `F(u)`, for each component in its own unit: the terms of a component are rounded
/// one by one, and the components share the round-off `η` of the covectors that they are computed from, and
/// `ξ` of the points, at which `F − u` is evaluated,
///
/// ```math
/// |\delta F_i| \le r_i + \Bigl| \sum_j G_{ij} \eta_j \Bigr| + \Bigl| \sum_j (J - 1)_{ij} \xi_j \Bigr| .
/// ```
///
/// The shared parts keep their direction. Where friction is stiff they point along the fast direction, so
/// the slow one has digits that the norm of `δF` does not show.
#[derive(Clone, Debug)]
pub struct Rounding<M: Space> {
    /// The round-off `r_i` of the terms.
    pub terms: Vector<M>,
    /// The derivative `G = ∂F/∂η`.
    pub sensitivity: Matrix<M>,
    /// The sizes of `η_j`.
    pub covector: Vector<M>,
    /// The sizes of `ξ_j`.
    pub argument: Vector<M>,
}

impl<M: Space> Rounding<M> {
    /// The bound of each component, with the Jacobian `J`.
    #[must_use]
    pub fn bounds(&self, jacobian: &Matrix<M>) -> Vector<M> {
        let moved = (*jacobian - Matrix::<M>::one()).abs();
        self.terms + self.sensitivity.abs() * self.covector + moved * self.argument
    }
}

/// A solved equation.
#[derive(Clone, Debug)]
pub struct Root<M: Space, E> {
    /// The solution.
    pub u: Vector<M>,
    /// The norm of the residual that is left.
    pub residual: f64,
    /// The round-off of each component of the solution.
    pub round_off: Vector<M>,
    /// The norm of the round-off of the residual.
    pub residual_bound: f64,
    /// Linear systems solved.
    pub iterations: usize,
    /// Data of the last evaluation beside the residual.
    pub evidence: E,
}

/// The best point of an equation that was not solved.
#[derive(Clone, Debug)]
pub struct Iterate<M: Space> {
    /// The best point found.
    pub best: Vector<M>,
    /// The norm of the residual there; infinite if it was defined nowhere.
    pub residual: f64,
    /// Linear systems solved.
    pub iterations: usize,
}

impl<M: Space> Iterate<M> {
    /// The best point as the root, with its round-off.
    pub(super) fn solved<E>(
        self,
        round_off: Vector<M>,
        evidence: E,
        residual_bound: f64,
    ) -> Root<M, E> {
        let Self { best: u, residual, iterations } = self;
        Root { u, residual, round_off, residual_bound, iterations, evidence }
    }
}
