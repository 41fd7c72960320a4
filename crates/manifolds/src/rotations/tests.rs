use super::*;
use crate::laws;
use crate::{Canonical, Exponential, WeylMidpoint};
use nalgebra::vector;
use proptest::prelude::*;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

proptest! {
    #[test]
    fn rotations_keep_the_laws(seed in any::<u64>(), u in prop::array::uniform3(-1.0..1.0)) {
        let x = Rotations.random(&mut ChaCha8Rng::seed_from_u64(seed));
        // Up to 3.1 radians.
        let u = Vector3::from(u) * (3.1 / 3.0_f64.sqrt());
        laws::manifold(&Rotations, &x, &u)?;
        laws::metric::<Rotations, _>(&Canonical, &x, &u)?;
        laws::retraction::<Rotations, _, _>(&WeylMidpoint, &Canonical, &x, &u)?;
        laws::retraction::<Rotations, _, _>(&Exponential, &Canonical, &x, &u)?;
        let y = Rotations::chart(&x, &u);
        laws::symmetric_retraction::<Rotations, _, _>(&WeylMidpoint, &Canonical, &x, &y)?;
    }

    #[test]
    fn dexp_is_the_derivative_of_exp(q in prop::array::uniform3(-2.0..2.0)) {
        let q = Vector3::from(q);
        for k in 0..3 {
            let seeded = Vector3::from_fn(|i, _| {
                Real::new(q[i], if i == k { 1.0 } else { 0.0 }, 0.0, 0.0)
            });
            let moved = exp(&seeded);
            let slope = vee(&exp(&q).tr_mul(&moved.map(|entry| entry.eps1)));
            prop_assert!((slope - dexp(&q).column(k)).norm() < 1e-14);
        }
        prop_assert!((dexp(&q) * dexp_inverse(&q) - Matrix3::identity()).amax() < 1e-13);
    }
}

#[test]
fn first_and_second_derivatives_are_right_at_the_identity() {
    let seeded = vector![
        Real::new(0.0, 1.0, 0.0, 0.0),
        Real::new(0.0, 0.0, 1.0, 0.0),
        Real::new(0.0, 0.0, 0.0, 0.0)
    ];
    let r = exp(&seeded);
    // exp(q̂) = 1 + q̂ + ½q̂²: first derivatives are the generators, the mixed second one is
    // ½(ê₁ê₂ + ê₂ê₁).
    let [e1, e2] = [Vector3::x(), Vector3::y()].map(|e: Vector3<f64>| hat(&e));
    assert_eq!(r.map(|entry| entry.eps1), e1);
    assert_eq!(r.map(|entry| entry.eps2), e2);
    assert_eq!(r.map(|entry| entry.eps1eps2), (e1 * e2 + e2 * e1) * 0.5);
    let back = log(&r);
    assert_eq!(back.map(|entry| entry.eps1), Vector3::x());
    assert_eq!(back.map(|entry| entry.eps2), Vector3::y());
    assert!(back.map(|entry| entry.eps1eps2).norm() < 1e-16);
}

/// `q = ε₁ e_i + ε₂ e_j`.
fn seed(i: usize, j: usize) -> Vector3<Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    Vector3::from_fn(|k, _| Real::new(0.0, part(k, i), part(k, j), 0.0))
}

#[test]
fn all_second_derivatives_are_right_at_the_identity() {
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let q = seed(i, j);
        let [a, b] = [i, j].map(|k| hat(&Vector3::<f64>::ith(k, 1.0)));
        let square = a * b + b * a;
        // exp(q̂) = 1 + q̂ + ½q̂², dexp(q) = 1 − ½q̂ + q̂²/6, dexp⁻¹(q) = 1 + ½q̂ + q̂²/12, each + O(q³).
        for (name, value, first, second) in [
            ("exp", exp(&q), 1.0, 0.5),
            ("dexp", dexp(&q), -0.5, 1.0 / 6.0),
            ("dexp⁻¹", dexp_inverse(&q), 0.5, 1.0 / 12.0),
        ] {
            assert_eq!(value.map(|entry| entry.re), Matrix3::identity(), "{name}");
            assert_eq!(value.map(|entry| entry.eps1), a * first, "{name}");
            assert_eq!(value.map(|entry| entry.eps2), b * first, "{name}");
            let off = value.map(|entry| entry.eps1eps2) - square * second;
            assert!(off.amax() < 1e-16, "{name}, {i} and {j}: {off}");
        }
        // log((1 + ε₁â)(1 + ε₂b̂)) = ε₁a + ε₂b + ½ε₁ε₂ a × b (Baker, Campbell and Hausdorff).
        let product = exp(&seed(i, 3)) * exp(&seed(3, j));
        let sum = log(&product);
        assert_eq!(sum.map(|entry| entry.eps1), Vector3::ith(i, 1.0));
        assert_eq!(sum.map(|entry| entry.eps2), Vector3::ith(j, 1.0));
        let bracket = Vector3::<f64>::ith(i, 1.0).cross(&Vector3::ith(j, 1.0)) * 0.5;
        assert!((sum.map(|entry| entry.eps1eps2) - bracket).amax() < 1e-16, "{i} and {j}");
        assert!(log(&exp(&q)).map(|entry| entry.eps1eps2).amax() < 1e-16, "{i} and {j}");
    }
}

