//! The laws of every dissipation on every kind of space, with negative controls.

use metriplectic_dynamics::BuildError;
use metriplectic_dynamics::{
    CasimirDissipation, CometricDissipation, Dissipation, FieldDissipation, KulkarniNomizu,
    MetricDissipation, Metriplectic, ModelError, NoDissipation, ProjectedDissipation, Scaled,
    System, Verify, laws,
};
use metriplectic_fields::{ChartPoint, Column, Dimension, Real, Space, Square, Vector};
use metriplectic_manifolds::{
    Canonical, Euclidean, HalfLine, LieAlgebra, LieDual, Manifold, Metric, MetricAt, Product,
    Riemannian, Rotations, Sphere,
};
use nalgebra::{
    Matrix3, Matrix4, Matrix5, Matrix6, SMatrix, SVector, Vector3, Vector5, Vector6, matrix, vector,
};
use num_dual::{Dual, Dual64, DualNum};
use proptest::prelude::*;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

fn columns<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform::<_, N>(-1.5..1.5).prop_map(SVector::<f64, N>::from)
}

fn matrices<const N: usize>() -> impl Strategy<Value = SMatrix<f64, N, N>> {
    prop::array::uniform::<_, N>(columns::<N>()).prop_map(|a| SMatrix::from_columns(&a))
}

fn square<const N: usize>(x: &SVector<Real, N>) -> Real {
    x.norm_squared() * 0.5
}

/// The identity at the scalar of closures.
fn eye<const N: usize>() -> SMatrix<Real, N, N> {
    SMatrix::from_fn(|i, j| Real::from(if i == j { 1.0 } else { 0.0 }))
}

/// A number that varies and is positive, from entries.
fn kappa(entries: &[Real]) -> Real {
    entries.iter().map(|e| e * e).sum::<Real>() + entries[0].sin() + 1.5
}

/// `BᵀB` for a varying `B` near the first `rank` rows of the identity: semidefinite of that rank.
fn degenerate<const N: usize>(
    b: &SMatrix<f64, N, N>,
    x: &[Real],
    rank: usize,
) -> SMatrix<Real, N, N> {
    let b = SMatrix::<Real, N, N>::from_fn(|i, j| {
        let near = (x[(i + j) % x.len()].cos() + b[(i, j)]) * 0.1;
        if i >= rank { 0.0.into() } else { near + if i == j { 1.0 } else { 0.0 } }
    });
    b.transpose() * b
}

/// The laws, for a `w` at which `K` is not the small rest of large terms: no smaller than a fiftieth
/// of what it is for other covectors of the same length.
fn keeps_the_laws<Y: Metriplectic>(
    system: &Y,
    x: &<Y::Manifold as Space>::Point<f64>,
    w: &Vector<Y::Manifold>,
    a: &Vector<Y::Manifold>,
) -> Result<(), TestCaseError> {
    let size = |w: &Vector<Y::Manifold>| {
        let at = ChartPoint::<Y::Manifold>::centre(x);
        system.dissipation().tensor(&system.metric_at(&at), w).expect("K exists").max_abs()
    };
    let other = |k| size(&(Vector::<Y::Manifold>::basis(k) * w.magnitude()));
    let largest = (0..<Y::Manifold as Space>::Dim::LEN).map(other).fold(0.0, f64::max);
    prop_assume!(size(w) > 0.02 * largest);
    Ok(laws::dissipation(system, x, w, a)?)
}

/// Two systems on `M`, one with each of two dissipations that should be the same, agree.
fn agree<M: Manifold, G: Riemannian<M>>(
    (left, right): (&impl Dissipation<M, G>, &impl Dissipation<M, G>),
    metric: &G,
    x: &M::Point<f64>,
    w: &Vector<M>,
    a: &Vector<M>,
) -> Result<(), TestCaseError> {
    let x = ChartPoint::<M>::centre(x);
    let g = MetricAt::new(metric, &x);
    let (l, r) = (left.linearise(&g, w, a), right.linearise(&g, w, a));
    let (l, r) = (l.expect("K exists"), r.expect("K exists"));
    let error = (l.value - r.value).magnitude();
    let bound = 1e-13 * (1.0 + w.magnitude().powi(2)) * (1.0 + a.magnitude());
    prop_assert!(error <= bound, "{error:.1e}");
    for (l, r) in [(l.along_w, r.along_w), (l.along_z, r.along_z), (l.tensor, r.tensor)] {
        let error = Square::max_abs(&(l - r));
        prop_assert!(error <= 10.0 * bound, "{error:.1e}");
    }
    Ok(())
}

