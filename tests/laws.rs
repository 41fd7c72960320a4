//! The laws of brackets and dissipations, with negative controls.

use metriplectic::dynamics::laws;
use metriplectic::fields::BrokenLaw;
use metriplectic::prelude::*;
use proptest::prelude::*;

fn columns<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform::<_, N>(-1.5..1.5).prop_map(SVector::<f64, N>::from)
}

fn square<const N: usize>(x: &SVector<Real, N>) -> Real {
    x.norm_squared() * 0.5
}

/// `|Γ|²` on se(3)*.
fn gamma_squared(x: &Vector6<Real>) -> Real {
    (3..6).map(|i| x[i] * x[i]).sum()
}

/// `M·Γ` on se(3)*.
fn m_dot_gamma(x: &Vector6<Real>) -> Real {
    (0..3).map(|i| x[i] * x[i + 3]).sum()
}

proptest! {
    #[test]
    fn lie_poisson_brackets_keep_the_laws(
        x in columns::<3>(), a in columns::<3>(), b in columns::<3>(),
        x6 in columns::<6>(), a6 in columns::<6>(), b6 in columns::<6>(),
    ) {
        for space in [LieDual::so3(), LieDual::su2(2.0), LieDual::sl2(), LieDual::heisenberg()] {
            let system = System::on(space).energy(square).build().unwrap();
            laws::bracket(&system, &x, &a, &b)?;
        }
        for space in [LieDual::se3(), LieDual::so4()] {
            let system = System::on(space).energy(square).build().unwrap();
            laws::bracket(&system, &x6, &a6, &b6)?;
        }
    }

    #[test]
    fn brackets_of_a_volume_form_keep_the_laws(
        seed in any::<u64>(), a in columns::<2>(), b in columns::<2>(),
        c in columns::<3>(), d in columns::<3>(),
    ) {
        use rand::SeedableRng;
        let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
        let sphere = Sphere::<2>::round();
        let top = System::on(sphere).bracket(AreaForm).energy(square).build().unwrap();
        laws::bracket(&top, &sphere.random(&mut rng), &a, &b)?;
        let entropy = |x: &Vector4<Real>| x.x * x.y + x.z.powi(3) - x.w;
        let three = Sphere::<3>::round();
        let nambu = System::on(three)
            .bracket(Nambu::default())
            .energy(square)
            .entropy(entropy)
            .build()
            .unwrap();
        laws::bracket(&nambu, &three.random(&mut rng), &c, &d)?;
        let group = System::on(Rotations::bi_invariant())
            .bracket(Nambu { factor: 0.7 })
            .energy(|r: &Matrix3<Real>| r.m11)
            .entropy(|r: &Matrix3<Real>| r.m12 * r.m23 + r.m31)
            .build()
            .unwrap();
        laws::bracket(&group, &Rotations.random(&mut rng), &c, &d)?;
    }

    #[test]
    fn constant_and_closure_brackets_keep_the_laws(
        entries in prop::array::uniform4(columns::<4>()),
        x in columns::<4>(), a in columns::<4>(), b in columns::<4>(),
        y in columns::<3>(), c in columns::<3>(), d in columns::<3>(),
    ) {
        let m = Matrix4::from_columns(&entries);
        let system = System::on(Euclidean::<4>)
            .bracket(Poisson::constant(m - m.transpose()).unwrap())
            .energy(square)
            .build()
            .unwrap();
        laws::bracket(&system, &x, &a, &b)?;
        // hat(∇C) with C = p₁²p₂ + sin p₃.
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::field(|p: &Vector3<Real>| {
                Vector3::new(p.x * p.y * 2.0, p.x * p.x, p.z.cos()).cross_matrix()
            }))
            .energy(square)
            .build()
            .unwrap();
        laws::bracket(&system, &y, &c, &d)?;
    }

    /// On so(3)* every tensor linear in the point passes; in dimension 6 random antisymmetric
    /// constants are no Lie algebra, and the identity must break.
    #[test]
    fn random_antisymmetric_constants_break_the_jacobi_identity(
        constants in prop::collection::vec(-1.0..1.0_f64, 216),
        x in columns::<6>(), a in columns::<6>(), b in columns::<6>(),
    ) {
        prop_assume!(x.norm() > 0.5);
        let tensor = move |x: &Vector6<Real>| {
            let raw = Matrix6::from_fn(|i, j| {
                (0..6).map(|k| x[k] * constants[36 * i + 6 * j + k]).sum::<Real>()
            });
            raw - raw.transpose()
        };
        let system =
            System::on(Euclidean::<6>).bracket(Poisson::field(tensor)).energy(square).build().unwrap();
        let broken: BrokenLaw = laws::bracket(&system, &x, &a, &b).unwrap_err();
        prop_assert_eq!(broken.law, "Jacobi identity");
    }

    #[test]
    fn the_metric_dissipation_keeps_the_laws(
        entries in prop::array::uniform5(columns::<5>()),
        x in columns::<5>(), w in columns::<5>(), a in columns::<5>(),
    ) {
        prop_assume!(w.norm() > 0.1);
        let b = Matrix5::from_columns(&entries);
        let g = (Matrix5::identity() + b * b.transpose()) * 0.5;
        let builder = || System::on(Euclidean::<5>).energy(square::<5>).entropy(square::<5>);
        laws::dissipation(&builder().build().unwrap(), &x, &w, &a)?;
        let constant = builder().metric(Metric::constant((g + g.transpose()) * 0.5).unwrap());
        laws::dissipation(&constant.build().unwrap(), &x, &w, &a)?;
        // Varying, and symmetric positive at every point.
        let closure = builder().metric(Metric::field(|x: &Vector5<Real>| {
            Matrix5::from_diagonal_element(1.0.into()) + *x * x.transpose() * Real::from(0.3)
        }));
        laws::dissipation(&closure.build().unwrap(), &x, &w, &a)?;
        // Nearly parallel covectors, where the two terms of K cancel.
        laws::dissipation(&builder().build().unwrap(), &x, &w, &(w * 2.0 + a * 1e-9))?;
    }
}

