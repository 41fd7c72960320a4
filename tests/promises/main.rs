//! Every method on every kind of flow: from a generic start, where the energy is zero, from rest, with fast friction, in
//! units of 1e-30 and 1e30, with steps of one size and with a tolerance.
//!
//! Each cell is right against a closed form, or it is the refusal that the book names. The table of
//! `book/src/guarantees.md` is written from the cells: `METRIPLECTIC_BLESS=1` writes it anew.

#[path = "../models/methods.rs"]
mod methods;
#[path = "../models/stages.rs"]
mod stages;

mod kinds;
mod motion;
mod page;

use kinds::{Asked, BOLTZMANN, BOND, KICK, KICKS, Outcome, TEMPERATURE, World};
use methods::{Every, Explicit, OneStage};
use metriplectic::integrators::Schedule;
use metriplectic::integrators::noise::Numbers as _;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use motion::Modes;
use stages::{Gauss1, Gauss2, Gauss3, Gauss4, Radau2, Radau3, Radau4};

/// The kinds of flows, in the order of the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Friction with an entropy.
    Closed,
    /// The same at values of its parameters.
    Family,
    /// An energy that depends on time, with friction inside.
    Clock,
    /// A motor, with friction inside.
    Port,
    /// A bath, and no entropy inside.
    Bath,
    /// A motor and a bath.
    PortAndBath,
    /// A closed system with noise, by `NinomiyaVictoir` where it `splits` a step, and by `RandomFlow`.
    Noise { splits: bool },
    /// A bath with noise.
    NoisyBath { splits: bool },
    /// A closed system with kicks.
    Jump,
    /// Friction in bonds.
    Lattice,
    /// A motor and a bath.
    OpenLattice,
}

impl Kind {
    const ALL: [Self; 13] = [
        Self::Closed,
        Self::Family,
        Self::Clock,
        Self::Port,
        Self::Bath,
        Self::PortAndBath,
        Self::Noise { splits: false },
        Self::Noise { splits: true },
        Self::NoisyBath { splits: false },
        Self::NoisyBath { splits: true },
        Self::Jump,
        Self::Lattice,
        Self::OpenLattice,
    ];

    /// Runs a method.
    fn run(self, method: Every, asked: &Asked<'_>) -> Outcome {
        match self {
            Self::Family => kinds::family(method, asked),
            Self::Clock => kinds::clock(method, asked),
            Self::Closed | Self::Port | Self::Jump | Self::Noise { .. } => {
                kinds::with_heat(self, method, asked)
            }
            Self::Bath | Self::PortAndBath | Self::NoisyBath { .. } => {
                kinds::in_a_bath(self, method, asked)
            }
            Self::Lattice => kinds::lattice(method, asked),
            Self::OpenLattice => kinds::open_lattice(method, asked),
        }
    }

    fn has_entropy(self) -> bool {
        matches!(
            self,
            Self::Closed
                | Self::Family
                | Self::Clock
                | Self::Port
                | Self::Noise { .. }
                | Self::Jump
                | Self::Lattice
        )
    }

    const fn is_noisy(self) -> bool {
        matches!(self, Self::Noise { .. } | Self::NoisyBath { .. })
    }

    fn sites(self) -> usize {
        if matches!(self, Self::Lattice | Self::OpenLattice) { 3 } else { 1 }
    }
}

/// Where a run starts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Start {
    /// It moves.
    Generic,
    /// It moves, and the energy is zero.
    ThroughZero,
    /// At rest, where the energy and all of its terms are zero.
    Zero,
    /// At rest, where the energy is not zero.
    Rest,
    /// It moves, with friction that is faster than a step.
    Stiff,
}

impl Start {
    const ALL: [Self; 5] = [Self::Generic, Self::ThroughZero, Self::Zero, Self::Rest, Self::Stiff];
}

/// How long the steps are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Fixed,
    Tolerance,
}

/// The end of all runs, in units of a model.
const END: f64 = 2.0;

