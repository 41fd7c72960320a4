//! The values that closures of a model may be, and the compiler's errors about others.
