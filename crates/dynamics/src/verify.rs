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
            judged(self, x0, |judge, x| judge.check_start(x))
        } else {
            self.verify(x0, RADIUS)
        }
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
