//! Runs of systems of tapes beside those of the same systems in the types of the library.

use metriplectic_dynamics::FieldDissipation;
use metriplectic_dynamics::bracket::{AreaForm, Zero};
use metriplectic_dynamics::exchange::Contact;
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{
    InNumbers, Metriplectic, OnsagerDissipation, Poisson, Symplectic, System,
};
use metriplectic_equations::{Covectors, Equations as _, Model, Part};
use metriplectic_fields::Real;
use metriplectic_integrators::{
    DormandPrince5, DormandPrince8, FromEquations, Gauss, Method, Radau, RungeKuttaChebyshev, Span,
};
use metriplectic_manifolds::{
    Euclidean, HalfLine, LieDual, Manifold, Product, Rotations, Sphere, WeylMidpoint,
};
use metriplectic_recording::Recorded as Number;
use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, Vector1, Vector3, Vector4, Vector6, vector};
use num_dual::DualNum;

use super::laws::tape;
use crate::model::{Bracket, Definition, Friction, Recorded, Space};

/// A scalar of a closure or of a recording.
pub(super) trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {}

/// Asserts that two runs have the same states to round-off, relative to the largest entry of the start.
fn same<M: Manifold, A: Method<Y> + Method<FromEquations<Recorded>> + Copy, Y>(
    name: &str,
    typed: &Y,
    x0: &Point<Y>,
    own: &FromEquations<Recorded>,
    h: f64,
    method: A,
) where
    Y: Metriplectic<Manifold = M>,
{
    let run = method.run(typed, x0.clone(), Span::steps(h, 40));
    let run = run.unwrap_or_else(|error| panic!("{name}: {error}"));
    let entries: Vec<f64> = M::entries(x0);
    let ours = method.run(own, entries.into(), Span::steps(h, 40));
    let ours = ours.unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(run.states().len(), ours.states().len(), "{name}");
    let size = M::entries(x0).iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    for (a, b) in run.states().iter().zip(ours.states()) {
        let a = M::entries(&a.point);
        let off = a.iter().zip(&b.point).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off <= 1e-12 * size, "{name}: {:.1e} of {size:.1e} at {}", off, b.time);
    }
    let [a, b] = [run.last().point.clone(), run.states()[0].point.clone()].map(|x| M::entries(&x));
    let way = a.iter().zip(&b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    assert!(way > 1e-2, "{name} moves by {way:.1e}");
    let certificate = ours.certificate();
    assert!(certificate.max_relative_energy_error() < 1e-14, "{name}: {certificate}");
}

/// Checks that all methods take the steps of a system in types.
#[track_caller]
fn agree<Y: Metriplectic>(name: &str, typed: &Y, x0: &Point<Y>, h: f64, definition: Definition) {
    let own = FromEquations(Recorded::new(definition, &[]).unwrap());
    far_from_the_centre(name, typed, x0, &own.0);
    macro_rules! each {
        ($($method:expr),*) => {$(
            same(&format!("{name} by {}", stringify!($method)), typed, x0, &own, h, $method);
        )*};
    }
    each!(
        WeylMidpoint,
        Gauss::<3>,
        Radau::<2>,
        DormandPrince5,
        DormandPrince8,
        RungeKuttaChebyshev
    );
}

/// Asserts that the parts and the metric far from the centre of a chart are those of a system in types.
fn far_from_the_centre<Y: Metriplectic>(name: &str, typed: &Y, x0: &Point<Y>, own: &Recorded) {
    let (typed, x) = (&InNumbers(typed), Y::Manifold::entries(x0));
    let n = typed.sizes().directions;
    let wave = |phase: f64| (0..n).map(|k| 0.4 * (phase + 1.7 * k as f64).sin()).collect();
    let [q, energy, entropy, alpha]: [Vec<f64>; 4] = [0.3, 1.1, 2.9, 4.0].map(wave);
    let w = Covectors { energy: &energy, entropy: &entropy };
    let both = |of: &dyn Fn(&dyn Model, &mut [f64])| {
        let [mut a, mut b] = [vec![0.0; n * n], vec![0.0; n * n]];
        of(typed, &mut a);
        of(own, &mut b);
        let size = a.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
        let off = a.iter().zip(&b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off <= 1e-13 * size, "{name}: {off:.1e} of {size:.1e}");
    };
    both(&|model, g| model.metric(&x, &q, g));
    for part in [Part::Reversible, Part::Irreversible] {
        if !typed.is_zero(part) && !own.is_zero(part) {
            both(&|model, v| model.apply(part, 0.0, (&x, &q), w, &alpha, &mut v[..n]).unwrap());
        }
    }
}

