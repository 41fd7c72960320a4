//! Parameters that make no model.

/// A parameter of a model that has no meaning there. It is the source of an [`Error`](metriplectic_integrators::Error), to which it can
/// be downcast.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[error("the parameter `{name}` is {value}; it must be {rule}")]
#[non_exhaustive]
pub struct ParameterError {
    /// The field of the model.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// The rule that it breaks.
    pub rule: &'static str,
}

metriplectic_equations::debug_is_the_sentence!(ParameterError);
metriplectic_integrators::passed_on_as_error!(ParameterError);

/// Checks masses, lengths, heat capacities and temperatures.
pub(crate) fn positive<const R: usize>(
    parameters: [(&'static str, f64); R],
) -> Result<(), ParameterError> {
    all(parameters, "a positive number", |value| value > 0.0)
}

/// Checks frictions and conductances, which may vanish.
pub(crate) fn not_negative<const R: usize>(
    parameters: [(&'static str, f64); R],
) -> Result<(), ParameterError> {
    all(parameters, "a number that is not negative", |value| value >= 0.0)
}

/// Checks parameters of either sign.
pub(crate) fn finite<const R: usize>(
    parameters: [(&'static str, f64); R],
) -> Result<(), ParameterError> {
    all(parameters, "a finite number", |_| true)
}

fn all<const R: usize>(
    parameters: [(&'static str, f64); R],
    rule: &'static str,
    obeys: impl Fn(f64) -> bool,
) -> Result<(), ParameterError> {
    let broken = parameters.into_iter().find(|(_, value)| !value.is_finite() || !obeys(*value));
    broken.map_or(Ok(()), |(name, value)| Err(ParameterError { name, value, rule }))
}
