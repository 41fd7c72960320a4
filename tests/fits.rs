//! Fits of systems of any kind: against fits of families, whose derivatives are exact, and against the scatter of noisy data.

use metriplectic::equations::{Apart, Covectors, Differences, ENERGY, Equations, Part, Sizes};
use metriplectic::fitting::{Failure, Fit, FitError, Fitted, Loss};
use metriplectic::integrators::{Element, Entries, Flow, FromEquations, Schedule, StepSequence};
use metriplectic::lattices::{BondState, Model, SiteState};
use metriplectic::manifolds::rand::rngs::ChaCha8Rng;
use metriplectic::manifolds::rand::{RngExt, SeedableRng};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};

/// Gaussian numbers of a seed.
fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move || {
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Times `count` times apart, from the first step on.
fn every(step: f64, count: usize) -> Vec<f64> {
    (1..=count).map(|k| step * k as f64).collect()
}

/// Data of a run at the true parameters with a noise, what of a state is observed, and where a fit of them begins.
struct Case<'a, O, X, const P: usize> {
    names: [&'static str; P],
    truth: SVector<f64, P>,
    guess: SVector<f64, P>,
    times: &'a [f64],
    observe: O,
    start: X,
    noise: f64,
}

/// Fits data of a system, and checks the estimates against the truth, the noise against that of the data, and the gradient of the loss
/// `χ²/2` at the fit.
fn finds<S, M, B, E, O, const P: usize, const K: usize>(
    case: &Case<'_, O, Element<S>, P>,
    build: &B,
    method: &M,
    schedule: impl Into<Schedule>,
) -> Fitted
where
    S: Flow,
    E: Into<Failure> + std::fmt::Debug,
    M: Clone + std::fmt::Debug + Stepper<S>,
    B: Fn(&SVector<f64, P>) -> Result<S, E>,
    O: Fn(&Element<S>) -> SVector<f64, K>,
    Element<S>: 'static,
{
    let (schedule, sigma) = (schedule.into(), case.noise);
    let (system, mut noise) = (build(&case.truth).expect("a system"), normal(17));
    let start = case.start.clone();
    let asked = schedule.clone().output_at(case.times.iter().copied());
    let run = method.clone().run(&system, start.clone(), asked).expect("a run");
    let indices = run.indices_at(case.times).expect("states");
    let data: Vec<SVector<f64, K>> = indices
        .into_iter()
        .map(|i| (case.observe)(&run.states()[i].point) + SVector::from_fn(|_, _| sigma * noise()))
        .collect();
    let fit = Fit::of_systems(case.names, build)
        .observe(&case.observe)
        .data(case.times, &data)
        .positive_all()
        .start_at(start.clone())
        .run(method.clone(), schedule.clone(), case.guess)
        .expect("a fit");
    println!("{}: {fit}", method.name());
    for (estimate, truth) in fit.estimates.iter().zip(&case.truth) {
        let off = (estimate.value - truth).abs() / estimate.standard_error;
        assert!(off < 3.5 && estimate.standard_error < 0.1 * truth, "{fit}");
    }
    assert!((0.7..1.3).contains(&(fit.noise / sigma)), "{fit}");
    let loss = Loss::of_systems(case.names, build)
        .starts(&[start])
        .times(case.times)
        .term(|_, k, x| ((case.observe)(x) - data[k]).norm_squared() * 0.5 / (sigma * sigma))
        .over(method.clone(), schedule);
    let best = SVector::<f64, P>::from_column_slice(&fit.parameters);
    let [at_guess, at_best] = [case.guess, best].map(|theta| {
        let (_, slope) = loss.gradient_at(&theta).expect("a gradient");
        slope.iter().zip(&fit.estimates).map(|(g, e)| (g * e.standard_error).abs()).sum::<f64>()
    });
    // In standard errors: a fit ends where less than a tenth of one is left.
    assert!(at_best < 0.2 && at_guess > 3.0, "{at_best} {at_guess}");
    fit
}

/// A rotor with friction: `θ = (I₁, I₂, γ)`.
macro_rules! rotors {
    () => {{
        // Pointers to functions: each use of closures would be a family of its own type.
        type Field = fn(&Vector3<Real>, &Vector3<Real>) -> Real;
        let energy: Field = |p, t| (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z) * 0.5;
        let entropy: Field = |p, t| p.norm_squared() * t.z * 0.5;
        Family::on(LieDual::so3())
            .parameters(["I1", "I2", "friction"])
            .energy(energy)
            .entropy(entropy)
            .build()
            .expect("a family")
    }};
}

#[test]
fn a_fit_by_differences_is_the_one_by_derivatives() {
    let family = rotors!();
    let (start, truth) = (vector![0.4, -1.0, 0.3], vector![3.0, 2.0, 0.05]);
    let times = every(0.5, 20);
    macro_rules! agree {
        ($($method:expr, $schedule:expr, $bound:expr);*) => {$({
            let schedule: Schedule = $schedule.into();
            let mut noise = normal(3);
            let exact = $method
                .run(&family.at(truth), start, schedule.clone().output_at(times.clone()))
                .expect("a run");
            let data: Vec<Vector3<f64>> = exact.states()[1..]
                .iter()
                .map(|state| state.point + Vector3::from_fn(|_, _| 1e-3 * noise()))
                .collect();
            let guess = vector![2.8, 2.1, 0.04];
            let by_derivatives = Fit::of(&family)
                .observe(|p: &Vector3<Real>| *p)
                .data(&times, &data)
                .positive(["friction"])
                .start_at(start)
                .run($method, schedule.clone(), guess)
                .expect("a fit");
            let by_differences =
                Fit::of_systems(["I1", "I2", "friction"], |t| Ok::<_, Error>(family.at(*t)))
                    .observe(|p: &Vector3<f64>| *p)
                    .data(&times, &data)
                    .positive(["friction"])
                    .start_at(start)
                    .run($method, schedule, guess)
                    .expect("a fit");
            let off = |of: fn(&metriplectic::fitting::Estimate) -> f64| {
                let [a, b] = [&by_derivatives, &by_differences].map(|fit| fit.estimates.iter().map(of));
                a.zip(b).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs() / a.abs()))
            };
            let (values, errors) = (off(|e| e.value), off(|e| e.standard_error));
            Claim::new(Guarantee::Derivatives, "estimates of a fit by differences", stringify!($method))
                .against("a fit by derivatives")
                .record(format!("{values:.1e}"), concat!("< ", stringify!($bound)));
            assert!(values < $bound && errors < 1e-6, "{values:e} {errors:e}");
            assert!(by_derivatives.standard_error_is_small());
        })*};
    }
    trait Small {
        fn standard_error_is_small(&self) -> bool;
    }
    impl Small for Fitted {
        fn standard_error_is_small(&self) -> bool {
            self.estimates.iter().all(|e| e.standard_error < 0.1 * e.value)
        }
    }
    // The minimum is known to a tenth of a standard error; near it both take the steps of Gauss and Newton.
    agree!(
        DormandPrince8, Span::until(10.0).tolerance(1e-8), 1e-6;
        DormandPrince5, Span::until(10.0).tolerance(1e-7), 1e-6;
        Gauss::<2>, Span::until(10.0).tolerance(1e-7), 1e-6;
        Radau::<2>, Span::steps(0.05, 200), 1e-6;
        Scheme::new(WeylMidpoint), Span::steps(0.05, 200), 1e-6;
        Scheme::new(WeylMidpoint), Span::until(10.0).tolerance(1e-5), 1e-6;
        RungeKuttaChebyshev, Span::until(10.0).tolerance(1e-6), 1e-6
    );
}

