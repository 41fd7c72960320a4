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
//! ones. Another system is noticed if its energy, its entropy, a further invariant or its velocity has
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

mod validation;

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::system::Point;
use metriplectic_fields::{ChartPoint, Column, Dimension, Square};
use metriplectic_manifolds::{Manifold, PointError, Retraction};

use crate::adaptive::{Controller, Entries, StepSize};
use crate::certificate::{Certificate, InvariantBalance};
use crate::discrete_gradient::DiscreteGradient;
use crate::newton::Inverse;
use crate::residual::Dim;
use crate::scales::Scales;
use crate::span::{SpanError, check_end, check_step_size, check_steps};
use crate::step::{Linearisation, Memory, Scheme};
use crate::trajectory::{Ending, Progress, State, Steps};

/// Where a run was put down; made by [`Steps::checkpoint`], taken up by [`Scheme::resume`].
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
    differences: Vec<Vec<Exact>>,
    linearised: Option<SavedLinearisation>,
    compensation: Option<Vec<Exact>>,
    balance: Balance,
    pace: SavedPace,
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

/// The Jacobian that the next step tries first.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct SavedLinearisation {
    /// The inverse, row by row.
    inverse: Vec<Exact>,
    contraction: Exact,
    first: Exact,
    /// The round-off of the solution.
    round_off: Vec<Exact>,
    floor: Exact,
    friction: Exact,
    h: Exact,
    length: Exact,
    steps: u32,
}

/// The version of the format that is written and read.
const VERSION: u32 = 2;

/// A number that keeps its bits in every format.
#[derive(Clone, Copy, Debug)]
struct Exact(f64);

impl PartialEq for Exact {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}

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
    iterations: usize,
    worst_iterations: usize,
    retries: usize,
    continued: usize,
    globalised: usize,
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum SavedPace {
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
    },
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
        let SavedPace::Fixed { h } = self.pace else { return Err(ResumeError::AdaptiveSteps) };
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
        let SavedPace::Adaptive { end: old, .. } = &mut self.pace else {
            return Err(ResumeError::FixedSteps);
        };
        check_end(self.time.0, end)?;
        *old = Exact(end);
        self.go_on();
        Ok(self)
    }

    fn go_on(&mut self) {
        if self.ending == Some(SavedEnding::Span) {
            self.ending = None;
        }
    }
}

fn exact(numbers: impl IntoIterator<Item = f64>) -> Vec<Exact> {
    numbers.into_iter().map(Exact).collect()
}

fn column<V: Column<f64>>(v: &V) -> Vec<Exact> {
    exact((0..V::LEN).map(|i| v[i]))
}

/// The vector with these components.
fn vector<V: Column<f64>>(what: &'static str, list: &[Exact]) -> Result<V, ResumeError> {
    expect_length(what, list.len(), V::LEN)?;
    let v = V::from_index(|i| list[i].0);
    if v.is_finite() { Ok(v) } else { Err(ResumeError::Damaged { what, value: v.magnitude() }) }
}

const fn expect_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ResumeError> {
    if found == expected { Ok(()) } else { Err(ResumeError::Length { what, found, expected }) }
}

impl<Y, R, W> Steps<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// All that the next steps depend on, but for the system and the scheme.
    pub fn checkpoint(&self) -> Checkpoint {
        let State { step, time, point, energy, entropy } = &self.state;
        let Progress { pace, start, count, every, most, scales, rest, largest_velocity, ending } =
            self.progress;
        let velocity = self.system.velocity(&ChartPoint::centre(point));
        let known = self.certificate.invariants.len();
        Checkpoint {
            version: VERSION,
            step: *step,
            start: Exact(start),
            time: Exact(*time),
            point: exact(Y::Manifold::entries(point)),
            velocity: velocity.map_or_else(|_| Vec::new(), |v| column(&v)),
            energy: Exact(*energy),
            entropy: Exact(*entropy),
            kept_entropy: Exact(self.entropy),
            invariants: exact((0..known).map(|k| self.invariants[k])),
            differences: self.memory.differences[..self.memory.known].iter().map(column).collect(),
            linearised: self.memory.linearised.as_ref().map(SavedLinearisation::of),
            compensation: self.memory.compensation.as_ref().map(column),
            balance: Balance::of(&self.certificate),
            pace: SavedPace::of(pace),
            count,
            every,
            most,
            sizes: column(&scales.sizes),
            terms: column(&scales.terms),
            rest: rest.map(Exact),
            largest_velocity: column(&largest_velocity),
            ending: ending.map(SavedEnding::of),
        }
    }
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Takes up a run where it was put down. With the system and the scheme of that run the steps
    /// are those that it would have taken, bit for bit.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if the checkpoint does not belong to the system, or is damaged.
    pub fn resume<'a, Y>(
        self,
        system: &'a Y,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, Y, R, W>, ResumeError>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let c = checkpoint;
        if c.version != VERSION {
            return Err(ResumeError::Version { found: c.version, expected: VERSION });
        }
        let entries: Vec<f64> = c.point().collect();
        let point = system.manifold().from_entries(&entries)?;
        let certificate = c.balance.certificate(system, &point)?;
        let progress = progress(c)?;
        let memory = memory(c)?;
        expect_length("further invariants", c.invariants.len(), certificate.invariants.len())?;
        validation::of_the_system(system, &point, c)?;
        validation::of_the_balance(system, &point, c)?;
        validation::of_the_course(c, &progress)?;
        validation::of_the_entries::<Y>(&point, &progress, &memory)?;
        let invariants =
            Dim::<Y>::array(|k| c.invariants.get(k).map_or(0.0, |invariant| invariant.0));
        let (energy, entropy, time) = (c.energy.0, c.entropy.0, c.time.0);
        let state = State { step: c.step, time, point, energy, entropy };
        let (entropy, failed) = (c.kept_entropy.0, false);
        let scheme = self;
        Ok(Steps {
            scheme,
            system,
            progress,
            state,
            invariants,
            entropy,
            memory,
            certificate,
            failed,
        })
    }
}

