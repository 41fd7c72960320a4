//! A run that is put down and taken up again, and a run that is taken twice: the same bits.

#[path = "models/digits.rs"]
mod digits;
mod models;

use digits::refuses_changed_digits;
use metriplectic::integrators::{Checkpoint, ResumeError, Schedule, SpanError, Steps};
use metriplectic::manifolds::PointError;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};
use models::{TUMBLING, UNSTABLE, free_body, half_square, relaxing_body, spring, top};

type Start<Y> = <<Y as Metriplectic>::Manifold as metriplectic::fields::Space>::Point<f64>;

/// The bits of a state.
fn bits<M: Manifold>(state: &State<M>) -> Vec<u64> {
    let laws = [state.time, state.energy, state.entropy];
    let numbers = M::entries(&state.point).into_iter().chain(laws).map(f64::to_bits);
    numbers.chain([state.step as u64]).collect()
}

/// All states of a run from where it is.
fn rest<Y: Metriplectic>(steps: &mut Steps<'_, Y, WeylMidpoint>) -> Vec<Vec<u64>>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    steps.map(|state| bits(&state.expect("every step is solved"))).collect()
}

/// A checkpoint that went through a file.
fn through_a_file(checkpoint: &Checkpoint) -> Checkpoint {
    let text = serde_json::to_string(checkpoint).expect("it is written");
    let read = serde_json::from_str(&text).expect("it is read");
    assert_eq!(&read, checkpoint);
    // Down to the sign of a zero.
    assert_eq!(serde_json::to_string(&read).expect("it is written"), text);
    // Reading it as a tree, as a program that adds a field of its own does, costs no digit.
    let tree: serde_json::Value = serde_json::from_str(&text).expect("it is read");
    assert_eq!(
        &serde_json::from_value::<Checkpoint>(tree.clone()).expect("it is read"),
        checkpoint
    );
    // And so does a format that writes fields in their order, without names.
    let list = serde_json::json!([tree["version"], tree["checksum"], tree["run"]]);
    assert_eq!(&serde_json::from_value::<Checkpoint>(list).expect("it is read"), checkpoint);
    read
}

/// Puts a run down at several places and takes it up again.
fn resumes<Y: Metriplectic>(
    name: &str,
    system: &Y,
    x0: Start<Y>,
    course: impl Into<Schedule> + Copy,
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let mut whole =
        WeylMidpoint.steps(system, x0.clone(), course).expect("the model keeps its laws");
    let expected = rest(&mut whole);
    assert!(expected.len() > 20, "{name}: {} steps", expected.len());
    for put_down in [0, 1, 2, 3, 10, expected.len() - 1, expected.len()] {
        let mut steps = WeylMidpoint.steps(system, x0.clone(), course).expect("as before");
        for _ in 0..put_down {
            steps.advance().expect("every step is solved");
        }
        let checkpoint = through_a_file(&steps.checkpoint());
        drop(steps);
        let mut resumed = WeylMidpoint.resume(system, &checkpoint).expect("it is the same system");
        assert_eq!(resumed.checkpoint(), checkpoint, "{name} at {put_down}");
        assert!(rest(&mut resumed) == expected[put_down..], "{name} at {put_down}");
        assert_eq!(resumed.certificate(), whole.certificate(), "{name} at {put_down}");
        assert_eq!(resumed.ending(), whole.ending(), "{name} at {put_down}");
        // Down to what the next step would be guessed from.
        assert_eq!(resumed.checkpoint(), whole.checkpoint(), "{name} at {put_down}");
    }
    let steps = expected.len();
    Claim::new(
        Guarantee::Reproducibility,
        format!("{name}, {steps} steps, resumed at 7 places"),
        "WeylMidpoint",
    )
    .against("the whole run")
    .record("the same bits", "the same bits");
}

/// With steps of one size, and with those of a controller.
fn resumes_both<Y: Metriplectic>(name: &str, system: &Y, x0: Start<Y>)
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    resumes(name, system, x0.clone(), Span::steps(0.07, 60));
    resumes(name, system, x0, Span::until(4.0).tolerance(1e-4).until_rest(1e-12));
}

/// A spin with a bath.
fn spin() -> impl Metriplectic<Manifold = Product<Sphere<2>, Euclidean<1>>, Metric = Canonical> {
    System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
            n.x.powi(2) * 0.25 - n.z + (s.x * 0.05).exp()
        })
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()
        .expect("the parts make a system")
}

