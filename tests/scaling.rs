//! Nothing in a run assumes a scale: the scaling law, stiff friction, SI units, spectators, tiny fields.

use metriplectic::integrators::laws::{self, UnitRun, Units};
use metriplectic::integrators::{RunError, Schedule, StepError};
use metriplectic::manifolds::Constant;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};

#[path = "models/stages.rs"]
mod stages;

use stages::{Gauss2, Radau3};

/// A problem on Rⁿ that can be written in any units, one for each entry.
struct Problem<const N: usize> {
    name: &'static str,
    energy: fn(&SVector<Real, N>) -> Real,
    entropy: fn(&SVector<Real, N>) -> Real,
    bracket: fn(&SVector<Real, N>) -> SMatrix<Real, N, N>,
    /// `K` of the point and the covector that it annihilates.
    dissipation: fn(&SVector<Real, N>, &SVector<Real, N>) -> SMatrix<Real, N, N>,
    x0: SVector<f64, N>,
    h: f64,
}

/// The exponents of factors that are powers of two.
#[derive(Clone, Copy)]
struct Factors<const N: usize> {
    entries: [i32; N],
    time: i32,
    energy: i32,
    entropy: i32,
}

const fn one<const N: usize>() -> Factors<N> {
    Factors { entries: [0; N], time: 0, energy: 0, entropy: 0 }
}

impl<const N: usize> Problem<N> {
    /// The problem in other units: `H̃(x̃) = E H(x)` with `x̃ = D x`, and the tensors that belong to it.
    fn system(
        &self,
        units: Factors<N>,
    ) -> impl Metriplectic<Manifold = Euclidean<N>, Metric = Constant<N>> + use<N> {
        let d = units.entries.map(|k| 2.0_f64.powi(k));
        let [t, e, s] = [units.time, units.energy, units.entropy].map(|k| 2.0_f64.powi(k));
        let Self { energy, entropy, bracket, dissipation, .. } = *self;
        let own =
            move |x: &SVector<Real, N>| SVector::<Real, N>::from_fn(|i, _| x[i] * d[i].recip());
        let tensor = move |a: SMatrix<Real, N, N>, factor: f64| {
            SMatrix::<Real, N, N>::from_fn(|i, j| a[(i, j)] * (d[i] * d[j] / factor))
        };
        let metric =
            SMatrix::<f64, N, N>::from_fn(|i, j| if i == j { (d[i] * d[i]).recip() } else { 0.0 });
        System::on(Euclidean::<N>)
            .metric(Metric::constant(metric).expect("a metric"))
            .bracket(Poisson::field(move |x: &SVector<Real, N>| tensor(bracket(&own(x)), e * t)))
            .energy(move |x: &SVector<Real, N>| energy(&own(x)) * e)
            .entropy(move |x: &SVector<Real, N>| entropy(&own(x)) * s)
            .dissipation(FieldDissipation(
                move |x: &SVector<Real, N>, w: &SVector<Real, N>| -> SMatrix<Real, N, N> {
                    let w = SVector::<Real, N>::from_fn(|i, _| w[i] * (d[i] / e));
                    tensor(dissipation(&own(x), &w), s * t)
                },
            ))
            .build()
            .expect("the parts make a system")
    }

    /// The scaling law in fixed and in adaptive steps.
    fn obeys_the_law(&self, units: Factors<N>, [fixed, adaptive]: [f64; 2]) {
        let factors = Units {
            entries: units.entries.map(|k| 2.0_f64.powi(k)).to_vec(),
            time: 2.0_f64.powi(units.time),
            energy: 2.0_f64.powi(units.energy),
            entropy: 2.0_f64.powi(units.entropy),
        };
        let (system, scaled) = (self.system(one()), self.system(units));
        let start = SVector::<f64, N>::from_fn(|i, _| self.x0[i] * factors.entries[i]);
        let t = factors.time;
        let until = |t: f64| Schedule::from(Span::until(40.0 * self.h * t).tolerance(1e-5));
        let courses: [(Schedule, Schedule, f64); 2] = [
            (Span::steps(self.h, 60).into(), Span::steps(self.h * t, 60).into(), fixed),
            (until(1.0), until(t), adaptive),
        ];
        for (course, other, tolerance) in courses {
            let run = UnitRun { system: &system, x0: self.x0, course };
            let twin = UnitRun { system: &scaled, x0: start, course: other };
            let laws = [
                laws::scaling(&Scheme::new(WeylMidpoint), &run, &twin, &factors, tolerance),
                laws::scaling(&DormandPrince8, &run, &twin, &factors, tolerance),
                laws::scaling(&DormandPrince5, &run, &twin, &factors, tolerance),
                laws::scaling(&RungeKuttaChebyshev, &run, &twin, &factors, tolerance),
                laws::scaling(&Gauss2, &run, &twin, &factors, tolerance),
                laws::scaling(&Radau3, &run, &twin, &factors, tolerance),
            ];
            for law in laws {
                law.unwrap_or_else(|law| panic!("{}: {law}", self.name));
            }
        }
        println!("{:<24} x · 2^{:?}, t · 2^{}: holds", self.name, units.entries, units.time);
    }

    /// The two parts of the law.
    fn obeys_both_laws(&self) {
        for [x, t, e, s] in [[20, -7, 11, -13], [-31, 40, -23, 17], [0, 3, -60, 0], [44, 0, 0, -50]]
        {
            let units = Factors { entries: [x; N], time: t, energy: e, entropy: s };
            self.obeys_the_law(units, [0.0, 0.0]);
        }
        for sign in [1, -1] {
            let entries = std::array::from_fn(|i| sign * [17, -23, 5, -9, 30][i % 5]);
            let units = Factors { entries, time: 4 * sign, energy: -6, entropy: 9 };
            self.obeys_the_law(units, [1e-12, 1e-9]);
        }
        let claim = |units: &str| {
            let problem = format!("{}, in {units}", self.name);
            Claim::new(Guarantee::Units, problem, "six methods, fixed and adaptive steps")
        };
        claim("one unit for all entries, 4 choices")
            .against("the run in other units, by powers of two")
            .record("the same bits", "the same bits");
        claim("a unit for each entry, 2 choices")
            .against("the run in other units, by powers of two")
            .record("within the bound", "1e-12, adaptive 1e-9");
    }
}

