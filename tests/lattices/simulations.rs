//! Lattices behind a pointer: `Simulation` is one type for all of their kinds too.

use metriplectic::integrators::{Entries, Listed, PlainNumbers, Simulation};
use metriplectic::lattices::{Model, SiteState};
use metriplectic::manifolds::PointError;
use metriplectic::prelude::*;

/// A rod whose bonds conduct.
fn rod() -> Lattice<impl Model<Manifold = Euclidean<1>>> {
    Lattice::on(Graph::chain(6), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
        })
        .build()
        .expect("a lattice")
}

/// The entries of the states and the certificate.
fn outcome(run: &Trajectory<PlainNumbers>) -> (Vec<Vec<f64>>, String) {
    let states = run.states().iter().map(|state| state.point.to_vec());
    (states.collect(), run.certificate().to_string())
}

#[test]
fn lattices_of_all_kinds_run_from_a_struct_with_the_bits_of_their_types() {
    let energies: Vec<f64> = (0..6).map(|i| 1.0 + 0.2 * f64::from(i)).collect();
    let points = |lattice: &Lattice<_>| lattice.points(|i| vector![energies[i]]);
    let span = || Span::steps(0.05, 20);
    let opened = || {
        rod().opened().bath("oven", 2.0, [0], |_, at: &SiteState<'_, Euclidean<1>>| {
            [Onsager { rate: at.x.x, b: vector![1.0] }]
        })
    };
    let noisy = || rod().with_noise(Boltzmann(0.01));
    let random = RandomFlow(DormandPrince5).seed(3);
    let cases = [
        (
            Simulation::new(DormandPrince8, rod()),
            typed(DormandPrince8, &rod(), points(&rod()), span()),
        ),
        (Simulation::new(Gauss::<2>, rod()), typed(Gauss::<2>, &rod(), points(&rod()), span())),
        (
            Simulation::new(DormandPrince5, opened()),
            typed(DormandPrince5, &opened(), opened().start(points(&rod())), span()),
        ),
        (Simulation::new(random, noisy()), typed(random, &noisy(), points(&rod()), span())),
    ];
    for (simulation, expected) in &cases {
        let run = simulation.run(&energies, span()).unwrap();
        assert_eq!(&outcome(&run), expected, "{simulation:?}");
    }
    // Events and jumps are asked in plain numbers: where the first site comes to 1.2.
    let simulation = &cases[0].0;
    let watched = Span::until(4.0)
        .tolerance(1e-8)
        .event("1.2", |u: &Entries| u[0] - 1.2)
        .jump(|_, u: &Entries| u.iter().map(|u| u * 1.0).collect());
    let run = simulation.run(&energies, watched).unwrap();
    let typed = Span::until(4.0)
        .tolerance(1e-8)
        .event("1.2", |u: &Points<Euclidean<1>>| u[0].x - 1.2)
        .jump(|_, u: &Points<Euclidean<1>>| u.clone());
    let typed = DormandPrince8.run(&rod(), points(&rod()), typed).unwrap();
    assert_eq!(run.events().len(), 1);
    let site = |entries: &[f64]| entries[0].to_bits();
    assert_eq!(site(&run.events()[0].state.point), typed.events()[0].state.point[0].x.to_bits());
    // A start of another length is refused.
    assert!(matches!(
        simulation.run(&energies[1..], span()),
        Err(RunError::Model(ModelError::Start(PointError::Length { found: 5, expected: 6 })))
    ));
}

/// The outcome of a run in types.
fn typed<F: Listed, N: Method<F>>(
    method: N,
    lattice: &F,
    start: metriplectic::integrators::Element<F>,
    span: Span,
) -> (Vec<Vec<f64>>, String) {
    let run = method.run(lattice, start, span).expect("a run");
    let states = run.states().iter().map(|state| F::write(&state.point).to_vec());
    (states.collect(), run.certificate().to_string())
}
