//! Definitions and models that are refused, with the reason.

use metriplectic_dynamics::{Boltzmann, ModelError};
use metriplectic_equations::{Equations as _, Kind};
use metriplectic_integrators::{
    DormandPrince5, DormandPrince8, FromEquations, Method as _, RandomFlow, RunError, Span,
};
use metriplectic_manifolds::WeylMidpoint;
use metriplectic_recording::Recorded as Number;
use num_dual::DualNum as _;

use super::laws::tape;
use super::runs::{defined, heat, of_ring, pairs, waves};
use crate::model::{Bracket, Definition, DefinitionError, Friction, Recorded, Space};

fn flat(n: usize) -> Space {
    Space::euclidean(n).unwrap()
}

/// `x0² + 2 x1² + x2² + x0 x1 x2`.
fn bowl(x: &[Number]) -> Number {
    x[0] * x[0] + x[1] * x[1] * 2.0 + x[2] * x[2] + x[0] * x[1] * x[2]
}

/// `exp(x0) + x1 + x2³`.
fn other(x: &[Number]) -> Number {
    x[0].exp() + x[1] + x[2] * x[2] * x[2]
}

/// The law that a system on R³ breaks.
fn refusal(definition: Definition) -> ModelError {
    let system = FromEquations(Recorded::new(definition, &[]).unwrap());
    system.verify(&[0.7, -0.4, 0.5], 0.1).unwrap_err()
}

fn tensor(f: impl Fn(&[Number]) -> [Number; 9]) -> Bracket {
    let tape = tape(4, |x| f(x).to_vec());
    Bracket::Recorded { tape, is_poisson: true }
}

#[test]
fn a_tensor_that_is_not_skew_is_refused() {
    let o = Number::from(0.0);
    let bracket = tensor(move |x| [o, x[2], o, x[2] * -0.999, o, x[0], o, -x[0], o]);
    let error = refusal(defined(flat(3), bowl, None, bracket));
    assert!(matches!(error, ModelError::BracketNotSkew { .. }), "{error}");
}

#[test]
fn a_tensor_without_the_identity_of_jacobi_is_refused() {
    let broken = |is_poisson| {
        let o = Number::from(0.0);
        // Of b = (x1, x2, x0) with the curl −(1, 1, 1), which is not across it.
        let t = tape(4, move |x| vec![o, x[0], -x[2], -x[0], o, x[1], x[2], -x[1], o]);
        defined(flat(3), bowl, None, Bracket::Recorded { tape: t, is_poisson })
    };
    let error = refusal(broken(true));
    assert!(matches!(error, ModelError::NoJacobiIdentity { .. }), "{error}");
    let almost = FromEquations(Recorded::new(broken(false), &[]).unwrap());
    assert_eq!(almost.verify(&[0.7, -0.4, 0.5], 0.1), Ok(()));
}

#[test]
fn an_entropy_that_moves_is_refused() {
    let o = Number::from(0.0);
    let bracket = tensor(move |x| [o, x[2], o, -x[2], o, o, o, o, o]);
    let error = refusal(defined(flat(3), bowl, Some(&other), bracket));
    assert!(matches!(error, ModelError::EntropyNotCasimir { .. }), "{error}");
}

#[test]
fn a_friction_that_changes_the_energy_is_refused() {
    let o = Number::from(0.0);
    let constant = tape(7, move |x| {
        let r = x[0] * x[0] + 1.0;
        vec![r, o, o, o, r, o, o, o, r]
    });
    let of =
        |friction| Definition { friction, ..defined(flat(3), bowl, Some(&other), Bracket::None) };
    let error = refusal(of(Friction::Recorded(constant)));
    assert!(matches!(error, ModelError::EnergyNotKept { .. }), "{error}");
    // It falls at a negative rate.
    let contact = |sign: f64| tape(7, move |x| vec![x[0] * x[0] * sign, x[4], -x[3], 0.0.into()]);
    let error = refusal(of(Friction::Contacts(contact(-1.0))));
    assert!(matches!(error, ModelError::DissipationNotPositive { .. }), "{error}");
    let sound = Recorded::new(of(Friction::Contacts(contact(1.0))), &[]).unwrap();
    assert_eq!(FromEquations(sound).verify(&[0.7, -0.4, 0.5], 0.1), Ok(()));
    // It is not symmetric.
    let turned = tape(7, move |x| {
        let [a, b] = [x[4] * x[4], x[3] * x[4]];
        vec![a, -b, o, -b, x[3] * x[3], o, x[4] * 0.01, -(x[3] * 0.01), o]
    });
    let error = refusal(of(Friction::Recorded(turned)));
    assert!(matches!(error, ModelError::DissipationNotSymmetric { .. }), "{error}");
}