/// The system on `M` with this dissipation; the laws look at nothing else of it.
macro_rules! with {
    ($manifold:expr, $entropy:expr, $dissipation:expr) => {
        System::on($manifold)
            .energy($entropy)
            .entropy($entropy)
            .dissipation($dissipation)
            .build()
            .unwrap()
    };
}

/// As a generic program asks.
fn is_projected<Y: Metriplectic>(system: &Y) -> bool {
    system.dissipation().is_projected()
}

fn of_matrix(r: &Matrix3<Real>) -> Real {
    r.m11 + r.m23
}

proptest! {
    #[test]
    fn a_scaled_dissipation_keeps_the_laws(
        seed in any::<u64>(), x in columns::<5>(), w in columns::<5>(), a in columns::<5>(),
        w3 in columns::<3>(), a3 in columns::<3>(),
    ) {
        prop_assume!(w.norm() > 0.1 && w3.norm() > 0.1 && w3.xy().norm() > 0.1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let scaled = MetricDissipation::scaled(|x: &Vector5<Real>| kappa(x.as_slice()));
        let system = with!(Euclidean::<5>, square::<5>, scaled);
        laws::dissipation(&system, &x, &w, &a)?;
        let metric = Metric::field(|x: &Vector5<Real>| {
            Matrix5::from_diagonal_element(1.0.into()) + *x * x.transpose() * Real::from(0.3)
        });
        let system = System::on(Euclidean::<5>)
            .metric(metric)
            .energy(square::<5>)
            .entropy(square::<5>)
            .dissipation(scaled)
            .build()?;
        laws::dissipation(&system, &x, &w, &a)?;
        let scaled = MetricDissipation::scaled(|x: &Vector3<Real>| kappa(x.as_slice()));
        let sphere = Sphere::<2>::round();
        let system = with!(sphere, square::<3>, scaled);
        laws::dissipation(&system, &sphere.random(&mut rng), &w3.xy(), &a3.xy())?;
        laws::dissipation(&with!(LieDual::so3(), square::<3>, scaled), &a3, &w3, &a3.zxy())?;
        let scaled = MetricDissipation::scaled(|r: &Matrix3<Real>| kappa(r.as_slice()));
        laws::dissipation(&with!(Rotations, of_matrix, scaled), &Rotations.random(&mut rng), &w3, &a3)?;
    }

    #[test]
    fn a_degenerate_cometric_keeps_the_laws(
        seed in any::<u64>(), b in matrices::<5>(), c in matrices::<3>(), rank in 2..=5_usize,
        x in columns::<5>(), w in columns::<5>(), a in columns::<5>(),
        w3 in columns::<3>(), a3 in columns::<3>(),
    ) {
        prop_assume!(w.norm() > 0.1 && w3.norm() > 0.1 && w3.xy().norm() > 0.1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let cometric = CometricDissipation(move |x: &Vector5<Real>| degenerate(&b, x.as_slice(), rank));
        keeps_the_laws(&with!(Euclidean::<5>, square::<5>, cometric), &x, &w, &a)?;
        // Nearly parallel covectors, where the two terms of K cancel.
        keeps_the_laws(&with!(Euclidean::<5>, square::<5>, cometric), &x, &w, &(w * 2.0 + a * 1e-9))?;
        let rank = rank.min(3);
        let cometric = CometricDissipation(move |x: &Vector3<Real>| degenerate(&c, x.as_slice(), 3));
        let sphere = Sphere::<2>::round();
        keeps_the_laws(&with!(sphere, square::<3>, cometric), &sphere.random(&mut rng), &w3.xy(), &a3.xy())?;
        let cometric = CometricDissipation(move |x: &Vector3<Real>| degenerate(&c, x.as_slice(), rank));
        keeps_the_laws(&with!(LieDual::so3(), square::<3>, cometric), &a3, &w3, &a3.zxy())?;
        let cometric = CometricDissipation(move |r: &Matrix3<Real>| degenerate(&c, r.as_slice(), rank));
        keeps_the_laws(&with!(Rotations, of_matrix, cometric), &Rotations.random(&mut rng), &w3, &a3)?;
    }

    #[test]
    fn the_cometric_of_a_metric_has_its_dissipation(
        seed in any::<u64>(), b in matrices::<3>(), w in columns::<3>(), a in columns::<3>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let g = b * b.transpose() + Matrix3::identity();
        let inverse = g.try_inverse().unwrap();
        let inverse = (inverse + inverse.transpose()) * 0.5;
        let metric = Metric::constant((g + g.transpose()) * 0.5).unwrap();
        let cometric = CometricDissipation(move |_: &Vector3<Real>| inverse.cast::<Real>());
        let half = move |_: &Vector3<Real>| inverse.cast::<Real>() * Real::from(0.5_f64.sqrt());
        type R3 = Euclidean<3>;
        agree::<R3, _>((&MetricDissipation, &cometric), &metric, &a, &w, &a)?;
        agree::<R3, _>((&MetricDissipation, &KulkarniNomizu(half, half)), &metric, &a, &w, &a)?;
        // The round cometric of the sphere is the identity of the space around.
        let one = CometricDissipation(|_: &Vector3<Real>| eye());
        let x = Sphere::<2>.random(&mut rng);
        agree::<Sphere<2>, _>((&MetricDissipation, &one), &Canonical, &x, &w.xy(), &a.xy())?;
        let one = CometricDissipation(|_: &Matrix3<Real>| eye());
        let x = Rotations.random(&mut rng);
        agree::<Rotations, _>((&MetricDissipation, &one), &Canonical, &x, &w, &a)?;
    }

    #[test]
    fn kulkarni_nomizu_products_keep_the_laws(
        seed in any::<u64>(), b in matrices::<5>(), c in matrices::<5>(),
        ranks in (1..=5_usize, 2..=5_usize),
        d in matrices::<3>(), e in matrices::<3>(),
        x in columns::<5>(), w in columns::<5>(), a in columns::<5>(),
        w3 in columns::<3>(), a3 in columns::<3>(),
    ) {
        prop_assume!(w.norm() > 0.1 && w3.norm() > 0.1 && w3.xy().norm() > 0.1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let sigma = move |x: &Vector5<Real>| degenerate(&b, x.as_slice(), ranks.0);
        let mu = move |x: &Vector5<Real>| degenerate(&c, x.as_slice(), ranks.1);
        keeps_the_laws(&with!(Euclidean::<5>, square::<5>, KulkarniNomizu(sigma, mu)), &x, &w, &a)?;
        let sigma = move |x: &Vector3<Real>| degenerate(&d, x.as_slice(), 2);
        let mu = move |x: &Vector3<Real>| degenerate(&e, x.as_slice(), 3);
        let sphere = Sphere::<2>::round();
        let product = KulkarniNomizu(sigma, mu);
        keeps_the_laws(&with!(sphere, square::<3>, product), &sphere.random(&mut rng), &w3.xy(), &a3.xy())?;
        keeps_the_laws(&with!(LieDual::so3(), square::<3>, product), &a3, &w3, &a3.zxy())?;
        let sigma = move |r: &Matrix3<Real>| degenerate(&d, r.as_slice(), 2);
        let mu = move |r: &Matrix3<Real>| degenerate(&e, r.as_slice(), 3);
        let product = KulkarniNomizu(sigma, mu);
        keeps_the_laws(&with!(Rotations, of_matrix, product), &Rotations.random(&mut rng), &w3, &a3)?;
    }

    /// The formula of Morrison and Updike with four slots, entry by entry.
    #[test]
    fn a_kulkarni_nomizu_product_is_its_four_bracket(
        b in matrices::<4>(), c in matrices::<4>(), w in columns::<4>(), a in columns::<4>(),
        beta in columns::<4>(),
    ) {
        let (s, m) = (b.transpose() * b, c.transpose() * c);
        let bracket = |f: &SVector<f64, 4>, k: &SVector<f64, 4>, g: &SVector<f64, 4>, n: &SVector<f64, 4>| {
            let form = |t: &Matrix4<f64>, p: &SVector<f64, 4>, q: &SVector<f64, 4>| p.dot(&(t * q));
            form(&s, f, g) * form(&m, k, n) - form(&s, f, n) * form(&m, k, g)
                + form(&m, f, g) * form(&s, k, n) - form(&m, f, n) * form(&s, k, g)
        };
        let product = KulkarniNomizu(
            move |_: &SVector<Real, 4>| s.cast::<Real>(),
            move |_: &SVector<Real, 4>| m.cast::<Real>(),
        );
        let x = ChartPoint::<Euclidean<4>>::centre(&w);
        let value = beta.dot(&product.apply(&MetricAt::new(&Canonical, &x), &w, &a).unwrap());
        let expected = bracket(&a, &w, &beta, &w);
        let scale = s.norm() * m.norm() * w.norm_squared() * a.norm() * beta.norm();
        prop_assert!((value - expected).abs() <= 1e-14 * scale);
    }

    #[test]
    fn casimir_dissipations_keep_the_laws(
        b in matrices::<3>(), c in matrices::<6>(), basis in matrices::<3>(), rank in 1..=6_usize,
        x in columns::<3>(), w in columns::<3>(), a in columns::<3>(),
        x6 in columns::<6>(), w6 in columns::<6>(), a6 in columns::<6>(),
    ) {
        prop_assume!(basis.determinant().abs() > 0.2 && w.norm() > 0.1 && w6.norm() > 0.1);
        let mixed = [0, 1, 2].map(|i| basis.column(i).into_owned().cross_matrix());
        let mine = LieDual::of(LieAlgebra::of_matrices(&mixed).unwrap());
        for space in [LieDual::so3(), LieDual::su2(2.0), LieDual::sl2(), LieDual::heisenberg(), mine] {
            let k = CasimirDissipation::new(space.algebra(), b.transpose() * b)?;
            laws::dissipation(&with!(space, square::<3>, k), &x, &w, &a)?;
        }
        let kept = Matrix6::from_fn(|i, j| if i < rank { c[(i, j)] } else { 0.0 });
        for space in [LieDual::se3(), LieDual::so4()] {
            let k = CasimirDissipation::new(space.algebra(), kept.transpose() * kept)?;
            laws::dissipation(&with!(space, square::<6>, k), &x6, &w6, &a6)?;
        }
    }

    #[test]
    fn on_so3_the_identity_has_the_dissipation_of_the_metric(w in columns::<3>(), a in columns::<3>()) {
        let k = CasimirDissipation::new(LieDual::so3().algebra(), Matrix3::identity())?;
        agree::<LieDual<3>, _>((&MetricDissipation, &k), &Canonical, &a, &w, &a)?;
    }

    /// `K dC = ad*_ξ F(ξ)` and `C' = κ([ξ, dC], [ξ, dC])`.
    #[test]
    fn the_force_of_a_form_is_its_dissipation(
        c in matrices::<6>(), xi in columns::<6>(), dc in columns::<6>(),
    ) {
        let (se3, kappa) = (LieDual::se3(), c.transpose() * c);
        let k = CasimirDissipation::new(se3.algebra(), kappa)?;
        let turned = se3.algebra().bracket(&xi, &dc);
        prop_assert!((k.force(&xi, &dc) - kappa * turned).norm() <= 1e-13 * kappa.norm() * (1.0 + turned.norm()));
        let x = ChartPoint::<LieDual<6>>::centre(&xi);
        let rate = dc.dot(&k.apply(&MetricAt::new(&Canonical, &x), &xi, &dc).unwrap());
        let expected = turned.dot(&(kappa * turned));
        prop_assert!((rate - expected).abs() <= 1e-13 * kappa.norm() * (xi.norm() * dc.norm()).powi(2));
    }

    #[test]
    fn closures_of_the_covector_to_be_annihilated_keep_the_laws(
        seed in any::<u64>(), x in columns::<3>(), w in columns::<3>(), a in columns::<3>(),
        x6 in columns::<6>(), w6 in columns::<6>(), a6 in columns::<6>(),
    ) {
        prop_assume!(w.z.abs() > 0.2 && w.xy().norm() > 0.1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let w = vector![w.x, w.y, w.z.abs()];
        laws::dissipation(&with!(Euclidean::<3>, square::<3>, oscillator()), &x, &w, &a)?;
        laws::dissipation(&with!(LieDual::so3(), square::<3>, oscillator()), &x, &w, &a)?;
        // Two baths that exchange energy: bbᵀ with b = (θ₂, −θ₁), θᵢ = wᵢ.
        let exchange = FieldDissipation(|x: &Vector6<Real>, w: &Vector6<Real>| {
            let mut b = Vector6::<Real>::zeros();
            (b[4], b[5]) = (w[5], -w[4]);
            b * b.transpose() * (x[0] * x[0] + 1.0)
        });
        prop_assume!(w6[4].hypot(w6[5]) > 0.1);
        laws::dissipation(&with!(Euclidean::<6>, square::<6>, exchange), &x6, &w6, &a6)?;
        let sphere = Sphere::<2>::round();
        let point = sphere.random(&mut rng);
        laws::dissipation(&with!(sphere, square::<3>, annihilates_on_vectors()), &point, &w.xy(), &a.xy())?;
        let point = Rotations.random(&mut rng);
        laws::dissipation(&with!(Rotations, of_matrix, annihilates_on_rotations()), &point, &w, &a)?;
        // A direction and a temperature: a spin that is warmed by its friction.
        let warm = Product(sphere, HalfLine);
        let friction = FieldDissipation(
            |(_, e): &(Vector3<Real>, nalgebra::Vector1<Real>), w: &nalgebra::Vector4<Real>| {
                (eye() * w.norm_squared() - w * w.transpose()) * e.x
            },
        );
        let energy = |(n, e): &(Vector3<Real>, nalgebra::Vector1<Real>)| n.z + e.x;
        laws::dissipation(&with!(warm, energy, friction), &warm.random(&mut rng), &w, &a)?;
    }

    /// Off the centre of the chart too, and with derivatives of the second order.
    #[test]
    fn a_closure_of_the_metric_dissipation_is_lifted_exactly(
        seed in any::<u64>(), q in columns::<3>(), w in columns::<3>(), a in columns::<3>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let nested = |v: &SVector<f64, 3>, k: f64| v.map(|v| {
            Dual::new(Dual64::new(v, v.sin() + k), Dual64::new(v.cos() - k, v * v + 0.3))
        });
        let base = Rotations.random(&mut rng);
        let x = ChartPoint::<Rotations, _> { base, q: nested(&(q * 0.3), 0.1) };
        let (w, a) = (nested(&w, 0.7), nested(&a, -0.4));
        let k = annihilates_on_rotations();
        let lifted = k.apply(&MetricAt::new(&Canonical, &x), &w, &a).unwrap();
        let defined = MetricDissipation.apply(&MetricAt::new(&Canonical, &x), &w, &a).unwrap();
        for i in 0..3 {
            let (l, d): (Dual<Dual64>, Dual<Dual64>) = (lifted[i], defined[i]);
            for (l, d) in [(l.re.re, d.re.re), (l.re.eps, d.re.eps), (l.eps.re, d.eps.re), (l.eps.eps, d.eps.eps)] {
                prop_assert!((l - d).abs() <= 1e-11, "{l} {d}");
            }
        }
    }

    #[test]
    fn a_projected_matrix_keeps_the_laws(
        seed in any::<u64>(), b in matrices::<5>(), c in matrices::<3>(), rank in 1..=5_usize,
        x in columns::<5>(), w in columns::<5>(), a in columns::<5>(),
        w3 in columns::<3>(), a3 in columns::<3>(),
    ) {
        prop_assume!(w.norm() > 0.3 && w3.xy().norm() > 0.3);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let projected = ProjectedDissipation(move |x: &Vector5<Real>| degenerate(&b, x.as_slice(), rank));
        let metric = Metric::field(|x: &Vector5<Real>| {
            Matrix5::from_diagonal_element(1.0.into()) + *x * x.transpose() * Real::from(0.3)
        });
        keeps_the_laws(&with!(Euclidean::<5>, square::<5>, projected), &x, &w, &a)?;
        let system = System::on(Euclidean::<5>)
            .metric(metric)
            .energy(square::<5>)
            .entropy(square::<5>)
            .dissipation(projected)
            .build()?;
        prop_assert!(is_projected(&system));
        keeps_the_laws(&system, &x, &w, &a)?;
        let projected = ProjectedDissipation(move |x: &Vector3<Real>| degenerate(&c, x.as_slice(), 2));
        let sphere = Sphere::<2>::round();
        keeps_the_laws(&with!(sphere, square::<3>, projected), &sphere.random(&mut rng), &w3.xy(), &a3.xy())?;
        keeps_the_laws(&with!(LieDual::so3(), square::<3>, projected), &a3, &w3, &a3.zxy())?;
        let projected = ProjectedDissipation(move |r: &Matrix3<Real>| degenerate(&c, r.as_slice(), 2));
        keeps_the_laws(&with!(Rotations, of_matrix, projected), &Rotations.random(&mut rng), &w3, &a3)?;
    }
}

/// `K = (γ/w_s) b bᵀ` with `b = (0, w_s, −w_p)` on `(q, p, s)`: the damped oscillator.
fn oscillator() -> FieldDissipation<impl Fn(&Vector3<Real>, &Vector3<Real>) -> Matrix3<Real> + Copy>
{
    FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(Real::from(0.0), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * 0.01)
    })
}

/// `|w|² − w wᵀ` in the space around a sphere.
fn annihilates_on_vectors()
-> FieldDissipation<impl Fn(&Vector3<Real>, &Vector3<Real>) -> Matrix3<Real> + Copy> {
    FieldDissipation(|x: &Vector3<Real>, w: &Vector3<Real>| {
        (eye() * w.norm_squared() - w * w.transpose()) * (x.x * x.y + 2.0)
    })
}

/// The dissipation of the bi-invariant metric, on body covectors.
fn annihilates_on_rotations()
-> FieldDissipation<impl Fn(&Matrix3<Real>, &Vector3<Real>) -> Matrix3<Real> + Copy> {
    FieldDissipation(|_: &Matrix3<Real>, w: &Vector3<Real>| {
        eye() * w.norm_squared() - w * w.transpose()
    })
}

const X: Vector3<f64> = Vector3::new(0.3, -0.7, 0.5);
const W: Vector3<f64> = Vector3::new(1.0, 0.4, -0.8);
const A: Vector3<f64> = Vector3::new(-0.2, 0.9, 0.6);

/// The first law that the dissipation breaks on R³.
fn broken(k: impl Dissipation<Euclidean<3>, Canonical>) -> Option<&'static str> {
    let system = with!(Euclidean::<3>, square::<3>, k);
    laws::dissipation(&system, &X, &W, &A).err().map(|broken| broken.law)
}

#[test]
fn each_part_of_a_dissipation_can_break_a_law() {
    let one = |_: &Vector3<Real>| eye();
    let skewed = |_: &Vector3<Real>| matrix![1.0, 0.3, 0.0; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0].cast();
    let negative = |_: &Vector3<Real>| -> Matrix3<Real> { eye() * Real::from(-1.0) };
    let (symmetric, positive) = (Some("K is symmetric"), Some("K is positive semidefinite"));

    assert_eq!(broken(Scaled(|_: &Vector3<Real>| Real::from(-0.1), MetricDissipation)), positive);
    assert_eq!(broken(CometricDissipation(one)), None);
    assert_eq!(broken(CometricDissipation(skewed)), symmetric);
    // A negative cometric is as good as a positive one, for K is quadratic in it; mixed signs are not.
    assert_eq!(broken(CometricDissipation(negative)), None);
    let mixed = |_: &Vector3<Real>| Matrix3::from_diagonal(&vector![1.0, 1.0, -1.0]).cast();
    assert_eq!(broken(CometricDissipation(mixed)), positive);
    assert_eq!(broken(KulkarniNomizu(one, skewed)), symmetric);
    assert_eq!(broken(KulkarniNomizu(skewed, one)), symmetric);
    assert_eq!(broken(KulkarniNomizu(negative, one)), positive);
    assert_eq!(broken(ProjectedDissipation(one)), None);
    assert_eq!(broken(ProjectedDissipation(skewed)), symmetric);
    assert_eq!(broken(ProjectedDissipation(negative)), positive);
    assert_eq!(
        broken(FieldDissipation(|x: &Vector3<Real>, _: &Vector3<Real>| one(x))),
        Some("K_w w = 0")
    );
    assert_eq!(
        broken(FieldDissipation(|x: &Vector3<Real>, _: &Vector3<Real>| skewed(x))),
        symmetric
    );
}

#[test]
fn a_run_accepts_a_closure_that_annihilates_the_covector_it_is_given_and_refuses_the_others() {
    let energy = |x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z * 0.7;
    let builder = || System::on(Euclidean::<3>).energy(energy).entropy(|x: &Vector3<Real>| x.z);
    builder().dissipation(oscillator()).build().unwrap().verify(&X, 0.1).unwrap();

    // K ignores w and does not annihilate dH.
    let deaf = FieldDissipation(|_: &Vector3<Real>, _: &Vector3<Real>| {
        Matrix3::from_diagonal(&vector![0.0, 1.0, 1.0]).cast::<Real>()
    });
    let error = builder().dissipation(deaf).build().unwrap().verify(&X, 0.1).unwrap_err();
    assert!(matches!(error, ModelError::EnergyNotKept { size, .. } if size > 0.1), "{error}");

    // K annihilates dH(x), and not the w of a step.
    let own = FieldDissipation(|x: &Vector3<Real>, _: &Vector3<Real>| {
        let b = Vector3::new(Real::from(0.0), Real::from(0.7), -x.y);
        b * b.transpose()
    });
    let error = builder().dissipation(own).build().unwrap().verify(&X, 0.1).unwrap_err();
    assert!(
        matches!(error, ModelError::CovectorNotAnnihilated { size, .. } if size > 1e-6),
        "{error}"
    );

    // The same matrix is accepted when it is projected, and the system knows.
    let projected = ProjectedDissipation(|x: &Vector3<Real>| {
        let b = Vector3::new(Real::from(0.0), Real::from(0.7), -x.y);
        b * b.transpose()
    });
    let system = builder().dissipation(projected).build().unwrap();
    system.verify(&X, 0.1).unwrap();
    assert!(is_projected(&system));
    assert!(!Dissipation::<Euclidean<3>, Canonical>::is_projected(&oscillator()));
    let scaled = Scaled(|_: &Vector3<Real>| Real::from(2.0), projected);
    assert!(Dissipation::<Euclidean<3>, Canonical>::is_projected(&scaled));
}

#[test]
fn a_dissipation_that_is_not_a_number_is_named() {
    let energy = |x: &Vector3<Real>| x.norm_squared() * 0.5;
    let builder = || System::on(Euclidean::<3>).energy(energy).entropy(energy);
    let root = MetricDissipation::scaled(|x: &Vector3<Real>| (x.x - 1.0).sqrt());
    let system = builder().dissipation(root).build().unwrap();
    let error = system.verify(&X, 0.1).unwrap_err();
    assert!(matches!(error, ModelError::ValueNotFinite { field: "dissipation", .. }), "{error}");
    // A norm at zero: the value is finite, the derivative is not.
    let norm = MetricDissipation::scaled(|x: &Vector3<Real>| (x.x * x.x).sqrt() + 1.0);
    let system = builder().dissipation(norm).build().unwrap();
    let error = system.verify(&vector![0.0, 1.0, 1.0], 0.1).unwrap_err();
    assert!(
        matches!(error, ModelError::DerivativeNotFinite { field: "dissipation", .. }),
        "{error}"
    );
}

#[test]
fn a_given_dissipation_stays_whatever_is_said_of_the_entropy() {
    fn kind<Y: Metriplectic<Dissipation: std::fmt::Debug>>(system: &Y) -> String {
        format!("{:?}", system.dissipation())
    }
    let builder = || System::on(LieDual::so3()).energy(square::<3>);
    assert_eq!(kind(&builder().build().unwrap()), format!("{NoDissipation:?}"));
    let metric = format!("{MetricDissipation:?}");
    assert_eq!(kind(&builder().entropy(square::<3>).build().unwrap()), metric);
    assert_eq!(kind(&builder().entropy(square::<3>).entropy(square::<3>).build().unwrap()), metric);
    let k = || CasimirDissipation::new(LieDual::so3().algebra(), Matrix3::identity()).unwrap();
    let given = format!("{:?}", k());
    assert_eq!(kind(&builder().dissipation(k()).entropy(square::<3>).build().unwrap()), given);
    assert_eq!(kind(&builder().entropy(square::<3>).dissipation(k()).build().unwrap()), given);
    let last =
        builder().dissipation(k()).entropy(square::<3>).dissipation(MetricDissipation).build();
    assert_eq!(kind(&last.unwrap()), metric);

    // A dissipation without an entropy has nothing to produce.
    let error = builder().dissipation(k()).build().err();
    assert_eq!(error, Some(BuildError::SecondLawWithoutEntropy));
    assert_eq!(size_of_val(&MetricDissipation), 0);
}
