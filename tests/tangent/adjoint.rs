//! Gradients of losses, against the tangents of the same runs: `⟨λ₀, 1⟩ = Σ_k ⟨w_k, T_k⟩`.

use metriplectic::dynamics::{Parametrised as _, Point};
use metriplectic::fields::{Column as _, Vector};
use metriplectic::integrators::{LinearisedAlong, LossGradient, Schedule};
use metriplectic::prelude::*;
use nalgebra::{DVector, vector};

use crate::{body, dim};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.05);

/// The bar: some hundreds of round-offs.
const ROUNDED: f64 = 1e-13;
/// Near an equilibrium `dS = β dH + n`, and a step onto an entropy has derivatives of size `1/|n|`: here `|n| ≈ 10⁻⁵ |dS|`.
const NEAR_REST: f64 = 1e-9;

/// A covector for state `k`, different from entry to entry.
fn weight<D: Differentiable>(k: usize) -> Vector<D::Manifold> {
    Vector::<D::Manifold>::from_index(|i| (1.0 + k as f64 + 0.7 * i as f64).sin())
}

pub(crate) fn whole(gradient: &LossGradient) -> DVector<f64> {
    let (start, parameters) = (gradient.along_start(), gradient.along_parameters());
    DVector::from_iterator(
        start.len() + parameters.len(),
        start.iter().chain(parameters.iter()).copied(),
    )
}

/// Compares the adjoint with the tangent, and segments that are taken again with steps that were kept, bit for bit.
pub(crate) fn transposed<D, M>(
    (name, bar): (&str, f64),
    (system, method): (&D, M),
    x0: &Point<D>,
    schedule: &Schedule,
) where
    D: Differentiable,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let tangent = method.tangent(system, x0.clone(), schedule.clone()).expect("a tangent");
    let run = method.adjoint(system, x0.clone(), schedule.clone()).expect("an adjoint");
    let (mut forward, mut terms) =
        (DVector::zeros(dim::<<D::Wide as Metriplectic>::Manifold>()), 0.0);
    let mut rows = Vec::new();
    assert_eq!(tangent.states().len(), run.states().len());
    for (k, (a, b)) in tangent.states().iter().zip(run.states()).enumerate() {
        assert!(a.point == b.point && a.time.to_bits() == b.time.to_bits());
        let row = weight::<D>(k);
        let along = a.derivative_of(&row);
        terms += along.amax();
        forward += along;
        rows.push(row);
    }
    let found = run.pull_back(&rows).expect("a gradient");
    let error = (whole(&found) - &forward).amax() / terms;
    println!("{name}: {error:.1e} of {:.2}, {} states", forward.amax(), rows.len());
    assert!(error < bar, "{name}: {error:e}");
    let again = method.adjoint_within(3, system, x0.clone(), schedule.clone()).expect("segments");
    assert_eq!(found, again.pull_back(&rows).expect("a gradient"), "{name}: segments");
}

#[test]
fn adjoints_are_transposed_tangents() {
    let weyl = Scheme::new(WeylMidpoint);
    let quartic = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| {
            p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + (p.x * p.z).sin() * 0.2
        })
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap()
        .erased();
    let span: Schedule = Span::steps(0.2, 15).into();
    transposed(("so(3)*, Weyl", ROUNDED), (&quartic, weyl), &START, &span);
    transposed(("so(3)*, order 5", NEAR_REST), (&quartic, DormandPrince5), &START, &span);
    for h in [2.0, 4.0, 8.0] {
        // In parts, with outputs inside them.
        let coarse: Schedule = Span::steps(h, 3).output_every(0.7 * h);
        transposed(("parts, Weyl", NEAR_REST), (&quartic, weyl), &START, &coarse);
        transposed(("parts, order 5", NEAR_REST), (&quartic, DormandPrince5), &START, &coarse);
    }
    let round = System::on(Sphere::<2>::round())
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
        .build()
        .unwrap()
        .erased();
    for n in [vector![0.36, 0.48, 0.8], vector![0.6, 0.8, -0.0]] {
        transposed(("S², Weyl", ROUNDED), (&round, weyl), &n, &Span::steps(0.1, 20).into());
        transposed(
            ("S², order 8", ROUNDED),
            (&round, DormandPrince8),
            &n,
            &Span::steps(0.1, 20).into(),
        );
    }
}

