//! Parameters in the tensors of a system: metric, bracket, dissipation and force.

use metriplectic::dynamics::{Parametrised, Point};
use metriplectic::fields::Space;
use metriplectic::integrators::{LinearisedAlong, TangentError};
use metriplectic::prelude::*;
use nalgebra::{SVector, vector};

use crate::{compared, differences, off, tables};

/// The manifold of a family.
type Of<Y, const P: usize> = <<Y as Parametrised<P>>::System as Metriplectic>::Manifold;

/// Compares the columns of the parameters and of the start with differences of order 6 of runs with the same steps.
fn accept<Y, M, const P: usize>(
    name: &str,
    family: &Y,
    method: M,
    (x0, theta): (&Point<Y::System>, SVector<f64, P>),
    span: Span,
) where
    Y: Parametrised<P>,
    Euclidean<P>: Space<Point<f64> = SVector<f64, P>>,
    M: Copy + Stepper<Y::System> + LinearisedAlong<Y::System>,
{
    let system = family.at_parameters(theta);
    let [along_start, law] = compared(&system, method, x0, &span, 2e-3);
    let end = |t: &SVector<f64, P>| {
        method.run(&family.at_parameters(*t), x0.clone(), span).expect("a run").last().point.clone()
    };
    let differences = differences::<Euclidean<P>, Of<Y, P>>(&theta, 2e-3, end);
    let run = method.tangent(&system, x0.clone(), span).expect("a tangent");
    let along = off(&run.last().along_parameters(), &differences);
    println!(
        "{name}: x₀ {along_start:.1e}, θ {along:.1e} of {:.1e}, law {law:.1e}",
        differences.amax()
    );
    assert!(along_start < 1e-9 && along < 1e-9 && law < 1e-11, "{name}");
    // A column of zeros would be a parameter that the tangent forgets.
    assert!((0..P).all(|k| differences.column(k).amax() > 1e-6), "{name}: {differences:.1e}");
}

/// Bodies with five parameters: of the bracket, its entropy, the metric and the friction.
fn bracket(x: &Vector3<Real>, t: &Parameters<Real>) -> Matrix3<Real> {
    // A density times the tensor of a quadratic Casimir.
    Vector3::new(x.x, x.y * t[0], x.z).cross_matrix() * (x.x * t[1]).exp()
}

fn metric(x: &Vector3<Real>, t: &Parameters<Real>) -> Matrix3<Real> {
    let corner = x.x * x.y * 0.2;
    let mut g = Matrix3::from_diagonal(&Vector3::new(
        x.x * x.x * t[3] + t[2],
        (x.y * 0.4).exp(),
        1.0.into(),
    ));
    (g[(0, 1)], g[(1, 0)]) = (corner, corner);
    g
}

fn energy(x: &Vector3<Real>) -> Real {
    x.x * x.x * 0.25 + x.y * x.y * 0.5 + x.z.powi(4) * 0.1
}

fn entropy(x: &Vector3<Real>, t: &Parameters<Real>) -> Real {
    (x.x * x.x + x.y * x.y * t[0] + x.z * x.z) * 0.5
}

fn kappa(x: &Vector3<Real>, t: &Parameters<Real>) -> Real {
    (x.x * x.x + 1.0) * t[4]
}

type Parameters<D> = SVector<D, 5>;

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);

fn theta() -> Parameters<f64> {
    vector![1.7, 0.3, 1.3, 0.7, 0.3]
}

