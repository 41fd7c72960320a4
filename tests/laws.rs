//! The laws of brackets and dissipations, with negative controls.

use metriplectic::dynamics::bracket::{BracketArgs, BracketJet};
use metriplectic::dynamics::dissipation::DissipationJet;
use metriplectic::dynamics::{Bracket, Dissipation, MetricDissipation, laws, parts_of};
use metriplectic::fields::{BrokenLaw, ChartPoint};
use metriplectic::manifolds::{MetricAt, MetricError};
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
            .bracket(Nambu::default().times(0.7))
            .energy(|r: &Matrix3<Real>| r.m11)
            .entropy(|r: &Matrix3<Real>| r.m12 * r.m23 + r.m31)
            .build()
            .unwrap();
        laws::bracket(&group, &Rotations.random(&mut rng), &c, &d)?;
    }

    #[test]
    fn brackets_with_several_casimirs_keep_the_laws(
        seed in any::<u64>(),
        a4 in columns::<4>(), b4 in columns::<4>(), x4 in columns::<4>(),
        a5 in columns::<5>(), b5 in columns::<5>(), a7 in columns::<7>(), b7 in columns::<7>(),
    ) {
        use rand::SeedableRng;
        let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
        let four = System::on(Sphere::<4>)
            .bracket(Nambu::default().and(|x: &Vector5<Real>| x[4] + x[0] * x[1]))
            .energy(square)
            .entropy(|x: &Vector5<Real>| x[0] * x[1] + x[2].powi(3) - x[3])
            .build()
            .unwrap();
        laws::bracket(&four, &Sphere::<4>.random(&mut rng), &a4, &b4)?;
        // No entropy, a factor that varies, and a metric that does.
        let metric = |q: &Vector4<Real>| {
            let wave = q.map(|x| (x * 0.7).sin());
            Matrix4::identity() + wave * wave.transpose() * Real::from(0.5)
        };
        let nambu = Nambu::of(|x: &Vector4<Real>| x[0] * x[2] - x[3].powi(2))
            .and(|x: &Vector4<Real>| x[1].sin() + x[2] * x[0])
            .times(|x: &Vector4<Real>| x[1].exp());
        let chart = System::on(Euclidean::<4>)
            .metric(Metric::field(metric))
            .bracket(nambu)
            .energy(square)
            .build()
            .unwrap();
        laws::bracket(&chart, &x4, &a4, &b4)?;
        let five = System::on(Sphere::<5>)
            .bracket(
                Nambu::default()
                    .and(|x: &Vector6<Real>| x[4].powi(2) - x[5])
                    .and(|x: &Vector6<Real>| x[1] * x[3]),
            )
            .energy(square)
            .entropy(|x: &Vector6<Real>| x[0] * x[1] + x[2].powi(3) - x[3])
            .build()
            .unwrap();
        laws::bracket(&five, &Sphere::<5>.random(&mut rng), &a5, &b5)?;
        let entry = |i: usize| move |x: &SVector<Real, 8>| x[i] + x[i + 1].powi(2);
        let seven = System::on(Sphere::<7>)
            .bracket(Nambu::default().and(entry(1)).and(entry(3)).and(entry(5)).and(entry(0)))
            .energy(square)
            .entropy(|x: &SVector<Real, 8>| x[0] * x[7])
            .build()
            .unwrap();
        laws::bracket(&seven, &Sphere::<7>.random(&mut rng), &a7, &b7)?;
    }

    #[test]
    fn canonical_brackets_and_sums_keep_the_laws(
        seed in any::<u64>(), x in columns::<4>(), a in columns::<4>(), b in columns::<4>(),
        a2 in columns::<2>(), b2 in columns::<2>(), a3 in columns::<3>(), b3 in columns::<3>(),
        a6 in columns::<6>(), b6 in columns::<6>(),
    ) {
        use rand::SeedableRng;
        let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
        let column = System::on(Euclidean::<4>).bracket(Symplectic).energy(square).build().unwrap();
        laws::bracket(&column, &x, &a, &b)?;
        let open = Chart::<4>::new(|_| true);
        let open = System::on(open).bracket(Symplectic).energy(square).build().unwrap();
        laws::bracket(&open, &x, &a, &b)?;

        let pairs = Product(Chart::<2>::new(|_| true), Euclidean::<2>);
        let sum = |(q, p): &(Vector2<Real>, Vector2<Real>)| q.norm_squared() + p.x.powi(3);
        let pairs = System::on(pairs).bracket(Symplectic).energy(sum).build().unwrap();
        laws::bracket(&pairs, &pairs.manifold().random(&mut rng), &a, &b)?;

        let angle = Product(Sphere::<1>::round(), Euclidean::<1>);
        let pendulum = |(x, p): &(Vector2<Real>, Vector1<Real>)| p.x.powi(2) * 0.5 + x.y;
        let angle = System::on(angle).bracket(Symplectic).energy(pendulum).build().unwrap();
        let at = angle.manifold().random(&mut rng);
        laws::bracket(&angle, &at, &a2, &b2)?;
        // θ' = p and p' = −∂H/∂θ, everywhere on the circle.
        let centre = ChartPoint::<Product<Sphere<1>, Euclidean<1>>>::centre(&at);
        let v = angle.velocity(&centre).map_err(|error| TestCaseError::fail(error.to_string()))?;
        let (turn, force) = (at.1.x, -at.0.x);
        prop_assert!((v - vector![turn, force]).norm() <= 1e-14, "{v}");

        let attitude = Product(Rotations, Euclidean::<3>);
        let heavy = |(r, p): &(Matrix3<Real>, Vector3<Real>)| p.norm_squared() + r.m33;
        let attitude = System::on(attitude).bracket(Symplectic).energy(heavy).build().unwrap();
        laws::bracket(&attitude, &attitude.manifold().random(&mut rng), &a6, &b6)?;

        let bath = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
            .bracket((AreaForm, Zero))
            .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| n.z.powi(2) + s.x.exp())
            .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
            .build()
            .unwrap();
        laws::bracket(&bath, &bath.manifold().random(&mut rng), &a3, &b3)?;
    }

    #[test]
    fn closure_brackets_on_curved_spaces_keep_the_laws(
        seed in any::<u64>(), a in columns::<2>(), b in columns::<2>(),
        a3 in columns::<3>(), b3 in columns::<3>(),
    ) {
        use rand::SeedableRng;
        let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
        // On S² the bivector x̂ is the area form.
        let energy = |x: &Vector3<Real>| x.x.powi(2) + x.y * x.z;
        let form = Poisson::field(|x: &Vector3<Real>| x.cross_matrix());
        let closure = System::on(Sphere::<2>).bracket(form).energy(energy).build().unwrap();
        let x = Sphere::<2>.random(&mut rng);
        laws::bracket(&closure, &x, &a, &b)?;
        let area = System::on(Sphere::<2>).bracket(AreaForm).energy(energy).build().unwrap();
        let at = ChartPoint::<Sphere<2>>::centre(&x);
        let [left, right] = [closure.velocity(&at).unwrap(), area.velocity(&at).unwrap()];
        prop_assert!((left - right).norm() <= 1e-14, "{left} {right}");
        // A bracket of any kind in other units, also in a product.
        let scaled = System::on(Sphere::<2>).bracket(Scaled(-2.5, AreaForm)).energy(energy).build().unwrap();
        laws::bracket(&scaled, &x, &a, &b)?;
        let left = scaled.velocity(&at).unwrap();
        prop_assert!((left + right * 2.5).norm() <= 1e-14, "{left} {right}");
        // On SO(3) the body covectors (dS)^ are Nambu's bracket of S = R₁₃, with dS = (R₁₂·, −R₁₁·, 0).
        let slope = |r: &Matrix3<Real>| Vector3::new(-r.m12, r.m11, Real::from(0.0));
        let body = System::on(Rotations)
            .bracket(Poisson::field(move |r: &Matrix3<Real>| slope(r).cross_matrix()))
            .energy(|r: &Matrix3<Real>| r.m21 + r.m33.powi(2))
            .build()
            .unwrap();
        let r = Rotations.random(&mut rng);
        laws::bracket(&body, &r, &a3, &b3)?;
        let nambu = System::on(Rotations)
            .bracket(Nambu::of(|r: &Matrix3<Real>| r.m13))
            .energy(|r: &Matrix3<Real>| r.m21 + r.m33.powi(2))
            .build()
            .unwrap();
        let at = ChartPoint::<Rotations>::centre(&r);
        let [left, right] = [body.velocity(&at).unwrap(), nambu.velocity(&at).unwrap()];
        prop_assert!((left - right).norm() <= 1e-14, "{left} {right}");
        // A metric that depends on R has a volume form that does.
        let metric = Metric::field(|r: &Matrix3<Real>| {
            let lean = r.column(2).into_owned();
            Matrix3::identity() + lean * lean.transpose() * (r.m11 + 1.5)
        });
        let varying = System::on(Rotations)
            .metric(metric)
            .bracket(Nambu::of(|r: &Matrix3<Real>| r.m13))
            .energy(|r: &Matrix3<Real>| r.m21)
            .build()
            .unwrap();
        laws::bracket(&varying, &r, &a3, &b3)?;
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

    #[test]
    fn the_dual_of_an_algebra_in_a_random_basis_keeps_the_laws(
        entries in prop::array::uniform3(columns::<3>()),
        x in columns::<3>(), a in columns::<3>(), b in columns::<3>(),
    ) {
        let basis = Matrix3::from_columns(&entries);
        prop_assume!(basis.determinant().abs() > 0.2);
        // so(3) in the basis of the columns.
        let mixed = entries.map(|column| column.cross_matrix());
        let algebra = LieAlgebra::of_matrices(&mixed).unwrap();
        let system = System::on(LieDual::of(algebra)).energy(square).build().unwrap();
        laws::bracket(&system, &x, &a, &b)?;
        // Its Casimir is |p|² in the old components, p = B⁻ᵀ μ.
        let inverse = basis.try_inverse().unwrap().transpose();
        let casimir = move |mu: &Vector3<Real>| (inverse.cast::<Real>() * mu).norm_squared();
        let system = System::on(system.manifold().clone())
            .energy(square)
            .entropy(casimir)
            .build()
            .unwrap();
        system.verify(&x, 0.1)?;
    }

    /// In dimension 3 a tensor linear in the point is `hat(Ax)`, with the Jacobi expression
    /// `v · curl v` for `v = Ax`: it vanishes for the six-dimensional family of symmetric `A`, among
    /// them so(3)*, and for no random one.
    #[test]
    fn random_antisymmetric_constants_in_dimension_three_break_the_jacobi_identity(
        entries in prop::array::uniform3(columns::<3>()),
        x in columns::<3>(), a in columns::<3>(), b in columns::<3>(),
    ) {
        let m = Matrix3::from_columns(&entries);
        let curl = vector![m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12];
        prop_assume!((m * x).dot(&curl).abs() > 1e-3);
        let with = |m: Matrix3<f64>| {
            System::on(Euclidean::<3>)
                .bracket(Poisson::field(move |x: &Vector3<Real>| {
                    (m.cast::<Real>() * x).cross_matrix()
                }))
                .energy(square)
                .build()
                .unwrap()
        };
        let broken: BrokenLaw = laws::bracket(&with(m), &x, &a, &b).unwrap_err();
        prop_assert_eq!(broken.law, "Jacobi identity");
        prop_assert!(broken.size > 1e-3);
        laws::bracket(&with(m + m.transpose()), &x, &a, &b)?;
    }

    /// In dimension 6 random antisymmetric constants are no Lie algebra either.
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

/// The bracket of so(3)* on R³, with one fault.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Faulty {
    None,
    NotSkew,
    NoJacobi,
    NotLinear,
    Value,
    Tensor,
    AlongPoint,
    AlongEntropy,
}

