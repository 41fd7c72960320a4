//! The models of `metriplectic::models`, and reactions by mass action: their laws by every method, and closed forms of the motion.

#[path = "models/methods.rs"]
mod methods;
#[path = "models/stages.rs"]
mod stages;

use std::f64::consts::PI;

use methods::Every;
use metriplectic::models::{
    DampedPiston, DampedRigidBody, Gas, HeatRod, ParameterError, ThermoelasticDoublePendulum,
    TwoGasContainers,
};
use metriplectic::prelude::*;
use metriplectic_studies::Order;

type Point<Y> = <<Y as Metriplectic>::Manifold as metriplectic::fields::Space>::Point<f64>;

/// A wall of 1 g between two tubes of 10 cm with a millimole of helium each.
const TUBES: TwoGasContainers = TwoGasContainers {
    mass: 1e-3,
    length: 0.2,
    gas: 8.314e-3,
    temperature: 300.0,
    conductance: 10.0,
};

/// A piston of 5 kg on a litre of argon at atmospheric pressure.
const PISTON: DampedPiston = DampedPiston {
    mass: 5.0,
    area: 5e-4,
    force: 49.0,
    friction: 20.0,
    gas: Gas::ideal(0.33, 300.0, 1e-3),
};

/// Carbon dioxide by van der Waals' constants of a mole, a = 0.364 J m³ and b = 4.27e-5 m³, with the heat capacity 7/2 R.
const DENSE: Gas = Gas {
    constant: 8.314,
    heat_capacity: 3.5 * 8.314,
    excluded_volume: 4.27e-5,
    attraction: 0.364,
    temperature: 300.0,
    volume: 1e-3,
};

/// The pendulum of Hernández et al. (2021).
const PENDULUM: ThermoelasticDoublePendulum = ThermoelasticDoublePendulum {
    masses: [1.0, 2.0],
    lengths: [2.0, 1.0],
    stiffness: [0.019, 0.188],
    coupling: 0.087,
    heat_capacity: 5.0,
    temperature: 300.0,
    conductance: 300.0,
};

/// Ten centimetres of copper.
const COPPER: HeatRod =
    HeatRod { length: 0.1, cross_section: 1e-4, conductivity: 400.0, heat_capacity: 3.45e6 };

const BODY: DampedRigidBody = DampedRigidBody { inertia: [2.0, 2.0, 5.0], time: 0.4 };

/// Runs every method, in so many steps of this size, and asserts both laws and the further invariants.
fn keeps<Y: Metriplectic>(name: &str, system: &Y, start: &Point<Y>, (h, steps): (f64, usize))
where
    Every: Method<Y>,
{
    for method in Every::all() {
        let run = method.run(system, start.clone(), Span::steps(h, steps).at_most(2));
        let run = run.unwrap_or_else(|error| panic!("{name}, {method:?}: {error}"));
        let c = run.certificate();
        let laws = c.keeps_energy() && c.keeps_entropy() && c.keeps_invariants();
        assert!(laws, "{name}, {method:?}: {c}");
        // Something has moved, and entropy was made.
        assert!(run.last().entropy > run.states()[0].entropy, "{name}, {method:?}");
    }
}

/// The states of an accurate run at these times.
fn accurate<Y: Metriplectic, const N: usize>(
    system: &Y,
    start: Point<Y>,
    (tolerance, times): (f64, [f64; N]),
) -> Vec<State<Y::Manifold>>
where
    DormandPrince8: Method<Y>,
{
    let span = Span::until(times[N - 1]).tolerance(tolerance).output_at(times);
    let run = DormandPrince8.run(system, start, span).expect("the run is taken");
    run.iter().cloned().collect()
}

