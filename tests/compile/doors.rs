//! Both doors into the library: every kind of value that is a field, and what the compiler says
//! about those that are not.

use std::marker::PhantomData;
use std::ops::Mul;
use std::thread;

use metriplectic::fields::ChartPoint;
use metriplectic::prelude::*;

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const METRIC: Matrix3<f64> = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1.0, -0.2, 0.0, -0.2, 3.0);

/// What is written for a scalar field in a box, and for one behind a pointer.
type Boxed = Box<dyn Fn(&Vector3<Real>) -> Real>;
type Shared = Box<dyn Fn(&Vector3<Real>) -> Real + Send + Sync>;
type Pointer = fn(&Vector3<Real>) -> Real;

/// The same for a matrix field.
type BoxedMatrix = Box<dyn Fn(&Vector3<Real>) -> Matrix3<Real>>;
type SharedMatrix = Box<dyn Fn(&Vector3<Real>) -> Matrix3<Real> + Send + Sync>;
type MatrixPointer = fn(&Vector3<Real>) -> Matrix3<Real>;

/// Where the velocity leads in a few steps of Euler's method, which compile in a tenth of the time of a run.
fn end<Y>(system: &Y) -> Result<Vector3<f64>, Error>
where
    Y: Metriplectic<Manifold = LieDual<3>>,
{
    (0..10).try_fold(START, |x, _| Ok(x + system.velocity(&ChartPoint::centre(&x))? * 0.1))
}

/// Where the free rigid body leads with this energy and this entropy.
fn end_with(
    energy: impl ScalarField<LieDual<3>>,
    entropy: impl ScalarField<LieDual<3>>,
) -> Result<Vector3<f64>, Error> {
    end(&System::on(LieDual::so3()).energy(energy).entropy(entropy).build()?)
}

/// Where the free rigid body leads with this metric and this Poisson tensor.
fn end_with_matrices(
    metric: impl MatrixField<LieDual<3>>,
    tensor: impl MatrixField<LieDual<3>>,
) -> Result<Vector3<f64>, Error> {
    let system = System::on(LieDual::so3())
        .metric(Metric::field(metric))
        .bracket(Poisson::field(tensor))
        .energy(kinetic)
        .entropy(casimir)
        .build()?;
    end(&system)
}

fn kinetic(p: &Vector3<Real>) -> Real {
    p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5
}

fn casimir(p: &Vector3<Real>) -> Real {
    p.norm_squared() * 0.5
}

fn metric(_: &Vector3<Real>) -> Matrix3<Real> {
    METRIC.cast()
}

fn hat(p: &Vector3<Real>) -> Matrix3<Real> {
    p.cross_matrix()
}

fn kinetic_of(inertia: Vector3<f64>) -> impl Fn(&Vector3<Real>) -> Real {
    move |p| p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
}

fn metric_of(g: Matrix3<f64>) -> impl Fn(&Vector3<Real>) -> Matrix3<Real> {
    move |_| g.cast()
}

/// The kinetic energy of a body, behind door 1.
struct Body {
    inertia: Vector3<f64>,
}

impl ScalarField<LieDual<3>> for Body {
    fn at<D: Scalar>(&self, p: &Vector3<D>) -> D {
        (p.x * p.x / self.inertia.x + p.y * p.y / self.inertia.y + p.z * p.z / self.inertia.z) * 0.5
    }
}

/// Half the square of the distance to the origin, behind door 1, on more than one manifold.
struct HalfSquare;

impl ScalarField<LieDual<3>> for HalfSquare {
    fn at<D: Scalar>(&self, p: &Vector3<D>) -> D {
        p.dot(p) * 0.5
    }
}

impl<const N: usize> ScalarField<Euclidean<N>> for HalfSquare {
    fn at<D: Scalar>(&self, x: &SVector<D, N>) -> D {
        x.dot(x) * 0.5
    }
}

/// A constant matrix, behind door 1.
struct Frozen(Matrix3<f64>);

impl MatrixField<LieDual<3>> for Frozen {
    fn at<D: Scalar>(&self, _: &Vector3<D>) -> Matrix3<D> {
        self.0.cast()
    }
}

/// The matrix of `p ×`, behind door 1.
struct Hat;

impl MatrixField<LieDual<3>> for Hat {
    fn at<D: Scalar>(&self, p: &Vector3<D>) -> Matrix3<D> {
        let o = D::zero();
        matrix![o, -p.z, p.y; p.z, o, -p.x; -p.y, p.x, o]
    }
}

