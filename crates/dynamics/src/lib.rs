//! Metriplectic systems: a bracket turns the differential of the energy into reversible motion, a dissipation
//! turns the differential of the entropy into irreversible motion, and a [`System`] combines them.
//!
//! ```math
//! \dot x = \Pi\, dH + K\, dS .
//! ```
//!
//! Each module uses only modules above it in this table.
//!
//! | module | what it holds |
//! |---|---|
//! | [`bracket`] | [`Bracket`]: `Π`; [`LiePoisson`], [`AreaForm`](type@AreaForm), [`Nambu`], [`Symplectic`], [`Poisson::constant`], [`Poisson::field`], [`AlmostPoisson::field`], [`Zero`]; with a [`Force`], [`ForcedLiePoisson`] |
//! | [`dissipation`] | [`Dissipation`]: `K`, given the covector it must annihilate; [`MetricDissipation`], [`CometricDissipation`], [`KulkarniNomizu`], [`CasimirDissipation`], [`FieldDissipation`], [`OnsagerDissipation`], [`ProjectedDissipation`], [`Scaled`] |
//! | [`exchange`] | [`Port`], [`Bath`]: work and heat from outside |
//! | [`invariants`] | further Casimirs and momenta `L_a`, and symmetries |
//! | [`orthogonal`] | projections off covectors, by which a tensor is made to annihilate them |
//! | [`mod@model_error`] | [`ModelError`]: the law that a model violates, with the numbers |
//! | [`report`](mod@report) | [`Report`]: the residual of every law |
//! | [`in_numbers`] | [`InNumbers`]: a system that answers the questions of [`Equations`](metriplectic_equations::Equations) |
//! | [`vector_field`] | [`VectorField`]: `system.velocity(x)` |
//! | [`verification`] | [`Verify`]: `system.verify(x0, radius)`, `system.report(x0)`; [`Verified`] |
//! | [`metriplectic`] | [`Metriplectic`]: the parts of a system |
//! | [`system`] | [`System`], which holds these parts |
//! | [`builder`] | [`SystemBuilder`], which makes it |
//! | [`legendre`] | [`Legendre`]: a reduced Lagrangian on a Lie algebra, as an energy on its dual |
//! | [`family`] | [`Family`]: closures of the state and of parameters; [`Differentiable`] |
//! | [`euler_poincare`] | `.lagrangian(..)` and `.force(..)` of the builder |
//! | [`velocity`](mod@velocity) | `Π w_H + K w_S` for given covectors: differentials, or discrete gradients |
//! | [`noise`] | the terms of a dissipation as thermal noise, and the kinetic drift |
//! | [`verify`] | the laws of a model, sampled |
//! | [`laws`] | the laws of brackets and dissipations, and the functions that check them |

pub mod bracket;
pub mod builder;
pub mod dissipation;
pub mod euler_poincare;
pub mod exchange;
pub mod family;
pub mod in_numbers;
pub mod invariants;
pub mod laws;
pub mod legendre;
pub mod metriplectic;
pub mod noise;
pub mod orthogonal;
pub mod system;
pub mod vector_field;
pub mod velocity;
pub mod verification;
mod verified;
pub mod verify;

pub use bracket::{
    AlmostPoisson, AreaForm, Bracket, BracketArgs, BracketJet, ConstantPoisson, FieldPoisson,
    Force, ForcedLiePoisson, LiePoisson, Nambu, NaturalBracket, OfEntropy, Poisson, PoissonError,
    Symplectic, Zero,
};
pub use builder::{NoEnergy, Surroundings, SystemBuilder};
pub use dissipation::{
    CasimirDissipation, CometricDissipation, Dissipation, DissipationJet, FieldDissipation,
    FormError, KulkarniNomizu, MetricDissipation, NoDissipation, OnsagerDissipation,
    ProjectedDissipation, Scaled,
};
pub use exchange::{Bath, Contact, Port};
pub use family::{Differentiable, Family, FamilyBuilder, Frozen, Parametrised};
pub use in_numbers::InNumbers;
pub use invariants::Invariants;
pub use legendre::{Legendre, LegendreError};
pub use metriplectic::{Metriplectic, Point, SecondLaw};
pub use metriplectic_equations::{LawResidual, ModelError, Report, model_error, report};
pub use noise::{Boltzmann, NoiseTerms};
pub use system::{BuildError, Erase, NoEntropy, System};
pub use vector_field::VectorField;
pub use verification::{Verified, Verify};
