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
//! The system and the scheme are not in it, since closures cannot be written down: resume with the same
//! ones. Nor are outputs at given times and events: say them again ([`Steps::watching`]). Another system is noticed if its energy, its entropy, a further invariant or its velocity has
//! another value at the point, by more than the round-off of its terms. The model is not verified again. All
//! numbers of a checkpoint are compared with each other, and with what the system says at the point.
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

mod saved;
mod validation;

use metriplectic_manifolds::PointError;

use crate::method::{Control, Effort, Flow, LimitingSites, Memory, Method, StateSpace, Vector};
use crate::run::certificate::{Certificate, ProjectedSteps, StageBalance};
use crate::run::controller::{Cap, Controller, Entries, StepSize};
use crate::run::output::StepBefore;
use crate::run::scales::Scales;
use crate::run::span::{SpanError, check_end, check_step_size, check_steps};
use crate::run::steps::{Progress, Steps};
use crate::run::trajectory::{Ending, State};

pub(crate) use saved::Exact;
pub use saved::Saved;

/// Where a run was put down; made by [`Steps::checkpoint`], taken up by [`Method::resume`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Checkpoint {
    version: u32,
    step: usize,
    start: Exact,
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
    balance: Balance,
    step_size: SavedStepSize,
    count: Option<usize>,
    every: usize,
    most: Option<usize>,
    /// The sizes of the entries so far, and those of the terms of their velocities.
    sizes: Vec<Exact>,
    terms: Vec<Exact>,
    rest: Option<Exact>,
    /// The largest velocity of each entry.
    largest_velocity: Vec<Exact>,
    ending: Option<SavedEnding>,
}

/// The version of the format that is written and read.
const VERSION: u32 = 5;

/// The figures of a certificate that the system does not know.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Balance {
    initial_energy: Exact,
    max_energy_error: Exact,
    energy_scale: Exact,
    initial_entropy: Exact,
    min_entropy_increment: Exact,
    entropy_gained: Exact,
    entropy_falls: usize,
    min_entropy_slope: Exact,
    /// Initial value, largest error and scale of each further invariant.
    invariants: Vec<(Exact, Exact, Exact)>,
    friction: Exact,
    max_manifold_defect: Exact,
    steps: usize,
    smallest_step: Exact,
    largest_step: Exact,
    rejected: usize,
    falls_avoided: usize,
    projected_steps: ProjectedSteps,
    /// Largest defect and surplus of steps with stages.
    stages: Option<(Exact, Exact)>,
    effort: Effort,
    worst_iterations: usize,
    local_error: Option<Exact>,
    #[cfg_attr(feature = "serde", serde(default))]
    limiting_sites: LimitingSites,
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum SavedStepSize {
    Fixed {
        h: Exact,
    },
    Adaptive {
        end: Exact,
        tolerance: Exact,
        entries: SavedEntries,
        least: Option<Exact>,
        largest: Option<Exact>,
        next: Exact,
        taken: Option<Exact>,
        error: Option<Exact>,
        rejected: bool,
        cap: Option<SavedCap>,
    },
}

/// What the second law says of the size of a step.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct SavedCap {
    size: Exact,
    before: Exact,
    steps: u32,
}

/// What is known of the errors of the entries.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum SavedEntries {
    Automatic,
    Scale(Vec<Exact>),
    Absolute(Vec<Exact>),
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum SavedEnding {
    Span,
    Rest { speed: Exact, largest: Exact },
    Event { index: usize },
    Stopped,
}

/// A checkpoint that cannot be resumed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// It was written by another version of this library.
    #[error(
        "the checkpoint has format {found}, and {expected} is what is read here; resume it with the version that wrote it"
    )]
    Version {
        /// The format of the checkpoint.
        found: u32,
        /// The format of this version.
        expected: u32,
    },
    /// Its point is not one of the manifold.
    #[error("the point of the checkpoint: {0}")]
    Point(#[from] PointError),
    /// A list in it has another length than the system says.
    #[error(
        "the checkpoint has {found} {what}, the system {expected}; resume it with the system that it is of"
    )]
    Length {
        /// What the list holds.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that it should have.
        expected: usize,
    },
    /// A field has another value than the checkpoint says.
    #[error(
        "the {field} is {found} at the point of the checkpoint, which says {stored}; resume it with the system that it is of"
    )]
    AnotherSystem {
        /// Which field.
        field: &'static str,
        /// Its value in the checkpoint.
        stored: f64,
        /// Its value in the system.
        found: f64,
    },
    /// The end that it is to be given cannot be that of the run.
    #[error(transparent)]
    Span(#[from] SpanError),
    /// It is of a run in steps of one size, and is to be given a time at which it ends.
    #[error(
        "the run takes steps of one size; say how many with `with_steps` instead of `with_end`"
    )]
    FixedSteps,
    /// It is of a run whose steps follow a tolerance, and is to be given a number of steps.
    #[error(
        "the steps of the run follow a tolerance; say when it ends with `with_end` instead of `with_steps`"
    )]
    AdaptiveSteps,
    /// A number in it is impossible: by itself, beside the others, or for the system.
    #[error(
        "the {what} of the checkpoint is {value}, which no run has that agrees with its other numbers; the \
         file is damaged: write another one"
    )]
    Damaged {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl std::fmt::Debug for ResumeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}

