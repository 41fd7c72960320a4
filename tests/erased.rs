//! Energies and entropies behind pointers: one type for different closures, with their bits, for every kind of system.

use metriplectic::equations::{ENERGY, ENTROPY, Equations, Sizes};
use metriplectic::integrators::{Element, Entries, Flow, FromEquations};
use metriplectic::lattices::{BondState, Onsager, SiteState};
use metriplectic::prelude::*;

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);

/// Runs two systems of one type, and compares them with those of the closures.
fn compared<E, A, B, M>(erased: [E; 2], by_hand: (&A, &B), method: M, starts: [Element<E>; 2])
where
    E: Flow,
    A: Flow<Space = E::Space>,
    B: Flow<Space = E::Space>,
    M: Clone + Stepper<E> + Stepper<A> + Stepper<B>,
{
    let span = || Span::steps(0.05, 20);
    let [first, second] = starts;
    let ends = [
        method.clone().run(by_hand.0, first.clone(), span()).expect("it runs"),
        method.clone().run(by_hand.1, second.clone(), span()).expect("it runs"),
    ];
    assert!(ends[0].last().point != ends[1].last().point, "they are the same");
    for ((system, start), end) in erased.iter().zip([first, second]).zip(ends) {
        let run = method.clone().run(system, start, span()).expect("it runs");
        assert!(run.states() == end.states(), "it has other bits");
    }
}

fn round(p: &Vector3<Real>) -> Real {
    p.norm_squared() * 0.5 + p.z.powi(4) * 0.1
}

fn long(p: &Vector3<Real>) -> Real {
    p.x * p.x * 0.25 + p.y * p.y * 0.5 + p.z * p.z
}

fn casimir(p: &Vector3<Real>) -> Real {
    p.norm_squared() * 0.5
}

fn torque(t: Real, p: &Vector3<Real>) -> Vector3<Real> {
    p.cross(&vector![Real::from(0.0), t.sin() * 0.5, Real::from(0.0)])
}

/// Two bodies with other closures, and the same parts otherwise.
macro_rules! bodies {
    ($($part:tt)*) => {{
        let one = || System::on(LieDual::so3()).energy(round).entropy(casimir) $($part)*.build().unwrap();
        let two = || {
            let steep = 0.7;
            System::on(LieDual::so3())
                .energy(long)
                .entropy(move |p: &Vector3<Real>| casimir(p) * steep)
                $($part)*
                .build()
                .unwrap()
        };
        (one, two)
    }};
}

#[test]
fn noisy_and_open_systems_have_one_type_and_the_bits_of_their_closures() {
    let (one, two) = bodies!(.noise(Boltzmann(0.1)));
    let method = RandomFlow(WeylMidpoint).seed(1);
    compared([one().erased(), two().erased()], (&one(), &two()), method, [START; 2]);

    let (one, two) = bodies!(.work("torque", torque).bath("air", Bath::at(1.0).isotropic(0.1)));
    let start = one().start(START);
    compared(
        [one().erased(), two().erased()],
        (&one(), &two()),
        DormandPrince8,
        [start.clone(), start.clone()],
    );
    let verified = one().verified(&start).unwrap().erased();
    let run = DormandPrince8.run(&verified, start, Span::steps(0.05, 2)).unwrap();
    assert!(run.certificate().verified_before);

    let (one, two) = bodies!(.bath("air", Bath::at(1.0).isotropic(0.1)).noise(Boltzmann(0.1)));
    let start = one().flow().start(START);
    let method = RandomFlow(DormandPrince8).seed(1);
    compared([one().erased(), two().erased()], (&one(), &two()), method, [start.clone(), start]);
}

#[test]
fn energies_that_depend_on_time_have_one_type_and_the_bits_of_their_closures() {
    let on = || System::on(LieDual::so3()).entropy(casimir);
    let one = || {
        on().energy_in_time(|t: Real, p: &Vector3<Real>| round(p) + p.x * t.sin()).build().unwrap()
    };
    let two =
        || on().energy_in_time(|t: Real, p: &Vector3<Real>| long(p) + p.y * t).build().unwrap();
    let start = one().start(START);
    let starts = || [start.clone(), start.clone()];
    compared([one().erased(), two().erased()], (&one(), &two()), WeylMidpoint, starts());
    compared([one().erased(), two().erased()], (&one(), &two()), DormandPrince8, starts());
}

#[test]
fn members_of_families_have_one_type_the_bits_of_their_closures_and_their_tangents() {
    let family = || Family::on(LieDual::so3()).parameters(["a"]);
    let entropy = |p: &Vector3<Real>, t: &Vector1<Real>| casimir(p) * t.x;
    let one =
        family().energy(|p: &Vector3<Real>, t: &Vector1<Real>| round(p) * t.x).entropy(entropy);
    let two = family().energy(|p: &Vector3<Real>, t: &Vector1<Real>| long(p) + p.x * p.x * t.x);
    let (one, two) = (one.build().unwrap(), two.entropy(entropy).build().unwrap());
    let at = vector![0.7];
    let erased = || [one.at(at).erased(), two.at(at).erased()];
    compared(erased(), (&one.at(at), &two.at(at)), DormandPrince8, [START; 2]);
    let [body, _] = erased();
    let span = || Span::steps(0.05, 20);
    macro_rules! same_tangents {
        ($($method:expr),+) => {$({
            let found = $method.tangent(&body, START, span()).unwrap();
            let exact = $method.tangent(&one.at(at), START, span()).unwrap();
            let (found, exact) = (found.last().matrix(), exact.last().matrix());
            assert!((&found - &exact).amax() < 1e-13 * exact.amax(), "{found} {exact}");
            assert!(exact[(0, 3)].abs() > 1e-3);
        })+};
    }
    same_tangents!(DormandPrince8, WeylMidpoint);

    // Those with surroundings.
    let clocked = |scale: f64| {
        let energy = move |t: Real, p: &Vector3<Real>, a: &Vector1<Real>| {
            long(p) * a.x * scale + p.x * t.sin()
        };
        family().energy_in_time(energy).entropy(entropy)
    };
    let (one, two) = (clocked(1.0), clocked(2.0));
    let (one, two) = (one.build().unwrap(), two.build().unwrap());
    let starts = [one.at(at).start(START), one.at(at).start(START)];
    let erased = [one.at(at).into_system().erased(), two.at(at).into_system().erased()];
    compared(erased, (&*one.at(at), &*two.at(at)), DormandPrince8, starts);
}

