//! A method and a system that a user writes against the public traits, run like those of the library.

use metriplectic::dynamics::SecondLaw;
use metriplectic::equations::{ENERGY, ENTROPY, Equations, Sizes};
use metriplectic::integrators::{
    Effort, Element, Entries, Evidence, Flow, FromEquations, Laws, Promises, StateSpace, StepStart,
    Taken, Vector, laws,
};
use metriplectic::manifolds::PointError;
use metriplectic::prelude::*;

/// The explicit midpoint rule: `x' = φ_x(h f(φ_x(½h f(x))))`, with the velocity `f` in the chart at `x`.
#[derive(Clone, Copy, Debug)]
struct ExplicitMidpoint;

impl<F: Flow> Stepper<F> for ExplicitMidpoint {
    type Memory = ();

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, _: &F) -> Promises {
        Promises::nothing()
    }

    fn step(&self, start: &StepStart<'_, F>, h: f64, (): &mut ()) -> Result<Taken<F>, StepError> {
        let (flow, x) = (start.flow, start.x);
        let rates = |d: &F::Vector| {
            let outside = StepError::OutOfDomain { time: start.time, h, tried: Effort::default() };
            flow.rates(x, d).ok_or(outside)
        };
        let first = rates(&flow.sizes(x).map(|_| 0.0))?;
        let middle = rates(&first.map(|v| 0.5 * h * v))?;
        let x = flow.moved(x, &middle.map(|v| h * v));
        let (values, evidence, effort) = (flow.laws(&x), Evidence::default(), Effort::default());
        Ok(Taken { x, values, evidence, effort })
    }
}

/// The free body on so(3)* with friction, which the scheme of the paper keeps on its energy.
fn body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .expect("the parts make a system")
}

const START: Vector3<f64> = Vector3::new(0.7, -1.0, 0.4);

#[test]
fn a_method_of_forty_lines_keeps_the_laws_of_a_method() {
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| x.x.powi(2) * 0.5 + x.y.powi(3) * 0.4 + x.z * x.x)
        .build()
        .unwrap();
    laws::method(ExplicitMidpoint, &body(), &START, 0.05).unwrap();
    laws::method(ExplicitMidpoint, &top, &vector![0.48, 0.6, 0.64], 0.02).unwrap();
    laws::method(Scheme::new(WeylMidpoint), &body(), &START, 0.05).unwrap();
    laws::method(Scheme::new(WeylMidpoint), &top, &vector![0.48, 0.6, 0.64], 0.05).unwrap();
    laws::method(ExplicitMidpoint, &Oscillators::new(100), &excited(100), 0.02).unwrap();
    // Another order than that of the method is noticed, and a promise that does not hold.
    let error = laws::method(Boastful, &body(), &START, 0.05).unwrap_err();
    assert_eq!(error.law, "the order of a method is the slope of its error");
}

/// The same method with another order.
#[derive(Clone, Copy, Debug)]
struct Boastful;

impl<F: Flow> Stepper<F> for Boastful {
    type Memory = ();

    fn order(&self) -> u32 {
        4
    }

    fn promises(&self, flow: &F) -> Promises {
        ExplicitMidpoint.promises(flow)
    }

    fn step(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut (),
    ) -> Result<Taken<F>, StepError> {
        ExplicitMidpoint.step(start, h, memory)
    }
}

#[test]
fn its_runs_have_what_every_run_has() {
    let body = body();
    let run = ExplicitMidpoint.run(&body, START, Span::steps(0.05, 400)).unwrap();
    let certificate = run.certificate();
    println!("{certificate}");
    // What is not promised is measured, and said.
    let text = certificate.to_string();
    assert!(
        text.contains("first law:   not promised") && text.contains("second law: not promised")
    );
    assert!(certificate.max_energy_error > 1e-9, "{certificate}");
    // Steps that follow a tolerance, until rest; and a time of its own.
    let span = Span::until(500.0).tolerance(1e-4).until_rest(1e-6).starting_at(10.0);
    let rest = ExplicitMidpoint.run(&body, START, span).unwrap();
    assert!(rest.ending().is_rest() && rest.last().time < 500.0);
    // A step that leaves the domain is an error with the trajectory so far.
    let logarithm = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y.powi(2) * 0.5 - (x.x).ln())
        .build()
        .unwrap();
    let error = ExplicitMidpoint.run(&logarithm, vector![1.0, -3.0], Span::steps(0.5, 9));
    assert!(matches!(error, Err(RunError::Step { cause: StepError::OutOfDomain { .. }, .. })));
}