/// `(q, p, s)` at the start, in units of the model, and the model.
fn case(kind: Kind, start: Start, unit: f64) -> (World, Vec<[f64; 3]>) {
    let mut world = World { units: [unit; 3], rates: [1.3, 0.4], drive: [0.8, 1.7], offset: 0.0 };
    let moving = [[1.0, 0.3, 0.5], [-0.4, 0.7, -0.2], [0.1, -0.6, 0.3]];
    let mut x = vec![[0.0; 3]; kind.sites()];
    match start {
        Start::Generic | Start::Stiff => x.copy_from_slice(&moving[..kind.sites()]),
        Start::ThroughZero => {
            x.copy_from_slice(&moving[..kind.sites()]);
            let energy = |[q, p, s]: &[f64; 3]| {
                let heat = if kind.has_entropy() { TEMPERATURE * s } else { 0.0 };
                0.5 * (p * p + world.rates[0].powi(2) * q * q) + heat
            };
            let mut total: f64 = x.iter().map(energy).sum();
            for pair in x.windows(2) {
                total += 0.5 * BOND * (pair[1][0] - pair[0][0]).powi(2);
            }
            world.offset = -total / x.len() as f64;
        }
        Start::Zero => {}
        Start::Rest => {
            world.offset = 1.0;
            x.fill([0.0, 0.0, 0.5]);
        }
    }
    if start == Start::Stiff {
        world.rates[1] = 1e3;
    }
    (world, x)
}

/// The drive `D sin Ωt`.
fn drive(world: &World) -> Modes {
    Modes::wave(world.drive[1], [0.0, world.drive[0]])
}

/// What is right: a number, and the size that its error is relative to.
type Right = Vec<(f64, f64)>;