const SPIN: (Vector3<f64>, Vector1<f64>) = (Vector3::new(0.48, 0.36, -0.8), Vector1::new(0.0));

#[test]
fn a_resumed_run_is_the_run() {
    resumes_both("so(3)*", &relaxing_body(), vector![0.2, -1.0, 0.3]);
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    resumes_both("S²", &system, Vector3::from_element(3.0_f64.sqrt().recip()));
    let group = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()
        .unwrap();
    resumes_both(
        "SO(3)",
        &group,
        Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).unwrap(),
    );
    resumes_both("S² × R", &spin(), SPIN);
}

#[test]
fn a_resumed_run_with_a_further_invariant_is_the_run() {
    let free = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(4) * 0.2)
        .casimir(half_square)
        .build()
        .unwrap();
    resumes_both("so(3)*", &free, TUMBLING);
    resumes_both("R⁴", &spring(), vector![1.0, 0.2, -0.3, 0.6]);
}

#[test]
fn a_run_that_has_ended_stays_ended() {
    let span = Span::until(1e4).tolerance(1e-4).until_rest(1e-8);
    let mut steps = WeylMidpoint.steps(&relaxing_body(), UNSTABLE, span).unwrap().count();
    assert!(steps > 10);
    let body = relaxing_body();
    let mut run = WeylMidpoint.steps(&body, UNSTABLE, span).unwrap();
    while run.next().is_some() {
        steps -= 1;
    }
    assert_eq!(steps, 0);
    let mut resumed = WeylMidpoint.resume(&body, &through_a_file(&run.checkpoint())).unwrap();
    assert!(resumed.ending().is_some_and(|ending| ending.is_rest()) && resumed.next().is_none());
}

#[test]
fn a_checkpoint_of_another_system_is_refused() {
    let (body, free) = (relaxing_body(), free_body());
    let mut steps = WeylMidpoint.steps(&body, UNSTABLE, 0.1).unwrap();
    steps.advance().unwrap();
    let checkpoint = steps.checkpoint();
    assert_eq!((checkpoint.step(), checkpoint.time()), (1, 0.1));
    let refused = |error: Option<ResumeError>| error.expect("it is refused");
    let error = refused(WeylMidpoint.resume(&free, &checkpoint).err());
    assert!(matches!(error, ResumeError::AnotherSystem { field: "energy", .. }), "{error}");
    let error = refused(WeylMidpoint.resume(&spin(), &checkpoint).err());
    let expected = PointError::Length { found: 3, expected: 4 };
    assert_eq!(error, ResumeError::Point(expected));
    let sphere = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let mut steps = WeylMidpoint.steps(&body, vector![0.0, 0.5, 0.5], 0.1).unwrap();
    steps.advance().unwrap();
    let error = refused(WeylMidpoint.resume(&sphere, &steps.checkpoint()).err());
    assert!(matches!(error, ResumeError::Point(PointError::OffManifold { .. })), "{error}");
    let with = System::on(LieDual::so3())
        .energy(models::kinetic(vector![10.0, 5.0, 1.0]))
        .entropy(half_square)
        .casimir(|p: &Vector3<Real>| p.norm_squared().powi(2))
        .build()
        .unwrap();
    let error = refused(WeylMidpoint.resume(&with, &checkpoint).err());
    assert!(matches!(error, ResumeError::Length { found: 0, expected: 1, .. }), "{error}");
}

/// A file of a run, with a change.
fn changed(
    checkpoint: &Checkpoint,
    change: impl FnOnce(&mut serde_json::Value),
) -> serde_json::Result<Checkpoint> {
    let mut tree = serde_json::to_value(checkpoint)?;
    change(&mut tree);
    serde_json::from_value(tree)
}

