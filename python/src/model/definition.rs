//! The definition of a system: a space and tapes.

use metriplectic_equations::Kind;
use metriplectic_recording::Tape;

use super::error::DefinitionError;
use super::space::Space;

/// A metriplectic system `x' = Π dH + K dS` as tapes on a space.
///
/// A tape of a function of the state has the inputs `[x | t | θ]`: the entries of the state, the time and the parameters. That of a friction
/// has `[x | w | t | θ]`, with the covector `w` of the energy as it acts on [velocities](Space::velocities).
#[derive(Clone, Debug)]
pub struct Definition {
    /// The space of the states.
    pub space: Space,
    /// The names of the parameters `θ`.
    pub parameters: Vec<String>,
    /// The energy `H`, one output.
    pub energy: Tape,
    /// The entropy `S`, one output; without it the system is Hamiltonian.
    pub entropy: Option<Tape>,
    /// Further invariants `L_a`, one output each, with the reason why each is conserved.
    pub invariants: Vec<(Kind, Tape)>,
    /// The bracket `Π`.
    pub bracket: Bracket,
    /// The friction `K`.
    pub friction: Friction,
    /// The metric, a matrix of `n × n` outputs row by row on a flat space; `None` for the canonical one.
    pub metric: Option<Tape>,
}

/// A bracket on a space.
#[derive(Clone, Debug, Default)]
pub enum Bracket {
    /// No bracket: nothing moves without friction.
    #[default]
    None,
    /// `x'_b = C_ab^d ∂_aH x_d` on the dual of a Lie algebra.
    LiePoisson,
    /// `q' = ∂H/∂p`, `p' = −∂H/∂q` on `R²ᵏ` with the positions first, on `T*SO(3)` and on `S¹ × R`.
    Canonical,
    /// The area form of S², `x' = x × dH`.
    AreaForm,
    /// A constant skew matrix of a flat space, row by row.
    Constant(Vec<f64>),
    /// A recorded skew matrix on velocities, row by row.
    Recorded {
        /// The tape, with the inputs `[x | t | θ]`.
        tape: Tape,
        /// Whether it is to satisfy the Jacobi identity.
        is_poisson: bool,
    },
    /// A bracket on each factor of a product.
    Sum(Vec<Self>),
}

/// A friction on a space.
#[derive(Clone, Debug, Default)]
pub enum Friction {
    /// No friction.
    #[default]
    None,
    /// The dissipation of the metric, `K_w = κ (G*(w,w) G* − ♯w ♯wᵀ)`, which annihilates `w`; further invariants are projected out of it.
    Metric {
        /// The factor `κ ≥ 0`, a tape with the inputs `[x | t | θ]` and one output; 1 without it.
        factor: Option<Tape>,
    },
    /// A recorded symmetric matrix `K(x, w)` on velocities, row by row, which annihilates `w` itself.
    Recorded(Tape),
    /// A sum of contacts `Σ ρ b bᵀ` with `⟨w, b⟩ = 0`: for each one the rate `ρ ≥ 0`, followed by the velocity `b`.
    Contacts(Tape),
}

/// Refuses a tape with other inputs or outputs than these.
pub(super) fn expect(
    part: &'static str,
    tape: &Tape,
    expected_inputs: usize,
    expected_outputs: usize,
) -> Result<(), DefinitionError> {
    let (inputs, outputs) = (tape.inputs(), tape.outputs().len());
    if (inputs, outputs) == (expected_inputs, expected_outputs) {
        return Ok(());
    }
    Err(DefinitionError::Shape { part, inputs, outputs, expected_inputs, expected_outputs })
}