#[test]
fn adjoints_have_parameters() {
    let family = body();
    let system = family.at_parameters(THETA);
    let outputs = Span::until(20.0).tolerance(1e-9).output_every(1.3);
    transposed(("θ, order 8, frozen", ROUNDED), (&system, DormandPrince8), &START, &outputs);
    transposed(
        ("θ, order 8", ROUNDED),
        (&system, DormandPrince8),
        &START,
        &Span::steps(0.5, 20).into(),
    );
    let weyl = Scheme::new(WeylMidpoint);
    let span = Span::until(5.0).tolerance(1e-5).output_at([0.3, 2.0, 5.0]);
    transposed(("θ, Weyl, frozen", ROUNDED), (&system, weyl), &START, &span);
}

/// Fifty parameters: an energy with the coefficients of a polynomial.
#[test]
fn adjoints_have_many_parameters() {
    let family = Family::on(LieDual::so3())
        .parameters([""; 50])
        .energy(|p: &Vector3<Real>, t: &SVector<Real, 50>| {
            let linear = |k: usize| p.x * t[k] + p.y * t[k + 1] + p.z * t[k + 2];
            (0..16).fold(p.norm_squared() * 0.5, |sum, k| sum + linear(3 * k).sin() * t[48])
        })
        .casimir(|p: &Vector3<Real>, t: &SVector<Real, 50>| p.norm_squared() * t[49])
        .build()
        .unwrap();
    let theta = SVector::<f64, 50>::from_fn(|k, _| 0.3 + (k as f64 * 1.7).cos());
    let system = family.at(theta);
    transposed(
        ("P = 50", ROUNDED),
        (&system, DormandPrince8),
        &START,
        &Span::steps(0.2, 10).into(),
    );
    transposed(
        ("P = 50, Weyl", ROUNDED),
        (&system, Scheme::new(WeylMidpoint)),
        &START,
        &Span::steps(0.1, 4).into(),
    );
}

/// A loss by a closure, against differences of order 4 of the losses of runs.
#[test]
fn losses_have_gradients() {
    let family = body();
    let data = vector![0.2, -0.7, 0.5];
    let span = || Span::steps(0.25, 40).output_at([2.0, 5.1, 10.0]);
    let loss = |x: Vector3<f64>, t: Vector4<f64>| -> f64 {
        let system = family.at_parameters(t);
        let run = DormandPrince8.adjoint(&system, x, span()).unwrap();
        run.states()[1..].iter().map(|s| (s.point - data).norm_squared()).sum()
    };
    let system = family.at_parameters(THETA);
    let run = DormandPrince8.adjoint(&system, START, span()).unwrap();
    let found = run
        .gradient(|k, p: &Vector3<Real>| match k {
            0 => 0.0.into(),
            _ => (p - data.map(Real::from)).norm_squared(),
        })
        .unwrap();
    assert!((found.value - loss(START, THETA)).abs() < 1e-13);
    assert_eq!(found.along("friction"), Some(found.along_parameters()[3]));
    let gradient = whole(&found);
    for k in 0..7 {
        let at = |d: f64| {
            let (mut x, mut t) = (START, THETA);
            if k < 3 {
                x[k] += d;
            } else {
                t[k - 3] += d;
            }
            loss(x, t)
        };
        let e = 5e-4;
        let slope = (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
        assert!((slope - gradient[k]).abs() < 1e-8 * gradient.amax(), "{k}: {slope} {gradient}");
    }
}
