//! The four discrete gradients: their laws, their digits, and the order of schemes with them.

mod models;

use metriplectic::fields::{BrokenLaw, ChartPoint, Vector};
use metriplectic::integrators::laws;
use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use metriplectic_studies::problems::flow;
use metriplectic_studies::{AnyGradient, Compared, Order, Table, scientific};
use models::top;
use proptest::prelude::*;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

/// The laws of each of them, on the path of `u` from `x`.
fn each<M: Manifold>(
    f: &impl ScalarField<M>,
    metric: &impl Riemannian<M>,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw> {
    laws::discrete_gradient(&Gonzalez, f, metric, &WeylMidpoint, x, u)?;
    laws::discrete_gradient(&MeanValue, f, metric, &WeylMidpoint, x, u)?;
    laws::discrete_gradient(&SymmetricItohAbe, f, metric, &WeylMidpoint, x, u)
}

fn height(x: &Vector3<Real>) -> Real {
    x.x.powi(2) + x.y.powi(3) * 0.3 + (x.z * x.x).sin() * 0.2 + 2.0
}

/// An energy with compact level sets.
fn bowl(x: &Vector3<Real>) -> Real {
    x.x.powi(2) + x.y.powi(2) * 1.5 + x.z.powi(2) * 0.6 + (x.z * x.x).sin() * 0.2
}

fn turn(r: &Matrix3<Real>) -> Real {
    r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn they_keep_their_laws(seed in any::<u64>(), u in prop::array::uniform3(-0.5..0.5)) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let u = Vector3::from(u);
        prop_assume!(u.xy().norm() > 0.05);
        let x = Euclidean::<3>.random(&mut rng);
        each::<Euclidean<3>>(&height, &Canonical, &x, &u)?;
        let lens = Metric::field(|q: &Vector3<Real>| {
            Matrix3::from_diagonal_element((q.x.sin() * 0.3 + 1.0) * (q.y.cos() * 0.2 + 1.0))
        });
        each::<Euclidean<3>>(&height, &lens, &x, &u)?;
        let x = Sphere::<2>::round().random(&mut rng);
        each::<Sphere<2>>(&height, &Canonical, &x, &u.xy())?;
        let x = Rotations.random(&mut rng);
        each::<Rotations>(&turn, &Canonical, &x, &u)?;
    }
}

#[test]
fn itoh_and_abe_keep_the_mean_value_law_and_are_of_first_order() {
    let (x, u) = (vector![0.3, -0.4, 0.5], vector![0.3, 0.2, -0.4]);
    let broken = laws::discrete_gradient::<Euclidean<3>, _, _, _>(
        &ItohAbe,
        &height,
        &Canonical,
        &WeylMidpoint,
        &x,
        &u,
    );
    // Everything but the second-order consistency of the symmetric ones.
    assert_eq!(broken.unwrap_err().law, "w − dF(z) falls like |d|²");
}

/// Covectors of Gonzalez on pairs of rounded points at distances from 1 to 10⁻¹⁴, to 40 digits.
#[test]
fn the_covector_of_gonzalez_has_its_digits_at_every_distance() {
    let f = |x: &Vector2<Real>| x.x.exp() * x.y.cos() + x.x.powi(3) * x.y + (x.x * x.y + 2.0).ln();
    let file = include_str!("data/gonzalez.json");
    let data: serde_json::Value = serde_json::from_str(file).expect("the data are JSON");
    let mut last: Option<f64> = None;
    let mut worst = 0.0_f64;
    for row in data["rows"].as_array().expect("rows") {
        let pair = |key: &str| -> Vector2<f64> {
            let entries: [f64; 2] = serde_json::from_value(row[key].clone()).expect("two numbers");
            entries.into()
        };
        let (x, y) = (pair("x"), pair("y"));
        let digits: [String; 2] = serde_json::from_value(row["w"].clone()).expect("two numbers");
        let exact = Vector2::from(digits.map(|w| w.parse::<f64>().expect("a number")));
        let w = metriplectic::integrators::discrete_gradient::along::<Euclidean<2>, _, _, _>(
            &Gonzalez,
            &f,
            &Canonical,
            &WeylMidpoint,
            (&x, &(y - x)),
        )
        .expect("the path exists");
        let value = ScalarField::<Euclidean<2>>::at::<f64>(&f, &x).abs();
        let size = exact.norm() + value / (y - x).norm().max(1e-2);
        let error = (w - exact).norm() / (f64::EPSILON * size);
        worst = worst.max(error);
        // No jump where one evaluation takes over from the other.
        if let Some(last) = last {
            assert!(
                error <= 10.0 * last.max(5.0),
                "{error} after {last} at |d| = {}",
                (y - x).norm()
            );
        }
        last = Some(error);
    }
    println!("worst error {worst:.2} ε (|dF| + |F|/max(|d|, 10⁻²))");
    assert!(worst <= 50.0);
}

