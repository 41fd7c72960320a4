//! The kinds of flows: a damped oscillator in any units, its surroundings, and a chain of three of them.

use metriplectic::integrators::noise::Counter;
use metriplectic::integrators::{Certificate, MethodError, NotDamped, Schedule, StateSpace};
use metriplectic::lattices::LatticeError;
use metriplectic::prelude::*;

use crate::Kind;
use crate::methods::{Every, OneStage};
use crate::stages::Stages;

/// Constants of a model, in units of its own: `q'' + γq' + ω²q = D sin Ωt`, in units of a length, a time and an energy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct World {
    /// The units of length, time and energy.
    pub(crate) units: [f64; 3],
    /// The rates `ω` and `γ`.
    pub(crate) rates: [f64; 2],
    /// The amplitude `D` and the rate `Ω` of the drive.
    pub(crate) drive: [f64; 2],
    /// A constant in the energy.
    pub(crate) offset: f64,
}

/// The temperature of the oscillator and of its bath.
pub(crate) const TEMPERATURE: f64 = 0.7;
/// Boltzmann's constant, in units of an entropy.
pub(crate) const BOLTZMANN: f64 = 0.2;
/// The stiffness of bonds.
pub(crate) const BOND: f64 = 0.6;

impl World {
    fn momentum(&self) -> f64 {
        let [length, time, energy] = self.units;
        energy * time / length
    }

    /// A rate of friction along the momentum, `p' = −rate ∂H/∂p`.
    fn friction(&self) -> f64 {
        self.rates[1] * self.momentum().powi(2) / (self.units[1] * self.units[2])
    }

    fn state(&self, [q, p]: [f64; 2]) -> Vector2<f64> {
        vector![q * self.units[0], p * self.momentum()]
    }

    fn with_heat(&self, [q, p, s]: [f64; 3]) -> Vector3<f64> {
        vector![q * self.units[0], p * self.momentum(), s * self.units[2]]
    }

    fn energy(&self, q: Real, p: Real) -> Real {
        let (q, p) = (q / self.units[0], p / self.momentum());
        let stiffness = self.rates[0] * self.rates[0];
        (p * p * 0.5 + q * q * (0.5 * stiffness) + self.offset) * self.units[2]
    }

    /// The amplitude of a force.
    fn force(&self) -> f64 {
        self.drive[0] * self.momentum() / self.units[1]
    }

    /// `sin Ωt`.
    fn sine(&self, t: Real) -> Real {
        (t * (self.drive[1] / self.units[1])).sin()
    }
}

/// What a run is asked for.
#[derive(Clone, Debug)]
pub(crate) struct Asked<'a> {
    pub(crate) world: World,
    /// Position, momentum and entropy at the start; of each site of a lattice.
    pub(crate) start: &'a [[f64; 3]],
    pub(crate) schedule: Schedule,
}

/// The end of a run, in the units of the model.
#[derive(Clone, Debug)]
pub(crate) struct Ran {
    pub(crate) time: f64,
    pub(crate) numbers: Vec<f64>,
    pub(crate) certificate: Certificate,
}

/// The end of a run, or the name of the error that it has ended in, and its sentence.
pub(crate) type Outcome = Result<Ran, (String, String)>;

/// The name of the fault of a method.
fn of_method(error: &MethodError) -> String {
    match error.downcast_ref::<NoiseError>() {
        Some(error) => format!("NoiseError::{}", of_noise(error)),
        None if error.downcast_ref::<NotDamped>().is_some() => "NotDamped".to_owned(),
        None => "MethodError".to_owned(),
    }
}

/// The name of a fault of noise.
const fn of_noise(error: &NoiseError) -> &'static str {
    match error {
        NoiseError::NeedsFixedSteps => "NeedsFixedSteps",
        NoiseError::NoiseWithRadau => "NoiseWithRadau",
        NoiseError::OrderTooLow { .. } => "OrderTooLow",
        NoiseError::StabilityUnresolved => "StabilityUnresolved",
        NoiseError::FrictionUnresolved { .. } => "FrictionUnresolved",
        _ => "?",
    }
}

