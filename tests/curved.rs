//! Implicit steps of systems in plain numbers on spaces that are not flat, and with metrics of their own.

use std::f64::consts::FRAC_PI_2;

use metriplectic::dynamics::bracket::{AreaForm, Zero};
use metriplectic::dynamics::{InNumbers, Metriplectic, system::Point};
use metriplectic::equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Part, SecondLaw, Sizes, laws,
};
use metriplectic::equations::{ByCharts, Path};
use metriplectic::fields::Space as _;
use metriplectic::integrators::{
    Entries, Flow as _, FromEquations, ItohAbe, Method, NoImplicitSteps, OpenEquations, Schedule,
    SymmetricItohAbe, Vector as _,
};
use metriplectic::prelude::*;

/// The largest distance of the states of a system in numbers from those in its types; both keep both laws.
fn apart<Y, N>(system: &Y, x: &Point<Y>, schedule: Schedule, method: N) -> f64
where
    Y: Metriplectic,
    N: Method<Y> + for<'a> Method<FromEquations<InNumbers<'a, Y>>> + Copy,
{
    let typed = method.run(system, x.clone(), schedule.clone()).expect("a run in types");
    let numbers = FromEquations(InNumbers(system));
    let run = method.run(&numbers, Y::Manifold::entries(x).into(), schedule).expect("a run");
    let certificates = [typed.certificate(), run.certificate()];
    for certificate in certificates {
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert_eq!(certificate.steps, certificates[0].steps);
    }
    assert_eq!(typed.states().len(), run.states().len());
    typed.states().iter().zip(run.states()).fold(0.0, |most, (typed, run)| {
        let pairs = Y::Manifold::entries(&typed.point).into_iter().zip(run.point.iter());
        pairs.map(|(a, b)| (a - b).abs()).fold(most, f64::max)
    })
}

/// Asserts that a system in numbers takes the steps of its types, and that its paths have their laws.
fn agrees<Y: Metriplectic>(name: &str, system: &Y, x: &Point<Y>, h: f64) {
    let fixed = || -> Schedule { Span::steps(h, 30).into() };
    let off = [
        apart(system, x, fixed(), WeylMidpoint),
        apart(system, x, fixed(), Scheme::new(Exponential).gradient(MeanValue)),
        apart(system, x, fixed(), Scheme::new(ChartMidpoint).gradient(ItohAbe)),
        apart(system, x, fixed(), Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe)),
        apart(system, x, fixed(), Gauss::<3>),
        apart(system, x, fixed(), Radau::<2>),
    ];
    println!("{name}: {off:?}");
    // Round-off in states of size 1, which the friction of a step does not make larger.
    assert!(off.iter().all(|off| *off < 1e-11), "{name}: {off:?}");
    // Sizes of steps follow an estimate of the error by other derivatives.
    let span = || Span::until(20.0 * h).tolerance(1e-4).output_every(3.0 * h);
    let off = [apart(system, x, span(), WeylMidpoint), apart(system, x, span(), Gauss::<3>)];
    println!("{name} by a tolerance: {off:?}");
    assert!(off.iter().all(|off| *off < 1e-6), "{name}: {off:?}");
    let (model, x) = (InNumbers(system), Y::Manifold::entries(x));
    let u: Vec<f64> = (0..model.sizes().directions).map(|i| 0.3 - 0.17 * i as f64).collect();
    for path in [Path::Exponential, Path::Weyl, Path::Chart] {
        laws::paths(&model, &model, path, &x, &u).expect("paths");
    }
    laws::paths(&model, &ByCharts(&model), Path::Chart, &x, &u).expect("lines of charts");
}

