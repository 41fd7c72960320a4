use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng, rngs::ChaCha8Rng};

use super::*;

fn halved(count: i32) -> Vec<f64> {
    (0..count).map(|k| 0.2 * 0.5_f64.powi(k)).collect()
}

fn fit(steps: &[f64], error: impl FnMut(&f64) -> f64) -> Result<Order, OrderError> {
    Order::fit(steps, &steps.iter().map(error).collect::<Vec<_>>())
}

/// Round-off as seen in runs: a random fraction of the floor.
fn floor(rng: &mut impl Rng) -> f64 {
    1e-15 * rng.random_range(0.2..1.0)
}

#[test]
fn a_power_law_has_its_order_and_no_plateau() {
    for p in [1, 2, 4] {
        let order = fit(&halved(7), |h| 3.0 * h.powi(p)).unwrap();
        assert!(order.agrees(f64::from(p), 1e-10), "{order:?}");
        assert!((order.constant - 3.0).abs() < 1e-10, "{order:?}");
        assert_eq!(order.used, [0, 1, 2, 3, 4, 5, 6]);
        assert!(order.plateau.is_empty());
    }
}

#[test]
fn the_plateau_is_dropped() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (p, ratio, clean) in [(1, 0.1, 14), (2, 0.25, 12), (4, 0.5, 11)] {
        let steps: Vec<f64> = (0..clean + 6).map(|k| 0.2 * f64::powi(ratio, k)).collect();
        let order = fit(&steps, |h| h.powi(p) + floor(&mut rng)).unwrap();
        assert!(order.agrees(f64::from(p), 0.05), "order {p}: {order:?}");
        let error = |i: &usize| steps[*i].powi(p);
        assert!(order.plateau.iter().all(|i| error(i) < 3e-14), "{order:?}");
        assert!(order.used.iter().all(|i| error(i) > 2e-15), "{order:?}");
    }
}

#[test]
fn a_fit_through_the_plateau_would_be_wrong() {
    let points: Vec<Point> = (0..12)
        .map(|index| (index, 0.2 * 0.25_f64.powi(i32::try_from(index).unwrap())))
        .map(|(index, h)| Point { index, x: h.ln(), y: (h.powi(4) + 1e-15).ln() })
        .collect();
    assert!(Line::through(&points).slope < 2.5);
}

#[test]
fn round_off_that_rises_is_dropped() {
    let steps: Vec<f64> = (1..12).map(|k| 10_f64.powf(-0.5 * f64::from(k))).collect();
    let order = fit(&steps, |h| h.powi(4) + 1e-15 / h).unwrap();
    assert!(order.agrees(4.0, 0.05), "{order:?}");
    assert_eq!(order.used.len() + order.plateau.len(), 11);
}

/// Residuals `(a, −a, −a, a)` at `x = 0, −1, −2, −3` leave the slope alone, and
/// `σ_p = √(4a²/2/5)`.
#[test]
fn the_interval_is_students() {
    let (steps, a) = ([0.0, -1.0, -2.0, -3.0].map(f64::exp), 0.1_f64);
    let residuals = [a, -a, -a, a];
    let errors: Vec<f64> = steps.iter().zip(residuals).map(|(h, r)| h * h * r.exp()).collect();
    let order = Order::fit(&steps, &errors).unwrap();
    let half = 4.3027 * a * 0.4_f64.sqrt();
    assert!((order.slope - 2.0).abs() < 1e-12, "{order:?}");
    assert!((order.interval.0 - 2.0 + half).abs() < 1e-5, "{order:?}");
    assert!((order.interval.1 - 2.0 - half).abs() < 1e-5, "{order:?}");
}

#[test]
fn noise_is_in_the_interval_and_not_taken_for_a_plateau() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut covered = 0;
    for _ in 0..1000 {
        let noise = |h: &f64| h.powi(2) * (1.0 + 0.1 * rng.random_range(-1.0..1.0));
        let order = fit(&halved(6), noise).unwrap();
        assert!(order.plateau.is_empty(), "{order:?}");
        covered += usize::from(order.interval.0 <= 2.0 && 2.0 <= order.interval.1);
    }
    assert!((920..=980).contains(&covered), "a 95 % interval covers {covered} of 1000");
}

#[test]
fn a_mildly_pre_asymptotic_law_keeps_its_points() {
    for amount in [-0.8, 1.0, 5.0] {
        let order = fit(&halved(8), |h| h * h * (1.0 + amount * h)).unwrap();
        assert_eq!(order.used.len(), 8, "{order:?}");
        assert!((order.slope - 2.0).abs() < 0.25, "{order:?}");
        assert!(!order.agrees(2.0, 0.005), "{order:?}");
    }
}