/// A tensor from its entries above the diagonal.
fn skew<const N: usize>(entries: &[(usize, usize, Real)]) -> SMatrix<Real, N, N> {
    let mut pi = SMatrix::<Real, N, N>::zeros();
    for &(i, j, value) in entries {
        (pi[(i, j)], pi[(j, i)]) = (value, -value);
    }
    pi
}

fn none<const N: usize>(_: &SVector<Real, N>, _: &SVector<Real, N>) -> SMatrix<Real, N, N> {
    SMatrix::zeros()
}

/// `rate · b bᵀ`.
fn onsager<const N: usize>(b: SVector<Real, N>, rate: Real) -> SMatrix<Real, N, N> {
    b * b.transpose() * rate
}

fn real(x: f64) -> Real {
    Real::from(x)
}

#[test]
fn the_oscillators_obey_the_scaling_law() {
    let canonical = |_: &Vector3<Real>| skew::<3>(&[(0, 1, real(1.0))]);
    let friction = |_: &Vector3<Real>, w: &Vector3<Real>| {
        onsager(Vector3::new(real(0.0), w.z, -w.y), w.z.recip() * 0.3)
    };
    let damped = Problem {
        name: "damped oscillator",
        energy: |x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z,
        entropy: |x| x.z,
        bracket: canonical,
        dissipation: friction,
        x0: vector![2.0, 0.25, 0.125],
        h: 0.1,
    };
    damped.obeys_both_laws();
    let pendulum = Problem {
        name: "pendulum with a bath",
        energy: |x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z.exp(),
        ..damped
    };
    pendulum.obeys_both_laws();
    Problem { name: "without friction", dissipation: none, ..pendulum }.obeys_both_laws();
}

#[test]
fn the_bodies_obey_the_scaling_law() {
    let turn = |p: &Vector3<Real>| skew::<3>(&[(0, 1, -p.z), (0, 2, p.y), (1, 2, -p.x)]);
    let relaxing = Problem {
        name: "relaxing body",
        energy: |p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5,
        entropy: |p: &Vector3<Real>| p.norm_squared() * 0.5,
        bracket: turn,
        dissipation: |_, w: &Vector3<Real>| {
            Matrix3::from_diagonal_element(w.norm_squared()) - w * w.transpose()
        },
        x0: vector![0.3, -1.0, 0.4],
        h: 0.1,
    };
    relaxing.obeys_both_laws();
    Problem { name: "free body", dissipation: none, ..relaxing }.obeys_both_laws();
    Problem {
        name: "body with a quartic entropy",
        energy: |p: &Vector3<Real>| p.x.powi(4) * 0.05 + p.y * p.y * 0.1 + p.z.powi(3) * 0.2,
        entropy: |p: &Vector3<Real>| p.norm_squared().powi(2) * 0.25,
        ..relaxing
    }
    .obeys_both_laws();
}

#[test]
fn the_thermal_models_obey_the_scaling_law() {
    let gas = Problem {
        name: "gas containers",
        energy: |x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w,
        entropy: |x| x.x.ln() + (-x.x + 2.0).ln() + (x.z.ln() + x.w.ln()) * 1.5,
        bracket: |x| {
            let (left, right) = (-x.z / x.x * (2.0 / 3.0), x.w / (-x.x + 2.0) * (2.0 / 3.0));
            skew::<4>(&[(0, 1, real(1.0)), (2, 1, left), (3, 1, right)])
        },
        dissipation: |_, w| onsager(Vector4::new(real(0.0), real(0.0), w.w, -w.z), real(0.5)),
        x0: vector![1.0, 2.0, 2.0, 2.5],
        h: 0.05,
    };
    gas.obeys_both_laws();
    let heat = Problem {
        name: "two temperatures",
        energy: |x: &Vector2<Real>| x.x + x.x * x.x * 0.5 + x.y + x.y * x.y * 0.5,
        entropy: |x| x.x.ln() + x.x + x.y.ln() + x.y,
        bracket: |_| SMatrix::zeros(),
        dissipation: |_, w| onsager(Vector2::new(w.x.recip(), -w.y.recip()), real(1.0)),
        x0: vector![0.5, 3.0],
        h: 0.02,
    };
    heat.obeys_both_laws();
}

#[test]
fn the_orbits_obey_the_scaling_law() {
    let pairs = |_: &Vector5| skew::<5>(&[(0, 2, real(1.0)), (1, 3, real(1.0))]);
    let kepler = Problem {
        name: "Kepler",
        energy: |x: &Vector5| {
            (x[2] * x[2] + x[3] * x[3]) * 0.5 - (x[0] * x[0] + x[1] * x[1]).sqrt().recip() + x[4]
        },
        entropy: |x| x[4],
        bracket: pairs,
        dissipation: none,
        x0: vector![0.75, 0.0, 0.0, 1.25, 0.5],
        h: 0.05,
    };
    kepler.obeys_both_laws();
    Problem {
        name: "Kepler with drag",
        dissipation: |_, w: &Vector5| {
            let b = |p: usize| {
                let mut b = Vector5::zeros();
                (b[p], b[4]) = (w[4], -w[p]);
                onsager(b, w[4].recip() * 0.05)
            };
            b(2) + b(3)
        },
        ..kepler
    }
    .obeys_both_laws();
}

type Vector5 = SVector<Real, 5>;

/// The overdamped oscillator `x = (q, p, s)`, its plane turned by `angle`: `H = ½p² + ½q² + s`, `S = s`,
/// `K = (γ/w_s) b bᵀ` with `b = (0, w_s, −w_p)`.
fn overdamped(
    gamma: f64,
    angle: f64,
) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    let (sin, cos) = angle.sin_cos();
    let pi = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    System::on(Euclidean::<3>)
        .bracket(Poisson::constant(pi).expect("it is skew"))
        .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            // The momentum is p = y cos − x sin in the turned plane.
            let p = w.y * cos - w.x * sin;
            onsager(Vector3::new(w.z * -sin, w.z * cos, -p), w.z.recip() * gamma)
        }))
        .build()
        .expect("the parts make a system")
}

