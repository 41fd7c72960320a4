//! Fields recorded as a tape: gradients whose cost does not grow with the dimension.
//!
//! A closure over [`Real`] has its derivatives by dual numbers: `⌈n/2⌉` evaluations for a gradient and
//! `n(n+1)/2` for a Hessian. The same function as a list of instructions, a [`Tape`], has its gradient by one
//! sweep forward and one back, and its Hessian by `n` of them (Griewank and Walther 2008, §3.2 and §3.4).
//!
//! | module | what it holds |
//! |---|---|
//! | [`tape`] | [`Tape`]: instructions over registers, from a recording or from plain numbers |
//! | [`op`] | [`Op`]: the operations |
//! | [`recorded`] | [`Recorded`]: a scalar that records what is done with it |
//! | [`record`](mod@record) | [`record()`]: a function becomes a tape |
//! | [`recordable`] | [`field!`] and [`Recordable`]: closures that can be recorded |
//! | [`branchless`] | [`Branchless`]: choices that a tape can hold |
//! | [`recorded_field`] | [`RecordedField`]: a closure with its tape |
//! | [`tape_field`] | [`TapeField`], [`TapeMatrix`]: tapes as fields |
//! | [`entries`] | [`PointEntries`]: the entries of a point at any scalar |

mod book;
pub mod branchless;
pub mod entries;
pub mod op;
pub mod record;
pub mod recordable;
pub mod recorded;
pub mod recorded_field;
mod room;
mod second_order;
mod simplify;
mod sweep;
pub mod tape;
pub mod tape_field;

pub use branchless::Branchless;
pub use entries::PointEntries;
pub use metriplectic_fields::Real;
pub use op::Op;
pub use record::{RecordingError, record};
pub use recordable::Recordable;
pub use recorded::Recorded;
pub use recorded_field::RecordedField;
pub use tape::{Instruction, Parts, Tape, TapeError};
pub use tape_field::{TapeField, TapeMatrix};
