//! Random input without sense: fields of random expressions, random brackets and metrics, numbers that
//! are none. What comes back is a value, a certificate or a typed error; never a panic, never a run
//! without end.
//!
//! The usual tests try a thousand inputs, the same each time. `just fuzz` goes on for ten minutes with new
//! ones, and prints what came of them; `FUZZ_SECONDS` is the time of each search.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::{Duration, Instant};

use metriplectic::dynamics::BuildError;
use metriplectic::fields::{ChartPoint, Form, Space};
use metriplectic::integrators::{Newton, RunError, Scheme};
use metriplectic::manifolds::{MetricAt, MetricError, Riemannian, rotations};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseResult, TestRunner};

/// Longer than any of these inputs should take, on a busy machine and with debug assertions.
const PATIENCE: Duration = Duration::from_secs(300);

/// Numbers as they come: most of them tame, some at the ends of the range, some none.
fn number() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![
        12 => -2.0..2.0,
        2 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 3.0]),
        1 => prop::sample::select(vec![
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            -1e200,
            1e100,
            1e-100,
            f64::MIN_POSITIVE,
            5e-324,
        ]),
    ]
}

/// An expression in the entries of a point.
#[derive(Clone, Debug)]
enum Tree {
    Number(f64),
    Entry(usize),
    Sum(Box<Self>, Box<Self>),
    Product(Box<Self>, Box<Self>),
    Quotient(Box<Self>, Box<Self>),
    Square(Box<Self>),
    Power(Box<Self>, f64),
    Sine(Box<Self>),
    Exponential(Box<Self>),
    Logarithm(Box<Self>),
    Root(Box<Self>),
}

impl Tree {
    fn at(&self, x: &[Real]) -> Real {
        match self {
            Self::Number(c) => Real::from(*c),
            Self::Entry(i) => x[i % x.len()],
            Self::Sum(a, b) => a.at(x) + b.at(x),
            Self::Product(a, b) => a.at(x) * b.at(x),
            Self::Quotient(a, b) => a.at(x) / b.at(x),
            Self::Square(a) => a.at(x).powi(2),
            Self::Power(a, p) => a.at(x).powf(*p),
            Self::Sine(a) => a.at(x).sin(),
            Self::Exponential(a) => a.at(x).exp(),
            Self::Logarithm(a) => a.at(x).ln(),
            Self::Root(a) => a.at(x).sqrt(),
        }
    }

    /// The field of this expression.
    fn field<const R: usize, const C: usize>(self) -> impl Fn(&SMatrix<Real, R, C>) -> Real {
        move |x| self.at(x.as_slice())
    }
}

fn tree() -> impl Strategy<Value = Tree> + Clone {
    let leaf = prop_oneof![
        1 => number().prop_map(Tree::Number),
        3 => (0..9_usize).prop_map(Tree::Entry),
    ];
    leaf.prop_recursive(4, 16, 2, |part| {
        let one = part.clone().prop_map(Box::new);
        let two = (one.clone(), one.clone());
        prop_oneof![
            4 => two.clone().prop_map(|(a, b)| Tree::Sum(a, b)),
            4 => two.clone().prop_map(|(a, b)| Tree::Product(a, b)),
            1 => two.prop_map(|(a, b)| Tree::Quotient(a, b)),
            4 => one.clone().prop_map(Tree::Square),
            1 => (one.clone(), number()).prop_map(|(a, p)| Tree::Power(a, p)),
            2 => one.clone().prop_map(Tree::Sine),
            1 => one.clone().prop_map(Tree::Exponential),
            1 => one.clone().prop_map(Tree::Logarithm),
            1 => one.prop_map(Tree::Root),
        ]
    })
}

/// Expressions that belong to a system more often: a random one beside the sum of the squares.
fn tame_tree() -> impl Strategy<Value = Tree> + Clone {
    let squares = (0..4).map(|i| Box::new(Tree::Square(Box::new(Tree::Entry(i)))));
    let sum = squares.reduce(|a, b| Box::new(Tree::Sum(a, b))).expect("four squares");
    prop_oneof![
        2 => Just((*sum).clone()),
        3 => tree().prop_map(move |t| Tree::Sum(sum.clone(), Box::new(Tree::Sine(Box::new(t))))),
        3 => tree(),
    ]
}