fn memory<N: Dimension>(c: &Checkpoint) -> Result<Memory<N>, ResumeError> {
    let mut memory = Memory::new();
    if c.differences.len() > memory.differences.len() {
        expect_length("displacements", c.differences.len(), memory.differences.len())?;
    }
    memory.known = c.differences.len();
    for (slot, list) in memory.differences.iter_mut().zip(&c.differences) {
        *slot = vector("components of a displacement", list)?;
    }
    let compensation =
        c.compensation.as_deref().map(|list| vector("components of the compensation", list));
    memory.compensation = compensation.transpose()?;
    memory.linearised = c.linearised.as_ref().map(SavedLinearisation::restore).transpose()?;
    Ok(memory)
}

impl SavedLinearisation {
    fn of<N: Dimension>(known: &Linearisation<N>) -> Self {
        let Linearisation { inverse, friction, h, length, steps } = *known;
        let n = N::LEN;
        let rows = |matrix: &N::Matrix<f64>| exact((0..n * n).map(|k| matrix[(k / n, k % n)]));
        Self {
            inverse: rows(&inverse.matrix),
            contraction: Exact(inverse.contraction),
            first: Exact(inverse.first),
            round_off: exact((0..n).map(|i| inverse.round_off[i])),
            floor: Exact(inverse.floor),
            friction: Exact(friction),
            h: Exact(h),
            length: Exact(length),
            steps,
        }
    }

    fn restore<N: Dimension>(&self) -> Result<Linearisation<N>, ResumeError> {
        let n = N::LEN;
        let number = |what, x: Exact| {
            if x.0.is_finite() { Ok(x.0) } else { Err(ResumeError::Damaged { what, value: x.0 }) }
        };
        let matrix = |what, rows: &[Exact]| -> Result<N::Matrix<f64>, ResumeError> {
            expect_length(what, rows.len(), n * n)?;
            rows.iter().try_for_each(|entry| number(what, *entry).map(drop))?;
            Ok(N::Matrix::<f64>::from_entries(|i, j| rows[i * n + j].0))
        };
        let inverse = Inverse {
            matrix: matrix("entries of an inverse", &self.inverse)?,
            round_off: vector("round-off of the solution", &self.round_off)?,
            floor: number("round-off of the residual", self.floor)?,
            contraction: number("contraction", self.contraction)?,
            first: self.first.0,
        };
        Ok(Linearisation {
            inverse,
            friction: number("rate of friction", self.friction)?,
            h: number("step size", self.h)?,
            length: number("length of a step", self.length)?,
            steps: self.steps,
        })
    }
}

