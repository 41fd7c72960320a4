//! Methods with stages for typed systems: of few variables, and of any on a curved space, in the types of the system; of many variables
//! on a vector space in plain numbers.

mod many;
mod stages;

use crate::implicit::StageNumbers;
use crate::numbers::AtRunTime;

/// The memory of [`Gauss`](crate::Gauss) and [`Radau`](crate::Radau) from one step to the next: the velocities of the stages, which are
/// continued; what rounding has lost of the position; with many variables, the linear part of the equation.
pub type StageMemory<N> =
    many::OfFewOrMany<crate::collocation::StageMemory<N>, StageNumbers<AtRunTime>>;