#[test]
fn systems_on_curved_spaces_take_the_steps_of_their_types() {
    let sphere = System::on(Sphere::<2>::round())
        .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.y * 0.25 + x.x.powi(3) * 0.1)
        .entropy(|x: &Vector3<Real>| x.z + x.x * x.y * 0.3)
        .build()
        .unwrap();
    agrees("a sphere", &sphere, &vector![0.48, 0.36, -0.8], 0.1);
    let spin = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
            n.x * n.x * 0.5 + n.y * n.y * 0.25 - n.z * 0.4 + s.x.exp()
        })
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()
        .unwrap();
    agrees("a spin", &spin, &(vector![0.6, 0.0, 0.8], vector![0.2]), 0.1);
    // With a momentum, about the vertical axis.
    let top = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy(|(r, p): &(Matrix3<Real>, Vector3<Real>)| {
            (p.x * p.x + p.y * p.y) * 0.5 + p.z * p.z * 0.2 + r[(2, 2)] * 0.3
        })
        .momentum(|(_, p): &(Matrix3<Real>, Vector3<Real>)| p.z)
        .build()
        .unwrap();
    agrees("a top", &top, &(Matrix3::identity(), vector![0.9, 0.4, -0.7]), 0.1);
}

#[test]
fn systems_with_metrics_take_the_steps_of_their_types() {
    // Geodesics by steps of their own, and derivatives of the metric.
    let half_plane = System::on(Chart::<2>::new(|q| q.y > 0.0))
        .metric(Metric::field(|q: &Vector2<Real>| {
            Matrix2::from_diagonal_element((q.y * q.y).recip())
        }))
        .bracket(Zero)
        .energy(|q: &Vector2<Real>| q.x * q.x * 0.5 + (q.y - 1.0).powi(2))
        .entropy(|q: &Vector2<Real>| q.y.ln() + q.x * 0.1)
        .build()
        .unwrap();
    agrees("a half plane", &half_plane, &vector![0.3, 1.2], 0.1);
    // A constant one.
    let g = Metric::constant(matrix![2.0, 0.3, 0.0; 0.3, 1.0, 0.1; 0.0, 0.1, 0.5]).unwrap();
    let body = System::on(LieDual::so3())
        .metric(g)
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    agrees("a body", &body, &vector![0.4, -1.0, 0.3], 0.1);
}

/// A spin on a sphere of the user's, with the entropy of its bath: `n' = n × ∇h − r n × (n × ∇h)/T` with `h = ½ n_x² + ¼ n_y² − 0.4 n_z`
/// and the temperature `T = exp s`.
struct Spin;

/// Two unit vectors normal to `n`.
fn frame(n: Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = Vector3::ith(n.abs().imin(), 1.0);
    let e = n.cross(&axis).normalize();
    [e, n.cross(&e)]
}

fn spin(x: &[f64]) -> (Vector3<f64>, f64) {
    (vector![x[0], x[1], x[2]], x[3])
}

impl Equations for Spin {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 4, directions: 3, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let (n, s) = spin(x);
        values[ENERGY] = n.x * n.x * 0.5 + n.y * n.y * 0.25 - n.z * 0.4 + s.exp();
        values[ENTROPY] = s;
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        let (n, s) = spin(x);
        let slope = vector![n.x, n.y * 0.5, -0.4];
        let e = frame(n);
        w.copy_from_slice(&[slope.dot(&e[0]), slope.dot(&e[1]), s.exp(), 0.0, 0.0, 1.0]);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (mut values, mut w, mut k) = ([0.0; 2], [0.0; 6], [0.0; 3]);
        self.differentials(t, x, &mut values, &mut w);
        let covectors = Covectors { energy: &w[..3], entropy: &w[3..] };
        self.apply(Part::Reversible, t, x, covectors, &w[..3], v);
        self.apply(Part::Irreversible, t, x, covectors, &w[3..], &mut k);
        v.iter_mut().zip(k).for_each(|(v, k)| *v += k);
        Some(k[2])
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        sizes.copy_from_slice(&[1.0, 1.0, x[3].abs()]);
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        let (n, s) = spin(x);
        let [a, b] = frame(n);
        let (v, angle) = (a * q[0] + b * q[1], q[0].hypot(q[1]));
        let sinc = if angle > 0.0 { angle.sin() / angle } else { 1.0 };
        let end = (n * angle.cos() + v * sinc).normalize();
        y.copy_from_slice(&[end.x, end.y, end.z, s + q[2]]);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        let ((n, s), (end, after)) = (spin(x), spin(y));
        let across = end - n * n.dot(&end);
        let (sine, cosine) = (across.norm(), n.dot(&end));
        let stretch = if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 };
        let [a, b] = frame(n).map(|e| e.dot(&across) * stretch);
        q.copy_from_slice(&[a, b, after - s]);
        sine.atan2(cosine) < 1.5
    }
}

