//! Fits in bounds and with robust losses: against SciPy, with every method, and with the errors that they say.

use metriplectic::fitting::{Bound, Estimate, Fit, FitError, Fitted, Robust};
use metriplectic::integrators::Schedule;
use metriplectic::manifolds::rand::rngs::ChaCha8Rng;
use metriplectic::manifolds::rand::{RngExt, SeedableRng};
use metriplectic::prelude::*;
use nalgebra::Vector1;

/// The data and the fits of `tests/data/robust_fits.json`, which `tests/data/robust_fits.py` has made by SciPy's `least_squares`.
struct Published {
    times: Vec<f64>,
    data: Vec<Vector1<f64>>,
    cases: Vec<Case>,
}

struct Case {
    loss: Option<Robust>,
    bounds: [[f64; 2]; 2],
    start: Vector2<f64>,
    held: [Option<Bound>; 2],
    parameters: [f64; 2],
    cost: f64,
}

fn published() -> Published {
    let file: serde_json::Value =
        serde_json::from_str(include_str!("data/robust_fits.json")).expect("JSON");
    let numbers = |list: &serde_json::Value| -> Vec<f64> {
        list.as_array().expect("a list").iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
    };
    let case = |case: &serde_json::Value| {
        let scale = case["scale"].as_f64().expect("a scale");
        let loss = match case["loss"].as_str().expect("a name") {
            "linear" => None,
            "huber" => Some(Robust::Huber(scale)),
            "soft_l1" => Some(Robust::SoftL1(scale)),
            "cauchy" => Some(Robust::Cauchy(scale)),
            other => panic!("{other}"),
        };
        let bounds = [0, 1].map(|i| {
            let pair = numbers(&case["bounds"][i]);
            let or = |x: f64, infinite: f64| if x.is_nan() { infinite } else { x };
            [or(pair[0], f64::NEG_INFINITY), or(pair[1], f64::INFINITY)]
        });
        let active = numbers(&case["active"]);
        let held = [0, 1].map(|i| match active[i] {
            side if side > 0.0 => Some(Bound::Upper),
            side if side < 0.0 => Some(Bound::Lower),
            _ => None,
        });
        let pair = |name: &str| [0, 1].map(|i| numbers(&case[name])[i]);
        let (start, parameters) = (pair("start").into(), pair("parameters"));
        Case { loss, bounds, start, held, parameters, cost: case["cost"].as_f64().expect("a cost") }
    };
    Published {
        times: numbers(&file["times"]),
        data: numbers(&file["data"]).into_iter().map(Vector1::new).collect(),
        cases: file["cases"].as_array().expect("a list").iter().map(case).collect(),
    }
}

/// `x' = −r (x − c)` at constant `y`, so `x = c + (2 − c) e^{−rt}` from the start.
macro_rules! decays {
    () => {
        Family::on(Euclidean::<2>)
            .parameters(["r", "c"])
            .energy(|x: &Vector2<Real>, _: &Vector2<Real>| x.y)
            .entropy(|x: &Vector2<Real>, t: &Vector2<Real>| {
                -((x.x - t.y) * (x.x - t.y) * t.x * 0.5)
            })
            .build()
            .expect("a family")
    };
}

/// The same motion, beside a port that changes the energy alone.
macro_rules! driven {
    () => {
        Family::on(Euclidean::<2>)
            .parameters(["r", "c"])
            .energy(|x: &Vector2<Real>, _: &Vector2<Real>| x.y)
            .entropy(|x: &Vector2<Real>, t: &Vector2<Real>| {
                -((x.x - t.y) * (x.x - t.y) * t.x * 0.5)
            })
            .work("heater", |time: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                vector![0.0.into(), time.sin()]
            })
            .build()
            .expect("a family")
    };
}

const START: Vector2<f64> = Vector2::new(2.0, 0.0);

/// Sets the bounds and the loss of a case, runs it, and returns the fit.
macro_rules! fitted {
    ($fit:expr, $published:expr, $case:expr, $method:expr, $schedule:expr) => {{
        let Case { loss, bounds: [r, c], start, .. } = $case;
        // By name, and by place.
        let mut fit = $fit
            .data(&$published.times, &$published.data)
            .between("r", r[0], r[1])
            .between(1, c[0], c[1]);
        if let Some(loss) = loss {
            fit = fit.robust(*loss);
        }
        fit.run($method, $schedule, *start).expect("a fit")
    }};
}

/// Compares a fit with that of SciPy; returns the largest error of a parameter.
fn agrees(fit: &Fitted, case: &Case) -> f64 {
    let mut off = 0.0_f64;
    for i in 0..2 {
        let Estimate { value, held, standard_error, .. } = fit.estimates[i];
        assert_eq!(held, case.held[i], "{fit}");
        assert_eq!(standard_error.is_nan(), held.is_some(), "{fit}");
        if held.is_some() {
            assert_eq!(value.to_bits(), case.parameters[i].to_bits(), "{fit}");
            assert!(fit.to_string().contains("held at its"), "{fit}");
        }
        off = off.max((value - case.parameters[i]).abs());
    }
    let cost = 0.5 * fit.chi_squared;
    assert!((cost / case.cost - 1.0).abs() < 1e-4, "{cost} {}: {fit}", case.cost);
    off
}

