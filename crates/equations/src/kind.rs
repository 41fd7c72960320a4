//! Why a further invariant is conserved.

use std::fmt;

/// The reason why a function is conserved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The bracket annihilates it: `Π dC = 0`.
    Casimir,
    /// The energy is symmetric: `⟨dJ, Π dH⟩ = 0`.
    Momentum,
}

impl Kind {
    /// Returns its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Casimir => "Casimir",
            Self::Momentum => "momentum",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