/// `q` after 300 steps of 0.01 γ from `q = 1` on the slow manifold, where `q = e^{−t/γ}` up to γ⁻².
fn slow_decay(gamma: f64, angle: f64) -> Result<(f64, Certificate), StepError> {
    let (sin, cos) = angle.sin_cos();
    let (q, p) = (1.0, -gamma.recip());
    let start = vector![q * cos - p * sin, q * sin + p * cos, 0.0];
    let span = Span::steps(0.01 * gamma, 300);
    match WeylMidpoint.run(&overdamped(gamma, angle), start, span) {
        Ok(run) => {
            let x = run.last().point;
            Ok((x.x * cos + x.y * sin, run.certificate().clone()))
        }
        Err(RunError::Step { cause, .. }) => Err(cause),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_stiff_state_is_not_taken_for_one_at_rest() {
    let exact = (-3.0_f64).exp();
    for gamma in [1e6, 1e7, 1e8, 1e9, 1e10] {
        let (q, certificate) = slow_decay(gamma, 0.0).expect("it is solved");
        println!("γ = {gamma:.0e}: q = {q:.6}\n{certificate}");
        assert!((q - exact).abs() < 1e-4 * exact.recip().min(1.0), "γ = {gamma:e}: {q}");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert!(certificate.to_string().contains("friction not damped: h|K'| = "), "{certificate}");
    }
}

#[test]
fn a_slow_direction_off_the_axes_is_right_or_an_error() {
    let exact = (-3.0_f64).exp();
    for gamma in [1e6, 1e7, 1e8, 1e9, 1e10] {
        match slow_decay(gamma, 0.6) {
            Ok((q, certificate)) => {
                println!("γ = {gamma:.0e}: q = {q:.6}\n{certificate}");
                assert!((q - exact).abs() < 1e-4, "γ = {gamma:e}: {q}");
            }
            Err(cause) => {
                println!("γ = {gamma:.0e}: {cause}");
                assert!(gamma > 1e8, "{cause}");
                // The slow motion has no digits beside the fast one, or the energy has none.
                assert!(
                    matches!(
                        cause,
                        StepError::StiffFriction { .. } | StepError::FirstLawBroken { .. }
                    ),
                    "{cause}"
                );
            }
        }
    }
}

#[test]
fn states_at_rest_stay_where_they_are_for_a_million_steps() {
    let (q, p) = (vector![0.0, 0.0, 0.5], vector![1.4, 0.0, 0.0]);
    let oscillator = overdamped(0.3, 0.0);
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let temperatures = System::on(Euclidean::<4>)
        .energy(|x: &Vector4<Real>| x.x + x.y + x.z + x.w)
        .entropy(|x: &Vector4<Real>| x.x.ln() + x.y.ln() + x.z.ln() + x.w.ln())
        .build()
        .unwrap();
    let span = Span::steps(0.1, 1_000_000).at_most(2);
    let rested = |certificate: &Certificate, change: f64, size: f64| {
        println!("{certificate}\nmoved by {change:.1e}");
        let bound = 16.0 * f64::EPSILON;
        assert!(certificate.max_energy_error <= bound * certificate.initial_energy.abs());
        assert!(change <= bound * size && certificate.keeps_entropy(), "{change:e}");
    };
    let run = WeylMidpoint.run(&oscillator, q, span).unwrap();
    rested(run.certificate(), (run.last().point - q).amax(), q.amax());
    let run = WeylMidpoint.run(&body, p, span).unwrap();
    rested(run.certificate(), (run.last().point - p).amax(), p.amax());
    // Not exactly at rest: the last digits of a third.
    let x = vector![1.0 / 3.0, 1.0 / 3.0, (1.0 / 3.0) * (1.0 + f64::EPSILON), 1.0 / 3.0];
    let run = WeylMidpoint.run(&temperatures, x, span).unwrap();
    rested(run.certificate(), (run.last().point - x).amax(), x.amax());
}

#[test]
fn a_uniform_motion_far_from_the_origin_is_not_at_rest() {
    // A step of 1 at 10¹⁷ changes no digit of the position; sixteen of them do.
    let free = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .build()
        .unwrap();
    let start = vector![1e17, 1.0];
    let run = WeylMidpoint.run(&free, start, Span::steps(1.0, 1600).until_rest(1e-9)).unwrap();
    assert_eq!((run.ending(), run.last().point.x), (Ending::Span, 1e17 + 1600.0));
}

#[test]
fn a_field_whose_square_underflows_moves_its_state() {
    for tiny in [1e-150, 1e-160, 1e-200, 1e-290] {
        // q' = tiny p, p' = −tiny q: a turn by one radian in a time of 1/tiny.
        let oscillator = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(move |x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * (0.5 * tiny))
            .build()
            .unwrap();
        let span = Span::steps(0.01 / tiny, 100);
        let x = WeylMidpoint.run(&oscillator, vector![1.0, 0.0], span).unwrap().last().point;
        // The midpoint rule turns by 2 atan(h/2) in a step.
        let angle = 200.0 * 0.005_f64.atan();
        assert!((x - vector![angle.cos(), -angle.sin()]).amax() < 1e-13, "{tiny:e}: {x}");
        let slow = WeylMidpoint.run(&oscillator, vector![1.0, 0.0], Span::steps(1.0, 10)).unwrap();
        let p = slow.last().point.y;
        assert!((p / (-10.0 * tiny) - 1.0).abs() < 1e-12, "{tiny:e}: {p:e}");
    }
}

/// A colloid in a harmonic trap, `x = (q, p, s)`: `H = p²/2m + ½kq² + C T e^{s/C}` with a bath of heat
/// capacity `C` that starts at the temperature `T`, `S = s`, and Stokes' friction `−γ p/m`.
#[derive(Clone, Copy)]
struct Colloid {
    mass: f64,
    friction: f64,
    stiffness: f64,
    capacity: f64,
    temperature: f64,
}

impl Colloid {
    /// `q/q₀` after 300 steps of `0.01 γ/k` from the slow manifold, its error, and the balance.
    fn relaxes(self, q: f64) -> (f64, f64, Certificate) {
        let Self { mass, friction, stiffness, capacity, temperature } = self;
        let pi = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::constant(pi).expect("it is skew"))
            .energy(move |x: &Vector3<Real>| {
                x.y * x.y * (0.5 / mass)
                    + x.x * x.x * (0.5 * stiffness)
                    + (x.z / capacity).exp() * (capacity * temperature)
            })
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
                onsager(Vector3::new(real(0.0), w.z, -w.y), w.z.recip() * friction)
            }))
            .build()
            .expect("the parts make a system");
        // The slow root of m r² + γ r + k = 0.
        let discriminant = (friction * friction - 4.0 * mass * stiffness).sqrt();
        let rate = -2.0 * stiffness / (friction + discriminant);
        let h = 0.01 * friction / stiffness;
        let start = vector![q, mass * rate * q, 0.0];
        let run = WeylMidpoint.run(&system, start, Span::steps(h, 300)).expect("it is solved");
        let end = run.last().point.x / q;
        (end, end - (rate * 300.0 * h).exp(), run.certificate().clone())
    }
}

