//! The printed equations of the paper that no other test looks at, against the library; and the tests
//! that the guide names, which must exist (`metriplectic::guide::equations`).

mod models;

use metriplectic::dynamics::{Bracket, Dissipation, laws};
use metriplectic::fields::{BrokenLaw, ChartPoint};
use metriplectic::integrators::DiscreteGradient;
use metriplectic::manifolds::{MetricAt, StepPath, rotations};
use metriplectic::prelude::*;
use models::{half_square, kinetic, relaxing_body, top};
use proptest::prelude::*;

const EPS: f64 = f64::EPSILON;

/// The moments of inertia of the example.
const I: [f64; 3] = [10.0, 5.0, 1.0];

fn columns<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform::<_, N>(-1.5..1.5).prop_map(SVector::<f64, N>::from)
}

/// Two vectors are the same to the rounding of terms of size 1.
fn same<const N: usize>(a: &SVector<f64, N>, b: &SVector<f64, N>) -> Result<(), BrokenLaw> {
    let bound = 64.0 * EPS * (1.0 + a.norm() + b.norm());
    BrokenLaw::unless("both sides of the equation", (a - b).norm(), bound)
}

/// The same for numbers.
fn equal(a: f64, b: f64) -> Result<(), BrokenLaw> {
    same(&vector![a], &vector![b])
}

/// `Ω = p/I`.
fn velocity(p: &Vector3<f64>) -> Vector3<f64> {
    p.component_div(&Vector3::from(I))
}

