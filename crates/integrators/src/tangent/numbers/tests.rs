//! Derivatives of implicit steps of models, against those of their types, differences of steps, and their laws.

use metriplectic_dynamics::bracket::{LiePoisson, Nambu, Zero};
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{
    FieldDissipation, InNumbers, Metriplectic, Poisson, Symplectic, System,
};
use metriplectic_equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Part, Path, SecondLaw, Sizes, laws,
};
use metriplectic_fields::{Dimension as _, Real};
use metriplectic_manifolds::{
    ChartMidpoint, Euclidean, LieDual, Manifold, MovingBase, Product, WeylMidpoint,
};
use nalgebra::{SVector, Vector1, Vector2, Vector3, matrix, vector};
use num_dual::DualNum as _;

use super::super::columns::Columns;
use super::super::linearised::{Linearised, Piece};
use super::units::{differential, units};
use super::*;
use crate::collocation::tableau::{GAUSS, RADAU};
use crate::collocation::{STAGES, Tableau};
use crate::step::{Dim, Flow as _, GradientKind, Inlined, PathOfStep};
use crate::tangent::Unlinearised;
use crate::{FromEquations, Gauss, MeanValue, Method, Radau, Scheme, Span, SymmetricItohAbe};

/// A method in plain numbers.
#[derive(Clone, Copy, Debug)]
enum Steps {
    Along(PathOfStep),
    With(&'static Tableau),
}

impl Steps {
    fn along(gradient: GradientKind) -> Self {
        Self::Along(PathOfStep { path: Path::Weyl, gradient })
    }

    fn name(self) -> String {
        match self {
            Self::Along(line) => format!("{:?}", line.gradient),
            Self::With(tableau) if tableau.one_sided => format!("Radau {}", tableau.stages),
            Self::With(tableau) => format!("Gauss {}", tableau.stages),
        }
    }

    fn derivative(self, step: &StepOfModel<'_>) -> Result<Derivative, Unlinearised> {
        match self {
            Self::Along(line) => schemes::derivative(step, line),
            Self::With(tableau) => collocated::derivative(step, tableau),
        }
    }

    fn pull_back(
        self,
        step: &StepOfModel<'_>,
        costate: &DVector<f64>,
    ) -> Result<Pulled, Unlinearised> {
        let costate = costate.as_slice();
        match self {
            Self::Along(line) => schemes::pull_back(step, line, costate),
            Self::With(tableau) => collocated::pull_back(step, tableau, costate),
        }
    }

    fn entropy_law(self, step: &StepOfModel<'_>, column: [&DVector<f64>; 2]) -> Option<f64> {
        let column = column.map(DVector::as_slice);
        match self {
            Self::Along(line) => schemes::entropy_law(step, line, column),
            Self::With(tableau) => collocated::entropy_law(step, tableau, column),
        }
    }
}

/// A step of a model from `x` to `end`.
fn step_of<'a>(
    model: &'a dyn Model,
    [x, end]: [&'a [f64]; 2],
    h: f64,
    targets: &'a Laws<Vec<f64>>,
) -> StepOfModel<'a> {
    StepOfModel {
        model,
        x,
        end,
        h,
        parameters: 0,
        allowed: None,
        targets,
        entropy_step: None,
        stage_count: None,
        stage_velocities: &[],
    }
}

fn no_targets() -> Laws<Vec<f64>> {
    Laws { energy: 0.0, entropy: 0.0, invariants: Vec::new() }
}

/// A matrix in units of the entries, and its largest number.
fn in_units(j: &DMatrix<f64>, units: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(j.nrows(), j.ncols(), |r, c| j[(r, c)] * units[c] / units[r])
}

/// A direction with a component along each axis, in units of the entries.
fn some(units: &DVector<f64>, phase: f64) -> DVector<f64> {
    DVector::from_fn(units.len(), |i, _| units[i] * (phase + 1.3 * i as f64).sin())
}

