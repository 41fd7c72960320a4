//! Structure-preserving integrators for metriplectic (GENERIC) systems, from closures for energy, entropy and metric.
//!
//! ```math
//! \dot x = \Pi(x)\, dH(x) + K(x)\, dS(x)
//! ```
//!
//! The Poisson tensor `Π` generates the reversible flow of the energy `H`. The positive semidefinite tensor `K`,
//! built from a Riemannian metric, produces the entropy `S` and conserves `H`. You write `H`, `S` and, if it is not the
//! canonical one, the metric. Dual numbers differentiate them. Every step conserves `H` to round-off, and `S` does not
//! decrease by more than round-off. It may decrease if it is no Casimir of the bracket, for which you ask by
//! [`SecondLaw::Published`](dynamics::SecondLaw::Published).
//!
//! ```
//! use metriplectic::prelude::*;
//!
//! fn main() -> Result<(), Error> {
//!     let body = System::on(LieDual::so3())
//!         .energy(|p: &Vector3<Real>| (p.x * p.x / 10.0 + p.y * p.y / 5.0 + p.z * p.z) * 0.5)
//!         .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//!         .build()?;
//!     let start = Vector3::new(0.001, -1.0, 0.001);
//!     let run = WeylMidpoint.run(&body, start, Span::steps(0.1, 1000))?;
//!     println!("{}", run.certificate());
//!     # assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
//!     Ok(())
//! }
//! ```
//!
//! Each method keeps both laws:
//!
//! | method | order | take it for |
//! |---|---|---|
//! | [`DormandPrince8`](integrators::DormandPrince8), [`DormandPrince5`](integrators::DormandPrince5) | 8, 5 | smooth motions, with steps that follow a tolerance |
//! | [`ExplicitRungeKutta`](integrators::ExplicitRungeKutta) | of its tableau | coefficients of your own |
//! | [`WeylMidpoint`](manifolds::WeylMidpoint) and the other [schemes](integrators::Scheme) of the paper | 2; `Exponential` 1 | long runs in steps of one size |
//! | [`Gauss`](integrators::Gauss) of 1 to 4 stages | 2 to 8 | the same with a smaller error; reversible in time |
//! | [`Radau`](integrators::Radau) of 2 to 4 stages | 3 to 7 | friction that is much faster than a step |
//! | [`RungeKuttaChebyshev`](integrators::RungeKuttaChebyshev) | 2 | stiff friction or conduction in many variables |
//!
//! The book in the folder `book/` of the repository (`mdbook serve book` shows it) is the introduction. It explains
//! the methods, units, tolerances and each line of the certificate. The guides go on from here:
//!
//! - begin with a model of the literature from [`models`];
//! - [choose](guide::choosing) bracket, dissipation and scheme;
//! - write [your own metric](guide::your_own_metric), or [your own manifold](guide::your_own_manifold) in sixty lines;
//! - prove the laws and orders of [methods with stages](guide::stages);
//! - read the paper [equation by equation](guide::equations), with its [errata](guide::errata).
//!
//! # The vocabulary
//!
//! | concept | in one line | where |
//! |---|---|---|
//! | [`Scalar`](fields::Scalar) | `f64` or a dual number over it; [`Real`](fields::Real) is the one a closure uses | [`fields`] |
//! | Field | a smooth function: [`ScalarField`](fields::ScalarField), [`MatrixField`](fields::MatrixField) | [`fields`] |
//! | [`Manifold`](manifolds::Manifold) | where points live, its frame, its charts | [`manifolds`] |
//! | [`Riemannian`](manifolds::Riemannian) metric | flat, sharp, norm, geodesics | [`manifolds`] |
//! | [`Retraction`](manifolds::Retraction) | `R_h`, `R_h⁻¹`: [`WeylMidpoint`](manifolds::WeylMidpoint), [`Exponential`](manifolds::Exponential) | [`manifolds`] |
//! | [`Bracket`](dynamics::Bracket) | `Π` | [`dynamics`] |
//! | [`Dissipation`](dynamics::Dissipation) | `K`, given the covector it must annihilate | [`dynamics`] |
//! | [`System`](dynamics::System) | all of these with `H` and `S` | [`dynamics`] |
//! | [`DiscreteGradient`](integrators::DiscreteGradient) | a covector with `⟨w, d⟩ = ΔH` | [`integrators`] |
//! | [`Newton`](integrators::Newton) | solves the equation of a step | [`integrators`] |
//! | [`Lattice`](lattices::Lattice) | many sites, from closures of a site and of a bond | [`lattices`] |
//! | [`Method`](integrators::Method) | a one-step method, such as [`Scheme`](integrators::Scheme) | [`integrators`] |
//! | [`Scheme`](integrators::Scheme) | one step: guess, solve, retract | [`integrators`] |
//! | [`field!`](recording::field) | a closure that can be recorded, for gradients by one sweep back | [`recording`] |
//! | [`Sweep`](ensembles::Sweep) | many runs, in one table | [`ensembles`] |
//! | [`Trajectory`](integrators::Trajectory) | the steps of a run, with their [`Certificate`](integrators::Certificate) | [`integrators`] |

