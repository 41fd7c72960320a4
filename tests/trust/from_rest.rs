//! What flows into a system at rest, at the zero of its energy, and what the time brings later.

use metriplectic::integrators::Schedule;
use metriplectic::prelude::*;

use crate::model::{ACCURATE, FREE, From, METHODS, Model, Outcome, nothing, run};

fn ended(method: &str, model: Model, x: [f64; 2], span: impl Into<Schedule>) -> Outcome {
    run(method, model, From::Point(x), span.into(), None)
        .unwrap_or_else(|error| panic!("{method} from {x:?}: {error}"))
}

fn push(_: Real) -> Real {
    (-1.0).into()
}

fn sine(t: Real) -> Real {
    t.sin()
}

/// The steps of a method of fixed size that end at 1, and what their error may be.
fn sizes(method: &str) -> (f64, f64) {
    if ["Weyl", "Gauss1", "RKC"].contains(&method) { (1e-3, 1e-5) } else { (1e-2, 1e-8) }
}

/// A balance counts what flowed: a port and a bath set a system in motion from the zero of its energy, in any unit. A size of
/// terms that forgets the flow refuses every first step.
#[test]
fn a_port_moves_a_state_from_the_zero_of_its_energy() {
    let pushed = Model { port: push, ..FREE };
    let driven = Model { stiffness: 1.0, port: sine, ..FREE };
    // p' = −p − 1 with the bath at rest.
    let warmed = Model { port: push, rate: 1.0, ..FREE };
    let lag = 1.0 - (-1.0_f64).exp();
    for method in METHODS {
        let (h, coarse) = sizes(method);
        for p in [0.0, 1e-300, 1e-12] {
            let count = (1.0 / h).round() as usize;
            let spans: [(Schedule, f64); 2] = [
                (Span::steps(h, count).into(), coarse),
                (Span::until(1.0).tolerance(1e-8).into(), 1e-6),
            ];
            for (span, allowed) in spans {
                for (model, right) in [
                    (pushed, [-0.5, -1.0]),
                    (driven, [0.150_584_339_469_878, 0.420_735_492_403_948]),
                    (warmed, [lag - 1.0, -lag]),
                ] {
                    let outcome = ended(method, model, [0.0, p], span.clone());
                    let [q, p] = outcome.end();
                    let off = (q - right[0]).abs().max((p - right[1]).abs());
                    assert!(off < allowed, "{method} from {p}: {off:.1e}");
                    assert!(
                        outcome.certificate.keeps_energy(),
                        "{method}: {}",
                        outcome.certificate
                    );
                    // The kinetic energy is what has flowed in.
                    let [_, work, heat, _] = outcome.ledger;
                    let energy = 0.5 * (p * p + model.stiffness * q * q);
                    assert!((work + heat - energy).abs() < 1e-13, "{method}: {work} {heat}");
                }
            }
        }
    }
}

fn stroke(t: Real) -> Real {
    if (1.0..2.0).contains(&t.re) { 1.0.into() } else { nothing(t) }
}

fn bell(t: Real, centre: f64, width: f64) -> Real {
    (((t - centre) / width).powi(2) * -0.5).exp()
}

/// A state at rest is left in small steps: a stroke that comes later is not stepped over, and the certificate says how long
/// nothing happened. One step over everything answers zero, with a clean certificate.
#[test]
fn a_pulse_is_seen_from_rest() {
    let model = Model { force: stroke, ..FREE };
    for method in METHODS {
        for end in [17.0, 100.0] {
            let outcome = ended(method, model, [0.0; 2], Span::until(end).tolerance(1e-6));
            let [_, p] = outcome.end();
            assert!((p - 1.0).abs() < 2e-4, "{method} until {end}: {p}");
            let rest = outcome.certificate.rest_in_time.expect("nothing moves it until 1");
            assert!(rest.longest <= 0.0101 * end, "{method}: {rest:?}");
            assert!(rest.steps <= 220 && rest.time > 1.0, "{method}: {rest:?}");
            assert!(outcome.certificate.to_string().contains("at rest:"));
        }
    }
    // A bell of a hundredth of the run, anywhere in it: its area is √(2π)/100.
    let area = 0.01 * std::f64::consts::TAU.sqrt();
    let bells: [fn(Real) -> Real; 4] = [
        |t| bell(t, 0.1234, 0.01),
        |t| bell(t, 0.405, 0.01),
        |t| bell(t, 0.7321, 0.01),
        |t| bell(t, 0.95, 0.01),
    ];
    for method in METHODS {
        for force in bells {
            for (p, span) in [(0.0, 1e-6), (1.0, 1e-6)] {
                let model = Model { force, ..FREE };
                let outcome = ended(method, model, [0.0, p], Span::until(1.0).tolerance(span));
                let gained = outcome.end()[1] - p;
                assert!((gained / area - 1.0).abs() < 1e-3, "{method} from {p}: {gained}");
            }
        }
    }
}