/// The laws of a derivative: the first one, for all laws that are kept; the transposed step; and that of the entropy.
fn obeys_laws(name: &str, steps: Steps, step: &StepOfModel<'_>, bound: f64) -> Derivative {
    let at = steps.derivative(step).unwrap_or_else(|error| panic!("{name}: {error}"));
    let units = units(step);
    let mut worst = 0.0_f64;
    let kept = std::iter::once(ENERGY).chain(ENTROPY + 1..step.model.sizes().laws);
    for law in kept {
        let [before, after] = [step.x, step.end].map(|x| differential(step.model, law, x, 0));
        let row = at.along_x.tr_mul(&after);
        let terms = at.along_x.abs().tr_mul(&after.abs());
        for k in 0..units.len() {
            let size: f64 = (0..units.len())
                .map(|i| (terms[i] + before[i].abs()) * units[i])
                .fold(0.0, f64::max);
            worst = worst.max(((row[k] - before[k]) * units[k]).abs() / size);
        }
    }
    let (v, row) = (some(&units, 0.3), some(&units.map(f64::recip), 0.9));
    let moved = &at.along_x * &v;
    let (pulled, _) = steps.pull_back(step, &row).unwrap_or_else(|error| panic!("{name}: {error}"));
    let terms = row.abs().dot(&(at.along_x.abs() * v.abs())) + pulled.abs().dot(&v.abs());
    let transposed = (row.dot(&moved) - pulled.dot(&v)).abs() / terms;
    let entropy = steps.entropy_law(step, [&v, &moved]);
    println!(
        "{name}: law {worst:.1e}, transposed {transposed:.1e}, entropy {:.1e}",
        entropy.unwrap_or(0.0)
    );
    assert!(worst < bound, "{name}: law {worst:e}");
    assert!(transposed < bound, "{name}: transposed {transposed:e}");
    assert!(entropy.is_none_or(|law| law < bound), "{name}: entropy {entropy:?}");
    assert_eq!(entropy.is_some(), step.model.second_law() == SecondLaw::Exact, "{name}");
    at
}

/// Compares the derivative of a step in plain numbers with that of its types, up to `bound` in units of the entries and of the largest
/// number of `J` in them.
fn agree<Y, N>(
    name: &str,
    system: &Y,
    x: &Point<Y>,
    h: f64,
    (method, steps): (N, Steps),
    bound: f64,
) -> DMatrix<f64>
where
    Y: Metriplectic,
    N: Linearised<Y> + Method<Y> + Copy,
{
    let name = format!("{name} by {}", steps.name());
    let end =
        Inlined(method).run(system, x.clone(), Span::steps(h, 1)).unwrap().last().point.clone();
    agree_at(&name, system, [x, &end], h, (method, steps), bound)
}

fn agree_at<Y, N>(
    name: &str,
    system: &Y,
    [x, end]: [&Point<Y>; 2],
    h: f64,
    (method, steps): (N, Steps),
    bound: f64,
) -> DMatrix<f64>
where
    Y: Metriplectic,
    N: Linearised<Y> + Copy,
{
    let n = Dim::<Y>::LEN;
    let piece = Piece {
        x,
        end,
        h,
        moving: n,
        allowed: None,
        targets: system.laws(x),
        entropy_step: None,
        stage_count: None,
        stage_velocities: &[],
    };
    let typed = method.propagate(system, &piece, &Columns::start(system, x)).unwrap();
    let numbers = InNumbers(system);
    let [x, end] = [x, end].map(|x| Y::Manifold::entries(x).to_vec());
    let targets = no_targets();
    let step = step_of(&numbers, [&x, &end], h, &targets);
    let at = obeys_laws(name, steps, &step, bound);
    let units = units(&step);
    let matrix = DMatrix::from_fn(n, n, |i, j| typed.columns.matrix()[(i, j)]);
    let along_h = DVector::from_fn(n, |i, _| typed.along_h[i]);
    let [here, there] = [&at.along_x, &matrix].map(|j| in_units(j, &units));
    let off = (&here - &there).amax() / there.amax();
    let by_size = (&at.along_h - &along_h).component_div(&units).amax() * h;
    println!("    J {off:.1e}, along h {by_size:.1e}");
    assert!(off < bound, "{name}: {off:e}\n{here}{there}");
    assert!(by_size < bound * there.amax(), "{name}: along h {by_size:e}");
    at.along_x
}

fn every_scheme_agrees<Y: Metriplectic>(name: &str, system: &Y, x: &Point<Y>, h: f64, bound: f64) {
    let weyl = Scheme::new(WeylMidpoint);
    let gonzalez = Steps::along(GradientKind::Gonzalez);
    agree(name, system, x, h, (weyl, gonzalez), bound);
    agree(name, system, x, h, (Scheme::new(ChartMidpoint), gonzalez), bound);
    let mean = (weyl.gradient(MeanValue), Steps::along(GradientKind::MeanValue));
    agree(name, system, x, h, mean, bound);
    let kind = Steps::along(GradientKind::SymmetricItohAbe);
    agree(name, system, x, h, (weyl.gradient(SymmetricItohAbe), kind), bound);
}