/// A satellite about the Earth in a thin atmosphere, in SI units: position and velocity, and the drag `−c |v| v` of a unit of mass.
#[test]
fn the_drag_of_a_satellite_scatters_as_its_standard_error_says() {
    const GM: f64 = 3.986e14;
    let satellite = |t: &Vector1<f64>| {
        let drag = t.x;
        System::on(Euclidean::<4>)
            .bracket(Symplectic)
            .energy(|x: &Vector4<Real>| {
                (x.z * x.z + x.w * x.w) * 0.5 - (x.x * x.x + x.y * x.y).sqrt().recip() * GM
            })
            .work("drag", move |_: Real, x: &Vector4<Real>| {
                let speed = (x.z * x.z + x.w * x.w).sqrt();
                vector![0.0.into(), 0.0.into(), -(x.z * speed * drag), -(x.w * speed * drag)]
            })
            .build()
    };
    let (truth, start) = (vector![1e-13], vector![7e6, 0.0, 0.0, 7.6e3]);
    let times = every(600.0, 30);
    let span = Span::until(18_000.0).tolerance(1e-9);
    let system = satellite(&truth).unwrap();
    let run =
        DormandPrince8.run(&system, system.start(start), span.output_at(times.clone())).unwrap();
    let (mut noise, mut scatter) = (normal(11), Vec::new());
    let mut standard_error = 0.0;
    for _ in 0..40 {
        // Ten metres in each coordinate.
        let place = |state: &State<OpenSpace<Euclidean<4>>>| state.point.x.xy();
        let data: Vec<Vector2<f64>> = run.states()[1..]
            .iter()
            .map(|state| place(state) + vector![10.0 * noise(), 10.0 * noise()])
            .collect();
        let fit = Fit::of_systems(["drag"], satellite)
            .observe(|state: &OpenState<Vector4<f64>>| state.x.xy())
            .data(&times, &data)
            .noise(10.0)
            .start_from(move |system, _| system.start(start))
            .run(DormandPrince8, span, vector![3e-13])
            .unwrap();
        let drag = fit.estimate("drag").unwrap();
        scatter.push((drag.value - truth.x) / drag.standard_error);
        standard_error = drag.standard_error;
    }
    let rms = (scatter.iter().map(|z| z * z).sum::<f64>() / 40.0).sqrt();
    println!("drag ± {standard_error:.1e}: {rms:.2} of the standard errors");
    // The root mean square of 40 numbers of variance 1 is off by 0.11 on average.
    assert!((0.6..1.4).contains(&rms), "{rms}");
    assert!(standard_error < 0.1 * truth.x);
}

