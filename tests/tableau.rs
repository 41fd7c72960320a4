//! Explicit Runge-Kutta methods with coefficients that a user writes down: they keep both laws at their order, follow a
//! tolerance, have states inside their steps and are resumed, on Rⁿ, on a sphere and on SO(3). Wrong ones are refused.

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{Row, Schedule, StepStart, TableauError, laws};
use metriplectic::prelude::*;

mod models;

use models::{boxed, distance, slope, top};

/// Kutta's method of order 3 (1901), without an error of its own.
const KUTTA: Tableau = Tableau::new(
    "Kutta3",
    3,
    &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
    &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
);

/// The pair of orders 5 and 4 of Tsitouras (2011, table 1), with its dense output of order 4.
const TSITOURAS: Tableau = Tableau::new("Tsitouras5", 5, STAGES, END)
    .error(
        &[
            (0, -0.001_780_011_052_225_777),
            (1, -0.000_816_434_459_656_746_9),
            (2, 0.007_880_878_010_261_995),
            (3, -0.144_711_007_173_262_9),
            (4, 0.582_357_165_452_555_2),
            (5, -0.458_082_105_929_186_97),
            (6, 1.0 / 66.0),
        ],
        4,
    )
    .dense(
        &[],
        &[&[
            (0, -1.053_088_497_729_021_6),
            (1, 0.1017),
            (2, 2.490_627_285_651_253),
            (3, -16.548_102_889_244_9),
            (4, 47.379_521_962_819_28),
            (5, -34.870_657_861_496_61),
            (6, 2.5),
        ]],
    );

const STAGES: &[Row] = &[
    &[(0, 0.161)],
    &[(0, -0.008_480_655_492_356_989), (1, 0.335_480_655_492_357)],
    &[(0, 2.897_153_057_105_493_5), (1, -6.359_448_489_975_075), (2, 4.362_295_432_869_581_5)],
    &[
        (0, 5.325_864_828_439_257),
        (1, -11.748_883_564_062_828),
        (2, 7.495_539_342_889_836_5),
        (3, -0.092_495_066_361_755_25),
    ],
    &[
        (0, 5.861_455_442_946_42),
        (1, -12.920_969_317_847_11),
        (2, 8.159_367_898_576_159),
        (3, -0.071_584_973_281_401),
        (4, -0.028_269_050_394_068_383),
    ],
];

const END: Row = &[
    (0, 0.096_460_766_818_065_23),
    (1, 0.01),
    (2, 0.479_889_650_414_499_6),
    (3, 1.379_008_574_103_742),
    (4, -3.290_069_515_436_081),
    (5, 2.324_710_524_099_774),
];

/// Euler's method: no stage but the start.
const EULER: Tableau = Tableau::new("Euler", 1, &[], &[(0, 1.0)]);

const METHODS: [ExplicitRungeKutta; 2] =
    [ExplicitRungeKutta::new(&KUTTA), ExplicitRungeKutta::new(&TSITOURAS)];

/// The end of a run that keeps its laws to round-off.
fn end<Y: Metriplectic>(
    method: impl Method<Y>,
    system: &Y,
    x0: &Point<Y>,
    span: impl Into<Schedule>,
) -> Point<Y> {
    let run = method.run(system, x0.clone(), span).expect("it runs");
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    assert!(certificate.max_relative_energy_error() <= 3e-15, "{certificate}");
    assert!(certificate.entropy_falls == 0 && certificate.max_manifold_defect <= 1e-15);
    run.last().point.clone()
}

