//! Two expressions of one time are the same time: corners beside times of the grid.

use metriplectic::integrators::Schedule;
use metriplectic::prelude::*;
use nalgebra::{Vector2, vector};

use crate::model::{FREE, From, METHODS, Model, Outcome, nothing, run};

/// A control `u_k = sin 1.7k` that is constant between its samples at intervals of 0.1, as a user finds the sample.
fn sampled(t: Real) -> Real {
    (1.7 * (t.re / 0.1).floor()).sin().into()
}

/// The same, whose sample is found by a remainder.
fn by_remainder(t: Real) -> Real {
    (1.7 * ((t.re - t.re % 0.1) / 0.1).round()).sin().into()
}

fn ended(method: &str, model: Model, span: impl Into<Schedule>) -> Result<Outcome, String> {
    run(method, model, From::Point([1.0, 0.0]), span.into(), None)
}

/// `q'' = −q + u_k` from (1, 0) at time 2, sample by sample in closed form.
fn exact() -> [f64; 2] {
    let (sin, cos) = 0.1_f64.sin_cos();
    (0..20).fold([1.0, 0.0], |[q, p], k| {
        let u = (1.7 * f64::from(k)).sin();
        [u + (q - u) * cos + p * sin, p * cos - (q - u) * sin]
    })
}

/// What a method of order p makes of a step of this size here, with the error constants of these methods below 1.
fn allowed(method: &str, h: f64) -> f64 {
    let order = match method {
        "Weyl" | "Gauss1" | "RKC" => 2,
        "DP5" => 5,
        "Gauss2" => 4,
        "Gauss3" => 6,
        _ => 8,
    };
    2.0 * h.powi(order) + 1e-13
}

/// Samples that lie a rounding before or after times of the grid keep the order, whatever the closure makes of the same time.
#[test]
fn samples_beside_times_of_the_grid_keep_the_order() {
    let [right_q, right_p] = exact();
    for (name, control) in [("floor", sampled as fn(Real) -> Real), ("remainder", by_remainder)] {
        for as_port in [false, true] {
            let (force, port) =
                if as_port { (nothing as _, control) } else { (control, nothing as _) };
            let model = Model { stiffness: 1.0, force, port, ..FREE };
            for method in METHODS {
                for (h, count) in [(0.1, 20), (0.04, 50), (0.025, 80), (0.02, 100), (0.01, 200)] {
                    let span = Span::steps(h, count).sampled(0.1);
                    let outcome = ended(method, model, span);
                    let outcome = outcome.unwrap_or_else(|e| panic!("{method}, {name}, {h}: {e}"));
                    let [q, p] = outcome.end();
                    let off = (q - right_q).hypot(p - right_p);
                    assert!(off < allowed(method, h), "{method}, {name}, {h}: {off:.1e}");
                }
                let accurate = !["Weyl", "Gauss1", "RKC"].contains(&method);
                let tolerance = if accurate { 1e-9 } else { 1e-5 };
                let span = Span::until(2.0).tolerance(tolerance).sampled(0.1);
                let [q, p] =
                    ended(method, model, span).unwrap_or_else(|e| panic!("{method}: {e}")).end();
                let off = (q - right_q).hypot(p - right_p);
                assert!(off < 20.0 * tolerance, "{method}, {name}, with a tolerance: {off:.1e}");
            }
        }
    }
}

fn stiffer(t: Real) -> Real {
    if t.re < 0.5 { 0.0.into() } else { 1.0.into() }
}

/// A corner that is named a rounding beside the jump is the jump, in one step of any size that ends there or beyond it.
#[test]
fn a_corner_beside_the_jump_is_the_jump() {
    let model = Model { stiffness: 1.0, force: stiffer, ..FREE };
    let at = |t: f64| {
        let [q, p] = [0.5_f64.cos(), -(0.5_f64.sin())];
        let (sin, cos) = (t - 0.5).sin_cos();
        [1.0 + (q - 1.0) * cos + p * sin, p * cos - (q - 1.0) * sin]
    };
    for corner in [0.5, 0.5_f64.next_up(), 0.5_f64.next_down(), 0.1 + 0.4, 0.5 + 2e-16, 0.5 - 2e-16]
    {
        for method in METHODS {
            for (h, count) in [(0.1, 10), (0.25, 4), (0.5, 2), (1.0, 1)] {
                let outcome = ended(method, model, Span::steps(h, count).corners([corner]));
                let outcome = outcome.unwrap_or_else(|e| panic!("{method}, {corner:?}, {h}: {e}"));
                let [q, p] = outcome.end();
                let off = (q - at(1.0)[0]).hypot(p - at(1.0)[1]);
                assert!(off < allowed(method, h), "{method}, {corner:?}, {h}: {off:.1e}");
                // The work of the jump, −q(½) at the frozen state.
                let work = outcome.ledger[0];
                let off = (work + 0.5_f64.cos()).abs();
                assert!(off < allowed(method, h), "{method}, {corner:?}, {h}: {work}");
            }
        }
    }
}

/// A stage at the end of a step is at the end: of entries of tens the rows of order 8 make a sum that is larger than one.
#[test]
fn stages_at_the_end_of_a_step_are_on_the_old_law() {
    for end in [0.1, 0.3, 0.7, 1.1, 12.3, 1e3] {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .work("port", move |t: Real, _: &Vector2<Real>| {
                vector![0.0.into(), if t.re < end { 0.0.into() } else { Real::from(1.0) }]
            })
            .build()
            .expect("a system");
        let start = end - 0.1 * end.min(1.0);
        let h = end - start;
        for count in [1, 2] {
            let span = Span::steps(h, count).starting_at(start).corners([end]);
            let run = DormandPrince8.run(&system, system.start(vector![1.0, 0.0]), span);
            let state = run.expect("it runs").states()[1].point.x;
            let off = (state.x - h.cos()).hypot(state.y + h.sin());
            // A step ends some roundings of the time before the corner.
            assert!(off < 1e-14 + 32.0 * f64::EPSILON * end, "{end}: {off:.1e}");
        }
    }
}