impl<G> Bracket<Euclidean<3>, G> for Faulty
where
    G: metriplectic::manifolds::Riemannian<Euclidean<3>>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Euclidean<3>, G, D>,
        a: &Vector3<D>,
    ) -> Result<Vector3<D>, MetricError> {
        let p = at.g.x.point();
        let mut turn =
            Vector3::new(p.y * a.z - p.z * a.y, p.z * a.x - p.x * a.z, p.x * a.y - p.y * a.x);
        match self {
            Self::NotSkew => turn.x += a.x * 1e-6,
            Self::NoJacobi => {
                turn.x += p.x * a.y * 1e-6;
                turn.y -= p.x * a.x * 1e-6;
            }
            Self::NotLinear => turn.x += (a.x * a.x - a.x) * a.y * 1e-6,
            _ => {}
        }
        Ok(turn)
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, Euclidean<3>, G>,
        a: &Vector3<f64>,
    ) -> Result<BracketJet<Euclidean<3>>, MetricError> {
        // The derivatives of a × b are those of a cross product.
        let p = at.g.x.point();
        let mut jet = BracketJet::<Euclidean<3>> {
            value: Bracket::<_, G>::apply(self, at, a)?,
            along_z: -a.cross_matrix(),
            along_s: Matrix3::zeros(),
            tensor: Bracket::<_, G>::tensor(self, at)?,
        };
        if *self == Self::NoJacobi {
            jet.along_z.m11 += a.y * 1e-6;
            jet.along_z.m21 -= a.x * 1e-6;
        }
        let off = 1e-6 * p.norm();
        match self {
            Self::Value => jet.value.z += off,
            Self::Tensor => jet.tensor.m13 += off,
            Self::AlongPoint => jet.along_z.m12 += off,
            Self::AlongEntropy => jet.along_s.m22 += off,
            _ => {}
        }
        Ok(jet)
    }
}