/// The orders, from so many steps on, the errors at a tolerance, the errors inside a step, and a resumed run, against
/// order 8.
fn is_a_method<Y: Metriplectic>(
    name: &str,
    system: &Y,
    x0: &Point<Y>,
    time: f64,
    coarsest: [usize; 2],
) {
    let exact = end(DormandPrince8, system, x0, Span::until(time).tolerance(1e-14));
    let off = |x: &Point<Y>| distance::<Y::Manifold>(x, &exact);
    for (method, coarsest) in METHODS.into_iter().zip(coarsest) {
        let tableau = method.tableau();
        let (who, order) = (format!("{}, {name}", tableau.name()), f64::from(tableau.order()));
        let counts = [4, 5, 6, 8, 10].map(|k| k * coarsest / 4);
        let errors = counts.map(|n| off(&end(method, system, x0, Span::steps(time / n as f64, n))));
        let slope_of = |errors: &[f64]| slope(&counts.map(|n| time / n as f64), errors, 1e-13);
        println!("{who}: order {:.2} {errors:?}", slope_of(&errors));
        // The leading error of Tsitouras' method is small, and the next one may be larger.
        let found = slope_of(&errors) - order;
        assert!((-0.3..1.1).contains(&found), "{who}: {errors:?}");

        // A hundredth of the tolerance is about a hundredth of the error.
        let followed = [1e-3, 1e-5]
            .map(|tolerance| off(&end(method, system, x0, Span::until(time).tolerance(tolerance))));
        println!("{who}: adaptive {followed:?}");
        assert!(followed[0] < 3e-2 && followed[1] < 0.1 * followed[0], "{who}: {followed:?}");

        // In the middle of one step: the dense output of order 4, and the cubic of order 3.
        let steps = [2.0, 1.6, 1.3, 1.0].map(|k| k * time / coarsest as f64);
        let inside = steps.map(|h| {
            let mut run = method.steps(system, x0.clone(), h).expect("it starts");
            run.advance().expect("a step");
            let fine = Span::until(0.4 * h).tolerance(1e-14);
            let state = run.at(0.4 * h).expect("it lies in the step");
            distance::<Y::Manifold>(&state.point, &end(DormandPrince8, system, x0, fine))
        });
        let (found, expected) = (slope(&steps, &inside, 1e-15), order.min(4.0) + 1.0);
        println!("{who}: inside {found:.2} {inside:?}");
        assert!(found > expected - 0.5, "{who}: {inside:?}");

        // Put down in the middle, in steps that follow a tolerance.
        let span = Span::until(time).tolerance(1e-4);
        let mut steps = method.steps(system, x0.clone(), span).expect("it starts");
        for _ in 0..3 {
            steps.advance().expect("a step");
        }
        let checkpoint = steps.checkpoint();
        assert!(checkpoint.method().starts_with(tableau.name()), "{}", checkpoint.method());
        let resumed = method.resume(system, &checkpoint).expect("it is resumed").run();
        let whole = method.run(system, x0.clone(), span).expect("it runs");
        assert_eq!(resumed.expect("it runs").last(), whole.last(), "{who}");
        let error = DormandPrince5.resume(system, &checkpoint).err();
        assert!(matches!(error, Some(ResumeError::AnotherMethod { .. })), "{error:?}");
    }
}

/// The rows of order 5 and 8 without their dense output: they are read as those of any other tableau.
const READ: [Tableau; 2] =
    [DormandPrince5::TABLEAU.dense(&[], &[]), DormandPrince8::TABLEAU.dense(&[], &[])];

#[test]
fn rows_that_are_compiled_as_constants_give_the_bits_of_rows_that_are_read() {
    let (body, start) = (models::relaxing_body(), models::UNSTABLE);
    let span = || Span::until(100.0).tolerance(1e-7);
    let compiled = [
        DormandPrince5.run(&body, start, span()).expect("it runs"),
        DormandPrince8.run(&body, start, span()).expect("it runs"),
    ];
    for (run, tableau) in compiled.iter().zip(&READ) {
        let read = ExplicitRungeKutta::new(tableau).run(&body, start, span()).expect("it runs");
        assert!(run.certificate().steps > 10, "{}", run.certificate());
        assert_eq!(run.states(), read.states(), "{}", tableau.name());
    }
}

#[test]
fn two_tableaus_of_one_name_are_two_methods() {
    const STAGES: &[Row] = &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]];
    const END: Row = &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)];
    const MINE: Tableau = Tableau::new("Mine", 3, STAGES, END);
    const SAME: Tableau = Tableau::new("Mine", 3, STAGES, END);
    // Of order 3 too, by the nodes 0, 1/3, 2/3.
    const HEUN: Tableau =
        Tableau::new("Mine", 3, &[&[(0, 1.0 / 3.0)], &[(1, 2.0 / 3.0)]], &[(0, 0.25), (2, 0.75)]);
    let (system, start) = (models::gas(0.5), vector![1.0, 2.0, 2.0, 2.0]);
    let [mine, same, heun] = [&MINE, &SAME, &HEUN].map(ExplicitRungeKutta::new);
    let run = mine.run(&system, start, Span::steps(0.01, 3)).expect("it runs");
    let later = run.checkpoint().clone().with_steps(6).expect("it goes on");
    assert!(later.method().starts_with("Mine "), "{}", later.method());
    assert!(same.resume(&system, &later).is_ok());
    let error = heun.resume(&system, &later).err();
    assert!(matches!(error, Some(ResumeError::AnotherMethod { .. })), "{error:?}");
}

