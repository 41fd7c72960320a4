//! Baths on half lines, by operators without samples, and what a bath is refused for.

use metriplectic::dynamics::NaturalBracket;
use metriplectic::fields::{ChartPoint, Space};
use metriplectic::manifolds::{Flat, PointError, rand};
use metriplectic::prelude::*;
use nalgebra::{Const, DMatrix, DVector};

use crate::operator::{
    Basis, Outcome, assert_orders, coefficients, mean, operator, order, outcomes, step,
};
use crate::refusals::fault;

/// `ln x` where the law of `H = x − 2 ln x` at `k_B T = ½` is: all but 10⁻⁶ of it.
const ENDS: [f64; 2] = [-4.0, 2.7];

/// The polynomials of Chebyshev in `ln x`.
struct Logarithm {
    nodes: Vec<Vector1<f64>>,
    projection: DMatrix<f64>,
}

impl Logarithm {
    fn new(n: usize) -> Self {
        let node = |k: usize| {
            let z = (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).cos();
            vector![(ENDS[0] + (ENDS[1] - ENDS[0]) * 0.5 * (z + 1.0)).exp()]
        };
        let mut line = Self { nodes: (0..n).map(node).collect(), projection: DMatrix::zeros(n, n) };
        let values = DMatrix::from_fn(n, n, |i, k| line.at(&line.nodes[i])[k]);
        line.projection = values.try_inverse().expect("the functions are independent");
        line
    }
}

impl Basis<Vector1<f64>> for Logarithm {
    fn nodes(&self) -> &[Vector1<f64>] {
        &self.nodes
    }

    fn at(&self, x: &Vector1<f64>) -> DVector<f64> {
        let z = 2.0 * (x.x.ln() - ENDS[0]) / (ENDS[1] - ENDS[0]) - 1.0;
        let angle = z.clamp(-1.0, 1.0).acos();
        DVector::from_fn(self.nodes.len(), |k, _| (k as f64 * angle).cos())
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

type One = Vector1<Real>;

fn well(x: &One) -> Real {
    x.x - x.x.ln() * 2.0
}

/// `exp(−H/k_B T)` relative to `dx/x` is the law Gamma(4, ½), with the mean 2 and `⟨x²⟩ = 5`.
fn errors(
    line: &Logarithm,
    sizes: [f64; 3],
    step: impl Fn(f64, &Vector1<f64>, &Outcome) -> Vector1<f64>,
) -> [Vec<(f64, f64)>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for h in sizes {
        let matrix = operator(line, &outcomes(1), |x, outcome| step(h, x, outcome));
        for (power, exact, errors) in
            [1, 2].into_iter().zip([2.0, 5.0]).zip(&mut errors).map(|((p, e), all)| (p, e, all))
        {
            let f = coefficients(line, |x| x.x.powi(power));
            errors.push((h, mean(line, &matrix, &f) / exact - 1.0));
        }
    }
    errors
}

#[test]
fn a_bath_on_a_half_line_has_the_law_of_the_metric() {
    let half = System::on(HalfLine)
        .energy(well)
        .bath("air", Bath::at(1.0).isotropic(0.5))
        .noise(Boltzmann(0.5))
        .build()
        .unwrap();
    let line = Logarithm::new(64);
    let two = errors(&line, [0.1, 0.05, 0.025], |h, x, outcome| {
        let method = NinomiyaVictoir(DormandPrince5).numbers(outcome.clone());
        step(&half, &method, &half.flow().start(*x), h).x
    });
    let one = errors(&line, [0.05, 0.025, 0.0125], |h, x, outcome| {
        let method = RandomFlow(DormandPrince5).numbers(outcome.clone());
        step(&half, &method, &half.flow().start(*x), h).x
    });
    let problem = "bath on a half line: mean and second moment of Gamma(4, ½)";
    for (method, errors, expected) in
        [("NinomiyaVictoir(DormandPrince5)", two, 2), ("RandomFlow(DormandPrince5)", one, 1)]
    {
        let found = errors.each_ref().map(|errors| order(errors));
        assert_orders(problem, method, &found, expected);
    }
    // A path, which the field `∂_x` led out of the half line on nearly every one.
    for path in 0..20 {
        let method = NinomiyaVictoir(DormandPrince5).seed(1).path(path);
        let run = method.run(&half, half.flow().start(vector![2.0]), Span::steps(0.04, 250));
        assert!(run.unwrap().certificate().keeps_energy());
    }
}

/// A half line whose manifold does not say along which velocities noise acts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ray;

impl Space for Ray {
    type Dim = Const<1>;
    type Velocity = Const<1>;
    type Point<D: Scalar> = Vector1<D>;

    fn constant<D: Scalar>(x: &Vector1<f64>) -> Vector1<D> {
        HalfLine::constant(x)
    }

    fn real<D: Scalar>(x: &Vector1<D>) -> Vector1<f64> {
        HalfLine::real(x)
    }

    fn chart<D: Scalar>(x: &Vector1<f64>, q: &Vector1<D>) -> Vector1<D> {
        HalfLine::chart(x, q)
    }

    fn coordinates<D: Scalar>(x: &Vector1<f64>, y: &Vector1<D>) -> Vector1<D> {
        HalfLine::coordinates(x, y)
    }

    fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector1<D>) -> Vector1<D> {
        at.point() * v.x
    }
}

impl Manifold for Ray {
    fn defect(&self, x: &Vector1<f64>) -> f64 {
        HalfLine.defect(x)
    }

