//! Every manifold, bracket and kind of metric: the order of each retraction, and the energy at every
//! step, also where a step spans two radians.

use metriplectic::prelude::*;
use metriplectic_studies::problems::{self, Problem, Study};
use metriplectic_studies::{Order, scientific};

/// Fits the order, and checks the energy of every step on the way.
struct Orders {
    /// Steps of the coarsest run.
    coarsest: u32,
}

impl Study for Orders {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, order: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, time } = problem;
        let exact = problems::flow(system, start, *time).expect("the flow exists");
        // A scheme of order 1 needs smaller steps to show it.
        let coarsest = if order > 1.5 { self.coarsest } else { 8 * self.coarsest };
        let counts = [1, 2, 4, 8].map(|k| k * coarsest);
        let sizes = counts.map(|n| time / f64::from(n));
        let errors: Vec<f64> = counts
            .iter()
            .zip(sizes)
            .map(|(&n, h)| {
                let scheme = Scheme::new(retraction);
                let run = scheme.run(system, start.clone(), Span::steps(h, n as usize));
                let run = run.unwrap_or_else(|error| panic!("{name} on {manifold}: {error}"));
                assert!(run.certificate().keeps_energy(), "{name}: {}", run.certificate());
                Problem::<Y>::distance(&run.last().point, &exact)
            })
            .collect();
        let fitted = Order::fit(&sizes, &errors).expect("the errors follow a power law");
        let listed: Vec<_> = errors.iter().map(|&error| scientific(error)).collect();
        println!("{name}, {manifold}, {metric}, {scheme}: {fitted} from {}", listed.join(", "));
        assert!(
            fitted.agrees(order, 0.05),
            "{name} on {manifold} ({metric}), {scheme}: {fitted} from {}",
            listed.join(", ")
        );
    }
}

#[test]
fn canonical_metrics_are_integrated_to_the_order_of_the_retraction() {
    problems::canonical(&mut Orders { coarsest: 50 });
}

#[test]
fn metrics_from_closures_are_integrated_to_the_order_of_the_retraction() {
    problems::closures(&mut Orders { coarsest: 20 });
}

#[test]
fn products_are_integrated_to_the_order_of_the_retraction() {
    problems::products(&mut Orders { coarsest: 20 });
}

/// Takes steps so large that the geodesic of a step spans two radians, and checks the energy.
struct LargeSteps {
    longest: f64,
}

impl Study for LargeSteps {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        for h in [0.5, 1.0] {
            let Ok(mut steps) =
                Scheme::new(retraction).steps(&problem.system, problem.start.clone(), h)
            else {
                panic!("{} is a model", problem.name)
            };
            for _ in 0..10 {
                let before = steps.state().point.clone();
                // A step so large may have no solution: then it is an error, not a wrong answer.
                if steps.advance().is_err() {
                    break;
                }
                let moved = Problem::<Y>::distance(&before, &steps.state().point);
                self.longest = self.longest.max(moved);
            }
            assert!(
                steps.certificate().keeps_energy(),
                "{} on {}, {scheme}, h = {h}: {}",
                problem.name,
                problem.manifold,
                steps.certificate()
            );
        }
    }
}

#[test]
fn the_energy_is_kept_where_a_step_spans_two_radians() {
    let mut study = LargeSteps { longest: 0.0 };
    problems::each(&mut study);
    println!("the longest chord of a step: {:.2}", study.longest);
    // The chord of two radians on a unit sphere.
    assert!(study.longest > 2.0 * 1_f64.sin());
}
