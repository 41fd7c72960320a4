//! Every system answers the questions of a verification, by the [judge](metriplectic_equations::judge) of models.

use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_manifolds::Manifold;

use crate::in_numbers::InNumbers;
use crate::metriplectic::{Metriplectic, Point};
use crate::verification::{Verified, Verify};
use crate::{ModelError, Report};

/// The time that the clock of a closed system shows.
const NO_CLOCK: f64 = 0.0;

/// Asks the judge of a system about a state, with room for the matrices of all of its questions.
fn judged<Y: Metriplectic + ?Sized, T>(
    system: &Y,
    x: &Point<Y>,
    ask: impl FnOnce(&Judge<'_>, &[f64]) -> T,
) -> T {
    InNumbers(system).at(x, |system, x| ask(&Judge::of(system, NO_CLOCK), x))
}

impl<Y: Metriplectic + ?Sized> Verify<Y::Manifold> for Y {
    fn verify(&self, x0: &Point<Y>, radius: f64) -> Result<(), ModelError> {
        judged(self, x0, |judge, x0| judge.verify(x0, radius))
    }

    fn report(&self, x0: &Point<Y>) -> Report {
        judged(self, x0, |judge, x| judge.report(x))
    }

    fn verified(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        self.verify(x0, RADIUS)?;
        Ok(Verified { system: self })
    }

    fn verified_as_member(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        judged(self, x0, |judge, x| judge.check_start(x))?;
        Ok(Verified { system: self })
    }

    fn check_start(&self, x0: &Point<Y>) -> Result<(), ModelError> {
        if self.is_verified() {
            return judged(self, x0, |judge, x| judge.check_start(x));
        }
        let Some(begun) = self.begun() else { return self.verify(x0, RADIUS) };
        if begun.has() {
            return judged(self, x0, |judge, x| {
                judge.check_start(x)?;
                judge.check_derivatives(x)
            });
        }
        self.verify(x0, RADIUS)?;
        begun.note();
        Ok(())
    }

    fn check_state(&self, x: &Point<Y>) -> Result<(), ModelError> {
        judged(self, x, |judge, x| judge.check_state(x))
    }

    fn check_derivatives(&self, x: &Point<Y>) -> Result<(), ModelError> {
        judged(self, x, |judge, x| judge.check_derivatives(x))
    }

    fn look_at_derivatives(&self, x: &Point<Y>, turn: usize) -> Result<(), ModelError> {
        judged(self, x, |judge, x| judge.look_at_derivatives(x, turn))
    }

    fn check_around(&self, x: &Point<Y>, ahead: &[Point<Y>]) -> Result<(), ModelError> {
        let ahead: Vec<_> = ahead.iter().map(Y::Manifold::entries).collect();
        judged(self, x, |judge, x| judge.check_around(x, &ahead))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Matrix3, Vector3, vector};

    use super::*;
    use crate::verification::Begun;
    use crate::{FieldDissipation, System};

    #[test]
    fn a_further_run_checks_the_model_at_its_start_alone() {
        let asked = AtomicUsize::new(0);
        // A friction that feeds the energy beyond x = 2, where the first start does not look.
        let friction = |x: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y);
            let k: Matrix3<Real> = b * b.transpose();
            if x.x.re > 2.0 { k + Matrix3::identity() } else { k }
        };
        let system = System::on(Euclidean::<3>)
            .energy(|x: &Vector3<Real>| {
                asked.fetch_add(1, Ordering::Relaxed);
                x.norm_squared() * 0.5
            })
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(friction))
            .build()
            .unwrap();
        let checked = |x: Vector3<f64>| {
            asked.store(0, Ordering::Relaxed);
            let verdict = system.check_start(&x);
            (verdict, asked.load(Ordering::Relaxed))
        };
        let (first, of_all) = checked(vector![1.0, 0.5, 0.2]);
        let (second, of_one) = checked(vector![0.8, -0.5, 0.3]);
        assert!(first.is_ok() && second.is_ok());
        assert!(10 * of_one < of_all, "{of_one} of {of_all}");
        let (wrong, _) = checked(vector![2.5, 0.5, 0.2]);
        assert!(matches!(wrong, Err(ModelError::EnergyNotKept { .. })), "{wrong:?}");
        let nan = vector![f64::NAN, 0.5, 0.2];
        assert!(matches!(checked(nan).0, Err(ModelError::Start(_))));
        // A copy has the same parts.
        let copy = system.clone().begun().map(Begun::has);
        assert!(copy == Some(true));
    }
}
