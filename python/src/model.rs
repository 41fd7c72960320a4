//! Systems of run-time size made of tapes, which answer the questions of the library in plain numbers.
//!
//! ```math
//! x' = \Pi(x)\, dH + K_{dH}(x)\, dS .
//! ```
//!
//! A [`Definition`] is a space with tapes for energy, entropy, bracket, friction and metric. [`Recorded`] is the system at values of the
//! parameters: it implements `Equations`, `Model` and `FrictionTerms` of the library with exact derivatives.
//!
//! | module | what it holds |
//! |---|---|
//! | [`space`] | [`Space`]: flat spaces, duals of Lie algebras, spheres, attitudes, positive numbers, and their products |
//! | [`definition`] | [`Definition`], [`Bracket`], [`Friction`] |
//! | [`recorded`] | [`Recorded`] |
//! | [`error`] | [`DefinitionError`] |
//! | `factor`, `layout`, `paths` | the charts and paths of the factors of a space, side by side |
//! | `law`, `field`, `tapes` | tapes as functions and as tensors on a space |
//! | `bracket`, `friction`, `metric`, `normals` | the parts of the motion |
//! | `along` | the derivatives along parameters |

mod algebra;
mod along;
mod bracket;
pub mod definition;
pub mod error;
mod factor;
mod field;
mod friction;
mod law;
mod layout;
mod metric;
mod normals;
mod paths;
mod reals;
pub mod recorded;
pub mod space;
mod tapes;

pub use definition::{Bracket, Definition, Friction};
pub use error::DefinitionError;
pub use recorded::Recorded;
pub use space::Space;

#[cfg(test)]
mod tests;