fn outcome<M: StateSpace>(
    world: &World,
    run: Result<Trajectory<M>, RunError<M>>,
    numbers: impl FnOnce(&M::Element) -> Vec<f64>,
) -> Outcome {
    match run {
        Ok(run) => Ok(Ran {
            time: run.last().time / world.units[1],
            numbers: numbers(&run.last().point),
            certificate: run.certificate().clone(),
        }),
        Err(error) => Err((name_of(&error), error.to_string())),
    }
}

fn name_of<M: StateSpace>(error: &RunError<M>) -> String {
    let step = |name: &str| format!("StepError::{name}");
    match error {
        RunError::Method(error) => of_method(error),
        RunError::Step { cause, .. } => match cause {
            StepError::Method { error, .. } => of_method(error),
            StepError::StiffFriction { .. } => step("StiffFriction"),
            StepError::NotConverged { .. } => step("NotConverged"),
            StepError::NotProjected { .. } => step("NotProjected"),
            StepError::EntropyFalls { .. } => step("EntropyFalls"),
            StepError::FirstLawBroken { .. } => step("FirstLawBroken"),
            StepError::ProtocolJumps { .. } => step("ProtocolJumps"),
            StepError::OutOfDomain { .. } => step("OutOfDomain"),
            StepError::TooSmall { .. } => step("TooSmall"),
            StepError::Standstill { .. } => step("Standstill"),
            StepError::SiteOutOfDomain { .. } => step("SiteOutOfDomain"),
            StepError::NothingBetween { .. } => step("NothingBetween"),
            StepError::WrongDerivative { .. } => step("WrongDerivative"),
            _ => step("?"),
        },
        RunError::Model(_) => "ModelError".to_owned(),
        RunError::Flow(error) => match error.downcast_ref::<NoiseError>() {
            Some(error) => format!("NoiseError::{}", of_noise(error)),
            None => match error.downcast_ref::<LatticeError>() {
                Some(_) => "LatticeError".to_owned(),
                None => "FlowError".to_owned(),
            },
        },
        RunError::Span(_) => "SpanError".to_owned(),
        _ => "?".to_owned(),
    }
}

/// The tensor `Π` of `(q, p, s)`.
fn canonical() -> Matrix3<f64> {
    matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0]
}

fn three(world: &World, x: &Vector3<f64>) -> Vec<f64> {
    vec![x.x / world.units[0], x.y / world.momentum(), x.z / world.units[2]]
}

fn two(world: &World, x: &Vector2<f64>) -> Vec<f64> {
    vec![x.x / world.units[0], x.y / world.momentum()]
}

/// A method for the steps between random numbers.
macro_rules! sampled {
    ($method:expr, $splits:expr, $system:expr, $start:expr, $asked:expr) => {
        if $splits {
            let method = NinomiyaVictoir($method).numbers(numbers());
            method.run($system, $start, $asked.schedule.clone())
        } else {
            let method = RandomFlow($method).numbers(numbers());
            method.run($system, $start, $asked.schedule.clone())
        }
    };
}

/// The oscillator with `H = ½p² + ½ω²q² + Ts`, `S = s` and friction of its momentum: closed, with kicks, with noise, with a motor. The
/// closures have the same types in each of them, so that what they share is compiled once.
pub(crate) fn with_heat(kind: Kind, method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let builder = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(canonical()).expect("it is skew"))
        .energy(move |x: &Vector3<Real>| world.energy(x.x, x.y) + x.z * TEMPERATURE)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(OnsagerDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            [Contact {
                rate: w.z.recip() * world.friction(),
                along: vector![0.0.into(), w.z, -w.y],
            }]
        }));
    let start = world.with_heat(asked.start[0]);
    match kind {
        Kind::Port => {
            let force = move |t: Real, _: &Vector3<Real>| {
                vector![0.0.into(), world.sine(t) * world.force(), 0.0.into()]
            };
            let system = builder.work("motor", force).build().expect("it is a system");
            let run = method.run(&system, system.start(start), asked.schedule.clone());
            outcome(&world, run, |state| [three(&world, &state.x), work(&world, state)].concat())
        }
        Kind::Noise { splits } => {
            let noise = Boltzmann(BOLTZMANN * world.units[2]);
            let system = builder.noise(noise).build().expect("it is a system");
            let run = sampled!(method, splits, &system, start, asked);
            outcome(&world, run, |x| three(&world, x))
        }
        _ => {
            let system = builder.build().expect("it is a system");
            let mut schedule = asked.schedule.clone();
            for at in KICKS.map(|at| at * world.units[1]) {
                if kind == Kind::Jump {
                    let kick = move |_: f64, x: &Vector3<f64>| {
                        vector![x.x, x.y + KICK * world.momentum(), x.z]
                    };
                    let kicks = schedule.event_in_time("kick", move |t, _: &Vector3<f64>| t - at);
                    schedule = kicks.jump(kick).into();
                }
            }
            let run = method.run(&system, start, schedule);
            outcome(&world, run, |x| three(&world, x))
        }
    }
}

