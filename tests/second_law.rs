//! The second law: what the published scheme breaks and the exact one keeps.

use metriplectic::prelude::*;

/// Two gas containers with a moving wall, in energy coordinates `(q, p, U₁, U₂)` (Öttinger 2018; Shang
/// and Öttinger 2020): they exchange heat at the rate `α`.
fn gas(
    alpha: f64,
    law: SecondLaw,
) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    System::on(Euclidean::<4>)
        .bracket(Poisson::field(|x: &Vector4<Real>| {
            let (left, right) = (-x.z / x.x * (2.0 / 3.0), x.w / (-x.x + 2.0) * (2.0 / 3.0));
            let mut pi = Matrix4::<Real>::zeros();
            pi[(0, 1)] = 1.0.into();
            pi[(1, 0)] = (-1.0).into();
            (pi[(2, 1)], pi[(1, 2)]) = (left, -left);
            (pi[(3, 1)], pi[(1, 3)]) = (right, -right);
            pi
        }))
        .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
        .entropy(|x: &Vector4<Real>| x.x.ln() + (-x.x + 2.0).ln() + (x.z.ln() + x.w.ln()) * 1.5)
        .dissipation(FieldDissipation(move |_: &Vector4<Real>, w: &Vector4<Real>| {
            // α b bᵀ with b orthogonal to w on the two energies.
            let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
            b * b.transpose() * Real::from(alpha)
        }))
        .second_law(law)
        .build()
        .expect("the parts make a system")
}

const GAS: Vector4<f64> = Vector4::new(1.0, 2.0, 2.0, 2.0);

fn certified(alpha: f64, law: SecondLaw, h: f64, steps: usize) -> Certificate {
    let run = WeylMidpoint.run(&gas(alpha, law), GAS, Span::steps(h, steps)).expect("it runs");
    println!("α = {alpha}, h = {h}, {law:?}:\n{}\n", run.certificate());
    assert!(run.certificate().keeps_energy());
    run.certificate().clone()
}

#[test]
fn two_gas_containers_lose_entropy_by_the_published_scheme_and_never_by_the_exact_one() {
    let published = certified(1e-3, SecondLaw::Published, 0.1, 300);
    assert!(published.entropy_falls.abs_diff(150) <= 2, "{published}");
    assert!((published.min_entropy_increment + 1.4e-3).abs() < 5e-5, "{published}");
    let finer = certified(1e-3, SecondLaw::Published, 0.025, 1200);
    assert!(finer.entropy_falls.abs_diff(500) <= 2, "{finer}");

    let exact = certified(1e-3, SecondLaw::Exact, 0.1, 300);
    assert!(exact.keeps_entropy() && exact.min_entropy_increment > -1e-14, "{exact}");
    assert!(exact.min_entropy_slope > 0.1 && exact.sweeps as f64 <= 1.15 * published.sweeps as f64);
    // Without exchange the entropy is a constant.
    let isolated = certified(0.0, SecondLaw::Exact, 0.1, 300);
    assert!(isolated.entropy_gained.abs() <= 1e-13, "{isolated}");
}

#[test]
fn two_gas_containers_follow_their_exact_flow() {
    let exact = Vector4::new(
        0.995_943_001_913_088_5,
        -1.924_764_006_791_638_6,
        2.257_266_242_112_464_2,
        1.890_375_516_967_234_2,
    );
    let errors = [10, 20, 40, 80].map(|steps| {
        let span = Span::steps(1.0 / f64::from(steps), steps as usize);
        let run = WeylMidpoint.run(&gas(0.5, SecondLaw::Exact), GAS, span).expect("it runs");
        (run.last().point - exact).norm()
    });
    let steps = [0.1, 0.05, 0.025, 0.0125];
    let order = metriplectic_studies::Order::fit(&steps, &errors).expect("four errors");
    println!("errors {errors:?}, order {order}");
    assert!(order.agrees(2.0, 0.05), "{order}");
}