/// A spacecraft that a motor turns, with a tank in which the fuel sloshes: the fuel swings against a spring, and rubs at the wall.
#[test]
fn the_damping_of_a_tank_is_found_from_the_rate_of_its_spacecraft() {
    const INERTIA: [f64; 2] = [40.0, 3.0];
    let spacecraft = |t: &Vector2<f64>| {
        let (stiffness, damping) = (t.x, t.y);
        let spin = |x: &Vector4<Real>, k: usize| x[2 + k] / INERTIA[k];
        System::on(Euclidean::<4>)
            .bracket(Symplectic)
            .energy(move |x: &Vector4<Real>| {
                let kinetic = x[2] * spin(x, 0) + x[3] * spin(x, 1);
                (kinetic + (x[1] - x[0]).powi(2) * stiffness) * 0.5
            })
            .work("motor", |t: Real, _: &Vector4<Real>| {
                vector![0.0.into(), 0.0.into(), (t * 0.4).sin() * 2.0, 0.0.into()]
            })
            .bath(
                "tank",
                Bath::at(290.0).friction(move |_: Real, _: &Vector4<Real>, _: &Vector4<Real>| {
                    let along = vector![0.0.into(), 0.0.into(), (-1.0).into(), 1.0.into()];
                    [Contact { rate: damping.into(), along }]
                }),
            )
            .build()
    };
    let case = Case {
        names: ["stiffness", "damping"],
        truth: vector![6.0, 0.8],
        guess: vector![4.0, 0.3],
        times: &every(0.5, 60),
        observe: |state: &OpenState<Vector4<f64>>| vector![state.x[2] / INERTIA[0]],
        start: spacecraft(&vector![6.0, 0.8]).unwrap().start(vector![0.0, 0.1, 0.0, 0.0]),
        noise: 1e-3,
    };
    finds(&case, &spacecraft, &DormandPrince8, Span::until(30.0).tolerance(1e-8));
    finds(&case, &spacecraft, &Gauss::<2>, Span::steps(0.1, 300));
    finds(&case, &spacecraft, &Scheme::new(WeylMidpoint), Span::until(30.0).tolerance(1e-5));
}

/// A rod whose bonds conduct: alone, with noise, and between an oven and the cold.
#[test]
fn the_conduction_of_lattices_is_found_from_temperatures_and_heat() {
    type Rod = Euclidean<1>;
    fn rod(conduction: f64) -> Result<Lattice<impl Model<Manifold = Rod>>, LatticeError> {
        Lattice::on(Graph::chain(8), Euclidean::<1>)
            .energy(|u: &Vector1<Real>| u.x)
            .entropy(|u: &Vector1<Real>| u.x.ln())
            .bond_onsager(move |bond: &BondState<'_, Rod>| {
                let [u, v] = bond.x.map(|u| u.x);
                [Onsager {
                    rate: conduction * u * v,
                    b: [vector![bond.w[1].x], vector![-bond.w[0].x]],
                }]
            })
            .build()
    }
    let warm = |i: usize| vector![if i < 3 { 2.0 } else { 1.0 }];
    let alone = |t: &Vector1<f64>| rod(t.x);
    let case = Case {
        names: ["conduction"],
        truth: vector![0.6],
        guess: vector![0.2],
        times: &every(0.3, 20),
        observe: |u: &Points<Rod>| vector![u[1].x, u[6].x],
        start: alone(&vector![1.0]).unwrap().points(warm),
        noise: 1e-3,
    };
    finds(&case, &alone, &DormandPrince8, Span::until(6.0).tolerance(1e-8));
    finds(&case, &alone, &RungeKuttaChebyshev, Span::until(6.0).tolerance(1e-6));
    finds(&case, &alone, &Radau::<2>, Span::steps(0.1, 60));
    // The path of its noise moves with the conduction.
    let noisy = |t: &Vector1<f64>| Ok::<_, LatticeError>(rod(t.x)?.with_noise(Boltzmann(1e-4)));
    let random = RandomFlow(DormandPrince5).seed(6);
    finds(&case, &noisy, &random, Span::steps(0.05, 120));
    let opened = |t: &Vector2<f64>| {
        let contact = t.y;
        let touches = move |_: f64, at: &SiteState<'_, Rod>| {
            [Onsager { rate: contact * at.x.x, b: vector![1.0] }]
        };
        Ok::<_, LatticeError>(rod(t.x)?.opened().bath("oven", 2.0, [0], touches))
    };
    let rod = opened(&vector![1.0, 1.0]).unwrap();
    let start = rod.start(rod.lattice().points(|_| vector![1.0]));
    let case = Case {
        names: ["conduction", "contact"],
        truth: vector![3.0, 0.7],
        guess: vector![1.0, 1.0],
        times: &every(0.4, 25),
        observe: |state: &OpenState<Points<Rod>>| {
            vector![state.x[1].x, state.x[6].x, state.ledger.heat("oven").unwrap_or(f64::NAN)]
        },
        start,
        noise: 1e-3,
    };
    finds(&case, &opened, &DormandPrince5, Span::until(10.0).tolerance(1e-7));
    finds(&case, &opened, &RungeKuttaChebyshev, Span::until(10.0).tolerance(1e-6));
    finds(&case, &opened, &RungeKuttaChebyshev, Span::steps(0.1, 100));
}

