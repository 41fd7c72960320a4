//! The laws of an implementation, and the functions that check them.