fn column<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop_oneof![
        9 => prop::array::uniform::<_, N>(-1.5..1.5_f64),
        1 => prop::array::uniform::<_, N>(number().boxed()),
    ]
    .prop_map(SVector::from)
}

fn step_size() -> impl Strategy<Value = f64> {
    prop_oneof![6 => 1e-3..0.3, 2 => 0.3..100.0, 1 => number()]
}

/// Whether squares of the components leave the range of numbers.
fn is_huge(v: &Vector2<f64>) -> bool {
    !v.norm().is_finite() || v.norm() >= 1e100
}

/// How often each outcome came.
#[derive(Clone, Default)]
struct Tally(Rc<RefCell<BTreeMap<String, usize>>>);

impl Tally {
    fn count(&self, outcome: impl Into<String>) {
        *self.0.borrow_mut().entry(outcome.into()).or_default() += 1;
    }
}

/// Tries random inputs, a few hundred or as many as there are seconds for.
fn search<S: Strategy>(
    name: &str,
    strategy: &S,
    cases: u32,
    test: impl Fn(S::Value, &Tally) -> TestCaseResult,
) {
    let seconds = std::env::var("FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let (begin, tally, mut tried) = (Instant::now(), Tally::default(), 0);
    loop {
        let usual = Config { cases, failure_persistence: None, ..Config::default() };
        let config = match seconds {
            Some(_) => Config { rng_seed: RngSeed::Random, ..usual },
            None => usual,
        };
        let outcome = TestRunner::new(config).run(strategy, |input| {
            let clock = Instant::now();
            let result = test(input, &tally);
            prop_assert!(clock.elapsed() < PATIENCE, "it took {:?}", clock.elapsed());
            result
        });
        if let Err(failure) = outcome {
            panic!("{name}: {failure}");
        }
        tried += cases;
        if seconds.is_none_or(|seconds| begin.elapsed().as_secs_f64() >= seconds) {
            break;
        }
    }
    println!("{name}: {tried} inputs, {:?}", tally.0.borrow());
    if seconds.is_none() {
        Claim::new(Guarantee::RandomInput, format!("{name}, {tried} inputs"), "WeylMidpoint")
            .record("0 panics, 0 states without a number", "0");
    }
}

/// Verifies a model and steps it; whatever comes back is finite, or an error with a message.
fn step<Y: Metriplectic>(
    system: &Y,
    x0: <Y::Manifold as Space>::Point<f64>,
    (h, adaptive): (f64, bool),
    tally: &Tally,
) -> TestCaseResult
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    // A start without a solution is given up sooner than usual.
    let scheme = Scheme { splits: 3, ..Scheme::new(WeylMidpoint) }
        .newton(Newton { iterations: 12, ..Newton::default() });
    let (state, certificate, failure) = if adaptive {
        let mut steps = match scheme.steps(system, x0, Span::until(h).tolerance(1e-2)) {
            Ok(steps) => steps,
            Err(error) => return refused(&error, tally),
        };
        let failure = (0..5).find_map(|_| steps.advance().err());
        (steps.state().clone(), steps.certificate().clone(), failure)
    } else {
        match scheme.run(system, x0, Span::steps(h, 5)) {
            Ok(run) => (run.last().clone(), run.certificate().clone(), None),
            Err(RunError::Step { cause, trajectory }) => {
                (trajectory.last().clone(), trajectory.certificate().clone(), Some(cause))
            }
            Err(error) => return refused(&error, tally),
        }
    };
    tally.count(if failure.is_some() { "step failed" } else { "certified" });
    prop_assert!(failure.is_none_or(|error| !error.to_string().is_empty()));
    prop_assert!(state.energy.is_finite() && state.time.is_finite(), "{state:?}");
    prop_assert!(Y::Manifold::entries(&state.point).iter().all(|x| x.is_finite()));
    prop_assert!(certificate.max_energy_error.is_finite(), "{certificate}");
    Ok(())
}