proptest! {
    /// §2.1: `{f, g} = Π^{ij} f_i g_j`, `X_H = Π^{ij} H_j ∂_i`, `X_H(g) = {g, H}`, `{H, H} = 0`.
    #[test]
    fn a_hamiltonian_vector_field_is_the_bracket_with_the_energy(
        p in columns::<3>(), dg in columns::<3>(),
    ) {
        let body = System::on(LieDual::so3()).energy(kinetic(Vector3::from(I))).build().unwrap();
        let (x, dh) = (ChartPoint::centre(&p), velocity(&p));
        let pi = body.bracket().tensor(&body.bracket_args(&body.metric_at(&x), &Vector3::zeros())).unwrap();
        let field = body.velocity(&x).unwrap();
        let bracket = |f: &Vector3<f64>, g: &Vector3<f64>| {
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j)))
                .map(|(i, j)| pi[(i, j)] * f[i] * g[j])
                .sum::<f64>()
        };
        equal(dg.dot(&field), bracket(&dg, &dh))?;
        equal(bracket(&dg, &dh), -bracket(&dh, &dg))?;
        equal(bracket(&dh, &dh), 0.0)?;
        // S = |p|²/2 is a Casimir.
        equal(bracket(&p, &dg), 0.0)?;
    }

    /// §2.2, eq. (semid): both of its lines, and its components, with a metric that is not diagonal.
    #[test]
    fn the_form_of_the_metric_is_the_printed_one_on_each_line(
        entries in prop::array::uniform3(columns::<3>()),
        w in columns::<3>(), df in columns::<3>(), dg in columns::<3>(),
    ) {
        prop_assume!(w.norm() > 0.1);
        let b = Matrix3::from_columns(&entries) * 0.5;
        let g = Matrix3::identity() + (b * b.transpose() + (b * b.transpose()).transpose()) * 0.5;
        let inverse = g.try_inverse().unwrap();
        let k = Dissipation::<Euclidean<3>, _>::tensor(
            &MetricDissipation,
            &MetricAt::new(&Metric::constant(g).unwrap(), &ChartPoint::centre(&w)),
            &w,
        ).unwrap();
        let star = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(inverse * b));
        let c = star(&w, &w);
        let off = |a: &Vector3<f64>| a * c - w * star(&w, a);
        equal(df.dot(&(k * dg)), star(&off(&df), &off(&dg)) / c)?;
        equal(df.dot(&(k * dg)), c * star(&df, &dg) - star(&w, &df) * star(&w, &dg))?;
        let sharp = inverse * w;
        let components = inverse * c - sharp * sharp.transpose();
        prop_assert!((k - components).norm() <= 64.0 * EPS * (1.0 + components.norm()));
        same(&(k * w), &Vector3::zeros())?;
    }

    /// §2.3: `x' = Π∇H + K∇S`, `H' = {H, H} + (H, S) = 0` and `S' = (S, S) ≥ 0`.
    #[test]
    fn the_equations_of_motion_have_both_laws(p in columns::<3>()) {
        let body = relaxing_body();
        let x = ChartPoint::centre(&p);
        let v = body.velocity(&x).unwrap();
        let k = body.dissipation().tensor(&body.metric_at(&x), &velocity(&p)).unwrap();
        same(&v, &(p.cross(&velocity(&p)) + k * p))?;
        // The same with E = H + S for both, since Π dS = 0 and K dH = 0.
        let de = velocity(&p) + p;
        same(&v, &(p.cross(&de) + k * de))?;
        equal(velocity(&p).dot(&v), 0.0)?;
        let rate = p.dot(&(k * p));
        equal(p.dot(&v), rate)?;
        prop_assert!(rate >= -4.0 * EPS);
    }

    /// §3, eqs. (el), (fel) and (fel2): `μ'_b = C_ab^d ξ^a (μ_d + F_d)`, and `ξ` takes no power from it.
    #[test]
    fn forced_euler_poincare_equations_in_a_basis(
        xi in columns::<6>(), mu in columns::<6>(), force in columns::<6>(), eta in columns::<6>(),
    ) {
        for space in [LieDual::se3(), LieDual::so4()] {
            let algebra = space.algebra();
            let rate = algebra.coadjoint(&xi, &(mu + force));
            let by_hand = algebra.constants().iter().fold(Vector6::zeros(), |mut sum, c| {
                sum[c.b] += c.value * xi[c.a] * (mu + force)[c.d];
                sum
            });
            same(&rate, &by_hand)?;
            equal(rate.dot(&eta), (mu + force).dot(&algebra.bracket(&xi, &eta)))?;
            equal(rate.dot(&xi), 0.0)?;
        }
    }

    /// §3, first example: the three components with an arbitrary force.
    #[test]
    fn the_forced_rigid_body_in_components(o in columns::<3>(), f in columns::<3>()) {
        let so3 = LieDual::so3();
        let legendre = Legendre::<_, 3>::of(|o: &Vector3<Real>| {
            (o.x * o.x * I[0] + o.y * o.y * I[1] + o.z * o.z * I[2]) * 0.5
        });
        let rate = so3.algebra().coadjoint(&o, &(legendre.momentum(&o) + f));
        let printed = vector![
            (I[1] - I[2]) * o.y * o.z + o.z * f.y - o.y * f.z,
            (I[2] - I[0]) * o.z * o.x + o.x * f.z - o.z * f.x,
            (I[0] - I[1]) * o.x * o.y + o.y * f.x - o.x * f.y
        ];
        same(&rate, &printed)?;
    }

    /// §3, eqs. (cas), (ops1), and the second example: the power of the force is the growth of `C`.
    #[test]
    fn a_casimir_grows_by_the_power_of_the_force(p in columns::<3>(), f in columns::<3>()) {
        let so3 = LieDual::so3();
        let (o, algebra) = (velocity(&p), so3.algebra());
        let printed = (1.0 / I[1] - 1.0 / I[2]) * p.y * p.z * f.x
            + (1.0 / I[2] - 1.0 / I[0]) * p.x * p.z * f.y
            + (1.0 / I[0] - 1.0 / I[1]) * p.x * p.y * f.z;
        equal(p.dot(&algebra.coadjoint(&o, &(p + f))), printed)?;
        equal(f.dot(&algebra.bracket(&o, &p)), printed)?;
        // The force of the example is that of (ops1) with κ = 1, and C' = κ([ξ, dC], [ξ, dC]).
        let friction = CasimirDissipation::new(algebra, Matrix3::identity()).unwrap();
        let force = friction.force(&o, &p);
        let example = vector![
            (I[2] - I[1]) * o.y * o.z, (I[0] - I[2]) * o.x * o.z, (I[1] - I[0]) * o.x * o.y
        ];
        same(&force, &example)?;
        let turned = algebra.bracket(&o, &p);
        equal(p.dot(&algebra.coadjoint(&o, &(p + force))), turned.norm_squared())?;
    }

    /// §3 and §4.3: the relaxed rigid body, printed twice, and its matrix `K`.
    #[test]
    fn the_relaxed_rigid_body_in_components(p in columns::<3>()) {
        let (body, x) = (relaxing_body(), ChartPoint::centre(&p));
        let rate = body.velocity(&x).unwrap();
        let [a, b, c] = I;
        let third = vector![
            (b - c) / (b * c) * p.y * p.z + (a - c) / (a * c * c) * p.x * p.z * p.z
                - (b - a) / (a * b * b) * p.x * p.y * p.y,
            (c - a) / (c * a) * p.z * p.x + (b - a) / (a * a * b) * p.x * p.x * p.y
                - (c - b) / (b * c * c) * p.y * p.z * p.z,
            (a - b) / (a * b) * p.x * p.y + (c - b) / (b * b * c) * p.y * p.y * p.z
                - (a - c) / (a * a * c) * p.x * p.x * p.z
        ];
        same(&rate, &third)?;
        same(&rate, &printed(&p))?;
        let o = velocity(&p);
        let k = body.dissipation().tensor(&body.metric_at(&x), &o).unwrap();
        let matrix = Matrix3::new(
            o.y * o.y + o.z * o.z, -o.x * o.y, -o.x * o.z,
            -o.x * o.y, o.x * o.x + o.z * o.z, -o.y * o.z,
            -o.x * o.z, -o.y * o.z, o.x * o.x + o.y * o.y,
        );
        prop_assert!((k - matrix).norm() <= 16.0 * EPS * (1.0 + matrix.norm()));
    }

    /// §4.3: a step solves the printed midpoint rule, `P − p = h` times its right hand side at `z`.
    #[test]
    fn a_step_solves_the_printed_midpoint_rule(p in columns::<3>()) {
        prop_assume!(p.norm() > 0.1);
        let h = 0.1;
        let run = WeylMidpoint.run(&relaxing_body(), p, Span::steps(h, 1)).unwrap();
        let end = run.last().point;
        same(&(end - p), &(printed(&((p + end) * 0.5)) * h))?;
        prop_assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    }

    /// §4.1, eqs. (AVF), (gonzalez) and (itoAbe) on R³, and eq. (discGrad) for each.
    #[test]
    fn three_discrete_gradients_are_the_printed_ones(x in columns::<3>(), d in columns::<3>()) {
        // Away from short edges, where the quotients are integrals.
        prop_assume!(d.amin() > 0.2);
        let f = |p: &Vector3<Real>| p.x.powi(3) * p.y + p.z.powi(4) * 0.25 + p.y * p.z + 3.0;
        let df = |p: Vector3<f64>| {
            vector![3.0 * p.x * p.x * p.y, p.x.powi(3) + p.z, p.z.powi(3) + p.y]
        };
        let at = |p: &Vector3<f64>| ScalarField::<Euclidean<3>>::at::<f64>(&f, p);
        let path: StepPath<Euclidean<3>> = WeylMidpoint.step_path(&Canonical, &x, &d).unwrap();
        let (y, z) = (x + d, x + d * 0.5);
        let close = |a: Vector3<f64>, b: Vector3<f64>| {
            BrokenLaw::unless("the printed covector", (a - b).norm(), 1e-12 * (1.0 + b.norm()))
        };
        // Simpson's rule is exact to degree 3, that of a gradient of a polynomial of degree 4.
        let mean = (df(x) + df(z) * 4.0 + df(y)) / 6.0;
        close(MeanValue.mean(&f, &x, &path), mean)?;
        let slope = (at(&y) - at(&x) - df(z).dot(&d)) / d.norm_squared();
        close(Gonzalez.covector(&f, &Canonical, (&x, at(&x)), &path), df(z) + d * slope)?;
        let corners = [x, vector![y.x, x.y, x.z], vector![y.x, y.y, x.z], y];
        let quotients =
            Vector3::from_fn(|i, _| (at(&corners[i + 1]) - at(&corners[i])) / (y[i] - x[i]));
        close(ItohAbe.mean(&f, &x, &path), quotients)?;
        for w in [mean, df(z) + d * slope, quotients] {
            equal(w.dot(&d) / 10.0, (at(&y) - at(&x)) / 10.0)?;
        }
    }

    /// The dissipations of a form on an algebra and of two forms on covectors keep the laws.
    #[test]
    fn dissipations_beside_that_of_the_metric_keep_the_laws(
        entries in prop::array::uniform6(columns::<6>()),
        x in columns::<6>(), w in columns::<6>(), a in columns::<6>(),
    ) {
        prop_assume!(w.norm() > 0.1);
        let b = Matrix6::from_columns(&entries) * 0.5;
        let form = (b * b.transpose() + (b * b.transpose()).transpose()) * 0.5;
        let square = |x: &Vector6<Real>| x.norm_squared() * 0.5;
        let se3 = LieDual::se3();
        let casimir = CasimirDissipation::new(se3.algebra(), form).unwrap();
        let system = System::on(se3).energy(square).entropy(square).dissipation(casimir);
        laws::dissipation(&system.build().unwrap(), &x, &w, &a)?;
        let sigma = move |x: &Vector6<Real>| form.cast::<Real>() * (x.norm_squared() + 0.5);
        let mu = |x: &Vector6<Real>| Matrix6::from_diagonal_element(Real::from(0.7)) + *x * x.transpose();
        let system = System::on(Euclidean::<6>)
            .energy(square)
            .entropy(square)
            .dissipation(KulkarniNomizu(sigma, mu))
            .build()
            .unwrap();
        laws::dissipation(&system, &x, &w, &a)?;
        // σ = μ = G*/√2 is (semid).
        let half = |_: &Vector6<Real>| {
            Matrix6::from_diagonal_element(std::f64::consts::FRAC_1_SQRT_2).cast::<Real>()
        };
        let at = ChartPoint::<Euclidean<6>>::centre(&x);
        let product = KulkarniNomizu(half, half).apply(&MetricAt::new(&Canonical, &at), &w, &a).unwrap();
        same(&product, &MetricDissipation.apply(&MetricAt::new(&Canonical, &at), &w, &a).unwrap())?;
    }

    /// §4.4: `exp_h(v) = (x, exp_x(hv))` and eq. (weyl), by the closed form on SO(3).
    #[test]
    fn both_retractions_are_the_printed_pairs(q in columns::<3>(), d in columns::<3>()) {
        use metriplectic::manifolds::Tangent;
        let tangent = Tangent::<Rotations> { base: rotations::exp(&q), vector: d };
        let (x, y) = Exponential.pair(&Canonical, &tangent).unwrap();
        prop_assert!((x - tangent.base).norm() <= 8.0 * EPS);
        prop_assert!((y - tangent.base * rotations::exp(&d)).norm() <= 32.0 * EPS);
        let (x, y) = WeylMidpoint.pair(&Canonical, &tangent).unwrap();
        prop_assert!((x - tangent.base * rotations::exp(&(d * -0.5))).norm() <= 32.0 * EPS);
        prop_assert!((y - tangent.base * rotations::exp(&(d * 0.5))).norm() <= 32.0 * EPS);
    }
}

