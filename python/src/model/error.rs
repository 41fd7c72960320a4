//! Definitions that make no system.

use metriplectic_manifolds::AlgebraError;
use metriplectic_recording::TapeError;

/// A definition that makes no system.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DefinitionError {
    /// A space without variables.
    #[error("a space has at least one variable")]
    NoVariables,
    /// A sphere that the library does not have.
    #[error("the spheres are S^1 to S^7, and not S^{n}")]
    Sphere {
        /// Its dimension.
        n: usize,
    },
    /// An index beyond a dimension.
    #[error("the index {index} is beyond the dimension {n}: indices are 0 to n − 1")]
    Index {
        /// The index.
        index: usize,
        /// The dimension.
        n: usize,
    },
    /// Structure constants that are not those of a Lie algebra.
    #[error(transparent)]
    Algebra(AlgebraError),
    /// A tape has not the inputs or the outputs of its part.
    #[error(
        "the tape of the {part} takes {inputs} numbers and gives {outputs}, and on this space it takes {expected_inputs} and gives {expected_outputs}"
    )]
    Shape {
        /// The part.
        part: &'static str,
        /// The inputs of the tape.
        inputs: usize,
        /// Its outputs.
        outputs: usize,
        /// The inputs that it should have.
        expected_inputs: usize,
        /// The outputs that it should have.
        expected_outputs: usize,
    },
    /// The outputs of a tape of contacts are not a whole number of them.
    #[error(
        "the tape of the friction gives {outputs} numbers, and each contact has a rate and {velocities} more"
    )]
    Contacts {
        /// The outputs of the tape.
        outputs: usize,
        /// The numbers of a velocity.
        velocities: usize,
    },
    /// A tape that cannot be used.
    #[error("the tape of the {part}: {source}")]
    Tape {
        /// The part.
        part: &'static str,
        /// Why.
        source: TapeError,
    },
    /// A part that may not depend on time does.
    #[error(
        "the {part} depends on the time, and only energy, bracket and friction may: a state that stands still keeps its entropy, its invariants and its lengths"
    )]
    InTime {
        /// The part.
        part: &'static str,
    },
    /// Another number of parameters than the definition has.
    #[error("there are {expected} parameters, not {found}")]
    Parameters {
        /// How many were given.
        found: usize,
        /// How many there are.
        expected: usize,
    },
    /// A parameter that is no number.
    #[error("the parameter `{name}` is {value}; every parameter must be a finite number")]
    ParameterNotFinite {
        /// Its name.
        name: String,
        /// Its value.
        value: f64,
    },
    /// A bracket on a space that does not have it.
    #[error("{bracket} is not on {space}: {remedy}")]
    Bracket {
        /// The bracket.
        bracket: &'static str,
        /// The space.
        space: String,
        /// Where it is.
        remedy: &'static str,
    },
    /// Another number of brackets than the product has factors.
    #[error(
        "a sum of {found} brackets is not on {space}, which has {expected} factors: give one for each, and none where nothing moves"
    )]
    Blocks {
        /// How many brackets were given.
        found: usize,
        /// How many factors there are.
        expected: usize,
        /// The space.
        space: String,
    },
    /// An entry of a constant tensor that is no number.
    #[error("entry ({row}, {column}) of the Poisson tensor is not a finite number")]
    TensorNotFinite {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// A constant tensor that is not skew.
    #[error(
        "the Poisson tensor is not skew: entries ({row}, {column}) and ({column}, {row}) add up to {size:.3e}"
    )]
    TensorNotSkew {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// `|Π_ij + Π_ji|`.
        size: f64,
    },
    /// A constant tensor with another number of entries.
    #[error("the Poisson tensor has {found} entries, and {n} × {n} are expected")]
    TensorSize {
        /// How many entries were given.
        found: usize,
        /// The rows and the columns.
        n: usize,
    },
    /// A friction without an entropy that it produces.
    #[error(
        "a friction produces entropy, and there is none: give an entropy, or leave the friction out"
    )]
    FrictionWithoutEntropy,
    /// A recorded metric on a space that is not flat.
    #[error(
        "a recorded metric is for flat spaces, and {space} is not: leave it out there for the canonical metric"
    )]
    Metric {
        /// The space.
        space: String,
    },
}