#[test]
fn every_method_keeps_the_laws_of_every_model() -> Result<(), Error> {
    keeps("containers", &TUBES.system()?, &TUBES.start(0.12, 0.0, [300.0, 400.0]), (2e-4, 200));
    keeps("piston", &PISTON.system()?, &PISTON.start(1.8, 0.0, 300.0), (0.02, 200));
    let dense = DampedPiston { force: 2000.0, friction: 200.0, gas: DENSE, ..PISTON };
    keeps("dense piston", &dense.system()?, &dense.start(1.5, 0.0, 310.0), (2e-3, 200));
    let start = SVector::from([4.5, 4.5, 2.0, 4.5, -0.5, 1.5, 1.4, -0.2, 0.1, -0.1]);
    keeps("pendulum", &PENDULUM.system()?, &start, (2e-3, 200));
    let start = vector![400.0, 350.0, 320.0, 300.0];
    keeps("rod", &COPPER.system::<4>()?, &start, (0.5, 200));
    keeps("body", &BODY.system()?, &vector![0.9, -0.4, 0.3], (0.1, 200));
    Ok(())
}

/// At rest the wall is in the middle and both gases have the temperature `E/3Nk`. Without a leak, the wall oscillates about the
/// middle with `ω² = (10/3) Nk T/m (ℓ/2)²`, by `d²U/dq² = (10/9) U/q²` of each gas.
#[test]
fn the_containers_oscillate_and_rest_as_in_closed_form() -> Result<(), Error> {
    let start = TUBES.start(0.12, 0.0, [300.0, 400.0]);
    let leaky = TwoGasContainers { conductance: 5e5, ..TUBES };
    let run = Gauss::<3>.run(&leaky.system()?, start, Span::steps(5e-4, 1000).at_most(2))?;
    let end = run.last();
    let energy = 1.5 * TUBES.gas * 700.0;
    assert!((end.energy - energy).abs() < 1e-14 * energy);
    let temperature = energy / (3.0 * TUBES.gas);
    let rest = leaky.start(0.1, 0.0, [temperature; 2]);
    println!("at rest: {:.1e} off", (end.point - rest).amax());
    assert!((end.point - rest).amax() < 1e-8, "{} {rest}", end.point);

    let closed = TwoGasContainers { conductance: 0.0, ..TUBES };
    let frequency = (10.0 / 3.0 * TUBES.gas * 300.0 / TUBES.mass).sqrt() / 0.1;
    let small = 1e-5;
    let start = closed.start(0.1, small * TUBES.mass * frequency, [300.0; 2]);
    // Nine half periods later the wall is in the middle again, and moves to the other side.
    let time = 4.5 * 2.0 * PI / frequency;
    let states = accurate(&closed.system()?, start, (1e-13, [time]));
    let end = states[states.len() - 1].point;
    let off = (end.x - 0.1) / small;
    println!("after nine half periods: {off:.1e} of the amplitude");
    // The square of the relative amplitude of 10⁻⁴ changes the period.
    assert!(off.abs() < 1e-6 && (end.y + start.y).abs() < 1e-6 * start.y, "{off:.1e}");
    Ok(())
}

#[test]
fn the_piston_rests_where_its_energy_says() -> Result<(), Error> {
    let start = PISTON.start(1.8, 0.0, 300.0);
    let heavy = DampedPiston { friction: 30.0, ..PISTON };
    let states = accurate(&heavy.system()?, start, (1e-10, [10.0]));
    let end = &states[states.len() - 1];
    // E = C T + F q and F q = Nk T.
    let Gas { constant, heat_capacity, .. } = PISTON.gas;
    let energy = heat_capacity * 300.0 + PISTON.force * 1.8;
    let temperature = energy / (heat_capacity + constant);
    let rest = heavy.start(constant * temperature / PISTON.force, 0.0, temperature);
    println!("ideal: {:.1e} off", (end.point - rest).amax());
    assert!((end.energy - energy).abs() < 1e-13 * energy && (end.point - rest).amax() < 1e-7);

    // Van der Waals: C T − a/V + F q = E and (F/A + a/V²)(V − b) = Nk T, by bisection in V.
    let dense = DampedPiston { force: 2000.0, friction: 200.0, gas: DENSE, ..PISTON };
    let start = dense.start(1.5, 0.0, 310.0);
    let states = accurate(&dense.system()?, start, (1e-10, [3.0]));
    let end = &states[states.len() - 1];
    let Gas { constant, heat_capacity, excluded_volume: b, attraction: a, .. } = DENSE;
    let energy = heat_capacity * 310.0 - a / (1.5 * 5e-4) + 2000.0 * 1.5;
    assert!((end.energy - energy).abs() < 1e-13 * energy);
    let temperature = |v: f64| (2000.0 / 5e-4 + a / (v * v)) * (v - b) / constant;
    let excess = |v: f64| heat_capacity * temperature(v) - a / v + 4e6 * v - energy;
    let (mut low, mut high) = (1.01 * b, 1e-2);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { high = middle } else { low = middle }
    }
    let rest = dense.start(low / 5e-4, 0.0, temperature(low));
    println!("van der Waals: {:.1e} off of {rest}", (end.point - rest).amax());
    assert!((end.point - rest).amax() < 1e-7, "{} {rest}", end.point);
    Ok(())
}

