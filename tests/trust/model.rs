//! One open system with all that takes the time, and every method that runs it, behind one function: each pair of a
//! method and the system is compiled once for all tests.

use metriplectic::integrators::{Certificate, Checkpoint, Schedule};
use metriplectic::prelude::*;
use nalgebra::{Vector2, vector};

/// A function of the time.
pub(crate) type Protocol = fn(Real) -> Real;

/// `H(t, x) = ½p² + ½ω²q² + ¼c q⁴ − q f(t)` with the port `(0, g(t))` and a contact along `p` with a bath.
#[derive(Clone, Copy)]
pub(crate) struct Model {
    pub(crate) stiffness: f64,
    pub(crate) quartic: f64,
    pub(crate) force: Protocol,
    pub(crate) port: Protocol,
    pub(crate) temperature: f64,
    pub(crate) rate: f64,
}

/// Zero at all times.
pub(crate) fn nothing(_: Real) -> Real {
    0.0.into()
}

/// A free particle that nothing moves.
pub(crate) const FREE: Model = Model {
    stiffness: 0.0,
    quartic: 0.0,
    force: nothing,
    port: nothing,
    temperature: 1.0,
    rate: 0.0,
};

/// What came out of a run.
pub(crate) struct Outcome {
    /// The times and the points that were recorded.
    pub(crate) states: Vec<(f64, [f64; 2])>,
    pub(crate) certificate: Certificate,
    /// The work of the energy in time, the work of the port, and the heat and the entropy of the bath.
    pub(crate) ledger: [f64; 4],
    pub(crate) checkpoint: Checkpoint,
}

impl Outcome {
    pub(crate) fn end(&self) -> [f64; 2] {
        self.states.last().expect("a run has a start").1
    }
}

/// Where a run starts.
#[derive(Clone, Copy)]
pub(crate) enum From<'a> {
    Point([f64; 2]),
    /// Where another run was put down; the requests of the schedule are watched.
    Checkpoint(&'a Checkpoint),
    /// The state in which a run from this point over `Span::until` this time ends.
    EndOf([f64; 2], f64),
}

/// The methods, without Radau, which asks for friction.
pub(crate) const METHODS: [&str; 8] =
    ["DP5", "DP8", "RKC", "Weyl", "Gauss1", "Gauss2", "Gauss3", "Gauss4"];

/// Those of a high order.
pub(crate) const ACCURATE: [&str; 5] = ["DP5", "DP8", "Gauss2", "Gauss3", "Gauss4"];

/// Runs the model by the method of a name, and puts the run down after so many steps, or at its end.
pub(crate) fn run(
    name: &str,
    model: Model,
    from: From<'_>,
    span: Schedule,
    steps: Option<usize>,
) -> Result<Outcome, String> {
    let Model { stiffness, quartic, force, port, temperature, rate } = model;
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(move |t: Real, x: &Vector2<Real>| {
            let square = x.x * x.x;
            x.y * x.y * 0.5 + square * (0.5 * stiffness) + square * square * (0.25 * quartic)
                - x.x * force(t)
        })
        .work("port", move |t: Real, _: &Vector2<Real>| vector![0.0.into(), port(t)])
        .bath(
            "bath",
            Bath::at(temperature).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: rate.into(), along: vector![0.0.into(), 1.0.into()] }]
            }),
        )
        .build()
        .map_err(|error| error.to_string())?;
    macro_rules! by {
        ($method:expr) => {{
            let method = $method;
            let begun = match from {
                From::Point([q, p]) => method
                    .steps(&system, system.start(vector![q, p]), span)
                    .map_err(|error| error.to_string()),
                From::Checkpoint(checkpoint) => method
                    .resume(&system, checkpoint)
                    .map_err(|error| error.to_string())
                    .and_then(|steps| steps.watching(span).map_err(|error| error.to_string())),
                From::EndOf([q, p], end) => {
                    let start = system.start(vector![q, p]);
                    let first = if ACCURATE.contains(&name) { 1e-8 } else { 1e-4 };
                    let first = method.run(&system, start, Span::until(end).tolerance(first));
                    let first = first.map_err(|error| error.to_string())?;
                    method
                        .steps(&system, first.last().point.clone(), span)
                        .map_err(|error| error.to_string())
                }
            };
            let mut run = begun?;
            if let Some(count) = steps {
                for _ in 0..count {
                    run.advance().map_err(|error| error.to_string())?;
                }
            }
            let certificate = run.certificate().clone();
            let (mut states, mut state) = (Vec::new(), run.state().clone());
            let put_down = run.checkpoint();
            let mut checkpoint = put_down;
            let mut last = certificate;
            if steps.is_none() {
                let run = run.run().map_err(|error| error.to_string())?;
                states = run.iter().map(|s| (s.time, [s.point.x.x, s.point.x.y])).collect();
                (state, last) = (run.last().clone(), run.certificate().clone());
                checkpoint = run.checkpoint().clone();
            }
            let ledger = &state.point.ledger;
            let ledger = [
                ledger.parameter_work(),
                ledger.work("port").unwrap_or(f64::NAN),
                ledger.heat("bath").unwrap_or(f64::NAN),
                ledger.bath_entropy("bath").unwrap_or(f64::NAN),
            ];
            if states.is_empty() {
                states.push((state.time, [state.point.x.x, state.point.x.y]));
            }
            Ok(Outcome { states, certificate: last, ledger, checkpoint })
        }};
    }
    match name {
        "DP5" => by!(DormandPrince5),
        "DP8" => by!(DormandPrince8),
        "RKC" => by!(RungeKuttaChebyshev),
        "Weyl" => by!(Scheme::new(WeylMidpoint)),
        "Gauss1" => by!(Gauss::<1>),
        "Gauss2" => by!(Gauss::<2>),
        "Gauss3" => by!(Gauss::<3>),
        "Gauss4" => by!(Gauss::<4>),
        "Radau2" => by!(Radau::<2>),
        "Radau3" => by!(Radau::<3>),
        "Radau4" => by!(Radau::<4>),
        other => panic!("no method {other}"),
    }
}
