//! The splitting of Ninomiya and Victoir: weak order 2.

use super::error::NoiseError;
use super::fluctuating::Fluctuating;
use super::moves::Moves;
use super::numbers::{Counter, Numbers};
use super::sampler::{Sampler, Sampling};
use crate::step::{MethodError, StepError, Stepper};

/// Samples a system with noise by half steps of the method `M` around the flows of all noise fields, with the weak order 2
/// (Ninomiya and Victoir 2008).
///
/// `M` has order 2 or more. A step follows as many flows as there are terms: `n(n−1)/2` for the dissipation of a metric, which
/// is 15 in six dimensions.
///
/// ```
/// use metriplectic_dynamics::{Boltzmann, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Gauss, Method, NinomiyaVictoir, NoiseBuilder, Span};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .noise(Boltzmann(0.15))
///     .build()?;
/// let method = NinomiyaVictoir(Gauss::<2>).seed(7).path(3);
/// let run = method.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.05, 500))?;
/// assert!(run.certificate().keeps_energy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NinomiyaVictoir<M>(pub M);

impl<M> NinomiyaVictoir<M> {
    /// Draws the Gaussian numbers of a seed.
    pub const fn seed(self, seed: u64) -> Sampler<Self> {
        Sampler::new(self, Counter::new(seed))
    }

    /// Takes numbers of your own.
    pub const fn numbers<R: Numbers>(self, numbers: R) -> Sampler<Self, R> {
        Sampler::new(self, numbers)
    }
}

impl<F: Fluctuating<U>, U, M: Stepper<F>> Sampling<F, U> for NinomiyaVictoir<M> {
    fn name(&self) -> String {
        format!("NinomiyaVictoir({})", self.0.name())
    }

    fn order(&self) -> u32 {
        2
    }

    fn check(&self) -> Result<(), NoiseError> {
        match self.0.order() {
            order @ 0..2 => Err(NoiseError::OrderTooLow { order }),
            _ if self.0.damps() => Err(NoiseError::NoiseWithRadau),
            _ => Ok(()),
        }
    }

    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        self.0.serves(flow)
    }

    fn sample<R: Numbers>(&self, moves: &mut Moves<'_, F, U, R>) -> Result<(), StepError> {
        let half = |moves: &mut Moves<'_, F, U, R>, from: f64| {
            moves.drift(0.25, false)?;
            moves.deterministic(&self.0, [from, 0.5])?;
            moves.drift(0.25, true)
        };
        half(moves, 0.0)?;
        let groups = moves.groups().into_iter().enumerate();
        let mut terms: Vec<_> =
            groups.flat_map(|(group, terms)| terms.map(move |r| (group, r))).collect();
        if moves.is_backward() {
            terms.reverse();
        }
        moves.fluctuate(|moves| {
            terms.into_iter().try_for_each(|(group, r)| moves.noise(group, r..r + 1))
        })?;
        half(moves, 0.5)
    }
}