impl Checkpoint {
    /// The number of steps taken.
    pub const fn step(&self) -> usize {
        self.step
    }

    /// The time reached.
    pub const fn time(&self) -> f64 {
        self.time.0
    }

    /// The entries of the point reached.
    pub fn point(&self) -> impl Iterator<Item = f64> {
        self.point.iter().map(|x| x.0)
    }

    /// The same run in so many steps of one size, those taken so far among them: a run that has reached
    /// its end goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::AdaptiveSteps`] if its steps follow a tolerance; [`ResumeError::Span`] if it has taken
    /// as many already, or the end would be too late for a number.
    pub fn with_steps(mut self, count: usize) -> Result<Self, ResumeError> {
        let SavedStepSize::Fixed { h } = self.step_size else {
            return Err(ResumeError::AdaptiveSteps);
        };
        if count <= self.step {
            return Err(SpanError::NoSteps.into());
        }
        check_steps(self.start.0, h.0, count)?;
        self.count = Some(count);
        self.go_on();
        Ok(self)
    }

    /// The same run to another time, in steps that follow its tolerance: a run that has reached its end
    /// goes on. One that has come to rest stays there.
    ///
    /// # Errors
    ///
    /// [`ResumeError::FixedSteps`] if its steps are of one size; [`ResumeError::Span`] if the end is not
    /// after the time reached.
    pub fn with_end(mut self, end: f64) -> Result<Self, ResumeError> {
        let SavedStepSize::Adaptive { end: old, .. } = &mut self.step_size else {
            return Err(ResumeError::FixedSteps);
        };
        check_end(self.time.0, end)?;
        *old = Exact(end);
        self.go_on();
        Ok(self)
    }

    fn go_on(&mut self) {
        if matches!(self.ending, Some(SavedEnding::Span | SavedEnding::Event { .. })) {
            self.ending = None;
        }
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
    expect_length(what, list.len(), like.len())?;
    match list.iter().find(|number| !number.0.is_finite()) {
        Some(number) => Err(ResumeError::Damaged { what, value: number.0 }),
        None => Ok(like.with(|i| list[i].0)),
    }
}

const fn expect_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ResumeError> {
    if found == expected { Ok(()) } else { Err(ResumeError::Length { what, found, expected }) }
}

impl<'a, F: Flow, M: Method<F>> Steps<'a, F, M> {
    /// All that the next steps depend on, but for the system and the method.
    pub fn checkpoint(&self) -> Checkpoint {
        let State { step, time, point, energy, entropy } = &self.state;
        let Progress { step_size, scales, largest_velocity, .. } = &self.progress;
        let velocity = self.flow.rates(point, &self.flow.sizes(point).map(|_| 0.0));
        let known = self.certificate.invariants.len();
        let mut memory = Saved::default();
        self.memory.save(&mut memory);
        Checkpoint {
            version: VERSION,
            step: *step,
            start: Exact(self.progress.start),
            time: Exact(*time),
            point: exact(F::Space::numbers(point)),
            velocity: velocity.map_or_else(Vec::new, |v| column(&v)),
            energy: Exact(*energy),
            entropy: Exact(*entropy),
            kept_entropy: Exact(self.entropy),
            invariants: exact(self.values.invariants.as_ref()[..known].iter().copied()),
            memory,
            balance: Balance::of(&self.certificate),
            step_size: SavedStepSize::of(step_size),
            count: self.progress.count,
            every: self.progress.every,
            most: self.progress.most,
            sizes: column(&scales.sizes),
            terms: column(&scales.terms),
            rest: self.progress.rest.map(Exact),
            largest_velocity: column(largest_velocity),
            ending: self.progress.ending.map(SavedEnding::of),
        }
    }