/// The same for the system that a builder makes, if the parts make one.
fn build_and_step<Y: Metriplectic>(
    system: Result<Y, BuildError>,
    x0: <Y::Manifold as Space>::Point<f64>,
    span: (f64, bool),
    tally: &Tally,
) -> TestCaseResult
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    match system {
        Ok(system) => step(&system, x0, span, tally),
        Err(_) => {
            tally.count("parts refused");
            Ok(())
        }
    }
}

/// A run that did not start.
fn refused<M: Manifold>(error: &RunError<M>, tally: &Tally) -> TestCaseResult {
    prop_assert!(!error.to_string().is_empty());
    tally.count(if matches!(error, RunError::Model(_)) { "model refused" } else { "span refused" });
    Ok(())
}

#[test]
fn structure_constants_and_the_models_on_them() {
    let entry = prop_oneof![8 => Just(0.0), 4 => -1.0..1.0, 1 => number()];
    // Half of the tables are antisymmetric, so that some are algebras.
    let table = (prop::array::uniform::<_, 27>(entry.boxed()), any::<bool>());
    let inputs = (table, tame_tree(), tame_tree(), column::<3>(), step_size(), any::<bool>());
    search(
        "structure constants",
        &inputs,
        300,
        |((c, skew), energy, entropy, x0, h, adaptive), tally| {
            let at = |i: usize, j: usize, k: usize| c[9 * i + 3 * j + k];
            let constants: [[[f64; 3]; 3]; 3] = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    std::array::from_fn(|k| {
                        if !skew {
                            at(i, j, k)
                        } else if i == j {
                            0.0
                        } else if i < j {
                            at(i, j, k)
                        } else {
                            -at(j, i, k)
                        }
                    })
                })
            });
            let space = match LieDual::new(&constants) {
                Ok(space) => space,
                Err(error) => {
                    tally.count("not an algebra");
                    prop_assert!(!error.to_string().is_empty());
                    return Ok(());
                }
            };
            let system = System::on(space).energy(energy.field()).entropy(entropy.field()).build();
            build_and_step(system, x0, (h, adaptive), tally)
        },
    );
}

#[test]
fn metrics_and_their_geodesics() {
    // A symmetric matrix more often than not.
    let entries = (prop::array::uniform4(tree()), 0..4_u8);
    let inputs = (entries, column::<2>(), column::<2>(), column::<2>());
    search("metrics", &inputs, 150, |((trees, kind), x, v, y), tally| {
        let field = move |x: &Vector2<Real>| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| trees[k].at(x.as_slice()));
            match kind {
                0 => Matrix2::new(a, b, c, d),
                1 => Matrix2::new(a, b, b, d),
                // Positive: 1 + AᵀA.
                _ => {
                    let m = Matrix2::new(a, b, c, d);
                    Matrix2::identity() + m.transpose() * m
                }
            }
        };
        // What the laws of a metric ask for: components that have squares.
        if [x, v, y].iter().any(is_huge) {
            return Ok(());
        }
        let metric = Metric::field(field);
        let centre = ChartPoint::<Euclidean<2>>::centre(&x);
        let finite = |what: &str, result: Result<Vec<f64>, MetricError>| {
            match result {
                Ok(numbers) => {
                    tally.count(what);
                    prop_assert!(numbers.iter().all(|x| x.is_finite()), "{what}: {numbers:?}");
                }
                Err(error) => {
                    tally.count(format!("{what} refused"));
                    prop_assert!(!error.to_string().is_empty());
                }
            }
            Ok(())
        };
        let m: &dyn Fn(&Vector2<f64>) -> Vec<f64> = &|v| vec![v.x, v.y];
        finite("exp", Riemannian::<Euclidean<2>>::end(&metric, &x, &v).map(|y| m(&y)))?;
        finite("log", Riemannian::<Euclidean<2>>::log(&metric, &x, &y).map(|v| m(&v)))?;
        finite("norm", Riemannian::<Euclidean<2>>::norm(&metric, &x, &v).map(|l| vec![l]))?;
        finite(
            "volume",
            MetricAt::<Euclidean<2>, _>::new(&metric, &centre).volume_density().map(|l| vec![l]),
        )
    });
}

