//! What a run did to its laws.

use std::fmt;

use metriplectic_dynamics::SecondLaw;

/// The balance of a run: what became of the two laws, of the manifold, and what it cost.
///
/// All figures of the laws are evaluated from the closures at the stored points, none from the
/// terms of the scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Certificate {
    /// The energy `H(x₀)`.
    pub initial_energy: f64,
    /// `max |H(x_k) − H(x₀)|`.
    pub max_energy_error: f64,
    /// The entropy `S(x₀)`; 0 without an entropy.
    pub initial_entropy: f64,
    /// `min (S(x_{k+1}) − S(x_k))`; 0 before the first step.
    pub min_entropy_increment: f64,
    /// `S(x_n) − S(x₀)`.
    pub entropy_gained: f64,
    /// Steps on which the entropy fell by more than its round-off
    /// `4ε (max(|S|, 1) + |dS||x|)`.
    pub entropy_falls: usize,
    /// `max` of the manifold's defect.
    pub max_manifold_defect: f64,
    /// Steps taken.
    pub steps: usize,
    /// Linear systems solved by Newton's method, in all steps.
    pub sweeps: usize,
    /// The same in the worst step.
    pub worst_sweeps: usize,
    /// How often a step was retried as two halves.
    pub retries: usize,
    /// How often the globaliser was called.
    pub globalised: usize,
    /// What the model promises about its entropy; serialized as the name of the variant.
    #[cfg_attr(feature = "serde", serde(serialize_with = "by_name"))]
    pub second_law: SecondLaw,
}

#[cfg(feature = "serde")]
fn by_name<S: serde::Serializer>(law: &SecondLaw, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{law:?}"))
}

impl Certificate {
    /// `max |H(x_k) − H(x₀)| / |H(x₀)|`; the absolute error if `H(x₀) = 0`.
    pub fn max_relative_energy_error(&self) -> f64 {
        if self.initial_energy == 0.0 {
            self.max_energy_error
        } else {
            self.max_energy_error / self.initial_energy.abs()
        }
    }

    /// Whether the first law was kept to round-off: `|H − H₀| ≤ 50 ε max(|H₀|, 1)`.
    pub fn keeps_energy(&self) -> bool {
        self.max_energy_error <= 50.0 * f64::EPSILON * self.initial_energy.abs().max(1.0)
    }

    /// Whether the entropy fell on no step by more than its round-off.
    pub const fn keeps_entropy(&self) -> bool {
        self.entropy_falls == 0
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "first law:   |H − H₀| ≤ {:.1e}, {:.1e} of H₀ = {:.6}, over {}",
            self.max_energy_error,
            self.max_relative_energy_error(),
            self.initial_energy,
            counted(self.steps, "step", "steps")
        )?;
        match self.second_law {
            SecondLaw::NoEntropy => writeln!(f, "second law:  no entropy, a Hamiltonian system"),
            SecondLaw::Published => {
                writeln!(f, "second law: not promised; {}", self.entropy_line())
            }
            _ => writeln!(f, "second law:  {}", self.entropy_line()),
        }?;
        writeln!(f, "manifold:    defect ≤ {:.1e}", self.max_manifold_defect)?;
        write!(
            f,
            "solver:      {} ({} in the worst step), {}",
            counted(self.sweeps, "Newton sweep", "Newton sweeps"),
            self.worst_sweeps,
            counted(self.retries, "retry", "retries")
        )
    }
}

impl Certificate {
    fn entropy_line(&self) -> String {
        let falls = match self.entropy_falls {
            0 => "it never fell".to_owned(),
            n => format!("it fell on {}", counted(n, "step", "steps")),
        };
        format!(
            "ΔS ≥ {:.1e} on every step, {falls}; S rose by {:.6e}",
            self.min_entropy_increment, self.entropy_gained
        )
    }
}

/// A number with its noun.
fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_FALL: Certificate = Certificate {
        initial_energy: 0.5,
        max_energy_error: 1e-16,
        initial_entropy: 1.0,
        min_entropy_increment: -2e-9,
        entropy_gained: 0.25,
        entropy_falls: 1,
        max_manifold_defect: 0.0,
        steps: 7,
        sweeps: 9,
        worst_sweeps: 2,
        retries: 1,
        globalised: 0,
        second_law: SecondLaw::Casimir,
    };

    #[test]
    fn one_is_no_plural() {
        let text = ONE_FALL.to_string();
        for part in ["over 7 steps", "fell on 1 step;", "9 Newton sweeps", "1 retry"] {
            assert!(text.contains(part), "\"{part}\" is missing in: {text}");
        }
        let text = Certificate { entropy_falls: 2, steps: 1, sweeps: 1, ..ONE_FALL }.to_string();
        for part in ["over 1 step\n", "fell on 2 steps;", "1 Newton sweep ("] {
            assert!(text.contains(part), "\"{part}\" is missing in: {text}");
        }
    }
}