#[test]
fn every_changed_digit_of_a_checkpoint_is_refused() {
    let body = relaxing_body();
    let fixed = Schedule::from(Span::steps(0.1, 50).until_rest(1e-9));
    let adaptive = Schedule::from(Span::until(10.0).tolerance(1e-4).scale([1.0, 0.0, 0.0]));
    for course in [&fixed, &adaptive] {
        macro_rules! refuse {
            ($($method:expr),*) => {$(
                refuses_changed_digits($method, &body, UNSTABLE, course.clone());
            )*};
        }
        refuse!(Scheme::new(WeylMidpoint), Gauss::<3>, Radau::<2>);
        refuse!(DormandPrince5, DormandPrince8, RungeKuttaChebyshev);
    }
    refuses_changed_digits(
        Scheme::new(WeylMidpoint),
        &spring(),
        vector![1.0, 0.2, -0.3, 0.6],
        fixed,
    );
}

#[test]
fn a_damaged_checkpoint_is_refused() {
    let body = relaxing_body();
    let mut steps = WeylMidpoint.steps(&body, UNSTABLE, Span::until(1.0)).unwrap();
    steps.advance().unwrap();
    let checkpoint = steps.checkpoint();
    let resumed = |checkpoint: &Checkpoint| WeylMidpoint.resume(&body, checkpoint).err();
    let with = |path: &str, value: serde_json::Value| {
        changed(&checkpoint, |tree| *tree.pointer_mut(path).expect(path) = value)
    };
    let same = with("/run/progress/every", 1.into()).unwrap();
    assert!(same == checkpoint && resumed(&same).is_none());
    for (path, value) in [
        ("/run/point/1", "NaN".into()),
        ("/run/point/1", "-0.99999".into()),
        ("/run/time", "-1.0".into()),
        ("/run/progress/every", 0.into()),
        ("/run/progress/step_size/Adaptive/pace/next", "0.0".into()),
        ("/run/progress/ending", "Span".into()),
        ("/run/memory/compensation", serde_json::json!(["0.0"])),
        ("/run/memory", serde_json::json!({})),
        ("/run/method", "DormandPrince8".into()),
    ] {
        let altered = with(path, value).expect(path);
        let error = resumed(&altered).expect(path);
        assert!(matches!(error, ResumeError::Altered { .. }), "{path}: {error}");
        assert_eq!(altered.clone().with_end(2.0), Err(error.clone()));
        assert!(altered.time().is_nan() && altered.method().is_empty());
        // It is not written again under a checksum that fits.
        assert!(serde_json::to_string(&altered).unwrap_err().to_string() == error.to_string());
    }
    // Two numbers that have changed places.
    let swapped = changed(&checkpoint, |tree| {
        let point = tree["run"]["point"].as_array_mut().unwrap();
        point.swap(0, 1);
    });
    assert!(matches!(resumed(&swapped.unwrap()), Some(ResumeError::Altered { .. })));
    // What is no number, and what is no field, is not even read.
    assert!(with("/run/energy", "one".into()).is_err() && with("/checksum", "sum".into()).is_err());
    assert!(with("/run", serde_json::Value::Null).is_err());
    for path in
        ["", "/run", "/run/balance", "/run/progress", "/run/progress/step_size/Adaptive/pace"]
    {
        let unread = changed(&checkpoint, |tree| {
            tree.pointer_mut(path).expect(path)["enegry"] = "1.0".into();
        });
        assert!(unread.is_err(), "{path}");
    }
}

#[test]
fn a_checkpoint_of_another_method_is_refused_and_one_with_other_options_is_not() {
    let body = relaxing_body();
    let mut steps = WeylMidpoint.steps(&body, UNSTABLE, 0.1).unwrap();
    steps.advance().unwrap();
    let checkpoint = through_a_file(&steps.checkpoint());
    assert_eq!(checkpoint.method(), "Scheme<WeylMidpoint, Gonzalez>");
    let patient = Newton { iterations: 60, ..Newton::default() };
    let options = Scheme { splits: 3, ..Scheme::new(WeylMidpoint).newton(patient) };
    assert!(options.resume(&body, &checkpoint).is_ok());
    let refused = |error: Option<ResumeError>, name: &str| match error {
        Some(ResumeError::AnotherMethod { stored, found }) => {
            assert!(stored == checkpoint.method() && found == name, "{stored}, {found}");
        }
        other => panic!("{name}: {other:?}"),
    };
    refused(Exponential.resume(&body, &checkpoint).err(), "Scheme<Exponential, Gonzalez>");
    let other = Scheme::new(WeylMidpoint).gradient(MeanValue);
    refused(other.resume(&body, &checkpoint).err(), "Scheme<WeylMidpoint, MeanValue>");
}

