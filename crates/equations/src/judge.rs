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

pub(crate) mod at;
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
mod motion;
mod numbers;
mod parameters;
mod reached;
pub(crate) mod sampling;
mod sums;
mod table;
mod unbracketed;

pub use self::balance::Violation;
pub use self::bracket::BracketDefects;
pub use self::derivatives::{Derivatives, Mismatch, OF_SOLUTIONS, Rounding, Values};
pub use self::parameters::ModelBeside;
pub use self::sampling::CoordinateScales;
pub use self::table::Row;

use rand::rngs::ChaCha8Rng;

use self::at::At;
use self::domain::{has_digits, value_not_finite};
use self::examination::Examination;
use self::motion::Motion;
use crate::{
    ENERGY, ENTROPY, Equations, MetricError, Model, ModelError, PointError, Report, Sizes,
};

/// The number of states sampled around the start.
const SAMPLES: usize = 16;

/// The least number of states at which a model must have values, of 17 with the start.
const ENOUGH: usize = 12;

/// The distance from the start within which a run samples its model, relative to the size of each coordinate.
pub const RADIUS: f64 = 0.1;

/// The rounding of the largest terms of all rows, in units of the violation that is taken for round-off.
pub const ROUNDING: f64 = balance::ROUNDING;

/// An invariant is taken for a function of the other fields if less than this fraction of its differential is
/// independent of theirs at every sample.
const DEPENDENT: f64 = 1e-8;

/// The judge of a system at a time: what it finds of its laws.
///
/// A system whose parts are known apart is judged as a [`Model`], law by law. Of another one the differentials are compared
/// with the values, and the velocity is to conserve the energy and the further invariants, and to produce the entropy that it
/// says.
#[derive(Clone, Copy)]
pub struct Judge<'a> {
    system: &'a dyn Equations,
    t: f64,
}

impl std::fmt::Debug for Judge<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Judge").field("t", &self.t).finish_non_exhaustive()
    }
}

impl<'a> Judge<'a> {
    /// Makes the judge of a system, whose clock shows the time `t`.
    pub const fn of(system: &'a dyn Equations, t: f64) -> Self {
        Self { system, t }
    }

    /// A state of the model, or what is known of the motion.
    fn at<'b>(&self, x: &'b [f64]) -> Result<At<'b>, Motion<'b>>
    where
        'a: 'b,
    {
        match self.system.model() {
            Some(model) => Ok(At { model, t: self.t, x }),
            None => Err(Motion { system: self.system, t: self.t, x }),
        }
    }

    /// Checks the laws at `x0` and at 16 states around it, each coordinate within `radius` times its size there.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    pub fn verify(&self, x0: &[f64], radius: f64) -> Result<(), ModelError> {
        self.examined(x0, radius).verdict
    }

    /// Lists the residual of every law around `x0`, with a note for a reader.
    pub fn report(&self, x0: &[f64]) -> Report {
        let mut report = self.examined(x0, RADIUS);
        // A check of a start does not pay for the note.
        if report.verdict.is_ok()
            && let Ok(at) = self.at(x0)
        {
            report.moved_by_friction = unbracketed::directions(at);
        }
        report
    }

    /// Judges a model that was verified before at one state, where its values must be finite.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify), at this state.
    pub fn check_start(&self, x: &[f64]) -> Result<(), ModelError> {
        self.check_sizes(x)?;
        self.system.check(x)?;
        match self.at(x) {
            Ok(at) => value_not_finite(at).map_or_else(|| reached::examine(at), Err),
            Err(motion) => motion.check(),
        }
    }

    /// Checks the laws at one state that a run has reached.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify), at this state.
    pub fn check_state(&self, x: &[f64]) -> Result<(), ModelError> {
        self.at(x).map_or_else(|motion| motion.check(), reached::examine)
    }

    /// Compares the derivatives of all laws with their values at a state.
    ///
    /// # Errors
    ///
    /// [`ModelError::WrongDerivative`].
    pub fn check_derivatives(&self, x: &[f64]) -> Result<(), ModelError> {
        self.at(x).map_or_else(|motion| motion.compare(), reached::compare)
    }

    /// Compares the derivatives of all laws with their values along two directions, which `turn` chooses.
    ///
    /// # Errors
    ///
    /// [`ModelError::WrongDerivative`].
    pub fn look_at_derivatives(&self, x: &[f64], turn: usize) -> Result<(), ModelError> {
        self.at(x).map_or_else(|motion| motion.look(turn), |at| reached::look(at, turn))
    }

    /// Compares the derivatives of a model along its [parameters](Model::parameters) with the values of the models beside it, at a state
    /// and at one near it. `values` are those of the parameters, and `beside` calls its function with the model whose parameters are
    /// displaced by the numbers it is given; it returns `false` where there is none. A model that knows no parameter is not compared.
    ///
    /// # Errors
    ///
    /// [`ModelError::WrongAlongParameter`], and [`ModelError::DerivativeNotFinite`] where an answer is not a number.
    pub fn check_parameters(
        &self,
        x: &[f64],
        values: &[f64],
        beside: ModelBeside<'_>,
    ) -> Result<(), ModelError> {
        self.at(x).map_or(Ok(()), |at| parameters::compare(at, values, beside))
    }

    /// Looks for a broken law at a state, around it, and at the states `ahead`. States without values are left out.
    ///
    /// # Errors
    ///
    /// The errors of [`check_state`](Self::check_state) and [`check_derivatives`](Self::check_derivatives).
    pub fn check_around(&self, x: &[f64], ahead: &[Vec<f64>]) -> Result<(), ModelError> {
        match self.at(x) {
            Ok(at) => reached::around(at, ahead),
            Err(motion) => motion.check().and_then(|()| motion.compare()),
        }
    }

    /// Checks that a system says sizes that can be, and that the state has its entries.
    fn check_sizes(&self, x: &[f64]) -> Result<(), ModelError> {
        let Sizes { entries, directions, laws } = self.system.sizes();
        if directions == 0 || directions > entries || laws < 2 {
            return Err(ModelError::BadSizes { entries, directions, laws });
        }
        if x.len() != entries {
            return Err(PointError::Length { found: x.len(), expected: entries }.into());
        }
        Ok(())
    }

    fn examined(&self, x0: &[f64], radius: f64) -> Report {
        let mut report = Report::new();
        if let Err(wrong) = self.check_sizes(x0) {
            report.verdict = Err(wrong);
            return report;
        }
        report.verdict = match self.at(x0) {
            Ok(at) => examine(at, radius, &mut report),
            Err(motion) => motion.examine(radius, &mut report),
        };
        report
    }
}