#[test]
fn an_invariant_that_is_none_is_refused() {
    let o = Number::from(0.0);
    let turns = tensor(move |x| [o, x[2], -x[1], -x[2], o, x[0], x[1], -x[0], o]);
    let square = tape(4, |x| vec![x[0] * x[0] + x[1] * x[1] + x[2] * x[2]]);
    let with = |tape| Definition {
        invariants: vec![(Kind::Casimir, tape)],
        ..defined(flat(3), bowl, None, turns.clone())
    };
    let sound = Recorded::new(with(square), &[]).unwrap();
    assert_eq!(FromEquations(sound).verify(&[0.7, -0.4, 0.5], 0.1), Ok(()));
    let error = refusal(with(tape(4, |x| vec![x[0] * x[0] + x[1] * x[1] * 1.01 + x[2] * x[2]])));
    assert!(matches!(error, ModelError::NotCasimir { .. }), "{error}");
    // The square of another one.
    let twice = Definition {
        invariants: [1, 2]
            .map(|power| {
                (
                    Kind::Casimir,
                    tape(4, move |x| vec![(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).powi(power)]),
                )
            })
            .to_vec(),
        ..defined(flat(3), bowl, None, turns)
    };
    let error = refusal(twice);
    assert!(matches!(error, ModelError::DependentInvariant { .. }), "{error}");
}

#[test]
fn a_part_in_time_runs_in_an_open_system_alone() {
    let o = Number::from(0.0);
    let still = defined(flat(2), |x| x[0] * x[0] + x[1] * x[1], None, Bracket::Canonical);
    let driven = tape(3, |x| vec![x[0] * x[0] * (x[2].sin() * 0.5 + 1.0) + x[1] * x[1]]);
    let faster = tape(3, move |x| vec![o, x[2] + 1.0, -(x[2] + 1.0), o]);
    let faster = Bracket::Recorded { tape: faster, is_poisson: true };
    for definition in [
        Definition { energy: driven, ..still.clone() },
        Definition { bracket: faster, ..still.clone() },
    ] {
        let system = Recorded::new(definition, &[]).unwrap();
        assert!(system.energy_depends_on_time());
        let closed = FromEquations(system.clone());
        let run = DormandPrince8.run(&closed, vec![0.3, 0.4].into(), Span::steps(0.1, 10));
        assert!(matches!(run, Err(RunError::Model(ModelError::EnergyInTime))));
        let open = FromEquations(system).opened();
        let start = open.start(vec![0.3, 0.4]);
        for run in [
            DormandPrince8.run(&open, start.clone(), Span::steps(0.05, 40)),
            WeylMidpoint.run(&open, start.clone(), Span::steps(0.05, 40)),
        ] {
            let run = run.unwrap();
            let (end, ledger) = (&run.last().point, &run.last().point.ledger);
            let gained = open.energy_at(end) - open.energy_at(&start);
            assert!((gained - ledger.parameter_work()).abs() < 1e-14, "{gained}");
        }
    }
    // With q' = 2p (1 + t) and p' = −2q (1 + t) the angle is 2(t + t²/2).
    let faster = tape(3, move |x| vec![o, x[2] + 1.0, -(x[2] + 1.0), o]);
    let bracket = Bracket::Recorded { tape: faster, is_poisson: true };
    let open = FromEquations(Recorded::new(Definition { bracket, ..still }, &[]).unwrap()).opened();
    let start = open.start(vec![0.5, 0.0]);
    let run = DormandPrince8.run(&open, start, Span::steps(0.02, 50)).unwrap();
    let (x, angle) = (&run.last().point.x, 3.0_f64);
    assert!((x[0] - 0.5 * angle.cos()).abs() < 1e-12 && (x[1] + 0.5 * angle.sin()).abs() < 1e-12);
}