fn progress<N: Dimension>(c: &Checkpoint) -> Result<Progress<N>, ResumeError> {
    let damaged = |what, value| Err(ResumeError::Damaged { what, value });
    if c.every == 0 {
        return damaged("interval of its records", 0.0);
    }
    let positive = |what, h: Exact| match check_step_size(h.0) {
        Ok(()) => Ok(h.0),
        Err(_) => Err(ResumeError::Damaged { what, value: h.0 }),
    };
    let pace = match &c.pace {
        SavedPace::Fixed { h } => StepSize::Fixed(positive("step size", *h)?),
        SavedPace::Adaptive {
            end,
            tolerance,
            entries,
            least,
            largest,
            next,
            taken,
            error,
            rejected,
        } => StepSize::Adaptive(Controller {
            start: c.start.0,
            end: end.0,
            tolerance: positive("tolerance", *tolerance)?,
            entries: entries.restore()?,
            least: least.map(|h| positive("least step", h)).transpose()?,
            largest: largest.map(|h| positive("largest step", h)).transpose()?,
            next: positive("next step", *next)?,
            taken: taken.map(|h| positive("last step", h)).transpose()?,
            error: error.map(|e| positive("last error", e)).transpose()?,
            rejected: *rejected,
        }),
    };
    Ok(Progress {
        pace,
        start: c.start.0,
        count: c.count,
        every: c.every,
        most: c.most,
        scales: Scales {
            sizes: vector("sizes of the entries", &c.sizes)?,
            terms: vector("sizes of the terms", &c.terms)?,
        },
        rest: c.rest.map(|x| positive("tolerance of rest", x)).transpose()?,
        largest_velocity: vector("largest velocities", &c.largest_velocity)?,
        ending: c.ending.as_ref().map(SavedEnding::ending),
    })
}

impl SavedPace {
    fn of<N: Dimension>(pace: StepSize<N>) -> Self {
        match pace {
            StepSize::Fixed(h) => Self::Fixed { h: Exact(h) },
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
            },
        }
    }
}

impl SavedEntries {
    fn of<V: Column<f64>>(entries: &Entries<V>) -> Self {
        match entries {
            Entries::Automatic => Self::Automatic,
            Entries::Scale(sizes) => Self::Scale(column(sizes)),
            Entries::Absolute(errors) => Self::Absolute(column(errors)),
        }
    }

    fn restore<V: Column<f64>>(&self) -> Result<Entries<V>, ResumeError> {
        Ok(match self {
            Self::Automatic => Entries::Automatic,
            Self::Scale(list) => Entries::Scale(vector("sizes of entries", list)?),
            Self::Absolute(list) => Entries::Absolute(vector("errors of entries", list)?),
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
            Ending::Stopped => Self::Stopped,
        }
    }

    const fn ending(&self) -> Ending {
        match self {
            Self::Span => Ending::Span,
            Self::Rest { speed, largest } => Ending::Rest { speed: speed.0, largest: largest.0 },
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
            iterations: c.iterations,
            worst_iterations: c.worst_iterations,
            retries: c.retries,
            continued: c.continued,
            globalised: c.globalised,
        }
    }

    fn certificate<Y: Metriplectic>(
        &self,
        system: &Y,
        point: &Point<Y>,
    ) -> Result<Certificate, ResumeError> {
        use metriplectic_dynamics::Dissipation as _;
        let mut invariants = InvariantBalance::of(system, point);
        expect_length("further invariants", self.invariants.len(), invariants.len())?;
        for (kept, (initial, max_error, scale)) in invariants.iter_mut().zip(&self.invariants) {
            (kept.initial, kept.max_error, kept.scale) = (initial.0, max_error.0, scale.0);
        }
        Ok(Certificate {
            initial_energy: self.initial_energy.0,
            max_energy_error: self.max_energy_error.0,
            energy_scale: self.energy_scale.0,
            friction: self.friction.0,
            initial_entropy: self.initial_entropy.0,
            min_entropy_increment: self.min_entropy_increment.0,
            entropy_gained: self.entropy_gained.0,
            entropy_falls: self.entropy_falls,
            min_entropy_slope: self.min_entropy_slope.0,
            invariants,
            max_manifold_defect: self.max_manifold_defect.0,
            steps: self.steps,
            smallest_step: self.smallest_step.0,
            largest_step: self.largest_step.0,
            rejected: self.rejected,
            iterations: self.iterations,
            worst_iterations: self.worst_iterations,
            retries: self.retries,
            continued: self.continued,
            globalised: self.globalised,
            second_law: system.second_law(),
            projected: system.dissipation().is_projected(),
        })
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Exact {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_str(&format_args!("{:?}", self.0))
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Exact {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Digits;
        impl serde::de::Visitor<'_> for Digits {
            type Value = f64;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the digits of a number in a string, such as \"0.1\"")
            }

            fn visit_str<E: serde::de::Error>(self, digits: &str) -> Result<f64, E> {
                digits
                    .parse()
                    .map_err(|_| E::invalid_value(serde::de::Unexpected::Str(digits), &self))
            }
        }
        if deserializer.is_human_readable() {
            deserializer.deserialize_str(Digits).map(Self)
        } else {
            f64::deserialize(deserializer).map(Self)
        }
    }
}
