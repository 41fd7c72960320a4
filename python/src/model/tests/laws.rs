//! The laws of [`Equations`], [`Model`] and [`Paths`] for each space, bracket and friction.

use metriplectic_equations::{Equations as _, Kind, Path, laws};
use metriplectic_recording::{Recorded as Number, Tape, record};
use num_dual::DualNum as _;

use crate::model::{Bracket, Definition, Friction, Recorded, Space};

/// Records a function of so many numbers.
pub(super) fn tape(inputs: usize, f: impl Fn(&[Number]) -> Vec<Number>) -> Tape {
    let x: Vec<f64> = (0..inputs).map(|k| 0.3 + 0.1 * k as f64).collect();
    record(&x, f).unwrap()
}

/// `Σ_i c_i x_i² + Σ_i x_i x_{i+1} sin x_i` with other coefficients for another phase.
fn curved(x: &[Number], phase: f64) -> Number {
    let mut sum = Number::from(0.0);
    for (i, x_i) in x.iter().enumerate() {
        sum += *x_i * *x_i * (1.0 + 0.3 * (phase + i as f64).sin());
        sum += *x_i * x[(i + 1) % x.len()].sin() * (0.4 + 0.1 * phase);
    }
    sum
}

/// A function of the state alone, with one parameter.
pub(super) fn law(entries: usize, phase: f64) -> Tape {
    tape(entries + 2, |x| vec![curved(&x[..entries], phase) * x[entries + 1]])
}

/// A system without motion.
fn still(space: Space) -> Definition {
    let n = space.entries();
    Definition {
        energy: law(n, 0.2),
        entropy: None,
        invariants: Vec::new(),
        bracket: Bracket::None,
        friction: Friction::None,
        metric: None,
        parameters: vec!["scale".into()],
        space,
    }
}

/// A state of each space.
fn spaces() -> Vec<(Space, Vec<f64>)> {
    let r = |n| Space::euclidean(n).unwrap();
    let s = |n| Space::sphere(n).unwrap();
    let on_sphere = |n: usize| {
        let x: Vec<f64> = (0..=n).map(|k| (1.0 + k as f64).sin()).collect();
        let norm = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.into_iter().map(|x| x / norm).collect::<Vec<_>>()
    };
    let attitude = || {
        let rotation = metriplectic_manifolds::rotations::exp(&nalgebra::vector![0.3, -0.7, 0.5]);
        rotation.transpose().iter().copied().collect::<Vec<f64>>()
    };
    let momentum = vec![0.4, -1.1, 0.7];
    let mut all = vec![
        (r(1), vec![0.7]),
        (r(4), vec![0.7, -0.3, 1.2, 0.4]),
        (Space::so3_dual(), momentum.clone()),
        (Space::rotations(), attitude()),
        (Space::cotangent_rotations(), [attitude(), momentum.clone()].concat()),
        (Space::half_line(), vec![1.7]),
    ];
    all.extend((1..=7).map(|n| (s(n), on_sphere(n))));
    let product = Space::product(vec![
        s(2),
        r(2),
        Space::product(vec![Space::half_line(), Space::cotangent_rotations()]).unwrap(),
        Space::so3_dual(),
    ]);
    let x = [on_sphere(2), vec![0.3, -0.8], vec![0.9], attitude(), momentum.clone(), momentum];
    all.push((product.unwrap(), x.concat()));
    all
}

/// A direction that moves each entry by some part of its size.
fn direction(n: usize) -> Vec<f64> {
    (0..n).map(|k| 0.2 * (0.7 + 1.3 * k as f64).sin()).collect()
}