/// Paths of a particle in a trap, whose trap and friction are found with the numbers of its noise known.
#[test]
fn noisy_paths_are_fitted_at_their_own_numbers() {
    type At<D> = (Vector2<D>, Vector1<D>);
    macro_rules! particle {
        ($theta:expr) => {{
            let (trap, friction) = ($theta.x, $theta.y);
            System::on(Product(Euclidean::<2>, Euclidean::<1>))
                .bracket((Symplectic, Zero))
                .dissipation(OnsagerDissipation(move |_: &At<Real>, w: &Vector3<Real>| {
                    let along = vector![0.0.into(), w.z, -w.y];
                    [Contact { rate: friction.into(), along }]
                }))
                .energy(move |(x, u): &At<Real>| (x.y * x.y + x.x * x.x * trap) * 0.5 + u.x)
                .entropy(|(_, u): &At<Real>| u.x)
        }};
    }
    let (alone, pulled) = (
        |t: &Vector2<f64>| particle!(t).noise(Boltzmann(0.05)).build(),
        |t: &Vector2<f64>| {
            let pull = |t: Real, _: &At<Real>| vector![0.0.into(), t.sin() * 0.3, 0.0.into()];
            particle!(t).work("pull", pull).noise(Boltzmann(0.05)).build()
        },
    );
    let start = (vector![1.0, 0.0], vector![3.0]);
    let (random, span) = (RandomFlow(DormandPrince5).seed(4), Span::steps(0.05, 200));
    let case = Case {
        names: ["trap", "friction"],
        truth: vector![1.7, 0.4],
        guess: vector![1.5, 0.3],
        times: &every(0.5, 20),
        observe: |(x, _): &At<f64>| vector![x.x],
        start,
        noise: 1e-3,
    };
    finds(&case, &alone, &random, span);
    let Case { names, truth, guess, times, noise, .. } = case;
    let observe = |state: &OpenState<At<f64>>| vector![state.x.0.x];
    let start = pulled(&truth).unwrap().flow().start(start);
    let case = Case { names, truth, guess, times, noise, observe, start };
    finds(&case, &pulled, &random, span);
}

/// A ball that loses a part of its momentum at the floor: the steps of a run go on after each bounce.
#[test]
fn a_restitution_is_found_across_the_bounces() {
    let ball = |t: &Vector1<f64>| {
        let gravity = t.x;
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(move |x: &Vector2<Real>| x.y * x.y * 0.5 + x.x * gravity)
            .build()
    };
    // Bounces at t = √(2 z/g) and after 2 e v/g: both depend on the gravity.
    let floor = |span: Schedule| -> Schedule {
        let falls = span.event("floor", |x: &Vector2<f64>| x.x).falling();
        falls.jump(|_, x: &Vector2<f64>| vector![x.x, -0.8 * x.y]).into()
    };
    let height = |g: f64, t: f64| {
        let (mut from, mut v) = ((2.0 / g).sqrt(), 0.8 * (2.0 * g).sqrt());
        if t < from {
            return 1.0 - 0.5 * g * t * t;
        }
        while t > from + 2.0 * v / g {
            (from, v) = (from + 2.0 * v / g, 0.8 * v);
        }
        v * (t - from) - 0.5 * g * (t - from).powi(2)
    };
    let times = [0.31, 0.52, 0.95, 1.3, 1.55, 1.8];
    let data = times.map(|t| vector![height(9.8, t)]);
    macro_rules! fitted {
        ($($method:expr, $schedule:expr, $bound:expr);*) => {$({
            let fit = Fit::of_systems(["gravity"], ball)
                .observe(|x: &Vector2<f64>| vector![x.x])
                .data(&times, &data)
                .start_at(vector![1.0, 0.0])
                .run($method, floor($schedule.into()), vector![9.6])
                .unwrap();
            let off = (fit.parameters[0] - 9.8).abs();
            println!("{}: {off:.1e}", stringify!($method));
            assert!(off < $bound, "{off:e}");
        })*};
    }
    // Parabolas are exact for each method, but for the round-off of the bounces.
    fitted!(
        DormandPrince8, Span::until(1.8).tolerance(1e-8), 1e-9;
        DormandPrince5, Span::steps(0.1, 18), 1e-9;
        Gauss::<2>, Span::until(1.8).tolerance(1e-8), 1e-9;
        WeylMidpoint, Span::steps(0.1, 18), 1e-9
    );
}