#[test]
fn fits_in_bounds_and_with_losses_are_those_of_scipy() {
    let published = published();
    let (closed, driven) = (decays!(), driven!());
    let span = || Span::until(6.0).tolerance(1e-10);
    let (mut worst, mut held) = ([0.0_f64; 3], 0);
    for case in &published.cases {
        let seen = Fit::of(&closed).observe(|x: &Vector2<Real>| vector![x.x]).start_at(START);
        let by_derivatives = fitted!(seen, published, case, DormandPrince8, span());
        let built = |t: &Vector2<f64>| Ok::<_, Error>(closed.at(*t));
        let seen = Fit::of_systems(["r", "c"], built)
            .observe(|x: &Vector2<f64>| vector![x.x])
            .start_at(START);
        let by_differences = fitted!(seen, published, case, DormandPrince8, span());
        let seen = Fit::of(&driven)
            .observe(|x: &OpenState<Vector2<f64>>| vector![x.x.x])
            .start_from(|system, _| system.start(START));
        let surrounded = fitted!(seen, published, case, DormandPrince8, span());
        for (k, fit) in [by_derivatives, by_differences, surrounded].iter().enumerate() {
            worst[k] = worst[k].max(agrees(fit, case));
            held += fit.estimates.iter().filter(|estimate| estimate.held.is_some()).count();
        }
    }
    println!("off by {worst:?} of SciPy");
    assert_eq!(held, 3 * 16);
    assert!(worst.iter().all(|off| *off < 2e-7), "{worst:?}");
}

#[test]
fn every_method_meets_the_same_bound() {
    let (published, family) = (published(), decays!());
    let is_it = |case: &&Case| {
        matches!(case.loss, Some(Robust::Cauchy(_))) && case.held == [Some(Bound::Upper), None]
    };
    let case = published.cases.iter().find(is_it).expect("a case");
    macro_rules! each {
        ($($method:expr, $schedule:expr, $bound:expr);*) => {$({
            let schedule: Schedule = $schedule.into();
            let seen = Fit::of(&family).observe(|x: &Vector2<Real>| vector![x.x]).start_at(START);
            let fit = fitted!(seen, published, case, $method, schedule);
            let off = agrees(&fit, case);
            println!("{}: {off:.1e}", stringify!($method));
            assert!(off < $bound, "{}: {off:e}", stringify!($method));
        })*};
    }
    each!(
        DormandPrince8, Span::steps(0.25, 24), 1e-6;
        DormandPrince5, Span::until(6.0).tolerance(1e-8), 1e-6;
        Gauss::<2>, Span::until(6.0).tolerance(1e-8), 1e-6;
        Radau::<2>, Span::steps(0.05, 120), 1e-5;
        Scheme::new(WeylMidpoint), Span::steps(0.025, 240), 1e-4;
        RungeKuttaChebyshev, Span::until(6.0).tolerance(1e-7), 1e-5
    );
}

/// The errors of the others are those of a fit with the parameter fixed at the bound; inside of them bounds change nothing.
#[test]
fn a_bound_that_holds_a_parameter_fixes_it() {
    let (published, family) = (published(), decays!());
    let span = || Span::until(6.0).tolerance(1e-10);
    for loss in [None, Some(Robust::SoftL1(0.05))] {
        let fit = || {
            let fit = Fit::of(&family)
                .observe(|x: &Vector2<Real>| vector![x.x])
                .data(&published.times, &published.data)
                .start_at(START);
            if let Some(loss) = loss { fit.robust(loss) } else { fit }
        };
        let held = fit().between("r", 0.1, 0.7).run(DormandPrince8, span(), vector![0.5, 0.4]);
        let fixed = fit().free(["c"]).run(DormandPrince8, span(), vector![0.7, 0.4]).unwrap();
        let held = held.unwrap();
        let [a, b] = [&held.estimates[1], &fixed.estimates[0]];
        assert!(
            (a.value - b.value).abs() < 1e-7 && held.degrees == fixed.degrees,
            "{held}\n{fixed}"
        );
        assert!((a.standard_error / b.standard_error - 1.0).abs() < 1e-5, "{held}\n{fixed}");
        assert!(held.correlations()[(0, 1)].is_nan() && held.not_told_apart().is_empty());
        assert!(held.estimates[0].interval(1.0).iter().all(|x| x.is_nan()));
        // A logarithm at its bound has its bits too, and wide bounds change nothing.
        let in_logarithms = fit()
            .positive_all()
            .between("r", -1.0, 0.7)
            .run(DormandPrince8, span(), vector![0.5, 0.4])
            .unwrap();
        assert_eq!(in_logarithms.parameters[0].to_bits(), 0.7_f64.to_bits());
        assert!((in_logarithms.parameters[1] - a.value).abs() < 1e-7, "{in_logarithms}");
        let guess = vector![0.9, 0.4];
        let wide = fit().between(0, 1e-3, 1e3).between(1, -9.0, 9.0);
        let [wide, without] =
            [wide, fit()].map(|fit| fit.run(DormandPrince8, span(), guess).unwrap());
        for (a, b) in wide.estimates.iter().zip(&without.estimates) {
            assert!((a.value - b.value).abs() < 1e-7 && a.held.is_none());
            assert!((a.standard_error / b.standard_error - 1.0).abs() < 1e-5);
            assert_eq!(a.interval(1e6).map(f64::to_bits), a.bounds.map(f64::to_bits));
        }
        // Both at their bounds: a fit without an unknown.
        let all = fit().between("r", 0.9, 2.0).between("c", 0.0, 0.45);
        let all = all.run(DormandPrince8, span(), vector![0.9, 0.45]).unwrap();
        assert_eq!(all.parameters, [0.9, 0.45]);
        assert_eq!((all.degrees, all.runs), (24, 3), "{all}");
    }
}