#[test]
fn each_law_of_a_bracket_can_break() {
    let (x, a, b) = (vector![0.3, -0.7, 0.5], vector![1.0, 0.4, -0.8], vector![-0.2, 0.9, 0.6]);
    let law = |fault: Faulty| {
        let system = System::on(Euclidean::<3>).bracket(fault).energy(square).build().unwrap();
        laws::bracket(&system, &x, &a, &b).err().map(|broken| broken.law)
    };
    assert_eq!(law(Faulty::None), None);
    assert_eq!(law(Faulty::NotSkew), Some("Π is skew"));
    assert_eq!(law(Faulty::NoJacobi), Some("Jacobi identity"));
    assert_eq!(law(Faulty::NotLinear), Some("Π(α + 3β) = Πα + 3Πβ"));
    assert_eq!(law(Faulty::Value), Some("linearise has the value of apply"));
    assert_eq!(law(Faulty::Tensor), Some("linearise has the tensor of apply"));
    assert_eq!(law(Faulty::AlongPoint), Some("linearise is the derivative along x"));
    assert_eq!(law(Faulty::AlongEntropy), Some("linearise is the derivative along dS"));
}

/// A system with another dissipation than the one it was built with.
struct With<Y, K> {
    system: Y,
    dissipation: K,
}

