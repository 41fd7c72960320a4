//! The laws of a model, checked at the start and at sampled points around it.
//!
//! The verdict does not depend on units. A point is sampled within a tenth of the size of each coordinate. A
//! law is judged row by row, relative to the terms that should cancel in it (module `balance`).
//!
//! A model has a domain (a logarithm, a square root), and is judged inside it. If a *value* is not finite at a
//! sample, the sample is drawn again, nearer to the start. If a value is finite and a derivative is not, the
//! model is refused, as with `x.norm()` at zero.
//!
//! A run asks for the laws again at states on its way (module `reached`).

pub(crate) mod balance;
pub(crate) mod bracket;
pub(crate) mod derivatives;
mod dissipation;
pub(crate) mod domain;
mod examination;
mod fields;
mod findings;
mod force;
mod invariants;
mod metric;
mod place;
mod reached;
pub(crate) mod sampling;
mod sums;
mod table;
mod unbracketed;

use metriplectic_fields::stack::with_room;
use metriplectic_fields::{ChartPoint, Dimension};
use metriplectic_manifolds::Manifold;

use self::domain::{has_digits, value_not_finite};
use self::examination::Examination;
use crate::invariants::Invariants;
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::model_error::ModelError;
use crate::report::Report;
use crate::velocity::independence;
use crate::verification::{Verified, Verify};

/// The number of points sampled around the start.
const SAMPLES: usize = 16;

/// The least number of points at which a model must have values, of 17 with the start.
const ENOUGH: usize = 12;

/// The distance from the start within which a run samples its model, relative to the size of each coordinate.
pub(crate) const RADIUS: f64 = 0.1;

/// An invariant is taken for a function of the other fields if less than this fraction of its differential is
/// independent of theirs at every sample.
const DEPENDENT: f64 = 1e-8;

impl<Y: Metriplectic + ?Sized> Verify<Y::Manifold> for Y {
    fn verify(&self, x0: &Point<Y>, radius: f64) -> Result<(), ModelError> {
        report(self, x0, radius).verdict
    }

    fn report(&self, x0: &Point<Y>) -> Report {
        let mut report = report(self, x0, RADIUS);
        // A note for a reader: the check of a start does not pay for it.
        if report.verdict.is_ok() {
            report.moved_by_friction = with_room::<Dim<Y>, _>(|| unbracketed::directions(self, x0));
        }
        report
    }

    fn verified(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        self.verify(x0, RADIUS)?;
        Ok(Verified { system: self })
    }

    fn verified_as_member(&self, x0: &Point<Y>) -> Result<Verified<'_, Y>, ModelError> {
        at_one_point(self, x0)?;
        Ok(Verified { system: self })
    }

    fn check_start(&self, x0: &Point<Y>) -> Result<(), ModelError> {
        if self.is_verified() { at_one_point(self, x0) } else { self.verify(x0, RADIUS) }
    }

    fn check_state(&self, x: &Point<Y>) -> Result<(), ModelError> {
        with_room::<Dim<Y>, _>(|| reached::examine(self, x))
    }

    fn check_derivatives(&self, x: &Point<Y>) -> Result<(), ModelError> {
        with_room::<Dim<Y>, _>(|| reached::compare(self, x))
    }

    fn look_at_derivatives(&self, x: &Point<Y>, turn: usize) -> Result<(), ModelError> {
        with_room::<Dim<Y>, _>(|| reached::look(self, x, turn))
    }

    fn check_around(&self, x: &Point<Y>, ahead: &[Point<Y>]) -> Result<(), ModelError> {
        with_room::<Dim<Y>, _>(|| reached::around(self, x, ahead))
    }
}

fn report<Y: Metriplectic + ?Sized>(system: &Y, x0: &Point<Y>, radius: f64) -> Report {
    let mut report = Report::new();
    report.verdict = with_room::<Dim<Y>, _>(|| examine(system, x0, radius, &mut report));
    report
}

/// Judges a model that was verified before at one point, where its values must be finite. It costs less than a step, as
/// a check on the way of a run does.
fn at_one_point<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Result<(), ModelError> {
    system.manifold().check(x)?;
    value_not_finite(system, x).map_or(Ok(()), Err)?;
    reached::examine(system, x)
}

/// Examines the start and the samples around it, and notes every law in the report.
fn examine<Y: Metriplectic + ?Sized>(
    system: &Y,
    x0: &Point<Y>,
    radius: f64,
    report: &mut Report,
) -> Result<(), ModelError> {
    system.manifold().check(x0)?;
    value_not_finite(system, x0).map_or(Ok(()), Err)?;
    has_digits(system.energy(), "energy", x0)?;
    has_digits(system.entropy(), "entropy", x0)?;
    let mut independent = vec![0.0_f64; Y::Invariants::COUNT];
    let mut widen = |x: &Point<Y>| {
        let fractions = independence(system, &ChartPoint::centre(x));
        independent
            .iter_mut()
            .zip(fractions)
            .for_each(|(most, fraction)| *most = most.max(fraction));
    };
    let mut examination = Examination::around(system, x0, radius);
    let n = Dim::<Y>::LEN;
    widen(x0);
    let every: Vec<usize> = (0..n).collect();
    let mut first = examination.at(x0, &every, report);
    for sample in 0..SAMPLES {
        let Some(x) = examination.sample(x0, report) else { continue };
        widen(&x);
        // Over the samples each axis comes up at least twice.
        let each = n.div_ceil(SAMPLES / 2);
        let axes: Vec<usize> = (sample * each..(sample + 1) * each).map(|axis| axis % n).collect();
        first = first.and(examination.at(&x, &axes, report));
    }
    first?;
    if report.judged < ENOUGH {
        let (judged, wanted) = (report.judged, SAMPLES + 1);
        return Err(ModelError::TooFewPoints { judged, wanted, point: Y::Manifold::entries(x0) });
    }
    match independent.iter().position(|fraction| *fraction < DEPENDENT) {
        Some(index) => Err(ModelError::DependentInvariant { index, fraction: independent[index] }),
        None => Ok(()),
    }
}
