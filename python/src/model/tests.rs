//! The laws of the library for each space, bracket and friction; runs beside those in types; and what is refused.

mod laws;
mod refused;
mod runs;