/// Checks all laws of a system at a state.
#[track_caller]
pub(super) fn keeps_the_laws(definition: Definition, x: &[f64]) {
    let name =
        format!("{} with {:?}", definition.space, std::mem::discriminant(&definition.friction));
    let has_metric = definition.metric.is_some();
    let system = Recorded::new(definition, &[1.1]).unwrap();
    let u = direction(system.sizes().directions);
    system.check(x).unwrap();
    let t = 0.3;
    laws::equations(&system, t, x, &u).unwrap_or_else(|error| panic!("{name}: {error}"));
    let model = system.model().unwrap();
    laws::model(model, t, x, &u).unwrap_or_else(|error| panic!("{name}: {error}"));
    let paths = model.paths().unwrap();
    for path in [Path::Exponential, Path::Weyl, Path::Chart] {
        assert_eq!(paths.follows(path), !has_metric || path == Path::Chart);
        if paths.follows(path) {
            let kept = laws::paths(model, paths, path, x, &u);
            kept.unwrap_or_else(|error| panic!("{name}, {path:?}: {error}"));
        }
    }
    // A Hessian at a displacement has its definition by a difference of the differential.
    let n = u.len();
    let (mut hf, mut both) = (vec![0.0; n * n], [vec![0.0; n], vec![0.0; n]]);
    model.hessian_at(0, t, x, &u, &mut hf);
    for k in 0..n {
        let h = 1e-5;
        for (df, h) in both.iter_mut().zip([h, -h]) {
            let mut q = u.clone();
            q[k] += h;
            model.differential_at(0, t, x, &q, df);
        }
        for i in 0..n {
            let quotient = (both[0][i] - both[1][i]) / (2.0 * h);
            assert!(
                (quotient - hf[i * n + k]).abs() < 1e-8,
                "{name}: {quotient} {}",
                hf[i * n + k]
            );
        }
    }
}

/// A skew matrix of functions of the state on velocities.
fn skew(entries: usize, n: usize) -> Tape {
    tape(entries + 2, |x| {
        let above = |i: usize, j: usize| {
            (x[i % entries] * (1.0 + j as f64)).sin() * x[entries + 1] + x[j % entries]
        };
        let entry = |k: usize| match (k / n, k % n) {
            (i, j) if i < j => above(i, j),
            (i, j) if i > j => -above(j, i),
            _ => Number::from(0.0),
        };
        (0..n * n).map(entry).collect()
    })
}

/// `K(x, w) = (w·w) A − w ⊗ Aw − Aw ⊗ w + (w·Aw) 1` with a diagonal `A(x)`: symmetric, positive, and it annihilates `w`.
fn recorded_friction(entries: usize, n: usize) -> Tape {
    tape(entries + n + 2, |x| {
        let (x, w) = (&x[..entries], &x[entries..entries + n]);
        let a: Vec<Number> = (0..n).map(|i| x[i % entries] * x[i % entries] + 0.5).collect();
        let zero = Number::from(0.0);
        let ww = w.iter().fold(zero, |sum, w| sum + *w * *w);
        let waw = (0..n).fold(zero, |sum, i| sum + w[i] * w[i] * a[i]);
        let entry = |k: usize| {
            let (i, j) = (k / n, k % n);
            let outer = -(w[i] * w[j] * (a[i] + a[j]));
            if i == j { outer + ww * a[i] + waw } else { outer }
        };
        (0..n * n).map(entry).collect()
    })
}

/// A contact for each pair of neighbours, `b = w_i e_j − w_j e_i`.
fn contacts(entries: usize, n: usize) -> Tape {
    tape(entries + n + 2, |x| {
        let (scale, w) = (x[entries + n + 1], &x[entries..entries + n]);
        let mut all = Vec::new();
        for i in 0..n.saturating_sub(1) {
            all.push(x[i % entries] * x[i % entries] * scale + 0.2);
            for k in 0..n {
                all.push(if k == i {
                    -w[i + 1]
                } else if k == i + 1 {
                    w[i]
                } else {
                    Number::from(0.0)
                });
            }
        }
        all
    })
}

#[test]
fn each_space_keeps_the_laws() {
    for (space, x) in spaces() {
        keeps_the_laws(still(space), &x);
    }
}