/// A row of masses of any number between springs, as a system of one's own.
struct Row {
    count: usize,
    stiffness: f64,
}

impl Equations for Row {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2 * self.count, directions: 2 * self.count, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let (q, p) = x.split_at(self.count);
        let stretch = |i: usize| {
            let at = |i: usize| if i == 0 || i > self.count { 0.0 } else { q[i - 1] };
            at(i + 1) - at(i)
        };
        let springs = (0..=self.count).map(|i| self.stiffness * stretch(i).powi(2));
        let moving = p.iter().map(|p| p * p);
        values.fill(0.0);
        values[ENERGY] = 0.5 * springs.chain(moving).sum::<f64>();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        let (q, p) = x.split_at(self.count);
        for i in 0..self.count {
            let at = |i: usize| if i == 0 || i > self.count { 0.0 } else { q[i - 1] };
            w[i] = self.stiffness * (2.0 * at(i + 1) - at(i) - at(i + 2));
            w[self.count + i] = p[i];
        }
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let mut w = vec![0.0; 2 * x.len()];
        self.differentials(t, x, &mut [0.0; 2], &mut w);
        let (energy, entropy) = w.split_at(x.len());
        self.apply(Part::Reversible, t, x, Covectors { energy, entropy }, energy, v);
        Some(0.0)
    }
}

impl Apart for Row {
    fn is_zero(&self, part: Part) -> bool {
        part != Part::Reversible
    }

    fn apply(&self, _: Part, _: f64, _: &[f64], _: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let (q, p) = v.split_at_mut(self.count);
        q.copy_from_slice(&alpha[self.count..]);
        p.iter_mut().zip(alpha).for_each(|(p, alpha)| *p = -alpha);
    }
}

#[test]
fn a_system_of_ones_own_is_fitted_by_every_kind_of_method_in_any_unit() {
    let count = 6;
    // The number of masses is known at run time; an energy of 10⁻²⁰ is one of molecules.
    for unit in [1.0, 1e-20] {
        let row = |t: &Vector1<f64>| {
            let row = Row { count, stiffness: t.x };
            Ok::<_, Error>(FromEquations(Differences(row)))
        };
        let start: Vec<f64> = (0..2 * count).map(|i| if i == 1 { unit } else { 0.0 }).collect();
        let case = Case {
            names: ["stiffness"],
            truth: vector![1.6],
            guess: vector![1.5],
            times: &every(0.7, 10),
            observe: |x: &Entries| vector![x[0], x[4]],
            start: Entries::from(start.as_slice()),
            noise: 1e-3 * unit,
        };
        finds(&case, &row, &DormandPrince8, Span::until(7.0).tolerance(1e-7));
        finds(&case, &row, &Gauss::<2>, Span::steps(0.1, 70));
        finds(&case, &row, &Radau::<2>, Span::until(7.0).tolerance(1e-6));
        finds(&case, &row, &Scheme::new(WeylMidpoint), Span::steps(0.1, 70));
    }
}

