//! A run that is put down and taken up again.
//!
//! A [`Checkpoint`] holds all that the next steps depend on: the state, what the scheme remembers
//! (the displacements that it extrapolates, the Jacobian that it tries first, the digits that rounding has lost), the sizes of the
//! steps, and the balance so far. A run that is resumed from it takes the same steps as one that was
//! never interrupted, bit for bit.
//!
//! ```
//! # use metriplectic_dynamics::System;
//! # use metriplectic_fields::Real;
//! # use metriplectic_integrators::{Run, Span};
//! # use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! # use nalgebra::Vector3;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let body = System::on(LieDual::so3())
//! #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
//! #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//! #     .build()?;
//! # let start = Vector3::new(0.4, 0.5, 0.3);
//! let span = Span::until(20.0).tolerance(1e-5);
//! let mut steps = WeylMidpoint.steps(&body, start, span)?;
//! for _ in 0..100 {
//!     steps.advance()?;
//! }
//! let checkpoint = steps.checkpoint();
//! # #[cfg(feature = "serde")] {
//! let text = serde_json::to_string(&checkpoint)?; // with the feature `serde`
//! # assert_eq!(serde_json::from_str::<metriplectic_integrators::Checkpoint>(&text)?, checkpoint);
//! # }
//!
//! // In another process, perhaps.
//! let resumed = WeylMidpoint.resume(&body, &checkpoint)?.run()?;
//! let whole = WeylMidpoint.run(&body, start, span)?;
//! assert_eq!(resumed.last(), whole.last());
//! assert_eq!(resumed.certificate(), whole.certificate());
//! # Ok(())
//! # }
//! ```
//!
//! The system is not in it, since closures cannot be written down: resume with the same one. Nor are outputs at
//! given times and events: say them again ([`Steps::watching`]). Another system is noticed if its energy, its
//! entropy, a further invariant or its velocity has another value at the point, by more than the round-off of its
//! terms. The model is not verified around the point; it is checked on the way like that of any run.
//!
//! The [name](Method::name) of the method is in it, and another method is refused. The options of the method are
//! not in it: a run that failed may go on with more corrections or more splits.
//!
//! A file has a checksum over the bits of all of its numbers. A file with another number is refused
//! ([`ResumeError::Altered`]), and one with other digits of the same number is not.
//!
//! # Going on
//!
//! A run that has reached its end goes on from its last [checkpoint](crate::Trajectory::checkpoint), with a
//! later one:
//!
//! ```
//! # use metriplectic_dynamics::System;
//! # use metriplectic_fields::Real;
//! # use metriplectic_integrators::{Run, Span};
//! # use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! # use nalgebra::Vector3;
//! # fn main() -> Result<(), metriplectic_integrators::Error> {
//! # let body = System::on(LieDual::so3())
//! #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
//! #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//! #     .build()?;
//! # let start = Vector3::new(0.4, 0.5, 0.3);
//! let first = WeylMidpoint.run(&body, start, Span::steps(0.1, 100))?;
//! let later = first.checkpoint().clone().with_steps(300)?;
//! let extended = WeylMidpoint.resume(&body, &later)?.run()?;
//! let whole = WeylMidpoint.run(&body, start, Span::steps(0.1, 300))?;
//! assert_eq!(extended.last(), whole.last());
//! # Ok(())
//! # }
//! ```
//!
//! With steps of one size this is the run that would have gone on, bit for bit. With steps that follow a
//! tolerance ([`Checkpoint::with_end`]) it is this run as long as no step has been shortened to meet the
//! former end, as those at the end are.
//!
//! # Digits
//!
//! In formats for people the numbers are written as strings, `"0.1"`. Some readers of numbers are off
//! by a digit, `serde_json` without its feature `float_roundtrip` among them, and JSON has no
//! infinity; strings are read by the standard library, which is exact.
//!
//! # What "bit for bit" means
//!
//! A run is a sequence of floating-point operations in a fixed order: there are no threads in it, no
//! clock, no random number after verification, and no hash map. So the same program gives the same
//! bits, in every run and in every thread. Between *different* programs this cannot be promised. The
//! functions `sin`, `exp`, `ln` and powers come from the mathematical library of the system, whose last digits differ from
//! one to the next; another compiler, or other options of the same, may fold a constant in
//! another way or contract `a*b + c`; and another processor has another library. There the laws hold all the
//! same, to the same round-off, but the digits of two long runs need not agree.