impl<Y: Metriplectic, K: Dissipation<Y::Manifold, Y::Metric>> Metriplectic for With<Y, K> {
    parts_of!(self.system: Y {
        manifold: Manifold, metric: Metric, bracket: Bracket, energy: Energy, entropy: Entropy,
        invariants: Invariants,
    });

    type Dissipation = K;

    fn dissipation(&self) -> &K {
        &self.dissipation
    }

    fn second_law(&self) -> SecondLaw {
        self.system.second_law()
    }
}

/// The dissipation of the metric, with one fault.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Leaky {
    None,
    NotSymmetric,
    Negative,
    LosesEnergy,
    AlongPoint,
    AlongAnnihilated,
    AlongCovector,
}

impl<G> Dissipation<LieDual<3>, G> for Leaky
where
    G: metriplectic::manifolds::Riemannian<LieDual<3>>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, LieDual<3>, G, D>,
        w: &Vector3<D>,
        a: &Vector3<D>,
    ) -> Result<Vector3<D>, MetricError> {
        let mut k = MetricDissipation.apply(g, w, a)?;
        let off = 1e-6;
        match self {
            // w × α annihilates w and adds nothing to the form; only symmetry is lost.
            Self::NotSymmetric => {
                k.x += (w.y * a.z - w.z * a.y) * off;
                k.y += (w.z * a.x - w.x * a.z) * off;
                k.z += (w.x * a.y - w.y * a.x) * off;
            }
            Self::Negative => k = -k,
            Self::LosesEnergy => k.x += a.x * off,
            _ => {}
        }
        Ok(k)
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, LieDual<3>, G>,
        w: &Vector3<f64>,
        a: &Vector3<f64>,
    ) -> Result<DissipationJet<LieDual<3>>, MetricError> {
        let mut jet = MetricDissipation.linearise(g, w, a)?;
        match self {
            Self::AlongPoint => jet.along_z.m12 += 1e-6,
            Self::AlongAnnihilated => jet.along_w.m31 += 1e-6,
            Self::AlongCovector => jet.tensor.m23 += 1e-6,
            _ => {}
        }
        Ok(jet)
    }
}

#[test]
fn each_law_of_a_dissipation_can_break() {
    let (x, w, a) = (vector![0.3, -0.7, 0.5], vector![1.0, 0.4, -0.8], vector![-0.2, 0.9, 0.6]);
    let with = |dissipation: Leaky| {
        let system = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x.powi(2) + p.y.powi(2) * 0.5 + p.z * 0.1)
            .entropy(square::<3>)
            .build()
            .unwrap();
        With { system, dissipation }
    };
    let law = |fault| laws::dissipation(&with(fault), &x, &w, &a).err().map(|broken| broken.law);
    assert_eq!(law(Leaky::None), None);
    assert_eq!(law(Leaky::NotSymmetric), Some("K is symmetric"));
    assert_eq!(law(Leaky::Negative), Some("K is positive semidefinite"));
    assert_eq!(law(Leaky::LosesEnergy), Some("K_w w = 0"));
    assert_eq!(law(Leaky::AlongPoint), Some("linearise is the derivative along x"));
    assert_eq!(law(Leaky::AlongAnnihilated), Some("linearise is the derivative along w"));
    assert_eq!(law(Leaky::AlongCovector), Some("linearise is the derivative along α"));

    // A run refuses the same faults, as far as a step can see them.
    let refused = |fault| with(fault).verify(&x, 0.1).err();
    assert_eq!(refused(Leaky::None), None);
    assert!(matches!(
        refused(Leaky::NotSymmetric),
        Some(ModelError::DissipationNotSymmetric { .. })
    ));
    assert!(matches!(refused(Leaky::Negative), Some(ModelError::DissipationNotPositive { .. })));
    assert!(matches!(refused(Leaky::LosesEnergy), Some(ModelError::EnergyNotKept { .. })));
}
