//! Runs of ten million steps: whether the errors stay where they are.
//!
//! `cargo test --release -p metriplectic-tests --test long_runs -- --ignored --nocapture` prints a table of
//! them; `docs/verification.md` has its figures. The same runs with a hundred thousand steps are among the usual tests.

mod models;

use std::time::Instant;

use metriplectic::dynamics::system::Point;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Drift, Growth, Guarantee, Table, scientific};
use models::{TUMBLING, UNSTABLE, free_body, relaxing_body, top};

/// What is watched over a run.
struct LongRun {
    name: &'static str,
    h: f64,
    /// `(H − H₀)/H₀`.
    energy: Drift,
    /// `S − S₀`.
    entropy: Drift,
    /// How far the state is off its manifold.
    defect: Drift,
    certificate: Certificate,
    seconds: f64,
}

impl LongRun {
    fn of<Y: Metriplectic>(
        name: &'static str,
        system: &Y,
        start: Point<Y>,
        (h, steps): (f64, usize),
    ) -> Self
    where
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let mut run = WeylMidpoint.steps(system, start, h).expect("the model keeps its laws");
        let begin = run.state().clone();
        let [mut energy, mut entropy, mut defect] = [(); 3].map(|()| Drift::over(steps));
        let clock = Instant::now();
        for _ in 0..steps {
            let state = run.advance().expect("every step is solved");
            energy.push((state.energy - begin.energy) / begin.energy);
            entropy.push(state.entropy - begin.entropy);
            defect.push(system.manifold().defect(&state.point));
        }
        let (seconds, certificate) = (clock.elapsed().as_secs_f64(), run.certificate().clone());
        Self { name, h, energy, entropy, defect, certificate, seconds }
    }

    fn row(&self, table: &mut Table<10>) {
        let growth = |drift: &Drift| drift.growth().map_or("?".into(), |g| g.to_string());
        let ends = |drift: &Drift| {
            let [first, last] = [drift.first_tenth_worst(), drift.last_tenth_worst()];
            format!("{} → {}", scientific(first), scientific(last))
        };
        let c = &self.certificate;
        let entropy = |text: String| match c.second_law {
            SecondLaw::NoEntropy => "–".into(),
            _ => text,
        };
        table.row([
            self.name.to_owned(),
            self.h.to_string(),
            ends(&self.energy),
            growth(&self.energy),
            entropy(scientific(c.min_entropy_increment)),
            entropy(c.entropy_falls.to_string()),
            entropy(scientific(c.entropy_gained)),
            format!("{}, {}", ends(&self.defect), growth(&self.defect)),
            format!("{:.2}", c.effort.iterations as f64 / c.steps as f64),
            format!("{:.2}", 1e6 * self.seconds / c.steps as f64),
        ]);
    }
}

/// No drift: the worst of the last tenth is at most three times that of the first, where less than
/// a unit in the last place counts as one.
fn is_flat(drift: &Drift) -> bool {
    drift.last_tenth_worst() <= 3.0 * drift.first_tenth_worst().max(f64::EPSILON)
}

/// Nambu's bracket on SO(3) with the friction `κ`.
fn rotations(kappa: f64) -> impl Metriplectic<Manifold = Rotations, Metric = Canonical> {
    System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .dissipation(MetricDissipation::scaled(move |_: &Matrix3<Real>| Real::from(kappa)))
        .build()
        .expect("the parts make a system")
}

/// Two gas containers with a moving wall between them (`examples/gas_containers.rs`).
fn gas(alpha: f64) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    System::on(Euclidean::<4>)
        .bracket(Poisson::field(|x: &Vector4<Real>| {
            let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
            let push = Vector4::new(1.0.into(), 0.0.into(), -left, right);
            push * Vector4::y().transpose() - Vector4::y() * push.transpose()
        }))
        .dissipation(FieldDissipation(move |_: &Vector4<Real>, w: &Vector4<Real>| {
            let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
            b * b.transpose() * Real::from(alpha)
        }))
        .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
        .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
        .build()
        .expect("the parts make a system")
}

/// All runs, with the table of them printed.
fn runs(steps: usize) -> [LongRun; 7] {
    let sphere = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build();
    let sphere = sphere.expect("the top is a system");
    let frame = metriplectic::manifolds::rotations::exp(&vector![0.3, -0.2, 0.5]);
    let diagonal = Vector3::from_element(3.0_f64.sqrt().recip());
    let pushed = Vector4::new(1.0, 2.0, 2.0, 2.0);
    let settling = WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(0.1, 10_000));
    let settling = settling.expect("every step is solved");
    let all = [
        LongRun::of("free rigid body, so(3)*", &free_body(), TUMBLING, (0.1, steps)),
        LongRun::of("spinning top, S²", &sphere, diagonal, (0.1, steps)),
        LongRun::of("Nambu, SO(3), κ = 0", &rotations(0.0), frame, (0.1, steps)),
        LongRun::of("Nambu, SO(3), κ = 10⁻⁶", &rotations(1e-6), frame, (0.1, steps)),
        LongRun::of("gas containers, α = 10⁻³", &gas(1e-3), pushed, (0.01, steps)),
        LongRun::of("gas containers, α = 10⁻⁶", &gas(1e-6), pushed, (0.01, steps)),
        LongRun::of("body at rest, so(3)*", &relaxing_body(), settling.last().point, (0.1, steps)),
    ];
    let mut table = Table::new([
        "run",
        "h",
        "energy error, first → last tenth",
        "growth",
        "least ΔS",
        "falls of S",
        "S − S₀",
        "manifold defect, first → last tenth",
        "iterations a step",
        "µs a step",
    ]);
    for run in &all {
        run.row(&mut table);
        println!("{}\nenergy  {}\nentropy {}", run.name, run.energy, run.entropy);
        println!("defect  {}\n{}\n", run.defect, run.certificate);
    }
    println!("{steps} steps each\n\n{}", table.markdown());
    all
}

