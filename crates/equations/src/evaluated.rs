//! The origin of the derivatives of a field.

use std::fmt;

/// A field of a system, and what its derivatives are computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Evaluated {
    /// The name of the field, such as `energy`.
    pub field: &'static str,
    /// Its origin of derivatives.
    pub from: Evaluation,
}

impl Evaluated {
    /// Makes the list of a system from the names and evaluations of its fields; empty where none is written to be recorded.
    pub fn list(fields: impl IntoIterator<Item = (&'static str, Evaluation)>) -> Vec<Self> {
        let list: Vec<_> = fields.into_iter().map(|(field, from)| Self { field, from }).collect();
        if list.iter().all(|part| part.from == Evaluation::Function) { Vec::new() } else { list }
    }
}

impl fmt::Display for Evaluated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { field, from } = self;
        write!(f, "{field} ")?;
        match from {
            Evaluation::Function => write!(f, "not recorded"),
            Evaluation::Tape => write!(f, "by its tape"),
            Evaluation::FewVariables(n) => {
                write!(
                    f,
                    "recorded, with gradients by its closure, which is faster with {n} variables"
                )
            }
            Evaluation::Recordable => write!(f, "by its closure, until `recorded` is called"),
            Evaluation::Branches { file, line } => {
                write!(f, "by its closure, which branches on the state at {file}:{line}")
            }
            Evaluation::Unrecordable => write!(f, "by its closure, which cannot be recorded"),
        }
    }
}

/// The origin of the derivatives of a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Evaluation {
    /// The function as it was given, which is not written to be recorded.
    #[default]
    Function,
    /// The tape of its recording.
    Tape,
    /// The function for gradients, although there is a recording that agrees with it: with so few variables the function is faster.
    FewVariables(usize),
    /// The function. Its recording would be faster, and has not been made.
    Recordable,
    /// The function, which cannot be recorded because it branches on the state.
    Branches {
        /// The file of the branch.
        file: &'static str,
        /// Its line.
        line: u32,
    },
    /// The function, which cannot be recorded for another reason: an attempt says which.
    Unrecordable,
}
