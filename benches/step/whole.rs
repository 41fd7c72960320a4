//! Steps of whole runs: with the certificate, the checks of a start and of each step, and the controller of a tolerance.

use metriplectic::prelude::*;

use crate::Row;

/// A body with friction inside, on so(3)*.
fn body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> + 'static {
    System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .expect("it is a body")
}

/// A field and another one on S².
fn sphere() -> impl Metriplectic<Manifold = Sphere<2>> + 'static {
    System::on(Sphere::<2>::round())
        .energy(|x: &Vector3<Real>| {
            let term = |x: Real, w: f64| x * x * (x * (2.0 / 3.0) + 1.0) * (0.5 * w);
            term(x.x, 1.0) + term(x.y, 0.5) + term(x.z, 0.25)
        })
        .entropy(|x: &Vector3<Real>| x.z + x.x * x.y * 0.3)
        .build()
        .expect("it is a system")
}

/// A spin on S² with its heat.
fn spin() -> impl Metriplectic<Manifold = Product<Sphere<2>, Euclidean<1>>> + 'static {
    type State = (Vector3<Real>, Vector1<Real>);
    System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &State| {
            n.x * n.x * 0.5 + n.y * n.y * 0.25 + n.z * n.z * 0.1 - n.z * 0.4 + s.x.exp()
        })
        .entropy(|(_, s): &State| s.x)
        .build()
        .expect("it is a system")
}

/// A chart with a metric from a closure.
fn chart() -> impl Metriplectic<Manifold = Chart<2>> + 'static {
    let metric = Metric::field(|q: &Vector2<Real>| {
        Matrix2::from_diagonal_element((q.y * q.y + 1.0).recip())
    });
    System::on(Chart::<2>::new(|q| q.y > -3.0))
        .metric(metric)
        .bracket(Zero)
        .energy(|q: &Vector2<Real>| q.x * q.x * 0.5 + q.y.exp())
        .entropy(|q: &Vector2<Real>| q.y + q.x * 0.1)
        .build()
        .expect("it is a system")
}

/// The bracket and the entropy of eight oscillators with heat.
const SITES: usize = 8;

fn pairs() -> impl metriplectic::dynamics::Bracket<Euclidean<24>, Canonical> {
    let mut bracket = SMatrix::<f64, 24, 24>::zeros();
    for i in 0..SITES {
        (bracket[(i, SITES + i)], bracket[(SITES + i, i)]) = (1.0, -1.0);
    }
    Poisson::constant(bracket).expect("it is skew")
}

/// The energy of a ring of eight oscillators with heat: 24 variables.
macro_rules! energy {
    () => {
        field!(|x: &SVector<Real, 24>| {
            let mut energy = Real::from(0.0);
            for i in 0..SITES {
                let (q, p, s) = (x[i], x[SITES + i], x[2 * SITES + i]);
                let bond = (x[(i + 1) % SITES] - q).powi(2);
                energy += p * p * 0.5 + q * q * 0.5 + bond * bond * 0.125 + s.exp();
            }
            energy
        })
    };
}

/// The ring with closures.
fn ring() -> impl Metriplectic<Manifold = Euclidean<24>> + 'static {
    System::on(Euclidean::<24>)
        .bracket(pairs())
        .energy(energy!())
        .entropy(|x: &SVector<Real, 24>| x.fixed_rows::<SITES>(2 * SITES).sum())
        .build()
        .expect("it is a system")
}

/// The ring with recorded fields.
fn recorded_ring() -> impl Metriplectic<Manifold = Euclidean<24>> + 'static {
    let space = Euclidean::<24>;
    let entropy = field!(|x: &SVector<Real, 24>| x.fixed_rows::<SITES>(2 * SITES).sum());
    System::on(space)
        .bracket(pairs())
        .energy(energy!().recorded(&space, &waves()).expect("it does not branch"))
        .entropy(entropy.recorded(&space, &waves()).expect("it does not branch"))
        .build()
        .expect("it is a system")
}

fn waves() -> SVector<f64, 24> {
    let wave =
        |i: usize| if i < 16 { 0.5 * (1.0 + i as f64).sin() } else { 0.1 * (i as f64).cos() };
    SVector::from_fn(|i, _| wave(i))
}

pub(crate) fn rows() -> Vec<Row> {
    let start = || vector![0.4, -1.0, 0.3];
    let on_sphere = || Vector3::new(0.69, -0.4, -0.6).normalize();
    let with_heat = || (vector![0.48, 0.36, -0.8], vector![0.0]);
    let fixed = |h: f64| Span::steps(h, 1_000_000);
    vec![
        Row::whole("body/midpoint", WeylMidpoint, body(), start(), fixed(0.1)),
        Row::whole("body/order_5", DormandPrince5, body(), start(), fixed(0.1)),
        Row::whole("body/order_8", DormandPrince8, body(), start(), fixed(0.1)),
        Row::whole("body/gauss_3", Gauss::<3>, body(), start(), fixed(0.1)),
        Row::whole("body/radau_2", Radau::<2>, body(), start(), fixed(0.1)),
        Row::whole("sphere/midpoint", WeylMidpoint, sphere(), on_sphere(), fixed(0.01)),
        Row::whole("sphere/order_8", DormandPrince8, sphere(), on_sphere(), fixed(0.01)),
        Row::whole("spin/midpoint", WeylMidpoint, spin(), with_heat(), fixed(0.01)),
        Row::whole("spin/order_8", DormandPrince8, spin(), with_heat(), fixed(0.01)),
        Row::whole("chart/order_8", DormandPrince8, chart(), vector![1.0, 0.2], fixed(0.001)),
        Row::whole("ring_24/order_5", DormandPrince5, ring(), waves(), fixed(0.001)),
        Row::whole("ring_24/order_8", DormandPrince8, ring(), waves(), fixed(0.001)),
        Row::whole("ring_24/midpoint", WeylMidpoint, ring(), waves(), fixed(0.001)),
        Row::whole("ring_24/gauss_3", Gauss::<3>, ring(), waves(), fixed(0.001)),
        Row::whole("ring_24/radau_2", Radau::<2>, ring(), waves(), fixed(0.001)),
        Row::whole(
            "ring_24/recorded/order_5",
            DormandPrince5,
            recorded_ring(),
            waves(),
            fixed(0.001),
        ),
        Row::whole(
            "ring_24/recorded/order_8",
            DormandPrince8,
            recorded_ring(),
            waves(),
            fixed(0.001),
        ),
        Row::whole(
            "ring_24/recorded/midpoint",
            WeylMidpoint,
            recorded_ring(),
            waves(),
            fixed(0.001),
        ),
        Row::whole("ring_24/recorded/gauss_3", Gauss::<3>, recorded_ring(), waves(), fixed(0.001)),
        Row::whole("ring_24/recorded/radau_2", Radau::<2>, recorded_ring(), waves(), fixed(0.001)),
        // Each step that is tried, with a tolerance.
        Row::whole(
            "body/tried/order_5",
            DormandPrince5,
            body(),
            start(),
            Span::until(1e3).tolerance(1e-12),
        ),
    ]
}