#[test]
fn on_euclidean_space_with_friction() {
    is_a_method("R⁴", &models::gas(0.5), &vector![1.0, 2.0, 2.0, 2.0], 2.0, [160, 64]);
}

#[test]
fn on_a_sphere() {
    let spin = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    is_a_method("S²", &spin, &Vector3::repeat(3_f64.sqrt().recip()), 20.0, [128, 64]);
}

#[test]
fn on_rotations() {
    let group = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(boxed(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5))
        .entropy(boxed(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25))
        .build()
        .unwrap();
    let start = Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).unwrap();
    is_a_method("SO(3)", &group, &start, 0.4, [32, 64]);
}

#[test]
fn the_tableaus_of_this_library_and_two_others_have_their_orders() {
    for tableau in [&KUTTA, &TSITOURAS, &EULER, DormandPrince5::TABLEAU, DormandPrince8::TABLEAU] {
        laws::tableau(tableau).unwrap_or_else(|broken| panic!("{}: {broken}", tableau.name()));
        tableau.check(false).expect("a run may start");
    }
    let system = models::gas(0.5);
    laws::method(ExplicitRungeKutta::new(&EULER), &system, &vector![1.0, 2.0, 2.0, 2.0], 0.005)
        .unwrap();
    // The coefficients of a method of this library make the same method.
    let start = vector![1.0, 2.0, 2.0, 2.0];
    let span = Span::until(2.0).tolerance(1e-6);
    let ours = DormandPrince8.run(&system, start, span).unwrap();
    let again = ExplicitRungeKutta::new(DormandPrince8::TABLEAU).run(&system, start, span).unwrap();
    assert_eq!(ours, again);
}

