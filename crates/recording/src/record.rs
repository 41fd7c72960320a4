//! How a function becomes a tape.

use thiserror::Error;

use crate::{Recorded, Tape, TapeError, book};

/// Records a function of the inputs `x` as a simplified [`Tape`].
///
/// The function is called twice, at `x` and at other numbers, and both recordings must have the same instructions and the
/// same bits in their constants. A function that draws random numbers, counts its calls or reads a clock is refused.
///
/// # Examples
///
/// ```
/// use metriplectic_recording::record;
/// use num_dual::DualNum;
/// let tape = record(&[0.5, 2.0], |x| vec![x[0] * x[1] + x[0].sin()])?;
/// assert_eq!(tape.to_string(), "r2 = sin(r0)\nr3 = mul_add(r0, r1, r2)\nreturn r3");
/// # Ok::<(), metriplectic_recording::RecordingError>(())
/// ```
///
/// # Errors
///
/// A [`RecordingError`] if the function asks for the value of a number, or if its recordings differ.
pub fn record(x: &[f64], f: impl Fn(&[Recorded]) -> Vec<Recorded>) -> Result<Tape, RecordingError> {
    // No number of a recording depends on the inputs: at a negative input a root is NaN, and recorded all the same.
    let other: Vec<f64> = x.iter().map(|x| x * 1.125 + 0.125).collect();
    let (tape, again) = (book::write(x, &f)?, book::write(&other, &f)?);
    if tape == again {
        return Ok(tape.simplified());
    }
    let mut pairs = tape.code().iter().zip(again.code());
    let instruction = pairs.position(|(a, b)| a != b);
    let shorter = tape.code().len().min(again.code().len());
    Err(RecordingError::Differs { instruction: instruction.unwrap_or(shorter) })
}

/// A function that cannot be recorded.
#[derive(Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The function asks for the value of a number that depends on the state, and may branch on it.
    #[error(
        "the field asks for {question} of a number that depends on the state, at {file}:{line}: what it does at another state is not on the tape. Write the choice by `Branchless::select`, or use the closure without recording it"
    )]
    Branches {
        /// The question.
        question: &'static str,
        /// The file of the question.
        file: &'static str,
        /// Its line.
        line: u32,
    },
    /// The function uses a number of another recording or of another thread.
    #[error(
        "the field uses a number of another recording, or one that another thread computed: form all numbers within one call, from its argument"
    )]
    Foreign,
    /// Two calls do not compute the same.
    #[error(
        "two calls of the field differ from instruction {instruction} on: a recorded field draws no random numbers, counts no calls and reads no clock"
    )]
    Differs {
        /// The first instruction that differs.
        instruction: usize,
    },
    /// The tape and the closure give different numbers.
    #[error(
        "the recorded {quantity} is {recorded:e} and that of the closure {closure:e}: both copies of the closure must compute the same, from what they capture and from the state alone"
    )]
    Disagrees {
        /// The value or a component of the differential.
        quantity: &'static str,
        /// The number of the tape.
        recorded: f64,
        /// The number of the closure.
        closure: f64,
    },
    /// The recording is no tape.
    #[error(transparent)]
    Tape(#[from] TapeError),
    /// The tape has not the inputs of a point, or not the outputs of a field.
    #[error(
        "the tape takes {inputs} numbers and gives {outputs}, and a field of this kind on this space takes {entries} and gives {expected}"
    )]
    Shape {
        /// The inputs of the tape.
        inputs: usize,
        /// The outputs of the tape.
        outputs: usize,
        /// The entries of a point.
        entries: usize,
        /// The numbers that a field of this kind gives.
        expected: usize,
    },
}

metriplectic_equations::debug_is_the_sentence!(RecordingError);