#[test]
fn a_colloid_in_si_units_relaxes_like_its_dimensionless_twin() {
    let (q, si) = (
        1e-7,
        Colloid {
            mass: 5e-16,
            friction: 1e-8,
            stiffness: 1e-6,
            capacity: 4e-12,
            temperature: 300.0,
        },
    );
    // Lengths in q₀, times in γ/k, energies in kq₀², entropies in kq₀²/T.
    let unit = si.stiffness * q * q / si.temperature;
    let twin = Colloid {
        mass: si.mass * si.stiffness / si.friction.powi(2),
        friction: 1.0,
        stiffness: 1.0,
        capacity: si.capacity / unit,
        temperature: 1.0,
    };
    let (end, error, certificate) = si.relaxes(q);
    let (other, twins, _) = twin.relaxes(1.0);
    println!(
        "q/q₀ = {end:.6}, off by {error:.1e}; dimensionless {other:.6}, off by {twins:.1e}\n{certificate}"
    );
    assert!(error.abs() <= 2.0 * twins.abs() && error.abs() < 1e-4);
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
}

/// Kepler's problem `x = (r, p)` of a body of mass `m` around `μ = GM`.
fn kepler(mass: f64, mu: f64) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(move |x: &Vector4<Real>| {
            let r = (x.x * x.x + x.y * x.y).sqrt();
            (x.z * x.z + x.w * x.w) * (0.5 / mass) - r.recip() * (mu * mass)
        })
        .build()
        .expect("the parts make a system")
}

#[test]
fn an_orbit_in_si_units_is_that_in_astronomical_ones() {
    let (unit, mu, mass) = (1.495_978_707e11, 1.327_124_4e20, 5.972e24);
    let time = (unit * unit * unit / mu).sqrt();
    let speed = unit / time;
    // An eccentric orbit from its aphelion, 2000 steps of 0.02.
    let x = vector![1.0, 0.0, 0.0, 0.6];
    let scale = vector![unit, unit, mass * speed, mass * speed];
    let run = |system: &_, x, h| WeylMidpoint.run(system, x, Span::steps(h, 2000)).unwrap();
    let twin = run(&kepler(1.0, 1.0), x, 0.02);
    let si = run(&kepler(mass, mu), x.component_mul(&scale), 0.02 * time);
    let fine = WeylMidpoint.run(&kepler(1.0, 1.0), x, Span::steps(0.001, 40_000)).unwrap();
    let error = |y: Vector4<f64>| (y - fine.last().point).amax();
    let (a, b) = (error(twin.last().point), error(si.last().point.component_div(&scale)));
    println!(
        "{a:.3e} in units of one, {b:.3e} in SI\n{}\n{}",
        twin.certificate(),
        si.certificate()
    );
    assert!(b <= 2.0 * a && a > 0.0);
    for run in [&twin, &si] {
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
        assert!(run.certificate().max_relative_energy_error() < 2e-14);
    }
}

/// An oscillator that warms a bath, `x = (q, p, s)`, with entries in units of `a`, `b` and `c`: energies have the unit `ab`, and times the
/// unit 1. The metric stays that of the numbers, so that a discrete gradient along it mixes the units.
fn warming([a, b, c]: [f64; 3]) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    let structure = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    System::on(Euclidean::<3>)
        .bracket(Poisson::constant(structure).expect("it is antisymmetric"))
        .energy(move |x: &Vector3<Real>| {
            let (q, p, s) = (x.x / a, x.y / b, x.z / c);
            ((q * q + p * p) * 0.5 + q.powi(4) * 0.1 + s.exp() * 0.7) * (a * b)
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let v = Vector3::new(0.0.into(), w.z, -w.y);
            v * v.transpose() * (w.z.recip() * (0.2 * b / a))
        }))
        .build()
        .expect("the parts make a system")
}

/// A position that starts from rest has no displacement in the first guess, and one in a large unit none above the round-off of another.
#[test]
fn every_method_starts_from_rest_in_any_units() {
    let units = [
        [1.5e10, 6.5e-8, 1e6],
        [5.4e11, 5.8e-7, 1.1e9],
        [1e12, 1e-4, 1.0],
        [1e20, 1.0, 1.0],
        [1e-10, 1e-23, 1e-22],
        [1e11, 1e25, 1e-3],
    ];
    let starts = [[1.0, 0.0, 0.1], [1.0, 1e-17, 0.1], [1.0, 1e-20, 0.0], [1e-9, 1.0, 1e-17]];
    let start = |i: usize| Vector3::from(starts[i]);
    let twin = warming([1.0; 3]);
    let exact = [0, 1, 2, 3].map(|i| {
        DormandPrince8.run(&twin, start(i), Span::until(4.0).tolerance(1e-13)).unwrap().last().point
    });
    macro_rules! as_in_units_of_one {
        ($($method:expr, $span:expr);+) => {$(
            let mut worst = [0.0_f64; 2];
            for i in 0..starts.len() {
                let off = |units: [f64; 3]| {
                    let (system, units) = (warming(units), Vector3::from(units));
                    let run = $method.run(&system, start(i).component_mul(&units), $span).unwrap();
                    (run.last().point.component_div(&units) - exact[i]).amax()
                };
                let own = off([1.0; 3]);
                let error = units.map(off).into_iter().fold(0.0, f64::max);
                worst = [worst[0].max(own), worst[1].max(error)];
                assert!(error <= 5.0 * own + 1e-12, "{}: {error:e}, {own:e}", stringify!($method));
            }
            println!("{}: {:.1e}, in other units {:.1e}", stringify!($method), worst[0], worst[1]);
        )+};
    }
    as_in_units_of_one!(
        WeylMidpoint, Span::steps(0.02, 200);
        Scheme::new(WeylMidpoint).gradient(MeanValue), Span::steps(0.02, 200);
        Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe), Span::steps(0.02, 200);
        Gauss::<2>, Span::steps(0.1, 40);
        Radau::<2>, Span::until(4.0).tolerance(1e-7);
        DormandPrince8, Span::until(4.0).tolerance(1e-9)
    );
}

