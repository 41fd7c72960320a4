//! Fields written to be recorded: the bits of a lattice stay, and certificates name what is recorded.

use metriplectic::dynamics::InNumbers;
use metriplectic::equations::Evaluation;
use metriplectic::integrators::FromEquations;
use metriplectic::prelude::*;

use crate::chain::{CANONICAL, chain, onsager, waves};

/// The chain of `models/chain.rs`, whose fields can be recorded.
fn recordable(
    graph: Graph,
) -> Lattice<impl metriplectic::lattices::Model<Manifold = Euclidean<3>>> {
    Lattice::on(graph, Euclidean::<3>)
        .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
        .energy(field!(|x: &Vector3<Real>| x.y * x.y * 0.5 + (x.z * 0.5).exp() * 2.0))
        .bond_energy(field!(|(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = y.x - x.x;
            r * r * (r * r * 0.25 + r * (0.25 / 3.0) + 0.5) - r * (x.z + y.z) * 0.025
        }))
        .entropy(field!(|x: &Vector3<Real>| x.z))
        .bond_onsager(onsager)
        .conserved(|x: &Vector3<Real>| x.y)
        .build()
        .expect("the parts make a lattice")
}

const SMALL: [(&str, usize); 3] =
    [("energy of a site", 3), ("energy of a bond", 6), ("entropy of a site", 3)];

fn names_small_fields(certificate: &Certificate) {
    let found = certificate.evaluated.iter().map(|part| (part.field, part.from));
    let expected = SMALL.map(|(name, n)| (name, Evaluation::FewVariables(n)));
    assert!(found.eq(expected), "{certificate}");
    assert!(certificate.to_string().contains("fields:      energy of a site recorded"));
}

#[test]
fn a_lattice_of_recordable_fields_has_the_bits_of_closures_on_every_graph() {
    let star = Graph::from_bonds(6, (1..6).map(|i| [i, 0]));
    let graphs = [Graph::chain(6), Graph::ring(6), Graph::square([2, 3], Boundary::Open), star];
    for graph in graphs {
        let span = Span::steps(0.05, 20);
        let (ours, closures) = (recordable(graph.clone()), chain(graph));
        let run = DormandPrince5.run(&ours, ours.points(waves), span).unwrap();
        let plain = DormandPrince5.run(&closures, closures.points(waves), span).unwrap();
        let bits = |x: &Vector3<f64>| x.map(f64::to_bits);
        assert!(run.last().point.iter().map(bits).eq(plain.last().point.iter().map(bits)));
        names_small_fields(run.certificate());
        assert!(plain.certificate().evaluated.is_empty());

        // Steps with Jacobians, and an open lattice.
        let run = Gauss::<2>.run(&ours, ours.points(waves), Span::steps(0.05, 1)).unwrap();
        names_small_fields(run.certificate());
        let open = ours.opened();
        let start = open.start(open.lattice().points(waves));
        let run = DormandPrince5.run(&open, start, Span::steps(0.05, 1)).unwrap();
        names_small_fields(run.certificate());
    }
}

#[test]
fn a_branch_in_the_energy_of_a_site_is_named_with_its_place() {
    let line = line!() + 4;
    let ring = Lattice::on(Graph::ring(3), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(field!(|x: &Vector2<Real>| {
            let kinetic = if x.y > Real::from(0.0) { x.y * x.y } else { x.y.powi(2) };
            (kinetic + x.x * x.x) * 0.5
        }))
        .build()
        .unwrap();
    let start = ring.points(|i| vector![1.0, i as f64]);
    let run = DormandPrince5.run(&ring, start, Span::steps(0.1, 2)).unwrap();
    let [energy] = run.certificate().evaluated[..] else { panic!("{}", run.certificate()) };
    let file = file!();
    assert_eq!(energy.from, Evaluation::Branches { file, line });
    let place = format!("which branches on the state at {file}:{line}");
    assert!(run.certificate().to_string().contains(&place));
}

#[test]
fn certificates_of_systems_name_what_is_recorded() {
    let space = Euclidean::<10>;
    let start = SVector::<f64, 10>::from_fn(|i, _| (1.0 + i as f64).sin());
    let energy = field!(|x: &SVector<Real, 10>| x.norm_squared() * 0.5 + x[0].powi(4));
    let system = System::on(space)
        .bracket(Symplectic)
        .energy(energy.recorded(&space, &start).unwrap())
        .build()
        .unwrap();
    let names = |certificate: &Certificate| {
        let parts = certificate.evaluated.iter().map(|part| (part.field, part.from));
        assert!(parts.eq([("energy", Evaluation::Tape)]), "{certificate}");
    };
    let span = Span::steps(0.05, 3);
    names(WeylMidpoint.run(&system, start, span).unwrap().certificate());
    names(Gauss::<2>.run(&system, start, span).unwrap().certificate());
    names(DormandPrince8.run(&system, start, span).unwrap().certificate());
    // In plain numbers, and open.
    let numbers = FromEquations(InNumbers(&system));
    let entries = start.as_slice().into();
    names(DormandPrince8.run(&numbers, entries, span).unwrap().certificate());

    // The same field without its tape, and a closure beside it.
    let system = System::on(LieDual::so3())
        .energy(field!(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5))
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let run = DormandPrince5.run(&system, vector![1.0, 2.0, 3.0], span).unwrap();
    assert!(run.certificate().to_string().contains(
        "fields:      energy recorded, with gradients by its closure, which is faster with 3 variables; entropy not recorded\n"
    ));
}
