//! Tests that run in a tenth of a second when they are optimised, and take twenty to compile then. They are compiled as
//! they stand. Their files are those of `tests/`.
