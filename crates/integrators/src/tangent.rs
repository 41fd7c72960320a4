//! The derivative of a run: how each state depends on the start and on parameters.
//!
//! A run is a row of discrete maps `x_{k+1} = Φ_{h_k}(x_k, θ)`. Its tangent `T = ∂x/∂(x₀, θ)` is the derivative of these maps, not of
//! the equation that they approximate:
//!
//! ```math
//! T_{k+1} = \frac{\partial\Phi_{h_k}}{\partial x}\, T_k + \frac{\partial\Phi_{h_k}}{\partial\theta}, \qquad T_0 = (1, 0) .
//! ```
//!
//! So it has no noise of its own, and the laws of the run hand theirs down: `H(x_k, θ) = H(x₀, θ)` on every step gives
//! `dH(x_k) T_k = dH(x₀) T_0` to round-off at any step size, and so for the further invariants. Explicit methods say what entropy they
//! have produced, and `dS(x_k) T_k` is its derivative. The [`Sensitivity`] of a run records the errors of these laws.
//!
//! The run is the plain run: no bit of it changes because a tangent is asked for. Steps that follow a tolerance are *frozen*: `h_k` is
//! a number, and what the controller would have chosen for another start is left out. `T` is then smooth where a
//! difference of two adaptive runs is not. [`Tangents::tangent_to`] makes it as exact as asked for.
//!
//! | steps | how |
//! |---|---|
//! | [`Scheme`](crate::Scheme) with [`SelfAdjoint`] parts, or such a retraction alone | two linearisations of its own equation, from either end |
//! | [`DormandPrince5`](crate::DormandPrince5), [`DormandPrince8`](crate::DormandPrince8), [`RungeKuttaChebyshev`](crate::RungeKuttaChebyshev), [`ExplicitRungeKutta`](crate::ExplicitRungeKutta) | stages and projection at dual numbers |
//! | [`Gauss`](crate::Gauss), [`Radau`](crate::Radau) | the implicit function theorem at the root, with its residual at dual numbers |
//! | these of a [model](metriplectic_equations::Model) in plain numbers on a vector space | the same, with the derivatives of the model, and along the [parameters](metriplectic_equations::Model::parameters) that it knows |
//! | of any other kind of system: open, noisy, a lattice; along parameters that a model does not know | differences of steps beside the step, to some ten digits |
//!
//! [Corners](crate::Watch::corners) of a law in time stay where they are, and the tangent crosses them: the work at the frozen state has a
//! derivative of its own. In steps beside a corner the column of the clock of an open system is that of the motion, to the error of a step.
//!
//! A loss over a run has a gradient by the transposed steps ([`Adjoints`]), whatever the number of parameters.
//!
//! Components are those of the frames of the charts at both ends. [`TangentState::embedded`] has entries of velocities.

mod adjoint;
mod along;
mod beside;
mod certificate;
mod collocated;
mod columns;
mod default_schemes;
mod differentiated;
mod duals;
mod error;
mod event;
mod exact;
mod explicit;
mod factors;
mod families;
mod frames;
mod landing;
mod linearised;
mod model;
mod numbers;
mod of_equations;
mod of_open;
mod parameters;
mod part;
mod pieces;
mod product;
mod record;
mod refined;
mod saltation;
mod schemes;
mod smooth;
mod state;
mod steps;
mod systems;
mod tape;

/// The most corrections of a root, which converge quadratically.
const CORRECTIONS: usize = 10;

#[doc(hidden)]
pub use crate::smooth_open_flow;
pub use crate::step::HasFlow;
pub use adjoint::{AdjointRun, Adjoints, LossGradient, WITHIN};
pub use along::LinearisedAlong;
pub use certificate::Sensitivity;
pub use columns::{Carried, Columns, LawRows, Moved};
pub use differentiated::Differentiated;
pub use error::{TangentError, Unlinearised};
pub use event::TangentEvent;
pub use exact::ExactSteps;
pub use families::{
    BathOf, BuildMember, Depends, FamilySurroundings, Fittable, InTimeOf, OpenFamily,
    SurroundingsOf,
};
#[doc(hidden)]
pub use frames::between;
pub use linearised::{Linearised, Piece, Propagated, Targets};
pub use part::Part as StepPart;
pub use record::{TangentRun, Tangents};
pub use schemes::SelfAdjoint;
pub use smooth::{FlowOf, SmoothFlow, SpaceOf};
pub use state::TangentState;
pub use steps::TangentSteps;
pub use systems::{SystemAt, Systems};
