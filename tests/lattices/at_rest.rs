//! Lattices that are released from rest follow their tolerance.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use metriplectic::integrators::Schedule;
use metriplectic::lattices::Model;
use metriplectic::prelude::*;
use metriplectic_studies::checkpoints;

type Pair = (Vector2<Real>, Vector2<Real>);

/// A ring of equal masses on equal springs.
fn ring(sites: usize, mass: f64, spring: f64) -> Lattice<impl Model<Manifold = Euclidean<2>>> {
    Lattice::on(Graph::ring(sites), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| x.y * x.y * (0.5 / mass))
        .bond_energy(move |(x, y): &Pair| (y.x - x.x).powi(2) * (0.5 * spring))
        .build()
        .expect("the parts make a lattice")
}

/// The largest error of `q_i = A cos(ki) cos ωt` at the end, relative to `A`, and the certificate.
fn standing_wave(
    lattice: &Lattice<impl Model<Manifold = Euclidean<2>>>,
    [amplitude, k, omega]: [f64; 3],
    schedule: impl Into<Schedule>,
) -> (f64, Certificate) {
    let mode = |i: usize| amplitude * (k * i as f64).cos();
    let start = lattice.points(|i| vector![mode(i), 0.0]);
    let run = DormandPrince5.run(lattice, start, schedule).expect("it runs");
    let phase = (omega * run.last().time).cos();
    let off = run.last().point.iter().enumerate().map(|(i, x)| (x.x - mode(i) * phase).abs());
    (off.fold(0.0, f64::max) / amplitude, run.certificate().clone())
}

#[test]
fn a_plucked_ring_follows_its_tolerance_in_every_unit() {
    // ω = 2 sin(π/4): 112 periods.
    let (k, omega, end) = (FRAC_PI_2, 2_f64.sqrt(), 500.0);
    let span = |tolerance| Span::until(end).tolerance(tolerance).at_most(2);
    let runs = [1e-6, 1e-9]
        .map(|tolerance| standing_wave(&ring(64, 1.0, 1.0), [1.0, k, omega], span(tolerance)));
    println!("{} {}\n{}", runs[0].0, runs[1].0, runs[1].1);
    // From a start with the momenta 10⁻³ ωq the errors are 1.50e-5 and 3.85e-9.
    assert!(runs[0].0 < 3e-5 && runs[1].0 < 8e-9, "{} {}", runs[0].0, runs[1].0);
    assert!(runs.iter().all(|(_, c)| c.keeps_energy() && c.misjudged_size.is_none()));
    // Masses and springs in powers of two leave the frequency as it is.
    let [mass, amplitude] = [80, -90].map(|power| 2_f64.powi(power));
    let (off, other) = standing_wave(&ring(64, mass, mass), [amplitude, k, omega], span(1e-6));
    assert_eq!((off, other.steps), (runs[0].0, runs[0].1.steps));
}

#[test]
fn atoms_in_si_units_follow_their_tolerance() {
    let (mass, spring, amplitude) = (4e-26, 20.0, 1e-12);
    let (k, end) = (TAU / 8.0, 1e-10);
    let omega = 2.0 * f64::sqrt(spring / mass) * (k / 2.0).sin();
    let atoms = ring(64, mass, spring);
    for (tolerance, most) in [(1e-6, 3e-4), (1e-9, 8e-8)] {
        let span = Span::until(end).tolerance(tolerance).at_most(2);
        let (off, certificate) = standing_wave(&atoms, [amplitude, k, omega], span);
        println!("{tolerance:e}: {off:.1e} after {:.0} radians", omega * end);
        assert!(off < most && certificate.keeps_energy(), "{tolerance:e}: {off:.1e}");
    }
}

/// Two isolated sites with the frequencies 1 and 100, or one of them.
fn isolated(stiffness: &[f64]) -> Lattice<impl Model<Manifold = Euclidean<2>>> {
    Lattice::on(Graph::from_bonds(stiffness.len(), []), Euclidean::<2>)
        .bracket(Symplectic)
        .site_data(stiffness.to_vec())
        .energy_with(|x: &Vector2<Real>, k: &f64| x.y * x.y * 0.5 + x.x * x.x * (0.5 * k))
        .build()
        .expect("the parts make a lattice")
}

