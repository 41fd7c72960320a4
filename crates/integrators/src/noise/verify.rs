//! The verification of a system with noise: the laws of its model, and those that make `exp(S/k_B) μ` its law.

use std::fmt;

use metriplectic_dynamics::Report;

use super::error::{NoiseError, NoisyError};
use super::fluctuating::Fluctuating;
use super::judged::Judged;
use super::system::Noisy;
use crate::step::Element;

/// The report of a system with noise; see [`Noisy::report`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NoisyReport<R = Report> {
    /// The residual of every law of the model, and its verdict.
    pub model: R,
    /// The verdict of the noise. `None` where the model breaks a law, so that there is no law to sample.
    pub noise: Option<Result<(), NoiseError>>,
}

impl<R: fmt::Display> fmt::Display for NoisyReport<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.model)?;
        match &self.noise {
            Some(Ok(())) => write!(f, "noise: its law is exp(S/k_B)"),
            Some(Err(error)) => write!(f, "noise: {error}"),
            None => write!(f, "noise: not judged, because the model breaks a law"),
        }
    }
}

impl<F: Judged + Fluctuating<U>, U> Noisy<F, U> {
    /// Checks the laws of the model around a state, with those of its surroundings if it has any, and then what makes
    /// `exp(S/k_B) μ` the law of the noise: Boltzmann's constant, the terms, the kinetic drift and the measure. A run does
    /// this first, with a radius of 0.1, or of 0.01 if it is a lattice.
    ///
    /// # Errors
    ///
    /// [`NoisyError::Model`] that names the law, the state and the size of the violation, and [`NoisyError::Noise`] if the
    /// model is sound and its noise has another law.
    pub fn verify(&self, x0: &Element<F>, radius: f64) -> Result<(), NoisyError<F::Broken>> {
        self.flow().verify_model(x0, radius).map_err(NoisyError::Model)?;
        Ok(self.examine_law(x0)?)
    }

    /// Lists the residual of every law of the model around a state, with the verdict of its noise there. Read it when a new
    /// model misbehaves.
    pub fn report(&self, x0: &Element<F>) -> NoisyReport<F::Report> {
        let model = self.flow().report_model(x0);
        let noise = F::is_sound(&model).then(|| self.examine_law(x0));
        NoisyReport { model, noise }
    }