fn every_method_of_stages_agrees<Y>(name: &str, system: &Y, x: &Point<Y>, h: f64, bound: f64)
where
    Y: Metriplectic<Manifold: MovingBase>,
{
    agree(name, system, x, h, (Gauss::<1>, Steps::With(&GAUSS[0])), bound);
    agree(name, system, x, h, (Gauss::<2>, Steps::With(&GAUSS[1])), bound);
    agree(name, system, x, h, (Gauss::<3>, Steps::With(&GAUSS[2])), bound);
    agree(name, system, x, h, (Gauss::<4>, Steps::With(&GAUSS[3])), bound);
    agree(name, system, x, h, (Radau::<2>, Steps::With(&RADAU[0])), bound);
    agree(name, system, x, h, (Radau::<3>, Steps::With(&RADAU[1])), bound);
    agree(name, system, x, h, (Radau::<4>, Steps::With(&RADAU[2])), bound);
}

fn body() -> impl Metriplectic<Manifold = LieDual<3>> {
    System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap()
}

/// An oscillator whose numbers have this size, which heats a bath with this friction.
fn damped(size: f64, friction: f64) -> impl Metriplectic<Manifold = Euclidean<3>> {
    let per = size.recip();
    System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0]).unwrap())
        .energy(move |x: &Vector3<Real>| {
            let x = x * Real::from(per);
            let motion = x.x * x.x * 0.5 + x.x.powi(4) * 0.1 + x.y * x.y * 0.5;
            (motion + (x.z - 0.3).exp()) * (size * size)
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * friction)
        }))
        .build()
        .unwrap()
}

fn pendulum(size: f64) -> impl Metriplectic<Manifold = Euclidean<2>> {
    let per = size.recip();
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| {
            let (q, p) = (x.x * per, x.y * per);
            (p * p * 0.5 + q * q * 0.5 - q.powi(4) * 0.05) * (size * size)
        })
        .build()
        .unwrap()
}

/// A hundred roundings: those of some tens of sums of a few terms, times the condition of the equation, which is of order one here.
const BOUND: f64 = 2e-14;