/// Rüchhardt's experiment: the frequency of a small motion without friction has `γ = 1 + Nk/C`.
#[test]
fn the_piston_measures_the_ratio_of_heat_capacities() -> Result<(), Error> {
    let smooth = DampedPiston { friction: 0.0, ..PISTON };
    let rest = 0.33 * 300.0 / PISTON.force;
    let system = smooth.system()?;
    let span = Span::until(20.0).tolerance(1e-12).event("lowest", |x: &Vector3<f64>| x.y).rising();
    let run = DormandPrince8.run(&system, smooth.start(rest, 1e-3, 300.0), span)?;
    let times: Vec<f64> = run.events().iter().map(|event| event.state.time).collect();
    let period = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let volume = rest * PISTON.area;
    let pressure = PISTON.force / PISTON.area;
    let ratio =
        (2.0 * PI / period).powi(2) * PISTON.mass * volume / (pressure * PISTON.area.powi(2));
    println!("γ = {ratio} from {} periods", times.len() - 1);
    assert!((ratio - 5.0 / 3.0).abs() < 1e-7, "{ratio}");
    Ok(())
}

/// The modes of the rod decay at `4 (G/C) sin²(πn/2N)`.
#[test]
fn the_modes_of_the_rod_decay_as_in_closed_form() -> Result<(), Error> {
    const CELLS: usize = 6;
    let mode = |n: usize, i: usize| (PI * n as f64 * (i as f64 + 0.5) / CELLS as f64).cos();
    let at = |t: f64| {
        SVector::<f64, CELLS>::from_fn(|i, _| {
            let decayed = |n: usize| {
                let cell: f64 = 0.1 / CELLS as f64;
                let rate = 4.0 * 400.0 / (3.45e6 * cell.powi(2));
                (-rate * (PI * n as f64 / (2 * CELLS) as f64).sin().powi(2) * t).exp()
            };
            350.0 + 30.0 * mode(1, i) * decayed(1) + 5.0 * mode(4, i) * decayed(4)
        })
    };
    let rod = COPPER.system::<CELLS>()?;
    let states = accurate(&rod, at(0.0), (1e-12, [8.0]));
    let off = (states[states.len() - 1].point - at(8.0)).amax();
    println!("{off:.1e} K off after 8 s, where {:.2} K are left of 5", (at(8.0) - at(1e9))[0]);
    assert!(off < 1e-9, "{off}");
    Ok(())
}

/// The component of `p` along the axis of a symmetric body obeys Bernoulli's equation.
#[test]
fn the_symmetric_body_turns_over_as_in_closed_form() -> Result<(), Error> {
    let start = vector![0.9, -0.4, 0.3];
    let energy = (0.9_f64.powi(2) + 0.4_f64.powi(2)) / 4.0 + 0.3_f64.powi(2) / 10.0;
    let rate = 4.0 * energy * 0.4 * (1.0 / 2.0 - 1.0 / 5.0);
    let most = 2.0 * energy * 5.0;
    let states = accurate(&BODY.system()?, start, (1e-12, [5.0, 10.0, 20.0, 40.0]));
    for state in &states {
        let squared = most / (1.0 + (most / 0.09 - 1.0) * (-rate * state.time).exp());
        let off = state.point.z.powi(2) - squared;
        assert!(off.abs() < 1e-10, "t = {}: {off:.1e}", state.time);
    }
    let grown = states[states.len() - 1].point.z.powi(2) / most;
    assert!((0.8..1.0).contains(&grown), "{grown}");
    Ok(())
}

