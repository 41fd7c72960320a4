//! What fields promise: both doors give the same derivatives, the laws hold and can be broken, and
//! what is not a number shows.

mod laws;
mod not_a_number;
mod spaces;
mod subject;
mod taylor_lift;
