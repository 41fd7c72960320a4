//! One step from each of 242 hard starts: stiff friction, steps of 1 to 100 times the sensible size,
//! states near rest, near antipodes and near the edges of logarithms, metrics that nearly degenerate.
//!
//! `tests/data/hard_corpus.py` makes the starts without looking at the library, and follows the solution
//! of each in 60 digits from a step of size 0 to the one that is asked for. A start is solvable if
//! that branch gets there.

mod models;

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::Effort;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};
use models::boxed;
use serde_json::Value;

/// A start with its label.
struct Case(Value);

impl Case {
    fn all() -> Vec<Self> {
        let file = include_str!("data/hard_corpus.json");
        let all: Vec<Value> = serde_json::from_str(file).expect("the data are JSON");
        all.into_iter().map(Self).collect()
    }

    fn family(&self) -> &str {
        self.0["family"].as_str().expect("a name")
    }

    fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().expect("a number")
    }

    fn numbers(&self, key: &str) -> Vec<f64> {
        serde_json::from_value(self.0[key].clone()).expect("numbers")
    }

    fn x<const N: usize>(&self) -> SVector<f64, N> {
        SVector::from_vec(self.numbers("x"))
    }

    fn solvable(&self) -> bool {
        self.0["solvable"].as_bool().expect("a label")
    }

    /// The distance of a point from the end of the branch, in fractions of its size.
    fn off(&self, end: &[f64]) -> f64 {
        let exact = self.numbers("end");
        let distance = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        distance(end, &exact) / distance(&exact, &vec![0.0; exact.len()])
    }

    /// One step of the library.
    fn step(&self) -> Outcome {
        match self.family() {
            "stiff body" | "body near rest" => {
                let epsilon = self.number("sigma").sqrt().recip();
                let metric = Metric::constant(Matrix3::from_diagonal_element(epsilon));
                let inertia = vector![10.0, 5.0, 1.0];
                self.outcome(
                    System::on(LieDual::so3())
                        .metric(metric.expect("a metric"))
                        .energy(boxed(move |p: &Vector3<Real>| {
                            p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
                        }))
                        .entropy(boxed(|p: &Vector3<Real>| p.norm_squared() * 0.5))
                        .build(),
                    self.x(),
                )
            }
            "climbing body" => self.outcome(
                System::on(LieDual::so3())
                    .energy(boxed(|p: &Vector3<Real>| {
                        p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.exp()
                    }))
                    .entropy(boxed(|p: &Vector3<Real>| p.norm_squared().powi(2)))
                    .build(),
                self.x(),
            ),
            "doomed logarithm" => self.outcome(
                System::on(Euclidean::<2>)
                    .energy(boxed(|x: &Vector2<Real>| x.x.ln() + x.y))
                    .entropy(boxed(|x: &Vector2<Real>| -x.x))
                    .build(),
                self.x(),
            ),
            "gas containers" => self.gas(),
            "heat exchange" => {
                let kind = self.number("kind");
                self.outcome(
                    System::on(Euclidean::<2>)
                        .energy(boxed(|e: &Vector2<Real>| e.x + e.y * 2.0 + e.x * e.y * 0.1))
                        .entropy(boxed(move |e: &Vector2<Real>| match kind {
                            0.0 => e.x.ln() + e.y.ln() * 3.0,
                            1.0 => e.x.sqrt() * 2.0 + e.y.sqrt() * 6.0,
                            _ => (e.x.powf(0.3) + e.y.powf(0.3) * 3.0) / 0.3,
                        }))
                        .build(),
                    self.x(),
                )
            }
            "sphere" => self.sphere(),
            "rotation" => self.outcome(
                System::on(Rotations::bi_invariant())
                    .bracket(Nambu::default())
                    .energy(boxed(|r: &Matrix3<Real>| {
                        r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
                    }))
                    .entropy(boxed(|r: &Matrix3<Real>| {
                        r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25
                    }))
                    .build(),
                Matrix3::from_row_slice(&self.numbers("x")),
            ),
            "anisotropic metric" => self.anisotropic(),
            "degenerate metric" => {
                let delta = self.number("delta");
                let metric = Metric::field(move |x: &Vector2<Real>| {
                    Matrix2::from_diagonal(&vector![(x.x * x.x + delta).powi(2), 1.0.into()])
                });
                self.outcome(
                    System::on(Euclidean::<2>)
                        .metric(metric)
                        .energy(boxed(|x: &Vector2<Real>| {
                            x.x.powi(2) * 0.5 + x.y.powi(2) + x.x * x.y * 0.3
                        }))
                        .entropy(boxed(|x: &Vector2<Real>| {
                            x.x - x.y * 0.5 + x.x * x.y.powi(2) * 0.25
                        }))
                        .build(),
                    self.x(),
                )
            }
            "oscillator" => {
                let gamma = self.number("gamma");
                self.outcome(
                    System::on(Euclidean::<3>)
                        .bracket(Poisson::constant(-Vector3::z().cross_matrix()).expect("skew"))
                        .energy(boxed(|x: &Vector3<Real>| {
                            (x.x.powi(2) + x.y.powi(2)) * 0.5 + x.z.exp()
                        }))
                        .entropy(boxed(|x: &Vector3<Real>| x.z))
                        .dissipation(FieldDissipation(
                            move |_: &Vector3<Real>, w: &Vector3<Real>| {
                                let b = Vector3::new(0.0.into(), w.z, -w.y);
                                b * b.transpose() * (w.z.recip() * gamma)
                            },
                        ))
                        .build(),
                    self.x(),
                )
            }
            other => panic!("no family {other}"),
        }
    }

    fn gas(&self) -> Outcome {
        let alpha = self.number("alpha");
        let system = System::on(Euclidean::<4>)
            .bracket(Poisson::field(|x: &Vector4<Real>| {
                let (left, right) = (-x.z / x.x * (2.0 / 3.0), x.w / (-x.x + 2.0) * (2.0 / 3.0));
                let mut pi = Matrix4::<Real>::zeros();
                (pi[(0, 1)], pi[(1, 0)]) = (1.0.into(), (-1.0).into());
                (pi[(2, 1)], pi[(1, 2)]) = (left, -left);
                (pi[(3, 1)], pi[(1, 3)]) = (right, -right);
                pi
            }))
            .energy(boxed(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w))
            .entropy(boxed(|x: &Vector4<Real>| {
                x.x.ln() + (-x.x + 2.0).ln() + (x.z.ln() + x.w.ln()) * 1.5
            }))
            .dissipation(FieldDissipation(move |_: &Vector4<Real>, w: &Vector4<Real>| {
                let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
                b * b.transpose() * Real::from(alpha)
            }))
            .build();
        self.outcome(system, self.x())
    }

    fn sphere(&self) -> Outcome {
        let energy = |x: &Vector3<Real>| {
            let weights = [1.0, 0.5, 0.25];
            (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * weights[i])).sum()
        };
        let sphere = System::on(Sphere::<2>::round()).energy(energy);
        if self.number("kind") < 0.5 {
            return self.outcome(sphere.bracket(AreaForm).build(), self.x());
        }
        let hill = |x: &Vector3<Real>| x.z + x.x * x.y * 0.3;
        self.outcome(sphere.entropy(hill).build(), self.x())
    }

    fn anisotropic(&self) -> Outcome {
        let c = self.number("condition");
        let thirds = Matrix3::new(2.0, 1.0, 2.0, -2.0, 2.0, 1.0, 1.0, 2.0, -2.0);
        let eigen = [1.0, c.powf(-0.5), c.recip()];
        let g = Matrix3::from_fn(|i, j| {
            (0..3).map(|k| thirds[(k, i)] * thirds[(k, j)] * eigen[k]).sum::<f64>() / 9.0
        });
        let system = System::on(Euclidean::<3>)
            .metric(Metric::constant(g).expect("a metric"))
            .bracket(Nambu::default())
            .energy(boxed(|x: &Vector3<Real>| {
                let wells = x.iter().map(|a| a.powi(2) * 0.5 + a.powi(4) * 0.25).sum::<Real>();
                wells + x.x * x.y / 3.0
            }))
            .entropy(boxed(|x: &Vector3<Real>| x.z + x.x.powi(2) * 0.5 - x.y.exp() * 0.25))
            .build();
        self.outcome(system, self.x())
    }

    fn outcome<Y: Metriplectic, E: fmt::Debug>(&self, system: Result<Y, E>, x: Point<Y>) -> Outcome
    where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let (system, span) = (system.expect("a system"), Span::steps(self.number("h"), 1));
        let run = catch_unwind(AssertUnwindSafe(|| WeylMidpoint.run(&system, x, span)));
        let Ok(run) = run else { return Outcome::Wrong("a panic".to_owned()) };
        match run {
            Ok(run) => {
                let end = Y::Manifold::entries(&run.last().point);
                Outcome::Step { end, certificate: Box::new(run.certificate().clone()) }
            }
            Err(RunError::Step { cause, trajectory }) => {
                let refusal = match cause {
                    StepError::NotConverged { tried, .. } => Some((Error::NotConverged, tried)),
                    StepError::OutOfDomain { tried, .. } => Some((Error::OutOfDomain, tried)),
                    _ => None,
                };
                match refusal {
                    Some((error, tried)) if trajectory.last().step == 0 => {
                        Outcome::Refused { error, tried }
                    }
                    _ => Outcome::Wrong(cause.to_string()),
                }
            }
            Err(error) => Outcome::Wrong(error.to_string()),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Error {
    NotConverged,
    OutOfDomain,
}

/// What became of a start.
enum Outcome {
    Step {
        end: Vec<f64>,
        certificate: Box<Certificate>,
    },
    Refused {
        error: Error,
        tried: Effort,
    },
    /// Anything else, which is always wrong.
    Wrong(String),
}

impl Outcome {
    /// By which means a step was taken that keeps both laws, or which error came.
    fn word(&self) -> &'static str {
        match self {
            Self::Wrong(_) => "wrong",
            Self::Refused { error: Error::NotConverged, .. } => "not converged",
            Self::Refused { error: Error::OutOfDomain, .. } => "out of domain",
            Self::Step { end, certificate } => {
                let Effort { splits, continued, .. } = certificate.effort;
                let kept = certificate.keeps_energy() && certificate.keeps_entropy();
                let finite = end.iter().all(|entry| entry.is_finite());
                match (kept && finite, splits, continued) {
                    (false, ..) => "not certified",
                    (_, 0, 0) => "plain",
                    (_, 0, _) => "continued",
                    _ => "split",
                }
            }
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wrong(text) => write!(f, "{text}"),
            Self::Refused { tried, .. } => write!(f, "{tried}"),
            Self::Step { certificate, .. } => write!(
                f,
                "{} iterations, {} splits, |ΔH|/|H| {:.1e}, ΔS {:.1e}",
                certificate.effort.iterations,
                certificate.effort.splits,
                certificate.max_relative_energy_error(),
                certificate.min_entropy_increment
            ),
        }
    }
}