/// Where something moves the state, a run takes the steps that it needs, and no more than ten beside them.
#[test]
fn a_motion_in_time_costs_no_more_steps() {
    let model = Model { stiffness: 1.0, port: sine, ..FREE };
    // With one step over everything from rest, 24 and 43.
    for (method, most) in [("DP8", 34), ("Gauss4", 53)] {
        let outcome = ended(method, model, [1.0, 0.0], Span::until(20.0).tolerance(1e-6));
        let steps = outcome.certificate.steps + outcome.certificate.rejected;
        assert!(steps <= most, "{method}: {steps} steps");
        assert!(outcome.certificate.rest_in_time.is_none(), "{method}");
    }
}

fn late(t: Real) -> Real {
    bell(t, 50.0, 1.0)
}

fn short(t: Real) -> Real {
    bell(t, 50.0, 0.1)
}

/// Numbers without digits are zeros: a force grows through all powers of ten, and nothing is refused on the way. The sizes of
/// the entries begin at a small part of what the rates make of the run, so that the first digits need not be followed.
#[test]
fn a_force_that_grows_from_nothing_is_followed() {
    let area = std::f64::consts::TAU.sqrt();
    for method in METHODS {
        // Of order 2, a step at a tolerance of 1e-6 is short.
        let tolerance = if ACCURATE.contains(&method) { 1e-6 } else { 1e-4 };
        let spans: [Schedule; 3] = [
            Span::until(60.0).tolerance(tolerance).into(),
            Span::until(60.0).tolerance(tolerance).scale([1.0; 2]).into(),
            Span::until(60.0).tolerance(tolerance).absolute([1e-6; 2]).into(),
        ];
        for span in spans {
            for (force, area) in [(late as fn(Real) -> Real, area), (short, 0.1 * area)] {
                let outcome = ended(method, Model { force, ..FREE }, [0.0; 2], span.clone());
                let [_, p] = outcome.end();
                assert!((p - area).abs() < 300.0 * tolerance * area, "{method}: {p} for {area}");
                let steps = outcome.certificate.steps;
                assert!(steps < 6000, "{method}: {steps} steps");
            }
        }
        let outcome = ended(method, Model { force: late, ..FREE }, [0.0; 2], Span::steps(0.1, 600));
        let allowed = if ACCURATE.contains(&method) { 1e-6 } else { 1e-3 };
        assert!((outcome.end()[1] - area).abs() < allowed, "{method}: {:?}", outcome.end());
    }
}

/// An oscillation in a bath without temperature decays below the least number.
#[test]
fn a_motion_decays_below_the_least_number() {
    let cold = Model { stiffness: 1.0, rate: 0.5, temperature: 0.0, ..FREE };
    for method in METHODS.into_iter().chain(["Radau2", "Radau3", "Radau4"]) {
        for tolerance in [1e-4, 1e-6] {
            if tolerance < 1e-4 && !ACCURATE.contains(&method) {
                continue;
            }
            let span = Span::until(2000.0).tolerance(tolerance).at_most(2);
            let outcome = ended(method, cold, [1.0, 0.0], span);
            let [q, p] = outcome.end();
            assert!(q.hypot(p) < 3.0 * tolerance, "{method}: {q} {p}");
            // What is left of the energy has not become heat.
            let [_, _, heat, _] = outcome.ledger;
            let left = 0.5 * (q * q + p * p);
            assert!((heat + 0.5 - left).abs() < 1e-13, "{method}: {heat}");
        }
    }
}