#[cfg(feature = "serde")]
mod checksum;
mod error;
pub(crate) mod exact;
#[cfg(feature = "serde")]
mod file;
#[cfg(feature = "serde")]
mod forms;
mod saved;
mod validation;

use std::convert::Infallible;

use crate::method::{Flow, Memory, Method, StateSpace, Vector};
use crate::run::certificate::Certificate;
use crate::run::controller::{Rule, StepSize};
use crate::run::output::StepBefore;
use crate::run::progress::Progress;
use crate::run::recheck::checked_states;
use crate::run::span::{SpanError, check_end, check_steps};
use crate::run::steps::Steps;
use crate::run::trajectory::{Ending, State};

pub use error::ResumeError;
pub(crate) use exact::Exact;
pub use saved::Saved;

/// Where a run was put down; made by [`Steps::checkpoint`], taken up by [`Method::resume`].
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint(
    /// The run, or why the file that it was read from cannot be resumed.
    Result<Box<SavedRun>, ResumeError>,
);

/// The version of the format that is written and read. Each change of a field is a new version.
#[cfg(feature = "serde")]
const VERSION: u32 = 7;

/// A run between two steps, but for its system and the options of its method.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
struct SavedRun {
    /// The name of the method.
    method: String,
    step: usize,
    time: Exact,
    point: Vec<Exact>,
    /// The velocity there; empty where it cannot be evaluated.
    velocity: Vec<Exact>,
    energy: Exact,
    entropy: Exact,
    /// The entropy after the last step that dissipated.
    kept_entropy: Exact,
    invariants: Vec<Exact>,
    memory: Saved,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    balance: Certificate,
    progress: Progress<Vec<Exact>>,
}

impl Checkpoint {
    /// The run that was put down.
    fn run(&self) -> Result<&SavedRun, ResumeError> {
        self.0.as_deref().map_err(Clone::clone)
    }

    /// The name of the method; empty in a file that cannot be resumed.
    pub fn method(&self) -> &str {
        self.0.as_deref().map_or("", |run| &run.method)
    }

    /// The number of steps taken; 0 in a file that cannot be resumed.
    pub fn step(&self) -> usize {
        self.run().map_or(0, |run| run.step)
    }

    /// The time reached; not a number in a file that cannot be resumed.
    pub fn time(&self) -> f64 {
        self.run().map_or(f64::NAN, |run| run.time.0)
    }

    /// The entries of the point reached; none in a file that cannot be resumed.
    pub fn point(&self) -> impl Iterator<Item = f64> {
        self.run().into_iter().flat_map(SavedRun::point)
    }

    /// The same run in so many steps of one size, those taken so far among them: a run that has reached
    /// its end goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::AdaptiveSteps`] if its steps follow a tolerance; [`ResumeError::Span`] if it has taken
    /// as many already, or the end would be too late for a number; [`ResumeError::Version`] and
    /// [`ResumeError::Altered`] of a file.
    pub fn with_steps(self, count: usize) -> Result<Self, ResumeError> {
        let mut run = self.run()?.clone();
        let StepSize::Fixed(h) = run.progress.step_size else {
            return Err(ResumeError::AdaptiveSteps);
        };
        if count <= run.step {
            return Err(SpanError::NoSteps.into());
        }
        check_steps(run.progress.start, h, count)?;
        run.progress.count = Some(count);
        Ok(run.go_on())
    }

    /// The same run to another time, in steps that follow its tolerance: a run that has reached its end
    /// goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::FixedSteps`] if its steps are of one size; [`ResumeError::Span`] if the end is not
    /// after the time reached; [`ResumeError::Version`] and [`ResumeError::Altered`] of a file.
    pub fn with_end(self, end: f64) -> Result<Self, ResumeError> {
        let mut run = self.run()?.clone();
        let StepSize::Adaptive(controller) = &mut run.progress.step_size else {
            return Err(ResumeError::FixedSteps);
        };
        check_end(run.time.0, end)?;
        controller.pace.end = end;
        Ok(run.go_on())
    }
}

impl From<SavedRun> for Checkpoint {
    fn from(run: SavedRun) -> Self {
        Self(Ok(Box::new(run)))
    }
}

impl SavedRun {
    fn point(&self) -> impl Iterator<Item = f64> {
        self.point.iter().map(|x| x.0)
    }

