//! What solves the equation of a step.

use metriplectic_fields::{Matrix, Space, Square, Vector};

/// An equation `F(u) = 0` for a tangent vector `u`.
pub trait Equation<M: Space> {
    /// `F(u)`, or `None` where it is not defined: outside the domain of a field, or beyond the reach
    /// of a geodesic.
    fn value(&self, u: &Vector<M>) -> Option<Vector<M>>;

    /// `F(u)` with its Jacobian, or `None` where it is not defined.
    fn linearise(&self, u: &Vector<M>) -> Option<Linearised<M>>;
}

/// An equation at one point.
#[derive(Clone, Debug)]
pub struct Linearised<M: Space> {
    /// `F(u)`.
    pub residual: Vector<M>,
    /// `∂F/∂u`.
    pub jacobian: Matrix<M>,
    /// The round-off of `F(u)`.
    pub rounding: Rounding<M>,
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
    pub gain: Matrix<M>,
    /// The sizes of `η_j`.
    pub noise: Vector<M>,
    /// The sizes of `ξ_j`.
    pub argument: Vector<M>,
}

impl<M: Space> Rounding<M> {
    /// The bound of each component, with the Jacobian `J`.
    #[must_use]
    pub fn bounds(&self, jacobian: &Matrix<M>) -> Vector<M> {
        let moved = (*jacobian - Matrix::<M>::one()).abs();
        self.terms + self.gain.abs() * self.noise + moved * self.argument
    }
}

/// A solved equation.
#[derive(Clone, Debug)]
pub struct Root<M: Space> {
    /// The solution.
    pub u: Vector<M>,
    /// The norm of the residual that is left.
    pub residual: f64,
    /// The round-off of each component of the solution.
    pub noise: Vector<M>,
    /// The norm of the round-off of the residual.
    pub floor: f64,
    /// Linear systems solved.
    pub iterations: usize,
}

/// An equation that was not solved.
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
    pub(crate) fn solved(self, noise: Vector<M>, floor: f64) -> Root<M> {
        let Self { best: u, residual, iterations } = self;
        Root { u, residual, noise, floor, iterations }
    }
}

/// A method that solves `F(u) = 0` from a guess.
pub trait RootFinder<M: Space> {
    /// A root near the guess.
    ///
    /// # Errors
    ///
    /// [`Iterate`] with the best point found.
    fn solve(&self, equation: &impl Equation<M>, guess: &Vector<M>) -> Result<Root<M>, Iterate<M>>;
}