#[test]
fn a_system_of_ones_own_in_surroundings_is_fitted_with_its_ledger() {
    let count = 3;
    let row = |t: &Vector3<f64>| {
        let (push, friction) = (t.y, t.z);
        let row = FromEquations(Differences(Row { count, stiffness: t.x }));
        let row = row.opened().work("motor", move |t, _, v| v[count] = push * (1.3 * t).sin());
        Ok::<_, Error>(row.bath("air", 0.7, move |_, contact| {
            (count..2 * count).for_each(|p| contact(friction, &[(p, 1.0)]));
        }))
    };
    let start = row(&vector![1.6, 0.4, 0.1]).unwrap().start([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let case = Case {
        names: ["stiffness", "push", "friction"],
        truth: vector![1.6, 0.4, 0.1],
        guess: vector![1.5, 0.5, 0.15],
        times: &every(0.7, 10),
        observe: |x: &OpenState<Entries>| {
            vector![x.x[0], x.x[2], x.ledger.heat("air").unwrap_or(f64::NAN)]
        },
        start,
        noise: 1e-3,
    };
    finds(&case, &row, &DormandPrince8, Span::until(7.0).tolerance(1e-7));
    finds(&case, &row, &Gauss::<2>, Span::steps(0.1, 70));
    finds(&case, &row, &Radau::<2>, Span::until(7.0).tolerance(1e-6));
    finds(&case, &row, &Scheme::new(WeylMidpoint), Span::steps(0.1, 70));
}

/// The strength of a port and the friction of a bath of a family, from places and heat with noise.
#[test]
fn a_family_with_surroundings_is_fitted_as_it_is() {
    let pushed = Family::on(Euclidean::<2>)
        .parameters(["stiffness", "push", "friction"])
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>, t: &Vector3<Real>| (x.y * x.y + x.x * x.x * t.x) * 0.5)
        .work("motor", |time: Real, _: &Vector2<Real>, t: &Vector3<Real>| {
            vector![0.0.into(), (time * 1.3).sin() * t.y]
        })
        .bath("air", |t: &Vector3<f64>| {
            let rate = Real::from(t.z);
            Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate, along: Vector2::<Real>::y() }]
            })
        })
        .build()
        .unwrap();
    let (truth, guess) = (vector![1.5, 0.4, 0.1], vector![1.4, 0.5, 0.2]);
    let (times, sigma, mut noise) = (every(0.5, 30), 1e-3, normal(5));
    let span = || Span::until(15.0).tolerance(1e-8);
    let (system, start) = (pushed.at(truth), vector![1.0, 0.0]);
    let start = system.start(start);
    let observe =
        |s: &OpenState<Vector2<f64>>| vector![s.x.x, s.ledger.heat("air").unwrap_or(f64::NAN)];
    let run = DormandPrince8.run(&system, start.clone(), span().output_at(times.clone())).unwrap();
    let data: Vec<_> = run.states()[1..]
        .iter()
        .map(|state| observe(&state.point) + Vector2::from_fn(|_, _| sigma * noise()))
        .collect();
    let fit = Fit::of(&pushed)
        .observe(observe)
        .data(&times, &data)
        .positive(["friction"])
        .start_at(start.clone())
        .run(DormandPrince8, span(), guess)
        .unwrap();
    println!("{fit}");
    for (estimate, truth) in fit.estimates.iter().zip(&truth) {
        let off = (estimate.value - truth).abs() / estimate.standard_error;
        assert!(off < 3.5 && estimate.standard_error < 0.01 * truth, "{fit}");
    }
    assert!((0.7..1.3).contains(&(fit.noise / sigma)), "{fit}");
    let build = |t: &Vector3<f64>| Ok::<_, Error>(pushed.at(*t).into_system());
    let by_closure = Fit::of_systems(*pushed.names(), build)
        .observe(observe)
        .data(&times, &data)
        .positive(["friction"])
        .start_at(start.clone())
        .run(DormandPrince8, span(), guess)
        .unwrap();
    assert_eq!(fit.parameters, by_closure.parameters);
    // The gradient of a loss, and the fit is where it vanishes.
    let term = |_, k: usize, x: &OpenState<Vector2<f64>>| {
        (observe(x) - data[k]).norm_squared() * 0.5 / (sigma * sigma)
    };
    let loss = Loss::of(&pushed)
        .starts(std::slice::from_ref(&start))
        .times(&times)
        .term(term)
        .over(DormandPrince8, span());
    let in_errors = |theta: Vector3<f64>| {
        let (_, slope) = loss.gradient_at(&theta).unwrap();
        slope.iter().zip(&fit.estimates).map(|(g, e)| (g * e.standard_error).abs()).sum::<f64>()
    };
    let [at_guess, at_best] = [guess, Vector3::from_column_slice(&fit.parameters)].map(in_errors);
    println!("{at_guess} {at_best}");
    assert!(at_best < 0.2 && at_guess > 3.0, "{at_best} {at_guess}");
}

#[test]
fn a_gradient_by_differences_is_the_one_by_the_adjoint() {
    let family = rotors!();
    let (theta, times) = (vector![3.0, 2.0, 0.05], [2.0, 5.0, 9.0]);
    let starts = [vector![0.4, -1.0, 0.3], vector![-0.7, 0.2, 0.9]];
    let weight = |i: usize, k: usize| 1.0 + (i as f64) + 0.3 * k as f64;
    let exact = Loss::of(&family)
        .starts(&starts)
        .times(&times)
        .term(|i, k, p: &Vector3<Real>| (p.x * p.y + p.z) * weight(i, k));
    let by_differences =
        Loss::of_systems(["I1", "I2", "friction"], |t| Ok::<_, Error>(family.at(*t)))
            .starts(&starts)
            .times(&times)
            .term(|i, k, p: &Vector3<f64>| (p.x * p.y + p.z) * weight(i, k));
    let span = Span::steps(0.05, 180);
    let (exact, by_differences) =
        (exact.over(DormandPrince8, span), by_differences.over(DormandPrince8, span));
    let [(a, along), (b, slopes)] =
        [exact.gradient_at(&theta).unwrap(), by_differences.gradient_at(&theta).unwrap()];
    assert_eq!(by_differences.value(&theta).unwrap().to_bits(), b.to_bits());
    let off = (along - slopes).component_div(&along).amax();
    // Round-off ε^{2/3} = 4e-11 of terms that cancel to a tenth, and truncation of motions that turn three times.
    println!("{:e} {along:?} {off:e}", a - b);
    assert!((a - b).abs() < 1e-13 && off < 1e-8, "{off:e}");
    let zero = by_differences.gradient_at(&vector![3.0, 2.0, 0.0]).unwrap_err();
    assert!(zero.to_string().starts_with("the guess of friction is zero"), "{zero}");
}

