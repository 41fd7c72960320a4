//! Losses over runs: their gradients, and a small network that is trained for an energy.

use argmin::core::CostFunction as _;
use metriplectic_dynamics::{Family, FieldDissipation, Poisson, System};
use metriplectic_fields::Real;
use metriplectic_fitting::Loss;
use metriplectic_integrators::{DormandPrince5, Method as _, Span, Watch as _};
use metriplectic_manifolds::Euclidean;
use nalgebra::{Matrix2, Matrix3, SVector, Vector1, Vector2, Vector3, vector};
use num_dual::DualNum as _;

/// Neurons of the network.
const NEURONS: usize = 8;

/// Its weights: two inputs, a bias and an output for each neuron.
const WEIGHTS: usize = 4 * NEURONS;

type Weights<D> = SVector<D, WEIGHTS>;

/// The network `h(q, p) = Σ_j c_j tanh(a_j q + b_j p + d_j)`.
fn network(q: Real, p: Real, w: &Weights<Real>) -> Real {
    let neuron = |j: usize| (w[j] * q + w[8 + j] * p + w[16 + j]).tanh() * w[24 + j];
    (0..NEURONS).map(neuron).sum()
}

/// Oscillators `(q, p, s)` with the energy `h(q, p) + s` of a network and a known friction, which heats them.
macro_rules! learned {
    () => {
        Family::on(Euclidean::<3>)
            .parameters::<WEIGHTS>([""; WEIGHTS])
            .bracket(
                Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                    .unwrap(),
            )
            .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
                let b = Vector3::new(Real::from(0.0), w.z, -w.y);
                b * b.transpose() * Real::from(0.1)
            }))
            .energy(|x: &Vector3<Real>, w: &Weights<Real>| network(x.x, x.y, w) + x.z)
            .entropy(|x: &Vector3<Real>, _: &Weights<Real>| x.z)
            .build()
            .unwrap()
    };
}

/// A damped pendulum, of which the data are.
macro_rules! pendulum {
    () => {
        System::on(Euclidean::<3>)
            .bracket(
                Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                    .unwrap(),
            )
            .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
                let b = Vector3::new(Real::from(0.0), w.z, -w.y);
                b * b.transpose() * Real::from(0.1)
            }))
            .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z)
            .entropy(|x: &Vector3<Real>| x.z)
            .build()
            .unwrap()
    };
}

/// Small weights to begin with.
fn begin() -> Weights<f64> {
    Weights::from_fn(|i, _| 0.4 * (12.9898 * (i + 1) as f64).sin())
}

#[test]
fn a_network_is_trained_for_an_energy() {
    let (family, truth) = (learned!(), pendulum!());
    let starts = [vector![1.2, 0.0, 0.0], vector![0.0, 1.0, 0.0]];
    let times: Vec<f64> = (1..=6).map(|k| 0.5 * f64::from(k)).collect();
    let span = Span::steps(0.25, 12);
    let data = starts.map(|x0| {
        let run = DormandPrince5.run(&truth, x0, span.output_at(times.clone())).unwrap();
        run.states()[1..].iter().map(|state| state.point).collect::<Vec<_>>()
    });
    let loss = Loss::of(&family)
        .starts(&starts)
        .times(&times)
        .term(|i, k, x: &Vector3<Real>| {
            let off = x - data[i][k].map(Real::from);
            off.x * off.x + off.y * off.y
        })
        .over(DormandPrince5, span);

    // The gradient against differences of order 4 along a few weights.
    let (value, gradient) = loss.gradient_at(&begin()).unwrap();
    assert!((value / loss.value(&begin()).unwrap() - 1.0).abs() < 1e-12);
    for k in [0, 9, 18, 31] {
        let at = |e: f64| {
            let mut w = begin();
            w[k] += e;
            loss.value(&w).unwrap()
        };
        let e = 1e-3;
        let slope = (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
        let error = (slope - gradient[k]).abs() / gradient.amax();
        println!("weight {k}: {error:.1e}");
        assert!(error < 1e-8);
    }

    let found = loss.minimise(begin(), 40).unwrap();
    println!(
        "loss {value:.3e} → {:.3e} in {} iterations, {} losses and {} gradients",
        found.value, found.iterations, found.losses, found.gradients
    );
    assert!(found.value < 0.01 * value);
    // Both laws are those of the learned energy, whatever the weights are, at a start that was never seen too.
    let seen = vector![0.8, -0.5, 0.0];
    for (name, weights) in [("before", begin()), ("after", found.parameters)] {
        let run = DormandPrince5.run(&family.at(weights), seen, span).unwrap();
        let known = DormandPrince5.run(&truth, seen, span).unwrap().last().point;
        let off = (run.last().point - known).xy().norm();
        let certificate = run.certificate();
        println!("{name}: off by {off:.2e}, {certificate}");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy());
        assert!(if name == "before" { off > 0.5 } else { off < 0.3 }, "{name}: {off}");
    }
}

/// Parameters without a run have an infinite loss, and a guess without one is an error.
#[test]
fn losses_outside_of_the_domain_are_infinite() {
    let family = Family::on(Euclidean::<2>)
        .parameters(["width"])
        .field_metric(|_: &Vector2<Real>, t: &Vector1<Real>| {
            Matrix2::from_diagonal(&Vector2::new(t.x, 1.0.into()))
        })
        .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.x * x.x * 0.5 + x.y)
        .entropy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y)
        .build()
        .unwrap();
    let loss = Loss::of(&family)
        .starts(&[vector![1.0, 0.0]])
        .times(&[1.0])
        .term(|_, _, x: &Vector2<Real>| (x.x - 0.7) * (x.x - 0.7))
        .over(DormandPrince5, Span::steps(0.1, 10));
    assert!(loss.cost(&vec![-1.0]).unwrap().is_infinite());
    assert!(loss.minimise(vector![-1.0], 10).is_err());
    let found = loss.minimise(vector![0.3], 30).unwrap();
    println!("width {:.6} at a loss of {:.1e}", found.parameters.x, found.value);
    assert!(found.value < 1e-12);
}