/// The right hand side of the relaxing rigid body as §4.3 prints it.
fn printed(p: &Vector3<f64>) -> Vector3<f64> {
    let [a, b, c] = I;
    let slow = |i: f64, j: f64| 1.0 / (i * i) - 1.0 / (i * j);
    vector![
        (b - c) / (b * c) * p.y * p.z + slow(b, a) * p.x * p.y * p.y + slow(c, a) * p.x * p.z * p.z,
        (c - a) / (a * c) * p.x * p.z + slow(a, b) * p.y * p.x * p.x + slow(c, b) * p.y * p.z * p.z,
        (a - b) / (a * b) * p.x * p.y + slow(a, c) * p.z * p.x * p.x + slow(b, c) * p.y * p.y * p.z
    ]
}

/// §2.4: an action with `Φ_g^*{f, h} = {Φ_g^*f, Φ_g^*h}`, `H∘Φ_g = H` and `X_{J_ξ} = ξ_P`; rotations
/// of so(3)* about an axis `e`, with `J = −p·e`, for a body that is symmetric about it or is not.
#[test]
fn an_action_is_checked_against_bracket_energy_and_momentum_map() {
    let body = |moments: Vector3<f64>, sign: f64| {
        let turn = |t: Real, p: &Vector3<Real>| {
            rotations::exp(&Vector3::new(0.0.into(), 0.0.into(), t)) * p
        };
        System::on(LieDual::so3())
            .energy(kinetic(moments))
            .symmetry(turn, move |p: &Vector3<Real>| p.z * sign)
            .build()
            .expect("a system")
    };
    let start = vector![0.4, -0.7, 0.9];
    let verdict = |moments, sign| body(moments, sign).verify(&start, 0.1);
    let signs = [1.0, -1.0].map(|sign| verdict(vector![2.0, 2.0, 1.0], sign).is_ok());
    assert!(signs[0] != signs[1], "{signs:?}");
    let mistaken = verdict(vector![2.0, 2.0, 1.0], if signs[0] { -1.0 } else { 1.0 });
    assert!(matches!(mistaken, Err(ModelError::ActionNotOfMomentum { .. })), "{mistaken:?}");
    let asymmetric = verdict(vector![2.0, 3.0, 1.0], if signs[0] { 1.0 } else { -1.0 });
    assert!(asymmetric.is_err(), "{asymmetric:?}");
}