/// The tubes at a nanometre have the motion of the tubes at a gigametre, in their units of length, momentum and time.
#[test]
fn no_model_has_a_scale_of_its_own() -> Result<(), Error> {
    let course =
        |method: &Every, length: f64, mass: f64, heat: f64| -> Result<Vector4<f64>, Error> {
            let (gas, temperature) = (heat / 300.0, 300.0);
            let time = length * (mass / heat).sqrt();
            let conductance = 0.05 * heat * temperature / time;
            let tubes = TwoGasContainers { mass, length, gas, temperature, conductance };
            let start = tubes.start(0.6 * length, 0.0, [300.0, 400.0]);
            let run = method.run(&tubes.system()?, start, Span::steps(0.02 * time, 100))?;
            assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            let x = run.last().point;
            Ok(vector![x.x / length, x.y * time / (mass * length), x.z / gas, x.w / gas])
        };
    for method in Every::all() {
        let one = course(&method, 1.0, 1.0, 1.0)?;
        for [length, mass, heat] in [[1e-9, 1e-21, 4e-21], [1e9, 1e24, 1e30], [1e-9, 1e11, 1e-9]] {
            let off = (course(&method, length, mass, heat)? - one).amax();
            println!("{method:?}, {length:e} m, {mass:e} kg, {heat:e} J: {off:.1e}");
            assert!(off < 1e-12, "{method:?}, {length:e} m: {off:.1e}");
        }
    }
    Ok(())
}

#[test]
fn a_parameter_without_meaning_is_named() {
    let refused = |error: Error| {
        let source = std::error::Error::source(&error).expect("it has a source");
        *source.downcast_ref::<ParameterError>().expect("it is a parameter")
    };
    let error = TwoGasContainers { mass: -1.0, ..TUBES }.system().map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "the parameter `mass` is -1; it must be a positive number");
    assert_eq!(refused(error).name, "mass");
    for value in [f64::NAN, f64::INFINITY, -1.0] {
        let error = TwoGasContainers { conductance: value, ..TUBES }.system().map(|_| ());
        assert_eq!(refused(error.unwrap_err()).name, "conductance");
    }
    let small = Gas { volume: 1e-5, ..DENSE };
    let error = DampedPiston { gas: small, ..PISTON }.system().map(|_| ()).unwrap_err();
    assert_eq!(refused(error).name, "gas.volume - gas.excluded_volume");
    let error = DampedPiston { force: f64::NAN, ..PISTON }.system().map(|_| ()).unwrap_err();
    assert_eq!(refused(error).name, "force");
    let error = ThermoelasticDoublePendulum { lengths: [1.0, 0.0], ..PENDULUM }.system();
    assert_eq!(refused(error.map(|_| ()).unwrap_err()).name, "lengths[1]");
    let error = HeatRod { conductivity: 0.0, ..COPPER }.system::<4>().map(|_| ()).unwrap_err();
    assert_eq!(refused(error).name, "conductivity");
    let error = DampedRigidBody { time: -0.1, ..BODY }.system().map(|_| ()).unwrap_err();
    assert_eq!(refused(error).name, "time");
}

/// A gas with `Nk = C` has an integer power of the volume, which would be positive beyond the bottom of the cylinder.
#[test]
fn a_start_outside_the_cylinder_is_refused() -> Result<(), Error> {
    let gas = Gas { heat_capacity: 0.33, ..PISTON.gas };
    let piston = DampedPiston { gas, ..PISTON }.system()?;
    let start = vector![-1.0, 0.0, 0.1];
    assert!(DormandPrince8.run(&piston, start, Span::steps(0.01, 1)).is_err());
    let start = vector![0.3, 0.0, 0.1, 0.0];
    assert!(DormandPrince8.run(&TUBES.system()?, start, Span::steps(1e-4, 1)).is_err());
    Ok(())
}

