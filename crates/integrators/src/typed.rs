//! Implicit methods for typed systems: of few variables, and of any on a curved space, in the types of the system; of many variables
//! on a vector space in plain numbers.

#[cfg(test)]
#[macro_use]
mod ring;

mod many;
mod schemes;
mod stages;

use crate::implicit::{MidpointNumbers, StageNumbers};
use crate::numbers::AtRunTime;

/// The memory of [`Gauss`](crate::Gauss) and [`Radau`](crate::Radau) from one step to the next: the velocities of the stages, which are
/// continued; what rounding has lost of the position; with many variables, the linear part of the equation.
pub type StageMemory<N> =
    many::OfFewOrMany<crate::collocation::StageMemory<N>, StageNumbers<AtRunTime>>;

/// The memory of a [`Scheme`](crate::Scheme) from one step to the next: the displacements, from which the next one is
/// extrapolated; the inverse of a Jacobian, which is used as long as it contracts; and what rounding has
/// lost of the position.
pub type MidpointMemory<N> =
    many::OfFewOrMany<crate::midpoint::MidpointMemory<N>, MidpointNumbers<AtRunTime>>;
