//! Why a system has no implicit steps.

use metriplectic_equations::{ByCharts, Equations, Path, Paths as _, Sizes};

use super::parts::is_flat;

/// A system, or a method, without implicit steps in plain numbers.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoImplicitSteps {
    /// The parts of the system are not known apart.
    #[error(
        "an implicit method asks for the parts of a system, its bracket and its friction: answer `Equations::model`, or take an explicit method"
    )]
    Model,
    /// Geodesics of the system are not known.
    #[error(
        "the geodesics of this system are not known, only its charts: take `ChartMidpoint`, or answer `Model::paths`"
    )]
    Geodesics,
    /// A vector space has another number of entries than of directions.
    #[error(
        "a state of this system has {entries} entries and {directions} directions: answer `Apart::has_charts` and the charts of `Equations`"
    )]
    Charts {
        /// How many entries a state has.
        entries: usize,
        /// How many directions there are.
        directions: usize,
    },
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

metriplectic_equations::debug_is_the_sentence!(NoImplicitSteps);

/// The most variables of a system with implicit steps: a Jacobian of 1024 has a million entries, and its inverse takes a billion
/// operations.
/// A factor of four fails `tests/lattices/implicit.rs::a_lattice_without_implicit_steps_says_which_method_to_take`.
const MOST: usize = 1024;

/// Refuses a system without implicit steps along the paths of a retraction.
pub(crate) fn refuse(system: &dyn Equations, path: Path) -> Result<(), NoImplicitSteps> {
    let Some(model) = system.model() else { return Err(NoImplicitSteps::Model) };
    let Sizes { directions: variables, entries, .. } = system.sizes();
    let by_charts = || ByCharts(model).follows(path);
    let follows = || model.paths().map_or_else(by_charts, |paths| paths.follows(path));
    if model.is_vector_space() && entries != variables {
        Err(NoImplicitSteps::Charts { entries, directions: variables })
    } else if !is_flat(model) && !follows() {
        Err(NoImplicitSteps::Geodesics)
    } else if variables > MOST {
        Err(NoImplicitSteps::Variables { variables })
    } else {
        Ok(())
    }
}
