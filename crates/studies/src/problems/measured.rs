//! Measurements on every problem: orders, large steps, and both schemes side by side.

use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::Space as _;
use metriplectic_integrators::{Certificate, Method as _, Scheme, Span};
use metriplectic_manifolds::{Retraction, Riemannian as _, WeylMidpoint};

use super::list::{canonical, closures, products};
use super::{Constants, Problem, Study, each, flow, relative};
use crate::{Compared, Convergence};

/// The orders of every scheme on the problems that are visited, and how well the energy was kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Orders {
    coarsest: u32,
    /// A study for each problem and scheme.
    pub studies: Vec<Convergence>,
    /// The order that theory gives for each of them.
    pub expected: Vec<f64>,
    /// The worst energy error of any step, relative to `|H|` or to the unit of energy, 1, if that is larger.
    pub energy_error: f64,
    /// The fault, where an order could not be fitted.
    pub failures: Vec<String>,
}

impl Orders {
    /// Runs of `coarsest`, twice, four and eight times as many steps; of eight times as many again for
    /// schemes of order 1.
    const fn new(coarsest: u32) -> Self {
        Self {
            coarsest,
            studies: Vec::new(),
            expected: Vec::new(),
            energy_error: 0.0,
            failures: Vec::new(),
        }
    }

    /// All of them.
    #[inline]
    pub fn of_every_problem() -> Self {
        let mut all = Self::canonical();
        for part in [Self::closures(), Self::products()] {
            all.studies.extend(part.studies);
            all.expected.extend(part.expected);
            all.failures.extend(part.failures);
            all.energy_error = all.energy_error.max(part.energy_error);
        }
        all
    }

    /// The orders of canonical metrics, with geodesics in closed form.
    #[inline]
    pub fn canonical() -> Self {
        let mut orders = Self::new(40);
        canonical(&mut orders, Constants::default());
        orders
    }

    /// The orders of metrics from closures, with numerical geodesics.
    #[inline]
    pub fn closures() -> Self {
        let mut orders = Self::new(15);
        closures(&mut orders, Constants::default());
        orders
    }

    /// The orders of products.
    #[inline]
    pub fn products() -> Self {
        let mut orders = Self::new(15);
        products(&mut orders, Constants::default());
        orders
    }
}

/// Steps that are far too large for accuracy, of each retraction on every problem.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LargeSteps {
    /// The figures of each problem and scheme.
    pub rows: Vec<Strides>,
}

/// The steps of one scheme on one problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Strides {
    /// Problem, manifold, metric and scheme.
    pub label: String,
    /// The largest `√G(d, d)` of the displacements `d = hv`, from `R_h⁻¹(x, x')`, of the steps that
    /// were taken whole.
    pub longest: f64,
    /// The largest `|H(x') − H(x)|` of all of them, relative to `|H|` or to the unit of energy, 1, if that is
    /// larger.
    pub energy_error: f64,
}

impl LargeSteps {
    /// The figures of every problem.
    #[inline]
    pub fn of_every_problem() -> Self {
        let mut study = Self::default();
        each(&mut study);
        study
    }
}

impl Study for LargeSteps {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, strides, .. } = problem;
        let label = format!("{name} on {manifold} ({metric}), {scheme}");
        let mut row = Strides { label, longest: 0.0, energy_error: 0.0 };
        for (away, h) in strides {
            let x = Y::Manifold::chart(start, away);
            let span = Span::steps(*h, 1);
            let Ok(run) = Scheme::new(retraction).run(system, x.clone(), span) else { continue };
            let y = &run.last().point;
            let (before, after) = (system.energy_at(&x), system.energy_at(y));
            row.energy_error = row.energy_error.max(relative(after - before, before));
            if run.certificate().effort.splits == 0
                && let Ok(d) = retraction.inverse(system.metric(), &x, y)
                && let Ok(length) = system.metric().norm(&d.base, &d.vector)
            {
                row.longest = row.longest.max(length);
            }
        }
        self.rows.push(row);
    }
}

impl Study for Orders {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, order: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, time, .. } = problem;
        let Some(exact) = flow(system, start, *time) else {
            return self.failures.push(format!("{name} on {manifold} has no flow"));
        };
        let first = if order > 1.5 { self.coarsest } else { 8 * self.coarsest };
        let counts = [1, 2, 4, 8].map(|k| k * first);
        let labels = [name, manifold, metric, scheme];
        let study = Convergence::measure(labels, *time, &counts, |h, n| {
            let run = Scheme::new(retraction).run(system, start.clone(), Span::steps(h, n));
            run.map_or(f64::NAN, |run| {
                let certificate = run.certificate();
                let error = relative(certificate.max_energy_error, certificate.initial_energy);
                self.energy_error = self.energy_error.max(error);
                Problem::<Y>::distance(&run.last().point, &exact)
            })
        });
        match study {
            Ok(study) => {
                self.studies.push(study);
                self.expected.push(order);
            }
            Err(error) => {
                self.failures.push(format!("{name} on {manifold} ({metric}), {scheme}: {error}"));
            }
        }
    }
}

/// The exact scheme beside the published one, with the Weyl midpoint on every problem that has an
/// entropy which is a Casimir.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SecondLaws {
    /// A comparison for each of them.
    pub rows: Vec<Comparison>,
}

/// Both schemes on one problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Problem and manifold.
    pub problem: String,
    /// The balance of the exact scheme.
    pub exact: Certificate,
    /// The balance of the published one.
    pub published: Certificate,
}

impl SecondLaws {
    /// `steps` steps of size `h` on every problem.
    #[inline]
    pub fn of_every_problem(h: f64, steps: usize) -> Self {
        struct Runs(SecondLaws, f64, usize);
        impl Study for Runs {
            fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, _: R, _: f64)
            where
                Y: Metriplectic,
                R: Retraction<Y::Manifold, Y::Metric> + Copy,
            {
                let Problem { name, manifold, system, start, .. } = problem;
                if scheme != "Weyl midpoint" || system.second_law() != SecondLaw::Exact {
                    return;
                }
                let span = Span::steps(self.1, self.2).at_most(2);
                let schemes = [Compared::given(system), Compared::published(system)];
                let runs = schemes.map(|system| WeylMidpoint.run(&system, start.clone(), span));
                if let [Ok(exact), Ok(published)] = runs {
                    let problem = format!("{name} on {manifold}");
                    let [exact, published] =
                        [exact, published].map(|run| run.certificate().clone());
                    self.0.rows.push(Comparison { problem, exact, published });
                }
            }
        }
        let mut runs = Runs(Self::default(), h, steps);
        each(&mut runs);
        runs.0
    }

    /// The fraction by which the exact scheme solves more linear systems, over all problems.
    pub fn extra_iterations(&self) -> f64 {
        let sum = |of: fn(&Comparison) -> usize| self.rows.iter().map(of).sum::<usize>() as f64;
        sum(|row| row.exact.effort.iterations) / sum(|row| row.published.effort.iterations) - 1.0
    }
}