/// The words of all outcomes in the order of the columns printed.
const WORDS: [&str; 7] =
    ["plain", "continued", "split", "not converged", "out of domain", "not certified", "wrong"];

/// How many of some outcomes are described by each of the words.
fn counts<'a>(outcomes: impl Iterator<Item = &'a Outcome> + Clone) -> [usize; 7] {
    WORDS.map(|word| outcomes.clone().filter(|outcome| outcome.word() == word).count())
}

#[test]
fn every_hard_start_ends_in_a_certified_step_or_in_the_right_error() {
    let all: Vec<(Case, Outcome)> = Case::all()
        .into_iter()
        .map(|case| {
            let outcome = case.step();
            (case, outcome)
        })
        .collect();
    assert_eq!(all.len(), 242);

    println!("{:<20} {WORDS:?}", "");
    let mut families: Vec<&str> = all.iter().map(|(case, _)| case.family()).collect();
    families.dedup();
    for family in families {
        for solvable in [true, false] {
            let some = all
                .iter()
                .filter(|(case, _)| case.family() == family && case.solvable() == solvable);
            println!("{family:<20} {:<13} {:?}", label(solvable), counts(some.map(|(_, o)| o)));
        }
    }
    let [solvable, not] =
        [true, false].map(|label| all.iter().filter(move |(case, _)| case.solvable() == label));
    let of_solvable = counts(solvable.clone().map(|(_, outcome)| outcome));
    let of_others = counts(not.map(|(_, outcome)| outcome));
    println!("all, {} {of_solvable:?}\nall, {} {of_others:?}", label(true), label(false));
    let mut effort = Effort::default();
    for (_, outcome) in &all {
        match outcome {
            Outcome::Step { certificate, .. } => effort += certificate.effort,
            Outcome::Refused { tried, .. } => effort += *tried,
            Outcome::Wrong(_) => (),
        }
    }
    println!("in all: {effort}");
    // A search without an end would show here, on any machine.
    assert!(effort.iterations < 20_000, "{effort}");
    for (case, outcome) in &all {
        let word = outcome.word();
        if word != "plain" {
            let (family, h) = (case.family(), case.number("tameness"));
            println!("{family:<20} {h:<12} {:<13} {word:<14} {outcome}", label(case.solvable()));
        }
    }

    let certified = |counts: &[usize]| counts[..3].iter().sum::<usize>();
    let hard = |starts: &str| Claim::new(Guarantee::HardSteps, starts, "WeylMidpoint");
    hard("starts whose step has a solution")
        .against("continuation in 60 digits")
        .record(format!("{} certified steps", certified(&of_solvable)), "218 of 218");
    hard("starts whose step has none on the branch").against("continuation in 60 digits").record(
        format!("{} certified steps, else typed errors", certified(&of_others)),
        "24 of 24",
    );
    // Every solvable start, 218, ends in a certified step.
    assert_eq!(of_solvable[..3].iter().sum::<usize>(), 218);
    let [plain, continued, split, ..] = of_solvable;
    assert!(plain >= 191 && continued <= 26 && split <= 2, "{of_solvable:?}");
    // Every other ends in a certified step, of another solution or of halves, or in a typed error.
    assert_eq!(of_others[..5].iter().sum::<usize>(), 24);
    let [_, _, split, not_converged, out_of_domain, ..] = of_others;
    assert!(split >= 9, "{of_others:?}");
    assert!(not_converged + out_of_domain <= 9, "{of_others:?}");
    // Only what has an edge is left, and what has none does not converge.
    for (case, outcome) in &all {
        if let Outcome::Refused { error, .. } = outcome {
            let edge = case.family() == "doomed logarithm";
            assert_eq!(*error == Error::OutOfDomain, edge, "{}: {outcome}", case.family());
        }
    }

    // The tamest half of the solvable ones needs no split; 107 of 109 need nothing but
    // Newton's method, and two are continued in the step size: the top on the sphere and the logarithm,
    // both at h · rate = 1.7.
    let mut tame: Vec<&(Case, Outcome)> = solvable.clone().collect();
    tame.sort_by(|(a, _), (b, _)| a.number("tameness").total_cmp(&b.number("tameness")));
    tame.truncate(109);
    let of_tame = counts(tame.iter().map(|(_, outcome)| outcome));
    println!("the tamest half: {of_tame:?}");
    assert!(of_tame[0] >= 107 && of_tame[0] + of_tame[1] == 109, "{of_tame:?}");

    // Without a split, the end is the one of the branch, but for other solutions of the same equation.
    let ends = solvable.filter_map(|(case, outcome)| match outcome {
        Outcome::Step { end, certificate } if certificate.effort.splits == 0 => {
            Some((case.family(), case.off(end), case))
        }
        _ => None,
    });
    let (same, other): (Vec<_>, Vec<_>) = ends.partition(|(_, off, _)| *off < 1e-4);
    println!("{} ends of the branch, {} others:", same.len(), other.len());
    for (family, off, case) in same.iter().filter(|(_, off, _)| *off > 1e-12).chain(&other) {
        println!("{family:<20} {:<12} {off:.1e}", case.number("tameness"));
    }
    assert!(other.len() <= 10);
    let digits = |limit: f64| same.iter().filter(|(_, off, _)| *off <= limit).count();
    println!("{} to 1e-14, {} to 1e-12, {} to 1e-9", digits(1e-14), digits(1e-12), digits(1e-9));
    // 188 of them here. Of the 19 others 18 have metrics of condition 10⁶ to 10¹², where the last digits
    // of the metric's entries count that many times.
    assert!(digits(1e-12) >= 185);
}