/// The state at `t`, and what has been booked until then. A path with noise is compared with the flows of its steps in closed form,
/// with the same random numbers.
fn right(kind: Kind, world: &World, x: &[[f64; 3]], t: f64, steps: usize) -> Right {
    let [omega, gamma] = world.rates;
    let still = Modes::wave(1.0, [0.0; 2]);
    let pair = |motion: &Modes| {
        let speed = motion.slope();
        [(motion.at(t), motion.size()), (speed.at(t), speed.size())]
    };
    let heat = |speed: &Modes| gamma * speed.integral(speed, t);
    let [q, p, s] = x[0];
    let mut right: Right = Vec::new();
    match kind {
        Kind::Closed | Kind::Family => {
            let motion = Modes::oscillator([q, p], world.rates, &still);
            right.extend(pair(&motion));
            let gained = heat(&motion.slope()) / TEMPERATURE;
            right.push((s + gained, s.abs().max(gained)));
        }
        Kind::Clock => {
            let motion = Modes::oscillator([q, p], world.rates, &drive(world));
            right.extend(pair(&motion));
            let gained = heat(&motion.slope()) / TEMPERATURE;
            right.push((s + gained, s.abs().max(gained)));
            // −∫ (ω²q − D sin Ωt) (D/ω² sin Ωt)'.
            let shift = drive(world).slope();
            let pull = drive(world).plus(-omega * omega, &motion);
            let factor = (omega * omega).recip();
            right.push((factor * pull.integral(&shift, t), factor * pull.gross(&shift, t)));
        }
        Kind::Port | Kind::PortAndBath => {
            let motion = Modes::oscillator([q, p], world.rates, &drive(world));
            right.extend(pair(&motion));
            let (speed, force) = (motion.slope(), drive(world));
            let heat = heat(&speed);
            let gained = heat / TEMPERATURE;
            if kind == Kind::Port {
                right.push((s + gained, s.abs().max(gained)));
            }
            right.push((force.integral(&speed, t), force.gross(&speed, t)));
            if kind == Kind::PortAndBath {
                right.extend([(-heat, heat), (gained, gained)]);
            }
        }
        Kind::Bath => {
            let motion = Modes::oscillator([q, p], world.rates, &still);
            right.extend(pair(&motion));
            let heat = heat(&motion.slope());
            right.extend([(-heat, heat), (heat / TEMPERATURE, heat / TEMPERATURE)]);
        }
        Kind::Jump => {
            let (mut state, mut gained, mut from) = ([q, p], 0.0, 0.0);
            let mut sizes = [0.0_f64; 2];
            for to in KICKS.into_iter().chain([t]) {
                let motion = Modes::oscillator(state, world.rates, &still);
                let speed = motion.slope();
                gained += gamma * speed.integral(&speed, to - from) / TEMPERATURE;
                sizes = [sizes[0].max(motion.size()), sizes[1].max(speed.size())];
                state = [motion.at(to - from), speed.at(to - from) + KICK];
                from = to;
            }
            right.extend([(state[0], sizes[0]), (state[1] - KICK, sizes[1])]);
            right.push((s + gained, s.abs().max(gained)));
        }
        Kind::Noise { splits } | Kind::NoisyBath { splits } => {
            // The flows of a step in closed form, with the numbers of the path.
            let h = t / steps as f64;
            let (mut state, mut heat, mut gross) = ([q, p], 0.0, 0.0);
            let strength = (2.0 * BOLTZMANN * TEMPERATURE * gamma * h).sqrt();
            let mut sizes = [0.0_f64; 2];
            for step in 0..steps {
                for part in 0..2 {
                    if part == 1 || splits {
                        let h = if splits { 0.5 * h } else { h };
                        let motion = Modes::oscillator(state, world.rates, &still);
                        let speed = motion.slope();
                        heat += gamma * speed.integral(&speed, h);
                        gross += gamma * speed.integral(&speed, h);
                        sizes = [sizes[0].max(motion.size()), sizes[1].max(speed.size())];
                        state = [motion.at(h), speed.at(h)];
                    }
                    if part == usize::from(!splits) {
                        let kick = strength * kinds::numbers().number(step as u64, 0);
                        let change = 0.5 * (state[1] + kick).powi(2) - 0.5 * state[1].powi(2);
                        heat -= change;
                        gross += change.abs();
                        state[1] += kick;
                    }
                }
            }
            right.extend([(state[0], sizes[0]), (state[1], sizes[1])]);
            if kind.has_entropy() {
                right.push((s + heat / TEMPERATURE, s.abs().max(gross)));
            } else {
                right.extend([(-heat, gross), (heat / TEMPERATURE, gross / TEMPERATURE)]);
            }
        }
        Kind::Lattice | Kind::OpenLattice => {
            // The normal modes of three sites.
            let shapes = [[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [1.0, -2.0, 1.0]];
            let stiffness = [0.0, 1.0, 3.0];
            let mut sites = [still.clone(), still.clone(), still.clone()];
            for (shape, stiffness) in shapes.iter().zip(stiffness) {
                let norm = shape.iter().map(|a: &f64| a * a).sum::<f64>().sqrt();
                let along =
                    |k: usize| x.iter().zip(shape).map(|(x, a)| x[k] * a / norm).sum::<f64>();
                let omega = (omega * omega + BOND * stiffness).sqrt();
                let (gamma, force) = if kind == Kind::Lattice {
                    (gamma * stiffness, still.clone())
                } else {
                    (gamma, still.plus(shape[0] / norm, &drive(world)))
                };
                let mode = Modes::oscillator([along(0), along(1)], [omega, gamma], &force);
                for (site, a) in sites.iter_mut().zip(shape) {
                    *site = site.plus(a / norm, &mode);
                }
            }
            let mut gained = [0.0; 3];
            for bond in 0..2 {
                let slip = sites[bond + 1].plus(-1.0, &sites[bond]).slope();
                let heat = 0.5 * gamma * slip.integral(&slip, t) / TEMPERATURE;
                gained[bond] += heat;
                gained[bond + 1] += heat;
            }
            for (i, site) in sites.iter().enumerate() {
                right.extend(pair(site));
                if kind == Kind::Lattice {
                    right.push((x[i][2] + gained[i], x[i][2].abs().max(gained[i])));
                }
            }
            // An error is relative to the largest size on the lattice.
            let per_site = if kind == Kind::Lattice { 3 } else { 2 };
            for entry in 0..per_site {
                let of_site = |i: usize| right[i * per_site + entry].1;
                let largest = (0..3).map(of_site).fold(0.0, f64::max);
                for i in 0..3 {
                    right[i * per_site + entry].1 = largest;
                }
            }
            if kind == Kind::OpenLattice {
                let force = drive(world);
                let first = sites[0].slope();
                right.push((force.integral(&first, t), force.gross(&first, t)));
                let heat: f64 = sites.iter().map(|site| heat(&site.slope())).sum();
                right.extend([(-heat, heat), (heat / TEMPERATURE, heat / TEMPERATURE)]);
            }
        }
    }
    right
}

/// The order of a method, as the book has it.
fn order(method: Every) -> u32 {
    match method {
        Every::OneStage(OneStage::Exponential | OneStage::ItohAbe) => 1,
        Every::OneStage(_) | Every::Explicit(Explicit::Chebyshev) => 2,
        Every::Implicit(stages) => match stages {
            Gauss1 => 2,
            Gauss2 => 4,
            Gauss3 => 6,
            Gauss4 => 8,
            Radau2 => 3,
            Radau3 => 5,
            Radau4 => 7,
        },
        Every::Explicit(Explicit::Kutta3) => 3,
        Every::Explicit(Explicit::Order5) => 5,
        Every::Explicit(Explicit::Order8) => 8,
    }
}

/// A tolerance for some hundred steps at most, where friction is slow.
fn tolerance(method: Every) -> f64 {
    match order(method) {
        1 => 1e-2,
        2 => 1e-4,
        3 => 1e-5,
        _ => 1e-8,
    }
}

/// What a method is asked for, and its number of steps of one size.
fn schedule(method: Every, course: Course, unit: f64) -> (Schedule, usize) {
    let steps = if order(method) < 3 { 100 } else { 40 };
    match course {
        Course::Fixed => (Span::steps(END / steps as f64 * unit, steps).into(), steps),
        Course::Tolerance => (Span::until(END * unit).tolerance(tolerance(method)).into(), 0),
    }
}

/// One run.
#[derive(Clone, Copy, Debug)]
struct Cell {
    kind: Kind,
    method: Every,
    start: Start,
    unit: f64,
    course: Course,
}

/// What a run has shown that the book says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    /// It is right.
    Right,
    /// It is not, and the certificate says that the steps are too long.
    Named,
    /// It is refused.
    Refused(&'static str),
}

/// The error that the book names for a cell.
fn refusal(cell: &Cell) -> Option<&'static str> {
    use Kind::*;
    let Cell { kind, method, start, course, .. } = *cell;
    let is_radau = matches!(method, Every::Implicit(Radau2 | Radau3 | Radau4));
    let is_tableau =
        matches!(method, Every::Explicit(Explicit::Kutta3 | Explicit::Order5 | Explicit::Order8));
    match kind {
        Noise { .. } | NoisyBath { .. } if course == Course::Tolerance => {
            Some("NoiseError::NeedsFixedSteps")
        }
        Noise { .. } | NoisyBath { .. } if is_radau => Some("NoiseError::NoiseWithRadau"),
        Noise { splits } | NoisyBath { splits } if splits && order(method) == 1 => {
            Some("NoiseError::OrderTooLow")
        }
        Noise { .. } | NoisyBath { .. } if start == Start::Stiff => Some(if is_tableau {
            "NoiseError::StabilityUnresolved"
        } else {
            "NoiseError::FrictionUnresolved"
        }),
        Clock | Port if is_radau => Some("NotDamped"),
        _ => None,
    }
}