#[test]
fn an_asymptotic_range_after_a_bad_start_is_no_plateau() {
    let order = fit(&halved(9), |h| h * h + 1e4 * (5.0 * h).powi(8)).unwrap();
    assert!(!order.agrees(2.0, 0.5), "{order:?}");
    assert!(order.plateau.is_empty(), "{order:?}");
}

#[test]
fn the_sequence_of_the_points_does_not_matter() {
    let steps = [0.01, 1e-9, 0.1, 0.02, 0.05, 0.2, 1e-8];
    let order = fit(&steps, |h| h.powi(2).max(1e-15)).unwrap();
    assert_eq!(order.used, [5, 2, 4, 3, 0]);
    assert_eq!(order.plateau, [6, 1]);
}

#[test]
fn errors_that_do_not_fall_are_all_plateau() {
    let result = fit(&halved(8), |_| 1e-15);
    assert!(matches!(result, Err(OrderError::AllPlateau { points: 8, .. })), "{result:?}");
    let rising = fit(&halved(8), |h| 1e-15 / h);
    assert!(matches!(rising, Err(OrderError::AllPlateau { .. })), "{rising:?}");
}

#[test]
fn round_off_alone_has_no_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let fitted = (0..1000).filter(|_| fit(&halved(8), |_| floor(&mut rng)).is_ok()).count();
    assert!(fitted < 50, "{fitted} of 1000 plateaus have an order");
}

#[test]
fn too_few_points_are_refused_with_their_number() {
    let few = fit(&halved(3), |h| *h);
    assert_eq!(few, Err(OrderError::TooFewPoints { found: 3, dropped: 0, needed: 4 }));
    let steps = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
    let buried = fit(&steps, |h| h.powi(4) + 1e-15);
    assert_eq!(buried, Err(OrderError::TooFewPoints { found: 2, dropped: 4, needed: 4 }));
    let none = Order::fit(&[], &[]);
    assert_eq!(none, Err(OrderError::TooFewPoints { found: 0, dropped: 0, needed: 4 }));
}

#[test]
fn bad_input_is_named() {
    let steps = [0.4, 0.3, 0.2, 0.1];
    let short = Order::fit(&steps, &[1.0]);
    assert_eq!(short, Err(OrderError::LengthMismatch { steps: 4, errors: 1 }));
    let zero = Order::fit(&steps, &[1.0, 1.0, 0.0, 1.0]);
    assert_eq!(zero, Err(OrderError::InvalidError { index: 2, value: 0.0 }));
    let infinite = Order::fit(&steps, &[1.0, f64::INFINITY, 1.0, 1.0]);
    assert_eq!(infinite, Err(OrderError::InvalidError { index: 1, value: f64::INFINITY }));
    let nan = Order::fit(&steps, &[1.0, 1.0, 1.0, f64::NAN]);
    assert!(matches!(nan, Err(OrderError::InvalidError { index: 3, .. })), "{nan:?}");
    let negative = Order::fit(&[0.4, -0.3, 0.2, 0.1], &steps);
    assert_eq!(negative, Err(OrderError::InvalidStep { index: 1, value: -0.3 }));
    let repeated = Order::fit(&[0.4, 0.3, 0.2, 0.3], &steps);
    assert_eq!(repeated, Err(OrderError::RepeatedStep { first: 1, second: 3, value: 0.3 }));
}

#[test]
fn agreement_needs_a_narrow_interval() {
    let order = |interval| Order {
        slope: 2.0,
        constant: 1.0,
        interval,
        used: vec![0, 1, 2, 3],
        plateau: vec![],
    };
    assert!(order((1.95, 2.05)).agrees(2.04, 0.06));
    assert!(!order((1.95, 2.05)).agrees(2.1, 0.06));
    assert!(!order((1.0, 3.0)).agrees(2.0, 0.06));
    assert_eq!(order((1.994, 2.006)).to_string(), "2.00 [1.99, 2.01]");
}

proptest! {
    #[test]
    fn the_order_survives_a_random_plateau_or_says_how_far_it_is_off(
        p in 1_i32..=4, constant in 0.01..10.0, length in 4..40_i32, seed: u64
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let order = fit(&halved(length), |h| constant * h.powi(p) + floor(&mut rng))?;
        let half = 0.5 * (order.interval.1 - order.interval.0);
        prop_assert!((order.slope - f64::from(p)).abs() < (2.0 * half).max(0.05), "{:?}", order);
        prop_assert!(half < 0.5, "{:?}", order);
    }
}
