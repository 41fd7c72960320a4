//! How a metriplectic system moves in discrete time, with the first law kept to round-off.
//!
//! Each module is a room: a file in it uses files of its own room and of rooms above it in this table.
//!
//! | room | what it holds | knows |
//! |---|---|---|
//! | [`newton`] | [`Newton`]: the solver of an implicit midpoint step | |
//! | [`step`] | [`Flow`] and [`Stepper`]: what a run knows of a system and of a method; [`StepError`] | [`newton`] |
//! | [`round_off`] | covectors, laws and positions that are safe against round-off | [`step`] |
//! | [`discrete_gradient`] | [`DiscreteGradient`]: [`Gonzalez`], [`MeanValue`], [`ItohAbe`], [`SymmetricItohAbe`] | [`step`], [`round_off`] |
//! | [`midpoint`] | [`Scheme`]: the method of the paper, its equation and its fallbacks | [`step`], [`round_off`], [`discrete_gradient`], [`newton`] |
//! | [`collocation`] | [`Gauss`], [`Radau`]: methods with stages, of order `2s` and `2s − 1` | [`step`], [`round_off`] |
//! | [`explicit`] | [`DormandPrince8`], [`DormandPrince5`], [`RungeKuttaChebyshev`]: explicit methods, and then back onto the laws | [`step`], [`round_off`] |
//! | [`system`] | every metriplectic system is a flow | [`step`], [`round_off`], [`explicit`] |
//! | [`numbers`] | [`FromEquations`]: a system in plain numbers is a flow | [`step`], [`round_off`], [`explicit`], [`system`] |
//! | `implicit` | implicit methods of models in plain numbers, of any size: the [`Scheme`], [`Gauss`] and [`Radau`] of [`FromEquations`] | [`newton`], [`step`], [`round_off`], [`discrete_gradient`], [`midpoint`], [`collocation`], [`system`], [`numbers`] |
//! | `compiled` | methods in plain numbers, one instance for each number of directions and entries | [`step`], [`explicit`], [`numbers`], `implicit` |
//! | [`run`] | [`Method`], [`Span`], [`Until`], [`Watch`], [`Steps`], [`Trajectory`], [`Event`], [`Certificate`], [`Checkpoint`], [`Observables`]: what a user does with a run of any method | [`step`], [`round_off`], [`numbers`], `implicit`, `compiled` |
//! | [`noise`](mod@noise) | [`Noisy`]: a system with thermal noise; [`NinomiyaVictoir`], [`RandomFlow`], which sample its law with any method | [`step`], [`explicit`] |
//! | [`open`](mod@open) | [`OpenSystem`]: a clock in the energy, ports, baths and a ledger, for every method | [`step`], [`round_off`], [`discrete_gradient`], [`midpoint`], [`collocation`], [`explicit`], [`system`], [`numbers`], `implicit`, [`noise`](mod@noise) |
//! | `default_scheme` | a retraction is a method: its [`Scheme`] with the default options | [`step`], [`midpoint`] |
//! | [`attitude`] | [`Attitude`]: where a body points along a run of its angular momentum | [`run`], [`round_off`] |
//! | [`tangent`](mod@tangent) | [`Tangents`]: the derivative of a run along its start and parameters | [`step`], [`discrete_gradient`], [`newton`], [`midpoint`], [`explicit`], [`run`] |
//! | [`error`](mod@error) | [`Error`]: everything that can go wrong, for `?` | those with an error of their own |
//! | [`laws`] | what a step and a method promise, and the functions that check it | all of them |
//!
//! # What a later version may add
//!
//! Results are `#[non_exhaustive]`: [`Certificate`], [`InvariantBalance`], [`State`], [`Effort`], [`Evidence`], and the report of a
//! model. A later version may add a field to them; a pattern ends in `..`, and a changed copy is a clone whose
//! fields are assigned. So are errors and the other enums that may grow. Options are not, because
//! `Newton { iterations: 50, ..Newton::default() }` and `Scheme { splits: 4, ..Scheme::new(WeylMidpoint) }` are
//! how they are written: write the last part, and a new option has its default. What you pass to an equation
//! or return from one ([`Linearised`], [`Root`], [`Iterate`]) has all of its fields.

pub mod attitude;
pub mod collocation;
mod compiled;
mod default_scheme;
pub mod discrete_gradient;
pub mod error;
pub mod explicit;
mod implicit;
pub mod laws;
pub mod midpoint;
pub mod newton;
pub mod noise;
pub mod numbers;
pub mod open;
pub mod round_off;
pub mod run;
pub mod step;
pub mod system;
pub mod tangent;
mod typed;

pub use attitude::{Attitude, AttitudeError};
pub use collocation::{Gauss, Radau};
pub use discrete_gradient::{DiscreteGradient, Gonzalez, ItohAbe, MeanValue, SymmetricItohAbe};
pub use error::{Error, FlowError, RunError};
pub use explicit::{
    DormandPrince5, DormandPrince8, ExplicitRungeKutta, Row, RungeKuttaChebyshev, StageFlow,
    Tableau, TableauError,
};
pub use implicit::NoImplicitSteps;
pub use midpoint::{Residual, Scheme};
pub use newton::{Equation, Iterate, Linearised, Newton, Root, Rounding};
pub use noise::{
    Counter, Judged, NinomiyaVictoir, NoiseBuilder, NoiseError, Noisy, NoisyError, NoisyReport,
    RandomFlow, Sampler, Sampling,
};
pub use numbers::FromEquations;
pub use open::{NotDamped, OpenBuilder, OpenEquations, OpenSpace, OpenState, OpenSystem};
pub use round_off::stable_gradient::StableGradient;
pub use run::certificate::{
    Certificate, EventCount, InvariantBalance, MisjudgedSize, ProjectedSteps, RestInTime,
    StageBalance, UnsureEvent,
};
pub use run::checkpoint::{Checkpoint, ResumeError};
pub use run::event::Event;
pub use run::jump::{Jump, JumpBalance};
pub use run::observables::{Csv, Npy, Observables, ObservablesError};
pub use run::paired::Unpaired;
pub use run::span::Span;
pub use run::steps::Steps;
pub use run::trajectory::Trajectory;
pub use run::until::Until;
pub use run::watch::{Jumping, Watch, Watched};
pub use run::{
    Ending, Method, Method as Run, Schedule, Simulation, SpanError, State, StepSequence,
};
pub use step::{
    Compiled, Components, Control, Directions, Effort, Element, Entries, EntropyStep,
    EventExchange, Evidence, Excursion, Flow, GradientKind, Inlined, JumpError, Laws, LedgerErrors,
    LedgerSummary, LimitingSites, Listed, Memory, MethodError, NoiseSummary, Panicked, PathOfStep,
    PlainNumbers, Promises, Recheck, Refusal, RestoreError, Saved, Scales, StageLaws, StartError,
    StateSpace, StepEnds, StepError, StepStart, Stepper, Taken, Values, Vector,
};
pub use tangent::{
    AdjointRun, Adjoints, Differentiated, FamilySurroundings, Linearised as LinearisedStep,
    LinearisedAlong, LossGradient, SelfAdjoint, Sensitivity, SystemAt, Systems, TangentError,
    TangentEvent, TangentRun, TangentState, TangentSteps, Tangents, Unlinearised,
};
pub use typed::{MidpointMemory, StageMemory};
