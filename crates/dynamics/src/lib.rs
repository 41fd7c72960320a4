//! What drives the state: a bracket turns energy into reversible motion, a dissipation turns
//! entropy into irreversible motion, and a [`System`] puts them together and checks them.
//!
//! ```math
//! \dot x = \Pi\, dH + K\, dS .
//! ```
//!
//! | module | what it holds |
//! |---|---|
//! | [`bracket`] | [`Bracket`]: `Π`; [`LiePoisson`], [`AreaForm`](type@AreaForm), [`Nambu`], [`Symplectic`], [`Poisson::constant`], [`Poisson::field`], [`AlmostPoisson::field`], [`Zero`]; with a [`Force`], [`ForcedLiePoisson`] |
//! | [`dissipation`] | [`Dissipation`]: `K`, given the covector it must annihilate; [`MetricDissipation`], [`CometricDissipation`], [`KulkarniNomizu`], [`CasimirDissipation`], [`FieldDissipation`], [`ProjectedDissipation`], [`Scaled`] |
//! | [`euler_poincare`] | [`Legendre`]: a reduced Lagrangian on a Lie algebra, as an energy on its dual |
//! | [`system`] | [`System`] and its builder |
//! | [`invariants`] | further Casimirs and momenta `L_a`, and symmetries |
//! | [`orthogonal`] | projections off covectors, by which a tensor is made to annihilate them |
//! | [`velocity`](mod@velocity) | `Π w_H + K w_S` for given covectors: differentials, or discrete gradients |
//! | [`verify`] | the laws of a model, sampled: [`System::verify`], [`System::report`], [`Verified`] |
//! | [`laws`] | what brackets and dissipations promise, and the functions that check it |

pub mod bracket;
pub mod dissipation;
pub mod euler_poincare;
pub mod invariants;
pub mod laws;
pub mod model_error;
pub mod orthogonal;
pub mod report;
pub mod system;
pub mod velocity;
pub mod verified;
pub mod verify;

pub use bracket::{
    AlmostPoisson, AreaForm, Bracket, BracketArgs, BracketJet, ConstantPoisson, FieldPoisson,
    Force, ForcedLiePoisson, LiePoisson, Nambu, NaturalBracket, OfEntropy, Poisson, PoissonError,
    Symplectic, Zero,
};
pub use dissipation::{
    CasimirDissipation, CometricDissipation, Dissipation, DissipationJet, FieldDissipation,
    FormError, KulkarniNomizu, MetricDissipation, NoDissipation, ProjectedDissipation, Scaled,
};
pub use euler_poincare::{Legendre, LegendreError};
pub use invariants::Invariants;
pub use model_error::ModelError;
pub use report::{LawResidual, Report};
pub use system::{
    BuildError, Metriplectic, NoEnergy, NoEntropy, Point, SecondLaw, System, SystemBuilder,
};
pub use verified::Verified;
