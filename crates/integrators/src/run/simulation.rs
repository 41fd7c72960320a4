//! A system with a method of it, behind a pointer.

use std::fmt;

use metriplectic_dynamics::ModelError;

use crate::run::error::RunError;
use crate::run::plain::{Outcome, WholeInNumbers, without_panics};
use crate::run::schedule::Schedule;
use crate::run::trajectory::Trajectory;
use crate::step::{Listed, PlainNumbers, Stepper};

/// A system with a method of it: a type that a struct can name, whatever the closures are.
///
/// It has all kinds: closed systems, members of families, open systems, systems with noise, lattices, and
/// [your own](crate::FromEquations), with every method that runs them. States are [`Entries`](crate::Entries), slices of numbers in the order
/// in which a point is written. Those of an open system have the time and the entries of its ledger after the point; a start may
/// leave them out. The functions of events and of [observables](crate::Observables) take `&Entries` then. The run is that of
/// [`Method::run`](crate::Method::run), with its bits.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Simulation, Span};
/// use metriplectic_manifolds::{LieDual, Sphere, WeylMidpoint};
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// struct Case {
///     simulation: Simulation,
///     start: Vec<f64>,
/// }
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()?;
/// let spin = System::on(Sphere::<2>::round())
///     .energy(|n: &Vector3<Real>| n.x * n.x * 0.5)
///     .entropy(|n: &Vector3<Real>| n.z)
///     .build()?;
/// let cases = [
///     Case { simulation: Simulation::new(DormandPrince8, body), start: vec![0.4, 0.5, 0.3] },
///     Case { simulation: Simulation::new(WeylMidpoint, spin), start: vec![0.6, 0.0, 0.8] },
/// ];
/// for Case { simulation, start } in &cases {
///     let run = simulation.run(start, Span::steps(0.1, 100))?;
///     assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// }
/// # Ok(())
/// # }
/// ```
pub struct Simulation {
    method: String,
    run: Box<dyn Runs>,
}

/// Runs from a start over a schedule.
trait Runs: Fn(&[f64], Schedule) -> Outcome + Send + Sync {}

impl<R: Fn(&[f64], Schedule) -> Outcome + Send + Sync> Runs for R {}

impl fmt::Debug for Simulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Simulation").field("method", &self.method).finish_non_exhaustive()
    }
}

impl Simulation {
    /// Puts a system and a method of it behind a pointer.
    pub fn new<F, M>(method: M, system: F) -> Self
    where
        F: Listed + Send + Sync + 'static,
        M: Stepper<F> + Clone + Send + Sync + 'static,
    {
        let name = method.name();
        let run = move |start: &[f64], schedule| {
            let run = || {
                let x0 = system.at_start(start).map_err(ModelError::Start)?;
                let method = method.clone();
                system.visit(WholeInNumbers { method, x0, schedule })
            };
            if const { F::CATCHES_PANICS } { without_panics(run) } else { run() }
        };
        Self { method: name, run: Box::new(run) }
    }

    /// Returns the name of the method, as checkpoints have it.
    pub fn method(&self) -> &str {
        &self.method
    }