/// A reaction by its rate constant, and how often each of three substances stands on its left and on its right side.
#[derive(Clone, Copy)]
struct Reaction {
    rate: f64,
    sides: [[i32; 3]; 2],
}

/// Two reactions of three substances by mass action, with the amounts and the molar energies of an equilibrium.
#[derive(Clone, Copy)]
struct Network {
    reactions: [Reaction; 2],
    equilibrium: [f64; 3],
    energies: [f64; 3],
}

impl Network {
    /// `A ⇌ B ⇌ C` with these rate constants, and amounts in this unit.
    const fn isomers(rates: [f64; 2], unit: f64) -> Self {
        let first = Reaction { rate: rates[0] * unit, sides: [[1, 0, 0], [0, 1, 0]] };
        let second = Reaction { rate: rates[1] * unit, sides: [[0, 1, 0], [0, 0, 1]] };
        let equilibrium = [unit, 2.0 * unit, 0.5 * unit];
        Self { reactions: [first, second], equilibrium, energies: [3e4; 3] }
    }

    /// `2A ⇌ B`, in two halves, beside a substance that does not react.
    const fn dimer(unit: f64) -> Self {
        let half = Reaction { rate: 0.5 * unit, sides: [[2, 0, 0], [0, 1, 0]] };
        let equilibrium = [unit, 2.0 * unit, unit];
        Self { reactions: [half; 2], equilibrium, energies: [3e4, 6e4, 3e4] }
    }

    fn system(
        self,
    ) -> Result<impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> + Clone, Error> {
        let activities =
            move |n: &Vector3<Real>| Vector3::from_fn(|i, _| n[i] / self.equilibrium[i]);
        let system = System::on(Euclidean::<3>)
            .energy(move |n: &Vector3<Real>| n.dot(&Vector3::from(self.energies).cast()))
            .entropy(move |n: &Vector3<Real>| {
                n.dot(&activities(n).map(|activity| -activity.ln() + 1.0))
            })
            .onsager(move |n: &Vector3<Real>, _: &Vector3<Real>| {
                let activities = activities(n);
                self.reactions.map(|Reaction { rate, sides }| {
                    let [p, q] = sides.map(|side| {
                        (0..3).fold(Real::from(rate), |p, i| p * activities[i].powi(side[i]))
                    });
                    let along = Vector3::from_fn(|i, _| f64::from(sides[1][i] - sides[0][i]));
                    Contact { rate: logarithmic_mean(p, q), along: along.cast() }
                })
            })
            .build()?;
        Ok(system)
    }

    /// The amounts of isomers at a time, by the exponential of the matrix of their linear equations.
    fn linear(self, start: Vector3<f64>, t: f64) -> Vector3<f64> {
        let mut generator = Matrix3::<f64>::zeros();
        for (r, Reaction { rate, .. }) in self.reactions.into_iter().enumerate() {
            for (from, to) in [(r, r + 1), (r + 1, r)] {
                let slope = rate / self.equilibrium[from];
                generator[(from, from)] -= slope;
                generator[(to, from)] += slope;
            }
        }
        (generator * t).exp() * start
    }
}

/// The amount of A in the network of a dimer, from `a₀` with `a + 2b = 1`.
fn riccati(a: f64, t: f64) -> f64 {
    let root = (1.0_f64 / 64.0 + 0.25).sqrt();
    let [above, below] = [root - 0.125, -root - 0.125];
    let ratio = (a - above) / (a - below) * (-4.0 * root * t).exp();
    (above - ratio * below) / (1.0 - ratio)
}

