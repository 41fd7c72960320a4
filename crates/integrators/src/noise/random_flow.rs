//! One random flow: weak order 1.

use super::error::NoiseError;
use super::fluctuating::Fluctuating;
use super::moves::Moves;
use super::numbers::{Counter, Numbers};
use super::sampler::{Sampler, Sampling};
use crate::step::{MethodError, StepError, Stepper};

/// Samples a system with noise by a step of the method `M` and one random flow, with the weak order 1: for large systems, whose
/// terms it takes all at once.
///
/// ```
/// use metriplectic_dynamics::{Boltzmann, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince5, Method, NoiseBuilder, RandomFlow, Span};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .noise(Boltzmann(0.15))
///     .build()?;
/// let method = RandomFlow(DormandPrince5).seed(7);
/// let run = method.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.02, 500))?;
/// assert!(run.certificate().keeps_energy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RandomFlow<M>(pub M);

impl<M> RandomFlow<M> {
    /// Draws the Gaussian numbers of a seed.
    pub const fn seed(self, seed: u64) -> Sampler<Self> {
        Sampler::new(self, Counter::new(seed))
    }

    /// Takes numbers of your own.
    pub const fn numbers<R: Numbers>(self, numbers: R) -> Sampler<Self, R> {
        Sampler::new(self, numbers)
    }
}

impl<F: Fluctuating<U>, U, M: Stepper<F>> Sampling<F, U> for RandomFlow<M> {
    fn name(&self) -> String {
        format!("RandomFlow({})", self.0.name())
    }

    fn order(&self) -> u32 {
        1
    }

    fn check(&self) -> Result<(), NoiseError> {
        if self.0.damps() { Err(NoiseError::NoiseWithRadau) } else { Ok(()) }
    }

    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        self.0.serves(flow)
    }

    fn sample<R: Numbers>(&self, moves: &mut Moves<'_, F, U, R>) -> Result<(), StepError> {
        moves.deterministic(&self.0, [0.0, 1.0])?;
        moves.drift(1.0, false)?;
        moves.fluctuate(|moves| {
            let mut groups = moves.groups().into_iter().enumerate();
            groups.try_for_each(|(group, terms)| moves.noise(group, terms))
        })
    }
}