impl Apart for Spin {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, _: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.fill(0.0);
        if part == Part::Reversible {
            (v[0], v[1]) = (-alpha[1], alpha[0]);
            return;
        }
        let w = w.energy;
        for b in [[w[2], 0.0, -w[0]], [0.0, w[2], -w[1]]] {
            let force = 0.2 * (b[0] * alpha[0] + b[1] * alpha[1] + b[2] * alpha[2]);
            (0..3).for_each(|i| v[i] += force * b[i]);
        }
    }

    fn has_charts(&self) -> bool {
        true
    }
}

#[test]
fn a_system_with_charts_of_its_own_has_implicit_steps() {
    let typed = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
            n.x * n.x * 0.5 + n.y * n.y * 0.25 - n.z * 0.4 + s.x.exp()
        })
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .dissipation(FieldDissipation(
            |(n, _): &(Vector3<Real>, Vector1<Real>), w: &Vector4<Real>| {
                let slope = Vector3::new(w.x, w.y, w.z);
                let across = slope - n * n.dot(&slope);
                (0..3).fold(Matrix4::zeros(), |k, i| {
                    let axis = Vector3::<Real>::ith(i, 1.0.into());
                    let leg = (axis - n * n[i]) * w.w;
                    let b = Vector4::new(leg.x, leg.y, leg.z, -across[i]);
                    k + b * b.transpose() * Real::from(0.2)
                })
            },
        ))
        .build()
        .unwrap();
    let own = FromEquations(Differences(Spin));
    let (x, entries) = ((vector![0.6, 0.0, 0.8], vector![0.2]), vec![0.6, 0.0, 0.8, 0.2]);
    let model = Differences(Spin);
    laws::paths(&model, &ByCharts(&model), Path::Chart, &entries, &[0.3, -0.2, 0.1]).unwrap();
    let chart = Scheme::new(ChartMidpoint);
    let span = || Span::steps(0.1, 30);
    macro_rules! off {
        ($method:expr) => {{
            let run = $method.run(&own, entries.clone().into(), span()).unwrap();
            let certificate = run.certificate();
            assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
            let typed = $method.run(&typed, x, span()).unwrap();
            let (n, s) = &typed.last().point;
            let end = [n.x, n.y, n.z, s.x];
            let pairs = end.iter().zip(run.last().point.iter());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        }};
    }
    let off = [off!(chart), off!(Gauss::<2>), off!(Radau::<2>)];
    println!("{off:?}");
    // The displacement of a step has twelve digits.
    assert!(off.iter().all(|off| *off < 1e-10), "{off:?}");
    // Derivatives, in the frames of the charts of the user.
    let turned = |x: &[f64]| {
        let n = spin(x).0;
        nalgebra::DMatrix::from_fn(3, 3, |i, k| {
            let mut y = [0.0; 4];
            Spin.chart(
                x,
                &std::array::from_fn::<_, 3, _>(|j| if j == k { 0.1 } else { 0.0 }),
                &mut y,
            );
            // Both charts of the sphere are geodesics.
            let q = Sphere::<2>::coordinates(&n, &spin(&y).0);
            let q = [q[0], q[1], y[3] - x[3]];
            q[i] / 0.1
        })
    };
    macro_rules! off {
        ($method:expr) => {{
            let typed = $method.tangent(&typed, x, Span::steps(0.1, 10)).unwrap().last().matrix();
            let run = $method.tangent(&own, entries.clone().into(), Span::steps(0.1, 10)).unwrap();
            let (found, end) = (run.last().matrix(), &run.last().point);
            let exact = turned(end).transpose() * typed * turned(&entries);
            (found - &exact).amax() / exact.amax()
        }};
    }
    let off = [off!(DormandPrince8), off!(chart), off!(Gauss::<2>), off!(Radau::<2>)];
    println!("derivatives: {off:?}");
    // Nine digits: the charts are known by their values alone.
    assert!(off.iter().all(|off| *off < 4e-9), "{off:?}");
    // An entropy near zero costs no digits of the spin.
    for small in [1e-9, 1e-15] {
        let (x, entries) = ((vector![0.6, 0.0, 0.8], vector![small]), vec![0.6, 0.0, 0.8, small]);
        let run = chart.run(&own, entries.into(), Span::steps(0.1, 10)).unwrap();
        let typed = chart.run(&typed, x, Span::steps(0.1, 10)).unwrap();
        let ((n, s), end) = (&typed.last().point, &run.last().point);
        let off = (0..3).map(|i| (n[i] - end[i]).abs()).fold((s.x - end[3]).abs(), f64::max);
        assert!(off < 1e-10, "{small}: {off:.1e}");
    }
    // Long steps stay on this side of the antipode, as those of the system in its types do.
    for h in [2.0, 6.0, 9.0] {
        let run = chart.run(&own, entries.clone().into(), Span::steps(h, 1)).unwrap();
        let typed = chart.run(&typed, x, Span::steps(h, 1)).unwrap();
        let off = (0..3).map(|i| (typed.last().point.0[i] - run.last().point[i]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{h}");
    }
    // Geodesics are not known.
    let error = WeylMidpoint.run(&own, entries.into(), span()).unwrap_err();
    let RunError::Method(error) = error else { panic!("{error}") };
    assert_eq!(error.downcast_ref(), Some(&NoImplicitSteps::Geodesics));
}

/// Asserts that the methods keep both laws of a flow of spins, and have these orders.
macro_rules! orders {
    ($flow:expr, $start:expr, $distance:expr; $($method:expr => $order:expr),+ $(,)?) => {{
        let exact = DormandPrince8.run($flow, $start.clone(), Span::until(1.0).tolerance(1e-11));
        let exact = exact.unwrap().last().point.clone();
        $({
            let errors = [5_usize, 10, 20].map(|steps| {
                let span = Span::steps(1.0 / steps as f64, steps);
                let run = $method.run($flow, $start.clone(), span).unwrap();
                let certificate = run.certificate();
                assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
                $distance(&run.last().point, &exact)
            });
            let found: f64 = (errors[1] / errors[2]).log2();
            println!("{}: order {found:.2} from {errors:?}", stringify!($method));
            assert!((found - $order).abs() < 0.25, "{found} from {errors:?}");
        })+
    }};
}

/// The spin of charts of its own, which a field turns, in air.
fn driven_spin(strength: f64, friction: f64) -> OpenEquations<Differences<Spin>> {
    FromEquations(Differences(Spin))
        .opened()
        .work("field", move |t, x, v| {
            let (n, _) = spin(x);
            let turned = n.cross(&vector![0.0, (2.0 * t).sin() * strength, 0.2]);
            let [a, b] = frame(n).map(|e| e.dot(&turned));
            v.copy_from_slice(&[a, b, 0.0]);
        })
        .bath("air", 0.5, move |_, contact| {
            (0..2).for_each(|axis| contact(friction, &[(axis, 1.0)]));
        })
}

#[test]
fn a_system_with_charts_of_its_own_is_driven() {
    let own = driven_spin(0.5, 0.2);
    let start = own.start(vec![0.6, 0.0, 0.8, 0.2]);
    type State = OpenState<Entries>;
    let distance = |a: &State, b: &State| {
        let of = |state: &State| {
            let ledger = [state.ledger.heat("air"), state.ledger.work("field")];
            state.x.iter().copied().chain(ledger.into_iter().flatten()).collect::<Vec<f64>>()
        };
        let pairs = of(a).into_iter().zip(of(b));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    orders! { &own, start, distance;
        Scheme::new(ChartMidpoint) => 2.0,
        Gauss::<2> => 4.0,
    }
}

#[test]
fn a_driven_system_with_charts_of_its_own_has_tangents() {
    let systems = Systems::new(["strength", "friction"], |t: &Vector2<f64>| {
        Ok::<_, Error>(driven_spin(t.x, t.y))
    });
    let theta = vector![0.5, 0.2];
    let own = systems.at(theta).unwrap();
    let (entries, span) = ([0.6, 0.0, 0.8, 0.2], Span::steps(0.1, 3));
    macro_rules! compare {
        ($($method:expr),+) => {$({
            let run = $method.tangent(&own, own.start(entries), span).unwrap();
            let (end, found) = (&run.last().point, run.last().matrix());
            // Three directions, the clock, the works and heats, and the parameters.
            assert_eq!(found.shape(), (8, 10));
            let last = |theta: Vector2<f64>, q: [f64; 3]| {
                let own = systems.build(&theta).unwrap();
                let mut x = [0.0; 4];
                Spin.chart(&entries, &q, &mut x);
                let run = $method.run(&own, own.start(x), span).unwrap();
                let d = own.displacement(end, &run.last().point).unwrap();
                nalgebra::DVector::from_vec(d.to_list())
            };
            let column = |k: usize| {
                let at = |e: f64| match k {
                    0..3 => last(theta, std::array::from_fn(|i| if i == k { e } else { 0.0 })),
                    _ => last(theta + Vector2::ith(k - 3, e), [0.0; 3]),
                };
                let slope = |e: f64| (at(e) - at(-e)) / (2.0 * e);
                (slope(1e-4) * 4.0 - slope(2e-4)) / 3.0
            };
            for (k, place) in [0, 1, 2, 8, 9].into_iter().enumerate() {
                let (exact, found) = (column(k), found.column(place).rows(0, 8).into_owned());
                let off = (&found - &exact).amax() / exact.amax();
                println!("{}, {k}: {off:.1e}", stringify!($method));
                assert!(off < 1e-7, "{}, {k}: {off:e}\n{found}\n{exact}", stringify!($method));
            }
        })+};
    }
    compare!(DormandPrince8, Scheme::new(ChartMidpoint));
}

/// A free particle, `H = ½p²`, before a wall at `q = 1`, in charts that are translations.
struct Wall {
    /// Whether the wall is the edge of the domain; else charts do not see past half of the way to it.
    is_edge: bool,
}

impl Equations for Wall {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[0.5 * x[1] * x[1], 0.0]);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[0.0, x[1], 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1], 0.0]);
        Some(0.0)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        sizes.copy_from_slice(&[1.0, x[1].abs()]);
    }

    fn defect(&self, x: &[f64]) -> f64 {
        if self.is_edge && x[0] >= 1.0 { f64::INFINITY } else { 0.0 }
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        y.copy_from_slice(&[x[0] + q[0], x[1] + q[1]]);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        q.copy_from_slice(&[y[0] - x[0], y[1] - x[1]]);
        self.is_edge || q[0].abs() < 0.5 * (1.0 - x[0])
    }
}

