//! Methods with stages for typed systems: of few variables, and of any on a curved space, in the types of the system; of many variables
//! on a vector space in plain numbers.

mod many;
mod stages;
