//! Systems of more than a hundred variables, in a thread with the default stack.

use std::sync::atomic::{AtomicU64, Ordering};

use metriplectic::prelude::*;

/// Springs in a ring, and the heat that friction makes.
const SPRINGS: usize = 64;
/// Positions, momenta, heat.
const N: usize = 2 * SPRINGS + 1;

type State = SVector<f64, N>;

/// `½|p|² + ½|q|² + ⅛ Σ (q_{i+1} − q_i)⁴ + e^s`, which counts its evaluations.
fn energy(evaluations: &AtomicU64) -> impl Fn(&SVector<Real, N>) -> Real {
    |x| {
        evaluations.fetch_add(1, Ordering::Relaxed);
        let mut sum = x[N - 1].exp();
        for i in 0..SPRINGS {
            let stretch = x[(i + 1) % SPRINGS] - x[i];
            let square = stretch * stretch;
            sum += (x[i] * x[i] + x[SPRINGS + i] * x[SPRINGS + i]) * 0.5 + square * square * 0.125;
        }
        sum
    }
}

/// Friction of each spring, `Σ_i b_i b_iᵀ / (10 w_s)` with `b_i = w_s e_{p_i} − w_{p_i} e_s`.
fn friction(_: &SVector<Real, N>, w: &SVector<Real, N>) -> SMatrix<Real, N, N> {
    let (heat, mut k) = (N - 1, SMatrix::zeros());
    for p in SPRINGS..2 * SPRINGS {
        k[(p, p)] = w[heat] * 0.1;
        k[(p, heat)] = -w[p] * 0.1;
        k[(heat, p)] = k[(p, heat)];
        k[(heat, heat)] += w[p] * w[p] / w[heat] * 0.1;
    }
    k
}

#[test]
fn a_hundred_and_twenty_nine_variables_are_verified_and_stepped_in_any_thread() {
    let evaluations = AtomicU64::new(0);
    let canonical = SMatrix::<f64, N, N>::from_fn(|i, j| {
        f64::from(u8::from(i < SPRINGS && j == i + SPRINGS))
            - f64::from(u8::from(j < SPRINGS && i == j + SPRINGS))
    });
    let system = System::on(Euclidean::<N>)
        .bracket(Poisson::constant(canonical).expect("it is skew"))
        .energy(energy(&evaluations))
        .entropy(|x: &SVector<Real, N>| x[N - 1])
        .dissipation(FieldDissipation(friction))
        .build()
        .expect("a ring is a system");
    let start = State::from_fn(|i, _| if i == N - 1 { 0.1 } else { (1.0 + i as f64).sin() });

    // A Hessian takes n(n+1)/2 evaluations, and there is one at each of 17 points; all triples of axes would take
    // 10⁶ of the bracket.
    system.verify(&start, 0.1).expect("a valid model");
    let taken = evaluations.load(Ordering::Relaxed);
    println!("{taken} evaluations of the energy in the verification");
    assert!(taken < 20 * (N * (N + 1) / 2) as u64, "{taken}");

    let verified = system.verified(&start).expect("a valid model");
    let run = WeylMidpoint.run(&verified, start, Span::steps(0.02, 20)).expect("the run ends");
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    assert!(certificate.entropy_gained > 0.1, "{certificate}");
    // Steps one by one find the room too, and the method of order 8 agrees with the midpoint to its error.
    let mut steps = DormandPrince8.steps(&verified, start, 0.02).expect("a valid model");
    for _ in 0..20 {
        steps.advance().expect("a step");
    }
    let apart = (steps.state().point - run.last().point).amax();
    assert!(apart < 1e-3 && apart > 1e-7, "{apart:e}");
}

/// A bracket in 14 dimensions, beyond those whose triples of axes are all checked, that violates the Jacobi
/// identity: `{q₁, p₁} = 1 + q₂ p₃/4` of the canonical one.
#[test]
fn random_covectors_find_a_bracket_without_the_jacobi_identity() {
    const N: usize = 14;
    let bracket = |defect: f64| {
        move |x: &SVector<Real, N>| {
            let mut pi = SMatrix::<Real, N, N>::zeros();
            for i in 0..N / 2 {
                pi[(i, i + N / 2)] = Real::from(1.0);
                pi[(i + N / 2, i)] = Real::from(-1.0);
            }
            let change = x[1] * x[N / 2 + 2] * defect;
            pi[(0, N / 2)] += change;
            pi[(N / 2, 0)] -= change;
            pi
        }
    };
    let verdict = |defect| {
        let system = System::on(Euclidean::<N>)
            .bracket(Poisson::field(bracket(defect)))
            .energy(|x: &SVector<Real, N>| x.norm_squared() * 0.5)
            .build()
            .expect("the parts fit");
        system.verify(&SVector::<f64, N>::from_fn(|i, _| 1.0 + 0.1 * i as f64), 0.1)
    };
    assert_eq!(verdict(0.0), Ok(()));
    assert!(matches!(verdict(0.25), Err(ModelError::NoJacobiIdentity { .. })));
    assert!(matches!(verdict(1e-6), Err(ModelError::NoJacobiIdentity { .. })));
}