/// Oscillators in a row, coupled by springs, in a number that is known at run time.
#[derive(Clone, Debug, PartialEq)]
struct Oscillators {
    count: usize,
}

impl Oscillators {
    const fn new(count: usize) -> Self {
        Self { count }
    }

    /// The extension of the spring after an oscillator, whose ends are fixed.
    fn extension(&self, x: &[f64], i: usize) -> f64 {
        let at = |i: usize| if i == 0 || i > self.count { 0.0 } else { x[i - 1] };
        at(i + 1) - at(i)
    }
}

/// `(q₁, …, q_n, p₁, …, p_n)`.
#[derive(Clone, Debug, PartialEq)]
struct Phase;

impl StateSpace for Phase {
    type Element = Vec<f64>;

    fn numbers(x: &Vec<f64>) -> Vec<f64> {
        x.clone()
    }
}

/// `H = Σ ½p² + Σ (½r² + ¼r⁴)` over the extensions `r` of the springs.
impl Flow for Oscillators {
    type Space = Phase;
    type Numbers = [f64; 0];
    type Vector = Vec<f64>;

    fn laws(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
        let kinetic: f64 = x[self.count..].iter().map(|p| 0.5 * p * p).sum();
        let springs = (0..=self.count).map(|i| self.extension(x, i).powi(2));
        let energy = kinetic + springs.map(|r| 0.5 * r + 0.25 * r * r).sum::<f64>();
        Laws { energy, entropy: 0.0, invariants: [] }
    }

    fn term_sizes(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
        // Σ|∂_iH x_i| is at most four times the energy of these springs.
        let laws = self.laws(x);
        Laws { energy: 5.0 * laws.energy, ..laws }
    }

    fn rates(&self, x: &Element<Self>, d: &Vec<f64>) -> Option<Vec<f64>> {
        let y = self.moved(x, d);
        let force = |i| {
            let r = self.extension(&y, i);
            r + r.powi(3)
        };
        let forces = (1..=self.count).map(|i| force(i) - force(i - 1));
        Some(y[self.count..].iter().copied().chain(forces).collect())
    }

    fn sizes(&self, x: &Element<Self>) -> Vec<f64> {
        x.iter().map(|x| x.abs()).collect()
    }

    fn moved(&self, x: &Element<Self>, d: &Vec<f64>) -> Vec<f64> {
        x.iter().zip(d).map(|(x, d)| x + d).collect()
    }

    fn element(&self, entries: &[f64]) -> Result<Vec<f64>, PointError> {
        let (found, expected) = (entries.len(), 2 * self.count);
        if found == expected {
            Ok(entries.to_vec())
        } else {
            Err(PointError::Length { found, expected })
        }
    }
}

/// The lowest mode.
fn excited(count: usize) -> Vec<f64> {
    let mode = |i: usize| (std::f64::consts::PI * (i + 1) as f64 / (count + 1) as f64).sin();
    (0..count).map(mode).chain(std::iter::repeat_n(0.0, count)).collect()
}

