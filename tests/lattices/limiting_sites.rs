//! The sites that set the steps, as the certificate names them.

use super::*;

#[test]
fn the_certificate_names_the_stiff_bond_in_every_unit() {
    // One bond conducts a hundred times better; in units of its own, and copper in cells of 1 mm and 1 cm².
    let copper = [385.0 * 8960.0 * 1e-7, 401.0 * 1e-1, 300.0];
    let (n, stiff) = (3000, 1234);
    for parameters @ [c, kappa, _] in [[1.0, 1.0, 1.0], copper] {
        let of = |i| if i == stiff { 100.0 * kappa } else { kappa };
        let lattice = conduction::of_bonds(c, (0..n).map(of).collect(), Arc::default());
        let start = lattice.points(|i| conduction::at([n, i], 2.0, parameters, 0.0));
        let span = || Span::until(1.5 * c / kappa).tolerance(1e-4).at_most(2);
        let ends = [stiff, stiff + 1];
        let explicit = DormandPrince8.run(&lattice, start.clone(), span()).unwrap();
        let certificate = explicit.certificate();
        println!("{certificate}");
        assert!(certificate.is_limited_by_stability());
        let site = certificate.limiting_sites.stiffness.expect("a stiff site");
        assert!(ends.contains(&site), "{site}");
        assert!(
            certificate.to_string().contains(&format!("at site {site}, and not the tolerance"))
        );

        let whole = RungeKuttaChebyshev.run(&lattice, start.clone(), span()).unwrap();
        let site = whole.certificate().limiting_sites.stiffness.expect("a stiff site");
        println!("{}", whole.certificate());
        assert!(ends.contains(&site), "{site}");
        assert!(whole.certificate().to_string().contains(&format!("is stiffest at site {site}")));
        // The direction in which the motion is stiff is part of a checkpoint, and so are the sites.
        let mut steps = RungeKuttaChebyshev.steps(&lattice, start, span()).unwrap();
        for _ in 0..7 {
            steps.advance().unwrap();
        }
        let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
        let resumed = RungeKuttaChebyshev.resume(&lattice, &checkpoint).unwrap().run().unwrap();
        assert_eq!(resumed.certificate(), whole.certificate());
    }
}

#[test]
fn every_changed_digit_of_a_checkpoint_of_a_lattice_is_refused() {
    let lattice = conduction::of_bonds(1.0, vec![1.0; 4], Arc::default());
    let start = lattice.points(|i| conduction::at([4, i], 1.0, [1.0; 3], 0.0));
    let span = || Span::until(1.5).tolerance(1e-4);
    refuses_changed_digits(RungeKuttaChebyshev, &lattice, start.clone(), span());
    refuses_changed_digits(DormandPrince8, &lattice, start.clone(), span());
    refuses_changed_digits(DormandPrince5, &lattice, start, Span::steps(0.01, 10));
}

#[test]
fn the_certificate_names_the_site_of_a_pulse() {
    let (n, pushed) = (4000, 1717);
    let lattice = chain(Graph::ring(n));
    let start = lattice.points(|i| vector![0.0, if i == pushed { 0.5 } else { 0.0 }, 0.0]);
    let span = Span::until(3.0).tolerance(1e-8).at_most(2);
    let run = DormandPrince5.run(&lattice, start, span).unwrap();
    let (certificate, text) = (run.certificate(), run.certificate().to_string());
    println!("{text}");
    // Sound moves by one site in a unit of time.
    let site = certificate.limiting_sites.error.expect("a site");
    assert!(site.abs_diff(pushed) <= 4, "{site}");
    assert!(text.contains(&format!("the largest error is at site {site}\n")), "{text}");
    assert!(!certificate.is_limited_by_stability() && !text.contains("stiffest"), "{text}");
}
