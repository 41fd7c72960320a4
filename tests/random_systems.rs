//! Random systems: both laws by the exact scheme, where the published one loses entropy.

use metriplectic::prelude::*;
use metriplectic_studies::Compared;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Coefficients of a random polynomial and trigonometric field.
type Coefficients<const N: usize> = [[f64; N]; 3];

fn coefficients<const N: usize>() -> impl Strategy<Value = Coefficients<N>> {
    prop::array::uniform3(prop::array::uniform::<_, N>(-1.0..1.0))
}

/// `Σ (1 + a_i) x_i² + b_i sin x_i + ½ c_i x_i x_{i+1}²/(1 + |x|²)`: its level sets are compact.
fn waves<const N: usize>([a, b, c]: Coefficients<N>) -> impl Fn(&SVector<Real, N>) -> Real + Copy {
    move |x| {
        let bound = (x.norm_squared() + 1.0).recip();
        (0..N)
            .map(|i| {
                let next = x[(i + 1) % N];
                x[i].powi(2) * (1.5 + a[i])
                    + x[i].sin() * b[i]
                    + x[i] * next * next * bound * (0.5 * c[i])
            })
            .sum()
    }
}

fn columns<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform::<_, N>(0.3..1.0).prop_map(SVector::<f64, N>::from)
}

/// What became of the entropy on random systems of one kind.
#[derive(Debug, Default)]
struct Outcome {
    runs: usize,
    steps: usize,
    /// Runs in which the published scheme lost entropy.
    lost_by_published: usize,
    exact_iterations: usize,
    published_iterations: usize,
}

impl Outcome {
    /// Runs both schemes; the exact one has to keep both laws.
    fn compare<Y: Metriplectic>(
        &mut self,
        system: &Y,
        x0: <Y::Manifold as metriplectic::fields::Space>::Point<f64>,
        span: Span,
    ) where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let span = span.at_most(2);
        let [exact, published] = [Compared::given(system), Compared::published(system)];
        let run = WeylMidpoint.run(&exact, x0.clone(), span).expect("the exact scheme runs");
        let exact = run.certificate();
        assert!(exact.keeps_energy() && exact.keeps_entropy(), "{exact}");
        let run = WeylMidpoint.run(&published, x0, span).expect("the published scheme runs");
        let published = run.certificate();
        assert!(published.keeps_energy(), "{published}");
        self.runs += 1;
        self.steps += exact.steps;
        self.lost_by_published += usize::from(published.entropy_falls > 0);
        self.exact_iterations += exact.effort.iterations;
        self.published_iterations += published.effort.iterations;
    }

    fn is_as_claimed(&self) {
        println!("{self:?}");
        assert!(2 * self.lost_by_published >= self.runs, "{self:?}");
        assert!(
            self.exact_iterations as f64 <= 1.15 * self.published_iterations as f64,
            "{self:?}"
        );
    }
}

/// Calls `run` with `count` samples of a strategy, the same in each run of the test.
fn sampled<S: Strategy>(strategy: S, count: usize, mut run: impl FnMut(S::Value)) {
    let mut runner = TestRunner::deterministic();
    for _ in 0..count {
        run(strategy.new_tree(&mut runner).expect("a sample").current());
    }
}

/// Little friction, so that the reversible part is not hidden by the irreversible one.
fn friction(_: &Vector3<Real>) -> Real {
    Real::from(1e-4)
}

#[test]
fn nambu_brackets_of_random_energies_and_entropies() {
    let mut outcome = Outcome::default();
    sampled((coefficients::<3>(), coefficients::<3>(), columns::<3>()), 24, |(h, s, x)| {
        let system = System::on(Euclidean::<3>)
            .bracket(Nambu::default())
            .energy(waves(h))
            .entropy(waves(s))
            .dissipation(MetricDissipation::scaled(friction))
            .build()
            .unwrap();
        outcome.compare(&system, x, Span::steps(0.1, 10_000));
    });
    outcome.is_as_claimed();
}

