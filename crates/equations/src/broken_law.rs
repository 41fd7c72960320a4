//! A law that does not hold.

/// A law that does not hold, with the size of the violation.
#[derive(Clone, PartialEq, thiserror::Error)]
#[error("law broken: {law}: {size:.3e}, where {bound:.1e} is allowed")]
pub struct BrokenLaw {
    /// The law as a sentence.
    pub law: &'static str,
    /// The size of the violation.
    pub size: f64,
    /// The size that is allowed.
    pub bound: f64,
}

crate::debug_is_the_sentence!(BrokenLaw);

impl BrokenLaw {
    /// Returns `Ok` if `size ≤ bound`. NaN breaks every law.
    ///
    /// # Errors
    ///
    /// The broken law.
    pub fn unless(law: &'static str, size: f64, bound: f64) -> Result<(), Self> {
        if size <= bound { Ok(()) } else { Err(Self { law, size, bound }) }
    }
}