/// The oscillator with `H = ½p² + ½ω²q²` in a bath: with a motor, with noise, and without both.
pub(crate) fn in_a_bath(kind: Kind, method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let builder = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| world.energy(x.x, x.y));
    let contact = move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
        [Contact { rate: world.friction().into(), along: vector![0.0.into(), 1.0.into()] }]
    };
    let air = Bath::at(TEMPERATURE).friction(contact);
    let start = world.state([asked.start[0][0], asked.start[0][1]]);
    match kind {
        Kind::PortAndBath => {
            let force = move |t: Real, _: &Vector2<Real>| {
                vector![0.0.into(), world.sine(t) * world.force()]
            };
            let builder = builder.work("motor", force).bath("air", air);
            let system = builder.build().expect("it is a system");
            let run = method.run(&system, system.start(start), asked.schedule.clone());
            outcome(&world, run, |state| {
                [two(&world, &state.x), work(&world, state), heat(&world, state)].concat()
            })
        }
        Kind::NoisyBath { splits } => {
            let noise = Boltzmann(BOLTZMANN * world.units[2]);
            let system = builder.bath("air", air).noise(noise).build().expect("it is a system");
            let run = sampled!(method, splits, &system, system.flow().start(start), asked);
            outcome(&world, run, |state| [two(&world, &state.x), heat(&world, state)].concat())
        }
        _ => {
            let system = builder.bath("air", air).build().expect("it is a system");
            let run = method.run(&system, system.start(start), asked.schedule.clone());
            outcome(&world, run, |state| [two(&world, &state.x), heat(&world, state)].concat())
        }
    }
}

/// A family at values of its parameters.
pub(crate) fn family(method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let family = Family::on(Euclidean::<3>)
        .parameters(["friction", "temperature"])
        .bracket(Poisson::constant(canonical()).expect("it is skew"))
        .energy(move |x: &Vector3<Real>, theta: &Vector2<Real>| {
            world.energy(x.x, x.y) + x.z * theta.y
        })
        .entropy(|x: &Vector3<Real>, _: &Vector2<Real>| x.z)
        .field_dissipation(|_: &Vector3<Real>, w: &Vector3<Real>, theta: &Vector2<Real>| {
            let b = vector![0.0.into(), w.z, -w.y];
            b * b.transpose() * (w.z.recip() * theta.x)
        })
        .build()
        .expect("it is a family");
    let system = family.at(vector![world.friction(), TEMPERATURE]);
    let run = method.run(&system, world.with_heat(asked.start[0]), asked.schedule.clone());
    outcome(&world, run, |x| three(&world, x))
}

/// A closed system whose trap moves, with friction inside.
pub(crate) fn clock(method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let system = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(canonical()).expect("it is skew"))
        .energy_in_time(move |t: Real, x: &Vector3<Real>| {
            let shift = world.drive[0] / world.rates[0].powi(2) * world.units[0];
            world.energy(x.x - world.sine(t) * shift, x.y) + x.z * TEMPERATURE
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(OnsagerDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            [Contact {
                rate: w.z.recip() * world.friction(),
                along: vector![0.0.into(), w.z, -w.y],
            }]
        }))
        .build()
        .expect("it is a system");
    let start = system.start(world.with_heat(asked.start[0]));
    let run = method.run(&system, start, asked.schedule.clone());
    outcome(&world, run, |state| {
        let work = state.ledger.parameter_work() / world.units[2];
        [three(&world, &state.x), vec![work]].concat()
    })
}

/// Heat and entropy of the bath.
fn heat<P>(world: &World, state: &OpenState<P>) -> Vec<f64> {
    let entries = [state.ledger.heat("air"), state.ledger.bath_entropy("air")];
    entries.map(|entry| entry.expect("a column of the ledger") / world.units[2]).to_vec()
}