#[test]
fn a_reflection_is_not_a_rotation() {
    let mirror = Matrix3::from_diagonal(&vector![1.0, 1.0, -1.0]);
    assert!(Rotations.check(&mirror).is_err());
    assert!(Rotations.check(&Rotations.project(&mirror)).is_ok());
}

#[test]
fn quaternions_without_a_direction_are_refused() {
    assert_eq!(Rotations.from_quaternion([0.0; 4]), Err(PointError::NoDirection));
    for bad in [f64::NAN, f64::INFINITY] {
        let error = Rotations.from_quaternion([1.0, bad, 0.0, 0.0]).unwrap_err();
        assert!(matches!(error, PointError::NotFinite { index: 1, .. }), "{error}");
    }
    let half = Rotations.from_quaternion([0.0, 0.0, 1.0, 1.0]).unwrap();
    for size in [1e-320, 1e-200, 1e200, 1e308] {
        let r = Rotations.from_quaternion([0.0, 0.0, size, size]).unwrap();
        assert!((r - half).amax() < 1e-15, "{size}: {r}");
    }
}

#[test]
fn what_is_not_finite_is_off_the_group_and_stays_so() {
    for bad in [f64::NAN, f64::INFINITY] {
        for (i, j) in [(0, 0), (2, 1)] {
            let mut r = Matrix3::identity();
            r[(i, j)] = bad;
            assert!(!Rotations.defect(&r).is_finite(), "{r}");
            assert!(Rotations.check(&Rotations.project(&r)).is_err());
        }
    }
    // Any rotation is nearest to zero; and no size is too large or too small.
    for scale in [0.0, 5e-324, 1e-200, 1e200, f64::MAX] {
        let projected = Rotations.project(&(Matrix3::identity() * scale));
        assert!((projected - Matrix3::identity()).amax() < 1e-15, "{scale}: {projected}");
    }
}

proptest! {
    #[test]
    fn quaternions_go_in_and_out(
        mut q in prop::array::uniform4(-0.9..0.9), largest in 0..4_usize, scale in 1e-3..1e3_f64,
    ) {
        // Some roundings of an entry, and as many of each of the three that a product sums.
        let bound = 16.0 * f64::EPSILON;
        // Each component has its turn as the pivot, with either sign.
        q[largest] = 1_f64.copysign(q[largest]);
        let q: Vector4<f64> = Vector4::from(q).normalize();
        let r = Rotations.from_quaternion((q * scale).into()).unwrap();
        prop_assert!(Rotations.defect(&r) < bound);
        prop_assert!((r - Rotations.from_quaternion((-q).into()).unwrap()).amax() < bound);
        let v = vector![q[1], q[2], q[3]];
        let turned = v * (2.0 * v.dot(&Vector3::x()))
            + Vector3::x() * (q[0] * q[0] - v.norm_squared())
            + v.cross(&Vector3::x()) * (2.0 * q[0]);
        prop_assert!((r.column(0) - turned).norm() < bound);
        let back = Vector4::from(Rotations.to_quaternion(&r));
        prop_assert!(back[0] >= 0.0);
        let off = |sign: f64| (back - q * sign).norm();
        // A turn by π has two quaternions.
        let off = if q[0].abs() < bound { off(1.0).min(off(-1.0)) } else { off(q[0].signum()) };
        prop_assert!(off < bound);
    }
}