#[test]
fn nambu_brackets_with_random_metrics() {
    let mut outcome = Outcome::default();
    let strategy = (
        coefficients::<3>(),
        coefficients::<3>(),
        columns::<3>(),
        prop::array::uniform3(-0.4..0.4),
    );
    sampled(strategy, 10, |(h, s, x, c): (_, _, _, [f64; 3])| {
        let metric = move |q: &Vector3<Real>| {
            let wave = Vector3::new(q.y.sin() * c[0], q.z.cos() * c[1], q.x.sin() * c[2]);
            Matrix3::from_diagonal_element(Real::from(1.0)) + wave * wave.transpose()
        };
        let system = System::on(Euclidean::<3>)
            .metric(Metric::field(metric))
            .bracket(Nambu::default())
            .energy(waves(h))
            .entropy(waves(s))
            .dissipation(MetricDissipation::scaled(friction))
            .build()
            .unwrap();
        outcome.compare(&system, x, Span::steps(0.1, 400));
    });
    outcome.is_as_claimed();
}

/// `1 + c w(q) w(q)ᵀ`, of which no geodesic is a straight line.
fn bent<const N: usize>(c: f64) -> impl Fn(&SVector<Real, N>) -> SMatrix<Real, N, N> {
    move |q| {
        let wave = SVector::<Real, N>::from_fn(|i, _| (q[(i + 1) % N] + i as f64).sin());
        SMatrix::from_diagonal_element(Real::from(1.0)) + wave * wave.transpose() * Real::from(c)
    }
}

// On a flat space the published scheme does not lose a function of quadratic Casimirs such as |p|² or
// M·Γ: the midpoint rule keeps these. So the metric is not flat.
#[test]
fn the_dual_of_so3_with_a_quartic_casimir() {
    let mut outcome = Outcome::default();
    sampled((coefficients::<3>(), columns::<3>(), 0.3..0.8), 10, |(h, x, c)| {
        let system = System::on(LieDual::so3())
            .metric(Metric::field(bent(c)))
            .energy(waves(h))
            .entropy(|p: &Vector3<Real>| p.norm_squared().powi(2) * 0.25)
            .dissipation(MetricDissipation::scaled(friction))
            .build()
            .unwrap();
        outcome.compare(&system, x, Span::steps(0.1, 400));
    });
    outcome.is_as_claimed();
}

#[test]
fn the_dual_of_se3_with_an_entropy_of_both_casimirs() {
    let mut outcome = Outcome::default();
    sampled((coefficients::<6>(), columns::<6>(), 0.3..0.8), 6, |(h, x, c)| {
        // C₁ = |Γ|², C₂ = M·Γ.
        let entropy = |x: &SVector<Real, 6>| {
            let (m, gamma) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
            (gamma.norm_squared() * m.dot(&gamma)).exp()
        };
        let system = System::on(LieDual::se3())
            .metric(Metric::field(bent(c)))
            .energy(waves(h))
            .entropy(entropy)
            .dissipation(MetricDissipation::scaled(|_: &SVector<Real, 6>| Real::from(1e-4)))
            .build()
            .unwrap();
        outcome.compare(&system, x * 0.6, Span::steps(0.1, 100));
    });
    outcome.is_as_claimed();
}

#[test]
fn long_runs_on_flat_duals_keep_both_laws() {
    let mut outcome = Outcome::default();
    sampled((coefficients::<3>(), columns::<3>()), 8, |(h, x)| {
        let system = System::on(LieDual::so3())
            .energy(waves(h))
            .entropy(|p: &Vector3<Real>| p.norm_squared().powi(2) * 0.25)
            .dissipation(MetricDissipation::scaled(friction))
            .build()
            .unwrap();
        outcome.compare(&system, x, Span::steps(0.1, 100_000));
    });
    println!("{outcome:?}");
}

#[test]
fn nambu_brackets_on_the_rotation_group() {
    let mut outcome = Outcome::default();
    sampled((coefficients::<3>(), coefficients::<3>(), columns::<3>()), 12, |(h, s, u)| {
        let system = System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(move |r: &Matrix3<Real>| {
                waves(h)(&(r.column(0) + r.column(1) * Real::from(0.5)))
            })
            .entropy(move |r: &Matrix3<Real>| waves(s)(&(r.column(2) * r.m11)))
            .dissipation(MetricDissipation::scaled(|_: &Matrix3<Real>| Real::from(1e-5)))
            .build()
            .unwrap();
        outcome.compare(
            &system,
            metriplectic::manifolds::rotations::exp(&u),
            Span::steps(0.05, 2000),
        );
    });
    outcome.is_as_claimed();
}
