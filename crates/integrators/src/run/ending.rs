//! How a run ended.

/// How a run ended.
///
/// ```
/// # use metriplectic_dynamics::System;
/// # use metriplectic_fields::Real;
/// # use metriplectic_integrators::{Ending, Run, Span};
/// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
/// # use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// # let body = System::on(LieDual::so3())
/// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
/// #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
/// #     .build()?;
/// let span = Span::until(1e4).tolerance(1e-5).until_rest(1e-8);
/// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
/// match run.ending() {
///     Ending::Rest { speed, .. } => println!("at rest at t = {}, speed {speed:.1e}", run.last().time),
///     Ending::Span => println!("still moving at t = {}", run.last().time),
///     _ => unreachable!("a run that stops is an error"),
/// }
/// # assert!(run.ending().is_rest() && run.last().time < 1e3);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Ending {
    /// It went the whole span.
    Span,
    /// The state came to rest: the speed fell below the tolerance times the one with the largest velocity of
    /// each entry, or a step changed neither an entry nor its lost digits.
    ///
    /// The speed is the norm of `(Π dH + K dS)_i / s_i`, each entry relative to its own size, in units of
    /// one over the time: `1/speed` is how long the state would take to move by its own size.
    Rest {
        /// The speed at the end.
        speed: f64,
        /// The largest speed of the run, to which the tolerance is relative.
        largest: f64,
    },
    /// It stopped at an [event](crate::Watched::stop).
    Event {
        /// Which one of the events that were asked for, counted from 0. Its name is that of the last one in
        /// [`Trajectory::events`](crate::Trajectory::events).
        index: usize,
    },
    /// It stopped on the way: a step failed, or nobody asked for the next.
    Stopped,
}

impl Ending {
    /// Whether the state came to rest.
    pub const fn is_rest(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }

    /// Whether the run stopped at an event.
    ///
    /// ```
    /// use metriplectic_integrators::Ending;
    /// assert!(Ending::Event { index: 0 }.is_event() && !Ending::Span.is_event());
    /// ```
    pub const fn is_event(self) -> bool {
        matches!(self, Self::Event { .. })
    }
}