#[test]
fn a_site_takes_the_steps_that_a_system_takes() {
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x * x.x * 5e3)
        .build()
        .unwrap();
    let lattice = isolated(&[1e4]);
    let (start, span) = (vector![1.0, 0.0], Span::until(5.0).tolerance(1e-9).at_most(2));
    let one = DormandPrince5.run(&system, start, span).unwrap();
    let other = DormandPrince5.run(&lattice, lattice.points(|_| start), span).unwrap();
    let exact = 500_f64.cos();
    let off = [one.last().point.x, other.last().point[0].x].map(|x| (x - exact).abs());
    let steps = [one.certificate(), other.certificate()].map(|c| c.steps);
    println!("{steps:?} steps, off by {off:?}");
    // The norm of a site is a mean over its directions, so its error may be larger by √2.
    assert!(off[1] < 2.0 * off[0] && off[0] < 1e-8, "{off:?}");
    assert!(steps[1] * 10 > steps[0] * 8, "{steps:?}");
}

#[test]
fn a_small_fast_site_beside_a_large_slow_one_keeps_to_the_tolerance() {
    let lattice = isolated(&[1.0, 1e4]);
    for tolerance in [1e-6, 1e-9] {
        let start = lattice.points(|i| vector![[1.0, 1e-20][i], 0.0]);
        let span = Span::until(50.0).tolerance(tolerance);
        let run = DormandPrince5.run(&lattice, start, span).unwrap();
        let small = run.states().iter().map(|state| state.point[1].x.abs());
        let (small, certificate) = (small.fold(0.0, f64::max), run.certificate());
        println!("{tolerance:e}: {small:.1e}, |ΔH| = {:.1e}", certificate.max_energy_error);
        // Positions have one size on the lattice, and stability lets the small one grow to 6.6 tolerances.
        assert!(small < 20.0 * tolerance, "{tolerance:e}: {small:.1e}");
        // 4ε Σ|h|, the bound of the documentation.
        assert!(certificate.max_energy_error <= 4.0 * f64::EPSILON * 0.5);
    }
}

#[test]
fn a_long_run_of_fput_follows_its_tolerance() {
    let file = include_str!("../data/fput.json");
    let file: serde_json::Value = serde_json::from_str(file).expect("the data are JSON");
    let number = |name: &str| file[name].as_f64().expect("a number");
    let positions: Vec<(usize, f64)> =
        serde_json::from_value(file["positions"].clone()).expect("sites and numbers");
    let (masses, alpha, end) = (32, number("alpha"), number("end"));
    let last = masses + 1;
    let is_free = |i: usize| if i == 0 || i == last { 0.0 } else { 1.0 };
    let lattice = Lattice::on(Graph::chain(masses + 2), Euclidean::<2>)
        .bracket(Symplectic)
        .site_data((0..masses + 2).map(is_free).collect())
        .energy_with(|x: &Vector2<Real>, free: &f64| x.y * x.y * (0.5 * free))
        .bond_energy(move |(x, y): &Pair| {
            let r = y.x - x.x;
            r * r * 0.5 + r * r * r * (alpha / 3.0)
        })
        .build()
        .unwrap();
    let mode = |i: usize| if i == last { 0.0 } else { (PI * i as f64 / last as f64).sin() };
    let period = PI / (PI / (2.0 * last as f64)).sin();
    for (eight, tolerance) in
        [(true, 1e-6), (true, 1e-8), (true, 1e-10), (true, 1e-12), (false, 1e-8)]
    {
        let start = lattice.points(|i| vector![mode(i), 0.0]);
        let span = Span::until(end).tolerance(tolerance).at_most(2);
        let run = if eight {
            DormandPrince8.run(&lattice, start, span).unwrap()
        } else {
            DormandPrince5.run(&lattice, start, span).unwrap()
        };
        let point = &run.last().point;
        let off = positions.iter().map(|&(i, q)| (point[i].x - q).abs());
        // The reference has twelve digits.
        let allowed = (10.0 * tolerance * end / period).max(1e-8);
        let (off, c) = (off.fold(0.0, f64::max), run.certificate());
        println!("order 8: {eight}, {tolerance:e}: off by {off:.1e} of {allowed:.1e}, {c}");
        assert!(off <= allowed, "{tolerance:e}: off by {off:.1e}");
        // Steps that collapse would be far shorter than the least one of a sound run.
        assert!(c.keeps_energy() && c.smallest_step > 0.02 * c.largest_step, "{c}");
    }
}