/// Estimates of many data with outliers scatter as each fit says, and those of squares much wider.
#[test]
fn robust_estimates_scatter_as_their_errors_say() {
    let (family, times) = (decays!(), published().times);
    let span = || Span::until(6.0).tolerance(1e-8);
    let curve = |t: f64| 0.5 + 1.5 * (-0.8 * t).exp();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut noise = || {
        let (a, b, c): (f64, f64, f64) = (rng.random(), rng.random(), rng.random());
        let size = if c < 0.1 { 0.3 } else { 0.02 };
        size * (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    let (mut of_robust, mut of_squares, mut said) = (0.0, 0.0, 0.0);
    let count = 60;
    for _ in 0..count {
        let data: Vec<_> = times.iter().map(|t| vector![curve(*t) + noise()]).collect();
        let fit = || {
            Fit::of(&family)
                .observe(|x: &Vector2<Real>| vector![x.x])
                .data(&times, &data)
                .start_at(START)
        };
        let guess = vector![0.8, 0.5];
        let robust = fit().robust(Robust::Huber(0.027)).run(DormandPrince8, span(), guess).unwrap();
        let squares = fit().run(DormandPrince8, span(), guess).unwrap();
        let off = |fit: &Fitted| (fit.parameters[1] - 0.5).powi(2) / f64::from(count);
        of_robust += off(&robust);
        of_squares += off(&squares);
        said += robust.estimates[1].standard_error.powi(2) / f64::from(count);
    }
    let ratio = (said / of_robust).sqrt();
    println!(
        "said / found = {ratio:.3}; squares / robust = {:.2}",
        (of_squares / of_robust).sqrt()
    );
    assert!((0.75..1.3).contains(&ratio), "{ratio}");
    assert!(of_squares > 4.0 * of_robust, "{of_squares} {of_robust}");
}

#[test]
fn bounds_and_scales_that_are_none_are_errors() {
    let (published, family) = (published(), decays!());
    let fit = || {
        Fit::of(&family)
            .observe(|x: &Vector2<Real>| vector![x.x])
            .data(&published.times, &published.data)
            .start_at(START)
    };
    macro_rules! refused {
        ($fit:expr) => {
            $fit.run(DormandPrince8, Span::until(6.0), vector![0.8, 0.5]).unwrap_err()
        };
    }
    let (nan, infinity) = (f64::NAN, f64::INFINITY);
    for (a, b) in [(2.0, 0.1), (0.8, 0.8), (nan, 1.0), (0.1, nan), (infinity, infinity)] {
        let error = refused!(fit().between("r", a, b));
        assert!(matches!(error, FitError::Bounds { name: "r", .. }), "{error}");
    }
    for (which, a, b) in [(0, 0.9, 2.0), (0, -1.0, 0.7), (1, 0.6, infinity)] {
        let error = refused!(fit().between(which, a, b));
        assert!(matches!(error, FitError::OutOfBounds { .. }), "{error}");
    }
    // A guess that is no number, and a fixed parameter.
    let error = fit()
        .between("r", 0.0, 1.0)
        .run(DormandPrince8, Span::until(6.0), vector![nan, 0.5])
        .unwrap_err();
    assert!(matches!(error, FitError::OutOfBounds { .. }), "{error}");
    let error = refused!(fit().free(["c"]).between("r", 0.9, 1.0));
    assert!(matches!(error, FitError::OutOfBounds { name: "r", .. }), "{error}");
    let error = refused!(fit().between("q", 0.0, 1.0));
    assert!(matches!(error, FitError::UnknownParameter { .. }), "{error}");
    let error = refused!(fit().between(2, 0.0, 1.0));
    assert!(error.to_string().contains("no parameter 2"), "{error}");
    for scale in [0.0, -1.0, nan, infinity] {
        for loss in [Robust::Huber(scale), Robust::SoftL1(scale), Robust::Cauchy(scale)] {
            let error = refused!(fit().robust(loss));
            assert!(matches!(error, FitError::Scale { .. }), "{error}");
        }
    }
    // The last bounds of a parameter count.
    let twice = fit().between("r", 0.9, 1.0).between("r", 0.1, 2.0);
    assert!(twice.run(DormandPrince8, Span::until(6.0), vector![0.8, 0.5]).is_ok());
}
