//! The interface between tangents and methods.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::Vector;

use super::columns::Columns;
use super::error::Unlinearised;
use crate::step::{EntropyStep, Laws, Numbers};

/// A step that was taken, or a part of one.
#[derive(Debug)]
pub struct Piece<'a, Y: Metriplectic> {
    /// The state at its start.
    pub x: &'a Point<Y>,
    /// The state at its end.
    pub end: &'a Point<Y>,
    /// Its size.
    pub h: f64,
    /// How many directions move: parameters, which stand behind them, do not.
    pub moving: usize,
    /// The error that each entry was allowed, if the steps follow a tolerance.
    pub allowed: Option<Vector<Y::Manifold>>,
    /// The values of the laws that an explicit method moves its end onto, with the entropy at its start.
    pub targets: Targets<Y>,
    /// How the entropy at the end was found, by a method that projects onto it.
    pub entropy_step: Option<EntropyStep>,
    /// The number of stages, by a method that chooses it from step to step.
    pub stage_count: Option<u32>,
    /// The velocities of the moving directions at its stages, one stage after the other in the frame at the start, by a method
    /// that solves for them; none if they are not known.
    pub stage_velocities: &'a [f64],
}

/// The values of the laws of a run, with the entropy at the start and what was produced since.
pub type Targets<Y> = Laws<Numbers<Y>>;

/// A step with its derivatives.
#[derive(Clone, Debug)]
pub struct Propagated<Y: Metriplectic> {
    /// The tangent at the end of the step.
    pub columns: Columns<Y>,
    /// The derivative `∂x'/∂h` of the end along the size of the step.
    pub along_h: Vector<Y::Manifold>,
}

/// A method whose steps can be differentiated.
///
/// Laws: 1. the tangent is the derivative of the step that was taken, of this size and on this branch; 2.
/// `dF(x') T' = dF(x) T` for the energy and the further invariants; 3. a row of steps has the product of their
/// derivatives; 4. the transposed steps have the transposed product.
///
/// A retraction that is not symmetric does not compile:
///
/// ```compile_fail
/// # use metriplectic_dynamics::System;
/// # use metriplectic_fields::Real;
/// # use metriplectic_integrators::{Scheme, Span, Tangents};
/// # use metriplectic_manifolds::{Exponential, LieDual};
/// # use nalgebra::Vector3;
/// let body = System::on(LieDual::so3()).energy(|p: &Vector3<Real>| p.x * p.x).build().unwrap();
/// let run = Scheme::new(Exponential).tangent(&body, Vector3::x(), Span::steps(0.1, 1));
/// ```
#[diagnostic::on_unimplemented(
    message = "the steps of `{Self}` have no tangent on this system",
    note = "a `Scheme` has one if its retraction and its discrete gradient are symmetric (`SelfAdjoint`): not `Exponential`, \
            and not `ItohAbe`",
    note = "`DormandPrince5`, `DormandPrince8`, `RungeKuttaChebyshev`, `ExplicitRungeKutta`, `Gauss` and `Radau` have one on every space of this library (`MovingBase`)"
)]
pub trait Linearised<Y: Metriplectic> {
    /// Whether a step from a state at rest has a derivative. A step that is corrected along differences that vanish there, as one that is
    /// moved onto both energy and entropy, has another slope in each direction.
    const SMOOTH_AT_REST: bool = false;

    /// Computes the tangent at the end of a step from that at its start.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn propagate(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        columns: &Columns<Y>,
    ) -> Result<Propagated<Y>, Unlinearised>;

    /// Computes the error of the second law of tangents in a step, `dS(x') δ' − dS(x) δ = δ(h ⟨w_S, K̃ w_S⟩)` for a column `δ` at its start
    /// and `δ'` at its end, relative to its terms. `None` if the method does not say what it has produced, or says it in the
    /// columns.
    fn entropy_law(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        column: [&Vector<Y::Manifold>; 2],
    ) -> Option<f64> {
        let _ = (system, step, column);
        None
    }

    /// Computes the derivative of a loss along the start of a step from that along its end: the transpose of
    /// [`propagate`](Self::propagate), `λᵀ T = λ'ᵀ T'`.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn pull_back(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        costate: &Vector<Y::Manifold>,
    ) -> Result<Vector<Y::Manifold>, Unlinearised>;
}
