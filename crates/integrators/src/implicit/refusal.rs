//! Why a system has no implicit steps.

use metriplectic_equations::{Equations, Sizes};

/// A system, or a method, without implicit steps in plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoImplicitSteps {
    /// The parts of the system are not known apart.
    #[error(
        "an implicit method asks for the parts of a system, its bracket and its friction: answer `Equations::model`, or take an explicit method"
    )]
    Model,
    /// The space of the system is not known to be a vector space.
    #[error(
        "an implicit method takes steps along the straight lines of a vector space: answer `Equations::is_vector_space` if the charts are translations, or take an explicit method"
    )]
    Space,
    /// The metric of the system is not the canonical one.
    #[error(
        "an implicit method in plain numbers has the canonical metric of a vector space: answer `Model::has_canonical_metric` if it is that one, or take an explicit method"
    )]
    Metric,
    /// The retraction or the discrete gradient is not one of this library.
    #[error(
        "a system in plain numbers is stepped by the retractions and the discrete gradients of this library alone"
    )]
    Scheme,
    /// There are so many variables that a matrix of all pairs of them is too large.
    #[error(
        "a Jacobian of all pairs of {variables} variables is too large: take an explicit method, and RungeKuttaChebyshev where friction is stiff"
    )]
    Variables {
        /// How many there are.
        variables: usize,
    },
}

/// The most variables of a system with implicit steps: a Jacobian of 1024 has a million entries, and its inverse takes a billion
/// operations.
/// A factor of four fails `tests/lattices/implicit.rs::a_lattice_without_implicit_steps_says_which_method_to_take`.
const MOST: usize = 1024;

/// Refuses a system without implicit steps.
pub(crate) fn refuse(system: &dyn Equations) -> Result<(), NoImplicitSteps> {
    let Some(model) = system.model() else { return Err(NoImplicitSteps::Model) };
    let Sizes { entries, directions: variables, .. } = system.sizes();
    if !system.is_vector_space() || entries != variables {
        Err(NoImplicitSteps::Space)
    } else if !model.has_canonical_metric() {
        Err(NoImplicitSteps::Metric)
    } else if variables > MOST {
        Err(NoImplicitSteps::Variables { variables })
    } else {
        Ok(())
    }
}