/// Examines the start and the samples around it, and notes every law in the report.
fn examine(start: At<'_>, radius: f64, report: &mut Report) -> Result<(), ModelError> {
    let At { model, t, x: x0 } = start;
    model.check(x0)?;
    value_not_finite(start).map_or(Ok(()), Err)?;
    has_digits(start, ENERGY)?;
    has_digits(start, ENTROPY)?;
    let n = start.n();
    let mut independent = vec![0.0_f64; start.invariants().len()];
    let mut widen = |x: &[f64]| {
        let mut fractions = vec![0.0; independent.len()];
        model.independence(t, x, &mut fractions);
        independent
            .iter_mut()
            .zip(fractions)
            .for_each(|(most, fraction)| *most = most.max(fraction));
    };
    let mut examination = Examination::around(start, radius);
    widen(x0);
    let every: Vec<usize> = (0..n).collect();
    let mut first = examination.at(x0, &every, report);
    for sample in 0..SAMPLES {
        let Some(x) = examination.sample(report) else { continue };
        widen(&x);
        // Over the samples each axis comes up at least twice.
        let each = n.div_ceil(SAMPLES / 2);
        let axes: Vec<usize> = (sample * each..(sample + 1) * each).map(|axis| axis % n).collect();
        first = first.and(examination.at(&x, &axes, report));
    }
    first?;
    if report.judged < ENOUGH {
        let (judged, wanted) = (report.judged, SAMPLES + 1);
        return Err(ModelError::TooFewPoints { judged, wanted, point: x0.to_vec() });
    }
    match independent.iter().position(|fraction| *fraction < DEPENDENT) {
        Some(index) => Err(ModelError::DependentInvariant { index, fraction: independent[index] }),
        None => Ok(()),
    }
}

/// Computes the sizes of a state of a model that do not vanish.
pub fn coordinate_scales(model: &dyn Model, t: f64, x: &[f64]) -> CoordinateScales {
    CoordinateScales::at(At { model, t, x })
}

/// Draws a state within `radius` of these sizes around `x` at which a model has values, or nearer.
pub fn draw(
    (model, t, x): (&dyn Model, f64, &[f64]),
    sizes: &CoordinateScales,
    radius: f64,
    rng: &mut ChaCha8Rng,
) -> Option<Vec<f64>> {
    let inside = |at: At<'_>| at.model.defect(at.x).is_finite() && value_not_finite(at).is_none();
    sizes.draw(At { model, t, x }, radius, rng, &mut 0, inside).map(|(y, _)| y.to_vec())
}

/// Evaluates the skewness and the Jacobi identity of the bracket of a model in coordinates of the sizes `units`.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at the state.
pub fn bracket_defects(
    model: &dyn Model,
    t: f64,
    x: &[f64],
    units: &[f64],
) -> Result<BracketDefects, MetricError> {
    let at = At { model, t, x };
    bracket::bracket_defects(at, &at.jet2(ENTROPY), units, 1.0)
}