pub mod guide;

pub use metriplectic_dynamics as dynamics;
#[cfg(all(feature = "ensembles", not(all(target_arch = "wasm32", target_os = "unknown"))))]
pub use metriplectic_ensembles as ensembles;
pub use metriplectic_equations as equations;
pub use metriplectic_fields as fields;
#[cfg(all(feature = "fitting", not(all(target_arch = "wasm32", target_os = "unknown"))))]
pub use metriplectic_fitting as fitting;
pub use metriplectic_integrators as integrators;
pub use metriplectic_lattices as lattices;
pub use metriplectic_manifolds as manifolds;
pub use metriplectic_models as models;
pub use metriplectic_recording as recording;
pub use nalgebra;

/// Everything that a program usually needs.
pub mod prelude {
    pub use metriplectic_dynamics::{
        AlmostPoisson, AreaForm, Bath, Boltzmann, CasimirDissipation, CometricDissipation, Contact,
        Differentiable, Erase, Family, FieldDissipation, Force, ForcedLiePoisson, KulkarniNomizu,
        Legendre, LiePoisson, MetricDissipation, Metriplectic, ModelError, Nambu, NoDissipation,
        OnsagerDissipation, Poisson, ProjectedDissipation, Scaled, SecondLaw, Symplectic, System,
        VectorField, Verify, Zero,
    };
    #[cfg(all(
        feature = "ensembles",
        not(all(target_arch = "wasm32", target_os = "unknown"))
    ))]
    pub use metriplectic_ensembles::{
        Doubling, Estimate, FluctuationTheorem, Row, RowStatus, Shard, Sweep, Table, geomspace,
        linspace,
    };
    pub use metriplectic_fields::{
        ErasedField, MatrixField, Piecewise, Real, Scalar, ScalarField, logarithmic_mean,
    };
    #[cfg(all(feature = "fitting", not(all(target_arch = "wasm32", target_os = "unknown"))))]
    pub use metriplectic_fitting::{Fit, FitError, Fitted};
    pub use metriplectic_integrators::{
        Adjoints, Attitude, AttitudeError, Certificate, Checkpoint, DormandPrince5, DormandPrince8,
        Ending, Error, Event, ExplicitRungeKutta, FamilySurroundings, Gauss, Gonzalez, Inlined,
        ItohAbe, MeanValue, Method, Newton, NinomiyaVictoir, NoiseBuilder, NoiseError, Noisy,
        NoisyError, Observables, OpenBuilder, OpenSpace, OpenState, OpenSystem, Radau, RandomFlow,
        ResumeError, Run, RunError, RungeKuttaChebyshev, Scheme, Simulation, Span, SpanError,
        StartError, State, StepError, Stepper, Steps, SymmetricItohAbe, Systems, Tableau, Tangents,
        Trajectory, Until, Watch,
    };
    pub use metriplectic_lattices::{
        BondState, Boundary, Graph, Lattice, LatticeError, NoisySurroundings, Onsager, OpenLattice,
        OpenSites, Points, Profiles, SiteState,
    };
    pub use metriplectic_manifolds::{
        Canonical, Cayley, Chart, ChartMidpoint, Euclidean, Exponential, HalfLine, Inert,
        LieAlgebra, LieDual, Manifold, Metric, Product, Projection, Retraction, Rotations, Sphere,
        WeylMidpoint,
    };
    pub use metriplectic_recording::{Branchless, RecordedField, field};
    /// The linear algebra of this library; its macros, such as `vector!`, look for it under this name.
    pub use nalgebra;
    pub use nalgebra::{
        Matrix1, Matrix2, Matrix3, Matrix4, Matrix5, Matrix6, SMatrix, SVector, Vector1, Vector2,
        Vector3, Vector4, Vector5, Vector6, matrix, vector,
    };
    pub use num_dual::DualNum;
}

/// The programs of the README, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