/// The inner product of a projection onto the laws has no unit of its own to go by.
#[test]
fn explicit_methods_have_the_errors_of_the_dimensionless_twin_in_si_units() {
    let (unit, mu, mass) = (1.495_978_707e11, 1.327_124_4e20, 5.972e24);
    let time = (unit * unit * unit / mu).sqrt();
    let speed = unit / time;
    let x = vector![1.0, 0.0, 0.0, 0.6];
    let scale = vector![unit, unit, mass * speed, mass * speed];
    let (twin, si) = (kepler(1.0, 1.0), kepler(mass, mu));
    let fine = DormandPrince5.run(&twin, x, Span::until(40.0).tolerance(1e-14)).unwrap();
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let a = DormandPrince8.run(&twin, x, Span::until(40.0).tolerance(tolerance)).unwrap();
        let span = Span::until(40.0 * time).tolerance(tolerance);
        let b = DormandPrince8.run(&si, x.component_mul(&scale), span).unwrap();
        let error = |y: Vector4<f64>| (y - fine.last().point).amax();
        let errors = [error(a.last().point), error(b.last().point.component_div(&scale))];
        println!(
            "{tolerance:.0e}: {errors:?}, {} and {} steps",
            a.certificate().steps,
            b.certificate().steps
        );
        assert!(errors[1] <= 2.0 * errors[0], "{errors:?}");
        assert!(b.certificate().keeps_energy(), "{}", b.certificate());
    }
}

/// A magnet on a spring in a bath, `x = (m, (q, p, s))` on `S² × R³`, in units of length, energy and temperature:
///
/// `H = E (−m_z − 0.3 m_x² + ½ (p/P)² + ½ (q/L)² + 0.2 m_x q/L) + C T e^{s/C}`, `S = s`, with `P = 1/L` and `C = 10 E/T`.
/// Friction turns `m` towards its field and slows `p`. A time has the unit `1/E`, because `m' = m × dH`.
struct Magnet {
    length: f64,
    energy: f64,
    temperature: f64,
    friction: f64,
}

type MagnetSpace = Product<Sphere<2>, Euclidean<3>>;
type MagnetState = (Vector3<Real>, Vector3<Real>);

impl Magnet {
    const ONE: Self = Self { length: 1.0, energy: 1.0, temperature: 1.0, friction: 1e-3 };
    /// A Bohr magneton in a field of one tesla at room temperature.
    const SI: Self = Self { length: 1e-9, energy: 9.27e-24, temperature: 300.0, friction: 1e-3 };

    fn system(&self) -> impl Metriplectic<Manifold = MagnetSpace, Metric = Canonical> + use<> {
        let Self { length, energy, temperature, friction } = *self;
        let capacity = 10.0 * energy / temperature;
        let pi = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        System::on(Product(Sphere::<2>::round(), Euclidean::<3>))
            .bracket((AreaForm, Poisson::constant(pi).expect("it is skew")))
            .energy(move |(m, x): &MagnetState| {
                let [q, p] = [x.x / length, x.y * length];
                let motion = (p * p + q * q) * 0.5 + m.x * q * 0.2;
                let bath = (x.z / capacity).exp() * (capacity * temperature);
                (motion - m.z - m.x * m.x * 0.3) * energy + bath
            })
            .entropy(|(_, x): &MagnetState| x.z)
            .dissipation(FieldDissipation(move |(m, _): &MagnetState, w: &SVector<Real, 6>| {
                // Of `b` in each direction of `m` across itself, and of `p`.
                let mut k = SMatrix::<Real, 6, 6>::zeros();
                let [rate, slow] = [friction, friction / (length * length)].map(Real::from);
                let field = Vector3::new(w[0], w[1], w[2]);
                let across = Matrix3::identity() - m * m.transpose();
                for axis in 0..3 {
                    let mut b = SVector::<Real, 6>::zeros();
                    let a: Vector3<Real> = across.column(axis).into();
                    b.fixed_rows_mut::<3>(0).copy_from(&(a * w[5]));
                    b[5] = -a.dot(&field);
                    k += onsager(b, w[5].recip() * rate);
                }
                let mut b = SVector::<Real, 6>::zeros();
                (b[4], b[5]) = (w[5], -w[4]);
                k + onsager(b, w[5].recip() * slow)
            }))
            .build()
            .expect("the parts make a system")
    }

    fn start(&self, moves: bool) -> (Vector3<f64>, Vector3<f64>) {
        let p = if moves { 0.5 / self.length } else { 0.0 };
        let unit = self.energy / self.temperature;
        (vector![0.6, 0.0, -0.8], vector![0.7 * self.length, p, 0.5 * unit])
    }

    /// The entries of a state in these units.
    fn own(&self, (m, x): &(Vector3<f64>, Vector3<f64>)) -> [f64; 6] {
        let unit = self.energy / self.temperature;
        [m.x, m.y, m.z, x.x / self.length, x.y * self.length, x.z / unit]
    }
}

/// The same run in units of one and in SI units: as many steps of each kind, and the same states.
fn targets_alike<Y, M>(method: M, [one, si]: [&Y; 2])
where
    Y: Metriplectic<Manifold = MagnetSpace>,
    M: Method<Y> + Copy + std::fmt::Debug,
{
    for (moves, tolerance) in [(true, 1e-4), (false, 1e-4), (true, 1e-6), (false, 1e-6)] {
        let courses: [&dyn Fn(f64) -> Schedule; 2] =
            [&|unit| Span::until(20.0 * unit).tolerance(tolerance).into(), &|unit| {
                Span::steps(0.05 * unit, 400).into()
            }];
        for course in courses {
            let [a, b] = [(one, &Magnet::ONE), (si, &Magnet::SI)].map(|(system, units)| {
                let schedule = course(units.energy.recip());
                let run = method.run(system, units.start(moves), schedule).expect("it runs");
                let certificate = run.certificate();
                assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
                let kinds = certificate.projected_steps;
                let counts = [certificate.steps, kinds.targeted, kinds.free, kinds.held];
                (counts, units.own(&run.last().point))
            });
            println!("{method:?}, {tolerance:e}, {moves}: {:?}", a.0);
            assert_eq!(a.0, b.0, "{method:?}, {tolerance:e}, {moves}");
            // All but the first steps of a magnet with friction aim at the entropy that it produces.
            assert!(a.0[1] > a.0[0] * 9 / 10, "{:?}", a.0);
            let off = a.1.iter().zip(b.1).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(off < 1e-9, "{method:?}, {tolerance:e}, {moves}: {off:e}");
        }
    }
}

