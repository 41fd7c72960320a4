//! Sweeps and ensembles: a thousand runs are one table.
//!
//! A [`Sweep`] lists rows of parameters. A closure builds the system of a row and returns its trajectory. The rows
//! run on all threads, and each one goes to a journal as soon as it is done. The [`Table`] has for each row its
//! parameters, its last state, the figures of its certificate, and what was observed, or the error.
//!
//! ```
//! use metriplectic_ensembles::{Shard, Sweep, linspace};
//! # use metriplectic_dynamics::System;
//! # use metriplectic_fields::Real;
//! # use metriplectic_integrators::{Run, Span};
//! # use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! # use nalgebra::{Vector3, vector};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = std::env::temp_dir().join(format!("metriplectic-sweep-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let journal = folder.join("relax.journal");
//! let table = Sweep::new("relax")
//!     .grid("friction", linspace(0.05, 1.0, 4))
//!     .samples(5)
//!     .random("spin", |draw| draw.uniform(-1.0..1.0))
//!     .run(|row| {
//!         let (friction, spin) = (row["friction"], row["spin"]);
//!         let body = System::on(LieDual::so3())
//!             .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
//!             .entropy(move |p: &Vector3<Real>| p.norm_squared() * (0.5 * friction))
//!             .build()?;
//!         Ok(WeylMidpoint.run(&body, vector![spin, -1.0, 0.3], Span::steps(0.1, 100).every(10))?)
//!     })
//!     .observe("p1", |p| p.x)
//!     .journal(&journal)                   // "relax.journal"; a second start goes on from it
//!     .shard(Shard::WHOLE)                 // Shard::from_environment()? on a cluster
//!     .execute()?;
//! println!("{table}");                     // relax: 20 rows, 0 failed …
//! table.quantiles("p1", [0.05, 0.5, 0.95])?;
//! # assert!(table.len() == 20 && table.failed() == 0 && table.to_string().contains("20 rows"));
//! # std::fs::remove_dir_all(folder)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Laws
//!
//! 1. The bytes of a table do not depend on threads, shards, machines with the same program and mathematical library,
//!    or how often the sweep was put down. After a kill this holds of the table with [`retry_failed`](Runs::retry_failed).
//! 2. Each row of the plan is in the table once, [done, failed or passed over](RowStatus), or it is
//!    [missing](Table::missing). A row is passed over if it was being run when the process was killed.
//! 3. A row [alone](Runs::only) has the bits of the same row in the table.
//! 4. A failed write ends the sweep with an error that has the rows so far.
//! 5. If any bytes are removed from the end of a journal, at most the rows of these bytes are run anew, and of a torn
//!    line there is one.
//! 6. [Samples that are added](Sweep::more_samples) change no row that was there.

mod bar;
mod doubling;
mod draw;
mod entry;
mod error;
mod estimate;
mod execution;
mod figures;
mod fingerprint;
mod interrupt;
mod journal;
mod listed;
#[cfg(feature = "serde")]
mod long;
mod plan;
mod record;
mod replaced;
mod row;
mod rows_file;
mod running;
mod runs;
mod shard;
mod sweep_error;
mod table;

pub use doubling::{DoubledPath, Doubling, DoublingError, StepAdviceError, StepBias};
pub use draw::Draw;
pub use entry::RowStatus;
pub use error::{JournalError, PlanError, TableError};
pub use estimate::{Estimate, FluctuationTheorem};
pub use plan::{Sweep, geomspace, linspace};
pub use record::{Crossing, Record, Recorded};
pub use row::Row;
pub use runs::Runs;
pub use shard::{Shard, ShardError};
pub use sweep_error::SweepError;
pub use table::{Series, Table, TableRow};