#[test]
fn a_wrong_tableau_is_refused_by_its_laws_and_before_a_run() {
    // A weight with a wrong digit, in a stage and in the end.
    const STAGE: Tableau =
        Tableau::new("wrong stage", 3, &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0001)]], KUTTA_END);
    const WEIGHT: Tableau = Tableau::new(
        "wrong end",
        3,
        &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
        &[(0, 1.0 / 6.0), (1, 0.66667), (2, 1.0 / 6.0)],
    );
    const KUTTA_END: Row = &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)];
    // An order too high, and errors that vanish too late or too early.
    const ORDER: Tableau =
        Tableau::new("too high", 4, &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]], KUTTA_END);
    const ERROR: Tableau = TSITOURAS.error(&[(0, 1e-3), (6, -1e-3)], 4);
    const EARLY: Tableau = TSITOURAS.error(&[(0, 1e-3)], 4);
    const DENSE: Tableau = TSITOURAS.dense(&[], &[&[(0, 1.0), (6, -1.0)]]);
    let broken = |tableau: &Tableau| laws::tableau(tableau).expect_err("it is wrong").law;
    for tableau in [&STAGE, &WEIGHT, &ORDER] {
        assert_eq!(broken(tableau), "the end has the order of the method");
    }
    assert_eq!(broken(&ERROR), "an error vanishes up to its order");
    assert_eq!(broken(&EARLY), "an error vanishes up to its order");
    assert_eq!(broken(&DENSE), "the dense output has the order of the method less one");

    let refused = |tableau: &'static Tableau, span: Schedule| {
        let run = ExplicitRungeKutta::new(tableau).run(
            &models::gas(0.5),
            vector![1.0, 2.0, 2.0, 2.0],
            span,
        );
        match run {
            Err(RunError::Method(error)) => {
                println!("{error}");
                *error.downcast_ref::<TableauError>().expect("the error of a tableau")
            }
            other => panic!("{:?}", other.err()),
        }
    };
    let steps = || Schedule::from(Span::steps(0.1, 3));
    // Numbers that are none, no order, and an error or a dense output that a run would follow.
    const NAN: Tableau =
        Tableau::new("not a number", 3, &[&[(0, 0.5)], &[(0, -1.0), (1, f64::NAN)]], KUTTA_END);
    const NAN_END: Tableau = Tableau::new("not a number", 1, &[], &[(0, f64::NAN)]);
    const ZERO: Tableau = Tableau::new("no order", 0, &[], &[(0, 1.0)]);
    const NOTHING: Tableau = KUTTA.error(&[(0, 0.0)], 2);
    const NAN_ERROR: Tableau = TSITOURAS.error(&[(0, f64::NAN)], 4);
    const NAN_DENSE: Tableau = TSITOURAS.dense(&[], &[&[(0, f64::NAN)]]);
    for tableau in [&NAN, &NAN_END, &ZERO] {
        assert_eq!(broken(tableau), "the end has the order of the method");
        assert!(matches!(refused(tableau, steps()), TableauError::Order { .. }));
    }
    assert_eq!(broken(&NOTHING), "an error does not vanish in the next order");
    assert_eq!(broken(&NAN_ERROR), "an error vanishes up to its order");
    assert_eq!(broken(&NAN_DENSE), "the dense output has the order of the method less one");
    let follows = || Schedule::from(Span::until(1.0).tolerance(1e-4));
    for span in [steps(), follows()] {
        let nothing = TableauError::NothingEstimated { name: "Kutta3", which: 0, order: 2 };
        assert_eq!(refused(&NOTHING, span.clone()), nothing);
        for tableau in [&ERROR, &EARLY, &NAN_ERROR] {
            let error = refused(tableau, span.clone());
            assert!(matches!(error, TableauError::Error { which: 0, order: 4, .. }));
        }
        for tableau in [&DENSE, &NAN_DENSE] {
            assert!(matches!(refused(tableau, span.clone()), TableauError::Dense { order: 4, .. }));
        }
    }
    assert!(matches!(refused(&STAGE, steps()), TableauError::Order { order: 3, .. }));
    assert!(
        matches!(refused(&WEIGHT, steps()), TableauError::Order { order: 3, off, .. } if off < 1e-5)
    );
    assert!(matches!(refused(&ORDER, steps()), TableauError::Order { order: 4, .. }));
    // The bound is a residual of 1e-8, and these have 2e-8 and half of 1e-8.
    const ROWS: &[Row] = &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]];
    const FAR: Tableau =
        Tableau::new("far", 3, ROWS, &[(0, 1.0 / 6.0 + 4e-8), (1, 2.0 / 3.0), (2, 1.0 / 6.0)]);
    const NEAR: Tableau =
        Tableau::new("near", 3, ROWS, &[(0, 1.0 / 6.0 + 1e-8), (1, 2.0 / 3.0), (2, 1.0 / 6.0)]);
    assert!(matches!(refused(&FAR, steps()), TableauError::Order { order: 3, .. }));
    assert!(NEAR.check(true).is_ok() && laws::tableau(&NEAR).is_err());
    // A stage that is known only later, and more stages than fit.
    const LATER: Tableau =
        Tableau::new("later", 3, &[&[(1, 0.5)], &[(0, -1.0), (1, 2.0)]], KUTTA_END);
    const NONE: Row = &[];
    const EMPTY: &[Row] = &[NONE; 15];
    const LONG: Tableau = Tableau::new("long", 1, EMPTY, &[(0, 1.0)]);
    assert_eq!(
        refused(&LATER, steps()),
        TableauError::Unknown { name: "later", part: "the stages", row: 0, stage: 1, known: 1 }
    );
    assert_eq!(refused(&LONG, steps()), TableauError::Stages { name: "long", found: 17, most: 16 });
    // A step by hand is refused too.
    let (system, start) = (models::gas(0.5), vector![1.0, 2.0, 2.0, 2.0]);
    for tableau in [&LATER, &LONG] {
        let from = StepStart::first(&system, &start);
        let taken = ExplicitRungeKutta::new(tableau).step(&from, 0.1, &mut Default::default());
        assert!(matches!(taken, Err(StepError::Method { .. })));
    }
}

#[test]
fn steps_follow_a_tolerance_only_where_their_error_is_known() {
    const ALONE: Tableau = Tableau::new("Tsitouras5", 5, STAGES, END);
    let (system, start) = (models::gas(0.5), vector![1.0, 2.0, 2.0, 2.0]);
    let alone = ExplicitRungeKutta::new(&ALONE);
    let error = alone.run(&system, start, Span::until(1.0)).expect_err("it has no error");
    let no_error = TableauError::NoError { name: "Tsitouras5", order: 5 };
    assert!(
        matches!(&error, RunError::Method(error) if error.downcast_ref() == Some(&no_error)),
        "{error}"
    );
    assert!(
        error.trajectory().is_none() && Error::from(error).to_string().contains("`Tableau::error`")
    );
    // Nor is a run resumed by it that follows one.
    let mut steps = METHODS[1].steps(&system, start, Span::until(1.0)).unwrap();
    steps.advance().unwrap();
    let resumed = alone.resume(&system, &steps.checkpoint()).err();
    assert!(matches!(resumed, Some(ResumeError::Method(_))), "{resumed:?}");
    let fixed = alone.run(&system, start, Span::steps(0.1, 10)).expect("steps of one size");
    assert!(fixed.certificate().keeps_energy() && fixed.certificate().local_error.is_none());
}