#[test]
fn a_system_of_any_size_needs_no_more_than_a_flow() {
    let system = Oscillators::new(100);
    assert_eq!(system.entropy_law(), SecondLaw::NoEntropy);
    let watch = Observables::on(&system)
        .of("middle", |x: &Vec<f64>| x[49])
        .of_state("energy", |state| state.energy);
    let span = Span::steps(0.02, 200).every(20);
    let whole = ExplicitMidpoint.run(&system, excited(100), span).unwrap();
    println!("{}", whole.certificate());
    assert_eq!(whole.states().len(), 11);
    assert!(whole.certificate().max_relative_energy_error() < 1e-4);
    let mut table = watch.csv(Vec::new()).unwrap();
    whole.iter().for_each(|state| table.write(state).unwrap());
    let text = String::from_utf8(table.finish().unwrap()).unwrap();
    assert_eq!(text.lines().count(), 12);

    // Put down after 100 steps, and taken up again.
    let mut steps = ExplicitMidpoint.steps(&system, excited(100), span).unwrap();
    for _ in 0..100 {
        steps.advance().unwrap();
    }
    let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
    let resumed = ExplicitMidpoint.resume(&system, &checkpoint).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    // Of a system of another size it is none.
    let error = ExplicitMidpoint.resume(&Oscillators::new(99), &checkpoint).unwrap_err();
    assert!(matches!(error, ResumeError::Point(PointError::Length { found: 200, expected: 198 })));
}

/// Oscillators of the frequency 1, as the trait of systems in plain numbers has them.
#[derive(Clone, Debug)]
struct Unit(usize);

impl Equations for Unit {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values[ENERGY] = x.iter().map(|x| 0.5 * x * x).sum();
        values[ENTROPY] = 0.0;
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        w[..x.len()].copy_from_slice(x);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (q, p) = x.split_at(self.0);
        v[..self.0].copy_from_slice(p);
        (0..self.0).for_each(|i| v[self.0 + i] = -q[i]);
        Some(0.0)
    }
}

/// `q_i = (i + 1) cos t`, until `q₀` vanishes at `t = π/2` and all momenta are reversed.
#[test]
fn a_system_in_numbers_has_all_that_a_run_has() {
    // More variables than a typed system may have.
    const COUNT: usize = 150;
    let system = FromEquations(Unit(COUNT));
    let start: Entries =
        (0..2 * COUNT).map(|i| if i < COUNT { (i + 1) as f64 } else { 0.0 }).collect();
    let turn = std::f64::consts::FRAC_PI_2;
    let span = || {
        Span::until(2.0)
            .tolerance(1e-9)
            .output_at([0.5, 1.75])
            .event("wall", |x: &Entries| x[0])
            .jump(|_, x: &Entries| {
                x.iter().enumerate().map(|(i, x)| if i < COUNT { *x } else { -x }).collect()
            })
    };
    let run = DormandPrince8.run(&system, start.clone(), span()).unwrap();
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    near(run.events()[0].state.time, turn);
    let outputs: Vec<_> = run.iter().filter(|s| [0.5, 1.75].contains(&s.time)).collect();
    assert_eq!(outputs.len(), 2);
    near(outputs[0].point[4], 5.0 * 0.5_f64.cos());
    // Reversed at π/2, so the way goes back: q(t) = cos(π − t).
    near(outputs[1].point[4], 5.0 * (2.0 * turn - 1.75).cos());
    near(run.last().point[0], (2.0 * turn - 2.0).cos());
    assert!(run.certificate().max_relative_energy_error() < 1e-14);

    let plain = || Span::until(2.0).tolerance(1e-9);
    let whole = DormandPrince8.run(&system, start.clone(), plain()).unwrap();
    let mut steps = DormandPrince8.steps(&system, start.clone(), plain()).unwrap();
    for _ in 0..3 {
        steps.advance().unwrap();
    }
    let resumed = DormandPrince8.resume(&system, &steps.checkpoint()).unwrap().run().unwrap();
    assert!(resumed.last() == whole.last(), "a resumed run is the run");

    let watch = Observables::on(&system).of("q5", |x: &Entries| x[4]);
    let mut table = watch.csv(Vec::new()).unwrap();
    whole.iter().for_each(|state| table.write(state).unwrap());
    let text = String::from_utf8(table.finish().unwrap()).unwrap();
    assert_eq!(text.lines().count(), whole.states().len() + 1);

    let sweep = Sweep::new("of numbers").grid("turns", [1.0, 2.0]);
    let table = sweep.run(|row| {
        let span = Span::until(row["turns"]).tolerance(1e-9);
        Ok(DormandPrince8.run(&system, start.clone(), span)?)
    });
    let table = table.execute().unwrap();
    assert_eq!(table.rows().len(), 2);
}
