//! Fits of metriplectic systems to data.
//!
//! A system has parameters `θ`; a fit finds those with which a run comes nearest to what was measured, with their standard errors. The
//! derivatives of a [`Family`](metriplectic_dynamics::Family) are those of the discrete steps
//! ([`Tangents`](metriplectic_integrators::Tangents)), so each run keeps its laws whatever `θ` is tried, and no difference quotient has
//! a noise to be tuned. [Systems of any other kind](Fit::of_systems) are fitted by differences of runs in the
//! [same steps](metriplectic_integrators::StepSequence).
//!
//! Each module uses only modules above it in this table.
//!
//! | module | what it holds |
//! |---|---|
//! | [`error`](mod@error) | [`FitError`]: why there is no fit |
//! | [`least_squares`] | [`LeastSquares`]: residuals and their Jacobian, from one run |
//! | [`bounds`] | [`Which`] parameter is kept in an interval, and the [`Bound`] that holds it |
//! | [`robust`] | [`Robust`]: losses that outliers move little |
//! | `trust_region` | the best step of a linear model within a trust region |
//! | `projected` | this step within a box |
//! | [`levenberg_marquardt`] | [`LevenbergMarquardt`]: a solver for argmin's executor |
//! | [`unknowns`] | which parameters are free, and which are fitted by their logarithm |
//! | [`covariance`] | standard errors and correlations from a Jacobian |
//! | [`fitted`] | [`Fitted`]: the result, which prints what the data say |
//! | `model` | the residuals of runs, and those of a family |
//! | `systems` | the residuals of systems of any kind, and differences of their runs |
//! | [`fit`](mod@fit) | [`Fit`]: what a user says of a fit |
//! | [`loss`](mod@loss) | [`Loss`]: a loss over runs with its gradient, for argmin's L-BFGS |

pub mod bounds;
pub mod covariance;
pub mod error;
pub mod fit;
pub mod fitted;
pub mod least_squares;
pub mod levenberg_marquardt;
pub mod loss;
mod model;
mod projected;
pub mod robust;
mod systems;
mod trust_region;
pub mod unknowns;

pub use bounds::{Bound, Which};
pub use error::FitError;
pub use fit::{FamilyStart, Fit, FitBuilder, Observation, SystemStart};
pub use fitted::{Ending, Estimate, Fitted};
pub use least_squares::{LeastSquares, Squares};
pub use levenberg_marquardt::LevenbergMarquardt;
pub use loss::{Graded, Loss, LossOver, Minimised};
pub use model::Failure;
pub use robust::Robust;