#[test]
fn runs_in_the_same_steps_have_their_bits_and_a_smooth_end() {
    let family = rotors!();
    let (theta, start) = (vector![3.0, 2.0, 0.05], vector![0.4, -1.0, 0.3]);
    macro_rules! replayed {
        ($($method:expr, $tolerance:expr);*) => {$({
            let schedule = Schedule::from(Span::until(15.0).tolerance($tolerance));
            let taken = StepSequence::default();
            let run = $method.run(&family.at(theta), start, schedule.clone().noting(&taken)).unwrap();
            let count = run.last().step;
            assert_eq!((taken.ends().len(), taken.ends().last().copied()), (count, Some(15.0)));
            let again = $method.run(&family.at(theta), start, schedule.clone().taking(&taken)).unwrap();
            let times = |run: &Trajectory<_>| run.iter().map(|s| s.time.to_bits()).collect::<Vec<_>>();
            assert_eq!(times(&run), times(&again), "{}", stringify!($method));
            let off = (run.last().point - again.last().point).norm();
            assert!(off < 1e-13, "{off:e}");
            assert!(again.certificate().keeps_energy() && again.certificate().keeps_entropy());
            // Third differences of the ends at many values of a parameter: those of a smooth function are small.
            let end = |k: i32, schedule: Schedule| {
                let moved = theta + vector![1e-3 * f64::from(k), 0.0, 0.0];
                $method.run(&family.at(moved), start, schedule).unwrap().last().point.x
            };
            let bend = |of: &dyn Fn(i32) -> f64| {
                let ends: Vec<f64> = (-100..=100).map(of).collect();
                let third = ends.windows(4).map(|e| (e[3] - 3.0 * e[2] + 3.0 * e[1] - e[0]).abs());
                third.fold(0.0, f64::max)
            };
            let [frozen, free] = [
                bend(&|k| end(k, schedule.clone().taking(&taken))),
                bend(&|k| end(k, schedule.clone())),
            ];
            println!("{}: {frozen:.1e} in the same steps, {free:.1e} in their own", stringify!($method));
            assert!(frozen < 1e-7 && free > 10.0 * frozen, "{frozen:e} {free:e}");
        })*};
    }
    replayed!(
        DormandPrince8, 1e-5;
        DormandPrince5, 1e-4;
        Gauss::<2>, 1e-4;
        Radau::<2>, 1e-4;
        WeylMidpoint, 1e-3;
        RungeKuttaChebyshev, 1e-4
    );
    // Steps of one size have no sequence.
    let taken = StepSequence::default();
    let fixed = Schedule::from(Span::steps(0.1, 10)).noting(&taken);
    DormandPrince8.run(&family.at(theta), start, fixed).unwrap();
    assert!(taken.ends().is_empty());
}