fn work<P>(world: &World, state: &OpenState<P>) -> Vec<f64> {
    vec![state.ledger.work("motor").expect("a column of the ledger") / world.units[2]]
}

/// The times of the kicks: one on a time of a grid of 0.05, an ulp beside one, and between two; and their size.
pub(crate) const KICKS: [f64; 3] = [0.05 * 3.0, 0.75, 1.23];
pub(crate) const KICK: f64 = 0.4;

/// The random numbers of a path of the oscillator.
pub(crate) fn numbers() -> Counter {
    Counter::new(11)
}

/// A run of a lattice by one of all methods.
macro_rules! run_of_sites {
    ($method:expr, $lattice:expr, $start:expr, $schedule:expr) => {{
        macro_rules! by {
            ($one:expr) => {
                $one.run($lattice, $start, $schedule)
            };
        }
        match $method {
            Every::OneStage(OneStage::Weyl) => by!(WeylMidpoint),
            Every::OneStage(OneStage::Chart) => by!(ChartMidpoint),
            Every::OneStage(OneStage::Exponential) => by!(Exponential),
            Every::OneStage(OneStage::MeanValue) => {
                by!(Scheme::new(WeylMidpoint).gradient(MeanValue))
            }
            Every::OneStage(OneStage::ItohAbe) => by!(Scheme::new(WeylMidpoint).gradient(ItohAbe)),
            Every::Implicit(Stages::Gauss1) => by!(Gauss::<1>),
            Every::Implicit(Stages::Gauss2) => by!(Gauss::<2>),
            Every::Implicit(Stages::Gauss3) => by!(Gauss::<3>),
            Every::Implicit(Stages::Gauss4) => by!(Gauss::<4>),
            Every::Implicit(Stages::Radau2) => by!(Radau::<2>),
            Every::Implicit(Stages::Radau3) => by!(Radau::<3>),
            Every::Implicit(Stages::Radau4) => by!(Radau::<4>),
            Every::Explicit(method) => by!(method),
        }
    }};
}

/// A chain of three oscillators with friction in its bonds, whose heat both sites share.
pub(crate) fn lattice(method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let lattice = Lattice::on(Graph::chain(3), Euclidean::<3>)
        .bracket(Poisson::constant(canonical()).expect("it is skew"))
        .energy(move |x: &Vector3<Real>| world.energy(x.x, x.y) + x.z * TEMPERATURE)
        .bond_energy(move |(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = (y.x - x.x) / world.units[0];
            r * r * (0.5 * BOND * world.units[2])
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(move |bond| {
            let [u, v] = bond.w;
            let slip = 0.5 * (v.y - u.y);
            [Onsager {
                rate: world.friction() * TEMPERATURE,
                b: [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]],
            }]
        })
        .build()
        .expect("it is a lattice");
    let start = lattice.points(|i| world.with_heat(asked.start[i]));
    let run = run_of_sites!(method, &lattice, start, asked.schedule.clone());
    outcome(&world, run, |points| points.iter().flat_map(|x| three(&world, x)).collect())
}

/// A chain of three oscillators in a bath, with a motor at the first.
pub(crate) fn open_lattice(method: Every, asked: &Asked<'_>) -> Outcome {
    let world = asked.world;
    let lattice = Lattice::on(Graph::chain(3), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| world.energy(x.x, x.y))
        .bond_energy(move |(x, y): &(Vector2<Real>, Vector2<Real>)| {
            let r = (y.x - x.x) / world.units[0];
            r * r * (0.5 * BOND * world.units[2])
        })
        .build()
        .expect("it is a lattice")
        .opened()
        .work("motor", [0], move |t, _, _: &Vector2<f64>| {
            vector![0.0, world.force() * (t / world.units[1] * world.drive[1]).sin()]
        })
        .bath("air", TEMPERATURE, 0..3, move |_, _: &SiteState<'_, Euclidean<2>>| {
            [Onsager { rate: world.friction(), b: vector![0.0, 1.0] }]
        });
    let start = lattice.lattice().points(|i| world.state([asked.start[i][0], asked.start[i][1]]));
    let start = lattice.start(start);
    let run = run_of_sites!(method, &lattice, start, asked.schedule.clone());
    outcome(&world, run, |state| {
        let points = state.x.iter().flat_map(|x| two(&world, x));
        points.chain(work(&world, state)).chain(heat(&world, state)).collect()
    })
}
