//! Noise from the zero of an energy; and a retraction is a method wherever one is asked for: in samplers, tangents and adjoints.

use metriplectic::prelude::*;

#[test]
fn a_retraction_is_its_scheme() {
    let start = vector![0.4, -1.0, 0.3];
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .noise(Boltzmann(0.1))
        .build()
        .unwrap();
    let span = Span::steps(0.05, 20);
    let scheme = Scheme::new(WeylMidpoint);
    let short = RandomFlow(WeylMidpoint).seed(3).run(&body, start, span).unwrap();
    let long = RandomFlow(scheme).seed(3).run(&body, start, span).unwrap();
    assert_eq!(short.states(), long.states());
    let short = NinomiyaVictoir(WeylMidpoint).seed(3).path(1).run(&body, start, span).unwrap();
    assert!(short.certificate().keeps_energy() && !short.certificate().keeps_entropy());

    let family = Family::on(LieDual::so3())
        .parameters(["friction"])
        .energy(|p: &Vector3<Real>, _: &Vector1<Real>| {
            p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector1<Real>| p.norm_squared() * t.x * 0.5)
        .build()
        .unwrap();
    let system = family.at(vector![0.05]);
    let short = WeylMidpoint.tangent(&system, start, span).unwrap();
    let long = scheme.tangent(&system, start, span).unwrap();
    assert_eq!(short.last().matrix(), long.last().matrix());
    let rows = vec![vector![1.0, 2.0, 3.0]; short.states().len()];
    let gradient = WeylMidpoint.adjoint(&system, start, span).unwrap().pull_back(&rows).unwrap();
    let expected = scheme.adjoint(&system, start, span).unwrap().pull_back(&rows).unwrap();
    assert_eq!(gradient.along_start(), expected.along_start());
    assert_eq!(gradient.along_parameters(), expected.along_parameters());
    // A checkpoint of one is one of the other.
    let mut steps = WeylMidpoint.steps(&system, start, span).unwrap();
    steps.advance().unwrap();
    let resumed = scheme.resume(&system, &steps.checkpoint()).unwrap().run().unwrap();
    assert_eq!(resumed.last().point, WeylMidpoint.run(&system, start, span).unwrap().last().point);
}

/// Runs paths of a system in an isotropic bath at `T = 1` with rate ½ from a state at which the energy vanishes, and compares the
/// mean of `H`. With `H = ½|p|²` in `n` damped directions it is `½ n (1 − e^{−t})`.
macro_rules! from_the_zero {
    ($name:literal, $space:expr, $zero:expr, $energy:expr, $directions:expr) => {{
        const PATHS: u64 = 200;
        let system = System::on($space)
            .energy($energy)
            .bath("air", Bath::at(1.0).isotropic(0.5))
            .noise(Boltzmann(1.0))
            .build()
            .unwrap();
        let start = system.flow().start($zero);
        let exact = 0.5 * $directions * (1.0 - (-2.0_f64).exp());
        // The variance of the energy of n degrees of freedom is 2/n of the square of its mean.
        let error = exact * (2.0 / $directions / PATHS as f64).sqrt();
        let mean = |method: &str, end: &dyn Fn(u64) -> Result<(f64, bool), String>| {
            let mut sum = 0.0;
            for path in 0..PATHS {
                let (energy, balances) =
                    end(path).unwrap_or_else(|e| panic!("{}, {method}, path {path}: {e}", $name));
                assert!(balances, "{}, {method}, path {path}", $name);
                sum += energy / PATHS as f64;
            }
            let off = (sum - exact) / error;
            println!(
                "{}, {method}: H = {sum:.3} of {exact:.3}, {off:.1} errors of the mean",
                $name
            );
            assert!(off.abs() <= 4.0, "{}, {method}: {sum} instead of {exact}", $name);
        };
        let span = Span::steps(0.05, 40);
        macro_rules! by {
            ($method:expr) => {
                mean(stringify!($method), &|path| {
                    let method = NinomiyaVictoir($method).seed(8).path(path);
                    let run =
                        method.run(&system, start.clone(), span).map_err(|e| e.to_string())?;
                    Ok((
                        system.flow().energy_at(&run.last().point),
                        run.certificate().keeps_energy(),
                    ))
                });
            };
        }
        by!(DormandPrince5);
        by!(Gauss::<2>);
    }};
}

#[test]
fn noise_moves_a_state_from_the_zero_of_its_energy() {
    let half = |p: &Vector2<Real>| p.norm_squared() * 0.5;
    from_the_zero!("trap", Euclidean::<2>, vector![0.0, 0.0], half, 2.0);
    let free = |p: &Vector2<Real>| p.y * p.y * 0.5;
    from_the_zero!("free particle", Euclidean::<2>, vector![0.0, 0.0], free, 1.0);
    let ball = |p: &Vector3<Real>| p.norm_squared() * 0.5;
    from_the_zero!("ball", LieDual::so3(), vector![0.0, 0.0, 0.0], ball, 3.0);
}