    fn entries(x: &Vector1<f64>) -> Vec<f64> {
        HalfLine::entries(x)
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Vector1<f64> {
        HalfLine::assemble(next)
    }

    fn magnitude(x: &Vector1<f64>) -> f64 {
        HalfLine::magnitude(x)
    }

    fn project(&self, x: &Vector1<f64>) -> Vector1<f64> {
        HalfLine.project(x)
    }

    fn random(&self, rng: &mut impl rand::Rng) -> Vector1<f64> {
        HalfLine.random(rng)
    }

    fn check(&self, x: &Vector1<f64>) -> Result<(), PointError> {
        HalfLine.check(x)
    }
}

impl Flat for Ray {}

impl NaturalBracket for Ray {
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}

#[test]
fn terms_that_are_not_those_of_the_metric() {
    let ray = System::on(Ray)
        .energy(well)
        .bath("air", Bath::at(1.0).isotropic(0.5))
        .noise(Boltzmann(0.5))
        .build()
        .unwrap();
    let method = NinomiyaVictoir(DormandPrince5).seed(1);
    let error = fault(method.run(&ray, ray.flow().start(vector![2.0]), Span::steps(0.04, 10)));
    assert!(matches!(error, NoiseError::BathTermsDiffer { bath: 0, .. }), "{error}");
    let pair = System::on(Product(Euclidean::<1>, Ray))
        .energy(|x: &(One, One)| x.0.x + x.1.x)
        .entropy(|x: &(One, One)| x.1.x.ln())
        .noise(Boltzmann(0.3))
        .build()
        .unwrap();
    // A start at zero has a size of its own.
    for x in [1.0, 0.0] {
        let error = fault(method.run(&pair, (vector![x], vector![2.0]), Span::steps(0.01, 5)));
        assert!(matches!(error, NoiseError::TermsDiffer { .. }), "{error}");
    }
}

#[test]
fn derivatives_that_the_drift_of_a_bath_needs() {
    let run = |lost: bool, noise: f64| {
        let rate = move |x: Real| {
            let x = if lost { Real::from(x.re) } else { x };
            x * x + 0.5
        };
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .bath(
                "water",
                Bath::at(1.0).friction(move |_: Real, x: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: rate(x.y), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .noise(Boltzmann(noise))
            .build()
            .unwrap();
        let start = system.flow().start(vector![0.3, 0.0]);
        RandomFlow(DormandPrince5).seed(1).run(&system, start, Span::steps(0.01, 5))
    };
    assert!(run(false, 0.2).is_ok());
    let error = fault(run(true, 0.2));
    assert!(
        matches!(error, NoiseError::LostDerivative { derivative, quotient, .. } if derivative == 0.0 && quotient != 0.0),
        "{error}"
    );
    // A rate with a kink at the start has derivatives around it.
    let kink = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .bath(
            "water",
            Bath::at(1.0).friction(|_: Real, x: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact {
                    rate: if x.y.re < 0.0 { -x.y } else { x.y } + 0.5,
                    along: vector![0.0.into(), 1.0.into()],
                }]
            }),
        )
        .noise(Boltzmann(0.2))
        .build()
        .unwrap();
    let start = kink.flow().start(vector![0.3, 0.0]);
    assert!(RandomFlow(DormandPrince5).seed(1).run(&kink, start, Span::steps(0.01, 5)).is_ok());
}