#[test]
fn a_member_of_a_family_is_verified_and_has_its_tables() {
    let family = Family::on(LieDual::so3())
        .parameters(["skew"])
        .energy(|p: &Vector3<Real>, _: &Vector1<Real>| {
            p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector1<Real>| p.norm_squared() * 0.5 + p.x * t.x)
        .build()
        .unwrap();
    let start = vector![0.4, -1.0, 0.3];
    let (sound, skew) = (family.at(vector![0.0]), family.at(vector![0.1]));
    sound.verify(&start, 0.1).unwrap();
    let refused = |error| matches!(error, ModelError::EntropyNotCasimir { .. });
    assert!(refused(skew.verify(&start, 0.1).unwrap_err()));
    assert!(refused(skew.verified(&start).err().unwrap()));
    let verified = sound.verified(&start).unwrap();
    let run = || Ok(DormandPrince8.run(&sound, start, Span::steps(0.1, 20))?);
    let cheap = DormandPrince8.run(&verified, start, Span::steps(0.1, 20)).unwrap();
    let whole: Result<_, Error> = run();
    assert_eq!(cheap.states(), whole.unwrap().states());
    tables::are_those_of_the_run(&sound, run);
}

#[test]
fn parameters_of_tensors_are_columns() {
    let family = Family::on(Euclidean::<3>)
        .parameters(["ratio", "rate", "a", "b", "friction"])
        .field_metric(metric)
        .field_bracket(bracket)
        .metric_dissipation(kappa)
        .energy(|x: &Vector3<Real>, _: &Parameters<Real>| energy(x))
        .entropy(entropy)
        .build()
        .unwrap();
    let at = (&START, theta());
    accept("chart midpoint", &family, Scheme::new(ChartMidpoint), at, Span::steps(0.1, 20));
    accept("geodesics", &family, Scheme::new(WeylMidpoint), at, Span::steps(0.1, 5));
    accept("explicit", &family, DormandPrince8, at, Span::steps(0.1, 20));

    // The family at θ has the bits of closures that capture θ.
    let t = theta().cast::<Real>();
    let captured = System::on(Euclidean::<3>)
        .metric(Metric::field(|x: &Vector3<Real>| metric(x, &t)))
        .bracket(Poisson::field(|x: &Vector3<Real>| bracket(x, &t)))
        .dissipation(MetricDissipation::scaled(|x: &Vector3<Real>| kappa(x, &t)))
        .energy(energy)
        .entropy(|x: &Vector3<Real>| entropy(x, &t))
        .build()
        .unwrap();
    let (chart, span) = (Scheme::new(ChartMidpoint), Span::steps(0.1, 20));
    let runs = (chart.run(&captured, START, span), chart.run(&family.at(theta()), START, span));
    assert_eq!(runs.0.unwrap().states(), runs.1.unwrap().states());

    // Another θ, at which the metric is indefinite.
    let mut bad = theta();
    bad[2] = -1.3;
    let error = chart.tangent(&family.at(bad), START, span).err().unwrap();
    let text = error.to_string();
    assert!(matches!(error, TangentError::Run(_)) && text.contains("not positive"), "{text}");
}

/// The area form of a metric uses it, so that it depends on its parameters too.
#[test]
fn parameters_of_a_metric_move_what_uses_it() {
    let metric = |n: &Vector3<Real>, t: &Vector2<Real>| {
        Matrix3::from_diagonal(&Vector3::new(n.x * n.x * t.x + 1.0, t.y, (n.x * 0.5).exp()))
    };
    let start: (&Vector3<f64>, _) = (&vector![0.36, 0.48, 0.8], vector![0.6, 1.4]);
    let sphere = Family::on(Sphere::<2>::round())
        .parameters(["stretch", "width"])
        .field_metric(metric)
        .bracket(AreaForm)
        .energy(|n: &Vector3<Real>, _: &Vector2<Real>| n.x * n.x * 0.5 + n.z.powi(3) * 0.4)
        .build()
        .unwrap();
    accept("area form", &sphere, Scheme::new(WeylMidpoint), start, Span::steps(0.1, 5));
}

/// A skew tensor without the promise of Jacobi's identity is taken, and one with it is refused.
#[test]
fn parameters_of_an_almost_poisson_bracket_are_columns() {
    let skewed = |x: &Vector3<Real>, t: &Vector2<Real>| {
        Vector3::new(x.y * x.y * t.x, x.x + t.y, x.z * x.x).cross_matrix()
    };
    let family = || Family::on(Euclidean::<3>).parameters(["bend", "shift"]);
    let energy = |x: &Vector3<Real>, _: &Vector2<Real>| energy(x);
    let almost = family().almost_field_bracket(skewed).energy(energy).build().unwrap();
    let theta = vector![1.7, 0.3];
    accept("almost Poisson", &almost, DormandPrince5, (&START, theta), Span::steps(0.1, 20));
    let broken = family().field_bracket(skewed).energy(energy).build().unwrap();
    assert!(DormandPrince5.run(&broken.at(theta), START, Span::steps(0.1, 1)).is_err());
}

/// A dissipation of the state and of `w`, and one of the state alone, which the metric with its parameters projects.
#[test]
fn parameters_of_a_dissipation_are_columns() {
    let heat = Family::on(Euclidean::<2>)
        .parameters(["conductance", "bend"])
        .field_dissipation(|x: &Vector2<Real>, w: &Vector2<Real>, t: &Vector2<Real>| {
            let b = Vector2::new(w.y, -w.x);
            b * b.transpose() * (t.x + x.x * t.y)
        })
        .energy(|e: &Vector2<Real>, _: &Vector2<Real>| e.x + e.y)
        .entropy(|e: &Vector2<Real>, _: &Vector2<Real>| e.x.ln() + e.y.ln() * 2.0)
        .build()
        .unwrap();
    let start: (&Vector2<f64>, _) = (&vector![1.0, 1.5], vector![0.4, 0.2]);
    accept("heat", &heat, Scheme::new(WeylMidpoint), start, Span::steps(0.1, 20));
    let friction = |x: &Vector2<Real>| {
        Matrix2::new(x.x * x.x + 1.0, Real::from(0.3), Real::from(0.3), Real::from(0.8))
    };
    let plane = Family::on(Euclidean::<2>)
        .parameters(["a", "b", "c"])
        .field_metric(g)
        .dissipation(ProjectedDissipation(friction))
        .energy(|x: &Vector2<Real>, _: &Vector3<Real>| h(x))
        .entropy(|x: &Vector2<Real>, _: &Vector3<Real>| s(x))
        .build()
        .unwrap();
    let at = (&PLANE, COEFFICIENTS);
    accept("projected", &plane, Scheme::new(ChartMidpoint), at, Span::steps(0.1, 20));
}

#[test]
fn parameters_of_a_force_are_columns() {
    let force = |xi: &Vector3<Real>, t: &Vector2<Real>| {
        Vector3::new(-xi.y * t.x, xi.x * t.x, xi.z * xi.x * t.y) * xi.norm_squared()
    };
    let body = Family::on(LieDual::so3())
        .parameters(["swirl", "lift"])
        .energy(|p: &Vector3<Real>, _: &Vector2<Real>| energy(p))
        .force(force)
        .build()
        .unwrap();
    let theta = vector![0.4, 0.2];
    let (weyl, span) = (Scheme::new(WeylMidpoint), Span::steps(0.1, 20));
    accept("force", &body, weyl, (&START, theta), span);
    let captured = System::on(LieDual::so3())
        .energy(energy)
        .force(move |xi: &Vector3<Real>| force(xi, &theta.cast()))
        .build()
        .unwrap();
    let runs = (weyl.run(&captured, START, span), weyl.run(&body.at(theta), START, span));
    assert_eq!(runs.0.unwrap().states(), runs.1.unwrap().states());
}

/// A metric on the plane with three coefficients.
fn g(x: &Vector2<Real>, t: &Vector3<Real>) -> Matrix2<Real> {
    let corner = x.x * x.y * 0.2;
    Matrix2::new(t.x + x.x * x.x * t.y, corner, corner, (x.y * t.z).exp())
}

fn h(x: &Vector2<Real>) -> Real {
    x.x * x.x * 0.5 + x.y.powi(4) * 0.25
}

fn s(x: &Vector2<Real>) -> Real {
    x.x * 0.7 + (x.y * x.x).sin() * 0.3
}

const PLANE: Vector2<f64> = Vector2::new(0.8, -0.6);
const COEFFICIENTS: Vector3<f64> = Vector3::new(1.3, 0.7, 0.4);

/// The tangent of a metric has no unit: lengths of an atom and of a planet, with coefficients to match.
#[test]
fn parameters_of_a_metric_have_any_unit() {
    let along = |length: f64, unit: f64| {
        let family = Family::on(Euclidean::<2>)
            .parameters(["a", "b", "c"])
            .field_metric(move |x: &Vector2<Real>, t: &Vector3<Real>| {
                g(&(x / Real::from(length)), &(t / Real::from(unit)))
            })
            .energy(move |x: &Vector2<Real>, _: &Vector3<Real>| h(&(x / Real::from(length))))
            .entropy(move |x: &Vector2<Real>, _: &Vector3<Real>| s(&(x / Real::from(length))))
            .build()
            .unwrap();
        let span = Span::steps(0.1 * length.powi(4), 4);
        let system = family.at(COEFFICIENTS * unit);
        let run = Scheme::new(WeylMidpoint).tangent(&system, PLANE * length, span).unwrap();
        run.last().along_parameters() * (unit / length)
    };
    let one = along(1.0, 1.0);
    for (length, unit) in [(1e-9, 1e6), (1e11, 1e-8), (1e-9, 1e-12), (1e11, 1e12)] {
        let error = off(&along(length, unit), &one);
        println!("lengths of {length:e}, coefficients of {unit:e}: {error:.1e}");
        assert!(error < 1e-11);
    }
}
