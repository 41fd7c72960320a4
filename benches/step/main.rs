//! One step from closures against the same step written by hand.
//!
//! Both sides solve the same equation to the same floor, and both take a hundred steps from the same
//! moving state. Before they are timed, they are checked to arrive at the same point. By hand there is an
//! analytic Jacobian in every step and the guess of a parabola; the library differentiates closures,
//! and keeps its Jacobian and a guess of higher order.
//!
//! - `cargo bench -p metriplectic-benches --bench step` times every row;
//! - `cargo bench -p metriplectic-benches --bench step -- --instructions` counts the instructions of a step in each row with
//!   callgrind, and compares them with `snapshot.txt`; `--bless` writes that file.
//!
//! `closure_metric` is the step from closures once more, with the canonical metric given by a closure
//! too, so that its geodesics are integrated.

use std::cell::Cell;
use std::hint::black_box;

use criterion::Criterion;
use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{DiscreteGradient, Element, Flow, Schedule, StateSpace, StepStart};
use metriplectic::prelude::*;

#[path = "../callgrind.rs"]
mod callgrind;
#[path = "../../tests/models/chain.rs"]
mod chain;
mod chart_midpoint;
mod dimension;
mod hand_generic;
mod instructions;
mod lattice;
mod rigid_body;
mod so3_nambu;
mod spinning_top;
mod stable_gradient;
mod whole;

/// Steps in one measurement.
const STEPS: usize = 100;

/// A step that is written out by hand.
trait Step: Clone {
    type Point: Copy;

    /// One step of size `h`; the displacement is kept for the next guess.
    fn step(&mut self, x: &Self::Point, h: f64) -> Self::Point;

    /// The corrections of Newton's method so far.
    fn iterations(&self) -> usize;

    /// The entries of a point, in the order of [`Manifold::entries`].
    fn entries(x: &Self::Point) -> Vec<f64>;
}

/// What a number of steps came to.
struct Outcome {
    /// The entries of the last point.
    end: Vec<f64>,
    /// Newton iterations.
    iterations: usize,
}

/// One line of the comparison: what is timed, and counted.
struct Row {
    name: String,
    run: Box<dyn Fn(usize) -> Outcome>,
    /// Calls of the closure of the energy, or of the metric, in a step, where they are counted.
    calls: Option<f64>,
}

impl Row {
    /// Steps of a system from its closures.
    fn new<Y: Metriplectic + 'static>(
        name: impl Into<String>,
        system: Y,
        start: Point<Y>,
        h: f64,
    ) -> Self
    where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        Self::with(name, Scheme::new(WeylMidpoint), system, start, h)
    }

    /// The same with another scheme.
    fn with<Y: Metriplectic + 'static, R, W: DiscreteGradient + 'static>(
        name: impl Into<String>,
        scheme: Scheme<R, W>,
        system: Y,
        start: Point<Y>,
        h: f64,
    ) -> Self
    where
        R: Retraction<Y::Manifold, Y::Metric> + 'static,
    {
        Self::by(name, scheme, system, start, h)
    }

    /// Steps of a flow by any method.
    fn by<F: Flow + 'static, M: Stepper<F> + 'static>(
        name: impl Into<String>,
        method: M,
        flow: F,
        start: Element<F>,
        h: f64,
    ) -> Self {
        let run = move |steps| {
            let (mut memory, mut x, mut iterations) =
                (Default::default(), black_box(start.clone()), 0);
            let mut values = flow.laws(&x);
            for _ in 0..steps {
                let reference = values.clone();
                let start =
                    StepStart { flow: &flow, x: &x, time: 0.0, values, reference, allowed: None };
                let taken = method.step(&start, h, &mut memory).expect("a step is taken");
                iterations += taken.effort.iterations;
                (x, values) = (taken.x, taken.values);
            }
            Outcome { end: F::Space::numbers(&x), iterations }
        };
        Self { name: name.into(), run: Box::new(run), calls: None }
    }

    /// Steps of a whole run, tried ones where it has a tolerance.
    fn whole<F: Flow + 'static, M: Method<F> + Clone + 'static>(
        name: &str,
        method: M,
        flow: F,
        start: Element<F>,
        span: impl Into<Schedule> + Clone + 'static,
    ) -> Self {
        let run = move |steps: usize| {
            let start = black_box(start.clone());
            let run = method.clone().steps(&flow, start, span.clone());
            let mut run = run.unwrap_or_else(|error| panic!("{error}"));
            let tried = |of: &Certificate| of.steps + of.rejected;
            while tried(run.certificate()) < steps {
                assert!(run.ending().is_none(), "the run has ended before");
                run.advance().expect("a step is taken");
            }
            let end = F::Space::numbers(&run.state().point);
            Outcome { end, iterations: run.certificate().effort.iterations }
        };
        Self { name: format!("run/{name}"), run: Box::new(run), calls: None }
    }

    /// Notes the calls of a closure in a step, from the same system with a closure that counts them.
    fn counted<Y: Metriplectic + 'static>(
        self,
        counter: &Cell<u64>,
        twin: Y,
        start: Point<Y>,
        h: f64,
    ) -> Self
    where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let twin = Self::new("", twin, start, h);
        counter.set(0);
        (twin.run)(STEPS);
        Self { calls: Some(counter.get() as f64 / STEPS as f64), ..self }
    }

    /// Steps by hand.
    fn by_hand<B: Step + 'static>(name: &str, hand: B, start: B::Point, h: f64) -> Self
    where
        B::Point: 'static,
    {
        let run = move |steps| {
            let mut hand = black_box(hand.clone());
            let end = (0..steps).fold(black_box(start), |x, _| hand.step(&x, h));
            Outcome { end: B::entries(&end), iterations: hand.iterations() }
        };
        Self { name: name.into(), run: Box::new(run), calls: None }
    }
}

/// Every row.
fn rows() -> Vec<Row> {
    let all = [
        rigid_body::rows(),
        spinning_top::rows(),
        so3_nambu::rows(),
        chart_midpoint::rows(),
        dimension::rows(),
        lattice::rows(),
        whole::rows(),
    ];
    all.into_iter().flatten().collect()
}

/// Compares the ends of rows that solve the same equation.
fn check(rows: &[Row], allowed: f64) {
    let ends: Vec<_> = rows.iter().map(|row| (row.run)(STEPS).end).collect();
    for (row, end) in rows.iter().zip(&ends) {
        let off = end.iter().zip(&ends[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off <= allowed, "{}: ends {off:.1e} away from {}", row.name, rows[0].name);
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    if has("--instructions") {
        return instructions::compare(&rows(), has("--bless"));
    }
    if let [_, flag, name, steps] = &arguments[..]
        && flag == "--row"
    {
        return instructions::count(&rows(), name, steps.parse().expect("a number of steps"));
    }
    let mut criterion = Criterion::default().configure_from_args();
    for row in rows() {
        println!(
            "{}: {} Newton iterations in {STEPS} steps",
            row.name,
            (row.run)(STEPS).iterations
        );
        // The time of a hundred steps: read tens of nanoseconds for microseconds.
        criterion.bench_function(&row.name, |bencher| bencher.iter(|| black_box((row.run)(STEPS))));
    }
    criterion.final_summary();
}
