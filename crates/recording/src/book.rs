//! The instructions that a thread is recording.

use std::cell::RefCell;
use std::panic::Location;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::tape::{Instruction, MOST_REGISTERS};
use crate::{Op, Recorded, RecordingError, Tape, TapeError};

/// The book of a constant, which belongs to every recording.
const EVERY: u32 = 0;

/// The book of a number that was computed where none was open.
const LOST: u32 = u32::MAX;

thread_local! {
    static OPEN: RefCell<Option<Book>> = const { RefCell::new(None) };
}

struct Book {
    /// Which recording this is: no other has the number, in any thread.
    number: u32,
    inputs: usize,
    code: Vec<Instruction>,
    /// The first reason why this is not a recording.
    error: Option<RecordingError>,
}

/// The place of a number in a book.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Identity {
    book: u32,
    register: u32,
}

impl Identity {
    pub(crate) const CONSTANT: Self = Self { book: EVERY, register: 0 };

    #[inline]
    pub(crate) fn is_constant(self) -> bool {
        self.book == EVERY
    }
}

impl Book {
    fn open(inputs: usize) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let mut number = EVERY;
        while number == EVERY || number == LOST {
            number = NUMBER.fetch_add(1, Ordering::Relaxed);
        }
        Self { number, inputs, code: Vec::new(), error: None }
    }

    fn push(&mut self, instruction: Instruction) -> u32 {
        let register = self.inputs + self.code.len();
        match u32::try_from(register) {
            Ok(place) if register < MOST_REGISTERS => {
                self.code.push(instruction);
                place
            }
            _ => {
                self.error.get_or_insert(TapeError::TooLarge.into());
                0
            }
        }
    }

    /// Returns the register of a number, which is an instruction of its own for a constant.
    fn register(&mut self, number: Recorded) -> u32 {
        if number.identity.is_constant() {
            return self.push(Instruction {
                op: Op::Literal,
                operands: [0; 3],
                constant: number.value,
            });
        }
        if number.identity.book != self.number {
            self.error.get_or_insert(RecordingError::Foreign);
            return 0;
        }
        number.identity.register
    }
}

/// Writes an instruction into the open book, and returns the number that it defines.
pub(crate) fn put(op: Op, numbers: &[Recorded], constant: f64, value: f64) -> Recorded {
    let identity = OPEN.with_borrow_mut(|open| match open {
        Some(book) => {
            let mut operands = [0; 3];
            for (operand, number) in operands.iter_mut().zip(numbers) {
                *operand = book.register(*number);
            }
            let register = book.push(Instruction { op, operands, constant });
            Identity { book: book.number, register }
        }
        None => Identity { book: LOST, register: 0 },
    });
    Recorded { identity, value }
}

/// Notes that the function asks for the value of a number that depends on its inputs.
#[track_caller]
pub(crate) fn asked(question: &'static str) {
    let place = Location::caller();
    OPEN.with_borrow_mut(|open| {
        if let Some(book) = open {
            let (file, line) = (place.file(), place.line());
            book.error.get_or_insert(RecordingError::Branches { question, file, line });
        }
    });
}

/// Records a function at the point `x`. What was being recorded before goes on afterwards, also if `f` panics.
pub(crate) fn write(
    x: &[f64],
    f: impl FnOnce(&[Recorded]) -> Vec<Recorded>,
) -> Result<Tape, RecordingError> {
    struct Restored(Option<Book>);
    impl Drop for Restored {
        fn drop(&mut self) {
            OPEN.set(self.0.take());
        }
    }

    if x.len() > MOST_REGISTERS {
        return Err(TapeError::TooLarge.into());
    }
    let book = Book::open(x.len());
    let number = book.number;
    let _restored = Restored(OPEN.replace(Some(book)));
    let inputs: Vec<Recorded> = (0..)
        .zip(x)
        .map(|(register, &value)| Recorded { identity: Identity { book: number, register }, value })
        .collect();
    let outputs = f(&inputs);
    // It is open, unless a destructor of `f` has opened another one and leaked it.
    let Some(mut book) = OPEN.take() else { return Err(RecordingError::Foreign) };
    let outputs = outputs.into_iter().map(|number| book.register(number)).collect();
    match book.error {
        Some(error) => Err(error),
        None => Ok(Tape::new(book.inputs, book.code, outputs)?),
    }
}
