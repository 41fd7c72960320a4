//! The promises of the page of guarantees, and where they stand.

use serde::{Deserialize, Serialize};

/// The subject of a table of the report, in the order of the page of guarantees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Guarantee {
    /// Every method on every kind of flow.
    Kinds,
    /// The first law.
    Energy,
    /// The second law.
    Entropy,
    /// Casimirs and momenta.
    Invariants,
    /// Casimirs of which the entropy becomes a function.
    DependentCasimirs,
    /// The order of convergence.
    Order,
    /// States against independent solutions.
    Accuracy,
    /// Steps that lead back.
    Symmetry,
    /// Other units.
    Units,
    /// Other charts.
    Charts,
    /// Ten million steps.
    LongRuns,
    /// Adaptive steps.
    Tolerance,
    /// States between steps.
    Outputs,
    /// Hard starts.
    HardSteps,
    /// Input without sense.
    RandomInput,
    /// Lattices.
    ManySites,
    /// Equal bits.
    Reproducibility,
    /// Many runs in one table.
    Sweeps,
    /// Heap allocations.
    Allocation,
    /// Friction faster than a step.
    StiffFriction,
    /// Thermal noise.
    Noise,
    /// Derivatives of runs, and fits.
    Derivatives,
}

/// A guarantee in words.
pub(super) struct Facts {
    /// The heading of its table.
    pub(super) heading: &'static str,
    /// The words that sentences of the page begin with, or contain, where it holds them.
    pub(super) sentences: &'static [&'static str],
    /// Figures of the gallery that show it.
    pub(super) figures: &'static [&'static str],
}

impl Guarantee {
    /// All of them.
    pub(super) const ALL: [Self; 22] = [
        Self::Kinds,
        Self::Energy,
        Self::Entropy,
        Self::Invariants,
        Self::DependentCasimirs,
        Self::Order,
        Self::Accuracy,
        Self::Symmetry,
        Self::Units,
        Self::Charts,
        Self::LongRuns,
        Self::Tolerance,
        Self::Outputs,
        Self::HardSteps,
        Self::RandomInput,
        Self::ManySites,
        Self::Reproducibility,
        Self::Sweeps,
        Self::Allocation,
        Self::StiffFriction,
        Self::Noise,
        Self::Derivatives,
    ];

    /// Its heading, its sentences and its figures.
    pub(super) const fn facts(self) -> Facts {
        let (heading, sentences, figures): (_, &[_], &[_]) = match self {
            Self::Kinds => (
                "Every method is right on every kind of flow, or says why not",
                &["asserts every run of this table", "✓"],
                &[],
            ),
            Self::Energy => (
                "Energy is constant to round-off",
                &[
                    "| energy, further invariants |",
                    "At every step of the runs in",
                    "Over 10⁶ steps of a tumbling body",
                    "The error is at most 1.6·10⁻¹⁵ for steps up to",
                ],
                &[],
            ),
            Self::Entropy => (
                "Entropy decreases on no step",
                &[
                    "\\(S\\) a Casimir |",
                    "At every step of the implicit scheme",
                    "A step on which \\(S\\) would fall",
                    "the published scheme lowers the entropy on 150 of 300 steps",
                    "the exact scheme takes 1.5 % more Newton iterations",
                ],
                &["gas_containers"],
            ),
            Self::Invariants => (
                "Casimirs and momenta are constant to round-off",
                &[
                    "| energy, further invariants |",
                    "conserves it to round-off and keeps its order",
                    "All four invariants of the Kovalevskaya top",
                ],
                &["kovalevskaya_top"],
            ),
            Self::DependentCasimirs => (
                "Both laws hold where the entropy becomes a function of a listed Casimir",
                &["The midpoint rule keeps both there", "All of this is in"],
                &[],
            ),
            Self::Order => (
                "Orders are fitted",
                &[
                    "| order |",
                    "conserves it to round-off and keeps its order",
                    "The order is 2 with",
                    "It is 5 and 8 with",
                    "have the orders 2 to 8",
                    "Sixteen problems are fitted",
                    "Formulas by hand check this velocity",
                    "Closed forms, and flows of gradients by hand",
                    "The orders 5 and 8 are fitted on",
                ],
                &["convergence", "convergence_rotations", "convergence_charts"],
            ),
            Self::Accuracy => (
                "Published problems are met to the digits of independent solutions",
                &["Problems that papers publish are met"],
                &["kepler", "learning_data"],
            ),
            Self::Symmetry => ("Symmetric steps lead back", &["| symmetric in time |"], &[]),
            Self::Units => ("A run in other units is the same run", &["A run in other units"], &[]),
            Self::Charts => (
                "A step in another chart is the same step",
                &["A step in two charts", "It is another step without"],
                &[],
            ),
            Self::LongRuns => {
                ("Errors do not grow over ten million steps", &["Over 10⁷ steps neither"], &[])
            }
            Self::Tolerance => (
                "Adaptive steps follow a tolerance",
                &[
                    "has the same laws in each step",
                    "A stiff start of a slow motion",
                    "Steps of one size would be",
                ],
                &["sphere_relaxation"],
            ),
            Self::Outputs => (
                "Outputs and events keep the laws",
                &[
                    "| outputs and events with the laws |",
                    "The tests of the explicit methods are in",
                    "States between the steps keep the laws",
                ],
                &["spinning_top"],
            ),
            Self::HardSteps => (
                "Hard starts end in a certified step or in an error",
                &[
                    "takes a step of the implicit scheme from 242 hard starts",
                    "218 of them have a solution",
                    "Each ends in a certified step",
                    "Of the other 24",
                ],
                &[],
            ),
            Self::RandomInput => {
                ("Input without sense never panics", &["**Fuzzed input** never panics"], &[])
            }
            Self::ManySites => (
                "Lattices keep both laws",
                &[
                    "A lattice has the same laws",
                    "With ports and baths implicit steps keep the balance of work and heat",
                ],
                &["heat_chain"],
            ),
            Self::Reproducibility => {
                ("The same inputs have the same bits", &["A run has the same bits each time"], &[])
            }
            Self::Sweeps => (
                "The table of a sweep does not depend on how it was run",
                &[
                    "has the same bytes for any number of threads and shards",
                    "Memory grows by the rows of the table alone",
                ],
                &["sweep"],
            ),
            Self::Allocation => ("A step allocates nothing", &["makes no heap allocation"], &[]),
            Self::StiffFriction => (
                "Friction faster than a step is damped by `Radau` and named with the others",
                &["is damped by `Radau` alone", "With every other method it is not"],
                &["colloid"],
            ),
            Self::Noise => (
                "Thermal noise samples its law with the order of its method",
                &[
                    "A path with thermal noise keeps its energy",
                    "Means over paths, and the law that they sample",
                    "Friction that is faster than a step is an error",
                ],
                &["thermal_rigid_body"],
            ),
            Self::Derivatives => (
                "Derivatives are those of the steps, and errors of fits are as large as they say",
                &[
                    "The tangent of a run is the derivative of the steps",
                    "The joint ellipsoid of 95 % holds the truth",
                    "by differences of runs in the same steps, agree with those by derivatives",
                    "Derivatives of state and heat of an oscillator in air are right",
                ],
                &["fit_metric"],
            ),
        };
        Facts { heading, sentences, figures }
    }

    /// The anchor of its heading in the report.
    pub(super) fn anchor(self) -> String {
        let letters = self.facts().heading.to_lowercase();
        letters.replace(' ', "-").chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
    }
}
