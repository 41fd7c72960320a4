//! The numbers of a certificate that a table has for each row, and the kinds of errors.

use metriplectic_dynamics::ModelError;
use metriplectic_integrators::{Certificate, Error, RunError, StateSpace, StepError};

/// The names of the columns, in the order of [`figures`].
pub(crate) const FIGURES: [&str; 13] = [
    "run.t",
    "run.steps",
    "run.rejected",
    "run.energy_error",
    "run.entropy_increment",
    "run.entropy_gained",
    "run.entropy_slope",
    "run.manifold_defect",
    "run.friction",
    "run.stiff",
    "run.local_error",
    "run.resolved",
    "run.kept",
];

/// The numbers of a row in the order of [`FIGURES`].
pub(crate) type Figures = [f64; FIGURES.len()];

/// Other columns of a table.
const OTHERS: [&str; 4] = ["row", "outcome", "error", "failed"];

/// Whether a name is one of the columns that each table has.
pub(crate) fn reserved(name: &str) -> bool {
    OTHERS.contains(&name) || ["run.", "end."].iter().any(|prefix| name.starts_with(prefix))
}

/// The numbers of a certificate, with the time that was reached.
pub(crate) fn figures(certificate: &Certificate, time: f64) -> Figures {
    let flag = |is: bool| f64::from(u8::from(is));
    let promises = certificate.promises;
    let kept = (!promises.energy || certificate.keeps_energy())
        && (!promises.entropy || certificate.keeps_entropy())
        && (!promises.invariants || certificate.keeps_invariants());
    let error = certificate.max_energy_error;
    let energy_error = if error == 0.0 { 0.0 } else { error / certificate.energy_scale };
    [
        time,
        certificate.steps as f64,
        certificate.rejected as f64,
        energy_error,
        certificate.min_entropy_increment,
        certificate.entropy_gained,
        certificate.min_entropy_slope,
        certificate.max_manifold_defect,
        certificate.friction,
        flag(certificate.is_stiff()),
        certificate.local_error.unwrap_or(f64::NAN),
        flag(certificate.is_resolved()),
        flag(kept),
    ]
}

/// The kind of an error in a word, and the numbers of the steps before it.
pub(crate) fn kind<M: StateSpace>(error: &Error) -> (&'static str, Option<Figures>) {
    match error {
        Error::Model(ModelError::Start(_)) | Error::Point(_) => ("start", None),
        Error::Model(_) => ("model", None),
        Error::Span(_) => ("span", None),
        Error::Step(cause) => (of_step(cause), None),
        Error::Resume(_) => ("resume", None),
        Error::Attitude(_) => ("attitude", None),
        Error::Run(source) => match source.downcast_ref::<RunError<M>>() {
            Some(RunError::Step { cause, trajectory }) => {
                let time = trajectory.last().time;
                (of_step(cause), Some(figures(trajectory.certificate(), time)))
            }
            _ => ("run", None),
        },
        Error::Flow(_) => ("flow", None),
        _ => ("build", None),
    }
}

const fn of_step(cause: &StepError) -> &'static str {
    match cause {
        StepError::Model { .. } => "model",
        StepError::Flow { .. } => "flow",
        StepError::NotConverged { .. } => "not_converged",
        StepError::StiffFriction { .. } => "stiff_friction",
        StepError::FirstLawBroken { .. } => "first_law",
        StepError::DependentInvariants { .. } => "dependent_invariants",
        StepError::NotProjected { .. } => "not_projected",
        StepError::EntropyFalls { .. } => "entropy_falls",
        StepError::WrongDerivative { .. } => "wrong_derivative",
        StepError::TooSmall { .. } => "step_too_small",
        StepError::Standstill { .. } => "standstill",
        StepError::OutOfDomain { .. } | StepError::SiteOutOfDomain { .. } => "out_of_domain",
        StepError::NothingBetween { .. } => "nothing_between",
        _ => "step",
    }
}
