//! The bias of means over noisy paths, by steps that are doubled on the same paths: against the exact law of a damped oscillator.
#![allow(clippy::cast_possible_truncation, reason = "a number of steps is small")]

use metriplectic::ensembles::{DoublingError, StepAdviceError, StepBias};
use metriplectic::prelude::*;
use nalgebra::vector;

const THERMAL: f64 = 0.8;
const FRICTION: f64 = 0.7;
const START: Vector2<f64> = vector![0.3, -0.2];
const TIME: f64 = 2.0;

/// A damped oscillator in a bath: `q' = p`, `p' = −q − γ p + √(2 γ kT) ξ`.
macro_rules! oscillator {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| (x.y * x.y + x.x * x.x) * 0.5)
            .bath(
                "water",
                Bath::at(THERMAL).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: FRICTION.into(), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

/// The motion without noise over a time, `e^{At}`.
fn motion(t: f64) -> Matrix2<f64> {
    (Matrix2::new(0.0, 1.0, -1.0, -FRICTION) * t).exp()
}

/// `E q²` or `E p²` at the time 2 in steps of size `h`, whose noise is at a fraction of the step; exact where `h` is zero.
fn mean_square(h: f64, (entry, before_noise): (usize, f64)) -> f64 {
    let mean = (motion(TIME) * START)[entry];
    if h == 0.0 {
        let all = motion(TIME);
        return mean * mean
            + (THERMAL * (Matrix2::identity() - all * all.transpose()))[(entry, entry)];
    }
    let [first, second] = [before_noise, 1.0 - before_noise].map(|part| motion(part * h));
    let noise = Matrix2::new(0.0, 0.0, 0.0, 2.0 * FRICTION * THERMAL * h);
    let mut spread = Matrix2::zeros();
    for _ in 0..(TIME / h).round() as usize {
        spread = first * spread * first.transpose() + noise;
        spread = second * spread * second.transpose();
    }
    mean * mean + spread[(entry, entry)]
}

macro_rules! measured {
    ($method:expr, $entry:expr, $h:expr, $paths:expr, $order:expr) => {{
        let oscillator = oscillator!();
        let start = oscillator.flow().start(START);
        let oscillator = oscillator.verified(&start).unwrap();
        let steps = (TIME / $h).round() as usize;
        let doubling = Doubling { h: $h, steps, paths: $paths, order: $order };
        let bias = doubling.measure(|path| {
            let method = path.sampler($method.seed(7));
            let run = method.run(&oscillator, start.clone(), path.span())?;
            Ok(run.last().point.x[$entry].powi(2))
        });
        bias.unwrap()
    }};
}

/// Asserts a measured bias against the exact one of these steps.
fn assert_bias(bias: &StepBias, before_noise: (usize, f64), order: f64) {
    println!("{bias}");
    let h = bias.doubling.h;
    let [here, double] = [h, 2.0 * h].map(|h| mean_square(h, before_noise));
    let exact = mean_square(0.0, before_noise);
    println!("exact {exact:.6}, bias {:.6} {:.6}", here - exact, double - exact);
    assert!(bias.means[0].errors_from(here) < 4.0 && bias.means[1].errors_from(double) < 4.0);
    // The formula leaves an error of the next order.
    let allowed = |of: &Estimate, exact: f64| 4.0 * of.standard_error + h * exact.abs();
    assert!((bias.bias.mean - (here - exact)).abs() < allowed(&bias.bias, here - exact));
    let of_double = &bias.bias_of_double;
    assert!((of_double.mean - (double - exact)).abs() < 2.0 * allowed(of_double, double - exact));
    let measured = bias.measured_order;
    assert!((measured.mean - order).abs() < 0.15 + 3.0 * measured.standard_error, "{measured}");
    assert!(measured.standard_error < 0.2, "{measured}");
    // On one path the difference has a far smaller spread than the numbers.
    assert!(bias.bias.standard_error < 0.2 * bias.means[0].standard_error, "{bias}");
    // A step that is advised has the bias that was asked for, and one twice as long has not.
    for wanted in [0.5 * (here - exact).abs(), 0.1 * (here - exact).abs()] {
        let advised = bias.step_for(wanted).expect("a step");
        let whole = TIME / (TIME / advised).ceil();
        let off = |h: f64| (mean_square(h, before_noise) - exact).abs();
        println!("h = {advised:.4} for {wanted:.2e}: {:.2e}", off(whole));
        assert!(off(whole) < wanted && off(TIME / (TIME / (2.0 * advised)).floor()) > wanted);
    }
}

#[test]
fn the_bias_of_a_damped_oscillator_is_that_of_its_law() {
    let one = measured!(RandomFlow(DormandPrince8), 0, 0.05, 10_000, 1.0);
    assert_bias(&one, (0, 1.0), 1.0);
    let two = measured!(NinomiyaVictoir(DormandPrince8), 1, 0.25, 40_000, 2.0);
    assert_bias(&two, (1, 0.5), 2.0);
    // The wrong order is found out where it matters.
    let wrong = measured!(RandomFlow(DormandPrince8), 0, 0.05, 10_000, 4.0);
    let error = wrong.step_for(1e-3).unwrap_err();
    assert!(
        matches!(error, StepAdviceError::OffOrder { measured, .. } if (measured - 1.0).abs() < 0.3)
    );
    assert!(matches!(one.step_for(0.0), Err(StepAdviceError::NotPositive { .. })));
    // With few paths chance decides, and the steps are shorter.
    let few = measured!(NinomiyaVictoir(DormandPrince8), 1, 0.25, 40, 2.0);
    assert!(few.step_for(1e-3).unwrap() < two.step_for(1e-3).unwrap());
    // Never longer than what was tried.
    assert!(two.step_for(1e3).unwrap() <= 1.0);
}

#[test]
fn the_bias_does_not_depend_on_threads() {
    let [a, b] = [0, 1].map(|_| measured!(RandomFlow(DormandPrince5), 0, 0.1, 101, 1.0));
    assert_eq!(a, b);
}

#[test]
fn what_cannot_be_doubled_is_refused() {
    let all = Doubling { h: 0.1, steps: 8, paths: 4, order: 1.0 };
    let fails = |doubling: Doubling| doubling.measure(|_| Ok(1.0)).unwrap_err();
    for steps in [0, 2, 6, 7] {
        assert!(matches!(fails(Doubling { steps, ..all }), DoublingError::Steps { .. }));
    }
    assert!(matches!(fails(Doubling { paths: 1, ..all }), DoublingError::Paths { paths: 1 }));
    for order in [0.0, -1.0, f64::NAN] {
        assert!(matches!(fails(Doubling { order, ..all }), DoublingError::Order { .. }));
    }
    let none = all.measure(|path| Ok(if path.number() == 2 { f64::NAN } else { 1.0 }));
    assert!(matches!(none, Err(DoublingError::NotANumber { path: 2, .. })));
    let oscillator = oscillator!();
    let fails = Doubling { h: -0.1, ..all }.measure(|path| {
        let method = path.sampler(RandomFlow(DormandPrince5).seed(7));
        let run = method.run(&oscillator, oscillator.flow().start(START), path.span())?;
        Ok(run.last().point.x.x)
    });
    assert!(matches!(fails, Err(DoublingError::Run { path: 0, .. })));
}
