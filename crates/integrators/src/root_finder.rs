//! What solves the equation of a step.

use metriplectic_fields::{Matrix, Space, Vector};

/// An equation `F(u) = 0` for a tangent vector `u`.
pub trait Equation<M: Space> {
    /// `F(u)`, or `None` where it is not defined: outside the domain of a field, or beyond the reach
    /// of a geodesic.
    fn value(&self, u: &Vector<M>) -> Option<Vector<M>>;

    /// `F(u)` with the norm below which it is round-off, if that is known without the Jacobian; only
    /// then an equation is tried with the Jacobian of another one near by.
    #[inline]
    fn value_and_floor(&self, _u: &Vector<M>) -> Option<(Vector<M>, f64)> {
        None
    }

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
    /// The norm below which `F(u)` is round-off.
    pub floor: f64,
}

/// A solved equation.
#[derive(Clone, Debug)]
pub struct Root<M: Space> {
    /// The solution.
    pub u: Vector<M>,
    /// The norm of the residual that is left.
    pub residual: f64,
    /// The norm below which a residual is round-off, and so is a displacement.
    pub floor: f64,
    /// Linear systems solved.
    pub sweeps: usize,
}

/// An equation that was not solved.
#[derive(Clone, Debug)]
pub struct NoRoot<M: Space> {
    /// The best point found.
    pub best: Vector<M>,
    /// The norm of the residual there; infinite if it was defined nowhere.
    pub residual: f64,
    /// Linear systems solved.
    pub sweeps: usize,
}

impl<M: Space> NoRoot<M> {
    /// The best point as the root, with its floor.
    pub(crate) fn solved(self, floor: f64) -> Root<M> {
        let Self { best: u, residual, sweeps } = self;
        Root { u, residual, floor, sweeps }
    }
}

/// A method that solves `F(u) = 0` from a guess.
pub trait RootFinder<M: Space> {
    /// A root near the guess.
    ///
    /// # Errors
    ///
    /// [`NoRoot`] with the best point found.
    fn solve(&self, equation: &impl Equation<M>, guess: &Vector<M>) -> Result<Root<M>, NoRoot<M>>;
}
