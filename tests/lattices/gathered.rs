//! Energies and entropies that depend on a sum over the neighbours of a site.

use super::*;

#[test]
fn embedded_atoms_have_both_laws_and_the_order_of_the_method() {
    // Bonds across chunks, so that sums of neighbours cross them too.
    let n = 2080;
    let lattice = embedded_atoms::lattice(n);
    let start = lattice.points(waves);
    let end = |steps: usize| {
        let span = Span::steps(2.0 / steps as f64, steps).every(steps);
        let run = DormandPrince5.run(&lattice, start.clone(), span).unwrap();
        let certificate = run.certificate();
        // Each site has terms of about 2 and −1.6.
        let bound = 4.0 * f64::EPSILON * 3.6 * n as f64;
        assert!(certificate.max_energy_error <= bound, "{certificate}");
        assert!(certificate.keeps_entropy() && certificate.keeps_invariants());
        run.last().point.clone()
    };
    let span = Span::until(2.0).tolerance(1e-13).at_most(2);
    let exact = DormandPrince8.run(&lattice, start.clone(), span).unwrap().last().point.clone();
    let steps = [40, 57, 80, 113];
    let errors = steps.map(|steps| distance(&end(steps), &exact));
    let order = order(&steps, &errors);
    println!("order {order:.2}: {errors:?}");
    assert!(order > 4.7 && order < 5.5, "{errors:?}");
}

#[test]
fn an_entropy_of_neighbours_has_both_laws_and_the_order_of_the_method_in_every_unit() {
    // Bonds across chunks; in units of one, and of an electron volt and the constant of Boltzmann.
    let n = 2080;
    let runs = [[1.0, 1.0], [1.602_176_634e-19, 1.380_649e-23]].map(|[joule, boltzmann]| {
        let lattice = warm_neighbours::lattice(n, [joule, boltzmann]);
        let start = lattice.points(|i| warm_neighbours::at(i, joule));
        let in_units = |x: &Vector3<f64>| vector![x.x, x.y / joule, x.z / joule];
        // The motion is the sum of terms by hand.
        let v = lattice.rates(&start, &lattice.sizes(&start).zero()).unwrap();
        let x: Vec<_> = start.iter().map(in_units).collect();
        let off = warm_neighbours::velocity(&x).into_iter().enumerate().map(|(i, by_hand)| {
            let v = in_units(&vector![v.get(3 * i), v.get(3 * i + 1), v.get(3 * i + 2)]);
            (v - by_hand).amax()
        });
        let off = off.fold(0.0, f64::max);
        assert!(off < 64.0 * f64::EPSILON, "{off:.1e}");
        let end = |steps: usize| {
            let span = Span::steps(2.0 / steps as f64, steps).every(steps);
            let run = DormandPrince5.run(&lattice, start.clone(), span).unwrap();
            let certificate = run.certificate();
            // All terms of this energy are positive.
            let bound = 4.0 * f64::EPSILON * certificate.initial_energy;
            assert!(certificate.max_energy_error <= bound, "{certificate}");
            assert!(certificate.keeps_entropy() && certificate.keeps_invariants());
            assert!(certificate.projected_steps.targeted == steps, "{certificate}");
            assert!(certificate.entropy_gained > boltzmann);
            run.last().point.clone()
        };
        let span = Span::until(2.0).tolerance(1e-13).at_most(2);
        let exact = DormandPrince8.run(&lattice, start.clone(), span).unwrap().last().point.clone();
        let steps = [40, 57, 80, 113];
        let errors = steps.map(|steps| {
            let off = |(x, y): (&Vector3<f64>, &Vector3<f64>)| in_units(&(x - y)).amax();
            end(steps).iter().zip(exact.iter()).map(off).fold(0.0, f64::max)
        });
        let order = order(&steps, &errors);
        println!("order {order:.2}: {errors:?}");
        assert!(order > 4.7 && order < 5.5, "{errors:?}");
        errors[0]
    });
    // Up to some roundings of entries of about one.
    let off = (runs[0] - runs[1]).abs();
    assert!(off < 64.0 * f64::EPSILON, "the error has no unit: {runs:?}");
}
