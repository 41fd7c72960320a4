//! A retraction is a method wherever one is asked for: in samplers, tangents and adjoints.

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