#[test]
fn derivatives_in_numbers_are_those_of_types() {
    let body = body();
    every_scheme_agrees("body", &body, &vector![0.4, -1.0, 0.3], 0.3, BOUND);
    every_method_of_stages_agrees("body", &body, &vector![0.4, -1.0, 0.3], 0.3, BOUND);
    let damped = damped(1.0, 0.4);
    every_scheme_agrees("damped", &damped, &vector![0.7, -0.4, 0.2], 0.3, BOUND);
    every_method_of_stages_agrees("damped", &damped, &vector![0.7, -0.4, 0.2], 0.3, BOUND);
    let nambu = System::on(Euclidean::<3>)
        .bracket(Nambu::default())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.x * 0.4)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5 + p.x.powi(3) * 0.2)
        .build()
        .unwrap();
    every_scheme_agrees("Nambu", &nambu, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    every_method_of_stages_agrees("Nambu", &nambu, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    let pendulum = pendulum(1.0);
    every_scheme_agrees("pendulum", &pendulum, &vector![0.7, -0.4], 0.5, BOUND);
    every_method_of_stages_agrees("pendulum", &pendulum, &vector![0.7, -0.4], 0.5, BOUND);
    let swirl = |xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, 0.0.into()) * (xi.x * 0.8);
    let forced = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z.powi(4) * 0.3)
        .force(swirl)
        .build()
        .unwrap();
    every_scheme_agrees("forced", &forced, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    every_method_of_stages_agrees("forced", &forced, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    // A Casimir that friction keeps.
    let rotor = System::on(Product(LieDual::so3(), Euclidean::<1>))
        .bracket((LiePoisson, Zero))
        .energy(|(p, s): &(Vector3<Real>, Vector1<Real>)| {
            p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + s.x.exp()
        })
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .casimir(|(p, _): &(Vector3<Real>, Vector1<Real>)| p.norm_squared())
        .build()
        .unwrap();
    let x = (vector![0.4, -1.0, 0.3], vector![0.2]);
    every_scheme_agrees("rotor", &rotor, &x, 0.1, BOUND);
    every_method_of_stages_agrees("rotor", &rotor, &x, 0.1, BOUND);
    // The scheme as published, whose entropy has a differential in place of a discrete gradient.
    let published = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5 + p.x.powi(3) * 0.2)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    every_scheme_agrees("published", &published, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    every_method_of_stages_agrees("published", &published, &vector![0.4, -1.0, 0.3], 0.2, BOUND);
    let planar = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(|x: &SVector<Real, 4>| {
            (x[2] * x[2] + x[3] * x[3]) * 0.5 + (x[0] * x[0] + x[1] * x[1]).powi(2) * 0.25
        })
        .momentum(|x: &SVector<Real, 4>| x[0] * x[3] - x[1] * x[2])
        .build()
        .unwrap();
    every_scheme_agrees("planar", &planar, &vector![1.0, 0.2, -0.3, 0.7], 0.2, BOUND);
    every_method_of_stages_agrees("planar", &planar, &vector![1.0, 0.2, -0.3, 0.7], 0.2, BOUND);
}

/// A row of masses on springs that harden, the last of which rubs on a bath, whose temperature is known by the covector of the entropy.
struct Row {
    masses: usize,
    friction: f64,
}

impl Row {
    fn force(&self, x: &[f64], i: usize) -> f64 {
        let at = |i: usize| if i == 0 || i > self.masses { 0.0 } else { x[i - 1] };
        let d = at(i + 1) - at(i);
        d + 0.4 * d.powi(3)
    }
}

impl Equations for Row {
    fn sizes(&self) -> Sizes {
        let n = 2 * self.masses + 1;
        Sizes { entries: n, directions: n, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let at = |i: usize| if i == 0 || i > self.masses { 0.0 } else { x[i - 1] };
        let spring = |d: f64| 0.5 * d * d + 0.1 * d.powi(4);
        let springs: f64 = (0..=self.masses).map(|i| spring(at(i + 1) - at(i))).sum();
        let motion: f64 = x[self.masses..2 * self.masses].iter().map(|p| 0.5 * p * p).sum();
        let heat = x[2 * self.masses];
        values[ENERGY] = springs + motion + heat;
        values[ENTROPY] = (1.0 + heat).ln();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        let m = self.masses;
        for i in 0..m {
            w[i] = self.force(x, i) - self.force(x, i + 1);
            w[m + i] = x[m + i];
        }
        w[2 * m] = 1.0;
        w[2 * (2 * m + 1) - 1] = 1.0 / (1.0 + x[2 * m]);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let n = x.len();
        let (mut values, mut w, mut rubbed) = ([0.0; 2], vec![0.0; 2 * n], vec![0.0; n]);
        self.differentials(t, x, &mut values, &mut w);
        let (energy, entropy) = w.split_at(n);
        let w = Covectors { energy, entropy };
        self.apply(Part::Reversible, t, x, w, energy, v);
        self.apply(Part::Irreversible, t, x, w, entropy, &mut rubbed);
        v.iter_mut().zip(&rubbed).for_each(|(v, rubbed)| *v += rubbed);
        Some(rubbed.iter().zip(entropy).map(|(v, w)| v * w).sum())
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }
}

impl Apart for Row {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, _: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let m = self.masses;
        v.fill(0.0);
        if part == Part::Reversible {
            v[..m].copy_from_slice(&alpha[m..2 * m]);
            (0..m).for_each(|i| v[m + i] = -alpha[i]);
            return;
        }
        // γ(T) T b bᵀ with the temperature by both covectors.
        let temperature = w.energy[2 * m] / w.entropy[2 * m];
        let b = [-1.0, w.energy[2 * m - 1] / w.energy[2 * m]];
        let rate = self.friction * temperature * (1.0 + 0.3 * temperature * temperature);
        let along = rate * (b[0] * alpha[2 * m - 1] + b[1] * alpha[2 * m]);
        (v[2 * m - 1], v[2 * m]) = (along * b[0], along * b[1]);
    }
}

/// The end of a step of a model.
fn ended<N>(system: &FromEquations<Differences<Row>>, method: N, x: &[f64], h: f64) -> Vec<f64>
where
    N: Method<FromEquations<Differences<Row>>>,
{
    let run = method.run(system, x.into(), Span::steps(h, 1)).unwrap();
    run.last().point.to_vec()
}

/// `f'` of a vector, by a central difference of order 4.
fn slope(f: impl Fn(f64) -> Vec<f64>, step: f64) -> DVector<f64> {
    let at = |s: f64| DVector::from_vec(f(s * step));
    (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step)
}

fn differences_agree<N>(masses: usize, (method, steps): (N, Steps))
where
    N: Method<FromEquations<Differences<Row>>> + Copy,
{
    let system = FromEquations(Differences(Row { masses, friction: 0.3 }));
    let n = 2 * masses + 1;
    let x: Vec<f64> = (0..n).map(|i| 0.7 + 0.3 * (1.1 + 1.7 * i as f64).sin()).collect();
    let u: Vec<f64> = (0..n).map(|i| (0.5 + i as f64).sin()).collect();
    laws::model(&system.0, 0.0, &x, &u).unwrap();
    let (h, targets) = (0.2, no_targets());
    let end = ended(&system, method, &x, h);
    let step = step_of(&system.0, [&x, &end], h, &targets);
    let name = format!("{n} numbers by {}", steps.name());
    // The tensors and the Hessians have derivatives by differences, with errors of 1e-10 where no entry is near zero.
    let at = obeys_laws(&name, steps, &step, 1e-9);
    let mut off = 0.0_f64;
    for k in 0..n {
        let moved = |s: f64| {
            let mut x = x.clone();
            x[k] += s;
            ended(&system, method, &x, h)
        };
        off = off.max((slope(moved, 2e-3) - at.along_x.column(k)).amax());
    }
    let along_h = (slope(|s| ended(&system, method, &x, h + s), 2e-3) - &at.along_h).amax();
    println!("    J {off:.1e}, along h {along_h:.1e}");
    assert!(off < 1e-9 && along_h < 1e-9, "{name}: {off:e} {along_h:e}");
}

#[test]
fn derivatives_of_a_model_by_differences_are_those_of_its_steps() {
    let weyl = Scheme::new(WeylMidpoint);
    let kind = Steps::along;
    for masses in [1, 6] {
        differences_agree(masses, (weyl, kind(GradientKind::Gonzalez)));
        differences_agree(masses, (weyl.gradient(MeanValue), kind(GradientKind::MeanValue)));
        let gradient = kind(GradientKind::SymmetricItohAbe);
        differences_agree(masses, (weyl.gradient(SymmetricItohAbe), gradient));
        differences_agree(masses, (Gauss::<2>, Steps::With(&GAUSS[1])));
        differences_agree(masses, (Gauss::<3>, Steps::With(&GAUSS[2])));
        differences_agree(masses, (Radau::<2>, Steps::With(&RADAU[0])));
        differences_agree(masses, (Radau::<3>, Steps::With(&RADAU[1])));
    }
}

/// Each of the smooth methods of both kinds.
fn smooth_methods_agree<Y>(name: &str, system: &Y, [x, end]: [&Point<Y>; 2], h: f64, bound: f64)
where
    Y: Metriplectic<Manifold: MovingBase>,
{
    let weyl = Scheme::new(WeylMidpoint);
    let gonzalez = Steps::along(GradientKind::Gonzalez);
    agree_at(name, system, [x, end], h, (weyl, gonzalez), bound);
    let kind = Steps::along(GradientKind::SymmetricItohAbe);
    agree_at(name, system, [x, end], h, (weyl.gradient(SymmetricItohAbe), kind), bound);
    agree_at(name, system, [x, end], h, (Gauss::<1>, Steps::With(&GAUSS[0])), bound);
    agree_at(name, system, [x, end], h, (Gauss::<3>, Steps::With(&GAUSS[2])), bound);
}

#[test]
fn a_state_at_rest_has_the_derivative_of_a_rotation() {
    let (system, rest) = (pendulum(1.0), vector![0.0, 0.0]);
    smooth_methods_agree("rest", &system, [&rest, &rest], 0.3, BOUND);
    let numbers = InNumbers(&system);
    let (zero, targets) = ([0.0; 2], no_targets());
    let step = step_of(&numbers, [&zero, &zero], 0.3, &targets);
    let at = Steps::along(GradientKind::Gonzalez).derivative(&step).unwrap();
    // Cayley's map of h/2, which is symplectic.
    let (c, s) = (1.0 - 0.0225, 0.3);
    let cayley = DMatrix::from_row_slice(2, 2, &[c, s, -s, c]) / 1.0225;
    assert!((at.along_x - cayley).amax() < 4.0 * f64::EPSILON);
    // Beside a bath, with an entry that is not zero.
    let (system, rest) = (damped(1.0, 0.4), vector![0.0, 0.0, 0.2]);
    smooth_methods_agree("rest beside a bath", &system, [&rest, &rest], 0.3, BOUND);
    agree_at(
        "rest beside a bath",
        &system,
        [&rest, &rest],
        0.3,
        (Radau::<2>, Steps::With(&RADAU[0])),
        BOUND,
    );
}

#[test]
fn a_state_near_rest_has_nearly_the_derivative_at_rest() {
    let (system, rest) = (damped(1.0, 0.4), vector![0.0, 0.0, 0.2]);
    for deviation in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14] {
        let x = rest + vector![0.7, -0.4, 0.0] * deviation;
        let name = format!("beside rest by {deviation:e}");
        every_scheme_agrees(&name, &system, &x, 0.3, BOUND);
        every_method_of_stages_agrees(&name, &system, &x, 0.3, BOUND);
        macro_rules! is_near {
            ($method:expr, $steps:expr) => {
                let both = ($method, $steps);
                let here = agree(&name, &system, &x, 0.3, both, BOUND);
                let there = agree_at("rest", &system, [&rest, &rest], 0.3, both, BOUND);
                let off = (here - there).amax();
                println!("    {off:.1e} from that at rest");
                assert!(off < 2.0 * deviation + BOUND, "{name}: {off:e}");
            };
        }
        let weyl = Scheme::new(WeylMidpoint);
        is_near!(weyl, Steps::along(GradientKind::Gonzalez));
        is_near!(weyl.gradient(SymmetricItohAbe), Steps::along(GradientKind::SymmetricItohAbe));
        is_near!(Gauss::<1>, Steps::With(&GAUSS[0]));
        is_near!(Gauss::<3>, Steps::With(&GAUSS[2]));
    }
}

