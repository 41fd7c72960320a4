//! Measurements of what the library claims.
//!
//! A claim of this project is a number with an uncertainty, and the examples, the tests and the
//! benches all read it off the same instruments:
//!
//! | module | question | answer |
//! |---|---|---|
//! | [`order`] | how fast does the error fall with the step? | [`Order`]: the fitted slope, its 95 % interval, the points left out as round-off |
//! | [`convergence`] | how do schemes compare? | [`Convergence`]: errors, order, table and figure |
//! | [`problems`] | on what, on every manifold and metric? | [`problems::Orders`], [`problems::LargeSteps`], with flows by another method, [`problems::flow`] |
//! | [`either`] | with which retraction and gradient? | [`Either`] and [`AnyGradient`], chosen at run time |
//! | [`published`] | and by the scheme as published? | [`Compared`], [`problems::SecondLaws`] |
//! | [`drift`] | does the error grow with time? | [`Drift`]: flat, a random walk or a linear drift, in constant memory |
//! | [`claim`] | which test holds a guarantee, by which figure? | [`Claim`], and the report of all |
//! | [`checkpoints`] | is a run that was put down the same run? | [`checkpoints::reread`]: a checkpoint through its file |
//! | [`table`] | what does the study say, in rows? | [`Table`]: plain text and Markdown |
//! | [`plot`] | what does it look like? | [`Panels`] of lines and [`Map`]s, with a [`Globe`] beside them, and [`LogLog`]: SVG, the same bytes every time |
//! | [`example`] | what surrounds the model of an example? | [`Example`]: options, progress and the run; [`Record`]: its states |
//! | [`report`] | what does an example write? | [`Report`]: files, and text or one JSON object |
//! | [`gallery`] | where do pictures and words go? | [`Gallery`], [`Progress`], [`print()`], [`write_csv`] |
//! | [`interrupt`] | has Ctrl-C been pressed? | [`interrupted()`]: a long run stops where its file is whole |
//!
//! # Example
//!
//! The trapezoidal rule on `∫₀¹ eᵗ dt`, second order until round-off:
//!
//! ```
//! use metriplectic_studies::{Order, Table, scientific};
//!
//! let trapezoid = |n: u32| {
//!     let h = f64::from(n).recip();
//!     let inner: f64 = (1..n).map(|i| (h * f64::from(i)).exp()).sum();
//!     h * (0.5 + inner + 0.5 * 1_f64.exp())
//! };
//! let steps: Vec<f64> = (2..8).map(|k| 0.5_f64.powi(k)).collect();
//! let errors: Vec<f64> =
//!     (2..8).map(|k| (trapezoid(1 << k) - (1_f64.exp() - 1.0)).abs()).collect();
//!
//! let order = Order::fit(&steps, &errors)?;
//! assert!(order.agrees(2.0, 0.01), "measured {order}");
//!
//! let mut table = Table::new(["h", "error"]);
//! for (h, error) in steps.iter().zip(&errors) {
//!     table.row([h.to_string(), scientific(*error)]);
//! }
//! assert!(table.markdown().starts_with("| h "));
//! # Ok::<(), metriplectic_studies::OrderError>(())
//! ```

pub mod checkpoints;
pub mod claim;
pub mod convergence;
pub mod drift;
pub mod either;
pub mod example;
pub mod gallery;
pub mod interrupt;
pub mod order;
pub mod plot;
pub mod problems;
pub mod published;
pub mod report;
pub mod table;

mod axis;
mod frame;
mod globe;
mod header;
mod log_log;
mod map;
mod marker;
mod options;
mod panel;
mod panels;
mod student;

pub use claim::{Claim, Guarantee};
pub use convergence::Convergence;
pub use drift::{Drift, Growth, Slope};
pub use either::{AnyGradient, Either};
pub use example::{Example, Record};
pub use gallery::{Gallery, GalleryError, Progress, print, write_csv};
pub use interrupt::interrupted;
pub use map::Map;
pub use order::{Order, OrderError};
pub use plot::{Globe, LogLog, Panel, Panels, PlotError};
pub use published::Compared;
pub use report::Report;
pub use table::{Table, scientific};