/// In amounts of the order of 1, of a nanomole and of molecules; and with the second reaction a million times faster.
#[test]
fn reactions_keep_the_laws_and_follow_mass_action() -> Result<(), Error> {
    let unequal = vector![3.0, 0.1, 0.2];
    for unit in [1.0, 1e-9, 1e11] {
        let isomers = Network::isomers([1.0, 0.4], unit);
        let system = isomers.system()?;
        keeps("isomers", &system, &(unequal * unit), (0.01, 100));
        let states = accurate(&system, unequal * unit, (1e-13, [0.3, 2.0]));
        for state in &states {
            let off = (state.point - isomers.linear(unequal * unit, state.time)).amax() / unit;
            println!("{unit:e}: t = {}: {off:.1e}", state.time);
            assert!(off < 1e-11, "{unit:e}, t = {}: {off:.1e}", state.time);
        }
        let dimer = Network::dimer(unit).system()?;
        let start = vector![0.98, 0.01, 1.0];
        keeps("dimer", &dimer, &(start * unit), (0.01, 100));
        for state in accurate(&dimer, start * unit, (1e-13, [0.3, 2.0])) {
            let off = state.point.x / unit - riccati(0.98, state.time);
            assert!(off.abs() < 1e-11, "{unit:e}, t = {}: {off:.1e}", state.time);
        }
    }
    // Radau resolves nothing of the fast reaction: after it, B and C are in equilibrium and A is as in the closed form.
    let fast = Network::isomers([1.0, 1e6], 1.0);
    let run = Radau::<2>.run(&fast.system()?, unequal, Span::until(2.0).tolerance(1e-8))?;
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    let off = (run.last().point - fast.linear(unequal, 2.0)).amax();
    println!("a fast reaction: {off:.1e}");
    assert!(off < 1e-5, "{off:.1e}");
    Ok(())
}

#[test]
fn the_scheme_has_order_two_on_mass_action() -> Result<(), Box<dyn std::error::Error>> {
    let counts = [10_u32, 20, 40, 80];
    let sizes = counts.map(|count| 1.0 / f64::from(count));
    let errors = |network: Network, start: Vector3<f64>, exact: Vector3<f64>| {
        counts.map(|count| {
            let system = network.system().expect("it is built");
            let span = Span::steps(1.0 / f64::from(count), count as usize);
            let run = WeylMidpoint.run(&system, start, span);
            (run.expect("it runs").last().point - exact).amax()
        })
    };
    let isomers = Network::isomers([1.0, 0.4], 1.0);
    let start = vector![3.0, 0.1, 0.2];
    let order = Order::fit(&sizes, &errors(isomers, start, isomers.linear(start, 1.0)))?;
    assert!(order.agrees(2.0, 0.1), "{order:?}");
    let a = riccati(0.9, 1.0);
    let [start, end] = [0.9, a].map(|a| vector![a, 0.5 * (1.0 - a), 1.0]);
    let order = Order::fit(&sizes, &errors(Network::dimer(1.0), start, end))?;
    assert!(order.agrees(2.0, 0.1), "{order:?}");
    Ok(())
}

#[test]
fn detailed_balance_is_rest_and_no_substance_is_an_error() -> Result<(), Error> {
    let system = Network::isomers([1.0, 0.4], 1e-3).system()?;
    for method in Every::all() {
        let rest = vector![2e-3, 4e-3, 1e-3];
        let run = method.run(&system, rest, Span::steps(0.1, 20))?;
        let (c, off) = (run.certificate(), (run.last().point - rest).amax());
        assert!(c.keeps_energy() && c.keeps_entropy(), "{method:?}: {c}");
        assert!(off <= 1e-17, "{method:?}: {off:.1e}");
        // Nearly none of B and C: their affinities are infinite in the limit, and their rates are not.
        let scarce = vector![1e-3, 1e-12, 1e-14];
        let run = method.run(&system, scarce, Span::until(1.0))?;
        let c = run.certificate();
        assert!(c.keeps_energy() && c.keeps_entropy(), "{method:?}: {c}");
        for absent in [0.0, -1e-9] {
            let start = vector![1e-3, absent, 1e-3];
            let error = method.run(&system, start, Span::steps(0.1, 20)).map(|_| ()).unwrap_err();
            assert!(error.to_string().contains("the entropy is NaN at"), "{method:?}: {error}");
        }
    }
    Ok(())
}