#[test]
fn each_bracket_keeps_the_laws() {
    for (space, x) in spaces() {
        let (entries, n) = (space.entries(), space.velocities());
        // On a curve a skew tensor is zero.
        if space.directions() < 2 {
            continue;
        }
        let recorded = Bracket::Recorded { tape: skew(entries, n), is_poisson: false };
        keeps_the_laws(Definition { bracket: recorded, ..still(space) }, &x);
    }
    let at = |index: usize| spaces().swap_remove(index);
    for (index, bracket) in [
        (1, Bracket::Canonical),
        (
            1,
            Bracket::Constant(
                (0..16).map(|k| (f64::from(k / 4) - f64::from(k % 4)) * 0.3).collect(),
            ),
        ),
        (2, Bracket::LiePoisson),
        (4, Bracket::Canonical),
        (7, Bracket::AreaForm),
        (
            13,
            Bracket::Sum(vec![
                Bracket::AreaForm,
                Bracket::Canonical,
                Bracket::Sum(vec![Bracket::None, Bracket::Canonical]),
                Bracket::LiePoisson,
            ]),
        ),
    ] {
        let (space, x) = at(index);
        keeps_the_laws(Definition { bracket, ..still(space) }, &x);
    }
    let cylinder =
        Space::product(vec![Space::sphere(1).unwrap(), Space::euclidean(1).unwrap()]).unwrap();
    keeps_the_laws(
        Definition { bracket: Bracket::Canonical, ..still(cylinder) },
        &[0.6, 0.8, -0.7],
    );
}

#[test]
fn each_friction_keeps_the_laws() {
    for (space, x) in spaces() {
        let (entries, n) = (space.entries(), space.velocities());
        if space.directions() < 2 {
            continue;
        }
        let factor = tape(entries + 2, |x| vec![x[0] * x[0] * x[entries + 1] + 0.7]);
        let mut frictions =
            vec![Friction::Metric { factor: None }, Friction::Metric { factor: Some(factor) }];
        // These annihilate the covector of velocities, which on a curved factor is that of the chart.
        frictions.push(Friction::Recorded(recorded_friction(entries, n)));
        frictions.push(Friction::Contacts(contacts(entries, n)));
        for friction in frictions {
            let entropy = Some(law(entries, 1.9));
            keeps_the_laws(Definition { friction, entropy, ..still(space.clone()) }, &x);
        }
    }
}

/// `1 + ¼ a aᵀ` with `a_i = sin x_i`.
fn metric(n: usize) -> Tape {
    tape(n + 2, |x| {
        let entry = |k: usize| {
            let (i, j) = (k / n, k % n);
            x[i].sin() * x[j].sin() * 0.25 * x[n + 1] + if i == j { 1.0 } else { 0.0 }
        };
        (0..n * n).map(entry).collect()
    })
}

#[test]
fn a_recorded_metric_keeps_the_laws() {
    for n in [4, 11] {
        let x: Vec<f64> = (0..n).map(|k| (1.0 + k as f64).cos()).collect();
        let factor = tape(n + 2, |x| vec![x[0] * x[0] + 0.7]);
        let definition = Definition {
            friction: Friction::Metric { factor: Some(factor) },
            entropy: Some(law(n, 1.9)),
            metric: Some(metric(n)),
            ..still(Space::euclidean(n).unwrap())
        };
        keeps_the_laws(definition, &x);
    }
}

#[test]
fn an_energy_in_time_keeps_the_laws() {
    for (space, x) in spaces() {
        let n = space.entries();
        let energy =
            tape(n + 2, |x| vec![curved(&x[..n], 0.2) * (x[n] * 3.0).cos() * x[n + 1] + x[0]]);
        keeps_the_laws(Definition { energy, ..still(space) }, &x);
    }
}

#[test]
fn invariants_are_projected_out_of_the_friction() {
    let (space, x) = spaces().swap_remove(1);
    let invariants = vec![(Kind::Casimir, law(4, 0.9)), (Kind::Momentum, law(4, 3.1))];
    let of_metric = Friction::Metric { factor: None };
    // It does not annihilate the invariants by itself.
    let recorded = Friction::Recorded(recorded_friction(4, 4));
    for (metric, friction) in
        [(None, of_metric.clone()), (Some(metric(4)), of_metric), (None, recorded)]
    {
        let definition = Definition {
            invariants: invariants.clone(),
            friction,
            entropy: Some(law(4, 1.9)),
            metric,
            ..still(space.clone())
        };
        let system = Recorded::new(definition.clone(), &[1.1]).unwrap();
        let mut v = [0.0; 4];
        assert!(system.velocity(0.0, &x, &mut v).unwrap() > 1e-3);
        keeps_the_laws(definition, &x);
    }
}
