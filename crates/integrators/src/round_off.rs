//! The care for round-off: none of it changes the equation of a step.
//!
//! | module | what it guards | how |
//! |---|---|---|
//! | [`stable_gradient`] | the covectors of a step | an integral beside a difference of nearly equal values |
//! | `drift` | the laws over millions of steps | a number that is added to `ΔF` |
//! | `compensation` | steps shorter than the last digit of the position | a compensated sum |
//! | `sum` | a balance through which much flows | a sum in two numbers |
//! | `bound` | all of these | the sizes to which round-off is relative |

pub(crate) mod bound;
pub(crate) mod compensation;
pub(crate) mod drift;
pub mod stable_gradient;
pub(crate) mod sum;