#[test]
fn the_casimirs_of_se3_are_entropies_and_the_angular_momentum_is_not() {
    let start = vector![0.1, -0.4, 0.9, 0.3, 0.5, -0.7];
    let energy = |x: &Vector6<Real>| x.norm_squared() * 0.5 + x[0] * x[4];
    let system = System::on(LieDual::se3()).energy(energy).entropy(gamma_squared).build().unwrap();
    system.verify(&start, 0.3).unwrap();
    let system = System::on(LieDual::se3()).energy(energy).entropy(m_dot_gamma).build().unwrap();
    system.verify(&start, 0.3).unwrap();
    let m_squared = |x: &Vector6<Real>| (0..3).map(|i| x[i] * x[i]).sum::<Real>();
    let system = System::on(LieDual::se3()).energy(energy).entropy(m_squared).build().unwrap();
    let error = system.verify(&start, 0.3).unwrap_err();
    assert!(matches!(error, ModelError::EntropyNotCasimir { .. }), "{error}");
}

#[test]
fn a_report_lists_every_law_and_the_verdict() {
    let system =
        System::on(LieDual::so3()).energy(square).entropy(|p: &Vector3<Real>| p.x).build().unwrap();
    let report = system.report(&vector![0.3, 0.2, 0.1]);
    let broken: Vec<_> = report.laws.iter().filter(|law| !law.holds()).collect();
    assert_eq!(broken.len(), 1);
    assert_eq!(broken[0].law, "Π dS = 0");
    let text = report.to_string();
    for law in ["Πᵀ = −Π", "Jacobi identity", "Π dS = 0", "Kᵀ = K", "K ⪰ 0", "K dH = 0", "verdict"]
    {
        assert!(text.contains(law), "{law} is missing in:\n{text}");
    }
}
