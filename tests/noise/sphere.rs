//! The spin of a nanoparticle in SI units, in a bath: the stochastic equation of Landau, Lifshitz and Gilbert.

use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use nalgebra::vector;

use crate::operator::{
    Outcome, assert_orders, coefficients, mean, operator, order, outcomes, step,
};
use crate::shell::Shell;

/// Boltzmann's constant in J/K, and the temperature in K.
const K_B: f64 = 1.380649e-23;
const TEMPERATURE: f64 = 300.0;
/// The moment in J/T, the field in T, the gyromagnetic ratio in 1/(s T), and the damping.
const MOMENT: f64 = 4.8e-19;
const FIELD: Vector3<f64> = vector![0.006, 0.0, 0.008];
const RATIO: f64 = 1.76e11;
const DAMPING: f64 = 0.3;

/// A spin with `H = −μ n·B − a (n·e)⁴`, `n' = (γ/μ) n × ∇H` and the friction `αγ/μ g⁻¹`.
macro_rules! spin {
    ($anisotropy:expr) => {
        System::on(Sphere::<2>::round())
            .bracket(Poisson::field(|n: &Vector3<Real>| {
                n.cross_matrix() * Real::from(RATIO / MOMENT)
            }))
            .energy(|n: &Vector3<Real>| FIELD.cast().dot(n) * -MOMENT - n.z.powi(4) * $anisotropy)
            .bath("crystal", Bath::at(TEMPERATURE).isotropic(DAMPING * RATIO / MOMENT))
            .noise(Boltzmann(K_B))
            .build()
            .unwrap()
    };
}

/// A function of the direction of the spin.
type Function<'a> = dyn Fn(&Vector3<f64>) -> f64 + 'a;

/// The orders of the means of `cos` and of `n_x²`, and the error of the first in the smallest step.
fn measure(
    (sizes, anisotropy): (&[f64], f64),
    step: impl Fn(f64, &Vector3<f64>, &Outcome) -> Vector3<f64>,
) -> ([f64; 2], f64) {
    let shell = Shell::new(9, Vector3::from_element(1.0));
    let axis = FIELD.normalize();
    let functions: [&Function<'_>; 2] = [&|n| n.dot(&axis), &|n| n.x * n.x];
    let thermal = K_B * TEMPERATURE;
    let density =
        |n: &Vector3<f64>| ((MOMENT * FIELD.dot(n) + anisotropy * n.z.powi(4)) / thermal).exp();
    let fine = Shell::new(24, Vector3::from_element(1.0));
    let mut errors = [Vec::new(), Vec::new()];
    for &size in sizes {
        let h = size / (RATIO * FIELD.norm());
        let matrix = operator(&shell, &outcomes(3), |n, outcome| step(h, n, outcome));
        for k in 0..2 {
            let f = coefficients(&shell, functions[k]);
            errors[k].push((h, mean(&shell, &matrix, &f) - fine.mean(density, functions[k])));
        }
    }
    (errors.each_ref().map(|errors| order(errors)), errors[0][2].1.abs())
}

#[test]
fn the_law_of_a_nanoparticle_in_si_units() {
    let spin = spin!(0.0);
    let (two, error) = measure((&[0.1, 0.05, 0.025], 0.0), |h, n, outcome| {
        let method = NinomiyaVictoir(DormandPrince5).numbers(outcome.clone());
        step(&spin, &method, &spin.flow().start(*n), h).x
    });
    let problem = "nanoparticle in SI units: law of n·B and n₁²";
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &two, 2);
    assert!(error < 1e-4, "{error}");
    Claim::new(
        Guarantee::Noise,
        "nanoparticle in SI units: ⟨cos θ⟩",
        "NinomiyaVictoir(DormandPrince5)",
    )
    .against("Langevin's function coth x − 1/x")
    .record(scientific(error), "1e-4");
    // Along a path the energy, of some kT, is the heat of the crystal.
    let span = Span::steps(0.2 / (RATIO * FIELD.norm()), 2000);
    let start = spin.flow().start(vector![0.0, 0.6, 0.8]);
    let path = NinomiyaVictoir(DormandPrince5).seed(7).run(&spin, start, span).unwrap();
    let off = path.certificate().max_energy_error / (K_B * TEMPERATURE);
    assert!(off < 1e-13, "{off:e}");
    let (one, _) = measure((&[0.1, 0.05, 0.025], 0.0), |h, n, outcome| {
        let method = RandomFlow(DormandPrince5).numbers(outcome.clone());
        step(&spin, &method, &spin.flow().start(*n), h).x
    });
    assert_orders(problem, "RandomFlow(DormandPrince5)", &one, 1);
}

#[test]
fn the_law_of_a_spin_whose_energy_is_not_quadratic() {
    const ANISOTROPY: f64 = 2.5e-21;
    let spin = spin!(ANISOTROPY);
    let (two, _) = measure((&[0.2, 0.1, 0.05], ANISOTROPY), |h, n, outcome| {
        let method = NinomiyaVictoir(Gauss::<2>).numbers(outcome.clone());
        step(&spin, &method, &spin.flow().start(*n), h).x
    });
    let problem = "spin with an energy of degree 4 in a bath: law of n·B and n₁²";
    assert_orders(problem, "NinomiyaVictoir(Gauss::<2>)", &two, 2);
}