/// Energy, entropy, lengths and momenta of a magnet differ by tens of orders in SI units, and its metric adds their
/// squares.
#[test]
fn explicit_methods_aim_at_the_entropy_alike_in_any_units() {
    let systems = [&Magnet::ONE.system(), &Magnet::SI.system()];
    targets_alike(DormandPrince8, systems);
    targets_alike(DormandPrince5, systems);
    targets_alike(RungeKuttaChebyshev, systems);
}

/// Weak friction heats a magnet by what its motion loses, to the tolerance, in every unit.
#[test]
fn a_magnet_with_weak_friction_follows_its_tolerance_in_any_units() {
    fn run<Y, M>(method: M, system: &Y, units: &Magnet, tolerance: f64) -> ([f64; 6], usize)
    where
        Y: Metriplectic<Manifold = MagnetSpace>,
        M: Method<Y>,
    {
        let span = Span::until(20.0 / units.energy).tolerance(tolerance).at_most(2);
        let run = method.run(system, units.start(true), span).expect("it runs");
        let c = run.certificate();
        assert!(c.keeps_energy() && c.keeps_entropy(), "{c}");
        (units.own(&run.last().point), c.projected_steps.free)
    }
    for friction in [1e-4, 1e-6] {
        let [one, si] = [Magnet::ONE, Magnet::SI].map(|units| Magnet { friction, ..units });
        let (in_one, in_si) = (one.system(), si.system());
        // Each of the two is a reference for the other.
        let (five, _) = run(DormandPrince5, &in_one, &one, 1e-13);
        let (eight, _) = run(DormandPrince8, &in_one, &one, 1e-13);
        for (exact, other) in five.iter().zip(eight) {
            assert!((exact - other).abs() < 1e-10, "{five:?} {eight:?}");
        }
        let off = |name: &str, (end, free): ([f64; 6], usize), exact: [f64; 6], most: [f64; 2]| {
            let moved = (0..5).map(|i| (end[i] - exact[i]).abs()).fold(0.0, f64::max);
            let heated = ((end[5] - exact[5]) / (exact[5] - 0.5)).abs();
            println!(
                "α = {friction:e}, {name}: off by {moved:.1e}, the heat by {heated:.1e}, {free} free"
            );
            assert!(moved < most[0] && heated < most[1], "{name}: {moved:e}, {heated:e}");
        };
        for tolerance in [1e-6, 1e-9] {
            // The error collects over ten turns.
            let most = [1e2 * tolerance, 1e3 * tolerance];
            for (name, system, units) in [("one", &in_one, &one), ("SI", &in_si, &si)] {
                let name = format!("{name}, {tolerance:e}");
                let end = run(DormandPrince8, system, units, tolerance);
                off(&format!("order 8, {name}"), end, five, most);
                let end = run(DormandPrince5, system, units, tolerance);
                off(&format!("order 5, {name}"), end, eight, most);
            }
        }
    }
}

/// Bodies of energies `e_i` in a row that exchange heat, `S = Σ c_i ln e_i`, with constants added to `H` and `S`.
fn heated(
    [energy, entropy]: [f64; 2],
) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    System::on(Euclidean::<4>)
        .bracket(Zero)
        .energy(move |e: &Vector4<Real>| e.x + e.y + e.z + e.w + energy)
        .entropy(move |e: &Vector4<Real>| e.x.ln() + e.y.ln() * 2.0 + e.z.ln() + e.w.ln() + entropy)
        .dissipation(FieldDissipation(|_: &Vector4<Real>, w: &Vector4<Real>| {
            let b = |i: usize| {
                let mut b = Vector4::zeros();
                (b[i], b[i + 1]) = (w[i + 1], -w[i]);
                b
            };
            onsager(b(0), real(10.0)) + onsager(b(1), real(1.0)) + onsager(b(2), real(5.0))
        }))
        .build()
        .expect("the parts make a system")
}

/// A damped pendulum with its bath, with constants added to `H` and `S`.
fn swinging(
    [energy, entropy]: [f64; 2],
) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    let pi = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    System::on(Euclidean::<3>)
        .bracket(Poisson::constant(pi).expect("it is skew"))
        .energy(move |x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z.exp() + energy)
        .entropy(move |x: &Vector3<Real>| x.z + entropy)
        .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
            onsager(Vector3::new(real(0.0), w.z, -w.y), w.z.recip() * 0.4)
        }))
        .build()
        .expect("the parts make a system")
}

/// Constants of 10⁶ times the range of `H` and `S` leave their values ten digits. They change no motion, so they may
/// cost no more steps and move the end by no more than its tolerance.
fn ignores_constants<Y: Metriplectic<Metric = Canonical>, M: Method<Y> + Clone>(
    name: &str,
    method: &M,
    shifted: impl Fn([f64; 2]) -> Y,
    x0: &metriplectic::dynamics::system::Point<Y>,
    tolerance: f64,
) {
    let span = Span::until(20.0).tolerance(tolerance);
    let run = |constants| {
        let run = method.clone().run(&shifted(constants), x0.clone(), span).expect("it runs");
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        (certificate.steps + certificate.rejected, Y::Manifold::entries(&run.last().point))
    };
    let (steps, end) = run([0.0, 0.0]);
    for constants in [[0.0, 1e6], [1e6, 0.0], [-1e6, 1e6]] {
        let (more, other) = run(constants);
        let off = end.iter().zip(&other).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        println!(
            "{name}, {tolerance:e}, {constants:?}: {more} steps for {steps}, off by {off:.1e}"
        );
        // Values beside the constants have ten digits.
        let allowed = 20.0 * tolerance + 1e-8;
        assert!(more * 2 <= steps * 3 && off < allowed, "{name}, {constants:?}: {more}, {off:e}");
    }
}