/// A function of the entries of a state.
type Function<'a> = &'a dyn Fn(&[Number]) -> Number;

/// A definition without parameters.
pub(super) fn defined(
    space: Space,
    energy: impl Fn(&[Number]) -> Number,
    entropy: Option<Function<'_>>,
    bracket: Bracket,
) -> Definition {
    let n = space.entries();
    let friction =
        if entropy.is_some() { Friction::Metric { factor: None } } else { Friction::None };
    Definition {
        energy: tape(n + 1, |x| vec![energy(&x[..n])]),
        entropy: entropy.map(|entropy| tape(n + 1, |x| vec![entropy(&x[..n])])),
        invariants: Vec::new(),
        bracket,
        friction,
        metric: None,
        parameters: Vec::new(),
        space,
    }
}

fn of_body<D: Scalar>(p: &[D]) -> D {
    p[0] * p[0] * 0.5 + p[1] * p[1] * 0.25 + p[2] * p[2] * 0.2 + p[1].powi(4) * 0.1
}

fn square<D: Scalar>(p: &[D]) -> D {
    p.iter().fold(D::from(0.0), |sum, p| sum + *p * *p) * 0.5
}

#[test]
fn a_body_runs_as_in_types() {
    let typed = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| of_body(p.as_slice()))
        .entropy(|p: &Vector3<Real>| square(p.as_slice()))
        .build()
        .unwrap();
    let own = defined(Space::so3_dual(), of_body, Some(&square), Bracket::LiePoisson);
    agree("a body", &typed, &vector![0.4, -1.0, 0.3], 0.1, own);
}

fn of_top<D: Scalar>(x: &[D]) -> D {
    of_body(&x[..3]) + x[3] * 0.2 + x[5] * 0.7
}

#[test]
fn a_heavy_top_runs_as_in_types() {
    let typed = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| of_top(x.as_slice()))
        .build()
        .unwrap();
    let own = defined(Space::se3_dual(), of_top, None, Bracket::LiePoisson);
    let start = vector![0.4, -1.0, 0.3, 0.6, 0.0, 0.8];
    agree("a heavy top", &typed, &start, 0.05, own);
}

/// The energy of a ring of oscillators with heat, positions before momenta before entropies.
pub(super) fn of_ring<D: Scalar>(x: &[D]) -> D {
    let sites = x.len() / 3;
    let mut energy = D::from(0.0);
    for i in 0..sites {
        let (q, p, s) = (x[i], x[sites + i], x[2 * sites + i]);
        let bond = (x[(i + 1) % sites] - q).powi(2);
        energy = energy + p * p * 0.5 + q * q * 0.5 + bond * bond * 0.125 + s.exp();
    }
    energy
}

pub(super) fn heat<D: Scalar>(x: &[D]) -> D {
    x[2 * (x.len() / 3)..].iter().fold(D::from(0.0), |sum, s| sum + *s)
}

/// The tensor of so many oscillators with heat.
pub(super) fn pairs(sites: usize) -> Vec<f64> {
    let n = 3 * sites;
    let mut entries = vec![0.0; n * n];
    for i in 0..sites {
        entries[i * n + sites + i] = 1.0;
        entries[(sites + i) * n + i] = -1.0;
    }
    entries
}

pub(super) fn waves(n: usize) -> Vec<f64> {
    let wave = |i: usize| {
        if i < 2 * n / 3 { 0.5 * (1.0 + i as f64).sin() } else { 0.1 * (i as f64).cos() }
    };
    (0..n).map(wave).collect()
}