/// What holds of every run, however long.
fn keeps_its_laws(run: &LongRun) {
    let LongRun { name, energy, defect, certificate, .. } = run;
    assert!(energy.worst() <= 5e-15 && is_flat(energy), "{name}: {energy}");
    assert!(defect.worst() <= 1e-15 && is_flat(defect), "{name}: {defect}");
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{name}: {certificate}");
}

#[test]
#[ignore = "a study of some minutes, run by `just study`"]
fn ten_million_steps() {
    let all = runs(10_000_000);
    for run in &all {
        let [first, last] = [run.energy.first_tenth_worst(), run.energy.last_tenth_worst()];
        let growth = run.energy.growth().map_or_else(|| "?".into(), |growth| growth.to_string());
        Claim::new(Guarantee::LongRuns, format!("{}, h = {}", run.name, run.h), "WeylMidpoint")
            .against("H at the start, relative: worst of the first and of the last tenth")
            .record(
                format!(
                    "{} → {}, {growth}; {} falls of S",
                    scientific(first),
                    scientific(last),
                    run.certificate.entropy_falls
                ),
                "5e-15, last ≤ 3 × first, no fall",
            );
    }
    let entropy = &all[2].entropy;
    Claim::new(Guarantee::LongRuns, format!("{}: S", all[2].name), "WeylMidpoint")
        .against("S at the start, 10⁷ steps of 0.1")
        .record(scientific(entropy.worst()), "5e-15");
    all.iter().for_each(keeps_its_laws);
    let [body, top, nambu, _, _, gas, rest] = &all;
    for run in [body, top, nambu, gas, rest] {
        // The other two come to rest on their way.
        assert_eq!(run.energy.growth(), Some(Growth::Flat), "{}: {}", run.name, run.energy);
    }
    // Where K = 0 the entropy stays.
    assert!(nambu.entropy.worst() <= 5e-15, "{}", nambu.entropy);
}

#[test]
fn a_hundred_thousand_steps() {
    let all = runs(100_000);
    all.iter().for_each(keeps_its_laws);
    let [body, top, nambu, weak, .., rest] = &all;
    for run in [body, top, nambu, weak] {
        assert_eq!(run.energy.growth(), Some(Growth::Flat), "{}: {}", run.name, run.energy);
    }
    assert!(nambu.entropy.worst() <= 5e-15, "{}", nambu.entropy);
    assert!(rest.entropy.worst() <= 4.0 * f64::EPSILON, "{}", rest.entropy);
}

#[test]
fn a_jacobian_of_earlier_steps_leaves_no_trend() {
    // Steps a quarter as long, where a Jacobian serves longest. What one of them leaves has the same
    // sign in each step.
    let frame = metriplectic::manifolds::rotations::exp(&vector![0.3, -0.2, 0.5]);
    let pushed = Vector4::new(1.0, 2.0, 2.0, 2.0);
    let nambu = LongRun::of("Nambu, SO(3), κ = 0", &rotations(0.0), frame, (0.025, 100_000));
    let gas = LongRun::of("gas containers, α = 10⁻³", &gas(1e-3), pushed, (0.025, 4000));
    for run in [&nambu, &gas] {
        println!("{}\nenergy {}\n{}\n", run.name, run.energy, run.certificate);
        keeps_its_laws(run);
    }
    assert!(nambu.entropy.worst() <= 5e-15, "{}", nambu.entropy);
}

#[test]
fn a_long_run_of_order_8_reaches_the_flow_in_twice_the_digits() {
    let span = Span::until(1e4).tolerance(1e-8).largest_step(1.0);
    let run = DormandPrince8.run(&gas(1e-3), Vector4::new(1.0, 2.0, 2.0, 2.0), span);
    let run = run.expect("every step is taken");
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.max_relative_energy_error() <= 5e-15, "{certificate}");
    assert!(certificate.min_entropy_increment > 0.0, "{certificate}");
    // By `benches/peers`. The errors of the steps add up to a phase that is off by some 10⁻⁶.
    let flow = Vector4::new(
        0.697_372_907_244_776,
        0.543_261_789_486_713,
        3.526_959_397_033_727,
        2.325_473_917_008_12,
    );
    assert!((run.last().point - flow).norm() < 1e-5, "{}", run.last().point - flow);
}
