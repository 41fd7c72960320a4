//! Fields with many variables: closures that are recorded once, and differentiated by sweeps along the recording.
//!
//! A closure has its gradient by dual numbers, in `⌈n/2⌉` evaluations, and its Hessian in `n(n+1)/2`. So the cost of a step
//! grows like `n²` for an energy whose terms are `n`. Written by [`field!`](crate::recording::field) and
//! [recorded](crate::recording::Recordable::recorded) at a state, the same closure is a list of instructions too, a
//! [`Tape`](crate::recording::Tape), whose gradient costs as much as two or three evaluations:
//!
//! ```
//! use metriplectic::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! /// Toda's ring of twelve particles, `Σ p²/2 + exp(q_{i+1} − q_i)`.
//! fn ring<D: Scalar>(x: &SVector<D, 24>) -> D {
//!     (0..12).fold(D::zero(), |sum, i| {
//!         let (q, p, next) = (x[i], x[12 + i], x[(i + 1) % 12]);
//!         sum + p * p * 0.5 + (next - q).exp()
//!     })
//! }
//!
//! let space = Euclidean::<24>;
//! let start = SVector::<f64, 24>::from_fn(|k, _| (k as f64).sin() * 0.3);
//! let energy = field!(|x: &SVector<Real, 24>| ring(x)).recorded(&space, &start)?;
//! println!("{}", energy.tape());
//!
//! let recorded = System::on(space).bracket(Symplectic).energy(energy).build()?;
//! let plain = System::on(space)
//!     .bracket(Symplectic)
//!     .energy(|x: &SVector<Real, 24>| ring(x))
//!     .build()?;
//! let span = Span::steps(0.05, 40);
//! let a = DormandPrince8.run(&recorded, start, span)?;
//! let b = DormandPrince8.run(&plain, start, span)?;
//! assert!((a.last().point - b.last().point).norm() < 1e-13);
//! # Ok(())
//! # }
//! ```
//!
//! # What it costs
//!
//! Instructions of one evaluation of a ring with three variables and one `exp` a site, by callgrind:
//!
//! | variables | gradient, closure | gradient, tape | Hessian, closure | Hessian, tape |
//! |--:|--:|--:|--:|--:|
//! | 6 | 576 | 2124 | 12,045 | 14,452 |
//! | 12 | 5995 | 4197 | 81,540 | 35,991 |
//! | 24 | 28,714 | 8167 | 715,868 | 86,144 |
//! | 48 | 120,747 | 19,607 | 5,931,070 | 275,868 |
//!
//! Derivatives of the energy are a part of a step. Instructions of whole steps of a ring of eight oscillators with heat, 24 variables
//! (rows `run/ring_24` of `just instructions`):
//!
//! | method | closures | tapes |
//! |---|--:|--:|
//! | `DormandPrince5` | 145,625 | 60,898 |
//! | `DormandPrince8` | 291,809 | 114,277 |
//! | `WeylMidpoint` | 114,357 | 68,696 |
//! | `Gauss::<3>` | 748,105 | 618,209 |
//! | `Radau::<2>` | 965,198 | 834,429 |
//!
//! The [certificate](crate::integrators::Certificate::evaluated) of a run says which fields are evaluated from a recording, and why others are not.
//! A recorded field takes the faster one of closure and tape by itself. A sweep needs room for a few numbers for each
//! operation, and each thread keeps it from one evaluation to the next.
//!
//! # What can be recorded
//!
//! The macro writes the closure twice, with two meanings of the name `Real`. So the name must stand in it, and
//! what the closure moves must be `Copy` or a reference. Functions that it calls are generic in a
//! [`Scalar`](crate::fields::Scalar). Norms, products, determinants and the other linear algebra of nalgebra are recorded.
//!
//! | the closure | is refused | write |
//! |---|---|---|
//! | branches on the state, `if x < y` | [`Branches`](crate::recording::RecordingError::Branches), with file and line | [`x.less(y).select(a, b)`](crate::recording::Branchless), `least`, `greatest` |
//! | reads a value, `x.re()` | the same | arithmetic with `x` |
//! | inverts a matrix, and so asks whether it is singular; a determinant of four rows and more pivots | the same | the adjugate over the determinant, or the closure as it is |
//! | draws random numbers, counts its calls | [`Differs`](crate::recording::RecordingError::Differs) | a captured number |
//! | computes in another thread, or keeps numbers of another call | [`Foreign`](crate::recording::RecordingError::Foreign) | all within one call |
//! | has copies that differ | [`Disagrees`](crate::recording::RecordingError::Disagrees) | one text for both |
//!
//! A captured number is that of the recording. A tape can also come from elsewhere, as plain numbers:
//! [`Tape::from_parts`](crate::recording::Tape::from_parts), [`TapeField`](crate::recording::TapeField) and
//! [`TapeMatrix`](crate::recording::TapeMatrix) make fields of it without a closure.