#[test]
fn a_file_of_another_version_is_known_by_its_version_alone() {
    let body = relaxing_body();
    let run = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 3)).unwrap();
    // The sixth version had neither a checksum nor the name of the method.
    let mut sixth = serde_json::to_value(run.checkpoint()).unwrap();
    sixth["version"] = 6.into();
    sixth.as_object_mut().unwrap().remove("checksum").unwrap();
    sixth["run"].as_object_mut().unwrap().remove("method").unwrap();
    // In the order of its fields, and with the run before the version.
    let first = format!(r#"{{"version":6,"run":{}}}"#, sixth["run"]);
    for (version, text) in [
        (5, r#"{"version":5,"step":0,"start":"0.0","point":["0.0","0.5","0.5"],"balance":{}}"#),
        (6, &first),
        (6, &sixth.to_string()),
        (11, r#"{"step":{"taken":0},"version":11}"#),
        (4, r#"{"version":4}"#),
        (6, &format!("[6,{}]", sixth["run"])),
    ] {
        let error = ResumeError::Version { found: version, expected: 10 };
        let older: Checkpoint = serde_json::from_str(text).expect("it is read");
        assert_eq!(WeylMidpoint.resume(&body, &older).err(), Some(error.clone()));
        assert_eq!(older.clone().with_steps(10), Err(error.clone()));
        assert_eq!(older.clone().with_end(10.0), Err(error));
        assert!(older.time().is_nan() && older.point().next().is_none());
    }
    for text in [r#"{"step":0}"#, r#"{"version":10}"#, "[]", "[10]", r#"[10,"0"]"#, "10"] {
        assert!(serde_json::from_str::<Checkpoint>(text).is_err(), "{text}");
    }
}

/// An oscillator with the energy `(a p² + q²)/2` times a unit, and friction `b` into its entropy.
fn oscillator(a: f64, b: f64, unit: f64) -> impl Metriplectic<Manifold = Euclidean<3>> {
    System::on(Euclidean::<3>)
        .bracket(
            Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                .expect("it is skew"),
        )
        .energy(move |x: &Vector3<Real>| ((x.y.powi(2) * a + x.x.powi(2)) * 0.5 + x.z) * unit)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let b_ = Vector3::new(Real::from(0.0), w.z, -w.y);
            b_ * b_.transpose() * (w.z.recip() * b)
        }))
        .build()
        .expect("the parts make a system")
}

#[test]
fn another_system_is_noticed_in_any_unit() {
    for unit in [1.0, 1e-20, 1e20] {
        let system = oscillator(1.0, 0.1, unit);
        let start = vector![0.3, 0.2, 0.0];
        let mut steps = WeylMidpoint.steps(&system, start, 0.01 / unit).unwrap();
        steps.advance().unwrap();
        let checkpoint = steps.checkpoint();
        assert!(WeylMidpoint.resume(&system, &checkpoint).is_ok());
        let refused = |other| match WeylMidpoint.resume(&other, &checkpoint).err() {
            Some(ResumeError::AnotherSystem { field, .. }) => field,
            other => panic!("{unit:e}: {other:?}"),
        };
        assert_eq!(refused(oscillator(1.0 + 1e-9, 0.1, unit)), "energy");
        // The same energy and entropy, and other friction.
        assert_eq!(refused(oscillator(1.0, 0.1 * (1.0 + 1e-9), unit)), "velocity");
    }
}