#[test]
fn every_kind_of_closure_is_a_scalar_field() -> Result<(), Error> {
    let expected = end_with(kinetic, casimir)?;
    assert!((expected - START).norm() > 0.01, "nothing moves: {expected}");

    let inertia = INERTIA;
    let half = 0.5;
    let captured =
        move |p: &Vector3<Real>| p.component_mul(p).component_div(&inertia.cast()).sum() * half;
    assert_eq!(end_with(captured, move |p: &Vector3<Real>| p.norm_squared() * half)?, expected);

    let borrowing =
        |p: &Vector3<Real>| p.component_mul(p).component_div(&inertia.cast()).sum() * half;
    assert_eq!(end_with(borrowing, |p: &Vector3<Real>| p.norm_squared() * half)?, expected);
    let (energy, entropy) = (&borrowing, &casimir);
    assert_eq!(end_with(energy, entropy)?, expected);

    let boxed: Boxed = Box::new(kinetic_of(inertia));
    let boxed_entropy: Boxed = Box::new(casimir);
    assert_eq!(end_with(boxed, boxed_entropy)?, expected);
    let unsized_energy: &dyn Fn(&Vector3<Real>) -> Real = &kinetic;
    assert_eq!(end_with(unsized_energy, casimir)?, expected);

    assert_eq!(end_with(kinetic_of(inertia), casimir)?, expected);
    let pointers: [Pointer; 2] = [kinetic, casimir];
    assert_eq!(end_with(pointers[0], pointers[1])?, expected);
    Ok(())
}

#[test]
fn a_system_of_shareable_boxes_runs_on_another_thread() -> Result<(), Error> {
    let (energy, entropy): (Shared, Shared) = (Box::new(kinetic_of(INERTIA)), Box::new(casimir));
    let body = System::on(LieDual::so3()).energy(energy).entropy(entropy).build()?;
    let run =
        || WeylMidpoint.run(&body, START, Span::steps(0.1, 10)).expect("it runs").last().point;
    let elsewhere = thread::scope(|scope| scope.spawn(run).join().unwrap());
    assert_eq!(elsewhere, run());
    Ok(())
}

#[test]
fn every_kind_of_closure_is_a_matrix_field() -> Result<(), Error> {
    let expected = end_with_matrices(metric, hat)?;
    assert!((expected - end_with(kinetic, casimir)?).norm() > 1e-3, "the metric plays no part");

    let (g, sign) = (METRIC, 1.0);
    let captured = move |_: &Vector3<Real>| g.cast::<Real>();
    let tensor = move |p: &Vector3<Real>| p.cross_matrix() * Real::from(sign);
    assert_eq!(end_with_matrices(captured, tensor)?, expected);

    let borrowing = |_: &Vector3<Real>| g.cast::<Real>();
    let tensor = |p: &Vector3<Real>| p.cross_matrix() * Real::from(sign);
    assert_eq!(end_with_matrices(borrowing, tensor)?, expected);
    let (metric_ref, tensor_ref) = (&borrowing, &tensor);
    assert_eq!(end_with_matrices(metric_ref, tensor_ref)?, expected);

    let boxed: BoxedMatrix = Box::new(metric_of(g));
    let shared: SharedMatrix = Box::new(hat);
    assert_eq!(end_with_matrices(boxed, shared)?, expected);

    assert_eq!(end_with_matrices(metric_of(g), hat)?, expected);
    let pointers: [MatrixPointer; 2] = [metric, hat];
    assert_eq!(end_with_matrices(pointers[0], pointers[1])?, expected);
    Ok(())
}

/// The round-off of ten steps.
const ROUND_OFF: f64 = 1e-13;

#[test]
fn both_doors_stand_side_by_side_in_one_system() -> Result<(), Error> {
    let expected = end_with(kinetic, casimir)?;
    let body = || Body { inertia: INERTIA };
    for found in [
        end_with(body(), casimir)?,
        end_with(kinetic, HalfSquare)?,
        end_with(body(), HalfSquare)?,
        end_with_matrices(Frozen(Matrix3::identity()), hat)?,
    ] {
        assert!((found - expected).norm() < ROUND_OFF, "{found} is not {expected}");
    }

    let expected = end_with_matrices(metric, hat)?;
    for found in [
        end_with_matrices(Frozen(METRIC), hat)?,
        end_with_matrices(metric, Hat)?,
        end_with_matrices(Frozen(METRIC), Hat)?,
    ] {
        assert!((found - expected).norm() < ROUND_OFF, "{found} is not {expected}");
    }
    Ok(())
}