#[test]
fn contacts_have_thermal_noise() {
    // A momentum with a bath of heat, p' = −p γ T⁻¹…, and its contact b = (−T, p).
    let energy = |x: &[Number]| x[0] * x[0] * 0.5 + x[1];
    let entropy = |x: &[Number]| x[1].ln() * 3.0;
    let contact = tape(5, |x| vec![x[1] * 0.2, -x[3], x[2]]);
    let of = |friction| {
        let definition = defined(flat(2), energy, Some(&entropy), Bracket::None);
        Recorded::new(Definition { friction, ..definition }, &[]).unwrap()
    };
    let run = |system: Recorded| {
        let noisy = FromEquations(system).with_noise(Boltzmann(0.01));
        RandomFlow(DormandPrince5).seed(3).run(&noisy, vec![0.3, 1.0].into(), Span::steps(0.01, 20))
    };
    for system in [of(Friction::Contacts(contact)), of(Friction::Metric { factor: None })] {
        assert!(system.has_terms());
        let run = run(system).unwrap();
        assert!(run.certificate().max_relative_energy_error() < 1e-13);
        assert!((run.last().point[0] - 0.3).abs() > 1e-4);
    }
    // A matrix is not a sum of terms.
    let matrix = tape(5, |x| {
        let r = x[1] * 0.2;
        vec![x[3] * x[3] * r, -(x[2] * x[3] * r), -(x[2] * x[3] * r), x[2] * x[2] * r]
    });
    let system = of(Friction::Recorded(matrix));
    assert!(!system.has_terms());
    assert!(run(system).is_err());
}

#[test]
fn definitions_that_make_no_system_say_why() {
    let refused = |definition: Definition| Recorded::new(definition, &[]).unwrap_err();
    let ring = || defined(flat(6), of_ring, Some(&heat), Bracket::Constant(pairs(2)));
    assert!(Recorded::new(ring(), &[]).is_ok());
    let error = Recorded::new(ring(), &[1.0]).unwrap_err();
    assert_eq!(error, DefinitionError::Parameters { found: 1, expected: 0 });
    let named = Definition { parameters: vec!["k".into()], ..ring() };
    let error = Recorded::new(named, &[f64::NAN]).unwrap_err();
    assert!(matches!(error, DefinitionError::ParameterNotFinite { name, .. } if name == "k"));
    let error = refused(Definition { energy: tape(6, |x| vec![x[0]]), ..ring() });
    assert!(matches!(error, DefinitionError::Shape { part: "energy", expected_inputs: 7, .. }));
    let error = refused(Definition { entropy: Some(tape(7, |x| vec![x[0] + x[6]])), ..ring() });
    assert_eq!(error, DefinitionError::InTime { part: "entropy" });
    let friction = Friction::Contacts(tape(13, |x| vec![x[0]; 8]));
    let error = refused(Definition { friction, ..ring() });
    assert_eq!(error, DefinitionError::Contacts { outputs: 8, velocities: 6 });
    assert_eq!(
        refused(Definition { entropy: None, ..ring() }),
        DefinitionError::FrictionWithoutEntropy
    );
    let mut bent = pairs(2);
    bent[2] = 1.5;
    let error = refused(Definition { bracket: Bracket::Constant(bent), ..ring() });
    assert!(matches!(error, DefinitionError::TensorNotSkew { size, .. } if size == 0.5), "{error}");
    for bracket in [Bracket::LiePoisson, Bracket::AreaForm] {
        let error = refused(Definition { bracket, ..ring() });
        assert!(matches!(error, DefinitionError::Bracket { .. }), "{error}");
    }
    let error = refused(Definition { bracket: Bracket::Sum(vec![Bracket::None; 3]), ..ring() });
    assert!(matches!(error, DefinitionError::Blocks { found: 3, expected: 1, .. }));
    let sphere = defined(Space::sphere(2).unwrap(), bowl, None, Bracket::Canonical);
    assert!(matches!(refused(sphere), DefinitionError::Bracket { .. }));
    let metric = Some(tape(4, |x| vec![x[0]; 4]));
    let sphere = defined(Space::sphere(2).unwrap(), bowl, None, Bracket::None);
    assert!(matches!(refused(Definition { metric, ..sphere }), DefinitionError::Metric { .. }));
    assert!(matches!(Space::sphere(8), Err(DefinitionError::Sphere { n: 8 })));
    assert!(matches!(Space::euclidean(0), Err(DefinitionError::NoVariables)));
    assert!(Space::lie_dual(2, &[(0, 1, 1, 1.0), (1, 0, 1, -1.0)]).is_ok());
    assert!(matches!(Space::lie_dual(2, &[(0, 1, 1, 1.0)]), Err(DefinitionError::Algebra(_))));
    let start = Recorded::new(ring(), &[]).unwrap().check(&[f64::NAN; 6]);
    assert!(start.is_err() && waves(6).len() == 6);
}