#[test]
fn a_ring_with_heat_runs_as_in_types() {
    let bracket = SMatrix::<f64, 24, 24>::from_row_slice(&pairs(8));
    let typed = System::on(Euclidean::<24>)
        .bracket(Poisson::constant(bracket).unwrap())
        .energy(|x: &SVector<Real, 24>| of_ring(x.as_slice()))
        .entropy(|x: &SVector<Real, 24>| heat(x.as_slice()))
        .build()
        .unwrap();
    let space = Space::euclidean(24).unwrap();
    let own = defined(space, of_ring, Some(&heat), Bracket::Constant(pairs(8)));
    let start = SVector::from_column_slice(&waves(24));
    agree("a ring", &typed, &start, 0.01, own);
}

fn field<D: Scalar>(x: &[D]) -> D {
    x[0] * x[0] * 0.5 + x[1] * x[1] * 0.25 + x[0].powi(3) * 0.1
}

fn other<D: Scalar>(x: &[D]) -> D {
    x[2] + x[0] * x[1] * 0.3
}

#[test]
fn a_sphere_runs_as_in_types() {
    let typed = System::on(Sphere::<2>::round())
        .energy(|x: &Vector3<Real>| field(x.as_slice()))
        .entropy(|x: &Vector3<Real>| other(x.as_slice()))
        .build()
        .unwrap();
    let own = defined(Space::sphere(2).unwrap(), field, Some(&other), Bracket::None);
    agree("a sphere", &typed, &vector![0.48, 0.36, -0.8], 0.1, own);
}

fn of_spin<D: Scalar>(x: &[D]) -> D {
    field(&x[..3]) - x[2] * 0.4 + x[3].exp()
}

#[test]
fn a_spin_with_heat_runs_as_in_types() {
    let typed = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| of_spin(&[n.x, n.y, n.z, s.x]))
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()
        .unwrap();
    let space = Space::product(vec![Space::sphere(2).unwrap(), Space::euclidean(1).unwrap()]);
    let bracket = Bracket::Sum(vec![Bracket::AreaForm, Bracket::None]);
    let own = defined(space.unwrap(), of_spin, Some(&|x| x[3]), bracket);
    agree("a spin", &typed, &(vector![0.6, 0.0, 0.8], vector![0.2]), 0.05, own);
}

fn of_satellite<D: Scalar>(x: &[D]) -> D {
    of_body(&x[9..]) + x[8] * 0.3 + x[1] * x[1] * 0.2
}

/// The entries of an attitude and a momentum.
fn listed(r: &Matrix3<Real>, p: &Vector3<Real>) -> Vec<Real> {
    r.transpose().iter().chain(p.iter()).copied().collect()
}

#[test]
fn a_satellite_runs_as_in_types() {
    let typed = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy(|(r, p): &(Matrix3<Real>, Vector3<Real>)| of_satellite(&listed(r, p)))
        .build()
        .unwrap();
    let own = defined(Space::cotangent_rotations(), of_satellite, None, Bracket::Canonical);
    agree("a satellite", &typed, &(Matrix3::identity(), vector![0.9, 0.4, -0.7]), 0.05, own);
}

fn of_frame<D: Scalar>(r: &[D]) -> D {
    r[1] * 0.5 + r[8] * r[8]
}

fn order<D: Scalar>(r: &[D]) -> D {
    r[0] + r[5] * 0.3
}

#[test]
fn an_attitude_runs_as_in_types() {
    let typed = System::on(Rotations::bi_invariant())
        .energy(|r: &Matrix3<Real>| of_frame(r.transpose().as_slice()))
        .entropy(|r: &Matrix3<Real>| order(r.transpose().as_slice()))
        .build()
        .unwrap();
    let own = defined(Space::rotations(), of_frame, Some(&order), Bracket::None);
    agree("an attitude", &typed, &Matrix3::identity(), 0.1, own);
}

/// Temperatures of two bodies, as positive energies, with a contact between them.
fn of_bodies<D: Scalar>(x: &[D]) -> D {
    x[0] + x[1]
}

fn of_logarithms<D: Scalar>(x: &[D]) -> D {
    x[0].ln() * 2.0 + x[1].ln()
}

