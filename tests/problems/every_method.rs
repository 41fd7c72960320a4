//! Every method on every problem: from its start and from rest, and with constants in both laws.

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{Certificate, RunError, Schedule};
use metriplectic::manifolds::Manifold;
use metriplectic::prelude::*;
use metriplectic_studies::problems::{Constants, Problem, Study, each, each_with};

use crate::methods::{Any, Explicit};
use crate::promises::{Case, promises};

/// The end of a run, and what was kept on it.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) label: String,
    pub(crate) entries: Vec<f64>,
    certificate: Certificate,
}

/// Every method on every problem, from its start and from rest.
#[derive(Default)]
pub(crate) struct EveryMethod {
    pub(crate) outcomes: Vec<Outcome>,
    pub(crate) failures: Vec<String>,
}

impl EveryMethod {
    /// Notes the end of a run, and a law that it has not kept.
    pub(crate) fn note<Y: Metriplectic>(
        &mut self,
        label: String,
        system: &Y,
        run: Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>,
    ) {
        match run {
            Ok(run) => {
                let (certificate, end) = (run.certificate().clone(), &run.last().point);
                let second = system.second_law() != SecondLaw::Exact || certificate.keeps_entropy();
                if !(certificate.keeps_energy() && second && certificate.keeps_invariants()) {
                    self.failures.push(format!("{label}: {certificate}"));
                }
                self.outcomes.push(Outcome {
                    label,
                    entries: Y::Manifold::entries(end),
                    certificate,
                });
            }
            Err(error) => self.failures.push(format!("{label}: {error}")),
        }
    }
}

/// Steps of a fixed size, and of sizes that follow the motion.
fn courses(time: f64) -> [(&'static str, Schedule); 2] {
    [
        ("fixed", Span::steps(time / 40.0, 8).into()),
        ("adaptive", Span::until(0.2 * time).tolerance(1e-5).into()),
    ]
}

impl Study for EveryMethod {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, rest, time, .. } = problem;
        let starts: [(&str, &Point<Y>); 2] = [("start", start), ("rest", rest)];
        for (from, x) in starts {
            for (course, schedule) in courses(*time) {
                let label = format!("{name} on {manifold} ({metric}) from {from}, {course}");
                let run = Any::Scheme(retraction).run(system, x.clone(), schedule.clone());
                self.note(format!("{label}, {scheme}"), system, run);
                let methods = Any::all(retraction).into_iter().skip(1);
                for method in methods.filter(|_| scheme == "exponential") {
                    let run = method.run(system, x.clone(), schedule.clone());
                    self.note(format!("{label}, {method:?}"), system, run);
                }
            }
        }
    }
}

/// The promises of every method on every problem that are not kept.
#[derive(Default)]
struct Table {
    cells: usize,
    broken: Vec<String>,
}

impl Table {
    fn enter(&mut self, label: String, broken: Vec<String>) {
        self.cells += 1;
        self.broken.extend(broken.into_iter().map(|what| format!("{label}: {what}")));
    }
}

impl Study for Table {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        if scheme != "Weyl midpoint" {
            return;
        }
        let Problem { name, manifold, metric, start, rest, .. } = problem;
        for (from, x) in [("start", start), ("rest", rest)] {
            let label = format!("{name} on {manifold} ({metric}) from {from}");
            let case = Case { flow: &problem.system, start: x, time: problem.time };
            let mut methods = Any::all(retraction);
            for _ in 0..methods.len() {
                let label = format!("{label}, {:?}", methods[0]);
                self.enter(label, promises(&case, &methods));
                methods.rotate_left(1);
            }
        }
    }
}

#[test]
fn every_method_keeps_its_promises_on_every_problem() {
    let mut table = Table::default();
    each(&mut table);
    assert!(table.broken.is_empty(), "{}", table.broken.join("\n"));
    // From two starts, twelve methods on each of sixteen problems.
    assert_eq!(table.cells, 2 * 12 * 16);
}

#[test]
fn every_method_takes_every_problem_from_its_start_and_from_rest() {
    let mut plain = EveryMethod::default();
    each(&mut plain);
    assert!(plain.failures.is_empty(), "{}", plain.failures.join("\n"));
    // From two starts, by two courses: 47 schemes, and eleven methods on each of sixteen problems.
    assert_eq!(plain.outcomes.len(), 4 * (47 + 176));

    // Constants of a million times the terms of both laws change no run by an implicit method. An explicit one sees
    // the entropy of a step with ten digits, so another step may be targeted.
    let mut shifted = EveryMethod::default();
    each_with(&mut shifted, Constants { energy: SHIFT, entropy: SHIFT });
    assert!(shifted.failures.is_empty(), "{}", shifted.failures.join("\n"));
    assert_eq!(shifted.outcomes.len(), plain.outcomes.len());
    let mut farthest = [0.0_f64; 2];
    for at in &shifted.outcomes {
        let twin = plain.outcomes.iter().find(|plain| plain.label == at.label).expect("a twin");
        let pairs = at.entries.iter().zip(&twin.entries);
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let is_explicit =
            Explicit::ALL.iter().any(|method| at.label.ends_with(&format!(", {method:?}")));
        let which = usize::from(is_explicit);
        if off > farthest[which] {
            println!("{}: off by {off:.1e}", at.label);
        }
        farthest[which] = farthest[which].max(off);
        let [steps, others] = [at, twin].map(|at| at.certificate.steps + at.certificate.rejected);
        if is_explicit {
            // Measured: 5.6e-9.
            assert!(off <= 1e-7, "{}: off by {off:e}", at.label);
            assert!(2 * steps <= 3 * others + 4, "{}: {steps} steps for {others}", at.label);
            continue;
        }
        // The last digit of a law, in each of eight steps; measured: 4.3e-10.
        assert!(off <= 8.0 * SHIFT * f64::EPSILON, "{}: off by {off:e}", at.label);
        assert_eq!(at.certificate.steps, twin.certificate.steps, "{}", at.label);
    }
    println!("off by {:.1e}, {:.1e} by explicit methods", farthest[0], farthest[1]);
}

/// A constant in an energy and an entropy whose terms are of size 1.
const SHIFT: f64 = 1e6;