#[test]
fn constants_in_the_energy_and_the_entropy_cost_no_steps() {
    let heat = vector![1.0, 3.0, 0.5, 2.0];
    let swings = [vector![1.5, 0.5, 0.0], vector![1.5, 0.0, 0.0]];
    macro_rules! ignored {
        ($($method:expr, $tolerances:expr);+) => {$(
            for tolerance in $tolerances {
                let name = stringify!($method);
                ignores_constants(name, &$method, heated, &heat, tolerance);
                for start in &swings {
                    ignores_constants(name, &$method, swinging, start, tolerance);
                }
            }
        )+};
    }
    ignored!(
        DormandPrince8, [1e-4, 1e-6, 1e-8, 1e-10];
        DormandPrince5, [1e-4, 1e-6, 1e-8, 1e-10];
        RungeKuttaChebyshev, [1e-4, 1e-6]
    );
}

/// A Morse molecule `x = (r, p)`: `H = p²/2μ + D (1 − e^{−a(r − r₀)})²`.
fn molecule(
    [mass, depth, width, length]: [f64; 4],
) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| {
            let stretch = -((-x.x + length) * width).exp() + 1.0;
            x.y * x.y * (0.5 / mass) + stretch * stretch * depth
        })
        .build()
        .expect("the parts make a system")
}

#[test]
fn a_molecule_in_si_units_vibrates_like_its_dimensionless_twin() {
    // Hydrogen: the reduced mass, the depth, the width and the length of the bond.
    let [mass, depth, width, length] = [8.367e-28, 7.61e-19, 1.943e10, 7.414e-11];
    let time = (mass / depth).sqrt() / width;
    let scale = vector![width.recip(), (mass * depth).sqrt()];
    let start = vector![length * width + 0.5, 0.1];
    let twin = molecule([1.0, 1.0, 1.0, length * width]);
    let si = molecule([mass, depth, width, length]);
    let courses: [fn(f64) -> Schedule; 2] =
        [|t| Span::steps(0.05 * t, 2000).into(), |t| Span::until(100.0 * t).into()];
    let exact = WeylMidpoint.run(&twin, start, Span::steps(0.001, 100_000)).unwrap();
    for course in courses {
        let a = WeylMidpoint.run(&twin, start, course(1.0)).unwrap();
        let b = WeylMidpoint.run(&si, start.component_mul(&scale), course(time)).unwrap();
        let error = |x: Vector2<f64>| (x - exact.last().point).amax();
        let errors = [error(a.last().point), error(b.last().point.component_div(&scale))];
        println!("{errors:.2?}\n{}\n{}", a.certificate(), b.certificate());
        Claim::new(
            Guarantee::Units,
            "vibrating molecule in SI units, T = 100 in its unit of time",
            "WeylMidpoint",
        )
        .against("its dimensionless twin, whose error is the bound's half")
        .record(scientific(errors[1]), scientific(2.0 * errors[0]));
        assert!(errors[1] <= 2.0 * errors[0] && errors[0] > 0.0);
        assert!(b.certificate().keeps_energy(), "{}", b.certificate());
        assert!(b.certificate().max_relative_energy_error() < 2e-14);
    }
}

#[test]
fn an_entropy_in_tiny_units_falls_where_it_falls() {
    // The published scheme lowers the entropy of the gas containers on half of the steps, in any unit.
    let falls = |unit: f64, spectator: f64| {
        let system = System::on(Euclidean::<5>)
            .bracket(Poisson::field(|x: &Vector5| {
                let (left, right) =
                    (-x[2] / x[0] * (2.0 / 3.0), x[3] / (-x[0] + 2.0) * (2.0 / 3.0));
                skew::<5>(&[(0, 1, real(1.0)), (2, 1, left), (3, 1, right)])
            }))
            .energy(|x: &Vector5| x[1].powi(2) * 0.5 + x[2] + x[3])
            .entropy(move |x: &Vector5| {
                (x[0].ln() + (-x[0] + 2.0).ln() + (x[2].ln() + x[3].ln()) * 1.5) * unit
            })
            .dissipation(FieldDissipation(move |_: &Vector5, w: &Vector5| {
                let zero = real(0.0);
                onsager(Vector5::from([zero, zero, w[3], -w[2], zero]), real(1e-3 / unit))
            }))
            .second_law(SecondLaw::Published)
            .build()
            .expect("the parts make a system");
        let x = SVector::from([1.0, 2.0, 2.0, 2.0, spectator]);
        let run = WeylMidpoint.run(&system, x, Span::steps(0.1, 300)).expect("it runs");
        run.certificate().entropy_falls
    };
    assert_eq!(falls(1.0, 0.0), 150);
    assert_eq!([falls(1e-16, 0.0), falls(1e20, 0.0), falls(1.0, 1e12)], [150; 3]);
}

#[test]
fn an_energy_in_tiny_units_is_printed_with_its_digits() {
    let tiny = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 1.5e-16)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&tiny, vector![1.0, 0.0], Span::steps(1e14, 10)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy(), "{certificate}");
    assert!(certificate.to_string().contains("H₀ = 1.500000e-16"), "{certificate}");
    // Most of the energy is lost, and no bound of scale one hides it.
    let mut lost = certificate.clone();
    lost.max_energy_error = 1.2e-16;
    assert!(!lost.keeps_energy() && lost.to_string().contains("first law:   BROKEN"), "{lost}");
}

