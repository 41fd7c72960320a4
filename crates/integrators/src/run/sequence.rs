//! The steps of one run, for runs of other systems beside it.
//!
//! A run that follows a tolerance chooses its steps by comparisons, so its end is no smooth function of the start or of a parameter:
//! the difference of two runs whose controllers have chosen alike but for a rounding is the derivative of nothing. With the steps of
//! one run *frozen*, others beside it are the same discrete map at other arguments, and a difference quotient of them has the digits
//! of one of a smooth function (internal numerical differentiation: Bock 1981, Numerical treatment of inverse problems in chemical
//! reaction kinetics, §4).

use std::sync::{Arc, Mutex, PoisonError};

/// The steps of a run that follows a tolerance: the times at which they end, event by event as they would have ended without it.
///
/// Steps of one size need no sequence: they are the same in each run.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Method, Schedule, Span, StepSequence};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, vector};
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .build()?;
/// let (taken, schedule) = (StepSequence::default(), Schedule::from(Span::until(20.0).tolerance(1e-6)));
/// let end = |x: f64, schedule: Schedule| {
///     Ok::<_, metriplectic_integrators::Error>(DormandPrince8.run(&body, vector![x, -1.0, 0.3], schedule)?.last().point)
/// };
/// end(0.4, schedule.clone().noting(&taken))?;
/// // The derivative along the first entry of the start, by 1e-5 and by 1e-6.
/// let slope = |d: f64| -> Result<Vector3<f64>, metriplectic_integrators::Error> {
///     let [after, before] = [d, -d].map(|d| end(0.4 + d, schedule.clone().taking(&taken)));
///     Ok((after? - before?) / (2.0 * d))
/// };
/// let [wide, near] = [slope(1e-5)?, slope(1e-6)?];
/// assert!((wide - near).norm() < 1e-6 * near.norm());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct StepSequence(Arc<Mutex<Vec<f64>>>);

impl StepSequence {
    /// The times at which the steps end, in their order.
    pub fn ends(&self) -> Vec<f64> {
        self.list().clone()
    }

    fn list(&self) -> std::sync::MutexGuard<'_, Vec<f64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The origin of the sizes of the steps of a run, and the notes of them.
#[derive(Clone, Debug, Default)]
pub(crate) enum Frozen {
    /// From the controller.
    #[default]
    No,
    /// From the controller; and they are noted.
    Noting(StepSequence),
    /// From another run, as far as its steps can be taken.
    Taking(Arc<[f64]>),
}

/// Lists are compared by their place: the notes of one run are those of no other.
impl PartialEq for Frozen {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::No, Self::No) => true,
            (Self::Noting(a), Self::Noting(b)) => Arc::ptr_eq(&a.0, &b.0),
            (Self::Taking(a), Self::Taking(b)) => a == b,
            _ => false,
        }
    }
}

impl Frozen {
    pub(super) fn noting(sequence: &StepSequence) -> Self {
        Self::Noting(sequence.clone())
    }

    pub(super) fn taking(sequence: &StepSequence) -> Self {
        Self::Taking(sequence.list().as_slice().into())
    }

    /// A run begins.
    pub(super) fn begin(&self) {
        if let Self::Noting(sequence) = self {
            sequence.list().clear();
        }
    }

    /// A step was taken to this time.
    pub(super) fn note(&self, end: f64) {
        if let Self::Noting(sequence) = self {
            sequence.list().push(end);
        }
    }

    /// The time at which the step after so many steps ends that begins at a time. A run that is ahead of the list, because an event
    /// came earlier or a step was taken in parts, goes on to the next time of it. The times rise, or fall where their direction is −1.
    pub(super) fn end(&self, steps: usize, begin: f64, direction: f64) -> Option<f64> {
        let Self::Taking(ends) = self else { return None };
        let is_over = |end: &f64| direction * (end - begin) <= 0.0;
        let own = ends.get(steps).filter(|end| !is_over(end));
        own.or_else(|| ends.get(ends.partition_point(is_over))).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_ends_where_that_of_its_number_did() {
        let sequence = StepSequence::default();
        let noting = Frozen::noting(&sequence);
        [1.0, 2.0, 4.0].into_iter().for_each(|end| noting.note(end));
        let taking = Frozen::taking(&sequence);
        // An event at 0.5 has cut the first step: the second one goes to 2 all the same.
        assert_eq!([0, 1, 2].map(|step| taking.end(step, 0.5, 1.0)), [1.0, 2.0, 4.0].map(Some));
        // Ahead of the list, and behind it.
        assert_eq!(
            [taking.end(1, 2.5, 1.0), taking.end(7, 1.0, 1.0), taking.end(3, 4.0, 1.0)],
            [Some(4.0), Some(2.0), None]
        );
        assert_eq!(Frozen::No.end(0, 0.0, 1.0), None);
        noting.begin();
        assert!(sequence.ends().is_empty() && taking.end(0, 0.0, 1.0) == Some(1.0));
    }
}