#[test]
fn entries_in_other_units_keep_their_digits() {
    // The damped oscillator in units of 10⁹, 10⁻⁶ and 10³, with the pairs of position and momentum.
    const UNITS: [f64; 3] = [1e9, 1e-6, 1e3];
    let pair = UNITS[0] * UNITS[1];
    let system = System::on(Euclidean::<3>)
        .bracket(
            Poisson::constant(matrix![0.0, pair, 0.0; -pair, 0.0, 0.0; 0.0, 0.0, 0.0]).unwrap(),
        )
        .energy(|x: &Vector3<Real>| {
            let [q, p, z] = [0, 1, 2].map(|i| x[i] / UNITS[i]);
            q * q * 0.5 + q.powi(4) * 0.1 + p * p * 0.5 + (z - 0.3).exp()
        })
        .entropy(|x: &Vector3<Real>| x.z / UNITS[2])
        .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y) * Real::from(UNITS[1] * UNITS[2]);
            b * b.transpose() * (w.z.recip() * (0.4 / UNITS[2]))
        }))
        .build()
        .unwrap();
    let x = vector![0.7 * UNITS[0], -0.4 * UNITS[1], 0.2 * UNITS[2]];
    every_scheme_agrees("units", &system, &x, 0.3, BOUND);
    every_method_of_stages_agrees("units", &system, &x, 0.3, BOUND);
}