#[test]
fn both_doors_are_open_on_euclidean_space_too() -> Result<(), Error> {
    let canonical = Poisson::constant(matrix![0.0, 1.0; -1.0, 0.0])?;
    let by_hand = System::on(Euclidean::<2>).bracket(canonical).energy(HalfSquare).build()?;
    let closure = System::on(Euclidean::<2>)
        .bracket(canonical)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()?;
    let start = vector![0.3, -0.7];
    let span = Span::steps(0.1, 10);
    let expected = WeylMidpoint.run(&closure, start, span)?.last().point;
    let found = WeylMidpoint.run(&by_hand, start, span)?.last().point;
    assert!((expected - start).norm() > 0.1 && (found - expected).norm() < ROUND_OFF);
    Ok(())
}

/// Whether `f64 * T` is an operation: the first constant exists only if it is, and is then
/// preferred.
struct OnTheLeft<T>(PhantomData<T>);

impl<T> OnTheLeft<T>
where
    f64: Mul<T>,
{
    const COMPILES: bool = true;
}

trait Otherwise {
    const COMPILES: bool = false;
}

impl<T> Otherwise for OnTheLeft<T> {}

#[test]
fn a_number_stands_on_the_right_of_a_dual_number() {
    // The documentation of `Scalar` says so; if this changes, it may say less.
    assert_eq!((OnTheLeft::<f64>::COMPILES, OnTheLeft::<Real>::COMPILES), (true, false));
    assert_eq!(Real::from(3.0) * 0.5, Real::from(1.5));
}

#[test]
fn erased_closures_have_one_type_and_the_bits_of_the_closures() {
    let round = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let long = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.25 + p.y * p.y * 0.5 + p.z * p.z)
        .build()
        .unwrap();
    let erased = [round.clone().erased(), long.clone().erased()];
    let span = || Span::steps(0.1, 20);
    let last = |run: Trajectory<LieDual<3>>| run.last().point;
    let ends = [
        last(WeylMidpoint.run(&round, START, span()).unwrap()),
        last(WeylMidpoint.run(&long, START, span()).unwrap()),
    ];
    for (body, end) in erased.iter().zip(ends) {
        let same = last(WeylMidpoint.run(body, START, span()).unwrap());
        assert_eq!(same.map(f64::to_bits), end.map(f64::to_bits));
    }
}

/// The messages are part of the interface: the first lines say what to write instead.
/// `TRYBUILD=overwrite cargo test -p metriplectic-compile-tests` renews the snapshots.
#[test]
fn the_compiler_explains_what_is_not_a_field() {
    let cases = trybuild::TestCases::new();
    cases.pass("doors/a_closure_is_a_field.rs");
    cases.pass("doors/a_type_of_your_own_has_every_order.rs");
    cases.compile_fail("doors/bracket_*.rs");
    cases.compile_fail("doors/closure_*.rs");
    cases.compile_fail("doors/dissipation_*.rs");
    cases.compile_fail("doors/energy_*.rs");
    cases.compile_fail("doors/force_*.rs");
    cases.compile_fail("doors/matrix_*.rs");
    cases.compile_fail("doors/product_*.rs");
}

/// The first line of a message without the paths of its types.
fn short(message: &str) -> String {
    let mut words = message.to_owned();
    for path in
        ["metriplectic::prelude::", "metriplectic::nalgebra::", "num_dual::datatypes::hyperdual::"]
    {
        words = words.replace(path, "");
    }
    while let Some(start) = words.find("{closure@") {
        let end = words[start..].find('}').map_or(words.len(), |at| start + at + 1);
        words.replace_range(start..end, "{closure}");
    }
    words
}

/// A reader who searches for a message finds it as a heading of the book. `…` stands for the rest of it.
#[test]
fn every_message_is_a_heading_of_the_book() {
    let page = include_str!("../../book/src/compiler_messages.md");
    let headings: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix("## ")).collect();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/doors");
    let mut messages = 0;
    for entry in std::fs::read_dir(folder).expect("the folder of the messages") {
        let path = entry.expect("a file").path();
        if path.extension().is_some_and(|extension| extension == "stderr") {
            let text = std::fs::read_to_string(&path).expect("a message");
            let message = short(text.lines().next().expect("a first line"));
            let found = headings.iter().any(|heading| {
                let beginning = heading.split('…').next().unwrap_or(heading);
                message.starts_with(beginning)
            });
            assert!(found, "{} is no heading: {message}", path.display());
            messages += 1;
        }
    }
    assert!(messages >= 12, "{messages} messages");
}