/// A body that answers by itself.
struct Spring(f64);

impl Equations for Spring {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values[ENERGY] = 0.5 * (self.0 * x[0] * x[0] + x[1] * x[1]);
        values[ENTROPY] = 0.0;
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[self.0 * x[0], x[1], 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1], -self.0 * x[0]]);
        Some(0.0)
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

/// A system with another number of entries, in which nothing moves.
struct Still(usize);

impl Equations for Still {
    fn sizes(&self) -> Sizes {
        Sizes { entries: self.0, directions: self.0, laws: 2 }
    }

    fn values(&self, _: f64, _: &[f64], values: &mut [f64]) {
        values.fill(0.0);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
    }

    fn velocity(&self, _: f64, _: &[f64], v: &mut [f64]) -> Option<f64> {
        v.fill(0.0);
        Some(0.0)
    }
}

#[test]
fn systems_of_ones_own_have_one_type_and_their_bits() {
    let erased = [FromEquations(Spring(2.0)).erased(), FromEquations(Still(3)).erased()];
    let starts = [Entries::from([1.0, 0.2]), Entries::from([1.0, 0.2, 0.3])];
    let by_hand = (FromEquations(Spring(2.0)), FromEquations(Still(3)));
    compared(erased, (&by_hand.0, &by_hand.1), DormandPrince8, starts);
}

/// The builder of a lattice takes energy and entropy in boxes.
#[test]
fn lattices_have_one_type_and_the_bits_of_their_closures() {
    fn rubbed(bond: &BondState<'_, LieDual<3>>) -> [Onsager<[Vector3<f64>; 2]>; 1] {
        let [u, v] = bond.w;
        [Onsager { rate: 0.1, b: [u.cross(v), v.cross(u)] }]
    }
    fn turned(t: f64, _: usize, p: &Vector3<f64>) -> Vector3<f64> {
        p.cross(&vector![0.0, 0.5 * t.sin(), 0.0])
    }
    fn still(_: f64, _: &SiteState<'_, LieDual<3>>) -> [Onsager<Vector3<f64>>; 1] {
        [Onsager { rate: 0.1, b: vector![0.0, 1.0, 0.0] }]
    }
    let on = || Lattice::on(Graph::ring(4), LieDual::so3());
    let boxed = || {
        let one = on().energy(ErasedField::new(round)).entropy(ErasedField::new(casimir));
        let two = on()
            .energy(ErasedField::new(long))
            .entropy(ErasedField::new(|p: &Vector3<Real>| casimir(p) * 0.7));
        [one, two].map(|body| body.bond_onsager(rubbed).build().unwrap())
    };
    let one = || on().energy(round).entropy(casimir).bond_onsager(rubbed).build().unwrap();
    let two = || {
        let entropy = |p: &Vector3<Real>| casimir(p) * 0.7;
        on().energy(long).entropy(entropy).bond_onsager(rubbed).build().unwrap()
    };
    let points = || one().points(|site| START * (1.0 + 0.1 * site as f64));
    compared(boxed(), (&one(), &two()), DormandPrince8, [points(), points()]);

    macro_rules! opened {
        ($lattice:expr) => {
            $lattice.opened().work("torque", [0], turned).bath("air", 1.0, [1], still)
        };
    }
    let (one, two) = (opened!(one()), opened!(two()));
    let start = one.start(points());
    compared(
        boxed().map(|body| opened!(body)),
        (&one, &two),
        DormandPrince8,
        [start.clone(), start],
    );
}

/// Lattices with noise too.
#[test]
fn noisy_lattices_have_one_type_and_the_bits_of_their_closures() {
    fn conducted(bond: &BondState<'_, Euclidean<1>>) -> [Onsager<[Vector1<f64>; 2]>; 1] {
        let [u, v] = bond.x.map(|u| u.x);
        [Onsager { rate: 0.1 * u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
    }
    let on = || Lattice::on(Graph::ring(4), Euclidean::<1>);
    macro_rules! ring {
        ($energy:expr, $entropy:expr) => {
            on().energy($energy)
                .entropy($entropy)
                .bond_onsager(conducted)
                .build()
                .unwrap()
                .with_noise(Boltzmann(0.01))
        };
    }
    let heat = |u: &Vector1<Real>| u.x;
    let (ideal, other) = (|u: &Vector1<Real>| u.x.ln(), |u: &Vector1<Real>| u.x.ln() * 1.5);
    let erased = [
        ring!(ErasedField::new(heat), ErasedField::new(ideal)),
        ring!(ErasedField::new(heat), ErasedField::new(other)),
    ];
    let (one, two) = (ring!(heat, ideal), ring!(heat, other));
    let start = one.flow().points(|site| vector![1.0 + 0.1 * site as f64]);
    compared(erased, (&one, &two), RandomFlow(DormandPrince5).seed(1), [start.clone(), start]);
}
