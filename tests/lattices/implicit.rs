//! Implicit steps of lattices of some tens of sites.

use metriplectic::integrators::{ItohAbe, NoImplicitSteps, Schedule, Stepper, SymmetricItohAbe};
use metriplectic::prelude::*;

use super::order;
use crate::chain::{chain, waves};

/// The states of the chain.
type Sites = metriplectic::lattices::Sites<Euclidean<3>>;

/// The largest distance of entries of two states.
fn distance(x: &Points<Euclidean<3>>, y: &Points<Euclidean<3>>) -> f64 {
    x.iter().zip(y.iter()).map(|(x, y)| (x - y).amax()).fold(0.0, f64::max)
}

#[test]
fn implicit_methods_of_a_chain_have_their_orders_and_both_laws() {
    let lattice = chain(Graph::ring(8));
    let start = lattice.points(waves);
    let tight = Span::until(1.0).tolerance(1e-12).at_most(2);
    let exact = DormandPrince8.run(&lattice, start.clone(), tight).unwrap();
    let exact = &exact.last().point;
    let check = |name: &str, steps: [usize; 4], expected: f64, run: &dyn Fn(Schedule) -> _| {
        let errors = steps.map(|steps| {
            let run: Trajectory<Sites> = run(Span::steps(1.0 / steps as f64, steps).into());
            let certificate = run.certificate();
            assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
            assert!(certificate.invariants[0].max_error < 1e-14, "{certificate}");
            distance(&run.last().point, exact)
        });
        let found = order(&steps, &errors);
        println!("{name}: {found:.2} from {errors:?}");
        assert!((found - expected).abs() < 0.25, "{name} has order {found}: {errors:?}");
    };
    let whole = |schedule| WeylMidpoint.run(&lattice, start.clone(), schedule).unwrap();
    check("the midpoint scheme", [10, 20, 40, 80], 2.0, &whole);
    let mean = Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe);
    let whole = |schedule| mean.run(&lattice, start.clone(), schedule).unwrap();
    check("symmetric increments", [10, 20, 40, 80], 2.0, &whole);
    let one = Scheme::new(Exponential).gradient(ItohAbe);
    let whole = |schedule| one.run(&lattice, start.clone(), schedule).unwrap();
    check("increments", [20, 40, 80, 160], 1.0, &whole);
    let whole = |schedule| Gauss::<2>.run(&lattice, start.clone(), schedule).unwrap();
    check("Gauss", [4, 8, 16, 32], 4.0, &whole);
    let whole = |schedule| Radau::<2>.run(&lattice, start.clone(), schedule).unwrap();
    check("Radau", [8, 16, 32, 64], 3.0, &whole);
}

#[test]
fn radau_damps_conduction_that_is_far_faster_than_a_step() {
    // Bodies of the heat capacity 1, whose bonds conduct within nanoseconds: one step leads to the mean temperature.
    let rod = Lattice::on(Graph::chain(20), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: 1e9 * u * v, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()
        .unwrap();
    let start = rod.points(|i| vector![300.0 + i as f64]);
    let run = Radau::<3>.run(&rod, start.clone(), Span::steps(1.0, 5)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    let off = run.last().point.iter().map(|u| (u.x - 309.5).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off:.1e}");
    // With outputs and a checkpoint, of a method that follows a tolerance.
    let span = || Span::until(1e-7).tolerance(1e-8).output_every(2e-8);
    let whole = Radau::<3>.run(&rod, start.clone(), span()).unwrap();
    let mut steps = Radau::<3>.steps(&rod, start, span()).unwrap();
    steps.advance().unwrap();
    let checkpoint = steps.checkpoint();
    let resumed = Radau::<3>.resume(&rod, &checkpoint).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert!(whole.states().windows(2).all(|s| s[0].entropy <= s[1].entropy));
}

#[test]
fn a_lattice_without_implicit_steps_says_which_method_to_take() {
    let long = chain(Graph::ring(400));
    let start = long.points(waves);
    let refusal = |error: RunError<_>| match error {
        RunError::Method(error) => *error.downcast_ref::<NoImplicitSteps>().unwrap(),
        error => panic!("{error}"),
    };
    let found = Gauss::<2>.run(&long, start, Span::steps(0.1, 1)).unwrap_err();
    assert_eq!(refusal(found), NoImplicitSteps::Variables { variables: 1200 });
    // So does a path with noise, and a run that is taken up again.
    let noisy = chain(Graph::ring(400)).with_noise(Boltzmann(1e-6));
    let start = noisy.flow().points(waves);
    let found = RandomFlow(WeylMidpoint).seed(1).run(&noisy, start, Span::steps(0.1, 1));
    let Err(RunError::Method(error)) = found else { panic!("it has a step") };
    assert_eq!(error.downcast_ref(), Some(&NoImplicitSteps::Variables { variables: 1200 }));
    let short = chain(Graph::ring(8));
    let steps = WeylMidpoint.steps(&short, short.points(waves), Span::steps(0.1, 2)).unwrap();
    let Err(error) = WeylMidpoint.resume(&long, &steps.checkpoint()) else {
        panic!("it goes on with another lattice")
    };
    assert_eq!(error.to_string(), NoImplicitSteps::Variables { variables: 1200 }.to_string());
    let shorter = chain(Graph::ring(320));
    assert!(Stepper::serves(&Gauss::<2>, &shorter).is_ok());
    assert!(
        NoImplicitSteps::Variables { variables: 1200 }.to_string().contains("RungeKuttaChebyshev")
    );
}
