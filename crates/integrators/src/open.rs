//! Open systems: an energy that depends on time, ports that do work, baths that give heat, and a ledger of all of it.
//!
//! ```math
//! x' = \Pi\, dH + K\, dS + \sum_a F_a(t, x) + \sum_b R_b(t, x) \bigl( T_b\, dS - dH \bigr), \qquad H = H(t, x)
//! ```
//!
//! An open system is a closed one with a clock and a ledger. On `M × (τ, E, U_b)`, with the energy `H + E + Σ U_b` and the
//! entropy `S + Σ U_b/T_b`, the equation is metriplectic: the clock and the reservoirs are linear in both laws, so their
//! discrete gradients are constants, and they are eliminated from each step. Neither the clock nor the ledger is a
//! coordinate: an [`OpenState`] carries them beside the point, and no equation, norm or projection sees them.
//!
//! # The laws
//!
//! ```math
//! H(t, x) - W_t - \sum_a W_a - \sum_b Q_b = H_0, \qquad \Bigl( S + \sum_b S_b \Bigr)' = K(dS, dS) + \sum_b R_b(A_b, A_b)/T_b \ge 0
//! ```
//!
//! with `A_b = T_b dS − dH`. The left side of the first is the *energy* of an open run, and `S + Σ S_b` its *entropy*. Both
//! laws hold on every step of every method. So a run, its certificate, its outputs and its checkpoints treat an open
//! system as any other.
//!
//! # Frozen work
//!
//! The work `W_t` of a parameter is the change of `H` at a frozen state `z`,
//!
//! ```math
//! W_t = H(t', z) - H(t, z) + h \sum_i b_i \bigl( \partial_t H(t_i, X_i) - \partial_t H(t_i, z) \bigr) ,
//! ```
//!
//! and neither what is left over of the balance, which would make the first law empty, nor a quadrature of `∂_tH` alone: its error
//! would move a state near rest, and a protocol that jumps inside a step would do the wrong work at each step size.
//! The midpoint scheme takes the symmetric form `½ [H(t', x') − H(t, x') + H(t', x) − H(t, x)]`.

mod as_flow;
mod balance;
mod beside;
mod builder;
mod clock;
mod equations;
mod flow;
mod halves;
mod in_numbers;
mod midpoint;
mod noise;
mod projection;
mod stages;
mod state;
#[doc(hidden)]
pub mod surrounded;
mod system;
mod vector;
mod verify;
mod view;

#[doc(hidden)]
pub use crate::open_flow;
pub use beside::Beside;
pub use builder::{OpenBuilder, Opened, Opening, Timed, With};
pub use clock::{AtTime, Clock, InTime, OfTime, Still};
pub use equations::{EntriesAt, OpenEquations};
pub use in_numbers::OpenSteps;
pub use projection::OpenGradients;
pub use stages::NotDamped;
pub use state::{Booked, Ledger, OpenSpace, OpenState};
pub use surrounded::{Exchanged, OpenFlow, OpenJets};
pub use system::OpenSystem;
pub(crate) use system::StateOf;
pub use vector::OpenVector;
pub use verify::compare_with_values;
pub use view::{Closed, EnergyAt, Frozen};