impl Apart for Wall {
    fn is_zero(&self, part: Part) -> bool {
        part != Part::Reversible
    }

    fn apply(&self, _: Part, _: f64, _: &[f64], _: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.copy_from_slice(&[alpha[1], -alpha[0]]);
    }

    fn has_charts(&self) -> bool {
        true
    }
}

#[test]
fn no_driven_step_leads_beyond_the_charts_or_the_domain() {
    for is_edge in [true, false] {
        let own =
            FromEquations(Differences(Wall { is_edge }))
                .opened()
                .bath("air", 0.5, |_, contact| contact(0.01, &[(1, 1.0)]));
        let start = || own.start([0.0, 1.0]);
        macro_rules! check {
            ($($method:expr),+) => {$(
                let name = stringify!($method);
                let before = $method.run(&own, start(), Span::steps(0.3, 2)).unwrap();
                assert!(before.last().point.x[0] > 0.5 && before.last().point.x[0] < 0.7, "{name}");
                let error = $method.run(&own, start(), Span::steps(0.3, 6)).unwrap_err();
                println!("{name}: {error}");
                let RunError::Step { cause, .. } = error else { panic!("{name}: {error}") };
                let time = match cause {
                    StepError::OutOfDomain { time, .. } | StepError::NotConverged { time, .. } => time,
                    other => panic!("{name}: {other}"),
                };
                // The wall is reached at the time 1.005.
                assert!(time < 1.0, "{name}: {time}");
            )+};
        }
        check!(Gauss::<2>, Gauss::<3>, Radau::<2>, Scheme::new(ChartMidpoint));
    }
}