#[test]
fn a_state_without_energy_and_a_short_step_lose_no_digit() {
    // H = p²/2 + q²/2 − q⁴/20 is zero at q = √10.
    let system = pendulum(1.0);
    let x = vector![10.0_f64.sqrt(), 0.0];
    every_scheme_agrees("zero", &system, &x, 0.05, BOUND);
    every_method_of_stages_agrees("zero", &system, &x, 0.05, BOUND);
    let damped = damped(1.0, 0.4);
    for h in [1e-3, 1e-6, 1e-9] {
        let name = format!("h = {h:e}");
        every_scheme_agrees(&name, &damped, &vector![0.7, -0.4, 0.2], h, BOUND);
        every_method_of_stages_agrees(&name, &damped, &vector![0.7, -0.4, 0.2], h, BOUND);
    }
}

#[test]
fn numbers_of_any_size_have_the_same_derivatives() {
    let sizes = [0.0_f64, -100.0, 100.0];
    let derivatives = |steps: Steps, method: &dyn Fn(f64) -> [Vec<f64>; 2]| {
        sizes.map(|exponent| {
            let size = exponent.exp2();
            let (system, [x, end]) = (damped(size, 0.4), method(size));
            let (numbers, targets) = (InNumbers(&system), no_targets());
            let step = step_of(&numbers, [&x, &end], 0.3, &targets);
            let at = obeys_laws(&format!("{} at {size:e}", steps.name()), steps, &step, BOUND);
            in_units(&at.along_x, &DVector::from_element(3, size))
        })
    };
    macro_rules! scaled {
        ($method:expr, $steps:expr) => {
            let [one, small, large] = derivatives($steps, &|size| {
                let (system, x) = (damped(size, 0.4), vector![0.7, -0.4, 0.2] * size);
                let run = Inlined($method).run(&system, x, Span::steps(0.3, 1)).unwrap();
                [x.as_slice().to_vec(), run.last().point.as_slice().to_vec()]
            });
            let off = [&small, &large].map(|j| (j - &one).amax());
            println!("    off {:.1e} {:.1e}", off[0], off[1]);
            assert!(off.iter().all(|off| *off < BOUND), "{off:?}\n{one}{small}{large}");
        };
    }
    scaled!(Scheme::new(WeylMidpoint), Steps::along(GradientKind::Gonzalez));
    scaled!(Gauss::<2>, Steps::With(&GAUSS[1]));
    scaled!(Radau::<2>, Steps::With(&RADAU[0]));
}