/// The largest error of a run with steps of one size, of twice what is measured or more; from rest the explicit methods
/// lose an order, as `book/src/open_systems.md` says.
fn bound(kind: Kind, method: Every) -> f64 {
    match method {
        Every::OneStage(OneStage::Exponential) => 1e-2,
        Every::OneStage(OneStage::ItohAbe) if matches!(kind, Kind::Lattice | Kind::OpenLattice) => {
            6e-3
        }
        Every::OneStage(_) | Every::Implicit(Gauss1) => 1e-3,
        Every::Implicit(Gauss2) => 2e-6,
        Every::Implicit(Gauss3) => 2e-10,
        Every::Implicit(Gauss4) => 1e-12,
        Every::Implicit(Radau2) => 3e-4,
        Every::Implicit(Radau3) => 3e-8,
        Every::Implicit(Radau4) => 2e-12,
        Every::Explicit(Explicit::Kutta3) => 2e-3,
        Every::Explicit(Explicit::Order5) => 1e-7,
        Every::Explicit(Explicit::Order8) => 1e-12,
        Every::Explicit(Explicit::Chebyshev) => 5e-3,
    }
}

/// The error from which on a step that is longer than the friction has not damped it.
const DAMPED: f64 = 1e-3;

/// An error with a tolerance, in units of it.
const OF_TOLERANCE: f64 = 10.0;

/// What a cell shows; an error in words.
fn judged(cell: &Cell, farthest: &mut [f64; 2]) -> Result<Verdict, String> {
    let Cell { kind, method, start, unit, course } = *cell;
    let (world, x) = case(kind, start, unit);
    let (schedule, steps) = schedule(method, course, unit);
    let asked = Asked { world, start: &x, schedule };
    let expected = refusal(cell);
    let ran = match (kind.run(method, &asked), expected) {
        (Err((name, _)), Some(expected)) if name == expected => {
            return Ok(Verdict::Refused(expected));
        }
        (Err((name, sentence)), _) => return Err(format!("{name}: {sentence}")),
        (Ok(_), Some(expected)) => return Err(format!("it runs: {expected}")),
        (Ok(ran), None) => ran,
    };
    let right = right(kind, &world, &x, END, steps);
    assert_eq!(right.len(), ran.numbers.len());
    let off = right.iter().zip(&ran.numbers).map(|((a, size), b)| {
        let off = (a - b).abs();
        // 0/0 = 0: nothing has flowed, and nothing is booked.
        if off == 0.0 { 0.0 } else { off / size }
    });
    let worst = off.fold(0.0_f64, |a, b| if b > a || b.is_nan() { b } else { a });
    let certificate = &ran.certificate;
    let second = kind.is_noisy() || certificate.keeps_entropy();
    if !(certificate.keeps_energy() && second) {
        return Err(format!("a law: {certificate}"));
    }
    if (ran.time - END).abs() > 4.0 * f64::EPSILON * END {
        return Err(format!("it ends at {}", ran.time));
    }
    let bound = match course {
        Course::Fixed if start == Start::Stiff => bound(kind, method).max(DAMPED),
        Course::Fixed => bound(kind, method),
        Course::Tolerance => OF_TOLERANCE * tolerance(method),
    };
    if worst <= bound {
        let part = &mut farthest[course as usize];
        *part = part.max(worst / bound);
        Ok(Verdict::Right)
    } else if start == Start::Stiff && course == Course::Fixed && !certificate.is_resolved() {
        Ok(Verdict::Named)
    } else {
        Err(format!("off by {worst:.1e}"))
    }
}