/// Beside an oscillator from rest, an entry that moves with the power `k + 1` of time.
#[test]
fn an_entry_that_moves_with_a_high_power_of_time_starts_from_rest() {
    for k in [2, 5, 6, 9] {
        let energy = move |x: &Vector4<Real>| (x.x * x.x + x.z * x.z) * 0.5 + x.w * x.z.powi(k);
        let system = System::on(Euclidean::<4>).bracket(Symplectic).energy(energy).build().unwrap();
        let lattice = Lattice::on(Graph::ring(3), Euclidean::<4>)
            .bracket(Symplectic)
            .energy(energy)
            .build()
            .unwrap();
        let (start, span) = (vector![1.0, 0.0, 0.0, 0.0], Span::until(20.0).tolerance(1e-7));
        let one = DormandPrince5.run(&system, start, span).unwrap();
        let all = DormandPrince5.run(&lattice, lattice.points(|_| start), span).unwrap();
        let fine = DormandPrince8.run(&system, start, Span::until(20.0).tolerance(1e-12)).unwrap();
        for (end, c) in
            [(one.last().point, one.certificate()), (all.last().point[0], all.certificate())]
        {
            let off = (end - fine.last().point).norm();
            println!("k = {k}: off by {off:.1e} in {} steps", c.steps);
            assert!(off < 1e-4 && c.steps < 500, "k = {k}: off by {off:e}, {c}");
        }
    }
}

#[test]
fn the_sizes_of_a_kind_of_entry_can_be_said() {
    let (lattice, wave) = (ring(64, 1.0, 1.0), [1.0, FRAC_PI_2, 2_f64.sqrt()]);
    let span = Span::until(20.0).tolerance(1e-6);
    let of_kinds = standing_wave(&lattice, wave, span.scale([1.0, 1.5]));
    let each: [f64; 128] = std::array::from_fn(|i| if i % 2 == 0 { 1.0 } else { 1.5 });
    assert_eq!(of_kinds, standing_wave(&lattice, wave, span.scale(each)));
    let fewer = standing_wave(&lattice, wave, span.scale([100.0, 150.0])).1;
    assert!(fewer.steps < of_kinds.1.steps);
    // A size that the state does not reach is in the certificate.
    let fewer = standing_wave(&lattice, wave, span.scale([0.0, 200.0])).1;
    let misjudged = fewer.misjudged_size.expect("momenta of 1.4");
    println!("{fewer}");
    assert_eq!((misjudged.direction, misjudged.judged), (1, 200.0));
    assert!(misjudged.reached < 1.5);
    let start = lattice.points(|_| vector![0.0, 0.0]);
    let error = DormandPrince5.run(&lattice, start, span.scale([1.0; 3])).unwrap_err();
    let expected = SpanError::Entries { found: 3, expected: 2 };
    assert!(matches!(error, RunError::Span(error) if error == expected), "{error}");
}

#[test]
fn a_run_from_rest_is_resumed_with_its_sizes() {
    let lattice = ring(16, 1.0, 1.0);
    let start = lattice.points(|i| vector![(FRAC_PI_2 * i as f64).cos(), 0.0]);
    let span = Span::until(20.0).tolerance(1e-6).scale([0.0, 200.0]);
    let mut steps = DormandPrince5.steps(&lattice, start.clone(), span).unwrap();
    for _ in 0..5 {
        steps.advance().unwrap();
    }
    let checkpoint = steps.checkpoint();
    let text = checkpoints::written(&checkpoint);
    // Sizes are in the file once for each kind of entry.
    assert!(text.contains(r#""Scale":["0.0","200.0"]"#), "{text}");
    let read = checkpoints::reread(&checkpoint);
    let resumed = DormandPrince5.resume(&lattice, &read).unwrap().run().unwrap();
    let whole = DormandPrince5.run(&lattice, start, span).unwrap();
    assert_eq!(resumed.last().point, whole.last().point);
    assert_eq!(resumed.certificate(), whole.certificate());
    assert!(whole.certificate().misjudged_size.is_some());
}