/// What the page on choosing says of the discrete gradients: errors at `t = 5` of the spinning top of
/// Celledoni, Eidnes, Owren and Ringholm (2020), with 25 steps.
#[test]
fn the_discrete_gradients_have_small_errors_on_the_spinning_top() {
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let exact = vector![-0.135_129_410_617_930_4, 0.973_728_123_375_976_9, 0.183_285_526_250_026_5];
    let span = Span::steps(0.2, 25);
    let error = |end: Vector3<f64>| (end - exact).norm();
    let gonzalez = error(WeylMidpoint.run(&system, start, span).unwrap().last().point);
    let scheme = Scheme::new(WeylMidpoint);
    let mean_value = scheme.gradient(MeanValue).run(&system, start, span).unwrap();
    let mean_value = error(mean_value.last().point);
    let increments = scheme.gradient(SymmetricItohAbe).run(&system, start, span).unwrap();
    let increments = error(increments.last().point);
    println!("{gonzalez:.4e}, {mean_value:.4e}, {increments:.4e}");
    assert!((gonzalez / 3.57e-4 - 1.0).abs() < 1e-2);
    assert!((mean_value / 3.16e-4 - 1.0).abs() < 1e-2);
    assert!((increments / 5.42e-5 - 1.0).abs() < 1e-2);
}