#[test]
fn models_on_flat_space_with_brackets_and_metrics_of_their_own() {
    let metric = (prop::array::uniform3(tree()), any::<bool>());
    let inputs = (metric, tame_tree(), tree(), tree(), column::<2>(), step_size(), any::<bool>());
    search("flat models", &inputs, 150, |(metric, energy, entropy, pi, x0, h, adaptive), tally| {
        let (trees, positive) = metric;
        let field = move |x: &Vector2<Real>| {
            let [a, b, d] = [0, 1, 2].map(|k| trees[k].at(x.as_slice()));
            let m = Matrix2::new(a, b, b, d);
            if positive { Matrix2::identity() + m.transpose() * m } else { m }
        };
        let bracket = Poisson::field(move |x: &Vector2<Real>| {
            let p = pi.at(x.as_slice());
            Matrix2::new(0.0.into(), p, -p, 0.0.into())
        });
        let system = System::on(Euclidean::<2>)
            .metric(Metric::field(field))
            .bracket(bracket)
            .energy(energy.field())
            .entropy(entropy.field())
            .second_law(SecondLaw::Published)
            .build();
        build_and_step(system, x0, (h, adaptive), tally)
    });
}

#[test]
fn models_on_the_sphere() {
    let inputs = (tame_tree(), tree(), column::<3>(), 0..4_u8, step_size(), any::<bool>());
    search("sphere", &inputs, 150, |(energy, entropy, x0, kind, h, adaptive), tally| {
        let space = Sphere::<2>::round();
        // One start in four is not on the sphere.
        let x0 = if kind == 0 { x0 } else { space.project(&x0) };
        let system =
            System::on(space).bracket(Zero).energy(energy.field()).entropy(entropy.field());
        build_and_step(system.build(), x0, (h, adaptive), tally)
    });
}

#[test]
fn models_on_the_rotations() {
    let inputs = (tame_tree(), tree(), column::<3>(), 0..4_u8, step_size(), any::<bool>());
    search("rotations", &inputs, 150, |(energy, entropy, q, kind, h, adaptive), tally| {
        let mut x0 = rotations::exp(&q);
        if kind == 0 {
            x0 *= 1.1;
        }
        let system = System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(energy.field())
            .entropy(entropy.field())
            .build();
        build_and_step(system, x0, (h, adaptive), tally)
    });
}

/// The form that a metric closure on the sphere gives is ambient.
#[test]
fn metrics_on_the_sphere() {
    let inputs = (prop::array::uniform3(tree()), column::<3>(), column::<2>(), any::<bool>());
    search("sphere metrics", &inputs, 60, |(trees, x, v, positive), tally| {
        let field = move |x: &Vector3<Real>| -> Form<Sphere<2>, Real> {
            let diagonal = [0, 1, 2].map(|k| trees[k].at(x.as_slice()));
            let d = Vector3::from(diagonal);
            let form = Matrix3::from_diagonal(&d);
            if positive { Matrix3::identity() + d * d.transpose() } else { form }
        };
        let (metric, x) = (Metric::field(field), Sphere::<2>::round().project(&x));
        if Sphere::<2>::round().check(&x).is_err() || is_huge(&v) {
            return Ok(());
        }
        match Riemannian::<Sphere<2>>::end(&metric, &x, &v) {
            Ok(y) => {
                tally.count("exp");
                prop_assert!(Sphere::<2>::round().defect(&y) < 1e-12, "{y}");
            }
            Err(error) => {
                tally.count("exp refused");
                prop_assert!(!error.to_string().is_empty());
            }
        }
        Ok(())
    });
}