/// A vector space with more entries than directions.
struct Constrained;

impl Equations for Constrained {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 3, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[0.5 * (x[0] * x[0] + x[1] * x[1]), 0.0]);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[x[0], x[1], 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1], -x[0]]);
        Some(0.0)
    }
}

impl Apart for Constrained {
    fn is_zero(&self, part: Part) -> bool {
        part != Part::Reversible
    }

    fn apply(&self, _: Part, _: f64, _: &[f64], _: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.copy_from_slice(&[alpha[1], -alpha[0]]);
    }
}

#[test]
fn a_vector_space_with_more_entries_than_directions_has_no_implicit_steps() {
    let own = FromEquations(Differences(Constrained));
    let open = FromEquations(Differences(Constrained)).opened();
    let expected = NoImplicitSteps::Charts { entries: 3, directions: 2 };
    macro_rules! check {
        ($($method:expr),+) => {$(
            let x = [0.6, 0.8, 0.0];
            let closed = $method.run(&own, x.into(), Span::steps(0.1, 2)).unwrap_err();
            let RunError::Method(closed) = closed else { panic!("{closed}") };
            let opened = $method.run(&open, open.start(x), Span::steps(0.1, 2)).unwrap_err();
            let RunError::Method(opened) = opened else { panic!("{opened}") };
            let refused = [closed, opened].map(|error| error.downcast_ref().copied());
            assert_eq!(refused, [Some(expected); 2]);
        )+};
    }
    check!(WeylMidpoint, Scheme::new(ChartMidpoint), Gauss::<2>);
}