    /// A run that was put down.
    pub(crate) fn resume(method: M, flow: &'a F, c: &Checkpoint) -> Result<Self, ResumeError> {
        if c.version != VERSION {
            return Err(ResumeError::Version { found: c.version, expected: VERSION });
        }
        let entries: Vec<f64> = c.point().collect();
        let point = flow.element(&entries)?;
        let mut certificate = Certificate::start(flow, &point, method.promises(flow));
        c.balance.restore(&mut certificate)?;
        let progress = progress(c, &flow.sizes(&point), (method.order(), method.control()))?;
        let memory = M::Memory::restore(&c.memory)?;
        expect_length("further invariants", c.invariants.len(), certificate.invariants.len())?;
        validation::of_the_system(flow, &point, c)?;
        validation::of_the_balance(flow, &point, c, certificate.promises)?;
        validation::of_the_schedule(c, &progress)?;
        validation::of_the_entries(flow, &point, &progress, &memory)?;
        let mut values = flow.laws(&point);
        (values.energy, values.entropy) = (c.energy.0, c.entropy.0);
        for (k, stored) in c.invariants.iter().enumerate() {
            values.invariants[k] = stored.0;
        }
        let (energy, entropy, time) = (c.energy.0, c.entropy.0, c.time.0);
        let state = State { step: c.step, time, point, energy, entropy };
        let (kept, h) = (c.kept_entropy.0, 0.0);
        let before = StepBefore { state: state.clone(), values: values.clone(), entropy: kept, h };
        Ok(Self {
            promises: certificate.promises,
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

fn progress<V: Vector>(
    c: &Checkpoint,
    like: &V,
    (order, control): (u32, Control),
) -> Result<Progress<V>, ResumeError> {
    let damaged = |what, value| Err(ResumeError::Damaged { what, value });
    if c.every == 0 {
        return damaged("interval of its records", 0.0);
    }
    let positive = |what, h: Exact| match check_step_size(h.0) {
        Ok(()) => Ok(h.0),
        Err(_) => Err(ResumeError::Damaged { what, value: h.0 }),
    };
    let step_size = match &c.step_size {
        SavedStepSize::Fixed { h } => StepSize::Fixed(positive("step size", *h)?),
        SavedStepSize::Adaptive {
            end,
            tolerance,
            entries,
            least,
            largest,
            next,
            taken,
            error,
            rejected,
            cap,
        } => StepSize::Adaptive(Controller {
            order,
            control,
            start: c.start.0,
            end: end.0,
            tolerance: positive("tolerance", *tolerance)?,
            entries: entries.restore(like)?,
            least: least.map(|h| positive("least step", h)).transpose()?,
            largest: largest.map(|h| positive("largest step", h)).transpose()?,
            next: positive("next step", *next)?,
            taken: taken.map(|h| positive("last step", h)).transpose()?,
            error: error.map(|e| positive("last error", e)).transpose()?,
            rejected: *rejected,
            cap: match cap {
                Some(SavedCap { size, before, steps }) => Some(Cap {
                    size: positive("bound of the step size", *size)?,
                    before: before.0,
                    steps: *steps,
                }),
                None => None,
            },
        }),
    };
    Ok(Progress {
        step_size,
        start: c.start.0,
        count: c.count,
        every: c.every,
        most: c.most,
        scales: Scales {
            sizes: vector("sizes of the entries", &c.sizes, like)?,
            terms: vector("sizes of the terms", &c.terms, like)?,
        },
        rest: c.rest.map(|x| positive("tolerance of rest", x)).transpose()?,
        largest_velocity: vector("largest velocities", &c.largest_velocity, like)?,
        ending: c.ending.as_ref().map(SavedEnding::ending),
    })
}

impl SavedStepSize {
    fn of<V: Vector>(step_size: &StepSize<V>) -> Self {
        match step_size {
            StepSize::Fixed(h) => Self::Fixed { h: Exact(*h) },
            StepSize::Adaptive(c) => Self::Adaptive {
                end: Exact(c.end),
                tolerance: Exact(c.tolerance),
                entries: SavedEntries::of(&c.entries),
                least: c.least.map(Exact),
                largest: c.largest.map(Exact),
                next: Exact(c.next),
                taken: c.taken.map(Exact),
                error: c.error.map(Exact),
                rejected: c.rejected,
                cap: c.cap.map(|Cap { size, before, steps }| SavedCap {
                    size: Exact(size),
                    before: Exact(before),
                    steps,
                }),
            },
        }
    }
}

impl SavedEntries {
    fn of<V: Vector>(entries: &Entries<V>) -> Self {
        match entries {
            Entries::Automatic => Self::Automatic,
            Entries::Scale(sizes) => Self::Scale(column(sizes)),
            Entries::Absolute(errors) => Self::Absolute(column(errors)),
        }
    }

    fn restore<V: Vector>(&self, like: &V) -> Result<Entries<V>, ResumeError> {
        Ok(match self {
            Self::Automatic => Entries::Automatic,
            Self::Scale(list) => Entries::Scale(vector("sizes of entries", list, like)?),
            Self::Absolute(list) => Entries::Absolute(vector("errors of entries", list, like)?),
        })
    }
}

impl SavedEnding {
    const fn of(ending: Ending) -> Self {
        match ending {
            Ending::Span => Self::Span,
            Ending::Rest { speed, largest } => {
                Self::Rest { speed: Exact(speed), largest: Exact(largest) }
            }
            Ending::Event { index } => Self::Event { index },
            Ending::Stopped => Self::Stopped,
        }
    }

    const fn ending(&self) -> Ending {
        match self {
            Self::Span => Ending::Span,
            Self::Rest { speed, largest } => Ending::Rest { speed: speed.0, largest: largest.0 },
            Self::Event { index } => Ending::Event { index: *index },
            Self::Stopped => Ending::Stopped,
        }
    }
}

impl Balance {
    fn of(c: &Certificate) -> Self {
        Self {
            initial_energy: Exact(c.initial_energy),
            max_energy_error: Exact(c.max_energy_error),
            energy_scale: Exact(c.energy_scale),
            friction: Exact(c.friction),
            initial_entropy: Exact(c.initial_entropy),
            min_entropy_increment: Exact(c.min_entropy_increment),
            entropy_gained: Exact(c.entropy_gained),
            entropy_falls: c.entropy_falls,
            min_entropy_slope: Exact(c.min_entropy_slope),
            invariants: c
                .invariants
                .iter()
                .map(|k| (Exact(k.initial), Exact(k.max_error), Exact(k.scale)))
                .collect(),
            max_manifold_defect: Exact(c.max_manifold_defect),
            steps: c.steps,
            smallest_step: Exact(c.smallest_step),
            largest_step: Exact(c.largest_step),
            rejected: c.rejected,
            falls_avoided: c.falls_avoided,
            projected_steps: c.projected_steps,
            stages: c.stages.map(|s| (Exact(s.defect), Exact(s.surplus))),
            effort: c.effort,
            worst_iterations: c.worst_iterations,
            local_error: c.local_error.map(Exact),
            limiting_sites: c.limiting_sites,
        }
    }

    /// Enters these figures into the certificate of the system.
    fn restore(&self, c: &mut Certificate) -> Result<(), ResumeError> {
        expect_length("further invariants", self.invariants.len(), c.invariants.len())?;
        for (balance, (initial, error, scale)) in c.invariants.iter_mut().zip(&self.invariants) {
            (balance.initial, balance.max_error, balance.scale) = (initial.0, error.0, scale.0);
        }
        c.initial_energy = self.initial_energy.0;
        c.max_energy_error = self.max_energy_error.0;
        c.energy_scale = self.energy_scale.0;
        c.friction = self.friction.0;
        c.initial_entropy = self.initial_entropy.0;
        c.min_entropy_increment = self.min_entropy_increment.0;
        c.entropy_gained = self.entropy_gained.0;
        c.entropy_falls = self.entropy_falls;
        c.min_entropy_slope = self.min_entropy_slope.0;
        c.max_manifold_defect = self.max_manifold_defect.0;
        c.steps = self.steps;
        c.smallest_step = self.smallest_step.0;
        c.largest_step = self.largest_step.0;
        c.rejected = self.rejected;
        c.falls_avoided = self.falls_avoided;
        c.projected_steps = self.projected_steps;
        c.stages = self
            .stages
            .map(|(defect, surplus)| StageBalance { defect: defect.0, surplus: surplus.0 });
        c.effort = self.effort;
        c.worst_iterations = self.worst_iterations;
        c.local_error = self.local_error.map(|error| error.0);
        c.limiting_sites = self.limiting_sites;
        Ok(())
    }
}
