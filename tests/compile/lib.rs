//! The values that closures of a model may be, the compiler's errors about others, and what works with what.