/// The fitted order of a scheme on a system, with its errors.
fn order<Y: Metriplectic>(
    (gradient, finer): (AnyGradient, u32),
    system: &Y,
    start: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    exact: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
) -> (Order, Vec<f64>)
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let counts = [20, 40, 80, 160].map(|n| n * finer);
    let (steps, errors): (Vec<f64>, Vec<f64>) = counts
        .iter()
        .map(|&n| {
            let h = 2.0 / f64::from(n);
            let scheme = Scheme::new(WeylMidpoint).gradient(gradient);
            let run =
                scheme.run(system, start.clone(), Span::steps(h, n as usize)).expect("it runs");
            assert!(run.certificate().keeps_energy(), "{gradient:?}: {}", run.certificate());
            let exact = Y::Manifold::entries(exact);
            let end = Y::Manifold::entries(&run.last().point);
            let square = end.iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            (h, square.sqrt())
        })
        .unzip();
    (Order::fit(&steps, &errors).expect("an order"), errors)
}

/// Orders of all four on a system by both schemes, as rows of a table.
fn all<Y: Metriplectic>(
    table: &mut Table<5>,
    name: &str,
    system: &Y,
    start: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let exact = flow(system, start, 2.0).expect("an exact flow");
    for (gradient, finer, expected) in [
        (AnyGradient::Gonzalez, 1, 2.0),
        (AnyGradient::MeanValue, 1, 2.0),
        (AnyGradient::SymmetricItohAbe, 1, 2.0),
        (AnyGradient::ItohAbe, 16, 1.0),
    ] {
        for (law, system) in [
            (format!("{:?}", system.second_law()), Compared::given(system)),
            ("Published".to_owned(), Compared::published(system)),
        ] {
            let (order, errors) = order((gradient, finer), &system, start, &exact);
            let error = scientific(errors[3]);
            table.row([name.to_owned(), format!("{gradient:?}"), law, error, order.to_string()]);
            assert!(order.agrees(expected, 0.05), "{name}, {gradient:?}: {order}");
        }
    }
}

/// The body on so(3)* with a Casimir of fourth degree for its entropy.
fn quartic(friction: f64) -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(bowl)
        .entropy(|p: &Vector3<Real>| p.norm_squared().powi(2) * 0.25)
        .dissipation(Scaled(friction, MetricDissipation))
        .build()
        .expect("the parts make a system")
}

#[test]
fn every_scheme_has_its_order() {
    let mut table = Table::new(["system", "discrete gradient", "second law", "error", "order"]);
    let hill = |x: &Vector3<Real>| x.z + x.x * x.y * 0.3;
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let sphere = || System::on(Sphere::<2>::round()).energy(top);
    all(&mut table, "relaxation, S²", &sphere().entropy(hill).build().unwrap(), &start);
    all(&mut table, "spinning top, S²", &sphere().bracket(AreaForm).build().unwrap(), &start);
    all(&mut table, "quartic Casimir, so(3)*", &quartic(0.1), &vector![0.4, -0.6, 0.5]);
    let rotations = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(turn)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .dissipation(MetricDissipation::scaled(|_: &Matrix3<Real>| Real::from(0.1)))
        .build()
        .unwrap();
    let attitude = metriplectic::manifolds::rotations::exp(&vector![0.3, -0.2, 0.5]);
    all(&mut table, "Nambu, SO(3)", &rotations, &attitude);
    println!("{table}");
}

#[test]
fn the_other_gradients_keep_both_laws_over_many_steps() {
    let quartic = quartic(1e-3);
    let quartic = Compared::given(&quartic);
    let (start, span) = (vector![0.4, -0.6, 0.5], Span::steps(0.1, 10_000).at_most(2));
    let runs = [AnyGradient::MeanValue, AnyGradient::ItohAbe, AnyGradient::SymmetricItohAbe]
        .map(|gradient| Scheme::new(WeylMidpoint).gradient(gradient).run(&quartic, start, span));
    for run in runs {
        let run = run.expect("it runs");
        let certificate = run.certificate();
        println!("{certificate}\n");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert!(certificate.effort.splits == 0);
    }
}

#[test]
fn a_centre_is_all_there_is_at_rest() {
    // A path without length has the differential itself.
    let x = vector![0.3, -0.4, 0.5];
    let df =
        metriplectic::fields::differential::<Euclidean<3>, f64>(&height, &ChartPoint::centre(&x));
    let w = metriplectic::integrators::discrete_gradient::along::<Euclidean<3>, _, _, _>(
        &Gonzalez,
        &height,
        &Canonical,
        &WeylMidpoint,
        (&x, &Vector3::zeros()),
    );
    assert!((w.expect("the path exists") - df).norm() <= 4.0 * f64::EPSILON * df.norm());
}
