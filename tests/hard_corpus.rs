//! One step from each of 242 hard starts: stiff friction, steps of 1 to 100 times the sensible size,
//! states near rest, near antipodes and near the edges of logarithms, metrics that nearly degenerate.
//!
//! `tests/data/hard_corpus.py` makes the starts without looking at the library, and follows the solution
//! of each in 60 digits from a step of size 0 to the one that is asked for. A start is solvable if
//! that branch gets there.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{RunError, StepError};
use metriplectic::prelude::*;
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

    /// The distance of a point from the end of the branch, in shares of its size.
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
                        .energy(move |p: &Vector3<Real>| {
                            p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
                        })
                        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
                        .build(),
                    self.x(),
                )
            }
            "climbing body" => self.outcome(
                System::on(LieDual::so3())
                    .energy(|p: &Vector3<Real>| {
                        p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.exp()
                    })
                    .entropy(|p: &Vector3<Real>| p.norm_squared().powi(2))
                    .build(),
                self.x(),
            ),
            "doomed logarithm" => self.outcome(
                System::on(Euclidean::<2>)
                    .energy(|x: &Vector2<Real>| x.x.ln() + x.y)
                    .entropy(|x: &Vector2<Real>| -x.x)
                    .build(),
                self.x(),
            ),
            "gas containers" => self.gas(),
            "heat exchange" => {
                let kind = self.number("kind");
                self.outcome(
                    System::on(Euclidean::<2>)
                        .energy(|e: &Vector2<Real>| e.x + e.y * 2.0 + e.x * e.y * 0.1)
                        .entropy(move |e: &Vector2<Real>| match kind {
                            0.0 => e.x.ln() + e.y.ln() * 3.0,
                            1.0 => e.x.sqrt() * 2.0 + e.y.sqrt() * 6.0,
                            _ => (e.x.powf(0.3) + e.y.powf(0.3) * 3.0) / 0.3,
                        })
                        .build(),
                    self.x(),
                )
            }
            "sphere" => self.sphere(),
            "rotation" => self.outcome(
                System::on(Rotations::bi_invariant())
                    .bracket(Nambu::default())
                    .energy(|r: &Matrix3<Real>| {
                        r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
                    })
                    .entropy(|r: &Matrix3<Real>| {
                        r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25
                    })
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
                        .energy(|x: &Vector2<Real>| {
                            x.x.powi(2) * 0.5 + x.y.powi(2) + x.x * x.y * 0.3
                        })
                        .entropy(|x: &Vector2<Real>| x.x - x.y * 0.5 + x.x * x.y.powi(2) * 0.25)
                        .build(),
                    self.x(),
                )
            }
            "oscillator" => {
                let gamma = self.number("gamma");
                self.outcome(
                    System::on(Euclidean::<3>)
                        .bracket(Poisson::constant(-Vector3::z().cross_matrix()).expect("skew"))
                        .energy(|x: &Vector3<Real>| (x.x.powi(2) + x.y.powi(2)) * 0.5 + x.z.exp())
                        .entropy(|x: &Vector3<Real>| x.z)
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
            .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
            .entropy(|x: &Vector4<Real>| x.x.ln() + (-x.x + 2.0).ln() + (x.z.ln() + x.w.ln()) * 1.5)
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
            .energy(|x: &Vector3<Real>| {
                let wells = x.iter().map(|a| a.powi(2) * 0.5 + a.powi(4) * 0.25).sum::<Real>();
                wells + x.x * x.y / 3.0
            })
            .entropy(|x: &Vector3<Real>| x.z + x.x.powi(2) * 0.5 - x.y.exp() * 0.25)
            .build();
        self.outcome(system, self.x())
    }

    fn outcome<Y: Metriplectic, E: std::fmt::Debug>(
        &self,
        system: Result<Y, E>,
        x: Point<Y>,
    ) -> Outcome
    where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let (system, span) = (system.expect("a system"), Span::steps(self.number("h"), 1));
        let begin = Instant::now();
        let run = catch_unwind(AssertUnwindSafe(|| WeylMidpoint.run(&system, x, span)));
        let time = begin.elapsed();
        let result = match run {
            Err(_) => Err(("panic", String::new())),
            Ok(Ok(run)) => {
                let end = Y::Manifold::entries(&run.last().point);
                Ok((end, Box::new(run.certificate().clone())))
            }
            Ok(Err(error)) => {
                let kind = match &error {
                    RunError::Model(_) => "model",
                    RunError::Step { cause: StepError::NotConverged { .. }, .. } => "not converged",
                    RunError::Step { cause: StepError::OutOfDomain { .. }, .. } => "out of domain",
                    _ => "another error",
                };
                Err((kind, error.to_string()))
            }
        };
        Outcome { result, time }
    }
}

/// What became of a start: the end of the step and its balance, or the kind of error and its sentence.
struct Outcome {
    result: Result<(Vec<f64>, Box<Certificate>), (&'static str, String)>,
    time: Duration,
}

#[test]
fn hard_starts_end_in_a_certified_step_or_the_right_error() {
    let mut counts = BTreeMap::<(String, bool, &str), usize>::new();
    for case in Case::all() {
        let Outcome { result, time } = case.step();
        let (word, text) = match &result {
            Ok((end, certificate)) => {
                let Certificate { sweeps, retries, continued, globalised, .. } = **certificate;
                let certified = certificate.keeps_energy() && certificate.keeps_entropy();
                let finite = end.iter().all(|entry| entry.is_finite());
                let word = match (certified && finite, retries, globalised, continued) {
                    (false, ..) => "uncertified",
                    (_, 0, 0, 0) => "plain",
                    (_, 0, 0, _) => "continued",
                    (_, 0, ..) => "globalised",
                    _ => "split",
                };
                let off = if case.solvable() { case.off(end) } else { f64::NAN };
                let text = format!(
                    "{sweeps} sweeps, {globalised} globalised, {retries} splits, ΔH {:.1e}, ΔS {:.1e}, off {off:.1e}",
                    certificate.max_relative_energy_error(), certificate.min_entropy_increment
                );
                (word, text)
            }
            Err((kind, text)) => (*kind, text.clone()),
        };
        println!(
            "{:<20} {:<10.3} {:<10} {word:<12} {text} ({:.1} ms)",
            case.family(),
            case.number("tameness"),
            if case.solvable() { "solvable" } else { "not" },
            1e3 * time.as_secs_f64()
        );
        *counts.entry((case.family().to_owned(), case.solvable(), word)).or_default() += 1;
    }
    for (key, count) in counts {
        println!("{key:?}: {count}");
    }
}