const fn label(solvable: bool) -> &'static str {
    if solvable { "solvable" } else { "not solvable" }
}

#[test]
fn a_blow_up_on_the_dual_of_se3_ends_in_the_error_of_the_step_it_cannot_take() {
    // C₁ = |Γ|², C₂ = M·Γ. H has no lower bound along Γ, so that exp(C₁C₂) climbs without bound.
    let system = System::on(LieDual::se3())
        .energy(boxed(|x: &SVector<Real, 6>| {
            let m = x.fixed_rows::<3>(0);
            m.x.powi(2) * 0.5 + m.y.powi(2) * 0.25 + m.z.powi(2) * 0.2 + x[5] + x[3] * x[4] * 0.3
        }))
        .entropy(boxed(|x: &SVector<Real, 6>| {
            let (m, gamma) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
            (gamma.norm_squared() * m.dot(&gamma)).exp()
        }))
        .build()
        .unwrap();
    let start = SVector::from([0.4, -0.3, 0.5, 0.6, 0.2, 0.5]);
    let error = WeylMidpoint.run(&system, start, Span::steps(0.1, 1000)).unwrap_err();
    println!("{error}");
    let RunError::Step { cause, trajectory } = &error else { panic!("another error: {error}") };
    assert!(matches!(cause, StepError::NotConverged { .. } | StepError::OutOfDomain { .. }));
    let certificate = trajectory.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    for part in ["Newton iterations", "1 continuation in", "halvings"] {
        assert!(error.to_string().contains(part), "\"{part}\" is missing in: {error}");
    }
}