/// A curved space has no unit of length, but times, energies and entropies have units there too.
fn curved<Y: Metriplectic>(
    name: &str,
    [system, scaled]: [&Y; 2],
    start: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    h: f64,
    units: [i32; 3],
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let [time, energy, entropy] = units.map(|k| 2.0_f64.powi(k));
    let entries = vec![1.0; Y::Manifold::entries(start).len()];
    let factors = Units { entries, time, energy, entropy };
    let until = |t: f64| Schedule::from(Span::until(40.0 * h * t).tolerance(1e-5));
    let courses: [(Schedule, Schedule); 2] =
        [(Span::steps(h, 60).into(), Span::steps(h * time, 60).into()), (until(1.0), until(time))];
    for (course, other) in courses {
        let run = UnitRun { system, x0: start.clone(), course };
        let twin = UnitRun { system: scaled, x0: start.clone(), course: other };
        let laws = [
            laws::scaling(&Scheme::new(WeylMidpoint), &run, &twin, &factors, 0.0),
            laws::scaling(&DormandPrince8, &run, &twin, &factors, 0.0),
            laws::scaling(&DormandPrince5, &run, &twin, &factors, 0.0),
            laws::scaling(&RungeKuttaChebyshev, &run, &twin, &factors, 0.0),
            laws::scaling(&Gauss2, &run, &twin, &factors, 0.0),
            laws::scaling(&Radau3, &run, &twin, &factors, 0.0),
        ];
        for law in laws {
            law.unwrap_or_else(|law| panic!("{name}, {units:?}: {law}"));
        }
    }
    Claim::new(
        Guarantee::Units,
        format!("{name}, in {units:?}"),
        "six methods, fixed and adaptive steps",
    )
    .against("the run with times, energies and entropies in these powers of two")
    .record("the same bits", "the same bits");
}

#[test]
fn curved_spaces_obey_the_scaling_law_in_times_energies_and_entropies() {
    // x' = x × dH: an energy in units of E makes times of 1/E.
    let top = |e: f64| {
        System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(move |x: &Vector3<Real>| {
                (x.x.powi(2) * 0.5 + x.y.powi(3) * 0.4 + x.z * x.x) * e
            })
            .build()
            .unwrap()
    };
    for k in [-70, -9, 13, 60] {
        let systems = [&top(1.0), &top(2.0_f64.powi(k))];
        curved("top on S²", systems, &vector![0.48, 0.6, 0.64], 0.1, [-k, k, 0]);
    }
    // Nambu's bracket is linear in S, and K dS = κ (|dH|² − dH ⊗ dH) dS in S and quadratic in H.
    let group = |e: f64, s: f64| {
        System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(move |r: &Matrix3<Real>| {
                (r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5) * e
            })
            .entropy(move |r: &Matrix3<Real>| {
                (r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25) * s
            })
            .dissipation(MetricDissipation::scaled(move |_: &Matrix3<Real>| Real::from(0.1 / e)))
            .build()
            .unwrap()
    };
    let start = metriplectic::manifolds::rotations::exp(&vector![0.3, -0.2, 0.5]);
    for [e, s] in [[20, 0], [0, -17], [-33, 40], [7, -50]] {
        let systems = [&group(1.0, 1.0), &group(2.0_f64.powi(e), 2.0_f64.powi(s))];
        curved("Nambu on SO(3)", systems, &start, 0.05, [-e - s, e, s]);
    }
    // A relaxation on S³: both laws, and no bracket.
    let sphere = |e: f64, s: f64| {
        System::on(Sphere::<3>::round())
            .bracket(Zero)
            .energy(move |x: &Vector4<Real>| (x.x.powi(2) + x.y * x.z * 0.3 + x.w) * e)
            .entropy(move |x: &Vector4<Real>| (x.w * 0.5 - x.x * x.y) * s)
            .build()
            .unwrap()
    };
    for [e, s] in [[11, 0], [0, 31], [-20, 3]] {
        let systems = [&sphere(1.0, 1.0), &sphere(2.0_f64.powi(e), 2.0_f64.powi(s))];
        curved("S³", systems, &vector![0.5, 0.5, 0.5, 0.5], 0.1, [-2 * e - s, e, s]);
    }
}

/// A spin about an oscillator in a bath, in units of angular momentum, length and energy, at 300 K per unit of temperature:
/// both the Casimir of the spin and its momentum about the third axis are listed.
#[test]
fn listed_invariants_of_unlike_factors_are_independent_in_any_units() {
    type State = (Vector3<Real>, Vector3<Real>);
    let ends = [[1.0; 4], [1e-34, 1e-9, 1e-23, 300.0]].map(|[spin, length, energy, kelvin]| {
        let capacity = 10.0 * energy / kelvin;
        let pi = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let system = System::on(Product(LieDual::so3(), Euclidean::<3>))
            .bracket((LiePoisson, Poisson::constant(pi).expect("it is skew")))
            .energy(move |(l, x): &State| {
                let l = *l * Real::from(1.0 / spin);
                let [q, p] = [x.x / length, x.y * (length / spin)];
                let body = (l.x * l.x + l.y * l.y) * 0.5 + l.z * l.z * (q * 0.1 + 0.2);
                let bath = (x.z / capacity).exp() * (capacity * kelvin);
                (body + (p * p + q * q) * 0.5) * energy + bath
            })
            .entropy(|(_, x): &State| x.z)
            .dissipation(FieldDissipation(move |_: &State, w: &SVector<Real, 6>| {
                let b = SVector::<Real, 6>::from([
                    0.0.into(),
                    0.0.into(),
                    0.0.into(),
                    0.0.into(),
                    w[5],
                    -w[4],
                ]);
                b * b.transpose() * (w[5].recip() * (0.1 * spin / (length * length)))
            }))
            .casimir(move |(l, _): &State| l.norm_squared() * (0.5 / spin / spin))
            .momentum(|(l, _): &State| l.z)
            .build()
            .expect("the parts make a system");
        let start = (
            Vector3::new(0.6, 0.3, 0.8) * spin,
            Vector3::new(0.7 * length, 0.3 * spin / length, 0.5 * energy / kelvin),
        );
        let span = Span::steps(0.05 * spin / energy, 400);
        let run = DormandPrince8.run(&system, start, span).expect("its invariants are independent");
        let c = run.certificate();
        assert!(c.keeps_energy() && c.keeps_entropy() && c.keeps_invariants(), "{c}");
        let (l, x) = run.last().point;
        let [q, p, s] = [x.x / length, x.y * length / spin, x.z * kelvin / energy];
        ([l.x / spin, l.y / spin, l.z / spin, q, p, s], c.projected_steps)
    });
    let [(one, steps), (si, steps_in_si)] = ends;
    let off = one.iter().zip(si).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("off by {off:.1e}");
    assert_eq!(steps, steps_in_si);
    // The rounding of 400 steps; measured: 1.3e-15.
    assert!(off < 400.0 * f64::EPSILON, "off by {off:e}");
}