type SpinAt<T> = (Vector3<T>, Vector1<T>);
type Warm = Product<Sphere<2>, Euclidean<1>>;

/// The largest distance of two states.
fn distance(a: &Points<Warm>, b: &Points<Warm>) -> f64 {
    let pairs = a.iter().zip(b.iter());
    pairs.map(|(a, b)| (a.0 - b.0).amax().max((a.1 - b.1).amax())).fold(0.0, f64::max)
}

#[test]
fn lattices_on_curved_sites_have_implicit_steps() {
    // Spins with the entropies of their baths, friction at sites and exchange in bonds.
    let spins = Lattice::on(Graph::chain(2), Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| n.z * n.z * 0.5 + n.x * 0.3 + s.x.exp())
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .bond_energy(|(a, b): &(SpinAt<Real>, SpinAt<Real>)| a.0.dot(&b.0) * -0.4)
        .site_onsager(|site| {
            let w = site.w;
            [
                Onsager { rate: 0.3, b: vector![w[2], 0.0, -w[0]] },
                Onsager { rate: 0.3, b: vector![0.0, w[2], -w[1]] },
            ]
        })
        .build()
        .unwrap();
    let start = spins.points(|i| {
        let angle = 0.3 + 0.7 * i as f64;
        (vector![angle.cos() * 0.8, angle.sin() * 0.8, 0.6], vector![0.1 * i as f64])
    });
    orders! { &spins, start, distance;
        WeylMidpoint => 2.0,
        Exponential => 1.0,
        Scheme::new(ChartMidpoint).gradient(MeanValue) => 2.0,
        Scheme::new(ChartMidpoint).gradient(ItohAbe) => 1.0,
        Scheme::new(ChartMidpoint).gradient(SymmetricItohAbe) => 2.0,
        Gauss::<2> => 4.0,
        Radau::<2> => 3.0,
    }
    // With a field that pushes the first one, and one in cold air.
    let open = spins
        .opened()
        .work("field", [0], |t, _, (n, _): &(Vector3<f64>, Vector1<f64>)| {
            let turned = n.cross(&vector![0.0, (2.0 * t).sin() * 0.5, 0.2]);
            // A quarter turn leads to an axis of the frame.
            let along = |k: usize| {
                let axis = Sphere::<2>::chart::<f64>(n, &(Vector2::ith(k, FRAC_PI_2)));
                axis.dot(&turned)
            };
            vector![along(0), along(1), 0.0]
        })
        .bath("air", 0.5, [1], |_, _: &SiteState<'_, Warm>| {
            [
                Onsager { rate: 0.2, b: vector![1.0, 0.0, 0.0] },
                Onsager { rate: 0.2, b: vector![0.0, 1.0, 0.0] },
            ]
        });
    let start = open.start(start);
    type State = OpenState<Points<Warm>>;
    let in_all = |a: &State, b: &State| {
        let [heat, work] = [a, b]
            .map(|state| (state.ledger.heat("air").unwrap(), state.ledger.work("field").unwrap()));
        let ledger = (heat.0 - work.0).abs().max((heat.1 - work.1).abs());
        distance(&a.x, &b.x).max(ledger)
    };
    orders! { &open, start, in_all;
        WeylMidpoint => 2.0,
        Scheme::new(ChartMidpoint).gradient(MeanValue) => 2.0,
        Gauss::<2> => 4.0,
    }
    // What a step says of the error of its heat has the order of the method, and a tolerance follows it.
    let exact = DormandPrince8.run(&open, start.clone(), Span::until(1.0).tolerance(1e-11));
    let exact = exact.unwrap().last().point.clone();
    let said = [10_usize, 20].map(|steps| {
        let span = Span::steps(1.0 / steps as f64, steps);
        let run = WeylMidpoint.run(&open, start.clone(), span).unwrap();
        let said = run.certificate().exchange_errors.unwrap();
        let [heat, limit] = [&run.last().point, &exact].map(|state| state.ledger.heat("air"));
        println!("{said:?}, and the heat {heat:?} is {limit:?}");
        said.heat
    });
    let order = (said[0] / said[1]).log2();
    assert!((order - 2.0).abs() < 0.3, "{order} from {said:?}");
    let run = Gauss::<2>.run(&open, start, Span::until(1.0).tolerance(1e-8)).unwrap();
    let (off, steps) = (in_all(&run.last().point, &exact), run.certificate().steps);
    println!("off by {off:.1e} in {steps} steps");
    assert!(off < 1e-6 && steps < 200, "{off:.1e} in {steps} steps");
}

#[test]
fn a_gas_on_half_lines_has_implicit_steps() {
    // The chart of a half line is a logarithm: no temperature falls below zero, however long the step is.
    let gas = Lattice::on(Graph::chain(4), HalfLine)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.w.map(|w| w.x);
            [Onsager { rate: 0.2, b: [vector![v], vector![-u]] }]
        })
        .build()
        .unwrap();
    let start = gas.points(|i| vector![1.0 + i as f64]);
    let distance = |a: &Points<HalfLine>, b: &Points<HalfLine>| {
        a.iter().zip(b.iter()).map(|(a, b)| (a.x - b.x).abs()).fold(0.0, f64::max)
    };
    orders! { &gas, start, distance;
        WeylMidpoint => 2.0,
        Gauss::<2> => 4.0,
        Radau::<2> => 3.0,
    }
    let run = Radau::<2>.run(&gas, start, Span::steps(10.0, 20)).unwrap();
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    assert!(run.last().point.iter().all(|u| (u.x - 2.5).abs() < 1e-6), "{:?}", run.last().point);
}
