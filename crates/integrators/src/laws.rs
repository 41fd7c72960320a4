//! What a step promises, and the function that checks it.
