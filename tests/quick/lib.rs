//! Tests that run in less than half a second when they are optimised, and take much longer to compile then. They are compiled
//! as they stand. Their files are those of `tests/`.