    /// Verifies the model, runs it over a [`Span`](crate::Span) or [`Until`](crate::Until), and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    pub fn run(
        &self,
        start: &[f64],
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<PlainNumbers>, RunError<PlainNumbers>> {
        (self.run)(start, schedule.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{NoiseBuilder as _, RandomFlow};
    use crate::open::OpenBuilder as _;
    use crate::step::{Element, Entries};
    use crate::{DormandPrince5, DormandPrince8, FromEquations, Gauss, Method, Span, Watch as _};
    use metriplectic_dynamics::{Bath, Boltzmann, InNumbers, Metriplectic, System};
    use metriplectic_equations::Equations;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{LieDual, Manifold as _, PointError, Sphere, WeylMidpoint};
    use nalgebra::{Vector3, vector};
    use num_dual::DualNum as _;

    const START: Vector3<f64> = vector![0.4, -1.0, 0.3];

    macro_rules! body {
        ($(.$name:ident($($part:expr),*))*) => {
            System::on(LieDual::so3())
                .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
                .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
                $(.$name($($part),*))*
                .build()
                .unwrap()
        };
    }

    fn bits(x: &[f64]) -> Vec<u64> {
        x.iter().map(|x| x.to_bits()).collect()
    }

    /// The entries of a state.
    fn written<F: Listed>(flow: &F, x: impl Fn(&F) -> Element<F>) -> Entries {
        F::write(&x(flow))
    }

    /// A case of a study.
    struct Case {
        simulation: Simulation,
        start: Vec<f64>,
        /// The last state of the run in types, and its certificate.
        end: (Vec<u64>, String),
    }

    /// A system with a method, and the run of both in types.
    fn case<F, M>(method: M, system: F, x0: Element<F>, start: &[f64], span: Span) -> Case
    where
        F: Listed + Send + Sync + 'static,
        M: Stepper<F> + Clone + Send + Sync + 'static,
    {
        let run = method.clone().run(&system, x0, span).unwrap();
        let end = (bits(&F::write(&run.last().point)), run.certificate().to_string());
        Case { simulation: Simulation::new(method, system), start: start.to_vec(), end }
    }

    #[test]
    fn systems_of_all_kinds_run_from_a_struct_with_the_bits_of_their_types() {
        let span = || Span::steps(0.1, 30);
        let sphere = System::on(Sphere::<2>::round())
            .energy(|n: &Vector3<Real>| n.x * n.x * 0.5)
            .entropy(|n: &Vector3<Real>| n.z)
            .build()
            .unwrap();
        // A torque about the third axis keeps |p|.
        let push = |t: Real, p: &Vector3<Real>| Vector3::new(-p.y, p.x, 0.0.into()) * t.sin();
        let open = || body!(.work("push", push).bath("air", Bath::at(1.0).isotropic(0.1)));
        let (point, pole) = (START.as_slice(), vector![0.6, 0.0, 0.8]);
        let booked = written(&open(), |open| open.start(START));
        let with_noise = body!(.noise(Boltzmann(0.01)));
        let noisy = RandomFlow(DormandPrince5).seed(7);
        let own: Box<dyn Equations + Send + Sync> = Box::new(Own(body!()));
        let cases = [
            case(DormandPrince8, body!(), START, point, span()),
            case(WeylMidpoint, body!(), START, point, span()),
            case(Gauss::<2>, sphere, pole, pole.as_slice(), span()),
            case(DormandPrince8, open(), open().start(START), point, span()),
            case(WeylMidpoint, open(), open().start(START), &booked, span()),
            case(noisy, with_noise, START, point, span()),
            case(DormandPrince8, FromEquations(own), START.as_slice().into(), point, span()),
        ];
        for (k, Case { simulation, start, end }) in cases.iter().enumerate() {
            let run = simulation.run(start, span()).unwrap();
            assert_eq!(bits(&run.last().point), end.0, "{k}: {simulation:?}");
            assert_eq!(run.certificate().to_string(), end.1, "{k}: {simulation:?}");
        }
    }

    /// A closed system as one of one's own.
    struct Own<Y>(Y);

    impl<Y: Metriplectic> Equations for Own<Y> {
        fn sizes(&self) -> metriplectic_equations::Sizes {
            InNumbers(&self.0).sizes()
        }

        fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
            InNumbers(&self.0).values(t, x, values);
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            InNumbers(&self.0).differentials(t, x, values, w);
        }

        fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            InNumbers(&self.0).velocity(t, x, v)
        }
    }

    #[test]
    fn a_panic_in_a_system_is_an_error_of_its_run() {
        /// A system that panics where its start is checked.
        struct Panics;

        impl Equations for Panics {
            fn sizes(&self) -> metriplectic_equations::Sizes {
                metriplectic_equations::Sizes { entries: 1, directions: 1, laws: 2 }
            }

            fn values(&self, _: f64, _: &[f64], _: &mut [f64]) {}

            fn differentials(&self, _: f64, _: &[f64], _: &mut [f64], _: &mut [f64]) {}

            fn velocity(&self, _: f64, _: &[f64], _: &mut [f64]) -> Option<f64> {
                None
            }

            fn check(&self, _: &[f64]) -> Result<(), PointError> {
                panic!("it has no states")
            }
        }
        let simulation = Simulation::new(DormandPrince8, FromEquations(Panics));
        let Err(RunError::Flow(error)) = simulation.run(&[1.0], Span::steps(0.1, 1)) else {
            panic!("it has no error of its own")
        };
        assert_eq!(error.to_string(), "it has panicked: it has no states");
    }

    #[test]
    fn events_are_asked_in_numbers_and_a_bad_start_is_refused() {
        let simulation = Simulation::new(DormandPrince8, body!());
        let schedule = Span::until(5.0).tolerance(1e-8);
        let events = schedule.event("x = 0.45", |x: &Entries| x[0] - 0.45);
        let run = simulation.run(START.as_slice(), events).unwrap();
        let typed = schedule.event("x = 0.45", |p: &Vector3<f64>| p.x - 0.45);
        let of_types = DormandPrince8.run(&body!(), START, typed).unwrap();
        assert!(!run.events().is_empty() && run.events().len() == of_types.events().len());
        for (a, b) in run.events().iter().zip(of_types.events()) {
            let there = LieDual::<3>::entries(&b.state.point);
            assert_eq!(bits(&a.state.point), bits(&there));
        }
        let refusal = |start: &[f64]| match simulation.run(start, schedule) {
            Err(RunError::Model(ModelError::Start(cause))) => cause,
            other => panic!("{other:?}"),
        };
        assert_eq!(refusal(&[0.4, 1.0]), PointError::Length { found: 2, expected: 3 });
        assert!(matches!(refusal(&[0.4, f64::NAN, 0.0]), PointError::NotFinite { index: 1, .. }));
        let open = body!(.bath("air", Bath::at(1.0).isotropic(0.1)));
        let open = Simulation::new(DormandPrince8, open);
        for length in [2, 4, 17, 19] {
            let refused = open.run(&vec![0.1; length], schedule);
            assert!(matches!(refused, Err(RunError::Model(ModelError::Start(_)))), "{length}");
        }
    }
}