#[test]
fn a_run_that_has_reached_its_end_goes_on() {
    let body = relaxing_body();
    let whole = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 300)).unwrap();
    let first = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 100)).unwrap();
    let later = first.checkpoint().clone().with_steps(300).unwrap();
    let second = WeylMidpoint.resume(&body, &through_a_file(&later)).unwrap().run().unwrap();
    let joined = first.iter().chain(second.iter().skip(1)).map(bits);
    assert!(joined.eq(whole.iter().map(bits)));
    assert_eq!(second.certificate(), whole.certificate());
    assert_eq!(second.checkpoint(), whole.checkpoint());

    // In steps of a controller, before one is shortened to meet the end, the same bits.
    let span = |end: f64| Span::until(end).tolerance(1e-4).starting_at(-20.0);
    let whole = WeylMidpoint.run(&body, UNSTABLE, span(20.0)).unwrap();
    let mut steps = WeylMidpoint.steps(&body, UNSTABLE, span(0.0)).unwrap();
    for _ in 0..100 {
        steps.advance().unwrap();
    }
    let later = through_a_file(&steps.checkpoint()).with_end(20.0).unwrap();
    let second = WeylMidpoint.resume(&body, &later).unwrap().run().unwrap();
    assert!(second.iter().map(bits).eq(whole.iter().skip(100).map(bits)));
    // After its end, the same motion.
    let first = WeylMidpoint.run(&body, UNSTABLE, span(0.0)).unwrap();
    let later = first.checkpoint().clone().with_end(20.0).unwrap();
    let second = WeylMidpoint.resume(&body, &later).unwrap().run().unwrap();
    assert_eq!(second.last().time.to_bits(), 20.0_f64.to_bits());
    assert!((second.last().point - whole.last().point).norm() < 1e-3);
    assert!(second.certificate().keeps_energy() && second.certificate().keeps_entropy());

    // What cannot go on so.
    let fixed = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 10)).unwrap();
    let fixed = || fixed.checkpoint().clone();
    assert!(matches!(fixed().with_steps(10), Err(ResumeError::Span(SpanError::NoSteps))));
    assert_eq!(fixed().with_end(20.0), Err(ResumeError::FixedSteps));
    let adaptive = || first.checkpoint().clone();
    assert_eq!(adaptive().with_steps(20), Err(ResumeError::AdaptiveSteps));
    assert!(matches!(adaptive().with_end(0.0), Err(ResumeError::Span(SpanError::End { .. }))));
    assert!(matches!(adaptive().with_end(f64::NAN), Err(ResumeError::Span(SpanError::End { .. }))));
}

/// At a velocity of zero friction produces no entropy, and the entropy rises in the step that begins there.
#[test]
fn a_run_from_rest_with_friction_goes_on() {
    let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let system = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(canonical).unwrap())
        .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(Real::from(0.0), w.z, -w.y);
            b * b.transpose() * w.z.recip()
        }))
        .build()
        .unwrap();
    let start = vector![1.0, 0.0, 1.0];
    let run = DormandPrince5.run(&system, start, Span::steps(0.1, 1)).unwrap();
    assert!(run.last().entropy > 1.0);
    let later = through_a_file(run.checkpoint()).with_steps(2).unwrap();
    let resumed = DormandPrince5.resume(&system, &later).unwrap().run().unwrap();
    let whole = DormandPrince5.run(&system, start, Span::steps(0.1, 2)).unwrap();
    assert_eq!(bits(resumed.last()), bits(whole.last()));
}

#[test]
fn a_run_that_failed_goes_on_with_other_options() {
    let body = relaxing_body();
    let span = Span::until(10.0).tolerance(1e-9).least_step(1e-2);
    let error = WeylMidpoint.run(&body, UNSTABLE, span).unwrap_err();
    let stopped = error.trajectory().expect("it had started");
    let other = Scheme { splits: 2, ..Scheme::new(WeylMidpoint) };
    let resumed = other.resume(&body, stopped.checkpoint()).unwrap();
    assert_eq!(resumed.state(), stopped.last());
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let whole = || {
        let body = relaxing_body();
        let fixed = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 500)).unwrap();
        let adaptive = WeylMidpoint.run(&body, UNSTABLE, Span::until(50.0)).unwrap();
        let spin = WeylMidpoint.run(&spin(), SPIN, Span::until(5.0)).unwrap();
        let bodies = fixed.iter().chain(&adaptive).map(bits);
        let certificates = [fixed.certificate(), adaptive.certificate(), spin.certificate()];
        let certificates = certificates.map(|certificate| format!("{certificate:?}"));
        (bodies.chain(spin.iter().map(bits)).collect::<Vec<_>>(), certificates)
    };
    let once = whole();
    assert!(once == whole(), "twice in one thread");
    let threads = [0, 1].map(|_| std::thread::spawn(whole));
    for thread in threads {
        assert!(thread.join().expect("it runs") == once, "in another thread");
    }
    Claim::new(
        Guarantee::Reproducibility,
        "body and spin, twice and in two threads",
        "WeylMidpoint",
    )
    .against("the first run")
    .record("the same bits", "the same bits");
}
