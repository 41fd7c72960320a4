//! The noise of a system in the making.

use metriplectic_dynamics::noise::Fluctuation;
use metriplectic_dynamics::{Surroundings, SystemBuilder};

use super::fluctuating::Noise;
use super::system::Noisy;

/// The surroundings `P` of a system in the making, with noise.
#[derive(Clone, Copy, Debug)]
pub struct Fluctuates<P, U> {
    surroundings: P,
    noise: Noise<U>,
}

impl<P, U> Fluctuates<P, U> {
    pub(crate) const fn new(surroundings: P, noise: Noise<U>) -> Self {
        Self { surroundings, noise }
    }

    /// The noise in other surroundings.
    pub(crate) fn map<Q>(self, replace: impl FnOnce(P) -> Q) -> Fluctuates<Q, U> {
        Fluctuates { surroundings: replace(self.surroundings), noise: self.noise }
    }
}

impl<P: Surroundings, U> Surroundings for Fluctuates<P, U> {
    type Built<Y> = Noisy<P::Built<Y>, U>;

    fn around<Y>(self, system: Y) -> Self::Built<Y> {
        Noisy::new(self.surroundings.around(system), self.noise)
    }

    fn is_open(&self) -> bool {
        self.surroundings.is_open()
    }
}

/// A builder with noise.
type With<M, G, B, K, H, S, L, P, U> = SystemBuilder<M, G, B, K, H, S, L, Fluctuates<P, U>>;

/// Gives a system the thermal noise that its friction fixes.
pub trait NoiseBuilder<M, G, B, K, H, S, L, P>: Sized {
    /// Sets the strength of the noise: [`Boltzmann(k_B)`](metriplectic_dynamics::Boltzmann),
    /// with a [measure](metriplectic_dynamics::Boltzmann::measure) or without one.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    fn noise<N: Fluctuation>(self, noise: N) -> With<M, G, B, K, H, S, L, P, N::Measure>;
}

impl<M, G, B, K, H, S, L, P> NoiseBuilder<M, G, B, K, H, S, L, P>
    for SystemBuilder<M, G, B, K, H, S, L, P>
{
    fn noise<N: Fluctuation>(self, noise: N) -> With<M, G, B, K, H, S, L, P, N::Measure> {
        let noise = Noise::of(noise);
        self.surrounded(|surroundings| Fluctuates::new(surroundings, noise))
    }
}