/// Cells that are wrong today, and what they show.
struct NotYet {
    cells: fn(&Cell) -> bool,
    shows: &'static str,
}

/// The cells that are wrong today. A cell may be right nevertheless; an entry that no cell shows is to be deleted.
const NOT_YET: &[NotYet] = &[
    // A fall of the entropy by its round-off, from rest.
    NotYet {
        cells: |cell| is_chebyshev(cell) && cell.kind == Kind::Port && cell.start == Start::Rest,
        shows: "StepError::EntropyFalls",
    },
    // Inside a step that is at the edge of stability, the dense output of order 8 follows no tolerance.
    NotYet {
        cells: |cell| {
            cell.kind == Kind::Jump
                && cell.method == Every::Explicit(Explicit::Order8)
                && cell.start == Start::Stiff
                && cell.course == Course::Tolerance
        },
        shows: "off by",
    },
    // Chebyshev's production may be negative in a step that is long for friction, and a path meets such a step.
    NotYet {
        cells: |cell| {
            is_chebyshev(cell)
                && cell.kind.is_noisy()
                && cell.start == Start::Stiff
                && cell.course == Course::Fixed
        },
        shows: "StepError::EntropyFalls",
    },
    // Schemes of order 1 say that their order is 2.
    NotYet {
        cells: |cell| cell.kind.is_noisy() && order(cell.method) == 1,
        shows: "it runs: NoiseError::OrderTooLow",
    },
    NotYet {
        cells: |cell| cell.kind.is_noisy() && order(cell.method) == 1,
        shows: "NoiseError::FrictionUnresolved",
    },
];

fn is_chebyshev(cell: &Cell) -> bool {
    cell.method == Every::Explicit(Explicit::Chebyshev)
}

#[test]
fn every_method_is_right_on_every_kind_of_flow_or_says_why_not() {
    let mut wrong = Vec::new();
    let mut stale: Vec<bool> = NOT_YET.iter().map(|_| true).collect();
    let mut table = page::Table::default();
    let (mut cells, mut farthest) = (0, [0.0; 2]);
    for kind in Kind::ALL {
        let began = std::time::Instant::now();
        for method in Every::all() {
            for start in Start::ALL {
                for unit in [1.0, 1e-30, 1e30] {
                    for course in [Course::Fixed, Course::Tolerance] {
                        let cell = Cell { kind, method, start, unit, course };
                        let promised = refusal(&cell).map_or(Verdict::Right, Verdict::Refused);
                        let shown = judged(&cell, &mut farthest);
                        cells += 1;
                        let shown = match shown {
                            Ok(verdict) => {
                                table.enter(&cell, verdict);
                                continue;
                            }
                            Err(shown) => shown,
                        };
                        let is_known =
                            |entry: &NotYet| (entry.cells)(&cell) && shown.starts_with(entry.shows);
                        match NOT_YET.iter().position(is_known) {
                            Some(entry) => {
                                stale[entry] = false;
                                table.enter(&cell, promised);
                            }
                            None => wrong.push(format!("{cell:?}: {shown}")),
                        }
                    }
                }
            }
        }
        println!("{kind:?}: {:.2?}", began.elapsed());
    }
    let entries = NOT_YET.iter().zip(stale);
    for (entry, _) in entries.filter(|(_, is_stale)| *is_stale) {
        wrong.push(format!("no cell shows \"{}\" any more: delete its entry", entry.shows));
    }
    println!("{cells} cells, off by {farthest:.2?} of what is allowed");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    page::compare(&table);
    for (course, farthest) in ["steps of one size", "a tolerance"].iter().zip(farthest) {
        let problem =
            format!("{cells} runs, those with {course}: the largest error in units of its bound");
        Claim::new(Guarantee::Kinds, problem, "all")
            .against("closed forms of a damped oscillator")
            .record(scientific(farthest), "1");
    }
}
