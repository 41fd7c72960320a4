//! Every system answers the questions of a verification, by the [judge](metriplectic_equations::judge) of models.

use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_fields::stack::with_room;
use metriplectic_manifolds::Manifold;

use crate::in_numbers::{InNumbers, with_entries};
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::verification::{Verified, Verify};
use crate::{ModelError, Report};

/// The time that the clock of a closed system shows.
const NO_CLOCK: f64 = 0.0;

/// Asks the judge of a system, with room for the matrices of all of its questions.
fn judged<Y: Metriplectic + ?Sized, T>(system: &Y, ask: impl FnOnce(&Judge<'_>) -> T) -> T {
    with_room::<Dim<Y>, T>(|| ask(&Judge::of(&InNumbers(system), NO_CLOCK)))
}

impl<Y: Metriplectic + ?Sized> Verify<Y::Manifold> for Y {
    fn verify(&self, x0: &Point<Y>, radius: f64) -> Result<(), ModelError> {
        judged(self, |judge| judge.verify(&Y::Manifold::entries(x0), radius))
    }

    fn report(&self, x0: &Point<Y>) -> Report {
        judged(self, |judge| judge.report(&Y::Manifold::entries(x0)))
    }

    fn verified(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        self.verify(x0, RADIUS)?;
        Ok(Verified { system: self })
    }

    fn verified_as_member(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        judged(self, |judge| judge.check_start(&Y::Manifold::entries(x0)))?;
        Ok(Verified { system: self })
    }

    fn check_start(&self, x0: &Point<Y>) -> Result<(), ModelError> {
        if self.is_verified() {
            judged(self, |judge| judge.check_start(&Y::Manifold::entries(x0)))
        } else {
            self.verify(x0, RADIUS)
        }
    }

    fn check_state(&self, x: &Point<Y>) -> Result<(), ModelError> {
        with_entries::<Y::Manifold, _>(x, |x| judged(self, |judge| judge.check_state(x)))
    }

    fn check_derivatives(&self, x: &Point<Y>) -> Result<(), ModelError> {
        judged(self, |judge| judge.check_derivatives(&Y::Manifold::entries(x)))
    }

    fn look_at_derivatives(&self, x: &Point<Y>, turn: usize) -> Result<(), ModelError> {
        with_entries::<Y::Manifold, _>(x, |x| {
            judged(self, |judge| judge.look_at_derivatives(x, turn))
        })
    }

    fn check_around(&self, x: &Point<Y>, ahead: &[Point<Y>]) -> Result<(), ModelError> {
        let ahead: Vec<_> = ahead.iter().map(Y::Manifold::entries).collect();
        judged(self, |judge| judge.check_around(&Y::Manifold::entries(x), &ahead))
    }
}