    /// Verifies the model and its noise around a state, and returns the system with this certificate. A run of it, from any
    /// start, checks the laws of the model at that start without samples around it, and the law of the noise as before,
    /// which may hold at some starts alone. Use it for a study of many paths.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x0: &Element<F>) -> Result<Self, NoisyError<F::Broken>> {
        self.verify(x0, F::radius())?;
        Ok(self.with_certificate())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Noise, NoiseBuilder as _, RandomFlow};
    use crate::open::OpenBuilder as _;
    use crate::step::Flow;
    use crate::{DormandPrince5, Error, Method as _, RunError, Span, StepError, Trajectory};
    use metriplectic_dynamics::noise::Uniform;
    use metriplectic_dynamics::{
        Bath, Boltzmann, ModelError, Poisson, Symplectic, System, Verify as _, Zero,
    };
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Euclidean, LieDual, Product, Sphere};
    use nalgebra::{Matrix3, Vector1, Vector2, Vector3, vector};
    use num_dual::DualNum as _;

    const START: Vector3<f64> = vector![0.4, -1.0, 0.3];
    /// Values that Boltzmann's constant must not have.
    const NOT_POSITIVE: [f64; 4] = [-1.0, 0.0, f64::NAN, f64::INFINITY];

    /// A rigid body with friction.
    macro_rules! body {
        ($k_b:expr) => {
            System::on(LieDual::so3())
                .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
                .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
                .noise(Boltzmann($k_b))
                .build()
                .unwrap()
        };
    }

    /// A pushed oscillator in air with an internal energy, of which the port carries a part.
    macro_rules! oscillator {
        ($carried:expr, $k_b:expr) => {
            System::on(Product(Euclidean::<2>, Euclidean::<1>))
                .bracket((Symplectic, Zero))
                .energy_in_time(|t: Real, (x, s): &(Vector2<Real>, Vector1<Real>)| {
                    x.norm_squared() * 0.5 + x.x * t.sin() + s.x
                })
                .entropy(|(_, s): &(Vector2<Real>, Vector1<Real>)| s.x)
                .work("push", |t: Real, _: &(Vector2<Real>, Vector1<Real>)| {
                    Vector3::new(Real::from(0.0), t.cos(), Real::from($carried))
                })
                .bath("air", Bath::at(1.0).isotropic(0.1))
                .noise(Boltzmann($k_b))
                .build()
                .unwrap()
        };
    }

    /// A system on whose motion `b(y)` no law of the model depends, and whose entropy is a Casimir where `x < 2` alone.
    macro_rules! bent {
        ($b:expr $(, $name:ident($($part:expr),*))*) => {
            System::on(Euclidean::<3>)
                .bracket(Poisson::field(|x: &Vector3<Real>| {
                    Matrix3::<Real>::from(Vector3::z().cross_matrix()) * $b(x.y)
                }))
                .energy(|x: &Vector3<Real>| x.norm_squared())
                .entropy(|x: &Vector3<Real>| {
                    if x.x.re > 2.0 { x.z + x.x * (x.x - 2.0) } else { x.z }
                })
                $(.$name($($part),*))*
                .noise(Boltzmann(1e-6))
                .build()
                .unwrap()
        };
    }

    fn one(_: Real) -> Real {
        Real::from(1.0)
    }

    /// `1` up to `y = 2` and a slope behind it.
    fn sloping(y: Real) -> Real {
        if y.re > 2.0 { y - 1.0 } else { Real::from(1.0) }
    }

    /// A closed system or an open one.
    trait Model: Judged<Broken = ModelError, Report = Report> {}

    impl<F: Judged<Broken = ModelError, Report = Report>> Model for F {}

    /// Runs a few short steps.
    fn run<F: Fluctuating<U>, U>(
        system: &Noisy<F, U>,
        x0: &Element<F>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        RandomFlow(DormandPrince5).seed(1).run(system, x0.clone(), Span::steps(1e-6, 3))
    }

    /// Verifies a sound system, reports on it, and runs it with and without its certificate.
    fn is_sound<F: Model + Fluctuating<U>, U>(system: Noisy<F, U>, x0: &Element<F>) {
        assert_eq!(system.verify(x0, 0.1), Ok(()));
        let report = system.report(x0);
        assert!(report.model.verdict.is_ok() && !report.model.laws.is_empty(), "{report}");
        assert_eq!(report.noise, Some(Ok(())));
        let text = report.to_string();
        assert!(text.starts_with(&report.model.to_string()), "{text}");
        assert!(text.ends_with("\nnoise: its law is exp(S/k_B)"), "{text}");
        let before = run(&system, x0).unwrap();
        assert!(!system.is_verified() && !before.certificate().verified_before);
        let system = system.verified(x0).unwrap();
        let after = run(&system, x0).unwrap();
        assert!(system.is_verified() && after.certificate().verified_before);
        assert_eq!(before.states(), after.states());
    }

    /// Returns the error of each of the verbs, all of them the same.
    fn refused<F: Model + Fluctuating<U>, U>(system: Noisy<F, U>, x0: &Element<F>) -> NoisyError {
        let error = system.verify(x0, 0.1).unwrap_err();
        let report = system.report(x0);
        let text = report.to_string();
        match &error {
            NoisyError::Model(_) => {
                assert!(report.model.verdict.is_err() && report.noise.is_none(), "{text}");
                assert!(text.ends_with("not judged, because the model breaks a law"), "{text}");
            }
            NoisyError::Noise(_) => {
                assert!(report.model.verdict.is_ok(), "{text}");
                assert!(matches!(report.noise, Some(Err(_))), "{text}");
                assert!(text.ends_with(&format!("noise: {error}")), "{text}");
            }
        }
        let again = system.verified(x0).err();
        assert_eq!(format!("{again:?}"), format!("{:?}", Some(&error)));
        error
    }

    #[test]
    fn noisy_systems_are_verified_once_and_run_as_before() {
        is_sound(body!(0.1), &START);
        let open = oscillator!(0.0, 0.1);
        let x0 = open.flow().start((vector![1.0, 0.0], vector![0.5]));
        is_sound(open, &x0);
    }

    #[test]
    fn a_verified_system_has_noise_and_its_certificate() {
        let body = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .unwrap();
        let body = body.verified(&START).unwrap();
        let noisy: Noisy<_, Uniform> = Noisy::new(body, Noise::of(Boltzmann(0.1)));
        assert!(noisy.is_verified());
        assert_eq!(noisy.verify(&START, 0.1), Ok(()));
        assert!(
            run(&noisy.verified(&START).unwrap(), &START).unwrap().certificate().verified_before
        );
    }

    #[test]
    fn a_model_that_breaks_a_law_is_refused_before_its_noise() {
        let start = vector![2.5, 1.0, 1.0];
        let error = refused(bent!(one), &start);
        assert!(
            matches!(error, NoisyError::Model(ModelError::EntropyNotCasimir { .. })),
            "{error}"
        );
        assert!(matches!(Error::from(error), Error::Model(_)));
        let open = oscillator!(0.1, -1.0);
        let x0 = open.flow().start((vector![1.0, 0.0], vector![0.5]));
        let error = refused(open, &x0);
        assert!(
            matches!(error, NoisyError::Model(ModelError::WorkCarriesEntropy { .. })),
            "{error}"
        );
    }

    #[test]
    fn a_start_that_is_no_state_is_refused() {
        let error = refused(body!(0.1), &vector![0.4, f64::NAN, 0.3]);
        assert!(matches!(error, NoisyError::Model(ModelError::Start(_))), "{error}");
        let spin = || {
            System::on(Sphere::<2>)
                .energy(|x: &Vector3<Real>| x.z)
                .entropy(|x: &Vector3<Real>| x.x)
                .noise(Boltzmann(0.1))
                .build()
                .unwrap()
        };
        let error = refused(spin(), &vector![0.0, 0.0, 1.1]);
        assert!(matches!(error, NoisyError::Model(ModelError::Start(_))), "{error}");
    }

    #[test]
    fn noise_with_another_law_is_refused() {
        let error = refused(bent!(sloping), &vector![1.0, 3.0, 1.0]);
        assert!(matches!(error, NoisyError::Noise(NoiseError::NotUnimodular { .. })), "{error}");
        assert!(matches!(
            Error::from(error),
            Error::Flow(error) if error.downcast_ref::<NoiseError>().is_some()
        ));
        for k_b in NOT_POSITIVE {
            let of_a_body = refused(body!(k_b), &START);
            let open = oscillator!(0.0, k_b);
            let x0 = open.flow().start((vector![1.0, 0.0], vector![0.5]));
            for error in [of_a_body, refused(open, &x0)] {
                assert!(
                    matches!(error, NoisyError::Noise(NoiseError::BoltzmannNotPositive { .. })),
                    "{error}"
                );
            }
        }
    }

    #[test]
    fn a_run_of_a_verified_system_judges_its_start_alone() {
        // A Casimir at the start, and not at samples around it.
        let [sound, edge, broken] = [0.5, 1.95, 2.5].map(|x| vector![x, 0.5, 0.5]);
        let closed = bent!(one);
        assert!(matches!(run(&closed, &edge), Err(RunError::Model(_))));
        let closed = closed.verified(&sound).unwrap();
        assert!(run(&closed, &edge).unwrap().certificate().verified_before);
        assert!(matches!(run(&closed, &broken), Err(RunError::Model(_))));
        let open = bent!(one, bath("air", Bath::at(1.0).isotropic(0.1)));
        let [sound, edge, broken] = [sound, edge, broken].map(|x| open.flow().start(x));
        assert!(matches!(run(&open, &edge), Err(RunError::Model(_))));
        let open = open.verified(&sound).unwrap();
        assert!(run(&open, &edge).unwrap().certificate().verified_before);
        assert!(matches!(run(&open, &broken), Err(RunError::Model(_))));
    }

    #[test]
    fn the_law_of_the_noise_is_judged_at_the_end_of_each_run() {
        // Friction drives it away from the third axis, to y = 2.4.
        let start = vector![0.8, 1.5, -2.0];
        let refused = |run: Result<Trajectory<Euclidean<3>>, RunError<Euclidean<3>>>| match run {
            Err(RunError::Step { cause: StepError::Flow { time, law }, .. }) => {
                assert!(
                    time > 0.05
                        && matches!(law.downcast_ref(), Some(NoiseError::NotUnimodular { .. }))
                );
            }
            other => panic!("{:?}", other.map(|run| run.certificate().to_string())),
        };
        let (method, span) = (RandomFlow(DormandPrince5).seed(1), Span::steps(0.02, 4));
        refused(method.run(&bent!(sloping), start, span));
        refused(method.run(&bent!(sloping).verified(&start).unwrap(), start, span));
    }

    #[test]
    fn a_run_of_a_verified_system_judges_the_law_of_its_noise() {
        let system = bent!(sloping).verified(&vector![0.5, 0.5, 0.5]).unwrap();
        let Err(RunError::Flow(error)) = run(&system, &vector![1.0, 3.0, 1.0]) else {
            panic!("its volume changes there")
        };
        assert!(matches!(error.downcast_ref(), Some(NoiseError::NotUnimodular { .. })), "{error}");
    }
}