    fn go_on(mut self) -> Checkpoint {
        if matches!(self.progress.ending, Some(Ending::Span | Ending::Event { .. })) {
            self.progress.ending = None;
        }
        self.into()
    }
}

fn exact(numbers: impl IntoIterator<Item = f64>) -> Vec<Exact> {
    numbers.into_iter().map(Exact).collect()
}

fn column(v: &impl Vector) -> Vec<Exact> {
    exact(v.to_list())
}

/// The numbers of a list, as many as there are in `like`.
fn vector<V: Vector>(what: &'static str, list: &[Exact], like: &V) -> Result<V, ResumeError> {
    let numbers: Vec<f64> = list.iter().map(|number| number.0).collect();
    let (found, expected) = (list.len(), like.len());
    like.with_list(&numbers).ok_or(ResumeError::Length { what, found, expected })
}

const fn expect_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ResumeError> {
    if found == expected { Ok(()) } else { Err(ResumeError::Length { what, found, expected }) }
}

impl<'a, F: Flow, M: Method<F>> Steps<'a, F, M> {
    /// All that the next steps depend on, but for the system and the options of the method.
    pub fn checkpoint(&self) -> Checkpoint {
        let State { step, time, point, energy, entropy } = &self.state;
        let velocity = self.flow.rates(point, &self.flow.sizes(point).map(|_| 0.0));
        let known = self.certificate.invariants.len();
        let mut memory = Saved::default();
        self.memory.save(&mut memory);
        let Ok(progress) =
            self.progress.convert(|_, v| Ok::<_, Infallible>(exact(v.to_short_list())));
        let run = SavedRun {
            method: self.method.name(),
            step: *step,
            time: Exact(*time),
            point: exact(F::Space::numbers(point)),
            velocity: velocity.map_or_else(Vec::new, |v| column(&v)),
            energy: Exact(*energy),
            entropy: Exact(*entropy),
            kept_entropy: Exact(self.entropy),
            invariants: exact(self.values.invariants.as_ref()[..known].iter().copied()),
            memory,
            balance: self.certificate.clone(),
            progress,
        };
        run.into()
    }

    /// A run that was put down.
    pub(crate) fn resume(
        method: M,
        flow: &'a F,
        checkpoint: &Checkpoint,
    ) -> Result<Self, ResumeError> {
        let c = checkpoint.run()?;
        validation::of_the_method(&c.method, method.name())?;
        let entries: Vec<f64> = c.point().collect();
        let point = flow.element(&entries)?;
        let mut certificate =
            c.balance.resumed(Certificate::start(flow, &point, method.promises(flow)))?;
        if c.progress.ending.is_none() {
            certificate.checked_states = checked_states(flow, c.step);
        }
        let like = flow.sizes(&point);
        let progress = c.progress.convert(|what, list| vector(what, list, &like))?;
        let memory = M::Memory::restore(&c.memory)?;
        expect_length("further invariants", c.invariants.len(), certificate.invariants.len())?;
        validation::of_the_system(flow, &point, c)?;
        let mut values = flow.laws(&point);
        (values.energy, values.entropy) = (c.energy.0, c.entropy.0);
        for (k, stored) in c.invariants.iter().enumerate() {
            values.invariants[k] = stored.0;
        }
        let (energy, entropy, time) = (c.energy.0, c.entropy.0, c.time.0);
        let state = State { step: c.step, time, point, energy, entropy };
        let (kept, h, in_parts) = (c.kept_entropy.0, 0.0, false);
        let before =
            StepBefore { state: state.clone(), values: values.clone(), entropy: kept, h, in_parts };
        Ok(Self {
            promises: certificate.promises,
            rule: Rule::of(&method, progress.start),
            before,
            watching: None,
            method,
            flow,
            progress,
            state,
            values,
            entropy: kept,
            memory,
            certificate,
            failed: false,
        })
    }
}

impl Certificate {
    /// These figures, in a run that starts anew with the certificate `fresh`: what the system and the method say
    /// of themselves is theirs.
    fn resumed(&self, fresh: Self) -> Result<Self, ResumeError> {
        expect_length("further invariants", self.invariants.len(), fresh.invariants.len())?;
        let Self { promises, second_law, projected, .. } = fresh;
        let mut certificate = Self { promises, second_law, projected, ..self.clone() };
        for (balance, fresh) in certificate.invariants.iter_mut().zip(fresh.invariants) {
            balance.kind = fresh.kind;
        }
        Ok(certificate)
    }
}