#[test]
fn two_positive_energies_run_as_in_types() {
    type Pair = (Vector1<Real>, Vector1<Real>);
    let typed = System::on(Product(HalfLine, HalfLine))
        .dissipation(OnsagerDissipation(|(u, v): &Pair, w: &nalgebra::Vector2<Real>| {
            [Contact { rate: u.x * v.x * 0.3, along: nalgebra::Vector2::new(w.y, -w.x) }]
        }))
        .energy(|(u, v): &Pair| of_bodies(&[u.x, v.x]))
        .entropy(|(u, v): &Pair| of_logarithms(&[u.x, v.x]))
        .build()
        .unwrap();
    let space = Space::product(vec![Space::half_line(), Space::half_line()]).unwrap();
    let contact = tape(5, |x| vec![x[0] * x[1] * 0.3, x[3], -x[2]]);
    let own = Definition {
        friction: Friction::Contacts(contact),
        ..defined(space, of_bodies, Some(&of_logarithms), Bracket::None)
    };
    agree("two bodies", &typed, &(vector![0.5], vector![2.0]), 0.05, own);
}

#[test]
fn a_ring_of_three_hundred_variables_runs() {
    let n = 300;
    let space = Space::euclidean(n).unwrap();
    let own = defined(space, of_ring, Some(&heat), Bracket::Constant(pairs(n / 3)));
    let system = FromEquations(Recorded::new(own, &[]).unwrap());
    let run = DormandPrince8.run(&system, waves(n).into(), Span::steps(1e-3, 3)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.max_relative_energy_error() < 1e-14 && certificate.keeps_entropy());
    assert!(run.last().entropy > run.states()[0].entropy);
    let verified = system.verified(&waves(n)).unwrap();
    let run = WeylMidpoint.run(&verified, waves(n).into(), Span::steps(1e-3, 1)).unwrap();
    assert!(run.certificate().max_relative_energy_error() < 1e-14);
}

/// `x ×` on a sphere, with a further number.
fn turns<D: Scalar>(x: &[D]) -> Vec<D> {
    let o = D::from(0.0);
    vec![o, -x[2], x[1], o, x[2], o, -x[0], o, -x[1], x[0], o, o, o, o, o, o]
}

/// `K = (w·w) A − w ⊗ Aw − Aw ⊗ w + (w·Aw) 1` with a diagonal `A(x)`.
fn rubs<D: Scalar>(x: &[D], w: &[D]) -> Vec<D> {
    let a: Vec<D> = x.iter().map(|x| *x * *x + 0.5).collect();
    let sum = |of: &dyn Fn(usize) -> D| (0..4).fold(D::from(0.0), |sum, i| sum + of(i));
    let (ww, waw) = (sum(&|i| w[i] * w[i]), sum(&|i| w[i] * w[i] * a[i]));
    let entry = |k: usize| {
        let (i, j) = (k / 4, k % 4);
        let outer = -(w[i] * w[j] * (a[i] + a[j]));
        if i == j { outer + ww * a[i] + waw } else { outer }
    };
    (0..16).map(entry).collect()
}

fn of_spin_with_energy<D: Scalar>(x: &[D]) -> D {
    field(&x[..3]) - x[2] * 0.4 + x[3]
}

#[test]
fn recorded_tensors_on_curved_factors_run_as_in_types() {
    type State = (Vector3<Real>, Vector1<Real>);
    let list = |(n, s): &State| [n.x, n.y, n.z, s.x];
    let typed = System::on(Product(Sphere::<2>::round(), HalfLine))
        .bracket(Poisson::field(move |x: &State| Matrix4::from_row_slice(&turns(&list(x)))))
        .dissipation(FieldDissipation(move |x: &State, w: &Vector4<Real>| {
            Matrix4::from_row_slice(&rubs(&list(x), w.as_slice()))
        }))
        .energy(move |x: &State| of_spin_with_energy(&list(x)))
        .entropy(|(_, s): &State| s.x.ln())
        .build()
        .unwrap();
    let space = Space::product(vec![Space::sphere(2).unwrap(), Space::half_line()]).unwrap();
    let bracket = Bracket::Recorded { tape: tape(5, |x| turns(&x[..4])), is_poisson: true };
    let friction = Friction::Recorded(tape(9, |x| rubs(&x[..4], &x[4..8])));
    let own = defined(space, of_spin_with_energy, Some(&|x| x[3].ln()), bracket);
    let start = (vector![0.6, 0.0, 0.8], vector![0.7]);
    agree("a spin by tensors", &typed, &start, 0.02, Definition { friction, ..own });
}
