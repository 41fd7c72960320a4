//! The laws of the library for each space, bracket and friction.

mod laws;