#[test]
fn fits_without_a_size_a_system_or_a_run_are_errors() {
    let decay = |t: &Vector2<f64>| {
        let rate = t.x;
        if rate > 5.0 {
            return Err("it decays too fast".into());
        }
        let system = System::on(Euclidean::<2>)
            .energy(|x: &Vector2<Real>| x.y)
            .entropy(move |x: &Vector2<Real>| -(x.x * x.x * rate * 0.5))
            .build();
        system.map_err(Box::<dyn std::error::Error + Send + Sync>::from)
    };
    let times = every(0.5, 8);
    let data: Vec<_> = times.iter().map(|t| vector![2.0 * (-t).exp()]).collect();
    let fit = || {
        Fit::of_systems(["rate", "start"], decay)
            .observe(|x: &Vector2<f64>| vector![x.x])
            .data(&times, &data)
            .start_from(|_, t| vector![t.y, 1.0])
    };
    let span = || Span::until(4.0).tolerance(1e-8);
    // The start is an unknown too.
    let found = fit().run(DormandPrince8, span(), vector![0.7, 1.5]).unwrap();
    assert!((found.parameters[0] - 1.0).abs() < 1e-6 && (found.parameters[1] - 2.0).abs() < 1e-6);
    assert_eq!(found.start, [found.parameters[1], 1.0]);
    let error = fit().run(DormandPrince8, span(), vector![0.7, 0.0]).unwrap_err();
    assert!(matches!(error, FitError::NoSize { name: "start" }), "{error}");
    let error = fit().free(["rate"]).run(DormandPrince8, span(), vector![0.0, 2.0]).unwrap_err();
    assert!(matches!(error, FitError::NoSize { name: "rate" }), "{error}");
    let error = fit().run(DormandPrince8, span(), vector![6.0, 2.0]).unwrap_err();
    assert!(error.to_string().contains("it decays too fast"), "{error}");
    let error = fit().free(["color"]).run(DormandPrince8, span(), vector![1.0, 2.0]).unwrap_err();
    assert!(matches!(error, FitError::UnknownParameter { .. }), "{error}");
    // At the edge of the domain the slope is that of one side.
    let edge = fit().free(["start"]).run(DormandPrince8, span(), vector![5.0, 1.0]).unwrap();
    assert!(edge.parameters[1] > 1.0);
    let at_edge = fit().run(DormandPrince8, span(), vector![5.0, 1.0]).unwrap();
    assert!((at_edge.parameters[0] - 1.0).abs() < 1e-5, "{at_edge}");
    // A run that stops before the data.
    let stopped = span().event("half", |x: &Vector2<f64>| x.x - 0.5).stop();
    let error = fit().run(DormandPrince8, stopped, vector![1.0, 2.0]).unwrap_err();
    assert!(error.to_string().contains("stopped at the event"), "{error}");
}

/// An oscillator in air, whose motion is known: `x(t) = e^{−ct/2} cos(Ωt) + ..`, and whose lost energy is heat of the air.
#[test]
fn derivatives_of_work_heat_and_state_are_those_of_closed_forms() {
    let oscillator = |t: &Vector3<f64>| {
        let (stiffness, friction) = (t.x, t.y);
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(move |x: &Vector2<Real>| (x.y * x.y + x.x * x.x * stiffness) * 0.5)
            .bath(
                "air",
                Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: friction.into(), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .build()
    };
    // The position, and the heat from the air, from the position t.z at rest.
    let exact = |t: Vector3<f64>, time: f64| {
        let (rate, fall) = ((t.x - 0.25 * t.y * t.y).sqrt(), 0.5 * t.y);
        let ((sine, cosine), decay) = ((rate * time).sin_cos(), (-fall * time).exp());
        let q = t.z * decay * (cosine + fall / rate * sine);
        let p = -t.z * decay * t.x / rate * sine;
        vector![q, 0.5 * (p * p + t.x * (q * q - t.z * t.z))]
    };
    let theta = vector![1.5, 0.2, 0.8];
    macro_rules! agree {
        ($($method:expr, $schedule:expr, $bound:expr);*) => {$({
            let found = Fit::of_systems(["stiffness", "friction", "start"], oscillator)
                .observe(|s: &OpenState<Vector2<f64>>| {
                    vector![s.x.x, s.ledger.heat("air").unwrap_or(f64::NAN)]
                })
                .start_from(|system, t| system.start(vector![t.z, 0.0]))
                .derivatives($method, $schedule, theta, &[0.0, 2.0, 7.0])
                .unwrap();
            let mut worst = 0.0_f64;
            for (time, observation) in [0.0, 2.0, 7.0].into_iter().zip(&found) {
                worst = worst.max((observation.value - exact(theta, time)).amax());
                for k in 0..3 {
                    // By the five points of a polynomial of degree 4.
                    let at = |d: f64| exact(theta + Vector3::ith(k, d), time);
                    let slope = ((at(1e-3) - at(-1e-3)) * 8.0 - at(2e-3) + at(-2e-3)) / 12e-3;
                    worst = worst.max((observation.along.column(k) - slope).amax());
                }
            }
            Claim::new(Guarantee::Derivatives, "state and heat of an oscillator in air", stringify!($method))
                .against("the closed form")
                .record(format!("{worst:.1e}"), concat!("< ", stringify!($bound)));
            assert!(worst < $bound, "{worst:e}");
        })*};
    }
    agree!(
        DormandPrince8, Span::until(7.0).tolerance(1e-12), 2e-9;
        DormandPrince5, Span::until(7.0).tolerance(1e-11), 2e-9;
        Gauss::<3>, Span::steps(0.05, 140), 2e-9;
        // Its steps of order 2 have an error of 1e-6.
        WeylMidpoint, Span::steps(0.002, 3500), 1e-5
    );
    let zero = Fit::of_systems(["stiffness", "friction", "start"], oscillator)
        .observe(|s: &OpenState<Vector2<f64>>| vector![s.x.x])
        .start_from(|system, t| system.start(vector![t.z, 0.0]))
        .derivatives(DormandPrince8, Span::until(1.0), vector![1.0, 0.0, 1.0], &[1.0]);
    assert!(matches!(zero, Err(FitError::NoSize { name: "friction" })));
}