#[test]
fn a_stiff_row_keeps_the_digits_of_the_others() {
    // Friction of 10⁶ in a step of 0.1: the condition of its row.
    let bound = 10.0 * f64::EPSILON * 1e6;
    let system = damped(1.0, 1e6);
    let x = vector![0.7, -1e-7, 0.2];
    agree("stiff", &system, &x, 0.1, (Radau::<2>, Steps::With(&RADAU[0])), bound);
    agree("stiff", &system, &x, 0.1, (Radau::<3>, Steps::With(&RADAU[1])), bound);
    let gonzalez = Steps::along(GradientKind::Gonzalez);
    let system = damped(1.0, 1e3);
    agree("stiff", &system, &x, 0.1, (Scheme::new(WeylMidpoint), gonzalez), bound);
    agree("stiff", &system, &x, 0.1, (Gauss::<2>, Steps::With(&GAUSS[1])), bound);
}

#[test]
fn velocities_of_stages_that_are_known_are_the_root() {
    let system = damped(1.0, 0.4);
    let (numbers, targets, x, h) = (InNumbers(&system), no_targets(), vector![0.7, -0.4, 0.2], 0.3);
    let end = Inlined(Radau::<3>).run(&system, x, Span::steps(h, 1)).unwrap().last().point;
    let solved = step_of(&numbers, [x.as_slice(), end.as_slice()], h, &targets);
    let steps = Steps::With(&RADAU[1]);
    let at = steps.derivative(&solved).unwrap();
    let around = collocated::along::Around::new(&solved, &RADAU[1]).unwrap().displacements;
    let mut known: Vec<f64> = around.iter().flat_map(|y| y.iter().map(|y| y / h)).collect();
    known.resize(3 * STAGES, 0.0);
    let step = StepOfModel { stage_velocities: &known, ..solved };
    let off = (steps.derivative(&step).unwrap().along_x - at.along_x).amax();
    assert!(off < BOUND, "{off:e}");
    let mut other = known.clone();
    other[1] += 1e-6;
    let step = StepOfModel { stage_velocities: &other, ..step };
    let error = steps.derivative(&step).unwrap_err();
    assert!(matches!(error, Unlinearised::NotReproduced { .. }), "{error:?}");
}

#[test]
fn a_scheme_that_is_not_symmetric_is_refused() {
    let system = pendulum(1.0);
    let (numbers, targets) = (InNumbers(&system), no_targets());
    let (x, end) = ([0.7, -0.4], [0.5, -0.6]);
    let step = step_of(&numbers, [&x, &end], 0.3, &targets);
    let lines = [(Path::Weyl, GradientKind::ItohAbe), (Path::Exponential, GradientKind::Gonzalez)];
    for (path, gradient) in lines {
        let steps = Steps::Along(PathOfStep { path, gradient });
        let costate = DVector::zeros(2);
        assert_eq!(steps.derivative(&step).unwrap_err(), Unlinearised::NotSymmetric);
        assert_eq!(steps.pull_back(&step, &costate).unwrap_err(), Unlinearised::NotSymmetric);
    }
    println!("{}", Unlinearised::NotSymmetric);
}