/// §4.3: `S` grows although it is not asked for, because it is quadratic: `∇S(z) = ∇̄₂S(p, P)`.
#[test]
fn the_example_relaxes_with_both_laws() {
    let run = WeylMidpoint
        .run(&relaxing_body(), vector![0.001, -1.0, 0.001], Span::steps(0.1, 1000))
        .unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    let start = half_square(&vector![0.001, -1.0, 0.001].cast()).re;
    assert!((certificate.entropy_gained - (1.0000055 - start)).abs() < 1e-5, "{certificate}");
}

// The tests that the guide names.

/// A page of the guide, and the tests that it names, `path.rs::name`.
fn named(page: &str) -> Vec<(&str, &str)> {
    let is_path = |c: char| c.is_ascii_alphanumeric() || "_/.-".contains(c);
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    page.match_indices(".rs::")
        .map(|(at, mark)| {
            let path = &page[..at + 3];
            let start = path.rfind(|c| !is_path(c)).map_or(0, |i| i + 1);
            let rest = &page[at + mark.len()..];
            let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
            (&path[start..], &rest[..end])
        })
        .collect()
}

const ERRATA: &str = include_str!("../src/guide/errata.rs");
const EQUATIONS: &str = include_str!("../src/guide/equations.rs");
const CHOOSING: &str = include_str!("../src/guide/choosing.rs");

#[test]
fn every_test_that_the_guide_names_exists() {
    for (page, at_least) in [(ERRATA, 17), (EQUATIONS, 80), (CHOOSING, 1)] {
        let tests = named(page);
        assert!(tests.len() >= at_least, "{} tests are named", tests.len());
        for (path, name) in tests {
            let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
            let source = std::fs::read_to_string(&file).expect("the file of a test that is named");
            // A function, or the name given to a macro that makes one, on a line of its own.
            let found = source.lines().map(str::trim_start).any(|line| {
                let of_macro = line.split_once("!(").map(|(_, arguments)| arguments);
                [line.strip_prefix("fn "), of_macro].into_iter().flatten().any(|rest| {
                    rest.strip_prefix(name).is_some_and(|after| after.starts_with(['(', ',']))
                })
            });
            assert!(found, "{path} has no test {name}");
        }
    }
}

#[test]
fn every_test_of_an_erratum_is_on_its_page() {
    let source = include_str!("errata.rs");
    let tests: Vec<&str> = source
        .split("#[test]")
        .skip(1)
        .filter_map(|test| test.trim_start().strip_prefix("fn ")?.split('(').next())
        .collect();
    assert!(tests.len() >= 17, "{tests:?}");
    for test in tests {
        assert!(ERRATA.contains(&format!("tests/errata.rs::{test}`")), "{test} is not on the page");
    }
}
